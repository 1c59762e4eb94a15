use std::f64::consts::TAU;

use glam::{DAffine3, DQuat, DVec2, DVec3};

use super::*;
use crate::body::{Glb, MeshData, Modality, Taxel};

const PITCH: f64 = 0.01;

fn taxel(id: u32, position_in_link: DVec3, normal_in_link: DVec3, area: f64) -> Taxel {
    Taxel { id, link: 0, position_in_link, normal_in_link, area, modality: Modality::Pressure, tangent_in_link: None }
}

/// A link with `meshes` and `taxels`, and beside it another with `beyond`.
fn body(meshes: &[MeshData], taxels: &[Taxel], beyond: &[Taxel]) -> Body {
    let mut glb = Glb::new();
    let [arm, other] = ["arm", "other"].map(|name| glb.node(name, None, DVec3::ZERO));
    let mut whole = MeshData::default();
    for mesh in meshes {
        let first = whole.positions.len() as u32;
        whole.positions.extend(&mesh.positions);
        whole.normals.extend(&mesh.normals);
        whole.triangles.extend(mesh.triangles.iter().map(|corners| corners.map(|v| v + first)));
    }
    if !meshes.is_empty() {
        glb.mesh(arm, "shells", &whole, None, None);
    }
    glb.taxels("taxels", Some(arm), taxels, None);
    if !beyond.is_empty() {
        glb.taxels("others", Some(other), beyond, None);
    }
    Body::from_bytes("body", &glb.to_bytes().unwrap()).unwrap()
}

/// A flat sheet over `low` to `high` at the height `z`, of two triangles, facing +z.
fn sheet(low: DVec2, high: DVec2, z: f64) -> MeshData {
    let corners = [(low.x, low.y), (high.x, low.y), (high.x, high.y), (low.x, high.y)];
    MeshData {
        positions: corners.map(|(x, y)| DVec3::new(x, y, z).as_vec3().to_array()).to_vec(),
        normals: vec![[0.0, 0.0, 1.0]; 4],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        skinning: None,
    }
}

fn grid(first: u32, columns: u32, rows: u32, at: DVec3) -> Vec<Taxel> {
    (0..columns * rows)
        .map(|i| {
            let place = at + DVec3::new(f64::from(i % columns), f64::from(i / columns), 0.0) * PITCH;
            taxel(first + i, place, DVec3::Z, 0.0)
        })
        .collect()
}

fn pairs(graph: &TaxelGraph) -> Vec<(u32, u32)> {
    graph.edges().collect()
}

#[test]
fn a_grid_on_a_surface_has_four_neighbours_and_points_alone_the_corners_too() {
    let taxels = grid(0, 5, 5, DVec3::ZERO);
    let sheet = sheet(DVec2::splat(-0.02), DVec2::splat(0.06), 0.0);
    let on_surface = TaxelGraph::made(&body(&[sheet], &taxels, &[]));
    assert_eq!(on_surface.neighbours(12), [7, 11, 13, 17]);
    assert_eq!(pairs(&on_surface).len(), 40);
    // The corners of a square are on the ball over its diagonal, not inside.
    let alone = TaxelGraph::made(&body(&[], &taxels, &[]));
    assert_eq!(alone.neighbours(12), [6, 7, 8, 11, 13, 16, 17, 18]);
    // Buttons are smaller than their cells.
    let buttons: Vec<Taxel> = taxels.iter().map(|one| Taxel { area: 1e-6, ..one.clone() }).collect();
    assert_eq!(TaxelGraph::made(&body(&[], &buttons, &[])), alone);
}

