//! footscan's text: for each foot the rectangle of the plate that it stepped on, then its frames: a line with the number and the time
//! in milliseconds, and rows of forces. The first row is nearest to where the walk begins. One foot follows the other, each from
//! a time of its own, so that such a file is read twice.
//!
//! Neither the size of the sensors nor the unit is printed. The plates have sensors of 5.08 mm × 7.62 mm, and print newtons.

use super::layout::{Grid, Layout, MAX_CELLS, Panel, next_value};
use super::parser::{AfterWrong, Parser, Rate};
use super::text::{Separator, decoded, leading_number};
use crate::error::{Error, Result, failed};
use crate::signal::{Frame, RawValue, UnitOfP};

/// Width and height of a sensor, m.
const PITCH_M: [f64; 2] = [0.005_08, 0.007_62];
const SIDES: [&str; 2] = ["left", "right"];

/// A foot: which it is, and its rectangle on the plate, in sensors.
#[derive(Clone, Debug, Default, PartialEq)]
struct Foot {
    side: usize,
    bottom: u32,
    left: u32,
    rows: u32,
    columns: u32,
}

/// The feet of a file, as a first pass finds them.
#[derive(Default)]
pub(super) struct Feet {
    feet: Vec<Foot>,
    /// The number that the next line gives.
    awaited: Option<Key>,
}

/// What a number of a rectangle is.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Key {
    Bottom,
    Left,
    Width,
    Height,
}

/// A line that is no row.
#[derive(Debug, PartialEq)]
enum Head {
    /// The data of a side.
    Side(usize),
    Frame,
    Other,
}

fn head(line: &[u8]) -> Head {
    let is_side = |side: &&str| {
        let (start, rest) = line.split_at_checked(side.len()).unwrap_or_default();
        start.eq_ignore_ascii_case(side.as_bytes()) && rest.trim_ascii().eq_ignore_ascii_case(b"foot data")
    };
    match SIDES.iter().position(is_side) {
        Some(side) => Head::Side(side),
        None if line.starts_with(b"Frame ") => Head::Frame,
        None => Head::Other,
    }
}

impl Feet {
    /// Takes the next line.
    pub(super) fn line(&mut self, line: &[u8]) -> Result<()> {
        let line = line.trim_ascii();
        let keys = [("bottom", Key::Bottom), ("left", Key::Left), ("width", Key::Width), ("height", Key::Height)];
        if let Some(key) = self.awaited.take_if(|_| line.first().is_some_and(u8::is_ascii_digit)) {
            return self.number(key, line);
        }
        if line.first().is_none_or(|first| first.is_ascii_digit() || *first == b'-') {
            return Ok(());
        }
        self.awaited = None;
        match head(line) {
            Head::Side(side) => {
                if self.feet.iter().any(|foot| foot.side == side) {
                    return Err(failed!(
                        "the {} foot is there twice; export each step to a file of its own",
                        SIDES[side]
                    ));
                }
                self.feet.push(Foot { side, ..Foot::default() });
            }
            Head::Other => {
                let text = decoded(line);
                let rest = text.strip_prefix("Rectangle ").unwrap_or_default();
                let key = keys.into_iter().find(|(name, _)| rest.starts_with(name));
                if let Some((name, key)) = key {
                    match rest[name.len()..].trim_matches([':', ' ', '\t']) {
                        "" => self.awaited = Some(key),
                        number => self.number(key, number.as_bytes())?,
                    }
                }
            }
            Head::Frame => {}
        }
        Ok(())
    }

    fn number(&mut self, key: Key, number: &[u8]) -> Result<()> {
        let wrong = || failed!("`{}` is no number of sensors", super::text::shortened(&decoded(number)));
        let number = std::str::from_utf8(number).ok().and_then(|number| number.parse().ok()).ok_or_else(wrong)?;
        let foot = self.feet.last_mut().ok_or_else(|| Error::failed("a rectangle comes before its foot"))?;
        match key {
            Key::Bottom => foot.bottom = number,
            Key::Left => foot.left = number,
            Key::Width => foot.columns = number,
            Key::Height => foot.rows = number,
        }
        Ok(())
    }
}

