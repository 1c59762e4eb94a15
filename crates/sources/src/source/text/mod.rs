//! Lines of text from boards and programs, live: numbers with anything between them, `name: value`, JSON, tables with a header,
//! frames of several lines.
//!
//! How lines are written is found out from the first second of them ([`recognise`]), and said; options say it instead. Then
//! lines become frames one by one ([`assembler`]). Lines that are anything else are skipped and counted by kind ([`skipped`]).

mod assembler;
mod body;
mod by_map;
mod cells;
mod form;
mod link;
mod opening;
mod options;
mod place;
mod recognise;
mod skipped;
mod splitter;
mod stamps;
#[cfg(feature = "websocket")]
mod web_socket;

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

pub use self::options::{FrameEnd, TextColumns, TextIds, TextOptions, TextTime, TimeColumnName};
pub use self::place::TextPlace;

use self::assembler::Assembler;
use self::form::Form;
use self::link::{Came, Link};
use self::opening::{Opened, listen};
use self::recognise::Known;
use self::splitter::Splitter;
use self::stamps::Stamps;
use super::Source;
use super::map::{self, ArrayMap, MappedTaxels};
use super::sizes::USUAL_PITCH_M;
use super::vendor::VendorOptions;
use crate::error::{Error, Result, failed};
use crate::signal::{Channel, Frame, RawValue};

/// A board is silent after this time without a line, if it is also this many of its usual periods.
const SILENT_AFTER: Duration = Duration::from_secs(1);
const SILENT_PERIODS: f64 = 5.0;

/// Frames of a board or program that sends lines of text.
///
/// Times are those of its column of times, else those of arrival, in seconds since it was opened. A line that is not a frame is
/// skipped and counted; a connection that is gone is opened again. While nothing comes, one frame has all its values
/// [`RawValue::STALE`].
pub struct TextSource {
    name: String,
    link: Link,
    splitter: Splitter,
    assembler: Assembler,
    form: Form,
    taxels: MappedTaxels,
    pitch_m: Option<[f64; 2]>,
    map: Option<ArrayMap>,
    start: Instant,
    stamps: Stamps,
    rate_hz: Option<f64>,
    frames: u64,
    read_at: Option<Instant>,
    /// When the last frame came, and its time; before the first there is none.
    last: Option<(Instant, f64)>,
    is_stale: bool,
    has_stale: bool,
    is_gone: bool,
    is_ended: bool,
    stopped: Arc<AtomicBool>,
    told_restarts: u64,
    notices: Vec<String>,
}

somatic_skin::debug_by_name!(TextSource);

impl TextSource {
    /// Opens `place` and listens until its lines are understood, a second from the first numbers on, as `options` say it: `text`,
    /// `grid`, `pitch_m`, and of standard input `rate_hz`. `tell` is called with what people should know while that takes long.
    ///
    /// # Errors
    /// It cannot be opened; what comes is not text, or not what the options say.
    pub fn open(place: &TextPlace, options: &VendorOptions, tell: &mut dyn FnMut(&str)) -> Result<Self> {
        if options.rate_hz.is_some_and(|rate| !(rate.is_finite() && rate > 0.0)) {
            return Err(Error::usage("--rate is not a frame rate; give a positive number of Hz"));
        }
        if options.rate_hz.is_some() && *place != TextPlace::Stdin {
            return Err(Error::usage("--rate is for recordings; lines that come live are stamped when they arrive"));
        }
        Self::listen(place, Link::open(place)?, options, tell)
    }

    /// Reads `bytes` as lines of text that come all at once.
    ///
    /// # Errors
    /// They are not text, or not what the options say.
    pub fn from_bytes(bytes: impl Into<Vec<u8>>, options: &VendorOptions) -> Result<Self> {
        Self::listen(&TextPlace::Stdin, Link::given(bytes.into()), options, &mut |_| {})
    }

    fn listen(place: &TextPlace, mut link: Link, options: &VendorOptions, tell: &mut dyn FnMut(&str)) -> Result<Self> {
        let start = Instant::now();
        let grid = options.grid.or(options.map.as_ref().and_then(|map| map.grid));
        let grid = grid.map(|[rows, columns]| [rows as usize, columns as usize]);
        let by_map = options.map.as_ref().map(by_map::options_of).transpose()?;
        let is_joined = link.joins_midway();
        let known = Known {
            options: by_map.as_ref().unwrap_or(&options.text),
            grid,
            may_have_grids: options.grid.is_none(),
            is_joined,
            has_rate: options.rate_hz.is_some(),
            decoder: options.map.as_ref().and_then(|map| map.decoder),
            has_axes: options.map.as_ref().is_some_and(|map| map.axes.is_some()),
        };
        let Opened { form, kept, is_ended } = listen(&mut link, place, start, known, tell).map_err(|e| e.at(place))?;
        let taxels = MappedTaxels::new(options.map.as_ref(), form.ids.as_deref(), form.sensors(), None)
            .map_err(|e| e.at(place))?;
        let mut source = Self {
            name: place.to_string(),
            link,
            splitter: Splitter::default(),
            assembler: Assembler::new(form.clone(), is_joined),
            taxels,
            pitch_m: options.pitch_m.or(options.map.as_ref().and_then(|map| map.pitch_m)),
            map: options.map.clone(),
            start,
            stamps: Stamps::default(),
            rate_hz: options.rate_hz,
            frames: 0,
            read_at: None,
            last: None,
            is_stale: false,
            has_stale: false,
            is_gone: false,
            is_ended,
            stopped: Arc::default(),
            told_restarts: 0,
            notices: Vec::new(),
            form,
        };
        source.notices.push(source.understood());
        if let Some(map) = &source.map {
            source.notices.extend(map.notes.iter().map(|note| format!("{}: {note}", map.name)));
            if map.names.is_some() {
                let what = "names of sensors are not read of lines that come live; send them to --source -";
                source.notices.push(format!("{}: {what}", map.name));
            }
        }
        for (at, bytes) in kept {
            source.take(&bytes, at.as_secs_f64());
        }
        if is_ended {
            source.end();
        }
        Ok(source)
    }

