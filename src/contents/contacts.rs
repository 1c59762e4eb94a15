//! How often, how long and how hard each field is touched in a recording.

use std::path::Path;

use serde_json::{Value, json};

use super::episodes::{Episode, Rule, Sample, Summary, episodes, summary};
use crate::backend::BackendKind;
use crate::body::Body;
use crate::engine::{Engine, Options};
use crate::error::Result;
use crate::percept::{Outputs, Percept};
use crate::recording::Reader;
use crate::scene::Scene;
use crate::setup::{Tell, attached};
use crate::signal::{Calibration, Frame, Quantity};
use crate::source::Source;

/// Frames that are taken through the engine together.
const BATCH: usize = 256;

/// Follows how hard all fields are pressed.
pub struct Contacts {
    engine: Engine,
    /// Those that wait for others, then room for more.
    frames: Vec<Frame>,
    waiting: usize,
    times_s: Vec<f64>,
    fields: Vec<FieldSamples>,
}

/// A field in the frames in which it is pressed.
struct FieldSamples {
    name: String,
    quantity: Quantity,
    samples: Vec<Sample>,
}

/// The contacts of all fields.
pub struct FoundContacts {
    rule: Rule,
    times_s: Vec<f64>,
    fields: Vec<FieldContacts>,
}

/// The contacts of a field that is pressed.
pub struct FieldContacts {
    /// The field's name.
    pub name: String,
    /// Of P.
    quantity: Quantity,
    samples: Vec<Sample>,
    /// Whether loads are forces, N; else they are the total of P.
    pub is_force: bool,
    /// The load where contacts begin.
    pub over: f64,
    /// The contacts.
    pub contacts: Vec<Episode>,
}

impl Contacts {
    /// For frames of `source` on `body`.
    ///
    /// # Errors
    /// No engine can be made for them.
    pub fn new(body: &Body, calibration: Option<Calibration>, source: &dyn Source) -> Result<Self> {
        let outputs = Outputs::TOTAL | Outputs::FORCE | Outputs::PEAK | Outputs::AREA | Outputs::CENTROID;
        let scene = Scene::default().outputs(outputs);
        let options = Options::default().scene(scene).calibration(calibration).backend(BackendKind::Cpu).batch(BATCH);
        let mut engine = Engine::new(body, options)?;
        engine.set_channels(source.taxels())?;
        let plan = engine.plan();
        let field = |index: usize| FieldSamples {
            name: plan.label(index),
            quantity: plan.quantity(index),
            samples: Vec::new(),
        };
        let fields = (0..plan.fields().len()).map(field).collect();
        Ok(Self { engine, frames: Vec::new(), waiting: 0, times_s: Vec::new(), fields })
    }

    /// Those in the MCAP at `path`, if it has its body, and that can be run. `goes_on` is asked after each frame, with how many were
    /// read; None if it does not wish to.
    ///
    /// # Errors
    /// The file, or what is attached to it, cannot be read; or the rule asks for a force where there is none.
    pub fn of_mcap(
        path: &Path,
        tell: &Tell,
        rule: Rule,
        mut goes_on: impl FnMut(u64) -> bool,
    ) -> Result<Option<FoundContacts>> {
        let Some((name, bytes)) = attached::body(path)? else { return Ok(None) };
        let Ok(body) = Body::from_bytes(&name, &bytes) else { return Ok(None) };
        let ids: Vec<u32> = body.taxels.iter().map(|taxel| taxel.id).collect();
        let calibration = attached::calibration(path, tell)?.map(|text| Calibration::parse(&text, &ids)).transpose();
        let mut reader = Reader::open(path)?;
        // What cannot be run is described all the same.
        let Ok(Ok(mut contacts)) = calibration.map(|calibration| Self::new(&body, calibration, &reader)) else {
            return Ok(None);
        };
        let mut frame = Frame::missing(0.0, reader.taxels().len());
        let mut frames = 0;
        while reader.next_frame(&mut frame)? {
            contacts.see(&frame)?;
            frames += 1;
            if !goes_on(frames) {
                return Ok(None);
            }
        }
        contacts.finish(rule).map(Some)
    }

    /// Takes the next frame.
    ///
    /// # Errors
    /// The engine's.
    pub fn see(&mut self, frame: &Frame) -> Result<()> {
        match self.frames.get_mut(self.waiting) {
            Some(room) => room.clone_from(frame),
            None => self.frames.push(frame.clone()),
        }
        self.waiting += 1;
        if self.waiting == BATCH { self.follow() } else { Ok(()) }
    }

