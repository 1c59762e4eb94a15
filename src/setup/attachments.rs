//! The files that `run` attaches to a recording of its own.

use std::path::Path;

use super::Setup;
use super::attached::{self, body_bytes, file_name};
use crate::body::Body;
use crate::error::{Error, Result};
use crate::limits::{self, MAX_TOML_BYTES};
use crate::recording::{BODY, CALIBRATION, SCENE};

/// The files to attach to a recording of this run: name, media type, bytes.
pub fn attachments(setup: &Setup, body: &Body, scene: Option<&Path>) -> Result<Vec<(String, String, Vec<u8>)>> {
    let text = |path: &Path| limits::read(path, MAX_TOML_BYTES).map_err(|e| Error::io(path, &e));
    let recording = setup.recording();
    let inherited = match recording {
        Some(recording) => attached::body(recording)?,
        None => made_body(setup)?,
    };
    let (name, bytes) = match inherited {
        Some(body) => body,
        None => (file_name(&body.name), body_bytes(&body.name)?),
    };
    let mut files = vec![(name, BODY.to_owned(), bytes)];
    let calibration = setup.calibration_text(body)?.map(|(_, text)| text.into_bytes());
    let toml = "application/toml".to_owned();
    files.extend(calibration.map(|bytes| (CALIBRATION.to_owned(), toml.clone(), bytes)));
    if let Some(scene) = scene {
        files.push((SCENE.to_owned(), toml, text(scene)?));
    }
    Ok(files)
}

/// The body that was made for what is read, where none is named.
fn made_body(setup: &Setup) -> Result<Option<(String, Vec<u8>)>> {
    if let Some(body) = setup.export_body()? {
        return Ok(Some(body));
    }
    let made = match setup.text_body()? {
        Some(body) => Some(body),
        None => setup.mapped_body()?,
    };
    Ok(made.map(|(name, bytes)| (file_name(&name), bytes)))
}
