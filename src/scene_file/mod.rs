//! Scene files: all that a run is asked to do, as a person writes it down.

mod accuracy;
mod asked;
mod check;
mod deserialize;
mod joints;
mod joints_delay;
mod lines;
mod states;
mod target;
mod text;
mod touches;
mod within;

use std::path::{Path, PathBuf};

#[cfg(feature = "cli")]
use schemars::JsonSchema;
use serde::Deserialize;

pub use self::accuracy::Accuracy;
#[cfg(feature = "cli")]
use self::deserialize::{OneOrMany, output_names};
use self::deserialize::{batch, outputs, window, word, words};
pub use self::joints_delay::JointsDelay;
pub use self::lines::LineKeys;
pub use self::states::StatesSpec;
pub use self::target::{Target, angle, length, time};
pub use self::text::TextKeys;
pub use self::touches::TouchKeys;
use crate::backend::BackendKind;
use crate::body::Up;
use crate::error::{Error, Result, parse_toml};
use crate::limits::{self, MAX_TOML_BYTES};
use crate::scene::{AskedOutputs, Coordinates, FilterBy};
use crate::signal::{FsrSignal, Receptor};
use crate::sink::{RecordPart, RosTime, SinkSpec};
use crate::source::{SourceSpec, VendorFormat};

/// What a run is asked to do: each field is a key of a scene file, and units are in their names.
///
/// Paths in a file are relative to its folder; [`SceneFile::load`] makes them relative to where we are.
#[derive(Clone, Debug, Default, Deserialize, PartialEq)]
#[serde(default, deny_unknown_fields)]
#[cfg_attr(feature = "cli", derive(JsonSchema))]
#[cfg_attr(feature = "cli", schemars(title = "somatic scene", description = "What `somatic run SCENE` is asked to do"))]
#[allow(
    rustdoc::broken_intra_doc_links,
    rustdoc::invalid_html_tags,
    reason = "the documentation of keys is the schema's too, and shows what is left out in brackets"
)]
#[non_exhaustive]
pub struct SceneFile {
    /// The robot's body: a .glb or .gltf file, or the bundled hand, mat or humanoid [default: the source's own, or
    /// hand].
    pub body: Option<String>,

    /// Where touch frames come from: csv:FILE, mcap:FILE, ros2-mcap:PATH[:/TOPIC,...] for a bag of ROS 2, sim:FILE.toml, a pressure system's export (.csv, .asf, .lst,
    /// .asc, .txt), one or more serial:PORT[@BAUD], text:PORT[@BAUD] (also text:tcp://HOST:PORT, text:udp://:PORT, text:-) for a board that prints numbers, ros2:/TOPIC, one or more zenoh:KEY for limbs on other computers, or from standard input - for NDJSON and csv:- for CSV [default: a bundled touch].
    #[serde(rename = "source", deserialize_with = "words")]
    #[cfg_attr(feature = "cli", schemars(with = "OneOrMany"))]
    pub sources: Vec<SourceSpec>,

    /// Where percepts go: ndjson:FILE, csv:FILE or parquet:FILE for a table, mcap:FILE, ros2-mcap:FOLDER for a bag of ROS 2, ros2[:/NAMESPACE] for its topics, page[:HOST:PORT] for browsers, zenoh:KEY or zenoh-percepts:KEY to send frames or percepts of a limb to another computer, or -
    /// for NDJSON on standard output; one or a list [default: a table at a terminal, else -].
    #[serde(rename = "sink", deserialize_with = "words")]
    #[cfg_attr(feature = "cli", schemars(with = "OneOrMany"))]
    pub sinks: Vec<SinkSpec>,

    /// Compute only the fields whose names match, such as 'hand/palm*' or '**/thumb'; one or a list.
    #[serde(deserialize_with = "words")]
    #[cfg_attr(feature = "cli", schemars(with = "OneOrMany"))]
    pub fields: Vec<String>,

    /// Compute only these quantities [default: all but touches, self_contacts, speed_in_world, filtered_* and *_sigma;
    /// force only where P has a unit].
    #[serde(deserialize_with = "outputs")]
    #[cfg_attr(feature = "cli", schemars(with = "Vec<String>", transform = output_names))]
    pub outputs: Vec<AskedOutputs>,

    /// When touches of the whole body begin and end: `on` and `off`, in the unit of P.
    pub touch: Option<TouchKeys>,

    /// The calibration of the sensors, a TOML file; without one, pressures are raw values [default: the source's own,
    /// if it has one].
    pub calibration: Option<PathBuf>,

    /// What computes: reference in double precision, cpu or gpu in single precision, or auto, the faster of cpu and gpu
    /// [default: auto].
    #[serde(deserialize_with = "word")]
    #[cfg_attr(feature = "cli", schemars(with = "Option<String>", extend("enum" = BackendKind::WORDS)))]
    pub backend: Option<BackendKind>,

