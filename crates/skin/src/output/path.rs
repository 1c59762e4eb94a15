//! Paths that are checked before anything is written there.

use std::path::{Path, PathBuf};

use super::destination::{Destination, Identity, STANDARD_OUTPUT, Stream};
use crate::error::{Error, Result};

/// A checked output path: a file that may be created or replaced, or a pipe, a terminal or a device. Consumed by writing.
#[derive(Debug)]
pub struct OutputPath {
    /// As it was written.
    pub(super) name: PathBuf,
    pub(super) destination: Destination,
    /// Whether an existing file is replaced.
    pub(super) replaces: bool,
}

impl OutputPath {
    /// The output at `path` of a program that reads the files `inputs`. A regular file is replaced only with `force`.
    ///
    /// # Errors
    /// A usage error if it is one of `inputs`; it exists, is a folder, or is in a folder that does not exist.
    pub fn new(path: impl AsRef<Path>, force: bool, inputs: &[&Path]) -> Result<Self> {
        OutputPaths::new(force, inputs).add(path)
    }

    /// The file at `path`, an input to be edited in place.
    ///
    /// # Errors
    /// It does not exist, or is not a regular file.
    pub fn edit(path: impl AsRef<Path>) -> Result<Self> {
        let name = path.as_ref().to_owned();
        match Destination::from_path(&name).map_err(|e| Error::io(&name, &e))? {
            destination @ Destination::File(_) => Ok(Self { name, destination, replaces: true }),
            _ => Err(Error::failed("only a file can be edited in place").at(name.display())),
        }
    }

    /// As it was written, or `standard output`.
    #[must_use]
    pub fn name(&self) -> &Path {
        &self.name
    }

    /// Whether it is or will be a file, rather than a pipe or a device.
    #[must_use]
    pub fn is_file(&self) -> bool {
        matches!(self.destination, Destination::Nothing(_) | Destination::File(_))
    }

    /// Writes `bytes` atomically.
    ///
    /// # Errors
    /// They cannot be written; an existing file stays.
    pub fn write(self, bytes: &[u8]) -> Result<()> {
        use std::io::Write as _;
        let mut file = self.begin()?;
        file.write_all(bytes).map_err(|e| Error::io(file.name(), &e))?;
        file.finish()
    }
}

/// The outputs of one command, checked against its inputs and each other.
#[derive(Debug, Default)]
pub struct OutputPaths {
    pub(super) force: bool,
    inputs: Vec<(PathBuf, Identity)>,
    outputs: Vec<(PathBuf, Identity)>,
    has_standard_output: bool,
}

impl OutputPaths {
    /// For a command that reads the files `inputs`, which need not exist. Regular files are replaced only with `force`.
    pub fn new(force: bool, inputs: impl IntoIterator<Item = impl AsRef<Path>>) -> Self {
        let known = |path: &Path| Some((path.to_owned(), Identity::of_input(path)?));
        let inputs = inputs.into_iter().filter_map(|path| known(path.as_ref())).collect();
        Self { force, inputs, outputs: Vec::new(), has_standard_output: false }
    }

    /// Adds an output at `path`, or `-` for standard output.
    ///
    /// # Errors
    /// A usage error if it is an input or another output; it exists, is closed, is a folder, or is in a folder that does not exist.
    pub fn add(&mut self, path: impl AsRef<Path>) -> Result<OutputPath> {
        let name = path.as_ref().to_owned();
        let destination = Destination::from_path(&name).map_err(|e| Error::io(&name, &e))?;
        if let Destination::Stream(stream) = &destination {
            stream.check()?;
        }
        if name.as_os_str() == STANDARD_OUTPUT {
            self.take_standard_output(&name)?;
        }
        if let Some(identity) = destination.identity() {
            self.take(&name, identity, matches!(destination, Destination::Stream(_)))?;
        }
        match destination {
            Destination::Folder => Err(Error::io(&name, &std::io::ErrorKind::IsADirectory.into())),
            Destination::File(_) if !self.force => Err(already_exists(&name)),
            destination => {
                let name = if name.as_os_str() == STANDARD_OUTPUT { "standard output".into() } else { name };
                Ok(OutputPath { name, destination, replaces: self.force })
            }
        }
    }

    /// Adds standard output, which may be redirected to a file.
    ///
    /// # Errors
    /// A usage error if that file is an input or another output.
    pub fn add_standard_output(&mut self) -> Result<()> {
        Stream::Output.check()?;
        self.take_standard_output(Path::new("standard output"))?;
        let identity = Destination::Stream(Stream::Output).identity();
        identity.map_or(Ok(()), |identity| self.take(Path::new("standard output"), identity, true))
    }

    /// Registers standard output, which has room for one output.
    fn take_standard_output(&mut self, name: &Path) -> Result<()> {
        if std::mem::replace(&mut self.has_standard_output, true) {
            let what = "another output goes to standard output already; name a file for one of them";
            return Err(Error::usage(what).at(name.display()));
        }
        Ok(())
    }

    /// Registers the file `identity` as an output, once unless it is a stream of this process.
    fn take(&mut self, name: &Path, identity: Identity, is_stream: bool) -> Result<()> {
        self.refuse_input(name, &identity)?;
        if let Some((other, _)) = self.outputs.iter().find(|(_, known)| *known == identity) {
            let what = format!("the output {} is the same file; give each output its own file", other.display());
            return Err(Error::usage(what).at(name.display()));
        }
        if !is_stream {
            self.outputs.push((name.to_owned(), identity));
        }
        Ok(())
    }

    pub(super) fn refuse_input(&self, name: &Path, identity: &Identity) -> Result<()> {
        match self.inputs.iter().find(|(_, known)| known == identity) {
            Some((input, _)) => {
                let what = format!("this is the input {} and would be lost; name another file", input.display());
                Err(Error::usage(what).at(name.display()))
            }
            None => Ok(()),
        }
    }
}

pub(super) fn already_exists(name: &Path) -> Error {
    Error::failed("it exists; choose another name, or give --force").at(name.display())
}
