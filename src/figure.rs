//! Figures of panels with axes and a legend, as SVG and PNG.

use std::borrow::Cow;
use std::ops::Range;

use plotters::coord::Shift;
use plotters::coord::ranged1d::{KeyPointHint, NoDefaultFormatting, Ranged, ValueFormatter};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use crate::error::Result;
use crate::ink::{self, FAMILY, cannot};
use crate::plain;

/// Dots drawn for each pixel of a size below: plotters has whole dots only, and small figures would show it.
const SCALE: u32 = 2;

/// Red, green, blue.
pub type Colour = [u8; 3];
/// x, y.
pub type Point = (f64, f64);

/// A shape in a panel's coordinates; what is called a width, radius or size is in pixels.
#[derive(Clone, Debug)]
#[expect(missing_docs, reason = "a shape's parts are named by what they are")]
pub enum Mark {
    /// Lines, each through some points.
    Lines { runs: Vec<Vec<Point>>, width: f64 },
    /// A dashed line.
    Dashed { from: Point, to: Point },
    /// A dot at every point.
    Dots { points: Vec<Point>, radius: f64 },
    /// A filled circle whose radius is in the panel's unit.
    Disc { centre: Point, radius: f64 },
    /// The sign `+`.
    Plus { at: Point, size: f64 },
    /// The sign `*`.
    Asterisk { at: Point, size: f64 },
}

/// A mark with a colour.
#[derive(Clone, Debug)]
pub struct Layer {
    /// The shape.
    pub mark: Mark,
    /// Its colour.
    pub colour: Colour,
    /// Its name in the legend, if it is listed there.
    pub name: Option<Cow<'static, str>>,
}

/// An axis with ticks at chosen places.
#[derive(Clone, Debug)]
pub struct Axis {
    /// Its name, with the unit.
    pub label: &'static str,
    /// The values at its ends.
    pub range: [f64; 2],
    /// The values that are marked.
    pub ticks: Vec<f64>,
}

/// A plot with a title and two axes.
#[derive(Clone, Debug)]
pub struct Panel {
    /// The title, above it.
    pub title: String,
    /// The horizontal axis.
    pub x: Axis,
    /// The vertical axis.
    pub y: Axis,
    /// What is drawn, the first at the bottom.
    pub layers: Vec<Layer>,
}

/// How a figure's panels are arranged, and the size of each panel's plot, pixels.
#[derive(Clone, Copy, Debug)]
#[expect(missing_docs, reason = "sizes are named by what they are")]
pub enum Arrangement {
    /// One below the other.
    Stacked { width: u32, height: u32 },
    /// One beside the other.
    SideBySide { side: u32 },
}

/// Panels with a title and a legend.
#[derive(Clone, Debug)]
pub struct Figure {
    /// The title, above all panels.
    pub title: &'static str,
    /// The panels.
    pub panels: Vec<Panel>,
    /// What the legend has before the panels' named layers.
    pub key: Vec<Layer>,
    /// How the panels are arranged.
    pub arrangement: Arrangement,
}

const TITLE: u32 = 30;
const LEGEND: u32 = 26;
/// Around what a panel plots into.
const LEFT: u32 = 62;
const RIGHT: u32 = 12;
const TOP: u32 = 24;
const BOTTOM: u32 = 44;
/// Of a dashed line.
const DASH: f64 = 2.0;
const GAP: f64 = 12.0;
/// Width of a legend's sample.
const SAMPLE: f64 = 24.0;

impl Ranged for Axis {
    type FormatOption = NoDefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, limit: (i32, i32)) -> i32 {
        let share = (value - self.range[0]) / (self.range[1] - self.range[0]);
        limit.0 + (share * f64::from(limit.1 - limit.0)).round() as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, hint: Hint) -> Vec<f64> {
        if hint.weight().allow_light_points() { Vec::new() } else { self.ticks.clone() }
    }

    fn range(&self) -> Range<f64> {
        self.range[0]..self.range[1]
    }
}

impl ValueFormatter<f64> for Axis {
    fn format_ext(&self, value: &f64) -> String {
        tick(*value)
    }
}

impl Figure {
    /// Width and height, pixels.
    fn size(&self) -> (u32, u32) {
        let count = self.panels.len() as u32;
        let (width, height) = match self.arrangement {
            Arrangement::Stacked { width, height } => (LEFT + width + RIGHT, count * (TOP + height + BOTTOM)),
            Arrangement::SideBySide { side } => (count * (LEFT + side + RIGHT), TOP + side + BOTTOM),
        };
        (width, height + TITLE + LEGEND)
    }

