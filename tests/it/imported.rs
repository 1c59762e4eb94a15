//! Meshes and robots of other formats: the same shape however it is written, where it belongs, in metres.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use glam::DVec3;
use somatic::author::mesh::{Geometry, MeshOptions, author_mjcf_skin, author_urdf_skin, open};
use somatic::author::{Authored, Recipe, author, author_csv_skin, author_icub};
use somatic::body::Body;
use somatic::internal::author::mesh::{Up, files};
use somatic::internal::body::Original;

/// The corners and sides, counter-clockwise seen from outside, of a box of 20 × 40 × 60 from the origin on.
const CORNERS: [[f64; 3]; 8] = [
    [0.0, 0.0, 0.0],
    [20.0, 0.0, 0.0],
    [0.0, 40.0, 0.0],
    [20.0, 40.0, 0.0],
    [0.0, 0.0, 60.0],
    [20.0, 0.0, 60.0],
    [0.0, 40.0, 60.0],
    [20.0, 40.0, 60.0],
];
const SIDES: [[usize; 4]; 6] = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];

fn triangles() -> Vec<[usize; 3]> {
    SIDES.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect()
}

fn text_stl() -> Vec<u8> {
    let mut text = "solid box\n".to_owned();
    for triangle in triangles() {
        text += " facet normal 0 0 0\n  outer loop\n";
        for corner in triangle {
            let [x, y, z] = CORNERS[corner];
            writeln!(text, "   vertex {x} {y} {z}").unwrap();
        }
        text += "  endloop\n endfacet\n";
    }
    (text + "endsolid box\n").into_bytes()
}

fn binary_stl() -> Vec<u8> {
    let mut bytes = vec![0; 80];
    bytes.extend((triangles().len() as u32).to_le_bytes());
    for triangle in triangles() {
        bytes.extend([0; 12]);
        for corner in triangle {
            CORNERS[corner].iter().for_each(|&x| bytes.extend((x as f32).to_le_bytes()));
        }
        bytes.extend([0; 2]);
    }
    bytes
}

fn obj() -> Vec<u8> {
    let mut text = "# a box\no box\n".to_owned();
    CORNERS.iter().for_each(|[x, y, z]| writeln!(text, "v {x} {y} {z}").unwrap());
    SIDES.iter().for_each(|[a, b, c, d]| writeln!(text, "f {} {} {} {}", a + 1, b + 1, c + 1, d + 1).unwrap());
    text.into_bytes()
}

fn ply() -> Vec<u8> {
    let mut text = "ply\nformat ascii 1.0\nelement vertex 8\nproperty float x\nproperty float y\nproperty float z\n\
                    element face 6\nproperty list uchar int vertex_indices\nend_header\n"
        .to_owned();
    CORNERS.iter().for_each(|[x, y, z]| writeln!(text, "{x} {y} {z}").unwrap());
    SIDES.iter().for_each(|[a, b, c, d]| writeln!(text, "4 {a} {b} {c} {d}").unwrap());
    text.into_bytes()
}

fn dae(up: &str, metre: f64) -> Vec<u8> {
    let list = |numbers: &mut dyn Iterator<Item = String>| numbers.collect::<Vec<_>>().join(" ");
    let places = list(&mut CORNERS.iter().flatten().map(ToString::to_string));
    let corners = list(&mut triangles().iter().flatten().map(ToString::to_string));
    format!(
        r##"<?xml version="1.0" encoding="utf-8"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
  <asset><unit name="own" meter="{metre}"/><up_axis>{up}</up_axis></asset>
  <library_geometries><geometry id="g" name="box"><mesh>
    <source id="p"><float_array id="a" count="24">{places}</float_array>
      <technique_common><accessor source="#a" count="8" stride="3"><param name="X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common></source>
    <vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
    <triangles count="12"><input semantic="VERTEX" source="#v" offset="0"/><p>{corners}</p></triangles>
  </mesh></geometry></library_geometries>
  <library_visual_scenes><visual_scene id="s"><node id="n"><instance_geometry url="#g"/></node></visual_scene></library_visual_scenes>
  <scene><instance_visual_scene url="#s"/></scene>
</COLLADA>"##
    )
    .into_bytes()
}