#[test]
fn an_edge_is_as_long_as_two_roots_of_the_larger_cell_at_most() {
    let strip = || sheet(DVec2::ZERO, DVec2::new(0.2, 0.002), 0.0);
    let at = |x: f64| taxel((x * 1e3) as u32, DVec3::new(x, 0.001, 0.0), DVec3::Z, 0.0);
    // On a strip of 2 mm the cells are 1 cm long and have 20 mm²: 9 mm is the limit.
    assert_eq!(pairs(&TaxelGraph::made(&body(&[strip()], &[at(0.09), at(0.1), at(0.11)], &[]))).len(), 2);
    let many: Vec<Taxel> = (1..20).map(|i| at(f64::from(i) * 0.01)).collect();
    assert_eq!(pairs(&TaxelGraph::made(&body(&[strip()], &many, &[]))).len(), 2, "only at the ends cells are larger");
}

#[test]
fn shells_of_one_link_are_stitched_and_links_are_not() {
    // Two sheets side by side with a gap of 2 mm between them, and a third behind that faces away.
    let left = sheet(DVec2::splat(-0.005), DVec2::new(0.045, 0.045), 0.0);
    let right = sheet(DVec2::new(0.047, -0.005), DVec2::new(0.097, 0.045), 0.0);
    let mut behind = sheet(DVec2::splat(-0.005), DVec2::new(0.045, 0.045), -0.05);
    behind.triangles.iter_mut().for_each(|corners| corners.swap(1, 2));
    let mut taxels = grid(0, 5, 5, DVec3::ZERO);
    taxels.extend(grid(25, 5, 5, DVec3::X * 0.052));
    taxels.extend(grid(50, 5, 5, DVec3::Z * -0.05).into_iter().map(|one| Taxel { normal_in_link: -DVec3::Z, ..one }));
    let graph = TaxelGraph::made(&body(&[left.clone(), right.clone(), behind], &taxels, &[]));
    let across: Vec<(u32, u32)> = pairs(&graph).into_iter().filter(|&(a, b)| a / 25 != b / 25).collect();
    for row in 0..5 {
        assert!(across.contains(&(5 * row + 4, 25 + 5 * row)), "{across:?}");
    }
    assert!(across.iter().all(|&(a, b)| a % 5 == 4 && b % 5 == 0 && b < 50), "{across:?}");
    assert_eq!(graph.islands(&body(&[left, right], &taxels, &[])).len(), 2);
    // As links they move on their own.
    let apart = TaxelGraph::made(&body(&[], &taxels[..25], &taxels[25..50]));
    assert!(pairs(&apart).iter().all(|&(a, b)| a / 25 == b / 25));
}

#[test]
fn links_that_the_layout_joins_are_stitched() {
    // A finger, its tip beyond a link without taxels, and a part beyond, each 5 × 5 taxels, one pitch from the next.
    let pairs_of_links = |joined: &[&[&str]]| {
        let mut glb = Glb::new();
        let finger = glb.node("finger", None, DVec3::new(0.3, 0.0, 0.0));
        let turned = DAffine3::from_rotation_translation(DQuat::from_rotation_z(TAU / 4.0), DVec3::X * 5.0 * PITCH);
        let flange = glb.placed_node("flange", Some(finger), turned);
        let tip = glb.placed_node("tip", Some(flange), DAffine3::from_quat(DQuat::from_rotation_z(-TAU / 4.0)));
        let beyond = glb.node("beyond", Some(tip), DVec3::X * 5.0 * PITCH);
        for (number, (link, name)) in (0..).zip([(finger, "finger skin"), (tip, "tip skin"), (beyond, "skin beyond")]) {
            glb.taxels(name, Some(link), &grid(25 * number, 5, 5, DVec3::ZERO), None);
        }
        let joined = joined.iter().map(|names| names.iter().map(ToString::to_string).collect()).collect();
        glb.edges(&StoredEdges { joined, ..StoredEdges::default() });
        let body = Body::from_bytes("body", &glb.to_bytes().unwrap()).unwrap();
        let (graph, note) = TaxelGraph::from_body(&body);
        assert_eq!(note, None);
        // What is stored is current.
        let stored = Body { edges: Some(graph.to_stored(&body)), ..body.clone() };
        assert_eq!(TaxelGraph::from_body(&stored), (graph.clone(), None));
        let across = pairs(&graph).into_iter().filter(|&(a, b)| a / 25 != b / 25);
        let pairs_of_links: BTreeSet<(u32, u32)> = across.map(|(a, b)| (a / 25, b / 25)).collect();
        let is_beside = (0..5).all(|row| graph.neighbours(5 * row + 4).contains(&(25 + 5 * row as u32)));
        assert_eq!(is_beside, pairs_of_links.contains(&(0, 1)));
        pairs_of_links.into_iter().collect::<Vec<_>>()
    };
    assert_eq!(pairs_of_links(&[]), []);
    assert_eq!(pairs_of_links(&[&["finger", "tip"]]), [(0, 1)]);
    assert_eq!(pairs_of_links(&[&["beyond", "flange", "tip"], &["gone"], &[]]), [(1, 2)]);
    assert_eq!(pairs_of_links(&[&["beyond", "tip"], &["tip", "finger"]]), [(0, 1), (1, 2)]);
}

