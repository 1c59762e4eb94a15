//! A calibration that is given, laid over the one that comes with a file.

use std::path::Path;

use super::Tell;
use crate::body::{Body, Modality};
use crate::error::Result;
use crate::signal::{Calibration, LaidOver};

/// What becomes of a file's own calibration.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum How {
    /// Keys that are given replace its own, others stay.
    Laid,
    /// Nothing of it stays.
    Replaced,
}

/// The text of the calibration `given`, at a path, laid over `own`, which comes with a file, for `taxels`, ids and what they measure,
/// ascending. Tells once what of `own` stays, or that its unit does not.
pub fn overlaid(
    (of, own): (&Path, &str),
    (path, given): (&Path, &str),
    taxels: &[(u32, Modality)],
    how: How,
    tell: &Tell,
) -> Result<String> {
    let laid = Calibration::lay_over_for(own, given, taxels).map_err(|e| e.at(path.display()))?;
    words(&laid, how).iter().for_each(|what| tell.once(&format!("{}: {what}", of.display())));
    Ok(laid.text)
}

/// The taxels of `body`, ids and what they measure, ascending.
pub fn kinds_in(body: &Body) -> Vec<(u32, Modality)> {
    body.taxels.iter().map(|taxel| (taxel.id, taxel.modality)).collect()
}

fn words(laid: &LaidOver, how: How) -> Vec<String> {
    if how == How::Replaced {
        let unit = laid.stays.iter().find(|key| key.starts_with("unit = "));
        let what = |key| format!("`calibration` replaces its own, with {key}, and names no unit: P is a count");
        return unit.map(what).into_iter().collect();
    }
    let stays = match &laid.stays[..] {
        [] => None,
        stays => Some(format!("of its own calibration, this stays under `calibration`: {}", stays.join(", "))),
    };
    let unit =
        laid.replaced_unit.as_ref().map(|[own, given]| format!("`calibration` replaces its unit {own} by {given}"));
    stays.into_iter().chain(unit).collect()
}
