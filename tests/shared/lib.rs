//! What tests of all crates share: damage to bytes, and how they say what they leave out for want of something. `tests/run` says that at
//! its end, as nobody sees what a passing test prints.

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

/// Damages `bytes` in one to four places, by numbers from `chance`.
pub fn damage(bytes: &mut Vec<u8>, chance: &mut impl FnMut() -> u64) {
    for _ in 0..=chance() % 4 {
        if bytes.is_empty() {
            return;
        }
        let at = (chance() % bytes.len() as u64) as usize;
        let length = (chance() % 200).min((bytes.len() - at) as u64) as usize;
        match chance() % 7 {
            0 | 1 => bytes[at] ^= 1 << (chance() % 8),
            2 => bytes[at..at + length].fill(0),
            3 => bytes[at..at + length].fill_with(|| chance() as u8),
            4 => drop(bytes.drain(at..at + length)),
            5 => bytes.truncate(at),
            _ => {
                let copy = bytes[at..at + length].to_vec();
                bytes.splice(at..at, copy);
            }
        }
    }
}

/// Random numbers of 53 bits.
pub fn numbers(seed: u64) -> impl FnMut() -> u64 {
    let mut state = seed | 1;
    move || {
        // xorshift64*
        state ^= state >> 12;
        state ^= state << 25;
        state ^= state >> 27;
        state.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 11
    }
}
