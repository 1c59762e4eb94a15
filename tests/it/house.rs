//! The house stays in order: who may use whom, and each heavy dependency behind its one door.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use crate::paths::{Paths, circle};

/// What each module of the crate may use of the others.
fn allowed() -> BTreeMap<&'static str, Vec<&'static str>> {
    let below_backend = ["error", "percept", "signal", "body", "field", "stage", "scene"];
    BTreeMap::from([
        ("error", vec![]),
        ("percept", vec![]),
        ("bundled", vec![]),
        ("output", vec!["error"]),
        ("keys", vec!["error"]),
        ("length", vec![]),
        ("limits", vec![]),
        ("plain", vec![]),
        ("random", vec![]),
        ("renamed", vec![]),
        ("debug", vec![]),
        ("setters", vec![]),
        ("words", vec!["error"]),
        ("parallel", vec![]),
        ("signal", vec!["error", "keys", "body"]),
        ("body", vec!["error", "output"]),
        ("field", vec!["error", "body"]),
        ("author", vec!["error", "keys", "length", "body", "field", "parallel"]),
        ("stage", vec!["percept", "signal", "field"]),
        ("touch", vec!["percept", "body", "field"]),
        ("scene", vec!["error", "length", "percept", "signal", "body", "field", "stage", "touch"]),
        ("backend", [&below_backend[..], &["parallel"]].concat()),
        ("engine", [&below_backend[..], &["backend", "parallel", "touch"]].concat()),
        ("gains", [&below_backend[..], &["backend", "engine", "touch"]].concat()),
        (
            "expected",
            [&below_backend[..], &["backend", "engine", "touch", "source", "author", "parallel", "setters"]].concat(),
        ),
        ("shape", [&below_backend[..], &["backend", "engine"]].concat()),
        ("wire", vec![]),
        ("board", vec!["error", "signal", "wire"]),
        ("limb", vec!["error", "signal", "wire"]),
        ("recording", vec!["error", "output", "signal", "body"]),
        (
            "source",
            vec![
                "error",
                "keys",
                "length",
                "signal",
                "body",
                "field",
                "bundled",
                "output",
                "recording",
                "wire",
                "limb",
            ],
        ),
        ("dds", vec!["error"]),
        ("robot", vec!["error", "signal", "body", "author", "recording", "source", "dds"]),
        ("colours", vec![]),
        ("page", vec!["error", "percept", "signal", "body", "stage", "scene", "colours"]),
        (
            "sink",
            vec!["error", "output", "percept", "signal", "body", "scene", "recording", "page", "robot", "dds", "limb"],
        ),
        ("ink", vec!["error"]),
        (
            "picture",
            vec!["error", "percept", "signal", "body", "field", "scene", "backend", "engine", "ink", "colours"],
        ),
        (
            "contents",
            vec![
                "error",
                "percept",
                "signal",
                "body",
                "scene",
                "backend",
                "engine",
                "recording",
                "source",
                "robot",
                "setup",
            ],
        ),
        ("convert", vec!["error", "signal", "body", "bundled", "author", "output", "recording", "source"]),
        ("figure", vec!["error", "ink"]),
        ("plot", vec!["error", "percept", "signal", "body", "field", "scene", "engine", "ink", "colours"]),
        (
            "run",
            vec![
                "error",
                "percept",
                "signal",
                "body",
                "engine",
                "recording",
                "source",
                "sink",
                "output",
                "scene_file",
                "setup",
            ],
        ),
        (
            "setup",
            vec![
                "error",
                "body",
                "bundled",
                "engine",
                "limits",
                "output",
                "recording",
                "robot",
                "scene_file",
                "signal",
                "sink",
                "source",
            ],
        ),
        ("scene_file", [&below_backend[..], &["backend", "bundled", "engine", "touch", "source", "sink"]].concat()),
    ])
}

/// What every module may use, and which use nothing.
const FOR_ALL: [&str; 4] = ["limits", "plain", "random", "renamed"];

