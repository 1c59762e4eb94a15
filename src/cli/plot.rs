//! Plots that commands draw beside what they say.

use std::path::Path;

use somatic::{Error, Result, whole};

/// A picture's format.
#[derive(Clone, Copy)]
pub(super) enum Format {
    Svg,
    Png,
}

impl Format {
    /// The one that the ending of `path` names.
    pub(super) fn of(path: &Path) -> Result<Self> {
        match path.extension().and_then(|ending| ending.to_str()) {
            Some("svg") => Ok(Self::Svg),
            Some("png") => Ok(Self::Png),
            _ => Err(Error::usage(format!(
                "--plot {} is neither .svg nor .png; a plot ends in .svg or .png",
                path.display()
            ))),
        }
    }

    /// Draws in this format and writes it at `path`, whole or not at all.
    pub(super) fn write(
        self,
        path: &Path,
        svg: impl FnOnce() -> Result<String>,
        png: impl FnOnce() -> Result<Vec<u8>>,
    ) -> Result<()> {
        let bytes = match self {
            Self::Svg => svg()?.into_bytes(),
            Self::Png => png()?,
        };
        whole::write(path, &bytes)
    }
}
