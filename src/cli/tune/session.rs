//! A tuning session: the boards, their sensors and the prompts for the user.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use console::Term;
use somatic::internal::signal::{Axis, Channel};
use somatic::internal::source::BoardState;
use somatic::internal::survey::tuning::Tuning;
use somatic::signal::Wiring;
use somatic::source::{Lines, SerialSource};
use somatic::{Error, Frame, Result};

use crate::cli::stdio::{for_terminal, say};
use crate::cli::words;
use somatic::internal::run::{Arrival, Feed};

/// Boards without progress for this long are given up.
const BOARD_TIMEOUT: Duration = Duration::from_secs(6);
/// Time until frames from before a wiper change have passed.
const SETTLE_TIME: Duration = Duration::from_millis(300);
/// Time limit for restoring the wipers.
const RESTORE_TIMEOUT: Duration = Duration::from_secs(4);
/// Time between updates of the press count.
const UPDATE_INTERVAL: Duration = Duration::from_millis(150);

#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum PhaseLimit {
    After(Duration),
    Enter,
}

#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum PhaseEnd {
    Completed,
    Stopped,
}

#[derive(Clone, Copy)]
pub(super) struct TunedChannel {
    /// The board's number in the wiring, and its id.
    pub(super) board: usize,
    pub(super) id: u16,
    pub(super) channel: u16,
    pub(super) taxel: u32,
    /// The wiper at the start.
    before: u8,
    /// Whether its board has confirmed the wanted wiper.
    pub(super) is_set: bool,
    /// Why not, if it has not.
    pub(super) trouble: Option<&'static str>,
}

pub(super) struct TuningSession {
    lines: Lines,
    feed: Feed,
    stop: Arc<AtomicBool>,
    enter: Option<Receiver<()>>,
    places: Vec<TunedChannel>,
    pub(super) guide: Guide,
}

/// Messages to the user, and a status line at a terminal.
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
            self.shown = self.term.write_str(&for_terminal(&words::clipped(&text(), width), true)).is_ok();
        }
    }
}

impl TuningSession {
    /// For `source`, whose wiring is `wiring` with a wiper on each channel.
    pub(super) fn new(source: SerialSource, wiring: &Wiring, stop: Arc<AtomicBool>) -> Self {
        let mut places = Vec::new();
        for (board, wired) in wiring.boards().iter().enumerate() {
            for (channel, (taxel, wiper)) in (0..).zip(wired.taxels.iter().zip(&wired.wipers)) {
                let taxel = taxel.filter(|&taxel| Channel(taxel).axis() == Axis::Normal);
                if let (Some(taxel), Some(before)) = (taxel, *wiper) {
                    let id = wired.id;
                    places.push(TunedChannel { board, id, channel, taxel, before, is_set: false, trouble: None });
                }
            }
        }
        let lines = source.lines();
        let feed = Feed::start_live(Box::new(source), 64);
        let guide = Guide { term: Term::stderr(), shown: false };
        Self { lines, feed, stop, enter: None, places, guide }
    }

    /// Tuning of the sensors at their first wipers.
    pub(super) fn tuning(&mut self) -> Result<Tuning> {
        let accounts = self.lines.accounts();
        let most = |board: usize| f64::from((1_u32 << accounts[board].bits.unwrap_or(10)) - 1);
        let sensors: Vec<_> = self.places.iter().map(|at| (at.taxel, most(at.board), at.before)).collect();
        let mut tuning = Tuning::new(&sensors);
        self.mark_failed_wipers(&mut tuning);
        if accounts.iter().all(|account| account.state == BoardState::Awaited) {
            return Err(Error::failed("no board answered; `somatic devices` shows the ports"));
        }
        let wipers = self.lines.wipers();
        if self.places.iter().all(|at| wipers[at.board][usize::from(at.channel)].set.is_none()) {
            return Err(Error::failed(
                "no board sets a wiper; does its firmware know the command, and has it potentiometers?",
            ));
        }
        Ok(tuning)
    }

    /// Requests wipers, by sensor index.
    pub(super) fn set(&mut self, wipers: &[(usize, u8)]) {
        for &(index, wiper) in wipers {
            let at = self.places[index];
            self.lines.set_wiper(at.board, usize::from(at.channel), wiper);
        }
    }

    /// Number of wipers that are requested, not confirmed and not given up.
    fn due(&self) -> usize {
        let due = self.lines.wipers();
        due.iter()
            .flatten()
            .filter(|wiper| wiper.wanted.is_some() && wiper.wanted != wiper.set && wiper.trouble.is_none())
            .count()
    }

