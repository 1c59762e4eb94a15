//! What tests leave out for want of something: `tests/run` says it at its end, as nobody sees what a passing test prints.

use std::fmt::Display;
use std::io::Write as _;

/// Says that this test, or a part of it, is left out: it needs `need` (GPU, DATA, ...), which is missing because of `why`.
///
/// The line is appended to the file that `SOMATIC_SKIPS` names.
///
/// # Panics
/// `SOMATIC_REQUIRE_<need>` is set, to anything but 0.
pub fn skip(need: &str, why: impl Display) {
    let required = format!("SOMATIC_REQUIRE_{need}");
    let set = std::env::var_os(&required).is_some_and(|value| !value.is_empty() && value != "0");
    assert!(!set, "{required} is set: {why}");
    eprintln!("SKIPPED: {why}");
    let Some(path) = std::env::var_os("SOMATIC_SKIPS") else { return };
    // libtest names threads after tests.
    let test = std::thread::current().name().unwrap_or("a test").to_owned();
    let why = why.to_string().trim().replace(['\n', '\t'], " ");
    let mut file = std::fs::OpenOptions::new().create(true).append(true).open(path).unwrap();
    file.write_all(format!("{need}\t{why}\t{test}\n").as_bytes()).unwrap();
}
