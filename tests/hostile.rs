//! Bodies that are damaged or meant to do damage: each is refused in one line or read, and nothing panics, hangs or
//! fills the memory.

#[path = "it/common.rs"]
mod common;
#[path = "it/draft.rs"]
mod draft;
#[cfg(feature = "cli")]
mod fuzz;
#[cfg(feature = "cli")]
#[allow(dead_code, reason = "the tests of exports use more of it")]
#[path = "vendor/make.rs"]
mod make;

use std::path::{Path, PathBuf};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

use common::data;
use draft::{Draft, FLOAT};
use glam::{DVec3, Vec3};
use serde_json::{Value, json};
use somatic::body::{FieldSpec, MemberSpec, Modality, Taxel};
use somatic::internal::body::{Glb, MeshData, Skinning};
use somatic::{Body, Result};

/// What `work` gives, if it does so within `seconds` and without a panic.
fn within<T: Send + 'static>(seconds: u64, what: &str, work: impl FnOnce() -> T + Send + 'static) -> T {
    let (sender, receiver) = channel();
    std::thread::spawn(move || sender.send(work()));
    match receiver.recv_timeout(Duration::from_secs(seconds)) {
        Ok(result) => result,
        Err(RecvTimeoutError::Timeout) => panic!("{what}: not done after {seconds} s"),
        Err(RecvTimeoutError::Disconnected) => panic!("{what}: it panicked"),
    }
}

/// Loads `path`, holds what comes of it against what every answer must be, and uses the body if there is one.
fn load(path: &Path) -> Result<Body, String> {
    let name = path.display().to_string();
    let file = path.to_owned();
    let (result, mib) = within(20, &name, move || measured(|| Body::load(file).inspect(use_it)));
    assert!(mib < 1024, "{name}: {mib} MiB");
    result.map_err(|e| sound(&name, &e.to_string()))
}

/// `line`, which must be one line that begins with the file's name and says something.
fn sound(name: &str, line: &str) -> String {
    assert!(line.starts_with(&format!("{name}: ")), "{line}");
    assert!(line.len() > name.len() + 10 && !line.contains('\n'), "{line}");
    line.to_owned()
}

/// Asks a body what everybody asks of one; whatever was let in must stand that.
fn use_it(body: &Body) {
    for link in 0..body.links.len().min(8) {
        let surface = body.surface_in_link(link);
        let _ = surface.nearest(DVec3::new(0.01, 0.02, 0.03));
        let _ = surface.along(DVec3::ZERO, DVec3::Z, 1.0);
        let _ = body.rest_transform(0, link);
    }
    let _ = body.common_ancestor(0..body.links.len());
    for taxel in &body.taxels {
        assert!(taxel.position_in_link.is_finite() && taxel.area.is_finite(), "{taxel:?}");
        assert!((taxel.normal_in_link.length() - 1.0).abs() < 1e-9, "{taxel:?}");
    }
}

/// What `work` gives, and the most memory that its thread held at once, MiB.
fn measured<T>(work: impl FnOnce() -> T) -> (T, u64) {
    let mut result = None;
    let used = allocation_counter::measure(|| result = Some(work()));
    (result.unwrap(), used.bytes_max >> 20)
}

fn files_below(folder: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            files.extend(files_below(&path));
        } else if path.extension().is_some_and(|e| e == "glb" || e == "gltf") {
            files.push(path);
        }
    }
    files.sort();
    files
}

#[test]
fn every_hostile_file_is_read_or_refused_in_a_line() {
    let Some(folder) = data("meshes/hostile") else { return };
    let files = files_below(&folder);
    assert!(files.len() > 30, "{} files in {}", files.len(), folder.display());
    for file in files {
        if let Err(line) = load(&file) {
            eprintln!("{line}");
        }
    }
}

#[test]
fn hostile_files_are_refused_in_the_words_expected() {
    let Some(folder) = data("meshes/hostile") else { return };
    let cases = [
        ("generic-hand_left_truncated.glb", "cut short, 47286 of 94572 bytes"),
        ("generic-hand_left_nan_inf.glb", "position that is not a finite number"),
        ("glb/empty_file.glb", "the file is empty"),
        ("glb/no_header.glb", "not a glTF"),
        ("glb/invalid_magic.glb", "not a glTF"),
        ("glb/zero_length.glb", "header is damaged"),
        ("glb/truncated_chunk_data.glb", "cut short"),
    ];
    for (file, words) in cases {
        let line = load(&folder.join(file)).expect_err(file);
        assert!(line.contains(words), "{line}");
    }
    for file in
        ["glb/valid.glb", "glb/valid_buffer.glb", "glb/extra_data.glb", "accessor_data/get_elements_sparse.gltf"]
    {
        load(&folder.join(file)).expect(file);
    }
    let vertices = |file: &str| load(&folder.join(file)).unwrap().surfaces[0].positions.len();
    assert_eq!(vertices("generic-hand_left_nonormals.glb"), 1360);
    assert_eq!(vertices("generic-hand_left_unwelded_noindices.glb"), 6942);
}

