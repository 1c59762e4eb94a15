//! Small inputs that ask for a lot: each is refused in a line that names the limit, or done in time that grows with its length.

use std::time::{Duration, Instant};

use serde_json::json;

use super::{done, fails, file, output, stderr, text_of};

/// A body of one triangle, as a mesh to author on.
const TRIANGLE: &str = "v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nf 1 2 3\n";

#[test]
#[cfg(unix)]
fn inputs_without_end_are_refused() {
    let (folder, recipe) = file("zero.toml", "[[place]]\ncsv = \"/dev/zero\"\n");
    let mesh = folder.path().join("a.obj");
    std::fs::write(&mesh, TRIANGLE).unwrap();
    let icub = folder.path().join("icub.toml");
    std::fs::write(&icub, "[[place]]\nicub = \"/dev/zero\"\n").unwrap();
    let out = folder.path().join("o.glb");
    let (mesh, out) = (text_of(&mesh), text_of(&out));
    for arguments in [
        &["author", "--csv-skin", "/dev/zero", "-o", out][..],
        &["author", mesh, "--recipe", "/dev/zero", "-o", out],
        &["author", mesh, "--recipe", text_of(&recipe), "-o", out],
        &["author", mesh, "--recipe", text_of(&icub), "-o", out],
        &["author", "--grid", "2x2", "--pitch", "5mm", "--cells", "/dev/zero", "-o", out],
        &["inspect", "/dev/zero"],
        &["run", "--calibration", "/dev/zero"],
        &["run", "/dev/zero"],
        &["simulate", "/dev/zero", "-o", "x.csv"],
    ] {
        let started = Instant::now();
        let reported = output(arguments);
        let text = stderr(&reported);
        assert_ne!(reported.status.code(), Some(0), "{arguments:?}");
        assert!(text.contains("a device may have at most 1 MiB"), "{arguments:?}: {text}");
        assert_eq!(text.trim_end().lines().count(), 1, "{arguments:?}: {text}");
        assert!(started.elapsed() < Duration::from_secs(20), "{arguments:?} took {:?}", started.elapsed());
    }
}

#[test]
fn numbers_that_ask_for_too_much_are_refused() {
    let (folder, mesh) = file("a.obj", TRIANGLE);
    let out = folder.path().join("o.glb");
    let (mesh, out) = (text_of(&mesh), text_of(&out));
    let why = fails(2, &["author", "--grid", "1000x1000", "--pitch", "5mm", "--regions", "1000x1000", "-o", out]);
    assert!(why.contains("1000 × 1000 regions are over the 500000 fields"), "{why}");
    let why = output(&["author", mesh, "--taxels", "4294967295", "-o", out]);
    assert!(stderr(&why).contains("ask for 1 to 4000000"), "{}", stderr(&why));
    let why = fails(2, &["bench", "--sensors", "4294967295"]);
    assert!(why.contains("is more than a body can have"), "{why}");
    let why = fails(2, &["bench", "--frames", "9223372036854775807"]);
    assert!(why.contains("GiB of memory"), "{why}");
    let places = folder.path().join("places.toml");
    std::fs::write(&places, "[[place]]\ntaxels = 1\n".repeat(4097)).unwrap();
    let why = fails(1, &["author", mesh, "--recipe", text_of(&places), "-o", out]);
    assert!(why.contains("there are over 4096 places"), "{why}");
}

#[test]
fn a_range_of_ids_takes_no_longer_than_the_taxels_that_are_there() {
    let ranges = "\"0..=4294967295\", ".repeat(1000);
    let recipe = format!(
        "[[place]]\ntaxels = 10\n[[fields]]\nname = \"a\"\ntaxels = [{ranges}]\n\
         [[fields]]\nname = \"b\"\npatches = 4294967295\n"
    );
    let (folder, recipe) = file("r.toml", &recipe);
    let mesh = folder.path().join("a.obj");
    std::fs::write(&mesh, TRIANGLE).unwrap();
    let out = folder.path().join("o.glb");
    let started = Instant::now();
    done(&["author", text_of(&mesh), "--recipe", text_of(&recipe), "-o", text_of(&out)]);
    assert!(started.elapsed() < Duration::from_secs(20), "{:?}", started.elapsed());
    let body = somatic::Body::load(&out).unwrap();
    assert_eq!((body.fields[0].name.as_str(), body.fields[0].members.len()), ("a", 10));
    assert!((3..=12).contains(&body.fields.len()), "{} fields", body.fields.len());
}

