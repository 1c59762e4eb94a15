//! The percepts that a recording holds, beside those computed from its frames now.

use std::collections::HashMap;
use std::path::Path;
use std::sync::{Mutex, PoisonError};

use serde_json::{Map, Value};
use somatic::field::WORLD;
use somatic::internal::body::WORLD_FROM_BODY;
use somatic::internal::renamed::old_name;
use somatic::percept::Measure;
use somatic::recording::Reader;
use somatic::sink::FieldNames;
use somatic::{COLUMNS, Column, Outputs, Percept, Percepts, Plan, Result};

use super::recording::Recording;

/// Quantities that differ by less than this part are the same: another backend rounds differently.
const ROUNDING: f64 = 1e-3;
/// And so are those that differ by less than this, in m, rad or what else they are measured in.
const SMALLEST: f64 = 1e-6;
/// Recorded values that are kept to be shown, at most.
const MAX_KEPT: usize = 100_000;

/// Recorded quantities that differ from the computed ones: by frame and field, the name and value of each.
#[derive(Default)]
pub(super) struct Differences(Mutex<HashMap<(usize, usize), Vec<Different>>>);

/// A recorded quantity; no value where the recording says that it was absent, or the field not touched.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Different {
    pub(super) column: &'static str,
    pub(super) recorded: Option<Vec<f64>>,
}

impl Differences {
    /// The recorded quantities that differ in a field of a frame.
    pub(super) fn in_field(&self, frame: usize, field: usize) -> Vec<Different> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).get(&(frame, field)).cloned().unwrap_or_default()
    }

    fn keep(&self, frame: usize, field: usize, different: Vec<Different>) {
        let mut kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if kept.len() < MAX_KEPT {
            kept.insert((frame, field), different);
        }
    }
}

/// Reads the percepts of a recording in the order of its frames.
pub(super) struct Recorded {
    reader: Reader,
    line: Vec<u8>,
    /// The next percepts, and their time.
    next: Option<(f64, Map<String, Value>)>,
    /// Fields by what a line says of them: name, letter, signal.
    fields: HashMap<[Option<String>; 3], usize>,
    /// Columns that the recording has, as far as it has been read: others were not asked for.
    columns: Vec<&'static Column>,
}

impl Recorded {
    /// Of the recording at `path`. `None` where it holds no percepts.
    ///
    /// # Errors
    /// It cannot be read.
    pub(super) fn open(path: &Path, plan: &Plan) -> Result<Option<Self>> {
        let names = FieldNames::all_of(plan).into_iter().map(|names| [Some(names.field), names.letter, names.signal]);
        let mut recorded = Self {
            reader: Reader::open(path)?,
            line: Vec::new(),
            next: None,
            fields: names.zip(0..).collect(),
            columns: Vec::new(),
        };
        recorded.advance()?;
        Ok(recorded.next.is_some().then_some(recorded))
    }

    fn advance(&mut self) -> Result<()> {
        self.next = None;
        while self.reader.next_percepts(&mut self.line)? {
            // What is damaged is not compared.
            if let Ok(Value::Object(line)) = serde_json::from_slice(&self.line)
                && let Some(t_s) = line.get("t").and_then(Value::as_f64)
            {
                self.next = Some((t_s, line));
                return Ok(());
            }
        }
        Ok(())
    }

    /// Compares `percepts`, those of the frames of `recording` from `first` on. Gives whether each frame differs.
    ///
    /// # Errors
    /// The file cannot be read.
    pub(super) fn compare(
        &mut self,
        percepts: &Percepts,
        recording: &Recording,
        first: usize,
        differences: &Differences,
    ) -> Result<Vec<bool>> {
        let mut differs = vec![false; percepts.frames()];
        for frame in 0..percepts.frames() {
            let t_s = recording.frames[first + frame].t_s;
            let Some((_, line)) = self.next.take_if(|(recorded_s, _)| *recorded_s == t_s) else { continue };
            for (field, different) in self.differences(percepts, frame, &line) {
                differences.keep(first + frame, field, different);
                differs[frame] = true;
            }
            self.advance()?;
        }
        Ok(differs)
    }

