//! A touch for the hand of all senses: another hand comes near its palm, rests on it, presses and warms it, is drawn over it towards
//! the wrist, and goes; then a fingertip presses its index finger and is drawn along it, too.
//!
//! What presses is spread by a layer, as in the other touch. What is drawn over the skin sticks until its tangential force is μ times
//! its pressure; a thermometer follows what is near with a delay; a distance sensor reads to the nearest point over it.

use std::fmt::Write as _;

use glam::DVec3;
use somatic::body::Modality;

use super::hand::Sensor;

const RATE_HZ: u32 = 50;
const FRAMES: u32 = 300;

/// Temperatures of the hand at rest and of the one that comes, °C.
const COOL: f64 = 24.0;
const WARM: f64 = 33.5;
/// How fast a thermometer follows, s; how far warmth reaches, and how far it spreads along the skin, m.
const DELAY_S: f64 = 0.8;
const REACH: f64 = 0.03;
const WARM_SPREAD: f64 = 22e-3;

/// When the other hand comes, rests on the palm, and has gone, s; how far away it begins, m.
const COMES: (f64, f64) = (0.4, 1.6);
const GOES: (f64, f64) = (3.4, 4.0);
const FAR: f64 = 0.08;
/// The most that a distance sensor reads, mm.
const MOST_MM: f64 = 60.0;

/// When the fingertip presses the index finger, s.
const FINGERTIP: (f64, f64) = (4.0, 5.6);

/// How long it takes to press and to let go; how long a drag begins after the one and ends before the other has ended, s.
const PRESSES_S: f64 = 0.3;
const RESTS_S: f64 = 0.4;
/// How far it is dragged, m; friction at which it slips; tangential force for each metre while it sticks, as a share of pressure.
const DRAGGED: f64 = 6e-3;
const SLIPS_AT: f64 = 0.6;
const STIFFNESS: f64 = 180.0;

/// From 0 to 1 over `(start, end)`, smoothly.
fn rise(t_s: f64, (start, end): (f64, f64)) -> f64 {
    let x = ((t_s - start) / (end - start)).clamp(0.0, 1.0);
    x * x * (3.0 - 2.0 * x)
}

fn bell(distance_squared: f64, spread: f64) -> f64 {
    libm::exp(-distance_squared / (2.0 * spread * spread))
}

/// How far the other hand is from the palm, m; 0 while it rests on it.
fn distance(t_s: f64) -> f64 {
    FAR * (1.0 - rise(t_s, COMES) + rise(t_s, GOES))
}

/// What presses the sensors of one field and is then drawn over them, towards the wrist.
struct Drag {
    field: &'static str,
    /// When it begins to press and has let go, s.
    over: (f64, f64),
    /// Pressure under its middle, N; spread of its footprint, m.
    newton: f64,
    spread: f64,
    /// Its middle at first, and the way from there, in the hand.
    from: DVec3,
    way: DVec3,
}

impl Drag {
    /// The other hand, around the palm's middle sensor.
    fn over_palm(sensors: &[Sensor]) -> Self {
        let middle = of_three_axes(sensors, "hand/palm").nth(4).expect("a palm has nine");
        let way = -middle.tangent.expect("it has three axes");
        let (from, over) = (middle.position_in_hand, (COMES.1, GOES.0));
        Self { field: "hand/palm", over, newton: 1.4, spread: 11e-3, from, way }
    }

    /// The fingertip, between the two sensors on the index finger's pad.
    fn along_index(sensors: &[Sensor]) -> Self {
        let index: Vec<&Sensor> = of_three_axes(sensors, "hand/midhand/index").collect();
        let from = index[2].position_in_hand.midpoint(index[3].position_in_hand);
        let way = -index[2].tangent.expect("it has three axes");
        Self { field: "hand/midhand/index", over: FINGERTIP, newton: 1.1, spread: 5e-3, from, way }
    }

    /// How far it has been dragged, m.
    fn dragged(&self, t_s: f64) -> f64 {
        DRAGGED * rise(t_s, (self.over.0 + RESTS_S, self.over.1 - RESTS_S))
    }

    /// Its middle: where it is while the layer gives.
    fn place(&self, t_s: f64) -> DVec3 {
        self.from + self.way * (self.dragged(t_s) - SLIPS_AT / STIFFNESS).max(0.0)
    }

    /// A sensor's pressure, and its tangential force along the way.
    fn felt(&self, t_s: f64, sensor: &Sensor) -> [f64; 2] {
        let (start, end) = self.over;
        let presses = rise(t_s, (start, start + PRESSES_S)) - rise(t_s, (end - PRESSES_S, end));
        let distance_squared = sensor.position_in_hand.distance_squared(self.place(t_s));
        let newton = self.newton * presses * bell(distance_squared, self.spread);
        [newton, newton * (STIFFNESS * self.dragged(t_s)).min(SLIPS_AT)]
    }
}

fn of_three_axes<'a>(sensors: &'a [Sensor], field: &'a str) -> impl Iterator<Item = &'a Sensor> {
    sensors.iter().filter(move |sensor| sensor.field == field && sensor.modality == Modality::Force3)
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
    let drags = [Drag::over_palm(sensors), Drag::along_index(sensors)];
    let felt = |t_s: f64, sensor: &Sensor| {
        let drag = drags.iter().find(|drag| drag.field == sensor.field);
        drag.map_or([0.0; 2], |drag| drag.felt(t_s, sensor))
    };
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
        let (away, warmest) = (distance(t_s), drags[0].place(t_s));
        for (sensor, celsius) in sensors.iter().zip(&mut celsius) {
            let value = match sensor.modality {
                Modality::Temperature => {
                    let apart = sensor.position_in_hand.distance_squared(warmest);
                    let near = libm::exp(-away / REACH) * bell(apart, WARM_SPREAD);
                    let towards = COOL + (WARM - COOL) * near;
                    *celsius += (towards - *celsius) / (DELAY_S * f64::from(RATE_HZ));
                    *celsius
                }
                Modality::Proximity => (1e3 * away).min(MOST_MM),
                _ => felt(t_s, sensor)[0],
            };
            put(&mut text, value);
        }
        for sensor in pulled() {
            // The way is against the tangent.
            put(&mut text, -felt(t_s, sensor)[1]);
            text += ",0";
        }
        text.push('\n');
    }
    text
}
