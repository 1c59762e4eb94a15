//! Simulated touches of whole bodies: across links, all of the force, the same however they are read, one line for what is wrong.

use std::collections::BTreeSet;
use std::path::Path;

use somatic::author::{Authored, Recipe, author, mesh};
use somatic::source::{SimulatedSource, Source as _};
use somatic::{
    BackendKind, Body, Calibration, Engine, Frame, Options, Outputs, Result, Scene, TouchFlags, bundled, touch,
};

/// A rod over an elbow, a strap and a pair.
fn elbow() -> SimulatedSource {
    SimulatedSource::open(concat!(env!("CARGO_MANIFEST_DIR"), "/examples/simulations/elbow.toml")).unwrap()
}

fn read(simulation: &mut SimulatedSource, number: u64) -> Frame {
    simulation.seek(number);
    let mut frame = Frame::missing(0.0, simulation.taxels().len());
    assert!(simulation.next_frame(&mut frame).unwrap());
    frame
}

#[test]
fn a_rod_over_an_elbow_presses_both_links_with_all_of_its_force() {
    let mut simulation = elbow();
    let (mut links, mut turned_deg) = (BTreeSet::new(), 0.0_f64);
    let mut before = None;
    // The rod presses at 20 Hz from 0.2 to 2.2 s.
    for number in (12..36).step_by(4) {
        read(&mut simulation, number);
        let [truth] = simulation.truth() else { panic!("one touch presses") };
        let felt: f64 = simulation.forces_newton().iter().sum();
        assert!((felt / truth.force_newton - 1.0).abs() < 0.01, "frame {number}: {felt} of {} N", truth.force_newton);
        assert!((truth.normal_in_link.length() - 1.0).abs() < 1e-9 && truth.uv.is_none() && truth.field.is_none());
        let speed = truth.speed.unwrap();
        assert!((0.01..0.2).contains(&speed), "frame {number}: {speed} m/s");
        let (axis, direction) = (truth.principal_axis_in_link.unwrap(), truth.direction_in_link.unwrap());
        turned_deg = turned_deg.max(axis.cross(direction).length().asin().to_degrees());
        let depth = truth.depth_m.unwrap();
        assert!((1e-4..0.012).contains(&depth), "frame {number}: {depth} m");
        links.insert(truth.link.clone());
        assert!(before.replace(truth.position_in_link) != Some(truth.position_in_link));
    }
    assert_eq!(links.into_iter().collect::<Vec<_>>(), ["left_forearm", "left_upper_arm"]);
    // A limb is no cylinder: its footprint lies otherwise than the rod.
    assert!((0.5..30.0).contains(&turned_deg), "{turned_deg}°");
    read(&mut simulation, 100);
    let names: Vec<&str> = simulation.truth().iter().map(|truth| truth.name.as_str()).collect();
    assert_eq!(names, ["fingers (first)", "fingers (second)"]);
    let [one, other] = simulation.truth() else { panic!("two fingers press") };
    let apart = one.position_in_link.distance(other.position_in_link);
    assert!((0.025..0.031).contains(&apart) && one.force_newton == other.force_newton, "{apart}");
}

#[test]
fn frames_of_whole_bodies_are_the_same_in_any_order() {
    let (mut ahead, mut back) = (elbow(), elbow());
    let numbers = [20_u64, 21, 22];
    let forwards: Vec<(Frame, _)> =
        numbers.iter().map(|&number| (read(&mut ahead, number), ahead.truth().to_vec())).collect();
    for (&number, (frame, truth)) in numbers.iter().zip(&forwards).rev() {
        assert_eq!(&read(&mut back, number), frame, "frame {number}");
        assert_eq!(back.truth(), truth, "frame {number}");
    }
}

#[test]
fn a_taxel_feels_its_cell_or_its_area() {
    let touch = |sensor: &str| {
        let text = format!(
            "body = \"hand\"\nrate_hz = 1\nduration_s = 1\n[layer]\nthickness_m = 0.002\n[sensor]\n{sensor}\n[[touch]]\n\
             on = \"body\"\nindenter = \"ball\"\nradius_m = 0.004\npath = [{{ taxel = 4 }}]\nhold = {{ newton = 1 }}\n"
        );
        let mut simulation = SimulatedSource::from_text("a.toml", &text, Path::new("")).unwrap();
        read(&mut simulation, 0);
        simulation.forces_newton().to_vec()
    };
    let cells: f64 = touch("").iter().sum();
    assert!((0.5..1.0 + 1e-9).contains(&cells), "{cells} N");
    // A small sensor feels its area's share of the pressure above it.
    let [small, smaller] = ["area_m2 = 2e-7", "area_m2 = 1e-7"].map(|area| touch(area)[4]);
    assert!((small / smaller / 2.0 - 1.0).abs() < 0.01, "{small} {smaller}");
    assert_eq!(touch("covers = \"area\"\narea_m2 = 1e-7")[4], smaller);
    assert_eq!(touch("covers = \"cell\"").iter().sum::<f64>(), cells);
}

