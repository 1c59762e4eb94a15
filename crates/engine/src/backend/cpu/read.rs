//! Reading a frame's values.
//!
//! Those that do not lie in a plan's order, but near each other, are picked by shuffles of whole lanes: sixteen of 32 with
//! AVX-512, twice eight of sixteen with AVX2. They take a third and a quarter of the instructions of shuffling bytes.

use std::ops::Range;

use fearless_simd::Level;
use fearless_simd::prelude::*;
use fearless_simd::u32x16;

use super::super::Rows;
use super::super::raw::{ELSEWHERE, Near, Picks, Shuffle};
use super::lanes::{Aligned, Columns, LANES, Row, store_first, transpose, with_widest};

/// A frame's raw values in the plan's order, tile by tile.
#[derive(Clone, Copy, Debug)]
pub(super) struct OneFrame<'a> {
    raw: Rows<'a>,
    frame: usize,
    calibrated: usize,
    /// As the source delivered them, if it did.
    picked: Option<(&'a [u32], &'a Picks)>,
}

impl<'a> OneFrame<'a> {
    /// Frame `frame` of `raw`; its first `calibrated` slots are calibrated.
    #[inline(always)]
    pub(super) fn new(raw: Rows<'a>, frame: usize, calibrated: usize) -> Self {
        let picked = match raw {
            Rows::Packed { .. } => None,
            Rows::Picked { frames, picks } => Some((bytemuck::cast_slice(frames.row(frame)), picks)),
        };
        Self { raw, frame, calibrated, picked }
    }

    /// The bits from slot 16 · `tile` on.
    #[inline(always)]
    pub(super) fn row<S: Simd>(self, simd: S, tile: usize) -> u32x16<S> {
        if let Some((values, picks)) = self.picked {
            match picks.near[tile] {
                Near::Straight(from) => return u32x16::from_slice(simd, &values[from as usize..][..LANES]),
                Near::Shuffled { first, count } => {
                    if let Some(row) = pick_all(simd, values, &picks.shuffles[first as usize..][..count as usize]) {
                        return row;
                    }
                }
                Near::Scattered => {}
            }
        }
        u32x16::from_slice(simd, &one_by_one(self.raw, self.frame, tile, self.calibrated))
    }

    #[inline(always)]
    pub(super) fn read<S: Simd>(self, simd: S, tile: usize, bits: &mut Row<u32>) {
        self.row(simd, tile).store_slice(bits);
    }
}

/// The bits of frame `frame` of `raw` from slot 16 · `tile` on, wherever they lie.
#[inline(never)]
fn one_by_one(raw: Rows<'_>, frame: usize, tile: usize, calibrated: usize) -> Row<u32> {
    let mut bits = [0; LANES];
    raw.read(frame, tile * LANES, calibrated, &mut bits);
    bits
}

/// Up to sixteen frames' raw values, for reading a tile of all of them at a time.
#[derive(Clone, Copy, Debug)]
pub(super) struct SomeFrames<'a> {
    raw: Rows<'a>,
    first: usize,
    frames: usize,
    /// By frame: as the source delivered them, or by channel.
    values: [&'a [u32]; LANES],
}

impl<'a> SomeFrames<'a> {
    pub(super) fn new(raw: Rows<'a>, first: usize, frames: usize) -> Self {
        let mut values: [&[u32]; LANES] = [&[]; LANES];
        for (frame, values) in (first..first + frames).zip(&mut values) {
            *values = bytemuck::cast_slice(match raw {
                Rows::Packed { values, channels } => &values[frame * channels..][..channels],
                Rows::Picked { frames, .. } => frames.row(frame),
            });
        }
        Self { raw, first, frames, values }
    }

    pub(super) fn frames(&self) -> usize {
        self.frames
    }

    /// Where the values from slot 16 · `tile` on lie.
    #[inline(always)]
    fn near(&self, tile: usize) -> Near {
        match self.raw {
            Rows::Packed { channels, .. } if (tile + 1) * LANES <= channels => Near::Straight((tile * LANES) as u32),
            Rows::Packed { .. } => Near::Scattered,
            Rows::Picked { picks, .. } => picks.near[tile],
        }
    }

