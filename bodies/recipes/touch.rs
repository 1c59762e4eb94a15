//! A touch for the hand: a fingertip taps each finger, a rod rolls over the back, a fingertip is drawn across the palm.
//!
//! Each sensor lies under a compliant layer that spreads what presses on it, so that it reads a bell-shaped footprint
//! around the place of contact, as counts of a 10-bit converter. Untouched, it reads 0.

use std::fmt::Write as _;

use glam::{DVec2, DVec3};

use super::hand::Sensor;

const RATE_HZ: u32 = 50;
const FRAMES: u32 = 280;

/// Counts under the middle of a footprint at full force, and the largest count there is.
const FULL_COUNTS: f64 = 880.0;
const MOST_COUNTS: f64 = 1023.0;

/// Spread of the footprints behind the layer, m: of a fingertip's tap, of a rod of 25.4 mm, of a finger drawn along.
const TAP_SPREAD: f64 = 4.4e-3;
const ROD_SPREAD: f64 = 4.8e-3;
const STROKE_SPREAD: f64 = 5.6e-3;

/// The taps, one a finger: when the first starts, how far apart they start, how long each lasts, s.
const TAPS: (f64, f64, f64) = (0.20, 0.40, 0.24);
/// The rod: when it meets the board and when it leaves, s; from where to where along the hand, m.
const ROD: (f64, f64) = (2.00, 3.60);
const ROD_PATH: (f64, f64) = (0.021, -0.021);
/// How far the rod's axis lies along the hand for each metre across: a slant of 20°.
const ROD_SLANT: f64 = 0.364;
/// The stroke across the palm: its start and end, s, and the corners of its curve (x, z), m.
const STROKE: (f64, f64) = (3.80, 5.40);
const STROKE_PATH: [DVec2; 3] = [DVec2::new(-0.015, -0.013), DVec2::new(-0.004, 0.030), DVec2::new(0.015, -0.010)];

/// How far through `(start, end)` the time `t_s` is; `None` outside.
fn progress(t_s: f64, (start, end): (f64, f64)) -> Option<f64> {
    let s = (t_s - start) / (end - start);
    (0.0..=1.0).contains(&s).then_some(s)
}

/// A force that comes on over the first `ramp` of a touch and goes over its last.
fn pressed(s: f64, ramp: f64) -> f64 {
    let x = (s.min(1.0 - s) / ramp).clamp(0.0, 1.0);
    x * x * (3.0 - 2.0 * x)
}

fn bell(distance_squared: f64, spread: f64) -> f64 {
    libm::exp(-distance_squared / (2.0 * spread * spread))
}

fn taps(t_s: f64, sensor: &Sensor, fingers: &[(&str, DVec3)]) -> f64 {
    let (first, apart, lasts) = TAPS;
    let starts = (0..fingers.len()).map(|n| first + apart * n as f64);
    let forces = starts.zip(fingers).filter(|(_, (field, _))| *field == sensor.field).map(|(start, (_, pad))| {
        let force = progress(t_s, (start, start + lasts)).map_or(0.0, |s| pressed(s, 0.5));
        force * bell(sensor.position_in_hand.distance_squared(*pad), TAP_SPREAD)
    });
    forces.sum()
}

fn rod(t_s: f64, sensor: &Sensor) -> f64 {
    let Some(s) = progress(t_s, ROD).filter(|_| sensor.field == "hand/back") else { return 0.0 };
    let at = ROD_PATH.0 + (ROD_PATH.1 - ROD_PATH.0) * s;
    let off_axis = sensor.position_in_hand.z - at - ROD_SLANT * sensor.position_in_hand.x;
    let distance_squared = off_axis * off_axis / (1.0 + ROD_SLANT * ROD_SLANT);
    pressed(s, 0.15) * bell(distance_squared, ROD_SPREAD)
}

fn stroke(t_s: f64, sensor: &Sensor) -> f64 {
    let Some(s) = progress(t_s, STROKE).filter(|_| sensor.field == "hand/palm") else { return 0.0 };
    let [a, b, c] = STROKE_PATH;
    let at = a * ((1.0 - s) * (1.0 - s)) + b * (2.0 * s * (1.0 - s)) + c * (s * s);
    let place = DVec2::new(sensor.position_in_hand.x, sensor.position_in_hand.z);
    0.85 * pressed(s, 0.12) * bell(place.distance_squared(at), STROKE_SPREAD)
}

/// The touch as CSV: time in seconds, then a count for each of `sensors`.
pub(crate) fn csv(sensors: &[Sensor]) -> String {
    let fingers: Vec<(&str, DVec3)> = sensors
        .chunk_by(|a, b| a.field == b.field)
        .filter(|board| board[0].field.starts_with("hand/midhand/"))
        // The tap meets the pad between its last three sensors.
        .map(|board| (board[0].field, board[2..].iter().map(|s| s.position_in_hand).sum::<DVec3>() / 3.0))
        .collect();
    let mut text = String::from("t");
    for sensor in sensors {
        write!(text, ",{}", sensor.id).expect("a string takes all");
    }
    text.push('\n');
    for frame in 0..FRAMES {
        let t_s = f64::from(frame) / f64::from(RATE_HZ);
        write!(text, "{t_s:.2}").expect("a string takes all");
        for sensor in sensors {
            let force = taps(t_s, sensor, &fingers) + rod(t_s, sensor) + stroke(t_s, sensor);
            let counts = (FULL_COUNTS * force).floor().min(MOST_COUNTS);
            write!(text, ",{counts}").expect("a string takes all");
        }
        text.push('\n');
    }
    text
}
