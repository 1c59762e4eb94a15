//! The README's table "What do you have?": every command in it runs, with what its reader would have.

use somatic_testing::skip;

use super::{root, shell, workplace};

/// Commands of the table that are run elsewhere: `tests/python/run`, `.ci/run`.
const ELSEWHERE: [&str; 2] = ["pip install ./python", "cargo run --release --example embed"];

/// What the rows name, in a folder that has the project's bodies and examples.
const HAVE: [&str; 9] = [
    "cp bodies/hand.glb skin.glb; cp bodies/hand.glb hand.glb; cp bodies/touch.csv touch.csv",
    "cp examples/exports/insoles.csv walk.csv",
    "cp examples/robots/arm.urdf robot.urdf",
    "somatic author --urdf-skin examples/robots/arm.urdf -o arm.glb",
    "somatic run -q --body arm.glb --source - --joints robot.urdf --sink ros2-mcap:bag < examples/robots/arm-drive.ndjson",
    r#"printf '{"t":0,"pads":[{"force":[0,9]},{"force":[3,4]}]}\n' > messages.ndjson"#,
    r#"printf 'values = "pads[*].force"\n' > pads.toml"#,
    "sed 's/duration_s = 5/duration_s = 1/' examples/simulations/press.toml > press.toml",
    r#"printf '{"t":0,"values":{"4":1}}\n' > frames.ndjson"#,
];

/// What stands in for hardware, other programs and people who look: a part of a command, and what is run in its place.
const STAND_INS: [(&str, &str); 9] = [
    ("somatic view", "somatic view --for 1s --listen 127.0.0.1:0"),
    // An arm has taxels of its own.
    ("--body skin.glb --source ros2-mcap:bag", "--body arm.glb --source ros2-mcap:bag"),
    ("hand.glb --taxels 500 -o skin.glb", "hand.glb --taxels 50 -o own.glb"),
    ("robot.urdf --taxels 500 -o skin.glb", "robot.urdf --taxels 50 -o robot.glb"),
    ("somatic run --source text:/dev/ttyUSB0@115200", "somatic run --source text:- < examples/arduino/fsr_row.txt"),
    (
        "somatic run --body skin.glb --source serial:/dev/ttyUSB0",
        "somatic board --wiring examples/wirings/hand.toml --link line --wait --for 6s > board.txt & sleep 1; \
         somatic run --body skin.glb --source serial:line --for 2s --wiring examples/wirings/hand.toml",
    ),
    ("driver |", "cat frames.ndjson |"),
    ("| controller", "> percepts.ndjson"),
    ("somatic run --body skin.glb --source ros2:/skin --sink ros2", "somatic run --sink ros2 --for 1s"),
];

/// The commands of the table in `text`, row by row.
fn rows(text: &str) -> Vec<Vec<String>> {
    let table = text.split("\n## What do you have?\n").nth(1).unwrap().split("\n## ").next().unwrap();
    let row = |line: &str| -> Option<Vec<String>> {
        // A bar within a command is written `\|`.
        let line = line.replace("\\|", "\u{0}");
        let cell = line.strip_prefix('|')?.split('|').nth(1)?.replace('\u{0}', "|");
        let quoted: Vec<String> = cell.split('`').skip(1).step_by(2).map(str::to_owned).collect();
        let begins = ["somatic ", "pip ", "cargo ", "driver "];
        let commands: Vec<String> =
            quoted.into_iter().filter(|quoted| begins.iter().any(|begin| quoted.starts_with(begin))).collect();
        (!commands.is_empty()).then_some(commands)
    };
    table.lines().filter_map(row).collect()
}

#[test]
fn every_command_of_the_readmes_table_runs() {
    let rows = rows(&std::fs::read_to_string(root().join("README.md")).unwrap());
    assert!(rows.len() >= 14, "{rows:?}");
    let folder = workplace();
    let done = |command: &str| {
        let output = shell(command, folder.path());
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "`{command}` ended with {}\n{said}", output.status);
    };
    HAVE.iter().for_each(|command| done(command));
    let mut used = [false; STAND_INS.len()];
    for command in rows.iter().flatten().filter(|command| !ELSEWHERE.contains(&command.as_str())) {
        if command.contains("--sink ros2") && cfg!(not(feature = "ros2")) {
            skip("ROS2_FEATURE", "this build has no feature `ros2`, which a row of the README's table needs");
            used[8] = true;
            continue;
        }
        let mut runs = command.clone();
        for ((part, other), used) in STAND_INS.iter().zip(&mut used) {
            *used |= runs.contains(part);
            runs = runs.replace(part, other);
        }
        let domain = std::process::id() % 101 + 1;
        done(&format!("export ROS_DOMAIN_ID={domain}; rm -f percepts*; {runs}"));
    }
    // What nothing uses any more is taken out.
    assert_eq!(used, [true; STAND_INS.len()]);
}

#[test]
fn commands_are_found_in_their_cells() {
    let text = "# a\n## What do you have?\n\n| you have | one command | more |\n|---|---|---|\n\
        | `x.csv` | `somatic info x.csv`, `somatic run` with `--wide` | [`somatic no`](x.md) |\n\
        | a | `driver \\| somatic run --source - \\| controller` | b |\n| c | by hand | d |\n\n## Why\n| a | `somatic no` | b |\n";
    assert_eq!(
        rows(text),
        [vec!["somatic info x.csv", "somatic run"], vec!["driver | somatic run --source - | controller"]]
    );
}
