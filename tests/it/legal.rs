//! Bodies that are unusual and legal: they must be read, and read right.

use crate::draft::{Draft, FLOAT, U16};
use glam::{DVec3, Mat4, Vec3};
use serde_json::{Value, json};
use somatic::Body;
use somatic::internal::body::Home;

const CORNERS: [[f32; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0]];

/// A body whose node shows the one primitive `primitive` makes.
fn plate(primitive: impl FnOnce(&mut Draft) -> Value) -> Body {
    let mut draft = Draft::default();
    let primitive = primitive(&mut draft);
    let mesh = draft.mesh(&primitive);
    draft.node(json!({"name": "plate", "mesh": mesh}));
    draft.load().unwrap()
}

fn positions(body: &Body) -> Vec<[f32; 3]> {
    body.surfaces[0].positions.iter().map(|p| p.as_vec3().to_array()).collect()
}

#[test]
fn strided_and_offset_views_are_read_through() {
    let body = plate(|draft| {
        // Eight bytes in front, then position and eight bytes of something else in turn.
        let mut bytes = vec![0xAB; 8];
        for corner in CORNERS {
            bytes.extend_from_slice(bytemuck::cast_slice(&corner));
            bytes.extend_from_slice(&[0xCD; 8]);
        }
        let accessor = draft.accessor(FLOAT, "VEC3", 4, &bytes);
        draft.json["bufferViews"][0]["byteStride"] = json!(20);
        draft.json["accessors"][accessor]["byteOffset"] = json!(8);
        draft.bounds(accessor);
        json!({"attributes": {"POSITION": accessor}, "mode": 5})
    });
    assert_eq!(positions(&body), CORNERS);
}

/// Says of `accessor` that its elements 1 and 3 are `values`.
fn make_sparse(draft: &mut Draft, accessor: usize, values: &[[f32; 3]; 2]) {
    let indices = draft.view(bytemuck::cast_slice(&[1_u16, 3]));
    let values = draft.view(bytemuck::cast_slice(values));
    draft.json["accessors"][accessor]["sparse"] = json!({
        "count": 2, "indices": {"bufferView": indices, "componentType": U16}, "values": {"bufferView": values},
    });
}

#[test]
fn sparse_accessors_change_what_they_say_and_nothing_else() {
    let moved = [[9.0, 0.0, 0.0], [9.0, 9.0, 0.0]];
    let over_data = plate(|draft| {
        let accessor = draft.points(&CORNERS);
        make_sparse(draft, accessor, &moved);
        json!({"attributes": {"POSITION": accessor}, "mode": 5})
    });
    assert_eq!(positions(&over_data), [CORNERS[0], moved[0], CORNERS[2], moved[1]]);
    let over_nothing = plate(|draft| {
        let accessor = draft.points(&CORNERS);
        make_sparse(draft, accessor, &moved);
        draft.json["accessors"][accessor].as_object_mut().unwrap().remove("bufferView");
        json!({"attributes": {"POSITION": accessor}, "mode": 5})
    });
    assert_eq!(positions(&over_nothing), [[0.0; 3], moved[0], [0.0; 3], moved[1]]);
}

#[test]
fn an_accessor_without_data_is_zeros() {
    let mut draft = Draft::default();
    let mesh = draft.taxels(&[[0.5; 3]], &[3.0]);
    let zeros = draft.push("accessors", json!({"componentType": FLOAT, "type": "SCALAR", "count": 1}));
    draft.json["meshes"][mesh]["primitives"][0]["attributes"]["_TAXEL_ID"] = json!(zeros);
    draft.node(json!({"mesh": mesh}));
    assert_eq!(draft.load().unwrap().taxels[0].id, 0);
}

#[test]
fn strips_fans_and_lists_turn_the_same_way() {
    let read = |mode: u32, points: &[[f32; 3]], indices: Option<&[u16]>| {
        let body = plate(|draft| {
            let mut primitive = json!({"mode": mode, "attributes": {"POSITION": draft.points(points)}});
            if let Some(indices) = indices {
                primitive["indices"] = json!(draft.indices(indices));
            }
            primitive
        });
        let surface = body.surface_in_link(0);
        for p in [DVec3::new(0.9, 0.8, 0.3), DVec3::new(0.2, 0.1, 0.3), DVec3::new(0.1, 0.3, 0.3)] {
            let hit = surface.nearest(p).unwrap();
            assert_eq!(hit.normal, DVec3::Z, "mode {mode}");
            assert!((hit.position - p.with_z(0.0)).length() < 1e-12, "mode {mode}");
        }
        body.surfaces[0].triangles.len()
    };
    assert_eq!(read(4, &CORNERS, Some(&[0, 1, 2, 1, 3, 2])), 2);
    assert_eq!(read(5, &CORNERS, None), 2);
    assert_eq!(read(5, &CORNERS, Some(&[0, 1, 2, 3, 3])), 2, "a corner named twice covers nothing");
    let [a, b, d, c] = CORNERS;
    assert_eq!(read(6, &[a, b, c, d], None), 2);
}

