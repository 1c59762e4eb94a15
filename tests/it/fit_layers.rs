//! What a user gets of fits under layers that the fit does not know, on noisy sensors and on quiet ones.
//!
//! `SOMATIC_SEEDS=10 cargo test --release --test it fit_layers -- --nocapture` prints the table of docs/evidence/fit.md.

use somatic::{Body, TouchFlags};

use crate::fit_cells::{HALF, Random, between, flat, grid};

/// Presses of a seed and cell, and of a test without seeds.
const PRESSES: usize = 40;
const FEW_PRESSES: usize = 6;
const PITCH_M: f64 = 5e-3;
const SIGMA_M: f64 = 2e-3;
/// Touches with no more pressed taxels are counted apart.
const FEW: usize = 4;
/// What 95 of 100 errors are within, in standard deviations.
const COVERS: f64 = 1.96;

const LAYERS: [&str; 4] = ["gaussian", "boussinesq", "exponential", "bonded"];
/// σ of the noise of a sensor, N.
const NOISES: [f64; 4] = [1e-3, 3e-3, 10e-3, 30e-3];

/// What presses, and where.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Pressed {
    /// Balls and fingertips far from any border.
    Inside,
    /// The same within a pitch and a half of an edge of the sheet.
    AtRim,
    /// Rods that end on the sheet.
    Rods,
}

impl Pressed {
    fn word(self) -> &'static str {
        match self {
            Self::Inside => "inside",
            Self::AtRim => "at a rim",
            Self::Rods => "rods",
        }
    }

    fn simulation(self, (seed, presses): (u64, usize), layer: &str, noise: f64) -> String {
        let mut random = Random(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1);
        let (mut path, mut times, mut forces, mut angles) =
            (String::new(), String::new(), String::new(), String::new());
        for t in 0..presses {
            let edge = HALF * PITCH_M;
            let [u, v] = match self {
                Self::AtRim => [edge + PITCH_M * (1.5 * random.next() - 1.0), 0.03 * (random.next() - 0.5)],
                _ => [0, 1].map(|_| 0.01 * (random.next() - 0.5)),
            };
            times += &format!("{t},");
            path += &format!("[{u}, {v}],");
            // A rod is as hard on each sensor as a ball, so that it is one touch.
            let more = if self == Self::Rods { 4.0 } else { 1.0 };
            forces += &format!("[{t}, {}],", (2.0 + 6.0 * random.next()) * more);
            angles += &format!("[{t}, {}],", 180.0 * random.next());
        }
        let indenter = match (self, seed % 2) {
            (Self::Rods, _) => format!("indenter = \"rod\"\nradius_m = 0.008\nlength_m = 0.05\nangle_deg = [{angles}]"),
            (_, 0) => "indenter = \"ball\"\nradius_m = 0.0127".to_owned(),
            _ => "indenter = \"fingertip\"".to_owned(),
        };
        let spread = if layer == "bonded" { 0.460_634_846_4 } else { 3.0_f64.sqrt().recip() };
        format!(
            "rate_hz = 1\nduration_s = {presses}\nseed = {seed}\n[layer]\nthickness_m = {}\nkernel = \"{layer}\"\n\
             contact = \"hertz\"\n[sensor]\nkind = \"ideal\"\nnoise_sigma = {noise}\n[[touch]]\non = \"grid\"\n{indenter}\n\
             path = [{path}]\ntimes_s = [{times}]\nforce_newton = [{forces}]\n",
            SIGMA_M / spread
        )
    }
}

/// What was found in one cell of the table.
#[derive(Default)]
struct Found {
    /// Touches with more than [`FEW`] pressed taxels, and those with fewer.
    touches: usize,
    few: usize,
    given: usize,
    doubtful: usize,
    /// Squares of errors of the moments and of the fit, for touches that have one.
    moments: f64,
    fitted: f64,
    /// Squares of errors of the moments and of `place`, for all touches, and for those with few taxels.
    placed: [f64; 2],
    placed_of_few: [f64; 2],
    /// Errors within 1.96 σ, and their number: of the fit's place or angle, of `place`, and of the force.
    covered: [usize; 2],
    places: [usize; 2],
    forces: [usize; 2],
}

