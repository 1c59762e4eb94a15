//! Ctrl-C, `SIGTERM`, closed streams and two processes with one output: nothing hangs, and no part of a file passes for a whole one.

use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use super::{code_of, done, files_in, frames, somatic, stderr, text_of};

/// One taxel of the bundled hand's palm.
const PRESSED: &str = "t,4\n0,0\n0.1,5\n0.2,7\n";

fn signal(child: &Child, name: &str) {
    assert!(Command::new("kill").args([name, &child.id().to_string()]).status().unwrap().success());
}

/// Waits until `is_so`.
fn wait_for(what: &str, mut is_so: impl FnMut() -> bool) {
    let start = Instant::now();
    while !is_so() {
        assert!(start.elapsed() < Duration::from_secs(20), "never: {what}");
        std::thread::sleep(Duration::from_millis(10));
    }
}

/// A recording of `thousands` thousand frames. Its time begins again every ten seconds.
fn long(path: &Path, thousands: usize) {
    let rows: String = (0..1000).map(|k| format!("{},{}\n", f64::from(k) / 100.0, k % 7)).collect();
    std::fs::write(path, format!("t,4\n{}", rows.repeat(thousands))).unwrap();
}

fn parts(folder: &Path) -> Vec<String> {
    files_in(folder).into_iter().filter(|name| name.ends_with(".part")).collect()
}

#[test]
fn an_interrupted_recording_leaves_no_part_under_a_final_name() {
    for (name, old) in [("-INT", false), ("-TERM", true)] {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        std::fs::write(at("touch.csv"), PRESSED).unwrap();
        let made = ["out.csv", "out.mcap", "out.ndjson"];
        for file in made.iter().filter(|_| old) {
            std::fs::write(at(file), "mine").unwrap();
        }
        // Its second frame comes after a minute and a half.
        let mut run = somatic(&["run", "--backend", "cpu", "--quiet", "--source", "touch.csv", "--speed", "0.001"])
            .args([
                "--outputs",
                "total",
                "--sink",
                "-",
                "--sink",
                "out.csv",
                "--sink",
                "out.mcap",
                "--sink",
                "out.ndjson",
            ])
            .args(if old { &["--force"][..] } else { &[] })
            .current_dir(folder.path())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut lines = BufReader::new(run.stdout.take().unwrap()).lines();
        lines.next().unwrap().unwrap();
        assert_eq!(parts(folder.path()).len(), 3);
        let begin = Instant::now();
        signal(&run, name);
        assert_eq!(code_of(&mut run), Some(3), "{name}");
        assert!(begin.elapsed() < Duration::from_secs(3), "{:?}", begin.elapsed());
        let said = stderr(&run.wait_with_output().unwrap());
        assert!(said.contains("never processed: touch.csv after t = 0 s: interrupted after 1 frame"), "{said}");
        assert!(parts(folder.path()).is_empty(), "{:?}", files_in(folder.path()));
        if old {
            assert!(said.contains("out.csv, out.mcap, out.ndjson are not written"), "{said}");
            for file in made {
                assert_eq!(std::fs::read_to_string(at(file)).unwrap(), "mine", "{file}");
            }
        } else {
            // Lines are of use without those after them.
            assert!(said.contains("out.csv, out.mcap are not written"), "{said}");
            assert_eq!(files_in(folder.path()), ["out.ndjson", "touch.csv"]);
            assert_eq!(frames(&std::fs::read_to_string(at("out.ndjson")).unwrap()).len(), 1);
        }
        // Uninterrupted, all of them are there.
        let sinks = ["--sink", "out.csv", "--sink", "out.mcap", "--sink", "out.ndjson", "--force"];
        let run = ["run", "--backend", "cpu", "--quiet", "--source", "touch.csv", "--outputs", "total"];
        let output = somatic(&[&run[..], &sinks].concat()).current_dir(folder.path()).output().unwrap();
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
        assert_eq!(frames(&std::fs::read_to_string(at("out.ndjson")).unwrap()).len(), 3);
        done(&["info", text_of(&at("out.mcap"))]);
    }
}

