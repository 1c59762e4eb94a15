//! A simulated board that speaks the serial protocol as firmware does. No I/O, no clock.

mod faults;
mod wiper;

use std::collections::VecDeque;
use std::time::Duration;

pub use faults::{FaultCounts, Faults, FaultyLine, Window};
pub use wiper::RECORDED_WIPER;

use self::wiper::at_wiper;
use crate::wire::encode;
use crate::wire::{ANY_BOARD, Answer, Bits, Command, Head, Identity, MAX_CHANNELS, MAX_ENCODED_BYTES, Status};
use crate::wire::{Decoder, Event};

/// Interval of full frames among partial ones.
const FULL_EVERY: Duration = Duration::from_secs(1);

/// How a simulated board responds to the command `wiper`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Potentiometers {
    /// It sets the wiper.
    #[default]
    Obeyed,
    /// It answers "unknown command", as firmware without potentiometers does.
    Unknown,
    /// It does not answer.
    Ignored,
}

/// The configuration of a simulated board.
#[derive(Clone, Debug, PartialEq)]
pub struct BoardConfig {
    /// Its id, 0 to 65534.
    pub board: u16,
    /// Its channels, 1 to 256.
    pub channels: u16,
    /// Bits of a value.
    pub bits: Bits,
    /// [`layout_hash`](somatic_wire::layout_hash) of its taxels.
    pub layout: u32,
    /// Frame rate in mHz; 0 is as fast as readings and line allow.
    pub rate_mhz: u32,
    /// Whether it sends frames from the start.
    pub running: bool,
    /// Whether it sends changed channels only, with a full frame once a second.
    pub partial: bool,
    /// Whether readings fall under pressure, which decides how a wiper changes them.
    pub falls: bool,
    /// How it responds to the command `wiper`.
    pub potentiometers: Potentiometers,
    /// Relative error of its clock; positive runs fast.
    pub drift: f64,
}

/// A running simulated board.
pub struct VirtualBoard {
    config: BoardConfig,
    boot: u8,
    started: Duration,
    sequence: u32,
    running: bool,
    rate_mhz: u32,
    wipers: Vec<u8>,
    due: Duration,
    full_due: Duration,
    last: Vec<Option<u16>>,
    decoder: Decoder,
    outgoing: VecDeque<u8>,
    frames: u64,
    commands: u64,
}

impl VirtualBoard {
    /// A board with this configuration that starts at `now`.
    #[must_use]
    pub fn new(config: BoardConfig, now: Duration) -> Self {
        let channels = usize::from(config.channels).clamp(1, MAX_CHANNELS);
        let mut board = Self {
            boot: 0,
            started: now,
            sequence: 0,
            running: false,
            rate_mhz: 0,
            wipers: vec![RECORDED_WIPER; channels],
            due: now,
            full_due: now,
            last: vec![None; channels],
            decoder: Decoder::new(),
            outgoing: VecDeque::new(),
            frames: 0,
            commands: 0,
            config,
        };
        board.restart(now);
        board
    }

    /// Restarts as after a power cycle.
    pub fn restart(&mut self, now: Duration) {
        self.boot = self.boot.wrapping_add(1);
        self.started = now;
        self.sequence = 0;
        self.running = self.config.running;
        self.rate_mhz = self.config.rate_mhz;
        self.wipers.fill(RECORDED_WIPER);
        (self.due, self.full_due) = (now, now);
        self.last.fill(None);
        self.decoder.rejoin();
        self.outgoing.clear();
        self.send_identity(0, now);
    }

    /// Frames sent since it was created, over all restarts.
    #[must_use]
    pub fn frames(&self) -> u64 {
        self.frames
    }

    /// Commands received for this board.
    #[must_use]
    pub fn commands(&self) -> u64 {
        self.commands
    }

    /// The current wipers, one per channel.
    #[must_use]
    pub fn wipers(&self) -> &[u8] {
        &self.wipers
    }

    /// Whether it sends frames.
    #[must_use]
    pub fn is_running(&self) -> bool {
        self.running
    }

    /// Bytes to be sent, in order.
    pub fn outgoing(&mut self) -> &mut VecDeque<u8> {
        &mut self.outgoing
    }

    /// Handles bytes from the host.
    pub fn receive(&mut self, bytes: &[u8], now: Duration) {
        let mut commands = Vec::new();
        self.decoder.push(bytes, |event| {
            if let Event::Command { board, request, command } = event {
                commands.push((board, request, command));
            }
        });
        for (board, request, command) in commands {
            if board == self.config.board || board == ANY_BOARD {
                self.commands += 1;
                self.execute(request, command, now);
            }
        }
    }