/// Per frame of `numbers` the touches' summed force, N, and the truth's; each has a mean pressure and no doubt about units.
fn forces(simulation: &mut SimulatedSource, numbers: impl Iterator<Item = u64>) -> Vec<(f64, f64)> {
    let calibration = Calibration::parse(&simulation.calibration(), simulation.taxels()).unwrap();
    let scene = Scene::default().outputs(Outputs::TOTAL).touches(touch::Options::default());
    let options = Options::default().scene(scene).calibration(calibration).backend(BackendKind::Cpu);
    let mut engine = Engine::new(simulation.body(), options).unwrap();
    engine.set_channels(simulation.taxels()).unwrap();
    assert!(engine.remarks().is_empty(), "{:?}", engine.remarks());
    let compared = numbers.map(|number| {
        let frame = read(simulation, number);
        let truth: f64 = simulation.truth().iter().map(|truth| truth.force_newton).sum();
        let touches = &engine.process_one(&frame).unwrap().touches(0).unwrap().touches;
        assert!(!touches.is_empty());
        let force = touches.iter().map(|touch| {
            assert!(!touch.flags.contains(TouchFlags::NO_UNIT), "{touch:?}");
            let force = touch.force_newton.unwrap();
            assert!((touch.mean_pressure_pascal.unwrap() * touch.area_m2.unwrap() / force - 1.0).abs() < 1e-9);
            force
        });
        (force.sum(), truth)
    });
    compared.collect()
}

#[test]
fn touches_of_a_simulation_have_its_force() {
    let near = |pairs: Vec<(f64, f64)>, share: f64| {
        for (felt, truth) in pairs {
            assert!((felt / truth - 1.0).abs() < share && truth > 1.0, "{felt} of {truth} N");
        }
    };
    // A rod on the whole body, over an elbow, by sensors that cover their cells.
    let mut simulation = elbow();
    assert!(
        simulation.calibration().contains("[all]\nsensors = \"cell\"\nunit = \"N\"\n"),
        "{}",
        simulation.calibration()
    );
    near(forces(&mut simulation, (12..36).step_by(4)), 0.01);
    // The same by a converter: rounding and noise of some 40 taxels, and what their dead bands cut off at the rim.
    let text =
        std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/examples/simulations/elbow.toml")).unwrap();
    let counts = "[sensor]\nkind = \"linear\"\noffset = 30.5\ngain = 2000\nbits = 16\nnoise_sigma = 2\n\n";
    let first = text.find("[[touch]]").unwrap();
    let text = format!("{}{counts}{}", &text[..first], &text[first..]);
    let mut counted = SimulatedSource::from_text("elbow.toml", &text, Path::new("")).unwrap();
    near(forces(&mut counted, (12..36).step_by(4)), 0.02);
    // A ball on one link of sensors of one size without gaps: the mat's.
    let mat = Body::from_bytes("mat", bundled::MAT).unwrap();
    let side_m = mat.taxels[0].position_in_link.distance(mat.taxels[1].position_in_link);
    let text = format!(
        "rate_hz = 10\nduration_s = 1\n[layer]\nthickness_m = {side_m}\n[sensor]\nkind = \"linear\"\ngain = 100\nbits = 20\n\
         noise_sigma = 1\noffset = 200.5\narea_m2 = {}\n[[touch]]\non = \"mat\"\nindenter = \"ball\"\nradius_m = {side_m}\n\
         path = [[0, 0]]\nhold = {{ newton = 200 }}\n",
        side_m * side_m
    );
    let mut simulation = SimulatedSource::on_body("mat", &text, mat).unwrap();
    assert!(simulation.calibration().contains("sensors = \"equal\"\nunit = \"N\"\n"), "{}", simulation.calibration());
    near(forces(&mut simulation, 0..5), 0.02);
    // The paper's signals are no newtons.
    let rod = SimulatedSource::open(concat!(env!("CARGO_MANIFEST_DIR"), "/examples/simulations/rod.toml")).unwrap();
    assert!(rod.calibration().contains("sensors = \"equal\"") && !rod.calibration().contains("unit"));
}

