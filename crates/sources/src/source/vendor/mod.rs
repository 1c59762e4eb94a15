//! Recordings that pressure systems export, read as they are: sensors, units, times and values come from the file.

mod body;
mod emed;
mod first_pass;
mod footscan;
mod format;
mod insoles;
mod layout;
mod lines;
mod loadsol;
mod matrix;
mod matrix_columns;
mod novel_asc;
mod novel_places;
mod options;
mod parser;
mod sides;
mod stappone;
mod tekscan;
mod text;
mod time;
mod totals;
mod xsensor;
mod xsensor_groups;

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

pub use format::VendorFormat;
pub use layout::{Cell, Layout, Panel};
pub use options::VendorOptions;

use self::emed::Emed;
use self::footscan::Footscan;
use self::insoles::Insoles;
use self::layout::Grid;
use self::lines::Lines;
use self::loadsol::Loadsol;
use self::matrix::Matrix;
use self::matrix_columns::way_out;
use self::novel_asc::NovelAsc;
use self::parser::{Parser, Rate};
use self::stappone::Stappone;
use self::tekscan::Tekscan;
use self::text::Separator;
use self::xsensor::Xsensor;
use super::Source;
use super::skipped_bad::SkippedBad;
use crate::error::{Error, Result, failed};
use crate::signal::{Frame, Quantity, RawValue};

/// A recording that a pressure system exported.
pub struct VendorSource {
    path: PathBuf,
    name: String,
    format: VendorFormat,
    lines: Lines,
    parser: Box<dyn Parser>,
    layout: Layout,
    ids: Vec<u32>,
    /// By place in a frame, the place of the value in the parser's.
    order: Vec<usize>,
    /// The first frame, which tells the layout, until it is taken.
    first: Option<Frame>,
    scratch: Frame,
    ended: bool,
    notices: Vec<String>,
    losses: Vec<String>,
    skipped: SkippedBad,
}

somatic_skin::debug_by_name!(VendorSource);

impl VendorSource {
    /// The format that the content of the file at `path` has, if it is one of these.
    #[must_use]
    pub fn detect(path: impl AsRef<Path>) -> Option<VendorFormat> {
        let path = path.as_ref();
        // A pipe can be read only once.
        if !path.is_file() {
            return None;
        }
        VendorFormat::detect(Lines::open(path).ok()?.head().ok()?)
    }

    /// Opens the recording at `path`.
    ///
    /// # Errors
    /// It cannot be read, is of no known format, or its first frame is not what it should be; a usage error if something is
    /// missing that the file does not say, or given that it does.
    pub fn open(path: impl AsRef<Path>, options: &VendorOptions) -> Result<Self> {
        let path = path.as_ref();
        Self::begin(path, Lines::open(path)?, options).map_err(|e| e.at(path.display()))
    }

    fn begin(path: &Path, mut lines: Lines, options: &VendorOptions) -> Result<Self> {
        let head = lines.head()?;
        if head.is_empty() {
            return Err(Error::failed("the file is empty"));
        }
        let by_grid = options.grid.map(|_| VendorFormat::Matrix);
        let format = options.format.or_else(|| VendorFormat::detect(head)).or(by_grid);
        let separator = Separator::detect(head);
        let format = format.ok_or_else(|| way_out(separator, head))?;
        let parser = parser(format, separator, head, path, options)?;
        let mut source = Self {
            path: path.to_owned(),
            name: path.display().to_string(),
            format,
            lines,
            parser,
            layout: Layout::default(),
            ids: Vec::new(),
            order: Vec::new(),
            first: None,
            scratch: Frame::missing(0.0, 0),
            ended: false,
            notices: Vec::new(),
            losses: Vec::new(),
            skipped: SkippedBad::new(options.skip_bad),
        };
        let mut first = Frame::missing(0.0, 0);
        if !source.read(&mut first)? {
            let why = source
                .losses
                .pop()
                .map_or_else(|| no_frames(format).to_owned(), |loss| format!("it has no whole frame: {loss}"));
            return Err(Error::failed(why));
        }
        source.layout = source.parser.layout();
        if let Some(unit) = options.unit {
            source.layout.unit = unit;
        }
        source.set_order()?;
        source.notices.extend(source.parser.understood());
        source.first = Some(first);
        Ok(source)
    }

