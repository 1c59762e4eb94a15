//! Labels of a picture: title, captions, legend and scale bar.

use std::collections::BTreeMap;

use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::arrows;
use super::colour::{PAPER, linear};
use crate::colours::COLOURS;
use crate::error::Result;
use crate::ink::{self, FAMILY, cannot};

pub(super) const INK: RGBColor = RGBColor(0x2A, 0x2A, 0x2C);
const FAINT: RGBColor = RGBColor(0x6A, 0x6A, 0x6E);
/// Width of a picture up to which labels have the sizes below, pixels; in wider ones they scale with it.
const BASE_WIDTH: f64 = 1000.0;
/// Height of a row of the legend, of its text and of the title, pixels.
const ROW: u32 = 26;
const SIZE: u32 = 16;
const TITLE_SIZE: u32 = 22;
/// Minimum size of a title, pixels.
const MIN_TITLE_SIZE: u32 = 10;
/// Pixels above the views for the title, and above each for its name.
const TITLE: u32 = 44;
const CAPTION: u32 = 26;
/// Margins left and right of labels.
const SIDE: u32 = 20;
/// Pixels of a swatch with the gap behind it, and of the gap between two entries.
const SWATCH: u32 = 22;
const GAP: u32 = 24;
/// Length of a bar of colours: at least, that for which a title gets smaller, and at most.
const SHORTEST_BAR: u32 = 24;
const LEFT_BAR: u32 = 80;
const LONGEST_BAR: u32 = 160;
/// Width reserved for the scale bar at the right of the last row.
const BAR: u32 = 220;

/// A bar of colours with its ends.
pub(super) struct Legend {
    pub(super) colours: [[u8; 3]; COLOURS],
    /// In `unit`.
    pub(super) ends: [f64; 2],
    pub(super) unit: String,
    /// What else is to be said, where there is room.
    pub(super) note: String,
}

pub(super) struct Labels {
    title: String,
    /// Pixels across the picture.
    width: u32,
    key: Vec<(Option<[u8; 3]>, String)>,
    captions: Vec<(String, [u32; 2])>,
    /// Pixels a metre.
    scale: Option<f64>,
    /// Where an origin with its axes goes.
    axes: Option<[f64; 2]>,
    /// The colours of what taxels read, with their ends.
    colours: Option<Legend>,
    /// The length of an arrow, pixels, and the force that it stands for.
    arrow: Option<(f64, String)>,
}

impl Labels {
    pub(super) fn new(title: &str, width: u32) -> Self {
        Self {
            title: title.to_owned(),
            width,
            key: Vec::new(),
            captions: Vec::new(),
            scale: None,
            axes: None,
            colours: None,
            arrow: None,
        }
    }

    /// `pixels` scaled to this picture's width.
    fn scaled(&self, pixels: u32) -> u32 {
        (f64::from(pixels) * (f64::from(self.width) / BASE_WIDTH).max(1.0)).round() as u32
    }

    pub(super) fn above(&self) -> u32 {
        self.scaled(TITLE)
    }

    pub(super) fn above_view(&self) -> u32 {
        self.scaled(CAPTION)
    }

    /// Sets the legend's colours and names, and returns its height, pixels. A legend of over a third of a picture of `size` is
    /// replaced by the number of fields.
    pub(super) fn key(&mut self, key: Vec<(Option<[u8; 3]>, String)>, size: [u32; 2]) -> u32 {
        let named = key.len();
        self.key = key;
        if 3 * self.legend_height() > size[1] {
            self.key = vec![(None, format!("{named} fields"))];
        }
        self.legend_height()
    }

    fn legend_height(&self) -> u32 {
        self.scaled(ROW) * (self.bar_row() + 1) + self.scaled(12)
    }

    /// The row of the scale bar: the last, or a new one if a name needs the bar's place.
    fn bar_row(&self) -> u32 {
        let rows = self.rows();
        let (Some(&(x, row)), Some((_, name))) = (rows.last(), self.key.last()) else { return 0 };
        row + u32::from(x + self.wide(name) > self.end())
    }

    /// Left end of the bar's place, pixels.
    fn end(&self) -> u32 {
        self.width.saturating_sub(self.scaled(SIDE + BAR)).max(self.scaled(SIDE) + 1)
    }

