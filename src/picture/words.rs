//! Words over the pixels: title, captions, legend, and a bar that says how large things are.

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use crate::error::Result;
use crate::ink::{self, FAMILY, cannot};

const INK: RGBColor = RGBColor(0x2A, 0x2A, 0x2C);
const FAINT: RGBColor = RGBColor(0x6A, 0x6A, 0x6E);
/// Height of a row of the legend, and of the words in it, pixels.
const ROW: u32 = 26;
const SIZE: u32 = 16;
/// Left and right of the words.
const SIDE: u32 = 20;
/// Pixels of a swatch with the gap behind it, and of the gap between two entries.
const SWATCH: u32 = 22;
const GAP: u32 = 24;
/// Of the width that the bar keeps free at the right of the last row.
const BAR: u32 = 220;

/// Everything that is written into a picture.
pub(super) struct Words {
    title: String,
    key: Vec<(Option<[u8; 3]>, String)>,
    captions: Vec<(String, [u32; 2])>,
    /// Pixels a metre.
    scale: Option<f64>,
    /// Where an origin with its axes goes.
    axes: Option<[f64; 2]>,
}

impl Words {
    pub(super) fn new(title: &str) -> Self {
        Self { title: title.to_owned(), key: Vec::new(), captions: Vec::new(), scale: None, axes: None }
    }

    /// Sets what the legend has, colours and names, and gives the pixels that it takes. One that would take over a third
    /// of a picture of `size` only says how many there are.
    pub(super) fn key(&mut self, key: Vec<(Option<[u8; 3]>, String)>, size: [u32; 2]) -> u32 {
        let named = key.len();
        self.key = key;
        if 3 * self.legend_height(size[0]) > size[1] {
            self.key = vec![(None, format!("{named} fields"))];
        }
        self.legend_height(size[0])
    }

    fn legend_height(&self, width: u32) -> u32 {
        ROW * self.rows(width).last().map_or(1, |(_, row)| row + 1) + 12
    }

    /// `text` with its middle at `at`.
    pub(super) fn caption(&mut self, text: &str, at: [u32; 2]) {
        self.captions.push((text.to_owned(), at));
    }

    pub(super) fn bar(&mut self, pixels_a_metre: f64) {
        self.scale = Some(pixels_a_metre);
    }

    pub(super) fn axes(&mut self, origin: [f64; 2]) {
        self.axes = Some(origin);
    }

    /// Left and row of each entry of the legend; every row keeps the bar's place free.
    fn rows(&self, width: u32) -> Vec<(u32, u32)> {
        let end = width.saturating_sub(SIDE + BAR).max(SIDE + 1);
        let (mut x, mut row) = (SIDE, 0);
        let mut places = Vec::with_capacity(self.key.len());
        for (_, name) in &self.key {
            // What cannot be measured cannot be written either, and that is told there.
            let wide = SWATCH + ink::width(name, SIZE).unwrap_or_default();
            if x > SIDE && x + wide > end {
                (x, row) = (SIDE, row + 1);
            }
            places.push((x, row));
            x += wide + GAP;
        }
        places
    }

    /// Writes everything into `pixels`.
    pub(super) fn draw(&self, pixels: &mut [u8], size: [u32; 2]) -> Result<()> {
        ink::font()?;
        let [width, height] = size;
        let area = BitMapBackend::with_buffer(pixels, (width, height)).into_drawing_area();
        let text = |pixels: u32, colour: RGBColor, side: HPos| {
            (FAMILY, pixels).into_font().color(&colour).pos(Pos::new(side, VPos::Center))
        };
        let place = |x: u32, y: u32| (x as i32, y as i32);
        area.draw_text(&self.title, &text(22, INK, HPos::Left), place(SIDE, 24)).map_err(cannot)?;
        for (caption, [x, y]) in &self.captions {
            area.draw_text(caption, &text(SIZE, FAINT, HPos::Center), place(*x, *y)).map_err(cannot)?;
        }
        let top = height.saturating_sub(self.legend_height(width)) + ROW / 2;
        let style = text(SIZE, INK, HPos::Left);
        for ((colour, name), (x, row)) in self.key.iter().zip(self.rows(width)) {
            let middle = top + ROW * row;
            let mut left = x;
            if let Some([r, g, b]) = *colour {
                let dot = |radius: i32, colour: RGBColor| Circle::new(place(x + 7, middle), radius, colour.filled());
                area.draw(&dot(8, INK)).and_then(|()| area.draw(&dot(7, RGBColor(r, g, b)))).map_err(cannot)?;
                left += SWATCH;
            }
            area.draw_text(name, &style, place(left, middle)).map_err(cannot)?;
        }
        if let Some(scale) = self.scale {
            let (metres, name) = round_length(f64::from(BAR - 100) / scale);
            let (right, y) = (width - SIDE, height.saturating_sub(ROW / 2 + 12));
            let left = right - (metres * scale).round() as u32;
            let stroke = |from, to| PathElement::new([from, to], INK.stroke_width(2));
            for (from, to) in [
                (place(left, y), place(right, y)),
                (place(left, y - 5), place(left, y + 5)),
                (place(right, y - 5), place(right, y + 5)),
            ] {
                area.draw(&stroke(from, to)).map_err(cannot)?;
            }
            area.draw_text(&name, &text(SIZE, INK, HPos::Right), place(left - 8, y)).map_err(cannot)?;
        }
        if let Some([x, y]) = self.axes {
            let (x, y) = (x.round() as i32, y.round() as i32);
            for (to, name, at) in [((x + 44, y), "u", (x + 54, y)), ((x, y - 44), "v", (x, y - 54))] {
                let line = PathElement::new([(x, y), to], INK.stroke_width(3));
                area.draw(&line).map_err(cannot)?;
                area.draw_text(name, &text(SIZE, INK, HPos::Center), at).map_err(cannot)?;
            }
        }
        area.present().map_err(cannot)
    }
}

/// The largest length of 1, 2 or 5 with zeros that is at most `most_m`, and how people write it.
fn round_length(most_m: f64) -> (f64, String) {
    let power = libm::pow(10.0, libm::floor(libm::log10(most_m.max(1e-9))));
    let metres = [5.0, 2.0, 1.0].map(|digit| digit * power).into_iter().find(|&m| m <= most_m).unwrap_or(power);
    let name = match metres {
        m if m >= 1.0 => format!("{m:.0} m"),
        m if m >= 0.01 => format!("{:.0} cm", m * 1e2),
        m if m >= 0.001 => format!("{:.0} mm", m * 1e3),
        m => format!("{:.0e} m", m),
    };
    (metres, name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bar_has_a_round_length() {
        let names = [0.0234, 0.07, 12.0, 0.0051, 0.19].map(|most| round_length(most).1);
        assert_eq!(names, ["2 cm", "5 cm", "10 m", "5 mm", "10 cm"]);
    }

    #[test]
    fn a_legend_breaks_its_rows_before_the_bar() {
        let mut words = Words::new("x");
        let key = vec![(None, "a field of some name".to_owned()); 9];
        let below = words.key(key.clone(), [800, 800]);
        let rows = words.rows(800);
        assert!(rows.iter().all(|&(x, _)| x < 800 - BAR));
        assert_eq!((rows.last().unwrap().1, below), (4, 5 * ROW + 12));
        // No room: they are counted.
        assert_eq!(words.key(key, [800, 400]), ROW + 12);
        assert_eq!(words.key[0].1, "9 fields");
    }
}
