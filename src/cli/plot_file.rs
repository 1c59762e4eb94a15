//! Plots that commands draw, as SVG or PNG.

use std::path::Path;

use somatic::output::{OutputPath, OutputPaths};
use somatic::{Error, Result};

pub(super) struct PlotFile {
    format: Format,
    output: OutputPath,
}

enum Format {
    Svg,
    Png,
}

impl PlotFile {
    /// One in the format that the ending of `path` names, which the flag `flag` gives and is one of `outputs`.
    pub(super) fn at(path: &Path, flag: &str, outputs: &mut OutputPaths) -> Result<Self> {
        let format = match path.extension().and_then(|ending| ending.to_str()) {
            Some("svg") => Format::Svg,
            Some("png") => Format::Png,
            _ => {
                return Err(Error::usage(format!(
                    "{flag} {} is neither .svg nor .png; a plot ends in .svg or .png",
                    path.display()
                )));
            }
        };
        Ok(Self { format, output: outputs.add(path)? })
    }

    /// Draws it in its format and writes it, whole or not at all.
    pub(super) fn draw(
        self,
        svg: impl FnOnce() -> Result<String>,
        png: impl FnOnce() -> Result<Vec<u8>>,
    ) -> Result<()> {
        let bytes = match self.format {
            Format::Svg => svg()?.into_bytes(),
            Format::Png => png()?,
        };
        self.output.write(&bytes)
    }
}
