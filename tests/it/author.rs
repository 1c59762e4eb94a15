//! Skins put on meshes: where taxels come to lie, what stays of the file, and what is refused in one line.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::sync::mpsc;
use std::time::{Duration, Instant};

use glam::{DQuat, DVec3};
use serde_json::{Value, json};
use somatic::author::mesh::{self, MeshOptions};
use somatic::author::{Authored, Recipe, author};
use somatic::body::Body;
use somatic::field::FieldSet;
use somatic::internal::body::{Glb, MeshData, Original};
use somatic::{Result, bundled};

use crate::common::data;
use crate::draft::Draft;

/// A square of 0.2 m × 0.1 m in the plane z = 0 that looks along +z, of `across` × 10 squares, drawn `scale` times as large;
/// painted with `_DENSITY`, 1 on the right half, and with a colour that is red on the upper.
fn sheet(draft: &mut Draft, across: u32, scale: f32) -> Value {
    let (mut positions, mut colours, mut density) = (Vec::new(), Vec::new(), Vec::new());
    for y in 0..=10 {
        for x in 0..=across {
            let (x, y) = (0.2 * x as f32 / across as f32, 0.01 * y as f32);
            positions.push([scale * x, scale * y, 0.0]);
            density.push(f32::from(x > 0.1));
            colours.push([f32::from(y > 0.0501), 0.25, 0.0, 1.0]);
        }
    }
    let corner = |x: u32, y: u32| y * (across + 1) + x;
    let squares = (0..10).flat_map(|y| (0..across).map(move |x| (x, y)));
    let indices: Vec<u32> = squares
        .flat_map(|(x, y)| {
            let [a, b, c, d] = [corner(x, y), corner(x + 1, y), corner(x + 1, y + 1), corner(x, y + 1)];
            [a, b, c, a, c, d]
        })
        .collect();
    let positions = draft.points(&positions);
    let density = draft.scalars(&density);
    let colours = draft.accessor(5126, "VEC4", colours.len(), bytemuck::cast_slice(&colours));
    let indices = draft.accessor(5125, "SCALAR", indices.len(), bytemuck::cast_slice(&indices));
    json!({"attributes": {"POSITION": positions, "_DENSITY": density, "COLOR_0": colours}, "indices": indices})
}

/// A file with one such sheet on a node `sheet`, which `node` says more of.
fn drafted(scale: f32, node: &Value) -> Original {
    let mut draft = Draft::default();
    let primitive = sheet(&mut draft, 20, scale);
    let material = json!([{"name": "skin"}]);
    let mesh = draft.push("meshes", json!({"name": "patch", "primitives": [primitive]}));
    draft.json["meshes"][mesh]["primitives"][0]["material"] = 0.into();
    draft.json["materials"] = material;
    let mut own = json!({"name": "sheet", "mesh": mesh});
    own.as_object_mut().unwrap().extend(node.as_object().unwrap().clone());
    draft.node(own);
    draft.json["scenes"] = json!([{"nodes": [0]}]);
    draft.json["scene"] = 0.into();
    original(&draft)
}

fn original(draft: &Draft) -> Original {
    Original::from_bytes("draft", &draft.to_bytes(), None).unwrap()
}

fn recipe(text: &str) -> Recipe {
    Recipe::parse("recipe.toml", text, Path::new("")).unwrap()
}

fn made(file: &Original, text: &str) -> Authored {
    author(file.clone(), &recipe(text), |_| {}).unwrap()
}

/// Why `text` is refused, which must be one line.
fn why(file: &Original, text: &str) -> String {
    let done =
        Recipe::parse("recipe.toml", text, Path::new("")).and_then(|recipe| author(file.clone(), &recipe, |_| {}));
    let line = done.unwrap_err().to_string();
    assert!(!line.contains('\n'), "{line}");
    line
}

/// That every taxel lies on the surface of its link and looks out of it, as far as a layout counts as current.
fn lies_on_its_surface(body: &Body) {
    for link in 0..body.links.len() {
        let own: Vec<_> = body.taxels.iter().filter(|taxel| taxel.link == link).collect();
        if own.is_empty() {
            continue;
        }
        let surface = body.surface_in_link(link);
        for taxel in own {
            let hit = surface.nearest(taxel.position_in_link).unwrap();
            let off = hit.position.distance(taxel.position_in_link);
            assert!(off < 1e-6, "taxel {} is {off} m off", taxel.id);
            let fits = |normal: DVec3| normal.angle_between(taxel.normal_in_link) < 1e-5;
            // On an edge the nearest triangle may be the one beside.
            let around = surface.along(taxel.position_in_link, taxel.normal_in_link, 1e-5).map(|hit| hit.normal);
            assert!(fits(hit.normal) || around.is_some_and(fits), "taxel {} looks away", taxel.id);
        }
    }
}

fn ids(body: &Body) -> Vec<u32> {
    body.taxels.iter().map(|taxel| taxel.id).collect()
}

/// Per taxel its id and the bits of its place.
fn places(body: &Body) -> BTreeMap<u32, [u64; 3]> {
    body.taxels.iter().map(|taxel| (taxel.id, taxel.position_in_link.to_array().map(f64::to_bits))).collect()
}

#[test]
fn a_skinned_hand_gets_as_many_as_asked_and_feels_with_them() {
    let Some(path) = data("meshes/webxr/generic-hand_left.glb") else { return };
    let recipe = Recipe::simple(Some(500), None, &[]).unwrap().with_seed(1);
    let file = Original::open(path).unwrap();
    let made = author(file.clone(), &recipe, |_| {}).unwrap();
    assert_eq!(ids(&made.body), (0..500).collect::<Vec<_>>());
    lies_on_its_surface(&made.body);
    // Evenly as blue noise goes: no two closer than 0.65 of the widest spacing there is.
    let area: f64 = made.body.taxels.iter().map(|taxel| taxel.area).sum();
    let widest = 2.0 * somatic::internal::author::widest_radius(area, 500);
    assert!(made.places[0].least_spacing_m.unwrap() > 0.65 * widest, "{:?}", made.places[0]);
    assert!(made.places[0].links.len() >= 20 && made.body.fields.len() > made.places[0].links.len());
    // Each rides on the joint that holds the skin there most: it is nobody else's fingertip.
    for taxel in made.body.taxels.iter().filter(|taxel| made.body.links[taxel.link].name.ends_with("distal")) {
        assert!(taxel.position_in_link.length() < 0.04, "{}", taxel.position_in_link);
    }
    let engine = somatic::Engine::new(&made.body, somatic::Options::default());
    assert!(engine.is_ok());
    assert_eq!(made.file.to_glb().unwrap(), author(file, &recipe, |_| {}).unwrap().file.to_glb().unwrap());
    // A second time, the old layout is replaced and leaves no trace.
    let again = Original::from_bytes("again", &made.file.to_glb().unwrap(), None).unwrap();
    assert!(made.file.to_glb().unwrap() == author(again, &recipe, |_| {}).unwrap().file.to_glb().unwrap());
}

