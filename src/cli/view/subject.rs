//! What `view` shows, by what it is called.

use std::path::Path;

use somatic::internal::setup::Setup;
use somatic::internal::setup::bodies::load_body;
use somatic::internal::source::{BagName, LeRobotName};
use somatic::source::SimulatedSource;
use somatic::{Body, Error, Result, bundled};

use super::super::scene::RunFlags;

/// What is shown.
pub(super) enum Subject {
    /// A body at rest.
    Body(Body),
    /// A recording, with all that is asked of it.
    Recording(Box<Setup>),
}

/// What `what` names, with the flags `asked`.
///
/// # Errors
/// It is neither a body, a recording, a scene nor a simulation; or flags contradict it.
pub(super) fn subject(what: Option<&str>, asked: &RunFlags) -> Result<Subject> {
    let Some(what) = what else { return Ok(Subject::Recording(Box::new(asked.with(None)?))) };
    let ending = Path::new(what).extension().and_then(|ending| ending.to_str()).map(str::to_ascii_lowercase);
    let as_source = |kind: &str| {
        if let Some(other) = asked.sources.first() {
            return Err(Error::usage(format!("`{what}` and --source {other}: give one of them")));
        }
        let source = if kind.is_empty() { what.to_owned() } else { format!("{kind}:{what}") };
        let asked = RunFlags { sources: vec![source], ..asked.clone() };
        Ok(Subject::Recording(Box::new(asked.with(None)?)))
    };
    match ending.as_deref() {
        _ if what.starts_with("ros2-mcap:") || what.starts_with("lerobot:") => as_source(""),
        _ if BagName::is_folder(Path::new(what)) => as_source("ros2-mcap"),
        _ if LeRobotName::is_folder(Path::new(what)) => as_source("lerobot"),
        Some("mcap") => as_source("mcap"),
        Some("db3") => as_source("ros2-mcap"),
        Some("csv") => as_source("csv"),
        Some("asf" | "lst" | "asc" | "txt" | "tsv" | "gz") => as_source(""),
        Some("toml") if SimulatedSource::is_named(what) => as_source("sim"),
        Some("toml") => Ok(Subject::Recording(Box::new(asked.with(Some(Path::new(what)))?))),
        _ if ending.is_none() && bundled::body(what).is_none() && !Path::new(what).exists() => Err(Error::usage(
            "give a body (.glb, .gltf or a bundled one), a recording (.mcap, .csv, or a pressure system's .asf, .lst, .asc), a scene or a simulation (.toml)",
        )
        .at(what)),
        _ => body(what, asked),
    }
}

/// The body `what`, at rest, or with a recording where `asked` has one.
fn body(what: &str, asked: &RunFlags) -> Result<Subject> {
    if let Some(other) = &asked.body {
        return Err(Error::usage(format!("`{what}` and --body {other}: give one of them")));
    }
    if asked.sources.is_empty() {
        let about_frames = [
            ("--joints", asked.joints.is_some()),
            ("--joint-states", asked.joint_states.is_some()),
            ("--poses", asked.poses.is_some()),
            ("--calibration", asked.calibration.is_some()),
            ("--outputs", !asked.outputs.is_empty()),
            ("--fields", !asked.fields.is_empty()),
            ("--from", asked.from_s.is_some()),
            ("--to", asked.to_s.is_some()),
            ("--speed", asked.playback_speed.is_some()),
            ("--rate", asked.rate_hz.is_some()),
            ("--wiring", asked.wiring.is_some()),
        ];
        if let Some((flag, _)) = about_frames.into_iter().find(|(_, is_given)| *is_given) {
            let what_to_do = "it is about frames, and a body at rest has none; give their recording with --source";
            return Err(Error::usage(what_to_do).at(flag));
        }
        return Ok(Subject::Body(load_body(what)?));
    }
    let asked = RunFlags { body: Some(what.to_owned()), ..asked.clone() };
    Ok(Subject::Recording(Box::new(asked.with(None)?)))
}
