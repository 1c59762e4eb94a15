//! What is found of a slow touch, a finger or a ball that slides at 5 mm/s: its velocity on noisy sensors and on quiet ones, how far
//! hysteresis holds it back, its force and its area.
//!
//! `SOMATIC_SEEDS=3 cargo test --test it slow -- --nocapture` prints the tables of docs/evidence/touches.md, under all four layers; without
//! seeds there is one, and the layers are those that are simulated fast.

use crate::fit_cells::{Random, found, grid};

const PITCH_M: f64 = 5e-3;
const SIGMA_M: f64 = 2e-3;
const SPEED: f64 = 5e-3;
/// It slides for this long, s, at this many frames a second.
const SLIDES: f64 = 2.0;
const RATE_HZ: f64 = 50.0;
/// A velocity is over this time, which begins when the touch does.
const OVER: f64 = 0.2;

/// Errors of velocities of many frames, m/s.
#[derive(Default)]
struct Errors {
    frames: usize,
    without: usize,
    speeds: f64,
    squares: f64,
}

impl Errors {
    fn bias(&self) -> f64 {
        self.speeds / self.frames as f64 / SPEED - 1.0
    }

    fn rms(&self) -> f64 {
        (self.squares / self.frames as f64).sqrt() / SPEED
    }
}

/// Where seeds are given, all layers.
fn layers(seeds: Option<u64>) -> &'static [&'static str] {
    let all = &["gaussian", "boussinesq", "exponential", "bonded"];
    if seeds.is_some() { all } else { &all[..2] }
}

/// A touch that slides for [`SLIDES`], on sensors of this hysteresis.
fn simulation(seed: u64, layer: &str, noise: f64, hysteresis: f64) -> String {
    let mut random = Random(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1);
    let direction = std::f64::consts::TAU * random.next();
    let [u, v] = [0, 1].map(|_| 0.01 * (random.next() - 0.5));
    let half = SPEED * SLIDES / 2.0;
    let (x, y) = (half * direction.cos(), half * direction.sin());
    let indenter = if seed.is_multiple_of(2) { "ball\"\nradius_m = 0.0127" } else { "fingertip\"" };
    let spread = if layer == "bonded" { 0.460_634_846_4 } else { 3.0_f64.sqrt().recip() };
    format!(
        "rate_hz = {RATE_HZ}\nduration_s = {}\nseed = {seed}\n[layer]\nthickness_m = {}\nkernel = \"{layer}\"\ncontact = \"hertz\"\n\
         [sensor]\nkind = \"ideal\"\nnoise_sigma = {noise}\nhysteresis = {hysteresis}\n[[touch]]\non = \"grid\"\nindenter = \"{indenter}\n\
         path = [[{}, {}], [{}, {}]]\ntimes_s = [0.5, {}]\nforce_newton = [[0.2, 0], [0.3, 4], [{}, 4]]\n",
        SLIDES + 1.0,
        SIGMA_M / spread,
        u - x,
        v - y,
        u + x,
        v + y,
        0.5 + SLIDES,
        SLIDES + 1.0
    )
}