#[test]
fn meshes_of_other_tools_are_covered_through_their_transforms() {
    let recipe = Recipe::simple(Some(800), None, &[]).unwrap();
    for part in [
        "meshes/blender_io/06_parent-inverse-anim/06_parent-inverse-anim.gltf",
        "meshes/blender_io/02_suzanne/02_suzanne.gltf",
        "meshes/blender_io/03_skinned_cylinder/03_skinned_cylinder.gltf",
    ] {
        let Some(path) = data(part) else { return };
        let made = author(Original::open(path).unwrap(), &recipe, |_| {}).unwrap();
        assert_eq!(made.body.taxels.len(), 800, "{part}");
        // Of charts and of surface without taxels there may be something to say, and of nothing else.
        let of_charts = |note: &String| {
            let of_surface = note.contains("nothing can touch") || note.contains("too small");
            note.contains("chart") || note.contains("split into") || of_surface
        };
        assert!(made.notes.iter().all(of_charts), "{part}: {:?}", made.notes);
        // A tube that is bent at rest is open where the weights of its joints put it, not where its heaviest joints would.
        let is_tube = part.ends_with("03_skinned_cylinder.gltf");
        assert!(!is_tube || made.places[0].hidden_m2.is_empty(), "{:?}", made.places[0].hidden_m2);
        // What looks for hidden taxels in a body sees the same surface as what places them.
        let hidden = somatic::author::lint(&made.body, &[]);
        let hidden = hidden.iter().find(|finding| finding.kind == somatic::author::FindingKind::HiddenTaxel);
        assert!(hidden.is_none(), "{part}: {}", hidden.unwrap());
        lies_on_its_surface(&made.body);
        // Everything it needs is inside.
        assert_eq!(Body::from_bytes(part, &made.file.to_glb().unwrap()).unwrap().taxels.len(), 800);
        assert_eq!(Body::from_bytes(part, made.file.to_gltf().as_bytes()).unwrap().taxels.len(), 800);
    }
}

#[test]
fn scales_and_mirrors_leave_places_in_metres_and_normals_outside() {
    let turned = DQuat::from_rotation_x(0.3).as_quat().to_array();
    for scale in [[1.0, 1.0, 1.0], [2.0, 2.0, 2.0], [-1.0, 1.0, 1.0], [3.0, -0.5, 0.25]] {
        let file = drafted(1.0, &json!({"scale": scale, "rotation": turned, "translation": [1.0, 2.0, 3.0]}));
        let made = made(&file, "[[place]]\ntaxels = 120\n");
        lies_on_its_surface(&made.body);
        let area: f64 = made.body.taxels.iter().map(|taxel| taxel.area).sum();
        let stretched = 0.02 * f64::abs(scale[0] * scale[1]);
        // Areas are stored in single precision: each within 2⁻²⁴ of itself, and so their sum.
        assert!((area / stretched - 1.0).abs() < 1e-6, "{scale:?}: {area} m²");
    }
}

#[test]
fn a_file_in_millimetres_becomes_metres_once() {
    let file = drafted(1000.0, &json!({}));
    let in_mm = "unit = \"mm\"\n[[place]]\nspacing = \"8 mm\"\n";
    let made = made(&file, in_mm);
    let area: f64 = made.body.taxels.iter().map(|taxel| taxel.area).sum();
    assert!((area / 0.02 - 1.0).abs() < 1e-6, "{area} m²");
    assert!(made.places[0].least_spacing_m.unwrap() >= 0.008);
    lies_on_its_surface(&made.body);
    let again = Original::from_bytes("again", &made.file.to_glb().unwrap(), None).unwrap();
    assert!(
        author(again.clone(), &recipe(in_mm), |_| {}).unwrap().file.to_glb().unwrap() == made.file.to_glb().unwrap()
    );
    assert!(why(&again, "unit = \"cm\"\n[[place]]\ntaxels = 3\n").contains("in mm already"));
}

#[test]
fn another_place_or_region_changes_no_id_and_no_position() {
    let file = drafted(1.0, &json!({}));
    let first = "seed = 5\n[regions.left]\nbox = [[0, 0, -1], [0.1, 1, 1]]\n[[place]]\nregion = \"left\"\nfirst_id = 0\ntaxels = 60\n";
    let more =
        "[regions.right]\nexcept = \"left\"\n[[place]]\nregion = \"right\"\nfirst_id = 1000\nspacing = \"9 mm\"\n";
    let alone = places(&made(&file, first).body);
    let both = places(&made(&file, &format!("{first}{more}")).body);
    assert_eq!(alone.len(), 60);
    assert!(both.len() > 100 && alone.iter().all(|(id, place)| both[id] == *place));
    // In the other order as well; and another seed is another placement.
    let turned =
        format!("{}{more}{}", &first[..first.find("[[place]]").unwrap()], &first[first.find("[[place]]").unwrap()..]);
    let turned = turned.replace("[regions.right]\nexcept = \"left\"\n", "").replacen(
        "[[place]]",
        "[regions.right]\nexcept = \"left\"\n[[place]]",
        1,
    );
    assert_eq!(places(&made(&file, &turned).body), both);
    assert_ne!(places(&made(&file, &first.replace("seed = 5", "seed = 6")).body), alone);
}

