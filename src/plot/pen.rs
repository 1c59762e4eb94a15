//! Draws in pixels of the arrangement.

use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use crate::error::Result;
use crate::ink::{FAMILY, cannot};

/// Dots drawn for each pixel of the arrangement: plotters has whole dots only.
pub(super) const SCALE: i32 = 2;
pub(super) const INK: RGBColor = RGBColor(40, 40, 40);
/// The least size of a text, pixels.
const MIN_SIZE: i32 = 6;

/// Pixels as dots.
pub(super) fn scaled(pixels: f64) -> i32 {
    (pixels * f64::from(SCALE)).round() as i32
}

/// Draws in pixels of the arrangement; `dots` and `disc` in dots.
pub(super) struct Pen<'a, B: DrawingBackend> {
    pub(super) area: &'a DrawingArea<B, Shift>,
    /// Whether the backend joins the parts of a line. Where it does not, they would end in spikes at sharp corners.
    pub(super) joins: bool,
}

impl<B: DrawingBackend> Pen<'_, B> {
    fn style(pixels: i32, colour: RGBColor, aligned: HPos) -> TextStyle<'static> {
        (FAMILY, pixels * SCALE).into_font().color(&colour).pos(Pos::new(aligned, VPos::Center))
    }

    pub(super) fn text(
        &self,
        text: &str,
        pixels: i32,
        colour: RGBColor,
        aligned: HPos,
        (x, y): (i32, i32),
    ) -> Result<()> {
        self.area.draw_text(text, &Self::style(pixels, colour, aligned), (SCALE * x, SCALE * y)).map_err(cannot)
    }

    pub(super) fn upwards(&self, text: &str, pixels: i32, colour: RGBColor, (x, y): (i32, i32)) -> Result<()> {
        let style = Self::style(pixels, colour, HPos::Center).transform(FontTransform::Rotate270);
        self.area.draw_text(text, &style, (SCALE * x, SCALE * y)).map_err(cannot)
    }

    pub(super) fn width(&self, text: &str, pixels: i32) -> Result<i32> {
        let style = Self::style(pixels, INK, HPos::Left);
        Ok(self.area.estimate_text_size(text, &style).map_err(cannot)?.0 as i32 / SCALE)
    }

    /// The size at which all `texts` fit into `width`, at most `pixels`.
    pub(super) fn fitting_size(&self, texts: &[String], pixels: i32, width: i32) -> Result<i32> {
        for size in (MIN_SIZE..=pixels).rev() {
            let widths = texts.iter().map(|text| self.width(text, size)).collect::<Result<Vec<_>>>()?;
            if widths.into_iter().all(|wide| wide <= width) {
                return Ok(size);
            }
        }
        Ok(MIN_SIZE)
    }

    /// `text` cut off at its beginning where it is wider than `width`: the end of a path says more.
    fn shortened(&self, text: &str, pixels: i32, width: i32) -> Result<String> {
        let mut rest = text.to_owned();
        while self.width(&rest, pixels)? > width && rest.chars().count() > 4 {
            rest = format!("…{}", rest.chars().skip(3).collect::<String>());
        }
        Ok(rest)
    }

    pub(super) fn fitted(&self, text: &str, pixels: i32, colour: RGBColor, at: (i32, i32), width: i32) -> Result<()> {
        self.text(&self.shortened(text, pixels, width)?, pixels, colour, HPos::Left, at)
    }

    pub(super) fn fitted_centred(
        &self,
        text: &str,
        pixels: i32,
        colour: RGBColor,
        at: (i32, i32),
        width: i32,
    ) -> Result<()> {
        self.text(&self.shortened(text, pixels, width)?, pixels, colour, HPos::Center, at)
    }

    pub(super) fn line(&self, points: &[(i32, i32)], colour: RGBColor, width: f64) -> Result<()> {
        let points: Vec<(i32, i32)> = points.iter().map(|&(x, y)| (SCALE * x, SCALE * y)).collect();
        self.dots(&points, colour, width)
    }

    pub(super) fn dots(&self, points: &[(i32, i32)], colour: RGBColor, width: f64) -> Result<()> {
        match points {
            [] => Ok(()),
            [at] => self.disc(*at, scaled(width / 2.0).max(1), colour),
            points => {
                let stroke = colour.stroke_width(scaled(width).max(1) as u32);
                if self.joins {
                    return self.area.draw(&PathElement::new(points.to_vec(), stroke)).map_err(cannot);
                }
                for pair in points.windows(2) {
                    self.area.draw(&PathElement::new(pair.to_vec(), stroke)).map_err(cannot)?;
                    self.disc(pair[1], scaled(width / 2.0 - 0.25), colour)?;
                }
                Ok(())
            }
        }
    }

    pub(super) fn disc(&self, at: (i32, i32), radius: i32, colour: RGBColor) -> Result<()> {
        self.area.draw(&Circle::new(at, radius, colour.filled())).map_err(cannot)
    }

    pub(super) fn rectangle(&self, corners: [(i32, i32); 2], colour: RGBColor) -> Result<()> {
        self.area.draw(&Rectangle::new(corners, colour.filled())).map_err(cannot)
    }
}
