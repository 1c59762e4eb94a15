//! The outputs that are asked for, and what help says of them.

use somatic::internal::scene::AskedOutputs;
use somatic::{Error, Outputs, Result};

/// The quantity of fields called `name`.
pub(in crate::cli) fn output(name: &str) -> Result<Outputs> {
    let asked: AskedOutputs = name.parse()?;
    match asked.of_touches {
        None => Ok(asked.of_fields),
        Some(_) => {
            Err(Error::usage(format!("`{name}` is of touches; give quantities of fields here, such as `total`")))
        }
    }
}

pub(in crate::cli) fn outputs_help() -> String {
    let names: Vec<String> = Outputs::all().names().collect();
    format!(
        "Compute only these quantities: touches, which touches.NAME adds to; and of fields {} [default: touches, and of fields all but \
         motion, self_contacts, filtered_* and *_sigma; force only if P has a unit]\n\n`somatic outputs` lists them with their units.",
        names.join(", ")
    )
}

/// All of `named`, or the default outputs where none are.
pub(in crate::cli) fn outputs_or_usual(named: &[Outputs]) -> Outputs {
    named.iter().copied().reduce(|a, b| a | b).unwrap_or(Outputs::USUAL)
}