#[test]
fn what_else_a_file_holds_stays_to_the_byte() {
    let mut draft = Draft::default();
    let primitive = sheet(&mut draft, 8, 1.0);
    draft.push("meshes", json!({"primitives": [primitive]}));
    let times = draft.scalars(&[0.0, 1.0]);
    let moves = draft.accessor(5126, "VEC3", 2, bytemuck::cast_slice(&[0.0_f32; 6]));
    draft.node(json!({"name": "sheet", "mesh": 0}));
    let text = draft.json.to_string();
    let lists = text
        .trim_start_matches('{')
        .trim_end_matches('}')
        .replace("\"nodes\":[{", "\"nodes\" : [ {\"rotation\":[0.0,0.00,1.0e0,-0.0],");
    let bin = draft.bytes.clone();
    let text = format!(
        "{{\n  \"extensionsUsed\": [\"VENDOR_thing\"],\n  \"extensions\": {{\"VENDOR_thing\": {{\"node\": 0, \"x\": 1.500}}}},\n  {lists},\n  \
         \"animations\": [{{\"channels\": [{{\"sampler\": 0, \"target\": {{\"node\": 0, \"path\": \"translation\"}}}}], \"samplers\": \
         [{{\"input\": {times}, \"output\": {moves}}}]}}],\n  \"extras\": {{\"ünïcode\\u00e9\": [1.10, 2E+3, 12345678901234567890]}},\n  \
         \"buffers\": [{{\"byteLength\": {}}}],\n  \"scenes\": [{{\"nodes\": [0]}}]\n}}",
        bin.len()
    );
    let glb = container(&text, &bin, b"\x04\0\0\0XTRA\x01\x02\x03\x04");
    let file = Original::from_bytes("file", &glb, None).unwrap();
    assert_eq!(file.to_glb().unwrap(), glb);

    let made = made(&file, "[[place]]\ntaxels = 40\n");
    let out = made.file.to_glb().unwrap();
    let length = u32::from_le_bytes(out[12..16].try_into().unwrap()) as usize;
    let written = std::str::from_utf8(&out[20..20 + length]).unwrap();
    for kept in [
        "\"VENDOR_thing\": {\"node\": 0, \"x\": 1.500}",
        "\"nodes\" : [ {\"rotation\":[0.0,0.00,1.0e0,-0.0],",
        "\"extras\": {\"ünïcode\\u00e9\": [1.10, 2E+3, 12345678901234567890]}",
        "\"animations\": [{\"channels\": [{\"sampler\": 0, \"target\": {\"node\": 0, \"path\": \"translation\"}}]",
    ] {
        assert!(written.contains(kept), "{kept} is not in {written}");
    }
    let before: Value = serde_json::from_str(&text).unwrap();
    let after: Value = serde_json::from_str(written).unwrap();
    for list in ["accessors", "bufferViews", "meshes"] {
        let (before, after) = (before[list].as_array().unwrap(), after[list].as_array().unwrap());
        assert!(after.len() > before.len() && after.starts_with(before), "{list}");
    }
    assert_eq!(out[28 + length..][..bin.len()], bin);
    assert!(out.ends_with(b"\x04\0\0\0XTRA\x01\x02\x03\x04"));
    // And when the layout goes, the file is what it was.
    let mut cleared = Original::from_bytes("out", &out, None).unwrap();
    cleared.clear_layout(false).unwrap();
    assert_eq!(cleared.to_glb().unwrap(), glb);
}

/// A `.glb` of a text and a buffer, and what comes after them.
fn container(text: &str, bin: &[u8], rest: &[u8]) -> Vec<u8> {
    let mut json = text.as_bytes().to_vec();
    json.resize(json.len().next_multiple_of(4), b' ');
    let length = 28 + json.len() + bin.len() + rest.len();
    let mut glb = b"glTF\x02\0\0\0".to_vec();
    glb.extend((length as u32).to_le_bytes());
    glb.extend((json.len() as u32).to_le_bytes());
    glb.extend(b"JSON");
    glb.extend(json);
    glb.extend((bin.len() as u32).to_le_bytes());
    glb.extend(b"BIN\0");
    glb.extend(bin);
    glb.extend(rest);
    glb
}

#[test]
fn the_layout_of_a_bundled_body_is_replaced_or_kept() {
    for name in bundled::BODIES {
        let bytes = bundled::body(name).unwrap();
        let before = Body::from_bytes(name, bytes).unwrap();
        let file = Original::from_bytes(name, bytes, None).unwrap();
        let replaced = made(&file, "[[place]]\ntaxels = 70\nfirst_id = 5000\n").body;
        assert_eq!(ids(&replaced), (5000..5070).collect::<Vec<_>>(), "{name}");
        assert_eq!(replaced.links.len(), before.links.len(), "{name}");
        assert!(replaced.findings.is_empty(), "{name}: {:?}", replaced.findings);
        // It takes long on the largest body, and nothing there is different.
        if name == "humanoid" {
            continue;
        }
        let kept = made(&file, "existing = \"keep\"\n[[place]]\ntaxels = 70\nfirst_id = 5000\n").body;
        assert_eq!(ids(&kept), [ids(&before), (5000..5070).collect()].concat(), "{name}");
        let grouped = author(file.clone(), &Recipe::none(), |_| {}).unwrap().body;
        assert_eq!(grouped.taxels, before.taxels, "{name}");
        assert!(
            why(&file, "existing = \"keep\"\n[[place]]\ntaxels = 70\nfirst_id = 0\n").contains("id 0 is used twice")
        );
    }
}

#[test]
fn regions_choose_by_name_material_paint_and_box() {
    let file = drafted(1.0, &json!({}));
    let mean = |region: &str| {
        let made = made(&file, &format!("[regions.r]\n{region}\n[[place]]\nregion = \"r\"\ntaxels = 200\n"));
        made.body.taxels.iter().map(|taxel| taxel.position_in_link).sum::<DVec3>() / 200.0
    };
    let near = |mean: DVec3, x: f64, y: f64| {
        assert!(mean.distance(DVec3::new(x, y, 0.0)) < 2e-3, "{mean}");
    };
    near(mean("node = \"shee?\""), 0.1, 0.05);
    near(mean("node = [\"nothing\", \"patch\"]\nmaterial = \"sk*\""), 0.1, 0.05);
    // Where most of a triangle's corners are painted: half of the squares at the edge.
    near(mean("attribute = \"COLOR_0.r\""), 0.1, (4.0 * 0.08 + 0.5 * 0.17 / 3.0) / 4.5);
    near(mean("attribute = \"_DENSITY\""), (9.0 * 0.155 + 0.5 * 0.32 / 3.0) / 9.5, 0.05);
    near(mean("box = [[0.05, 0, 0], [0.1, 0.1, 0]]"), 0.075, 0.05);
    // What is kept bare is kept from everything that samples, in whatever region.
    let bare = "bare = [\"b\"]\n[regions.b]\nbox = [[0, 0, 0], [0.1, 1, 0]]\n[[place]]\nspacing = 0.006\n";
    assert!(made(&file, bare).body.taxels.iter().all(|taxel| taxel.position_in_link.x >= 0.1));
}

