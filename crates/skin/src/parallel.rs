//! Work shared among the cores; the one door to rayon's threads.
//!
//! The caller's thread takes part: tasks that it would only wait for start late.

use std::sync::{Mutex, PoisonError};

/// Threads that a call may use, the caller's included.
pub fn threads() -> usize {
    rayon::current_num_threads()
}

/// Calls `work` on `threads` threads at once, this one among them, and returns when all have.
pub fn on_threads(threads: usize, work: impl Fn() + Sync) {
    if threads < 2 {
        return work();
    }
    rayon::in_place_scope(|scope| {
        for _ in 1..threads {
            scope.spawn(|_| work());
        }
        work();
    });
}

/// Calls `work` on one thread that shares nothing with others: for what nobody waits for, so
/// that what somebody waits for never waits for it.
pub fn aside<R: Send>(work: impl FnOnce() -> R + Send) -> R {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build();
    match pool {
        Ok(pool) => pool.install(work),
        // The system has no thread to give.
        Err(_) => work(),
    }
}

/// Tasks that threads take one after the other.
pub struct Tasks<I>(Mutex<I>);

impl<I: Iterator> Tasks<I> {
    pub fn new(tasks: impl IntoIterator<IntoIter = I>) -> Self {
        Self(Mutex::new(tasks.into_iter()))
    }

    /// The next task, for one thread.
    pub fn take(&self) -> Option<I::Item> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).next()
    }
}

/// Calls `work` with each of `tasks`, on as many as `threads` threads.
pub fn for_each<T: Send>(threads: usize, tasks: impl IntoIterator<Item = T, IntoIter: Send>, work: impl Fn(T) + Sync) {
    let tasks = Tasks::new(tasks);
    on_threads(threads, || {
        while let Some(task) = tasks.take() {
            work(task);
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn work_aside_has_one_thread() {
        let named = std::thread::current().id();
        let (count, id) = aside(|| (threads(), std::thread::current().id()));
        assert_eq!(count, 1);
        assert_ne!(id, named);
        assert_eq!(aside(threads), 1, "again");
    }
}
