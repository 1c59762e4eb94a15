//! XSENSOR's `.csv`: for each frame a header and, for each sensor, keys with values and then a table of its cells. In newer layouts keys
//! end with a colon, all is within quotation marks, and no line `SENSELS` is above a table.
//!
//! Cells outside a sensor's outline are printed as 0, and the file does not say which they are. It says the area of the whole
//! sensor, and how many cells each of its groups has and their area. The area of a cell comes from these: its width
//! and height in the file have only two digits.

use super::layout::{Grid, Layout, next_value};
use super::parser::{AfterWrong, Parser, Rate};
use super::sides::sides;
use super::text::{Cells, Separator, Word, in_parentheses, metres};
use super::time::OfDay;
use super::xsensor_groups::Groups;
use crate::error::{Error, Result, failed};
use crate::signal::{Frame, RawValue, UnitOfP};

/// Reads frames from lines.
pub(super) struct Xsensor {
    separator: Separator,
    rate: Rate,
    unit: Option<UnitOfP>,
    sensors: Vec<Sensor>,
    /// The sensors are those of the first frame, which is complete.
    is_known: bool,
    /// Area of all groups of the first frame, m², and their cells.
    grouped: (f64, f64),
    place: Place,
    frame: Option<Started>,
    time: OfDay,
    values: Vec<RawValue>,
    after_wrong: AfterWrong,
    /// Its groups, while they are looked for.
    looked_for: Option<Groups>,
    /// Its groups, as a first pass found them.
    groups: Option<Groups>,
}

/// A frame that is not complete yet.
struct Started {
    number: Option<u32>,
    t_s: Option<f64>,
    /// By sensor, whether its table has come.
    seen: Vec<bool>,
}

/// Where in a frame a line is.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Place {
    /// Before the first sensor.
    Head,
    /// Among a sensor's keys.
    Keys { sensor: usize },
    /// In a sensor's table, before row `row`.
    Table { sensor: usize, row: u32 },
    /// After a sensor's table.
    Between,
    /// In a group, whose cells are those of sensors once more.
    Group,
}

struct Sensor {
    name: String,
    grid: Grid,
    /// The middle of the file has it, or it is put together from these, m.
    width_m: Option<f64>,
    height_m: Option<f64>,
    total_area_m2: Option<f64>,
    /// Where its values begin, once its size is known.
    first: Option<usize>,
}

impl Xsensor {
    pub(super) fn new(separator: Separator, rate: Rate, unit: Option<UnitOfP>) -> Self {
        Self {
            separator,
            rate,
            unit,
            sensors: Vec::new(),
            is_known: false,
            grouped: (0.0, 0.0),
            place: Place::Head,
            frame: None,
            time: OfDay::default(),
            values: Vec::new(),
            after_wrong: AfterWrong::default(),
            looked_for: None,
            groups: None,
        }
    }

    /// The same, which looks for groups.
    pub(super) fn collecting(self) -> Self {
        Self { looked_for: Some(Groups::default()), ..self }
    }

    /// The same, whose `groups` are known.
    pub(super) fn with_groups(self, groups: Option<Groups>) -> Self {
        Self { groups, ..self }
    }

    /// Whether any group was seen.
    pub(super) fn has_groups(&self) -> bool {
        self.looked_for.as_ref().is_some_and(|groups| !groups.is_empty())
    }

    /// The groups that were seen.
    pub(super) fn into_groups(self) -> Option<Groups> {
        self.looked_for.filter(|groups| !groups.is_empty())
    }