#[test]
fn density_spacing_and_number_hold_together() {
    let file = drafted(1.0, &json!({}));
    let dense = made(&file, "[[place]]\ntaxels = 300\ndensity = \"_DENSITY\"\n").body;
    assert!(dense.taxels.len() == 300 && dense.taxels.iter().all(|taxel| taxel.position_in_link.x >= 0.1));
    // More than blue noise of that number would keep, less than what fits.
    let both = made(&file, "[[place]]\ntaxels = 180\nspacing = \"9 mm\"\n");
    assert!(both.body.taxels.len() == 180 && both.places[0].least_spacing_m.unwrap() >= 0.009, "{:?}", both.places[0]);
    let line = why(&file, "[[place]]\ntaxels = 250\nspacing = \"9 mm\"\n");
    assert!(
        line.starts_with("recipe.toml: line 2, column 10: 250 taxels do not fit 9.0 mm apart on 200.0 cm²"),
        "{line}"
    );
    let line = why(&file, "[[place]]\ntaxels = 400\nspacing = \"9 mm\"\n");
    assert!(line.contains("densest packing"), "{line}");
}

#[test]
fn a_grid_is_regular_on_what_unrolls() {
    let file = drafted(1.0, &json!({}));
    let hexagonal = made(&file, "[[place]]\ngrid = \"hexagonal\"\npitch = \"10 mm\"\n");
    let report = &hexagonal.places[0];
    // In the plane it is exact: all neighbours are one pitch apart, but for single precision at 0.2 m.
    assert!(
        (report.least_spacing_m.unwrap() - 0.01).abs() < 1e-7 && (report.mean_spacing_m.unwrap() - 0.01).abs() < 1e-7
    );
    // About one in each cell.
    let cells = 0.02 / (1e-4 * 3.0_f64.sqrt() / 2.0);
    assert!((hexagonal.body.taxels.len() as f64 - cells).abs() < 0.12 * cells, "{}", hexagonal.body.taxels.len());
    let turned = "[[place]]\ngrid = \"rectangular\"\npitch = 0.02\norigin = [0.01, 0.01, 0]\nu = [0, 1, 0]\n";
    let turned = made(&file, turned).body;
    assert_eq!(turned.taxels.len(), 50);
    // The first row runs along +u from the place asked for; rows count along +v, which is −x.
    let first = turned.taxels[0].position_in_link;
    assert!(first.distance(DVec3::new(0.19, 0.01, 0.0)) < 1e-6, "{first}");
    assert!(turned.taxels[1].position_in_link.distance(DVec3::new(0.19, 0.03, 0.0)) < 1e-6);
}

#[test]
fn a_grid_round_a_tube_meets_itself_with_room() {
    // A closed tube of 48 sides, 20 mm in radius and 100 mm long, without its ends.
    let (mut mesh, sides) = (MeshData::default(), 48);
    for row in 0..=20 {
        for side in 0..sides {
            let angle = std::f64::consts::TAU * f64::from(side) / f64::from(sides);
            let normal = DVec3::new(angle.cos(), angle.sin(), 0.0);
            mesh.positions.push((normal * 0.02 + DVec3::Z * 0.005 * f64::from(row)).as_vec3().to_array());
            mesh.normals.push(normal.as_vec3().to_array());
            if row < 20 {
                let (a, b) = (row * sides + side, row * sides + (side + 1) % sides);
                mesh.triangles.extend([[a, b, b + sides], [a, b + sides, a + sides]]);
            }
        }
    }
    let mut glb = Glb::new();
    let node = glb.node("tube", None, DVec3::ZERO);
    glb.mesh(node, "tube", &mesh, None, None);
    let file = Original::from_bytes("tube", &glb.to_bytes().unwrap(), None).unwrap();
    let laid =
        made(&file, "[[place]]\ngrid = \"hexagonal\"\npitch = \"5 mm\"\norigin = [0.02, 0, 0.05]\nu = [0, 0, 1]\n");
    let cells = std::f64::consts::TAU * 0.02 * 0.1 / (25e-6 * 3.0_f64.sqrt() / 2.0);
    let count = laid.body.taxels.len() as f64;
    assert!((count - cells).abs() < 0.1 * cells, "{count} of {cells}");
    let report = &laid.places[0];
    assert!(report.least_spacing_m.unwrap() >= 0.0025 * (1.0 - 1e-6), "{report:?}");
    // Chords are shorter than the way round; a pitch of 5 mm on a radius of 20 mm loses 0.3 %, at a corner of the
    // polygon twice that.
    assert!((report.mean_spacing_m.unwrap() / 0.005 - 1.0).abs() < 0.03, "{report:?}");
    lies_on_its_surface(&laid.body);
}

/// A ball of 100 mm with a mesh called `ball`.
fn ball() -> Original {
    let (mut mesh, rows, sides) = (MeshData::default(), 24_u32, 48_u32);
    for row in 0..=rows {
        for side in 0..sides {
            let [height, angle] = [std::f64::consts::PI / f64::from(rows), std::f64::consts::TAU / f64::from(sides)];
            let (sin, cos) = (height * f64::from(row)).sin_cos();
            let angle = angle * f64::from(side);
            let normal = DVec3::new(sin * angle.cos(), sin * angle.sin(), -cos);
            mesh.positions.push((normal * 0.1).as_vec3().to_array());
            mesh.normals.push(normal.as_vec3().to_array());
            if row < rows {
                let (a, b) = (row * sides + side, row * sides + (side + 1) % sides);
                mesh.triangles.extend([[a, b, b + sides], [a, b + sides, a + sides]]);
            }
        }
    }
    let mut glb = Glb::new();
    let node = glb.node("ball", None, DVec3::ZERO);
    glb.mesh(node, "ball", &mesh, None, None);
    Original::from_bytes("ball", &glb.to_bytes().unwrap(), None).unwrap()
}

