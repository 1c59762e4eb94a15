//! A batch of raw values, and where they lie.

use std::ops::Range;

use crate::percept::Flags;
use crate::signal::{Frame, RawValue};
use crate::stage::motion::SHORTEST_STEP_S;

/// A batch of raw values, frame by frame.
#[derive(Clone, Copy)]
pub(crate) struct RawBatch<'a> {
    /// The index of its first frame in the percepts.
    pub(crate) first: usize,
    pub(crate) frames: usize,
    pub(crate) rows: Rows<'a>,
    /// Per frame, the time since the one before.
    pub(crate) steps: &'a [Step],
}

/// Tiles of sixteen values that are looked at together.
pub(crate) const TILES_A_BLOCK: usize = 16;

/// Where in a frame a plan finds its values.
#[derive(Clone, Debug)]
pub(crate) struct Picks {
    /// Per slot that is calibrated, which are the channels once for every signal.
    pub(crate) places: Vec<u32>,
    pub(crate) channels: usize,
    /// Per sixteen slots.
    pub(crate) near: Vec<Near>,
    /// Per [`TILES_A_BLOCK`] tiles of sixteen whose values lie one after the other: where they start.
    pub(crate) blocks: Vec<Option<usize>>,
    /// What [`Near::Shuffled`] refers to.
    pub(crate) shuffles: Vec<Shuffle>,
}

/// Where up to sixteen values lie among 32 of a frame. A skin has many, and each is read with its values: it is small.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shuffle {
    pub(crate) from: u32,
    /// From `from` on; [`ELSEWHERE`] for those that do not lie there.
    pub(crate) places: [u8; 16],
    /// How far behind `from` the sixteen begin among which the first eight lie, and the last eight, if all do.
    pub(crate) halves: Option<[u8; 2]>,
}

/// Not among 32 values.
pub(crate) const ELSEWHERE: u8 = 63;

/// So many shuffles bring sixteen values together faster than one by one.
const SHUFFLES: usize = 4;

impl Shuffle {
    /// As few as together bring the values at `places` of a frame of `width` side by side, which is 32 or more; what fills up
    /// the last ones is as good a value as any.
    fn all(places: &[u32], width: u32) -> Vec<Self> {
        // Of the same eight, if these have any.
        let filling = |lane: usize| places.get(lane / 8 * 8).unwrap_or(&places[0]);
        let filled: [u32; 16] = std::array::from_fn(|lane| *places.get(lane).unwrap_or(filling(lane)));
        let mut sorted = filled;
        sorted.sort_unstable();
        let mut shuffles = Vec::<Self>::new();
        for low in sorted {
            if shuffles.last().is_some_and(|last| low < last.from + 32) {
                continue;
            }
            let from = low.min(width - 32);
            let place = |lane: usize| match filled[lane].checked_sub(from) {
                Some(place) if place < 32 => place as u8,
                _ => ELSEWHERE,
            };
            shuffles.push(Self { from, places: std::array::from_fn(place), halves: None });
        }
        if let [only] = &mut shuffles[..] {
            let [first, second] = [&only.places[..8], &only.places[8..]].map(|half| only.half(half, width));
            only.halves = first.zip(second).map(|(first, second)| [first, second]);
        }
        shuffles
    }

    /// Where among those of a frame of `width` sixteen begin that have all of the eight at `places`.
    fn half(&self, places: &[u8], width: u32) -> Option<u8> {
        let (low, high) = (*places.iter().min()?, *places.iter().max()?);
        let start = u32::from(low).min(width - 16 - self.from) as u8;
        (high < start + 16).then_some(start)
    }
}

/// Where sixteen values lie in a frame.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Near {
    /// One after the other from here on.
    Straight(u32),
    /// As these shuffles say, each of some of them.
    Shuffled {
        first: u32,
        count: u32,
    },
    Scattered,
}

impl Picks {
    /// For frames of `width` values, with the channels' values at `channels`; `calibrated` slots are made of them.
    pub(crate) fn new(channels: &[u32], calibrated: usize, width: usize) -> Self {
        let places: Vec<u32> = channels.iter().copied().cycle().take(calibrated).collect();
        // Places beyond are none.
        let end = u32::try_from(width).unwrap_or(u32::MAX);
        let mut shuffles = Vec::new();
        let near = places.chunks(16).map(|places| {
            let low = places[0];
            if end.saturating_sub(low) >= 16 && places.iter().zip(low..).all(|(&place, at)| place == at) {
                return Near::Straight(low);
            }
            if end < 32 {
                return Near::Scattered;
            }
            let those = Shuffle::all(places, end);
            if those.len() > SHUFFLES {
                return Near::Scattered;
            }
            let (first, count) = (shuffles.len() as u32, those.len() as u32);
            shuffles.extend(those);
            Near::Shuffled { first, count }
        });
        let near: Vec<Near> = near.collect();
        let block = |tiles: &[Near]| {
            let Some(&Near::Straight(from)) = tiles.first().filter(|_| tiles.len() == TILES_A_BLOCK) else {
                return None;
            };
            let follows =
                |(index, near): (usize, &Near)| matches!(near, Near::Straight(at) if *at == from + index as u32 * 16);
            tiles.iter().enumerate().all(follows).then_some(from as usize)
        };
        let blocks = near.chunks(TILES_A_BLOCK).map(block).collect();
        Self { near, blocks, shuffles, channels: channels.len(), places }
    }
}