fn rust_files(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            rust_files(&path, found);
        } else if path.extension().is_some_and(|e| e == "rs") {
            found.push(path);
        }
    }
}

/// The source folders of the crates, and what their paths begin with in the crate that has all of them under its own name.
const CRATES: [(&str, &str); 10] = [
    ("src", ""),
    ("crates/skin/src", ""),
    ("crates/engine/src", ""),
    ("crates/author/src", "author"),
    ("crates/wire/src", "wire"),
    ("crates/recording/src", "recording"),
    ("crates/sources/src", ""),
    ("crates/robot/src", ""),
    ("crates/page/src", "page"),
    ("crates/sinks/src", ""),
];

/// The rooms of `somatic-skin` that other crates of the house call as if they were their own.
const GROUND_FLOOR: [&str; 12] = [
    "body", "colours", "error", "field", "keys", "length", "limits", "output", "parallel", "plain", "random", "signal",
];

/// Every file of every crate: its path as if all were one crate, and its text, in which the paths are such too.
fn house() -> Vec<(PathBuf, String)> {
    let mut all = Vec::new();
    for (folder, room) in CRATES {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join(folder);
        let mut files = Vec::new();
        rust_files(&root, &mut files);
        for file in files {
            let mut within = Path::new(room).join(file.strip_prefix(&root).unwrap());
            let mut text = std::fs::read_to_string(&file).unwrap();
            if folder != "src" && within.ends_with("lib.rs") {
                if room.is_empty() {
                    continue;
                }
                within = within.with_file_name("mod.rs");
            }
            if !room.is_empty() {
                let own = format!("crate::{room}::");
                text = text.replace("crate::", &own);
                for ground in GROUND_FLOOR {
                    text = text.replace(&format!("{own}{ground}"), &format!("crate::{ground}"));
                }
            }
            // What a crate names of another is what the house has of it.
            for room in ["backend", "percept", "scene", "stage", "touch"] {
                text = text.replace(&format!("somatic_engine::{room}::"), &format!("crate::{room}::"));
            }
            all.push((within, text));
        }
    }
    all
}

/// Every file, as (top module, path, text without its tests).
fn sources() -> Vec<(String, PathBuf, String)> {
    house()
        .into_iter()
        .map(|(within, text)| {
            let module = room(&within).to_owned();
            let text = text.split("#[cfg(test)]\nmod tests {").next().unwrap().to_owned();
            (module, within, text)
        })
        .collect()
}

/// All files but the command's own root, with their tests, which [`Paths`] leaves out.
fn paths() -> Paths {
    Paths::from_files(house().into_iter().filter(|(file, _)| !file.ends_with("main.rs")))
}

/// The room that a file is of: a folder of a crate, or a file there.
fn room(file: &Path) -> &str {
    file.iter().next().unwrap().to_str().unwrap().trim_end_matches(".rs")
}

#[test]
fn arrows_point_one_way() {
    let (allowed, paths) = (allowed(), paths());
    for (file, used) in paths.uses(true) {
        let room_of = room(file);
        // The command sees the library's public face alone.
        if ["lib", "tradeoff", "cli", "experiments", "survey"].contains(&room_of) {
            continue;
        }
        let may = allowed.get(room_of).unwrap_or_else(|| panic!("say in this test what `{room_of}` may use"));
        for other in used {
            let is_allowed = room(other) == room_of || FOR_ALL.contains(&room(other)) || may.contains(&room(other));
            assert!(is_allowed, "{} uses {}; see the arrows in this test", file.display(), other.display());
        }
    }
}

#[test]
fn no_files_use_each_other_in_a_circle() {
    let paths = paths();
    let uses = paths.uses(false);
    assert!(uses.values().map(BTreeSet::len).sum::<usize>() > 500, "so many arrows are not seen");
    if let Some(circle) = circle(&uses) {
        panic!("these use each other: {circle:?}");
    }
}

