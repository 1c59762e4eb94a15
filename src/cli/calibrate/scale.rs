//! `somatic calibrate --known --calibration`: one scale for gains that were found before.

use std::path::Path;
use std::sync::atomic::Ordering;
use std::time::Duration;

use serde_json::json;
use somatic::internal::limits::{self, MAX_TOML_BYTES};
use somatic::internal::run::{Arrival, Feed, ReadMode, left_out};
use somatic::internal::survey::known::KnownForces;
use somatic::internal::survey::scale::{ScaleEstimate, ScaleSurvey, with_scale};
use somatic::source::{Lines, Source};
use somatic::{Body, Calibration, Error, OutputPath, Result};

use crate::cli::interrupt::stop_on_signal;
use crate::cli::stdio::{print, say, tell_losses};
use crate::cli::words::{bullet, number};

/// What presses come from.
pub(super) struct Presses<'a> {
    /// As the source is called.
    pub(super) name: &'a str,
    pub(super) source: Box<dyn Source + Send>,
    pub(super) lines: Option<&'a Lines>,
    pub(super) is_live: bool,
    /// For how long they are taken, s; to the end if that is not given.
    pub(super) for_s: Option<f64>,
}

/// Finds the scale of the calibration at `path` from `presses` on `body` with `forces`, and writes it with that to `to`.
pub(super) fn calibrate(
    presses: Presses<'_>,
    channels: &[u32],
    (body, path): (&Body, &Path),
    forces: &KnownForces,
    to: OutputPath,
    as_json: bool,
) -> Result<u8> {
    let text = limits::read_to_string(path, MAX_TOML_BYTES).map_err(|e| Error::io(path, &e))?;
    let kinds: Vec<_> = body.taxels.iter().map(|taxel| (taxel.id, taxel.modality)).collect();
    let calibration = Calibration::parse_for(&text, &kinds).map_err(|e| e.at(path.display()))?;
    let mut survey = ScaleSurvey::new(body, calibration, channels).map_err(|e| e.at(path.display()))?;
    let Presses { name, source, lines, is_live, for_s } = presses;
    let output = to.name().display().to_string();
    let stop = stop_on_signal()?;
    let mut feed = match lines {
        Some(_) => Feed::start_live(source, 64),
        None => Feed::start(source, ReadMode { most: 64, gather: !is_live, speed: None }),
    };
    if is_live {
        say(if for_s.is_some() {
            "now put the weights on"
        } else {
            "now put the weights on; Ctrl-C when all are done"
        });
    }
    let (mut begin, mut frames_taken, mut last_s, mut losses, mut is_whole) = (None, 0, 0.0, Vec::new(), false);
    while !stop.load(Ordering::Relaxed) {
        lines.into_iter().flat_map(Lines::notices).for_each(|notice| say(&notice.to_string()));
        match feed.next(Duration::from_millis(40)) {
            Some(Arrival::Frames(frames, info)) => {
                info.notices.iter().for_each(|notice| say(notice));
                losses = info.losses;
                let begin_s = *begin.get_or_insert_with(|| frames.first().map_or(0.0, |frame| frame.t_s));
                let taken =
                    frames.iter().take_while(|frame| for_s.is_none_or(|for_s| frame.t_s - begin_s < for_s)).count();
                is_whole = taken < frames.len();
                survey.add(&frames[..taken])?;
                frames_taken += taken as u64;
                last_s = frames.last().map_or(last_s, |frame| frame.t_s);
                feed.give_back(frames);
                if is_whole {
                    break;
                }
            }
            Some(Arrival::End(ending)) => {
                (losses, is_whole) = (ending.losses, true);
                break;
            }
            Some(Arrival::Failed(error)) => return Err(error),
            None | Some(Arrival::Woken) => {}
        }
    }
    if !is_live && !is_whole {
        losses.push(left_out(name, frames_taken, last_s, None, &[output]));
        return Ok(tell_losses(&losses));
    }
    let estimate = survey.finish(forces).map_err(|e| e.at(name))?;
    let written = with_scale(&text, &estimate).map_err(|e| e.at(path.display()))?;
    // What is written must be what `run` takes; if it were not, nothing is written.
    Calibration::parse_for(&written, &kinds).map_err(|e| e.at("the calibration that follows from these presses"))?;
    to.write(written.as_bytes())?;
    print(&if as_json { json_of(&estimate) } else { text_of(&estimate) })?;
    say(&format!("wrote {output}"));
    Ok(tell_losses(&losses))
}

fn text_of(estimate: &ScaleEstimate) -> String {
    let unit = if estimate.becomes_newton { "; P is in newtons" } else { "" };
    format!("all gains times {}{unit}\n{}\n", number(estimate.scale), bullet(&estimate.remark).trim_end())
}

fn json_of(estimate: &ScaleEstimate) -> String {
    let json = json!({ "scale": estimate.scale, "presses": estimate.presses, "remarks": [&estimate.remark] });
    format!("{json:#}\n")
}