#[test]
fn a_grid_is_refused_where_it_would_tear() {
    let ball = ball();
    let of = |grid: &str, region: &str| {
        format!(
            "[regions.cap]\n{region}\n[[place]]\nregion = \"cap\"\ngrid = \"{grid}\"\npitch = \"10 mm\"\norigin = [0, 0, 0.1]\n"
        )
    };
    for grid in ["hexagonal", "rectangular"] {
        // Up to 20° from its origin a ball narrows its circles by 2 % at most; a quarter of the way round by 36 %.
        let cap = made(&ball, &of(grid, "box = [[-1, -1, 0.094], [1, 1, 1]]"));
        assert!(cap.places[0].least_spacing_m.unwrap() > 0.008, "{:?}", cap.places[0]);
        let line = why(&ball, &of(grid, "box = [[-1, -1, -1], [1, 1, 1]]"));
        assert!(line.contains(&format!("a {grid} grid with a pitch of 10.0 mm tears on region `cap`")), "{line}");
        let count: f64 = line.split("`taxels = ").nth(1).unwrap().split('`').next().unwrap().parse().unwrap();
        assert!((count / (4.0 * std::f64::consts::PI * 0.01 / 1e-4) - 1.0).abs() < 0.2, "{line}");
        let apart: f64 = line.split("are neighbours ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
        assert!(!(8.0..=12.5).contains(&apart), "{line}");
    }
    // Flat, with borders all over, and a window: whatever is in the way of its rows, it is as far as its pitch.
    let file = drafted(1.0, &json!({}));
    let windows =
        "[regions.a]\nbox = [[0.04, 0.03, -1], [0.07, 0.06, 1]]\n[regions.b]\nbox = [[0.1, 0.05, -1], [0.13, 1, 1]]\n";
    for pitch in ["3 mm", "7 mm", "20 mm"] {
        for grid in ["hexagonal", "rectangular"] {
            let flat = format!(
                "{windows}[regions.all]\nexcept = [\"a\", \"b\"]\n[[place]]\nregion = \"all\"\ngrid = \"{grid}\"\npitch = \"{pitch}\"\n"
            );
            assert!(made(&file, &flat).body.taxels.len() > 20, "{flat}");
        }
    }
}

#[test]
fn places_that_are_given_are_taken_to_the_surface() {
    let folder = tempfile::tempdir().unwrap();
    let parse = |text: &str| Recipe::parse("recipe.toml", text, folder.path());
    let csv = |text: &str| std::fs::write(folder.path().join("taxels.csv"), text).unwrap();
    let file = drafted(1.0, &json!({"translation": [1.0, 0.0, 0.0]}));
    let table = "[[place]]\nwithin = \"3 mm\"\ncsv = \"taxels.csv\"\n";
    csv("id,x,y,z,link\n7,1.05,0.02,0.002,\n3,0.1,0.05,-0.001,sheet\n");
    let made = author(file.clone(), &parse(table).unwrap(), |_| {}).unwrap();
    assert_eq!(ids(&made.body), [3, 7]);
    assert!(made.body.taxels[1].position_in_link.distance(DVec3::new(0.05, 0.02, 0.0)) < 1e-7);
    let moved: BTreeMap<u32, f64> = made.places[0].moved_m.iter().copied().collect();
    assert!((moved[&7] - 0.002).abs() < 1e-7 && (moved[&3] - 0.001).abs() < 1e-7);
    let refused = |text: &str| {
        csv(text);
        let line = author(file.clone(), &parse(table).unwrap(), |_| {}).unwrap_err().to_string();
        assert!(
            line.starts_with("recipe.toml: line 3, column 7: ") && line.contains("taxels.csv") && !line.contains('\n'),
            "{line}"
        );
        line
    };
    assert!(
        refused("id,x,y,z\n0,1.05,0.02,0\n40,1.05,0.02,2.5\n")
            .contains("line 3: taxel 40 lies 2.50 m from the surface")
    );
    assert!(refused("id,x,y,z\n1,1.05,0.02,0\n1,1.06,0.02,0\n").contains("id 1 is on line 2 already"));
    assert!(refused("id,x,y\n1,1.05,0.02\n").contains("no column `z`"));
    assert!(refused("id,x,y,z\n1,1.05,zero,0\n").contains("`zero` is not a coordinate"));
    assert!(refused("id,x,y,z,link\n1,1.05,0,0,shet\n").contains("did you mean `sheet`?"));
    assert!(refused("id,x,y,z\n1,1.05,0\n").contains("line 2"));
    assert!(refused("id,x,y,z\n").contains("no rows"));
    std::fs::remove_file(folder.path().join("taxels.csv")).unwrap();
    let line = author(file.clone(), &parse(table).unwrap(), |_| {}).unwrap_err().to_string();
    assert!(line.contains("no such file"), "{line}");
}

#[test]
fn a_table_says_what_its_taxels_measure() {
    let folder = tempfile::tempdir().unwrap();
    let parse = |more: &str| {
        let text = format!("[[place]]\nwithin = \"3 mm\"\ncsv = \"taxels.csv\"\n{more}");
        author(drafted(1.0, &json!({})), &Recipe::parse("recipe.toml", &text, folder.path()).unwrap(), |_| {})
    };
    let csv = |text: &str| std::fs::write(folder.path().join("taxels.csv"), text).unwrap();
    csv(
        "id,x,y,z,modality,tx,ty,tz\n1,0.02,0.02,0,temperature,,,\n2,0.04,0.02,0,force3,0,-1,0\n3,0.06,0.02,0,force3,,,\n\
         4,0.08,0.02,0,,,,\n",
    );
    let body = parse("").unwrap().body;
    let kinds: Vec<String> = body.taxels.iter().map(|taxel| taxel.modality.name()).collect();
    assert_eq!(kinds, ["temperature", "force3", "force3", "pressure"]);
    let tangent = |taxel: usize| body.taxels[taxel].tangents_in_link()[0];
    assert!(tangent(1).distance(DVec3::NEG_Y) < 1e-6 && tangent(2).distance(DVec3::NEG_Y) > 0.5, "{}", tangent(2));
    let why = parse("modality = \"proximity\"\n").unwrap_err().to_string();
    assert!(why.contains("line 2: taxel 1 measures temperature, and the place's `modality` is proximity"), "{why}");
    csv("id,x,y,z\n1,0.02,0.02,0\n");
    assert_eq!(parse("modality = \"proximity\"\n").unwrap().body.taxels[0].modality.name(), "proximity");
}

#[test]
fn empties_and_points_become_taxels() {
    let mut draft = Draft::default();
    let primitive = sheet(&mut draft, 8, 1.0);
    draft.push("meshes", json!({"primitives": [primitive]}));
    let points = draft.points(&[[0.01, 0.01, 0.001], [0.02, 0.01, 0.0]]);
    draft.push("meshes", json!({"primitives": [{"mode": 0, "attributes": {"POSITION": points}}]}));
    draft.node(json!({"name": "sheet", "mesh": 0, "children": [1, 2, 3]}));
    draft.node(json!({"name": "tip.10", "translation": [0.1, 0.05, 0.0]}));
    draft.node(json!({"name": "tip.2", "translation": [0.15, 0.05, 0.0]}));
    draft.node(json!({"name": "loose", "mesh": 1}));
    draft.json["scenes"] = json!([{"nodes": [0]}]);
    let file = original(&draft);
    let by_hand = made(&file, "[[place]]\npoints = [\"tip*\", \"loose\"]\nwithin = 0.002\n");
    let x: Vec<f64> = by_hand.body.taxels.iter().map(|taxel| (taxel.position_in_link.x * 1e3).round()).collect();
    assert_eq!(x, [10.0, 20.0, 150.0, 100.0]);
    assert!(why(&file, "[[place]]\npoints = \"tipp*\"\n").starts_with("recipe.toml: line 2, column "));
    assert!(why(&file, "[[place]]\npoints = \"loose\"\nwithin = 0.0005\n").contains("point 0 of `loose` lies 1.0 mm"));
}

#[test]
fn what_a_recipe_may_not_say_is_named_with_its_line() {
    let file = drafted(1.0, &json!({}));
    let palm = "[regions.palm]\nnode = \"sheet\"\n";
    for (text, line, word) in [
        ("[[place]]\ntaxels = 0\n".to_owned(), 2, "between 1 and 4000000"),
        ("[[place]]\ntaxels = -3\n".into(), 2, "between 1"),
        ("[[place]]\ntaxels = 99999999999\n".into(), 2, "4000000"),
        ("[[place]]\nspacing = \"0 mm\"\n".into(), 2, "over 0"),
        ("[[place]]\nspacing = \"8\"\n".into(), 2, "mm, cm or m"),
        ("[[place]]\nspacing = \"8 mn\"\n".into(), 2, "not a length"),
        ("[[place]]\nspacing = 1e-6\n".into(), 2, "is the spacing in metres?"),
        ("[[place]]\nregion = \"plam\"\ntaxels = 5\n".into(), 2, "write a [regions] table"),
        (format!("{palm}[[place]]\nregion = \"plam\"\ntaxels = 5\n"), 4, "did you mean `palm`?"),
        (format!("bare = [\"pal\"]\n{palm}"), 1, "did you mean `palm`?"),
        ("[regions.a]\nnode = \"shet\"\n[[place]]\nregion = \"a\"\ntaxels = 5\n".into(), 1, "did you mean `sheet`?"),
        ("[regions.a]\nmaterial = \"skn\"\n[[place]]\nregion = \"a\"\ntaxels = 5\n".into(), 1, "did you mean `skin`?"),
        (
            "[regions.a]\nbox = [[5, 5, 5], [6, 6, 6]]\n[[place]]\nregion = \"a\"\ntaxels = 5\n".into(),
            1,
            "the surface lies between",
        ),
        ("[regions.a]\nbox = [[5, 5, 5], [4, 6, 6]]\n".into(), 2, "smaller numbers first"),
        (
            "[regions.a]\nnode = \"*\"\nattribute = \"_DENSTY\"\n[[place]]\nregion = \"a\"\ntaxels = 5\n".into(),
            3,
            "did you mean `_DENSITY`?",
        ),
        ("[regions.a]\nexcept = \"a\"\n[[place]]\nregion = \"a\"\ntaxels = 5\n".into(), 1, "excludes itself"),
        ("[[place]]\ntaxels = 5\ndensity = \"_HAIR\"\n".into(), 2, "no mesh has an attribute `_HAIR`"),
        ("[[place]]\ntaxels = 5\ndensity = \"COLOR_0\"\n".into(), 2, "did you mean `COLOR_0."),
        ("[[place]]\ntaxels = 5\ndensity = \"COLOR_0.b\"\n".into(), 2, "0 everywhere"),
        ("[[place]]\ntaxels = 5\nfirst_id = 16777214\n".into(), 2, "lower `first_id`"),
        ("[[place]]\ntaxels = 5\nfirst_id = 16777217\n".into(), 3, "between 0 and"),
        (
            "[[place]]\ntaxels = 5\nfirst_id = 0\n[[place]]\nname = \"b\"\nfirst_id = 4\ntaxels = 2\n".into(),
            7,
            "id 4 is used twice",
        ),
        ("[[place]]\ntaxels = 5\n[[place]]\nname = \"b\"\nfirst_id = 4\ntaxels = 2\n".into(), 1, "`first_id = 100`"),
        (
            "[[place]]\ntaxels = 5\nfirst_id = 0\n[[place]]\nfirst_id = 9\ntaxels = 2\n".into(),
            4,
            "two places are called `skin`",
        ),
        ("[[place]]\nname = \"x\"\n".into(), 1, "add `taxels`"),
        ("[[place]]\ngrid = \"hexagonal\"\n".into(), 2, "`pitch`"),
        ("[[place]]\ngrid = \"hexagnal\"\n".into(), 2, "did you mean `hexagonal`?"),
        ("[[place]]\ngrid = \"hexagonal\"\npitch = 1e-6\n".into(), 2, "too many places"),
        (
            "[[place]]\n\nspacing = 4\n".into(),
            3,
            "a spacing of 4.00 m is wider than what it is for, which is 223.6 mm across",
        ),
        ("[[place]]\nspacing = 4\n".into(), 2, "write \"4 mm\""),
        ("[[place]]\ngrid = \"hexagonal\"\npitch = 4\n".into(), 2, "a pitch of 4.00 m"),
        ("[[place]]\ntaxels = 5\npitch = 1\n".into(), 3, "`pitch` has no effect with `taxels`"),
        ("[[place]]\ntaxels = 5\ncsv = \"a.csv\"\n".into(), 3, "remove `csv` or `taxels`"),
        ("[[place]]\ntaxls = 5\n".into(), 2, "did you mean `taxels`?"),
        ("[[place]]\ntaxels = 5\nmodality = \"presure\"\n".into(), 3, "did you mean `pressure`?"),
        ("unit = \"inch\"\n".into(), 1, "um, mm, cm or m"),
        ("existing = \"kep\"\n".into(), 1, "did you mean `keep`?"),
        ("seed = \n".into(), 1, ""),
        ("bare = [\"palm\"]\n[regions.palm]\n[[place]]\ntaxels = 5\n".into(), 4, "are `bare`"),
    ] {
        let reported = why(&file, &text);
        assert!(
            reported.starts_with(&format!("recipe.toml: line {line}, column ")) && reported.contains(word),
            "{text}\n{reported}"
        );
    }
    assert!(why(&file, "").contains("no taxels"));
}

#[test]
fn buffers_and_images_of_their_own_are_taken_in() {
    let folder = tempfile::tempdir().unwrap();
    let mut draft = Draft::default();
    let primitive = sheet(&mut draft, 8, 1.0);
    draft.push("meshes", json!({"primitives": [primitive]}));
    draft.node(json!({"name": "sheet", "mesh": 0}));
    // Each view in a buffer of its own; the last is longer than it says.
    let views = draft.json["bufferViews"].as_array().unwrap().clone();
    draft.json["buffers"] = json!([]);
    for (index, view) in views.iter().enumerate() {
        let (start, length) =
            (view["byteOffset"].as_u64().unwrap() as usize, view["byteLength"].as_u64().unwrap() as usize);
        let (name, bytes) = (format!("part {index}.bin"), &draft.bytes[start..start + length]);
        std::fs::write(folder.path().join(&name), [bytes, &[7; 5]].concat()).unwrap();
        draft.push("buffers", json!({"byteLength": length, "uri": name.replace(' ', "%20")}));
        draft.json["bufferViews"][index] = json!({"buffer": index, "byteLength": length});
    }
    let png = b"\x89PNG not really";
    std::fs::write(folder.path().join("skin.png"), png).unwrap();
    draft.json["images"] = json!([{"uri": "skin.png"}, {"name": "gone", "uri": "gone.png"}]);
    std::fs::write(folder.path().join("sheet.gltf"), draft.json.to_string()).unwrap();

    let file = Original::open(folder.path().join("sheet.gltf")).unwrap();
    let made = made(&file, "[[place]]\ntaxels = 20\n");
    assert!(made.notes.len() == 1 && made.notes[0].contains("gone.png"), "{:?}", made.notes);
    lies_on_its_surface(&made.body);
    let glb = made.file.to_glb().unwrap();
    assert_eq!(Body::from_bytes("alone", &glb).unwrap().taxels, made.body.taxels);
    let length = u32::from_le_bytes(glb[12..16].try_into().unwrap()) as usize;
    let json: Value = serde_json::from_slice(&glb[20..20 + length]).unwrap();
    assert_eq!(json["buffers"].as_array().unwrap().len(), 1);
    assert_eq!((&json["images"][0]["mimeType"], &json["images"][1]["uri"]), (&"image/png".into(), &"gone.png".into()));
    let view = &json["bufferViews"][json["images"][0]["bufferView"].as_u64().unwrap() as usize];
    let start = 28 + length + view["byteOffset"].as_u64().unwrap() as usize;
    assert_eq!(&glb[start..start + view["byteLength"].as_u64().unwrap() as usize], png);
}

#[test]
fn damaged_files_get_a_skin_or_one_line() {
    let Some(folder) = data("meshes/hostile") else { return };
    let recipe = Recipe::simple(Some(50), None, &[]).unwrap();
    let (mut skins, mut lines) = (0, 0);
    let mut folders = vec![folder, data("meshes/compressed").unwrap()];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
                continue;
            }
            if !path.extension().is_some_and(|ending| ending == "glb" || ending == "gltf") {
                continue;
            }
            let made: Result<Authored> = Original::open(&path).and_then(|file| author(file, &recipe, |_| {}));
            match made {
                Ok(made) => {
                    assert_eq!(made.body.taxels.len(), 50, "{}", path.display());
                    skins += 1;
                }
                Err(error) => {
                    let line = error.to_string();
                    assert!(line.contains(path.to_str().unwrap()) || line.starts_with("--taxels: "), "{line}");
                    assert!(!line.contains('\n') && line.len() > 20, "{line}");
                    lines += 1;
                }
            }
        }
    }
    assert!(skins >= 2 && lines > 20, "{skins} skins, {lines} lines");
}