#[test]
fn an_arrow_is_seen_however_it_is_written() {
    let files = |third: &str| {
        [
            ("lib.rs", "mod one; mod two; mod three { } pub use one::One;"),
            ("one.rs", "pub(super) struct One; #[cfg(test)] mod tests { use crate::two::Two; }"),
            ("two/mod.rs", "mod deep; pub use self::deep::Deep; pub struct Two;"),
            ("two/deep.rs", "pub struct Deep;"),
            ("three.rs", third),
        ]
        .map(|(path, text)| (PathBuf::from(path), text.to_owned()))
    };
    let used_by_third = |text: &str| -> Vec<String> {
        let paths = Paths::from_files(files(text));
        let uses = paths.uses(false);
        assert!(uses[Path::new("one.rs")].is_empty(), "what tests use does not count");
        uses[Path::new("three.rs")].iter().map(|path| path.display().to_string()).collect()
    };
    for text in [
        "use crate::one::One;",
        "use crate::{one::{One as Other}};",
        "use super::One;",
        "fn f(_: &crate::one::One) {}",
        "fn f() { println!(\"{:?}\", crate::one::One); }",
        "mod inner { use super::super::one::One; }",
    ] {
        assert_eq!(used_by_third(text), ["one.rs"], "{text}");
    }
    // What a module hands on is its maker's.
    assert_eq!(used_by_third("use crate::two::{Deep, Two};"), ["two/deep.rs", "two/mod.rs"]);
    assert!(used_by_third("pub use crate::one::One; use std::fmt;").is_empty());
    let paths = Paths::from_files(
        [("a.rs", "use crate::{b::B};"), ("b.rs", "use super::c::C;"), ("c.rs", "struct C(super::a::A);")]
            .map(|(path, text)| (PathBuf::from(path), text.to_owned()))
            .into_iter()
            .chain([(PathBuf::from("lib.rs"), String::new())]),
    );
    assert_eq!(circle(&paths.uses(false)).map(|files| files.len()), Some(3));
}

#[test]
fn each_heavy_dependency_has_one_door() {
    let doors = [
        ("wgpu", "backend/gpu"),
        ("pollster", "backend/gpu"),
        ("gltf", "body"),
        ("cobs", "wire"),
        ("crc", "wire/format.rs|wire/encode.rs|wire/decode.rs"),
        ("csv", "source|body/taxel_table.rs|sink/table/csv_sink.rs|contents/contact_table.rs"),
        ("encoding_rs", "source/vendor"),
        ("encoding_rs_io", "source/vendor"),
        ("memchr", "source/vendor"),
        ("flate2", "source/gzip.rs"),
        ("parquet", "sink/table/parquet_sink.rs|source/lerobot.rs"),
        ("clap", "cli"),
        ("comfy_table", "cli"),
        (
            "toml",
            "error.rs|keys.rs|signal|source/simulated|source/time_column.rs|source/vendor|author/recipe|scene_file/accuracy.rs",
        ),
        ("rayon", "parallel.rs|backend/cpu/tests.rs|experiments|author/sample_neighbours.rs"),
        ("globset", "scene|author/recipe_values.rs"),
        ("fearless_simd", "backend/cpu"),
        ("plotters", "ink.rs|figure.rs|picture|plot/draw.rs|plot/pen.rs|tradeoff/plot.rs"),
        ("png", "ink.rs"),
        ("rustix", "cli/board/pty.rs|cli/keys.rs|source/ports.rs|page/wake.rs|output/lock.rs"),
        ("tungstenite", "page/socket.rs|source/text/web_socket.rs"),
        ("httparse", "page/http.rs"),
        ("getrandom", "page/token.rs"),
        ("roxmltree", "author/mesh"),
        ("mcap", "recording"),
        ("rusqlite", "recording/sqlite.rs"),
        ("crc32fast", "recording"),
        ("lz4_flex", "recording"),
        ("prost", "recording"),
        ("ruzstd", "recording"),
        ("serialport", "source"),
        ("ros2_client", "dds"),
        ("zenoh", "limb/network.rs"),
    ];
    for (dependency, door) in doors {
        let mut seen = false;
        for (_, path, text) in sources() {
            let code: String =
                text.lines().map(|line| line.split("//").next().unwrap_or("")).collect::<Vec<_>>().join("\n");
            let uses = code.contains(&format!("{dependency}::")) && !code.contains(&format!("_{dependency}::"));
            let door_open = door.split('|').any(|door| path.starts_with(door)) || path == Path::new("main.rs");
            assert!(!uses || door_open, "{} uses {dependency}, whose door is src/{door}", path.display());
            seen |= uses;
        }
        assert!(seen, "{dependency} is used nowhere");
    }
}

