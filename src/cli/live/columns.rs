//! The columns of the live table: which fit, and their contents.

use std::f64::consts::PI;

use console::style;
use somatic::signal::Quantity;
use somatic::{Outputs, Percept};

use super::senses::said;
use crate::cli::words::{clipped, fitted, millimetres, number};

/// Blank between columns.
const GAP: usize = 2;
/// Minimum widths of names and of flags.
const MIN_NAME_WIDTH: usize = 14;
const MIN_FLAGS_WIDTH: usize = 9;
const BAR_WIDTH: usize = 8;

/// Context of a percept's cells.
#[derive(Clone, Copy)]
pub(super) struct Scale {
    pub(super) largest_total: f64,
    /// The unit of P.
    pub(super) unit: PrintedUnit,
}

/// A unit of P as people read it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::cli) struct PrintedUnit {
    /// How many of it one of P is.
    pub(in crate::cli) factor: f64,
    pub(in crate::cli) name: &'static str,
}

impl PrintedUnit {
    /// Of fields that measure different things.
    pub(in crate::cli) const SI: Self = Self { factor: 1.0, name: "SI" };

    pub(in crate::cli) fn for_quantity(quantity: Quantity) -> Self {
        match quantity {
            Quantity::Count => Self { factor: 1.0, name: "" },
            Quantity::Pascal => Self { factor: 1e-3, name: "kPa" },
            Quantity::Newton => Self { factor: 1.0, name: "N" },
        }
    }

    /// `heading` with the unit, which counts do not have.
    pub(in crate::cli) fn heads(self, heading: &str) -> String {
        if self.name.is_empty() { heading.to_owned() } else { format!("{heading} {}", self.name) }
    }
}

impl Scale {
    /// `value` in the unit of P.
    fn of_p(self, value: f64) -> String {
        Self { largest_total: self.largest_total * self.unit.factor, ..self }.number(value * self.unit.factor)
    }

    /// `value` with the decimals that give the largest total five digits, so that decimal points align.
    fn number(self, value: f64) -> String {
        if !(1e-3..1e7).contains(&self.largest_total) {
            return number(value);
        }
        let decimals = (4 - self.largest_total.log10().floor() as i32).clamp(0, 6) as usize;
        format!("{value:.decimals$}")
    }
}

struct Column {
    heading: &'static str,
    width: usize,
    /// Shown if one of these is requested.
    outputs: Outputs,
    /// Columns with larger numbers are dropped first.
    gives_way: u8,
    text: Text,
}

/// What a column shows of a percept.
type Text = fn(&Percept, Scale) -> Option<String>;

const fn column(heading: &'static str, width: usize, outputs: Outputs, gives_way: u8, text: Text) -> Column {
    Column { heading, width, outputs, gives_way, text }
}

const COLUMNS: [Column; 11] = [
    column("total", 9, Outputs::TOTAL, 0, |p, scale| p.total.map(|total| scale.of_p(total))),
    column("", BAR_WIDTH, Outputs::TOTAL, 3, bar),
    column("peak", 8, Outputs::PEAK, 6, |p, scale| p.peak.map(|peak| scale.of_p(peak))),
    column("force N", 8, Outputs::FORCE, 1, |p, _| p.force.map(number)),
    column("active", 6, Outputs::ACTIVE, 4, |p, _| p.active.map(|active| active.to_string())),
    column("area mm²", 8, Outputs::AREA, 8, |p, _| p.area.map(|area| format!("{:.1}", area * 1e6))),
    column("u    v mm", 13, Outputs::CENTROID, 1, |p, _| p.centroid.map(|centroid| places(&centroid))),
    column("x      y      z mm", 20, Outputs::POSITION, 7, |p, _| p.position.map(|place| places(&place))),
    column("angle", 6, Outputs::ORIENTATION, 2, |p, _| p.orientation.map(line)),
    column("going", 7, Outputs::FILTERED_DIRECTION, 3, |p, _| p.filtered_direction.map(arrow)),
    column("aniso", 5, Outputs::ANISOTROPY, 5, |p, _| p.anisotropy.map(|share| format!("{share:.2}"))),
];

/// The columns that fit into a terminal.
pub(super) struct Layout {
    name: usize,
    columns: Vec<&'static Column>,
    flags: usize,
    /// What positions are in, where that is not their field's anchor.
    world: Option<String>,
    unit: PrintedUnit,
}

