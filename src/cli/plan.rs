//! `somatic plan`: what a scene costs, and what it leaves out.

mod bill;
#[cfg(feature = "zenoh")]
mod network;
mod shown;
mod timed;

use std::path::PathBuf;

use clap::Args;
use somatic::internal::setup::bodies::load_body;
use somatic::internal::setup::{Input, Setup};
use somatic::scene::file::SceneFile;
use somatic::{Error, Result};

use self::bill::Bill;
use super::scene::{RunFlags, grouped, in_flags};
use super::stdio::{DONE, print};

const EXAMPLES: &str = "\
Examples:
  somatic plan robot.scene.toml
  somatic plan --body humanoid --fields 'left_arm/**' --outputs centroid
  somatic plan robot.scene.toml --json | jq '.stages[] | select(.runs) | [.stage, .us]'
  somatic plan --schema > scene.schema.json      for editors that know JSON Schema

Times are measured now, on this machine: on the first frames of a recording, else with every
taxel pressed. A stage's time is what a plan with it takes more than a plan without.";

/// Show what a scene computes, what it leaves out, and what it costs.
#[derive(Args)]
#[command(after_help = EXAMPLES, hide_possible_values = true, mut_args(grouped))]
pub(super) struct Arguments {
    /// A scene, a TOML file; a flag overrides its key.
    ///
    /// Its keys are the flags below, with _ for -. `somatic plan --schema` has all keys.
    #[arg(value_name = "SCENE")]
    scene: Option<PathBuf>,

    #[command(flatten)]
    asked: RunFlags,

    /// Print JSON: bytes of a frame, times of a frame in µs.
    #[arg(long)]
    json: bool,

    /// Print the JSON Schema of scene files, and nothing else.
    #[arg(long)]
    schema: bool,
}

pub(super) fn plan(arguments: &Arguments) -> Result<u8> {
    if arguments.schema {
        let schema = serde_json::to_string_pretty(&schemars::schema_for!(SceneFile));
        print(&(schema.map_err(|e| Error::failed(e.to_string()))? + "\n"))?;
        return Ok(DONE);
    }
    let asked = arguments.asked.with(arguments.scene.as_deref())?;
    plan_asked(arguments, &asked).map_err(in_flags)
}

fn plan_asked(arguments: &Arguments, asked: &Setup) -> Result<u8> {
    let input = Input::named_or_none(asked)?;
    let body = match &input {
        Some(input) => input.body(asked)?,
        None => load_body(asked.body.as_deref().unwrap_or("hand"))?,
    };
    let bill = Bill::for_run(asked, input.as_ref(), &body)?;
    print(&if arguments.json { format!("{}\n", bill.json()) } else { bill.text() })?;
    Ok(DONE)
}
