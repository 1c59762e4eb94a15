//! The flags of `somatic run` and those like it, each for a key of scene files.

use std::path::PathBuf;

use clap::Args;
use somatic::internal::author::mesh::Up;
use somatic::internal::scene::AskedOutputs;
use somatic::internal::scene_file::Target;
use somatic::internal::scene_file::{hertz, metres, seconds, time};
use somatic::internal::sink::RecordPart;
use somatic::scene::file::{Accuracy, JointsDelay, SceneFile};
use somatic::scene::{Arithmetic, Cadence, Charts, Coordinates, Coverage, FilterBy, OrientationBy};
use somatic::signal::{FsrSignal, Receptor};
use somatic::sink::RosTime;
use somatic::source::VendorFormat;
use somatic::{BackendKind, Result};

use super::flags::{ACCURACY, COMPUTED, LIVE, OUTPUT, RECORDINGS, ROBOT, letter, one_of};
use super::outputs::outputs_help;
use crate::cli::text_flags::TextFlags;

/// The flags of `somatic run`. Each has the name of its key in a scene file, with `_` for `-` and the unit at the end. Messages
/// find it by that name. The keys of `--force` and `--speed` are `overwrite` and `playback_speed`. Flags override keys.
#[derive(Args, Clone, Debug, Default)]
pub(in crate::cli) struct RunFlags {
    /// The robot's body: a .glb or .gltf file, or the bundled hand, sensing-hand, mat or humanoid [default: the source's own, or
    /// hand].
    #[arg(long, value_name = "BODY")]
    pub(in crate::cli) body: Option<String>,

    /// Where touch frames come from, such as csv:FILE, serial:PORT, or - for NDJSON on standard input [default: a
    /// bundled touch].
    ///
    /// Recordings: csv:FILE, ndjson:FILE, mcap:FILE, ros2-mcap:PATH[:/TOPIC,...] for a ROS 2 bag, sim:FILE.toml,
    /// lerobot:DIR[:FEATURE][#EPISODE] for a LeRobot dataset, or a pressure system's export (.csv, .asf, .lst, .asc,
    /// .txt); text also as .gz. Live: one or more serial:PORT[@BAUD], ros2:/TOPIC, or one or more zenoh:KEY for
    /// limbs on other computers. A board that prints numbers: text:PORT[@BAUD], text:tcp://HOST:PORT, text:udp://:PORT or
    /// text:-. A hand with Modbus TCP: modbus://HOST:PORT with --map. Sensors of PaXini: paxini:PORT. Standard input: -
    /// for NDJSON, csv:- for CSV. Several recordings go into one table with a column `recording`, each from its own beginning.
    #[arg(id = "source", long = "source", value_name = "SOURCE")]
    pub(in crate::cli) sources: Vec<String>,

    /// Where percepts go, such as csv:FILE, mcap:FILE, or - for NDJSON on standard output; may be repeated [default:
    /// a table at a terminal, else -].
    ///
    /// Files: ndjson:FILE, csv:FILE or parquet:FILE for a table, mcap:FILE, and ros2-mcap:FOLDER for a ROS 2 bag.
    /// Live: ros2[:/NAMESPACE] for its topics, and page[:HOST:PORT] for browsers. To another computer: zenoh:KEY for
    /// the frames of a limb, and zenoh-percepts:KEY for its percepts.
    #[arg(id = "sink", long = "sink", value_name = "SINK")]
    pub(in crate::cli) sinks: Vec<String>,

    /// Compute only the fields whose names match, such as 'hand/palm*' or '**/thumb'; may be repeated.
    #[arg(long, value_name = "GLOB")]
    pub(in crate::cli) fields: Vec<String>,

    /// Compute only these quantities of `somatic outputs` [default: touches, and of fields all but motion,
    /// self_contacts, filtered_* and *_sigma; force only if P has a unit].
    #[arg(long, value_name = "OUTPUT,...", value_delimiter = ',', long_help = outputs_help())]
    pub(in crate::cli) outputs: Vec<AskedOutputs>,