#[test]
fn what_plays_until_it_is_ended_is_whole_when_it_is() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let mut run = somatic(&["run", "--quiet", "--backend", "cpu", "--loop", "--speed", "1", "--sink", "-"])
        .args(["--sink", &format!("mcap:{}", at("out.mcap").display()), "--sink", text_of(&at("out.csv"))])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut lines = BufReader::new(run.stdout.take().unwrap()).lines();
    lines.next().unwrap().unwrap();
    signal(&run, "-INT");
    assert_eq!(code_of(&mut run), Some(0));
    assert_eq!(files_in(folder.path()), ["out.csv", "out.mcap", "out.touches.csv"]);
    done(&["info", text_of(&at("out.mcap"))]);
}

#[test]
fn an_interrupted_conversion_keeps_what_was_there() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    long(&at("long.csv"), 3000);
    for to in ["out.mcap", "out.csv"] {
        std::fs::write(at(to), "mine").unwrap();
        let mut convert = somatic(&["convert", "long.csv", to, "--force"])
            .current_dir(folder.path())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        wait_for("a part", || parts(folder.path()).len() == 1);
        signal(&convert, "-INT");
        let code = code_of(&mut convert);
        let said = stderr(&convert.wait_with_output().unwrap());
        assert_eq!(code, Some(3), "{said}");
        assert!(said.contains("never processed: long.csv") && said.contains(&format!("{to} is not written")), "{said}");
        assert_eq!(std::fs::read_to_string(at(to)).unwrap(), "mine");
        assert!(parts(folder.path()).is_empty());
    }
}

/// Commands that take long, or wait for ever for input that does not come, in a folder with the named pipe `pipe.csv`.
const LONG: &[(&str, &[i32])] = &[
    ("run --source pipe.csv --sink out.ndjson", &[1, 3]),
    ("run --source - --sink out.ndjson --sink out.csv --sink mcap:out.mcap", &[0]),
    ("run --source long.csv --backend reference --sink out.csv", &[3]),
    ("view pipe.csv --body hand --listen 127.0.0.1:0", &[0, 1]),
    ("view --listen 127.0.0.1:0", &[0]),
    ("info pipe.csv", &[1]),
    ("info long.csv", &[1]),
    ("convert pipe.csv out.mcap", &[1, 3]),
    ("plot pipe.csv --body hand -o out.svg", &[1, 3]),
    ("plot long.csv --body hand -o out.svg", &[3]),
    ("render hand --source long.csv --from 0 --to 9999 -o out.png", &[1]),
    ("calibrate --body hand --source pipe.csv -o out.toml", &[1, 3]),
    ("calibrate --body hand --source long.csv -o out.toml", &[3]),
    ("simulate long.toml -o out.csv", &[1]),
    ("tradeoff --seconds 100", &[1]),
    ("tradeoff --body hand --source long.csv --seconds 100", &[1]),
    ("bench --calls 1000000", &[0, 1]),
    ("bench --sensors 100000 --fields 2000 --members 2000 --frames 200", &[0, 1]),
    ("paper --out figures", &[1]),
    ("board --loop", &[0]),
    ("board --source long.csv", &[0]),
    ("plan --source pipe.csv --outputs centroid", &[1]),
];

/// After how long each is interrupted, counted from when it heeds signals. What a fast machine ends before that is started again, and
/// signalled sooner.
const WAITS_MS: [u64; 5] = [700, 250, 80, 20, 0];

/// Waits until `child` heeds `SIGINT`, which it does from its first milliseconds on; on a busy machine those take a while. Before
/// that the signal ends any process.
fn wait_until_it_heeds_signals(child: &mut Child) {
    const SIGINT_BIT: u64 = 1 << 1;
    if !cfg!(target_os = "linux") {
        return std::thread::sleep(Duration::from_millis(80));
    }
    let status = format!("/proc/{}/status", child.id());
    wait_for("a handler of signals", || {
        let text = std::fs::read_to_string(&status).unwrap_or_default();
        let caught = text.lines().find_map(|line| line.strip_prefix("SigCgt:"));
        let caught = caught.and_then(|bits| u64::from_str_radix(bits.trim(), 16).ok()).unwrap_or(0);
        caught & SIGINT_BIT != 0 || child.try_wait().unwrap().is_some()
    });
}

