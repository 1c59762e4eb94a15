//! Work without Python's lock, on threads that this process has.

use std::panic::resume_unwind;
use std::sync::mpsc::{RecvTimeoutError, sync_channel};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use std::time::Duration;
use std::{process, thread};

use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

/// How long is waited until Ctrl-C is heard.
const WAIT: Duration = Duration::from_millis(40);

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

/// Runs `work`, which may wait for a board or a network, on a thread of its own.
///
/// # Errors
/// What Python raises for a signal meanwhile, such as Ctrl-C; then `work` ends by itself, and what it made is dropped.
pub(crate) fn waiting<T: Send + 'static>(py: Python<'_>, work: impl FnOnce() -> T + Send + 'static) -> PyResult<T> {
    let (sender, mut found) = sync_channel(1);
    let thread = thread::spawn(move || {
        let made = match threads_of_fork() {
            Some(pool) => pool.install(work),
            None => work(),
        };
        drop(sender.send(made));
    });
    loop {
        let found = &mut found;
        match py.detach(move || found.recv_timeout(WAIT)) {
            Ok(made) => return Ok(made),
            Err(RecvTimeoutError::Timeout) => py.check_signals()?,
            Err(RecvTimeoutError::Disconnected) => match thread.join() {
                Err(panic) => resume_unwind(panic),
                Ok(()) => unreachable!("it sends what it made, or panics"),
            },
        }
    }
}

/// Whether to go on: what Python raises for a signal is kept.
pub(crate) fn goes_on(raised: &mut Option<PyErr>) -> bool {
    *raised = Python::attach(|py| py.check_signals().err());
    raised.is_none()
}