    /// Width of an entry of the legend, pixels.
    fn wide(&self, name: &str) -> u32 {
        // An error is reported when the text is drawn.
        self.scaled(SWATCH) + ink::width(name, self.scaled(SIZE)).unwrap_or_default()
    }

    pub(super) fn caption(&mut self, text: &str, at: [u32; 2]) {
        self.captions.push((text.to_owned(), at));
    }

    pub(super) fn bar(&mut self, pixels_a_metre: f64) {
        self.scale = Some(pixels_a_metre);
    }

    /// Adds the colours of what taxels show.
    pub(super) fn colours(&mut self, legend: Legend) {
        self.colours = Some(legend);
    }

    /// Adds an arrow, pixels long, that stands for a force.
    pub(super) fn arrow(&mut self, key: (f64, String)) {
        self.arrow = Some(key);
    }

    pub(super) fn axes(&mut self, origin: [f64; 2]) {
        self.axes = Some(origin);
    }

    /// Left end and row of each entry of the legend; the bar's place stays free.
    fn rows(&self) -> Vec<(u32, u32)> {
        let (side, end) = (self.scaled(SIDE), self.end());
        let (mut x, mut row) = (side, 0);
        let mut places = Vec::with_capacity(self.key.len());
        for (_, name) in &self.key {
            let wide = self.wide(name);
            if x > side && x + wide > end {
                (x, row) = (side, row + 1);
            }
            places.push((x, row));
            x += wide + self.scaled(GAP);
        }
        places
    }

    fn title_size(&self) -> u32 {
        let room = match &self.colours {
            Some(legend) => self.legend_from(legend).saturating_sub(self.scaled(LEFT_BAR + SIDE)),
            None => self.width.saturating_sub(2 * self.scaled(SIDE)),
        };
        let sizes = (MIN_TITLE_SIZE..=self.scaled(TITLE_SIZE)).rev();
        let mut fitting = sizes.filter(|&size| ink::width(&self.title, size).is_ok_and(|wide| wide <= room));
        fitting.next().unwrap_or(MIN_TITLE_SIZE)
    }

    pub(super) fn draw(&self, pixels: &mut [u8], size: [u32; 2]) -> Result<()> {
        ink::font()?;
        let [width, height] = size;
        let area = BitMapBackend::with_buffer(pixels, (width, height)).into_drawing_area();
        let text = |pixels: u32, colour: RGBColor, side: HPos| {
            (FAMILY, pixels).into_font().color(&colour).pos(Pos::new(side, VPos::Center))
        };
        let place = |x: u32, y: u32| (x as i32, y as i32);
        let scaled = |pixels: u32| self.scaled(pixels);
        let (side, size) = (scaled(SIDE), scaled(SIZE));
        let title = text(self.title_size(), INK, HPos::Left);
        area.draw_text(&self.title, &title, place(side, scaled(24))).map_err(cannot)?;
        for (caption, [x, y]) in &self.captions {
            area.draw_text(caption, &text(size, FAINT, HPos::Center), place(*x, *y)).map_err(cannot)?;
        }
        let top = height.saturating_sub(self.legend_height()) + scaled(ROW) / 2;
        let style = text(size, INK, HPos::Left);
        for ((colour, name), (x, row)) in self.key.iter().zip(self.rows()) {
            let middle = top + scaled(ROW) * row;
            let mut left = x;
            if let Some([r, g, b]) = *colour {
                let dot = |radius: u32, colour: RGBColor| {
                    Circle::new(place(x + scaled(7), middle), scaled(radius) as i32, colour.filled())
                };
                area.draw(&dot(8, INK)).and_then(|()| area.draw(&dot(7, RGBColor(r, g, b)))).map_err(cannot)?;
                left += scaled(SWATCH);
            }
            area.draw_text(name, &style, place(left, middle)).map_err(cannot)?;
        }
        if let Some(scale) = self.scale {
            let (metres, name) = round_length(f64::from(scaled(BAR - 100)) / scale);
            let (right, y) = (width - side, height.saturating_sub(scaled(ROW / 2 + 12)));
            let left = right - (metres * scale).round() as u32;
            let end = scaled(5);
            let stroke = |from, to| PathElement::new([from, to], INK.stroke_width(scaled(2)));
            for (from, to) in [
                (place(left, y), place(right, y)),
                (place(left, y - end), place(left, y + end)),
                (place(right, y - end), place(right, y + end)),
            ] {
                area.draw(&stroke(from, to)).map_err(cannot)?;
            }
            area.draw_text(&name, &text(size, INK, HPos::Right), place(left - scaled(8), y)).map_err(cannot)?;
        }
        if let Some(legend) = &self.colours {
            self.draw_colours(&area, legend)?;
        }
        if let Some([x, y]) = self.axes {
            let (x, y) = (x.round() as i32, y.round() as i32);
            let [long, beyond, around] = [44, 56, 11].map(|pixels| scaled(pixels) as i32);
            let [r, g, b] = PAPER;
            let paper = RGBColor(r, g, b);
            let axes = [((x + long, y), "u", (x + beyond, y)), ((x, y - long), "v", (x, y - beyond))];
            // On a background, so that they are visible over discs.
            for (to, _, at) in axes {
                area.draw(&PathElement::new([(x, y), to], paper.stroke_width(scaled(7)))).map_err(cannot)?;
                area.draw(&Circle::new(at, around, paper.filled())).map_err(cannot)?;
            }
            for (to, name, at) in axes {
                area.draw(&PathElement::new([(x, y), to], INK.stroke_width(scaled(3)))).map_err(cannot)?;
                area.draw_text(name, &text(size, INK, HPos::Center), at).map_err(cannot)?;
            }
        }
        area.present().map_err(cannot)?;
        drop(area);
        match &self.arrow {
            Some((length, force)) => self.draw_arrow(pixels, [width, height], *length, force),
            None => Ok(()),
        }
    }

