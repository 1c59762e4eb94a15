//! The first line of NDJSON, where it is asked for: the units, and the body.

use std::collections::HashSet;

use serde_json::{Map, Value, json};

use crate::body::Body;
use crate::percept::{Column, TouchOutputs, Unit};
use crate::scene::{Plan, PlannedField, receptor_of};
use crate::signal::Receptor;

/// Version of the percepts' schema, with the header as its first line.
const VERSION: u32 = 2;

/// The units of all outputs of `plan`, in their order. Where fields measure different quantities, a unit of P is an object by
/// field.
pub(super) fn units(plan: &Plan) -> Vec<(&'static str, Value)> {
    plan.outputs().columns().map(|column| (column.name, unit(plan, column))).collect()
}

/// The units of all quantities of touches of the whole body; none where no touches are looked for.
pub(super) fn units_of_touches(plan: &Plan) -> Vec<(&'static str, Value)> {
    let outputs = plan.touch_outputs().unwrap_or(TouchOutputs::empty());
    outputs.columns().map(|column| (column.name, in_unit(plan, column.unit))).collect()
}

fn unit(plan: &Plan, column: &Column) -> Value {
    match in_unit(plan, column.unit) {
        Value::String(unit) => per_second(plan, column, unit).into(),
        Value::Object(by_field) => {
            let of_field = |(field, unit): (String, Value)| {
                let unit = unit.as_str().unwrap_or_default().to_owned();
                (field, per_second(plan, column, unit).into())
            };
            Value::Object(by_field.into_iter().map(of_field).collect())
        }
        unit => unit,
    }
}

/// `unit`, in which `column` is of pressures; a second of it where fields have the change of P in the place of P, and no pressures.
pub(super) fn per_second(plan: &Plan, column: &Column, unit: String) -> String {
    let has = |receptor: Receptor| plan.letters().iter().any(|letter| letter.receptor == receptor);
    let is_of_change = has(Receptor::Change) && !has(Receptor::Sustained) && receptor_of(column).is_of_pressure();
    if is_of_change && column.unit == Unit::P { format!("{unit}/s") } else { unit }
}

fn in_unit(plan: &Plan, unit: Unit) -> Value {
    match (unit, plan.common_quantity()) {
        (Unit::P, Some(quantity)) => quantity.symbol().into(),
        (Unit::Force, Some(quantity)) => quantity.of_force().symbol().into(),
        (Unit::PMetre, Some(quantity)) => format!("{} m", quantity.symbol()).into(),
        (Unit::P, None) => {
            let of_field = |(index, field): (usize, PlannedField<'_>)| {
                (field.name.to_owned(), plan.quantity(index).symbol().into())
            };
            Value::Object(plan.fields().enumerate().map(of_field).collect())
        }
        (unit, _) => unit.symbol().into(),
    }
}

/// The line, without its end.
pub(super) fn line(plan: &Plan, body: Option<&Body>) -> String {
    let units: Map<String, Value> = units(plan).into_iter().map(|(name, unit)| (name.to_owned(), unit)).collect();
    let body = body.map(|body| {
        let mut seen = HashSet::new();
        let fields: Vec<&str> = plan.fields().map(|field| field.name).filter(|name| seen.insert(*name)).collect();
        json!({"name": body.name, "taxels": body.taxels.len(), "fields": fields})
    });
    let mut line = json!({"somatic": VERSION, "units": units, "body": body});
    // As lines name them: not where all are the usual one.
    let mut seen = HashSet::new();
    let named = plan.letters().iter().filter_map(|letter| letter.mark(plan.letters()).receptor);
    let letters: Vec<String> =
        named.map(|letter| letter.to_string()).filter(|name| seen.insert(name.clone())).collect();
    if !letters.is_empty() {
        line["letters"] = letters.into();
    }
    if plan.touch_outputs().is_some() {
        let units = units_of_touches(plan).into_iter();
        line["touches"] = Value::Object(units.map(|(name, unit)| (name.to_owned(), unit)).collect());
    }
    line.to_string()
}
