//! Skins put on meshes from the command line, and fed.

use std::fmt::Write as _;
use std::path::Path;
#[cfg(unix)]
use std::process::{Command, Stdio};
#[cfg(unix)]
use std::time::{Duration, Instant};

use serde_json::Value;

#[cfg(unix)]
use crate::{code_of, somatic};
use crate::{done, fails, file, files_in, frames, text_of};

/// A folder, and in it the humanoid with 300 taxels.
fn skin(more: &[&str]) -> (tempfile::TempDir, std::path::PathBuf, String) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("skin.glb");
    let text = done(&[&["author", "humanoid", "-o", text_of(&path)], more].concat());
    (folder, path, text)
}

#[test]
fn a_mesh_gets_a_skin_that_is_inspected_and_run() {
    let (folder, path, text) = skin(&["--taxels", "300", "--seed", "1"]);
    assert!(
        text.contains("300 taxels in ")
            && text.contains(" fields, on ")
            && text.contains("0–299")
            && text.contains("least mm"),
        "{text}"
    );
    let reported: Value = serde_json::from_str(&done(&["inspect", text_of(&path), "--json"])).unwrap();
    let fields = reported["fields"].as_array().unwrap();
    let charted = fields.iter().filter(|field| !field["chart"].is_null()).count();
    assert!(text.contains(&format!(" {charted} of {} fields have centroids", fields.len())), "{text}");
    // Every taxel is in a field that has centroids, below the field of its link.
    for taxel in reported["taxels"].as_array().unwrap() {
        let holds = |field: &&Value| {
            let members = field["members"].as_array().unwrap();
            !field["chart"].is_null() && members.iter().any(|member| member["taxel"] == taxel["id"])
        };
        let name = fields.iter().find(holds).expect("it has one")["name"].as_str().unwrap();
        assert!(name.starts_with(taxel["link"].as_str().unwrap()), "{name}");
    }
    assert_eq!(reported["taxels"].as_array().unwrap().len(), 300);
    // Each taxel pressed in its turn is felt by the field of its link.
    let mut csv = format!("t,{}\n", (0..300).map(|id| id.to_string()).collect::<Vec<_>>().join(","));
    for frame in 0..300 {
        let row: Vec<&str> = (0..300).map(|id| if id == frame { "50" } else { "0" }).collect();
        writeln!(csv, "{},{}", f64::from(frame) * 0.01, row.join(",")).unwrap();
    }
    let touch = folder.path().join("touch.csv");
    std::fs::write(&touch, csv).unwrap();
    let percepts = done(&["run", "--body", text_of(&path), "--source", text_of(&touch), "--backend", "cpu"]);
    let felt = frames(&percepts);
    assert_eq!(felt.len(), 300);
    for (frame, taxel) in felt.iter().zip(reported["taxels"].as_array().unwrap()) {
        let touched = frame["fields"].as_array().unwrap();
        assert_eq!((&touched[0]["field"], &touched[0]["total"]), (&taxel["link"], &Value::from(50.0)));
        let least = touched.iter().filter(|field| !field["centroid"].is_null());
        assert!(least.count() > 0, "{frame}");
    }
}

#[test]
fn flags_say_how_even_taxels_are_and_where() {
    let spread = |more: &[&str]| -> [f64; 2] {
        let (_folder, path, text) = skin(&[&["--taxels", "200", "--json"], more].concat());
        let made: Value = serde_json::from_str(&text).unwrap();
        let reported: Value = serde_json::from_str(&done(&["inspect", text_of(&path), "--json"])).unwrap();
        let cells = |of: &Value| ["p5", "p95"].map(|key| of["cells"][key].as_f64().unwrap());
        let (made, reported) = (cells(&made["places"][0]), cells(&reported));
        // Areas are stored in single precision.
        assert!((0..2).all(|end| (made[end] - reported[end]).abs() < 1e-6), "{made:?} {reported:?}");
        reported
    };
    let (even, scattered) = (spread(&[]), spread(&["--even", "off", "--hidden", "keep"]));
    assert!(even[0] > 0.85 && even[1] < 1.15, "{even:?}");
    assert!(scattered[0] < 0.85 && scattered[1] > 1.2, "{scattered:?}");
    let out = ["author", "humanoid", "--taxels", "9", "-o", "/no/such/folder/out.glb"];
    assert!(fails(2, &[&out[..], &["--clear", "wide"]].concat()).contains("--clear"));
    assert!(fails(2, &[&out[..], &["--even", "maybe"]].concat()).contains("--even"));
    assert!(fails(2, &[&out[..], &["--mirror", "x"]].concat()).contains("--mirror"));
    assert!(fails(2, &["author", "humanoid", "--mirror", "y", "-o", "/no/such/folder/out.glb"]).contains("--taxels"));
}

