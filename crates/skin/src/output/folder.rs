//! Outputs of several files in a folder.

use std::collections::BTreeMap;
use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use super::destination::{Destination, STANDARD_OUTPUT};
use super::path::{OutputPath, OutputPaths};
use crate::error::{Error, Result};

/// A folder for files with given names.
#[derive(Debug)]
pub struct OutputFolder {
    path: PathBuf,
    files: BTreeMap<String, OutputPath>,
}

impl OutputPaths {
    /// The files called `names` in the folder at `path`, which need not exist.
    ///
    /// # Errors
    /// It is a file, or `-`; or as [`OutputPaths::add`], for each of them.
    pub fn add_folder(
        &mut self,
        path: impl AsRef<Path>,
        names: impl IntoIterator<Item = impl Into<String>>,
    ) -> Result<OutputFolder> {
        let path = path.as_ref().to_owned();
        if path.as_os_str() == STANDARD_OUTPUT {
            return Err(Error::usage("this is a folder, and no output for `-`; name one").at("-"));
        }
        let is_there = match fs::metadata(&path) {
            Ok(there) if there.is_dir() => true,
            Ok(_) => return Err(Error::failed("there is a file of this name; name a folder").at(path.display())),
            Err(e) if e.kind() == ErrorKind::NotFound => false,
            Err(e) => return Err(Error::io(&path, &e)),
        };
        let mut files = BTreeMap::new();
        for name in names.into_iter().map(Into::into) {
            let file = path.join(&name);
            let output = if is_there {
                self.add(file)?
            } else {
                OutputPath { destination: Destination::Nothing(file.clone()), name: file, replaces: self.force }
            };
            files.insert(name, output);
        }
        Ok(OutputFolder { path, files })
    }
}

impl OutputFolder {
    /// Creates the folder if needed.
    ///
    /// # Errors
    /// It cannot be created.
    pub fn make(&self) -> Result<()> {
        fs::create_dir_all(&self.path).map_err(|e| Error::io(&self.path, &e))
    }

    /// The output called `name`.
    ///
    /// # Panics
    /// If it was not among the names, or has been taken before.
    pub fn take(&mut self, name: &str) -> OutputPath {
        self.files.remove(name).unwrap_or_else(|| panic!("{name} was not asked for"))
    }
}
