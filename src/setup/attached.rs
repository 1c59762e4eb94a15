//! Files attached to a recording, which are used if no body is named.

use std::path::Path;

use super::Tell;
use crate::body::Original;
use crate::bundled;
use crate::error::{Error, Result};
use crate::limits::{self, MAX_BODY_BYTES};
use crate::recording::{BODY, CALIBRATION, Reader};
use crate::signal::Calibration;

/// The body in the recording at `path`: its name, and its bytes as `.glb`.
pub fn body(path: &Path) -> Result<Option<(String, Vec<u8>)>> {
    let mut reader = Reader::open(path)?;
    let found = reader.find_attached(|attached| attached.media_type == BODY)?;
    Ok(found.map(|(attached, bytes)| (attached.name, bytes)))
}

/// The text of the calibration in the recording at `path`. Tells once which of its names are others now.
pub fn calibration(path: &Path, tell: &Tell) -> Result<Option<String>> {
    let mut reader = Reader::open(path)?;
    let Some((_, bytes)) = reader.find_attached(|attached| attached.name == CALIBRATION)? else { return Ok(None) };
    let text = String::from_utf8(bytes)
        .map_err(|_| Error::failed("the attached calibration is not text").at(path.display()))?;
    let (text, renamed) = Calibration::with_names_of_now(text);
    if !renamed.is_empty() {
        tell.once(&format!("{}: its calibration was written under old names: {}", path.display(), renamed.join(", ")));
    }
    Ok(Some(text))
}

/// The body `name`, a file or a bundled one, as a self-contained `.glb`.
pub fn body_bytes(name: &str) -> Result<Vec<u8>> {
    let path = Path::new(name);
    if !path.exists()
        && let Some(bytes) = bundled::body(name)
    {
        return Ok(bytes.to_vec());
    }
    let bytes = limits::read(path, MAX_BODY_BYTES).map_err(|e| Error::io(path, &e))?;
    // A .glb may refer to buffers in other files; writing it anew embeds them.
    Original::from_bytes(name, &bytes, path.parent())?.to_glb().map_err(|e| e.at(name))
}

/// The file name of a path, by which calibrations name a body.
pub fn file_name(path: &str) -> String {
    Path::new(path).file_name().map_or_else(|| path.to_owned(), |name| name.to_string_lossy().into_owned())
}
