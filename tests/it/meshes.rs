//! Real meshes, where they are at hand: what Blender and a WebXR project exported is read as they meant it.

use crate::common::data;
use glam::DVec3;
use somatic::Body;
use somatic::body::Surface;
use somatic::internal::body::Home;

fn load(part: &str) -> Option<Body> {
    Some(Body::load(data(part)?).unwrap())
}

fn extent(surface: &Surface) -> DVec3 {
    let low = surface.positions.iter().copied().reduce(DVec3::min).unwrap();
    let high = surface.positions.iter().copied().reduce(DVec3::max).unwrap();
    high - low
}

#[test]
fn a_hand_of_25_joints() {
    let Some(body) = load("meshes/webxr/generic-hand_left.glb") else { return };
    assert_eq!(body.links.len(), 30);
    let [skin] = &body.surfaces[..] else { panic!("{} surfaces", body.surfaces.len()) };
    assert_eq!((skin.positions.len(), skin.triangles.len()), (1360, 2314));
    let Home::Skinned { joints, heaviest, .. } = &skin.home else { panic!("the hand is skinned") };
    assert_eq!((joints.len(), heaviest.len()), (25, 1360));
    // Every fingertip's own skin lies within two centimetres of its joint.
    for finger in ["thumb", "index-finger", "middle-finger", "ring-finger", "pinky-finger"] {
        let tip = body.link_index(&format!("{finger}-tip")).unwrap();
        let hit = body.surface_in_link(tip).nearest(DVec3::ZERO).unwrap();
        assert!(hit.position.length() < 0.02, "{finger}: {}", hit.position);
    }
    let root = body.link_index("Armature").unwrap();
    assert_eq!(body.common_ancestor(0..body.links.len()), Some(root));
    let length = extent(skin).max_element();
    assert!((0.15..0.25).contains(&length), "a hand of {length} m");
}

#[test]
fn a_cylinder_whose_pose_is_not_its_bind_pose() {
    let Some(body) = load("meshes/blender_io/03_skinned_cylinder/03_skinned_cylinder.gltf") else { return };
    let [skin] = &body.surfaces[..] else { panic!("{} surfaces", body.surfaces.len()) };
    assert_eq!((skin.positions.len(), skin.triangles.len()), (750, 316));
    let Home::Skinned { joints, heaviest, .. } = &skin.home else { panic!("the cylinder is skinned") };
    let names: Vec<&str> = joints.iter().map(|(link, _)| body.links[*link].name.as_str()).collect();
    assert_eq!(names, ["Joint_One", "Joint_Two", "Joint_Three", "Joint_Four"]);
    // At bind the joints stand in line, one metre apart, so that each one's own skin is around its axis y.
    for (index, (link, link_from_mesh)) in joints.iter().enumerate() {
        let own = skin.positions.iter().zip(heaviest).filter(|&(_, joint)| *joint == index);
        for (position, _) in own {
            let p = link_from_mesh.transform_point3(*position);
            assert!(p.with_y(0.0).length() < 1.01, "{}: {p}", body.links[*link].name);
        }
    }
    let bind = |joint: usize| joints[joint].1.inverse().translation;
    let bend = (bind(1) - bind(0)).angle_between(bind(3) - bind(2));
    assert!(bend < 1e-5, "straight at bind: {bend}");
    // As the file poses them, they are bent.
    let rest = |joint: usize| body.links[joints[joint].0].body_from_link.translation;
    let bend = (rest(1) - rest(0)).angle_between(rest(3) - rest(2));
    assert!((bend.to_degrees() - 30.0).abs() < 0.01, "bent by 30° in the file's pose: {bend}");
}

#[test]
fn a_head_and_ten_cubes() {
    let Some(body) = load("meshes/blender_io/02_suzanne/02_suzanne.gltf") else { return };
    assert_eq!((body.links.len(), body.surfaces.len()), (2, 1));
    assert_eq!((body.surfaces[0].positions.len(), body.surfaces[0].triangles.len()), (2160, 3936));
    assert!(body.taxels.is_empty() && body.fields.is_empty());

    let body = load("meshes/blender_io/06_parent-inverse-anim/06_parent-inverse-anim.gltf").unwrap();
    assert_eq!((body.links.len(), body.surfaces.len()), (12, 10));
    assert!(body.surfaces.iter().all(|s| s.positions.len() == 24 && s.triangles.len() == 12));
    // A child of a parent scaled to a half: its frame stays rigid, its cube is half as large.
    let child = body.link_index("ChildScale").unwrap();
    let link = &body.links[child];
    assert!((link.body_from_link.translation - DVec3::new(-4.0, 4.0, 0.0)).length() < 1e-6);
    assert!((link.body_from_link.matrix3.determinant() - 1.0).abs() < 1e-9);
    let cube = body.surfaces.iter().find(|s| s.name == "ChildScale").unwrap();
    let hit = body.surface_in_link(child).nearest(DVec3::new(0.0, 3.0, 0.0)).unwrap();
    assert!((hit.position.y - extent(cube).y / 4.0).abs() < 1e-6, "{}", hit.position);
}
