//! A board made of software: it says what a board's firmware would say. No I/O, no clock.

mod faults;
mod tap;

use std::collections::VecDeque;
use std::time::Duration;

pub use faults::{BadLine, Done, Faults, Window};
pub use tap::RECORDED_TAP;

use self::tap::at_tap;
use super::decode::{Decoder, Event};
use super::encode;
use super::format::{ANY_BOARD, Answer, Bits, Command, Head, Identity, MOST_CHANNELS, MOST_ON_LINE, Status};

/// From one full frame to the next, when those between are partial.
const FULL_EVERY: Duration = Duration::from_secs(1);

/// What a board does when it is told to set a tap.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Potentiometers {
    /// It sets it.
    #[default]
    Obeyed,
    /// It answers that it does not know the command, as firmware without potentiometers does.
    Unknown,
    /// It does not answer.
    Ignored,
}

/// What a board is.
#[derive(Clone, Debug, PartialEq)]
pub struct Make {
    /// Its id, 0 to 65534.
    pub board: u16,
    /// Its channels, 1 to 256.
    pub channels: u16,
    /// Bits of a value.
    pub bits: Bits,
    /// [`layout_hash`](super::layout_hash) of its taxels.
    pub layout: u32,
    /// Frames a second in thousandths of a hertz; 0 is as many as there are and the line takes.
    pub rate_mhz: u32,
    /// Whether it sends frames from the start.
    pub running: bool,
    /// Whether it sends only what changed, and everything once a second.
    pub partial: bool,
    /// Whether readings fall when pressed, which matters to its taps.
    pub falls: bool,
    /// What it does when it is told to set a tap.
    pub potentiometers: Potentiometers,
    /// How much faster its clock runs, as a part of one.
    pub drift: f64,
}

/// A board at work.
pub struct VirtualBoard {
    make: Make,
    boot: u8,
    started: Duration,
    sequence: u32,
    running: bool,
    rate_mhz: u32,
    taps: Vec<u8>,
    due: Duration,
    full_due: Duration,
    last: Vec<Option<u16>>,
    ears: Decoder,
    leaving: VecDeque<u8>,
    frames: u64,
    commands: u64,
}

impl VirtualBoard {
    /// A board of this make that starts at `now`.
    #[must_use]
    pub fn new(make: Make, now: Duration) -> Self {
        let channels = usize::from(make.channels).clamp(1, MOST_CHANNELS);
        let mut board = Self {
            boot: 0,
            started: now,
            sequence: 0,
            running: false,
            rate_mhz: 0,
            taps: vec![RECORDED_TAP; channels],
            due: now,
            full_due: now,
            last: vec![None; channels],
            ears: Decoder::new(),
            leaving: VecDeque::new(),
            frames: 0,
            commands: 0,
            make,
        };
        board.start_again(now);
        board
    }

    /// Forgets everything and starts again, as when its power was gone for a moment.
    pub fn start_again(&mut self, now: Duration) {
        self.boot = self.boot.wrapping_add(1);
        self.started = now;
        self.sequence = 0;
        self.running = self.make.running;
        self.rate_mhz = self.make.rate_mhz;
        self.taps.fill(RECORDED_TAP);
        (self.due, self.full_due) = (now, now);
        self.last.fill(None);
        self.ears.rejoin();
        self.leaving.clear();
        self.say_identity(0, now);
    }

    /// Frames sent in all, starts included.
    #[must_use]
    pub fn frames(&self) -> u64 {
        self.frames
    }

    /// Commands heard and obeyed or refused.
    #[must_use]
    pub fn commands(&self) -> u64 {
        self.commands
    }

    /// The taps that are set, one a channel.
    #[must_use]
    pub fn taps(&self) -> &[u8] {
        &self.taps
    }

    /// Whether it sends frames.
    #[must_use]
    pub fn is_running(&self) -> bool {
        self.running
    }

    /// Bytes on their way out, in order.
    pub fn leaving(&mut self) -> &mut VecDeque<u8> {
        &mut self.leaving
    }

    /// Hears what arrived from the host.
    pub fn hear(&mut self, bytes: &[u8], now: Duration) {
        let mut commands = Vec::new();
        self.ears.push(bytes, |event| {
            if let Event::Command { board, request, command } = event {
                commands.push((board, request, command));
            }
        });
        for (board, request, command) in commands {
            if board == self.make.board || board == ANY_BOARD {
                self.commands += 1;
                self.obey(request, command, now);
            }
        }
    }

