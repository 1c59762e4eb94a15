//! Outputs that are symbolic links, which give a fixed name to a changing path.

use std::fs;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};

use tempfile::Builder;

use super::destination::{Identity, STANDARD_OUTPUT, folder_of};
use super::path::OutputPaths;
use crate::error::{Error, Result};

/// A symbolic link that may be made and changed.
#[derive(Debug)]
pub struct OutputLink {
    path: PathBuf,
}

impl OutputPaths {
    /// A symbolic link at `path`, which may replace a link to a device or to nothing.
    ///
    /// # Errors
    /// A usage error if it is an input or a link to one; there is a file of this name, or a link to one.
    pub fn add_link(&mut self, path: impl AsRef<Path>) -> Result<OutputLink> {
        let path = path.as_ref().to_owned();
        if path.as_os_str() == STANDARD_OUTPUT {
            return Err(Error::usage("a link needs a name; give --link another").at("-"));
        }
        if let Some(identity) = Identity::of_input(&path) {
            self.refuse_input(&path, &identity)?;
        }
        let is_link = fs::symlink_metadata(&path).map(|there| there.is_symlink());
        let leads_to_file = fs::metadata(&path).is_ok_and(|there| there.is_file() || there.is_dir());
        if leads_to_file || is_link.is_ok_and(|is_link| !is_link) {
            return Err(Error::failed("there is a file of this name; give --link another").at(path.display()));
        }
        Ok(OutputLink { path })
    }
}

impl OutputLink {
    /// Its path.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Points it to `to`, atomically.
    ///
    /// # Errors
    /// Its folder cannot be written to.
    pub fn lead_to(&self, to: &Path) -> Result<()> {
        let made = Builder::new().make_in(folder_of(&self.path), |fresh| symlink(to, fresh));
        let put = made.and_then(|link| Ok(link.persist(&self.path).map(drop)?));
        put.map_err(|e| Error::io(&self.path, &e))
    }

    /// Removes it.
    pub fn remove(&self) {
        let _ = fs::remove_file(&self.path);
    }
}