    fn tell(&mut self) {
        for notice in self.lines.notices() {
            self.guide.say(&notice.to_string());
        }
    }

    /// Waits until all wipers are confirmed or given up.
    pub(super) fn settle(&mut self) -> Result<PhaseEnd> {
        let (mut since, mut before) = (Instant::now(), usize::MAX);
        loop {
            let due = self.due();
            if due < before {
                (since, before) = (Instant::now(), due);
            }
            let over = since.elapsed() > if due == 0 { SETTLE_TIME } else { BOARD_TIMEOUT };
            if self.stop.load(Ordering::Relaxed) {
                return Ok(PhaseEnd::Stopped);
            }
            // A board that was just set up has not sent anything yet.
            let awaited = self.lines.accounts().iter().any(|account| account.state == BoardState::Awaited);
            if over && (!awaited || since.elapsed() > BOARD_TIMEOUT) {
                self.guide.clear();
                return Ok(PhaseEnd::Completed);
            }
            self.guide.show(|| format!("  {due} wipers to set"));
            self.take(|_| ())?;
        }
    }

    /// Takes the frames that arrive within 40 ms.
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
            None | Some(Arrival::Woken) => Ok(()),
        }
    }

    /// Gives frames to `tuning` until the phase is over.
    pub(super) fn observe(
        &mut self,
        until: PhaseLimit,
        tuning: &mut Tuning,
        give: impl Fn(&mut Tuning, &Frame),
    ) -> Result<PhaseEnd> {
        let (start, mut glanced) = (Instant::now(), Instant::now());
        if until == PhaseLimit::Enter {
            // Discards earlier input.
            self.entered();
        }
        while !self.stop.load(Ordering::Relaxed) {
            let over = match until {
                PhaseLimit::After(span) => start.elapsed() >= span,
                PhaseLimit::Enter => self.entered(),
            };
            if over {
                self.guide.clear();
                return Ok(PhaseEnd::Completed);
            }
            self.take(|frame| give(tuning, frame))?;
            if glanced.elapsed() > UPDATE_INTERVAL {
                glanced = Instant::now();
                let left = match until {
                    PhaseLimit::After(span) => {
                        format!("  {:.0} s", span.saturating_sub(start.elapsed()).as_secs_f64().ceil())
                    }
                    PhaseLimit::Enter => String::new(),
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
        Ok(PhaseEnd::Stopped)
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

    pub(super) fn mark_failed_wipers(&mut self, tuning: &mut Tuning) {
        let wipers = self.lines.wipers();
        for (index, at) in self.places.iter().enumerate() {
            let wiper = wipers[at.board][usize::from(at.channel)];
            if wiper.wanted != wiper.set {
                tuning.not_set(index, wiper.set.unwrap_or(at.before));
            }
        }
    }

    pub(super) fn places(&self, wiring: &Wiring) -> Vec<TunedChannel> {
        let wipers = self.lines.wipers();
        debug_assert_eq!(wipers.len(), wiring.boards().len());
        let now = |at: &TunedChannel| {
            let wiper = wipers[at.board][usize::from(at.channel)];
            let is_set = wiper.wanted == wiper.set;
            let trouble = (!is_set).then(|| wiper.trouble.map_or("is not there", |trouble| trouble.word()));
            TunedChannel { is_set, trouble, ..*at }
        };
        self.places.iter().map(now).collect()
    }

    /// Restores the first wipers; returns the result in words.
    pub(super) fn restore_wipers(&mut self) -> String {
        self.guide.clear();
        for at in &self.places {
            self.lines.set_wiper(at.board, usize::from(at.channel), at.before);
        }
        let start = Instant::now();
        while self.due() > 0 && start.elapsed() < RESTORE_TIMEOUT {
            self.tell();
            std::thread::sleep(Duration::from_millis(20));
        }
        self.tell();
        let wipers = self.lines.wipers();
        let other: Vec<String> = self
            .places
            .iter()
            .filter(|at| wipers[at.board][usize::from(at.channel)].set != Some(at.before))
            .map(|at| match wipers[at.board][usize::from(at.channel)].set {
                Some(wiper) => format!("taxel {} has {wiper}", at.taxel),
                None => format!("taxel {} is not known", at.taxel),
            })
            .collect();
        self.close();
        match other.len() {
            0 => "all wipers are as they were at first".to_owned(),
            n if n == self.places.len() => "no wiper could be put back".to_owned(),
            n => format!("all but {n} wipers are as they were at first: {}", other.join(", ")),
        }
    }

    pub(super) fn close(&mut self) {
        self.guide.clear();
        self.lines.close();
        self.tell();
    }
}
