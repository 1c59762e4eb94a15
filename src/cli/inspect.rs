//! `somatic inspect`: what a body holds, for people and, as JSON, for programs.

mod graph;
mod inspection;
mod json;
mod report;

use std::path::PathBuf;

use clap::Args;
use somatic::author::coverage;
use somatic::error::{Error, Result};
use somatic::field::FieldSet;
use somatic::internal::author::mesh::Up;
use somatic::internal::author::{DrawnPoses, lint_with_progress};
use somatic::internal::field::{ContactTolerance, TaxelGraph, rest_overlaps};
use somatic::internal::robot::drawn_poses;
use somatic::internal::scene_file::metres;
use somatic::internal::setup::bodies::load_body;
use somatic::robot::Kinematics;

use self::graph::SkinGraph;
use self::inspection::Inspection;
use super::bar::Bar;
use super::expected;
use super::stdio::{DONE, FAILED, print};

const EXAMPLES: &str = "\
Examples:
  somatic inspect robot.glb
  somatic inspect humanoid --json | jq '.fields[].name'
  somatic inspect humanoid --errors
  somatic inspect arm.glb --joints arm.urdf
  somatic inspect robot.glb --strict > /dev/null || echo 'look at the findings'";

/// List a body's links, taxels and fields, and what is wrong with them.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Arguments {
    /// The robot: a .glb or .gltf file, or one of the bundled bodies hand, sensing-hand, mat and humanoid.
    body: String,

    /// Print JSON: positions in metres in the frame of each taxel's link, charts in the frame of each field's anchor.
    #[arg(long)]
    json: bool,

    /// Simulate touches on the layout: how far off place, axis and force will be.
    ///
    /// With the same on an ideal skin.
    #[arg(long)]
    errors: bool,

    /// Exit with 1 if anything is odd.
    #[arg(long)]
    strict: bool,

    /// Report links whose taxels are closer than this at rest, such as 5mm [default: by the taxels' spacing, as for
    /// self_contacts].
    ///
    /// A bare number is in metres.
    #[arg(long, value_name = "LENGTH", value_parser = metres)]
    contact_tolerance: Option<f64>,

    /// Joints of the robot: a URDF.
    ///
    /// Taxels that are covered at rest are then checked in other poses, too. A body that was made from a URDF keeps
    /// its joints and needs none.
    #[arg(long, value_name = "URDF")]
    joints: Option<PathBuf>,

    /// Axis that points up in the URDF of --joints [default: what the body was made with, else z].
    #[arg(long, requires = "joints", value_name = "AXIS")]
    up: Option<Up>,
}

pub(super) fn inspect(arguments: &Arguments) -> Result<u8> {
    if let Some(tolerance) = arguments.contact_tolerance.filter(|it| !(it.is_finite() && *it > 0.0)) {
        return Err(Error::usage(format!("--contact-tolerance {tolerance} is not a distance; give metres over 0")));
    }
    let body = load_body(&arguments.body)?;
    let mut findings = body.findings.clone();
    let fields = match FieldSet::new(&body) {
        Ok(set) => set.fields,
        Err(error) => {
            findings.push(error.to_string());
            Vec::new()
        }
    };
    let poses = match &arguments.joints {
        None => DrawnPoses::of_own_joints(&body),
        Some(urdf) => {
            let up = arguments.up.or_else(|| body.urdf_up()).unwrap_or(Up::Z);
            Some(
                Kinematics::load(urdf)
                    .and_then(|robot| drawn_poses(&robot, &body, up).map_err(|e| e.at(urdf.display())))?,
            )
        }
    };
    let mut bar = Bar::new("looking for defects");
    let odd = lint_with_progress(&body, &fields, poses.as_ref(), &mut |share| bar.show(share));
    drop(bar);
    let (graph, outdated) = TaxelGraph::from_body(&body);
    findings.extend(outdated);
    findings.extend(odd.iter().map(ToString::to_string));
    let coverage = coverage(&body);
    let overlaps = rest_overlaps(&body, &ContactTolerance::new(&body, arguments.contact_tolerance));
    let graph = SkinGraph::new(graph, &body);
    let errors = if arguments.errors { Some(expected::of_body(&body)?) } else { None };
    let seen = Inspection { body, fields, graph, coverage, overlaps, errors, findings, odd };
    print(&match arguments.json {
        true => json::text(&seen),
        false => report::text(&seen),
    })?;
    Ok(if arguments.strict && !seen.findings.is_empty() { FAILED } else { DONE })
}
