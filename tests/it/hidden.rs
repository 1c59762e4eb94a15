//! Taxels that nothing can touch are found, by each alternative of the rule, and no others.

use glam::DVec3;
use somatic::Body;
use somatic::author::{Finding, FindingKind, lint};
use somatic::body::{LinkJoint, Modality, Taxel};
use somatic::internal::author::lint_with_progress;
use somatic::internal::body::{Glb, LinkMotion, MeshData, Skinning};

/// Corners and triangles of a box, outside out.
fn cuboid(low: DVec3, high: DVec3) -> MeshData {
    let corner = |i: u32| {
        DVec3::new(
            [low.x, high.x][i as usize & 1],
            [low.y, high.y][i as usize >> 1 & 1],
            [low.z, high.z][i as usize >> 2],
        )
    };
    let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    MeshData {
        positions: (0..8).map(|i| corner(i).as_vec3().to_array()).collect(),
        normals: vec![[0.0, 0.0, 1.0]; 8],
        triangles: faces.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect(),
        skinning: None,
    }
}

fn flipped(mut mesh: MeshData) -> MeshData {
    mesh.triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
    mesh
}

fn joined(parts: impl IntoIterator<Item = MeshData>) -> MeshData {
    let mut all = MeshData::default();
    for part in parts {
        let first = all.positions.len() as u32;
        all.positions.extend(part.positions);
        all.normals.extend(part.normals);
        all.triangles.extend(part.triangles.iter().map(|triangle| triangle.map(|v| v + first)));
    }
    all
}

/// A box of half side `side` about `at`.
fn cube(at: DVec3, side: f64) -> MeshData {
    cuboid(at - side, at + side)
}

/// Walls from `inner` to `outer` around the origin: nothing of the outside gets in.
fn hollow(inner: f64, outer: f64) -> MeshData {
    joined([cube(DVec3::ZERO, outer), flipped(cube(DVec3::ZERO, inner))])
}

/// A sleeve along z with a floor, open at the top at z = 0.2, 10.5 mm wide inside on either side of the axis.
fn sleeve() -> MeshData {
    let (inner, outer) = (0.0105, 0.015);
    let corner = |side: f64, z: f64, i: usize| {
        let (x, y) = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)][i % 4];
        [(side * x) as f32, (side * y) as f32, z as f32]
    };
    let mut mesh = MeshData::default();
    let mut quad = |corners: [[f32; 3]; 4]| {
        let first = mesh.positions.len() as u32;
        mesh.positions.extend(corners);
        mesh.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
    };
    for i in 0..4 {
        quad([corner(outer, -0.01, i), corner(outer, -0.01, i + 1), corner(outer, 0.2, i + 1), corner(outer, 0.2, i)]);
        quad([corner(inner, 0.0, i), corner(inner, 0.2, i), corner(inner, 0.2, i + 1), corner(inner, 0.0, i + 1)]);
        quad([corner(outer, 0.2, i), corner(outer, 0.2, i + 1), corner(inner, 0.2, i + 1), corner(inner, 0.2, i)]);
    }
    quad([corner(outer, -0.01, 3), corner(outer, -0.01, 2), corner(outer, -0.01, 1), corner(outer, -0.01, 0)]);
    quad([corner(inner, 0.0, 0), corner(inner, 0.0, 1), corner(inner, 0.0, 2), corner(inner, 0.0, 3)]);
    mesh.normals = vec![[0.0, 0.0, 1.0]; mesh.positions.len()];
    mesh
}

/// A rod along z that stands in the sleeve and comes out of it.
fn rod() -> MeshData {
    cuboid(DVec3::new(-0.01, -0.01, 0.001), DVec3::new(0.01, 0.01, 0.4))
}

fn taxel(id: u32, position_in_link: DVec3, normal_in_link: DVec3) -> Taxel {
    Taxel {
        id,
        link: 0,
        position_in_link,
        normal_in_link,
        area: 1e-4,
        modality: Modality::Pressure,
        tangent_in_link: None,
    }
}

/// Taxels in the middle of each side of a box about `at`.
fn on_cube(first: u32, at: DVec3, side: f64) -> Vec<Taxel> {
    let normals = DVec3::AXES.into_iter().flat_map(|axis| [axis, -axis]);
    normals.zip(first..).map(|(normal, id)| taxel(id, at + normal * side, normal)).collect()
}

/// A link below the one before, with its mesh, its taxels and the joint above it.
struct Part {
    mesh: MeshData,
    taxels: Vec<Taxel>,
    joint: Option<LinkJoint>,
}