    /// Frames have their values in the order of the panels, which is that of the parser unless ids say otherwise.
    fn set_order(&mut self) -> Result<()> {
        self.ids = self.layout.ids();
        let mut order: Vec<usize> = (0..self.ids.len()).collect();
        order.sort_by_key(|&place| self.ids[place]);
        if let Some(pair) = order.windows(2).find(|pair| self.ids[pair[0]] == self.ids[pair[1]]) {
            return Err(failed!("sensor {} is there twice", self.ids[pair[0]]));
        }
        if !order.is_sorted() {
            self.ids.sort_unstable();
            self.order = order;
        }
        Ok(())
    }

    /// Reads the next frame, with its values in the parser's order.
    fn read(&mut self, frame: &mut Frame) -> Result<bool> {
        while !self.ended {
            let Some(line) = self.lines.next()? else {
                self.ended = true;
                return match self.parser.end(frame) {
                    Ok(complete) => Ok(complete),
                    Err(error) => Ok(self.cut(&error)),
                };
            };
            match self.parser.line(line, frame) {
                Ok(false) => {}
                Ok(true) => return Ok(true),
                Err(error) if error.is_usage() => return Err(error),
                // Only the last line may be cut short: the export was stopped, or the file was cut.
                Err(error) if !self.lines.is_whole() || self.lines.is_at_end()? => {
                    self.ended = true;
                    self.cut(&error);
                    return Ok(self.parser.rest(frame));
                }
                Err(error) => {
                    let error = with_way_out(&error).at(format!("line {}", self.lines.number()));
                    if !self.skipped.is_on() || !self.parser.go_on() {
                        self.ended = true;
                        return Err(self.unskipped(error));
                    }
                    let (thing, wrong) = if self.parser.is_of_lines() {
                        ("frame", "a line that does not fit")
                    } else {
                        ("line", "not a frame")
                    };
                    self.skipped.skip(thing, wrong, error)?;
                }
            }
        }
        Ok(false)
    }

    /// `error`, which ends the recording; with why, if it was to be skipped.
    fn unskipped(&self, error: Error) -> Error {
        match self.skipped.is_on() {
            false => error,
            true => failed!(
                "{error}; --skip-bad skips frames of one line, and those of XSENSOR, Tekscan and footscan after the first one; correct the \
                 file"
            ),
        }
    }

    /// Notes that the last frame is cut short.
    fn cut(&mut self, error: &Error) -> bool {
        self.losses.push(format!("line {}: the last frame is cut short: {error}", self.lines.number()));
        false
    }

    /// Its file.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Its format.
    #[must_use]
    pub fn format(&self) -> VendorFormat {
        self.format
    }

    /// Its sensors.
    #[must_use]
    pub fn layout(&self) -> &Layout {
        &self.layout
    }

    /// The name of its body: the file's, without what follows the last point, and without `.gz`.
    #[must_use]
    pub fn body_name(&self) -> String {
        let is_packed = self.path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("gz"));
        let path = if is_packed { self.path.with_extension("") } else { self.path.clone() };
        let stem = path.file_stem().map_or_else(|| "recording".to_owned(), |stem| stem.to_string_lossy().into_owned());
        format!("{stem}.glb")
    }

    /// Its sensors as a body, a `.glb`: each panel a link, with a field of all its cells.
    ///
    /// # Errors
    /// It has more sensors than a body can hold.
    pub fn body(&self) -> Result<Vec<u8>> {
        body::glb(&self.layout).map_err(|e| e.at(&self.name))
    }

    /// The calibration that turns its values into pressures, TOML; `None` where they are counts.
    #[must_use]
    pub fn calibration(&self) -> Option<String> {
        let unit = self.layout.unit;
        (unit.quantity != Quantity::Count).then(|| {
            let mut text = "# The unit that the recording itself states.\n\n".to_owned();
            let _ = write!(text, "body = {}\n\n[all]\nunit = \"{unit}\"\n", toml::Value::from(self.body_name()));
            text
        })
    }
}

/// `error` of a line, with what to do about it, where it does not say so itself.
fn with_way_out(error: &Error) -> Error {
    let text = error.to_string();
    let more = if text.contains("; ") { "" } else { "; correct the line, or export the file again" };
    Error::failed(text + more)
}