    /// Play a recording at this many times its own speed [default: as fast as possible; 1 with a page].
    pub playback_speed: Option<f64>,

    /// Compare every percept with the double-precision reference; exit with 1 where they disagree.
    pub verify: bool,

    /// Replace output files that exist; a file that is read is never replaced.
    pub overwrite: bool,

    /// Compute the fields from pressures (sustained), from their change per second (change), or once from each [default:
    /// sustained].
    #[serde(deserialize_with = "words")]
    #[cfg_attr(feature = "cli", schemars(with = "OneOrMany"))]
    pub letters: Vec<Receptor>,

    /// Compute from the raw or linear signal of force-sensing resistors, not the one in the calibration; with both,
    /// every field is computed once from each.
    #[serde(deserialize_with = "words")]
    #[cfg_attr(feature = "cli", schemars(with = "OneOrMany"))]
    pub signal: Vec<FsrSignal>,

    /// Take the first frame's values as the sensors' baselines; nothing may touch the robot then.
    pub tare: bool,

    /// Frame of positions and normals: the world where frames carry poses, or always the field's anchor [default:
    /// world].
    #[serde(deserialize_with = "word")]
    #[cfg_attr(feature = "cli", schemars(with = "Option<String>", extend("enum" = Coordinates::WORDS)))]
    pub coordinates: Option<Coordinates>,

    /// Put positions, normals and self-contacts into the frame of this link instead of the world, where frames carry poses.
    pub relative_to: Option<String>,

    /// How far the places of two touches may be apart that are one contact, in metres [default: by the taxels' spacing].
    pub contact_tolerance_m: Option<f64>,

    /// The longest time between two frames over which motion is measured, in seconds [default: 10].
    pub max_gap_s: Option<f64>,

    /// How far a centroid must move until the filtered_* outputs count it, and how far it moves at most within one
    /// touch, such as 0.5mm..20mm; either end may be left out [default: 1/16 and 3 times the spacing of the field's
    /// taxels].
    #[serde(deserialize_with = "window")]
    pub filter_window: Option<String>,

    /// What `filter_window` measures: how far the centroid moves (distance), or how much its distance from the chart's
    /// origin changes, as in the paper (radial) [default: distance].
    #[serde(deserialize_with = "word")]
    #[cfg_attr(feature = "cli", schemars(with = "Option<String>", extend("enum" = ["distance", "radial"])))]
    pub filter_by: Option<FilterBy>,

    /// Time constant of filtered_direction, in seconds; 0 follows at once [default: 0.1].
    pub filter_time_s: Option<f64>,

    /// Measure the filtered_* outputs over this time, in seconds, from where the centroid was that long ago, instead of by
    /// `filter_window`, of which the high end still counts. 0.2 is steady where few sensors feel a touch.
    pub filter_over_s: Option<f64>,

    /// Play a recording from this time after its start, in seconds [default: 0].
    pub from_s: Option<f64>,

    /// Play a recording up to this time after its start, in seconds [default: its end].
    pub to_s: Option<f64>,

    /// Play a recording this many times, or with 0 until interrupted; its time goes on.
    #[serde(rename = "loop")]
    pub repeat: Option<u64>,

    /// Frames per second of a recording that has no times, in Hz.
    pub rate_hz: Option<f64>,

    /// Read the source as a pressure system's export: xsensor, tekscan, emed, pliance, pedar, or matrix for plain numbers
    /// [default: as its content says].
    #[serde(deserialize_with = "word")]
    #[cfg_attr(feature = "cli", schemars(with = "Option<String>", extend("enum" = VendorFormat::WORDS)))]
    pub format: Option<VendorFormat>,

    /// Rows and columns of a frame of plain numbers, such as 31x11.
    pub grid: Option<String>,

    /// From one row and column of them to the next, such as 8.6mm, or 8.6mm,5mm for rows and columns.
    pub pitch: Option<String>,

    /// The unit of an export's values where it does not say it: kPa, mmHg, N/cm2, psi, N, and others.
    pub unit: Option<String>,

    /// Where the sensors of pedar's insoles are, which its files do not say: a CSV with the columns id, x, y and area, in
    /// metres and square metres.
    pub layout: Option<PathBuf>,

    /// What mcap:FILE holds: raw frames (frames), percepts, and what viewers show (view) [default: all].
    #[serde(deserialize_with = "words")]
    #[cfg_attr(feature = "cli", schemars(with = "OneOrMany"))]
    pub record: Vec<RecordPart>,

    /// How long a taxel that frames leave out keeps its value, in seconds; after that it counts as missing [default: 0;
    /// for boards three of their frames, and at least 0.05].
    pub max_age_s: Option<f64>,

    /// Fail at the first taxel on standard input that the body does not have [default: leave its values out and exit
    /// with 3].
    pub strict: bool,

