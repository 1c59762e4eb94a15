//! Listens until it is known how lines are written.

use std::time::{Duration, Instant};

use super::form::{Form, short};
use super::link::{Came, Link};
use super::place::TextPlace;
use super::recognise::{Heard, Kind, Known, kind, recognise};
use super::splitter::{Line, Splitter};
use crate::error::{Error, Result, failed};

/// How long is listened from the first numbers on.
const LISTEN: Duration = Duration::from_secs(1);
/// The same where there were few of them, or where it is not clear yet how many lines are a frame.
const LISTEN_LONGER: Duration = Duration::from_secs(3);
/// Lines of numbers that suffice.
const ENOUGH_LINES: usize = 8;
/// Lines that suffice however soon they came.
const MOST_LINES: usize = 2048;
/// Bytes that are kept while it is listened.
const MOST_BYTES: usize = 16 << 20;
/// The silence after which a message says so.
const QUIET: Duration = Duration::from_secs(2);
/// Bytes that decide whether a source is text.
const SAMPLE_BYTES: usize = 200;
/// The longest wait for them.
const SAMPLE: Duration = Duration::from_millis(1500);

/// What was heard while it was found out how lines are written: bytes that came at once, and when.
pub(super) type Kept = Vec<(Duration, Vec<u8>)>;

/// How lines are written, and what came of them so far.
pub(super) struct Opened {
    pub(super) form: Form,
    pub(super) kept: Kept,
    /// Whether all has come.
    pub(super) is_ended: bool,
}

struct Listening<'a> {
    link: &'a mut Link,
    place: &'a TextPlace,
    start: Instant,
    splitter: Splitter,
    lines: Vec<Heard>,
    kept: Kept,
    bytes: usize,
    /// When the first bytes at this speed came.
    since: Option<Duration>,
    /// When the first line of numbers came, and how many there are.
    first_numbers: Option<Duration>,
    numbers: usize,
    others: usize,
    is_quiet_said: bool,
    are_words_said: bool,
}

/// Listens to `link`, which is called `place`, until its lines are understood. Times count from `start`; `tell` is called with what
/// people should know while nothing is understood yet.
///
/// # Errors
/// What comes is not text, holds no numbers, or is not what the flags say.
pub(super) fn listen(
    link: &mut Link,
    place: &TextPlace,
    start: Instant,
    known: Known<'_>,
    tell: &mut dyn FnMut(&str),
) -> Result<Opened> {
    let mut listening = Listening {
        link,
        place,
        start,
        splitter: Splitter::default(),
        lines: Vec::new(),
        kept: Vec::new(),
        bytes: 0,
        since: None,
        first_numbers: None,
        numbers: 0,
        others: 0,
        is_quiet_said: false,
        are_words_said: false,
    };
    let is_ended = listening.until_enough(tell)?;
    let form = recognise(&listening.lines, known)?;
    Ok(Opened { form, kept: listening.kept, is_ended })
}