/// A finger with a tip that is fixed to it and a thumb that turns, boxes of 60 mm with gaps of 1 mm between them, and taxels by a recipe.
fn fingers(recipe: &str) -> Result<Authored> {
    let cuboid = "<visual><geometry><box size=\"0.06 0.02 0.02\"/></geometry></visual>";
    let link = |name: &str| format!("<link name=\"{name}\">{cuboid}</link>\n");
    let joint = |kind: &str, child: &str, x: f64| {
        format!(
            "<joint name=\"{child}\" type=\"{kind}\"><parent link=\"finger\"/><child link=\"{child}\"/>\
             <origin xyz=\"{x} 0 0\"/><axis xyz=\"0 1 0\"/></joint>\n"
        )
    };
    let links: String = ["finger", "tip", "thumb"].map(link).concat();
    let text = format!(
        "<robot name=\"r\">{links}{}{}</robot>",
        joint("fixed", "tip", 0.061),
        joint("continuous", "thumb", -0.061)
    );
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("r.urdf");
    std::fs::write(&path, text).unwrap();
    let file = mesh::open(&path, &mesh::MeshOptions::default()).unwrap();
    author(file, &Recipe::parse("recipe.toml", recipe, Path::new(""))?, |_| {})
}

const PLACES: &str = "[[place]]\ntaxels = 600\n";

#[test]
fn a_press_over_a_joint_is_one_touch_where_that_is_fixed_or_joined() {
    let touches = |body: &Body, x: f64| {
        let text = format!(
            "rate_hz = 10\nduration_s = 1\n[layer]\nthickness_m = 0.005\n[[touch]]\non = \"body\"\nindenter = \"ball\"\n\
             radius_m = 0.02\npath = [{{ link = \"finger\", at = [{x}, 0, 0.01] }}]\nhold = {{ newton = 5 }}\n"
        );
        let mut simulation = SimulatedSource::on_body("fingers", &text, body.clone()).unwrap();
        let calibration = Calibration::parse(&simulation.calibration(), simulation.taxels()).unwrap();
        let scene = Scene::default().outputs(Outputs::TOTAL).touches(touch::Options::default());
        let options = Options::default().scene(scene).calibration(calibration).backend(BackendKind::Cpu);
        let mut engine = Engine::new(simulation.body(), options).unwrap();
        engine.set_channels(simulation.taxels()).unwrap();
        let frame = read(&mut simulation, 2);
        let touches = &engine.process_one(&frame).unwrap().touches(0).unwrap().touches;
        touches.iter().map(|touch| (touch.force_newton.unwrap(), touch.flags)).collect::<Vec<_>>()
    };
    let is_one = |body: &Body, x: f64| match touches(body, x)[..] {
        [(force_newton, flags)] => {
            assert!((force_newton / 5.0 - 1.0).abs() < 0.02, "{force_newton} N");
            assert!(flags.contains(TouchFlags::SEVERAL_LINKS), "{flags:?}");
            true
        }
        [(one, _), (two, _)] => {
            assert!(((one + two) / 5.0 - 1.0).abs() < 0.02 && one.min(two) > 1.0, "{one} N and {two} N");
            false
        }
        _ => panic!("{:?}", touches(body, x)),
    };
    let (tip, thumb) = (0.0295, -0.0295);
    let Authored { file, body, .. } = fingers(PLACES).unwrap();
    assert!(is_one(&body, tip) && !is_one(&body, thumb), "the thumb may move");
    // What a recipe joins stays so, whatever is authored after it.
    let join = "[[join]]\nlinks = [\"thumb\", \"fing*\"]\n";
    let joined = author(file, &Recipe::parse("recipe.toml", join, Path::new("")).unwrap(), |_| {}).unwrap();
    assert!(joined.notes.is_empty(), "{:?}", joined.notes);
    let again = author(joined.file, &Recipe::none(), |_| {}).unwrap();
    assert_eq!(again.body.edges, joined.body.edges);
    let at_once = fingers(&[PLACES, join].concat()).unwrap().body;
    assert_eq!(at_once.edges, joined.body.edges);
    assert!(is_one(&again.body, tip) && is_one(&again.body, thumb));
    for (links, told) in [
        ("\"toe\"", "recipe.toml: line 4, column 9: the body has no link `toe`; `somatic inspect` lists its links"),
        ("[\"t*b\"]", "`t*b` is one link, `thumb`; name those that it is joined with, too"),
    ] {
        let error = fingers(&format!("{PLACES}[[join]]\nlinks = {links}\n")).unwrap_err().to_string();
        assert!(error.contains(told), "{error}");
    }
}

