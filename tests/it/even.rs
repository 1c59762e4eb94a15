//! Taxels that are spread evenly, by links, where something can touch them.

use std::path::Path;

use glam::DVec3;
use somatic::author::{Authored, Recipe, author};
use somatic::internal::author::{cell_spread, place_evenly};
use somatic::internal::body::{Glb, MeshData, Original};

/// A box between two corners, outside out, six sides of `n` × `n` squares; without the one on top if it is `open`.
pub(crate) fn block([low, high]: [DVec3; 2], n: u32, is_open: bool) -> MeshData {
    let mut mesh = MeshData::default();
    for axis in 0..3 {
        for side in 0..2 {
            if is_open && (axis, side) == (1, 1) {
                continue;
            }
            let first = mesh.positions.len() as u32;
            let mut normal = [0.0; 3];
            normal[axis] = if side == 0 { -1.0 } else { 1.0 };
            for (u, v) in (0..=n).flat_map(|v| (0..=n).map(move |u| (u, v))) {
                let mut at = [0.0; 3];
                at[axis] = f64::from(side);
                at[(axis + 1) % 3] = f64::from(u) / f64::from(n);
                at[(axis + 2) % 3] = f64::from(v) / f64::from(n);
                mesh.positions.push((low + (high - low) * DVec3::from_array(at)).as_vec3().to_array());
                mesh.normals.push(normal);
            }
            for a in (0..n).flat_map(|v| (0..n).map(move |u| first + v * (n + 1) + u)) {
                for [a, b, c] in [[a, a + 1, a + n + 2], [a, a + n + 2, a + n + 1]] {
                    mesh.triangles.push(if side == 1 { [a, b, c] } else { [a, c, b] });
                }
            }
        }
    }
    mesh
}

/// Links with a mesh each.
pub(crate) fn body(meshes: &[(&str, MeshData)]) -> Original {
    let mut glb = Glb::new();
    for (name, mesh) in meshes {
        let link = glb.node(name, None, DVec3::ZERO);
        glb.mesh(link, &format!("{name} mesh"), mesh, None, None);
    }
    Original::from_bytes("boxes", &glb.to_bytes().unwrap(), None).unwrap()
}

pub(crate) fn made(file: &Original, text: &str) -> Authored {
    author(file.clone(), &Recipe::parse("recipe.toml", text, Path::new("")).unwrap(), |_| {}).unwrap()
}

fn cube(side: f64) -> [DVec3; 2] {
    [DVec3::splat(-side / 2.0), DVec3::splat(side / 2.0)]
}

#[test]
fn cells_are_alike_and_links_get_what_their_surface_is_worth() {
    let two = body(&[
        ("large", block([DVec3::ZERO, DVec3::splat(0.2)], 4, false)),
        ("small", block([DVec3::X, DVec3::X + DVec3::splat(0.1)], 30, false)),
        ("crumb", block([DVec3::Y, DVec3::Y + DVec3::splat(0.005)], 1, false)),
    ]);
    let authored = made(&two, "[[place]]\ntaxels = 500");
    let place = &authored.places[0];
    assert_eq!(place.ids, Vec::from_iter(0..500));
    assert_eq!((place.links["large"], place.links["small"]), (400, 100));
    let [low, high] = place.cell_spread.unwrap();
    // Those at creases too: away from these they are alike to within a tenth or so.
    assert!(low > 0.8 && high < 1.2, "{low} {high}");
    let note = authored.notes.iter().find(|note| note.contains("`crumb`")).unwrap();
    assert!(note.contains("1 piece") && note.contains("1 of `crumb` (1.5 cm²)"), "{note}");
    let scattered = made(&two, "even = false\n[[place]]\ntaxels = 500");
    let [lower, higher] = scattered.places[0].cell_spread.unwrap();
    assert!(lower < low - 0.05 && higher > high + 0.05, "{lower} {higher}");
    // The same bytes again.
    assert_eq!(authored.file.to_glb().unwrap(), made(&two, "[[place]]\ntaxels = 500").file.to_glb().unwrap());
}

