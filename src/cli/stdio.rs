//! Standard output, standard error and exit codes.

use std::io::{self, Write as _};

use somatic::{Error, Result};

/// Exit code: everything was done.
pub(super) const DONE: u8 = 0;
/// Exit code: what was asked for does not hold.
pub(super) const FAILED: u8 = 1;
/// Exit code: done, but some input was never processed.
pub(super) const LOST: u8 = 3;

/// Prints `line` on standard error. A closed standard error is no reason to stop.
pub(crate) fn say(line: &str) {
    let _ = writeln!(io::stderr(), "somatic: {line}");
}

/// Says what of the input was never processed, and gives the exit code.
pub(super) fn tell_losses(losses: &[String]) -> u8 {
    losses.iter().for_each(|loss| say(&format!("never processed: {loss}")));
    if losses.is_empty() { DONE } else { LOST }
}

/// Writes `text` to standard output. A reader that has gone is a normal end.
pub(super) fn print(text: &str) -> Result<()> {
    let mut stdout = io::stdout().lock();
    match stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush()) {
        Err(e) if e.kind() != io::ErrorKind::BrokenPipe => {
            Err(Error::failed(format!("cannot write: {e}")).at("standard output"))
        }
        _ => Ok(()),
    }
}
