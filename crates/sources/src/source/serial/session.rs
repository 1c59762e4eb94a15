//! The state machine of one line: finds the board and its speed, checks it against the wiring, and reports problems.
//! No I/O, no clock.

mod board_checks;
mod text_heard;
mod wipers;

use std::sync::Arc;
use std::time::{Duration, Instant};

use self::text_heard::TextHeard;
use super::super::boards::{BoardFrame, BoardState, Shared, Verdict};
use crate::error::Error;
use crate::signal::{RawValue, Wiring};
use crate::wire::{ANY_BOARD, Command, Corruption, Decoder, Dialogue, Event, Outcome, RetryPolicy, Status};

/// The baud rates to try, most likely first.
const COMMON_BAUDS: [u32; 10] =
    [57_600, 115_200, 921_600, 230_400, 1_000_000, 460_800, 2_000_000, 38_400, 19_200, 9_600];
/// Timeout of an answer at the expected baud rate, and interval of identification requests.
const IDENTIFY_TIMEOUT: Duration = Duration::from_millis(400);
/// Timeout at other baud rates, beside the line time of [`PROBE_BITS`].
const PROBE_TIMEOUT: Duration = Duration::from_millis(70);
/// Bits on the line of a frame being sent and an answer.
const PROBE_BITS: u32 = 1500;
/// Time after which a line without a board is probed again.
const PROBE_INTERVAL: Duration = Duration::from_secs(5);
/// A board that sends no frames for this long is silent.
const SILENT_AFTER: Duration = Duration::from_secs(1);
/// A board that sends frames but does not answer for this long is accepted without identification.
const ACCEPT_AFTER: Duration = Duration::from_millis(1500);
const RETRY: RetryPolicy = RetryPolicy { wait: Duration::from_millis(120), tries: 4 };

#[derive(Clone, Copy, Debug, PartialEq)]
enum Stage {
    /// Asking for the identity at the expected baud rate.
    Identifying,
    /// Probing the n-th common baud rate.
    Probing(usize),
    /// No board was found at any baud rate.
    NothingFound,
    /// A board sends packets.
    Speaking,
}

pub(super) struct LineConfig {
    pub(super) line: usize,
    pub(super) port: String,
    pub(super) baud: u32,
    /// Whether the user has set the baud rate; if not, another one is accepted.
    pub(super) fixed: bool,
    /// The frame rate to set, mHz.
    pub(super) rate_mhz: Option<u32>,
    pub(super) wiring: Arc<Wiring>,
    pub(super) shared: Arc<Shared>,
}

pub(super) struct Session {
    decoder: Decoder,
    line: LineState,
}

struct LineState {
    config: LineConfig,
    dialogue: Dialogue,
    baud: u32,
    stage: Stage,
    since: Duration,
    /// Bytes since the line was opened, without echoes.
    bytes: u64,
    version: Option<u8>,
    text: TextHeard,
    /// The last message about a line without a usable board.
    said: Option<String>,
    /// The identified board, as an index in the wiring.
    board: Option<usize>,
    /// The board whose frames are counted, even while its identity is to be confirmed, and its id.
    joined: Option<(usize, u16)>,
    started: bool,
    /// Whether to start it once its wipers are set.
    starts: bool,
    stopped: bool,
    silent: bool,
    last_frame: Duration,
    unplugged: Option<Duration>,
    asked: Duration,
    clock_restarted: bool,
    lost: u32,
}

impl Session {
    pub(super) fn new(config: LineConfig) -> Self {
        let baud = config.baud;
        let line = LineState {
            config,
            dialogue: Dialogue::new(ANY_BOARD, RETRY, 0),
            baud,
            stage: Stage::Identifying,
            since: Duration::ZERO,
            bytes: 0,
            version: None,
            text: TextHeard::default(),
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
            clock_restarted: false,
            lost: 0,
        };
        Self { decoder: Decoder::new(), line }
    }

    pub(super) fn config(&self) -> &LineConfig {
        &self.line.config
    }

    pub(super) fn baud(&self) -> u32 {
        self.line.baud
    }

    /// Call it after the port was opened.
    pub(super) fn opened(&mut self, now: Duration) {
        self.decoder.rejoin();
        let line = &mut self.line;
        (line.bytes, line.version, line.board, line.starts) = (0, None, None, false);
        line.last_frame = now;
        line.set_stage(Stage::Identifying, line.config.baud, now);
    }

