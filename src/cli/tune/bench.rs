//! Boards on their lines while they are tuned, and the person who presses.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use console::Term;
use somatic::signal::Wiring;
use somatic::source::{BoardState, Lines, SerialSource};
use somatic::survey::tuning::Tuning;
use somatic::{Error, Frame, Result};

use crate::cli::feed::{Arrival, Feed};
use crate::cli::{say, words};

/// Boards that do nothing for so long are not waited for.
const PATIENCE: Duration = Duration::from_secs(6);
/// What is on its way when a tap is set is over after so long.
const SETTLING: Duration = Duration::from_millis(300);
/// How long taps may take to be put back.
const PUTTING_BACK: Duration = Duration::from_secs(4);
/// Between two looks at who was pressed.
const GLANCE: Duration = Duration::from_millis(150);

/// When a phase is over.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Until {
    Over(Duration),
    Enter,
}

/// Whether a phase came to its end.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Went {
    On,
    Stopped,
}

/// Where a sensor is.
#[derive(Clone, Copy)]
pub(super) struct Place {
    /// The board's number in the wiring, and its id.
    pub(super) board: usize,
    pub(super) id: u16,
    pub(super) channel: u16,
    pub(super) taxel: u32,
    /// The tap that it had at first.
    before: u8,
    /// Whether its board has confirmed the tap that it is to have.
    pub(super) is_set: bool,
    /// Why not.
    pub(super) trouble: Option<&'static str>,
}

pub(super) struct Bench {
    lines: Lines,
    feed: Feed,
    stop: Arc<AtomicBool>,
    enter: Option<Receiver<()>>,
    places: Vec<Place>,
    pub(super) guide: Guide,
}

/// What a person is told; at a terminal with a line that changes.
pub(super) struct Guide {
    term: Term,
    shown: bool,
}

impl Guide {
    pub(super) fn say(&mut self, text: &str) {
        self.clear();
        say(text);
    }

    fn clear(&mut self) {
        if std::mem::take(&mut self.shown) {
            let _ = self.term.clear_line();
        }
    }

    fn show(&mut self, text: impl FnOnce() -> String) {
        if self.term.is_term() {
            self.clear();
            let width = usize::from(self.term.size().1).saturating_sub(1);
            self.shown = self.term.write_str(&words::clipped(&text(), width)).is_ok();
        }
    }
}

impl Bench {
    /// For `source`, whose wiring is `wiring` with a tap on each channel.
    pub(super) fn new(source: SerialSource, wiring: &Wiring, stop: Arc<AtomicBool>) -> Self {
        let mut places = Vec::new();
        for (board, wired) in wiring.boards().iter().enumerate() {
            for (channel, (taxel, tap)) in (0..).zip(wired.taxels.iter().zip(&wired.taps)) {
                if let (Some(taxel), Some(before)) = (*taxel, *tap) {
                    let id = wired.id;
                    places.push(Place { board, id, channel, taxel, before, is_set: false, trouble: None });
                }
            }
        }
        let lines = source.lines();
        let feed = Feed::start_live(Box::new(source), 64);
        let guide = Guide { term: Term::stderr(), shown: false };
        Self { lines, feed, stop, enter: None, places, guide }
    }

    /// The sensors, at the taps that they begin with.
    pub(super) fn tuning(&mut self) -> Result<Tuning> {
        let accounts = self.lines.accounts();
        let most = |board: usize| f64::from((1_u32 << accounts[board].bits.unwrap_or(10)) - 1);
        let sensors: Vec<_> = self.places.iter().map(|at| (at.taxel, most(at.board), at.before)).collect();
        let mut tuning = Tuning::new(&sensors);
        self.heed_troubles(&mut tuning);
        if accounts.iter().all(|account| account.state == BoardState::Awaited) {
            return Err(Error::failed("no board is there; `somatic devices` shows the ports"));
        }
        let taps = self.lines.taps();
        if self.places.iter().all(|at| taps[at.board][usize::from(at.channel)].set.is_none()) {
            return Err(Error::failed(
                "no board sets a tap; does its firmware know the command, and has it potentiometers?",
            ));
        }
        Ok(tuning)
    }

    /// Wants the taps `taps` of sensors.
    pub(super) fn set(&mut self, taps: &[(usize, u8)]) {
        for &(index, tap) in taps {
            let at = self.places[index];
            self.lines.set_tap(at.board, usize::from(at.channel), tap);
        }
    }

    /// How many taps are not yet as wanted and not given up.
    fn due(&self) -> usize {
        let due = self.lines.taps();
        due.iter()
            .flatten()
            .filter(|tap| tap.wanted.is_some() && tap.wanted != tap.set && tap.trouble.is_none())
            .count()
    }

    fn tell(&mut self) {
        for notice in self.lines.notices() {
            self.guide.say(&notice.to_string());
        }
    }

