//! What is said and heard on one line: who is there, at which speed, whether it is the board that the wiring has, and what
//! is wrong where it is not. No I/O, no clock.

use std::sync::Arc;
use std::time::{Duration, Instant};

use super::lines::{BoardState, Shared, Verdict};
use super::merge::BoardFrame;
use crate::error::Error;
use crate::signal::{WiredBoard, Wiring};
use crate::wire::{
    ANY_BOARD, Bits, Command, Corruption, Decoder, Dialogue, Event, Head, Identity, NO_LAYOUT, Outcome, Patience,
    Placed, Status, layout_hash,
};

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
        (talk.bytes, talk.version, talk.board) = (0, None, None);
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
            self.say(&format!("the board does not answer `{}`", word(ended.command)));
        }
        let over = |span: Duration| now >= self.since + span;
        match self.stage {
            Stage::Asking if over(ASKING) => self.probe(0, now),
            Stage::Probing(index) if over(PROBING + bits_take(self.baud)) => self.probe(index + 1, now),
            Stage::GivenUp if over(AGAIN) => self.turn(Stage::Asking, self.task.baud, now),
            Stage::Speaking => self.watch(now),
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
        if now < self.last_frame + SILENCE || self.stopped {
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
                if let Some((ended, Outcome::Refused(status))) = ended.map(|ended| (ended, ended.outcome)) {
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

    /// Counts what was lost before a packet of the board that has an account.
    fn enter(&mut self, head: &Head, placed: &Placed, now: Duration) {
        let Some((board, id)) = self.joined.filter(|(_, id)| *id == head.board) else { return };
        let mut state = self.task.shared.lock();
        state.accounts[board].lost += u64::from(placed.lost);
        self.lost += placed.lost;
        if placed.restarted {
            state.accounts[board].restarts += 1;
            state.say(format!("{}: board {id} has started again", self.task.port));
            drop(state);
            self.clock_begins = true;
            self.doubt(now);
        }
    }

    /// Who is there must be asked for again.
    fn doubt(&mut self, now: Duration) {
        (self.board, self.since) = (None, now);
    }

    /// A board says who it is: whether the wiring has it so, and what it is to do.
    fn identified(&mut self, head: &Head, placed: &Placed, identity: &Identity<'_>, now: Duration) {
        let wiring = Arc::clone(&self.task.wiring);
        let Some(board) = wiring.boards().iter().position(|board| board.id == head.board) else {
            return self.stranger(head.board);
        };
        if let Err(why) = fits(&wiring.boards()[board], identity) {
            self.board = None;
            return self.bad(format!("board {}: {why}", head.board));
        }
        if !self.join(board, head.board) {
            return;
        }
        // A board that stops unasked, and did not start again, was told so by somebody else, or has nothing more to say.
        let stops = identity.request == 0 && !identity.running && self.started && !placed.restarted;
        if stops {
            if !std::mem::replace(&mut self.stopped, true) {
                self.task.shared.lock().accounts[board].state = BoardState::Silent;
                self.say(&format!("board {} has stopped", head.board));
            }
            return;
        }
        self.stopped = false;
        let rate = self.task.rate_mhz.filter(|rate| *rate != identity.rate_mhz);
        if let Some(rate_mhz) = rate {
            self.ask(Command::Rate { rate_mhz }, now);
        }
        if !identity.running {
            self.ask(Command::Start, now);
            self.started = true;
        }
    }

    fn stranger(&mut self, id: u16) {
        self.board = None;
        let ids: Vec<String> = self.task.wiring.boards().iter().map(|board| board.id.to_string()).collect();
        let known =
            if ids.len() == 1 { format!("has board {}", ids[0]) } else { format!("has boards {}", ids.join(", ")) };
        self.bad(format!("board {id} is here, and the wiring {known}; give --wiring a file that has it"));
    }

    /// A board that sends frames and answers nothing is believed as far as its frames go.
    fn take_as_it_is(&mut self, head: &Head, reach: usize, partial: bool) {
        let wiring = Arc::clone(&self.task.wiring);
        let Some(board) = wiring.boards().iter().position(|board| board.id == head.board) else {
            return self.stranger(head.board);
        };
        let wired = wiring.boards()[board].taxels.len();
        if !partial && reach < wired {
            return self.bad(format!("board {} has {reach} channels, and the wiring {wired}", head.board));
        }
        if self.join(board, head.board) {
            let what = "sends frames but answers nothing, so its layout is not checked; does the line lead to it, too?";
            self.say(&format!("board {} {what}", head.board));
        }
    }

    /// The board is right, and heard on this line alone.
    fn join(&mut self, board: usize, id: u16) -> bool {
        let Task { line, port, shared, .. } = &self.task;
        let mut state = shared.lock();
        if let Some(other) = state.claim(board, *line) {
            drop(state);
            self.bad(format!("board {id} is here and on line {} as well; give one of them another id", other + 1));
            return false;
        }
        state.judge(*line, Verdict::Good);
        let account = &mut state.accounts[board];
        account.port = Some(port.clone());
        let (was_away, was_bad) = (self.unplugged.take().is_some(), self.said.take().is_some());
        if was_away && self.joined == Some((board, id)) {
            state.say(format!("{port}: board {id} is back"));
            self.clock_begins = true;
        } else if was_away || was_bad {
            state.say(format!("{port}: board {id} is there"));
        }
        if self.joined != Some((board, id)) {
            if let Some((other, _)) = self.joined {
                state.accounts[other].state = BoardState::Silent;
            }
            // What came before is not in its account.
            (self.joined, self.lost, self.clock_begins) = (Some((board, id)), 0, true);
        }
        drop(state);
        self.board = Some(board);
        true
    }

    /// Hands a frame on, if its board is known.
    fn frame(&mut self, head: &Head, frame: BoardFrame, now: Duration, read_at: Instant) {
        let Some((board, id)) = self.joined.filter(|(_, id)| *id == head.board) else {
            if self.board.is_some() {
                // Another board on this line.
                self.doubt(now);
            }
            return;
        };
        if self.board != Some(board) {
            // It came, and was not used: lost.
            self.lost += 1;
            self.task.shared.lock().accounts[board].lost += 1;
            return;
        }
        if std::mem::take(&mut self.silent) {
            self.task.shared.lock().say(format!("{}: board {id} sends frames again", self.task.port));
        }
        (self.last_frame, self.stopped) = (now, false);
        let (lost, restarted) = (std::mem::take(&mut self.lost), std::mem::take(&mut self.clock_begins));
        self.task.shared.deliver(BoardFrame { board, lost, restarted, ..frame }, read_at);
    }
}

/// Whether `identity` is that of the board that the wiring has.
fn fits(wired: &WiredBoard, identity: &Identity<'_>) -> Result<(), String> {
    let (channels, taxels) = (usize::from(identity.channels), &wired.taxels);
    if channels < taxels.len() {
        return Err(format!("it has {channels} channels, and the wiring {}", taxels.len()));
    }
    if wired.bits.and_then(Bits::new).is_some_and(|bits| bits != identity.bits) {
        let (has, wants) = (identity.bits.count(), wired.bits.unwrap_or(0));
        return Err(format!("its values have {has} bits, and the wiring says {wants}"));
    }
    let padded = taxels.iter().copied().chain(std::iter::repeat(None)).take(channels);
    if identity.layout != NO_LAYOUT && identity.layout != layout_hash(padded) {
        return Err(
            "it is made for another layout than the wiring's; flash it anew, or give --wiring its file".to_owned()
        );
    }
    Ok(())
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
    use crate::wire::{Bits, Identity};

    #[test]
    fn every_speed_is_tried_within_two_seconds() {
        let probing: Duration = USUAL.iter().map(|&baud| PROBING + bits_take(baud)).sum();
        assert!(ASKING + probing < Duration::from_millis(1800), "{:?}", ASKING + probing);
    }

    #[test]
    fn a_board_fits_its_wiring_or_it_is_said_why() {
        let wired = WiredBoard { id: 1, bits: Some(10), port: None, baud: None, taxels: vec![Some(4), None, Some(9)] };
        let hash = |taxels: &[Option<u32>]| layout_hash(taxels.iter().copied());
        let right = Identity {
            request: 1,
            running: true,
            channels: 3,
            bits: Bits::Ten,
            layout: hash(&[Some(4), None, Some(9)]),
            rate_mhz: 0,
            firmware: "",
        };
        assert_eq!(fits(&wired, &right), Ok(()));
        assert_eq!(fits(&wired, &Identity { layout: NO_LAYOUT, ..right }), Ok(()), "it does not know");
        let longer = Identity { channels: 4, layout: hash(&[Some(4), None, Some(9), None]), ..right };
        assert_eq!(fits(&wired, &longer), Ok(()), "channels that nobody wired");
        let why = |identity: Identity<'_>| fits(&wired, &identity).unwrap_err();
        assert!(why(Identity { channels: 2, ..right }).contains("2 channels, and the wiring 3"));
        assert!(why(Identity { bits: Bits::Twelve, ..right }).contains("12 bits"));
        assert!(why(Identity { channels: 4, ..right }).contains("another layout"));
    }
}
