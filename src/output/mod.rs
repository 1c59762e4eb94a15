//! Outputs: the one place that decides where may be written, and the only one that writes files.
//!
//! An output that is an input of the same command is refused, whatever is forced: it is the same file by its number on its
//! device, through links and other spellings. Two outputs that are one file are refused as well. A regular file is
//! replaced only with force. Pipes, terminals and devices are written as they are.
//!
//! A command asks for all of its outputs by one [`OutputPaths`] before it begins any work; nothing is made by that. Whatever
//! writes a file takes an [`OutputPath`]:
//!
//! ```
//! use somatic::output::OutputPath;
//! use somatic::sink::{FieldNames, NdjsonSink};
//!
//! # fn main() -> somatic::Result<()> {
//! # let folder = tempfile::tempdir().unwrap();
//! # std::env::set_current_dir(&folder).unwrap();
//! let output = OutputPath::new("percepts.ndjson", false, &["touch.csv".as_ref()])?;
//! let sink = NdjsonSink::to_file(output, &[FieldNames::default()], false)?;
//! # Ok(())
//! # }
//! ```

mod file;
mod folder;
#[cfg(unix)]
mod link;
mod place;

use std::path::{Path, PathBuf};

pub use file::{GrowingFile, OutputFile};
pub use folder::OutputFolder;
#[cfg(unix)]
pub use link::OutputLink;

use self::place::{Identity, Place, Stream};
use crate::error::{Error, Result};

/// Where one output goes: a file that may be made or replaced, or a pipe, a terminal or a device. Used up by writing.
#[derive(Debug)]
pub struct OutputPath {
    /// As it was written.
    name: PathBuf,
    place: Place,
    /// Whether what is there goes.
    replaces: bool,
}

impl OutputPath {
    /// The output at `path` of what reads the files `inputs`. A regular file that is there is replaced only with `force`.
    ///
    /// # Errors
    /// A usage error where it is one of `inputs`; it is there already, or a folder, or in a folder that is not there.
    pub fn new(path: impl AsRef<Path>, force: bool, inputs: &[&Path]) -> Result<Self> {
        OutputPaths::new(force, inputs).add(path)
    }

    /// The file at `path`, which is an input and is to be edited in place.
    ///
    /// # Errors
    /// It is not there, or no regular file.
    pub fn edit(path: impl AsRef<Path>) -> Result<Self> {
        let name = path.as_ref().to_owned();
        match Place::of(&name).map_err(|e| Error::io(&name, &e))? {
            place @ Place::File(_) => Ok(Self { name, place, replaces: true }),
            _ => Err(Error::failed("only a file can be edited in place").at(name.display())),
        }
    }

    /// As it was written.
    #[must_use]
    pub fn name(&self) -> &Path {
        &self.name
    }

    /// Whether it is a file, or will be: something can lie beside that, and not beside a pipe or a device.
    #[must_use]
    pub fn is_file(&self) -> bool {
        matches!(self.place, Place::Nothing(_) | Place::File(_))
    }

    /// Writes `bytes`: whole, or not at all.
    ///
    /// # Errors
    /// They cannot be written; what was there stays.
    pub fn write(self, bytes: &[u8]) -> Result<()> {
        use std::io::Write as _;
        let mut file = self.begin()?;
        file.write_all(bytes).map_err(|e| Error::io(file.name(), &e))?;
        file.finish()
    }
}

/// The outputs of one command, told apart from its inputs and from each other.
#[derive(Debug, Default)]
pub struct OutputPaths {
    force: bool,
    inputs: Vec<(PathBuf, Identity)>,
    outputs: Vec<(PathBuf, Identity)>,
}

impl OutputPaths {
    /// Of a command that reads the files `inputs`, of which some may not be there. Regular files that are there are
    /// replaced only with `force`.
    pub fn new(force: bool, inputs: impl IntoIterator<Item = impl AsRef<Path>>) -> Self {
        let known = |path: &Path| Some((path.to_owned(), Identity::of_input(path)?));
        let inputs = inputs.into_iter().filter_map(|path| known(path.as_ref())).collect();
        Self { force, inputs, outputs: Vec::new() }
    }

    /// One more output, at `path`.
    ///
    /// # Errors
    /// A usage error where it is an input or another output; it is there already, or a folder, or in a folder that is not
    /// there.
    pub fn add(&mut self, path: impl AsRef<Path>) -> Result<OutputPath> {
        let name = path.as_ref().to_owned();
        let place = Place::of(&name).map_err(|e| Error::io(&name, &e))?;
        if let Some(identity) = place.identity() {
            self.take(&name, identity, matches!(place, Place::Stream(_)))?;
        }
        match place {
            Place::Folder => Err(Error::io(&name, &std::io::ErrorKind::IsADirectory.into())),
            Place::File(_) if !self.force => Err(there_already(&name)),
            place => Ok(OutputPath { name, place, replaces: self.force }),
        }
    }

    /// Standard output, which may be led into a file.
    ///
    /// # Errors
    /// A usage error where that file is an input or another output.
    pub fn add_standard_output(&mut self) -> Result<()> {
        let identity = Place::Stream(Stream::Output).identity();
        identity.map_or(Ok(()), |identity| self.take(Path::new("standard output"), identity, true))
    }

    /// Notes that an output is the file `identity`, which nothing else of the command is; but for streams of the process's
    /// own, which may be written in several ways.
    fn take(&mut self, name: &Path, identity: Identity, is_stream: bool) -> Result<()> {
        self.refuse_input(name, &identity)?;
        if let Some((other, _)) = self.outputs.iter().find(|(_, known)| *known == identity) {
            let what = format!("the output {} is the same file; give each output one of its own", other.display());
            return Err(Error::usage(what).at(name.display()));
        }
        if !is_stream {
            self.outputs.push((name.to_owned(), identity));
        }
        Ok(())
    }

    fn refuse_input(&self, name: &Path, identity: &Identity) -> Result<()> {
        match self.inputs.iter().find(|(_, known)| known == identity) {
            Some((input, _)) => {
                let what = format!("this is the input {} and would be lost; name another file", input.display());
                Err(Error::usage(what).at(name.display()))
            }
            None => Ok(()),
        }
    }
}

fn there_already(name: &Path) -> Error {
    Error::failed("it is there already; choose another name, or say --force").at(name.display())
}

#[cfg(test)]
mod tests;