    /// Waits until all taps are set, or nothing more is to be waited for.
    pub(super) fn settle(&mut self) -> Result<Went> {
        let (mut since, mut before) = (Instant::now(), usize::MAX);
        loop {
            let due = self.due();
            if due < before {
                (since, before) = (Instant::now(), due);
            }
            let over = since.elapsed() > if due == 0 { SETTLING } else { PATIENCE };
            if self.stop.load(Ordering::Relaxed) {
                return Ok(Went::Stopped);
            }
            // A board that was just set up has not spoken yet.
            let awaited = self.lines.accounts().iter().any(|account| account.state == BoardState::Awaited);
            if over && (!awaited || since.elapsed() > PATIENCE) {
                self.guide.clear();
                return Ok(Went::On);
            }
            self.guide.show(|| format!("  {due} taps to set"));
            self.take(|_| ())?;
        }
    }

    /// Takes what comes next, if something does soon.
    fn take(&mut self, mut each: impl FnMut(&Frame)) -> Result<()> {
        self.tell();
        match self.feed.next(Duration::from_millis(40)) {
            Some(Arrival::Frames(frames, _)) => {
                frames.iter().for_each(&mut each);
                self.feed.give_back(frames);
                Ok(())
            }
            Some(Arrival::Failed(error)) => Err(error),
            Some(Arrival::End(_)) => Err(Error::failed("the lines are closed")),
            None => Ok(()),
        }
    }

    /// Gives frames to `tuning` until the phase is over.
    pub(super) fn listen(
        &mut self,
        until: Until,
        tuning: &mut Tuning,
        give: impl Fn(&mut Tuning, &Frame),
    ) -> Result<Went> {
        let (start, mut glanced) = (Instant::now(), Instant::now());
        if until == Until::Enter {
            // What was typed before is no answer.
            self.entered();
        }
        while !self.stop.load(Ordering::Relaxed) {
            let over = match until {
                Until::Over(span) => start.elapsed() >= span,
                Until::Enter => self.entered(),
            };
            if over {
                self.guide.clear();
                return Ok(Went::On);
            }
            self.take(|frame| give(tuning, frame))?;
            if glanced.elapsed() > GLANCE {
                glanced = Instant::now();
                let left = match until {
                    Until::Over(span) => {
                        format!("  {:.0} s", span.saturating_sub(start.elapsed()).as_secs_f64().ceil())
                    }
                    Until::Enter => String::new(),
                };
                self.guide.show(|| {
                    let awaited: Vec<String> = tuning.awaited().map(|id| id.to_string()).collect();
                    match awaited.len() {
                        0 => format!("{left}  all pressed"),
                        some => format!("{left}  {some} not pressed yet: {}", awaited.join(", ")),
                    }
                });
            }
        }
        Ok(Went::Stopped)
    }

    /// Whether Enter was pressed since the last call.
    fn entered(&mut self) -> bool {
        let enter = self.enter.get_or_insert_with(|| {
            let (pressed, enter) = channel();
            std::thread::spawn(move || {
                let mut line = String::new();
                while std::io::stdin().read_line(&mut line).is_ok_and(|count| count > 0) && pressed.send(()).is_ok() {
                    line.clear();
                }
            });
            enter
        });
        enter.try_iter().count() > 0
    }

    /// Tells `tuning` which taps are not set, and says so of boards that have gone.
    pub(super) fn heed_troubles(&mut self, tuning: &mut Tuning) {
        let taps = self.lines.taps();
        for (index, at) in self.places.iter().enumerate() {
            let tap = taps[at.board][usize::from(at.channel)];
            if tap.wanted != tap.set {
                tuning.not_set(index, tap.set.unwrap_or(at.before));
            }
        }
    }

    /// Where the sensors are, and whether their taps are as wanted.
    pub(super) fn places(&self, wiring: &Wiring) -> Vec<Place> {
        let taps = self.lines.taps();
        debug_assert_eq!(taps.len(), wiring.boards().len());
        let now = |at: &Place| {
            let tap = taps[at.board][usize::from(at.channel)];
            let is_set = tap.wanted == tap.set;
            let trouble = (!is_set).then(|| tap.trouble.map_or("is not there", |trouble| trouble.word()));
            Place { is_set, trouble, ..*at }
        };
        self.places.iter().map(now).collect()
    }

    /// Puts all taps back as they were at first; in words, what came of it.
    pub(super) fn put_back(&mut self) -> String {
        self.guide.clear();
        for at in &self.places {
            self.lines.set_tap(at.board, usize::from(at.channel), at.before);
        }
        let start = Instant::now();
        while self.due() > 0 && start.elapsed() < PUTTING_BACK {
            self.tell();
            std::thread::sleep(Duration::from_millis(20));
        }
        self.tell();
        let taps = self.lines.taps();
        let other: Vec<String> = self
            .places
            .iter()
            .filter(|at| taps[at.board][usize::from(at.channel)].set != Some(at.before))
            .map(|at| match taps[at.board][usize::from(at.channel)].set {
                Some(tap) => format!("taxel {} has {tap}", at.taxel),
                None => format!("taxel {} is not known", at.taxel),
            })
            .collect();
        self.close();
        match other.len() {
            0 => "all taps are as they were at first".to_owned(),
            n if n == self.places.len() => "no tap could be put back".to_owned(),
            n => format!("all but {n} taps are as they were at first: {}", other.join(", ")),
        }
    }

    pub(super) fn close(&mut self) {
        self.guide.clear();
        self.lines.close();
        self.tell();
    }
}
