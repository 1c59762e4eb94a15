//! Errors that are to be expected on a layout, and two layouts side by side.

use std::path::Path;

use glam::DVec3;
use somatic::author::{Recipe, author};
use somatic::internal::body::{Glb, MeshData, Original};
use somatic::internal::expected::{TestTouches, compare_layouts, expected_and_ideal_errors, expected_errors};
use somatic::{Body, bundled};

/// A square sheet of 0.3 m, facing up, with 300 taxels.
fn sheet(more: &str) -> Body {
    const SQUARES: u32 = 12;
    let mut mesh = MeshData::default();
    for (row, column) in (0..=SQUARES).flat_map(|row| (0..=SQUARES).map(move |column| (row, column))) {
        let at = |step: u32| (f64::from(step) / f64::from(SQUARES) - 0.5) as f32 * 0.3;
        mesh.positions.push([at(column), 0.0, at(row)]);
        mesh.normals.push([0.0, 1.0, 0.0]);
    }
    for a in (0..SQUARES).flat_map(|row| (0..SQUARES).map(move |column| row * (SQUARES + 1) + column)) {
        let below = a + SQUARES + 1;
        mesh.triangles.extend([[a, below, below + 1], [a, below + 1, a + 1]]);
    }
    let mut glb = Glb::new();
    let link = glb.node("sheet", None, DVec3::ZERO);
    glb.mesh(link, "sheet mesh", &mesh, None, None);
    let file = Original::from_bytes("sheet", &glb.to_bytes().unwrap(), None).unwrap();
    let recipe = Recipe::parse("recipe.toml", &format!("{more}\n[[place]]\ntaxels = 300"), Path::new("")).unwrap();
    author(file, &recipe, |_| {}).unwrap().body
}

#[test]
fn even_taxels_are_truer_than_scattered_ones_and_nearly_ideal() {
    let (even, scattered) = (sheet(""), sheet("even = false"));
    let compared = compare_layouts([&scattered, &even], &TestTouches::default()).unwrap();
    let [scattered, even] = &compared.layouts;
    let ideal = &compared.ideal[1];
    assert!(compared.same_places && scattered.touches.len() == 400 && even.touches.len() == 400);
    assert!((even.spacing_m - 0.3 / 300_f64.sqrt()).abs() < 1e-4, "{}", even.spacing_m);
    let layouts = [even, scattered, ideal];
    let places = layouts.map(|of| of.place_m().unwrap());
    let axes = layouts.map(|of| of.axis_rad().unwrap());
    // At the sheet's borders, which the ideal skin has not, lines are cut off.
    for (what, of, of_ideal) in [("place", places, 1.5), ("axis", axes, 2.0)] {
        assert!(of.iter().all(|errors| errors.count > 150), "{what}: {of:?}");
        assert!(of[0].median < 0.85 * of[1].median && of[0].p95 < 0.9 * of[1].p95, "{what}: {of:?}");
        assert!(of[0].median < of_ideal * of[2].median && of[2].median < 1.1 * of[0].median, "{what}: {of:?}");
    }
    let nearer = compared.second_is_nearer().unwrap();
    assert!((0.55..0.95).contains(&nearer), "{nearer}");
    assert!(compared.frame_s.iter().all(|time_s| *time_s > 0.0 && *time_s < 0.1));
}

#[test]
fn errors_are_the_same_whenever_and_on_however_many_threads() {
    let hand = Body::from_bytes("hand", bundled::HAND).unwrap();
    let touches = TestTouches::default().count(70);
    let first = expected_and_ideal_errors(&hand, &touches).unwrap();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    assert_eq!(pool.install(|| expected_and_ideal_errors(&hand, &touches).unwrap()), first);
    // Fewer touches are the first of these.
    let fewer = expected_errors(&hand, &touches.count(20)).unwrap();
    assert_eq!(fewer.touches[..], first[0].touches[..20]);
    assert!(first[0].counted().count() > 50 && first[0].place_m().unwrap().median < 0.3 * first[0].spacing_m);
}

#[test]
fn layouts_of_two_surfaces_are_touched_at_places_of_their_own() {
    let bodies = [bundled::HAND, bundled::MAT].map(|bytes| Body::from_bytes("bundled", bytes).unwrap());
    let compared = compare_layouts([&bodies[0], &bodies[1]], &TestTouches::default().count(40)).unwrap();
    let spacings = compared.layouts.each_ref().map(|of| of.spacing_m);
    assert!(!compared.same_places && compared.second_is_nearer().is_none());
    // One size for both, that of the coarser one.
    let sized = spacings[0].max(spacings[1]);
    assert!(compared.layouts.iter().chain(&compared.ideal).all(|of| of.touch_spacing_m == sized));
}

#[test]
fn a_body_that_cannot_be_touched_is_refused_in_one_line() {
    let mut hand = Body::from_bytes("hand.glb", bundled::HAND).unwrap();
    let why = |body: &Body| expected_errors(body, &TestTouches::default()).unwrap_err().to_string();
    let taxels = std::mem::take(&mut hand.taxels);
    assert_eq!(
        why(&hand),
        "hand.glb: errors of touches cannot be simulated: it has no pressure taxels; give it some with `somatic author`"
    );
    hand.taxels = taxels;
    hand.surfaces.clear();
    assert_eq!(
        why(&hand),
        "hand.glb: errors of touches cannot be simulated: it has no surface; author its taxels on a mesh"
    );
}