    /// The calibration of the sensors, a TOML file [default: the source's own, if it has one].
    ///
    /// Without one, pressures are raw values.
    #[arg(long, value_name = "FILE")]
    pub(in crate::cli) calibration: Option<PathBuf>,

    /// What computes: auto, reference, cpu or gpu [default: auto].
    ///
    /// The reference has double precision, cpu and gpu have single precision. With auto, the faster of cpu and gpu
    /// computes.
    #[arg(long, value_parser = one_of::<BackendKind>(BackendKind::WORDS))]
    pub(in crate::cli) backend: Option<BackendKind>,

    /// Play a recording at this many times its own speed [default: as fast as possible; 1 with a page].
    #[arg(long = "speed", value_name = "X")]
    pub(in crate::cli) playback_speed: Option<f64>,

    /// Compare every percept with the double-precision reference; exit with 1 if they disagree.
    #[arg(long)]
    pub(in crate::cli) verify: bool,

    /// Replace output files that exist; a file that is read is never replaced.
    #[arg(long = "force")]
    pub(in crate::cli) overwrite: bool,

    /// Compute the fields from pressures (sustained), from their change per second (change), from tangential forces
    /// (shear), temperatures or distances (proximity), or once from each [default: sustained, and letters of other taxels].
    #[arg(long, help_heading = COMPUTED, value_name = "LETTER,...", value_delimiter = ',',
        value_parser = letter())]
    pub(in crate::cli) letters: Vec<Receptor>,

    /// Compute from the raw or the linear signal of force-sensing resistors, not the one in the calibration.
    ///
    /// With both, every field is computed once from each.
    #[arg(long, help_heading = COMPUTED, value_name = "SIGNAL,...", value_delimiter = ',',
        value_parser = one_of::<FsrSignal>(&["raw", "linear"]))]
    pub(in crate::cli) signal: Vec<FsrSignal>,

    /// Use the first frame's values as the sensors' baselines.
    ///
    /// Nothing may touch the robot then.
    #[arg(long, help_heading = COMPUTED)]
    pub(in crate::cli) tare: bool,

    /// Frame of positions and normals: the world if frames carry poses, or always the field's anchor [default:
    /// world].
    #[arg(long, help_heading = COMPUTED, value_name = "FRAME",
        value_parser = one_of::<Coordinates>(Coordinates::WORDS))]
    pub(in crate::cli) coordinates: Option<Coordinates>,

    /// Put positions, normals and self-contacts into the frame of this link instead of the world, if frames carry
    /// poses.
    #[arg(long, help_heading = COMPUTED, value_name = "LINK")]
    pub(in crate::cli) relative_to: Option<String>,

    /// How far apart the places of two touches in self-contact may be, such as 5mm [default: by the taxels' spacing].
    ///
    /// A bare number is in metres.
    #[arg(long = "contact-tolerance", help_heading = COMPUTED, value_name = "LENGTH", value_parser = metres)]
    pub(in crate::cli) contact_tolerance_m: Option<f64>,

    /// The longest time between two frames over which motion is measured, such as 500ms [default: 10s].
    ///
    /// A bare number is in seconds.
    #[arg(long = "max-gap", help_heading = COMPUTED, value_name = "TIME", value_parser = seconds)]
    pub(in crate::cli) max_gap_s: Option<f64>,

    /// How far a centroid must move to count in filtered_* outputs, such as 0.5mm..20mm [default: 1/16 and 3 times
    /// the spacing of the field's taxels].
    ///
    /// The upper end is how far it moves at most within one touch. Either end may be left out.
    #[arg(long, help_heading = COMPUTED, value_name = "LOW..HIGH", allow_hyphen_values = true)]
    pub(in crate::cli) filter_window: Option<String>,

    /// What --filter-window measures: distance or radial [default: distance].
    ///
    /// With distance, how far the centroid moves. With radial, how much its distance from the chart's origin changes,
    /// as in the paper.
    #[arg(long, help_heading = COMPUTED, value_name = "MEASURE",
        value_parser = one_of::<FilterBy>(&["distance", "radial"]))]
    pub(in crate::cli) filter_by: Option<FilterBy>,

    /// Time constant of filtered_direction, such as 200ms; 0 follows at once [default: 100ms].
    ///
    /// A bare number is in seconds.
    #[arg(long = "filter-time", help_heading = COMPUTED, value_name = "TIME", allow_hyphen_values = true,
        value_parser = seconds)]
    pub(in crate::cli) filter_time_s: Option<f64>,

    /// Measure the filtered_* outputs over this time, such as 100ms [default: 200ms, unless --filter-window has a lower end].
    ///
    /// Motion is measured from where the centroid was that long ago; the upper end of --filter-window still counts.
    /// With 200ms it is steady even if few sensors feel a touch. A bare number is in seconds.
    #[arg(long = "filter-over", help_heading = COMPUTED, value_name = "TIME", allow_hyphen_values = true,
        value_parser = seconds)]
    pub(in crate::cli) filter_over_s: Option<f64>,

    /// Play a recording from this time after its start, such as 60s [default: 0].
    ///
    /// A bare number is in seconds.
    #[arg(long = "from", help_heading = RECORDINGS, value_name = "TIME", value_parser = seconds)]
    pub(in crate::cli) from_s: Option<f64>,

    /// Play a recording up to this time after its start, such as 90s [default: its end].
    ///
    /// A bare number is in seconds.
    #[arg(long = "to", help_heading = RECORDINGS, value_name = "TIME", value_parser = seconds)]
    pub(in crate::cli) to_s: Option<f64>,

    /// Play a recording N times, or without N until interrupted; its time goes on.
    #[arg(id = "loop", long = "loop", help_heading = RECORDINGS, value_name = "N",
        num_args = 0..=1, require_equals = true, default_missing_value = "0")]
    pub(in crate::cli) repeat: Option<u64>,

    /// Frames per second of a recording without times, such as 50Hz.
    ///
    /// A bare number is in Hz.
    #[arg(long = "rate", help_heading = RECORDINGS, value_name = "RATE", value_parser = hertz)]
    pub(in crate::cli) rate_hz: Option<f64>,

    /// Read the source as the export of a pressure system [default: as its content says].
    ///
    /// One of xsensor, tekscan, emed, pliance, pedar, loadsol, footscan, stappone, or matrix for plain numbers.
    #[arg(long, help_heading = RECORDINGS, value_name = "FORMAT",
        value_parser = one_of::<VendorFormat>(VendorFormat::WORDS))]
    pub(in crate::cli) format: Option<VendorFormat>,

    /// Rows and columns of a frame of plain numbers, such as 31x11.
    #[arg(long, help_heading = RECORDINGS, value_name = "ROWSxCOLUMNS")]
    pub(in crate::cli) grid: Option<String>,

    /// Distance between rows and columns of plain numbers, such as 8.6mm, or 8.6mm,5mm for rows and columns.
    #[arg(long, help_heading = RECORDINGS, value_name = "LENGTH")]
    pub(in crate::cli) pitch: Option<String>,

    /// The unit of an export's values, if it has none: kPa, mmHg, N/cm2, psi, N, and others.
    #[arg(long, help_heading = RECORDINGS, value_name = "UNIT")]
    pub(in crate::cli) unit: Option<String>,

    /// Where the sensors of pedar's insoles are: a CSV with the columns id, x, y and area.
    ///
    /// It is in metres and square metres. The exports of pedar do not have it.
    #[arg(long, help_heading = RECORDINGS, value_name = "FILE.csv")]
    pub(in crate::cli) layout: Option<PathBuf>,

    /// Skip lines, rows and messages that are wrong, count them by kind, and exit with 3 [default: fail at the first].
    ///
    /// For CSV, NDJSON, exports with a line for each frame, ROS 2 bags, and joint states; `text:` does so always.
    #[arg(long, help_heading = RECORDINGS)]
    pub(in crate::cli) skip_bad: bool,

    /// What mcap:FILE holds: raw frames (frames), percepts, and what viewers show (view) [default: all].
    #[arg(long, help_heading = RECORDINGS, value_name = "PART,...", value_delimiter = ',',
        value_parser = one_of::<RecordPart>(&["frames", "percepts", "view"]))]
    pub(in crate::cli) record: Vec<RecordPart>,

    /// How long a taxel that frames leave out keeps its value, such as 50ms [default: 0; for boards three of their
    /// frames, at least 50ms].
    ///
    /// After that it counts as missing. A bare number is in seconds.
    #[arg(long = "max-age", help_heading = LIVE, value_name = "TIME", value_parser = seconds)]
    pub(in crate::cli) max_age_s: Option<f64>,

    /// Fail at the first taxel on standard input that the body does not have [default: leave its values out and exit
    /// with 3].
    #[arg(long, help_heading = LIVE)]
    pub(in crate::cli) strict: bool,

    /// The board and the channel of each taxel, a TOML file [default: taxels in ascending order of their ids].
    ///
    /// By default the boards, one per port, share the taxels. `somatic board --help` shows such a file.
    #[arg(long, help_heading = LIVE, value_name = "FILE")]
    pub(in crate::cli) wiring: Option<PathBuf>,

    /// Merge the boards' frames at this rate, such as 100Hz [default: one for each frame of the fastest board].
    ///
    /// With 0 there is one for each frame of any board. A bare number is in Hz.
    #[arg(long = "live-rate", help_heading = LIVE, value_name = "RATE", value_parser = hertz)]
    pub(in crate::cli) live_rate_hz: Option<f64>,

    /// Make the boards send frames at this rate, such as 100Hz [default: leave them as they are].
    ///
    /// With 0 they send as fast as the line allows. A bare number is in Hz.
    #[arg(long = "board-rate", help_heading = LIVE, value_name = "RATE", value_parser = hertz)]
    pub(in crate::cli) board_rate_hz: Option<f64>,

    #[command(flatten)]
    pub(in crate::cli) text: TextFlags,

    /// Which arrays of messages are sensors: a TOML file, or contactile, dex3, inspire, mujoco, paxini, tactile-state,
    /// xela or xela-ros2.
    ///
    /// For ROS 2 bags and topics with messages of any type, NDJSON, lines of JSON, Modbus and PaXini. All of them but tactile-state and
    /// mujoco are untested.
    #[arg(long, help_heading = RECORDINGS, value_name = "FILE")]
    pub(in crate::cli) map: Option<String>,

    /// Zenoh's own configuration, JSON5, for zenoh: sources and sinks [default: this computer alone, on port 7447].
    #[arg(long, help_heading = LIVE, value_name = "FILE.json5")]
    pub(in crate::cli) zenoh_config: Option<PathBuf>,

    /// The robot's URDF, with which joint states give the poses of links.
    ///
    /// Joint states come in the frames, or from --joint-states.
    #[arg(long, help_heading = ROBOT, value_name = "FILE.urdf")]
    pub(in crate::cli) joints: Option<PathBuf>,

    /// A recording of joint states, or ros2:/TOPIC, live [default: those in the frames, or in their bag].
    ///
    /// A recording is a CSV under t,<joint>,..., NDJSON, or a ROS 2 bag: a .mcap, a .db3, a folder, or
    /// ros2-mcap:PATH:/TOPIC.
    #[arg(long, help_heading = ROBOT, value_name = "FILE")]
    pub(in crate::cli) joint_states: Option<PathBuf>,

    /// A ROS 2 bag with poses of links: its /tf, /tf_static and odometry, or ros2-mcap:PATH:/TOPIC,...
    ///
    /// Links are matched by name. The root of the transforms is the world. With --joints, they are where the robot is.
    #[arg(long, help_heading = ROBOT, value_name = "BAG")]
    pub(in crate::cli) poses: Option<PathBuf>,

    /// The URDF's axis that points up: z, or y if its axes are glTF's [default: the axis used for the body, else z].
    #[arg(long, help_heading = ROBOT, value_name = "AXIS", value_parser = one_of::<Up>(Up::WORDS))]
    pub(in crate::cli) up: Option<Up>,

    /// How much later the clock of --joint-states stamps an instant than the frames' clock, such as 25ms [default:
    /// 0].
    ///
    /// With auto it is estimated, for frames and states from one ROS 2 bag. A bare number is in seconds.
    #[arg(long = "joints-delay", help_heading = ROBOT, value_name = "TIME", allow_hyphen_values = true)]
    pub(in crate::cli) joints_delay_s: Option<JointsDelay>,

    /// The age of a joint's last state from which positions stay in links, such as 200ms [default: 100ms].
    ///
    /// They have the flag stale_pose then. A bare number is in seconds.
    #[arg(long = "joints-max-age", help_heading = ROBOT, value_name = "TIME", value_parser = seconds)]
    pub(in crate::cli) joints_max_age_s: Option<f64>,

    /// The times of ROS messages: recording or wall [default: recording].
    ///
    /// With recording, they are the frames' times. With wall, they begin at this computer's time when the first frame
    /// comes, and go on as the frames do.
    #[arg(long, help_heading = ROBOT, value_name = "TIME", value_parser = one_of::<RosTime>(RosTime::WORDS))]
    pub(in crate::cli) ros_time: Option<RosTime>,

    #[command(flatten)]
    pub(in crate::cli) accuracy: AccuracyFlags,

    /// Compute at most this many frames in one call [default: 256 for recordings, 1 live].
    ///
    /// More is faster, fewer is sooner.
    #[arg(long, help_heading = ACCURACY, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=65536))]
    pub(in crate::cli) batch: Option<u32>,

    /// Let browsers reach the page by this host name too; may be repeated.
    ///
    /// Without one, the page is for this machine alone.
    #[arg(id = "allow_host", long = "allow-host", value_name = "NAME", help_heading = OUTPUT)]
    pub(in crate::cli) allow_hosts: Vec<String>,

    /// Begin NDJSON with a line that has units and body.
    #[arg(long, help_heading = OUTPUT)]
    pub(in crate::cli) header: bool,

    /// Write fields without contact, too.
    #[arg(long, help_heading = OUTPUT)]
    pub(in crate::cli) all_fields: bool,

    /// Show no table, progress or remarks.
    #[arg(short, long, help_heading = OUTPUT)]
    pub(in crate::cli) quiet: bool,
}

