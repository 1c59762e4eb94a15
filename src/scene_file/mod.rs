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
pub use self::states::{StatesSpec, bag_of};
pub use self::target::{Target, angle, hertz, length, metres, seconds, time};
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
    /// The robot's body: a .glb or .gltf file, or the bundled hand, sensing-hand, mat or humanoid [default: the source's own, or
    /// hand].
    pub body: Option<String>,

    /// Where touch frames come from, such as csv:FILE, serial:PORT, or - for NDJSON on standard input [default: a
    /// bundled touch].
    ///
    /// Recordings: csv:FILE, ndjson:FILE, mcap:FILE, ros2-mcap:PATH[:/TOPIC,...] for a ROS 2 bag, sim:FILE.toml,
    /// lerobot:DIR[:FEATURE][#EPISODE] for a LeRobot dataset, or a pressure system's export (.csv, .asf, .lst, .asc,
    /// .txt); text also as .gz. Live: one or more serial:PORT[@BAUD], ros2:/TOPIC, or one or more zenoh:KEY for
    /// limbs on other computers. A board that prints numbers: text:PORT[@BAUD], text:tcp://HOST:PORT, text:udp://:PORT or
    /// text:-. A hand with Modbus TCP: modbus://HOST:PORT with `map`. Sensors of PaXini: paxini:PORT. Standard input: -
    /// for NDJSON, csv:- for CSV. Several recordings go into one table with a column `recording`, each from its own beginning.
    #[serde(rename = "source", deserialize_with = "words")]
    #[cfg_attr(feature = "cli", schemars(with = "OneOrMany"))]
    pub sources: Vec<SourceSpec>,

    /// Where percepts go, such as csv:FILE, mcap:FILE, or - for NDJSON on standard output; one or a list [default: a
    /// table at a terminal, else -].
    ///
    /// Files: ndjson:FILE, csv:FILE or parquet:FILE for a table, mcap:FILE, and ros2-mcap:FOLDER for a ROS 2 bag.
    /// Live: ros2[:/NAMESPACE] for its topics, and page[:HOST:PORT] for browsers. To another computer: zenoh:KEY for
    /// the frames of a limb, and zenoh-percepts:KEY for its percepts.
    #[serde(rename = "sink", deserialize_with = "words")]
    #[cfg_attr(feature = "cli", schemars(with = "OneOrMany"))]
    pub sinks: Vec<SinkSpec>,

    /// Compute only the fields whose names match, such as 'hand/palm*' or '**/thumb'; one or a list.
    #[serde(deserialize_with = "words")]
    #[cfg_attr(feature = "cli", schemars(with = "OneOrMany"))]
    pub fields: Vec<String>,

    /// Compute only these quantities of `somatic outputs` [default: touches, and of fields all but motion,
    /// self_contacts, filtered_* and *_sigma; force only if P has a unit].
    #[serde(deserialize_with = "outputs")]
    #[cfg_attr(feature = "cli", schemars(with = "Vec<String>", transform = output_names))]
    pub outputs: Vec<AskedOutputs>,

    /// When touches of the whole body begin and end: `on` and `off`, in the unit of P.
    pub touch: Option<TouchKeys>,

    /// The calibration of the sensors, a TOML file [default: the source's own, if it has one].
    ///
    /// Without one, pressures are raw values.
    pub calibration: Option<PathBuf>,

    /// What computes: auto, reference, cpu or gpu [default: auto].
    ///
    /// The reference has double precision, cpu and gpu have single precision. With auto, the faster of cpu and gpu
    /// computes.
    #[serde(deserialize_with = "word")]
    #[cfg_attr(feature = "cli", schemars(with = "Option<String>", extend("enum" = BackendKind::WORDS)))]
    pub backend: Option<BackendKind>,

    /// Play a recording at this many times its own speed [default: as fast as possible; 1 with a page].
    pub playback_speed: Option<f64>,

    /// Compare every percept with the double-precision reference; exit with 1 if they disagree.
    pub verify: bool,

    /// Replace output files that exist; a file that is read is never replaced.
    pub overwrite: bool,

    /// Compute the fields from pressures (sustained), from their change per second (change), from tangential forces
    /// (shear), temperatures or distances (proximity), or once from each [default: sustained, and letters of other taxels].
    #[serde(deserialize_with = "words")]
    #[cfg_attr(feature = "cli", schemars(with = "OneOrMany"))]
    pub letters: Vec<Receptor>,

    /// Compute from the raw or the linear signal of force-sensing resistors, not the one in the calibration.
    ///
    /// With both, every field is computed once from each.
    #[serde(deserialize_with = "words")]
    #[cfg_attr(feature = "cli", schemars(with = "OneOrMany"))]
    pub signal: Vec<FsrSignal>,

    /// Use the first frame's values as the sensors' baselines.
    ///
    /// Nothing may touch the robot then.
    pub tare: bool,

    /// Frame of positions and normals: the world if frames carry poses, or always the field's anchor [default:
    /// world].
    #[serde(deserialize_with = "word")]
    #[cfg_attr(feature = "cli", schemars(with = "Option<String>", extend("enum" = Coordinates::WORDS)))]
    pub coordinates: Option<Coordinates>,

    /// Put positions, normals and self-contacts into the frame of this link instead of the world, if frames carry
    /// poses.
    pub relative_to: Option<String>,

    /// How far apart the places of two touches in self-contact may be, in metres [default: by the taxels' spacing].
    pub contact_tolerance_m: Option<f64>,

    /// The longest time between two frames over which motion is measured, in seconds [default: 10].
    pub max_gap_s: Option<f64>,

    /// How far a centroid must move to count in filtered_* outputs, such as 0.5mm..20mm [default: 1/16 and 3 times
    /// the spacing of the field's taxels].
    ///
    /// The upper end is how far it moves at most within one touch. Either end may be left out.
    #[serde(deserialize_with = "window")]
    pub filter_window: Option<String>,

    /// What `filter_window` measures: distance or radial [default: distance].
    ///
    /// With distance, how far the centroid moves. With radial, how much its distance from the chart's origin changes,
    /// as in the paper.
    #[serde(deserialize_with = "word")]
    #[cfg_attr(feature = "cli", schemars(with = "Option<String>", extend("enum" = ["distance", "radial"])))]
    pub filter_by: Option<FilterBy>,

    /// Time constant of filtered_direction, in seconds; 0 follows at once [default: 0.1].
    pub filter_time_s: Option<f64>,

    /// Measure the filtered_* outputs over this time, in seconds [default: 0.2, unless `filter_window` has a lower end].
    ///
    /// Motion is measured from where the centroid was that long ago; the upper end of `filter_window` still counts.
    /// With 0.2 it is steady even if few sensors feel a touch.
    pub filter_over_s: Option<f64>,

    /// Play a recording from this time after its start, in seconds [default: 0].
    pub from_s: Option<f64>,

    /// Play a recording up to this time after its start, in seconds [default: its end].
    pub to_s: Option<f64>,

    /// Play a recording this many times, or with 0 until interrupted; its time goes on.
    #[serde(rename = "loop")]
    pub repeat: Option<u64>,

    /// Frames per second of a recording without times, in Hz.
    pub rate_hz: Option<f64>,

    /// Read the source as the export of a pressure system [default: as its content says].
    ///
    /// One of xsensor, tekscan, emed, pliance, pedar, loadsol, footscan, stappone, or matrix for plain numbers.
    #[serde(deserialize_with = "word")]
    #[cfg_attr(feature = "cli", schemars(with = "Option<String>", extend("enum" = VendorFormat::WORDS)))]
    pub format: Option<VendorFormat>,

    /// Rows and columns of a frame of plain numbers, such as 31x11.
    pub grid: Option<String>,

    /// Distance between rows and columns of plain numbers, such as 8.6mm, or 8.6mm,5mm for rows and columns.
    pub pitch: Option<String>,

    /// The unit of an export's values, if it has none: kPa, mmHg, N/cm2, psi, N, and others.
    pub unit: Option<String>,

    /// Where the sensors of pedar's insoles are: a CSV with the columns id, x, y and area.
    ///
    /// It is in metres and square metres. The exports of pedar do not have it.
    pub layout: Option<PathBuf>,

    /// What mcap:FILE holds: raw frames (frames), percepts, and what viewers show (view) [default: all].
    #[serde(deserialize_with = "words")]
    #[cfg_attr(feature = "cli", schemars(with = "OneOrMany"))]
    pub record: Vec<RecordPart>,

    /// How long a taxel that frames leave out keeps its value, in seconds [default: 0; for boards three of their
    /// frames, at least 0.05].
    ///
    /// After that it counts as missing.
    pub max_age_s: Option<f64>,

    /// Fail at the first taxel on standard input that the body does not have [default: leave its values out and exit
    /// with 3].
    pub strict: bool,

    /// Skip lines, rows and messages that are wrong, count them by kind, and exit with 3 [default: fail at the first].
    ///
    /// For CSV, NDJSON, exports with a line for each frame, ROS 2 bags, and joint states; `text:` does so always.
    pub skip_bad: bool,

    /// The board and the channel of each taxel, a TOML file [default: taxels in ascending order of their ids].
    ///
    /// By default the boards, one per port, share the taxels. `somatic board --help` shows such a file.
    pub wiring: Option<PathBuf>,

    /// Merge the boards' frames at this rate, in Hz [default: one for each frame of the fastest board].
    ///
    /// With 0 there is one for each frame of any board.
    pub live_rate_hz: Option<f64>,

    /// Make the boards send frames at this rate, in Hz [default: leave them as they are].
    ///
    /// With 0 they send as fast as the line allows.
    pub board_rate_hz: Option<f64>,

    /// The form of the lines of `text:`, if it is not to be found out.
    #[cfg_attr(
        feature = "cli",
        schemars(description = "The form of the lines of `text:`, if it is not to be found out.")
    )]
    pub text: TextKeys,

    /// Which arrays of messages are sensors: a TOML file, or contactile, dex3, inspire, mujoco, paxini, tactile-state,
    /// xela or xela-ros2.
    ///
    /// For ROS 2 bags and topics with messages of any type, NDJSON, lines of JSON, Modbus and PaXini. All of them but tactile-state and
    /// mujoco are untested.
    pub map: Option<String>,

    /// Zenoh's own configuration, JSON5, for zenoh: sources and sinks [default: this computer alone, on port 7447].
    pub zenoh_config: Option<PathBuf>,

    /// The robot's URDF, with which joint states give the poses of links.
    ///
    /// Joint states come in the frames, or from `joint_states`.
    pub joints: Option<PathBuf>,

    /// A recording of joint states, or ros2:/TOPIC, live [default: those in the frames, or in their bag].
    ///
    /// A recording is a CSV under t,<joint>,..., NDJSON, or a ROS 2 bag: a .mcap, a .db3, a folder, or
    /// ros2-mcap:PATH:/TOPIC.
    pub joint_states: Option<PathBuf>,

    /// A ROS 2 bag with poses of links: its /tf, /tf_static and odometry, or ros2-mcap:PATH:/TOPIC,...
    ///
    /// Links are matched by name. The root of the transforms is the world. With `joints`, they are where the robot is.
    pub poses: Option<PathBuf>,

    /// The URDF's axis that points up: z, or y if its axes are glTF's [default: the axis used for the body, else z].
    #[serde(deserialize_with = "word")]
    #[cfg_attr(feature = "cli", schemars(with = "Option<String>", extend("enum" = Up::WORDS)))]
    pub up: Option<Up>,

    /// How much later the clock of `joint_states` stamps an instant than the frames' clock, in seconds [default: 0].
    ///
    /// With "auto" it is estimated, for frames and states from one ROS 2 bag.
    #[cfg_attr(
        feature = "cli",
        schemars(with = "Option<f64>", extend("type" = ["number", "string", "null"], "pattern" = "^auto$"))
    )]
    pub joints_delay_s: Option<JointsDelay>,

    /// The age of a joint's last state from which positions stay in links, in seconds [default: 0.1].
    ///
    /// They have the flag stale_pose then.
    pub joints_max_age_s: Option<f64>,

    /// The times of ROS messages: recording or wall [default: recording].
    ///
    /// With recording, they are the frames' times. With wall, they begin at this computer's time when the first frame
    /// comes, and go on as the frames do.
    #[serde(deserialize_with = "word")]
    #[cfg_attr(feature = "cli", schemars(with = "Option<String>", extend("enum" = RosTime::WORDS)))]
    pub ros_time: Option<RosTime>,

    /// Tolerances and a time budget, for which a measurement chooses the options, or these options themselves.
    #[cfg_attr(
        feature = "cli",
        schemars(
            description = "Tolerances and a time budget, for which a measurement chooses the options, or these options \
                           themselves."
        )
    )]
    pub accuracy: Accuracy,

    /// Compute at most this many frames in one call [default: 256 for recordings, 1 live].
    ///
    /// More is faster, fewer is sooner.
    #[serde(deserialize_with = "batch")]
    #[cfg_attr(feature = "cli", schemars(range(min = 1, max = 65536)))]
    pub batch: Option<u32>,

    /// Let browsers reach the page by this host name too; one or a list.
    ///
    /// Without one, the page is for this machine alone.
    #[serde(rename = "allow_host", deserialize_with = "words")]
    #[cfg_attr(feature = "cli", schemars(with = "OneOrMany"))]
    pub allow_hosts: Vec<String>,

    /// Begin NDJSON with a line that has units and body.
    pub header: bool,

    /// Write fields without contact, too.
    pub all_fields: bool,

    /// Show no table, progress or remarks.
    pub quiet: bool,
}

impl SceneFile {
    /// What the scene file at `path` asks for, its paths made relative to where we are. What does not go together is found by
    /// [`SceneFile::check`], as more may be laid over it before.
    ///
    /// # Errors
    /// It cannot be read; a usage error with line and column if it is not a scene.
    pub fn load(path: &Path) -> Result<Self> {
        let text = limits::read_to_string(path, MAX_TOML_BYTES).map_err(|e| Error::io(path, &e))?;
        let scene = Self::parse(&text).map_err(|e| e.at(path.display()))?;
        Ok(scene.within(path.parent().unwrap_or(Path::new(""))))
    }

    /// What the scene file `text` asks for, its paths as they are written.
    ///
    /// # Errors
    /// A usage error with line and column if it is not a scene.
    pub fn parse(text: &str) -> Result<Self> {
        let scene: Self = parse_toml(text).map_err(Error::into_usage)?;
        scene.check_accuracy().map_err(|(key, e)| Accuracy::placed(text, key, e))?;
        Ok(scene)
    }
}