fn options() -> MeshOptions {
    MeshOptions::default()
}

fn unit(metres: f64) -> MeshOptions {
    let mut options = options();
    options.unit_m = Some(metres);
    options
}

fn body(path: &Path, options: &MeshOptions) -> Body {
    open(path, options).unwrap().read().unwrap().0
}

fn why(path: &Path, options: &MeshOptions) -> String {
    let why = open(path, options).unwrap_err().to_string();
    assert!(!why.contains('\n'), "{why}");
    why
}

/// The lower and upper corner of a link's skin in the world, and its area.
fn measured(body: &Body, link: &str) -> (DVec3, DVec3, f64) {
    let index = body.link_index(link).unwrap_or_else(|| panic!("there is no {link}"));
    let mut area = 0.0;
    let (mut low, mut high) = (DVec3::MAX, DVec3::MIN);
    for (_, corners) in body.triangles_at_rest().into_iter().filter(|(link, _)| *link == index) {
        area += (corners[1] - corners[0]).cross(corners[2] - corners[0]).length() / 2.0;
        corners.iter().for_each(|&p| (low, high) = (low.min(p), high.max(p)));
    }
    (low, high, area)
}

fn is_box(got: (DVec3, DVec3, f64), low: [f64; 3], high: [f64; 3]) {
    let (low, high) = (DVec3::from_array(low), DVec3::from_array(high));
    assert!(got.0.distance(low) < 1e-6 && got.1.distance(high) < 1e-6, "{got:?} is not from {low} to {high}");
    let size = high - low;
    let area = 2.0 * (size.x * size.y + size.y * size.z + size.z * size.x);
    // Corners are in single precision.
    assert!((got.2 - area).abs() < 1e-6, "{} is not {area} m²", got.2);
}

#[test]
fn one_shape_in_every_format_is_one_body() {
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes) in
        [("text.stl", text_stl()), ("binary.stl", binary_stl()), ("Box.OBJ", obj()), ("box.ply", ply())]
    {
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        let body = body(&path, &unit(1e-3));
        let link = path.file_stem().unwrap().to_str().unwrap();
        is_box(measured(&body, link), [0.0; 3], [0.02, 0.04, 0.06]);
        // With z up, z becomes y.
        let mut turned = unit(1e-3);
        turned.up = Some(Up::Z);
        is_box(measured(&self::body(&path, &turned), link), [0.0, 0.0, -0.04], [0.02, 0.06, 0.0]);
        // In metres it is too large to be likely.
        let notes = open(&path, &options()).unwrap().notes;
        assert!(notes.len() == 1 && notes[0].contains("--unit mm"), "{notes:?}");
        // Its outside is outside, and taxels are put there.
        let made =
            author(open(&path, &unit(1e-3)).unwrap(), &Recipe::simple(Some(60), None, &[]).unwrap(), |_| {}).unwrap();
        let middle = DVec3::new(0.01, 0.02, 0.03);
        for taxel in &made.body.taxels {
            assert!((taxel.position_in_link - middle).dot(taxel.normal_in_link) > 0.0, "{name}: {taxel:?}");
        }
    }
}

#[test]
fn a_collada_file_says_its_unit_and_what_is_up() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("box.dae");
    std::fs::write(&path, dae("Z_UP", 0.001)).unwrap();
    is_box(measured(&body(&path, &options()), "box"), [0.0, 0.0, -0.04], [0.02, 0.06, 0.0]);
    std::fs::write(&path, dae("Y_UP", 0.01)).unwrap();
    is_box(measured(&body(&path, &options()), "box"), [0.0; 3], [0.2, 0.4, 0.6]);
    assert!(why(&path, &unit(1e-3)).contains("leave --unit out"));
}