    fn execute(&mut self, request: u8, command: Command, now: Duration) {
        let (mut status, mut value) = (Status::Done, 0);
        match command {
            Command::Identify => return self.send_identity(request, now),
            Command::Rate { rate_mhz } => {
                (self.rate_mhz, value) = (rate_mhz, rate_mhz);
                self.due = now;
            }
            Command::Wiper { .. } if self.config.potentiometers == Potentiometers::Ignored => return,
            Command::Wiper { .. } if self.config.potentiometers == Potentiometers::Unknown => status = Status::Unknown,
            Command::Wiper { channel, wiper } => match self.wipers.get_mut(usize::from(channel)) {
                Some(set) => (*set, value) = (wiper, wiper.into()),
                None => status = Status::Bad,
            },
            Command::Start => self.running = true,
            Command::Stop => self.running = false,
        }
        let answer = Answer { request, command: command.kind(), status, value };
        let head = self.head(now);
        self.queue(|to| encode::answer(to, &head, &answer));
    }

    fn send_identity(&mut self, request: u8, now: Duration) {
        let head = self.head(now);
        let identity = Identity {
            request,
            running: self.running,
            channels: self.wipers.len() as u16,
            bits: self.config.bits,
            layout: self.config.layout,
            rate_mhz: self.rate_mhz,
            firmware: concat!("somatic board ", env!("CARGO_PKG_VERSION")),
        };
        self.queue(|to| encode::identity(to, &head, &identity));
    }

    fn head(&self, now: Duration) -> Head {
        let time = now.saturating_sub(self.started).as_secs_f64() * (1.0 + self.config.drift);
        // The 32-bit clock wraps.
        let time_us = (time * 1e6) as u64 as u32;
        Head { board: self.config.board, boot: self.boot, sequence: self.sequence, time_us }
    }

    fn queue(&mut self, write: impl FnOnce(&mut [u8]) -> Option<usize>) {
        let mut line = [0; MAX_ENCODED_BYTES];
        let length = write(&mut line).unwrap_or(0);
        self.outgoing.extend(&line[..length]);
    }

    /// Stops, and if the line is free sends an identity, from which the host learns the frame count.
    pub fn finish(&mut self, now: Duration) {
        self.running = false;
        if self.outgoing.is_empty() {
            self.send_identity(0, now);
        }
    }

    /// Whether a frame is due at `now`: the line is free, and a frame period has passed.
    #[must_use]
    pub fn is_due(&self, now: Duration) -> bool {
        self.running && self.outgoing.is_empty() && now >= self.due
    }

    /// Whether its rate is limited only by line and readings.
    #[must_use]
    pub fn is_unthrottled(&self) -> bool {
        self.rate_mhz == 0
    }

    /// Sends a frame of `readings`, one per channel, as recorded at wiper 38.
    pub fn send(&mut self, readings: &[Option<u16>], now: Duration) {
        if self.rate_mhz > 0 {
            let period = Duration::from_secs_f64(1e3 / f64::from(self.rate_mhz));
            self.due += period;
            // Frames missed on a busy line are not sent later.
            if self.due < now {
                self.due = now + period;
            }
        }
        let (bits, falls) = (self.config.bits, self.config.falls);
        let read = |(reading, &wiper): (Option<u16>, &u8)| reading.map(|value| at_wiper(value, bits, wiper, falls));
        let padded = readings.iter().copied().chain(std::iter::repeat(None));
        let values: Vec<Option<u16>> = padded.zip(&self.wipers).map(read).collect();
        let full = !self.config.partial || now >= self.full_due;
        if full {
            self.full_due = now + FULL_EVERY;
        }
        let head = self.head(now);
        if full && values.iter().all(Option::is_some) {
            let all: Vec<u16> = values.iter().flatten().copied().collect();
            self.queue(|to| encode::frame(to, &head, bits, &all));
        } else {
            // A channel without a reading is left out, even of a full frame.
            let changed = |(new, old): (&Option<u16>, &Option<u16>)| new.filter(|_| full || new != old);
            let sent: Vec<Option<u16>> = values.iter().zip(&self.last).map(changed).collect();
            self.queue(|to| encode::partial(to, &head, bits, &sent));
        }
        self.last = values;
        self.sequence = self.sequence.wrapping_add(1);
        self.frames += 1;
    }
}
