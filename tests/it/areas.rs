//! The areas of taxels whose places are given: the surface nearer to each than to any other, half a pitch beyond the last.

use std::f64::consts::TAU;
use std::fmt::Write as _;

use glam::{DVec3, Vec3};
use somatic::author::{Recipe, author};
use somatic::body::Body;
use somatic::internal::body::{Glb, MeshData, Original};
use somatic::{Result, bundled};

const PITCH: f64 = 8.6e-3;

/// What single precision loses of a place, of a neighbour's place and of an area, at 0.2 m and a pitch of 8.6 mm: each
/// coordinate is off by up to 2⁻²⁷ m, which is 1e-6 of the pitch, on four sides.
const SINGLE: f64 = 8e-6;

/// A square grid of quads over [0, 1]², each corner where `place` takes it.
fn quads(mesh: &mut MeshData, across: u32, up: u32, place: impl Fn(f64, f64) -> DVec3) {
    let first = mesh.positions.len() as u32;
    for y in 0..=up {
        for x in 0..=across {
            let at = place(f64::from(x) / f64::from(across), f64::from(y) / f64::from(up));
            mesh.positions.push(at.as_vec3().to_array());
            mesh.normals.push(Vec3::Z.to_array());
        }
    }
    for y in 0..up {
        for x in 0..across {
            let a = first + y * (across + 1) + x;
            let (b, c, d) = (a + 1, a + across + 2, a + across + 1);
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
}

/// A sheet of 0.2 m × 0.2 m around the origin, `z` high.
fn sheet(mesh: &mut MeshData, z: f64) {
    quads(mesh, 40, 40, |x, y| DVec3::new(0.2 * x - 0.1, 0.2 * y - 0.1, z));
}

fn file(mesh: &MeshData) -> Original {
    let mut glb = Glb::new();
    let node = glb.node("skin", None, DVec3::ZERO);
    glb.mesh(node, "skin", mesh, None, None);
    Original::from_bytes("skin", &glb.to_bytes().unwrap(), None).unwrap()
}

/// The body that `table` makes of `file`, and what is said of it.
fn placed(file: &Original, table: &str) -> Result<(Body, Vec<String>)> {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("taxels.csv"), table).unwrap();
    let recipe = Recipe::parse("recipe.toml", "[[place]]\ncsv = \"taxels.csv\"\n", folder.path())?;
    author(file.clone(), &recipe, |_| {}).map(|made| (made.body, made.notes))
}

fn table(places: impl IntoIterator<Item = DVec3>) -> String {
    let mut text = "id,x,y,z\n".to_owned();
    for (id, p) in places.into_iter().enumerate() {
        writeln!(text, "{id},{},{},{}", p.x, p.y, p.z).unwrap();
    }
    text
}

/// Areas of taxels at `places` on `mesh`, m².
fn areas(mesh: &MeshData, places: impl IntoIterator<Item = DVec3>) -> Vec<f64> {
    placed(&file(mesh), &table(places)).unwrap().0.taxels.iter().map(|taxel| taxel.area).collect()
}

fn all_are(areas: &[f64], wanted: f64, within: f64) {
    for (index, area) in areas.iter().enumerate() {
        assert!((area / wanted - 1.0).abs() < within, "taxel {index}: {area} instead of {wanted} m²");
    }
}

fn grid(rows: u32, columns: u32) -> impl Iterator<Item = DVec3> {
    (0..rows).flat_map(move |y| (0..columns).map(move |x| DVec3::new(f64::from(x), f64::from(y), 0.0) * PITCH))
}

#[test]
fn a_square_grid_and_a_hexagonal_one_have_their_cells_borders_included() {
    let mut mesh = MeshData::default();
    sheet(&mut mesh, 0.0);
    let square = areas(&mesh, grid(7, 9).map(|p| p - DVec3::new(0.03, 0.02, 0.0)));
    all_are(&square, PITCH * PITCH, SINGLE);
    let h = 3.0_f64.sqrt() / 2.0;
    let hexagonal = (0..7_u32).flat_map(|y| {
        (0..8_u32).map(move |x| DVec3::new(f64::from(x) + 0.5 * f64::from(y % 2) - 4.0, h * f64::from(y), 0.0) * PITCH)
    });
    all_are(&areas(&mesh, hexagonal), h * PITCH * PITCH, SINGLE);
}

#[test]
fn a_cell_ends_with_the_surface() {
    let mut mesh = MeshData::default();
    sheet(&mut mesh, 0.0);
    // The last column lies 2 mm from the sheet's edge.
    let edge = areas(&mesh, grid(5, 4).map(|p| p + DVec3::new(0.098 - 3.0 * PITCH, 0.0, 0.0)));
    for (index, area) in edge.iter().enumerate() {
        let wanted = if index % 4 == 3 { PITCH * (PITCH / 2.0 + 0.002) } else { PITCH * PITCH };
        // The edge is followed by rays 2° apart.
        let within = if index % 4 == 3 { 1e-3 } else { SINGLE };
        assert!((area / wanted - 1.0).abs() < within, "{index}: {area} instead of {wanted} m²");
    }
}

#[test]
fn on_a_cylinder_the_way_is_measured_along_the_surface() {
    // 24 taxels around a cylinder of 24 sides each as wide as the pitch, on the middles of its sides; the chord to the
    // next but one is 2 % shorter than the way, that across far shorter.
    let (mut mesh, sides) = (MeshData::default(), 24_u32);
    let radius = PITCH / 2.0 / (TAU / f64::from(sides) / 2.0).sin();
    let at = move |turn: f64| DVec3::new((TAU * turn).cos() * radius, (TAU * turn).sin() * radius, 0.0);
    quads(&mut mesh, sides, 12, |x, y| at(x) + DVec3::Z * (0.2 * y - 0.1));
    let middle = move |side: u32| {
        let [a, b] = [side, side + 1].map(|side| at(f64::from(side) / f64::from(sides)));
        (a + b) / 2.0
    };
    let around =
        (0..6_u32).flat_map(|row| (0..sides).map(move |side| middle(side) + DVec3::Z * PITCH * f64::from(row)));
    all_are(&areas(&mesh, around), PITCH * PITCH, 2.0 * SINGLE);
}

#[test]
fn nothing_leaks_to_another_sheet_however_close() {
    // Two sheets 1 mm apart that face the same way, their grids shifted by half a pitch.
    let mut mesh = MeshData::default();
    sheet(&mut mesh, 0.0);
    sheet(&mut mesh, 1e-3);
    let shift = DVec3::new(0.5, 0.5, 0.0) * PITCH + DVec3::Z * 1e-3;
    let both = grid(5, 5).chain(grid(5, 5).map(|p| p + shift)).map(|p| p - DVec3::X * 0.02);
    all_are(&areas(&mesh, both), PITCH * PITCH, SINGLE);
    // Two strips side by side like fingers, 1 mm apart and each with a row in its middle: cells as wide as they are long.
    let mut fingers = MeshData::default();
    for left in [0.0, 0.013] {
        quads(&mut fingers, 4, 40, |x, y| DVec3::new(left + 0.012 * x, 0.2 * y - 0.1, 0.0));
    }
    let rows = [0.006, 0.019].into_iter().flat_map(|x| (0..8).map(move |i| DVec3::new(x, PITCH * f64::from(i), 0.0)));
    all_are(&areas(&fingers, rows), PITCH * PITCH, SINGLE);
}

#[test]
fn taxels_at_one_place_share_its_cell() {
    let mut mesh = MeshData::default();
    sheet(&mut mesh, 0.0);
    let ten = std::iter::repeat_n(DVec3::new(2.0, 2.0, 0.0) * PITCH, 9);
    let found = areas(&mesh, grid(5, 5).chain(ten));
    for (index, area) in found.iter().enumerate() {
        let shared = index == 12 || index >= 25;
        let wanted = PITCH * PITCH / if shared { 10.0 } else { 1.0 };
        assert!((area / wanted - 1.0).abs() < SINGLE, "{index}: {area} instead of {wanted} m²");
    }
}

#[test]
fn an_area_that_the_table_gives_is_kept() {
    let mut mesh = MeshData::default();
    sheet(&mut mesh, 0.0);
    let file = file(&mesh);
    let text = "id,x,y,z,area\n0,0,0,0,2e-5\n1,0.0086,0,0,\n2,0,0.0086,0,5e-5\n3,0.0086,0.0086,0,\n";
    let body = placed(&file, text).unwrap().0;
    let areas: Vec<f64> = body.taxels.iter().map(|taxel| taxel.area).collect();
    for (area, wanted) in areas.iter().zip([2e-5, PITCH * PITCH, 5e-5, PITCH * PITCH]) {
        assert!((area / wanted - 1.0).abs() < SINGLE, "{areas:?}");
    }
    let refused = |text: &str| {
        let line = placed(&file, text).unwrap_err().to_string();
        assert!(line.contains("taxels.csv") && !line.contains('\n'), "{line}");
        line
    };
    for area in ["-1e-5", "0", "74", "nan", "1 cm2"] {
        let line = refused(&format!("id,x,y,z,area\n0,0,0,0,{area}\n"));
        assert!(line.contains("line 2") && line.contains("square metres"), "{line}");
    }
    let line = refused("id,x,y,z,aera\n0,0,0,0,1e-5\n");
    assert!(line.contains("line 1") && line.contains("`aera`") && line.contains("id, link, x, y, z"), "{line}");
}

#[test]
fn a_taxel_alone_has_no_area_and_that_is_reported() {
    let mut mesh = MeshData::default();
    sheet(&mut mesh, 0.0);
    let (body, notes) = placed(&file(&mesh), &table([DVec3::ZERO])).unwrap();
    assert_eq!(body.taxels[0].area, 0.0);
    assert!(notes.iter().any(|note| note.contains("no area for 1 taxel") && note.ends_with(": 0")), "{notes:?}");
}

#[test]
fn cells_cover_a_body_all_over() {
    // A thousand taxels all over the humanoid, then placed anew by a table of where they are.
    let file = Original::from_bytes("humanoid", bundled::HUMANOID, None).unwrap();
    let recipe = Recipe::simple(Some(1000), None, &[]).unwrap();
    let evenly = author(file.clone(), &recipe, |_| {}).unwrap().body;
    let whole: f64 = evenly.taxels.iter().map(|taxel| taxel.area).sum();
    let places = evenly
        .taxels
        .iter()
        .map(|taxel| evenly.links[taxel.link].body_from_link.transform_point3(taxel.position_in_link));
    let (body, notes) = placed(&file, &table(places)).unwrap();
    let sum: f64 = body.taxels.iter().map(|taxel| taxel.area).sum();
    eprintln!("{sum} of {whole} m², {notes:?}");
    // Cells tile what unrolls; where the surface is bent both ways within a pitch, or parts meet, some is missed.
    assert!((0.93..1.03).contains(&(sum / whole)), "{sum} of {whole} m²");
}
