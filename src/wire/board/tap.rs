//! What a potentiometer's tap does to a reading that was taken at another.
//!
//! The sensor R and the potentiometer D(tap) = 50 kΩ · tap/256 + 52 Ω divide the supply. With x the reading over full
//! scale and r = D(tap)/D(38), for readings that rise when pressed x = D/(D + R), and
//!
//! x′ = x·r / (x·r + 1 − x);
//!
//! for readings that fall when pressed x = R/(D + R), and x′ = x / (x + (1 − x)·r). A reading stands for the middle of its
//! step, but that of an open sensor, the lowest or the highest, stays what it is. At tap 38 nothing changes.

use super::super::format::Bits;

/// The tap that recordings are taken to be made at.
pub const RECORDED_TAP: u8 = 38;

fn divider_ohm(tap: u8) -> f64 {
    50_000.0 * f64::from(tap) / 256.0 + 52.0
}

/// The reading at `tap` of what reads `recorded` at tap 38.
pub(super) fn at_tap(recorded: u16, bits: Bits, tap: u8, falls: bool) -> u16 {
    let most = bits.most();
    let open = if falls { most } else { 0 };
    if tap == RECORDED_TAP || recorded == open {
        return recorded.min(most);
    }
    let full = f64::from(most) + 1.0;
    let x = (f64::from(recorded.min(most)) + 0.5) / full;
    let ratio = divider_ohm(tap) / divider_ohm(RECORDED_TAP);
    let moved = if falls { x / (x + (1.0 - x) * ratio) } else { x * ratio / (x * ratio + 1.0 - x) };
    // In 0..full, as x is inside 0..1.
    ((moved * full) as u16).min(most)
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
        // By hand: x = 512.5/1024, r = 49.857 kΩ / 7.474 kΩ = 6.671: 6.684 / 7.684 of 1024.
        assert_eq!(at_tap(512, Bits::Ten, 255, false), 890);
    }
}
