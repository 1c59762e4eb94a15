//! Files that are not finished: they are removed however the process ends, except when it is killed.

use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

static PARTS: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// All unfinished files of this process. While it is held, none is finished.
pub(super) fn parts() -> MutexGuard<'static, Vec<PathBuf>> {
    PARTS.lock().unwrap_or_else(PoisonError::into_inner)
}

/// An unfinished file, listed until this is dropped.
#[derive(Debug)]
pub(super) struct Listed(PathBuf);

impl Listed {
    pub(super) fn new(path: &Path) -> Self {
        parts().push(path.to_owned());
        Self(path.to_owned())
    }
}

impl Drop for Listed {
    fn drop(&mut self) {
        parts().retain(|path| *path != self.0);
    }
}

/// Removes all files that this process has begun and not finished, for a process that ends at once. From here on no output can be
/// begun or finished: whoever tries waits for the end.
pub fn abandon_outputs() {
    let parts = parts();
    for path in &*parts {
        let _ = std::fs::remove_file(path);
    }
    std::mem::forget(parts);
}
