//! What ordinary touches tell of a skin: every taxel's gain, and how wide the layer makes a contact.
//!
//! A touch that moves over the skin is felt by other taxels in each frame. Where a fit of the contact explains them all but one,
//! that one's gain is off. Contacts are fitted under the gains found so far (`docs/fit.md`), each taxel's gain is
//! moved to what makes it agree with the contacts that pressed it, and both are repeated:
//!
//! ln γᵢ ← ln γᵢ + Σ w ln(Pᵢ/mᵢ) / (Σ w + 1/s²), w = 1/((σᵢ/mᵢ)² + e²), of the touches that press taxel i
//!
//! with m what the contact makes it feel, σ its noise, e = 0.1 what the model is off by and s = 0.2 how far gains are
//! taken to be apart. Residuals over 2e count less (Huber).
//!
//! **Not to be known** from touches alone: the gain of the whole, as any is explained by harder touches; a slope of gains over a field, as
//! it is explained by touches a little beside; one that grows with the square of the distance, as it makes a Gaussian another Gaussian,
//! wider or narrower. These are taken off what is found. Nor are the gain of a taxel that nothing touched, and
//! the layer's σ apart from the contacts' own size: the width that is found explains both together, and is what fits need.

use std::collections::{BTreeMap, BTreeSet};

use glam::DVec2;

use crate::backend::BackendKind;
use crate::backend::cpu::fit::fit_each;
use crate::body::Body;
use crate::engine::{Engine, Options};
use crate::error::{Error, Result, failed};
use crate::percept::{self, Outputs, Percepts};
use crate::scene::{Knobs, Scene};
use crate::signal::{Calibration, Frame, Letter};
use crate::stage::fit::{Layer, STEPS, Taxel, Touch, USUAL_WIDTH};
use crate::touch;

/// Gains are taken to differ by about this share.
const SPREAD: f64 = 0.2;
/// What the model is off by, as a share of what a taxel feels.
const MODEL: f64 = 0.1;
/// Times that contacts are fitted and gains are moved.
const ROUNDS: usize = 20;
/// Rounds after which the width is no longer changed.
const WIDTH_ROUNDS: usize = 8;
/// At most about so many touches are kept, evenly over the recording.
const MOST: usize = 6000;
/// A taxel counts where it feels at least this share of the touch's largest pressure: below, the model is more wrong than gains.
const LEAST_SHARE: f64 = 0.1;
/// Touches that a taxel needs for its gain to be told.
const LEAST_TOUCHES: u32 = 5;
/// Shapes of (the logarithm of) gains over a field that other contacts explain as well.
const UNKNOWABLE: [fn(DVec2) -> f64; 6] =
    [|_| 1.0, |at| at.x, |at| at.y, |at| at.x * at.x, |at| at.y * at.y, |at| at.x * at.y];
/// Of σ, in distances between taxels, where fits start without knowing it.
const START: f64 = 0.5;

/// What touches told.
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
    /// How many touches it was found from.
    pub touches: usize,
}

/// A touch in a frame: its field, its taxels with their indices in the body, and how far places may lie from them.
#[derive(Clone, Debug)]
struct Observed {
    field: usize,
    taxels: Vec<(usize, Taxel)>,
    reach_m: f64,
}

/// Gathers touches frame by frame.
pub struct GainsSurvey {
    engine: Engine,
    taxels: usize,
    /// Index in a frame by taxel of the body.
    value_of: Vec<Option<usize>>,
    touches: Vec<Observed>,
    /// Every so many touches one is kept.
    stride: usize,
    seen: usize,
    spacing_m: f64,
}

impl GainsSurvey {
    /// Begins with a calibration that knows baselines and dead bands, for frames of the taxels `ids`.
    ///
    /// # Errors
    /// No field has a chart; the calibration or the ids are for another body; no taxel has an area.
    pub fn new(body: &Body, calibration: Calibration, fields: &[String], ids: &[u32]) -> Result<Self> {
        let scene = Scene {
            outputs: Outputs::CENTROID,
            touches: Some(touch::Options::default()),
            fields: fields.to_vec(),
            letters: vec![Letter::default()],
            knobs: Knobs::default(),
            ..Scene::default()
        };
        let options = Options { scene, calibration: Some(calibration), batch: 256, ..Options::default() };
        let mut engine = Engine::new(body, Options { backend: BackendKind::Cpu, ..options })?;
        engine.set_channels(ids)?;
        let plan = engine.plan();
        let usable = || plan.fields.iter().filter(|field| field.chart.is_some() && field.area_known);
        let spacing_m = usable().map(|field| field.spacing * f64::from(field.unit_m)).fold(0.0, f64::max);
        if spacing_m == 0.0 {
            return Err(Error::failed("no field has a chart and taxels with areas, which contacts are fitted in")
                .at(&body.name));
        }
        let mut value_of = vec![None; body.taxels.len()];
        for (value, id) in ids.iter().enumerate() {
            if let Some(taxel) = engine.index_of_taxel(*id) {
                value_of[taxel] = Some(value);
            }
        }
        let (taxels, touches) = (body.taxels.len(), Vec::new());
        Ok(Self { engine, taxels, value_of, touches, stride: 1, seen: 0, spacing_m })
    }

