//! Ids in words, and what belongs to which.

use crate::body::{Body, Modality};
use crate::error::Error;
use crate::signal::{Calibration, Channel};

/// That a body with the taxels `ids`, ascending, does not have `channel`.
pub(super) fn no_channel(channel: Channel, ids: &[u32]) -> Error {
    let taxel = channel.taxel();
    Error::failed(if ids.binary_search(&taxel).is_ok() {
        format!("taxel {taxel} has one value, and {channel} is given; its modality is not force3")
    } else {
        format!("taxel id {channel} is not in the body, whose ids are {}; is it the right body?", ranges(ids))
    })
}

/// Ascending ids in few words: `0–35, 64–103`.
fn ranges(ids: &[u32]) -> String {
    let mut words: Vec<String> = Vec::new();
    let mut start = 0;
    for end in 1..=ids.len() {
        if end == ids.len() || ids[end] != ids[end - 1] + 1 {
            let (first, last) = (ids[start], ids[end - 1]);
            words.push(if first == last { first.to_string() } else { format!("{first}–{last}") });
            start = end;
        }
    }
    if words.len() > 6 {
        words.truncate(5);
        words.push("…".into());
    }
    words.join(", ")
}

/// `calibration`, whose checks leave out taxels that measure no pressure: what [all] says of raw values is not of theirs.
pub(super) fn checked_by_pressure(body: &Body, mut calibration: Calibration) -> Calibration {
    let others = body.taxels.iter().zip(&mut calibration.taxels).filter(|(taxel, _)| !taxel.modality.is_pressed());
    others.for_each(|(_, own)| own.mask = true);
    calibration
}

/// `calibration` whose codes of temperatures and distances that are no readings are those of their taxels, as what `[all]` and `[taxel.N]`
/// have of them is: all are missing before values are held.
pub(super) fn with_codes_of_senses(body: &Body, mut calibration: Calibration) -> Calibration {
    for (index, taxel) in body.taxels.iter().enumerate() {
        let sense = match taxel.modality {
            Modality::Temperature => &calibration.temperature,
            Modality::Proximity => &calibration.proximity,
            _ => continue,
        };
        let own = sense.of_taxel(index);
        // What a masked taxel reads is faulty, whatever it is.
        if !own.mask && !own.missing.is_empty() {
            calibration.missing.resize(body.taxels.len(), Vec::new());
            calibration.missing[index].extend(&own.missing);
        }
    }
    calibration
}

/// By channel of `body`, the place of its taxel among the body's.
pub(super) fn taxels_of(body: &Body, channels: &[u32]) -> Vec<usize> {
    channels.iter().filter_map(|&channel| body.taxel_index(Channel(channel).taxel())).collect()
}