/// The numbers of taxels of the fields right below `link`.
fn sizes_below(body: &Body, link: &str) -> Vec<usize> {
    let sets = FieldSet::new(body).unwrap().fields;
    let parent = sets.iter().position(|field| field.name == link);
    sets.iter().filter(|field| field.parent == parent && parent.is_some()).map(|field| field.members.len()).collect()
}

#[test]
fn without_rules_patches_are_even_in_number_and_every_taxel_has_a_chart() {
    let file = Original::from_bytes("humanoid", bundled::HUMANOID, None).unwrap();
    let made = author(file, &Recipe::simple(Some(500), None, &[]).unwrap().with_seed(1), |_| {}).unwrap();
    let set = FieldSet::new(&made.body).unwrap();
    let has_child = |index: usize| set.fields.iter().any(|field| field.parent == Some(index));
    for (index, field) in set.fields.iter().enumerate() {
        assert!(field.chart.is_ok() || has_child(index), "{} has no chart", field.name);
    }
    let mut patches = 0;
    for link in made.places[0].links.keys() {
        let sizes: Vec<usize> = sizes_below(&made.body, link).into_iter().collect();
        // Under that there is one patch, which may be split in parts.
        if made.places[0].links[link] >= 18 {
            let (least, most) = (sizes.iter().min().unwrap(), sizes.iter().max().unwrap());
            assert!(most - least <= 1 && (8..=18).contains(least), "{link}: {sizes:?}");
            patches += sizes.len();
        }
    }
    assert!(patches > 25, "{patches}");
}

