//! Names from elsewhere: what a terminal would obey in them reaches none, and odd ones come back from every format.

use std::path::Path;

use serde_json::{Value, json};
use somatic::Body;

use super::{done, fails, file, output, somatic, stderr, text_of};

/// Sets the title, writes the clipboard, clears the screen; ends a line; turns what follows; a C1 sequence; none at all.
const HOSTILE: &str = "\u{1b}]0;P\u{7}\u{1b}]52;c;aGk=\u{7}\u{1b}[2J\nforged\r\u{202e}\u{9b}31m\u{8}\0";

/// Whether a terminal would obey something in `bytes`, which this program printed.
fn is_obeyed(bytes: &[u8]) -> bool {
    let text = String::from_utf8_lossy(bytes);
    text.chars().any(|c| (c.is_control() && !matches!(c, '\n' | '\t')) || matches!(c, '\u{202A}'..='\u{202E}'))
        || text.lines().any(|line| line.starts_with("forged"))
}

/// A table of nine taxels on a link called `name`.
fn skin(name: &str) -> String {
    let mut text = "id,link,x,y,z,nx,ny,nz,area\n".to_owned();
    for id in 0..9 {
        let quoted = name.replace('"', "\"\"");
        let (x, z) = (0.005 * f64::from(id % 3), 0.005 * f64::from(id / 3));
        text += &format!("{id},\"{quoted}\",{x},0,{z},0,1,0,1e-5\n");
    }
    text
}

#[test]
fn what_a_terminal_would_obey_reaches_none() {
    assert!(is_obeyed(HOSTILE.as_bytes()) && is_obeyed(b"a\nforged") && !is_obeyed(b"a\tb\n"), "the check sees it");
    let (folder, table) = file("skin.csv", &skin(HOSTILE));
    let at = |name: &str| folder.path().join(name);
    let write = |name: &str, text: &str| {
        std::fs::write(at(name), text).unwrap();
        at(name).to_str().unwrap().to_owned()
    };
    let (table, body) = (text_of(&table), at("skin.glb"));
    let body = text_of(&body);
    // NUL and the like are no names of files; the rest may be.
    let file_name = HOSTILE.replace(['\0', '/'], "");
    let recorded =
        write(&format!("{file_name}.csv"), "t,0,1,2,3,4,5,6,7,8\n0,0,0,0,0,0,0,0,0,0\n0.1,9,9,9,9,9,9,9,9,9\n");
    let toml_key: String = HOSTILE
        .chars()
        .map(|c| if c.is_control() { format!("\\u{:04x}", u32::from(c)) } else { c.to_string() })
        .collect();
    let scene = write("scene.toml", &format!("\"{toml_key}\" = 1\n"));
    let recipe = write("recipe.toml", &format!("[[fields]]\nname = \"{toml_key}\"\n"));
    let wrong = write("wrong.toml", &format!("[[fields]]\nname = \"a\"\nlink = \"x{toml_key}\"\n"));
    let joints = write("joints.ndjson", &json!({"t": 0.0, "values": {}, (HOSTILE): 1}).to_string());
    let all: Vec<Vec<&str>> = vec![
        vec!["author", "--csv-skin", table, "-o", body],
        vec!["author", body, "--recipe", &recipe, "-o", "field.glb", "--force"],
        vec!["inspect", "field.glb"],
        vec!["author", body, "--recipe", &wrong, "-o", "never.glb"],
        vec!["inspect", body],
        vec!["inspect", body, "--json"],
        vec!["info", &recorded],
        vec!["info", &recorded, "--json"],
        vec!["plan", "--body", body],
        vec!["run", "--body", body, "--source", &recorded, "--sink", "ndjson:/dev/null", "--force"],
        vec!["run", &scene],
        vec!["run", "--body", body, "--source", &joints, "--sink", "ndjson:/dev/null", "--force"],
        vec!["run", "--source", &file_name],
        vec!["run", &file_name],
        vec![&file_name],
        vec!["convert", body, "-o", "never.xyz"],
    ];
    for arguments in all {
        for colours in [false, true] {
            let mut command = somatic(&arguments);
            command.current_dir(folder.path());
            if colours {
                command.env("CLICOLOR_FORCE", "1");
            }
            let reported = command.output().unwrap();
            // The command's own colours are no harm.
            let own = |bytes: &[u8]| {
                let text = String::from_utf8_lossy(bytes).into_owned();
                ["0", "1", "2", "4", "31", "32", "33", "36", "1;31"]
                    .iter()
                    .fold(text, |text, code| text.replace(&format!("\u{1b}[{code}m"), ""))
            };
            for bytes in [own(&reported.stdout), own(&reported.stderr)] {
                assert!(!is_obeyed(bytes.as_bytes()), "{arguments:?}, colours {colours}: {bytes:?}");
            }
            assert_ne!(reported.status.code(), Some(101), "{arguments:?}");
        }
    }
}