#[test]
fn lines_points_and_empty_meshes_are_no_surface() {
    for mode in 0..4 {
        let body = plate(|draft| json!({"mode": mode, "attributes": {"POSITION": draft.points(&CORNERS)}}));
        assert!(body.surfaces.is_empty() && body.taxels.is_empty());
    }
}

#[test]
fn millimetres_come_out_in_metres() {
    let mut draft = Draft::default();
    let points = draft.points(&[[0.0, 0.0, 0.0], [100.0, 0.0, 0.0], [0.0, 100.0, 0.0]]);
    let mesh = draft.mesh(&json!({"attributes": {"POSITION": points}}));
    let taxels = draft.taxels(&[[20.0, 30.0, 0.0]], &[5.0]);
    draft.json["nodes"] = json!([
        {"name": "root", "scale": [0.001, 0.001, 0.001], "children": [1]},
        {"name": "hand", "translation": [0.0, 500.0, 0.0], "mesh": mesh, "children": [2]},
        {"name": "hand.taxels", "mesh": taxels},
    ]);
    let body = draft.load().unwrap();
    let hand = body.link_index("hand").unwrap();
    let link = &body.links[hand];
    assert!((link.body_from_link.translation - DVec3::new(0.0, 0.5, 0.0)).length() < 1e-7);
    assert!((link.body_from_link.matrix3.determinant() - 1.0).abs() < 1e-12, "a link's frame is rigid");
    let taxel = &body.taxels[0];
    assert_eq!(taxel.link, hand);
    assert!((taxel.position_in_link - DVec3::new(0.02, 0.03, 0.0)).length() < 1e-7);
    assert!((taxel.normal_in_link - DVec3::Z).length() < 1e-12);
    // 1e-6 was square millimetres times a million less: areas are scaled as the points are.
    assert!((taxel.area / 1e-12 - 1.0).abs() < 1e-6, "{}", taxel.area);
    let hit = body.surface_in_link(hand).nearest(DVec3::new(0.09, 0.001, 0.01)).unwrap();
    assert!((hit.position - DVec3::new(0.09, 0.001, 0.0)).length() < 1e-7);
}

#[test]
fn a_mirrored_node_keeps_its_outside_outside() {
    let mut draft = Draft::default();
    let points = draft.points(&CORNERS);
    let mesh = draft.mesh(&json!({"mode": 5, "attributes": {"POSITION": points}}));
    let taxels = draft.taxels(&[[0.25, 0.5, 0.0]], &[5.0]);
    draft.json["nodes"] = json!([
        {"name": "left", "scale": [-1.0, 1.0, 1.0], "mesh": mesh, "children": [1]},
        {"name": "left.taxels", "mesh": taxels},
    ]);
    let body = draft.load().unwrap();
    let link = &body.links[0];
    assert!((link.body_from_link.matrix3.determinant() - 1.0).abs() < 1e-12);
    let in_body = |p: DVec3| link.body_from_link.transform_point3(p);
    let taxel = &body.taxels[0];
    assert!((in_body(taxel.position_in_link) - DVec3::new(-0.25, 0.5, 0.0)).length() < 1e-12);
    let normal = link.body_from_link.transform_vector3(taxel.normal_in_link);
    assert!((normal - DVec3::Z).length() < 1e-12, "{normal}");
    let hit = body.surface_in_link(0).nearest(taxel.position_in_link).unwrap();
    assert!((hit.normal - taxel.normal_in_link).length() < 1e-12, "surface and taxel face the same way");
    assert!((hit.position - taxel.position_in_link).length() < 1e-12);
    assert!((taxel.area / 1e-6 - 1.0).abs() < 1e-6);
}