/// Two faces whose taxels meet at an edge along y; their normals are `between` apart, and all of it is turned by `turn`.
fn edge_of_two_faces(between: f64, turn: DQuat) -> TaxelGraph {
    let top: Vec<Taxel> = grid(0, 3, 3, DVec3::new(0.005, 0.005, 0.0));
    let tilt = DQuat::from_rotation_y(-between);
    let side = top.iter().map(|one| {
        let DVec3 { x, y, .. } = one.position_in_link;
        let position_in_link = tilt * DVec3::new(-x, y, 0.0);
        Taxel { id: one.id + 9, position_in_link, normal_in_link: tilt * DVec3::Z, ..one.clone() }
    });
    let turned = |one: Taxel| Taxel {
        position_in_link: turn * one.position_in_link,
        normal_in_link: (turn * one.normal_in_link).as_vec3().as_dvec3(),
        ..one
    };
    let all: Vec<Taxel> = top.iter().cloned().chain(side).map(turned).collect();
    TaxelGraph::made(&body(&[], &all, &[]))
}

#[test]
fn faces_at_an_edge_are_stitched_and_the_sides_of_a_plate_are_not() {
    // The meshes of robots are often faces that share no vertices.
    for (degrees, is_edge) in [(0.0_f64, true), (60.0, true), (90.0, true), (95.0, false), (170.0, false)] {
        for step in 0..8 {
            let turn = DQuat::from_euler(glam::EulerRot::XYZ, 0.3 * f64::from(step), 0.7 * f64::from(step), 0.2);
            let graph = edge_of_two_faces(degrees.to_radians(), turn);
            for row in 0..3 {
                let is_stitched = graph.neighbours(3 * row).contains(&(9 + 3 * row as u32));
                assert_eq!(is_stitched, is_edge, "{degrees}°, turn {step}, row {row}");
            }
        }
    }
}

#[test]
fn what_is_no_pressure_taxel_is_no_node_and_one_place_is_one_node() {
    let mut taxels = grid(0, 4, 4, DVec3::ZERO);
    taxels[5].modality = Modality::Temperature;
    taxels.push(taxel(16, taxels[10].position_in_link, DVec3::Z, 0.0));
    for meshes in [vec![], vec![sheet(DVec2::splat(-0.02), DVec2::splat(0.06), 0.0)]] {
        let body = body(&meshes, &taxels, &[]);
        let graph = TaxelGraph::made(&body);
        assert!(graph.neighbours(5).is_empty());
        assert_eq!(graph.neighbours(16), [10]);
        assert!(graph.neighbours(10).contains(&16) && graph.neighbours(10).contains(&11));
        assert_eq!(graph.islands(&body).iter().map(Vec::len).collect::<Vec<_>>(), [16]);
    }
}