/// Names that are odd and hurt nobody.
const ODD: [&str; 8] = [
    "\"quoted\" 'twice'",
    "<a href=\"x\">&amp;</a>",
    "line\nand line",
    "掌/Zeigefinger ü 👋🏽",
    "a,b;c#d",
    "tab\there",
    "back\\slash \\u001b",
    "..=",
];

#[test]
fn odd_names_come_back_from_every_format() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    for (number, name) in ODD.into_iter().enumerate() {
        let (table, body) = (at(&format!("{number}.csv")), at(&format!("{number}.glb")));
        std::fs::write(&table, skin(name)).unwrap();
        let link_in = |body: &str| Body::load(body).unwrap().links.iter().any(|link| link.name == name);
        done(&["author", "--csv-skin", &table, "-o", &body]);
        assert!(link_in(&body), "{name:?} in a body");
        let inspected: Value = serde_json::from_str(&done(&["inspect", &body, "--json"])).unwrap();
        assert_eq!(inspected["taxels"][0]["link"], name, "in JSON");
        for (flag, ending) in [("--csv-skin", "csv"), ("--urdf-skin", "urdf")] {
            let (there, back) = (at(&format!("{number}_there.{ending}")), at(&format!("{number}_{ending}.glb")));
            done(&["convert", &body, "-o", &there]);
            done(&["author", flag, &there, "-o", &back]);
            assert!(link_in(&back), "{name:?} through {ending}: {}", std::fs::read_to_string(&there).unwrap());
        }
        // A field of that name, through a recipe in TOML, the body, and a drawing.
        let field = name.replace('/', "_");
        let recipe = at("r.toml");
        std::fs::write(&recipe, format!("[[fields]]\nname = {}\n", json!(field))).unwrap();
        let named = at(&format!("{number}_field.glb"));
        done(&["author", &body, "--recipe", &recipe, "-o", &named]);
        assert_eq!(Body::load(&named).unwrap().fields[0].name, field);
        let (recorded, plot) = (at("touch.csv"), at(&format!("{number}.svg")));
        std::fs::write(&recorded, "t,0,1,2,3,4,5,6,7,8\n0,0,0,0,0,0,0,0,0,0\n0.1,9,9,9,9,9,9,9,9,9\n").unwrap();
        done(&["plot", &recorded, "--body", &named, "-o", &plot]);
        is_svg_with(Path::new(&plot), &field);
        // In each line of percepts.
        let percepts = done(&["run", "--body", &named, "--source", &recorded, "--all-fields"]);
        let last: Value = serde_json::from_str(percepts.lines().last().unwrap()).unwrap();
        assert_eq!(last["fields"][0]["field"], field, "{percepts}");
    }
}

/// Asserts that the drawing at `path` is XML with the text `name`, whose white space a drawing does not keep.
fn is_svg_with(path: &Path, name: &str) {
    let text = std::fs::read_to_string(path).unwrap();
    let drawing = roxmltree::Document::parse(&text).unwrap_or_else(|e| panic!("{e}: {text}"));
    let words = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
    let texts = drawing.descendants().filter(|node| node.has_tag_name("text"));
    let texts: Vec<String> = texts.map(|node| words(node.text().unwrap_or_default())).collect();
    assert!(texts.iter().any(|text| text.contains(&words(name))), "{name:?} is not among {texts:?}");
}