    /// Takes the touches of `frames`: those that are alone on a field.
    ///
    /// # Errors
    /// As [`Engine::process`].
    pub fn add(&mut self, frames: &[Frame]) -> Result<()> {
        let percepts = self.engine.process(frames)?.clone();
        for (index, frame) in frames.iter().enumerate() {
            for field in 0..percepts.fields() {
                if touches_on(&percepts, index, field) != 1 || self.engine.plan().fields[field].divided {
                    continue;
                }
                self.seen += 1;
                if !self.seen.is_multiple_of(self.stride) {
                    continue;
                }
                let observed = observed(&self.engine, field, frame, &self.value_of);
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
        estimate(&self.touches, self.taxels, START * self.spacing_m, progress)
    }
}

/// How many touches lie on `field` in frame `frame`.
fn touches_on(percepts: &Percepts, frame: usize, field: usize) -> usize {
    let Some(found) = percepts.touches(frame) else { return 0 };
    let is_on = |touch: &&percept::Touch| found.fields(touch).iter().any(|share| share.field as usize == field);
    found.touches.iter().filter(is_on).count()
}

/// The touch on `field`, as fits take it; `None` where it cannot be used.
fn observed(engine: &Engine, field: usize, frame: &Frame, value_of: &[Option<usize>]) -> Option<Observed> {
    let (plan, skin) = (engine.plan(), engine.skin()?);
    // The skin's nodes are the plan's channels.
    let beside = |taxel: usize| {
        let node = plan.body_taxels.binary_search(&taxel).ok();
        let beside = node.map_or(&[][..], |node| skin.beside(node as u32));
        beside.iter().map(|&other| plan.body_taxels[other as usize])
    };
    let of = &plan.fields[field];
    of.chart.as_ref()?;
    if !of.area_known {
        return None;
    }
    let taxels: Vec<usize> = plan.taxels_of(field).collect();
    let taxel = |member: usize| plan.pressed_taxel(of, member, frame.values[value_of[taxels[member]]?]);
    let all: Vec<Option<Taxel>> = (0..of.count).map(taxel).collect();
    let is_pressed = |member: &usize| all[*member].is_some_and(|taxel| taxel.pressure > 0.0);
    let pressed: Vec<usize> = (0..of.count).filter(is_pressed).collect();
    // A point has four parameters; with one taxel more than that some agree by chance.
    if pressed.len() < 6 {
        return None;
    }
    let around = pressed.iter().flat_map(|&member| beside(taxels[member]));
    let around = around.filter_map(|taxel| taxels.iter().position(|&other| other == taxel));
    let members: BTreeSet<usize> = pressed.iter().copied().chain(around).collect();
    let reach_m = 2.0 * of.spacing * f64::from(of.unit_m);
    let taxels = members.into_iter().filter_map(|member| Some((taxels[member], all[member]?))).collect();
    Some(Observed { field, taxels, reach_m })
}

fn estimate(
    touches: &[Observed],
    taxels: usize,
    start_m: f64,
    progress: &mut dyn FnMut(f64) -> bool,
) -> Result<GainsEstimate> {
    const LEAST: usize = 50;
    if touches.len() < LEAST {
        return Err(failed!(
            "{} frames have a touch alone on a field that presses six taxels or more, of {LEAST} that are needed; let a finger wander over \
             all of the skin for two minutes",
            touches.len()
        ));
    }
    let (mut gains, mut sigma_m) = (vec![0.0_f64; taxels], start_m);
    let (mut width_m, mut left, mut used) = (0.0, 0.0, 0);
    let mut pressed = vec![0; taxels];
    // By field and taxel.
    let mut places: BTreeMap<usize, BTreeMap<usize, DVec2>> = BTreeMap::new();
    for touch in touches {
        let of_field = places.entry(touch.field).or_default();
        of_field.extend(touch.taxels.iter().map(|(index, taxel)| (*index, taxel.place_m)));
    }
    for round in 0..ROUNDS {
        let fitted: Vec<Touch> = touches.iter().map(|touch| touch.under(&gains, sigma_m)).collect();
        let explained = fit_each(&fitted.iter().collect::<Vec<_>>(), |touch, fits| touch.explained(fits?));
        let (mut weights, mut sums) = (vec![0.0; taxels], vec![0.0; taxels]);
        let (mut widths, mut squares) = (Vec::new(), (0.0, 0.0));
        pressed.fill(0);
        used = 0;
        for (observed, explained) in touches.iter().zip(explained) {
            let Some(explained) = explained else { continue };
            used += 1;
            widths.push(explained.width_m);
            let most = explained.felt.iter().copied().fold(0.0, f64::max);
            for (&(index, taxel), felt) in observed.taxels.iter().zip(&explained.felt) {
                if taxel.pressure <= 0.0 || *felt < LEAST_SHARE * most {
                    continue;
                }
                let off = (taxel.pressure / gains[index].exp() / felt).ln();
                let noise = taxel.sigma.unwrap_or(0.0) / taxel.pressure;
                let weight = 1.0 / (noise * noise + MODEL * MODEL) * (2.0 * MODEL / off.abs()).min(1.0);
                weights[index] += weight;
                sums[index] += weight * off;
                squares = (squares.0 + off * off, squares.1 + 1.0);
                pressed[index] += 1;
            }
        }
        if used < LEAST {
            return Err(failed!("{used} touches can be explained as contacts, of {LEAST} that are needed"));
        }
        left = (squares.0 / f64::max(squares.1, 1.0)).sqrt();
        for ((gain, weight), sum) in gains.iter_mut().zip(&weights).zip(&sums) {
            *gain += sum / (weight + 1.0 / (SPREAD * SPREAD));
        }
        for field in places.values() {
            let known: Vec<(usize, DVec2)> = field
                .iter()
                .map(|(&index, &at)| (index, at))
                .filter(|(index, _)| pressed[*index] >= LEAST_TOUCHES)
                .collect();
            take_off(&mut gains, &known);
        }
        widths.sort_by(f64::total_cmp);
        width_m = widths[widths.len() / 2];
        if round < WIDTH_ROUNDS {
            sigma_m = width_m / USUAL_WIDTH;
        }
        if !progress((round + 1) as f64 / ROUNDS as f64) {
            return Err(Error::failed("stopped before gains had come to rest"));
        }
    }
    let told = |(gain, count): (&f64, &u32)| (*count >= LEAST_TOUCHES).then(|| gain.exp());
    let gains = gains.iter().zip(&pressed).map(told).collect();
    Ok(GainsEstimate { gains, pressed, width_m, sigma_m, left, touches: used })
}

/// Takes off the logarithms of `gains` of the taxels that are `known`, with their places, what touches cannot tell.
fn take_off(gains: &mut [f64], known: &[(usize, DVec2)]) {
    let count = known.len();
    let middle = known.iter().map(|(_, at)| *at).sum::<DVec2>() / count.max(1) as f64;
    let size = known.iter().map(|(_, at)| at.distance(middle)).fold(f64::MIN_POSITIVE, f64::max);
    let of =
        |shape: fn(DVec2) -> f64| -> Vec<f64> { known.iter().map(|(_, at)| shape((*at - middle) / size)).collect() };
    // The constant alone where taxels are too few to see more in.
    let shapes = if count > 2 * UNKNOWABLE.len() { &UNKNOWABLE[..] } else { &UNKNOWABLE[..1] };
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let mut basis: Vec<Vec<f64>> = Vec::new();
    for shape in shapes {
        let mut vector = of(*shape);
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
        let along: f64 = known.iter().zip(vector).map(|((index, _), x)| gains[*index] * x).sum();
        known.iter().zip(vector).for_each(|((index, _), x)| gains[*index] -= along * x);
    }
}

impl Observed {
    /// It with `gains` taken off, as fits take it.
    fn under(&self, gains: &[f64], sigma_m: f64) -> Touch {
        let layer = Layer { sigma_m, gain_spread: MODEL, reach_m: self.reach_m, steps: STEPS };
        let taxel = |&(index, taxel): &(usize, Taxel)| {
            let by = (-gains[index]).exp();
            let sigma = taxel.sigma.map(|sigma| by * sigma);
            Taxel { pressure: by * taxel.pressure, threshold: by * taxel.threshold, sigma, ..taxel }
        };
        Touch::new(&self.taxels.iter().map(taxel).collect::<Vec<_>>(), &layer)
    }
}
