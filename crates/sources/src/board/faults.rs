//! Faults of a simulated board: line noise, clock drift, unplugging, silence, resets.

use std::str::FromStr;
use std::time::Duration;

use crate::error::{Error, Result, nearest};

/// The faults to inject, written `noise=1e-4,drop=1e-4,flip=1e-5,silence=2s@10s,unplug=1s/20s,reset@30s,drift=50ppm`.
///
/// `@10s` is once, 10 s after the start; `/20s` is every 20 s.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Faults {
    /// Probability of an extra random byte before each byte.
    pub noise: f64,
    /// Probability that a byte is lost.
    pub drop: f64,
    /// Probability that a bit is flipped.
    pub flip: f64,
    /// Relative error of the board's clock; positive runs fast.
    pub drift: f64,
    /// When the board sends no frames.
    pub silence: Vec<Window>,
    /// When the board is unplugged.
    pub unplug: Vec<Window>,
    /// When the board restarts.
    pub reset: Vec<Window>,
}

/// A time span, once or repeated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Window {
    lasts_s: f64,
    at_s: f64,
    repeats: bool,
}

impl Window {
    /// How often it has begun by `now`, and whether it is active.
    #[must_use]
    pub fn at(&self, now: Duration) -> (u64, bool) {
        let since = now.as_secs_f64() - self.at_s;
        if since < 0.0 {
            return (0, false);
        }
        if !self.repeats {
            return (1, since < self.lasts_s);
        }
        let times = (since / self.at_s).floor();
        (times as u64 + 1, since - times * self.at_s < self.lasts_s)
    }
}

const NAMES: [&str; 7] = ["noise", "drop", "flip", "drift", "silence", "unplug", "reset"];

impl FromStr for Faults {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let mut faults = Self::default();
        for fault in text.split(',').map(str::trim).filter(|fault| !fault.is_empty()) {
            faults.add(fault).map_err(|what| Error::usage(what).at(format!("fault `{fault}`")))?;
        }
        Ok(faults)
    }
}

impl Faults {
    fn add(&mut self, fault: &str) -> Result<(), String> {
        let name = fault.split(['=', '@', '/']).next().unwrap_or("");
        let value = fault[name.len()..].trim_start_matches('=');
        let chance = || match value.parse::<f64>() {
            Ok(chance) if (0.0..=1.0).contains(&chance) => Ok(chance),
            _ => Err(format!("write the chance of a byte, 0 to 1, such as {name}=1e-4")),
        };
        match name {
            "noise" => self.noise = chance()?,
            "drop" => self.drop = chance()?,
            "flip" => self.flip = chance()?,
            "drift" => {
                let parts = value.strip_suffix("ppm").and_then(|number| number.parse::<f64>().ok());
                let in_range = parts.filter(|ppm| ppm.abs() <= 100_000.0);
                self.drift = in_range.ok_or("write millionths, up to 100000ppm, such as drift=50ppm")? * 1e-6;
            }
            "silence" => {
                self.silence.push(window(value).ok_or("write silence=2s@10s, or silence=2s/10s for every 10 s")?);
            }
            "unplug" => self.unplug.push(window(value).ok_or("write unplug=1s@20s, or unplug=1s/20s for every 20 s")?),
            "reset" => self.reset.push(window(value).ok_or("write reset@30s, or reset/30s for every 30 s")?),
            other => {
                let hint = match nearest(other, NAMES) {
                    Some(near) => format!("did you mean `{near}`?"),
                    None => format!("it is one of {}", NAMES.join(", ")),
                };
                return Err(format!("there is no such fault; {hint}"));
            }
        }
        Ok(())
    }
}

/// Parses `2s@10s` or `2s/10s`; `@10s` has no duration.
fn window(text: &str) -> Option<Window> {
    let (lasts, at, repeats) = match (text.split_once('@'), text.split_once('/')) {
        (Some((lasts, at)), None) => (lasts, at, false),
        (None, Some((lasts, at))) => (lasts, at, true),
        _ => return None,
    };
    let seconds = |text: &str| text.strip_suffix('s')?.parse().ok().filter(|s| (0.0..=1e9).contains(s));
    let lasts_s = if lasts.is_empty() { 0.0 } else { seconds(lasts)? };
    let at_s = seconds(at)?;
    (!repeats || at_s > lasts_s).then_some(Window { lasts_s, at_s, repeats })
}

/// Counts of injected faults.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FaultCounts {
    /// Random bytes inserted.
    pub noise_bytes: u64,
    /// Bytes dropped.
    pub dropped_bytes: u64,
    /// Bits flipped.
    pub flipped_bits: u64,
    /// Bytes garbled because the receiver uses another baud rate.
    pub garbled_bytes: u64,
}

