//! What a scene asks for, put together: its body, its calibration, and the source that it reads.

pub mod attached;
mod attachments;
pub mod bodies;
mod calibrated;
mod files;
mod first_source;
mod input;
mod jointed;
mod mapped;
pub mod overlaid;
mod recorded;
mod tell;

use std::ops::Deref;
use std::path::PathBuf;

pub use self::attachments::attachments;
pub use self::files::FilesRead;
use self::first_source::FirstSource;
pub use self::first_source::source_of;
pub use self::input::{Input, OpenedLines, RECORDED_BATCH};
pub use self::mapped::open_mapped;
pub use self::tell::Tell;
use crate::body::Body;
use crate::engine::Options;
use crate::error::Result;
use crate::scene_file::SceneFile;
use crate::sink::TableWish;
use crate::source::SourceSpec;

/// What a run is asked to do, and what was found out of its first source.
#[derive(Clone, Debug, Default)]
pub struct Setup {
    scene: SceneFile,
    first: FirstSource,
    tell: Tell,
}

impl Deref for Setup {
    type Target = SceneFile;

    fn deref(&self) -> &SceneFile {
        &self.scene
    }
}

impl Setup {
    /// What `scene` asks for; `tell` gets lines about what is found out, unless the scene wants quiet.
    #[must_use]
    pub fn new(scene: SceneFile, tell: Tell) -> Self {
        let tell = if scene.quiet { Tell::default() } else { tell };
        Self { scene, first: FirstSource::default(), tell }
    }

    /// What is asked of each recording, if it names several; else of all that it names together.
    #[must_use]
    pub fn each(&self) -> Vec<Self> {
        let are_several = self.sources.len() > 1 && self.sources.iter().all(SourceSpec::is_recording);
        if !are_several {
            return vec![self.clone()];
        }
        let of_one = |(index, source): (usize, &SourceSpec)| Self {
            scene: SceneFile { sources: vec![source.clone()], ..self.scene.clone() },
            // What is known of the first one is known here.
            first: if index == 0 { self.first.clone() } else { FirstSource::default() },
            tell: self.tell.clone(),
        };
        self.sources.iter().enumerate().map(of_one).collect()
    }

    /// The same, of which nobody hears what is found out.
    #[must_use]
    pub fn unheard(&self) -> Self {
        Self::new(self.scene.clone(), Tell::default())
    }

    /// The recording whose body and calibration are used, which is so where no body is named.
    #[must_use]
    pub fn recording(&self) -> Option<&PathBuf> {
        match self.sources.first() {
            Some(SourceSpec::Mcap(path)) if self.body.is_none() && self.map.is_none() => Some(path),
            _ => None,
        }
    }

    /// The engine's options on `body`, whose taxels have `ids`, for calls of `batch` frames.
    ///
    /// # Errors
    /// The calibration is invalid, or of another body; keys do not go together.
    pub fn options(&self, body: &Body, ids: &[u32], batch: usize) -> Result<Options> {
        let calibration = self.calibration_for(body, ids)?;
        self.engine_options(calibration, self.is_placed()?, batch)
    }

    /// What tables have, with a row per frame or not.
    ///
    /// # Errors
    /// The source cannot be opened.
    pub fn table_wish(&self, wide: bool) -> Result<TableWish> {
        Ok(if self.is_placed()? { self.tables(wide) } else { TableWish::new(self.outputs(), false, wide) })
    }

    /// Whether the sensors have places, or somebody asks for quantities by name.
    fn is_placed(&self) -> Result<bool> {
        Ok(self.body.is_some() || !self.outputs.is_empty() || self.export_is_placed()?.unwrap_or(true))
    }
}
