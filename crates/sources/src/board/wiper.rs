//! Converts a reading from one position of a potentiometer's wiper to another.
//!
//! The sensor R and the potentiometer D(wiper) = 50 kΩ · wiper/256 + 52 Ω divide the supply. With x the reading over full
//! scale and r = D(wiper)/D(38), for readings that rise when pressed x = D/(D + R), and
//!
//! x′ = x·r / (x·r + 1 − x);
//!
//! for readings that fall when pressed x = R/(D + R), and x′ = x / (x + (1 − x)·r). A reading stands for the middle of its
//! step, but that of an open sensor, the lowest or the highest, stays what it is. At wiper 38 nothing changes.

use crate::wire::Bits;

/// The wiper position at which recordings are assumed to be made.
pub const RECORDED_WIPER: u8 = 38;

fn divider_ohm(wiper: u8) -> f64 {
    50_000.0 * f64::from(wiper) / 256.0 + 52.0
}

/// The reading at `wiper` of a sensor that reads `recorded` at wiper 38.
pub(super) fn at_wiper(recorded: u16, bits: Bits, wiper: u8, falls: bool) -> u16 {
    let max = bits.max();
    let open = if falls { max } else { 0 };
    if wiper == RECORDED_WIPER || recorded == open {
        return recorded.min(max);
    }
    let full = f64::from(max) + 1.0;
    let x = (f64::from(recorded.min(max)) + 0.5) / full;
    let ratio = divider_ohm(wiper) / divider_ohm(RECORDED_WIPER);
    let moved = if falls { x / (x + (1.0 - x) * ratio) } else { x * ratio / (x * ratio + 1.0 - x) };
    // In 0..full, as x is inside 0..1.
    ((moved * full) as u16).min(max)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wiper_stretches_the_range_and_keeps_rest_and_order() {
        for falls in [false, true] {
            let rest = if falls { 1023 } else { 0 };
            for wiper in [0, 1, 37, 38, 39, 128, 255] {
                let read = |recorded| at_wiper(recorded, Bits::Ten, wiper, falls);
                assert_eq!(read(rest), rest);
                assert!((1..=1023).all(|value| read(value) >= read(value - 1) && read(value) <= 1023));
                let more_pressed = (read(512) > 512) != falls;
                assert!(wiper == RECORDED_WIPER || more_pressed == (wiper > RECORDED_WIPER), "{wiper} {}", read(512));
            }
        }
        assert_eq!(at_wiper(700, Bits::Ten, RECORDED_WIPER, false), 700);
        // As the paper's circuit itself: a step at wiper 38 is as many at another as the curve is steeper there, and a
        // reading stands for the middle of its step.
        use crate::signal::FsrCircuit;
        for (wiper, force) in (0..=255).flat_map(|wiper| (1..100).map(move |n| (wiper, 0.1 * f64::from(n)))) {
            let recorded = FsrCircuit::default().counts(force);
            let [low, high] = [recorded, recorded + 1].map(|counts| {
                let x = f64::from(counts.min(1023)) / 1024.0;
                1024.0 * x / (x + (1.0 - x) * divider_ohm(wiper) / divider_ohm(RECORDED_WIPER))
            });
            let (read, own) = (at_wiper(recorded, Bits::Ten, wiper, true), FsrCircuit { wiper }.counts(force));
            assert!(f64::from(own.abs_diff(read)) <= high - low + 1.0, "{force} N at {wiper}: {own} {read}");
        }
        // By hand: x = 512.5/1024, r = 49.857 kΩ / 7.474 kΩ = 6.671: 6.684 / 7.684 of 1024.
        assert_eq!(at_wiper(512, Bits::Ten, 255, false), 890);
    }
}