    /// What its lines were taken for, on a line.
    #[must_use]
    pub fn understood(&self) -> String {
        let speed = self.link.baud().filter(|_| !self.name.contains('@')).map(|baud| format!(" (at {baud} baud)"));
        let advice = self.form.advice().map_or_else(String::new, |advice| format!("; {advice}"));
        let treatment = self.map.as_ref().map_or_else(String::new, ArrayMap::treatment);
        format!("{}{}{treatment}{advice}", self.form.words(self.rate_hz.is_some()), speed.unwrap_or_default())
    }

    /// Rows and columns of its sensors; one row where it is not known that they are a grid.
    fn size(&self) -> [usize; 2] {
        self.form.grid.unwrap_or([1, Channel::taxels_of(&self.taxels.channels).len()])
    }

    /// The map, if it says that the sensors are pads.
    fn with_pads(&self) -> Option<&ArrayMap> {
        self.map.as_ref().filter(|map| map::body::has_pads(map, self.form.taxels()))
    }

    /// A body for it, a `.glb`: pads, a grid, or a row of sensors, as far apart as the options say, else 10 mm.
    ///
    /// # Errors
    /// Two of its sensors have the same id, or it has too many.
    pub fn body(&self) -> Result<Vec<u8>> {
        let made = match self.with_pads() {
            Some(map) => map::body::glb(map, &self.taxels.channels),
            None => body::glb(&self.taxels.channels, self.size(), self.pitch_m.unwrap_or([USUAL_PITCH_M; 2])),
        };
        made.map_err(|e| e.at(&self.name))
    }

    /// What is to be said of [`TextSource::body`], whose places nobody has measured.
    #[must_use]
    pub fn about_body(&self) -> String {
        if let Some(map) = self.with_pads() {
            return map::body::about(map, &self.taxels.channels);
        }
        let [rows, columns] = self.size();
        let what = match rows {
            1 => format!("a row of {columns} sensors"),
            _ => format!("a grid of {rows} × {columns} sensors"),
        };
        let pitch = match self.pitch_m {
            None => {
                "10 mm apart. This distance is a guess: --pitch sets it, and --body names a body of yours".to_owned()
            }
            Some([rows, columns]) if rows == columns => format!("{} mm apart", rows * 1e3),
            Some([rows, columns]) => format!("{} mm and {} mm apart", rows * 1e3, columns * 1e3),
        };
        format!("a body is made: {what}, {pitch}")
    }

    /// Makes its taxels those of a body that has `taxels`: where neither names nor flags say which they are, they are the body's in
    /// ascending order of their ids.
    ///
    /// # Errors
    /// It has another number of sensors than the body has taxels, or the body lacks a taxel.
    pub fn for_body(mut self, taxels: &[u32]) -> Result<Self> {
        let by_map = self.form.ids.is_none() && self.map.is_some();
        if self.form.ids.is_none() && self.map.as_ref().is_none_or(|map| map.ids.is_none()) {
            let named = MappedTaxels::new(self.map.as_ref(), None, self.taxels.channels.len(), Some(taxels));
            let advice = "--ids says which these are, --columns which columns are sensors";
            self.taxels = named.map_err(|e| failed!("{e}; {advice}").at(&self.name))?;
        }
        let skipped = self.taxels.skip_absent(taxels, by_map, "--ids says which taxels the sensors are");
        self.notices.extend(skipped.map_err(|e| e.at(&self.name))?);
        Ok(self)
    }

    /// Takes `bytes`, which came at `now_s`.
    fn take(&mut self, bytes: &[u8], now_s: f64) {
        let before = self.assembler.ready.len();
        take(&self.link, bytes, &mut self.splitter, &mut self.assembler);
        self.stamp(before, now_s);
    }

