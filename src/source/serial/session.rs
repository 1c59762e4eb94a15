//! What is said and heard on one line: who is there, at which speed, whether it is the board that the wiring has, and what
//! is wrong where it is not. No I/O, no clock.

mod board;
mod taps;

use std::sync::Arc;
use std::time::{Duration, Instant};

use super::lines::{BoardState, Shared, Verdict};
use super::merge::BoardFrame;
use crate::error::Error;
use crate::signal::Wiring;
use crate::wire::{ANY_BOARD, Command, Corruption, Decoder, Dialogue, Event, Outcome, Patience, Status};

/// The speeds that a line is tried at, baud, the likeliest first.
const USUAL: [u32; 10] = [57_600, 115_200, 921_600, 230_400, 1_000_000, 460_800, 2_000_000, 38_400, 19_200, 9_600];
/// How long a board may take to answer at the speed that it should have, and how long between two askings of its name.
const ASKING: Duration = Duration::from_millis(400);
/// At each other speed: so long, and the time that a frame under way and an answer take on the line.
const PROBING: Duration = Duration::from_millis(70);
/// Bits on the line of a frame under way and an answer.
const PROBED_BITS: u32 = 1500;
/// After so long, a line on which nobody was understood is tried anew.
const AGAIN: Duration = Duration::from_secs(5);
/// A board that sends nothing for so long is silent.
const SILENCE: Duration = Duration::from_secs(1);
/// A board that sends frames and answers nothing for so long is taken as it is.
const UNHEARD: Duration = Duration::from_millis(1500);
/// An answer is waited for so long before a command is sent again.
const PATIENCE: Patience = Patience { wait: Duration::from_millis(120), tries: 4 };

#[derive(Clone, Copy, Debug, PartialEq)]
enum Stage {
    /// At the speed that it should have.
    Asking,
    /// At the n-th usual speed.
    Probing(usize),
    /// Nobody was understood.
    GivenUp,
    /// Packets of a board come.
    Speaking,
}

/// What a session is to do.
pub(super) struct Task {
    /// The line's number.
    pub(super) line: usize,
    /// The port's name, for messages.
    pub(super) port: String,
    /// The speed that it should have, baud.
    pub(super) baud: u32,
    /// Whether the user said so; else another is taken where a board speaks at it.
    pub(super) fixed: bool,
    /// The rate that boards are to send at, thousandths of a hertz.
    pub(super) rate_mhz: Option<u32>,
    pub(super) wiring: Arc<Wiring>,
    pub(super) shared: Arc<Shared>,
}

pub(super) struct Session {
    decoder: Decoder,
    talk: Talk,
}

struct Talk {
    task: Task,
    dialogue: Dialogue,
    /// What the line is set to, baud.
    baud: u32,
    stage: Stage,
    /// When the stage began.
    since: Duration,
    /// Bytes since the line was opened that were no echo.
    bytes: u64,
    version: Option<u8>,
    /// What was said last of a line on which nobody is understood.
    said: Option<String>,
    /// The board whose identity is known to be right, by its place in the wiring.
    board: Option<usize>,
    /// The board that has an account, whether or not its identity is known at the moment, and its id.
    joined: Option<(usize, u16)>,
    started: bool,
    /// Whether it is to be started once its taps are set.
    starts: bool,
    stopped: bool,
    silent: bool,
    last_frame: Duration,
    unplugged: Option<Duration>,
    asked: Duration,
    clock_begins: bool,
    lost: u32,
}

impl Session {
    pub(super) fn new(task: Task) -> Self {
        let baud = task.baud;
        let talk = Talk {
            task,
            dialogue: Dialogue::new(ANY_BOARD, PATIENCE, 0),
            baud,
            stage: Stage::Asking,
            since: Duration::ZERO,
            bytes: 0,
            version: None,
            said: None,
            board: None,
            joined: None,
            started: false,
            starts: false,
            stopped: false,
            silent: false,
            last_frame: Duration::ZERO,
            unplugged: None,
            asked: Duration::ZERO,
            clock_begins: false,
            lost: 0,
        };
        Self { decoder: Decoder::new(), talk }
    }

    pub(super) fn task(&self) -> &Task {
        &self.talk.task
    }

    /// The speed that the line is to have, baud.
    pub(super) fn baud(&self) -> u32 {
        self.talk.baud
    }

    /// The line was opened.
    pub(super) fn opened(&mut self, now: Duration) {
        self.decoder.rejoin();
        let talk = &mut self.talk;
        (talk.bytes, talk.version, talk.board, talk.starts) = (0, None, None, false);
        talk.last_frame = now;
        talk.turn(Stage::Asking, talk.task.baud, now);
    }

