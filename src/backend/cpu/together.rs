//! Work that the cores take from each other, the caller's thread among them: tasks that it would wait for start late. It
//! still waits until each of the others has had its turn, even to find that nothing is left.

use std::sync::{Mutex, PoisonError};

/// Has `work` done on `threads` threads, this one among them.
pub(super) fn on_threads(threads: usize, work: impl Fn() + Sync) {
    rayon::in_place_scope(|scope| {
        for _ in 1..threads {
            scope.spawn(|_| work());
        }
        work();
    });
}

/// What threads take tasks from, one after the other.
pub(super) struct Tasks<I>(Mutex<I>);

impl<I: Iterator> Tasks<I> {
    pub(super) fn new(tasks: impl IntoIterator<IntoIter = I>) -> Self {
        Self(Mutex::new(tasks.into_iter()))
    }

    /// The next, for one thread.
    pub(super) fn take(&self) -> Option<I::Item> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).next()
    }
}