    fn obey(&mut self, request: u8, command: Command, now: Duration) {
        let (mut status, mut value) = (Status::Done, 0);
        match command {
            Command::Identify => return self.say_identity(request, now),
            Command::Rate { rate_mhz } => {
                (self.rate_mhz, value) = (rate_mhz, rate_mhz);
                self.due = now;
            }
            Command::Tap { .. } if self.make.potentiometers == Potentiometers::Ignored => return,
            Command::Tap { .. } if self.make.potentiometers == Potentiometers::Unknown => status = Status::Unknown,
            Command::Tap { channel, tap } => match self.taps.get_mut(usize::from(channel)) {
                Some(set) => (*set, value) = (tap, tap.into()),
                None => status = Status::Bad,
            },
            Command::Start => self.running = true,
            Command::Stop => self.running = false,
        }
        let answer = Answer { request, command: command.kind(), status, value };
        let head = self.head(now);
        self.say(|to| encode::answer(to, &head, &answer));
    }

    fn say_identity(&mut self, request: u8, now: Duration) {
        let head = self.head(now);
        let identity = Identity {
            request,
            running: self.running,
            channels: self.taps.len() as u16,
            bits: self.make.bits,
            layout: self.make.layout,
            rate_mhz: self.rate_mhz,
            firmware: concat!("somatic board ", env!("CARGO_PKG_VERSION")),
        };
        self.say(|to| encode::identity(to, &head, &identity));
    }

    fn head(&self, now: Duration) -> Head {
        let time = now.saturating_sub(self.started).as_secs_f64() * (1.0 + self.make.drift);
        // Its clock wraps as any of 32 bits does.
        let time_us = (time * 1e6) as u64 as u32;
        Head { board: self.make.board, boot: self.boot, sequence: self.sequence, time_us }
    }

    fn say(&mut self, write: impl FnOnce(&mut [u8]) -> Option<usize>) {
        let mut line = [0; MOST_ON_LINE];
        let length = write(&mut line).unwrap_or(0);
        self.leaving.extend(&line[..length]);
    }

    /// Sends no more frames, and says unasked, where its line is free, how many there were.
    pub fn finish(&mut self, now: Duration) {
        self.running = false;
        if self.leaving.is_empty() {
            self.say_identity(0, now);
        }
    }

    /// Whether a frame is due at `now`: the line is free, and so long has passed since the last as the rate says.
    #[must_use]
    pub fn is_due(&self, now: Duration) -> bool {
        self.running && self.leaving.is_empty() && now >= self.due
    }

    /// Whether it waits for its line or for new readings only.
    #[must_use]
    pub fn has_no_rate(&self) -> bool {
        self.rate_mhz == 0
    }

    /// Sends a frame of `readings`, one a channel, as recorded at tap 38.
    pub fn send(&mut self, readings: &[Option<u16>], now: Duration) {
        if self.rate_mhz > 0 {
            let period = Duration::from_secs_f64(1e3 / f64::from(self.rate_mhz));
            self.due += period;
            // What the line was too busy for is not made up for.
            if self.due < now {
                self.due = now + period;
            }
        }
        let (bits, falls) = (self.make.bits, self.make.falls);
        let read = |(reading, &tap): (Option<u16>, &u8)| reading.map(|value| at_tap(value, bits, tap, falls));
        let padded = readings.iter().copied().chain(std::iter::repeat(None));
        let values: Vec<Option<u16>> = padded.zip(&self.taps).map(read).collect();
        let full = !self.make.partial || now >= self.full_due;
        if full {
            self.full_due = now + FULL_EVERY;
        }
        let head = self.head(now);
        if full && values.iter().all(Option::is_some) {
            let all: Vec<u16> = values.iter().flatten().copied().collect();
            self.say(|to| encode::frame(to, &head, bits, &all));
        } else {
            // A channel without a reading is left out, whether or not the others are.
            let changed = |(new, old): (&Option<u16>, &Option<u16>)| new.filter(|_| full || new != old);
            let sent: Vec<Option<u16>> = values.iter().zip(&self.last).map(changed).collect();
            self.say(|to| encode::partial(to, &head, bits, &sent));
        }
        self.last = values;
        self.sequence = self.sequence.wrapping_add(1);
        self.frames += 1;
    }
}
