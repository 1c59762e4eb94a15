//! What each taxel has in sixteen frames, side by side: for a backend that sends frames on like that.

use std::ops::Range;

use fearless_simd::Level;
use fearless_simd::prelude::*;
use fearless_simd::u32x16;

use super::super::Rows;
use super::columns::store_first;
use super::lines::Aligned;
use super::pick::SomeFrames;
use super::simd::{LANES, with_widest};
use super::transpose::{Columns, transpose};

/// Frames that are taken at once.
pub(crate) const FRAMES: usize = LANES;

/// Where a tile's values go.
struct Target<'a> {
    /// By channel, so many words each.
    words: &'a mut [u32],
    words_a_channel: usize,
    /// The first of the frames.
    at: usize,
}

impl Columns for Target<'_> {
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
pub(crate) fn write(raw: Rows<'_>, frames: Range<usize>, channels: usize, words: &mut [u32], at: usize) {
    let (words_a_channel, count) = (words.len() / channels, frames.len());
    let some = SomeFrames::new(raw, frames.start, count);
    with_widest!(Level::new(), simd => {
        let Aligned(bits) = &mut Aligned([[0; LANES]; LANES]);
        for (tile, words) in words.chunks_mut(LANES * words_a_channel).enumerate() {
            some.read(simd, tile, channels, bits);
            let last = bits[count - 1];
            bits[count..].fill(last);
            transpose(simd, |frame| &bits[frame], &mut Target { words, words_a_channel, at });
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::backend::Picks;
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
                    pose: Vec::new(),
                })
                .collect();
            let backwards: Vec<u32> = (0..channels as u32).rev().collect();
            let picks = Picks::new(&backwards, channels, channels + 9);
            let words_a_channel = frames.next_multiple_of(4);
            for (raw, place) in [
                (Rows::Packed { values: &packed, channels }, (|c, _| c) as fn(usize, usize) -> usize),
                (Rows::Picked { frames: &picked, picks: &picks }, |c, channels| channels - 1 - c),
            ] {
                let mut words = vec![0; channels * words_a_channel];
                for at in (0..frames).step_by(FRAMES) {
                    write(raw, at..frames.min(at + FRAMES), channels, &mut words, at);
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