    /// The line has gone, or cannot be opened, which is only said once: `why`.
    pub(super) fn gone(&mut self, now: Duration, why: impl FnOnce() -> Error) {
        let talk = &mut self.talk;
        if talk.unplugged.is_some() {
            return;
        }
        talk.unplugged = Some(now);
        let why = why();
        let mut state = talk.task.shared.lock();
        state.release(talk.task.line);
        match talk.joined {
            Some((board, _)) => {
                state.accounts[board].state = BoardState::Unplugged;
                state.accounts[board].unplugs += 1;
                state.say(format!("{}: unplugged; waiting for it to come back", talk.task.port));
            }
            None => state.judge(talk.task.line, Verdict::Bad(why)),
        }
        drop(state);
        talk.task.shared.arrived.notify_all();
    }

    /// Bytes came, the last of them read at `read_at`, which is `now`.
    pub(super) fn hear(&mut self, bytes: &[u8], now: Duration, read_at: Instant) {
        self.talk.bytes += bytes.len() as u64;
        let baud = self.talk.baud;
        self.decoder.push(bytes, |event| self.talk.on(&event, now, read_at));
        if self.talk.baud != baud {
            self.decoder.rejoin();
        }
    }

    /// Does what is due at `now`. The speed may be another then.
    pub(super) fn tend(&mut self, now: Duration) {
        let baud = self.talk.baud;
        self.talk.tend(now);
        if self.talk.baud != baud {
            self.decoder.rejoin();
        }
    }

    /// The bytes to send at `now`.
    pub(super) fn send(&mut self, now: Duration) -> Option<&[u8]> {
        self.talk.dialogue.send(now)
    }

    /// The bytes that end it: a board that was started is stopped.
    pub(super) fn farewell(&mut self, now: Duration) -> Option<&[u8]> {
        let talk = &mut self.talk;
        if !(talk.started && talk.board.is_some()) {
            return None;
        }
        talk.dialogue = Dialogue::new(ANY_BOARD, PATIENCE, talk.request(now));
        talk.dialogue.ask(Command::Stop);
        talk.dialogue.send(now)
    }
}

impl Talk {
    /// Another number for requests to begin with, so that no late answer is taken for a new one.
    fn request(&self, now: Duration) -> u8 {
        (now.as_millis() / 10) as u8
    }

    fn turn(&mut self, stage: Stage, baud: u32, now: Duration) {
        (self.stage, self.baud, self.since) = (stage, baud, now);
        self.dialogue = Dialogue::new(ANY_BOARD, PATIENCE, self.request(now));
        if stage != Stage::GivenUp {
            self.ask(Command::Identify, now);
        }
    }

    fn ask(&mut self, command: Command, now: Duration) {
        self.asked = now;
        // More than a dialogue holds are never asked.
        self.dialogue.ask(command);
    }

    fn bad(&mut self, why: String) {
        if self.said.as_ref() != Some(&why) {
            let error = Error::failed(why.clone()).at(&self.task.port);
            self.task.shared.lock().judge(self.task.line, Verdict::Bad(error));
            self.task.shared.arrived.notify_all();
            self.said = Some(why);
        }
    }

    fn say(&self, what: &str) {
        self.task.shared.lock().say(format!("{}: {what}", self.task.port));
    }

    fn tend(&mut self, now: Duration) {
        if let Some(ended) = self.dialogue.give_up(now)
            && ended.command != Command::Identify
            && self.stage == Stage::Speaking
        {
            if matches!(ended.command, Command::Tap { .. }) {
                return self.tap_ended(ended);
            }
            self.say(&format!("the board does not answer `{}`", word(ended.command)));
        }
        let over = |span: Duration| now >= self.since + span;
        match self.stage {
            Stage::Asking if over(ASKING) => self.probe(0, now),
            Stage::Probing(index) if over(PROBING + bits_take(self.baud)) => self.probe(index + 1, now),
            Stage::GivenUp if over(AGAIN) => self.turn(Stage::Asking, self.task.baud, now),
            Stage::Speaking => {
                self.tune(now);
                self.watch(now);
            }
            _ => {}
        }
    }

    /// Tries the next usual speed, from the n-th on; gives up after the last.
    fn probe(&mut self, from: usize, now: Duration) {
        match (from..USUAL.len()).find(|&index| USUAL[index] != self.task.baud) {
            Some(index) => self.turn(Stage::Probing(index), USUAL[index], now),
            None => {
                self.turn(Stage::GivenUp, self.task.baud, now);
                self.nobody();
            }
        }
    }