#[test]
fn around_a_limb_edges_go_along_the_skin() {
    // A tube of 8 mm radius and 16 taxels around it, 3 mm apart; through it, the opposite one is 16 mm away.
    let (sides, radius) = (32_u32, 0.008);
    let at = |side: u32, z: f64| {
        DVec2::from_angle(TAU * f64::from(side) / f64::from(sides)).extend(0.0) * radius + DVec3::Z * z
    };
    let mesh = MeshData {
        positions: (0..sides)
            .flat_map(|side| [at(side, 0.0), at(side, 0.03)])
            .map(|p| p.as_vec3().to_array())
            .collect(),
        normals: vec![[0.0, 0.0, 1.0]; 2 * sides as usize],
        triangles: (0..sides)
            .flat_map(|side| {
                let (a, b) = (2 * side, 2 * ((side + 1) % sides));
                [[a, b, b + 1], [a, b + 1, a + 1]]
            })
            .collect(),
        skinning: None,
    };
    let taxels: Vec<Taxel> = (0..16 * 8)
        .map(|i| {
            let place = at(2 * (i % 16), 0.003 * f64::from(i / 16) + 0.004);
            taxel(i, place, place.with_z(0.0).normalize(), 0.0)
        })
        .collect();
    let graph = TaxelGraph::made(&body(&[mesh], &taxels, &[]));
    assert_eq!(graph.neighbours(40), [24, 39, 41, 56]);
    assert_eq!(pairs(&graph).len(), 16 * 8 + 16 * 7);
}

#[test]
fn taxels_without_a_value_are_bridges() {
    let graph = TaxelGraph::made(&body(&[], &grid(0, 7, 1, DVec3::ZERO), &[]));
    assert_eq!(pairs(&graph).len(), 6);
    let bridged = graph.bridging(&[true, true, false, false, true, true, false]);
    assert_eq!(pairs(&bridged), [(0, 1), (1, 4), (4, 5)]);
    assert_eq!(graph.bridging(&[true; 7]), graph);
    assert!(pairs(&graph.bridging(&[false; 7])).is_empty());
    // In the middle of a cross, the four arms are each other's.
    let sheet = sheet(DVec2::splat(-0.02), DVec2::splat(0.04), 0.0);
    let cross = TaxelGraph::made(&body(&[sheet], &grid(0, 3, 3, DVec3::ZERO), &[]));
    let mut has_value = [true; 9];
    has_value[4] = false;
    assert_eq!(cross.bridging(&has_value).neighbours(1), [0, 2, 3, 5, 7]);
}

#[test]
fn stored_edges_are_used_while_they_are_current() {
    let taxels = grid(10, 5, 4, DVec3::ZERO);
    let mut body = body(&[], &taxels, &[]);
    let made = TaxelGraph::made(&body);
    assert_eq!(TaxelGraph::from_body(&body), (made.clone(), None));
    body.edges = Some(made.to_stored(&body));
    assert_eq!(TaxelGraph::from_body(&body), (made.clone(), None));
    // What is stored counts, also where it differs from what would be made.
    let fewer = body.edges.as_mut().unwrap();
    let row = fewer.rows.get_mut(&10).unwrap();
    row.to.remove(0);
    row.lengths_m -= PITCH;
    let (graph, note) = TaxelGraph::from_body(&body);
    assert_eq!((pairs(&graph).len() + 1, note), (pairs(&made).len(), None));
    // Moved by what an editor rounds, and by more.
    body.edges = Some(made.to_stored(&body));
    body.taxels[7].position_in_link += DVec3::X * 1e-6;
    assert_eq!(TaxelGraph::from_body(&body).1, None);
    body.taxels[7].position_in_link += DVec3::X * 1e-4;
    let note = TaxelGraph::from_body(&body).1.unwrap();
    assert!(note.contains("made anew") && note.contains("17") && note.contains("moved"), "{note}");
    body.taxels[7].position_in_link -= DVec3::X * 1e-4;
    let mut one = body.taxels.pop().unwrap();
    let note = TaxelGraph::from_body(&body).1.unwrap();
    assert!(note.contains("have taxel 29"), "{note}");
    one.id = 40;
    body.taxels.push(one);
    let note = TaxelGraph::from_body(&body).1.unwrap();
    assert!(note.contains("lack taxel 40"), "{note}");
}