    fn differences(
        &mut self,
        percepts: &Percepts,
        frame: usize,
        line: &Map<String, Value>,
    ) -> Vec<(usize, Vec<Different>)> {
        let listed = line.get("fields").and_then(Value::as_array).into_iter().flatten().filter_map(Value::as_object);
        let mut recorded: HashMap<usize, &Map<String, Value>> = HashMap::new();
        for values in listed {
            let key =
                ["field", "letter", "signal"].map(|key| values.get(key).and_then(Value::as_str).map(str::to_owned));
            if let Some(&field) = self.fields.get(&key) {
                recorded.insert(field, values);
                let new = COLUMNS.iter().filter(|column| recorded_of(column, values).is_some());
                let new: Vec<&Column> = new.filter(|column| !self.columns.contains(column)).collect();
                self.columns.extend(new);
            }
        }
        let is_y_up = self.reader.is_y_up();
        let is_touched = |values: &&Map<String, Value>| values.get("contact") == Some(&Value::Bool(true));
        let mut found = Vec::new();
        for field in 0..percepts.fields() {
            let percept = percepts.get(frame, field);
            let values = recorded.get(&field).copied().filter(is_touched);
            if !percept.contact && values.is_none() {
                continue;
            }
            let columns = self.columns.iter().filter(|column| percepts.outputs().contains(column.output));
            let different = columns.filter_map(|column| different(column, &percept, values, is_y_up));
            let different: Vec<Different> = different.collect();
            if !different.is_empty() {
                found.push((field, different));
            }
        }
        found
    }
}

/// The recorded value of `column`, also from before it was called so.
fn recorded_of<'v>(column: &Column, values: &'v Map<String, Value>) -> Option<&'v Value> {
    values.get(column.name).or_else(|| values.get(&old_name(column.name)?))
}

/// The recorded value of `column`, if it differs from that of `percept`; `is_y_up` says that its world was.
fn different(
    column: &Column,
    percept: &Percept,
    values: Option<&Map<String, Value>>,
    is_y_up: bool,
) -> Option<Different> {
    let mut recorded: Option<Vec<f64>> =
        values.and_then(|values| recorded_of(column, values)).and_then(|value| match value {
            Value::Array(parts) => parts.iter().map(Value::as_f64).collect(),
            one => one.as_f64().map(|one| vec![one]),
        });
    let is_place = (Outputs::POSITION | Outputs::NORMAL).contains(column.output);
    let is_of_world = values.is_some_and(|values| values.get("link").and_then(Value::as_str) == Some(WORLD));
    if is_y_up
        && is_place
        && is_of_world
        && let Some([x, y, z]) = recorded.as_deref()
    {
        recorded = Some(WORLD_FROM_BODY.transform_vector3([*x, *y, *z].into()).to_array().to_vec());
    }
    let computed = percept.value(column).filter(|_| percept.contact);
    let same = match (&recorded, computed) {
        (None, None) => true,
        (Some(recorded), Some(computed)) => is_same(column, recorded, &computed[..column.components]),
        _ => false,
    };
    (!same).then_some(Different { column: column.name, recorded })
}

fn is_same(column: &Column, recorded: &[f64], computed: &[f64]) -> bool {
    if recorded.len() != computed.len() {
        return false;
    }
    let apart = recorded.iter().zip(computed).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
    let turn = match column.measure {
        Measure::Line => std::f64::consts::PI,
        Measure::Direction => std::f64::consts::TAU,
        _ => {
            let size = |value: &[f64]| value.iter().map(|part| part * part).sum::<f64>().sqrt();
            return apart <= SMALLEST + ROUNDING * size(recorded).max(size(computed));
        }
    };
    (apart - turn * (apart / turn).round()).abs() <= ROUNDING
}

#[cfg(test)]
mod tests {
    use super::*;

    use std::f64::consts::PI;

    #[test]
    fn rounding_is_no_difference_and_an_angle_goes_round() {
        let column = |name: &str| COLUMNS.iter().find(|column| column.name == name).unwrap();
        let same = |name: &str, a: &[f64], b: &[f64]| is_same(column(name), a, b);
        assert!(same("total", &[100.0], &[100.05]) && !same("total", &[100.0], &[100.5]));
        assert!(same("centroid", &[0.0, 0.01], &[0.0, 0.010001]) && !same("centroid", &[0.0, 0.01], &[0.001, 0.01]));
        assert!(same("orientation", &[0.0001], &[PI - 0.0001]) && !same("orientation", &[0.0], &[1.57]));
        assert!(!same("direction", &[0.0], &[PI]) && same("direction", &[0.0001 - PI], &[PI - 0.0001]));
    }
}
