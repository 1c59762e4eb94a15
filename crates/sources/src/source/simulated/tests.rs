//! Touches of robots whose links lie near each other, and messages about what is not there.

use std::path::Path;

use glam::{DAffine3, DVec3};

use super::SimulatedSource;
use crate::body::{Body, Home, Link, Modality, Surface, Taxel};
use crate::signal::Frame;
use crate::source::Source as _;

/// Rectangles that face +z at rest, each of a link: its name, the corners (x, y, z) with the least and the greatest x and y, m. Taxels 4 mm
/// apart, ids from 0, link by link.
fn plates(of: &[(&str, [f64; 3], [f64; 2])]) -> Body {
    let (mut links, mut surfaces, mut taxels): (Vec<Link>, Vec<Surface>, Vec<Taxel>) = Default::default();
    for (number, &(name, [x, y, z], [right, top])) in of.iter().enumerate() {
        let link = links.iter().position(|link: &Link| link.name == name).unwrap_or_else(|| {
            links.push(Link {
                name: name.to_owned(),
                parent: None,
                body_from_link: DAffine3::IDENTITY,
                link_from_node: DAffine3::IDENTITY,
                joint: None,
                urdf_up: None,
            });
            links.len() - 1
        });
        surfaces.push(Surface {
            name: format!("plate {number}"),
            positions: [(x, y), (right, y), (right, top), (x, top)].map(|(x, y)| DVec3::new(x, y, z)).to_vec(),
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            home: Home::Rigid { link, link_from_mesh: DAffine3::IDENTITY },
        });
        let [columns, rows] = [right - x, top - y].map(|side| (side / 4e-3).round() as u32);
        for (column, row) in (0..columns).flat_map(|column| (0..rows).map(move |row| (column, row))) {
            taxels.push(Taxel {
                id: taxels.len() as u32,
                link,
                position_in_link: DVec3::new(
                    x + 4e-3 * (f64::from(column) + 0.5),
                    y + 4e-3 * (f64::from(row) + 0.5),
                    z,
                ),
                normal_in_link: DVec3::Z,
                area: 1.6e-5,
                modality: Modality::Force3,
                tangent_in_link: None,
            });
        }
    }
    Body {
        name: "made".to_owned(),
        links,
        surfaces,
        taxels,
        fields: Vec::new(),
        findings: Vec::new(),
        edges: None,
        kept: Default::default(),
    }
}

fn simulation(body: Body, touch: &str) -> crate::error::Result<SimulatedSource> {
    let text = format!(
        "rate_hz = 10\nduration_s = 1\n[layer]\nthickness_m = 0.004\n[[touch]]\nindenter = \"ball\"\nhold = {{ newton = 8 }}\n{touch}"
    );
    SimulatedSource::on_body("made", &text, body)
}

/// Palm and thumb, side by side.
fn hand() -> Body {
    plates(&[("palm", [-0.04, -0.02, 0.0], [0.0, 0.02]), ("thumb", [0.0, -0.02, 0.0], [0.04, 0.02])])
}

fn next(simulation: &mut SimulatedSource) -> Vec<f64> {
    let mut frame = Frame::missing(0.0, simulation.taxels().len());
    assert!(simulation.next_frame(&mut frame).unwrap());
    frame.values.iter().map(|value| value.number().unwrap()).collect()
}

#[test]
fn a_touch_on_a_link_presses_that_link_alone() {
    let of_link = |simulation: &SimulatedSource, link: usize| -> f64 {
        let taxels = simulation.body().taxels.iter().zip(simulation.forces_newton());
        taxels.filter(|(taxel, _)| taxel.link == link).map(|(_, force)| force).sum()
    };
    let at = |x: f64| format!("on = \"palm\"\nradius_m = 0.01\npath = [[{x}, 0, 0]]\n");
    let mut touched = simulation(hand(), &at(-0.004)).unwrap();
    next(&mut touched);
    assert!(of_link(&touched, 0) > 4.0 && of_link(&touched, 1) == 0.0, "{}", of_link(&touched, 1));
    // Its surface is that of the link, too.
    let why = simulation(hand(), &at(0.03)).err().unwrap().to_string();
    assert!(why.contains("`path` leaves the surface at 0.000 s"), "{why}");
}

#[test]
fn nothing_reads_a_footprints_tail() {
    let touch =
        "on = \"palm\"\nradius_m = 0.005\nfriction = 0.5\npath = [[-0.03, 0, 0], [-0.025, 0, 0]]\ntimes_s = [0, 1]\n";
    let mut simulation = simulation(hand(), touch).unwrap();
    let tail = |forces: &[f64]| forces.iter().any(|force| *force != 0.0 && force.abs() < 1e-18);
    next(&mut simulation);
    let values = next(&mut simulation);
    assert!(tail(simulation.forces_newton()), "there is nothing to cut");
    assert!(!tail(&values) && values.iter().any(|value| *value < 0.0 || *value > 0.1));
}

#[test]
fn an_indenter_that_does_not_reach_its_place_is_reported_once() {
    // A slit of 8 mm between two parts of the palm, 8 mm over a finger.
    let body = || {
        plates(&[
            ("palm", [-0.044, -0.02, 0.0], [-0.004, 0.02]),
            ("finger", [-0.02, -0.02, -0.008], [0.02, 0.02]),
            ("palm", [0.004, -0.02, 0.0], [0.044, 0.02]),
        ])
    };
    let with = |radius: f64| {
        let place = "path = [{ link = \"finger\", at = [0, 0, -0.008] }]";
        simulation(body(), &format!("on = \"body\"\nname = \"poke\"\nradius_m = {radius}\n{place}\n")).unwrap()
    };
    let mut wide = with(0.01);
    assert_eq!(wide.notices(), Vec::<String>::new());
    next(&mut wide);
    next(&mut wide);
    let [notice] = &wide.notices()[..] else { panic!("not one notice") };
    let start = "made: touch `poke` does not reach its place on `finger` at 0.000 s: it stays at least 4.";
    let end = " mm above, as `palm` is in the way; take a smaller indenter, or another `path`";
    assert!(notice.starts_with(start) && notice.ends_with(end), "{notice}");
    assert_eq!(wide.truth()[0].link, "palm");
    wide.seek(0);
    next(&mut wide);
    assert_eq!(wide.notices(), Vec::<String>::new());
    let mut slim = with(0.003);
    next(&mut slim);
    assert_eq!((slim.notices(), slim.truth()[0].link.as_str()), (Vec::new(), "finger"));
}

#[test]
fn what_is_not_there_is_named_with_what_is_near() {
    let why = |text: &str| SimulatedSource::from_text("a.toml", text, Path::new("/no")).err().unwrap().to_string();
    let head = "rate_hz = 1\nduration_s = 1\n";
    let missing = why(&format!("{head}body = \"nope.glb\"\n"));
    assert!(
        missing.starts_with("a.toml: line 3, column 8: /no/nope.glb: no such file; `body` is a path from"),
        "{missing}"
    );
    assert!(why(&format!("{head}body = \"hnad\"\n")).contains("did you mean `hand`?"));
    let mut body = hand();
    body.links[0].name = "palm_link".to_owned();
    let unknown = simulation(body, "on = \"palm\"\nradius_m = 0.01\npath = [[0, 0, 0]]\n").err().unwrap().to_string();
    assert!(unknown.contains("there is no link `palm`; did you mean `palm_link`?"), "{unknown}");
}
