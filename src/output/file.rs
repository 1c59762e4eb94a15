//! Files being written: whole in the end or not at all, or growing under their own names.

use std::fs::{self, File};
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};

use tempfile::{Builder, NamedTempFile};

use super::place::{Place, folder_of};
use super::{OutputPath, there_already};
use crate::error::{Error, Result};

/// An output being written. A file is there once it is finished, and not before; dropped, it leaves nothing behind, and
/// what was there stays.
pub struct OutputFile {
    name: PathBuf,
    to: To,
}

enum To {
    /// A file that is to become the one at `target`.
    Part { part: NamedTempFile, target: PathBuf, replaces: bool },
    /// Written as it is.
    Device(File),
}

impl OutputPath {
    /// Begins to write it.
    ///
    /// # Errors
    /// Its folder cannot be written to, or the device not be opened.
    pub fn begin(self) -> Result<OutputFile> {
        let Self { name, place, replaces } = self;
        let failed = |e: io::Error| Error::io(&name, &e);
        let to = match place {
            Place::Nothing(target) | Place::File(target) => {
                let part = beside(&target).map_err(failed)?;
                To::Part { part, target, replaces }
            }
            Place::Device(at) => To::Device(File::options().write(true).open(at).map_err(failed)?),
            Place::Stream(stream) => To::Device(stream.duplicate().map_err(failed)?),
            Place::Folder => return Err(failed(ErrorKind::IsADirectory.into())),
        };
        Ok(OutputFile { name, to })
    }

    /// Opens the file itself, for what has to last however the writing ends. What was there is gone then.
    ///
    /// # Errors
    /// It cannot be made or opened, or one came up there that is not to be replaced.
    pub fn grow(self) -> Result<(File, GrowingFile)> {
        let Self { name, place, replaces } = self;
        let failed = |e: io::Error| match e.kind() {
            ErrorKind::AlreadyExists => there_already(&name),
            _ => Error::io(&name, &e),
        };
        let (file, made) = match place {
            Place::Nothing(target) | Place::File(target) => {
                match File::options().write(true).create_new(true).open(&target) {
                    Err(e) if e.kind() == ErrorKind::AlreadyExists && replaces => {
                        (File::options().write(true).truncate(true).open(target).map_err(failed)?, None)
                    }
                    made => (made.map_err(failed)?, Some(target)),
                }
            }
            Place::Device(at) => (File::options().write(true).open(at).map_err(failed)?, None),
            Place::Stream(stream) => (stream.duplicate().map_err(failed)?, None),
            Place::Folder => return Err(failed(ErrorKind::IsADirectory.into())),
        };
        Ok((file, GrowingFile { made }))
    }
}

/// A file that `target` is to become: beside it, and named after it in case something ends the process before.
fn beside(target: &Path) -> io::Result<NamedTempFile> {
    let mut start = target.file_name().unwrap_or_default().to_owned();
    start.push(".");
    let mut builder = Builder::new();
    builder.prefix(&start).suffix(".part");
    // Temporary files are private unless told otherwise; what becomes of this one is as public as any other.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    builder.tempfile_in(folder_of(target))
}

impl OutputFile {
    /// As it was written.
    #[must_use]
    pub fn name(&self) -> &Path {
        &self.name
    }

    /// Puts the file in its place.
    ///
    /// # Errors
    /// It cannot be put there, or another came up there meanwhile that is not to be replaced.
    pub fn finish(self) -> Result<()> {
        let Self { name, to } = self;
        let To::Part { part, target, replaces } = to else { return Ok(()) };
        put(part, &target, replaces).map_err(|e| match e.kind() {
            ErrorKind::AlreadyExists => there_already(&name),
            _ => Error::io(&name, &e),
        })
    }

    /// Puts this file and `other` in their places: both, or neither.
    ///
    /// # Errors
    /// As [`OutputFile::finish`].
    pub fn finish_with(self, other: Self) -> Result<()> {
        let target = match &self.to {
            To::Part { target, .. } => Some(target.clone()),
            To::Device(_) => None,
        };
        self.finish()?;
        other.finish().inspect_err(|_| {
            let _ = target.map(fs::remove_file);
        })
    }
}

fn put(part: NamedTempFile, target: &Path, replaces: bool) -> io::Result<()> {
    if replaces {
        // Whoever might read the file before may read it now.
        if let Ok(there) = fs::metadata(target) {
            part.as_file().set_permissions(there.permissions())?;
        }
        return Ok(part.persist(target).map(drop)?);
    }
    match part.persist_noclobber(target) {
        // Some file systems cannot be asked to do both at once.
        Err(e) if e.error.kind() != ErrorKind::AlreadyExists && fs::symlink_metadata(target).is_err() => {
            Ok(e.file.persist(target).map(drop)?)
        }
        put => Ok(put.map(drop)?),
    }
}

impl Write for OutputFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match &mut self.to {
            To::Part { part, .. } => part.write(bytes),
            To::Device(file) => file.write(bytes),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        match &mut self.to {
            To::Part { part, .. } => part.flush(),
            To::Device(file) => file.flush(),
        }
    }
}

/// A file that grows under its own name.
#[derive(Debug)]
pub struct GrowingFile {
    /// Where it was made, if nothing was there before.
    made: Option<PathBuf>,
}

impl GrowingFile {
    /// Takes it away, unless something was there before: that, be it a device, is not ours to take away.
    pub fn remove(&self) {
        let _ = self.made.as_ref().map(fs::remove_file);
    }
}