#[test]
fn a_mirrored_skin_says_which_ids_are_pairs() {
    let (_folder, path, text) = skin(&["--taxels", "300", "--mirror", "y"]);
    assert!(text.contains("150 pairs"), "{text}");
    let reported: Value = serde_json::from_str(&done(&["inspect", text_of(&path), "--json"])).unwrap();
    let all = reported["fields"].as_array().unwrap().iter().filter_map(|field| field["name"].as_str());
    let names: Vec<&str> = all.filter(|name| name.matches('/').count() < 2).collect();
    let paired = |left: &&&str| left.contains("left") && names.contains(&left.replace("left", "right").as_str());
    let lefts = names.iter().filter(|name| name.contains("left")).count();
    assert!(lefts > 10 && names.iter().filter(paired).count() == lefts, "{names:?}");
}

#[test]
fn a_sheet_needs_no_mesh() {
    let (folder, mask) = file("mask.csv", "0,1\n1,1\n1,0\n");
    let path = folder.path().join("sole.glb");
    let grid = ["author", "--grid", "3x2", "--pitch", "8.6mm,5mm", "-o", text_of(&path)];
    let text = done(&[&grid[..], &["--cells", text_of(&mask), "--regions", "3x1"]].concat());
    assert!(text.contains("4 taxels in 4 fields") && text.contains("4 of 4 fields have centroids"), "{text}");
    let reported: Value = serde_json::from_str(&done(&["inspect", text_of(&path), "--json"])).unwrap();
    let ids: Vec<u64> =
        reported["taxels"].as_array().unwrap().iter().map(|taxel| taxel["id"].as_u64().unwrap()).collect();
    assert_eq!(ids, [1, 2, 3, 4]);
    let area = reported["taxels"][0]["area"].as_f64().unwrap();
    assert!((area - 0.0086 * 0.005).abs() < 1e-11, "{area}");
    let left_of_middle = |reported: &Value| reported["taxels"][0]["position"][0].as_f64().unwrap() < 0.0;
    assert!(!left_of_middle(&reported), "cell 1 is the second of its row");
    done(&[&grid[..], &["--cells", text_of(&mask), "--ids", "columns", "--force"]].concat());
    let reported: Value = serde_json::from_str(&done(&["inspect", text_of(&path), "--json"])).unwrap();
    assert!(left_of_middle(&reported), "cell 1 is the second of its column");
    let (_folder, touch) = file("touch.csv", "t,1,2,3,4\n0,0,0,5,5\n");
    let percepts = done(&["run", "--body", text_of(&path), "--source", text_of(&touch), "--backend", "cpu"]);
    let felt = frames(&percepts);
    let [field] = &felt[0]["fields"].as_array().unwrap()[..] else { panic!("{percepts}") };
    assert_eq!((&field["field"], &field["total"]), (&"sole".into(), &Value::from(10.0)));
}

#[test]
fn what_no_sheet_can_be_is_reported_in_a_line() {
    let (folder, mask) = file("mask.csv", "1,1\n1,oops\n");
    let path = folder.path().join("sole.glb");
    let why = |more: &[&str]| fails(2, &[&["author", "-o", text_of(&path)], more].concat());
    assert!(why(&["--grid", "3x2"]).contains("--pitch"));
    assert!(why(&["--grid", "3", "--pitch", "5mm"]).contains("31x11"));
    assert!(why(&["--grid", "3x2", "--pitch", "5"]).contains("--pitch"));
    assert!(why(&["--grid", "3x2", "--pitch", "5mm,5mm,5mm"]).contains("two"));
    assert!(why(&["--grid", "3x2", "--pitch", "5mm", "--regions", "4x1"]).contains("regions"));
    assert!(why(&["hand", "--grid", "3x2", "--pitch", "5mm"]).contains("--grid"));
    let masked = ["author", "--grid", "2x2", "--pitch", "5mm", "--cells", text_of(&mask), "-o", text_of(&path)];
    assert!(fails(1, &masked).contains("mask.csv: line 2: `oops`"));
    assert!(!path.exists());
}

