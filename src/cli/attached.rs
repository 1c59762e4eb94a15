//! Files attached to a recording: written by `run`, and used if no body is named.

use std::path::Path;

use somatic::body::{Body, Original};
use somatic::recording::{BODY, CALIBRATION, Reader, SCENE};
use somatic::{Error, Result, bundled};

use super::scene::RunOptions;

/// The body in the recording at `path`: its name, and its bytes as `.glb`.
///
/// # Errors
/// The recording cannot be read.
pub(super) fn body(path: &Path) -> Result<Option<(String, Vec<u8>)>> {
    let mut reader = Reader::open(path)?;
    let found = reader.attached().iter().find(|attached| attached.media_type == BODY).cloned();
    found.map(|attached| Ok((attached.name.clone(), reader.bytes_of(&attached)?))).transpose()
}

/// The text of the calibration in the recording at `path`.
///
/// # Errors
/// The recording cannot be read, or the calibration is no text.
pub(super) fn calibration(path: &Path) -> Result<Option<String>> {
    let mut reader = Reader::open(path)?;
    let found = reader.attached().iter().find(|attached| attached.name == CALIBRATION).cloned();
    let Some(attached) = found else { return Ok(None) };
    let text = String::from_utf8(reader.bytes_of(&attached)?);
    text.map(Some).map_err(|_| Error::failed("the attached calibration is no text").at(path.display()))
}

/// The files to attach to a recording of this run: name, media type, bytes.
///
/// # Errors
/// One of them cannot be read.
pub(super) fn files(asked: &RunOptions, body: &Body, scene: Option<&Path>) -> Result<Vec<(String, String, Vec<u8>)>> {
    let text = |path: &Path| std::fs::read(path).map_err(|e| Error::io(path, &e));
    let recording = asked.recording()?;
    let inherited = recording.as_deref().map(self::body).transpose()?.flatten();
    let (name, bytes) = match inherited {
        Some(body) => body,
        None => (file_name(&body.name), body_bytes(&body.name)?),
    };
    let mut files = vec![(name, BODY.to_owned(), bytes)];
    let calibration = match &asked.calibration {
        Some(path) => Some(text(path)?),
        None => asked.own_calibration()?.map(|(_, text)| text.into_bytes()),
    };
    let toml = "application/toml".to_owned();
    files.extend(calibration.map(|bytes| (CALIBRATION.to_owned(), toml.clone(), bytes)));
    if let Some(scene) = scene {
        files.push((SCENE.to_owned(), toml, text(scene)?));
    }
    Ok(files)
}

/// The body `name`, a file or a bundled one, as a self-contained `.glb`.
///
/// # Errors
/// It cannot be read.
pub(super) fn body_bytes(name: &str) -> Result<Vec<u8>> {
    let path = Path::new(name);
    if !path.exists()
        && let Some(bytes) = bundled::body(name)
    {
        return Ok(bytes.to_vec());
    }
    let bytes = std::fs::read(path).map_err(|e| Error::io(path, &e))?;
    // A .glb may refer to buffers in other files; writing it anew embeds them.
    Original::from_bytes(name, &bytes, path.parent())?.to_glb().map_err(|e| e.at(name))
}

/// The file name of a path, by which calibrations name a body.
pub(super) fn file_name(path: &str) -> String {
    Path::new(path).file_name().map_or_else(|| path.to_owned(), |name| name.to_string_lossy().into_owned())
}