#[test]
fn what_is_wrong_with_a_touch_of_the_body_is_reported_in_one_line() {
    const SOUND: &str = "body = \"hand\"\nrate_hz = 1\nduration_s = 1\n[layer]\nthickness_m = 0.002\n[[touch]]\non = \"body\"\n\
                         indenter = \"rod\"\nradius_m = 0.004\nlength_m = 0.02\npath = [{ taxel = 4 }]\nhold = { newton = 1 }\n";
    let open = |text: &str| SimulatedSource::from_text("a.toml", text, Path::new(""));
    assert!(open(SOUND).is_ok());
    for (from, to, expected) in [
        (
            "0.002",
            "0",
            "line 7, column 6: `on` is body, which needs a layer that gives way; give [layer] its `thickness_m`",
        ),
        ("\"rod\"", "\"flat\"", "line 8, column 12: on = \"body\" takes ball, ellipsoid, rod, strap and pair"),
        ("\"rod\"", "\"strap\"", "`radius_m` has no effect for this indenter"),
        ("\"rod\"\nradius_m = 0.004", "\"strap\"", "this indenter needs its `width_m`"),
        ("\"rod\"\nradius_m = 0.004\nlength_m = 0.02", "\"ellipsoid\"", "this indenter needs its `radii_m`"),
        (
            "\"rod\"\nradius_m = 0.004\nlength_m = 0.02",
            "\"ellipsoid\"\nradii_m = [1, 0, 1]",
            "`radii_m` is three lengths over 0",
        ),
        ("radius_m = 0.004", "radius_m = 4", "`radius_m` is 4; on = \"body\" takes up to 1 m"),
        ("{ taxel = 4 }", "{ taxel = 999 }", "line 11, column 9: the body has no taxel 999"),
        ("{ taxel = 4 }", "{ taxel = 4, u = 1 }", "`path` has places [u, v], [x, y, z], { taxel = ID }"),
        ("{ taxel = 4 }", "{ link = \"thum\", at = [0, 0, 0] }", "there is no link `thum`; did you mean `thumb`?"),
        (
            "{ taxel = 4 }",
            "{ link = \"thumb\", at = [0, 1, 0] }",
            "`path` has a place over 20 mm from the body's surface",
        ),
        ("{ taxel = 4 }", "{ link = \"thumb\", at = [0, nan, 0] }", "`path` has the coordinate NaN"),
        ("{ taxel = 4 }", "{ taxel = 4 }, [0, 0, 0]", "on = \"body\" needs a `path` of { taxel = ID }"),
        ("{ taxel = 4 }", "[0, 0, 0]", "on = \"body\" takes a `path` of { taxel = ID }"),
        (
            "\"body\"\nindenter",
            "\"thumb\"\nindenter",
            "`path` has a place of the whole body, which needs `on = \"body\"`",
        ),
        ("[[touch]]", "[sensor]\narea_m2 = 1e-5\ncovers = \"cell\"\n[[touch]]", "with `area_m2` it must be area"),
    ] {
        assert!(SOUND.contains(from), "{from}");
        let line =
            open(&SOUND.replacen(from, to, 1)).err().unwrap_or_else(|| panic!("`{to}` should be refused")).to_string();
        assert!(line.contains(expected) && !line.contains('\n'), "`{to}`:\n  {line}\nhas no\n  {expected}");
    }
    // Where one link is touched, nothing of the body is taken.
    let strap =
        SOUND.replace("\"body\"", "\"thumb\"").replace("{ taxel = 4 }", "[0, 0, 0]").replace("\"rod\"", "\"strap\"");
    let line = open(&strap.replace("radius_m = 0.004", "width_m = 0.004")).err().unwrap().to_string();
    assert!(line.contains("`width_m` has no effect") || line.contains("presses whole bodies"), "{line}");
}