    /// Draws the arrow that stands for `force` behind the legend's last entry, if there is room before the scale bar.
    fn draw_arrow(&self, pixels: &mut [u8], size: [u32; 2], length: f64, force: &str) -> Result<()> {
        let left = match (self.rows().last(), self.key.last()) {
            (Some((x, _)), Some((_, name))) => x + self.wide(name) + self.scaled(GAP),
            _ => self.scaled(SIDE),
        };
        let (gap, text) = (self.scaled(8), ink::width(force, self.scaled(SIZE))?);
        let tip = f64::from(left) + length;
        if tip + f64::from(gap + text) > f64::from(self.end()) {
            return Ok(());
        }
        let middle = size[1].saturating_sub(self.scaled(ROW / 2 + 12));
        let y = f64::from(middle);
        arrows::draw(pixels, size, std::iter::once([[f64::from(left), y], [tip, y]]))?;
        let area = BitMapBackend::with_buffer(pixels, (size[0], size[1])).into_drawing_area();
        let style = (FAMILY, self.scaled(SIZE)).into_font().color(&INK).pos(Pos::new(HPos::Left, VPos::Center));
        area.draw_text(force, &style, (tip.round() as i32 + gap as i32, middle as i32)).map_err(cannot)?;
        area.present().map_err(cannot)
    }

    /// Where a bar of colours could begin that is as long as nothing, pixels: what is right of it are its ends and gaps.
    fn legend_from(&self, Legend { ends: [least, most], unit, .. }: &Legend) -> u32 {
        let size = self.scaled(SIZE);
        // An error is reported when the text is drawn.
        let words = [short(*least), format!("{} {unit}", short(*most))].map(|end| ink::width(&end, size).unwrap_or(0));
        self.width.saturating_sub(words[0] + words[1] + self.scaled(SIDE + 16 + GAP))
    }

