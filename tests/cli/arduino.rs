//! The sketches of `examples/arduino`: they compile as C++, and what they send is read.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use super::{frames, somatic, stderr};
use somatic_testing::skip;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The compilers for C++ and C of this machine, if it has them.
fn compilers() -> Option<[&'static str; 2]> {
    let runs = |name: &str| Command::new(name).arg("--version").output().is_ok_and(|output| output.status.success());
    let found = [["g++", "gcc"], ["c++", "cc"], ["clang++", "clang"]]
        .into_iter()
        .find(|both| both.iter().all(|name| runs(name)));
    if found.is_none() {
        skip("COMPILER", "no C++ compiler: examples/arduino is not checked");
    }
    found
}

fn compile(compiler: &str, arguments: &[&str], file: &Path, folder: &Path) -> PathBuf {
    let object = folder.join(file.file_name().unwrap()).with_extension("o");
    let (stub, wire) = (root().join("tests/arduino"), root().join("examples/firmware"));
    let output = Command::new(compiler)
        .args(["-Wall", "-Wextra", "-Werror"])
        .args(arguments)
        .arg("-I")
        .arg(stub)
        .arg("-I")
        .arg(wire)
        .args(["-c", "-o"])
        .arg(&object)
        .arg(file)
        .output()
        .unwrap();
    assert!(output.status.success(), "{}: {}", file.display(), String::from_utf8_lossy(&output.stderr));
    object
}

/// What the sketch `name` sends in this many of its loops.
fn sent(name: &str, loops: u32) -> Option<Vec<u8>> {
    let [cpp, c] = compilers()?;
    let folder = tempfile::tempdir().unwrap();
    let as_cpp = ["-std=c++11", "-include", "Arduino.h", "-x", "c++"];
    let sketch = root().join(format!("examples/arduino/{name}/{name}.ino"));
    let objects = [
        compile(cpp, &as_cpp, &sketch, folder.path()),
        compile(cpp, &as_cpp, &root().join("tests/arduino/run.cpp"), folder.path()),
        compile(c, &["-std=c99"], &root().join("examples/firmware/somatic_wire.c"), folder.path()),
    ];
    let program = folder.path().join("sketch");
    assert!(Command::new(cpp).args(&objects).arg("-o").arg(&program).status().unwrap().success());
    let output = Command::new(program).arg(loops.to_string()).output().unwrap();
    assert!(output.status.success());
    Some(output.stdout)
}

/// What `somatic run` makes of lines: its messages, and the totals of its frames.
fn read(bytes: &[u8]) -> (String, Vec<f64>) {
    let mut child = somatic(&["run", "--backend", "cpu", "--source", "text:-", "--sink", "-", "--outputs", "total"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    std::io::Write::write_all(&mut child.stdin.take().unwrap(), bytes).unwrap();
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let text = String::from_utf8(output.stdout.clone()).unwrap();
    let total = |frame: &serde_json::Value| frame["fields"][0]["total"].as_f64().unwrap();
    (stderr(&output), frames(&text).iter().map(total).collect())
}

#[test]
fn what_the_sketches_print_is_read() {
    let Some(row) = sent("fsr_row", 300_000) else { return };
    let (said, totals) = read(&row);
    assert!(said.contains("columns 1–4 are a row of 4 sensors"), "{said}");
    // The stub of the board reads each pin's number.
    assert!(totals.len() > 100 && totals.iter().all(|total| *total == 6.0), "{totals:?}");
    let Some(mat) = sent("velostat_mat", 5) else { return };
    let (said, totals) = read(&mat);
    assert!(said.contains("columns 1–16 of 16 lines are a 16 × 16 grid, a blank line is between two frames"), "{said}");
    let all: u32 = (0..16).flat_map(|row| (0..16).map(move |column| 60 * row + column)).sum();
    assert_eq!(totals, [f64::from(all); 5]);
}

#[test]
fn the_sketch_with_packets_speaks_the_protocol() {
    let Some(bytes) = sent("somatic_board", 100_000) else { return };
    let mut decoder = somatic::internal::wire::Decoder::new();
    let (mut frames, mut identities) = (0, 0);
    decoder.push(&bytes, |event| match event {
        somatic::internal::wire::Event::Frame { values, .. } => {
            let values: Vec<u16> = values.iter().map(|(_, value)| value).collect();
            assert_eq!(values, [0, 1, 2, 3]);
            frames += 1;
        }
        somatic::internal::wire::Event::Identity { identity, .. } => {
            assert_eq!((identity.channels, identity.rate_mhz), (4, 100_000));
            identities += 1;
        }
        _ => panic!("nothing else is sent"),
    });
    assert!(frames > 50 && identities == 1, "{frames} {identities}");
}
