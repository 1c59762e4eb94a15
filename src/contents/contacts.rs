//! How often, how long and how hard each field is touched in a recording.

use std::path::Path;

use serde_json::{Value, json};

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

/// Follows the contacts of all fields.
pub struct Contacts {
    engine: Engine,
    /// Those that wait for others, then room for more.
    frames: Vec<Frame>,
    waiting: usize,
    fields: Vec<FieldContacts>,
    last_s: f64,
}

/// The contacts of one field.
pub struct FieldContacts {
    /// The field's name.
    pub name: String,
    quantity: Quantity,
    /// How many there are.
    pub contacts: u64,
    /// When the contact that lasts began, s.
    since_s: Option<f64>,
    /// How long the longest one is, s.
    pub longest_s: f64,
    /// Contacts that began and ended in the recording: how many, and how long all together.
    whole: u64,
    whole_s: f64,
    /// Load while touched: force in N where it is known, else the total.
    load_sum: f64,
    load_frames: u64,
    /// The highest load, in units of [`FieldContacts::load_quantity`].
    pub load_peak: f64,
    is_force: bool,
    /// Whether the contact that lasts began before the recording.
    began_touched: bool,
}

impl Contacts {
    /// For frames of `source` on `body`.
    ///
    /// # Errors
    /// No engine can be made for them.
    pub fn new(body: &Body, calibration: Option<Calibration>, source: &dyn Source) -> Result<Self> {
        let scene = Scene::default().outputs(Outputs::TOTAL | Outputs::FORCE);
        let options = Options::default().scene(scene).calibration(calibration).backend(BackendKind::Cpu).batch(BATCH);
        let mut engine = Engine::new(body, options)?;
        engine.set_channels(source.taxels())?;
        let plan = engine.plan();
        let field = |index: usize| FieldContacts {
            name: plan.label(index),
            quantity: plan.quantity(index),
            contacts: 0,
            since_s: None,
            longest_s: 0.0,
            whole: 0,
            whole_s: 0.0,
            load_sum: 0.0,
            load_frames: 0,
            load_peak: 0.0,
            is_force: false,
            began_touched: false,
        };
        let fields = (0..plan.fields().len()).map(field).collect();
        Ok(Self { engine, frames: Vec::new(), waiting: 0, fields, last_s: 0.0 })
    }

    /// Those in the MCAP at `path`, if it has its body, and that can be run. `goes_on` is asked after each frame, with how many were
    /// read; None if it does not wish to.
    ///
    /// # Errors
    /// The file, or what is attached to it, cannot be read.
    pub fn of_mcap(path: &Path, tell: &Tell, mut goes_on: impl FnMut(u64) -> bool) -> Result<Option<Self>> {
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
        contacts.finish()?;
        Ok(Some(contacts))
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
            let (t_s, is_first) = (percepts.t_s(frame), percepts.frame_number(frame) == 0);
            self.last_s = t_s;
            for (field, percept) in self.fields.iter_mut().zip(percepts.frame(frame)) {
                field.see(t_s, is_first, &percept);
            }
        }
        Ok(())
    }

    /// Ends the recording; a contact that lasts has lasted until its last frame.
    ///
    /// # Errors
    /// The engine's.
    pub fn finish(&mut self) -> Result<()> {
        self.follow()?;
        for field in &mut self.fields {
            if let Some(since_s) = field.since_s.take() {
                field.longest_s = field.longest_s.max(self.last_s - since_s);
            }
        }
        Ok(())
    }

    /// The fields that are touched.
    pub fn touched(&self) -> impl Iterator<Item = &FieldContacts> {
        self.fields.iter().filter(|field| field.contacts > 0)
    }

    /// The fields that are touched: times in seconds, loads in the unit that is named.
    pub fn as_json(&self) -> Vec<Value> {
        let json_of = |field: &FieldContacts| {
            json!({
                "field": field.name, "contacts": field.contacts, "longest": field.longest_s,
                "stance": field.stance_s(), "load_mean": field.load_mean(), "load_peak": field.load_peak,
                "load_unit": field.load_quantity().symbol(),
            })
        };
        self.touched().map(json_of).collect()
    }
}

impl FieldContacts {
    fn see(&mut self, t_s: f64, is_first: bool, percept: &Percept) {
        if percept.contact {
            if self.since_s.is_none() {
                self.contacts += 1;
                self.since_s = Some(t_s);
                self.began_touched = is_first;
            }
            self.is_force = percept.force.is_some();
            let load = percept.force.or(percept.total).unwrap_or(0.0);
            self.load_sum += load;
            self.load_frames += 1;
            self.load_peak = self.load_peak.max(load);
        } else if let Some(since_s) = self.since_s.take() {
            // Where recorded time goes back, nothing is known of how long it lasted.
            let lasted_s = (t_s - since_s).max(0.0);
            self.longest_s = self.longest_s.max(lasted_s);
            if !self.began_touched {
                self.whole += 1;
                self.whole_s += lasted_s;
            }
        }
    }

    /// What loads are: force where it is known, else the total of P.
    pub fn load_quantity(&self) -> Quantity {
        if self.is_force { Quantity::Newton } else { self.quantity }
    }

    /// How long contacts lasted that began and ended in the recording, s.
    pub fn stance_s(&self) -> Option<f64> {
        (self.whole > 0).then(|| self.whole_s / self.whole as f64)
    }

    /// The mean load while it is touched, in units of [`FieldContacts::load_quantity`].
    pub fn load_mean(&self) -> Option<f64> {
        (self.load_frames > 0).then(|| self.load_sum / self.load_frames as f64)
    }
}