    /// Draws a bar of colours at the right of the title.
    fn draw_colours<B: DrawingBackend>(&self, area: &DrawingArea<B, Shift>, legend: &Legend) -> Result<()> {
        let Legend { colours, ends: [least, most], unit, note } = legend;
        let (side, size) = (self.scaled(SIDE), self.scaled(SIZE));
        let text = |pixels: u32, colour: RGBColor, side: HPos| {
            (FAMILY, pixels).into_font().color(&colour).pos(Pos::new(side, VPos::Center))
        };
        let place = |x: u32, y: u32| (x as i32, y as i32);
        let (scaled, width) = (|pixels: u32| self.scaled(pixels), self.width);
        let (top, low) = (scaled(14), scaled(12));
        let ends = [(short(*least), HPos::Right), (format!("{} {unit}", short(*most)), HPos::Left)];
        let right = width - side - ink::width(&ends[1].0, size)? - scaled(8);
        // A bar of colours gives way to a title.
        let title = side + ink::width(&self.title, self.title_size())?;
        let room = self.legend_from(legend).saturating_sub(title);
        let left = right.saturating_sub(room.clamp(scaled(SHORTEST_BAR), scaled(LONGEST_BAR)));
        for x in left..right {
            let [r, g, b] = colours[((x - left) * 255 / (right - left)) as usize];
            let column = [place(x, top + scaled(5)), place(x + 1, top + scaled(5) + low)];
            area.draw(&Rectangle::new(column, RGBColor(r, g, b).filled())).map_err(cannot)?;
        }
        for ((text_of, side), x) in ends.iter().zip([left - scaled(8), right + scaled(8)]) {
            area.draw_text(text_of, &text(size, INK, *side), place(x, top + scaled(11))).map_err(cannot)?;
        }
        let taken = side + ink::width(&self.title, self.title_size())? + ink::width(&ends[0].0, size)? + scaled(44);
        if ink::width(note, size)? + taken <= left {
            let x = left - scaled(24) - ink::width(&ends[0].0, size)?;
            area.draw_text(note, &text(size, FAINT, HPos::Right), place(x, top + scaled(11))).map_err(cannot)?;
        }
        Ok(())
    }
}

/// Height of the ids of taxels, pixels.
const ID_SIZE: u32 = 13;
/// Relative luminance below which white is read better than ink.
const DARK: f64 = 0.2;

/// Half the width and the height of an id, pixels.
pub(super) fn half_of_id(id: &str) -> [f64; 2] {
    [ink::width(id, ID_SIZE).unwrap_or_default(), ID_SIZE].map(|side| f64::from(side) / 2.0)
}

/// An id of a taxel in a picture: the pixel that it is about, right and down, the colour that it stands on, and whether that is behind
/// others at the same place.
pub(super) struct PlacedId<'a> {
    pub(super) id: &'a str,
    pub(super) at: [f64; 2],
    pub(super) on: [u8; 3],
    pub(super) is_behind: bool,
}

