//! Resolves paths of outputs and compares them.

use std::ffi::{OsStr, OsString};
use std::fs::{self, File, Metadata};
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

use crate::error::{Error, Result};

/// Maximum number of links to follow, as in Linux.
const MAX_LINKS: usize = 40;

/// What standard output is called where an output is named; a file of this name is `./-`.
pub const STANDARD_OUTPUT: &str = "-";

/// Whether standard output was closed when the process started: the runtime has put `/dev/null` there since.
static IS_CLOSED: AtomicBool = AtomicBool::new(false);

/// Makes standard output an error for every output of this process: it was closed when the process started, and what is written
/// there would be lost.
pub fn refuse_standard_output() {
    IS_CLOSED.store(true, Ordering::Relaxed);
}

/// The destination of a path, with all links followed.
#[derive(Debug)]
pub(super) enum Destination {
    /// No file yet; it would be created here.
    Nothing(PathBuf),
    /// A regular file.
    File(PathBuf),
    /// A pipe, a terminal or a device.
    Device(PathBuf),
    /// A stream of this process, such as `/dev/stdout`.
    Stream(Stream),
    Folder,
}

/// A stream of this process.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Stream {
    Output,
    Error,
}

/// The folder that the last part of `path` is in.
pub(super) fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

impl Destination {
    /// The destination of `path`; `-` is standard output. Its folder must exist; the file or the target of a link need not.
    pub(super) fn from_path(path: &Path) -> io::Result<Self> {
        if path.as_os_str() == STANDARD_OUTPUT {
            return Ok(Self::Stream(Stream::Output));
        }
        let mut at = path.to_owned();
        for _ in 0..MAX_LINKS {
            let ends_as_folder = at.as_os_str().as_encoded_bytes().last().is_some_and(|&byte| byte == b'/');
            let Some(name) = at.file_name().filter(|_| !ends_as_folder) else { return Ok(Self::Folder) };
            let folder = folder_of(&at).canonicalize()?;
            if let Some(stream) = Stream::called(&folder, name) {
                return Ok(Self::Stream(stream));
            }
            at = folder.join(name);
            let there = match fs::symlink_metadata(&at) {
                Err(e) if e.kind() == ErrorKind::NotFound => return Ok(Self::Nothing(at)),
                there => there?,
            };
            if !there.is_symlink() {
                return Ok(Self::there(at, &there));
            }
            let next = folder.join(fs::read_link(&at)?);
            match fs::metadata(&at) {
                // The link of a shell's pipe, such as /dev/fd/63, has no real target.
                Ok(there) if fs::symlink_metadata(&next).is_err() => return Ok(Self::there(at, &there)),
                _ => at = next,
            }
        }
        Err(io::Error::other("too many symbolic links"))
    }

    fn there(at: PathBuf, metadata: &Metadata) -> Self {
        match metadata {
            there if there.is_dir() => Self::Folder,
            there if there.is_file() => Self::File(at),
            _ => Self::Device(at),
        }
    }

    /// Its file. `None` for destinations that may be shared, such as a terminal.
    pub(super) fn identity(&self) -> Option<Identity> {
        match self {
            Self::Nothing(at) => {
                let folder = folder_of(at);
                Some(Identity::Planned(file_number(folder, &fs::metadata(folder).ok()?)?, at.file_name()?.to_owned()))
            }
            Self::File(at) | Self::Device(at) => Identity::of_input(at),
            Self::Stream(stream) => Identity::of_stream(*stream),
            Self::Folder => None,
        }
    }
}

/// The identity of a file, independent of its path.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Identity {
    Existing(FileNumber),
    /// A file of this name to be created in a folder.
    Planned(FileNumber, OsString),
}

impl Identity {
    /// The identity of the file at `path`. `None` if it is neither a regular file nor a named pipe.
    pub(super) fn of_input(path: &Path) -> Option<Self> {
        let there = fs::metadata(path).ok()?;
        if there.is_file() || is_pipe(&there) { file_number(path, &there).map(Self::Existing) } else { None }
    }

    /// The identity of the regular file that `stream` is redirected to, if any.
    #[cfg(unix)]
    fn of_stream(stream: Stream) -> Option<Self> {
        let there = stream.duplicate().ok()?.metadata().ok()?;
        if there.is_file() { file_number(Path::new(""), &there).map(Self::Existing) } else { None }
    }

    #[cfg(not(unix))]
    fn of_stream(_: Stream) -> Option<Self> {
        None
    }
}

/// Device and inode.
#[cfg(unix)]
pub(super) type FileNumber = (u64, u64);
/// The canonical path, where inodes are not available.
#[cfg(not(unix))]
pub(super) type FileNumber = PathBuf;

#[cfg(unix)]
pub(super) fn file_number(_: &Path, there: &Metadata) -> Option<FileNumber> {
    use std::os::unix::fs::MetadataExt as _;
    Some((there.dev(), there.ino()))
}

#[cfg(not(unix))]
fn file_number(path: &Path, _: &Metadata) -> Option<FileNumber> {
    path.canonicalize().ok()
}

#[cfg(unix)]
fn is_pipe(there: &Metadata) -> bool {
    use std::os::unix::fs::FileTypeExt as _;
    there.file_type().is_fifo()
}

#[cfg(not(unix))]
fn is_pipe(_: &Metadata) -> bool {
    false
}

impl Stream {
    /// The stream with this name in this folder.
    fn called(folder: &Path, name: &OsStr) -> Option<Self> {
        let stream = match name.to_str()? {
            "1" => Self::Output,
            "2" => Self::Error,
            _ => return None,
        };
        let own = [Path::new("/proc/self/fd"), Path::new("/dev/fd")];
        own.iter().any(|own| own.canonicalize().is_ok_and(|own| own == folder)).then_some(stream)
    }

    /// Checks that it can be written to.
    ///
    /// # Errors
    /// It was closed when the process started.
    pub(super) fn check(self) -> Result<()> {
        if self == Self::Output && IS_CLOSED.load(Ordering::Relaxed) {
            return Err(Error::failed("it is closed; lead it somewhere, or name a file").at("standard output"));
        }
        Ok(())
    }

    /// A file that writes to the stream.
    #[cfg(unix)]
    pub(super) fn duplicate(self) -> io::Result<File> {
        use std::os::fd::AsFd as _;
        let owned = match self {
            Self::Output => io::stdout().as_fd().try_clone_to_owned(),
            Self::Error => io::stderr().as_fd().try_clone_to_owned(),
        };
        owned.map(File::from)
    }

    #[cfg(not(unix))]
    pub(super) fn duplicate(self) -> io::Result<File> {
        Err(ErrorKind::Unsupported.into())
    }
}