impl Found {
    fn add(&mut self, other: &Self) {
        self.touches += other.touches;
        self.few += other.few;
        self.given += other.given;
        self.doubtful += other.doubtful;
        self.moments += other.moments;
        self.fitted += other.fitted;
        for k in 0..2 {
            self.placed[k] += other.placed[k];
            self.placed_of_few[k] += other.placed_of_few[k];
            self.covered[k] += other.covered[k];
            self.places[k] += other.places[k];
            self.forces[k] += other.forces[k];
        }
    }

    fn given_share(&self) -> f64 {
        self.given as f64 / self.touches as f64
    }

    fn measure(pressed: Pressed, body: &Body, pressings: (u64, usize), layer: &str, noise: f64) -> Self {
        let text = pressed.simulation(pressings, layer, noise);
        let (percepts, truths) = crate::fit_cells::found(body, &text, (SIGMA_M, 0.0));
        let mut found = Self::default();
        for (frame, truth) in truths.iter().map(|truths| &truths[0]).enumerate() {
            let touches = percepts.touches(frame).unwrap();
            // The largest is the press; a tail may be a touch of its own.
            let Some(touch) = touches.touches.iter().max_by(|a, b| a.total.total_cmp(&b.total)) else { continue };
            let place = glam::DVec2::from_array(truth.uv.unwrap());
            let off = |p: glam::DVec3| flat(p).distance(place);
            let errors = [touch.position, touch.place.unwrap()].map(|place| off(place).powi(2));
            if touches.taxels(touch).len() <= FEW {
                found.few += 1;
                found.placed_of_few = add(found.placed_of_few, errors);
                continue;
            }
            found.touches += 1;
            found.placed = add(found.placed, errors);
            if let Some(sigma) = touch.place_sigma_m {
                found.places = add(found.places, within(flat(touch.place.unwrap()) - place, sigma));
            }
            found.doubtful += usize::from(touch.flags.contains(TouchFlags::POOR_FIT));
            let Some(fit) = touch.fit else { continue };
            match truth.angle {
                None => {
                    found.given += 1;
                    found.moments += off(touch.position).powi(2);
                    found.fitted += off(fit.place).powi(2);
                    let sigma = fit.sigma.unwrap();
                    found.covered = add(found.covered, within(flat(fit.place) - place, sigma.place));
                    if let Some(force) = fit.force {
                        found.forces[0] += usize::from((force - truth.force_newton).abs() <= COVERS * sigma.force);
                        found.forces[1] += 1;
                    }
                }
                Some(angle) => {
                    let (Some(axis), Some(direction)) = (touch.principal_axis, fit.direction) else { continue };
                    let turned = |line: glam::DVec3| between(flat(line).to_angle(), angle);
                    found.given += 1;
                    found.moments += turned(axis).powi(2);
                    found.fitted += turned(direction).powi(2);
                    found.covered[0] += usize::from(turned(direction) <= COVERS * fit.sigma.unwrap().angle);
                    found.covered[1] += 1;
                }
            }
        }
        found
    }

    fn row(&self, pressed: Pressed) -> String {
        let rms = |sum: f64| {
            let rms = (sum / self.given as f64).sqrt();
            if pressed == Pressed::Rods { format!("{:.2}°", rms.to_degrees()) } else { format!("{:.3} mm", 1e3 * rms) }
        };
        let share = |[within, of]: [usize; 2]| {
            if of == 0 { "–".to_owned() } else { format!("{:.0} %", 100.0 * within as f64 / of as f64) }
        };
        let few =
            if self.few == 0 { "–".to_owned() } else { format!("{} {:.2}", self.few, ratio(self.placed_of_few)) };
        format!(
            "{few} | {:.0} % | {:.0} % | {} | {} | {:.2} | {:.2} | {} | {} | {} |",
            100.0 * self.given_share(),
            100.0 * self.doubtful as f64 / self.touches as f64,
            rms(self.moments),
            rms(self.fitted),
            (self.fitted / self.moments).sqrt(),
            ratio(self.placed),
            share(self.covered),
            share(self.places),
            share(self.forces)
        )
    }
}