/// Speed against accuracy: either tolerances and a time budget, for which a measurement chooses the options, or these
/// options themselves.
#[derive(Args, Clone, Copy, Debug, Default)]
pub(in crate::cli) struct AccuracyFlags {
    /// Measure, and use the fastest method within this tolerance, such as '3 mm, 5 deg' or one of these.
    ///
    /// Of 100 places and orientations, 95 are within it of the truth. In a scene it is two keys.
    #[arg(long, help_heading = ACCURACY, value_name = "LENGTH,ANGLE", value_parser = Target::within)]
    pub(in crate::cli) within: Option<Target>,

    /// Measure, and use only options with which a frame takes at most this time, such as 100us.
    ///
    /// The median frame counts. Without --within, the most accurate of these options are chosen.
    #[arg(long, help_heading = ACCURACY, value_name = "TIME", value_parser = time)]
    pub(in crate::cli) budget: Option<f64>,

    /// How sums are made: one-pass, compensated or double [default: one-pass; reference: double].
    ///
    /// In single precision (one-pass), with the rounding errors added back (compensated), or in double precision on
    /// the CPU (double).
    #[arg(long, help_heading = ACCURACY, value_name = "HOW",
        value_parser = one_of::<Arithmetic>(Arithmetic::WORDS))]
    pub(in crate::cli) arithmetic: Option<Arithmetic>,

    /// Which charts fields have: as-authored, plane or geodesic [default: as-authored].
    ///
    /// They are the layout's (as-authored), tangent planes (plane), or shortest paths over the surface where that is
    /// possible (geodesic).
    #[arg(long, help_heading = ACCURACY, value_name = "KIND",
        value_parser = one_of::<Charts>(Charts::WORDS))]
    pub(in crate::cli) charts: Option<Charts>,

    /// Which output gives an orientation: as-asked, two-points, second-moments, fit-1, fit-2 or fit [default:
    /// as-asked].
    ///
    /// The ones in --outputs (as-asked), orientation alone (two-points), or principal_axis alone (second-moments). A
    /// fit adds touches.fit_direction and touches.fit_place to principal_axis. It fits a contact to each touch in one
    /// step (fit-1), two (fit-2) or all (fit).
    #[arg(long, help_heading = ACCURACY, value_name = "WAY",
        value_parser = one_of::<OrientationBy>(OrientationBy::WORDS))]
    pub(in crate::cli) orientation_by: Option<OrientationBy>,

    /// Which fields are computed in a live frame on the CPU: all, touched or auto [default: auto].
    ///
    /// All of them (all), only those that changed (touched), or the faster of these (auto). Percepts are the same.
    #[arg(long, help_heading = ACCURACY, value_name = "WHICH",
        value_parser = one_of::<Coverage>(Coverage::WORDS))]
    pub(in crate::cli) coverage: Option<Coverage>,

    /// When a field is computed: every-frame or on-change [default: every-frame].
    ///
    /// With on-change, a field is computed when its values change, and motion is from change to change.
    #[arg(long, help_heading = ACCURACY, value_name = "WHEN",
        value_parser = one_of::<Cadence>(Cadence::WORDS))]
    pub(in crate::cli) cadence: Option<Cadence>,
}

