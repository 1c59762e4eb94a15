//! What was drawn: pixels, and PNG made of them.

use crate::error::Result;
use crate::ink;

/// A picture that was drawn.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Picture {
    /// Width and height, pixels.
    pub size: [u32; 2],
    /// Red, green and blue of each pixel, row by row from the top.
    pub pixels: Vec<u8>,
}

impl Picture {
    /// It as PNG.
    ///
    /// # Errors
    /// It has another size than it says.
    pub fn png(&self) -> Result<Vec<u8>> {
        ink::png(&self.pixels, self.size)
    }

    /// Pictures of one size as PNG: animated where there are several, each shown for `picture_s` seconds.
    ///
    /// # Errors
    /// There are too many, or none.
    pub fn animation(pictures: &[Self], picture_s: f64) -> Result<Vec<u8>> {
        match pictures {
            [picture] => picture.png(),
            pictures => {
                let size = pictures.first().map_or([0; 2], |first| first.size);
                let pixels: Vec<&[u8]> = pictures.iter().map(|picture| &picture.pixels[..]).collect();
                ink::animated_png(&pixels, size, picture_s)
            }
        }
    }
}
