//! A touch for the hand of all senses: another hand comes near its palm, warms it, presses it and goes; then a fingertip presses its
//! index finger and is dragged along it.
//!
//! What presses is spread by a layer, as in the other touch. A dragged finger sticks until its tangential force is μ times its
//! pressure; a thermometer follows what is near with a delay; a distance sensor reads to the nearest point over it.

use std::fmt::Write as _;

use glam::DVec3;
use somatic::body::Modality;

use super::hand::Sensor;

const RATE_HZ: u32 = 50;
const FRAMES: u32 = 300;

/// Temperatures of the hand at rest and of the one that comes, °C.
const COOL: f64 = 24.0;
const WARM: f64 = 33.5;
/// How fast a thermometer follows, s; and how far warmth reaches, m.
const DELAY_S: f64 = 0.8;
const REACH: f64 = 0.03;

/// When the other hand comes, rests on the palm, and has gone, s; how far away it begins, m.
const COMES: (f64, f64) = (0.4, 1.6);
const GOES: (f64, f64) = (2.8, 3.6);
const FAR: f64 = 0.08;
/// The most that a distance sensor reads, mm.
const MOST_MM: f64 = 60.0;

/// Pressure under the middle of the palm, N; spread of its footprint, m.
const PALM_NEWTON: f64 = 1.4;
const PALM_SPREAD: f64 = 11e-3;

/// When the index finger is pressed and dragged, s; pressure, N; spread, m; friction at which it slips.
const DRAG: (f64, f64) = (4.0, 5.6);
const DRAG_NEWTON: f64 = 1.1;
const DRAG_SPREAD: f64 = 5e-3;
const SLIPS_AT: f64 = 0.6;
/// Tangential force for each metre that it is dragged while it sticks, as a share of pressure.
const STIFFNESS: f64 = 180.0;
/// How far it is dragged, m.
const DRAGGED: f64 = 6e-3;

/// From 0 to 1 over `(start, end)`, smoothly.
fn rise(t_s: f64, (start, end): (f64, f64)) -> f64 {
    let x = ((t_s - start) / (end - start)).clamp(0.0, 1.0);
    x * x * (3.0 - 2.0 * x)
}

fn bell(distance_squared: f64, spread: f64) -> f64 {
    libm::exp(-distance_squared / (2.0 * spread * spread))
}

/// How far the other hand is from the palm, m; 0 where it rests on it.
fn distance(t_s: f64) -> f64 {
    FAR * (1.0 - rise(t_s, COMES) + rise(t_s, GOES))
}

fn palm_pressure(t_s: f64, sensor: &Sensor) -> f64 {
    let presses = rise(t_s, (COMES.1, COMES.1 + 0.3)) - rise(t_s, (GOES.0 - 0.3, GOES.0));
    let place = DVec3::new(sensor.position_in_hand.x, 0.0, sensor.position_in_hand.z);
    PALM_NEWTON * presses * bell(place.length_squared(), PALM_SPREAD)
}

/// Pressure and tangential force along the finger of the drag.
fn drag(t_s: f64, sensor: &Sensor, tip: DVec3, along: DVec3) -> [f64; 2] {
    let presses = rise(t_s, (DRAG.0, DRAG.0 + 0.3)) - rise(t_s, (DRAG.1 - 0.3, DRAG.1));
    let moved = DRAGGED * rise(t_s, (DRAG.0 + 0.4, DRAG.1 - 0.4));
    // It stays where it is while the layer gives.
    let slid = (moved - SLIPS_AT / STIFFNESS).max(0.0);
    let at = tip - along * slid;
    let newton = DRAG_NEWTON * presses * bell(sensor.position_in_hand.distance_squared(at), DRAG_SPREAD);
    [newton, newton * (STIFFNESS * moved).min(SLIPS_AT)]
}

/// Adds a cell to three digits after the point, and 0 as that.
fn put(text: &mut String, value: f64) {
    if value.abs() < 5e-4 {
        text.push_str(",0");
    } else {
        write!(text, ",{value:.3}").expect("a string takes all");
    }
}

/// The touch as CSV: time in seconds, then N for each sensor that is pressed, °C and mm for the others, and last the tangential forces.
pub(crate) fn csv(sensors: &[Sensor]) -> String {
    let index: Vec<&Sensor> = sensors.iter().filter(|sensor| sensor.field == "hand/midhand/index").collect();
    let (tip, along) =
        (index[2].position_in_hand.midpoint(index[3].position_in_hand), index[2].tangent.expect("it has three axes"));
    let pulled = || sensors.iter().filter(|sensor| sensor.modality == Modality::Force3);
    let mut text = String::from("t");
    let names = sensors.iter().map(|sensor| sensor.id.to_string());
    let tangential = pulled().flat_map(|sensor| ["u", "v"].map(|axis| format!("{}.{axis}", sensor.id)));
    for name in names.chain(tangential) {
        text += ",";
        text += &name;
    }
    text.push('\n');
    let mut celsius: Vec<f64> = vec![COOL; sensors.len()];
    for frame in 0..FRAMES {
        let t_s = f64::from(frame) / f64::from(RATE_HZ);
        write!(text, "{t_s:.2}").expect("a string takes all");
        let away = distance(t_s);
        for (sensor, celsius) in sensors.iter().zip(&mut celsius) {
            let value = match sensor.modality {
                Modality::Temperature => {
                    let place = DVec3::new(sensor.position_in_hand.x, 0.0, sensor.position_in_hand.z);
                    let near = libm::exp(-away / REACH) * bell(place.length_squared(), 2.0 * PALM_SPREAD);
                    let towards = COOL + (WARM - COOL) * near;
                    *celsius += (towards - *celsius) / (DELAY_S * f64::from(RATE_HZ));
                    *celsius
                }
                Modality::Proximity => (1e3 * away).min(MOST_MM),
                Modality::Force3 if sensor.field == "hand/midhand/index" => drag(t_s, sensor, tip, along)[0],
                _ if sensor.field == "hand/palm" => palm_pressure(t_s, sensor),
                _ => 0.0,
            };
            put(&mut text, value);
        }
        for sensor in pulled() {
            let is_dragged = sensor.field == "hand/midhand/index";
            let pull = if is_dragged { drag(t_s, sensor, tip, along)[1] } else { 0.0 };
            // Towards the wrist, against the tangent.
            put(&mut text, -pull);
            text += ",0";
        }
        text.push('\n');
    }
    text
}