    /// Takes the frames that wait.
    fn follow(&mut self) -> Result<()> {
        let waiting = std::mem::take(&mut self.waiting);
        let percepts = self.engine.process(&self.frames[..waiting])?;
        for frame in 0..percepts.frames() {
            let number = u32::try_from(self.times_s.len()).unwrap_or(u32::MAX);
            self.times_s.push(percepts.t_s(frame));
            for (field, percept) in self.fields.iter_mut().zip(percepts.frame(frame)) {
                if percept.contact {
                    field.samples.push(sample(number, &percept));
                }
            }
        }
        Ok(())
    }

    /// Ends the recording; a contact that lasts has lasted until its last frame.
    ///
    /// # Errors
    /// The engine's; or `rule` asks for a force where there is none.
    pub fn finish(mut self, rule: Rule) -> Result<FoundContacts> {
        self.follow()?;
        let loads = |field: &FieldSamples| field.samples.iter().map(Sample::load).fold(0.0, f64::max);
        let is_force = |field: &FieldSamples| field.samples.iter().all(|sample| !sample.force.is_nan());
        let newtons = self.fields.iter().filter(|field| is_force(field)).map(loads).fold(0.0, f64::max);
        let pressed = self.fields.into_iter().filter(|field| !field.samples.is_empty());
        let fields = pressed.map(|field| -> Result<FieldContacts> {
            let (is_force, peak) = (is_force(&field), loads(&field));
            let over = rule.over(peak, is_force, newtons)?;
            let contacts = episodes(&field.samples, &self.times_s, over, rule.shortest_s);
            let FieldSamples { name, quantity, samples } = field;
            Ok(FieldContacts { name, quantity, samples, is_force, over, contacts })
        });
        Ok(FoundContacts { rule, fields: fields.collect::<Result<_>>()?, times_s: self.times_s })
    }
}

/// What is kept of `percept` in frame `frame`.
fn sample(frame: u32, percept: &Percept) -> Sample {
    let single = |value: Option<f64>| value.map_or(f32::NAN, |value| value as f32);
    Sample {
        frame,
        total: percept.total.unwrap_or(0.0) as f32,
        force: single(percept.force),
        peak: single(percept.peak),
        area: single(percept.area),
        centroid: percept.centroid.map_or([f32::NAN; 2], |at| at.map(|part| part as f32)),
    }
}

impl FoundContacts {
    /// The fields that are touched: times in seconds, loads in the unit that is named.
    pub fn as_json(&self) -> Vec<Value> {
        let json_of = |field: &FieldContacts| {
            json!({
                "field": field.name, "contacts": field.contacts.len(), "whole": field.whole().count(),
                "longest": field.longest_s(), "stance": field.stance_s(),
                "quantity": if field.is_force { "force" } else { "total" }, "unit": field.load_quantity().symbol(),
                "threshold": field.over, "mean": field.mean(), "peak": field.peak(),
            })
        };
        self.fields.iter().map(json_of).collect()
    }

    /// The fields that are touched.
    pub fn fields(&self) -> &[FieldContacts] {
        &self.fields
    }

    /// The times of the recording's frames, s.
    pub(super) fn times_s(&self) -> &[f64] {
        &self.times_s
    }

    /// How long a contact lasts at least, s.
    pub fn shortest_s(&self) -> f64 {
        self.rule.shortest_s
    }
}

impl FieldContacts {
    /// What each contact comes to, in their order; the frames of the recording are at `times_s`.
    pub(super) fn summaries(&self, times_s: &[f64]) -> impl Iterator<Item = (&Episode, Summary)> {
        self.contacts.iter().map(|contact| (contact, summary(&self.samples[contact.from..contact.to], times_s)))
    }

    /// Of P.
    pub(super) fn quantity(&self) -> Quantity {
        self.quantity
    }

    /// Contacts that began and ended in the recording.
    fn whole(&self) -> impl Iterator<Item = &Episode> {
        self.contacts.iter().filter(|contact| contact.is_whole)
    }

    /// How long the longest contact is, s.
    pub fn longest_s(&self) -> f64 {
        self.contacts.iter().map(Episode::lasts_s).fold(0.0, f64::max)
    }

    /// How long contacts lasted that began and ended in the recording, s.
    pub fn stance_s(&self) -> Option<f64> {
        let whole = self.whole().count();
        (whole > 0).then(|| self.whole().map(Episode::lasts_s).sum::<f64>() / whole as f64)
    }

    /// Of force where it is known, else of the total.
    pub fn load_quantity(&self) -> Quantity {
        if self.is_force { Quantity::Newton } else { self.quantity }
    }

    /// The mean over contacts.
    pub fn mean(&self) -> Option<f64> {
        let loads =
            || self.contacts.iter().flat_map(|contact| &self.samples[contact.from..contact.to]).map(Sample::load);
        let frames = loads().count();
        (frames > 0).then(|| loads().sum::<f64>() / frames as f64)
    }

    /// The largest load.
    pub fn peak(&self) -> f64 {
        self.samples.iter().map(Sample::load).fold(0.0, f64::max)
    }
}
