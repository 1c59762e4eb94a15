//! What ordinary touches tell of a skin: every taxel's gain, and how wide the layer makes a contact.
//!
//! A touch of the whole body that moves over the skin is felt by other taxels in each frame. Where a fit of the contact explains them
//! all but one, that one's gain is off. Contacts are fitted under the gains found so far (`docs/explanation/fit.md`), each
//! taxel's gain is moved to what makes it agree with the contacts that pressed it, and both are repeated:
//!
//! ln γᵢ ← ln γᵢ + Σ w ln(Pᵢ/mᵢ) / (Σ w + 1/s²), w = 1/((σᵢ/mᵢ)² + e²), of the touches that press taxel i
//!
//! with m what the contact makes it feel, σ its noise, e = 0.1 what the model is off by and s = 0.2 how far gains are
//! taken to be apart. Residuals over 2e count less (Huber).
//!
//! A finger is mostly longer than wide. As a round contact it would be explained by gains that rise one way and fall the other: so all is
//! done twice, with the kind of contact that explains a touch best, and with blobs, which are taken where they leave far less.
//!
//! **Not to be known** from touches alone: the gain of the whole, as any is explained by harder touches; a slope of gains over the
//! skin, as it is explained by touches a little beside; one that grows with the square of the distance, as it makes a Gaussian another
//! Gaussian, wider or narrower. These are taken off what is found, of each part of the skin that touches connect. Nor are the gain of
//! a taxel that nothing touched, and the layer's σ apart from the contacts' own size: the width that is found explains both
//! together, and is what fits need.

use glam::DVec3;

use crate::backend::BackendKind;
use crate::backend::cpu::fit::fit_each;
use crate::body::Body;
use crate::engine::{Engine, Options};
use crate::error::{Error, Result, failed};
use crate::percept::{self, Outputs, TouchFlags, TouchFrame, TouchOutputs};
use crate::scene::{Around, Knobs, Scene};
use crate::signal::{Calibration, Frame, Letter, RawValue};
use crate::stage::fit::{Explained, Layer, STEPS, Taxel, Touch, USUAL_WIDTH};
use crate::touch;

/// Gains are taken to differ by about this share.
const SPREAD: f64 = 0.2;
/// What the model is off by, as a share of what a taxel feels.
const MODEL: f64 = 0.1;
/// Times that contacts are fitted and gains are moved.
const ROUNDS: usize = 20;
/// Rounds after which the width is no longer changed.
const WIDTH_ROUNDS: usize = 8;
/// Touches that are kept at most, about, evenly over the recording.
const MOST: usize = 6000;
/// A taxel counts where it feels at least this share of the touch's largest pressure: below, the model is more wrong than gains.
const LEAST_SHARE: f64 = 0.1;
/// Touches that a taxel needs for a gain.
const LEAST_TOUCHES: u32 = 5;
/// Touches count as longer than wide where blobs leave less than this share of the variance that round contacts leave, both without
/// noise. Their two more parameters alone leave 0.87 of it where fifteen taxels are pressed.
const LONGER: f64 = 0.7;
/// What gains and model are off by at least, as a share.
const LEAST_SPREAD: f64 = 0.01;
/// A point has four parameters; with one taxel more than that some agree by chance.
const LEAST_PRESSED: usize = 6;
/// Shapes of (the logarithm of) gains over taxels that face one way, across their normal, that other contacts explain as well.
const UNKNOWABLE_ON_A_SIDE: [fn(DVec3) -> f64; 6] =
    [|_| 1.0, |at| at.x, |at| at.y, |at| at.x * at.x, |at| at.y * at.y, |at| at.x * at.y];
/// The same over taxels around a limb.
const UNKNOWABLE_AROUND: [fn(DVec3) -> f64; 10] = [
    |_| 1.0,
    |at| at.x,
    |at| at.y,
    |at| at.z,
    |at| at.x * at.x,
    |at| at.y * at.y,
    |at| at.z * at.z,
    |at| at.x * at.y,
    |at| at.y * at.z,
    |at| at.z * at.x,
];
/// Taxels face one way where the mean of their normals is at least this long: a cap that reaches 53° to every side.
const ONE_WAY: f64 = 0.8;
/// Of σ, in distances between taxels, where fits start without knowing it.
const START: f64 = 0.5;
/// A place is beyond the sensors where it is farther from all, in distances between taxels.
const REACH: f64 = 2.0;