/// A line that applies [`Faults`] to bytes; the same seed gives the same faults.
#[derive(Clone, Debug)]
pub struct FaultyLine {
    state: u64,
    /// Faults injected so far.
    pub done: FaultCounts,
}

impl FaultyLine {
    /// A line with its own random sequence.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        Self { state: seed, done: FaultCounts::default() }
    }

    /// SplitMix64 (Steele, Lea and Flood 2014).
    fn random(&mut self) -> u64 {
        self.state = self.state.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mixed = (self.state ^ (self.state >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        mixed ^ (mixed >> 31)
    }

    fn chance(&mut self, of: f64) -> bool {
        of > 0.0 && (self.random() >> 11) as f64 / (1_u64 << 53) as f64 <= of
    }

    /// Appends what the receiver gets for `byte` to `arrives`. `baud_ratio` is the receiver's baud rate over the sender's;
    /// any ratio but 1 gives random bytes, more or fewer than were sent.
    pub fn pass(&mut self, byte: u8, faults: &Faults, baud_ratio: f64, arrives: &mut Vec<u8>) {
        if baud_ratio != 1.0 {
            self.done.garbled_bytes += 1;
            let (whole, part) = (baud_ratio.min(4.0).floor(), baud_ratio.min(4.0).fract());
            let count = whole as u32 + u32::from(self.chance(part));
            for _ in 0..count {
                arrives.push(self.random() as u8);
            }
            return;
        }
        if self.chance(faults.noise) {
            self.done.noise_bytes += 1;
            arrives.push(self.random() as u8);
        }
        if self.chance(faults.drop) {
            self.done.dropped_bytes += 1;
            return;
        }
        let mut byte = byte;
        for bit in 0..8 {
            if self.chance(faults.flip) {
                self.done.flipped_bits += 1;
                byte ^= 1 << bit;
            }
        }
        arrives.push(byte);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faults_are_written_as_shown() {
        let text = "noise=1e-4, drop=0.5,flip=1e-5,silence=2s@10s,unplug=1s/20s,reset@30s,drift=-50ppm";
        let faults: Faults = text.parse().unwrap();
        assert_eq!((faults.noise, faults.drop, faults.flip), (1e-4, 0.5, 1e-5));
        assert!((faults.drift + 50e-6).abs() < 1e-18);
        let at = |window: &Window, s| window.at(Duration::from_secs(s));
        assert_eq!([9, 10, 11, 12].map(|s| at(&faults.silence[0], s)), [(0, false), (1, true), (1, true), (1, false)]);
        assert_eq!([19, 20, 21, 40].map(|s| at(&faults.unplug[0], s)), [(0, false), (1, true), (1, false), (2, true)]);
        assert_eq!([29, 30].map(|s| at(&faults.reset[0], s)), [(0, false), (1, false)]);
        assert_eq!("".parse::<Faults>().unwrap(), Faults::default());
        let why = |text: &str| text.parse::<Faults>().unwrap_err().to_string();
        assert!(why("nois=1").contains("did you mean `noise`"));
        assert!(why("drop=2").contains("0 to 1"));
        assert!(why("unplug=2s").contains("unplug=1s@20s"));
        assert!(why("unplug=9s/3s").contains("every"));
        assert!(why("banana").contains("one of"));
    }

    #[test]
    fn a_line_does_what_it_counts_and_the_same_again() {
        let faults: Faults = "noise=0.01,drop=0.01,flip=0.001".parse().unwrap();
        let pass = |seed, baud_ratio| {
            let (mut line, mut out) = (FaultyLine::new(seed), Vec::new());
            (0..100_000).for_each(|_| line.pass(0x55, &faults, baud_ratio, &mut out));
            (line.done, out)
        };
        let (done, out) = pass(1, 1.0);
        assert_eq!(out.len() as u64, 100_000 + done.noise_bytes - done.dropped_bytes);
        // Binomial: six standard deviations.
        assert!(done.noise_bytes.abs_diff(1000) < 190 && done.dropped_bytes.abs_diff(1000) < 190, "{done:?}");
        assert!(done.flipped_bits.abs_diff(792) < 170, "{done:?}");
        assert_eq!(pass(1, 1.0), (done, out.clone()));
        assert_ne!(pass(2, 1.0).1, out);
        let (done, out) = pass(1, 0.5);
        assert_eq!(done.garbled_bytes, 100_000);
        assert!(out.len().abs_diff(50_000) < 1000);
    }
}