fn part(mesh: MeshData, taxels: Vec<Taxel>) -> Part {
    Part { mesh, taxels, joint: None }
}

fn body(parts: Vec<Part>) -> Body {
    let mut glb = Glb::new();
    let mut parent = None;
    for (index, part) in parts.into_iter().enumerate() {
        let link = glb.node(&format!("l{index}"), parent, DVec3::ZERO);
        if let Some(joint) = &part.joint {
            glb.joint(link, joint);
        }
        if !part.mesh.triangles.is_empty() {
            glb.mesh(link, "skin", &part.mesh, None, None);
        }
        if !part.taxels.is_empty() {
            glb.taxels(&format!("taxels {index}"), Some(link), &part.taxels, None);
        }
        parent = Some(link);
    }
    Body::from_bytes("made up", &glb.to_bytes().unwrap()).unwrap()
}

/// What is found of taxels that nothing can touch, and of a body in itself.
fn found(body: &Body) -> Vec<(FindingKind, Vec<u32>)> {
    findings(body).into_iter().map(|finding| (finding.kind, finding.taxels)).collect()
}

fn findings(body: &Body) -> Vec<Finding> {
    use FindingKind::{CoveredAtRest, HiddenTaxel, InwardFaces, RestRunsIntoItself};
    let mut findings = lint(body, &[]);
    findings.retain(|finding| matches!(finding.kind, HiddenTaxel | CoveredAtRest | InwardFaces | RestRunsIntoItself));
    findings
}

fn slide(limits: [f64; 2]) -> Option<LinkJoint> {
    Some(LinkJoint { name: "slide".into(), motion: LinkMotion::Prismatic(DVec3::Z), limits: Some(limits), mimic: None })
}

#[test]
fn a_box_in_a_box_of_another_link_is_hidden_and_the_outer_one_is_not() {
    let outer = part(cube(DVec3::ZERO, 0.1), on_cube(0, DVec3::ZERO, 0.1));
    let inner = part(cube(DVec3::ZERO, 0.05), on_cube(10, DVec3::ZERO, 0.05));
    let body = body(vec![outer, inner]);
    let [finding] = &findings(&body)[..] else { panic!("{:?}", findings(&body)) };
    assert_eq!((finding.kind, &finding.taxels[..]), (FindingKind::HiddenTaxel, &[10, 11, 12, 13, 14, 15][..]));
    assert_eq!((finding.links[0].link.as_str(), finding.links[0].of), ("l1", 6));
    assert!((finding.worst.unwrap() - 0.5).abs() < 1e-9);
    let text = finding.to_string();
    assert!(text.contains("6 of 12 taxels are hidden") && text.contains("6 of 6 on `l1` (10–15)"), "{text}");
}

#[test]
fn without_one_side_of_the_outer_box_only_the_far_side_is_hidden() {
    let mut open = cube(DVec3::ZERO, 0.1);
    open.triangles.truncate(10);
    let inner = part(cube(DVec3::ZERO, 0.05), on_cube(10, DVec3::ZERO, 0.05));
    // Four sides look at walls, but rays get out past their edges; the one that looks away from the opening is shut in.
    assert_eq!(found(&body(vec![part(open, Vec::new()), inner])), [(FindingKind::HiddenTaxel, vec![11])]);
}

#[test]
fn an_open_sheet_is_open_on_both_sides() {
    let mut sheet = cube(DVec3::ZERO, 0.1);
    sheet.triangles.truncate(2);
    let middle = DVec3::new(0.01, 0.02, -0.1);
    let taxels = vec![taxel(0, middle, -DVec3::Z), taxel(1, middle, DVec3::Z)];
    assert_eq!(found(&body(vec![part(sheet, taxels)])), []);
}

#[test]
fn what_its_own_link_blocks_is_hidden() {
    // In the cavity of a hollow link the mean over the rays is 0: only that its own link blocks all tells it.
    let inside = vec![taxel(0, DVec3::new(0.01, 0.0, -0.05), DVec3::Z), taxel(1, DVec3::Z * 0.1, DVec3::Z)];
    assert_eq!(found(&body(vec![part(hollow(0.05, 0.1), inside)])), [(FindingKind::HiddenTaxel, vec![0])]);
}

#[test]
fn a_shell_that_is_closed_off_as_a_whole_is_hidden() {
    let away = DVec3::X * 0.5;
    let link = || joined([cube(DVec3::ZERO, 0.03), cube(away, 0.03)]);
    let taxels = || [on_cube(0, DVec3::ZERO, 0.03), on_cube(10, away, 0.03)].concat();
    let closed = body(vec![part(hollow(0.05, 0.1), Vec::new()), part(link(), taxels())]);
    assert_eq!(found(&closed), [(FindingKind::HiddenTaxel, (0..6).collect::<Vec<u32>>())]);
    let alone = body(vec![part(link(), taxels())]);
    assert_eq!(found(&alone), []);
}