    /// Takes the row `row` of a sensor's table.
    fn row(&mut self, sensor: usize, row: u32, mut cells: Cells<'_>) -> Result<()> {
        let Sensor { grid, first, name, .. } = &self.sensors[sensor];
        let at = |column: u32| format!("sensor `{name}`, row {}, column {}", row + 1, column + 1);
        let start = first.unwrap_or_default() + (row * grid.columns) as usize;
        let values = &mut self.values[start..start + grid.columns as usize];
        for (slot, column) in values.iter_mut().zip(0..) {
            let Some(value) = next_value(&mut cells) else {
                return Err(failed!("it has {column} of {} cells", grid.columns)
                    .at(format!("sensor `{name}`, row {}", row + 1)));
            };
            *slot = value.map_err(|e| e.at(at(column)))?;
        }
        if let Some(more) = cells.next_filled() {
            return Err(failed!("`{more}` follows the last of its {} columns", grid.columns)
                .at(format!("sensor `{name}`, row {}", row + 1)));
        }
        let done = row + 1 == grid.rows;
        self.place = if done { Place::Between } else { Place::Table { sensor, row: row + 1 } };
        if let Some(frame) = self.frame.as_mut().filter(|_| done) {
            frame.seen[sensor] = true;
        }
        Ok(())
    }

    /// Takes a row of values of a group.
    fn row_of_group(&mut self, cells: Cells<'_>) {
        if let Some(groups) = &mut self.looked_for {
            groups.values(cells);
        }
    }

    /// Begins a sensor's table, whose size must be known by now.
    fn table(&mut self, sensor: usize) -> Result<()> {
        let place = self.values.len();
        let known = &mut self.sensors[sensor];
        if known.first.is_none() {
            known.grid = known.grid.check().map_err(|e| e.at(format!("sensor `{}`", known.name)))?;
            known.grid.pitch_m = known.width_m.zip(known.height_m).map(|(width, height)| [width, height]);
            known.first = Some(place);
            self.values.resize(place + known.grid.cells(), RawValue::MISSING);
        }
        self.place = Place::Table { sensor, row: 0 };
        Ok(())
    }

    /// Begins the sensor called `name`.
    fn sensor(&mut self, name: &str) -> Result<()> {
        let frame = self.frame.as_mut().ok_or_else(|| failed!("a SENSOR comes before the first FRAME"))?;
        let known = self.sensors.iter().position(|sensor| sensor.name == name);
        let sensor = match known {
            Some(known) if frame.seen[known] => return Err(failed!("sensor `{name}` is in one frame twice")),
            Some(known) => known,
            None if self.is_known => {
                return Err(failed!(
                    "sensor `{name}` is not in the first frame; export the recording with all its sensors"
                ));
            }
            None => {
                frame.seen.push(false);
                self.sensors.push(Sensor {
                    name: name.to_owned(),
                    grid: Grid::default(),
                    width_m: None,
                    height_m: None,
                    total_area_m2: None,
                    first: None,
                });
                self.sensors.len() - 1
            }
        };
        self.place = Place::Keys { sensor };
        Ok(())
    }

    /// Takes a line that begins with a word, and has another one `beside` it.
    fn keyword(&mut self, word: Word<'_>, beside: Option<Word<'_>>) -> Result<()> {
        let keyword = |name: &str| is_key(word, name);
        if keyword("SENSOR") {
            self.sensor(&beside.map_or(String::new(), |word| word.text().into_owned()))?;
        } else if keyword("GROUP") {
            self.place = Place::Group;
            if let (Some(groups), Some(number)) = (&mut self.looked_for, beside.and_then(Word::whole)) {
                groups.begin(number);
            }
        } else if keyword("SENSELS") {
            if let Place::Keys { sensor } = self.place {
                self.table(sensor)?;
            }
        } else if keyword("Units") {
            if self.unit.is_none() {
                self.unit = beside.map(|unit| unit.text().parse()).transpose()?;
            }
        } else if keyword("Time") && self.place == Place::Head {
            let text = beside.map_or(String::new(), |word| word.text().into_owned());
            let t_s = self.time.since_first(&text)?;
            if let Some(frame) = &mut self.frame {
                frame.t_s = Some(t_s);
            }
        } else if keyword("Rows") && self.place == Place::Head && self.frame.is_some() {
            // A recording of one sensor may leave its name out.
            self.sensor("sensor")?;
            self.key(word, beside)?;
        } else if self.place == Place::Between && word.number().is_some() {
            return Err(failed!("a row follows the last row of its sensor"));
        } else {
            self.key(word, beside)?;
        }
        Ok(())
    }

