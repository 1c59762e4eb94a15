//! Outputs: never an input of the same command, never a file that is there unless forced, at every subcommand.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::process::Output;

use tempfile::TempDir;

use super::{done, somatic, stderr, text_of};

/// An output of a subcommand.
struct Written {
    flag: &'static str,
    /// A command that writes it to `OUT`, in the folder that [`workplace`] makes.
    command: &'static str,
    /// How its name must end.
    ending: &'static str,
    /// What the command reads.
    reads: &'static [&'static str],
}

const WRITTEN: &[Written] = &[
    Written {
        flag: "--sink",
        command: "run --body hand.glb --source csv:touch.csv --calibration cal.toml --sink ndjson:OUT",
        ending: "",
        reads: &["touch.csv", "hand.glb", "cal.toml"],
    },
    Written {
        flag: "--sink",
        command: "run --body hand.glb --source csv:touch.csv --calibration cal.toml --sink mcap:OUT",
        ending: "",
        reads: &["touch.csv", "hand.glb", "cal.toml"],
    },
    Written {
        flag: "--sink",
        command: "run --body hand.glb --source csv:touch.csv --calibration cal.toml --sink csv:OUT",
        ending: "",
        reads: &["touch.csv", "hand.glb", "cal.toml"],
    },
    Written {
        flag: "--sink",
        command: "run --source mcap:touch.mcap --sink ndjson:OUT",
        ending: "",
        reads: &["touch.mcap"],
    },
    Written {
        flag: "--sink",
        command: "run --source sim:sim.toml --sink ndjson:OUT",
        ending: "",
        reads: &["sim.toml", "hand.glb"],
    },
    Written {
        flag: "--sink",
        command: "run --body arm.gltf --source csv:touch.csv --sink ndjson:OUT",
        ending: "",
        reads: &["arm.gltf", "arm.bin", "arm.png"],
    },
    Written {
        flag: "--sink",
        command: "run scene.toml --sink ndjson:OUT",
        ending: "",
        reads: &["scene.toml", "hand.glb", "touch.csv", "cal.toml"],
    },
    Written {
        flag: "--summary",
        command: "run --body hand.glb --source serial:nowhere --wiring wiring.toml --sink ndjson:/dev/null --summary OUT",
        ending: "",
        reads: &["hand.glb", "wiring.toml"],
    },
    Written {
        flag: "--output",
        command: "author arm.gltf --recipe recipe.toml --output OUT",
        ending: ".glb",
        reads: &["arm.gltf", "arm.bin", "recipe.toml", "points.csv", "skin.txt"],
    },
    Written {
        flag: "--output",
        command: "author robot.urdf --package p=. --taxels 9 --output OUT",
        ending: ".glb",
        reads: &["robot.urdf", "link.glb"],
    },
    Written {
        flag: "--output",
        command: "author --grid 1x2 --pitch 5mm --cells mask.glb --output OUT",
        ending: ".glb",
        reads: &["mask.glb"],
    },
    Written {
        flag: "--output",
        command: "author hand.glb --zones points.csv --output OUT",
        ending: ".glb",
        reads: &["hand.glb", "points.csv"],
    },
    Written {
        flag: "--output",
        command: "author --compare hand.glb hand.glb --output OUT",
        ending: ".svg",
        reads: &["hand.glb"],
    },
    Written {
        flag: "--output",
        command: "plot csv:touch.csv --body hand.glb --calibration cal.toml --output OUT",
        ending: ".svg",
        reads: &["touch.csv", "hand.glb", "cal.toml"],
    },
    Written { flag: "--output", command: "render hand.glb --output OUT", ending: ".png", reads: &["hand.glb"] },
    Written {
        flag: "--plot",
        command: "tradeoff scene.toml --within 1mm --write --plot OUT",
        ending: ".svg",
        reads: &["scene.toml", "hand.glb", "touch.csv", "cal.toml"],
    },
    Written {
        flag: "--output",
        command: "simulate sim.toml --output OUT --truth truth.csv",
        ending: "",
        reads: &["sim.toml", "hand.glb"],
    },
    Written {
        flag: "--truth",
        command: "simulate sim.toml --output frames.csv --truth OUT",
        ending: "",
        reads: &["sim.toml", "hand.glb"],
    },
    Written {
        flag: "OUT",
        command: "convert touch.csv mcap:OUT --body hand.glb --calibration cal.toml",
        ending: "",
        reads: &["touch.csv", "hand.glb", "cal.toml"],
    },
    Written { flag: "--contacts", command: "info mcap:touch.mcap --contacts OUT", ending: "", reads: &["touch.mcap"] },
    Written { flag: "--output", command: "convert hand.glb --output OUT", ending: ".csv", reads: &["hand.glb"] },
    Written { flag: "--output", command: "convert hand.glb --output OUT", ending: ".urdf", reads: &["hand.glb"] },
    Written { flag: "OUT", command: "convert sim:sim.toml csv:OUT", ending: "", reads: &["sim.toml", "hand.glb"] },
    Written {
        flag: "--link",
        command: "board --source touch.csv --wiring wiring.toml --for 0.1s --link OUT",
        ending: "",
        reads: &["touch.csv", "wiring.toml"],
    },
    Written {
        flag: "--output",
        command: "calibrate --body hand.glb --source touch.csv --output OUT",
        ending: "",
        reads: &["hand.glb", "touch.csv"],
    },
    Written {
        flag: "--output",
        command: "calibrate --body hand.glb --gains-from touch.csv --calibration cal.toml --output OUT",
        ending: "",
        reads: &["hand.glb", "touch.csv", "cal.toml"],
    },
    Written {
        flag: "--output",
        command: "calibrate --body hand.glb --source touch.csv --known 1N --on field --calibration cal.toml --output OUT",
        ending: "",
        reads: &["hand.glb", "touch.csv", "cal.toml"],
    },
    Written {
        flag: "--plot",
        command: "calibrate --body hand.glb --source serial:nowhere --wiring wiring.toml --output new.toml --plot OUT",
        ending: ".svg",
        reads: &["hand.glb", "wiring.toml"],
    },
    Written {
        flag: "--output",
        command: "tune --body hand.glb --source serial:nowhere --wiring wiring.toml --press 1 --output OUT",
        ending: "",
        reads: &["hand.glb", "wiring.toml"],
    },
    Written {
        flag: "--fsr-calibration",
        command: "tune --body hand.glb --source serial:nowhere --wiring wiring.toml --press 1 --fsr-calibration OUT",
        ending: "",
        reads: &["hand.glb", "wiring.toml"],
    },
];