/// Puts ids that are about one pixel one below the other, on the colour that is seen there.
fn stack(ids: &mut [PlacedId<'_>]) {
    let mut at_pixel: BTreeMap<[i64; 2], Vec<usize>> = BTreeMap::new();
    for (index, placed) in ids.iter().enumerate() {
        at_pixel.entry(placed.at.map(|pixel| pixel.round() as i64)).or_default().push(index);
    }
    for mut stack in at_pixel.into_values().filter(|stack| stack.len() > 1) {
        stack.sort_by_key(|&index| ids[index].is_behind);
        let (on, middle) = (ids[stack[0]].on, (stack.len() - 1) as f64 / 2.0);
        for (line, index) in stack.into_iter().enumerate() {
            ids[index].on = on;
            ids[index].at[1] += (line as f64 - middle) * f64::from(ID_SIZE);
        }
    }
}

/// Writes `ids` on a picture of `size`, light on dark colours.
pub(super) fn write_ids(pixels: &mut [u8], [width, height]: [u32; 2], mut ids: Vec<PlacedId<'_>>) -> Result<()> {
    ink::font()?;
    stack(&mut ids);
    let area = BitMapBackend::with_buffer(pixels, (width, height)).into_drawing_area();
    for PlacedId { id, at, on, .. } in ids {
        let [r, g, b] = linear(on);
        let ink = if 0.2126 * r + 0.7152 * g + 0.0722 * b < DARK { WHITE } else { INK };
        let style = (FAMILY, ID_SIZE).into_font().color(&ink).pos(Pos::new(HPos::Center, VPos::Center));
        let [x, y] = at.map(|pixel| pixel.round() as i32);
        area.draw_text(id, &style, (x, y)).map_err(cannot)?;
    }
    area.present().map_err(cannot)
}

/// A number with three digits, or all of a larger one.
pub(super) fn short(number: f64) -> String {
    let digits = (2.0 - libm::floor(libm::log10(number.abs().max(1e-9)))).clamp(0.0, 9.0) as usize;
    let text = format!("{number:.digits$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

/// The largest length of 1, 2 or 5 times a power of ten up to `max_m`, m, and its text.
fn round_length(max_m: f64) -> (f64, String) {
    let power = libm::pow(10.0, libm::floor(libm::log10(max_m.max(1e-9))));
    let metres = [5.0, 2.0, 1.0].map(|digit| digit * power).into_iter().find(|&m| m <= max_m).unwrap_or(power);
    let name = match metres {
        m if m >= 1.0 => format!("{m:.0} m"),
        m if m >= 0.01 => format!("{:.0} cm", m * 1e2),
        m if m >= 0.001 => format!("{:.0} mm", m * 1e3),
        m if m >= 1e-6 => format!("{} mm", (m * 1e6).round() / 1e3),
        m => format!("{:.0e} m", m),
    };
    (metres, name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bar_has_a_round_length() {
        let names = [0.0234, 0.07, 12.0, 0.0051, 0.19, 0.00023].map(|most| round_length(most).1);
        assert_eq!(names, ["2 cm", "5 cm", "10 m", "5 mm", "10 cm", "0.2 mm"]);
    }

    #[test]
    fn a_legend_breaks_its_rows_before_the_bar() {
        let mut labels = Labels::new("x", 800);
        let key = vec![(None, "a field of some name".to_owned()); 9];
        let below = labels.key(key.clone(), [800, 800]);
        let rows = labels.rows();
        assert!(rows.iter().all(|&(x, _)| x < 800 - BAR));
        assert_eq!((rows.last().unwrap().1, below), (4, 5 * ROW + 12));
        // No room: they are counted.
        assert_eq!(labels.key(key, [800, 400]), ROW + 12);
        assert_eq!(labels.key[0].1, "9 fields");
        // A name that takes the bar's place has the bar below it.
        let mut narrow = Labels::new("x", 400);
        assert_eq!(narrow.key(vec![(None, "a field of a rather long name".to_owned())], [400, 400]), 2 * ROW + 12);
    }

    #[test]
    fn a_title_leaves_room_for_a_bar_of_colours() {
        let legend = || Legend { colours: [[0; 3]; COLOURS], ends: [0.0, 1.4], unit: "N".into(), note: String::new() };
        for width in [240, 300, 500, 1200] {
            let mut labels = Labels::new("hand/midhand/index", width);
            let alone = labels.title_size();
            labels.colours(legend());
            let (size, from) = (labels.title_size(), labels.legend_from(&legend()));
            let ends_at = labels.scaled(SIDE) + ink::width("hand/midhand/index", size).unwrap();
            assert!(ends_at + labels.scaled(SHORTEST_BAR) <= from, "{width}: {ends_at} and {from}");
            // Only where it would not fit, a title is smaller for it.
            assert_eq!(size < alone, width < 500, "{width}");
        }
    }

    #[test]
    fn ids_of_taxels_at_one_point_are_below_each_other_on_the_colour_that_is_seen() {
        let id = |id, x: f64, on: u8, is_behind| PlacedId { id, at: [x, 20.0], on: [on; 3], is_behind };
        let mut ids = [id("13", 10.0, 0xD6, true), id("14", 40.0, 0xD6, true), id("200", 10.2, 0x20, false)];
        stack(&mut ids);
        let found = ids.map(|placed| (placed.at[1], placed.on[0]));
        let half = f64::from(ID_SIZE) / 2.0;
        assert_eq!(found, [(20.0 + half, 0x20), (20.0, 0xD6), (20.0 - half, 0x20)]);
    }

    #[test]
    fn words_grow_with_the_picture_and_a_title_fits() {
        let [small, large] = [500, 3000].map(|width| Labels::new("hand/midhand/index · 5 taxels, plane chart", width));
        assert_eq!((small.scaled(SIZE), large.scaled(SIZE)), (SIZE, 3 * SIZE));
        assert_eq!((small.above(), large.above()), (TITLE, 3 * TITLE));
        assert_eq!(large.title_size(), 3 * TITLE_SIZE);
        let long = Labels::new("hand/midhand/index · 5 taxels, plane chart, distortion 3.2 %", 400);
        assert!((MIN_TITLE_SIZE..TITLE_SIZE).contains(&long.title_size()));
        assert!(ink::width(&long.title, long.title_size()).unwrap() <= 400 - 2 * SIDE);
    }
}