    /// Which taxel is on which channel of which board, a TOML file as `somatic board --help` shows [default: the boards, one per port,
    /// share the taxels in ascending order of their ids].
    pub wiring: Option<PathBuf>,

    /// Merge the boards' frames at this rate, in Hz; 0 gives one for each frame of any board [default: one for each
    /// frame of the fastest board].
    pub live_rate_hz: Option<f64>,

    /// Tell the boards to send frames at this rate, in Hz; 0 is as fast as the line allows [default: leave them as they
    /// are].
    pub board_rate_hz: Option<f64>,

    /// How lines of `text:` are written, where that is not to be found out.
    #[cfg_attr(
        feature = "cli",
        schemars(description = "How lines of `text:` are written, where that is not to be found out.")
    )]
    pub text: TextKeys,

    /// Zenoh's own configuration, JSON5, for zenoh: sources and sinks [default: this computer alone, on port 7447].
    pub zenoh_config: Option<PathBuf>,

    /// The robot's URDF: joint states, which frames carry or `joint_states` has, say where links are.
    pub joints: Option<PathBuf>,

    /// Joint states in a recording of their own: a CSV under t,<joint>,..., NDJSON, a bag of ROS 2 in MCAP (a .mcap, a folder, or
    /// ros2-mcap:PATH:/TOPIC), or ros2:/TOPIC, live [default: those in the frames, or in their bag].
    pub joint_states: Option<PathBuf>,

    /// The axis that points up in the URDF: z, or y where its axes are glTF's [default: what the body was made with, else z].
    #[serde(deserialize_with = "word")]
    #[cfg_attr(feature = "cli", schemars(with = "Option<String>", extend("enum" = Up::WORDS)))]
    pub up: Option<Up>,

    /// How much later the clock of `joint_states` stamps an instant than that of the frames, in seconds; auto estimates it
    /// for frames and states from one bag of ROS 2 [default: 0].
    #[cfg_attr(
        feature = "cli",
        schemars(with = "Option<f64>", extend("type" = ["number", "string", "null"], "pattern" = "^auto$"))
    )]
    pub joints_delay_s: Option<JointsDelay>,

    /// The age of a joint's last state from which on positions stay in links, flagged stale_pose, in seconds [default:
    /// 0.1].
    pub joints_max_age_s: Option<f64>,

    /// The times of ROS messages: those of the frames (recording), or this computer's when the first frame comes and as the
    /// frames go on (wall) [default: recording].
    #[serde(deserialize_with = "word")]
    #[cfg_attr(feature = "cli", schemars(with = "Option<String>", extend("enum" = RosTime::WORDS)))]
    pub ros_time: Option<RosTime>,

    /// How far percepts may be off and how long a frame may take, or the knobs themselves.
    #[cfg_attr(
        feature = "cli",
        schemars(description = "How far percepts may be off and how long a frame may take, or the knobs themselves.")
    )]
    pub accuracy: Accuracy,

    /// Compute at most this many frames in one call: more is faster, fewer is sooner [default: 256 for recordings, 1
    /// live].
    #[serde(deserialize_with = "batch")]
    #[cfg_attr(feature = "cli", schemars(range(min = 1, max = 65536)))]
    pub batch: Option<u32>,

    /// Let browsers reach the page by this host name too; without one it is for this machine alone. One or a list.
    #[serde(rename = "allow_host", deserialize_with = "words")]
    #[cfg_attr(feature = "cli", schemars(with = "OneOrMany"))]
    pub allow_hosts: Vec<String>,

    /// Begin NDJSON with a line that says units and body.
    pub header: bool,

    /// Write fields without contact too.
    pub all_fields: bool,

    /// Show no table, progress or remarks.
    pub quiet: bool,
}

impl SceneFile {
    /// What the scene file at `path` asks for, its paths made relative to where we are. What does not go together is found by
    /// [`SceneFile::check`], as more may be laid over it before.
    ///
    /// # Errors
    /// It cannot be read; a usage error with line and column if it is no scene.
    pub fn load(path: &Path) -> Result<Self> {
        let text = limits::read_to_string(path, MAX_TOML_BYTES).map_err(|e| Error::io(path, &e))?;
        let scene = Self::parse(&text).map_err(|e| e.at(path.display()))?;
        Ok(scene.within(path.parent().unwrap_or(Path::new(""))))
    }

    /// What the scene file `text` asks for, its paths as they are written.
    ///
    /// # Errors
    /// A usage error with line and column if it is no scene.
    pub fn parse(text: &str) -> Result<Self> {
        let scene: Self = parse_toml(text).map_err(Error::into_usage)?;
        scene.check_accuracy().map_err(|(key, e)| Accuracy::placed(text, key, e))?;
        Ok(scene)
    }
}