/// Reads frames from lines.
pub(super) struct Footscan {
    separator: Separator,
    rate: Rate,
    unit: Option<UnitOfP>,
    pitch_m: Option<[f64; 2]>,
    feet: Vec<Foot>,
    /// By foot, where its values begin.
    first: Vec<usize>,
    place: Place,
    /// Which of the feet the lines are of.
    foot: Option<usize>,
    number: Option<u32>,
    t_s: Option<f64>,
    values: Vec<RawValue>,
    after_wrong: AfterWrong,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Place {
    /// Before a foot's first frame.
    Header,
    /// Before row `row` of a frame.
    Table { row: u32 },
    /// After a frame's last row.
    After,
}

impl Footscan {
    /// A reader of `feet`.
    pub(super) fn new(
        separator: Separator,
        rate: Rate,
        unit: Option<UnitOfP>,
        pitch_m: Option<[f64; 2]>,
        feet: Feet,
    ) -> Result<Self> {
        let feet = feet.feet;
        if feet.is_empty() {
            return Err(Error::failed("it has neither `Left foot data` nor `Right foot data`; export it again"));
        }
        let (mut first, mut cells) = (Vec::new(), 0);
        for foot in &feet {
            let (rows, columns) = (foot.rows, foot.columns);
            Grid { rows, columns, ..Grid::default() }
                .check()
                .map_err(|e| e.at(format!("{} foot", SIDES[foot.side])))?;
            if u64::from(foot.bottom.max(foot.left)) > MAX_CELLS {
                return Err(failed!("the {} foot is off any plate", SIDES[foot.side]));
            }
            first.push(cells);
            cells += (rows * columns) as usize;
        }
        Ok(Self {
            separator,
            rate,
            unit,
            pitch_m,
            feet,
            first,
            place: Place::Header,
            foot: None,
            number: None,
            t_s: None,
            values: vec![RawValue::MISSING; cells],
            after_wrong: AfterWrong::default(),
        })
    }

    /// Whether what came before is whole.
    fn check_whole(&self) -> Result<()> {
        match (self.place, self.foot) {
            (Place::Table { row }, Some(foot)) => {
                Err(failed!("the frame before has {row} of {} rows", self.feet[foot].rows))
            }
            _ => Ok(()),
        }
    }

    /// Begins a frame, whose line says `Frame 7 (14.00 ms)`.
    fn frame(&mut self, line: &[u8]) -> Result<()> {
        let text = decoded(line);
        let wrong = || failed!("`{}` is not `Frame NUMBER (TIME ms)`", super::text::shortened(&text));
        self.foot.ok_or_else(|| Error::failed("a frame comes before its foot"))?;
        let rest = text["Frame ".len()..].trim();
        let (number, time) = rest.split_once('(').map_or((rest, None), |(number, time)| (number.trim(), Some(time)));
        self.number = Some(number.parse().map_err(|_| wrong())?);
        self.t_s = match time {
            None => None,
            Some(time) => match leading_number(time) {
                // As decimal numbers.
                Some((time, unit)) if unit.starts_with("ms") => Some((time * 1e3).round() / 1e6),
                Some((time, unit)) if unit.starts_with('s') => Some(time),
                _ => return Err(wrong()),
            },
        };
        self.values.fill(RawValue::MISSING);
        self.place = Place::Table { row: 0 };
        Ok(())
    }

