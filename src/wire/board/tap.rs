//! Converts a reading from one potentiometer tap to another.
//!
//! The sensor R and the potentiometer D(tap) = 50 kΩ · tap/256 + 52 Ω divide the supply. With x the reading over full
//! scale and r = D(tap)/D(38), for readings that rise when pressed x = D/(D + R), and
//!
//! x′ = x·r / (x·r + 1 − x);
//!
//! for readings that fall when pressed x = R/(D + R), and x′ = x / (x + (1 − x)·r). A reading stands for the middle of its
//! step, but that of an open sensor, the lowest or the highest, stays what it is. At tap 38 nothing changes.

use super::super::format::Bits;

/// The tap at which recordings are assumed to be made.
pub const RECORDED_TAP: u8 = 38;

fn divider_ohm(tap: u8) -> f64 {
    50_000.0 * f64::from(tap) / 256.0 + 52.0
}

/// The reading at `tap` of a sensor that reads `recorded` at tap 38.
pub(super) fn at_tap(recorded: u16, bits: Bits, tap: u8, falls: bool) -> u16 {
    let max = bits.max();
    let open = if falls { max } else { 0 };
    if tap == RECORDED_TAP || recorded == open {
        return recorded.min(max);
    }
    let full = f64::from(max) + 1.0;
    let x = (f64::from(recorded.min(max)) + 0.5) / full;
    let ratio = divider_ohm(tap) / divider_ohm(RECORDED_TAP);
    let moved = if falls { x / (x + (1.0 - x) * ratio) } else { x * ratio / (x * ratio + 1.0 - x) };
    // In 0..full, as x is inside 0..1.
    ((moved * full) as u16).min(max)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tap_stretches_the_range_and_keeps_rest_and_order() {
        for falls in [false, true] {
            let rest = if falls { 1023 } else { 0 };
            for tap in [0, 1, 37, 38, 39, 128, 255] {
                let read = |recorded| at_tap(recorded, Bits::Ten, tap, falls);
                assert_eq!(read(rest), rest);
                assert!((1..=1023).all(|value| read(value) >= read(value - 1) && read(value) <= 1023));
                let more_pressed = (read(512) > 512) != falls;
                assert!(tap == RECORDED_TAP || more_pressed == (tap > RECORDED_TAP), "{tap} {}", read(512));
            }
        }
        assert_eq!(at_tap(700, Bits::Ten, RECORDED_TAP, false), 700);
        // As the paper's circuit itself: a step at tap 38 is as many at another as the curve is steeper there, and a
        // reading stands for the middle of its step.
        use crate::signal::FsrCircuit;
        for (tap, force) in (0..=255).flat_map(|tap| (1..100).map(move |n| (tap, 0.1 * f64::from(n)))) {
            let recorded = FsrCircuit::default().counts(force);
            let [low, high] = [recorded, recorded + 1].map(|counts| {
                let x = f64::from(counts.min(1023)) / 1024.0;
                1024.0 * x / (x + (1.0 - x) * divider_ohm(tap) / divider_ohm(RECORDED_TAP))
            });
            let (read, own) = (at_tap(recorded, Bits::Ten, tap, true), FsrCircuit { tap }.counts(force));
            assert!(f64::from(own.abs_diff(read)) <= high - low + 1.0, "{force} N at {tap}: {own} {read}");
        }
        // By hand: x = 512.5/1024, r = 49.857 kΩ / 7.474 kΩ = 6.671: 6.684 / 7.684 of 1024.
        assert_eq!(at_tap(512, Bits::Ten, 255, false), 890);
    }
}