#[test]
fn normals_and_areas_stretch_as_surfaces_do() {
    let mut draft = Draft::default();
    let half = 0.5_f32.sqrt();
    let mesh = draft.taxels(&[[0.0; 3]], &[5.0]);
    // A slope of 45°, then twice as wide in x.
    let slope = [draft.scalars(&[half]), draft.scalars(&[half])];
    draft.json["meshes"][mesh]["primitives"][0]["attributes"]["_NX"] = json!(slope[0]);
    draft.json["meshes"][mesh]["primitives"][0]["attributes"]["_NZ"] = json!(slope[1]);
    draft.node(json!({"name": "wide", "scale": [2.0, 1.0, 1.0], "mesh": mesh}));
    let taxel = draft.load().unwrap().taxels.remove(0);
    assert!((taxel.normal_in_link - DVec3::new(1.0, 0.0, 2.0).normalize()).length() < 1e-7);
    assert!((taxel.area / (2.5_f64.sqrt() * 1e-6) - 1.0).abs() < 1e-6, "{}", taxel.area);
}

#[test]
fn a_flattened_node_gives_no_number_that_is_none() {
    for scale in [[0.0, 1.0, 1.0], [0.0, 0.0, 0.0], [1.0, 1.0, 0.0]] {
        let mut draft = Draft::default();
        let points = draft.points(&CORNERS);
        let plate = draft.mesh(&json!({"mode": 5, "attributes": {"POSITION": points}}));
        let mesh = draft.taxels(&[[0.5; 3]], &[5.0]);
        draft.json["nodes"] = json!([
            {"name": "base", "mesh": plate, "children": [1]},
            {"name": "flat", "scale": scale, "children": [2]},
            {"name": "flat.taxels", "mesh": mesh},
        ]);
        let taxel = draft.load().unwrap().taxels.remove(0);
        assert!(taxel.area.is_finite() && taxel.position_in_link.is_finite(), "{taxel:?}");
        assert!((taxel.normal_in_link.length() - 1.0).abs() < 1e-12, "{taxel:?}");
    }
}

#[test]
fn a_normal_that_is_no_number_is_taken_from_the_surface() {
    let mut draft = Draft::default();
    let points = draft.points(&CORNERS);
    let plate = draft.mesh(&json!({"mode": 5, "attributes": {"POSITION": points}}));
    let taxels = draft.taxels(&[[0.5, 0.5, 0.0]], &[5.0]);
    let bad = draft.scalars(&[f32::NAN]);
    draft.json["meshes"][taxels]["primitives"][0]["attributes"]["_NX"] = json!(bad);
    draft.json["nodes"] = json!([{"name": "hand", "mesh": plate, "children": [1]}, {"mesh": taxels}]);
    let body = draft.load().unwrap();
    assert_eq!(body.taxels[0].normal_in_link, DVec3::Z);
    assert!((body.taxels[0].area / 1e-6 - 1.0).abs() < 1e-6);
    assert!(body.findings[0].contains("no normal of their own"), "{:?}", body.findings);
}

#[test]
fn skinned_points_hang_on_their_joint_and_not_on_their_node() {
    let mut draft = Draft::default();
    let mesh = draft.taxels(&[[0.0, 1.5, 0.1], [0.0, 0.5, 0.1]], &[1.0, 2.0]);
    // The first point is mostly the forearm's, the second the upper arm's, through a second set of joints.
    let zeros = draft.accessor(U16, "VEC4", 2, &[0; 16]);
    let weights: [[f32; 4]; 2] = [[0.2, 0.0, 0.0, 0.0], [0.4, 0.3, 0.0, 0.0]];
    let weights = draft.accessor(FLOAT, "VEC4", 2, bytemuck::cast_slice(&weights));
    let joints: [[u16; 4]; 2] = [[1, 0, 0, 0], [1, 0, 0, 0]];
    let joints = draft.accessor(U16, "VEC4", 2, bytemuck::cast_slice(&joints));
    let more: [[f32; 4]; 2] = [[0.8, 0.0, 0.0, 0.0], [0.3, 0.0, 0.0, 0.0]];
    let more = draft.accessor(FLOAT, "VEC4", 2, bytemuck::cast_slice(&more));
    let attributes = &mut draft.json["meshes"][mesh]["primitives"][0]["attributes"];
    for (name, accessor) in [("JOINTS_0", zeros), ("WEIGHTS_0", weights), ("JOINTS_1", joints), ("WEIGHTS_1", more)] {
        attributes[name] = json!(accessor);
    }
    let binds = [Mat4::IDENTITY, Mat4::from_translation(Vec3::new(0.0, -1.0, 0.0))].map(|m| m.to_cols_array());
    let binds = draft.accessor(FLOAT, "MAT4", 2, bytemuck::cast_slice(&binds));
    draft.json["skins"] = json!([{"joints": [0, 1], "inverseBindMatrices": binds}]);
    draft.json["nodes"] = json!([
        {"name": "upper_arm", "children": [1]},
        {"name": "forearm", "translation": [0.3, 1.0, 0.0], "rotation": [0.0, 0.0, 1.0, 0.0]},
        {"name": "far_away", "translation": [100.0, 0.0, 0.0], "scale": [7.0, 7.0, 7.0], "children": [3]},
        {"name": "skin.taxels", "translation": [5.0, 5.0, 5.0], "mesh": mesh, "skin": 0},
    ]);
    let body = draft.load().unwrap();
    let place = |taxel: usize| {
        let taxel = &body.taxels[taxel];
        (body.links[taxel.link].name.as_str(), taxel.position_in_link.as_vec3().to_array())
    };
    assert_eq!(place(0), ("forearm", [0.0, 0.5, 0.1]));
    assert_eq!(place(1), ("upper_arm", [0.0, 0.5, 0.1]));
}