    /// Nobody is understood at any speed.
    fn nobody(&mut self) {
        let baud = self.task.baud;
        if let Some(version) = self.version {
            self.bad(format!("the board speaks version {version} of the protocol; this program speaks version 1"));
        } else if self.bytes > 0 {
            self.bad(format!(
                "something sends bytes, but no board is understood at {baud} baud or any usual rate; \
                 is it another device?"
            ));
        } else {
            // It may be without power yet: not an end, even where it is the only one.
            let why = format!(
                "nothing answers at {baud} baud or any usual rate; is the board powered, and the cable right? Waiting for it"
            );
            if self.said.as_ref() != Some(&why) {
                self.say(&why);
                self.said = Some(why);
            }
        }
    }

    /// A board is there: whether it still sends.
    fn watch(&mut self, now: Duration) {
        let waits = now.saturating_sub(self.asked) >= ASKING && self.dialogue.is_idle();
        if self.board.is_none() {
            if waits {
                self.ask(Command::Identify, now);
            }
            return;
        }
        // A board that is started once its taps are set has nothing to send yet.
        if now < self.last_frame + SILENCE || self.stopped || self.starts {
            return;
        }
        if !self.silent {
            self.silent = true;
            if let Some((board, id)) = self.joined {
                let mut state = self.task.shared.lock();
                state.accounts[board].state = BoardState::Silent;
                state.say(format!("{}: board {id} sends no frames", self.task.port));
            }
        }
        if waits {
            self.ask(Command::Identify, now);
        }
    }

    fn on(&mut self, event: &Event<'_>, now: Duration, read_at: Instant) {
        match event {
            Event::Corrupt { why, .. } => {
                if let Corruption::Version(version) = why {
                    self.version = Some(*version);
                }
                if let Some((board, _)) = self.joined
                    && *why != Corruption::Joined
                {
                    self.task.shared.lock().accounts[board].corrupt += 1;
                }
            }
            // What we say ourselves, from a line that echoes.
            Event::Command { .. } => self.bytes = 0,
            Event::Frame { head, placed, .. }
            | Event::Identity { head, placed, .. }
            | Event::Answer { head, placed, .. } => {
                if !self.understood(now) {
                    return;
                }
                self.enter(head, placed, now);
                if let Event::Identity { identity, .. } = event {
                    self.identified(head, placed, identity, now);
                }
                if let Event::Frame { values, .. } = event {
                    if self.board.is_none() && now >= self.since + UNHEARD {
                        self.take_as_it_is(head, values.reach(), values.is_partial());
                    }
                    let frame = BoardFrame {
                        board: 0,
                        board_us: placed.time_us,
                        arrived_s: now.as_secs_f64(),
                        lost: 0,
                        restarted: false,
                        partial: values.is_partial(),
                        values: values.iter().collect(),
                    };
                    self.frame(head, frame, now, read_at);
                }
                let ended = self.dialogue.hear(event);
                if let Some(ended) = ended.filter(|ended| matches!(ended.command, Command::Tap { .. })) {
                    self.tap_ended(ended);
                } else if let Some((ended, Outcome::Refused(status))) = ended.map(|ended| (ended, ended.outcome)) {
                    let why = match status {
                        Status::Unknown => "does not know",
                        _ => "refuses",
                    };
                    self.say(&format!("board {} {why} `{}`", head.board, word(ended.command)));
                }
            }
        }
    }

    /// A packet of a board came. Whether it counts.
    fn understood(&mut self, now: Duration) -> bool {
        if self.baud != self.task.baud {
            let (found, own) = (self.baud, self.task.baud);
            if self.task.fixed {
                self.bad(format!(
                    "the board speaks at {found} baud, not {own}; write serial:{}@{found}",
                    self.task.port
                ));
                self.turn(Stage::GivenUp, own, now);
                return false;
            }
            self.task.baud = found;
            self.say(&format!("the board speaks at {found} baud; taken instead of {own}"));
        }
        if self.stage != Stage::Speaking {
            (self.stage, self.since) = (Stage::Speaking, now);
        }
        true
    }
}

fn bits_take(baud: u32) -> Duration {
    Duration::from_secs(1) * PROBED_BITS / baud.max(1)
}

fn word(command: Command) -> &'static str {
    match command {
        Command::Identify => "identify",
        Command::Rate { .. } => "rate",
        Command::Tap { .. } => "tap",
        Command::Start => "start",
        Command::Stop => "stop",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_speed_is_tried_within_two_seconds() {
        let probing: Duration = USUAL.iter().map(|&baud| PROBING + bits_take(baud)).sum();
        assert!(ASKING + probing < Duration::from_millis(1800), "{:?}", ASKING + probing);
    }
}