    /// As SVG, text being text.
    ///
    /// # Errors
    /// It cannot be drawn.
    pub fn svg(&self) -> Result<String> {
        let mut text = String::new();
        let (width, height) = self.size();
        self.draw(&SVGBackend::with_string(&mut text, (SCALE * width, SCALE * height)).into_drawing_area())?;
        Ok(plain::xml(&text).into_owned())
    }

    /// As PNG.
    ///
    /// # Errors
    /// It cannot be drawn.
    pub fn png(&self) -> Result<Vec<u8>> {
        let (width, height) = self.size();
        let (width, height) = (SCALE * width, SCALE * height);
        let mut pixels = vec![0; (3 * width * height) as usize];
        self.draw(&BitMapBackend::with_buffer(&mut pixels, (width, height)).into_drawing_area())?;
        ink::png(&pixels, [width, height])
    }

    fn draw<B: DrawingBackend>(&self, area: &DrawingArea<B, Shift>) -> Result<()> {
        ink::font()?;
        area.fill(&WHITE).map_err(cannot)?;
        let (width, height) = self.size();
        let title = text(16, HPos::Center);
        area.draw_text(self.title, &title, (dots(f64::from(width) / 2.0), dots(f64::from(TITLE) / 2.0)))
            .map_err(cannot)?;
        let (_, rest) = area.split_vertically((TITLE * SCALE) as i32);
        let (panels, legend) = rest.split_vertically(((height - TITLE - LEGEND) * SCALE) as i32);
        let shape = match self.arrangement {
            Arrangement::Stacked { .. } => (self.panels.len(), 1),
            Arrangement::SideBySide { .. } => (1, self.panels.len()),
        };
        for (panel, area) in self.panels.iter().zip(panels.split_evenly(shape)) {
            panel.draw(&area)?;
        }
        self.draw_legend(&legend)
    }

    /// Names what is drawn, each once, in a row.
    fn draw_legend<B: DrawingBackend>(&self, area: &DrawingArea<B, Shift>) -> Result<()> {
        let mut named: Vec<(&str, &Layer)> = Vec::new();
        for layer in self.key.iter().chain(self.panels.iter().flat_map(|panel| &panel.layers)) {
            if let Some(name) = layer.name.as_deref().filter(|name| named.iter().all(|(known, _)| known != name)) {
                named.push((name, layer));
            }
        }
        let style = text(13, HPos::Left);
        let mut x = LEFT.into();
        for (name, layer) in named {
            let ends = [(x, 0.0), (x + SAMPLE, 0.0)];
            let at = (x + SAMPLE / 2.0, 0.0);
            let sample = match &layer.mark {
                Mark::Lines { width, .. } => Mark::Lines { runs: vec![ends.to_vec()], width: *width },
                Mark::Dashed { .. } => Mark::Dashed { from: ends[0], to: ends[1] },
                Mark::Dots { radius, .. } => Mark::Dots { points: vec![at], radius: *radius },
                Mark::Disc { .. } => Mark::Disc { centre: at, radius: 6.0 },
                Mark::Plus { size, .. } => Mark::Plus { at, size: *size },
                Mark::Asterisk { size, .. } => Mark::Asterisk { at, size: *size },
            };
            let (left, top) = area.get_base_pixel();
            let middle = dots(f64::from(LEGEND) / 2.0);
            let place = |point: Point| (left + dots(point.0), top + middle + dots(point.1));
            draw_mark(&sample, layer.colour, &area.use_screen_coord(), &place, f64::from(SCALE))?;
            x += SAMPLE + 6.0;
            area.draw_text(name, &style, (dots(x), middle)).map_err(cannot)?;
            let (width, _) = area.estimate_text_size(name, &style).map_err(cannot)?;
            x += f64::from(width) / f64::from(SCALE) + 22.0;
        }
        Ok(())
    }
}

