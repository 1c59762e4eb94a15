//! The outputs that are asked for, and what help and schema say of them.

use somatic::Outputs;

/// Says in a schema which outputs there are.
pub(super) fn output_names(schema: &mut schemars::Schema) {
    let names: Vec<String> = Outputs::all().names().collect();
    schema.insert("items".to_owned(), serde_json::json!({"type": "string", "enum": names}));
}

pub(in crate::cli) fn outputs_help() -> String {
    let names: Vec<String> = Outputs::all().names().collect();
    format!(
        "Compute only these quantities: {} [default: all but touches, self_contacts, speed_in_world, filtered_*, fit_* and \
         *_sigma; force only where P has a unit]",
        names.join(", ")
    )
}

/// All of `named`, or the default outputs where none are.
pub(in crate::cli) fn outputs_or_usual(named: &[Outputs]) -> Outputs {
    named.iter().copied().reduce(|a, b| a | b).unwrap_or(Outputs::USUAL)
}
