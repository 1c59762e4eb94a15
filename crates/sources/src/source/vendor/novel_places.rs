//! Where pliance's sensors are: rows of corners, middles and areas at the end of a file.
//!
//! The corners are counted from one corner of the mat, and the centres of pressure that the file has may be counted from
//! another one, so that they are turned or mirrored. Places are given as the centres of pressure count them, where the file
//! has any.

use super::layout::Cell;
use super::text::{Separator, Word};
use crate::error::{Error, Result, failed};

const CM: f64 = 0.01;
/// Pressed frames whose centres of pressure are looked at.
const SAMPLES: usize = 8;
/// By how much a printed centre of pressure may be off, cm.
const CENTRE_TOLERANCE: f64 = 0.002;
/// By how much a printed area may be off for its four decimals, cm².
const AREA_ROUNDING: f64 = 0.51e-4;

/// Where a file says its sensors are: for each its number, its corners, its middle and its area.
#[derive(Clone, Debug, Default)]
pub(super) struct Places {
    sensors: Vec<u32>,
    /// x[0], y[0], …, y[3], x[c], y[c], area, as far as they were found, cm.
    rows: [Vec<f64>; 11],
    table: Table,
    samples: Vec<Sample>,
    /// x and y as centres of pressure count them: a from the corners' x is `low + high − x` where it is turned.
    turned: [Option<f64>; 2],
}

/// Which table a line is in.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
enum Table {
    #[default]
    None,
    Pressures,
    Forces,
}

/// A frame in which something is pressed.
#[derive(Clone, Debug)]
struct Sample {
    t_s: f64,
    pressures: Vec<f64>,
    /// As the file has it, cm.
    centre: Option<[f64; 2]>,
}

/// What the rows are headed.
const HEADS: [&[u8]; 11] =
    [b"x[0]", b"y[0]", b"x[1]", b"y[1]", b"x[2]", b"y[2]", b"x[3]", b"y[3]", b"x[c]", b"y[c]", b"area"];

impl Places {
    /// Takes a line of the file, whichever it is.
    pub(super) fn line(&mut self, line: &[u8]) -> Result<()> {
        let line = line.trim_ascii_start();
        let words = Separator::Blanks.cells(line).skip(1);
        match line.first() {
            Some(b'0'..=b'9') => self.row(line),
            Some(b't') if line.starts_with(b"time[") => {
                let is_forces = words.clone().next().is_some_and(|word| word.whole().is_none());
                self.table = if is_forces { Table::Forces } else { Table::Pressures };
            }
            Some(b's') if line.starts_with(b"sensor") => {
                // `sensor type:` is a line of the header.
                self.sensors = words.map(Word::whole).collect::<Option<_>>().unwrap_or_default();
                self.table = Table::None;
            }
            Some(b'x' | b'y' | b'a') => {
                let Some(row) = HEADS.iter().position(|head| line.starts_with(head)) else { return Ok(()) };
                let number = |word: Word<'_>| {
                    word.number().filter(|x| x.is_finite()).ok_or_else(|| failed!("`{word}` is not a number"))
                };
                self.rows[row] = words.map(number).collect::<Result<_>>()?;
            }
            _ => {}
        }
        Ok(())
    }

    /// Keeps a row of one of the tables, if it is of use.
    fn row(&mut self, line: &[u8]) {
        let mut numbers = Separator::Blanks.cells(line).map(Word::number);
        let Some(Some(t_s)) = numbers.next() else { return };
        match self.table {
            Table::Pressures if self.samples.len() < SAMPLES => {
                let pressures: Vec<f64> = numbers.map(Option::unwrap_or_default).collect();
                if pressures.iter().any(|pressure| *pressure > 0.0) {
                    self.samples.push(Sample { t_s, pressures, centre: None });
                }
            }
            Table::Forces => {
                let centre = (numbers.nth(1).flatten(), numbers.next().flatten());
                if let (Some(x), Some(y)) = centre
                    && let Some(sample) = self.samples.iter_mut().find(|sample| sample.t_s == t_s)
                {
                    sample.centre = Some([x, y]);
                }
            }
            _ => {}
        }
    }

    /// These, if the file had any.
    pub(super) fn found(mut self) -> Option<Self> {
        if self.sensors.is_empty() || self.rows.iter().all(Vec::is_empty) {
            return None;
        }
        self.turned = self.turns();
        Some(self)
    }

    /// Along x and y, whether centres of pressure are counted from the other end: then the sum of both ends.
    fn turns(&self) -> [Option<f64>; 2] {
        let along = |axis: usize| {
            let corners = || (0..4).flat_map(|corner| self.rows[2 * corner + axis].iter().copied());
            let ends = corners().fold(f64::INFINITY, f64::min) + corners().fold(f64::NEG_INFINITY, f64::max);
            let middles = &self.rows[8 + axis];
            let known: Vec<[f64; 2]> = self
                .samples
                .iter()
                .filter(|sample| sample.pressures.len() == middles.len())
                .filter_map(|sample| {
                    let sum: f64 = sample.pressures.iter().sum();
                    let moment: f64 = sample.pressures.iter().zip(middles).map(|(p, x)| p * x).sum();
                    Some([moment / sum, sample.centre?[axis]])
                })
                .collect();
            let fit = |of: &dyn Fn(f64) -> f64| {
                known.iter().all(|[own, printed]| (of(*own) - printed).abs() < CENTRE_TOLERANCE)
            };
            (!known.is_empty() && !fit(&|own| own) && fit(&|own| ends - own)).then_some(ends)
        };
        [along(0), along(1)]
    }

    /// Refuses places that are not those of `sensors`.
    pub(super) fn check(&self, sensors: &[u32]) -> Result<()> {
        if self.sensors != sensors {
            return Err(Error::failed("the places at the end of the file and its table have different sensors"));
        }
        for (head, row) in HEADS.iter().zip(&self.rows) {
            if row.len() != sensors.len() {
                let head = String::from_utf8_lossy(head);
                return Err(failed!("row `{head}` of the places has {} of {} numbers", row.len(), sensors.len()));
            }
        }
        Ok(())
    }

    /// The cell at `index` of the table, without its id.
    pub(super) fn cell(&self, index: usize) -> Cell {
        let along = |axis: usize, x: f64| self.turned[axis].map_or(x, |ends| ends - x) * CM;
        let point = |row: usize| [along(0, self.rows[row][index]), along(1, self.rows[row + 1][index])];
        let corners_m = [point(0), point(2), point(4), point(6)];
        // Areas are printed with four digits, corners exactly.
        let (printed, exact) = (self.rows[10][index].max(0.0), area(corners_m) / (CM * CM));
        let area_m2 = if (printed - exact).abs() < AREA_ROUNDING { exact } else { printed } * CM * CM;
        Cell { id: 0, centre_m: point(8), corners_m, area_m2 }
    }
}

/// The area between corners.
fn area(corners: [[f64; 2]; 4]) -> f64 {
    let crosses = (0..4).map(|i| (corners[i], corners[(i + 1) % 4])).map(|([ax, ay], [bx, by])| ax * by - bx * ay);
    crosses.sum::<f64>().abs() / 2.0
}
