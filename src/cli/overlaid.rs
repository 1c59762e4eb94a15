//! A calibration that is given, laid over the one that comes with a file.

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

use somatic::signal::LaidOver;
use somatic::{Calibration, Result};

use super::stdio::say;

/// Whether it has been said what stays: a command may need the calibration several times.
static SAID: AtomicBool = AtomicBool::new(false);

/// What becomes of a file's own calibration.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum How {
    /// Keys that are given replace its own, others stay.
    Laid,
    /// Nothing of it stays.
    Replaced,
}

/// The text of the calibration `given`, at `path`, laid over `own`, which comes with `of`. Unless `quiet`, says once what of
/// `own` stays, or that its unit does not.
pub(super) fn overlaid(of: &Path, own: &str, path: &Path, given: &str, how: How, quiet: bool) -> Result<String> {
    let laid = Calibration::lay_over(own, given).map_err(|e| e.at(path.display()))?;
    if !quiet && !SAID.swap(true, Ordering::Relaxed) {
        words(&laid, how).iter().for_each(|what| say(&format!("{}: {what}", of.display())));
    }
    Ok(laid.text)
}

fn words(laid: &LaidOver, how: How) -> Vec<String> {
    if how == How::Replaced {
        let unit = laid.stays.iter().find(|key| key.starts_with("unit = "));
        let what = |key| format!("--calibration replaces its own, with {key}, and names no unit: P is a count");
        return unit.map(what).into_iter().collect();
    }
    let stays = match &laid.stays[..] {
        [] => None,
        stays => Some(format!("of its own calibration, this stays under --calibration: {}", stays.join(", "))),
    };
    let unit =
        laid.replaced_unit.as_ref().map(|[own, given]| format!("--calibration replaces its unit {own} by {given}"));
    stays.into_iter().chain(unit).collect()
}
