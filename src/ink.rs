//! What pictures share: a font that comes along, words on pixels, and PNG. No font of the system is needed.

use std::sync::OnceLock;

use plotters::prelude::*;
use plotters::style::register_font;

use crate::error::{Error, Result};

/// DejaVu Sans, cut down to the letters that figures use; its licence lies beside it.
static FONT: &[u8] = include_bytes!("font/DejaVuSans-subset.ttf");
/// What plotters knows it by.
pub(crate) const FAMILY: &str = "sans-serif";

/// Makes the font known to plotters, once.
pub(crate) fn font() -> Result<()> {
    static KNOWN: OnceLock<bool> = OnceLock::new();
    let known = *KNOWN.get_or_init(|| register_font(FAMILY, FontStyle::Normal, FONT).is_ok());
    if known { Ok(()) } else { Err(Error::failed("cannot draw: the font that comes with it is broken")) }
}

/// How wide `text` is in letters of `size`, pixels.
#[cfg(feature = "gpu")]
pub(crate) fn width(text: &str, size: u32) -> Result<u32> {
    font()?;
    (FAMILY, size).into_font().box_size(text).map(|(width, _)| width).map_err(cannot)
}

/// A PNG of `pixels`, three bytes each, row by row; width and height are `size`.
pub(crate) fn png(pixels: &[u8], size: [u32; 2]) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, size[0], size[1]);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::High);
    let written = encoder.write_header().and_then(|mut writer| {
        writer.write_image_data(pixels)?;
        writer.finish()
    });
    written.map_err(cannot)?;
    Ok(bytes)
}

pub(crate) fn cannot(error: impl std::fmt::Display) -> Error {
    Error::failed(format!("cannot draw: {error}"))
}