/// What touches show.
#[derive(Clone, Debug, Default)]
#[non_exhaustive]
pub struct GainsEstimate {
    /// By taxel in the body's order the factor by which it feels more than others, 1 in the (geometric) mean; `None` where too few
    /// touches pressed it.
    pub gains: Vec<Option<f64>>,
    /// How many touches pressed each taxel.
    pub pressed: Vec<u32>,
    /// The standard deviation of the pressure at the sensors under the touches, median, m: the layer's own and the contacts' size.
    pub width_m: f64,
    /// The layer's σ for fits, m: that by which fits expect such widths.
    pub sigma_m: f64,
    /// By what share taxels still differ from the contacts, root mean square.
    pub left: f64,
    /// What gains and model are still off by as a share, the `gain_spread` of fits: the part of `left` that noise does not explain, and
    /// what of the gains touches cannot tell. At least 0.01.
    pub gain_spread: f64,
    /// How many touches it was found from.
    pub touches: usize,
}

/// A touch in a frame.
#[derive(Clone, Debug)]
struct Observed {
    /// Its taxels and those beside them, as nodes of the skin.
    taxels: Vec<(usize, Taxel)>,
    /// The longest way between two of them that are neighbours, m.
    spacing_m: f64,
}

/// Where a taxel of the skin is on the body at rest.
#[derive(Clone, Copy, Debug)]
struct Spot {
    position: DVec3,
    normal: DVec3,
}

/// Gathers touches frame by frame.
pub struct GainsSurvey {
    engine: Engine,
    taxels: usize,
    /// Index in a frame by node of the skin, where the frame has the taxel.
    value_of: Vec<Option<usize>>,
    touches: Vec<Observed>,
    /// One touch in this many is kept.
    stride: usize,
    seen: usize,
}

impl GainsSurvey {
    /// Begins with a calibration that knows baselines and dead bands, for frames of the taxels `ids`.
    ///
    /// # Errors
    /// No taxel has an area; the calibration or the ids are for another body.
    pub fn new(body: &Body, calibration: Calibration, ids: &[u32]) -> Result<Self> {
        let asked = touch::Options { outputs: TouchOutputs::TAXELS, ..touch::Options::default() };
        let scene = Scene {
            outputs: Outputs::TOTAL,
            touches: Some(asked),
            letters: vec![Letter::default()],
            knobs: Knobs::default(),
            ..Scene::default()
        };
        let options = Options { scene, calibration: Some(calibration), batch: 256, ..Options::default() };
        let mut engine = Engine::new(body, Options { backend: BackendKind::Cpu, ..options })?;
        engine.set_channels(ids)?;
        let plan = engine.plan();
        if !plan.areas.iter().any(|area| *area > 0.0) {
            return Err(Error::failed("no taxel has an area, without which contacts cannot be fitted").at(&body.name));
        }
        let mut value_of_taxel = vec![None; body.taxels.len()];
        for (value, id) in ids.iter().enumerate() {
            if let Some(taxel) = engine.index_of_taxel(*id) {
                value_of_taxel[taxel] = Some(value);
            }
        }
        // The skin's nodes are the plan's channels.
        let value_of = plan.body_taxels.iter().map(|&taxel| value_of_taxel[taxel]).collect();
        Ok(Self { taxels: body.taxels.len(), value_of, touches: Vec::new(), stride: 1, seen: 0, engine })
    }

    /// Takes the touches of `frames`: those that nothing else presses beside.
    ///
    /// # Errors
    /// As [`Engine::process`].
    pub fn add(&mut self, frames: &[Frame]) -> Result<()> {
        let percepts = self.engine.process(frames)?.clone();
        for (index, frame) in frames.iter().enumerate() {
            let Some(found) = percepts.touches(index) else { continue };
            for touch in &found.touches {
                if touch.flags.contains(TouchFlags::WRAPPED) {
                    continue;
                }
                self.seen += 1;
                if !self.seen.is_multiple_of(self.stride) {
                    continue;
                }
                let observed = observed(&self.engine, (found, touch), |node| {
                    self.value_of[node as usize].map_or(RawValue::MISSING, |value| frame.values[value])
                });
                self.touches.extend(observed);
                if self.touches.len() > MOST {
                    let mut index = 0;
                    self.touches.retain(|_| {
                        index += 1;
                        index % 2 == 0
                    });
                    self.stride *= 2;
                }
            }
        }
        Ok(())
    }

