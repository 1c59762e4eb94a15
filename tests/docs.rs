//! Every command that the documentation shows is run, as written, in a folder with what a reader would have there.
#![cfg(feature = "cli")]

#[path = "docs/letters.rs"]
mod letters;
#[path = "docs/table.rs"]
mod table;

use std::panic::resume_unwind;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::Mutex;
use std::time::Instant;

use somatic_testing::skip;

/// Commands that are the project's own builds and tests; CI runs them, or they would run themselves from here.
const RUN_ELSEWHERE: [&str; 15] = [
    "cargo run --release -- view --open",
    "cargo run --release --example embed",
    "cargo run --example bodies",
    "cargo run --example bodies -- --check",
    "cargo install --path .",
    "pip install ./python",
    "tests/run",
    ".ci/run",
    // Measuring takes minutes, and is for release builds on a machine at rest.
    "cargo bench",
    "cargo bench --bench engine -- live",
    "cargo bench --bench gpu > gpu.json",
    "cargo bench --bench activity",
    "cargo bench --bench viewers",
    "benches/peers/run",
    "benches/recordings/run",
];

/// Commands that take long, and the shorter form that is run for them.
const SHORTENED: [(&str, &str); 15] = [
    // A port of its own, as other tests serve pages, too.
    ("somatic view --for 2s", "somatic view --for 1s --listen 127.0.0.1:0"),
    (
        "somatic view examples/exports/insoles.csv --for 2s",
        "somatic view examples/exports/insoles.csv --for 1s --listen 127.0.0.1:0",
    ),
    (
        "somatic view --outputs touches,total,centroid,orientation --for 2s",
        "somatic view --outputs touches,total,centroid,orientation --for 1s --listen 127.0.0.1:0",
    ),
    (
        "somatic view before.mcap --beside bodies/touch.csv --for 2s",
        "somatic view before.mcap --beside bodies/touch.csv --for 1s --listen 127.0.0.1:0",
    ),
    ("somatic tradeoff", "somatic tradeoff --seconds 0.1 --frames 60"),
    (
        "somatic tradeoff --fields hand/back --plot hand.svg",
        "somatic tradeoff --fields hand/back --plot hand.svg --seconds 0.1 --frames 60",
    ),
    (
        "somatic tradeoff --body grid.glb --plot grid.svg",
        "somatic tradeoff --body grid.glb --plot grid.svg --seconds 0.1 --frames 60",
    ),
    (
        "somatic tradeoff --body dense.glb --plot humanoid.svg",
        "somatic tradeoff --body dense.glb --plot humanoid.svg --seconds 0.1 --frames 20",
    ),
    (
        "somatic tradeoff --source sim:examples/simulations/mat.toml --all --seconds 0.2",
        "somatic tradeoff --source sim:examples/simulations/mat.toml --all --seconds 0.1 --frames 20",
    ),
    (
        "somatic tradeoff examples/scenes/palm.toml --within '3 mm, 30 deg' --write",
        "somatic tradeoff examples/scenes/palm.toml --within '3 mm, 30 deg' --write --seconds 0.1 --frames 250",
    ),
    ("somatic author humanoid --taxels 6000 -o dense.glb", "somatic author humanoid --taxels 500 -o dense.glb"),
    (
        "somatic author humanoid --taxels 960 --even off -o scattered.glb",
        "somatic author humanoid --taxels 300 --even off -o scattered.glb",
    ),
    ("somatic author humanoid --taxels 960 -o even.glb", "somatic author humanoid --taxels 300 -o even.glb"),
    ("somatic paper --out paper", "somatic paper --quick --out paper"),
    (
        "somatic bench --sensors 7560 --fields 600 --members 24 --frames 9984 --backend cpu",
        "somatic bench --sensors 7560 --fields 600 --members 24 --frames 16 --backend cpu --calls 2",
    ),
];

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// The lines of all `sh` blocks of a page, comments cut off.
fn commands(page: &str) -> Vec<String> {
    commands_of(page, "```sh")
}

/// The same of blocks that begin with `begin`.
fn commands_of(page: &str, begin: &str) -> Vec<String> {
    let mut inside = false;
    let mut commands = Vec::new();
    for line in page.lines() {
        match line.trim() {
            line if line == begin => inside = true,
            "```" => inside = false,
            command if inside && !command.is_empty() && !command.starts_with('#') => {
                commands.push(command.split("  #").next().unwrap().trim().to_owned());
            }
            _ => {}
        }
    }
    commands
}

