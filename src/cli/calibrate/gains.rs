//! `somatic calibrate --gains-from`: gains and the layer's width from ordinary touches, written into a calibration.

use std::path::Path;
use std::sync::atomic::Ordering;

use serde_json::json;
use somatic::internal::gains::{GainsEstimate, GainsSurvey};
use somatic::internal::limits::{self, MAX_TOML_BYTES};
use somatic::internal::run::left_out;
use somatic::internal::setup::bodies::in_body;
use somatic::source::{SourceSpec, VendorOptions};
use somatic::{Body, Calibration, Error, Frame, OutputPath, Result};
use toml_edit::{DocumentMut, Item, Table, value};

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
    pub(super) recording: &'a str,
    pub(super) calibration: Option<&'a Path>,
    pub(super) rate_hz: Option<f64>,
}

/// Finds gains and width from `touches` on `body`, all by a stamp of the radius `stamp_m` if one is given, and writes their calibration
/// with these to `to`.
pub(super) fn calibrate(
    touches: &Touches<'_>,
    body: &Body,
    stamp_m: Option<f64>,
    to: OutputPath,
    as_json: bool,
) -> Result<u8> {
    let &Touches { recording, calibration, rate_hz } = touches;
    let Some(path) = calibration else {
        return Err(Error::usage(
            "--gains-from improves a calibration; name the one with baselines and dead bands as --calibration",
        ));
    };
    let text = limits::read_to_string(path, MAX_TOML_BYTES).map_err(|e| Error::io(path, &e))?;
    let ids: Vec<u32> = body.taxels.iter().map(|taxel| taxel.id).collect();
    let calibration = Calibration::parse(&text, &ids).map_err(|e| e.at(path.display()))?;
    let spec: SourceSpec = recording.parse()?;
    let mut source = spec.open(&ids, &VendorOptions { rate_hz, ..VendorOptions::default() })?;
    let channels = in_body(body, &*source)?;
    let mut survey = GainsSurvey::new(body, calibration, &channels)?;
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
    let written = with(&text, &ids, &estimate).map_err(|e| e.at(path.display()))?;
    // What is written must be what `run` takes; if it were not, nothing is written.
    Calibration::parse(&written, &ids).map_err(|e| e.at("the calibration that follows from these touches"))?;
    let name = to.name().display().to_string();
    to.write(written.as_bytes())?;
    print(&if as_json { json_of(&ids, &estimate) } else { table_of(&ids, &estimate, path) })?;
    say(&format!("wrote {name}"));
    Ok(tell_losses(&source.losses()))
}

/// The layer's own σ where all touches were by the flat end of a stamp: an even disc has a variance of R²/4 each way.
fn layer_under(radius_m: f64, width_m: f64) -> Result<f64> {
    let variance = width_m * width_m - radius_m * radius_m / 4.0;
    if variance <= 0.0 {
        return Err(Error::failed(format!(
            "the touches are {:.2} mm wide, less than a stamp with a radius of {:.2} mm makes them; is it the radius, and flat?",
            width_m * 1e3,
            radius_m * 1e3
        )));
    }
    Ok(variance.sqrt())
}

/// `text` with the gains and the layer of `estimate`. What is counted in P goes with the gain.
fn with(text: &str, ids: &[u32], estimate: &GainsEstimate) -> Result<String> {
    let mut document: DocumentMut = text.parse().map_err(|e| Error::failed(format!("{e}")))?;
    let number =
        |item: Option<&Item>| item.and_then(|item| item.as_float().or_else(|| item.as_integer().map(|n| n as f64)));
    for (id, gain) in ids.iter().zip(&estimate.gains) {
        let Some(gain) = gain else { continue };
        let id = id.to_string();
        let of = |document: &DocumentMut, key: &str| {
            let own = document.get("taxel").and_then(|taxels| taxels.get(&id)).and_then(|taxel| taxel.get(key));
            number(own).or_else(|| number(document.get("all").and_then(|all| all.get(key))))
        };
        let new = [
            ("gain", Some(of(&document, "gain").unwrap_or(1.0) / gain)),
            ("dead_band", of(&document, "dead_band").map(|band| band / gain)),
            ("p_max", of(&document, "p_max").map(|most| most / gain)),
        ];
        let taxels = document.entry("taxel").or_insert_with(|| {
            let mut table = Table::new();
            table.set_implicit(true);
            Item::Table(table)
        });
        let Some(taxels) = taxels.as_table_like_mut() else { return Err(Error::failed("`taxel` is not a table")) };
        let taxel = taxels.entry(&id).or_insert_with(|| Item::Table(Table::new()));
        let Some(taxel) = taxel.as_table_like_mut() else {
            return Err(Error::failed(format!("`taxel.{id}` is not a table")));
        };
        for (key, number) in new {
            if let Some(number) = number {
                taxel.insert(key, value(rounded(number)));
            }
        }
    }
    let layer = document.entry("layer").or_insert_with(|| Item::Table(Table::new()));
    let Some(layer) = layer.as_table_like_mut() else { return Err(Error::failed("`layer` is not a table")) };
    layer.insert("sigma_m", value(rounded(estimate.sigma_m)));
    layer.insert("gain_spread", value(rounded(estimate.gain_spread)));
    Ok(document.to_string())
}

