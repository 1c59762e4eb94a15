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

/// An animated PNG of `frames`, each of `size` and shown for `frame_s` seconds, over and over. Of each only what differs from
/// the one before is stored.
#[cfg(feature = "gpu")]
pub(crate) fn animated_png(frames: &[&[u8]], size: [u32; 2], frame_s: f64) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, size[0], size[1]);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::High);
    encoder.set_animated(frames.len() as u32, 0).map_err(cannot)?;
    encoder.set_frame_delay((1000.0 * frame_s).round().clamp(1.0, 65535.0) as u16, 1000).map_err(cannot)?;
    let mut writer = encoder.write_header().map_err(cannot)?;
    for (index, frame) in frames.iter().enumerate() {
        let [left, top, width, height] = match index.checked_sub(1) {
            None => [0, 0, size[0], size[1]],
            Some(before) => difference(frames[before], frame, size),
        };
        // The place of the frame before may not suit this one's size.
        let reset = writer.reset_frame_position();
        let placed = reset.and_then(|()| writer.set_frame_dimension(width, height));
        placed.and_then(|()| writer.set_frame_position(left, top)).map_err(cannot)?;
        let row = |y: u32| &frame[3 * (y * size[0] + left) as usize..][..3 * width as usize];
        let part: Vec<u8> = (top..top + height).flat_map(row).copied().collect();
        writer.write_image_data(&part).map_err(cannot)?;
    }
    writer.finish().map_err(cannot)?;
    Ok(bytes)
}

/// Left, top, width and height of what differs between two pictures of `size`; a pixel where nothing does.
#[cfg(feature = "gpu")]
fn difference(one: &[u8], other: &[u8], size: [u32; 2]) -> [u32; 4] {
    let pairs = one.chunks_exact(3).zip(other.chunks_exact(3)).enumerate();
    let places = pairs.filter(|(_, (a, b))| a != b).map(|(at, _)| [at as u32 % size[0], at as u32 / size[0]]);
    let ends = places.fold(None, |ends: Option<[[u32; 2]; 2]>, [x, y]| {
        let [[left, top], [right, bottom]] = ends.unwrap_or([[x, y], [x, y]]);
        Some([[left.min(x), top.min(y)], [right.max(x), bottom.max(y)]])
    });
    ends.map_or([0, 0, 1, 1], |[[left, top], [right, bottom]]| [left, top, right - left + 1, bottom - top + 1])
}

pub(crate) fn cannot(error: impl std::fmt::Display) -> Error {
    Error::failed(format!("cannot draw: {error}"))
}