/// Outputs that are folders, of commands that read nothing, and a file that they write.
const FOLDERS: [(&str, &str, &str); 2] = [
    ("--out", "paper --quick --out OUT", "table.json"),
    ("--dump", "bench --sensors 9 --fields 1 --members 2 --calls 1 --backend cpu --dump OUT", "values.npy"),
];

/// Those of the subcommands that this build has.
fn all_written() -> impl Iterator<Item = &'static Written> {
    let is_there = |written: &&Written| match written.subcommand() {
        "render" => cfg!(feature = "gpu"),
        "board" => cfg!(unix),
        _ => true,
    };
    WRITTEN.iter().filter(is_there)
}

impl Written {
    fn arguments(&self, output: &str) -> Vec<String> {
        self.command.split(' ').map(|word| word.replace("OUT", output)).collect()
    }

    fn subcommand(&self) -> &str {
        self.command.split(' ').next().unwrap()
    }

    /// Ways to force it.
    fn forces(&self) -> &'static [&'static [&'static str]] {
        if self.flag == "--link" { &[&[]] } else { &[&[], &["--force"]] }
    }
}

const SIMULATION: &str = "body = \"hand.glb\"\nrate_hz = 50\nduration_s = 0.1\n";

/// A folder with everything that the commands read.
fn workplace() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let put = |name: &str, bytes: &[u8]| std::fs::write(folder.path().join(name), bytes).unwrap();
    put("hand.glb", somatic::bundled::HAND);
    put("touch.csv", b"t,4\n0,0\n0.1,5\n");
    put("touch.mcap", b"opened after the outputs are");
    put("cal.toml", b"[all]\nbaseline = 1\n");
    put("wiring.toml", include_bytes!("../../examples/wirings/hand.toml"));
    put("sim.toml", SIMULATION.as_bytes());
    put(
        "scene.toml",
        b"body = \"hand.glb\"\nsource = \"csv:touch.csv\"\ncalibration = \"cal.toml\"\nbackend = \"cpu\"\n",
    );
    put(
        "recipe.toml",
        b"[[place]]\ncsv = \"points.csv\"\n[[place]]\nfirst_id = 9\nicub = \"skin.txt\"\nname = \"b\"\n",
    );
    put("mask.glb", b"1,1\n");
    put("link.glb", b"no mesh at all");
    put(
        "robot.urdf",
        br#"<robot name="r"><link name="l"><visual><geometry><mesh filename="package://p/link.glb"/></geometry></visual></link></robot>"#,
    );
    put("points.csv", b"id,x,y,z\n");
    put("skin.txt", b"");
    put("arm.bin", b"\0\0\0\0");
    put("arm.png", b"");
    put(
        "arm.gltf",
        br#"{"asset":{"version":"2.0"},"buffers":[{"uri":"arm.bin","byteLength":4}],"images":[{"uri":"arm.png"}]}"#,
    );
    std::fs::create_dir(folder.path().join("inner")).unwrap();
    folder
}