#[test]
fn links_have_names_of_their_own() {
    let mut draft = Draft::default();
    draft.json["nodes"] = json!([
        {"name": "finger", "children": [1, 2, 3]}, {"name": "finger"}, {}, {"name": "finger"}, {"name": "finger#2"}, {},
    ]);
    let body = draft.load().unwrap();
    let names: Vec<&str> = body.links.iter().map(|link| link.name.as_str()).collect();
    assert_eq!(names, ["finger", "finger#2", "node_2", "finger#3", "finger#2#2", "node_5"]);
    assert!(body.links.iter().enumerate().all(|(index, link)| link.parent.is_none_or(|parent| parent < index)));
}

#[test]
fn taxels_and_fields_are_no_links() {
    let mut draft = Draft::default();
    let mesh = draft.taxels(&[[0.1, 0.2, 0.3]], &[5.0]);
    let field = r#"{"version":1,"name":"palm","members":{"5":[0.5,0.01,-0.02]},"chart":{"kind":"plane","u":[0,1,0]}}"#;
    draft.json["nodes"] = json!([
        {"name": "hand", "children": [1, 2]},
        {"name": "hand.taxels", "translation": [1.0, 0.0, 0.0], "mesh": mesh},
        {"name": "palm.001", "extras": {"somatic_field": field, "note": "Blender renamed me"}, "children": [3]},
        {"name": "thumb"},
    ]);
    let body = draft.load().unwrap();
    assert_eq!(body.links.iter().map(|l| l.name.as_str()).collect::<Vec<_>>(), ["hand", "thumb"]);
    assert_eq!(body.links[1].parent, Some(0));
    assert_eq!(body.fields[0].name, "palm");
    assert_eq!(body.fields[0].members[&5].uv, Some([0.01, -0.02]));
    let position = body.taxels[0].position_in_link;
    assert!((position - DVec3::new(1.1, 0.2, 0.3)).length() < 1e-6);
}

#[test]
fn fields_without_taxels_are_reported() {
    let mut draft = Draft::default();
    draft.field(r#"{"version":1,"name":"palm","members":{"5":[1]}}"#);
    let body = draft.load().unwrap();
    assert!(body.findings[0].contains("use_mesh_vertices"), "{:?}", body.findings);
}

#[test]
fn the_example_in_the_specification_is_a_body() {
    let page = include_str!("../../docs/reference/layout.md");
    let example = page.rsplit("```").nth(1).unwrap().strip_prefix("json").unwrap();
    let mut json: Value = serde_json::from_str(example).unwrap();
    let numbers = [0.0, 0.0, 0.0, 0.01, 0.0, 0.0, 17.0, 18.0, 1.0, 1.0, 0.0, 0.0_f32];
    let mut draft = Draft { bytes: bytemuck::cast_slice(&numbers).to_vec(), ..Draft::default() };
    std::mem::swap(&mut draft.json, &mut json);
    let body = draft.load().unwrap();
    assert_eq!(body.taxels.iter().map(|t| t.id).collect::<Vec<_>>(), [17, 18]);
    assert_eq!(body.taxels[1].normal_in_link, DVec3::Z);
    assert_eq!(body.fields[0].members.len(), 2);
    assert!(body.findings.is_empty(), "{:?}", body.findings);
}

#[test]
fn a_rigid_mesh_says_who_carries_it() {
    let body = plate(|draft| json!({"mode": 5, "attributes": {"POSITION": draft.points(&CORNERS)}}));
    assert!(matches!(body.surfaces[0].home, Home::Rigid { link: 0, .. }));
    assert_eq!(body.surfaces[0].carrier(3), 0);
}
