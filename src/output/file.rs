//! Files being written: atomically, or growing under their own names.

use std::fs::{self, File};
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};

use tempfile::{Builder, NamedTempFile};

use super::destination::{Destination, folder_of};
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
    Temporary { part: NamedTempFile, target: PathBuf, replaces: bool },
    /// Written directly.
    Device(File),
}

impl OutputPath {
    /// Starts to write it.
    ///
    /// # Errors
    /// Its folder cannot be written to, or the device cannot be opened.
    pub fn begin(self) -> Result<OutputFile> {
        let Self { name, destination, replaces } = self;
        let failed = |e: io::Error| Error::io(&name, &e);
        let to = match destination {
            Destination::Nothing(target) | Destination::File(target) => {
                let part = temporary_file(&target).map_err(failed)?;
                Target::Temporary { part, target, replaces }
            }
            Destination::Device(at) => Target::Device(File::options().write(true).open(at).map_err(failed)?),
            Destination::Stream(stream) => Target::Device(stream.duplicate().map_err(failed)?),
            Destination::Folder => return Err(failed(ErrorKind::IsADirectory.into())),
        };
        Ok(OutputFile { name, to })
    }

    /// Opens the file itself, for output that must survive a crash. An existing file is truncated.
    ///
    /// # Errors
    /// It cannot be made or opened, or it exists and must not be replaced.
    pub fn grow(self) -> Result<(File, GrowingFile)> {
        let Self { name, destination, replaces } = self;
        let failed = |e: io::Error| match e.kind() {
            ErrorKind::AlreadyExists => already_exists(&name),
            _ => Error::io(&name, &e),
        };
        let (file, made) = match destination {
            Destination::Nothing(target) | Destination::File(target) => {
                match File::options().write(true).create_new(true).open(&target) {
                    Err(e) if e.kind() == ErrorKind::AlreadyExists && replaces => {
                        (File::options().write(true).truncate(true).open(target).map_err(failed)?, None)
                    }
                    made => (made.map_err(failed)?, Some(target)),
                }
            }
            Destination::Device(at) => (File::options().write(true).open(at).map_err(failed)?, None),
            Destination::Stream(stream) => (stream.duplicate().map_err(failed)?, None),
            Destination::Folder => return Err(failed(ErrorKind::IsADirectory.into())),
        };
        Ok((file, GrowingFile { made }))
    }
}

/// A temporary file in the folder of `target`, named after it in case the process is killed.
fn temporary_file(target: &Path) -> io::Result<NamedTempFile> {
    let mut start = target.file_name().unwrap_or_default().to_owned();
    start.push(".");
    let mut builder = Builder::new();
    builder.prefix(&start).suffix(".part");
    // Temporary files are private by default; this one gets the usual permissions.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    builder.tempfile_in(folder_of(target))
}

impl OutputFile {
    /// The path as given.
    #[must_use]
    pub fn name(&self) -> &Path {
        &self.name
    }

    /// Moves the file into place.
    ///
    /// # Errors
    /// It cannot be moved, or another file has been created there and must not be replaced.
    pub fn finish(self) -> Result<()> {
        let Self { name, to } = self;
        let Target::Temporary { part, target, replaces } = to else { return Ok(()) };
        put(part, &target, replaces).map_err(|e| match e.kind() {
            ErrorKind::AlreadyExists => already_exists(&name),
            _ => Error::io(&name, &e),
        })
    }

    /// Moves this file and `others` into place: all, or none.
    ///
    /// # Errors
    /// As [`OutputFile::finish`].
    pub fn finish_with(self, others: Vec<Self>) -> Result<()> {
        let mut made = Vec::new();
        for file in std::iter::once(self).chain(others) {
            let target = match &file.to {
                Target::Temporary { target, .. } => Some(target.clone()),
                Target::Device(_) => None,
            };
            file.finish().inspect_err(|_| {
                made.iter().for_each(|target| {
                    let _ = fs::remove_file(target);
                });
            })?;
            made.extend(target);
        }
        Ok(())
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
            Target::Temporary { part, .. } => part.write(bytes),
            Target::Device(file) => file.write(bytes),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        match &mut self.to {
            Target::Temporary { part, .. } => part.flush(),
            Target::Device(file) => file.flush(),
        }
    }
}

/// A file that grows under its own name.
#[derive(Debug)]
pub struct GrowingFile {
    /// Its path, if it was created.
    made: Option<PathBuf>,
}

impl GrowingFile {
    /// Removes it, unless it existed before or is a device.
    pub fn remove(&self) {
        let _ = self.made.as_ref().map(fs::remove_file);
    }
}
