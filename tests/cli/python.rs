//! Other readers of our files: Python with their libraries, in an environment of its own.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Mutex;

use crate::stderr;

/// Python in which `works` succeeds, with what `tests/<folder>/requirements.txt` lists, or why there is none.
pub(crate) fn python_with(folder: &str, works: &str) -> Result<PathBuf, String> {
    static KNOWN: Mutex<BTreeMap<String, Result<PathBuf, String>>> = Mutex::new(BTreeMap::new());
    let mut known = KNOWN.lock().unwrap();
    known.entry(folder.to_owned()).or_insert_with(|| install(folder, works)).clone()
}

fn install(folder: &str, works: &str) -> Result<PathBuf, String> {
    let place = Path::new(env!("CARGO_TARGET_TMPDIR")).join(folder);
    let python = place.join("bin/python");
    let does_work = || Command::new(&python).args(["-c", works]).output().is_ok_and(|output| output.status.success());
    if does_work() {
        return Ok(python);
    }
    let run = |command: &mut Command| match command.output() {
        Err(e) => Err(format!("python cannot be run: {e}")),
        Ok(output) if !output.status.success() => Err(stderr(&output)),
        Ok(_) => Ok(()),
    };
    run(Command::new("python3").args(["-m", "venv"]).arg(&place))?;
    let requirements = format!("{}/tests/{folder}/requirements.txt", env!("CARGO_MANIFEST_DIR"));
    run(Command::new(&python).args(["-m", "pip", "install", "--quiet", "--requirement", &requirements]))?;
    if does_work() { Ok(python) } else { Err(format!("`{works}` fails")) }
}
