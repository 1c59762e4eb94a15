//! What commands are asked to do: flags laid over a scene file.

mod calibrated;
mod flags;
mod in_flags;
mod jointed;
mod outputs;
mod run_flags;

use std::ops::Deref;
use std::path::{Path, PathBuf};

use somatic::scene::file::SceneFile;
use somatic::source::SourceSpec;
use somatic::{Body, Options, Result};

pub(super) use self::flags::{LIVE, first, grouped, one_of};
pub(super) use self::in_flags::in_flags;
pub(super) use self::outputs::{output, outputs_help, outputs_or_usual};
pub(super) use self::run_flags::RunFlags;
use super::first_source::FirstSource;

impl RunFlags {
    /// What these flags and the scene file at `scene` ask for together; a flag comes before a key.
    pub(super) fn with(&self, scene: Option<&Path>) -> Result<Asked> {
        let file = scene.map(SceneFile::load).transpose()?.unwrap_or_default();
        let laid = self.over(file.clone()).and_then(|laid| laid.check().map(|()| laid));
        let laid = laid.map_err(|error| match scene {
            // What is wrong with the file alone is said by its keys.
            Some(path) if file.check().as_ref() == Err(&error) => error.at(path.display()),
            Some(path) => in_flags(error).at(path.display()),
            None => in_flags(error),
        });
        laid.map(Asked::from)
    }
}

/// What a command is asked to do, and what was found out of its first source.
#[derive(Clone, Debug, Default)]
pub(super) struct Asked {
    scene: SceneFile,
    pub(super) first: FirstSource,
}

impl From<SceneFile> for Asked {
    fn from(scene: SceneFile) -> Self {
        Self { scene, first: FirstSource::default() }
    }
}

impl Deref for Asked {
    type Target = SceneFile;

    fn deref(&self) -> &SceneFile {
        &self.scene
    }
}

impl Asked {
    /// The recording whose body and calibration are used, which is so where no body is named.
    pub(super) fn recording(&self) -> Option<&PathBuf> {
        match self.sources.first() {
            Some(SourceSpec::Mcap(path)) if self.body.is_none() => Some(path),
            _ => None,
        }
    }

    /// The engine's options on `body`, whose taxels have `ids`, for calls of `batch` frames.
    pub(super) fn options(&self, body: &Body, ids: &[u32], batch: usize) -> Result<Options> {
        let calibration = self.calibration_for(body, ids)?;
        let is_placed = self.body.is_some() || !self.outputs.is_empty() || self.export_is_placed()?.unwrap_or(true);
        self.engine_options(calibration, is_placed, batch)
    }
}