    /// What the touches tell. `progress` gets the share that is done and returns whether to continue.
    ///
    /// # Errors
    /// Too few touches press enough taxels at once; it was stopped.
    pub fn finish(self, progress: &mut dyn FnMut(f64) -> bool) -> Result<GainsEstimate> {
        let skin = self.engine.skin().map_or(&[][..], |skin| skin.taxels());
        let spots: Vec<Spot> =
            skin.iter().map(|taxel| Spot { position: taxel.position, normal: taxel.mean_normal }).collect();
        let (round, of_round) = estimate(&self.touches, &spots, false, &mut |share| progress(0.5 * share))?;
        let long = estimate(&self.touches, &spots, true, &mut |share| progress(0.5 + 0.5 * share));
        let is_longer = |of_long: f64| of_long + LEAST_SPREAD.powi(2) < LONGER * (of_round + LEAST_SPREAD.powi(2));
        let of_skin = long.ok().filter(|long| is_longer(long.1)).map_or(round, |(long, _)| long);
        let mut estimate = GainsEstimate { gains: vec![None; self.taxels], pressed: vec![0; self.taxels], ..of_skin };
        for (node, &taxel) in self.engine.plan().body_taxels.iter().enumerate() {
            (estimate.gains[taxel], estimate.pressed[taxel]) = (of_skin.gains[node], of_skin.pressed[node]);
        }
        Ok(estimate)
    }
}

/// The `touch` of those found in a frame that reads `value`, as fits take it; `None` where it cannot be used.
fn observed(
    engine: &Engine,
    (found, touch): (&TouchFrame, &percept::Touch),
    value: impl Fn(u32) -> RawValue,
) -> Option<Observed> {
    let skin = engine.skin()?;
    let own = found.taxels(touch);
    if own.len() < LEAST_PRESSED {
        return None;
    }
    let mut near: Vec<u32> = own.iter().flat_map(|&node| skin.beside(node)).chain(own).copied().collect();
    near.sort_unstable();
    near.dedup();
    let unrolled = skin.unrolled(touch.base, touch.link, near);
    let Around { felt, longest_way_m } = engine.plan().felt_around(skin, &unrolled, value);
    let is_alone = felt.iter().all(|(node, taxel)| taxel.pressure <= 0.0 || own.contains(node));
    let is_known = felt.iter().all(|(_, taxel)| taxel.area_m2 > 0.0);
    let pressed = felt.iter().filter(|(_, taxel)| taxel.pressure > 0.0).count();
    let taxels = || felt.iter().map(|&(node, taxel)| (node as usize, taxel)).collect();
    (is_alone && is_known && pressed >= LEAST_PRESSED).then(|| Observed { taxels: taxels(), spacing_m: longest_way_m })
}

/// The taxels of the skin that touches connect, in the order of their first ones.
fn connected(touches: &[Observed], taxels: usize) -> Vec<Vec<usize>> {
    // By taxel another one of its part, in the end the first.
    let mut part: Vec<usize> = (0..taxels).collect();
    let first = |part: &[usize], mut taxel: usize| {
        while part[taxel] != taxel {
            taxel = part[taxel];
        }
        taxel
    };
    for touch in touches {
        let pressed = || touch.taxels.iter().filter(|(_, taxel)| taxel.pressure > 0.0).map(|(node, _)| *node);
        for (a, b) in pressed().zip(pressed().skip(1)) {
            let (a, b) = (first(&part, a), first(&part, b));
            part[a.max(b)] = a.min(b);
        }
    }
    let mut parts: Vec<Vec<usize>> = vec![Vec::new(); taxels];
    (0..taxels).for_each(|taxel| parts[first(&part, taxel)].push(taxel));
    parts.retain(|part| part.len() > 1);
    parts
}

