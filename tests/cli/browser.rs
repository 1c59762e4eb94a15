//! The page in a real Chromium: `tests/page/browser.test.js` before this program. Needs node with npm and a Chromium;
//! without them, or a network to install its packages from, this is a skip.

use std::path::{Path, PathBuf};
use std::process::Command;

#[cfg(any(feature = "serial", feature = "zenoh"))]
use somatic::internal::source::BoardState;
use somatic_testing::skip;

/// Browsers by the names that systems give them.
const BROWSERS: [&str; 4] = ["chromium", "chromium-browser", "google-chrome", "google-chrome-stable"];

/// The folder with the tests and their packages, or why there is none.
fn installed() -> Result<PathBuf, String> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    // Beside the page's own modules, which the tests import.
    let folder = root.join("tests/page");
    if !folder.join("node_modules/playwright-core").is_dir() {
        let mut npm = Command::new("npm");
        npm.args(["ci", "--no-audit", "--no-fund", "--ignore-scripts"]).current_dir(&folder);
        let output = npm.output().map_err(|e| format!("npm cannot be run: {e}"))?;
        if !output.status.success() {
            return Err(format!("npm cannot install them: {}", String::from_utf8_lossy(&output.stderr).trim()));
        }
    }
    Ok(folder)
}

fn browser() -> Result<PathBuf, String> {
    let paths = std::env::var_os("PATH").unwrap_or_default();
    let named = |folder: PathBuf| BROWSERS.map(|name| folder.join(name));
    let found = std::env::split_paths(&paths).flat_map(named).find(|path| path.is_file());
    found.ok_or_else(|| format!("there is none of {}", BROWSERS.join(", ")))
}

#[test]
fn the_page_does_in_a_browser_what_it_promises() {
    let found = browser().and_then(|browser| Ok((browser, installed()?)));
    let (browser, folder) = match found {
        Ok(found) => found,
        Err(why) => return skip("BROWSER", format!("no browser tests: {why}")),
    };
    let mut node = Command::new("node");
    node.args([
        "--test",
        "--test-concurrency=1",
        "wire.test.js",
        "messages.test.js",
        "parts.test.js",
        "pick.test.js",
        "senses.test.js",
        "steps.test.js",
        "colours.test.js",
        "browser.test.js",
        "look.test.js",
        "touches.test.js",
        "self_contacts.test.js",
        "hidden.test.js",
        "pair.test.js",
        "situations.test.js",
        "tools.test.js",
        "speed.test.js",
    ])
    .current_dir(folder);
    node.env("SOMATIC", env!("CARGO_BIN_EXE_somatic")).env("CHROMIUM", browser);
    let output = node.output().unwrap();
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{said}{}", String::from_utf8_lossy(&output.stderr));
    eprintln!("{said}");
}

#[cfg(any(feature = "serial", feature = "zenoh"))]
#[test]
fn the_page_has_the_words_of_boards_that_the_program_has() {
    let page =
        std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("crates/page/src/web/wire.js")).unwrap();
    let words: Vec<String> = BoardState::ALL.iter().map(|state| format!("\"{}\"", state.word())).collect();
    let table = format!("BOARD_STATES = [{}];", words.join(", "));
    assert!(page.contains(&table), "wire.js has not {table}");
}