/// The documentation is not there after an installation: a message or a file says the thing itself.
#[test]
fn no_message_leads_to_a_page_that_is_not_installed() {
    for (_, path, text) in sources() {
        for line in text.lines().filter(|line| !line.trim_start().starts_with("//")) {
            let cites =
                line.split("docs/").skip(1).any(|rest| rest.split([' ', ')', ';']).next().unwrap().contains(".md"));
            assert!(!cites, "{}: {line}", path.display());
        }
    }
}

#[test]
fn no_file_is_too_long_for_one_sitting() {
    let mut of_python = Vec::new();
    rust_files(&Path::new(env!("CARGO_MANIFEST_DIR")).join("python/src"), &mut of_python);
    assert!(!of_python.is_empty());
    let of_python = of_python.into_iter().map(|path| (std::fs::read_to_string(&path).unwrap(), path));
    let of_crates = sources().into_iter().map(|(_, path, text)| (text, path));
    for (text, path) in of_crates.chain(of_python) {
        let lines = text.lines().count();
        assert!(lines <= 450, "{} has {lines} lines", path.display());
    }
}

/// The functions of `text` whose bodies have several lines: the name of each, and its lines from `fn` to the brace that closes it.
fn functions(text: &str) -> Vec<(&str, usize)> {
    let lines: Vec<&str> = text.lines().collect();
    let mut found = Vec::new();
    for (at, line) in lines.iter().enumerate() {
        let indent = &line[..line.len() - line.trim_start().len()];
        let mut words =
            line.split_whitespace().skip_while(|word| word.starts_with("pub") || ["const", "async"].contains(word));
        let Some(name) = words.next().filter(|word| *word == "fn").and_then(|_| words.next()) else { continue };
        let name = name.split(['(', '<']).next().unwrap();
        // What a trait asks for ends with a semicolon.
        let ends = |line: &&str| {
            line.strip_prefix(indent).is_some_and(|rest| rest == "}" || rest.starts_with(')') && rest.ends_with(';'))
        };
        if !line.ends_with(['}', ';']) {
            found.push((name, 2 + lines[at + 1..].iter().position(ends).unwrap()));
        }
    }
    found
}

#[test]
fn no_function_is_too_long_for_one_screen() {
    let mut count = 0;
    for (_, path, text) in sources().into_iter().filter(|(_, path, _)| !path.ends_with("tests.rs")) {
        for (name, lines) in functions(&text) {
            assert!(lines < 80, "`{name}` in {} has {lines} lines; split it by what it does", path.display());
            count += 1;
        }
    }
    assert!(count > 4000, "{count} functions are not all");
}

#[test]
fn lines_of_functions_are_counted_to_their_closing_braces() {
    let text = "fn one() {}\ntrait T {\n    fn two(\n        self,\n    ) -> u8;\n    fn three(self) -> u8 {\n        if true {\n\
                            1\n        } else {\n            2\n        }\n    }\n}\n\
                pub(super) const fn four<T>(\n    t: T,\n) -> T {\n    t\n}\n";
    assert_eq!(functions(text), [("two", 3), ("three", 7), ("four", 5)]);
}

