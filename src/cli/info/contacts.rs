//! How often, how long and how hard each field is touched in a recording.

use serde_json::{Value, json};
use somatic::signal::Quantity;
use somatic::source::Source;
use somatic::{BackendKind, Body, Calibration, Engine, Frame, Options, Outputs, Percept, Result, Scene};

use crate::cli::table::{plain, shown};
use crate::cli::words::{number, span};

/// Frames that are taken through the engine together.
const BATCH: usize = 256;

/// Follows the contacts of all fields.
pub(super) struct Contacts {
    engine: Engine,
    /// Those that wait for others, then room for more.
    frames: Vec<Frame>,
    waiting: usize,
    fields: Vec<FieldContacts>,
    last_s: f64,
}

/// The contacts of one field.
struct FieldContacts {
    name: String,
    quantity: Quantity,
    contacts: u64,
    /// When the contact that lasts began, s.
    since_s: Option<f64>,
    longest_s: f64,
    /// Contacts that began and ended in the recording: how many, and how long all together.
    whole: u64,
    whole_s: f64,
    /// Load while touched: force in N where it is known, else the total.
    load_sum: f64,
    load_frames: u64,
    load_peak: f64,
    is_force: bool,
    /// Whether the contact that lasts began before the recording.
    began_touched: bool,
}

impl Contacts {
    /// For frames of `source` on `body`.
    pub(super) fn new(body: &Body, calibration: Option<Calibration>, source: &dyn Source) -> Result<Self> {
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

    pub(super) fn see(&mut self, frame: &Frame) -> Result<()> {
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
    pub(super) fn finish(&mut self) -> Result<()> {
        self.follow()?;
        for field in &mut self.fields {
            if let Some(since_s) = field.since_s.take() {
                field.longest_s = field.longest_s.max(self.last_s - since_s);
            }
        }
        Ok(())
    }

    pub(super) fn as_json(&self) -> Vec<Value> {
        let json_of = |field: &FieldContacts| {
            json!({
                "field": field.name, "contacts": field.contacts, "longest": field.longest_s,
                "stance": field.stance_s(), "load_mean": field.load_mean(), "load_peak": field.load_peak,
                "load_unit": if field.is_force { "N" } else { field.quantity.symbol() },
            })
        };
        self.fields.iter().filter(|field| field.contacts > 0).map(json_of).collect()
    }

    /// A table of the fields that are touched.
    pub(super) fn text(&self) -> String {
        let touched: Vec<&FieldContacts> = self.fields.iter().filter(|field| field.contacts > 0).collect();
        if touched.is_empty() {
            return String::new();
        }
        let mut table = plain(["field", "contacts", "longest", "stance, mean", "load, mean", "load, peak"], 1..6);
        for field in touched {
            let quantity = if field.is_force { Quantity::Newton } else { field.quantity };
            let load = |value: f64| {
                let (factor, unit) = quantity.readable(field.load_peak);
                format!("{} {unit}", number(value * factor))
            };
            table.add_row([
                field.name.clone(),
                field.contacts.to_string(),
                span(field.longest_s),
                field.stance_s().map_or("–".to_owned(), span),
                field.load_mean().map_or("–".to_owned(), load),
                load(field.load_peak),
            ]);
        }
        format!("\n{}", shown(&table))
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

    /// How long contacts lasted that began and ended in the recording, s.
    fn stance_s(&self) -> Option<f64> {
        (self.whole > 0).then(|| self.whole_s / self.whole as f64)
    }

    fn load_mean(&self) -> Option<f64> {
        (self.load_frames > 0).then(|| self.load_sum / self.load_frames as f64)
    }
}