#[test]
fn compressed_files_are_refused_with_a_way_out() {
    let Some(folder) = data("meshes/compressed") else { return };
    for (file, words) in
        [("generic-hand_left_draco.glb", "draco_mesh"), ("generic-hand_left_meshopt.glb", "meshopt_compression")]
    {
        let line = load(&folder.join(file)).expect_err(file);
        assert!(line.contains(words) && line.contains("gltf-transform"), "{line}");
    }
}

/// A small body with one of everything: a rigid and a skinned mesh, taxels on both, fields, one within the other.
fn sound_body() -> Vec<u8> {
    let mut glb = Glb::new();
    let base = glb.node("base", None, DVec3::ZERO);
    let arm = glb.node("arm", Some(base), DVec3::new(0.0, 0.1, 0.0));
    let mut plate = MeshData {
        positions: vec![[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.1, 0.1, 0.0], [0.0, 0.1, 0.0]],
        normals: vec![Vec3::Z.to_array(); 4],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        skinning: None,
    };
    let shell = glb.node("shell", Some(base), DVec3::ZERO);
    glb.mesh(shell, "shell", &plate, None, None);
    let unit = glam::Mat4::IDENTITY.to_cols_array();
    let skin = glb.skin("skin", &[base, arm], &[unit, unit]);
    let halves = |n: usize| Skinning { joints: vec![[1, 0, 0, 0]; n], weights: vec![[0.75, 0.25, 0.0, 0.0]; n] };
    plate.skinning = Some(halves(4));
    let sleeve = glb.node("sleeve", None, DVec3::ZERO);
    glb.mesh(sleeve, "sleeve", &plate, None, Some(skin));
    let taxel = |id, x: f64| Taxel {
        id,
        link: 0,
        position_in_link: DVec3::new(x, 0.05, 0.0),
        normal_in_link: DVec3::Z,
        area: 1e-4,
        modality: Modality::Pressure,
        tangent_in_link: None,
    };
    glb.taxels("base.taxels", Some(base), &[taxel(0, 0.02), taxel(1, 0.04)], None);
    glb.taxels("sleeve.taxels", None, &[taxel(10, 0.02), taxel(11, 0.06)], Some((skin, &halves(2))));
    let field = |name: &str, parent: Option<&str>, ids: &[u32]| FieldSpec {
        name: name.into(),
        parent: parent.map(str::to_owned),
        members: ids.iter().map(|&id| (id, MemberSpec::default())).collect(),
        chart: None,
    };
    glb.field(&field("all", None, &[]), Some(base), DVec3::ZERO);
    glb.field(&field("all/arm", Some("all"), &[10, 11]), Some(arm), DVec3::ZERO);
    glb.to_bytes().unwrap()
}

/// Loads `bytes`; an answer of either kind is fine, a panic is not.
fn endure(bytes: &[u8], what: &str) {
    let (result, mib) = measured(|| std::panic::catch_unwind(|| Body::from_bytes("body.glb", bytes).inspect(use_it)));
    assert!(mib < 1024, "{what}: {mib} MiB");
    match result {
        Ok(Ok(_)) => {}
        Ok(Err(e)) => drop(sound("body.glb", &e.to_string())),
        Err(_) => panic!("{what}: it panicked"),
    }
}

#[test]
fn the_body_that_is_damaged_below_is_sound_itself() {
    let body = Body::from_bytes("body.glb", &sound_body()).unwrap();
    assert_eq!(body.taxels.iter().map(|t| t.id).collect::<Vec<_>>(), [0, 1, 10, 11]);
    assert_eq!(body.links[body.taxels[2].link].name, "arm");
    assert_eq!(body.fields.iter().map(|f| f.name.as_str()).collect::<Vec<_>>(), ["all", "all/arm"]);
    assert!(body.findings.is_empty(), "{:?}", body.findings);
}

