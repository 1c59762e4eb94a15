//! `somatic inspect`: what a body holds, for people and, as JSON, for programs.

mod inspection;
mod json;
mod report;

use clap::Args;
use somatic::author::{coverage, lint};
use somatic::error::Result;
use somatic::field::FieldSet;

use self::inspection::Inspection;
use super::bodies::load_body;
use super::stdio::{DONE, FAILED, print};

const EXAMPLES: &str = "\
Examples:
  somatic inspect robot.glb
  somatic inspect humanoid --json | jq '.fields[].name'
  somatic inspect robot.glb --strict > /dev/null || echo 'look at the findings'";

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
    let odd = lint(&body, &fields);
    findings.extend(odd.iter().map(ToString::to_string));
    let coverage = coverage(&body);
    let seen = Inspection { body, fields, coverage, findings, odd };
    print(&match arguments.json {
        true => json::text(&seen),
        false => report::text(&seen),
    })?;
    Ok(if arguments.strict && !seen.findings.is_empty() { FAILED } else { DONE })
}