fn all_in(folder: &Path) -> BTreeMap<String, Option<Vec<u8>>> {
    let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap());
    entries.map(|e| (e.file_name().into_string().unwrap(), std::fs::read(e.path()).ok())).collect()
}

fn run_in(folder: &Path, arguments: &[String], more: &[&str]) -> Output {
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).chain(more.iter().copied()).collect();
    somatic(&arguments).current_dir(folder).output().unwrap()
}

/// Runs what must be refused with `code` and one line, and leave `folder` as it is; gives the line.
fn refused(folder: &Path, code: i32, arguments: &[String], more: &[&str]) -> String {
    let before = all_in(folder);
    let output = run_in(folder, arguments, more);
    let said = stderr(&output);
    assert_eq!((output.status.code(), said.lines().count()), (Some(code), 1), "{arguments:?} {more:?}: {said}");
    assert!(all_in(folder) == before, "{arguments:?} {more:?} left something else behind");
    said
}

#[test]
fn no_output_is_an_input() {
    for written in all_written() {
        let folder = workplace();
        for &input in written.reads {
            let mut spellings = vec![
                input.to_owned(),
                format!("./{input}"),
                format!("inner/../{input}"),
                text_of(&folder.path().join(input)).to_owned(),
            ];
            let alias = |kind: &str| format!("{kind}-{input}{}", written.ending);
            std::fs::hard_link(folder.path().join(input), folder.path().join(alias("hard"))).unwrap();
            spellings.push(alias("hard"));
            #[cfg(unix)]
            {
                use std::os::unix::fs::symlink;
                symlink(input, folder.path().join(alias("soft"))).unwrap();
                let _ = symlink("..", folder.path().join("inner/linked"));
                spellings.extend([
                    alias("soft"),
                    format!("inner/linked/{input}"),
                    format!("inner/linked/{}", alias("soft")),
                ]);
            }
            spellings.retain(|spelling| spelling.ends_with(written.ending));
            // Where the input cannot have the ending itself, a link to it can.
            assert!(spellings.len() > 1 || cfg!(not(unix)));
            for spelling in spellings {
                for force in written.forces() {
                    let why = refused(folder.path(), 2, &written.arguments(&spelling), force);
                    assert!(why.contains(&format!("{spelling}: this is the input ")), "{why}");
                    assert!(why.contains(&format!("{input} and would be lost")), "{why}");
                }
            }
        }
    }
}

#[test]
fn a_file_that_is_there_stays_unless_forced() {
    for written in all_written() {
        let folder = workplace();
        let name = format!("there{}", written.ending);
        std::fs::write(folder.path().join(&name), "mine").unwrap();
        let why = refused(folder.path(), 1, &written.arguments(&name), &[]);
        let way_out = if written.flag == "--link" { "give --link another" } else { "it exists" };
        assert!(why.contains(&name) && why.contains(way_out), "{why}");
        let nowhere = format!("no/such{}", written.ending);
        assert!(
            written.flag == "--link" || refused(folder.path(), 1, &written.arguments(&nowhere), &[]).contains(&nowhere)
        );
    }
    for (_, command, file) in FOLDERS {
        let folder = workplace();
        let arguments: Vec<String> = command.split(' ').map(|word| word.replace("OUT", "there")).collect();
        std::fs::create_dir(folder.path().join("there")).unwrap();
        std::fs::write(folder.path().join("there").join(file), "mine").unwrap();
        let why = refused(folder.path(), 1, &arguments, &[]);
        assert!(why.contains(file) && why.contains("it exists"), "{why}");
        assert_eq!(all_in(&folder.path().join("there")).len(), 1, "nothing is written beside it");
        let output = run_in(folder.path(), &arguments, &["--force"]);
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
        assert_ne!(std::fs::read(folder.path().join("there").join(file)).unwrap(), b"mine");
    }
}

