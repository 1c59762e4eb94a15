//! Work without Python's lock, on threads that this process has.

use std::process;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

/// The process that has imported the module, whose threads the library starts for itself.
static IMPORTED_BY: OnceLock<u32> = OnceLock::new();

/// Notes which process this is.
pub(crate) fn note_process() {
    IMPORTED_BY.get_or_init(process::id);
}

/// Threads of its own for a process that was forked: a fork has none of those that were there.
fn threads_of_fork() -> Option<Arc<ThreadPool>> {
    static POOL: Mutex<Option<(u32, Arc<ThreadPool>)>> = Mutex::new(None);
    let process = process::id();
    if IMPORTED_BY.get().is_none_or(|first| *first == process) {
        return None;
    }
    let mut pool = POOL.lock().unwrap_or_else(PoisonError::into_inner);
    if pool.as_ref().is_none_or(|(of, _)| *of != process) {
        let made = Arc::new(ThreadPoolBuilder::new().build().ok()?);
        // The pool of the parent process stays as it is: to end it would wait for threads that do not exist here.
        std::mem::forget(pool.replace((process, made)));
    }
    pool.as_ref().map(|(_, pool)| Arc::clone(pool))
}

/// Runs `work` without Python's lock.
pub(crate) fn free<T: Send>(py: Python<'_>, work: impl FnOnce() -> T + Send) -> T {
    py.detach(|| match threads_of_fork() {
        Some(pool) => pool.install(work),
        None => work(),
    })
}

/// Whether to go on: what Python raises for a signal is kept.
pub(crate) fn goes_on(raised: &mut Option<PyErr>) -> bool {
    *raised = Python::attach(|py| py.check_signals().err());
    raised.is_none()
}