#[test]
fn what_only_another_pose_could_uncover_is_covered_at_rest() {
    let deep = || vec![taxel(0, DVec3::new(0.01, 0.0, 0.05), DVec3::X), taxel(1, DVec3::new(0.01, 0.0, 0.3), DVec3::X)];
    let of = |joint| body(vec![part(sleeve(), Vec::new()), Part { joint, ..part(rod(), deep()) }]);
    assert_eq!(found(&of(None)), [(FindingKind::CoveredAtRest, vec![0])]);
    // A joint that pulls the rod out uncovers it; one that hardly moves does not.
    assert_eq!(found(&of(slide([0.2, 0.3]))), []);
    assert_eq!(found(&of(slide([0.0, 0.01]))), [(FindingKind::HiddenTaxel, vec![0])]);
}

#[test]
fn of_a_skinned_mesh_all_is_a_link_s_own() {
    let (sleeve, rod) = (sleeve(), rod());
    let joints = [vec![[0_u16; 4]; sleeve.positions.len()], vec![[1; 4]; rod.positions.len()]].concat();
    let weights = vec![[1.0, 0.0, 0.0, 0.0]; joints.len()];
    let mesh = MeshData { skinning: Some(Skinning { joints, weights }), ..joined([sleeve, rod]) };
    let mut glb = Glb::new();
    let root = glb.node("root", None, DVec3::ZERO);
    let tip = glb.node("tip", Some(root), DVec3::ZERO);
    let shown = glb.node("skin", None, DVec3::ZERO);
    let identity = glam::Mat4::IDENTITY.to_cols_array();
    let skin = glb.skin("skin", &[root, tip], &[identity; 2]);
    glb.mesh(shown, "skin", &mesh, None, Some(skin));
    let taxels = [taxel(0, DVec3::new(0.01, 0.0, 0.05), DVec3::X), taxel(1, DVec3::new(0.01, 0.0, 0.3), DVec3::X)];
    let carried = Skinning { joints: vec![[1; 4]; 2], weights: vec![[1.0, 0.0, 0.0, 0.0]; 2] };
    glb.taxels("taxels", Some(root), &taxels, Some((skin, &carried)));
    let body = Body::from_bytes("skinned", &glb.to_bytes().unwrap()).unwrap();
    assert_eq!(body.links[body.taxels[0].link].name, "tip");
    assert_eq!(found(&body), [(FindingKind::HiddenTaxel, vec![0])]);
}

/// A closed tube along z, with two joints in its middle; the second is turned by 90° towards −y at rest. Its weights change within
/// `blend_m` of the middle. Taxels are on the inside of the bend.
fn bent_tube(blend_m: f64) -> Body {
    let (rings, sides) = (41_u32, 24_u32);
    let of_upper = |z: f64| ((z - 0.2 + blend_m) / (2.0 * blend_m)).clamp(0.0, 1.0) as f32;
    let mut mesh = MeshData::default();
    let mut skinning = Skinning::default();
    let mut add = |p: DVec3| {
        mesh.positions.push(p.as_vec3().to_array());
        mesh.normals.push([0.0, 0.0, 1.0]);
        skinning.joints.push([0, 1, 0, 0]);
        skinning.weights.push([1.0 - of_upper(p.z), of_upper(p.z), 0.0, 0.0]);
    };
    for ring in 0..rings {
        for side in 0..sides {
            let angle = std::f64::consts::TAU * f64::from(side) / f64::from(sides);
            add(DVec3::new(0.03 * angle.cos(), 0.03 * angle.sin(), 0.01 * f64::from(ring)));
        }
    }
    add(DVec3::ZERO);
    add(DVec3::Z * 0.4);
    let [bottom, top, last] = [rings * sides, rings * sides + 1, (rings - 1) * sides];
    for side in 0..sides {
        let next = (side + 1) % sides;
        mesh.triangles.extend([[bottom, next, side], [top, last + side, last + next]]);
        for ring in 0..rings - 1 {
            let [a, b] = [side, next].map(|side| ring * sides + side);
            mesh.triangles.extend([[a, b, b + sides], [a, b + sides, a + sides]]);
        }
    }
    mesh.skinning = Some(skinning);
    let mut glb = Glb::new();
    let root = glb.node("root", None, DVec3::ZERO);
    let turn = glam::DQuat::from_rotation_x(std::f64::consts::FRAC_PI_2);
    let upper = glb.placed_node("upper", Some(root), glam::DAffine3::from_rotation_translation(turn, DVec3::Z * 0.2));
    let binds = [glam::Mat4::IDENTITY, glam::Mat4::from_translation(glam::Vec3::Z * -0.2)];
    let skin = glb.skin("skin", &[root, upper], &binds.map(|bind| bind.to_cols_array()));
    let shown = glb.node("skin", None, DVec3::ZERO);
    glb.mesh(shown, "skin", &mesh, None, Some(skin));
    let heights = [0.175, 0.185, 0.195, 0.205, 0.215, 0.225];
    let on_inside = |(id, z): (u32, f64)| taxel(id, DVec3::new(0.0, -0.03, z), -DVec3::Y);
    let taxels: Vec<Taxel> = (0..).zip(heights).map(on_inside).collect();
    let carried = Skinning {
        joints: heights.map(|z| if of_upper(z) > 0.5 { [1, 0, 0, 0] } else { [0, 1, 0, 0] }).to_vec(),
        weights: heights
            .map(|z| [of_upper(z).max(1.0 - of_upper(z)), of_upper(z).min(1.0 - of_upper(z)), 0.0, 0.0])
            .to_vec(),
    };
    glb.taxels("taxels", Some(root), &taxels, Some((skin, &carried)));
    Body::from_bytes("bent", &glb.to_bytes().unwrap()).unwrap()
}