/// A robot of two links: a box of metres, and on a joint a mesh of a package, mirrored.
fn robot(folder: &Path) -> PathBuf {
    let path = folder.join("robot.urdf");
    std::fs::create_dir(folder.join("meshes")).unwrap();
    std::fs::write(folder.join("meshes/box.stl"), binary_stl()).unwrap();
    let text = r#"<?xml version="1.0"?>
<robot name="arm">
  <link name="hand">
    <visual><geometry><mesh filename="package://arm/meshes/box.stl" scale="0.001 0.001 -0.001"/></geometry></visual>
    <collision><origin xyz="0 0 0.1"/><geometry><sphere radius="0.05"/></geometry></collision>
  </link>
  <link name="base">
    <visual><origin xyz="0 0 0.5"/><geometry><box size="0.2 0.4 1"/></geometry></visual>
  </link>
  <link name="tool"/>
  <joint name="wrist" type="revolute"><parent link="base"/><child link="hand"/><origin xyz="1 0 2" rpy="0 0 1.5707963267948966"/></joint>
  <joint name="end" type="fixed"><parent link="hand"/><child link="tool"/><origin xyz="0 0 0.25"/></joint>
</robot>"#;
    std::fs::write(&path, text).unwrap();
    path
}

#[test]
fn links_of_a_robot_are_links_where_its_joints_put_them() {
    let folder = tempfile::tempdir().unwrap();
    let path = robot(folder.path());
    let mut with = options();
    with.packages = BTreeMap::from([("arm".to_owned(), folder.path().to_owned())]);
    let said = open(&path, &with).unwrap().notes;
    assert!(said.len() == 1 && said[0].contains("give --up y"), "{said:?}");
    assert_eq!(body(&path, &with).urdf_up(), Some(Up::Z));
    with.up = Some(Up::Y);
    let as_gltf = body(&path, &with);
    is_box(measured(&as_gltf, "base"), [-0.1, -0.2, 0.0], [0.1, 0.2, 1.0]);
    assert_eq!(as_gltf.urdf_up(), Some(Up::Y));
    with.up = Some(Up::Z);
    let whole = body(&path, &with);
    let links: Vec<(&str, Option<usize>)> = whole.links.iter().map(|l| (l.name.as_str(), l.parent)).collect();
    assert_eq!(links, [("base", None), ("hand", Some(0)), ("tool", Some(1))]);
    // URDF (x, y, z) is glTF (y, z, x).
    is_box(measured(&whole, "base"), [-0.2, 0.0, -0.1], [0.2, 1.0, 0.1]);
    // A quarter turn around z takes x to y and y to −x; the mirror takes z to −z.
    is_box(measured(&whole, "hand"), [0.0, 2.0 - 0.06, 1.0 - 0.04], [0.02, 2.0, 1.0]);
    let tool = whole.links[2].body_from_link.translation;
    assert!(tool.distance(DVec3::new(0.0, 2.25, 1.0)) < 1e-6, "{tool}");
    // What was outside before the mirror is outside.
    let made =
        author(open(&path, &with).unwrap(), &Recipe::simple(Some(80), None, &["hand".to_owned()]).unwrap(), |_| {})
            .unwrap();
    let middle = DVec3::new(0.01, 0.02, -0.03);
    assert!(made.body.taxels.iter().all(|t| (t.position_in_link - middle).dot(t.normal_in_link) > 0.0));
    assert_eq!(files(&path, &with), [path.clone(), folder.path().join("meshes/box.stl")]);
    let text = std::fs::read_to_string(&path).unwrap();
    let hand_of = |text: &str| {
        std::fs::write(&path, text).unwrap();
        let notes = open(&path, &with).unwrap().notes;
        (measured(&body(&path, &with), "hand"), notes)
    };
    let ((low, high, _), notes) = hand_of(&text.replace("package://", "package:///"));
    assert!(low.distance(DVec3::new(0.0, 1.94, 0.96)) < 1e-6 && notes.is_empty(), "{low} {high} {notes:?}");
    // A glTF and a COLLADA file are in the axes of the URDF, whatever points up in them.
    let stl = folder.path().join("meshes/box.stl");
    std::fs::write(folder.path().join("meshes/box.glb"), open(&stl, &unit(1.0)).unwrap().to_glb().unwrap()).unwrap();
    std::fs::write(folder.path().join("meshes/box.dae"), dae("Y_UP", 1.0)).unwrap();
    for other in ["box.glb", "box.dae"] {
        let ((low, high, _), _) = hand_of(&text.replace("box.stl", other));
        assert!(
            low.distance(DVec3::new(0.0, 1.94, 0.96)) < 1e-6 && high.distance(DVec3::new(0.02, 2.0, 1.0)) < 1e-6,
            "{other}"
        );
    }
    // Without its scale it is in millimetres.
    let (_, notes) = hand_of(&text.replace(" scale=\"0.001 0.001 -0.001\"", ""));
    assert!(
        notes.len() == 1 && notes[0].starts_with("link `hand` is 75 m across: if its numbers are millimetres"),
        "{notes:?}"
    );
    std::fs::write(&path, &text).unwrap();
    // The coarse shapes instead.
    with.geometry = Geometry::Collision;
    let coarse = body(&path, &with);
    let (low, high, area) = measured(&coarse, "hand");
    assert!(
        (area / (0.01 * std::f64::consts::PI) - 1.0).abs() < 0.01 && (high - low - DVec3::splat(0.1)).length() < 1e-3
    );
}