#[test]
fn a_region_keeps_its_taxels_on_its_own_links() {
    let Some(path) = data("meshes/webxr/generic-hand_left.glb") else { return };
    let file = Original::open(path).unwrap();
    for (region, count) in [("index*", 60), ("thumb-phalanx-proximal", 200), ("*metacarpal", 300)] {
        let recipe = Recipe::simple(Some(count), None, &[region.to_owned()]).unwrap();
        let made = author(file.clone(), &recipe, |_| {}).unwrap();
        let inside = |link: &str| match region {
            "index*" => link.starts_with("index"),
            "*metacarpal" => link.ends_with("metacarpal"),
            _ => link == region,
        };
        let links = &made.places[0].links;
        assert!(links.keys().all(|link| inside(link)), "{region}: {links:?}");
        assert_eq!(links.values().sum::<usize>() as u64, count);
        lies_on_its_surface(&made.body);
    }
}

/// Unit boxes at whole steps, so that some share a corner, an edge or a face, in one mesh; one triangle in twelve looks inward.
fn touching_boxes(seed: u64) -> Original {
    let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
    let mut below = |end: u64| {
        // xorshift64.
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        state % end
    };
    let mut mesh = MeshData::default();
    for _ in 0..2 + below(4) {
        let at = [below(3), below(3), below(3)].map(|steps| 0.1 * steps as f32);
        for axis in 0..3 {
            for side in 0..2 {
                let first = mesh.positions.len() as u32;
                let mut normal = [0.0; 3];
                normal[axis] = if side == 0 { -1.0 } else { 1.0 };
                for (u, v) in [(0, 0), (1, 0), (1, 1), (0, 1)] {
                    let mut p = at;
                    let steps = [(axis, side), ((axis + 1) % 3, u), ((axis + 2) % 3, v)];
                    steps.iter().for_each(|&(axis, steps)| p[axis] += 0.1 * steps as f32);
                    mesh.positions.push(p);
                    mesh.normals.push(normal);
                }
                for [a, b, c] in [[0, 1, 2], [0, 2, 3]] {
                    let looks_inward = (side == 0) != (below(12) == 0);
                    let [b, c] = if looks_inward { [c, b] } else { [b, c] };
                    mesh.triangles.push([first + a, first + b, first + c]);
                }
            }
        }
    }
    let mut glb = Glb::new();
    let link = glb.node("boxes", None, DVec3::ZERO);
    glb.mesh(link, "boxes", &mesh, None, None);
    Original::from_bytes("boxes", &glb.to_bytes().unwrap(), None).unwrap()
}