#[test]
fn a_body_cut_short_anywhere_is_refused() {
    within(60, "truncation", || {
        let bytes = sound_body();
        for length in 0..bytes.len() {
            endure(&bytes[..length], &format!("cut to {length} bytes"));
            assert!(Body::from_bytes("body.glb", &bytes[..length]).is_err(), "cut to {length} bytes");
        }
    });
}

#[test]
fn a_changed_byte_does_no_harm() {
    within(120, "mutation", || {
        let sound = sound_body();
        let mut state = 0x2545_F491_4F6C_DD1D_u64;
        let mut random = move |below: usize| {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state >> 11) as usize % below
        };
        for _ in 0..6000 {
            let (at, byte) = (random(sound.len()), random(256) as u8);
            let mut bytes = sound.clone();
            bytes[at] = byte;
            endure(&bytes, &format!("byte {at} set to {byte}"));
        }
    });
}

/// Every place in `value`, as JSON pointers.
fn places(value: &Value, at: &str, found: &mut Vec<String>) {
    found.push(at.to_owned());
    match value {
        Value::Object(map) => {
            for (key, value) in map {
                places(value, &format!("{at}/{}", key.replace('~', "~0").replace('/', "~1")), found);
            }
        }
        Value::Array(list) => {
            for (index, value) in list.iter().enumerate() {
                places(value, &format!("{at}/{index}"), found);
            }
        }
        _ => {}
    }
}

#[test]
fn a_changed_word_of_the_json_does_no_harm() {
    within(240, "mutation of the JSON", || {
        let sound = sound_body();
        let container = gltf_parts(&sound);
        let json: Value = serde_json::from_slice(container.0).unwrap();
        let mut all = Vec::new();
        places(&json, "", &mut all);
        let replacements = [
            json!(null),
            json!(0),
            json!(-1),
            json!(1),
            json!(3),
            json!(255),
            json!(4_294_967_295_u64),
            json!(1_u64 << 40),
            json!(u64::MAX),
            json!(0.5),
            json!(1e38),
            json!(1e300),
            json!(""),
            json!("MAT4"),
            json!([]),
            json!({}),
            json!(5121),
            json!(5126),
            json!([0, 0, 0, 0]),
            json!([1e38, 1e38, 1e38]),
        ];
        for place in &all {
            for new in &replacements {
                let mut json = json.clone();
                *json.pointer_mut(place).unwrap() = new.clone();
                endure(&glb_of(&json, container.1), &format!("{place} = {new}"));
            }
            if let Some((parent, key)) = place.rsplit_once('/')
                && let Some(Value::Object(map)) = json.clone().pointer_mut(parent)
            {
                map.remove(key);
                let mut json = json.clone();
                json.pointer_mut(parent).unwrap().as_object_mut().unwrap().remove(key);
                endure(&glb_of(&json, container.1), &format!("without {place}"));
            }
        }
    });
}

/// The JSON and the binary chunk of a sound `.glb`.
fn gltf_parts(bytes: &[u8]) -> (&[u8], &[u8]) {
    let length = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
    let json = length(12);
    (&bytes[20..20 + json], &bytes[28 + json..28 + json + length(20 + json)])
}

fn glb_of(json: &Value, bin: &[u8]) -> Vec<u8> {
    let mut text = serde_json::to_vec(json).unwrap();
    text.resize(text.len().next_multiple_of(4), b' ');
    let mut bytes = Vec::new();
    let word = |bytes: &mut Vec<u8>, n: usize| bytes.extend_from_slice(&u32::try_from(n).unwrap().to_le_bytes());
    bytes.extend_from_slice(b"glTF\x02\0\0\0");
    word(&mut bytes, 28 + text.len() + bin.len());
    word(&mut bytes, text.len());
    bytes.extend_from_slice(b"JSON");
    bytes.extend_from_slice(&text);
    word(&mut bytes, bin.len());
    bytes.extend_from_slice(b"BIN\0");
    bytes.extend_from_slice(bin);
    bytes
}