    /// Reads the bits from slot 16 · `tile` on, a row a frame.
    #[inline(always)]
    pub(super) fn read<S: Simd>(&self, simd: S, tile: usize, calibrated: usize, bits: &mut [Row<u32>; LANES]) {
        let rows = self.values[..self.frames].iter().zip(&mut *bits);
        match (self.near(tile), self.raw) {
            (Near::Straight(from), _) => {
                rows.for_each(|(values, bits)| bits.copy_from_slice(&values[from as usize..][..LANES]));
            }
            (Near::Shuffled { first, count }, Rows::Picked { picks, .. }) => {
                let shuffles = &picks.shuffles[first as usize..][..count as usize];
                // Mostly one is enough.
                if let [one] = shuffles
                    && pick_from_each(simd, &self.values[..self.frames], one, bits)
                {
                    return;
                }
                let rows = self.values[..self.frames].iter().zip(bits);
                for (frame, (values, bits)) in (self.first..).zip(rows) {
                    match pick_all(simd, values, shuffles) {
                        Some(row) => row.store_slice(bits),
                        None => *bits = one_by_one(self.raw, frame, tile, calibrated),
                    }
                }
            }
            _ => {
                for (frame, (_, bits)) in (self.first..).zip(rows) {
                    *bits = one_by_one(self.raw, frame, tile, calibrated);
                }
            }
        }
    }
}

/// The values that all `shuffles` pick together from `values`, if the machine has instructions that pay.
#[inline(always)]
fn pick_all<S: Simd>(simd: S, values: &[u32], shuffles: &[Shuffle]) -> Option<u32x16<S>> {
    let (first, others) = shuffles.split_first()?;
    let mut row = pick(simd, values, first)?;
    for shuffle in others {
        let Aligned(places) = &Aligned(shuffle.places.map(u32::from));
        let there = u32x16::from_slice(simd, places).simd_lt(u32x16::splat(simd, ELSEWHERE.into()));
        row = there.select(pick(simd, values, shuffle)?, row);
    }
    Some(row)
}

/// The values that `shuffle` picks from `values`, if the machine has instructions that pay; anything for values elsewhere.
#[inline(always)]
fn pick<S: Simd>(simd: S, values: &[u32], shuffle: &Shuffle) -> Option<u32x16<S>> {
    let Aligned(bits) = &mut Aligned([0; LANES]);
    if !pick_from_each(simd, &[values], shuffle, std::slice::from_mut(bits)) {
        return None;
    }
    // The same lanes under another name: nothing is stored.
    Some(u32x16::from_slice(simd, bits))
}

/// The same of each of `values`, with what is the same for all made once; whether the machine has the instructions.
#[cfg(target_arch = "x86_64")]
#[inline(always)]
fn pick_from_each<S: Simd>(simd: S, values: &[&[u32]], shuffle: &Shuffle, rows: &mut [Row<u32>]) -> bool {
    use fearless_simd::{u8x16, u32x8};

    use super::lanes::x86;

    let from = shuffle.from as usize;
    if let Some(avx512) = simd.level().as_avx512() {
        let places = x86::in_32(avx512, u8x16::from_slice(avx512, &shuffle.places));
        for (values, row) in values.iter().zip(rows) {
            let (low, high) = values[from..][..32].split_at(16);
            let [low, high] = [low, high].map(|lanes| u32x16::from_slice(avx512, lanes));
            x86::of_32(avx512, low, high, places).store_slice(row);
        }
    } else if let Some((avx2, starts)) = simd.level().as_avx2().zip(shuffle.halves) {
        let (places, _) = shuffle.places.as_chunks();
        let first = x86::in_sixteen(avx2, &places[0], starts[0]);
        let last = x86::in_sixteen(avx2, &places[1], starts[1]);
        for (values, row) in values.iter().zip(rows) {
            let values = &values[from..];
            let half = |start: u8, places| {
                let (low, high) = values[usize::from(start)..][..16].split_at(8);
                x86::of_sixteen(avx2, u32x8::from_slice(avx2, low), u32x8::from_slice(avx2, high), places)
            };
            let (low, high) = row.split_at_mut(8);
            half(starts[0], first).store_slice(low);
            half(starts[1], last).store_slice(high);
        }
    } else {
        return false;
    }
    true
}