    /// Takes row `row` of a frame; `true` if it is the last one.
    fn row(&mut self, row: u32, line: &[u8], to: &mut Frame) -> Result<bool> {
        let foot = self.foot.unwrap_or_default();
        let Foot { rows, columns, .. } = self.feet[foot];
        let mut cells = self.separator.cells(line);
        let first = self.first[foot] + (row * columns) as usize;
        for (index, slot) in self.values[first..first + columns as usize].iter_mut().enumerate() {
            let value = next_value(&mut cells);
            let value =
                value.ok_or_else(|| failed!("it has {index} of {columns} cells").at(format!("row {}", row + 1)))?;
            *slot = value.map_err(|e| e.at(format!("row {}, column {}", row + 1, index + 1)))?;
        }
        if let Some(more) = cells.next_filled() {
            return Err(failed!("`{more}` follows the last of its {columns} columns").at(format!("row {}", row + 1)));
        }
        if row + 1 < rows {
            self.place = Place::Table { row: row + 1 };
            return Ok(false);
        }
        self.place = Place::After;
        to.clear();
        to.t_s = self.rate.time_of(self.t_s, self.number)?;
        to.values.clone_from(&self.values);
        Ok(true)
    }
}

impl Parser for Footscan {
    fn line(&mut self, line: &[u8], to: &mut Frame) -> Result<bool> {
        let line = line.trim_ascii_start();
        let of_line = head(line.trim_ascii_end());
        if self.after_wrong.passes(|| of_line != Head::Other) || line.trim_ascii().is_empty() {
            return Ok(false);
        }
        let is_row = line.first().is_some_and(|first| first.is_ascii_digit() || *first == b'-');
        match (of_line, self.place) {
            (Head::Other, Place::Table { row }) => self.row(row, line, to),
            (Head::Other, Place::After) if is_row => Err(failed!("a row follows the last row of its frame")),
            // Among others the numbers of the rectangle.
            (Head::Other, _) => Ok(false),
            (Head::Side(side), _) => {
                let before = self.check_whole();
                self.after_wrong.begin(&before.clone().map(|()| false));
                self.foot = self.feet.iter().position(|foot| foot.side == side);
                self.place = Place::Header;
                before.map(|()| false)
            }
            (Head::Frame, _) => {
                let before = self.check_whole();
                self.after_wrong.begin(&before.clone().map(|()| false));
                self.frame(line)?;
                before.map(|()| false)
            }
        }
    }

    fn end(&mut self, _: &mut Frame) -> Result<bool> {
        self.check_whole().map(|()| false)
    }

    fn go_on(&mut self) -> bool {
        self.rate.pass();
        if self.after_wrong.pass_rest() {
            self.place = Place::After;
        }
        true
    }

    fn is_of_lines(&self) -> bool {
        true
    }

    fn understood(&self) -> Option<String> {
        let mut words = Vec::new();
        if self.pitch_m.is_none() {
            words.push("sensors are 5.08 mm wide and 7.62 mm high, unless --pitch says otherwise".to_owned());
        }
        if self.unit.is_none() {
            words.push("its values are in N, unless --unit says otherwise".to_owned());
        }
        if let [first, second] = &self.feet[..] {
            words.push(format!(
                "the {} foot comes after the {} one, and time begins anew with it",
                SIDES[second.side], SIDES[first.side]
            ));
        }
        (!words.is_empty()).then(|| words.join("; "))
    }

    fn layout(&self) -> Layout {
        let pitch_m = self.pitch_m.unwrap_or(PITCH_M);
        let panel = |(foot, first): (&Foot, &usize)| {
            let grid = Grid { rows: foot.rows, columns: foot.columns, pitch_m: Some(pitch_m), area_m2: None };
            let places = (0..foot.rows).flat_map(|row| (0..foot.columns).map(move |column| (row, column)));
            // The first row is at the bottom.
            let cells =
                places.zip(*first as u32..).map(|((row, column), id)| grid.cell(id, foot.rows - 1 - row, column));
            let middle = |from: u32, count: u32, pitch_m: f64| (f64::from(from) + f64::from(count) / 2.0) * pitch_m;
            Panel {
                name: SIDES[foot.side].to_owned(),
                cells: cells.collect(),
                is_placed: true,
                offset_m: [middle(foot.left, foot.columns, pitch_m[0]), middle(foot.bottom, foot.rows, pitch_m[1])],
                ..Panel::default()
            }
        };
        let newton = "N".parse().unwrap_or_default();
        Layout { panels: self.feet.iter().zip(&self.first).map(panel).collect(), unit: self.unit.unwrap_or(newton) }
    }
}