#[test]
fn what_xml_cannot_hold_is_written_so_that_people_can_read_it() {
    let (folder, table) = file("skin.csv", &skin("a\u{1b}\0b"));
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    done(&["author", "--csv-skin", text_of(&table), "-o", &at("a.glb")]);
    let reported = output(&["convert", &at("a.glb"), "-o", &at("a.urdf")]);
    assert_eq!(reported.status.code(), Some(0));
    let reported = stderr(&reported);
    assert!(reported.contains("XML has no place for some characters in the names of 1 links"), "{reported}");
    let text = std::fs::read_to_string(at("a.urdf")).unwrap();
    let urdf = roxmltree::Document::parse(&text).unwrap();
    assert!(urdf.descendants().any(|node| node.attribute("name") == Some("a\\u001b\\u0000b")), "{text}");
    std::fs::write(at("t.csv"), "t,0,1,2,3,4,5,6,7,8\n0,0,0,0,0,0,0,0,0,0\n0.1,9,9,9,9,9,9,9,9,9\n").unwrap();
    done(&["plot", &at("t.csv"), "--body", &at("a.glb"), "-o", &at("a.svg")]);
    is_svg_with(Path::new(&at("a.svg")), "a\\u001b\\u0000b");
}

/// A flag, an output, a table or a way under the name that it had before.
#[test]
fn an_old_name_is_reported_with_the_new_one_in_one_line() {
    let reported = |code: i32, arguments: &[&str], new: &str| {
        let said = fails(code, arguments);
        assert!(said.trim_end().ends_with(new) && said.lines().count() == 1, "{arguments:?}: {said}");
    };
    for (arguments, new) in [
        (&["run", "--outputs", "total,axis"][..], "--outputs: `axis` is `principal_axis` now"),
        (&["run", "--outputs", "axis_sigma"], "--outputs: `axis_sigma` is `principal_axis_sigma` now"),
        (&["run", "--outputs", "contacts"], "--outputs: `contacts` is `self_contacts` now"),
        (&["plan", "--outputs", "footprint_angle"], "--outputs: `footprint_angle` is `touches.fit_direction` now"),
        (&["run", "--outputs", "footprint"], "--outputs: `footprint` is `touches.fit_*` now"),
        (&["run", "--outputs", "total,fit_place"], "--outputs: `fit_place` is `touches.fit_place` now"),
        (&["plan", "--outputs", "fit_angle_sigma"], "--outputs: `fit_angle_sigma` is `touches.fit_sigmas` now"),
        (&["bench", "--outputs", "fit_speed"], "--outputs: `fit_speed` is `touches.fit_velocity` now"),
        (&["run", "--outputs", "total", "--table", "contacts"], "--table: `contacts` is `self_contacts` now"),
        (&["run", "--orientation-by", "footprint"], "--orientation-by: `footprint` is `fit` now"),
        (&["run", "--orientation-by", "footprint-2"], "--orientation-by: `footprint-2` is `fit-2` now"),
        (&["run", "--in", "hand"], "`--in` is `--relative-to` now"),
        (&["calibrate", "--body", "hand", "--skin=touches.csv"], "`--skin` is `--gains-from` now"),
        (&["tune", "--source", "serial:a", "--tap", "3"], "`--tap` is `--wiper` now"),
    ] {
        reported(2, arguments, new);
    }
    #[cfg(unix)]
    reported(2, &["board", "--taps", "ignored"], "`--taps` is `--wipers` now");
    // What another command was never called so is not said to be.
    assert!(!fails(2, &["author", "--skin", "a.csv"]).contains("now"));

    let folder = tempfile::tempdir().unwrap();
    let told_of = |code: i32, text: &str, arguments: &[&str], new: &str| {
        let path = folder.path().join("old.toml");
        std::fs::write(&path, text).unwrap();
        let source = format!("sim:{}", text_of(&path));
        let of = |word: &&str| match *word {
            "OLD" => text_of(&path).to_owned(),
            "SIM" => source.clone(),
            word => word.to_owned(),
        };
        let words: Vec<String> = arguments.iter().map(of).collect();
        reported(code, &words.iter().map(String::as_str).collect::<Vec<_>>(), new);
    };
    for (key, new) in [
        ("in = \"hand\"", "line 1, column 1: `in` is `relative_to` now"),
        ("force = true", "line 1, column 1: `force` is `overwrite` now"),
        ("tare = true\nspeed = 2", "line 2, column 1: `speed` is `playback_speed` now"),
        ("outputs = [\"total\", \"axis\"]", "`axis` is `principal_axis` now"),
        ("outputs = [\"fit_force\"]", "`fit_force` is `touches.fit_force` now"),
        ("[accuracy]\norientation_by = \"footprint-1\"", "`footprint-1` is `fit-1` now"),
    ] {
        told_of(2, key, &["run", "OLD"], new);
    }
    let calibrated = ["run", "--backend", "cpu", "--calibration", "OLD"];
    told_of(1, "[upkeep]\ndead_s = 2\n", &calibrated, "line 1, column 2: `upkeep` is `drift` now");
    told_of(1, "[skin]\nsigma_m = 0.004\n", &calibrated, "line 1, column 2: `skin` is `layer` now");
    told_of(1, "[all]\nsensor = \"fsr\"\ntap = 38\n", &calibrated, "line 3, column 1: `tap` is `wiper` now");
    let simulation = "body = \"hand\"\nrate_hz = 10\nduration_s = 1\n";
    let simulated = ["run", "--source", "SIM"];
    told_of(
        1,
        &format!("{simulation}[skin]\nthickness_m = 0.004\n"),
        &simulated,
        "line 4, column 2: `skin` is `layer` now",
    );
    let sensor = format!("{simulation}[sensor]\nkind = \"fsr\"\ntap = 38\n");
    told_of(1, &sensor, &simulated, "line 6, column 1: `tap` is `wiper` now");
    #[cfg(unix)]
    told_of(
        1,
        "[[board]]\nid = 1\ntaxels = [{ channel = 0, first = 0, count = 1, taps = [3] }]\n",
        &["run", "--body", "hand", "--source", "serial:/dev/null", "--wiring", "OLD"],
        "`taps` is `wipers` now",
    );
}