#[test]
fn what_a_robot_lacks_is_reported_with_its_line() {
    let folder = tempfile::tempdir().unwrap();
    let path = robot(folder.path());
    assert!(why(&path, &options()).contains("line 4: `package://arm/meshes/box.stl` is in the package `arm`"));
    let mut with = options();
    with.packages = BTreeMap::from([("arm".to_owned(), folder.path().join("meshes"))]);
    let too_deep = why(&path, &with);
    let hint = format!("meshes/meshes/box.stl: no such file; did you mean --package arm={}?", folder.path().display());
    assert!(too_deep.contains("line 4: ") && too_deep.ends_with(&hint), "{too_deep}");
    with.packages = BTreeMap::from([("arm".to_owned(), PathBuf::from("/no/such"))]);
    let missing = why(&path, &with);
    assert!(missing.contains("link `hand`") && missing.contains("box.stl: no such file"), "{missing}");
    with.packages = BTreeMap::from([("arm".to_owned(), folder.path().to_owned())]);
    let whole = std::fs::read_to_string(&path).unwrap();
    for (part, other, wanted) in [
        ("<robot name=\"arm\">", "<robot name=\"arm\" xmlns:xacro=\"x\"><xacro:include/>", "xacro"),
        ("<parent link=\"hand\"/>", "<parent link=\"hnad\"/>", "line 12: there is no link `hnad`"),
        ("<child link=\"tool\"/>", "<child link=\"hand\"/>", "child of two joints"),
        ("<box size=\"0.2 0.4 1\"/>", "<box size=\"0.2 0.4\"/>", "line 8: `size` is `0.2 0.4`"),
        ("<box size=\"0.2 0.4 1\"/>", "<torus/>", "line 8: a <torus> is not a shape"),
        ("</robot>", "", "not valid XML"),
        ("robot", "model", "not <robot>"),
        ("name=\"base\"", "name=\"tool\"", "two links are called `tool`"),
    ] {
        std::fs::write(&path, whole.replace(part, other)).unwrap();
        let why = why(&path, &with);
        assert!(why.contains(wanted) && why.contains("robot.urdf"), "{part}: {why}");
    }
    let ring =
        whole.replace("</robot>", "<joint name=\"r\"><parent link=\"tool\"/><child link=\"base\"/></joint></robot>");
    std::fs::write(&path, ring).unwrap();
    assert!(why(&path, &with).contains("ring"));
    let roots = whole.replace("</robot>", "<link name=\"other\"/></robot>");
    std::fs::write(&path, roots).unwrap();
    assert!(why(&path, &with).contains("two roots, `base` and `other`"));
    let mimic = whole.replace("rpy=\"0 0 1.5707963267948966\"/>", "/><mimic joint=\"wrist\"/>");
    std::fs::write(&path, mimic).unwrap();
    assert!(why(&path, &with).contains("line 11: `wrist` mimics itself"));
    let xacro = folder.path().join("robot.urdf.xacro");
    std::fs::write(&xacro, &whole).unwrap();
    assert!(why(&xacro, &with).contains("xacro robot.urdf.xacro > robot.urdf"));
}