fn pages() -> Vec<PathBuf> {
    let mut pages = vec![root().join("README.md"), root().join("CONTRIBUTING.md"), root().join("bodies/README.md")];
    pages_below(&root().join("docs"), &mut pages);
    pages
}

/// Adds all pages in `folder` and in the folders below it.
fn pages_below(folder: &Path, pages: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            pages_below(&path, pages);
        } else if path.extension().is_some_and(|e| e == "md") {
            pages.push(path);
        }
    }
}

/// A folder such as a reader works in: the project's bodies and docs, and a recording of their own for the mat.
fn workplace() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for name in ["bodies", "docs", "examples"] {
        let (from, to) = (root().join(name), folder.path().join(name));
        std::fs::create_dir(&to).unwrap();
        copy(&from, &to);
    }
    let ids: Vec<String> = (0..2048).map(|id| id.to_string()).collect();
    let mut recording = format!("t,{}\n", ids.join(","));
    for frame in 0..5 {
        let row: Vec<String> = (0..2048).map(|id| ((id * 31 + frame * 17) % 300).to_string()).collect();
        recording += &format!("{frame},{}\n", row.join(","));
    }
    std::fs::write(folder.path().join("recording.csv"), recording).unwrap();
    folder
}

fn copy(from: &Path, to: &Path) {
    for entry in std::fs::read_dir(from).unwrap() {
        let entry = entry.unwrap();
        let to = to.join(entry.file_name());
        if entry.file_type().unwrap().is_dir() {
            std::fs::create_dir(&to).unwrap();
            copy(&entry.path(), &to);
        } else {
            std::fs::copy(entry.path(), to).unwrap();
        }
    }
}

/// What a shell in `folder` does with `command`.
fn shell(command: &str, folder: &Path) -> Output {
    let program = Path::new(env!("CARGO_BIN_EXE_somatic"));
    let paths = std::env::join_paths(
        std::iter::once(program.parent().unwrap().to_path_buf())
            .chain(std::env::split_paths(&std::env::var_os("PATH").unwrap_or_default())),
    )
    .unwrap();
    Command::new("sh")
        .args(["-ec", command])
        .current_dir(folder)
        .env("PATH", &paths)
        .env("XDG_CACHE_HOME", folder.join("cache"))
        .output()
        .unwrap()
}

#[test]
fn the_lines_that_are_shown_are_what_the_commands_above_them_print() {
    for page in ["README.md", "docs/reference/ndjson.md"] {
        let text = std::fs::read_to_string(root().join(page)).unwrap();
        let (above, rest) = text.split_once("```json\n").unwrap();
        let shown: String = rest.split("```").next().unwrap().lines().collect();
        let output = shell(&commands(above).pop().unwrap(), workplace().path());
        assert_eq!(String::from_utf8_lossy(&output.stdout).trim_end(), shown, "{page}: {output:?}");
    }
}

/// README is read by people who have just come: what grows over this belongs on a page of its own.
#[test]
fn the_readme_is_short() {
    let lines = std::fs::read_to_string(root().join("README.md")).unwrap().lines().count();
    assert!(lines <= 120, "{lines} lines");
}

#[test]
fn every_command_that_is_shown_runs() {
    // Each page by itself, two beside each other.
    let left = Mutex::new(pages());
    let worker = || -> usize {
        let next = || left.lock().unwrap().pop();
        std::iter::from_fn(next).map(|page| run_page(&page)).sum()
    };
    // Skips are listed by the thread's name.
    let named = || std::thread::Builder::new().name("every_command_that_is_shown_runs".to_owned());
    let run: usize = std::thread::scope(|scope| {
        let workers = [(); 2].map(|()| named().spawn_scoped(scope, worker).unwrap());
        workers.into_iter().map(|worker| worker.join().unwrap_or_else(|e| resume_unwind(e))).sum()
    });
    assert!(run >= 6, "only {run} commands were found in the documentation");
}

/// Runs the commands of a page, one after the other. Gives their number; with `--nocapture`, says which take long.
fn run_page(page: &Path) -> usize {
    let mut run = 0;
    let text = std::fs::read_to_string(page).unwrap();
    let folder = workplace();
    for command in commands(&text) {
        if RUN_ELSEWHERE.contains(&command.as_str()) {
            continue;
        }
        let shortened = SHORTENED.iter().find(|(long, _)| *long == command).map_or(&command[..], |(_, short)| short);
        let started = Instant::now();
        let output = shell(shortened, folder.path());
        let took_s = started.elapsed().as_secs_f64();
        if took_s > 5.0 {
            println!("{took_s:.0} s  {}: {command}", page.display());
        }
        let no_driver = String::from_utf8_lossy(&output.stderr).contains("no GPU driver answers");
        if no_driver && !output.status.success() {
            skip("GPU", format!("no adapter answers, and `{command}` draws"));
            continue;
        }
        assert!(
            output.status.success(),
            "{}: `{command}` ended with {}\n{}",
            page.display(),
            output.status,
            String::from_utf8_lossy(&output.stderr)
        );
        run += 1;
    }
    run
}