#[test]
fn what_is_not_gltf_is_reported() {
    let why = |bytes: &[u8]| sound("x", &Body::from_bytes("x", bytes).unwrap_err().to_string());
    assert!(why(b"").contains("the file is empty"));
    assert!(why(b"t,0,1\n0,1,2\n").contains("not a glTF"));
    assert!(why(b"{}").contains("not a glTF"));
    assert!(why(b"{\"asset\":").contains("not a glTF"));
    assert!(why(b"glTF").contains("damaged or cut short"));
    assert!(why(b"glTF\x01\0\0\0\x0c\0\0\0").contains("container is damaged"));
    assert!(why("[".repeat(100_000).as_bytes()).contains("not a glTF"));
    let deep = format!("{{\"asset\":{{\"version\":\"2.0\",\"extras\":{}", "[".repeat(100_000));
    assert!(why(deep.as_bytes()).contains("not a glTF"));
    assert_eq!(Body::load("no/such.glb").unwrap_err().kind(), somatic::ErrorKind::NotFound);
}

#[test]
fn a_layout_that_contradicts_itself_is_refused() {
    let on_plate = |ids: &[f32]| {
        let mut draft = Draft::default();
        let mesh = draft.taxels(&vec![[0.0; 3]; ids.len()], ids);
        draft.node(json!({"name": "hand", "mesh": mesh}));
        draft
    };
    assert!(on_plate(&[0.5]).why().contains("taxel id 0.5"));
    assert!(on_plate(&[-1.0]).why().contains("taxel id -1"));
    assert!(on_plate(&[f32::NAN]).why().contains("taxel id NaN"));
    // Single floats step from 2²⁴ to 2²⁴ + 2.
    assert!(on_plate(&[16_777_218.0]).why().contains("taxel id 16777218"));
    assert_eq!(on_plate(&[16_777_216.0]).load().unwrap().taxels[0].id, 1 << 24);

    let with_fields = |fields: &[&str]| {
        let mut draft = on_plate(&[7.0]);
        for field in fields {
            draft.field(field);
        }
        draft
    };
    let why = |fields: &[&str]| with_fields(fields).why();
    assert!(why(&[r#"{"version":1,"name":"a","parent":"b"}"#]).contains("parent `b`, which is not a field"));
    let ring = [
        r#"{"version":1,"name":"a","parent":"b"}"#,
        r#"{"version":1,"name":"b","parent":"c"}"#,
        r#"{"version":1,"name":"c","parent":"b"}"#,
    ];
    assert!(why(&ring).contains("its own ancestor"));
    let twice = r#"{"version":1,"name":"a"}"#;
    assert!(why(&[twice, twice]).contains("two fields are called `a`"));
    assert!(why(&["a field"]).contains("field node `outline`"));
    assert!(why(&[r#"{"version":9,"name":"a"}"#]).contains("newer"));

    let mut draft = on_plate(&[7.0]);
    draft.node(json!({"extras": {"somatic_field": {"version": 1}}}));
    assert!(draft.why().contains("one string"));
    let mut draft = on_plate(&[7.0]);
    let mesh = draft.taxels(&[[0.0; 3]], &[8.0]);
    draft.node(json!({"mesh": mesh, "extras": {"somatic_field": twice}}));
    assert!(draft.why().contains("put it under a link"));
}

#[test]
fn attributes_of_the_wrong_shape_are_refused() {
    let mut draft = Draft::default();
    let mesh = draft.taxels(&[[0.0; 3]], &[1.0]);
    let vector = draft.accessor(FLOAT, "VEC3", 1, &[0; 12]);
    draft.node(json!({"mesh": mesh}));
    draft.bounds(1);
    let attributes = "/meshes/0/primitives/0/attributes";
    let mut changed = |name: &str, accessor: usize| {
        let before = draft.json.clone();
        draft.json.pointer_mut(attributes).unwrap()[name] = json!(accessor);
        let why = draft.why();
        draft.json = before;
        why
    };
    assert!(changed("_NX", vector).contains("_NX is not SCALAR FLOAT"));
    assert!(changed("_TAXEL_ID", vector).contains("_TAXEL_ID is not SCALAR FLOAT"));
    assert!(changed("POSITION", 1).contains("1 numbers an element instead of 3"));
    let mut draft = Draft::default();
    let mesh = draft.taxels(&[[0.0; 3], [0.1; 3]], &[1.0]);
    draft.node(json!({"mesh": mesh}));
    assert!(draft.why().contains("1 values for 2 points"), "{}", draft.why());
}

#[test]
fn nodes_that_form_no_tree_are_refused() {
    let tree = |nodes: Value| {
        let mut draft = Draft::default();
        draft.json["nodes"] = nodes;
        draft.why()
    };
    assert!(tree(json!([{"children": [1]}, {"children": [0]}])).contains("ring"));
    assert!(tree(json!([{"children": [0]}])).contains("ring"));
    assert!(tree(json!([{"children": [2]}, {"children": [2]}, {}])).contains("two parents"));
    assert!(tree(json!([{"children": [9]}])).contains("not in the file"));
    assert!(tree(json!([{"scale": [1e30, 1.0, 1.0]}])).contains("units"));
    assert!(tree(json!([{"translation": [1e300, 0.0, 0.0]}])).contains("out of range"));
}

#[test]
fn many_nodes_of_one_name_are_read_in_time_and_a_long_chain_is_refused() {
    const COUNT: usize = 100_000;
    let body = within(30, "100,000 nodes", || {
        let mut draft = Draft::default();
        // Chains of a hundred.
        let node =
            |n: usize| if n % 100 < 99 { json!({"name": "a", "children": [n + 1]}) } else { json!({"name": "a"}) };
        draft.json["nodes"] = (0..COUNT).map(node).collect();
        draft.load().unwrap()
    });
    assert_eq!(body.links[COUNT - 1].name, "a#100000");
    let why = within(30, "a chain of 100,000", || {
        let mut draft = Draft::default();
        let node = |n: usize| if n + 1 < COUNT { json!({"children": [n + 1]}) } else { json!({}) };
        draft.json["nodes"] = (0..COUNT).map(node).collect();
        draft.why()
    });
    assert!(why.contains("node 1000 has 1000 nodes above it"), "{why}");
}

#[test]
fn accessors_that_claim_what_is_not_there_are_refused() {
    let plate = |change: &dyn Fn(&mut Value)| {
        let mut draft = Draft::default();
        let points = draft.points(&[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
        let mesh = draft.mesh(&json!({"attributes": {"POSITION": points}}));
        draft.node(json!({"name": "plate", "mesh": mesh}));
        change(&mut draft.json);
        draft.why()
    };
    let huge = plate(&|json| {
        json["accessors"][0]["count"] = json!(1_u64 << 40);
        json["accessors"][0].as_object_mut().unwrap().remove("bufferView");
    });
    assert!(huge.contains("claims 1099511627776 elements and has no data"), "{huge}");
    assert!(plate(&|json| json["accessors"][0]["count"] = json!(4)).contains("reaches beyond bufferView 0"));
    assert!(plate(&|json| json["accessors"][0]["count"] = json!(u64::MAX)).contains("reaches beyond"));
    assert!(plate(&|json| json["accessors"][0]["byteOffset"] = json!(u64::MAX)).contains("reaches beyond"));
    assert!(plate(&|json| json["bufferViews"][0]["byteLength"] = json!(1 << 30)).contains("reaches beyond"));
    assert!(plate(&|json| json["bufferViews"][0]["byteOffset"] = json!(u64::MAX)).contains("reaches beyond"));
    assert!(plate(&|json| json["accessors"][0]["bufferView"] = json!(5)).contains("not in the file"));
    let indexed = |indices: &[u16]| {
        let mut draft = Draft::default();
        let attributes = json!({"POSITION": draft.points(&[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])});
        let indices = draft.indices(indices);
        let mesh = draft.mesh(&json!({"attributes": attributes, "indices": indices}));
        draft.node(json!({"mesh": mesh}));
        draft.why()
    };
    assert!(indexed(&[0, 1, 3]).contains("a triangle names vertex 3 of 3"));
    assert!(indexed(&[0, 1, 2, 65535]).contains("a triangle names vertex 65535 of 3"));
    assert!(plate(&|json| json["accessors"][0]["type"] = json!("VEC7")).contains("not a sound glTF"));
    assert!(plate(&|json| json["accessors"][0]["componentType"] = json!(1)).contains("not a sound glTF"));
}

#[cfg(unix)]
#[test]
fn a_buffer_is_not_read_from_a_device_or_a_network() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("body.gltf");
    let why = |uri: &str| {
        let json = json!({"asset": {"version": "2.0"}, "buffers": [{"byteLength": 8, "uri": uri}]});
        std::fs::write(&path, json.to_string()).unwrap();
        load(&path).unwrap_err()
    };
    assert!(why("/dev/zero").contains("not a regular file"));
    assert!(why(".").contains("not a regular file"));
    assert!(why("absent.bin").contains("absent.bin: no such file"));
    assert!(why("https://example.org/a.bin").contains("nothing is fetched"));
    assert!(why("data:application/octet-stream;base64,AAAA").contains("holds 3 of its 8 bytes"));
    assert!(why("data:application/octet-stream;base64,*").contains("not base64"));
    assert!(why("data:").contains("no data"));
}