#[test]
fn a_mesh_that_is_bent_at_rest_is_seen_where_its_weights_put_it() {
    // Where the weights of both joints round the bend, nothing is in the way; by the heaviest joint alone, each half would run into the
    // other, as it does where the weights change at once.
    assert_eq!(found(&bent_tube(0.1)), []);
    assert_eq!(found(&bent_tube(1e-4)), [(FindingKind::HiddenTaxel, (0..6).collect::<Vec<u32>>())]);
}

#[test]
fn faces_that_point_inwards_are_distinguished() {
    let taxels = on_cube(0, DVec3::ZERO, 0.1).into_iter();
    let taxels = taxels.map(|taxel| Taxel { normal_in_link: -taxel.normal_in_link, ..taxel }).collect();
    let all: Vec<u32> = (0..6).collect();
    let inside_out = body(vec![part(flipped(cube(DVec3::ZERO, 0.1)), taxels)]);
    assert_eq!(found(&inside_out), [(FindingKind::HiddenTaxel, all.clone()), (FindingKind::InwardFaces, all)]);
}

#[test]
fn a_rest_pose_that_runs_into_itself_is_found() {
    let middle = part(cube(DVec3::Z * 0.3, 0.05), Vec::new());
    let base = || part(cube(DVec3::ZERO, 0.1), Vec::new());
    let tip = |joint| Part { joint, ..part(cube(DVec3::ZERO, 0.05), on_cube(0, DVec3::ZERO, 0.05)) };
    // It comes out in every drawn pose, which also uncovers its taxels.
    let runs = body(vec![base(), middle, tip(slide([0.5, 0.6]))]);
    let [finding] = &findings(&runs)[..] else { panic!("{:?}", findings(&runs)) };
    assert_eq!((finding.kind, finding.taxels.len()), (FindingKind::RestRunsIntoItself, 6));
    let text = finding.to_string();
    assert!(text.contains("`l2` into `l0`") && text.contains("outside the limits of joint `slide`"), "{text}");
    // What stays inside in every pose is built that way, and what is next to its parent meets it at the joint.
    let built = body(vec![base(), part(cube(DVec3::Z * 0.3, 0.05), Vec::new()), tip(slide([0.0, 0.001]))]);
    assert_eq!(found(&built), [(FindingKind::HiddenTaxel, (0..6).collect::<Vec<u32>>())]);
    assert_eq!(found(&body(vec![base(), tip(slide([0.5, 0.6]))])), []);
}

#[test]
fn the_search_reports_how_far_it_is() {
    let taxels = (0..100).flat_map(|k| on_cube(6 * k, DVec3::ZERO, 0.1)).collect();
    let body = body(vec![part(cube(DVec3::ZERO, 0.1), taxels)]);
    let mut shares = Vec::new();
    let found = lint_with_progress(&body, &[], None, &mut |share| shares.push(share));
    assert_eq!(found, lint(&body, &[]));
    assert!(shares.is_sorted() && shares.iter().all(|share| (0.0..1.0).contains(share)), "{shares:?}");
    // What is after the comparison with the surface: rays, on a machine of many cores in one piece.
    assert!(shares.last().is_some_and(|last| *last >= 0.4), "{shares:?}");
}