impl Layout {
    /// For names up to `longest` and the quantities `outputs`, those of P in `unit`, in `width` columns.
    pub(super) fn new(longest: usize, outputs: Outputs, world: Option<&str>, width: usize, unit: PrintedUnit) -> Self {
        let mut columns: Vec<&Column> = COLUMNS.iter().filter(|column| outputs.intersects(column.outputs)).collect();
        let taken = |columns: &[&Column]| columns.iter().map(|column| column.width + GAP).sum::<usize>();
        let least_name = longest.clamp(5, MIN_NAME_WIDTH);
        let mut flags = MIN_FLAGS_WIDTH;
        while least_name + taken(&columns) + GAP + flags > width {
            match columns.iter().enumerate().max_by_key(|(_, column)| column.gives_way) {
                Some((index, column)) if column.gives_way > 2 => drop(columns.remove(index)),
                _ if flags > 0 => flags = 0,
                Some((index, _)) => drop(columns.remove(index)),
                None => break,
            }
        }
        let gap = if flags > 0 { GAP } else { 0 };
        let name = longest.max(5).min(width.saturating_sub(taken(&columns) + gap + flags));
        let flags = if flags > 0 { width.saturating_sub(name + taken(&columns) + gap) } else { 0 };
        Self { name, columns, flags, world: world.map(str::to_owned), unit }
    }

    pub(super) fn headings(&self) -> String {
        let mut text = fitted("field", self.name, false);
        for column in &self.columns {
            text += &" ".repeat(GAP);
            let heading = match (column.outputs, &self.world) {
                (Outputs::POSITION, Some(world)) => format!("x    y    z mm {world}"),
                (Outputs::TOTAL | Outputs::PEAK, _) if !column.heading.is_empty() => self.unit.heads(column.heading),
                _ => column.heading.to_owned(),
            };
            text += &fitted(&heading, column.width, true);
        }
        if self.flags > 0 { text + "  flags" } else { text }
    }

    /// A row; dim when the touch is over.
    pub(super) fn row(&self, name: &str, percept: Option<&Percept>, scale: Scale) -> String {
        let touched = percept.is_some_and(|percept| percept.contact);
        let mut text = fitted(name, self.name, false);
        if let Some(said) = percept.and_then(|percept| said(percept, scale.unit.factor, scale.unit.name)) {
            let room = self.columns.iter().map(|column| column.width + GAP).sum::<usize>() + self.flags;
            // Not in columns: a long name has half of their room.
            let wide = console::measure_text_width(name).clamp(self.name, self.name + room / 2);
            text = fitted(name, wide, false) + &clipped(&format!("  {said}"), room + self.name - wide);
            return if touched { text } else { style(text).dim().to_string() };
        }
        for column in &self.columns {
            text += &" ".repeat(GAP);
            let cell = percept.map_or(Some("·".to_owned()), |percept| (column.text)(percept, scale));
            // Absent values leave a mark, so that columns stay readable.
            let cell = fitted(cell.as_deref().unwrap_or("–"), column.width, !column.heading.is_empty());
            let is_bar = column.heading.is_empty() && touched;
            text += &if is_bar { style(cell).cyan().to_string() } else { cell };
        }
        if let Some(percept) = percept.filter(|_| self.flags > 0) {
            let flags = percept.flags.names().collect::<Vec<_>>().join(" ");
            let flags = clipped(&flags, self.flags);
            text += &format!("  {}", if touched { style(flags).yellow().to_string() } else { flags });
        }
        if touched { text } else { style(text).dim().to_string() }
    }
}

fn places(metres: &[f64]) -> String {
    let texts: Vec<String> = metres.iter().map(|&m| format!("{:>6}", millimetres(m))).collect();
    texts.join(" ")
}

/// Degrees and the direction of a line at `angle`; +u points right and +v up.
fn line(angle: f64) -> String {
    const LINES: [&str; 4] = ["─", "╱", "│", "╲"];
    let eighth = (angle / (PI / 4.0)).round() as usize % LINES.len();
    format!("{:.0}° {}", angle.to_degrees(), LINES[eighth])
}

