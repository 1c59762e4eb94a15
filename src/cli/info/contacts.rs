//! How often, how long and how hard each field is touched in a recording.

use serde_json::{Value, json};
use somatic::signal::Quantity;
use somatic::source::Source;
use somatic::{BackendKind, Body, Calibration, Engine, Frame, Options, Outputs, Percept, Result, Scene};

use super::episodes::{Episode, Rule, Sample, episodes, summary};
use crate::cli::table::{plain, shown};
use crate::cli::words::{number, span};

/// Frames that are taken through the engine together.
const BATCH: usize = 256;

/// Follows how hard all fields are pressed.
pub(super) struct Contacts {
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
pub(super) struct Found {
    rule: Rule,
    times_s: Vec<f64>,
    fields: Vec<FieldContacts>,
}

/// The contacts of a field that is pressed.
struct FieldContacts {
    name: String,
    /// Of P.
    quantity: Quantity,
    samples: Vec<Sample>,
    is_force: bool,
    /// Where contacts begin.
    over: f64,
    contacts: Vec<Episode>,
}

/// The columns of a table of contacts.
pub(super) const COLUMNS: &str = "recording,field,contact,onset [s],offset [s],whole,force_peak [N],impulse [N s],total_peak,\
    total_time,pressure_peak,pressure_time,unit,area [m²],path [m]\n";

impl Contacts {
    /// For frames of `source` on `body`.
    pub(super) fn new(body: &Body, calibration: Option<Calibration>, source: &dyn Source) -> Result<Self> {
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
    pub(super) fn finish(mut self, rule: Rule) -> Result<Found> {
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
        Ok(Found { rule, fields: fields.collect::<Result<_>>()?, times_s: self.times_s })
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

impl Found {
    pub(super) fn as_json(&self) -> Vec<Value> {
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

    /// A table of the fields that are touched, and where contacts begin.
    pub(super) fn text(&self) -> String {
        if self.fields.is_empty() {
            return String::new();
        }
        // A sum of pressures is no load.
        let what = match self.fields.iter().filter(|field| field.is_force).count() {
            0 => "total",
            forces if forces == self.fields.len() => "force",
            _ => "force or total",
        };
        let [mean, peak] = ["mean", "peak"].map(|which| format!("{what}, {which}"));
        let mut table =
            plain(["field", "contacts", "over", "longest", "stance, mean", mean.as_str(), peak.as_str()], 1..7);
        for field in &self.fields {
            let quantity = field.load_quantity();
            let load = |value: f64| {
                let (factor, unit) = quantity.readable(value);
                format!("{} {unit}", number(value * factor))
            };
            table.add_row([
                field.name.clone(),
                field.contacts.len().to_string(),
                load(field.over),
                span(field.longest_s()),
                field.stance_s().map_or("–".to_owned(), span),
                field.mean().map_or("–".to_owned(), load),
                load(field.peak()),
            ]);
        }
        let shortest = span(self.rule.shortest_s);
        format!("\n{}  a contact begins over that much, ends at half, and lasts {shortest} or more\n", shown(&table))
    }

    /// The rows of a table of contacts of `recording`.
    pub(super) fn rows(&self, recording: &str) -> String {
        let mut text = String::new();
        for field in &self.fields {
            let unit = field.quantity.symbol();
            for (index, contact) in field.contacts.iter().enumerate() {
                let found = summary(&field.samples[contact.from..contact.to], &self.times_s);
                let [force, peak] = [found.force, found.peak]
                    .map(|pair| pair.map_or([String::new(), String::new()], |pair| pair.map(digits)));
                let or_empty = |value: Option<f64>| value.map_or(String::new(), digits);
                let row = [
                    quoted(recording),
                    quoted(&field.name),
                    (index + 1).to_string(),
                    contact.onset_s.to_string(),
                    contact.offset_s.to_string(),
                    contact.is_whole.to_string(),
                    force[0].clone(),
                    force[1].clone(),
                    digits(found.total[0]),
                    digits(found.total[1]),
                    peak[0].clone(),
                    peak[1].clone(),
                    unit.to_owned(),
                    or_empty(found.area_m2),
                    or_empty(found.path_m),
                ];
                text += &row.join(",");
                text += "\n";
            }
        }
        text
    }
}

/// With seven digits, as many as single precision has.
fn digits(value: f64) -> String {
    format!("{value:.6e}").parse::<f64>().map_or_else(|_| value.to_string(), |value| value.to_string())
}

/// `text` as a cell of a table.
fn quoted(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text.to_owned() }
}

impl FieldContacts {
    /// Contacts that began and ended in the recording.
    fn whole(&self) -> impl Iterator<Item = &Episode> {
        self.contacts.iter().filter(|contact| contact.is_whole)
    }

    fn longest_s(&self) -> f64 {
        self.contacts.iter().map(Episode::lasts_s).fold(0.0, f64::max)
    }

    /// How long contacts lasted that began and ended in the recording, s.
    fn stance_s(&self) -> Option<f64> {
        let whole = self.whole().count();
        (whole > 0).then(|| self.whole().map(Episode::lasts_s).sum::<f64>() / whole as f64)
    }

    /// Of force where it is known, else of the total.
    fn load_quantity(&self) -> Quantity {
        if self.is_force { Quantity::Newton } else { self.quantity }
    }

    /// The mean over contacts.
    fn mean(&self) -> Option<f64> {
        let loads =
            || self.contacts.iter().flat_map(|contact| &self.samples[contact.from..contact.to]).map(Sample::load);
        let frames = loads().count();
        (frames > 0).then(|| loads().sum::<f64>() / frames as f64)
    }

    fn peak(&self) -> f64 {
        self.samples.iter().map(Sample::load).fold(0.0, f64::max)
    }
}
