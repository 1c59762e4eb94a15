//! Outputs that are several files in a folder.

use std::collections::BTreeMap;
use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use super::place::Place;
use super::{OutputPath, OutputPaths};
use crate::error::{Error, Result};

/// A folder that files with certain names may be written into.
#[derive(Debug)]
pub struct OutputFolder {
    path: PathBuf,
    files: BTreeMap<String, OutputPath>,
}

impl OutputPaths {
    /// The files called `names` in the folder at `path`, which need not be there.
    ///
    /// # Errors
    /// There is a file in its place; or as [`OutputPaths::add`], for each of them.
    pub fn add_folder(
        &mut self,
        path: impl AsRef<Path>,
        names: impl IntoIterator<Item = impl Into<String>>,
    ) -> Result<OutputFolder> {
        let path = path.as_ref().to_owned();
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
                OutputPath { place: Place::Nothing(file.clone()), name: file, replaces: self.force }
            };
            files.insert(name, output);
        }
        Ok(OutputFolder { path, files })
    }
}

impl OutputFolder {
    /// Makes the folder where there is none.
    ///
    /// # Errors
    /// It cannot be made.
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
