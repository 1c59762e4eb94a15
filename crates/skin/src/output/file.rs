//! Files being written: atomically, or growing under their own names.

use std::fs::{self, File};
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};

use tempfile::{Builder, NamedTempFile};

use super::destination::{Destination, folder_of};
#[cfg(unix)]
use super::lock::{Holder, Lock, holder};
use super::parts::{Listed, parts};
use super::path::{OutputPath, already_exists};
use crate::error::{Error, Result};

/// An output being written. A file appears when it is finished; dropped before, it leaves nothing, and an existing file
/// stays.
pub struct OutputFile {
    name: PathBuf,
    to: Target,
}

enum Target {
    /// A temporary file that will be moved to `target`.
    Temporary { part: Part, target: PathBuf, replaces: bool },
    /// Written directly.
    Device(File),
}

/// A temporary file in the folder of the file that it will be.
struct Part {
    file: NamedTempFile,
    listed: Listed,
    #[cfg(unix)]
    _lock: Option<Lock>,
}

impl OutputPath {
    /// Starts to write it.
    ///
    /// # Errors
    /// Its folder cannot be written to, the device cannot be opened, or another process is writing the same file.
    pub fn begin(self) -> Result<OutputFile> {
        let Self { name, destination, replaces } = self;
        let failed = |e: io::Error| Error::io(&name, &e);
        let to = match destination {
            Destination::Nothing(target) | Destination::File(target) => {
                let part = Part::new(&target).map_err(failed)?;
                #[cfg(unix)]
                check_free(&target).map_err(|holder| held_by(&name, holder))?;
                Target::Temporary { part, target, replaces }
            }
            Destination::Device(at) => Target::Device(File::options().write(true).open(at).map_err(failed)?),
            Destination::Stream(stream) => Target::Device(stream.duplicate().map_err(failed)?),
            Destination::Folder => return Err(failed(ErrorKind::IsADirectory.into())),
        };
        Ok(OutputFile { name, to })
    }

    /// Opens the file itself, for output that must survive a crash: what is written is there at once, and
    /// [`OutputFile::finish`] adds nothing. An existing file is truncated.
    ///
    /// # Errors
    /// It cannot be made or opened, it exists and must not be replaced, or another process is writing it.
    pub fn grow(self) -> Result<(OutputFile, GrowingFile)> {
        let Self { name, destination, replaces } = self;
        let failed = |e: io::Error| match e.kind() {
            ErrorKind::AlreadyExists => already_exists(&name),
            _ => Error::io(&name, &e),
        };
        let (file, growing) = match destination {
            Destination::Nothing(target) | Destination::File(target) => {
                #[cfg(unix)]
                check_free(&target).map_err(|holder| held_by(&name, holder))?;
                let (file, is_new) = match File::options().write(true).create_new(true).open(&target) {
                    Err(e) if e.kind() == ErrorKind::AlreadyExists && replaces => {
                        (File::options().write(true).open(&target).map_err(failed)?, false)
                    }
                    made => (made.map_err(failed)?, true),
                };
                #[cfg(unix)]
                let lock = Lock::take(&file, &target).map_err(|holder| held_by(&name, holder))?;
                // Not before it is locked: it may be what another process is writing.
                file.set_len(0).map_err(failed)?;
                let growing = GrowingFile {
                    made: is_new.then_some(target),
                    #[cfg(unix)]
                    _lock: Some(lock),
                };
                (file, growing)
            }
            Destination::Device(at) => (File::options().write(true).open(at).map_err(failed)?, GrowingFile::default()),
            Destination::Stream(stream) => (stream.duplicate().map_err(failed)?, GrowingFile::default()),
            Destination::Folder => return Err(failed(ErrorKind::IsADirectory.into())),
        };
        Ok((OutputFile { name, to: Target::Device(file) }, growing))
    }
}

/// Checks that no other process writes `target`, or a part of it; nor this one, under its own name.
#[cfg(unix)]
fn check_free(target: &Path) -> Result<(), Holder> {
    if let Some(holder) = holder(target) {
        return Err(holder);
    }
    let start = part_name(target);
    let is_part = |name: &std::ffi::OsStr| {
        let (name, start) = (name.as_encoded_bytes(), start.as_encoded_bytes());
        name.starts_with(start) && name.ends_with(PART.as_bytes())
    };
    let entries = fs::read_dir(folder_of(target)).into_iter().flatten().flatten();
    let mut holders = entries.filter(|entry| is_part(&entry.file_name())).filter_map(|entry| holder(&entry.path()));
    holders.find(|Holder(process)| *process != Some(std::process::id())).map_or(Ok(()), Err)
}