    /// Takes a key of a sensor or a group, with the cells after it.
    fn key(&mut self, key: Word<'_>, beside: Option<Word<'_>>) -> Result<()> {
        let text = key.text();
        let name = text.strip_suffix(':').unwrap_or(&text);
        let wrong =
            || failed!("`{name}` is `{}`, which is not a number", beside.map_or(String::new(), |w| w.to_string()));
        let number = || beside.and_then(Word::number).filter(|x| x.is_finite()).ok_or_else(wrong);
        let count = || beside.and_then(Word::whole).ok_or_else(wrong);
        let length = || Ok::<_, Error>(number()? * in_parentheses(name).and_then(metres).unwrap_or(0.01));
        let area = || Ok::<_, Error>(number()? * in_parentheses(name).and_then(metres).unwrap_or(0.01).powi(2));
        if self.unit.is_none()
            && let Some(unit) = name.starts_with("Average Pressure").then(|| in_parentheses(name)).flatten()
        {
            self.unit = Some(unit.parse()?);
        }
        if let (Place::Group, "Name", Some(groups)) = (self.place, name, &mut self.looked_for) {
            groups.name(&beside.map_or(String::new(), |word| word.text().into_owned()));
        }
        if self.is_known {
            return Ok(());
        }
        match self.place {
            Place::Keys { sensor } if self.sensors[sensor].first.is_none() => {
                let known = &mut self.sensors[sensor];
                match name {
                    "Rows" => known.grid.rows = count()?,
                    "Columns" => known.grid.columns = count()?,
                    key if key.starts_with("Sensel Width") => known.width_m = Some(length()?),
                    key if key.starts_with("Sensel Height") => known.height_m = Some(length()?),
                    key if key.starts_with("Total Area") => known.total_area_m2 = Some(area()?),
                    _ => {}
                }
            }
            Place::Group if name == "Cells" => self.grouped.1 += number()?,
            Place::Group if name.starts_with("Total Area") => self.grouped.0 += area()?,
            _ => {}
        }
        Ok(())
    }

    /// Gives the frame that is complete, if there is one.
    fn finish(&mut self, to: &mut Frame) -> Result<bool> {
        if let Place::Table { sensor, row } = self.place {
            let Sensor { name, grid, .. } = &self.sensors[sensor];
            return Err(failed!("sensor `{name}` has {row} of {} rows in this frame", grid.rows));
        }
        if let Place::Keys { sensor } = self.place {
            return Err(failed!("sensor `{}` has no table SENSELS in this frame", self.sensors[sensor].name));
        }
        let Some(frame) = self.frame.take() else { return Ok(false) };
        if !frame.seen.contains(&true) {
            return Err(failed!("frame {} has no sensor", frame.number.map_or("?".to_owned(), |n| n.to_string())));
        }
        if let Some(sensor) = self.sensors.iter().find(|sensor| sensor.first.is_none()) {
            return Err(failed!("sensor `{}` has no table SENSELS in the first frame", sensor.name));
        }
        if let Some(groups) = &mut self.looked_for {
            groups.frame(&self.values);
        }
        self.is_known = true;
        to.clear();
        to.t_s = self.rate.time_of(frame.t_s, frame.number)?;
        to.values.clone_from(&self.values);
        self.values.fill(RawValue::MISSING);
        self.place = Place::Head;
        Ok(true)
    }

    /// The area of a cell of `sensor`, m².
    fn cell_area(&self, sensor: &Sensor) -> Option<f64> {
        let total = sensor.total_area_m2.filter(|&total| total > 0.0)?;
        let rectangle = sensor.width_m? * sensor.height_m?;
        let (grouped, cells) = self.grouped;
        // Groups may be in another system's units of area; then they are not believed.
        let near = |cell: &f64| (0.9..=1.1).contains(&(cell / rectangle));
        let cell = Some(grouped / cells).filter(near).unwrap_or(rectangle);
        let count = (total / cell).round().max(1.0);
        Some(total / count).filter(|_| count <= sensor.grid.cells() as f64).filter(near)
    }
}