/// What the fits of one round say of gains.
struct Round {
    /// By taxel, in how many touches it says something.
    pressed: Vec<u32>,
    /// By taxel, the weights of these, and the sums of weighted logarithms by which its gain is off.
    weights: Vec<f64>,
    sums: Vec<f64>,
    /// Of each touch that is explained.
    widths_m: Vec<f64>,
    /// Sums over taxels of touches: squares of logarithms that are off, squares of noise, and how many.
    squares: f64,
    of_noise: f64,
    counted: f64,
}

impl Round {
    /// A round over `touches`, which are `explained` under the logarithms `gains`.
    fn from_touches(touches: &[Observed], explained: Vec<Option<Explained>>, gains: &[f64]) -> Self {
        let zeros = || vec![0.0; gains.len()];
        let mut round = Self {
            pressed: vec![0; gains.len()],
            weights: zeros(),
            sums: zeros(),
            widths_m: Vec::new(),
            squares: 0.0,
            of_noise: 0.0,
            counted: 0.0,
        };
        for (observed, explained) in touches.iter().zip(explained) {
            let Some(explained) = explained else { continue };
            round.widths_m.push(explained.width_m);
            let most = explained.felt.iter().copied().fold(0.0, f64::max);
            for (&(index, taxel), felt) in observed.taxels.iter().zip(&explained.felt) {
                if taxel.pressure <= 0.0 || *felt < LEAST_SHARE * most {
                    continue;
                }
                let off = (taxel.pressure / gains[index].exp() / felt).ln();
                let noise = taxel.sigma.unwrap_or(0.0) / taxel.pressure;
                let weight = 1.0 / (noise * noise + MODEL * MODEL) * (2.0 * MODEL / off.abs()).min(1.0);
                round.weights[index] += weight;
                round.sums[index] += weight * off;
                round.squares += off * off;
                round.of_noise += noise * noise;
                round.counted += 1.0;
                round.pressed[index] += 1;
            }
        }
        round
    }
}

/// What `touches` of taxels at `spots` tell, fitted as the kind that explains each best, or all of them that can be as blobs; and the
/// mean square of what is left of the shares and is not noise.
fn estimate(
    touches: &[Observed],
    spots: &[Spot],
    as_blobs: bool,
    progress: &mut dyn FnMut(f64) -> bool,
) -> Result<(GainsEstimate, f64)> {
    const LEAST: usize = 50;
    if touches.len() < LEAST {
        return Err(failed!(
            "{LEAST} touches must press six taxels or more, away from others, and {} do; let a finger wander over all of the skin for \
             two minutes",
            touches.len()
        ));
    }
    let taxels = spots.len();
    let mut spacings: Vec<f64> = touches.iter().map(|touch| touch.spacing_m).collect();
    spacings.sort_by(f64::total_cmp);
    let (mut gains, mut sigma_m) = (vec![0.0_f64; taxels], START * spacings[spacings.len() / 2]);
    let (mut width_m, mut left, mut unexplained, mut unknowable, mut used) = (0.0, 0.0, 0.0, 0.0, 0);
    let mut pressed = vec![0; taxels];
    let parts = connected(touches, taxels);
    for round in 0..ROUNDS {
        let fitted: Vec<Touch> = touches.iter().map(|touch| touch.under(&gains, sigma_m)).collect();
        let explained = fit_each(&fitted.iter().collect::<Vec<_>>(), |touch, fits| touch.explained(fits?, as_blobs));
        let Round { pressed: counts, weights, sums, mut widths_m, squares, of_noise, counted } =
            Round::from_touches(touches, explained, &gains);
        (pressed, used) = (counts, widths_m.len());
        if used < LEAST {
            return Err(failed!("{LEAST} touches must be explained as contacts, and {used} can be"));
        }
        let mean = |sum: f64| sum / f64::max(counted, 1.0);
        left = mean(squares).sqrt();
        unexplained = mean(squares - of_noise).max(0.0);
        for ((gain, weight), sum) in gains.iter_mut().zip(&weights).zip(&sums) {
            *gain += sum / (weight + 1.0 / (SPREAD * SPREAD));
        }
        let mut taken_off = 0;
        for part in &parts {
            let known: Vec<usize> = part.iter().copied().filter(|&taxel| pressed[taxel] >= LEAST_TOUCHES).collect();
            taken_off += take_off(&mut gains, spots, &known);
        }
        let known = || gains.iter().zip(&pressed).filter(|(_, count)| **count >= LEAST_TOUCHES).map(|(gain, _)| gain);
        // What is taken off has as much of the gains' true variance for each shape as every other direction has.
        let others = known().count().saturating_sub(taken_off).max(1) as f64;
        unknowable =
            known().map(|gain| gain * gain).sum::<f64>() / others * (taken_off as f64 / (others + taken_off as f64));
        widths_m.sort_by(f64::total_cmp);
        width_m = widths_m[widths_m.len() / 2];
        if round < WIDTH_ROUNDS {
            sigma_m = width_m / USUAL_WIDTH;
        }
        if !progress((round + 1) as f64 / ROUNDS as f64) {
            return Err(Error::failed("stopped before gains had come to rest"));
        }
    }
    let gain_of = |(gain, count): (&f64, &u32)| (*count >= LEAST_TOUCHES).then(|| gain.exp());
    let gains = gains.iter().zip(&pressed).map(gain_of).collect();
    let gain_spread = (unexplained + unknowable).sqrt().max(LEAST_SPREAD);
    Ok((GainsEstimate { gains, pressed, width_m, sigma_m, left, gain_spread, touches: used }, unexplained))
}