fn add<T: std::ops::Add<Output = T> + Copy>(a: [T; 2], b: [T; 2]) -> [T; 2] {
    [a[0] + b[0], a[1] + b[1]]
}

/// How many of two errors are within 1.96 of their standard deviations, of two.
fn within(off: glam::DVec2, sigma: [f64; 2]) -> [usize; 2] {
    let is_within = |(off, sigma): (f64, f64)| usize::from(off.abs() <= COVERS * sigma);
    [off.to_array().into_iter().zip(sigma).map(is_within).sum(), 2]
}

/// RMS of `place` over that of the moments.
fn ratio([moments, place]: [f64; 2]) -> f64 {
    (place / moments).sqrt()
}

#[test]
fn fits_are_given_and_sure_of_themselves_under_every_layer() {
    let seeds: Option<u64> = std::env::var("SOMATIC_SEEDS").ok().map(|seeds| seeds.parse().unwrap());
    let first: u64 = std::env::var("SOMATIC_FIRST_SEED").map_or(1000, |seed| seed.parse().unwrap());
    let (presses, noises) = if seeds.is_some() { (PRESSES, &NOISES[..]) } else { (FEW_PRESSES, &[1e-3, 30e-3][..]) };
    let body = grid(PITCH_M);
    let (mut wrong, mut layers) = (Vec::new(), LAYERS.map(|_| Found::default()));
    println!(
        "| touches | layer | noise | few: place | given | doubtful | moments | fit | fit / moments | place / moments | fit within 1.96 σ | place | force |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|---|---|");
    for pressed in [Pressed::Inside, Pressed::AtRim, Pressed::Rods] {
        for (layer, of_layer) in LAYERS.iter().zip(&mut layers) {
            for &noise in noises {
                let mut all = Found::default();
                for seed in first..first + seeds.unwrap_or(1) {
                    all.add(&Found::measure(pressed, &body, (seed, presses), layer, noise));
                }
                println!("| {} | {layer} | {:.0} mN | {}", pressed.word(), 1e3 * noise, all.row(pressed));
                // At a rim a place may be beyond the sensors; of few presses, one is a sixth.
                let at_rim = if seeds.is_some() { 0.85 } else { 0.65 };
                let least = if pressed == Pressed::AtRim { at_rim } else { 0.95 };
                if all.touches > 0 && all.given_share() < least {
                    wrong.push(format!("{} {layer} {noise}: {:.2} given", pressed.word(), all.given_share()));
                }
                // Of few presses one may be by chance where the moments are right.
                let most = if seeds.is_some() { 1.05 } else { 1.2 };
                if ratio(all.placed) > most {
                    wrong.push(format!(
                        "{} {layer} {noise}: place {:.2} of the moments",
                        pressed.word(),
                        ratio(all.placed)
                    ));
                }
                of_layer.add(&all);
            }
        }
    }
    for (layer, found) in LAYERS.iter().zip(&layers) {
        let share = |[within, of]: [usize; 2]| within as f64 / of as f64;
        let [places, forces] = [found.covered, found.forces].map(share);
        let [blended, of_few] = [found.placed, found.placed_of_few].map(ratio);
        println!(
            "{layer}: {places:.2} of places and angles within 1.96 σ, {:.2} of blended places, {forces:.2} of forces; place \
             {blended:.3} of the moments' error, {of_few:.3} with few taxels",
            share(found.places)
        );
        if places < 0.88 || share(found.places) < 0.88 || forces < 0.6 || ratio(found.placed) > 1.0 {
            wrong.push(format!("{layer}: {places:.2}, {forces:.2} within 1.96 σ, place {:.2}", ratio(found.placed)));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}