#[cfg(not(target_arch = "x86_64"))]
#[inline(always)]
fn pick_from_each<S: Simd>(_: S, _: &[&[u32]], _: &Shuffle, _: &mut [Row<u32>]) -> bool {
    false
}

/// Frames that [`side_by_side`] takes at once.
pub(crate) const FRAMES: usize = LANES;

/// Where a tile's values go.
struct ByChannel<'a> {
    /// By channel, `words_a_channel` each.
    words: &'a mut [u32],
    words_a_channel: usize,
    /// The first of the frames.
    at: usize,
}

impl Columns for ByChannel<'_> {
    #[inline(always)]
    fn put<S: Simd>(&mut self, _: S, channel: usize, lanes: u32x16<S>) {
        let start = channel * self.words_a_channel;
        // The last tile has fewer channels.
        let Some(words) = self.words.get_mut(start..start + self.words_a_channel) else { return };
        match words.get_mut(self.at..self.at + LANES) {
            Some(words) => lanes.store_slice(words),
            // There are not as many frames.
            None => store_first(lanes, &mut words[self.at..]),
        }
    }
}

/// Writes the bits of `frames`, up to [`FRAMES`], from word `at` on of what each of `channels` channels has in `words`. Where
/// there is room for more frames, they are the last one.
pub(crate) fn side_by_side(raw: Rows<'_>, frames: Range<usize>, channels: usize, words: &mut [u32], at: usize) {
    let (words_a_channel, count) = (words.len() / channels, frames.len());
    let some = SomeFrames::new(raw, frames.start, count);
    with_widest!(Level::new(), simd => {
        let Aligned(bits) = &mut Aligned([[0; LANES]; LANES]);
        for (tile, words) in words.chunks_mut(LANES * words_a_channel).enumerate() {
            some.read(simd, tile, channels, bits);
            let last = bits[count - 1];
            bits[count..].fill(last);
            transpose(simd, |frame| &bits[frame], &mut ByChannel { words, words_a_channel, at });
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::backend::Delivered;
    use crate::signal::{Frame, RawValue};

    #[test]
    fn every_value_finds_its_place() {
        for (channels, frames) in [(1, 1), (40, 3), (41, 16), (100, 21)] {
            let value = |frame: usize, place: usize| RawValue::new((1000 * frame + place) as f64);
            let packed: Vec<RawValue> =
                (0..frames).flat_map(|frame| (0..channels).map(move |c| value(frame, c))).collect();
            let picked: Vec<Frame> = (0..frames)
                .map(|frame| Frame {
                    t_s: 0.0,
                    values: (0..channels + 9).map(|place| value(frame, place)).collect(),
                    ..Frame::default()
                })
                .collect();
            let backwards: Vec<u32> = (0..channels as u32).rev().collect();
            let picks = Picks::new(&backwards, channels, channels + 9);
            let words_a_channel = frames.next_multiple_of(4);
            for (raw, place) in [
                (Rows::Packed { values: &packed, channels }, (|c, _| c) as fn(usize, usize) -> usize),
                (Rows::Picked { frames: Delivered::Frames(&picked), picks: &picks }, |c, channels| channels - 1 - c),
            ] {
                let mut words = vec![0; channels * words_a_channel];
                for at in (0..frames).step_by(FRAMES) {
                    side_by_side(raw, at..frames.min(at + FRAMES), channels, &mut words, at);
                }
                for (channel, words) in words.chunks(words_a_channel).enumerate() {
                    for (frame, &word) in words.iter().enumerate() {
                        let right = value(frame.min(frames - 1), place(channel, channels));
                        assert_eq!(word, right.to_bits(), "channel {channel} of {channels}, frame {frame} of {frames}");
                    }
                }
            }
        }
    }
}