/// Authors `count` taxels on `file` and says how long that took; a panic if it has not ended in a minute.
fn time_of_author(file: Original, count: u64, what: &str) -> Duration {
    let (sender, receiver) = mpsc::channel();
    let begun = Instant::now();
    std::thread::spawn(move || {
        let made = author(file, &Recipe::simple(Some(count), None, &[]).unwrap(), |_| {});
        let _ = sender.send(made.map(|made| (made.body.taxels.len(), made.body.fields)));
    });
    let made = receiver.recv_timeout(Duration::from_secs(60)).unwrap_or_else(|e| panic!("{what}: {count} taxels: {e}"));
    let (taxels, fields) = made.unwrap();
    assert_eq!(taxels as u64, count, "{what}");
    // No taxel is lost where a field is split.
    let held: BTreeSet<u32> = fields.iter().flat_map(|field| field.members.keys().copied()).collect();
    assert_eq!(held.len() as u64, count, "{what}");
    begun.elapsed()
}

#[test]
fn parts_that_touch_do_not_hang() {
    for seed in 0..12 {
        for count in [2, 4, 12, 40] {
            time_of_author(touching_boxes(seed), count, &format!("boxes {seed}"));
        }
    }
    for (name, count) in [("face.obj", 20), ("edge.obj", 20), ("cubes.obj", 12), ("two_triangles_hang.stl", 4)] {
        let Some(path) = data(&format!("failing/{name}")) else { return };
        time_of_author(mesh::open(&path, &MeshOptions::default()).unwrap(), count, name);
    }
}

#[test]
#[ignore = "10,000 bodies; cargo test --release --test it five_hundred -- --ignored"]
fn five_hundred_soups_of_touching_boxes_end_in_two_seconds_each() {
    for seed in 0..500 {
        for count in [1, 2, 3, 4, 5, 6, 8, 10, 12, 14, 17, 20, 25, 30, 40, 50, 70, 100, 150, 200] {
            let took = time_of_author(touching_boxes(seed), count, &format!("boxes {seed}"));
            assert!(took < Duration::from_secs(2), "boxes {seed}, {count} taxels: {took:?}");
        }
    }
}

#[test]
fn charts_on_a_mesh_of_very_thin_triangles_take_bounded_time() {
    // A disc of 1500 triangles that meet in its middle, folded up and down: each path bends or splits at every one.
    let (mut mesh, around) = (MeshData::default(), 1500_u32);
    mesh.positions.push([0.0; 3]);
    mesh.normals.push([0.0, 1.0, 0.0]);
    for step in 0..around {
        let (sin, cos) = (f64::from(step) / f64::from(around) * std::f64::consts::TAU).sin_cos();
        let bent = if step % 2 == 0 { 0.002 } else { -0.002 };
        mesh.positions.push([0.1 * sin, bent, 0.1 * cos].map(|x| x as f32));
        mesh.normals.push([0.0, 1.0, 0.0]);
        mesh.triangles.push([0, 1 + step, 1 + (step + 1) % around]);
    }
    let mut glb = Glb::new();
    let link = glb.node("disc", None, DVec3::ZERO);
    glb.mesh(link, "disc", &mesh, None, None);
    let file = Original::from_bytes("disc", &glb.to_bytes().unwrap(), None).unwrap();
    let took = time_of_author(file, 60, "disc");
    assert!(took < Duration::from_secs(40), "{took:?}");
}