impl RunFlags {
    /// These flags laid over `file`.
    pub(super) fn over(&self, mut file: SceneFile) -> Result<SceneFile> {
        macro_rules! lay {
            (values: $($value:ident)*, lists: $($list:ident)*, switches: $($switch:ident)*) => {
                $(if self.$value.is_some() { file.$value.clone_from(&self.$value); })*
                $(if !self.$list.is_empty() { file.$list.clone_from(&self.$list); })*
                $(file.$switch |= self.$switch;)*
            };
        }
        lay! {
            values: zenoh_config ros_time joints joint_states poses up joints_delay_s joints_max_age_s body backend calibration rate_hz wiring
                format grid pitch unit layout map live_rate_hz board_rate_hz batch playback_speed from_s to_s repeat max_age_s max_gap_s
                contact_tolerance_m coordinates relative_to filter_window filter_by filter_time_s filter_over_s,
            lists: allow_hosts outputs fields letters signal record,
            switches: all_fields header tare strict skip_bad overwrite verify quiet
        }
        if !self.sources.is_empty() {
            file.sources = self.sources.iter().map(|text| text.parse()).collect::<Result<_>>()?;
        }
        if !self.sinks.is_empty() {
            file.sinks = self.sinks.iter().map(|text| text.parse()).collect::<Result<_>>()?;
        }
        file.accuracy = self.accuracy.keys().over(file.accuracy);
        file.text = self.text.keys().over(file.text);
        Ok(file)
    }
}

impl AccuracyFlags {
    fn keys(&self) -> Accuracy {
        let within = self.within.unwrap_or_default();
        let mut keys = Accuracy::default();
        (keys.centroid_m, keys.orientation_rad, keys.budget_s) =
            (within.centroid_m, within.orientation_rad, self.budget);
        (keys.arithmetic, keys.charts, keys.orientation_by) = (self.arithmetic, self.charts, self.orientation_by);
        (keys.coverage, keys.cadence) = (self.coverage, self.cadence);
        keys
    }
}
