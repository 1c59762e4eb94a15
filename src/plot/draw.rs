//! Draws what was gathered, as SVG and PNG.

use std::collections::BTreeMap;

use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::HPos;

use super::gather::{Gathered, Panel, colours_of};
use super::line;
use super::map::{MappedTaxel, PressureMap};
use super::page::{Area, LEFT, LEGEND, Page, TITLE};
use super::pen::{INK, Pen, SCALE, scaled};
use super::series::Series;
use super::ticks::{Numbers, shown, ticks};
use super::units::{for_people, numbers, p_for_people, period};
use crate::colours::pressure_colours;
use crate::error::{Error, Result};
use crate::ink::{self, cannot};
use crate::plain;

const PAPER: RGBColor = RGBColor(252, 252, 250);
const FAINT: RGBColor = RGBColor(226, 226, 224);
const GREY: RGBColor = RGBColor(120, 120, 120);
/// Of taxels that felt nothing.
const BARE: RGBColor = RGBColor(222, 222, 220);
/// Of lines: Okabe and Ito's, which people who see colours differently tell apart.
const LINES: [RGBColor; 7] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
    RGBColor(90, 90, 90),
];
/// Of the line of a field that holds all others: under theirs, and seen beside them.
const WHOLE: RGBColor = RGBColor(176, 184, 192);
const WHOLE_WIDTH: f64 = 4.0;
/// Width of an axis's numbers, pixels: beside them is the axis's name.
const NUMBERS: i32 = LEFT - 27;
/// Quantities that a map shows.
const PEAK: usize = 0;
const INTEGRAL: usize = 1;

/// A plot of `all` recordings, side by side, as SVG with text as text.
///
/// # Errors
/// There is nothing to draw, or it cannot be drawn.
pub fn svg(all: &[Gathered]) -> Result<String> {
    let plot = Plot::for_fields(all)?;
    let mut text = String::new();
    plot.draw(&SVGBackend::with_string(&mut text, plot.dots()).into_drawing_area(), true)?;
    Ok(plain::xml(&text).replace("<polyline ", "<polyline stroke-linejoin=\"round\" stroke-linecap=\"round\" "))
}

/// The same as PNG.
///
/// # Errors
/// As [`svg`].
pub fn png(all: &[Gathered]) -> Result<Vec<u8>> {
    let plot = Plot::for_fields(all)?;
    let (width, height) = plot.dots();
    let mut pixels = vec![0; (3 * width * height) as usize];
    plot.draw(&BitMapBackend::with_buffer(&mut pixels, (width, height)).into_drawing_area(), false)?;
    ink::png(&pixels, [width, height])
}

struct Plot<'a> {
    all: &'a [Gathered],
    page: Page,
    /// By name of a field.
    colours: BTreeMap<String, usize>,
    /// Most of what maps show: the highest pressure, the highest integral.
    most: [f64; 2],
    /// Pixels of a metre, in all maps.
    per_m: f64,
    pressure_colours: Vec<RGBColor>,
}

impl<'a> Plot<'a> {
    fn for_fields(all: &'a [Gathered]) -> Result<Self> {
        if all.iter().all(|gathered| gathered.frames == 0 || gathered.panels.is_empty()) {
            return Err(Error::failed("there are no frames to plot"));
        }
        let most = |of: fn(&MappedTaxel) -> f64| {
            let taxels = all.iter().flat_map(|gathered| &gathered.maps).flat_map(|map| &map.taxels);
            taxels.map(of).fold(0.0, f64::max)
        };
        let page = Page::for_fields(all);
        let per_m = all.iter().enumerate().flat_map(|(column, gathered)| {
            let area = page.map(column, 0, 0, gathered.maps.len());
            gathered.maps.iter().map(move |map| {
                let [low, high] = map.extent();
                let (width_m, height_m) = ((high.0 - low.0).max(1e-6), (high.1 - low.1).max(1e-6));
                (f64::from(area.width) / width_m).min(f64::from(area.height) / height_m)
            })
        });
        let per_m = per_m.fold(f64::INFINITY, f64::min);
        Ok(Self {
            all,
            per_m: if per_m.is_finite() { per_m } else { 1.0 },
            page,
            colours: colours_of(all),
            most: [most(|taxel| taxel.peak), most(|taxel| taxel.integral)],
            pressure_colours: pressure_colours().iter().map(|&[r, g, b]| RGBColor(r, g, b)).collect(),
        })
    }

    fn dots(&self) -> (u32, u32) {
        let [width, height] = self.page.size();
        ((SCALE * width) as u32, (SCALE * height) as u32)
    }