/// Files that blocks of `sh data` need, where they lie below the data.
const DATA: [&str; 2] = ["layouts/icub/left_forearm_V2.txt", "layouts/icub/left_hand_V2_1.txt"];

#[test]
fn every_command_about_files_made_elsewhere_runs() {
    let data = std::env::var_os("SOMATIC_DATA").map_or_else(|| root().join("../shared/data"), PathBuf::from);
    let missing = DATA.iter().find(|name| !data.join(name).is_file());
    if let Some(missing) = missing {
        skip("DATA", format!("{} is not there", data.join(missing).display()));
        return;
    }
    let mut run = 0;
    for page in pages() {
        let text = std::fs::read_to_string(&page).unwrap();
        let folder = tempfile::tempdir().unwrap();
        for name in DATA {
            std::fs::copy(data.join(name), folder.path().join(Path::new(name).file_name().unwrap())).unwrap();
        }
        for command in commands_of(&text, "```sh data") {
            let output = shell(&command, folder.path());
            let said = String::from_utf8_lossy(&output.stderr);
            if said.contains("no GPU driver answers") {
                skip("GPU", format!("no adapter answers, and `{command}` draws"));
                continue;
            }
            assert!(output.status.success(), "{}: `{command}` ended with {}\n{said}", page.display(), output.status);
            run += 1;
        }
    }
    assert!(run >= 6, "only {run} commands were found");
}

#[test]
fn every_command_about_live_topics_of_ros_2_runs() {
    if cfg!(not(feature = "ros2")) {
        skip("ROS2_FEATURE", "this build has no feature `ros2`, which the commands of docs/how-to/ros2.md need");
        return;
    }
    // A domain in which nobody else is.
    let domain = format!("ROS_DOMAIN_ID={} ", std::process::id() % 101 + 1);
    assert!(run_all("```sh ros2", &domain) >= 3);
}

#[test]
fn every_command_about_limbs_runs() {
    if cfg!(not(feature = "zenoh")) {
        skip(
            "ZENOH_FEATURE",
            "this build has no feature `zenoh`, which the commands of docs/how-to/several-computers.md need",
        );
        return;
    }
    assert!(run_all("```sh zenoh", "") >= 1);
}

/// Runs all commands of blocks that begin with `begin`, each after `before`. Gives their number.
fn run_all(begin: &str, before: &str) -> usize {
    let folder = workplace();
    let mut run = 0;
    for page in pages() {
        let text = std::fs::read_to_string(&page).unwrap();
        for command in commands_of(&text, begin) {
            let command = format!("{before}{command}");
            let output = shell(&command, folder.path());
            let said = String::from_utf8_lossy(&output.stderr);
            assert!(output.status.success(), "{}: `{command}` ended with {}\n{said}", page.display(), output.status);
            run += 1;
        }
    }
    run
}

#[test]
fn commands_are_found_where_they_stand() {
    let page = "text\n```sh\nsomatic run   # why\n\n# no\nls\n```\nsomatic no\n```json\n{}\n```\n";
    assert_eq!(commands(page), ["somatic run", "ls"]);
    assert_eq!(commands_of("```sh data\nls\n```\n```sh\npwd\n```\n", "```sh data"), ["ls"]);
}

#[test]
fn every_link_within_the_project_leads_somewhere() {
    for page in pages() {
        let text = std::fs::read_to_string(&page).unwrap();
        for link in text.split("](").skip(1).filter_map(|rest| rest.split(')').next()) {
            if link.contains("://") || link.starts_with('#') {
                continue;
            }
            let target = page.parent().unwrap().join(link.split('#').next().unwrap());
            assert!(target.exists(), "{}: [{link}] leads nowhere", page.display());
        }
    }
}

#[test]
fn nothing_is_promised_that_is_not_there() {
    for text in pages().into_iter().map(|page| std::fs::read_to_string(page).unwrap()) {
        // The crate is not published.
        assert!(!text.contains("cargo install somatic"));
    }
}