#[test]
fn damaged_meshes_are_one_line_or_a_mesh() {
    let folder = tempfile::tempdir().unwrap();
    let mut errors = 0;
    for (name, whole) in [
        ("a.stl", binary_stl()),
        ("b.stl", text_stl()),
        ("c.obj", obj()),
        ("d.ply", ply()),
        ("e.dae", dae("Z_UP", 1.0)),
    ] {
        let path = folder.path().join(name);
        for round in 0..120 {
            let mut bytes = whole.clone();
            let at = bytes.len() * round / 120;
            match round % 3 {
                0 => bytes.truncate(at),
                1 => bytes[at] ^= 0x55,
                _ => bytes.splice(at..at, *b"-1e999 99999999 ").for_each(drop),
            }
            std::fs::write(&path, &bytes).unwrap();
            match open(&path, &options()) {
                Ok(file) => drop(file.read()),
                Err(error) => {
                    let text = error.to_string();
                    assert!(!text.contains('\n') && text.contains(name), "{text}");
                    errors += 1;
                }
            }
        }
    }
    assert!(errors > 100, "{errors}");
}

#[test]
fn a_robot_with_a_skin_keeps_every_taxel_of_it() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("skin.urdf");
    let text = r#"<?xml version="1.0"?>
<robot name="hand" xmlns="http://www.ros.org">
  <link name="palm"/>
  <link name="tip"><visual><geometry><box size="0.02 0.02 0.02"/></geometry></visual></link>
  <joint name="j" type="fixed"><parent link="palm"/><child link="tip"/><origin xyz="0 0 0.1"/></joint>
  <sensor name="array" update_rate="100">
    <parent link="palm"/>
    <origin xyz="0 0 0.03" rpy="0 1.5707963267948966 0"/>
    <tactile channel="palm"><array rows="3" cols="4" order="col-major" size="0.004 0.005" spacing="0.005 -0.006" offset="0.01 0"/></tactile>
  </sensor>
  <sensor name="camera"><parent link="palm"/><camera/></sensor>
  <sensor name="taxels">
    <parent link="tip"/>
    <tactile channel="tip">
      <taxel idx="2" xyz="0 0 0.01" rpy="0 0 0"><geometry><box size="0.003 0.002 0.001"/></geometry></taxel>
      <taxel idx="0" xyz="0.01 0 0" rpy="0 1.5707963267948966 0"><geometry><mesh filename="no.stl"/></geometry></taxel>
    </tactile>
  </sensor>
</robot>"#;
    std::fs::write(&path, text).unwrap();
    let made = author_urdf_skin(&path, &options()).unwrap();
    assert_eq!(
        made.places.iter().map(|place| (place.name.as_str(), place.ids.len())).collect::<Vec<_>>(),
        [("array", 12), ("taxels", 2)]
    );
    let ids: Vec<u32> = made.body.taxels.iter().map(|taxel| taxel.id).collect();
    assert_eq!(ids, (0..12).chain([12, 14]).collect::<Vec<_>>());
    let taxel = |id: u32| &made.body.taxels[made.body.taxel_index(id).unwrap()];
    // Row 1, column 2 by columns; the sensor's z is the link's x, its x the link's −z.
    let seven = taxel(7);
    assert!(seven.position_in_link.distance(DVec3::new(0.0, -0.012, 0.03 + 0.005)) < 1e-7, "{seven:?}");
    assert!(seven.normal_in_link.distance(DVec3::X) < 1e-6 && (seven.area - 2e-5).abs() < 1e-10, "{seven:?}");
    assert!(taxel(14).position_in_link.distance(DVec3::Z * 0.01) < 1e-7 && (taxel(14).area - 6e-6).abs() < 1e-10);
    assert_eq!(made.body.links[taxel(12).link].name, "tip");
    let held: std::collections::BTreeSet<u32> =
        made.body.fields.iter().flat_map(|field| field.members.keys().copied()).collect();
    assert_eq!(held.len(), 14, "every taxel is in a field");
    for (part, other, wanted) in [
        ("idx=\"0\"", "idx=\"2\"", "line 12: sensor `taxels` has a second taxel of index 2"),
        ("<parent link=\"tip\"/>\n    <tactile", "<parent link=\"tpi\"/>\n    <tactile", "no such link"),
        ("rows=\"3\"", "rows=\"0\"", "an array of 0 rows"),
        ("col-major", "diagonal", "row-major or col-major"),
        ("<tactile", "<visual2", "not valid XML"),
    ] {
        std::fs::write(&path, text.replace(part, other)).unwrap();
        let why = author_urdf_skin(&path, &options()).unwrap_err().to_string();
        assert!(why.contains(wanted) && !why.contains('\n'), "{part}: {why}");
    }
}