#[test]
fn two_outputs_are_two_files() {
    let folder = workplace();
    #[cfg(unix)]
    std::os::unix::fs::symlink("..", folder.path().join("inner/linked")).unwrap();
    for (command, ending) in [
        ("run --sink ndjson:ONE --sink mcap:OTHER", ""),
        ("run --source serial:nowhere --sink ndjson:ONE --summary OTHER", ""),
        ("simulate sim.toml --output ONE --truth OTHER", ""),
        ("calibrate --body hand.glb --source touch.csv --output ONE --plot OTHER", ".svg"),
        ("tune --source serial:nowhere --press 1 --output ONE --fsr-calibration OTHER", ""),
    ] {
        let one = format!("out{ending}");
        for other in [one.clone(), format!("inner/../{one}"), format!("inner/linked/{one}")] {
            if other.contains("linked") && cfg!(not(unix)) {
                continue;
            }
            let arguments = command.split(' ').map(|word| word.replace("ONE", &one).replace("OTHER", &other));
            let why = refused(folder.path(), 2, &arguments.collect::<Vec<_>>(), &["--force"]);
            assert!(why.contains(&format!("{other}: the output {one} is the same file")), "{why}");
        }
    }
}

#[test]
fn what_is_put_beside_an_output_is_an_output() {
    for beside in ["touch.truth.csv", "touch.calibration.toml"] {
        let folder = workplace();
        std::fs::write(folder.path().join(beside), SIMULATION).unwrap();
        let simulate = |from: &str| ["simulate", from, "-o", "touch.x"].map(str::to_owned);
        let why = refused(folder.path(), 2, &simulate(beside), &["--force"]);
        assert!(why.contains(&format!("{beside}: this is the input {beside}")), "{why}");
        let why = refused(folder.path(), 1, &simulate("sim.toml"), &[]);
        assert!(why.contains(&format!("{beside}: it exists")), "{why}");
    }
}

#[test]
fn keys_of_a_scene_are_held_to_the_same() {
    for input in ["scene.toml", "hand.glb", "touch.csv", "cal.toml"] {
        let folder = workplace();
        let scene = folder.path().join("scene.toml");
        let text = std::fs::read_to_string(&scene).unwrap();
        for force in [false, true] {
            std::fs::write(&scene, format!("sink = \"ndjson:inner/../{input}\"\noverwrite = {force}\n{text}")).unwrap();
            let elsewhere = tempfile::tempdir().unwrap();
            let before = all_in(folder.path());
            let why = refused(elsewhere.path(), 2, &["run".to_owned(), text_of(&scene).to_owned()], &[]);
            assert!(why.contains("this is the input ") && why.contains(input), "{why}");
            assert!(all_in(folder.path()) == before);
        }
    }
}

#[test]
fn a_forced_run_that_fails_leaves_what_was_there() {
    let folder = workplace();
    let at = |name: &str| folder.path().join(name);
    std::fs::write(at("out.ndjson"), "mine").unwrap();
    std::fs::write(at("cut.csv"), "t,4\n0,1\n0.1\n0.2,1\n").unwrap();
    let words = |text: &str| -> Vec<String> { text.split(' ').map(str::to_owned).collect() };
    refused(folder.path(), 1, &words("run --quiet --backend cpu --source cut.csv --sink out.ndjson"), &["--force"]);
    refused(folder.path(), 1, &words("convert cut.csv csv:out.ndjson"), &["--force"]);
    let run = words("run --quiet --backend cpu --source touch.csv --sink out.ndjson");
    refused(folder.path(), 1, &run, &[]);
    assert_eq!(run_in(folder.path(), &run, &["--force"]).status.code(), Some(0));
    assert_eq!(std::fs::read_to_string(at("out.ndjson")).unwrap().lines().count(), 2);
}