#[test]
fn every_command_that_takes_long_ends_soon_after_ctrl_c() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    long(&at("long.csv"), 5000);
    std::fs::write(
        at("long.toml"),
        "body = \"hand\"\nrate_hz = 1000\nduration_s = 100000\n[[touch]]\non = \"hand/palm\"\nindenter = \"ball\"\n\
         radius_m = 0.01\npath = [[0, 0]]\nhold = { newton = 5 }\n",
    )
    .unwrap();
    assert!(Command::new("mkfifo").arg(at("pipe.csv")).status().unwrap().success());
    let before = files_in(folder.path());
    for (command, codes) in LONG {
        if (command.starts_with("render") && cfg!(not(feature = "gpu")))
            || (command.starts_with("view") && cfg!(not(feature = "page")))
        {
            continue;
        }
        let ended = WAITS_MS.iter().find_map(|&wait_ms| {
            let words: Vec<&str> = command.split(' ').collect();
            let mut child = somatic(&words)
                .current_dir(folder.path())
                .stdin(Stdio::piped())
                .stdout(Stdio::piped())
                .stderr(Stdio::piped())
                .spawn()
                .unwrap();
            wait_until_it_heeds_signals(&mut child);
            std::thread::sleep(Duration::from_millis(wait_ms));
            let begin = Instant::now();
            let is_over = child.try_wait().unwrap().is_some();
            if !is_over {
                signal(&child, "-INT");
            }
            let code = code_of(&mut child).unwrap_or_else(|| panic!("{command} is ended by a signal itself"));
            // Whether it was over, or the signal met it in its last moment.
            if is_over || code == 0 && !codes.contains(&0) {
                for name in files_in(folder.path()).into_iter().filter(|name| !before.contains(name)) {
                    std::fs::remove_file(at(&name)).unwrap();
                }
                return None;
            }
            Some((child, code, begin.elapsed(), wait_ms))
        });
        let (child, code, took, wait_ms) = ended.unwrap_or_else(|| panic!("{command} is over already"));
        eprintln!("{command}: exit {code} after {} ms", took.as_millis());
        let said = stderr(&child.wait_with_output().unwrap());
        // So soon a busy machine has not opened all that the command reads; then there is nothing to bring to an end.
        let may_be_opening = wait_ms <= 80 && code == 1 && said.ends_with("error: interrupted\n");
        assert!(codes.contains(&code) || may_be_opening, "{command}: {code}: {said}");
        // A second on an idle machine.
        assert!(took < Duration::from_secs(4), "{command}: {took:?}");
        assert!(code == 0 || said.contains("interrupted") || said.contains("stopped"), "{command}: {said}");
        for name in files_in(folder.path()).into_iter().filter(|name| !before.contains(name)) {
            let is_stream = code == 0 || name == "out.ndjson";
            assert!(is_stream, "{command} leaves {name}");
            std::fs::remove_file(at(&name)).unwrap();
        }
    }
}

#[test]
fn the_second_signal_ends_what_the_first_does_not() {
    // Nobody reads what it writes.
    let mut run = somatic(&["run", "--quiet", "--loop", "--backend", "cpu", "--all-fields", "--sink", "-"])
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    // From its first line on it has something to bring to an end.
    let mut out = BufReader::new(run.stdout.take().unwrap());
    out.read_line(&mut String::new()).unwrap();
    std::thread::sleep(Duration::from_millis(300));
    signal(&run, "-INT");
    std::thread::sleep(Duration::from_millis(500));
    assert!(run.try_wait().unwrap().is_none());
    signal(&run, "-INT");
    assert_eq!(code_of(&mut run), Some(130));
}

