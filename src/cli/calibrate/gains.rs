//! `somatic calibrate --gains-from`: gains and the layer's width from ordinary touches, written into a calibration.

use std::path::Path;
use std::sync::atomic::Ordering;

use serde_json::json;
use somatic::internal::gains::{GainsEstimate, GainsSurvey};
use somatic::internal::limits::{self, MAX_TOML_BYTES};
use somatic::internal::run::left_out;
use somatic::internal::survey::gains::{layer_under, spread, spread_without_gain, with_gains};
use somatic::source::Source;
use somatic::{Body, Calibration, Error, Frame, OutputPath, Result};

use crate::cli::bar::Bar;
use crate::cli::interrupt::stop_soon_on_signal;
use crate::cli::stdio::{print, say, tell_losses};
use crate::cli::table::{plain, shown};
use crate::cli::words::{bullet, count};

/// Frames that are taken at once.
const BATCH: usize = 256;
/// What is left of gains unexplained over which touches were not what contacts are taken for.
const MOST_SPREAD: f64 = 0.08;

/// Touches, and the calibration that they are to improve.
pub(super) struct Touches<'a> {
    /// As the recording is called.
    pub(super) name: &'a str,
    pub(super) source: Box<dyn Source + Send>,
    pub(super) calibration: Option<&'a Path>,
}

/// Finds gains and width from `touches` on `body`, all by a stamp of the radius `stamp_m` if one is given, and writes their calibration
/// with these to `to`.
pub(super) fn calibrate(
    touches: Touches<'_>,
    body: &Body,
    channels: &[u32],
    stamp_m: Option<f64>,
    to: OutputPath,
    as_json: bool,
) -> Result<u8> {
    let Touches { name: recording, mut source, calibration } = touches;
    let Some(path) = calibration else {
        return Err(Error::usage(
            "--gains-from improves a calibration; name the one with baselines and dead bands as --calibration",
        ));
    };
    let text = limits::read_to_string(path, MAX_TOML_BYTES).map_err(|e| Error::io(path, &e))?;
    let ids: Vec<u32> = body.taxels.iter().map(|taxel| taxel.id).collect();
    let kinds: Vec<_> = body.taxels.iter().map(|taxel| (taxel.id, taxel.modality)).collect();
    let calibration = Calibration::parse_for(&text, &kinds).map_err(|e| e.at(path.display()))?;
    let mut survey = GainsSurvey::new(body, calibration, channels)?;
    let stop = stop_soon_on_signal()?;
    let mut bar = Bar::new("read");
    let mut frames = Vec::with_capacity(BATCH);
    let mut frame = Frame::missing(0.0, channels.len());
    let (mut count, mut last_s) = (0, 0.0);
    let absent = [to.name().display().to_string()];
    while source.next_frame(&mut frame)? {
        if stop.load(Ordering::Relaxed) {
            drop(bar);
            let left = left_out(recording, count, last_s, source.progress(), &absent);
            return Ok(tell_losses(&[source.losses(), vec![left]].concat()));
        }
        (count, last_s) = (count + 1, frame.t_s);
        frames.push(frame.clone());
        if frames.len() == BATCH {
            survey.add(&frames)?;
            frames.clear();
            bar.show_with_time_left(source.progress().unwrap_or(0.0));
        }
    }
    survey.add(&frames)?;
    source.notices().iter().for_each(|notice| say(notice));
    drop(bar);
    let mut bar = Bar::new("fitted");
    let mut estimate = survey
        .finish(&mut |share| {
            bar.show_with_time_left(share);
            !stop.load(Ordering::Relaxed)
        })
        .map_err(|e| e.at(recording))?;
    drop(bar);
    if stop.load(Ordering::Relaxed) {
        return Err(Error::failed(format!("interrupted; {} is not written", absent[0])));
    }
    if let Some(radius_m) = stamp_m {
        estimate.sigma_m = layer_under(radius_m, estimate.width_m)?;
    }
    let written = with_gains(&text, &kinds, &estimate).map_err(|e| e.at(path.display()))?;
    // What is written must be what `run` takes; if it were not, nothing is written.
    Calibration::parse_for(&written, &kinds).map_err(|e| e.at("the calibration that follows from these touches"))?;
    let name = to.name().display().to_string();
    to.write(written.as_bytes())?;
    print(&if as_json { json_of(&ids, &estimate) } else { table_of(&ids, &estimate, path) })?;
    say(&format!("wrote {name}"));
    Ok(tell_losses(&source.losses()))
}

/// The ids of taxels without a gain.
fn taxels_without_gain(ids: &[u32], estimate: &GainsEstimate) -> Vec<u32> {
    ids.iter().zip(&estimate.gains).filter(|(_, gain)| gain.is_none()).map(|(id, _)| *id).collect()
}

fn table_of(ids: &[u32], estimate: &GainsEstimate, from: &Path) -> String {
    let estimated = estimate.gains.iter().flatten().count();
    let mut table = plain(["", "found"], 0..0);
    let percent = |share: f64| format!("{:.1} %", 100.0 * share);
    for row in [
        ["touches", &count(estimate.touches as u64, "frame")],
        ["gains", &format!("of {estimated} of {} taxels; they differ by {}", ids.len(), percent(spread(estimate)))],
        ["left", &format!("{} between taxels and contacts", percent(estimate.left))],
        ["width", &format!("{:.2} mm, of layer and contacts together", estimate.width_m * 1e3)],
        ["sigma_m", &format!("{:.2} mm", estimate.sigma_m * 1e3)],
        ["gain_spread", &percent(estimate.gain_spread)],
    ] {
        table.add_row(row);
    }
    let mut text = format!("{}\n{}", from.display(), shown(&table));
    if estimate.gain_spread > MOST_SPREAD {
        let what = format!(
            "{} of the gains are left unexplained, over {}: press with one round, soft thing, and away from rims",
            percent(estimate.gain_spread),
            percent(MOST_SPREAD)
        );
        text += &format!("{}\n", bullet(&what));
    }
    let without_gain = taxels_without_gain(ids, estimate);
    if !without_gain.is_empty() {
        let listed = without_gain.iter().take(12).map(ToString::to_string).collect::<Vec<_>>().join(", ");
        let more = if without_gain.len() > 12 { ", …" } else { "" };
        let what = format!(
            "taxels {listed}{more} were pressed too seldom: they keep their gains, each with a gain_spread of {}; touch there, too",
            percent(spread_without_gain(estimate))
        );
        text += &format!("{}\n", bullet(&what));
    }
    text
}

fn json_of(ids: &[u32], estimate: &GainsEstimate) -> String {
    let taxels = ids.iter().zip(&estimate.gains).zip(&estimate.pressed);
    let taxels = taxels.map(|((id, gain), touches)| json!({ "taxel": id, "gain": gain, "touches": touches }));
    let json = json!({
        "touches": estimate.touches, "width_m": estimate.width_m, "sigma_m": estimate.sigma_m, "left": estimate.left,
        "gain_spread": estimate.gain_spread,
        "taxels": taxels.collect::<Vec<_>>(),
    });
    format!("{json:#}\n")
}