/// Degrees and an arrow; +u points right and +v up.
fn arrow(direction: f64) -> String {
    const ARROWS: [&str; 8] = ["→", "↗", "↑", "↖", "←", "↙", "↓", "↘"];
    let eighth = (direction / (PI / 4.0)).round().rem_euclid(ARROWS.len() as f64) as usize;
    format!("{:.0}° {}", direction.to_degrees(), ARROWS[eighth])
}

/// A bar of the total as a share of the largest seen.
fn bar(percept: &Percept, scale: Scale) -> Option<String> {
    const EIGHTHS: [&str; 8] = ["", "▏", "▎", "▍", "▌", "▋", "▊", "▉"];
    let total = percept.total?;
    let share = if scale.largest_total > 0.0 { (total / scale.largest_total).clamp(0.0, 1.0) } else { 0.0 };
    // A touch always shows.
    let eighths = ((share * (8 * BAR_WIDTH) as f64).round() as usize).max(1);
    Some("█".repeat(eighths / 8) + EIGHTHS[eighths % 8])
}

#[cfg(test)]
mod tests {
    use somatic::internal::signal::{Channel, Frame, RawValue};
    use somatic::{Body, Engine, Options, bundled};

    use super::*;

    #[test]
    fn a_line_looks_the_way_it_runs() {
        let texts = [0.0, PI / 4.0, PI / 2.0, 3.0 * PI / 4.0, PI - 0.01].map(line);
        assert_eq!(texts, ["0° ─", "45° ╱", "90° │", "135° ╲", "179° ─"]);
    }

    #[test]
    fn an_arrow_points_the_way_it_goes() {
        let texts = [0.0, 0.4, PI / 2.0, PI, -PI + 0.01, -PI / 2.0, -0.4].map(arrow);
        assert_eq!(texts, ["0° →", "23° ↗", "90° ↑", "180° ←", "-179° ←", "-90° ↓", "-23° ↘"]);
        // The widest there is fits its column.
        assert_eq!(arrow(-3.0).chars().count(), 7);
    }

    #[test]
    fn a_name_of_another_letter_takes_room_that_columns_would_have() {
        let unit = PrintedUnit::for_quantity(Quantity::Newton);
        let layout = Layout::new(32, Outputs::all(), None, 100, unit);
        let body = Body::from_bytes("sensing-hand", bundled::SENSING_HAND).unwrap();
        let mut engine = Engine::new(&body, Options::default()).unwrap();
        let values = vec![RawValue::new(24.0); Channel::all_of(&body).len()];
        let percepts = engine.process_one(&Frame { values, ..Frame::default() }).unwrap().clone();
        let scale = Scale { largest_total: 1.0, unit };
        let name = "hand/midhand/index · temperature";
        let row = |has: fn(&Percept) -> bool| {
            let percept = percepts.frame(0).find(has).unwrap();
            layout.row(name, Some(&percept), scale)
        };
        let warm = row(|percept| percept.temperature.is_some());
        assert!(warm.contains(name) && warm.contains("24.0 °C") && console::measure_text_width(&warm) <= 100, "{warm}");
        // One of pressures has its columns.
        assert!(!row(|percept| percept.total.is_some()).contains(name));
    }

    #[test]
    fn every_row_fits_whatever_the_width() {
        for width in 0..200 {
            for longest in [1, 8, 30] {
                let layout = Layout::new(
                    longest,
                    Outputs::all(),
                    Some("world"),
                    width,
                    PrintedUnit::for_quantity(Quantity::Pascal),
                );
                let headings = console::measure_text_width(&layout.headings());
                assert!(headings <= width.max(5) || layout.columns.is_empty(), "{width}: {headings}");
            }
        }
    }

    #[test]
    fn what_was_not_asked_for_has_no_column_and_a_wide_terminal_has_all() {
        let headings = |outputs, width| {
            Layout::new(10, outputs, None, width, PrintedUnit::for_quantity(Quantity::Pascal)).headings()
        };
        assert!(!headings(Outputs::TOTAL, 200).contains("angle"));
        assert!(
            headings(Outputs::all(), 200).contains("peak kPa") && headings(Outputs::all(), 200).contains("force N")
        );
        let narrow = headings(Outputs::all(), 58);
        assert!(narrow.contains("total") && narrow.contains("angle") && !narrow.contains("peak"), "{narrow}");
    }
}
