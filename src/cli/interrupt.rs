//! Ctrl-C.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use console::Term;
use somatic::{Error, Result};

#[cfg(unix)]
use super::keys;

/// A flag that the first Ctrl-C or termination signal sets; the second ends the process at once.
pub(super) fn stop_on_signal() -> Result<Arc<AtomicBool>> {
    let stop = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&stop);
    ctrlc::set_handler(move || {
        if flag.swap(true, Ordering::Relaxed) {
            for term in [Term::stdout(), Term::stderr()].into_iter().filter(Term::is_term) {
                let _ = term.show_cursor();
            }
            #[cfg(unix)]
            keys::restore();
            std::process::exit(130);
        }
    })
    .map_err(|e| Error::failed(format!("cannot listen for Ctrl-C: {e}")))?;
    Ok(stop)
}