/// Takes off the logarithms of `gains` of the taxels `known`, which are at `spots`, what touches cannot tell. Returns how many shapes
/// that was.
fn take_off(gains: &mut [f64], spots: &[Spot], known: &[usize]) -> usize {
    let count = known.len();
    let mean =
        |of: fn(&Spot) -> DVec3| known.iter().map(|&taxel| of(&spots[taxel])).sum::<DVec3>() / count.max(1) as f64;
    let (middle, facing) = (mean(|spot| spot.position), mean(|spot| spot.normal));
    let side = (facing.length() >= ONE_WAY).then(|| facing.normalize().any_orthonormal_pair());
    let placed = |&taxel: &usize| {
        let from_middle = spots[taxel].position - middle;
        side.map_or(from_middle, |(u, v)| DVec3::new(from_middle.dot(u), from_middle.dot(v), 0.0))
    };
    let places: Vec<DVec3> = known.iter().map(placed).collect();
    let size = places.iter().map(|at| at.length()).fold(f64::MIN_POSITIVE, f64::max);
    let all = if side.is_some() { &UNKNOWABLE_ON_A_SIDE[..] } else { &UNKNOWABLE_AROUND[..] };
    // The constant alone where taxels are too few to see more in.
    let shapes = if count > 2 * all.len() { all } else { &all[..1] };
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let mut basis: Vec<Vec<f64>> = Vec::new();
    for shape in shapes {
        let mut vector: Vec<f64> = places.iter().map(|at| shape(*at / size)).collect();
        for other in &basis {
            let along = dot(&vector, other);
            vector.iter_mut().zip(other).for_each(|(x, y)| *x -= along * y);
        }
        let length = dot(&vector, &vector).sqrt();
        // Taxels in a row have no second direction.
        if length > 1e-6 * (count as f64).sqrt() {
            vector.iter_mut().for_each(|x| *x /= length);
            basis.push(vector);
        }
    }
    for vector in &basis {
        let along: f64 = known.iter().zip(vector).map(|(&taxel, x)| gains[taxel] * x).sum();
        known.iter().zip(vector).for_each(|(&taxel, x)| gains[taxel] -= along * x);
    }
    basis.len()
}

impl Observed {
    /// It with `gains` taken off, as fits take it.
    fn under(&self, gains: &[f64], sigma_m: f64) -> Touch {
        let layer = Layer { sigma_m, gain_spread: MODEL, reach_m: REACH * self.spacing_m, steps: STEPS };
        let taxel = |&(index, taxel): &(usize, Taxel)| {
            let by = (-gains[index]).exp();
            let sigma = taxel.sigma.map(|sigma| by * sigma);
            Taxel { pressure: by * taxel.pressure, threshold: by * taxel.threshold, sigma, ..taxel }
        };
        Touch::new(&self.taxels.iter().map(taxel).collect::<Vec<_>>(), &layer)
    }
}
