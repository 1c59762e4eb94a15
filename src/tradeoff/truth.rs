//! Frames whose truth is known, and how far the percepts of a combination of knobs are from it.

use std::collections::{BTreeMap, BTreeSet};

use super::errors::{ChartGeometry, TrueErrorSamples, TrueErrors};
use super::fits::{self, FitOnLink};
use super::{Combination, SimulatedTouches, TestFrames};
use crate::backend::BackendKind;
use crate::body::Body;
use crate::engine::{Engine, Options};
use crate::error::Result;
use crate::field::Recharted;
use crate::percept::{Outputs, Percept};
use crate::scene::{Cadence, Charts, Coordinates, Coverage, Knobs, Scene};
use crate::signal::Letter;
use crate::source::Truth;

/// Frames a call.
const BATCH: usize = 256;

/// Errors against the truth, of all touches, and of those that have a fit.
pub(super) type OfTouches = (TrueErrors, Option<TrueErrors>);

/// What is known of a field that is touched.
struct Seen {
    percept: Percept,
    /// What presses it, where that is fitted.
    fit: Option<FitOnLink>,
}

/// Frames, and per frame the fields with a single touch, and its truth.
pub(super) struct Truths<'a> {
    body: &'a Body,
    options: Options,
    frames: &'a TestFrames,
    truth: Vec<Vec<(usize, &'a Truth)>>,
    /// What the touches are, in words; empty where they are the source's own.
    pub(super) description: String,
    /// The (frame, field) of the touches that have a fit; `None` where nothing can be fitted.
    with_fit: Option<BTreeSet<(usize, usize)>>,
    /// What has been computed: coverage, cadence and calls change no percept of them.
    known: BTreeMap<String, OfTouches>,
}

impl<'a> Truths<'a> {
    /// The truths of `played`, or else of `touches`; `None` if neither has any. `charted` are the body's fields by kinds of charts.
    ///
    /// # Errors
    /// The scene is invalid.
    pub(super) fn new(
        body: &'a Body,
        options: &Options,
        played: &'a TestFrames,
        touches: Option<&'a SimulatedTouches>,
        charted: &BTreeMap<&'static str, Recharted>,
        authored: &ChartGeometry,
    ) -> Result<Option<Self>> {
        let of_frame = |truths: &'a Vec<Truth>| -> Vec<(usize, &'a Truth)> {
            let known = truths.iter().filter_map(|truth| {
                let field = authored.index_of(truth.field.as_deref()?)?;
                let alone = truths.iter().filter(|other| other.field == truth.field).count() == 1;
                (alone && authored.link(field) == truth.link).then_some((field, truth))
            });
            known.collect()
        };
        let truths_in = |frames: &'a TestFrames| -> Option<Vec<_>> {
            let truth: Vec<_> = frames.truth.iter().map(of_frame).collect();
            truth.iter().any(|known| !known.is_empty()).then_some(truth)
        };
        let (frames, truth, options, description) = match (truths_in(played), touches) {
            (Some(truth), _) => (played, truth, options.clone(), String::new()),
            (None, Some(touches)) => {
                let Some(truth) = truths_in(&touches.frames) else { return Ok(None) };
                let options = options.clone().calibration(touches.calibration.clone());
                (&touches.frames, truth, options, touches.description.clone())
            }
            (None, None) => return Ok(None),
        };
        let known = BTreeMap::new();
        let mut truths = Self { body, options, frames, truth, description, with_fit: None, known };
        if truths.options.calibration.as_ref().is_some_and(|calibration| calibration.layer.is_some()) {
            let mut with_fit = BTreeSet::new();
            let scene = truths.scene(Knobs::default()).touches(fits::asked());
            let recharted = &charted[Charts::AsAuthored.word()];
            truths.each(BackendKind::Cpu, scene, recharted, &mut |frame, Seen { percept, fit }, _| {
                if fit.is_some() {
                    with_fit.insert((frame, percept.field));
                }
            })?;
            truths.with_fit = Some(with_fit);
        }
        Ok(Some(truths))
    }

    /// The errors of `combination`, whose fields are `recharted`, in the charts of `geometry`.
    pub(super) fn errors(
        &mut self,
        combination: Combination,
        recharted: &Recharted,
        geometry: &ChartGeometry,
        authored: &ChartGeometry,
    ) -> Result<OfTouches> {
        let Combination { backend, knobs } = combination;
        let by = knobs.orientation_by;
        let knobs = knobs.coverage(Coverage::All).cadence(Cadence::EveryFrame);
        let key = Combination { backend, knobs }.to_string();
        if let Some(errors) = self.known.get(&key) {
            return Ok(*errors);
        }
        let knobs = knobs.arithmetic(knobs.arithmetic.filter(|_| backend != BackendKind::Reference));
        let [mut all, mut fitted] = [(); 2].map(|()| TrueErrorSamples::default());
        self.each(backend, self.scene(knobs), recharted, &mut |frame, Seen { percept, fit }, truth| {
            let add = |to: &mut TrueErrorSamples| match by.steps() {
                Some(_) => to.add_fit(authored, percept.field, fit, truth),
                None => to.add(geometry, authored, &percept, truth, by),
            };
            add(&mut all);
            if self.with_fit.as_ref().is_some_and(|with| with.contains(&(frame, percept.field))) {
                add(&mut fitted);
            }
        })?;
        let fitted = self.with_fit.is_some().then(|| TrueErrors::from_samples(&mut fitted));
        let errors = (TrueErrors::from_samples(&mut all), fitted);
        self.known.insert(key, errors);
        Ok(errors)
    }

    /// The scene in which percepts are held against the truth.
    fn scene(&self, knobs: Knobs) -> Scene {
        let outputs = self.options.scene.outputs & (Outputs::ORIENTATION | Outputs::PRINCIPAL_AXIS) | Outputs::CENTROID;
        let letters = vec![Letter::default()];
        // The truth is on links.
        let scene = self.options.scene.clone().knobs(knobs).outputs(outputs).touches(None).letters(letters);
        let mut scene = scene.coordinates(Coordinates::Anchor);
        scene.relative_to = None;
        scene
    }

    /// Calls `on` with the number of each frame, what is known of each field that is touched, and the truth.
    fn each(
        &self,
        backend: BackendKind,
        scene: Scene,
        recharted: &Recharted,
        on: &mut dyn FnMut(usize, Seen, &Truth),
    ) -> Result<()> {
        let options = self.options.clone().scene(scene).backend(backend).batch(BATCH).tare(false);
        let mut engine = Engine::in_charts(self.body, recharted.clone(), options)?;
        engine.set_channels(&self.frames.taxels).map_err(|e| e.at(&self.frames.source))?;
        for (call, frames) in self.frames.frames.chunks(BATCH).enumerate() {
            engine.process(frames)?;
            let percepts = engine.percepts();
            for frame in 0..frames.len() {
                let number = call * BATCH + frame;
                for (field, truth) in &self.truth[number] {
                    let percept = percepts.get(frame, *field);
                    if percept.contact {
                        let found = percepts.touches(frame);
                        let fit = found.and_then(|found| {
                            let link = self.body.links.iter().position(|link| link.name == truth.link)?;
                            FitOnLink::new(&engine, fits::touch_on(found, *field)?, link as u32)
                        });
                        on(number, Seen { percept, fit }, truth);
                    }
                }
            }
        }
        Ok(())
    }
}
