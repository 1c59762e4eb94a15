//! Plots time against error, with a dot per combination and the Pareto front.

use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::{CallMode, Errors, Measurement, Report};
use crate::error::Result;
use crate::ink::{self, FAMILY, cannot};
use crate::plain;

/// Width and height of a panel, dots.
const PANEL: (u32, u32) = (760, 560);
const TITLE: u32 = 64;
const LEGEND: u32 = 56;
/// Smallest error drawn, mm and degrees.
const MIN_ERROR: f64 = 1e-9;
const GREY: RGBColor = RGBColor(190, 190, 190);
const COLOURS: [(&str, RGBColor); 5] = [
    ("cpu, one-pass", RGBColor(31, 119, 180)),
    ("cpu, compensated", RGBColor(44, 140, 60)),
    ("double", RGBColor(20, 20, 20)),
    ("gpu, one-pass", RGBColor(214, 96, 20)),
    ("gpu, compensated", RGBColor(150, 60, 170)),
];

/// A report as SVG, text being text.
///
/// # Errors
/// It cannot be drawn.
pub fn plot_svg(report: &Report) -> Result<String> {
    let mut text = String::new();
    draw(report, &SVGBackend::with_string(&mut text, size(report)).into_drawing_area())?;
    Ok(plain::xml(&text).into_owned())
}

/// A report as PNG.
///
/// # Errors
/// It cannot be drawn.
pub fn plot_png(report: &Report) -> Result<Vec<u8>> {
    let (width, height) = size(report);
    let mut pixels = vec![0; (3 * width * height) as usize];
    draw(report, &BitMapBackend::with_buffer(&mut pixels, (width, height)).into_drawing_area())?;
    ink::png(&pixels, [width, height])
}

struct Panel<'a> {
    way: CallMode,
    what: &'static str,
    unit: &'static str,
    /// Whether errors are against the truth.
    truth: bool,
    points: Vec<(&'a Measurement, &'a Errors)>,
}

fn panels(report: &Report) -> Vec<Panel<'_>> {
    let mut panels = Vec::new();
    for way in CallMode::ALL {
        for (index, what, unit) in [(0, "place", "mm"), (1, "angle", "degrees")] {
            // What rounding changes cannot be seen beside what a rung is off by.
            let rows = if report.truth { report.rungs(way) } else { report.measurements(way) };
            let points = rows.into_iter().map(|row| (row, row.judged()[index]));
            let points: Vec<_> = points.filter(|(_, errors)| errors.compared > 0).collect();
            if !points.is_empty() {
                let truth = points.iter().any(|(row, _)| row.truth.is_some());
                panels.push(Panel { way, what, unit, truth, points });
            }
        }
    }
    panels
}