#[test]
fn an_edit_in_place_stays_one() {
    let folder = workplace();
    let scene = folder.path().join("scene.toml");
    let before = std::fs::read_to_string(&scene).unwrap();
    let command = "tradeoff scene.toml --within 1m --write --seconds 0.1 --frames 2 --quiet";
    let arguments: Vec<String> = command.split(' ').map(str::to_owned).collect();
    std::fs::write(folder.path().join("touch.csv"), "t,4\n0,9\n0.1,5\n").unwrap();
    let output = run_in(folder.path(), &arguments, &[]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert!(stderr(&output).contains("written into scene.toml"), "{}", stderr(&output));
    assert!(std::fs::read_to_string(&scene).unwrap() != before);
}

#[cfg(unix)]
#[test]
fn pipes_and_devices_are_written_as_they_are() {
    let folder = workplace();
    let words = |text: &str| -> Vec<String> { text.split(' ').map(str::to_owned).collect() };
    let said = |command: &str| {
        let output = run_in(folder.path(), &words(command), &[]);
        assert_eq!(output.status.code(), Some(0), "{command}: {}", stderr(&output));
        String::from_utf8(output.stdout).unwrap()
    };
    let run = "run --quiet --backend cpu --source touch.csv";
    let plain = said(run);
    assert_eq!(plain.lines().count(), 2);
    assert_eq!(
        said(&format!("{run} --sink ndjson:/dev/null --sink ndjson:/dev/null --sink ndjson:/dev/stdout")),
        plain
    );
    assert_eq!(said("simulate sim.toml -o /dev/stdout --truth /dev/null").lines().count(), 6);
    assert!(!std::fs::metadata("/dev/null").unwrap().is_file());
    // Nothing is put beside a device.
    assert!(!Path::new("/dev/stdout.calibration.toml").exists() && !Path::new("/dev/stdout.truth.csv").exists());
    assert!(refused(folder.path(), 2, &words("simulate sim.toml -o /dev/stdout"), &[]).contains("give --truth a file"));

    // A named pipe, and what a shell hands over as /dev/fd/63.
    let program = env!("CARGO_BIN_EXE_somatic");
    let shell = |script: &str| {
        let mut shell = std::process::Command::new("sh");
        let output = shell.args(["-ec", script, program]).current_dir(folder.path()).output().unwrap();
        assert!(output.status.success(), "{script}: {}", stderr(&output));
        String::from_utf8(output.stdout).unwrap()
    };
    assert_eq!(shell(&format!("mkfifo pipe; \"$0\" {run} --sink ndjson:pipe & cat pipe; wait")), plain);
    assert_eq!(shell(&format!("{{ \"$0\" {run} --sink ndjson:/dev/fd/3 3>&1 >/dev/null; }} | cat")), plain);
    // Led into a file, standard output is that file from where it stands, and nothing of it goes.
    let kept = shell(&format!("echo mine > log; \"$0\" {run} --sink ndjson:/dev/stdout >> log; cat log"));
    assert_eq!(kept, format!("mine\n{plain}"));
}

#[cfg(unix)]
#[test]
fn standard_streams_led_into_an_input_are_that_input() {
    let folder = workplace();
    let program = env!("CARGO_BIN_EXE_somatic");
    let refused = |script: &str| {
        let before = all_in(folder.path());
        let output =
            std::process::Command::new("sh").args(["-c", script, program]).current_dir(folder.path()).output().unwrap();
        assert_eq!(output.status.code(), Some(2), "{script}: {}", stderr(&output));
        assert!(stderr(&output).contains("this is the input "), "{script}: {}", stderr(&output));
        assert!(all_in(folder.path()) == before, "{script}");
    };
    for sink in ["", "--sink -", "--sink ndjson:/dev/stdout --force"] {
        refused(&format!("\"$0\" run --source touch.csv {sink} >> touch.csv"));
    }
    std::fs::write(folder.path().join("in.ndjson"), "{\"t\":0,\"values\":{\"4\":1}}\n").unwrap();
    refused("\"$0\" run --body hand --source - --sink in.ndjson --force < in.ndjson");
}

/// Flags and places of arguments that name what is read.
const READ: &[&str] = &[
    "--body",
    "--joints",
    "--joint-states",
    "--poses",
    "--zones",
    "--source",
    "--calibration",
    "--wiring",
    "--zenoh-config",
    "--recipe",
    "[SCENE]",
    "<BODY>",
    "[BODY]",
    "[MESH]",
    "[SOURCE]...",
    "--cells",
    "--compare",
    "--icub",
    "--package",
    "--urdf-skin",
    "--gains-from",
    "--mjcf-skin",
    "--csv-skin",
    "--layout",
    "--map",
    "<IN>",
    "<FILE.toml>",
    "<FILE>",
    "<FILE>...",
    "[WHAT]",
];

/// What values that name no file are called.
const NO_FILES: &[&str] = &[
    "AXIS",
    "BACKEND",
    "BAUD",
    "BITS",
    "COLUMNS",
    "COLUMN[:UNIT",
    "F",
    "FAULTS",
    "FIELD",
    "FORCE,...",
    "FORCE|SHARE",
    "FORMAT",
    "FRAME",
    "GLOB",
    "HOW",
    "HOST:PORT",
    "ID",
    "IDS",
    "K",
    "KIND",
    "LENGTH",
    "LENGTH,ANGLE",
    "LENGTH[,LENGTH",
    "LETTER",
    "LETTER,...",
    "LINK",
    "LOW..HIGH",
    "M",
    "MEASURE",
    "N",
    "NAME",
    "ORDER",
    "OUTPUT,...",
    "P",
    "PART,...",
    "PIXELS",
    "RAW,...",
    "REST",
    "ROWSxCOLUMNS",
    "RADIUS",
    "RATE",
    "S",
    "SEED",
    "SHELL",
    "SIGNAL,...",
    "T",
    "TABLE",
    "TEXT",
    "TIME",
    "UNIT",
    "VIEW",
    "WAY",
    "WHAT",
    "WHEN",
    "WIPER",
    "WIPERS",
    "WHICH",
    "X",
    "WORD",
];

/// What a help text has on flags and arguments with values: the flag, or the argument as it stands there, and the value's
/// name.
fn valued(help: &str) -> Vec<(String, String)> {
    let mut found = Vec::new();
    let before_examples = help.split("\nExamples:").next().unwrap();
    for line in before_examples.lines().filter(|line| line.starts_with(' ')) {
        let line = line.trim_start();
        let name = line.split_once(['<', '[']).map(|(_, rest)| rest.split(['>', ']']).next().unwrap().to_owned());
        let word = line.split_whitespace().find(|word| !word.starts_with('-') || word.starts_with("--"));
        match (word, name) {
            (Some(flag), Some(name)) if line.starts_with('-') && flag.starts_with("--") => {
                let end = flag.find(|c: char| !(c.is_alphanumeric() || c == '-')).unwrap_or(flag.len());
                let is_value = line.split_once(flag).unwrap().1.trim_start().starts_with('<');
                if is_value || flag.contains('[') {
                    found.push((flag[..end].to_owned(), name.trim_start_matches("=<").to_owned()));
                }
            }
            (Some(word), Some(name)) if word.starts_with(['<', '[']) && !name.starts_with(char::is_lowercase) => {
                found.push((word.to_owned(), name));
            }
            _ => {}
        }
    }
    found
}

#[test]
fn every_output_of_every_subcommand_is_in_these_tests() {
    let help = done(&["--help"]);
    let listed = help.split("\nUse:\n").nth(1).unwrap().split("\nOptions:\n").next().unwrap();
    let is_name = |line: &&str| line.starts_with("  ") && !line.starts_with("   ");
    let subcommands: Vec<&str> =
        listed.lines().filter(is_name).map(|line| line.split_whitespace().next().unwrap()).collect();
    assert!(subcommands.len() > 12 && subcommands.contains(&"run"), "{subcommands:?}");
    let mut tested: BTreeSet<(&str, &str)> =
        all_written().map(|written| (written.subcommand(), written.flag)).collect();
    tested.extend(FOLDERS.map(|(flag, command, _)| (command.split(' ').next().unwrap(), flag)));
    let mut seen = BTreeSet::new();
    for subcommand in subcommands.into_iter().filter(|name| *name != "help") {
        for (flag, value) in valued(&done(&[subcommand, "--help"])) {
            let named = flag.trim_matches(['<', '>', '[', ']']);
            if let Some(&known) = tested.iter().find(|known| **known == (subcommand, named)) {
                seen.insert(known);
                continue;
            }
            let only_named = flag == "--sink" && ["plan", "tradeoff"].contains(&subcommand);
            let is_known = READ.contains(&flag.as_str()) || NO_FILES.contains(&value.as_str()) || only_named;
            assert!(is_known, "say in these tests whether `somatic {subcommand}` reads or writes {flag} <{value}>");
        }
    }
    assert_eq!(seen, tested, "the help does not show all that these tests write");
    let help = "Options:\n      --rate <RATE>  [default: 1]\n  -o, --out <FILE>\n      --loop[=<N>]\n  <IN>\n  -h, --help  Say\n\nExamples:\n  [[place]]\n";
    let found = valued(help);
    let found: Vec<(&str, &str)> = found.iter().map(|(flag, value)| (flag.as_str(), value.as_str())).collect();
    assert_eq!(found, [("--rate", "RATE"), ("--out", "FILE"), ("--loop", "N"), ("<IN>", "IN")]);
}