#[test]
fn only_outputs_are_written() {
    let writes = [
        "File::create",
        "File::options",
        "OpenOptions",
        "fs::write",
        "fs::copy",
        "fs::rename",
        "fs::hard_link",
        "fs::create_dir",
        "fs::remove",
        "create_new",
        "symlink(",
        "set_permissions",
        ".set_len(",
        "persist",
        "tempfile",
    ];
    let mut seen = Vec::new();
    for (module, path, text) in sources() {
        if path.ends_with("tests.rs") {
            continue;
        }
        let code: Vec<&str> = text.lines().map(|line| line.split("//").next().unwrap_or("")).collect();
        // `CsvFile::create` is another's.
        let says = |line: &str, word: &str| {
            line.match_indices(word).any(|(at, _)| !line[..at].ends_with(char::is_alphanumeric))
        };
        for word in writes.into_iter().filter(|word| code.iter().any(|line| says(line, word))) {
            assert!(
                module == "output",
                "{} says {word}; files are written by crates/skin/src/output alone",
                path.display()
            );
            seen.push(word);
        }
    }
    for word in ["File::options", "create_new", "symlink(", "persist", "tempfile"] {
        assert!(seen.contains(&word), "{word} is not even seen where it is");
    }
}

#[test]
fn files_are_read_whole_within_limits_only() {
    let mut seen = Vec::new();
    for (_, path, text) in sources() {
        if path.ends_with("tests.rs") {
            continue;
        }
        // Some tests are of one system only.
        let text = text.split("mod tests {").next().unwrap();
        let code: Vec<&str> = text.lines().map(|line| line.split("//").next().unwrap_or("")).collect();
        // What is taken of a reader has an end; `limits::read` has it too.
        let whole = |line: &&str| {
            let line = line.replace("limits::read", "");
            ["fs::read(", "fs::read_to_string(", "read_to_end(", "read_to_string(", "File::open("]
                .into_iter()
                .find(|word| line.contains(word) && !line.contains(".take("))
        };
        for word in code.iter().filter_map(whole) {
            // Recordings, line by line or record by record; and a file that is only locked.
            let streams = [
                "source/csv.rs",
                "source/gzip.rs",
                "source/lerobot.rs",
                "source/map/json_lines.rs",
                "source/ndjson.rs",
                "source/vendor/lines.rs",
                "recording",
                "output/lock.rs",
            ]
            .iter()
            .any(|at| path.starts_with(at));
            let allowed =
                path == Path::new("limits.rs") || (streams && ["File::open(", "read_to_end("].contains(&word));
            assert!(allowed, "{} says {word}; a file is read whole by crates/skin/src/limits.rs alone", path.display());
            seen.push(word);
        }
    }
    for word in ["read_to_end(", "read_to_string(", "File::open("] {
        assert!(seen.contains(&word), "{word} is not even seen where it is");
    }
}

#[test]
fn all_that_is_printed_is_escaped_in_one_place() {
    // Where text goes to a terminal, after `plain` has seen it; and what writes bytes for programs.
    let doors = ["plain.rs", "cli/stdio.rs", "cli/screen.rs", "cli/tune/session.rs"];
    let raw = [
        "println!",
        "print!(",
        "dbg!(",
        "stdout().lock",
        "stdout().write",
        "stderr().write",
        "stderr(), ",
        "term.write",
    ];
    let mut seen = Vec::new();
    for (_, path, text) in sources() {
        if path.ends_with("tests.rs") {
            continue;
        }
        let text = text.split("mod tests {").next().unwrap();
        for line in text.lines().map(|line| line.split("//").next().unwrap_or("")) {
            for word in raw.into_iter().filter(|word| line.contains(word)) {
                let door = doors.iter().any(|door| path == Path::new(door));
                assert!(door, "{} says `{word}`; messages go through plain.rs or cli/stdio.rs", path.display());
                assert_ne!(word, "println!", "{}: a closed terminal would be a panic", path.display());
                seen.push(word);
            }
        }
    }
    for word in ["stderr(), ", "term.write", "stdout().lock"] {
        assert!(seen.contains(&word), "{word} is not even seen where it is");
    }
}