/// Panels side by side, and above each other.
fn shape(panels: &[Panel<'_>]) -> (usize, usize) {
    let wide = if panels.iter().any(|panel| panel.what == "angle") { 2 } else { 1 };
    (panels.len().div_ceil(wide).max(1), wide)
}

fn size(report: &Report) -> (u32, u32) {
    let (tall, wide) = shape(&panels(report));
    (PANEL.0 * wide as u32, TITLE + LEGEND + PANEL.1 * tall as u32)
}

fn draw<B: DrawingBackend>(report: &Report, area: &DrawingArea<B, Shift>) -> Result<()> {
    ink::font()?;
    area.fill(&WHITE).map_err(cannot)?;
    let (width, height) = size(report);
    let title = format!("{}, {} frames of {}", report.body, report.frames, report.source);
    let middle = (width as i32 / 2, TITLE as i32 / 2);
    area.draw_text(&title, &text(28, HPos::Center), middle).map_err(cannot)?;
    let (_, rest) = area.split_vertically(TITLE as i32);
    let (body, legend) = rest.split_vertically((height - TITLE - LEGEND) as i32);
    let panels = panels(report);
    for (panel, area) in panels.iter().zip(body.split_evenly(shape(&panels))) {
        panel.draw(&area)?;
    }
    draw_legend(report, &legend)
}

/// Draws the legend of the used colours.
fn draw_legend<B: DrawingBackend>(report: &Report, area: &DrawingArea<B, Shift>) -> Result<()> {
    let style = text(22, HPos::Left);
    let (mut x, y) = (80, LEGEND as i32 / 2);
    let there = COLOURS.iter().filter(|(name, _)| report.rows.iter().any(|row| colour(row).0 == *name));
    for (name, colour) in there.copied().chain([("beaten", GREY)]) {
        area.draw(&Circle::new((x, y), 8, colour.filled())).map_err(cannot)?;
        x += 18;
        area.draw_text(name, &style, (x, y)).map_err(cannot)?;
        x += area.estimate_text_size(name, &style).map_err(cannot)?.0 as i32 + 36;
    }
    Ok(())
}

fn colour(row: &Measurement) -> (&'static str, RGBColor) {
    let index = match (row.words.backend.as_str(), row.words.arithmetic.as_str()) {
        ("reference", _) => 2,
        ("gpu", "compensated") => 4,
        ("gpu", _) => 3,
        (_, "compensated") => 1,
        _ => 0,
    };
    COLOURS[index]
}

/// The powers of ten around `values`.
fn decades(values: impl Iterator<Item = f64>) -> std::ops::Range<f64> {
    let (low, high) = values.fold((f64::INFINITY, 0.0_f64), |(low, high), value| (low.min(value), high.max(value)));
    let (low, high) = (low.log10().floor(), high.log10().ceil());
    10_f64.powf(low)..10_f64.powf(if high > low { high } else { low + 1.0 })
}

impl Panel<'_> {
    fn draw<B: DrawingBackend>(&self, area: &DrawingArea<B, Shift>) -> Result<()> {
        let from = if self.truth { "from the truth" } else { "from the reference" };
        let place = |(row, errors): &(&Measurement, &Errors)| (row.p50_us, errors.p95.max(MIN_ERROR));
        let places: Vec<(f64, f64)> = self.points.iter().map(place).collect();
        let x = decades(places.iter().map(|point| point.0));
        let y = decades(places.iter().map(|point| point.1));
        let title = format!("{}: {} {from}", self.way.word(), self.what);
        let (width, _) = area.dim_in_pixel();
        area.draw_text(&title, &text(24, HPos::Center), (width as i32 / 2, 26)).map_err(cannot)?;
        let mut chart = ChartBuilder::on(area)
            .margin_top(48)
            .margin_right(36)
            .margin_left(20)
            .set_label_area_size(LabelAreaPosition::Left, 120)
            .set_label_area_size(LabelAreaPosition::Bottom, 72)
            .build_cartesian_2d(x.clone().log_scale(), y.log_scale())
            .map_err(cannot)?;
        chart
            .configure_mesh()
            .light_line_style(TRANSPARENT)
            .bold_line_style(RGBColor(232, 232, 232))
            .label_style((FAMILY, 20))
            .axis_desc_style((FAMILY, 22))
            .x_label_formatter(&|value| power(*value))
            .y_label_formatter(&|value| if *value <= MIN_ERROR { "0".to_owned() } else { power(*value) })
            .x_desc("a frame, median, microseconds")
            .y_desc(format!("95 % are off by no more, {}", self.unit))
            .draw()
            .map_err(cannot)?;
        let beaten =
            |at: &(f64, f64)| places.iter().any(|by| by.0 <= at.0 && by.1 <= at.1 && (by.0 < at.0 || by.1 < at.1));
        let mut front: Vec<(f64, f64)> = places.iter().filter(|at| !beaten(at)).copied().collect();
        front.sort_by(|a, b| a.0.total_cmp(&b.0));
        // Steps: points above and right of them are dominated.
        let corners = front.windows(2).flat_map(|pair| [pair[0], (pair[1].0, pair[0].1)]).chain(front.last().copied());
        chart.draw_series(LineSeries::new(corners, RGBColor(110, 110, 110).stroke_width(2))).map_err(cannot)?;
        let dots = |are_beaten: bool| {
            let points = self.points.iter().zip(&places).filter(move |(_, at)| beaten(at) == are_beaten);
            points.map(move |((row, _), at)| {
                let (size, colour) = if are_beaten { (5, GREY) } else { (9, colour(row).1) };
                Circle::new(*at, size, colour.filled())
            })
        };
        chart.draw_series(dots(true)).map_err(cannot)?;
        chart.draw_series(dots(false)).map_err(cannot)?;
        if self.truth {
            // Names beside their dots, by turns over and under them: left of those on the right, and under the last.
            let (middle, last) = ((x.start * x.end).sqrt(), places.len() - 1);
            let names = self.points.iter().zip(&places).enumerate().map(|(index, ((row, _), at))| {
                let (aligned, beside) = match index {
                    _ if index == last => (HPos::Center, 0),
                    _ if at.0 > middle => (HPos::Right, -12),
                    _ => (HPos::Left, 12),
                };
                let over = if index % 2 == 0 && index != last { -14 } else { 18 };
                EmptyElement::at(*at) + Text::new(row.words.orientation_by.clone(), (beside, over), text(20, aligned))
            });
            chart.draw_series(names).map_err(cannot)?;
        }
        Ok(())
    }
}

fn text(size: u32, aligned: HPos) -> TextStyle<'static> {
    (FAMILY, size).into_font().color(&BLACK).pos(Pos::new(aligned, VPos::Center))
}

/// A power of ten as people write it.
fn power(value: f64) -> String {
    if (0.0099..9999.0).contains(&value) { format!("{value}") } else { format!("{value:.0e}") }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{report, row};
    use super::*;

    #[test]
    fn a_plot_has_a_dot_for_every_combination_and_greys_what_is_beaten() {
        let report =
            report(vec![row("cpu", 1.0, 3.0, 3.0), row("cpu", 2.0, 4.0, 2.0), row("reference", 9.0, 0.0, 0.0)]);
        let svg = plot_svg(&report).unwrap();
        // In each of two panels; the legend has three.
        assert_eq!(svg.matches("<circle").count(), 2 * 3 + 3);
        // By the centroid one is beaten; by the orientation none.
        assert_eq!(svg.matches("fill=\"#BEBEBE\"").count(), 1 + 1);
        assert!(svg.contains("place from the reference") && svg.contains("10 frames of touch"));
        let png = plot_png(&report).unwrap();
        assert_eq!(&png[1..4], b"PNG");
    }

    #[test]
    fn decades_hold_their_values() {
        assert_eq!(decades([2.0, 30.0].into_iter()), 1.0..100.0);
        assert_eq!(decades([1.0].into_iter()), 1.0..10.0);
        assert_eq!([0.01, 1.0, 1e-4].map(power), ["0.01", "1", "1e-4"]);
    }
}