/// Why a file of `format` may have no frames, and what to do.
fn no_frames(format: VendorFormat) -> &'static str {
    match format {
        VendorFormat::Matrix => {
            "it has no frames: no line begins with a number, or with a time such as 2031-05-06T07:08:09.5Z; leave only the numbers, the \
             time before them, with commas, semicolons, tabs or blanks between"
        }
        _ => "it has no frames; export it again, with the tables of its frames",
    }
}

/// The reader of `format`.
fn parser(
    format: VendorFormat,
    separator: Separator,
    head: &[u8],
    path: &Path,
    options: &VendorOptions,
) -> Result<Box<dyn Parser>> {
    let VendorOptions { grid, pitch_m, unit, .. } = *options;
    let rate = Rate::new(options.rate_hz)?;
    let has_no_pitch = matches!(format, VendorFormat::Matrix | VendorFormat::Footscan);
    if format != VendorFormat::Matrix && grid.is_some() || !has_no_pitch && pitch_m.is_some() {
        return Err(Error::usage(format!(
            "--grid and --pitch are for plain matrices; {} says itself where its sensors are",
            format.title()
        )));
    }
    if format != VendorFormat::Pedar && options.layout.is_some() {
        return Err(Error::usage(format!(
            "--layout is for pedar, which does not say where its sensors are; leave it out for {}",
            format.title()
        )));
    }
    Ok(match format {
        VendorFormat::Xsensor => {
            let groups = first_pass::groups(path, separator, rate)?;
            Box::new(Xsensor::new(separator, rate, unit).with_groups(groups))
        }
        VendorFormat::Loadsol => Box::new(Loadsol::new(separator, rate, unit)),
        VendorFormat::Footscan => {
            Box::new(Footscan::new(separator, rate, unit, pitch_m.map(width_and_height), first_pass::feet(path)?)?)
        }
        VendorFormat::Stappone => Box::new(Stappone::new(separator, rate, unit, first_pass::soles(path, separator)?)?),
        VendorFormat::Tekscan => Box::new(Tekscan::new(separator, rate, unit)),
        VendorFormat::Emed => Box::new(Emed::new(rate, unit)),
        VendorFormat::Pedar => {
            let insoles = options.layout.as_deref().map(Insoles::load).transpose()?;
            Box::new(NovelAsc::new(rate, unit, None, insoles))
        }
        VendorFormat::Pliance => Box::new(NovelAsc::new(rate, unit, first_pass::places(path)?, None)),
        VendorFormat::Matrix => {
            let [rows, columns] = grid.ok_or_else(|| {
                Error::usage(
                    "a plain matrix does not say how many rows and columns a frame has; give them, as with --grid 31x11",
                )
            })?;
            let pitch_m = pitch_m.map(width_and_height);
            let grid = Grid { rows, columns, pitch_m, area_m2: None };
            Box::new(Matrix::new(separator, grid, rate, unit.unwrap_or_default(), head)?)
        }
    })
}

/// Of cells whose rows and columns have this pitch: that of rows is their height.
fn width_and_height([rows, columns]: [f64; 2]) -> [f64; 2] {
    [columns, rows]
}

impl Source for VendorSource {
    fn taxels(&self) -> &[u32] {
        &self.ids
    }

    fn next_frame(&mut self, frame: &mut Frame) -> Result<bool> {
        let mut scratch = std::mem::replace(&mut self.scratch, Frame::missing(0.0, 0));
        let read = match self.first.take() {
            Some(first) => {
                scratch = first;
                Ok(true)
            }
            None => self.read(&mut scratch),
        };
        if let Ok(true) = read {
            frame.clear();
            frame.t_s = scratch.t_s;
            if self.order.is_empty() {
                frame.values.clone_from(&scratch.values);
            } else {
                frame.values.resize(self.order.len(), RawValue::MISSING);
                for (slot, &place) in frame.values.iter_mut().zip(&self.order) {
                    *slot = scratch.values[place];
                }
            }
        }
        self.scratch = scratch;
        read.map_err(|e| e.at(&self.name))
    }

    fn progress(&self) -> Option<f64> {
        self.lines.progress()
    }

    fn notices(&mut self) -> Vec<String> {
        self.notices.extend(self.skipped.take_notices());
        self.notices.drain(..).map(|what| format!("{}: {what}", self.name)).collect()
    }

    fn losses(&self) -> Vec<String> {
        let own = self.losses.iter().cloned().chain(self.parser.losses());
        own.chain(self.skipped.losses()).map(|loss| format!("{}: {loss}", self.name)).collect()
    }
}