#[test]
fn a_recipe_places_region_by_region_and_says_so_as_json() {
    let (folder, recipe) = file(
        "recipe.toml",
        "seed = 3\n[regions.head]\nnode = \"head\"\n[regions.arms]\nnode = \"*arm*\"\n\
         [[place]]\nregion = \"head\"\nfirst_id = 0\ntaxels = 40\n\
         [[place]]\nregion = \"arms\"\nfirst_id = 1000\nspacing = \"15 mm\"\nmodality = \"temperature\"\n",
    );
    let output = folder.path().join("out.gltf");
    let text = done(&["author", "humanoid", "--recipe", text_of(&recipe), "-o", text_of(&output), "--json"]);
    let reported: Value = serde_json::from_str(&text).unwrap();
    let [head, arms] = &reported["places"].as_array().unwrap()[..] else { panic!("{reported}") };
    assert_eq!((&head["name"], &head["ids"]), (&"head".into(), &serde_json::json!([[0, 39]])));
    assert_eq!(head["links"], serde_json::json!({"head": 40}));
    assert!(arms["spacing"]["least"].as_f64().unwrap() >= 0.015, "{arms}");
    let body: Value = serde_json::from_str(&done(&["inspect", text_of(&output), "--json"])).unwrap();
    let taxels = body["taxels"].as_array().unwrap();
    assert_eq!(taxels.len() as u64, reported["taxels"].as_u64().unwrap());
    assert!(taxels.iter().all(|taxel| (taxel["modality"] == "temperature") == (taxel["id"].as_u64().unwrap() >= 1000)));
}

#[test]
fn nothing_is_overwritten_unless_forced() {
    let (folder, path, _) = skin(&["--taxels", "300"]);
    let before = std::fs::read(&path).unwrap();
    let again = ["author", "humanoid", "--taxels", "20", "-o", text_of(&path)];
    let line = fails(1, &again);
    assert!(line.contains("--force") && line.lines().count() == 1, "{line}");
    assert!(std::fs::read(&path).unwrap() == before);
    // What it is made of is replaced by nothing.
    let onto_itself = ["author", text_of(&path), "--taxels", "20", "-o", text_of(&path), "--force"];
    let line = fails(2, &onto_itself);
    assert!(line.contains("is the input") && line.lines().count() == 1, "{line}");
    assert!(std::fs::read(&path).unwrap() == before);
    done(&[&again[..], &["--force"]].concat());
    assert!(std::fs::read(&path).unwrap() != before);
    assert_eq!(files_in(folder.path()), ["skin.glb"]);
}