impl Panel {
    fn draw<B: DrawingBackend>(&self, area: &DrawingArea<B, Shift>) -> Result<()> {
        let (width, _) = area.dim_in_pixel();
        let middle = (width as i32 + dots(f64::from(LEFT)) - dots(f64::from(RIGHT))) / 2;
        let title = text(13, HPos::Center);
        area.draw_text(&self.title, &title, (middle, dots(f64::from(TOP) / 2.0))).map_err(cannot)?;
        let upwards = text(13, HPos::Center).transform(FontTransform::Rotate270);
        let height = (area.dim_in_pixel().1 as i32 + dots(f64::from(TOP)) - dots(f64::from(BOTTOM))) / 2;
        area.draw_text(self.y.label, &upwards, (dots(11.0), height)).map_err(cannot)?;
        let mut chart = ChartBuilder::on(area)
            .margin_top(TOP * SCALE)
            .margin_right(RIGHT * SCALE)
            .set_label_area_size(LabelAreaPosition::Left, LEFT * SCALE)
            .set_label_area_size(LabelAreaPosition::Bottom, BOTTOM * SCALE)
            .build_cartesian_2d(self.x.clone(), self.y.clone())
            .map_err(cannot)?;
        chart
            .configure_mesh()
            .disable_mesh()
            .axis_style(stroke([0; 3], 1.0))
            .set_all_tick_mark_size(5 * SCALE)
            .x_desc(self.x.label)
            .label_style((FAMILY, 12 * SCALE))
            .axis_desc_style((FAMILY, 13 * SCALE))
            .draw()
            .map_err(cannot)?;
        let plotted = chart.plotting_area();
        let place = |point: Point| plotted.map_coordinate(&point);
        let unit = f64::from(plotted.dim_in_pixel().0) / (self.x.range[1] - self.x.range[0]);
        for layer in &self.layers {
            draw_mark(&layer.mark, layer.colour, &area.use_screen_coord(), &place, unit)?;
        }
        Ok(())
    }
}

/// Draws `mark` with `place` taking its points, and `unit` its lengths, to dots of the whole picture.
fn draw_mark<B: DrawingBackend>(
    mark: &Mark,
    colour: Colour,
    area: &DrawingArea<B, Shift>,
    place: &dyn Fn(Point) -> (i32, i32),
    unit: f64,
) -> Result<()> {
    let fill = stroke(colour, 1.0).filled();
    let star = |at: Point, size: f64, strokes: u32| {
        let (x, y) = place(at);
        (0..strokes).try_for_each(|number| {
            let angle = std::f64::consts::PI * (f64::from(number) / f64::from(strokes) + 0.5);
            let (right, down) = (dots(size * libm::cos(angle)), dots(size * libm::sin(angle)));
            area.draw(&PathElement::new([(x - right, y - down), (x + right, y + down)], stroke(colour, 1.8)))
        })
    };
    let drawn = match mark {
        Mark::Lines { runs, width } => runs.iter().filter(|run| run.len() > 1).try_for_each(|run| {
            let run: Vec<(i32, i32)> = run.iter().map(|&point| place(point)).collect();
            area.draw(&PathElement::new(run, stroke(colour, *width)))
        }),
        Mark::Dashed { from, to } => {
            let ((x0, y0), (x1, y1)) = (place(*from), place(*to));
            let length = libm::hypot(f64::from(x1 - x0), f64::from(y1 - y0));
            let at = |along: f64| {
                let share = (along / length).min(1.0);
                let between = |a: i32, b: i32| a + (share * f64::from(b - a)).round() as i32;
                (between(x0, x1), between(y0, y1))
            };
            let [dash, period] = [DASH, DASH + GAP].map(|pixels| pixels * f64::from(SCALE));
            (0..(length / period).ceil() as u32).try_for_each(|number| {
                let from = f64::from(number) * period;
                area.draw(&PathElement::new([at(from), at(from + dash)], stroke(colour, 1.0)))
            })
        }
        Mark::Dots { points, radius } => {
            points.iter().try_for_each(|&point| area.draw(&Circle::new(place(point), dots(*radius), fill)))
        }
        Mark::Disc { centre, radius } => area.draw(&Circle::new(place(*centre), (radius * unit).round() as i32, fill)),
        Mark::Plus { at, size } => star(*at, *size, 2),
        Mark::Asterisk { at, size } => star(*at, *size, 3),
    };
    drawn.map_err(cannot)
}

/// A size in pixels as dots.
fn dots(pixels: f64) -> i32 {
    (pixels * f64::from(SCALE)).round() as i32
}

fn text(pixels: u32, aligned: HPos) -> TextStyle<'static> {
    (FAMILY, pixels * SCALE).into_font().color(&BLACK).pos(Pos::new(aligned, VPos::Center))
}

fn stroke(colour: Colour, width: f64) -> ShapeStyle {
    let [r, g, b] = colour;
    RGBColor(r, g, b).stroke_width(dots(width).max(1) as u32)
}

/// `value` with no more decimals than it needs.
fn tick(value: f64) -> String {
    let text = format!("{value:.3}");
    text.trim_end_matches('0').trim_end_matches('.').replace('-', "−")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_short() {
        assert_eq!([0.0, -45.0, 0.05, 1000.0, -12.5].map(tick), ["0", "−45", "0.05", "1000", "−12.5"]);
    }
}