    fn draw<B: DrawingBackend>(&self, area: &DrawingArea<B, Shift>, joins: bool) -> Result<()> {
        ink::font()?;
        area.fill(&PAPER).map_err(cannot)?;
        let pen = Pen { area, joins };
        self.draw_legend(&pen)?;
        let ranges = self.ranges();
        for (column, gathered) in self.all.iter().enumerate() {
            let title = self.page.title(column);
            pen.fitted(&gathered.name, 15, INK, (title.left, title.top + TITLE / 2), title.width)?;
            for (index, panel) in gathered.panels.iter().enumerate() {
                let is_last = index + 1 == gathered.panels.len();
                let range = ranges.get(panel.column.name).copied();
                self.draw_panel(&pen, gathered, panel, self.page.panel(column, index), range, is_last)?;
            }
            self.draw_maps(&pen, column, gathered)?;
        }
        Ok(())
    }

    /// By output, the range of all recordings, so that they can be compared.
    fn ranges(&self) -> BTreeMap<&'static str, [f64; 2]> {
        let mut ranges: BTreeMap<&'static str, (Numbers, [f64; 2])> = BTreeMap::new();
        let panels = self.all.iter().flat_map(|gathered| gathered.panels.iter().map(move |panel| (gathered, panel)));
        for (gathered, panel) in panels {
            let factor = for_people(panel.column, &gathered.p_unit).0;
            for [low, high] in panel.lines.iter().flatten().filter_map(Series::range) {
                let [low, high] = [low * factor, high * factor];
                let (_, known) = ranges.entry(panel.column.name).or_insert((numbers(panel.column), [low, high]));
                *known = [known[0].min(low), known[1].max(high)];
            }
        }
        ranges.into_iter().map(|(name, (numbers, range))| (name, numbers.rounded(range))).collect()
    }

    fn colour(&self, line: &str) -> RGBColor {
        LINES[self.colours.get(line).copied().unwrap_or(0) % LINES.len()]
    }

    fn draw_legend<B: DrawingBackend>(&self, pen: &Pen<'_, B>) -> Result<()> {
        let legend = self.page.legend();
        let (mut x, y) = (legend.left, legend.top + LEGEND / 2);
        let mut lines: Vec<(&String, usize)> = self.colours.iter().map(|(name, &colour)| (name, colour)).collect();
        lines.sort_by_key(|(_, colour)| *colour);
        for (line, _) in lines {
            let width = pen.width(line, 12)?;
            if x + 26 + width > legend.right() {
                return pen.text("…", 12, GREY, HPos::Left, (x, y));
            }
            let is_whole = self.all.iter().any(|gathered| gathered.first_is_whole && gathered.lines[0] == *line);
            let (colour, stroke) = if is_whole { (WHOLE, WHOLE_WIDTH) } else { (self.colour(line), 2.4) };
            pen.line(&[(x, y), (x + 20, y)], colour, stroke)?;
            pen.text(line, 12, INK, HPos::Left, (x + 26, y))?;
            x += 26 + width + 22;
        }
        Ok(())
    }

    /// `range` is that of the quantity in all recordings, if any has a value of it.
    fn draw_panel<B: DrawingBackend>(
        &self,
        pen: &Pen<'_, B>,
        gathered: &Gathered,
        panel: &Panel,
        area: Area,
        range: Option<[f64; 2]>,
        is_last: bool,
    ) -> Result<()> {
        let (factor, unit) = for_people(panel.column, &gathered.p_unit);
        let [first_s, last_s] = gathered.span_s;
        // A time since 1970 would fill the axis with digits.
        let start_s = if first_s.abs() > 10.0 * (last_s - first_s) + 1.0 { first_s } else { 0.0 };
        let span = [first_s - start_s, (last_s - start_s).max(first_s - start_s + 1e-3)];
        let x = |t: f64| f64::from(area.left) + (t - span[0]) / (span[1] - span[0]) * f64::from(area.width);
        if let Some(range) = range {
            draw_levels(pen, area, range, numbers(panel.column))?;
        }
        draw_times(pen, area, span, is_last)?;
        if is_last {
            let since = if start_s == 0.0 { "time [s]".to_owned() } else { format!("time since t = {start_s} s [s]") };
            pen.text(&since, 12, INK, HPos::Center, (area.left + area.width / 2, area.bottom() + 30))?;
        }
        let name = panel.column.name.replace('_', " ");
        let label = if unit.is_empty() { name } else { format!("{name} [{unit}]") };
        let middle = area.top + area.height / 2;
        pen.upwards(&label, 12, INK, (area.left - LEFT + 12, middle))?;
        if let Some(why) = panel.why_empty {
            pen.text(why, 12, GREY, HPos::Center, (area.left + area.width / 2, middle))?;
        }
        let range = range.unwrap_or([0.0, 1.0]);
        let y = |value: f64| level_of(value * factor, area, range);
        for (index, (line, components)) in gathered.lines.iter().zip(&panel.lines).enumerate() {
            let is_whole = index == 0 && gathered.first_is_whole;
            let (own, width) = if is_whole { (WHOLE, WHOLE_WIDTH) } else { (self.colour(line), 1.5) };
            for (component, series) in components.iter().enumerate() {
                let colour = paler(own, component);
                let (across, down) = (|t| scaled(x(t - start_s)), |value| scaled(y(value)));
                for run in line::points(series, period(panel.column), across, down) {
                    pen.dots(&run, colour, width)?;
                }
            }
        }
        if panel.column.components > 1 {
            let names = if panel.column.components == 2 { "u, paler v" } else { "x, paler y, palest z" };
            // Above the panel, where no line is.
            pen.text(names, 10, GREY, HPos::Right, (area.right(), area.top - 6))?;
        }
        Ok(())
    }

    fn draw_maps<B: DrawingBackend>(&self, pen: &Pen<'_, B>, column: usize, gathered: &Gathered) -> Result<()> {
        let count = gathered.maps.len();
        for (index, map) in gathered.maps.iter().enumerate() {
            for quantity in [PEAK, INTEGRAL] {
                self.draw_map(pen, map, quantity, self.page.map(column, quantity, index, count))?;
            }
        }
        if count == 0 {
            return Ok(());
        }
        for quantity in [PEAK, INTEGRAL] {
            self.draw_key(pen, quantity, &gathered.p_unit, self.page.maps(column, quantity))?;
        }
        let areas: Vec<Area> = [PEAK, INTEGRAL]
            .into_iter()
            .flat_map(|quantity| (0..count).map(move |index| self.page.map(column, quantity, index, count)))
            .collect();
        // No two maps look like one.
        for pair in areas.windows(2) {
            let between = (pair[0].right() + pair[1].left) / 2;
            pen.line(&[(between, pair[0].top), (between, pair[0].bottom())], FAINT, 1.0)?;
        }
        // Below the keys, where no map reaches.
        let last = self.page.maps(column, INTEGRAL);
        self.draw_length(pen, (last.right(), last.bottom() + 52))
    }

    /// A length, which is the same in all maps.
    fn draw_length<B: DrawingBackend>(&self, pen: &Pen<'_, B>, (right, y): (i32, i32)) -> Result<()> {
        let steps = ticks([0.0, 90.0 / self.per_m], 3);
        let Some(&length_m) = steps.last().filter(|length| **length > 0.0) else { return Ok(()) };
        let left = right - (length_m * self.per_m).round() as i32;
        pen.line(&[(left, y), (right, y)], INK, 1.6)?;
        for x in [left, right] {
            pen.line(&[(x, y - 3), (x, y + 3)], INK, 1.2)?;
        }
        let mm = length_m * 1e3;
        let is_whole_cm = mm >= 10.0 && (mm / 10.0 - (mm / 10.0).round()).abs() < 1e-6;
        let text = if is_whole_cm { format!("{:.0} cm", mm / 10.0) } else { format!("{} mm", shown(mm, mm.min(1.0))) };
        pen.text(&text, 11, GREY, HPos::Right, (left - 6, y))
    }

    fn draw_map<B: DrawingBackend>(
        &self,
        pen: &Pen<'_, B>,
        map: &PressureMap,
        quantity: usize,
        area: Area,
    ) -> Result<()> {
        let [low, high] = map.extent();
        let per_m = self.per_m;
        let middle = (area.left + area.width / 2, area.top + area.height / 2);
        let place = |(u, v): (f64, f64)| {
            let (u, v) = (u - (low.0 + high.0) / 2.0, v - (low.1 + high.1) / 2.0);
            (scaled(f64::from(middle.0) + u * per_m), scaled(f64::from(middle.1) - v * per_m))
        };
        pen.fitted_centred(&map.field, 12, INK, (middle.0, area.top - 12), area.width)?;
        let radius = scaled(map.radius_m * per_m).max(1);
        for taxel in &map.taxels {
            let value = [taxel.peak, taxel.integral][quantity];
            let share = if self.most[quantity] > 0.0 { value / self.most[quantity] } else { 0.0 };
            let colours = &self.pressure_colours;
            let colour = match value > 0.0 {
                true => colours[((share * (colours.len() - 1) as f64).round() as usize).min(colours.len() - 1)],
                false => BARE,
            };
            pen.disc(place(taxel.at), radius, colour)?;
        }
        if quantity != PEAK {
            return Ok(());
        }
        let runs: Vec<Vec<(i32, i32)>> = map.path.iter().map(|run| run.iter().map(|&at| place(at)).collect()).collect();
        for (colour, width) in [(WHITE, 4.2), (BLACK, 1.6)] {
            for run in &runs {
                pen.dots(run, colour, width)?;
            }
        }
        if let (Some(first), Some(last)) =
            (runs.first().and_then(|run| run.first()), runs.last().and_then(|run| run.last()))
        {
            for (at, inner) in [(first, WHITE), (last, BLACK)] {
                pen.disc(*at, scaled(4.6), WHITE)?;
                pen.disc(*at, scaled(3.8), BLACK)?;
                pen.disc(*at, scaled(2.4), inner)?;
            }
        }
        Ok(())
    }

    /// The scale of a map's colours, and above the maps what they show.
    fn draw_key<B: DrawingBackend>(&self, pen: &Pen<'_, B>, quantity: usize, p_unit: &str, area: Area) -> Result<()> {
        let (factor, p_unit) = p_for_people(p_unit);
        let what = ["highest pressure, path of its centre", "pressure–time integral"][quantity];
        let unit = [p_unit.to_owned(), format!("{p_unit}·s")][quantity].clone();
        pen.fitted_centred(what, 13, INK, (area.left + area.width / 2, area.top - 29), area.width)?;
        let beside = 8 + pen.width(&unit, 11)?;
        let width = (area.width - 2 * beside).min(220);
        let left = area.left + (area.width - width) / 2;
        let top = area.bottom() + 12;
        for step in 0..SCALE * width {
            let colour = self.pressure_colours[(step * 255 / (SCALE * width - 1)) as usize];
            let x = SCALE * left + step;
            pen.rectangle([(x, SCALE * top), (x + 1, SCALE * (top + 9))], colour)?;
        }
        let most = self.most[quantity] * factor;
        let range = [0.0, most.max(f64::MIN_POSITIVE)];
        let mut marks = ticks(range, 4);
        let step = if marks.len() > 1 { marks[1] - marks[0] } else { most };
        // The bar ends with its number, and a mark too close to it gives way.
        marks.retain(|&mark| mark < 0.85 * range[1]);
        marks.push(range[1]);
        let step = if (range[1] / step - (range[1] / step).round()).abs() < 1e-6 { step } else { step / 10.0 };
        for &mark in &marks {
            let at = left + (f64::from(width) * mark / range[1]).round() as i32;
            pen.line(&[(at, top + 9), (at, top + 13)], GREY, 1.0)?;
            pen.text(&shown(mark, step), 11, GREY, HPos::Center, (at, top + 21))?;
        }
        pen.text(&unit, 11, GREY, HPos::Left, (left + width + 8, top + 4))?;
        Ok(())
    }
}