    /// Call it when the port is gone or cannot be opened; `why` is reported once.
    pub(super) fn gone(&mut self, now: Duration, why: impl FnOnce() -> Error) {
        let line = &mut self.line;
        if line.unplugged.is_some() {
            return;
        }
        line.unplugged = Some(now);
        let why = why();
        let mut state = line.config.shared.lock();
        state.release(line.config.line);
        match line.joined {
            Some((board, _)) => {
                state.accounts[board].state = BoardState::Unplugged;
                state.accounts[board].unplugs += 1;
                state.notify(format!("{}: unplugged; waiting for it to come back", line.config.port));
            }
            None => state.set_verdict(line.config.line, Verdict::Bad(why)),
        }
        drop(state);
        line.config.shared.arrived.notify_all();
    }

    /// Handles bytes, the last of them read at `read_at`, which is `now`.
    pub(super) fn receive(&mut self, bytes: &[u8], now: Duration, read_at: Instant) {
        self.line.bytes += bytes.len() as u64;
        let baud = self.line.baud;
        if self.line.stage != Stage::Speaking {
            self.line.text.hear(bytes, baud);
        }
        self.decoder.push(bytes, |event| self.line.on(&event, now, read_at));
        if self.line.baud != baud {
            self.decoder.rejoin();
        }
    }

    /// Does what is due at `now`; the baud rate may change.
    pub(super) fn poll(&mut self, now: Duration) {
        let baud = self.line.baud;
        self.line.poll(now);
        if self.line.baud != baud {
            self.decoder.rejoin();
        }
    }

    pub(super) fn send(&mut self, now: Duration) -> Option<&[u8]> {
        self.line.dialogue.send(now)
    }

    /// The command that stops a board that was started.
    pub(super) fn stop_command(&mut self, now: Duration) -> Option<&[u8]> {
        let line = &mut self.line;
        if !(line.started && line.board.is_some()) {
            return None;
        }
        line.dialogue = Dialogue::new(ANY_BOARD, RETRY, line.request(now));
        line.dialogue.ask(Command::Stop);
        line.dialogue.send(now)
    }
}

impl LineState {
    /// The first request number, which varies so that a late answer is not mistaken for a new one.
    fn request(&self, now: Duration) -> u8 {
        (now.as_millis() / 10) as u8
    }

    fn set_stage(&mut self, stage: Stage, baud: u32, now: Duration) {
        (self.stage, self.baud, self.since) = (stage, baud, now);
        self.dialogue = Dialogue::new(ANY_BOARD, RETRY, self.request(now));
        if stage != Stage::NothingFound {
            self.ask(Command::Identify, now);
        }
    }

    fn ask(&mut self, command: Command, now: Duration) {
        self.asked = now;
        // The dialogue's queue is never full.
        self.dialogue.ask(command);
    }

    fn bad(&mut self, why: String) {
        if self.said.as_ref() != Some(&why) {
            let error = Error::failed(why.clone()).at(&self.config.port);
            self.config.shared.lock().set_verdict(self.config.line, Verdict::Bad(error));
            self.config.shared.arrived.notify_all();
            self.said = Some(why);
        }
    }

    fn notify(&self, what: &str) {
        self.config.shared.lock().notify(format!("{}: {what}", self.config.port));
    }

    fn poll(&mut self, now: Duration) {
        if let Some(ended) = self.dialogue.give_up(now)
            && ended.command != Command::Identify
            && self.stage == Stage::Speaking
        {
            if matches!(ended.command, Command::Wiper { .. }) {
                return self.wiper_ended(ended);
            }
            self.notify(&format!("the board does not answer `{}`", word(ended.command)));
        }
        let over = |span: Duration| now >= self.since + span;
        match self.stage {
            Stage::Identifying if over(IDENTIFY_TIMEOUT) => self.probe(0, now),
            Stage::Probing(index) if over(PROBE_TIMEOUT + bits_duration(self.baud)) => self.probe(index + 1, now),
            Stage::NothingFound if over(PROBE_INTERVAL) => self.set_stage(Stage::Identifying, self.config.baud, now),
            // It is said once.
            Stage::NothingFound if self.text.is_heard() => self.report_nothing_found(),
            Stage::Speaking => {
                self.set_wipers(now);
                self.watch(now);
            }
            _ => {}
        }
    }

    /// Probes the next common baud rate, from the n-th on; stops after the last.
    fn probe(&mut self, from: usize, now: Duration) {
        match (from..COMMON_BAUDS.len()).find(|&index| COMMON_BAUDS[index] != self.config.baud) {
            Some(index) => self.set_stage(Stage::Probing(index), COMMON_BAUDS[index], now),
            None => {
                self.set_stage(Stage::NothingFound, self.config.baud, now);
                self.report_nothing_found();
            }
        }
    }

