//! Ctrl-C and other requests to end: `SIGINT`, `SIGTERM` and `SIGHUP`.
//!
//! A command that has nothing to bring to an end is ended at the first signal; files that it has begun are removed. One that has,
//! asks for [`stop_on_signal`] and looks at the flag. The second signal ends either at once.

use std::sync::atomic::{AtomicBool, AtomicU8, Ordering};
use std::sync::{Arc, LazyLock};
use std::time::Duration;

use console::Term;
use somatic::internal::output::abandon_outputs;
use somatic::{Error, Result};

#[cfg(unix)]
use super::keys;
use super::stdio::{FAILED, say};

/// Exit code after the second signal: that of shells for a command that Ctrl-C has ended.
const KILLED: u8 = 130;
/// How long a command may take to end that has nothing to lose.
const SOON: Duration = Duration::from_millis(700);

static STOP: LazyLock<Arc<AtomicBool>> = LazyLock::new(Arc::default);
static HEED: AtomicU8 = AtomicU8::new(NOBODY);

/// Nobody looks at the flag.
const NOBODY: u8 = 0;
/// Somebody does, and ends by itself within [`SOON`] or is ended.
const HASTE: u8 = 1;
/// Somebody does, and brings everything to an end, however long that takes.
const PATIENCE: u8 = 2;

/// Heeds signals from here on.
pub(super) fn heed_signals() -> Result<()> {
    #[cfg(unix)]
    let hangup_is_ignored = hangup::is_ignored();
    ctrlc::set_handler(on_signal).map_err(|e| Error::failed(format!("cannot listen for Ctrl-C: {e}")))?;
    // Who has started this with `nohup` wants it to go on.
    #[cfg(unix)]
    if hangup_is_ignored {
        hangup::ignore();
    }
    Ok(())
}

/// A flag that the first signal sets. From here on the caller looks at it, and brings the command to a clean end.
pub(super) fn stop_on_signal() -> Result<Arc<AtomicBool>> {
    HEED.fetch_max(PATIENCE, Ordering::SeqCst);
    Ok(Arc::clone(&STOP))
}

/// The same for a command that has nothing to lose: where it is at something long, it is ended.
pub(super) fn stop_soon_on_signal() -> Result<Arc<AtomicBool>> {
    HEED.fetch_max(HASTE, Ordering::SeqCst);
    Ok(Arc::clone(&STOP))
}

fn on_signal() {
    if STOP.swap(true, Ordering::SeqCst) {
        end_at_once(KILLED);
    }
    match HEED.load(Ordering::SeqCst) {
        PATIENCE => return,
        HASTE => std::thread::sleep(SOON),
        _ => {}
    }
    say("error: interrupted");
    end_at_once(FAILED);
}

/// Ends the process, whatever its threads are at.
fn end_at_once(code: u8) -> ! {
    abandon_outputs();
    for term in [Term::stdout(), Term::stderr()].into_iter().filter(Term::is_term) {
        let _ = term.show_cursor();
    }
    #[cfg(unix)]
    keys::restore();
    #[cfg(unix)]
    hangup::exit(code);
    #[cfg(not(unix))]
    std::process::exit(code.into())
}

#[cfg(unix)]
mod hangup {
    #![expect(unsafe_code, reason = "the standard library has no signals")]

    /// Whether the process was started so that it outlives its terminal.
    pub(super) fn is_ignored() -> bool {
        // SAFETY: all zeros are a valid `sigaction`, which is written to, and no handler is set.
        unsafe {
            let mut now: libc::sigaction = std::mem::zeroed();
            libc::sigaction(libc::SIGHUP, std::ptr::null(), &raw mut now) == 0 && now.sa_sigaction == libc::SIG_IGN
        }
    }

    pub(super) fn ignore() {
        // SAFETY: no handler of this process is set.
        unsafe { libc::signal(libc::SIGHUP, libc::SIG_IGN) };
    }

    /// Ends the process without what else is done at exit: drivers wait there for threads that are at work.
    pub(super) fn exit(code: u8) -> ! {
        // SAFETY: nothing runs after it.
        unsafe { libc::_exit(code.into()) }
    }
}