#[test]
fn a_slow_touch_has_its_velocity() {
    let seeds: Option<u64> = std::env::var("SOMATIC_SEEDS").ok().map(|seeds| seeds.parse().unwrap());
    let noises = if seeds.is_some() { &[1e-3, 3e-3, 10e-3, 30e-3][..] } else { &[3e-3] };
    let body = grid(PITCH_M);
    println!(
        "| layer | noise | speed is off by | velocity is off by (RMS) | fit's velocity (RMS) |\n|---|---|---|---|---|"
    );
    let mut wrong = Vec::new();
    for layer in layers(seeds) {
        for &noise in noises {
            let [mut moments, mut fits] = [Errors::default(), Errors::default()];
            for seed in 3000..3000 + seeds.unwrap_or(1) {
                let (percepts, truths) = found(&body, &simulation(seed, layer, noise, 0.0), (SIGMA_M, 0.0));
                for (frame, truths) in truths.iter().enumerate() {
                    let t = frame as f64 / RATE_HZ;
                    // Only the sliding itself: while a velocity's time holds a rest, it is the mean of both.
                    if !(0.5 + OVER + 0.01..SLIDES + 0.5).contains(&t) {
                        continue;
                    }
                    let touches = percepts.touches(frame).unwrap();
                    let touch = touches.touches.iter().max_by(|a, b| a.total.total_cmp(&b.total)).expect("it presses");
                    let right = truths[0].velocity_in_link.unwrap();
                    let both = [(&mut moments, touch.velocity), (&mut fits, touch.fit.and_then(|fit| fit.velocity))];
                    for (errors, velocity) in both {
                        let Some(velocity) = velocity else {
                            errors.without += 1;
                            continue;
                        };
                        errors.frames += 1;
                        errors.speeds += velocity.length();
                        errors.squares += velocity.distance_squared(right);
                    }
                }
            }
            let [bias, rms, of_fit] = [moments.bias(), moments.rms(), fits.rms()].map(|share| 100.0 * share);
            println!("| {layer} | {:.0} mN | {bias:+.1} % | {rms:.1} % | {of_fit:.1} % |", 1e3 * noise);
            // Of noisier sensors the moments' velocity is off by more, and that of the fit by less.
            let within = if noise < 10e-3 { rms.max(of_fit) <= 15.0 } else { of_fit <= 0.75 * rms };
            let most = if noise > 10e-3 { 6.0 } else { 3.0 };
            if bias.abs() > most || !within || moments.without > 0 {
                wrong.push(format!(
                    "{layer} {noise}: {bias:.1} %, {rms:.1} %, {of_fit:.1} %, {} without",
                    moments.without
                ));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn hysteresis_holds_a_touch_back() {
    let seeds: Option<u64> = std::env::var("SOMATIC_SEEDS").ok().map(|seeds| seeds.parse().unwrap());
    let shares = if seeds.is_some() { &[0.0, 0.08][..] } else { &[0.08] };
    let body = grid(PITCH_M);
    println!("| layer | hysteresis | position is behind by | place is behind by |\n|---|---|---|---|");
    for layer in layers(seeds) {
        for &hysteresis in shares {
            let (mut behind, mut frames) = ([0.0; 2], 0);
            for seed in 4000..4000 + seeds.unwrap_or(1) {
                let (percepts, truths) = found(&body, &simulation(seed, layer, 3e-3, hysteresis), (SIGMA_M, 0.0));
                for (frame, truths) in truths.iter().enumerate() {
                    let t = frame as f64 / RATE_HZ;
                    // From the second millimetre on, all sensors of the contact have been both ways.
                    if !(1.0..SLIDES + 0.5).contains(&t) {
                        continue;
                    }
                    let touches = percepts.touches(frame).unwrap();
                    let touch = touches.touches.iter().max_by(|a, b| a.total.total_cmp(&b.total)).expect("it presses");
                    let ahead = truths[0].velocity_in_link.unwrap().normalize();
                    let off = |place: glam::DVec3| (truths[0].position_in_link - place).dot(ahead);
                    behind[0] += off(touch.position);
                    behind[1] += off(touch.place.unwrap());
                    frames += 1;
                }
            }
            let [position, place] = behind.map(|sum| 1e3 * sum / f64::from(frames));
            println!("| {layer} | {:.0} % | {position:.2} mm | {place:.2} mm |", 100.0 * hysteresis);
            let within = if hysteresis > 0.0 { 0.02..0.5 } else { -0.1..0.1 };
            assert!(within.contains(&position) && within.contains(&place), "{layer}: {position} {place} mm");
        }
    }
}

#[test]
fn a_dead_band_takes_off_a_force_and_a_layer_adds_to_an_area() {
    println!("| bits | force | area over that of the contact |\n|---|---|---|");
    // Hertz: a³ = 3FR/4E* of a finger of 8 mm and 50 kPa on the layer's 400 kPa.
    let contact_m2 = std::f64::consts::PI * (0.75 * 4.0 * 0.008 * (1.0 / 400e3 + 1.0 / 50e3_f64)).cbrt().powi(2);
    let body = grid(PITCH_M);
    let mut lost = Vec::new();
    for (bits, gain, noise) in [(12, 800, 1.0), (10, 200, 0.5), (8, 50, 0.3)] {
        let text = format!(
            "rate_hz = 10\nduration_s = 20\nseed = 3\n[layer]\nthickness_m = 0.0035\nkernel = \"boussinesq\"\ncontact = \"hertz\"\n\
             [sensor]\nkind = \"linear\"\nbits = {bits}\ngain = {gain}\noffset = 10\nnoise_sigma = {noise}\n[[touch]]\non = \"grid\"\n\
             indenter = \"fingertip\"\npath = [[-0.01, -0.01], [0.01, 0.01]]\ntimes_s = [0.5, 19]\nforce_newton = [[0.5, 4], [19.5, 4]]\n"
        );
        let (percepts, _) = found(&body, &text, (SIGMA_M, 0.0));
        let touches = (10..180).map(|frame| &percepts.touches(frame).unwrap().touches[0]);
        let (forces, areas): (Vec<f64>, Vec<f64>) =
            touches.map(|touch| (touch.force_newton.unwrap(), touch.area_m2.unwrap())).unzip();
        let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
        let (force, area) = (100.0 * (mean(&forces) / 4.0 - 1.0), mean(&areas) / contact_m2);
        println!("| {bits} | {force:+.1} % | {area:.1} |");
        lost.push((force, area));
    }
    // The coarser the sensors, the more is lost of the force, and of what the layer adds to the area.
    assert!(lost.windows(2).all(|pair| pair[0].0 > pair[1].0 && pair[0].1 > pair[1].1), "{lost:?}");
    assert!(lost.iter().all(|(force, area)| (-12.0..-1.0).contains(force) && (1.5..4.0).contains(area)), "{lost:?}");
}