#[test]
fn the_icubs_files_are_a_body_without_a_mesh() {
    let Some(folder) = crate::common::data("layouts/icub") else { return };
    let files = ["left_hand_V2_1.txt", "left_forearm_V2.txt", "torso.txt"].map(|name| folder.join(name));
    let made = author_icub(&files).unwrap();
    assert_eq!((made.body.links.len(), made.places.len()), (3, 3));
    let placed: usize = made.places.iter().map(|place| place.ids.len()).sum();
    assert_eq!(made.body.taxels.len(), placed);
    for (index, place) in made.places.iter().enumerate() {
        let text = std::fs::read_to_string(&files[index]).unwrap();
        let file = somatic::internal::author::icub::IcubFile::read(&text).unwrap();
        assert_eq!(place.ids.len(), file.taxels().count());
        assert!(place.ids.iter().all(|id| id / 1000 >= index as u32), "{:?}", place.ids);
    }
    assert!(somatic::Engine::new(&made.body, somatic::Options::default()).is_ok());
}

#[test]
fn what_is_deep_or_claims_a_lot_is_one_line_in_no_time() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| {
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        path
    };
    let mjcf = |depth: usize| {
        format!("<mujoco><worldbody>{}{}</worldbody></mujoco>", "<body>".repeat(depth), "</body>".repeat(depth))
    };
    let collada = |depth: usize| format!("<COLLADA>{}{}</COLLADA>", "<node>".repeat(depth), "</node>".repeat(depth));
    let urdf = |depth: usize| format!("<robot>{}{}</robot>", "<link>".repeat(depth), "</link>".repeat(depth));
    let skin = |path: &Path| author_mjcf_skin(path, &options()).unwrap_err().to_string();
    // Also where there is little stack.
    let small = std::thread::Builder::new().stack_size(512 << 10);
    std::thread::scope(|scope| {
        let work = || {
            let bare = write("a.xml", &mjcf(490));
            let why_not = skin(&bare);
            assert!(why_not.contains("neither <tactile> nor touch_grid"), "{why_not}");
            assert!(why_not.contains("URDF or mesh: somatic author robot.urdf --taxels 500 -o body.glb"), "{why_not}");
            let as_body = Original::open(&bare).unwrap_err().to_string();
            assert!(as_body.contains("this is an MJCF, not a glTF") && as_body.contains("--mjcf-skin"), "{as_body}");
            assert!(skin(&write("a.xml", &mjcf(100_000))).contains("nested over 500 deep"));
            assert!(why(&write("a.dae", &collada(490)), &options()).contains("no <scene>"));
            assert!(why(&write("a.dae", &collada(100_000)), &options()).contains("nested over 500 deep"));
            assert!(why(&write("a.urdf", &urdf(490)), &options()).contains("no `name`"));
            assert!(why(&write("a.urdf", &urdf(100_000)), &options()).contains("nested over 500 deep"));
        };
        small.spawn_scoped(scope, work).unwrap().join().unwrap();
    });
    let grid = "<mujoco><worldbody><body><geom size=\"1\"/><site name=\"s\"/></body></worldbody><sensor>\
                <plugin plugin=\"mujoco.sensor.touch_grid\" objname=\"s\"><config key=\"size\" value=\"4000 4000\"/>\
                <config key=\"fov\" value=\"45 45\"/></plugin></sensor></mujoco>";
    assert!(skin(&write("a.xml", grid)).contains("a touch grid of 4000 × 4000 taxels"));
    assert!(
        skin(&write("a.xml", &grid.replace("4000 4000", "2.9 3"))).contains("2.9 × 3 taxels; give it whole numbers")
    );
}

/// A model for MuJoCo without files of its own.
fn mjcf() -> String {
    let text = include_str!("../mujoco/skin.xml");
    text.lines().filter(|line| !line.contains("\"stl\"") && !line.contains("\"obj\"")).collect::<Vec<_>>().join("\n")
}