#[test]
fn what_nothing_can_touch_gets_no_taxel_and_is_named() {
    let nested = body(&[("outer", block(cube(0.2), 6, false)), ("inner", block(cube(0.1), 6, false))]);
    let authored = made(&nested, "[[place]]\ntaxels = 200");
    assert_eq!(authored.places[0].links.get("outer"), Some(&200));
    let hidden = &authored.places[0].hidden_m2;
    assert_eq!(hidden.len(), 1);
    assert!((hidden["inner"] - 0.06).abs() < 0.001, "{hidden:?}");
    let note = authored.notes.iter().find(|note| note.contains("nothing can touch")).unwrap();
    assert!(note.contains("20 %") && note.contains("`inner`"), "{note}");
    let area: f64 = authored.body.taxels.iter().map(|taxel| taxel.area).sum();
    assert!((area - 0.24).abs() < 1e-6, "{area}");

    let kept = made(&nested, "hidden = \"keep\"\n[[place]]\ntaxels = 200");
    assert_eq!(kept.places[0].links["inner"], 40);
    assert!(kept.places[0].hidden_m2.is_empty());

    // Through the open top something reaches the inner box's top, and the inside of nothing: it has no inner faces.
    let open = body(&[("outer", block(cube(0.2), 6, true)), ("inner", block(cube(0.1), 6, false))]);
    let reached = made(&open, "[[place]]\ntaxels = 200");
    assert!(reached.places[0].links["inner"] > 8, "{:?}", reached.places[0].links);
    let inner = reached.body.link_index("inner").unwrap();
    let taxels = reached.body.taxels.iter().filter(|taxel| taxel.link == inner);
    // On its very edges the bottom can be touched from beside.
    let is_below = |normal: DVec3, at: DVec3| normal.y < -0.5 && at.x.abs().max(at.z.abs()) < 0.049;
    let below: Vec<DVec3> = taxels
        .filter(|one| is_below(one.normal_in_link, one.position_in_link))
        .map(|one| one.position_in_link)
        .collect();
    assert!(below.is_empty(), "{below:?}");
}

#[test]
fn faces_that_look_inward_are_reported_and_get_taxels_all_the_same() {
    let mut mesh = block(cube(0.1), 3, false);
    mesh.triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
    let authored = made(&body(&[("box", mesh)]), "[[place]]\ntaxels = 50");
    assert_eq!(authored.places[0].links["box"], 50);
    assert!(authored.notes.iter().any(|note| note.contains("faces look inward")), "{:?}", authored.notes);
}

#[test]
fn taxels_keep_clear_of_borders() {
    let open = body(&[("box", block(cube(0.2), 5, true))]);
    let authored = made(&open, "clear = \"15 mm\"\n[[place]]\ntaxels = 150");
    assert_eq!(authored.body.taxels.len(), 150);
    // Its border is around the missing top.
    for taxel in &authored.body.taxels {
        assert!(taxel.position_in_link.y < 0.1 - 0.015, "{}", taxel.position_in_link);
    }
    let text = "clear = \"1 m\"\n[[place]]\ntaxels = 150";
    let recipe = Recipe::parse("recipe.toml", text, Path::new("")).unwrap();
    let line = author(open, &recipe, |_| {}).unwrap_err().to_string();
    assert!(line.contains("clear") && !line.contains('\n'), "{line}");
}

#[test]
fn without_rounds_and_with_hidden_surface_taxels_are_where_they_were_scattered() {
    let (low, high) = (DVec3::ZERO, DVec3::splat(0.25));
    let mesh = block([low, high], 4, false);
    let authored =
        made(&body(&[("box", mesh.clone())]), "even = false\nhidden = \"keep\"\n[[place]]\ntaxels = 90\nseed = 7");
    let positions: Vec<DVec3> =
        mesh.positions.iter().map(|&[x, y, z]| DVec3::new(x.into(), y.into(), z.into())).collect();
    // A place's seed, by its name.
    let step = |hash: u64, byte: u8| (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01B3);
    let seed = 7_u64.wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ "skin".bytes().fold(0xCBF2_9CE4_8422_2325, step);
    let placed = place_evenly(&positions, &mesh.triangles, 90, seed, &mut |_| true).unwrap();
    for (taxel, placed) in authored.body.taxels.iter().zip(&placed) {
        assert!(taxel.position_in_link.distance(placed.point.position) < 1e-7, "{}", taxel.id);
    }
    assert!(cell_spread(authored.body.taxels.iter().map(|taxel| taxel.area)).unwrap()[0] < 0.85);
}