/// How far down `value` is in a panel whose axis has this range.
fn level_of(value: f64, area: Area, [low, high]: [f64; 2]) -> f64 {
    f64::from(area.bottom()) - (value - low) / (high - low) * f64::from(area.height)
}

/// The axis of a quantity: lines at round numbers.
fn draw_levels<B: DrawingBackend>(pen: &Pen<'_, B>, area: Area, range: [f64; 2], numbers: Numbers) -> Result<()> {
    let marks = numbers.ticks(range, 4);
    let step = if marks.len() > 1 { marks[1] - marks[0] } else { range[1] - range[0] };
    let texts: Vec<String> = marks.iter().map(|&mark| shown(mark, step)).collect();
    let size = pen.fitting_size(&texts, 11, NUMBERS)?;
    for (&mark, text) in marks.iter().zip(&texts) {
        let level = level_of(mark, area, range).round() as i32;
        pen.line(&[(area.left, level), (area.right(), level)], FAINT, 1.0)?;
        pen.text(text, size, GREY, HPos::Right, (area.left - 7, level))?;
    }
    Ok(())
}

/// The axis of time, s, with its numbers if `are_shown`.
fn draw_times<B: DrawingBackend>(pen: &Pen<'_, B>, area: Area, span: [f64; 2], are_shown: bool) -> Result<()> {
    let seconds = ticks(span, (area.width / 90) as usize);
    let step_s = if seconds.len() > 1 { seconds[1] - seconds[0] } else { span[1] - span[0] };
    for &second in &seconds {
        let across = (second - span[0]) / (span[1] - span[0]) * f64::from(area.width);
        let at = (f64::from(area.left) + across).round() as i32;
        pen.line(&[(at, area.bottom()), (at, area.bottom() + 4)], GREY, 1.0)?;
        if are_shown {
            pen.text(&shown(second, step_s), 11, GREY, HPos::Center, (at, area.bottom() + 13))?;
        }
    }
    pen.line(&[(area.left, area.bottom()), (area.right(), area.bottom())], GREY, 1.0)
}

/// `colour` for component `index` of a vector.
fn paler(colour: RGBColor, index: usize) -> RGBColor {
    let share = [0.0, 0.45, 0.7][index.min(2)];
    let mixed = |part: u8| (f64::from(part) * (1.0 - share) + 255.0 * share).round() as u8;
    RGBColor(mixed(colour.0), mixed(colour.1), mixed(colour.2))
}