/// A recording cannot be changed: the calibration that it carries is read, whatever its names were then.
#[test]
fn a_recording_with_a_calibration_of_old_names_is_read_with_a_line() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| text_of(&folder.path().join(name)).to_owned();
    let touches = at("touches.csv");
    let values: Vec<String> = (0..40).map(|id| (200 + 10 * id).to_string()).collect();
    let ids: Vec<String> = [0..9, 16..27, 32..52].into_iter().flatten().map(|id| id.to_string()).collect();
    std::fs::write(&touches, format!("t,{}\n0,{}\n0.1,{}\n", ids.join(","), values.join(","), values.join(",")))
        .unwrap();
    let of_names = |recording: &str, layer: &str, drift: &str, wiper: &str| {
        let calibration =
            format!("[all]\nsensor = \"fsr\"\n{wiper} = 60\n[{layer}]\nsigma_m = 0.004\n[{drift}]\ndead_s = 2\n");
        std::fs::write(at("calibration.toml"), calibration).unwrap();
        done(&["convert", &touches, &at(recording), "--body", "hand", "--calibration", &at("calibration.toml")]);
        let run = output(&["run", "--backend", "cpu", "--source", &at(recording), "--sink", "-"]);
        assert_eq!(run.status.code(), Some(0), "{}", stderr(&run));
        let reported = stderr(&run);
        (String::from_utf8(run.stdout).unwrap(), reported)
    };
    let (old, said) = of_names("old.mcap", "skin", "upkeep", "tap");
    let (new, silent) = of_names("new.mcap", "layer", "drift", "wiper");
    let line = "old.mcap: its calibration was written under old names: `[skin]` is `[layer]` now, `[upkeep]` is `[drift]` now, \
                `tap` is `wiper` now";
    assert_eq!(said.matches(line).count(), 1, "{said}");
    assert!(!silent.contains("old names"), "{silent}");
    let of_frames = |text: &str| text.lines().map(str::to_owned).collect::<Vec<_>>();
    assert_eq!(of_frames(&old), of_frames(&new));
    assert!(of_frames(&old).len() == 2 && old.contains("\"total\""), "{old}");
}