    /// Stamps the frames from the one at `before` on, which came at `now_s`.
    fn stamp(&mut self, before: usize, now_s: f64) {
        let ready = &mut self.assembler.ready;
        let count = ready.len() - before;
        if let Some(rate_hz) = self.rate_hz {
            for (frame, _) in ready.iter_mut().skip(before) {
                frame.t_s = self.frames as f64 / rate_hz;
                self.frames += 1;
            }
            return;
        }
        self.stamps.stamp(count, now_s, |index, t_s| {
            let (frame, has_time) = &mut ready[before + index];
            if !*has_time {
                frame.t_s = t_s;
            }
        });
    }

    fn end(&mut self) {
        self.is_ended = true;
        let before = self.assembler.ready.len();
        let assembler = &mut self.assembler;
        self.splitter.flush(&mut |line| assembler.take(line));
        self.assembler.end();
        self.stamp(before, self.start.elapsed().as_secs_f64());
    }

    /// Makes `frame` one in which nothing is known, if none was since the last values.
    fn stale(&mut self, frame: &mut Frame) -> bool {
        let Some((at, t_s)) = self.last else { return false };
        if std::mem::replace(&mut self.is_stale, true) {
            return false;
        }
        frame.clear();
        frame.values.clear();
        frame.values.resize(self.taxels.channels.len(), RawValue::STALE);
        frame.t_s = t_s + at.elapsed().as_secs_f64();
        (self.has_stale, self.read_at) = (true, None);
        true
    }

    fn is_silent(&self) -> bool {
        let usual_s = self.stamps.period_s().unwrap_or(0.0) * SILENT_PERIODS;
        let limit = SILENT_AFTER.max(Duration::try_from_secs_f64(usual_s).unwrap_or(SILENT_AFTER));
        !self.is_stale && self.last.is_some_and(|(at, _)| at.elapsed() > limit)
    }

    fn say(&mut self, what: &str) {
        self.notices.push(what.to_owned());
    }

    /// The next frame that is whole, if one is.
    fn ready(&mut self, frame: &mut Frame) -> bool {
        let Some((mut next, _)) = self.assembler.ready.pop_front() else { return false };
        if let Some(map) = &self.map {
            for value in &mut next.values {
                *value = value.number().map_or(*value, |number| map.value(number));
            }
            self.taxels.arrange(&mut next.values);
        }
        self.assembler.give_back(std::mem::replace(frame, next));
        self.last = Some((Instant::now(), frame.t_s));
        if std::mem::take(&mut self.is_stale) && !self.is_gone {
            self.say("lines come again");
        }
        true
    }
}

/// Gives the lines of `bytes`, which came by `link`, to `assembler`.
fn take(link: &Link, bytes: &[u8], splitter: &mut Splitter, assembler: &mut Assembler) {
    splitter.push(bytes, &mut |line| assembler.take(line));
    if link.is_in_datagrams() {
        splitter.flush(&mut |line| assembler.take(line));
    }
}

impl Source for TextSource {
    fn taxels(&self) -> &[u32] {
        &self.taxels.channels
    }

    fn stop_by(&mut self, stopped: &Arc<AtomicBool>) {
        self.stopped = Arc::clone(stopped);
    }

    fn next_frame(&mut self, frame: &mut Frame) -> Result<bool> {
        loop {
            if self.ready(frame) {
                return Ok(true);
            }
            if self.is_ended || self.stopped.load(Ordering::Relaxed) {
                return Ok(false);
            }
            self.read_at = None;
            match self.link.read() {
                Came::Bytes(count) => {
                    let read_at = Instant::now();
                    self.read_at = Some(read_at);
                    let (before, assembler) = (self.assembler.ready.len(), &mut self.assembler);
                    take(&self.link, self.link.bytes(count), &mut self.splitter, assembler);
                    self.stamp(before, (read_at - self.start).as_secs_f64());
                }
                Came::Nothing if self.is_silent() => {
                    self.say("no lines come");
                    if self.stale(frame) {
                        return Ok(true);
                    }
                }
                Came::Nothing => {}
                Came::Gone => {
                    self.is_gone = true;
                    self.say("gone; waiting for it to come back");
                    if self.splitter.clear() {
                        self.assembler.skipped.add(skipped::Wrong::Torn, "");
                    }
                    self.assembler.join();
                    if self.stale(frame) {
                        return Ok(true);
                    }
                }
                Came::Back => {
                    self.is_gone = false;
                    self.say("is back");
                }
                Came::End => self.end(),
            }
        }
    }

    fn has_stale(&self) -> bool {
        self.has_stale
    }

    fn read_at(&mut self) -> Option<Instant> {
        self.read_at
    }

    fn notices(&mut self) -> Vec<String> {
        let restarts = self.assembler.restarts;
        if restarts > std::mem::replace(&mut self.told_restarts, restarts) && restarts.is_power_of_two() {
            self.say("its time went back; has the board started again?");
        }
        let new = self.assembler.skipped.take_notices();
        self.notices.drain(..).chain(new).map(|what| format!("{}: {what}", self.name)).collect()
    }

    fn losses(&self) -> Vec<String> {
        self.assembler.skipped.losses().into_iter().map(|what| format!("{}: {what}", self.name)).collect()
    }
}