#[test]
fn what_cannot_be_authored_is_one_line_and_leaves_nothing_behind() {
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("out.glb");
    let out = text_of(&output);
    let (_elsewhere, bare) =
        file("bare.gltf", r#"{"asset":{"version":"2.0"},"scenes":[{"nodes":[0]}],"nodes":[{"name":"a"}]}"#);
    let one = |code: i32, arguments: &[&str], word: &str| {
        let line = fails(code, arguments);
        assert!(line.contains(word) && line.lines().count() == 1, "{arguments:?}: {line}");
        assert!(!Path::new(out).exists());
    };
    one(2, &["author", text_of(&bare), "-o", out], "--taxels");
    one(2, &["author", "humanoid", "--region", "head", "-o", out], "--taxels");
    one(1, &["author", "humanoid", "--taxels", "0", "-o", out], "--taxels: 0 taxels");
    one(
        2,
        &["author", "humanoid", "--spacing", "8", "-o", out],
        "--spacing: `8` is not a length; write a number and um",
    );
    one(1, &["author", "humanoid", "--taxels", "100", "--spacing", "1m", "-o", out], "do not fit");
    one(1, &["author", "humanoid", "--taxels", "9", "--region", "haed", "-o", out], "did you mean `head`?");
    one(
        1,
        &["author", "humanoid", "--taxels", "9", "--region", "head", "--region", "hips_", "-o", out],
        "region `hips_` is empty",
    );
    one(2, &["author", "humanoid", "--taxels", "9", "--unit", "inch", "-o", out], "--unit");
    one(1, &["author", "humanoyd", "--taxels", "9", "-o", out], "did you mean the bundled body `humanoid`?");
    one(1, &["author", "humanoid", "--recipe", "/no/such.toml", "-o", out], "no such file");
    one(2, &["author", "humanoid", "--taxels", "9", "-o", "body.stl"], "a .glb or a .gltf");
    one(1, &["author", "humanoid", "--taxels", "9", "-o", "/no/such/folder/out.glb"], "no such file or directory");
    assert!(fails(2, &["author", "humanoid", "--recipe", "r.toml", "--taxels", "9", "-o", out]).contains("--recipe"));
    assert_eq!(files_in(folder.path()), [""; 0]);
}

#[test]
fn help_teaches_recipes() {
    let help = done(&["author", "--help"]);
    for word in ["--recipe", "--spacing", "Examples:", "[[place]]", "--force", "mm"] {
        assert!(help.contains(word), "{word}: {help}");
    }
}

/// The hand as text, to be edited; with what `edit` does to it.
fn edited(edit: impl FnOnce(&mut Value, &mut Vec<u8>)) -> (tempfile::TempDir, std::path::PathBuf) {
    let bytes = somatic::bundled::HAND;
    let length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
    let mut json: Value = serde_json::from_slice(&bytes[20..20 + length]).unwrap();
    let mut bin = bytes[28 + length..].to_vec();
    edit(&mut json, &mut bin);
    let folder = tempfile::tempdir().unwrap();
    json["buffers"][0]["uri"] = "hand.bin".into();
    std::fs::write(folder.path().join("hand.bin"), bin).unwrap();
    let path = folder.path().join("hand.gltf");
    std::fs::write(&path, json.to_string()).unwrap();
    (folder, path)
}

#[test]
fn a_layout_that_stays_is_brought_up_to_date() {
    // What is current keeps its bytes.
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out.glb");
    let text = done(&["author", "hand", "-o", text_of(&out)]);
    assert!(text.contains("40 taxels in 13 fields") && text.contains("nothing of them is stale"), "{text}");
    assert!(std::fs::read(&out).unwrap() == somatic::bundled::HAND);

    // A normal that somebody turned, and an id that is there twice: taxel 1 of the palm board was made of taxel 0.
    let (_folder, path) = edited(|json, bin| {
        let mesh = json["meshes"].as_array().unwrap().iter().find(|mesh| mesh["primitives"][0]["mode"] == 0).unwrap();
        let attributes = mesh["primitives"][0]["attributes"].clone();
        let mut put = |name: &str, point: usize, value: f32| {
            let accessor = &json["accessors"][attributes[name].as_u64().unwrap() as usize];
            let view = &json["bufferViews"][accessor["bufferView"].as_u64().unwrap() as usize];
            let at = view["byteOffset"].as_u64().unwrap_or(0) as usize + 4 * point;
            bin[at..at + 4].copy_from_slice(&value.to_le_bytes());
        };
        put("_NX", 5, 0.7);
        put("_TAXEL_ID", 1, 0.0);
    });
    let seen = |path: &Path| -> Value { serde_json::from_str(&done(&["inspect", text_of(path), "--json"])).unwrap() };
    fails(1, &["inspect", text_of(&path), "--strict"]);
    let text = done(&["author", text_of(&path), "-o", text_of(&out), "--force"]);
    for words in ["normals recomputed for 1 of 40 taxels: 5", "1 taxel has the id of another", "names taxel 1"] {
        assert!(text.contains(words), "{words}: {text}");
    }
    let (before, after) = (seen("hand".as_ref()), seen(&out));
    let by_id = |reported: &Value, id: u64| {
        reported["taxels"].as_array().unwrap().iter().find(|taxel| taxel["id"] == id).cloned().unwrap_or_default()
    };
    // The normal is back, to the rounding of a unit vector in single precision; all other taxels are as they were.
    for (x, y) in [0, 1, 2].map(|axis| {
        let normal = |reported: &Value| by_id(reported, 5)["normal"][axis].as_f64().unwrap();
        (normal(&before), normal(&after))
    }) {
        assert!((x - y).abs() <= 2.0 * f64::from(f32::EPSILON), "{x} {y}");
    }
    assert_eq!(by_id(&after, 52)["position"], by_id(&before, 1)["position"], "it has the next free id");
    for id in [0, 2, 3, 4, 6, 51] {
        assert_eq!(by_id(&after, id), by_id(&before, id));
    }
    // Fields are those it had, less the taxel that lost its id; nothing is found twice any more.
    let fields = |reported: &Value| reported["fields"].as_array().unwrap().len();
    assert_eq!(fields(&after), fields(&before));
    let said = done(&["inspect", text_of(&out)]);
    assert!(!said.contains("id of another") && !said.contains("not the surface's"), "{said}");

    // With rules of its own, a recipe groups anew and keeps the taxels.
    let (_folder, recipe) = file("recipe.toml", "[[fields]]\nname = \"all\"\n");
    let text = done(&["author", "hand", "--recipe", text_of(&recipe), "-o", text_of(&out), "--force"]);
    assert!(text.contains("40 taxels in 1 field"), "{text}");
    assert_eq!(seen(&out)["taxels"], before["taxels"]);
}

#[test]
#[cfg(unix)]
fn ctrl_c_ends_it_within_a_second_and_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("skin.glb");
    let arguments = ["author", "humanoid", "--taxels", "1000000", "-o", text_of(&path)];
    let mut child = somatic(&arguments).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    std::thread::sleep(Duration::from_millis(500));
    assert!(child.try_wait().unwrap().is_none(), "it ended by itself");
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
    let begun = Instant::now();
    let _ = code_of(&mut child);
    assert!(begun.elapsed() < Duration::from_secs(1), "{:?}", begun.elapsed());
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}
