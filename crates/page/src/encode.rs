//! Binary messages, little-endian.

use super::message::VERSION;
use super::series::Trail;

/// Bit of a percept's present columns: its position and normal are in the world.
pub(super) const IN_WORLD: u64 = 1 << 63;
/// Columns that have a bit beside it: a page shows the first of these.
pub(super) const MAX_COLUMNS: usize = 63;

/// Bits of a frame's sections.
pub(super) mod section {
    pub(in super::super) const PRESSURES: u16 = 1 << 0;
    pub(in super::super) const POSES: u16 = 1 << 1;
    pub(in super::super) const PERCEPTS: u16 = 1 << 2;
    pub(in super::super) const TOUCHES: u16 = 1 << 3;
    pub(in super::super) const SERIES: u16 = 1 << 4;
    /// Before the series, whose number only the viewer knows.
    pub(in super::super) const SELF_CONTACTS: u16 = 1 << 5;
    /// After the pressures, and only with them.
    pub(in super::super) const SHEARS: u16 = 1 << 6;
}

/// In place of the number of self-contacts that are not known.
pub(super) const UNKNOWN: u32 = u32::MAX;

/// A link's index, or that of none.
pub(super) fn no_link(link: Option<usize>) -> u32 {
    link.map_or(u32::MAX, |link| link as u32)
}

/// Writes a message.
#[derive(Debug)]
pub(super) struct Writer(Vec<u8>);

impl Writer {
    /// Begins a message of kind `kind` with `bits` after kind and version.
    pub(super) fn new(kind: u8, bits: u16) -> Self {
        let mut bytes = vec![kind, VERSION as u8];
        bytes.extend_from_slice(&bits.to_le_bytes());
        Self(bytes)
    }

    pub(super) fn u32(&mut self, number: u32) {
        self.0.extend_from_slice(&number.to_le_bytes());
    }

    pub(super) fn u64(&mut self, number: u64) {
        self.0.extend_from_slice(&number.to_le_bytes());
    }

    pub(super) fn f32(&mut self, number: f32) {
        self.0.extend_from_slice(&number.to_le_bytes());
    }

    pub(super) fn f64(&mut self, number: f64) {
        self.0.extend_from_slice(&number.to_le_bytes());
    }

    pub(super) fn f32s(&mut self, numbers: &[f32]) {
        if cfg!(target_endian = "little") {
            self.0.extend_from_slice(bytemuck::cast_slice(numbers));
        } else {
            numbers.iter().for_each(|&number| self.f32(number));
        }
    }

    pub(super) fn bytes(&mut self, bytes: &[u8]) {
        self.0.extend_from_slice(bytes);
    }

    /// Zeros up to a multiple of eight bytes.
    pub(super) fn pad(&mut self) {
        self.0.resize(self.0.len().next_multiple_of(8), 0);
    }

    pub(super) fn finish(self) -> Vec<u8> {
        self.0
    }
}

/// The head of a frame.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct FrameHead {
    pub(super) sections: u16,
    pub(super) seq: u32,
    pub(super) number: u64,
    pub(super) t_s: f64,
    pub(super) skipped: u32,
    pub(super) latency_ms: [f32; 2],
    pub(super) fields: u32,
    pub(super) touches: u32,
    pub(super) samples: u32,
    pub(super) newest_event: u32,
    pub(super) columns: u64,
    pub(super) call_us: f32,
    /// Number of `series` messages that the values of plots answer.
    pub(super) answered_series: u32,
}

impl FrameHead {
    /// Bytes of a head.
    pub(super) const BYTES: usize = 72;

    /// Begins a frame.
    pub(super) fn write(&self) -> Writer {
        let mut to = Writer::new(2, self.sections);
        to.u32(self.seq);
        to.u64(self.number);
        to.f64(self.t_s);
        to.u32(self.skipped);
        to.f32s(&self.latency_ms);
        for number in [self.fields, self.touches, self.samples, self.newest_event, self.answered_series] {
            to.u32(number);
        }
        to.f32(self.call_us);
        to.u32(0);
        to.u64(self.columns);
        debug_assert_eq!(to.0.len(), Self::BYTES);
        to
    }
}

/// The section of a frame that holds the values of `trail`.
pub(super) fn write_series(to: &mut Writer, trail: &Trail) {
    trail.times_s().for_each(|t_s| to.f64(t_s));
    for column in 0..trail.width() {
        trail.values(column).for_each(|value| to.f32(value));
    }
    to.pad();
}

/// The highest pressure of each taxel over a part of a recording.
#[derive(Clone, Debug)]
pub struct PeakMap {
    /// The number of the request.
    pub id: u32,
    /// Begin of the part, s.
    pub from_s: f64,
    /// End of the part, s.
    pub to_s: f64,
    /// By taxel of the body, in the unit of P; NaN where nothing is known of it.
    pub peaks: Vec<f32>,
}

impl PeakMap {
    /// The binary message that holds it.
    #[must_use]
    pub fn message(&self) -> Vec<u8> {
        let mut to = Writer::new(4, 0);
        to.u32(self.id);
        to.f64(self.from_s);
        to.f64(self.to_s);
        to.f32s(&self.peaks);
        to.finish()
    }
}

/// A history: for each series the least and the most in each of `bins` bins.
#[derive(Clone, Debug)]
pub struct History {
    /// The number of the request.
    pub id: u32,
    /// Begin of the first bin, s.
    pub from_s: f64,
    /// End of the last bin, s.
    pub to_s: f64,
    /// Number of bins.
    pub bins: usize,
    /// By series, least and most by bin; NaN where nothing was.
    pub series: Vec<[Vec<f32>; 2]>,
}

impl History {
    /// The binary message that holds it.
    ///
    /// # Panics
    /// A series has another number of bins.
    #[must_use]
    pub fn message(&self) -> Vec<u8> {
        let mut to = Writer::new(3, 0);
        for number in [self.id, self.bins as u32, self.series.len() as u32] {
            to.u32(number);
        }
        to.f64(self.from_s);
        to.f64(self.to_s);
        for ends in self.series.iter().flatten() {
            assert_eq!(ends.len(), self.bins, "a value a bin");
            to.f32s(ends);
        }
        to.finish()
    }
}