/// Five digits: gains are known to a few per cent.
fn rounded(number: f64) -> f64 {
    format!("{number:.4e}").parse().unwrap_or(number)
}

/// The ids of taxels without a gain.
fn untold(ids: &[u32], estimate: &GainsEstimate) -> Vec<u32> {
    ids.iter().zip(&estimate.gains).filter(|(_, gain)| gain.is_none()).map(|(id, _)| *id).collect()
}

/// The root mean square of the gains' logarithms: by what share they differ.
fn spread(estimate: &GainsEstimate) -> f64 {
    let logarithms = || estimate.gains.iter().flatten().map(|gain| gain.ln());
    (logarithms().map(|x| x * x).sum::<f64>() / logarithms().count().max(1) as f64).sqrt()
}

fn table_of(ids: &[u32], estimate: &GainsEstimate, from: &Path) -> String {
    let told = estimate.gains.iter().flatten().count();
    let mut table = plain(["", "found"], 0..0);
    let percent = |share: f64| format!("{:.1} %", 100.0 * share);
    for row in [
        ["touches", &count(estimate.touches as u64, "frame")],
        ["gains", &format!("of {told} of {} taxels; they differ by {}", ids.len(), percent(spread(estimate)))],
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
    let untold = untold(ids, estimate);
    if !untold.is_empty() {
        let listed = untold.iter().take(12).map(ToString::to_string).collect::<Vec<_>>().join(", ");
        let more = if untold.len() > 12 { ", …" } else { "" };
        let what = format!("taxels {listed}{more} were pressed too seldom and keep their gains: touch there, too");
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

#[cfg(test)]
mod tests {
    use super::*;

    fn estimate(gains: &[Option<f64>]) -> GainsEstimate {
        let mut estimate = GainsEstimate::default();
        (estimate.gains, estimate.sigma_m) = (gains.to_vec(), 0.002_345_67);
        estimate
    }

    #[test]
    fn gains_go_into_a_calibration_with_what_is_counted_in_p() {
        let text =
            "# Mine.\n[all]\nbaseline = 12\ndead_band = 3 # counts\ngain = 2\n\n[taxel.7]\ngain = 4.0\np_max = 800\n";
        let written = with(text, &[3, 7, 9], &estimate(&[Some(0.8), Some(1.25), None])).unwrap();
        assert!(written.contains("# Mine.") && written.contains("dead_band = 3 # counts"), "{written}");
        let [before, after] = [text, &written].map(|text| Calibration::parse(text, &[3, 7, 9]).unwrap());
        for (index, factor) in [0.8, 1.25, 1.0].into_iter().enumerate() {
            let [before, after] = [&before, &after].map(|calibration| &calibration.taxels[index]);
            assert!((after.gain * factor / before.gain - 1.0).abs() < 1e-4, "{index}");
            assert!((after.dead_band * factor / before.dead_band - 1.0).abs() < 1e-4, "{index}");
        }
        assert_eq!(after.taxels[1].p_max, 640.0);
        assert_eq!(after.layer.unwrap().sigma_m, 0.002_345_7);
        // Again with other gains: a layer that was there is replaced.
        let again = with(&written, &[3, 7, 9], &estimate(&[None; 3])).unwrap();
        assert_eq!(again, written);
    }

    #[test]
    fn a_stamp_tells_the_layer_apart_from_itself() {
        assert!((layer_under(0.006, 0.005).unwrap() - 0.004).abs() < 1e-12);
        assert!(layer_under(0.02, 0.005).unwrap_err().to_string().contains("is it the radius"));
    }
}