    fn report_nothing_found(&mut self) {
        let baud = self.config.baud;
        if let Some(version) = self.version {
            self.bad(format!("the board speaks version {version} of the protocol; this program speaks version 1"));
        } else if let Some(what) = self.text.words(&self.config.port) {
            self.bad(what);
        } else if self.bytes > 0 {
            self.bad(format!(
                "bytes arrive, but no valid packets at {baud} baud or any usual rate; \
                 is it another device?"
            ));
        } else {
            // The board may not be powered yet, so this is not an error.
            let why = format!(
                "nothing answers at {baud} baud or any usual rate; is the board powered, and the cable right? Waiting for it"
            );
            if self.said.as_ref() != Some(&why) {
                self.notify(&why);
                self.said = Some(why);
            }
        }
    }

    fn watch(&mut self, now: Duration) {
        let waits = now.saturating_sub(self.asked) >= IDENTIFY_TIMEOUT && self.dialogue.is_idle();
        if self.board.is_none() {
            if waits {
                self.ask(Command::Identify, now);
            }
            return;
        }
        // A board that waits for its wipers has nothing to send yet.
        if now < self.last_frame + SILENT_AFTER || self.stopped || self.starts {
            return;
        }
        if !self.silent {
            self.silent = true;
            if let Some((board, id)) = self.joined {
                let mut state = self.config.shared.lock();
                state.accounts[board].state = BoardState::Silent;
                state.notify(format!("{}: board {id} sends no frames", self.config.port));
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
                    self.config.shared.lock().accounts[board].corrupt += 1;
                }
            }
            // An echo of the host's own command.
            Event::Command { .. } => self.bytes = 0,
            Event::Frame { head, order, .. }
            | Event::Identity { head, order, .. }
            | Event::Answer { head, order, .. } => {
                if !self.accept_baud(now) {
                    return;
                }
                self.count_losses(head, order, now);
                if let Event::Identity { identity, .. } = event {
                    self.identified(head, order, identity, now);
                }
                if let Event::Frame { values, .. } = event {
                    if self.board.is_none() && now >= self.since + ACCEPT_AFTER {
                        self.accept_unidentified(head, values.channel_count(), values.is_partial());
                    }
                    let frame = BoardFrame {
                        board: 0,
                        board_us: order.time_us,
                        arrived_s: now.as_secs_f64(),
                        lost: 0,
                        restarted: false,
                        partial: values.is_partial(),
                        places: None,
                        values: values
                            .iter()
                            .map(|(channel, value)| (channel.into(), RawValue::new(value.into())))
                            .collect(),
                    };
                    self.frame(head, frame, now, read_at);
                }
                let ended = self.dialogue.receive(event);
                if let Some(ended) = ended.filter(|ended| matches!(ended.command, Command::Wiper { .. })) {
                    self.wiper_ended(ended);
                } else if let Some((ended, Outcome::Refused(status))) = ended.map(|ended| (ended, ended.outcome)) {
                    let why = match status {
                        Status::Unknown => "does not know",
                        _ => "refuses",
                    };
                    self.notify(&format!("board {} {why} `{}`", head.board, word(ended.command)));
                }
            }
        }
    }

    /// Handles the baud rate at which a packet came. Returns whether to use the packet.
    fn accept_baud(&mut self, now: Duration) -> bool {
        if self.baud != self.config.baud {
            let (found, own) = (self.baud, self.config.baud);
            if self.config.fixed {
                self.bad(format!(
                    "the board sends at {found} baud, not {own}; write serial:{}@{found}",
                    self.config.port
                ));
                self.set_stage(Stage::NothingFound, own, now);
                return false;
            }
            self.config.baud = found;
            self.notify(&format!("the board sends at {found} baud; used instead of {own}"));
        }
        if self.stage != Stage::Speaking {
            (self.stage, self.since) = (Stage::Speaking, now);
        }
        true
    }
}

fn bits_duration(baud: u32) -> Duration {
    Duration::from_secs(1) * PROBE_BITS / baud.max(1)
}

fn word(command: Command) -> &'static str {
    match command {
        Command::Identify => "identify",
        Command::Rate { .. } => "rate",
        Command::Wiper { .. } => "wiper",
        Command::Start => "start",
        Command::Stop => "stop",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_speed_is_tried_within_two_seconds() {
        let probing: Duration = COMMON_BAUDS.iter().map(|&baud| PROBE_TIMEOUT + bits_duration(baud)).sum();
        assert!(IDENTIFY_TIMEOUT + probing < Duration::from_millis(1800), "{:?}", IDENTIFY_TIMEOUT + probing);
    }
}