/// Where frames' raw values lie.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Rows<'a> {
    /// Gathered: one frame after the other, each with one value a channel.
    Packed { values: &'a [RawValue], channels: usize },
    /// As the source delivered them, each value where `picks` says.
    Picked { frames: Delivered<'a>, picks: &'a Picks },
}

/// Frames' values as their source delivered them.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Delivered<'a> {
    /// Each frame has its own.
    Frames(&'a [Frame]),
    /// In one slice, frame by frame, `width` values each.
    Flat { values: &'a [RawValue], width: usize },
}

impl<'a> Delivered<'a> {
    /// The values of frame `frame`.
    #[inline(always)]
    pub(crate) fn row(self, frame: usize) -> &'a [RawValue] {
        match self {
            Self::Frames(frames) => &frames[frame].values,
            Self::Flat { values, width } => &values[frame * width..][..width],
        }
    }

    fn part(self, part: Range<usize>) -> Self {
        match self {
            Self::Frames(frames) => Self::Frames(&frames[part]),
            Self::Flat { values, width } => Self::Flat { values: &values[part.start * width..part.end * width], width },
        }
    }
}

impl<'a> Rows<'a> {
    /// The values of frame `frame`, by channel.
    pub(crate) fn row(self, frame: usize) -> impl Iterator<Item = RawValue> + 'a {
        let (values, picks, channels): (&[RawValue], &[u32], usize) = match self {
            Self::Packed { values, channels } => (&values[frame * channels..], &[], channels),
            Self::Picked { frames, picks } => (frames.row(frame), &picks.places, picks.channels),
        };
        (0..channels).map(move |channel| values[picks.get(channel).map_or(channel, |&pick| pick as usize)])
    }

    /// The value of `channel` in frame `frame`.
    #[inline]
    pub(crate) fn value(self, frame: usize, channel: usize) -> RawValue {
        match self {
            Self::Packed { values, channels } => values[frame * channels + channel],
            Self::Picked { frames, picks } => frames.row(frame)[picks.places[channel] as usize],
        }
    }

    /// The bits of frame `frame` for the sixteen slots from 16 · `tile` on, where they lie one after the other.
    #[inline(always)]
    pub(crate) fn straight(self, frame: usize, tile: usize) -> Option<&'a [u32; 16]> {
        let (values, from) = match self {
            Self::Packed { values, channels } => {
                let first = tile * 16;
                let straight = first + 16 <= channels;
                (&values[frame * channels..][..channels], straight.then_some(first)?)
            }
            Self::Picked { frames, picks } => match picks.near[tile] {
                Near::Straight(from) => (frames.row(frame), from as usize),
                _ => return None,
            },
        };
        bytemuck::cast_slice(&values[from..]).first_chunk()
    }

    /// The bits of frame `frame` for the 16 · [`TILES_A_BLOCK`] slots of block `block`, where they lie one after the other.
    pub(crate) fn straight_block(self, frame: usize, block: usize) -> Option<&'a [u32]> {
        const SLOTS: usize = 16 * TILES_A_BLOCK;
        let values = match self {
            Self::Packed { values, channels } => {
                let first = block * SLOTS;
                values[frame * channels..][..channels].get(first..first + SLOTS)?
            }
            Self::Picked { frames, picks } => {
                let from = (*picks.blocks.get(block)?)?;
                &frames.row(frame)[from..from + SLOTS]
            }
        };
        Some(bytemuck::cast_slice(values))
    }

    /// The bits of frame `frame` for the slots from `first` on, as far as `bits` goes; zeros after the last.
    #[inline(always)]
    pub(crate) fn read(self, frame: usize, first: usize, calibrated: usize, bits: &mut [u32]) {
        let count = bits.len().min(calibrated - first);
        bits[count..].fill(0);
        match self {
            Self::Packed { values, channels } => {
                let values: &[u32] = bytemuck::cast_slice(&values[frame * channels..][..channels]);
                if first + count <= channels {
                    bits[..count].copy_from_slice(&values[first..first + count]);
                } else {
                    for (bits, slot) in bits[..count].iter_mut().zip(first..) {
                        *bits = values[slot % channels];
                    }
                }
            }
            Self::Picked { frames, picks } => {
                let values = frames.row(frame);
                for (bits, &pick) in bits.iter_mut().zip(&picks.places[first..first + count]) {
                    *bits = values[pick as usize].to_bits();
                }
            }
        }
    }

    /// The rows of `frames`.
    pub(crate) fn part(self, part: Range<usize>) -> Self {
        match self {
            Self::Packed { values, channels } => {
                Self::Packed { values: &values[part.start * channels..part.end * channels], channels }
            }
            Self::Picked { frames, picks } => Self::Picked { frames: frames.part(part), picks },
        }
    }
}

impl Step {
    /// Whether time starts again here: it goes back, or on by more than the scene's longest gap. Nothing is kept over that.
    pub(crate) fn restarts(&self) -> bool {
        self.flags.contains(Flags::BAD_DT) && self.dt_s.abs() > SHORTEST_STEP_S
    }
}

/// The time since the frame before.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Step {
    /// s; formed in double precision from the frames' times.
    pub(crate) dt_s: f64,
    /// Why it cannot be used; empty when it can.
    pub(crate) flags: Flags,
}
