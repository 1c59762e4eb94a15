//! Recordings in MCAP: frames bit for bit as they came, percepts, and what viewers show, with body and calibration beside.
//!
//! `docs/reference/recordings.md` describes topics and schemas. This is the only user of the crate `mcap`, which writes; files are
//! read record by record here, so that a damaged one gives what is whole in it and memory stays bounded.

#![deny(missing_docs)]
#![warn(unreachable_pub)]

mod account;
mod bag;
mod bag_files;
mod bag_reader;
mod bag_survey;
mod chunks;
mod entries;
mod frames;
#[cfg(test)]
pub(crate) mod harm;
mod head;
mod percepts;
mod proto;
mod reader;
mod recorder;
mod records;
mod schemas;
#[cfg(feature = "sqlite")]
mod sqlite;
mod storage;
mod stored;
mod summary;
mod survey;
mod unpack;
mod view;
mod yaml_list;

use somatic_skin::signal::Channel;
use somatic_skin::{body, error, limits, output, plain, signal};

pub use self::bag::{BAG_METADATA, BagTopic, BagType, BagWriter};
pub use self::bag_reader::{BagMessage, BagReader, DefinedTopic, WantedTopics, topics_of_bag};
pub use self::bag_survey::{BagSurvey, SurveyedTopic};
pub use self::entries::Attached;
pub use self::reader::Reader;
pub use self::recorder::Recorder;
pub use self::survey::{Rhythm, Survey, Topic};
pub use self::view::{Cloud, Scene, ShownTouch, Transforms, scalars, surface};

/// The topic of the frames.
pub const FRAMES: &str = "/somatic/frames";
/// The topic of the percepts.
pub const PERCEPTS: &str = "/somatic/percepts";
/// The topic of the taxels as points with their pressures.
pub const TAXELS: &str = "/somatic/taxels";
/// The topic of the touches as ellipsoids and arrows.
pub const TOUCHES: &str = "/somatic/touches";
/// The topic of where links are.
pub const LINKS: &str = "/somatic/links";

/// The topic of the body's surface.
pub const SURFACE: &str = "/somatic/body";
/// What the topics of top fields begin with; the field's name follows.
pub const FIELDS: &str = "/somatic/fields/";

/// Media type of the attached body.
pub const BODY: &str = "model/gltf-binary";
/// Name of the attached calibration.
pub const CALIBRATION: &str = "calibration.toml";
/// Name of the attached scene.
pub const SCENE: &str = "scene.toml";

/// The name of the metadata that every recording begins with, and what they tell.
const METADATA: &str = "somatic";
const TAXEL_IDS: &str = "taxels";
const FRAMES_CHANNEL: &str = "frames_channel";
/// The world that poses are in; without it, that of older versions, which had glTF's axes.
const WORLD: &str = "world";
const Z_UP: &str = "z up, x forward, y left";

/// A time as MCAP has it, ns from 0; what is before 0 is at 0, and frames have theirs to the last bit.
pub fn nanoseconds(t_s: f64) -> u64 {
    // Seconds and the rest by themselves: their product would lose digits that clocks since 1970 have.
    let whole = t_s.floor().clamp(0.0, 1.8e10);
    let rest = ((t_s - whole) * 1e9).round().clamp(0.0, 1e9);
    whole as u64 * 1_000_000_000 + rest as u64
}

/// Channels in few characters, in their order: `0-35,64-103`, of taxels with three axes also `64.u-103.u`.
fn words_of(ids: &[u32]) -> String {
    let runs = ids.chunk_by(|a, b| a.checked_add(1) == Some(*b) && Channel(*a).axis() == Channel(*b).axis());
    let word = |run: &[u32]| match run {
        [one] => Channel(*one).to_string(),
        run => format!("{}-{}", Channel(run[0]), Channel(run[run.len() - 1])),
    };
    runs.map(word).collect::<Vec<_>>().join(",")
}

/// The channels that [`words_of`] wrote; `None` where it did not, or where there are more than a body can have.
fn ids_of(words: &str) -> Option<Vec<u32>> {
    let mut ids = Vec::new();
    for word in words.split(',').filter(|word| !word.is_empty()) {
        let (first, last) = word.split_once('-').unwrap_or((word, word));
        let run = Channel::run(first, last)?;
        let last = Channel(*run.end());
        if last.taxel() > body::MAX_TAXEL_ID
            || (last.0 - run.start()) as usize + ids.len() > body::MAX_TAXEL_ID as usize
        {
            return None;
        }
        ids.extend(run);
    }
    Some(ids)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::signal::Axis;

    #[test]
    fn ids_come_back_from_their_words() {
        let tangential = |taxel| [Axis::U, Axis::V].map(|axis| Channel::of_taxel(taxel, axis).0);
        let ([four_u, four_v], [five_u, _]) = (tangential(4), tangential(5));
        for ids in [vec![], vec![7], vec![0, 1, 2, 5, 9, 10], vec![3, 2, 1, 1, 2], vec![4, four_u, four_v, 5, five_u]] {
            assert_eq!(ids_of(&words_of(&ids)), Some(ids));
        }
        assert_eq!(words_of(&[0, 1, 2, 5]), "0-2,5");
        assert_eq!(words_of(&[4, 5, four_u, five_u, four_v]), "4-5,4.u-5.u,4.v");
        let last = tangential(body::MAX_TAXEL_ID)[0];
        assert_eq!(ids_of(&words_of(&[last, four_v])), Some(vec![last, four_v]));
        for odd in ["a", "5-3", "1-", "0-4294967295", "-4", "4.u-5", "4.w", "16777217"] {
            assert_eq!(ids_of(odd), None, "{odd}");
        }
    }

    #[test]
    fn a_time_is_to_the_nanosecond_whatever_its_size() {
        assert_eq!([0.0, 1.5, -3.0, 0.1].map(nanoseconds), [0, 1_500_000_000, 0, 100_000_000]);
        assert_eq!(nanoseconds(1_800_000_000.25), 1_800_000_000_250_000_000);
    }
}
