//! `somatic inspect`: what a body holds, for people and, as JSON, for programs.

mod json;
mod report;

use clap::Args;
use somatic::body::Body;
use somatic::error::Result;
use somatic::field::{Field, FieldSet};

use super::words::count;
use super::{DONE, FAILED, load_body, print};

const EXAMPLES: &str = "\
Examples:
  somatic inspect robot.glb
  somatic inspect humanoid --json | jq '.fields[].name'
  somatic inspect robot.glb --strict > /dev/null || echo 'look at the findings'";

/// Fewer taxels than this leave orientation and axis little to say.
const FEW: usize = 3;
/// Names and ids that a finding lists.
const MOST_LISTED: usize = 8;

/// Say what links, taxels and fields a body has, and what is odd about it.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Arguments {
    /// The robot: a .glb or .gltf file, or one of the bundled bodies hand, mat and humanoid.
    body: String,

    /// Print JSON: positions in metres in the frame of each taxel's link, charts in the frame of each field's anchor.
    #[arg(long)]
    json: bool,

    /// Exit with 1 where anything is odd.
    #[arg(long)]
    strict: bool,
}

pub(super) fn inspect(arguments: &Arguments) -> Result<u8> {
    let body = load_body(&arguments.body)?;
    let mut findings = body.findings.clone();
    let fields = match FieldSet::new(&body) {
        Ok(set) => set.fields,
        Err(error) => {
            findings.push(error.to_string());
            Vec::new()
        }
    };
    findings.extend(odd(&body, &fields));
    print(&match arguments.json {
        true => json::text(&body, &fields, &findings),
        false => report::text(&body, &fields, &findings),
    })?;
    Ok(if arguments.strict && !findings.is_empty() { FAILED } else { DONE })
}

/// What is odd about a layout that can be read.
fn odd(body: &Body, fields: &[Field]) -> Vec<String> {
    let mut findings = Vec::new();
    if body.taxels.is_empty() {
        findings.push("the body has no taxels, so that it cannot be run; add a layout, see docs/layout.md".to_owned());
    }
    if body.fields.is_empty() {
        findings.push("the body has no fields, so that it cannot be run; add some, see docs/layout.md".to_owned());
    }
    let small: Vec<&str> =
        fields.iter().filter(|field| field.members.len() < FEW).map(|field| field.name.as_str()).collect();
    if !small.is_empty() {
        let fields = count(small.len() as u64, "field");
        findings.push(format!("{fields} with under {FEW} taxels, too few for orientation: {}", listed(&small)));
    }
    if !fields.is_empty() {
        let mut held = vec![false; body.taxels.len()];
        fields.iter().flat_map(|field| &field.members).for_each(|member| held[member.taxel] = true);
        let loose: Vec<String> =
            body.taxels.iter().zip(held).filter(|(_, held)| !held).map(|(taxel, _)| taxel.id.to_string()).collect();
        if !loose.is_empty() {
            let taxels = count(loose.len() as u64, "taxel");
            findings.push(format!("{taxels} in no field, so that nothing is felt there: {}", listed(&loose)));
        }
    }
    findings
}

fn listed<T: AsRef<str>>(names: &[T]) -> String {
    let names: Vec<&str> = names.iter().map(AsRef::as_ref).collect();
    match names.get(..MOST_LISTED) {
        Some(first) if names.len() > MOST_LISTED => {
            format!("{} and {} more", first.join(", "), names.len() - MOST_LISTED)
        }
        _ => names.join(", "),
    }
}