impl Listening<'_> {
    /// Whether the input has ended.
    fn until_enough(&mut self, tell: &mut dyn FnMut(&str)) -> Result<bool> {
        loop {
            match self.link.read() {
                Came::Bytes(count) => {
                    let now = self.start.elapsed();
                    let bytes = self.link.bytes(count).to_vec();
                    self.take(bytes, now);
                    self.check_text(now, tell)?;
                }
                Came::Nothing => {
                    let now = self.start.elapsed();
                    if self.bytes == 0 && now > QUIET && !std::mem::replace(&mut self.is_quiet_said, true) {
                        tell(&format!(
                            "{}: nothing comes yet; is the board on, and does it send? Waiting for it",
                            self.place
                        ));
                    }
                    if self.bytes > 0 {
                        self.check_text(now, tell)?;
                    }
                }
                Came::Gone => {
                    tell(&format!("{}: gone; waiting for it to come back", self.place));
                    self.begin_anew();
                }
                Came::Back => tell(&format!("{}: is back", self.place)),
                Came::End => {
                    let now = self.start.elapsed();
                    self.flush(now);
                    if self.lines.iter().all(|line| line.text.is_empty()) && self.bytes == 0 {
                        return Err(Error::failed("the input has ended without a line"));
                    }
                    return Ok(true);
                }
            }
            if self.is_enough(self.start.elapsed()) {
                return Ok(false);
            }
        }
    }

    fn begin_anew(&mut self) {
        self.splitter.clear();
        self.lines.clear();
        self.kept.clear();
        (self.bytes, self.numbers, self.others) = (0, 0, 0);
        (self.since, self.first_numbers) = (None, None);
    }

    fn take(&mut self, bytes: Vec<u8>, now: Duration) {
        self.bytes += bytes.len();
        self.since.get_or_insert(now);
        let before = self.lines.len();
        let lines = &mut self.lines;
        self.splitter.push(&bytes, &mut |line| lines.extend(heard(line, now)));
        self.kept.push((now, bytes));
        if self.link.is_in_datagrams() {
            self.flush(now);
        }
        self.count(before, now);
    }

    fn flush(&mut self, now: Duration) {
        let before = self.lines.len();
        let lines = &mut self.lines;
        self.splitter.flush(&mut |line| lines.extend(heard(line, now)));
        self.count(before, now);
    }

    /// Counts the lines from the one at `before` on.
    fn count(&mut self, before: usize, now: Duration) {
        for line in &self.lines[before..] {
            match kind(&line.text) {
                Kind::Numbers | Kind::Pairs | Kind::Json => {
                    self.numbers += 1;
                    self.first_numbers.get_or_insert(now);
                }
                Kind::Blank | Kind::Words if self.numbers > 0 => self.others += 1,
                Kind::Blank | Kind::Words => {}
            }
        }
    }

    fn is_enough(&self, now: Duration) -> bool {
        let Some(first) = self.first_numbers else { return self.lines.len() > MOST_LINES || self.bytes > MOST_BYTES };
        // Frames of several lines are recognised by two ends.
        let is_unclear = self.others == 1 || self.numbers < ENOUGH_LINES;
        let listen = if is_unclear { LISTEN_LONGER } else { LISTEN };
        (now >= first + listen && self.numbers > 1) || self.lines.len() > MOST_LINES || self.bytes > MOST_BYTES
    }

    /// Whether what came is text; if not, the next speed is tried.
    fn check_text(&mut self, now: Duration, tell: &mut dyn FnMut(&str)) -> Result<()> {
        let Some(since) = self.since.filter(|_| self.numbers == 0) else { return Ok(()) };
        if self.bytes < SAMPLE_BYTES && now < since + SAMPLE {
            return Ok(());
        }
        let sample = self.kept.iter().flat_map(|(_, bytes)| bytes).rev().take(4 * SAMPLE_BYTES);
        let is_text = |byte: &&u8| byte.is_ascii_graphic() || byte.is_ascii_whitespace();
        let (total, text) = (sample.clone().count(), sample.filter(is_text).count());
        if 10 * text < 9 * total {
            return self.not_text(tell);
        }
        if now > since + LISTEN_LONGER && !std::mem::replace(&mut self.are_words_said, true) {
            let first = self.lines.iter().find(|line| !line.text.is_empty()).map_or("", |line| &line.text);
            tell(&format!(
                "{}: text comes, but no numbers yet, such as `512,300,7`; the first line is `{}`",
                self.place,
                short(first)
            ));
        }
        Ok(())
    }

    fn not_text(&mut self, tell: &mut dyn FnMut(&str)) -> Result<()> {
        let was = self.link.baud();
        if self.link.next_baud() {
            self.begin_anew();
            if let (Some(was), Some(next)) = (was, self.link.baud()) {
                tell(&format!("{}: no text at {was} baud; trying {next}", self.place));
            }
            return Ok(());
        }
        Err(match was {
            Some(baud) => failed!(
                "bytes come at {baud} baud, but they are not text; does the board send at another speed (text:PORT@9600), or speak \
                 the protocol of --source serial:?"
            ),
            None => Error::failed("the input is not text; send lines of numbers, such as `512,300,7`"),
        })
    }
}

fn heard(line: Line<'_>, at: Duration) -> Option<Heard> {
    match line {
        Line::Text(text) => Some(Heard { text: text.to_owned(), at }),
        // It is counted when lines are read.
        Line::Garbled | Line::Long => None,
    }
}