#[test]
fn nodes_and_fields_stand_within_each_other_up_to_a_limit() {
    let chain = |count: usize| {
        let node = |index: usize| match index + 1 < count {
            true => json!({"name": format!("n{index}"), "children": [index + 1]}),
            false => json!({"name": "end"}),
        };
        let nodes: Vec<_> = (0..count).map(node).collect();
        json!({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": nodes}).to_string()
    };
    let (_folder, path) = file("a.gltf", &chain(1000));
    let why = stderr(&output(&["inspect", text_of(&path)]));
    assert!(!why.contains("nodes above it"), "{why}");
    for count in [1001, 20_000] {
        let (_folder, path) = file("a.gltf", &chain(count));
        let why = fails(1, &["inspect", text_of(&path)]);
        assert!(why.contains("has 1000 nodes above it"), "{why}");
    }
    let deep = |count: usize| {
        let field = |index: usize| {
            let parent = (index > 0).then(|| format!("f{:03}", index - 1));
            json!({"name": format!("f{index:03}"), "parent": parent, "version": 1, "members": {"0": [1]}}).to_string()
        };
        let nodes: Vec<_> = (0..count).map(|i| json!({"name": "f", "extras": {"somatic_field": field(i)}})).collect();
        json!({"asset": {"version": "2.0"}, "nodes": nodes}).to_string()
    };
    let (_folder, path) = file("a.gltf", &deep(200));
    let why = stderr(&output(&["inspect", text_of(&path)]));
    assert!(why.contains("has over 100 fields above it"), "{why}");
}

#[test]
fn a_mesh_that_is_placed_a_million_times_is_refused() {
    // Four million zeros without data, as often as there are nodes.
    let nodes: Vec<_> = (0..100).map(|_| json!({"mesh": 0})).collect();
    let text = json!({
        "asset": {"version": "2.0"}, "nodes": nodes,
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "mode": 0}]}],
        "accessors": [{"componentType": 5126, "count": 4_000_000, "type": "VEC3", "min": [0, 0, 0], "max": [0, 0, 0]}],
    });
    let (_folder, path) = file("a.gltf", &text.to_string());
    let why = fails(1, &["inspect", text_of(&path)]);
    assert!(why.contains("over 100000000 vertices"), "{why}");
    let many = format!("{{\"asset\":{{\"version\":\"2.0\"}},\"nodes\":[{}{{}}]}}", "{},".repeat(4_000_001));
    let (_folder, path) = file("a.gltf", &many);
    let why = fails(1, &["inspect", text_of(&path)]);
    assert!(why.contains("objects, over the 4000000"), "{why}");
}

#[test]
fn many_fields_take_time_by_their_number() {
    let (folder, mesh) = file("a.obj", TRIANGLE);
    let out = folder.path().join("o.glb");
    let took = |count: usize| {
        let rule = |index: usize| format!("[[fields]]\nname = \"f{index}\"\ntaxels = [{}]\n", index % 50);
        let text: String = (0..count).map(rule).collect();
        let recipe = folder.path().join("r.toml");
        std::fs::write(&recipe, format!("[[place]]\ntaxels = 50\n{text}")).unwrap();
        let started = Instant::now();
        done(&["author", text_of(&mesh), "--recipe", text_of(&recipe), "-o", text_of(&out), "--force"]);
        started.elapsed().as_secs_f64()
    };
    let [few, many] = [2_000, 16_000].map(took);
    assert!(many < 12.0 * few.max(0.25), "{few:.2} s for 2,000 fields, {many:.2} s for 16,000");
}
