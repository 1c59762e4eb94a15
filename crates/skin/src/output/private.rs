//! Files for one reader: what they hold is nobody else's.

use std::io::Write as _;
use std::path::Path;

use tempfile::NamedTempFile;

use super::parts::Listed;
use crate::error::{Error, Result};

/// A temporary file that only its owner can read. It is removed when this is dropped.
#[derive(Debug)]
pub struct PrivateFile {
    file: NamedTempFile,
    _listed: Listed,
}

impl PrivateFile {
    /// A file with `bytes`, whose name ends with `ending`.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn new(ending: &str, bytes: &[u8]) -> Result<Self> {
        let made = tempfile::Builder::new().prefix("somatic-").suffix(ending).tempfile();
        let written = made.and_then(|mut file| {
            file.write_all(bytes)?;
            file.flush()?;
            Ok(Self { _listed: Listed::new(file.path()), file })
        });
        written.map_err(|e| Error::failed(format!("cannot write a temporary file: {e}")))
    }

    /// Where it is.
    #[must_use]
    pub fn path(&self) -> &Path {
        self.file.path()
    }
}

#[cfg(all(test, unix))]
mod tests {
    use std::os::unix::fs::PermissionsExt as _;

    use super::*;

    #[test]
    fn nobody_else_can_read_it_and_it_goes() {
        let file = PrivateFile::new(".html", b"secret").unwrap();
        let path = file.path().to_owned();
        assert_eq!(std::fs::metadata(&path).unwrap().permissions().mode() & 0o777, 0o600);
        assert_eq!(std::fs::read(&path).unwrap(), b"secret");
        drop(file);
        assert!(!path.exists());
    }
}
