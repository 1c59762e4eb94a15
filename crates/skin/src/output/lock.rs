//! Locks on files that are being written, so that no two processes write the same one.
//!
//! They are advisory locks of the system (`fcntl`), which name the process that holds them and end with it. The system gives up a
//! process's lock as soon as that process closes any handle of the file; so files that this process holds are listed here, and
//! never opened to ask about them.

use std::fs::File;
use std::path::Path;
use std::sync::{Mutex, MutexGuard, PoisonError};

use rustix::fs::{FlockOperation, fcntl_lock};
use rustix::process::{Flock, FlockType, Pid, fcntl_getlk};

use super::destination::{FileNumber, file_number};

/// The files that this process holds.
static HELD: Mutex<Vec<FileNumber>> = Mutex::new(Vec::new());

fn held() -> MutexGuard<'static, Vec<FileNumber>> {
    HELD.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Who holds a file: the id of the process, where the system knows it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Holder(pub(super) Option<u32>);

/// A lock that this process holds until it is dropped, or the process ends.
#[derive(Debug)]
pub(super) struct Lock(Option<FileNumber>);

impl Lock {
    /// Locks `file`, which was opened for writing at `path`. Where the system has no locks, nothing is locked.
    ///
    /// # Errors
    /// Another process holds it, or this one.
    pub(super) fn take(file: &File, path: &Path) -> Result<Self, Holder> {
        let Some(number) = file.metadata().ok().and_then(|there| file_number(path, &there)) else {
            return Ok(Self(None));
        };
        let mut held = held();
        if held.contains(&number) {
            return Err(Holder(Some(std::process::id())));
        }
        match fcntl_lock(file, FlockOperation::NonBlockingLockExclusive) {
            Err(rustix::io::Errno::AGAIN | rustix::io::Errno::ACCESS) => Err(Holder(process_that_holds(file))),
            // Such as a network file system without locks.
            Err(_) => Ok(Self(None)),
            Ok(()) => {
                held.push(number);
                Ok(Self(Some(number)))
            }
        }
    }
}

impl Drop for Lock {
    fn drop(&mut self) {
        if let Some(number) = self.0 {
            held().retain(|known| *known != number);
        }
    }
}

/// Who holds the file at `path`, if anybody.
pub(super) fn holder(path: &Path) -> Option<Holder> {
    let there = std::fs::metadata(path).ok().filter(std::fs::Metadata::is_file)?;
    // Kept until the file is closed: another thread of this process may lock it meanwhile.
    let held = held();
    if held.contains(&file_number(path, &there)?) {
        return Some(Holder(Some(std::process::id())));
    }
    let file = File::open(path).ok()?;
    let found = fcntl_getlk(&file, &Flock::from(FlockType::WriteLock)).ok().flatten();
    drop(file);
    drop(held);
    found.map(|lock| Holder(number_of(lock.pid)))
}

fn process_that_holds(file: &File) -> Option<u32> {
    number_of(fcntl_getlk(file, &Flock::from(FlockType::WriteLock)).ok()??.pid)
}

fn number_of(process: Option<Pid>) -> Option<u32> {
    u32::try_from(process?.as_raw_nonzero().get()).ok()
}