#[cfg(unix)]
fn held_by(name: &Path, Holder(process): Holder) -> Error {
    let who = process.map_or_else(|| "another process".to_owned(), |process| format!("process {process}"));
    Error::failed(format!("{who} is writing it; wait for its end, or name another file")).at(name.display())
}

/// How the names of temporary files end.
const PART: &str = ".part";

/// How the name of a temporary file for `target` begins.
fn part_name(target: &Path) -> std::ffi::OsString {
    let mut start = target.file_name().unwrap_or_default().to_owned();
    start.push(".");
    start
}

impl Part {
    /// In the folder of `target`, named after it in case the process is killed.
    fn new(target: &Path) -> io::Result<Self> {
        let start = part_name(target);
        let mut builder = Builder::new();
        builder.prefix(&start).suffix(PART);
        // Temporary files are private by default; this one gets the usual permissions.
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
        let file = builder.tempfile_in(folder_of(target))?;
        let listed = Listed::new(file.path());
        // Nobody else knows this file yet.
        #[cfg(unix)]
        let lock = Lock::take(file.as_file(), file.path()).ok();
        Ok(Self {
            file,
            listed,
            #[cfg(unix)]
            _lock: lock,
        })
    }
}

impl OutputFile {
    /// The path as given.
    #[must_use]
    pub fn name(&self) -> &Path {
        &self.name
    }

    /// Whether it is a file that appears when it is finished, rather than a stream or a device.
    #[must_use]
    pub fn appears_when_finished(&self) -> bool {
        matches!(self.to, Target::Temporary { .. })
    }

    /// Moves the file into place.
    ///
    /// # Errors
    /// It cannot be moved, or another file has been created there and must not be replaced.
    pub fn finish(self) -> Result<()> {
        self.finish_with(Vec::new())
    }

    /// Moves this file and `others` into place: all, or none.
    ///
    /// # Errors
    /// As [`OutputFile::finish`].
    pub fn finish_with(self, others: Vec<Self>) -> Result<()> {
        let mut files = std::iter::once(self).chain(others);
        let (mut made, mut done) = (Vec::new(), Vec::new());
        // An interruption waits until all are there.
        let held = parts();
        let moved = files.by_ref().try_for_each(|Self { name, to }| {
            let Target::Temporary { part: Part { file, listed, .. }, target, replaces } = to else { return Ok(()) };
            done.push(listed);
            put(file, &target, replaces).map_err(|e| match e.kind() {
                ErrorKind::AlreadyExists => already_exists(&name),
                _ => Error::io(&name, &e),
            })?;
            made.push(target);
            Ok(())
        });
        if moved.is_err() {
            made.iter().for_each(|target| {
                let _ = fs::remove_file(target);
            });
        }
        // What has been listed, and what is left of the files, goes after this.
        drop(held);
        moved
    }

    /// Ends it early, as the beginning of a stream, which is of use as it stands: moves it into place unless that would
    /// replace a file that is there. Gives whether it is there.
    ///
    /// # Errors
    /// As [`OutputFile::finish`].
    pub fn finish_early(self) -> Result<bool> {
        match &self.to {
            Target::Temporary { target, .. } if fs::symlink_metadata(target).is_ok() => Ok(false),
            _ => self.finish().map(|()| true),
        }
    }
}

fn put(part: NamedTempFile, target: &Path, replaces: bool) -> io::Result<()> {
    if replaces {
        // Keep the permissions.
        if let Ok(there) = fs::metadata(target) {
            part.as_file().set_permissions(there.permissions())?;
        }
        return Ok(part.persist(target).map(drop)?);
    }
    match part.persist_noclobber(target) {
        // Some file systems do not support this.
        Err(e) if e.error.kind() != ErrorKind::AlreadyExists && fs::symlink_metadata(target).is_err() => {
            Ok(e.file.persist(target).map(drop)?)
        }
        put => Ok(put.map(drop)?),
    }
}

impl Write for OutputFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match &mut self.to {
            Target::Temporary { part, .. } => part.file.write(bytes),
            Target::Device(file) => file.write(bytes),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        match &mut self.to {
            Target::Temporary { part, .. } => part.file.flush(),
            Target::Device(file) => file.flush(),
        }
    }
}

/// A file that grows under its own name. Other processes cannot write it as long as this is there.
#[derive(Debug, Default)]
pub struct GrowingFile {
    /// Its path, if it was created.
    made: Option<PathBuf>,
    #[cfg(unix)]
    _lock: Option<Lock>,
}

impl GrowingFile {
    /// Removes it, unless it existed before or is a device.
    pub fn remove(&self) {
        let _ = self.made.as_ref().map(fs::remove_file);
    }
}