impl Parser for Xsensor {
    fn line(&mut self, line: &[u8], to: &mut Frame) -> Result<bool> {
        let mut cells = self.separator.cells(line);
        if self.after_wrong.passes(|| cells.clone().next().is_some_and(|word| is_key(word, "FRAME"))) {
            return Ok(false);
        }
        // Most lines are rows of cells, and no keyword begins with a digit.
        if line.first().is_some_and(u8::is_ascii_digit) {
            match self.place {
                Place::Table { sensor, row } => return self.row(sensor, row, cells).map(|()| false),
                Place::Group => {
                    self.row_of_group(cells);
                    return Ok(false);
                }
                _ => {}
            }
        }
        let word = cells.clone().next();
        let Some(word) = word.filter(|_| !is_blank(line)) else { return Ok(false) };
        let keyword = |name: &str| is_key(word, name);
        if keyword("FRAME") {
            let complete = self.finish(to);
            self.after_wrong.begin(&complete);
            cells.next();
            let number = cells.next().and_then(Word::whole);
            self.place = Place::Head;
            self.frame = Some(Started { number, t_s: None, seen: vec![false; self.sensors.len()] });
            return complete;
        }
        if let Place::Table { sensor, row } = self.place {
            if keyword("SENSOR") || keyword("GROUP") {
                let Sensor { name, grid, .. } = &self.sensors[sensor];
                return Err(failed!("sensor `{name}` has {row} of {} rows in this frame", grid.rows));
            }
            return self.row(sensor, row, cells).map(|()| false);
        }
        match self.place {
            Place::Group if word.number().is_some() => {
                self.row_of_group(cells);
                return Ok(false);
            }
            Place::Keys { sensor } if word.number().is_some() => {
                self.table(sensor)?;
                return self.row(sensor, 0, cells).map(|()| false);
            }
            _ => {}
        }
        cells.next();
        let beside = cells.next();
        self.keyword(word, beside).map(|()| false)
    }

    fn end(&mut self, to: &mut Frame) -> Result<bool> {
        self.finish(to)
    }

    fn go_on(&mut self) -> bool {
        if !self.is_known {
            return false;
        }
        self.rate.pass();
        self.values.fill(RawValue::MISSING);
        if self.after_wrong.pass_rest() {
            (self.frame, self.place) = (None, Place::Head);
        }
        true
    }

    fn is_of_lines(&self) -> bool {
        true
    }

    fn layout(&self) -> Layout {
        let (mut panels, mut first_id) = (Vec::new(), 0);
        for sensor in &self.sensors {
            let grid = Grid { area_m2: self.cell_area(sensor), ..sensor.grid };
            panels.push(grid.panel(&sensor.name, first_id));
            first_id += grid.cells() as u32;
        }
        let names = sides(&panels.iter().map(|panel| panel.name.as_str()).collect::<Vec<_>>());
        panels.iter_mut().zip(names).for_each(|(panel, name)| panel.name = name);
        if let Some(groups) = &self.groups {
            groups.parts(&mut panels);
        }
        let mut layout = Layout { panels, unit: self.unit.unwrap_or_default() };
        layout.side_by_side();
        layout
    }

    fn understood(&self) -> Option<String> {
        let groups = self.groups.as_ref()?;
        let mut panels = self.layout().panels;
        panels.iter_mut().for_each(|panel| panel.parts.clear());
        Some(groups.parts(&mut panels))
    }
}

/// Whether `word` is the key `name`, after which newer layouts have a colon.
fn is_key(word: Word<'_>, name: &str) -> bool {
    word.is(name) || word.after(name).is_some_and(|rest| rest == ":")
}

/// Whether a line has nothing but separators.
fn is_blank(line: &[u8]) -> bool {
    line.iter().all(|byte| matches!(byte, b',' | b';' | b'\t' | b' '))
}