/// Damages skins of others in many ways: each is read or refused in one line, and nothing panics or fills the memory.
///
/// `SOMATIC_MUTATIONS` files of each kind, by default two hundred.
#[test]
fn damaged_skins_are_one_line_or_a_body() {
    const TABLE: &str = "id,link,x,y,z,nx,ny,nz,area,modality\n1,a,0,0,0,0,0,1,1e-4,pressure\n\
                         2,a,0.01,0,0,0,0,1,,proximity\n3,\"b, c\",0,0.01,0,0,1,0,1e-4,\n";
    const ROBOT: &str = "<robot name=\"r\"><link name=\"a\"/><link name=\"b\"/><joint name=\"j\"><parent link=\"a\"/>\
                         <child link=\"b\"/><origin xyz=\"0 0 1\" rpy=\"0 1 0\"/></joint><sensor name=\"s\">\
                         <parent link=\"b\"/><tactile channel=\"c\"><array rows=\"3\" cols=\"4\" size=\"0.01 0.01\"/>\
                         </tactile></sensor></robot>";
    const WORDS: [&str; 16] = [
        "",
        "0",
        "-1",
        "1e308",
        "1e-320",
        "nan",
        "inf",
        "4294967296",
        "99999",
        "\"",
        "<",
        "/>",
        ",",
        "body",
        "ü",
        "1 2 3",
    ];
    let count: u64 = std::env::var("SOMATIC_MUTATIONS").ok().and_then(|word| word.parse().ok()).unwrap_or(200);
    let folder = tempfile::tempdir().unwrap();
    let mut state = 0x9E37_79B9_7F4A_7C15_u64;
    let mut below = |end: usize| {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as usize % end.max(1)
    };
    type Author = fn(&Path) -> somatic::Result<Authored>;
    let kinds: [(&str, String, Author); 3] = [
        ("skin.xml", mjcf(), |path| author_mjcf_skin(path, &options())),
        ("skin.urdf", ROBOT.to_owned(), |path| author_urdf_skin(path, &options())),
        ("skin.csv", TABLE.to_owned(), |path| author_csv_skin(path)),
    ];
    for (name, whole, author) in kinds {
        let path = folder.path().join(name);
        std::fs::write(&path, &whole).unwrap();
        author(&path).unwrap();
        let (mut read, mut refused) = (0, 0);
        for _ in 0..count {
            let mut bytes = whole.clone().into_bytes();
            for _ in 0..1 + below(2) {
                let at = below(bytes.len());
                match below(5) {
                    0 => bytes[at] = below(256) as u8,
                    1 => drop(bytes.drain(at..(at + below(30)).min(bytes.len()))),
                    2 => drop(bytes.splice(at..at, WORDS[below(WORDS.len())].bytes())),
                    3 => bytes.truncate(at.max(1)),
                    _ => {
                        // A word for another.
                        let ends = |byte: &u8| b" \"\n,<>=".contains(byte);
                        let begin = bytes[..at].iter().rposition(ends).map_or(0, |begin| begin + 1);
                        let end = bytes[at..].iter().position(ends).map_or(bytes.len(), |end| at + end);
                        drop(bytes.splice(begin..end, WORDS[below(WORDS.len())].bytes()));
                    }
                }
                if bytes.is_empty() {
                    bytes.push(b'\n');
                }
            }
            std::fs::write(&path, &bytes).unwrap();
            match author(&path) {
                Ok(made) => {
                    read += 1;
                    let is_sound = |t: &somatic::body::Taxel| {
                        t.position_in_link.is_finite()
                            && (t.normal_in_link.length() - 1.0).abs() < 1e-5
                            && t.area >= 0.0
                    };
                    assert!(made.body.taxels.iter().all(is_sound), "{}", String::from_utf8_lossy(&bytes));
                }
                Err(error) => {
                    refused += 1;
                    let text = error.to_string();
                    assert!(!text.contains('\n') && text.contains(name), "{text}");
                }
            }
        }
        assert!(read > count / 50 && refused > count / 20, "{name}: {read} read, {refused} refused");
    }
}