#[test]
fn a_hangup_does_not_end_what_was_started_to_outlive_it() {
    let command = format!("trap '' HUP; exec {} run --source - --sink -", env!("CARGO_BIN_EXE_somatic"));
    let mut run = Command::new("sh")
        .args(["-c", &command])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let (mut to, mut from) = (run.stdin.take().unwrap(), BufReader::new(run.stdout.take().unwrap()).lines());
    for _ in 0..2 {
        writeln!(to, r#"{{"t":0,"values":{{"4":1}}}}"#).unwrap();
        assert!(from.next().unwrap().unwrap().contains("\"t\""));
        signal(&run, "-HUP");
    }
    signal(&run, "-TERM");
    assert_eq!(code_of(&mut run), Some(0));
}

#[test]
fn two_processes_do_not_write_one_file() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("touch.csv"), PRESSED).unwrap();
    for out in ["out.mcap", "out.csv", "out.ndjson"] {
        let mut first = somatic(&["run", "--quiet", "--backend", "cpu", "--source", "-", "--sink", "-", "--sink", out])
            .current_dir(folder.path())
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let mut to = first.stdin.take().unwrap();
        let mut lines = BufReader::new(first.stdout.take().unwrap()).lines();
        writeln!(to, r#"{{"t":0,"values":{{"4":1}}}}"#).unwrap();
        lines.next().unwrap().unwrap();
        let run: &[&str] = &["run", "--quiet", "--backend", "cpu", "--source", "touch.csv", "--force", "--sink", out];
        let convert: &[&str] = &["convert", "touch.csv", out, "--force"];
        let second = |arguments: &[&str]| somatic(arguments).current_dir(folder.path()).output().unwrap();
        let refused = format!("{out}: process {} is writing it", first.id());
        for arguments in [run, convert].into_iter().filter(|it| it[0] == "run" || out != "out.ndjson") {
            let output = second(arguments);
            assert_eq!(output.status.code(), Some(1), "{arguments:?}");
            assert!(stderr(&output).contains(&refused), "{}", stderr(&output));
        }
        // The first has lost nothing of it.
        writeln!(to, r#"{{"t":1,"values":{{"4":1}}}}"#).unwrap();
        lines.next().unwrap().unwrap();
        drop(to);
        assert_eq!(code_of(&mut first), Some(0));
        if out == "out.mcap" {
            let info = done(&["info", "--json", text_of(&folder.path().join(out))]);
            assert!(info.contains("\"frames\": 2") || info.contains("\"frames\":2"), "{info}");
        }
        let output = second(run);
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    }
    assert!(parts(folder.path()).is_empty());
}

#[test]
fn a_stream_that_was_closed_from_the_start_is_an_error() {
    let folder = tempfile::tempdir().unwrap();
    let shell = |script: &str| {
        let program = env!("CARGO_BIN_EXE_somatic");
        let mut shell = Command::new("sh");
        let output = shell.args(["-c", script, program]).current_dir(folder.path()).output().unwrap();
        (output.status.code(), stderr(&output))
    };
    for command in [
        "run --quiet --sink -",
        "run --quiet",
        "run --quiet --sink csv:-",
        "run --quiet --sink ndjson:/dev/stdout",
        "inspect hand",
        "info x.csv",
        "calibrate --body hand --source x.csv -o new.toml",
    ] {
        std::fs::write(folder.path().join("x.csv"), PRESSED).unwrap();
        let (code, said) = shell(&format!("\"$0\" {command} >&-"));
        assert_eq!(code, Some(1), "{command}: {said}");
        assert!(said.contains("standard output: it is closed"), "{command}: {said}");
        assert_eq!(shell(&format!("\"$0\" {command} >/dev/null 2>&1 || [ $? = 1 ]")).0, Some(0), "{command}");
    }
    let (code, said) = shell("\"$0\" run --quiet --source - <&-");
    assert_eq!(code, Some(1), "{said}");
    assert!(said.contains("standard input: it is closed"), "{said}");
    // What goes elsewhere needs no standard output, and a null device is not a closed one.
    assert_eq!(shell("\"$0\" run --quiet --sink out.ndjson >&-"), (Some(0), String::new()));
    assert_eq!(shell("\"$0\" run --quiet --sink - 1<>/dev/null"), (Some(0), String::new()));
}

#[test]
fn a_dash_is_standard_output_wherever_an_output_is_named() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("touch.csv"), PRESSED).unwrap();
    let run_in = |command: &str| {
        let words: Vec<&str> = command.split_whitespace().collect();
        somatic(&words).current_dir(folder.path()).output().unwrap()
    };
    let out = |command: &str| {
        let output = run_in(command);
        assert_eq!(output.status.code(), Some(0), "{command}: {}", stderr(&output));
        output.stdout
    };
    let text = |command: &str| String::from_utf8(out(command)).unwrap();
    let run = "run --quiet --backend cpu --source touch.csv";
    out(&format!("{run} --outputs total,touches --sink out.csv"));
    let at = |name: &str| std::fs::read_to_string(folder.path().join(name)).unwrap();
    let table = |with: &str| text(&format!("{run} --outputs total,touches --sink csv:- {with}"));
    assert_eq!(table("--table fields"), at("out.csv"));
    assert_eq!(table("--table touches"), at("out.touches.csv"));
    assert_eq!(table(""), at("out.csv"), "fields where any are asked for");
    let alone = text(&format!("{run} --outputs touches --sink csv:-"));
    assert_eq!(alone, at("out.touches.csv"), "touches where nothing is asked of fields");
    assert!(out(&format!("{run} --sink mcap:-")).starts_with(b"\x89MCAP"));
    assert_eq!(text(&format!("{run} --sink ndjson:-")), text(&format!("{run} --sink -")));
    assert_eq!(text("convert touch.csv csv:-"), PRESSED);
    assert!(out("convert touch.csv mcap:-").starts_with(b"\x89MCAP"));
    assert!(text("convert hand csv:-").starts_with("id,"));
    let simulation = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/simulations/rod.toml");
    assert!(text(&format!("simulate {simulation} -o - --truth truth.csv")).starts_with("t,"));
    for (command, why) in [
        (format!("{run} --sink - --sink csv:-"), "standard output already"),
        (format!("{run} --sink csv:- --sink mcap:-"), "standard output already"),
        (format!("{run} --sink ros2-mcap:-"), "name one"),
        (format!("{run} --outputs total --sink csv:- --table touches"), "--outputs touches"),
        (format!("{run} --sink csv:- --table fileds"), "did you mean `fields`?"),
        (format!("{run} --sink out.csv --table fields"), "--sink csv:-"),
        (format!("simulate {simulation} -o -"), "give --truth a file"),
        ("calibrate --body hand --source touch.csv -o -".to_owned(), "standard output already"),
        ("author --grid 1x2 --pitch 5mm -o -".to_owned(), "a body is a .glb"),
        ("plot touch.csv -o -".to_owned(), ".svg or .png"),
        ("bench --dump -".to_owned(), "name one"),
        ("paper --out -".to_owned(), "name one"),
    ] {
        let output = run_in(&command);
        assert_eq!(output.status.code(), Some(2), "{command}: {}", stderr(&output));
        assert!(stderr(&output).contains(why), "{command}: {}", stderr(&output));
    }
    assert!(!files_in(folder.path()).iter().any(|name| name.starts_with('-')), "{:?}", files_in(folder.path()));
    // Who wants a file of that name says so.
    out(&format!("{run} --sink csv:./-"));
    assert!(folder.path().join("-").exists());
}

#[test]
fn a_reader_that_goes_is_a_normal_end_of_a_table_too() {
    let mut run = somatic(&["run", "--quiet", "--loop", "--backend", "cpu", "--all-fields", "--sink", "csv:-"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut reader = run.stdout.take().unwrap();
    reader.read_exact(&mut [0; 4096]).unwrap();
    drop(reader);
    assert_eq!(code_of(&mut run), Some(0));
    assert_eq!(stderr(&run.wait_with_output().unwrap()), "");
}
