//! The flags of `somatic run` and those like it, each for a key of scene files.

use std::path::PathBuf;

use clap::Args;
use somatic::author::mesh::Up;
use somatic::scene::file::{Accuracy, JointsDelay, SceneFile, Target, time};
use somatic::scene::{Arithmetic, AskedOutputs, Cadence, Charts, Coordinates, Coverage, FilterBy, OrientationBy};
use somatic::signal::{FsrSignal, Receptor};
use somatic::sink::{RecordPart, RosTime};
use somatic::source::VendorFormat;
use somatic::{BackendKind, Result};

use super::flags::{ACCURACY, COMPUTED, LIVE, OUTPUT, RECORDINGS, ROBOT, one_of};
use super::outputs::outputs_help;
use crate::cli::text_flags::TextFlags;

/// What `somatic run` is asked to do by flags. Each has the name of its key in a scene file, by which messages find it: with `_` for
/// `-` and the unit in it; of `--force` and `--speed` keys say more: `overwrite`, `playback_speed`. Flags come before keys.
#[derive(Args, Clone, Debug, Default)]
pub(in crate::cli) struct RunFlags {
    /// The robot's body: a .glb or .gltf file, or the bundled hand, mat or humanoid [default: the source's own, or
    /// hand].
    #[arg(long, value_name = "BODY")]
    pub(in crate::cli) body: Option<String>,

    /// Where touch frames come from: csv:FILE, mcap:FILE, ros2-mcap:PATH[:/TOPIC,...] for a bag of ROS 2, sim:FILE.toml, a pressure system's export (.csv, .asf, .lst,
    /// .asc, .txt), one or more serial:PORT[@BAUD], text:PORT[@BAUD] (also text:tcp://HOST:PORT, text:udp://:PORT, text:-) for a board that prints numbers, ros2:/TOPIC, one or more zenoh:KEY for limbs on other computers, or from standard input - for NDJSON and csv:- for CSV [default: a bundled touch].
    #[arg(id = "source", long = "source", value_name = "SOURCE")]
    pub(in crate::cli) sources: Vec<String>,

    /// Where percepts go: ndjson:FILE, csv:FILE or parquet:FILE for a table, mcap:FILE, ros2-mcap:FOLDER for a bag of ROS 2, ros2[:/NAMESPACE] for its topics, page[:HOST:PORT] for browsers, zenoh:KEY or zenoh-percepts:KEY to send frames or percepts of a limb to another computer, or -
    /// for NDJSON on standard output; may be repeated [default: a table at a terminal, else -].
    #[arg(id = "sink", long = "sink", value_name = "SINK")]
    pub(in crate::cli) sinks: Vec<String>,

    /// Compute only the fields whose names match, such as 'hand/palm*' or '**/thumb'; may be repeated.
    #[arg(long, value_name = "GLOB")]
    pub(in crate::cli) fields: Vec<String>,

    /// Compute only these quantities [default: all but touches, self_contacts, speed_in_world, filtered_* and *_sigma;
    /// force only where P has a unit].
    #[arg(long, value_name = "OUTPUT,...", value_delimiter = ',', help = outputs_help())]
    pub(in crate::cli) outputs: Vec<AskedOutputs>,

    /// The calibration of the sensors, a TOML file; without one, pressures are raw values [default: the source's own,
    /// if it has one].
    #[arg(long, value_name = "FILE")]
    pub(in crate::cli) calibration: Option<PathBuf>,

    /// What computes: reference in double precision, cpu or gpu in single precision, or auto, the faster of cpu and gpu
    /// [default: auto].
    #[arg(long, value_parser = one_of::<BackendKind>(BackendKind::WORDS))]
    pub(in crate::cli) backend: Option<BackendKind>,

    /// Play a recording at this many times its own speed [default: as fast as possible; 1 with a page].
    #[arg(long = "speed", value_name = "X")]
    pub(in crate::cli) playback_speed: Option<f64>,

    /// Compare every percept with the double-precision reference; exit with 1 where they disagree.
    #[arg(long)]
    pub(in crate::cli) verify: bool,

    /// Replace output files that exist; a file that is read is never replaced.
    #[arg(long = "force")]
    pub(in crate::cli) overwrite: bool,

    /// Compute the fields from pressures (sustained), from their change per second (change), or once from each [default:
    /// sustained].
    #[arg(long, help_heading = COMPUTED, value_name = "LETTER,...", value_delimiter = ',',
        value_parser = one_of::<Receptor>(&["sustained", "change"]))]
    pub(in crate::cli) letters: Vec<Receptor>,

    /// Compute from the raw or linear signal of force-sensing resistors, not the one in the calibration; with both,
    /// every field is computed once from each.
    #[arg(long, help_heading = COMPUTED, value_name = "SIGNAL,...", value_delimiter = ',',
        value_parser = one_of::<FsrSignal>(&["raw", "linear"]))]
    pub(in crate::cli) signal: Vec<FsrSignal>,

    /// Take the first frame's values as the sensors' baselines; nothing may touch the robot then.
    #[arg(long, help_heading = COMPUTED)]
    pub(in crate::cli) tare: bool,

    /// Frame of positions and normals: the world where frames carry poses, or always the field's anchor [default:
    /// world].
    #[arg(long, help_heading = COMPUTED, value_name = "FRAME",
        value_parser = one_of::<Coordinates>(Coordinates::WORDS))]
    pub(in crate::cli) coordinates: Option<Coordinates>,

    /// Put positions, normals and self-contacts into the frame of this link instead of the world, where frames carry poses.
    #[arg(long, help_heading = COMPUTED, value_name = "LINK")]
    pub(in crate::cli) relative_to: Option<String>,

    /// How far the places of two touches may be apart that are one contact, in metres [default: by the taxels' spacing].
    #[arg(long = "contact-tolerance", help_heading = COMPUTED, value_name = "M")]
    pub(in crate::cli) contact_tolerance_m: Option<f64>,

    /// The longest time between two frames over which motion is measured, in seconds [default: 10].
    #[arg(long = "max-gap", help_heading = COMPUTED, value_name = "S")]
    pub(in crate::cli) max_gap_s: Option<f64>,

    /// How far a centroid must move until the filtered_* outputs count it, and how far it moves at most within one
    /// touch, such as 0.5mm..20mm; either end may be left out [default: 1/16 and 3 times the spacing of the field's
    /// taxels].
    #[arg(long, help_heading = COMPUTED, value_name = "LOW..HIGH", allow_hyphen_values = true)]
    pub(in crate::cli) filter_window: Option<String>,

    /// What --filter-window measures: how far the centroid moves (distance), or how much its distance from the chart's
    /// origin changes, as in the paper (radial) [default: distance].
    #[arg(long, help_heading = COMPUTED, value_name = "MEASURE",
        value_parser = one_of::<FilterBy>(&["distance", "radial"]))]
    pub(in crate::cli) filter_by: Option<FilterBy>,

    /// Time constant of filtered_direction, in seconds; 0 follows at once [default: 0.1].
    #[arg(long = "filter-time", help_heading = COMPUTED, value_name = "S", allow_hyphen_values = true)]
    pub(in crate::cli) filter_time_s: Option<f64>,

    /// Measure the filtered_* outputs over this time, in seconds, from where the centroid was that long ago, instead of by
    /// --filter-window, of which the high end still counts. 0.2 is steady where few sensors feel a touch.
    #[arg(long = "filter-over", help_heading = COMPUTED, value_name = "S", allow_hyphen_values = true)]
    pub(in crate::cli) filter_over_s: Option<f64>,

    /// Play a recording from this time after its start, in seconds [default: 0].
    #[arg(long = "from", help_heading = RECORDINGS, value_name = "S")]
    pub(in crate::cli) from_s: Option<f64>,

    /// Play a recording up to this time after its start, in seconds [default: its end].
    #[arg(long = "to", help_heading = RECORDINGS, value_name = "S")]
    pub(in crate::cli) to_s: Option<f64>,

    /// Play a recording N times, or without N until interrupted; its time goes on.
    #[arg(id = "loop", long = "loop", help_heading = RECORDINGS, value_name = "N",
        num_args = 0..=1, require_equals = true, default_missing_value = "0")]
    pub(in crate::cli) repeat: Option<u64>,

    /// Frames per second of a recording that has no times, in Hz.
    #[arg(long = "rate", help_heading = RECORDINGS, value_name = "HZ")]
    pub(in crate::cli) rate_hz: Option<f64>,

    /// Read the source as a pressure system's export: xsensor, tekscan, emed, pliance, pedar, or matrix for plain numbers
    /// [default: as its content says].
    #[arg(long, help_heading = RECORDINGS, value_name = "FORMAT",
        value_parser = one_of::<VendorFormat>(VendorFormat::WORDS))]
    pub(in crate::cli) format: Option<VendorFormat>,

    /// Rows and columns of a frame of plain numbers, such as 31x11.
    #[arg(long, help_heading = RECORDINGS, value_name = "ROWSxCOLUMNS")]
    pub(in crate::cli) grid: Option<String>,

    /// From one row and column of them to the next, such as 8.6mm, or 8.6mm,5mm for rows and columns.
    #[arg(long, help_heading = RECORDINGS, value_name = "LENGTH")]
    pub(in crate::cli) pitch: Option<String>,

    /// The unit of an export's values where it does not say it: kPa, mmHg, N/cm2, psi, N, and others.
    #[arg(long, help_heading = RECORDINGS, value_name = "UNIT")]
    pub(in crate::cli) unit: Option<String>,

    /// Where the sensors of pedar's insoles are, which its files do not say: a CSV with the columns id, x, y and area, in
    /// metres and square metres.
    #[arg(long, help_heading = RECORDINGS, value_name = "FILE.csv")]
    pub(in crate::cli) layout: Option<PathBuf>,

    /// What mcap:FILE holds: raw frames (frames), percepts, and what viewers show (view) [default: all].
    #[arg(long, help_heading = RECORDINGS, value_name = "PART,...", value_delimiter = ',',
        value_parser = one_of::<RecordPart>(&["frames", "percepts", "view"]))]
    pub(in crate::cli) record: Vec<RecordPart>,

    /// How long a taxel that frames leave out keeps its value, in seconds; after that it counts as missing [default: 0;
    /// for boards three of their frames, and at least 0.05].
    #[arg(long = "max-age", help_heading = LIVE, value_name = "S")]
    pub(in crate::cli) max_age_s: Option<f64>,

    /// Fail at the first taxel on standard input that the body does not have [default: leave its values out and exit
    /// with 3].
    #[arg(long, help_heading = LIVE)]
    pub(in crate::cli) strict: bool,

    /// Which taxel is on which channel of which board, a TOML file as `somatic board --help` shows [default: the boards, one per port,
    /// share the taxels in ascending order of their ids].
    #[arg(long, help_heading = LIVE, value_name = "FILE")]
    pub(in crate::cli) wiring: Option<PathBuf>,

    /// Merge the boards' frames at this rate, in Hz; 0 gives one for each frame of any board [default: one for each
    /// frame of the fastest board].
    #[arg(long = "live-rate", help_heading = LIVE, value_name = "HZ")]
    pub(in crate::cli) live_rate_hz: Option<f64>,

    /// Tell the boards to send frames at this rate, in Hz; 0 is as fast as the line allows [default: leave them as they
    /// are].
    #[arg(long = "board-rate", help_heading = LIVE, value_name = "HZ")]
    pub(in crate::cli) board_rate_hz: Option<f64>,

    #[command(flatten)]
    pub(in crate::cli) text: TextFlags,

    /// Zenoh's own configuration, JSON5, for zenoh: sources and sinks [default: this computer alone, on port 7447].
    #[arg(long, help_heading = LIVE, value_name = "FILE.json5")]
    pub(in crate::cli) zenoh_config: Option<PathBuf>,

    /// The robot's URDF: joint states, which frames carry or --joint-states has, say where links are.
    #[arg(long, help_heading = ROBOT, value_name = "FILE.urdf")]
    pub(in crate::cli) joints: Option<PathBuf>,

    /// Joint states in a recording of their own: a CSV under t,<joint>,..., NDJSON, a bag of ROS 2 in MCAP (a .mcap, a folder, or
    /// ros2-mcap:PATH:/TOPIC), or ros2:/TOPIC, live [default: those in the frames, or in their bag].
    #[arg(long, help_heading = ROBOT, value_name = "FILE")]
    pub(in crate::cli) joint_states: Option<PathBuf>,

    /// The axis that points up in the URDF: z, or y where its axes are glTF's [default: what the body was made with, else z].
    #[arg(long, help_heading = ROBOT, value_name = "AXIS", value_parser = one_of::<Up>(Up::WORDS))]
    pub(in crate::cli) up: Option<Up>,

    /// How much later the clock of --joint-states stamps an instant than that of the frames, in seconds; auto estimates it
    /// for frames and states from one bag of ROS 2 [default: 0].
    #[arg(long = "joints-delay", help_heading = ROBOT, value_name = "S", allow_hyphen_values = true)]
    pub(in crate::cli) joints_delay_s: Option<JointsDelay>,

    /// The age of a joint's last state from which on positions stay in links, flagged stale_pose, in seconds [default:
    /// 0.1].
    #[arg(long = "joints-max-age", help_heading = ROBOT, value_name = "S")]
    pub(in crate::cli) joints_max_age_s: Option<f64>,

    /// The times of ROS messages: those of the frames (recording), or this computer's when the first frame comes and as the
    /// frames go on (wall) [default: recording].
    #[arg(long, help_heading = ROBOT, value_name = "TIME", value_parser = one_of::<RosTime>(RosTime::WORDS))]
    pub(in crate::cli) ros_time: Option<RosTime>,

    #[command(flatten)]
    pub(in crate::cli) accuracy: AccuracyFlags,

    /// Compute at most this many frames in one call: more is faster, fewer is sooner [default: 256 for recordings, 1
    /// live].
    #[arg(long, help_heading = ACCURACY, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=65536))]
    pub(in crate::cli) batch: Option<u32>,

    /// Let browsers reach the page by this host name too; without one it is for this machine alone. May be repeated.
    #[arg(id = "allow_host", long = "allow-host", value_name = "NAME", help_heading = OUTPUT)]
    pub(in crate::cli) allow_hosts: Vec<String>,

    /// Begin NDJSON with a line that says units and body.
    #[arg(long, help_heading = OUTPUT)]
    pub(in crate::cli) header: bool,

    /// Write fields without contact too.
    #[arg(long, help_heading = OUTPUT)]
    pub(in crate::cli) all_fields: bool,

    /// Show no table, progress or remarks.
    #[arg(short, long, help_heading = OUTPUT)]
    pub(in crate::cli) quiet: bool,
}

/// Speed against accuracy: either how far percepts may be off and how long a frame may take, so that the knobs are chosen
/// by measurement, or the knobs themselves.
#[derive(Args, Clone, Copy, Debug, Default)]
pub(in crate::cli) struct AccuracyFlags {
    /// Both tolerances; in a file they are two keys.
    #[arg(long, help_heading = ACCURACY, value_name = "LENGTH,ANGLE", value_parser = Target::within,
        help = "Measure, and use the fastest method that keeps 95 of 100 places and orientations within this of the truth, such as \
                '3 mm, 5 deg' or one of these")]
    pub(in crate::cli) within: Option<Target>,

    /// Measure, and use only knobs with which a frame takes at most this in the median, such as 100us; without --within
    /// the most accurate of them.
    #[arg(long, help_heading = ACCURACY, value_name = "TIME", value_parser = time)]
    pub(in crate::cli) budget: Option<f64>,

    /// How sums are made: in single precision (one-pass), with the rounding errors added back (compensated), or in
    /// double precision on the CPU (double) [default: one-pass; reference: double].
    #[arg(long, help_heading = ACCURACY, value_name = "HOW",
        value_parser = one_of::<Arithmetic>(Arithmetic::WORDS))]
    pub(in crate::cli) arithmetic: Option<Arithmetic>,

    /// Which charts fields have: the layout's (as-authored), tangent planes (plane), or shortest paths over the surface
    /// where that is possible (geodesic) [default: as-authored].
    #[arg(long, help_heading = ACCURACY, value_name = "KIND",
        value_parser = one_of::<Charts>(Charts::WORDS))]
    pub(in crate::cli) charts: Option<Charts>,

    /// Which output gives an orientation: the ones in --outputs (as-asked), orientation alone (two-points), principal_axis alone
    /// (second-moments), or with it the direction and place of the contact fitted to each touch in one step (fit-1), two
    /// (fit-2) or all (fit): touches.fit_direction and touches.fit_place [default: as-asked].
    #[arg(long, help_heading = ACCURACY, value_name = "WAY",
        value_parser = one_of::<OrientationBy>(OrientationBy::WORDS))]
    pub(in crate::cli) orientation_by: Option<OrientationBy>,

    /// Which fields are computed in a live frame on the CPU: all, only those that changed (touched), or the faster of
    /// these (auto); percepts are the same [default: auto].
    #[arg(long, help_heading = ACCURACY, value_name = "WHICH",
        value_parser = one_of::<Coverage>(Coverage::WORDS))]
    pub(in crate::cli) coverage: Option<Coverage>,

    /// When a field is computed: in every frame (every-frame), or when its values change (on-change), and motion then
    /// from change to change [default: every-frame].
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
            values: zenoh_config ros_time joints joint_states up joints_delay_s joints_max_age_s body backend calibration rate_hz wiring
                format grid pitch unit layout live_rate_hz board_rate_hz batch playback_speed from_s to_s repeat max_age_s max_gap_s
                contact_tolerance_m coordinates relative_to filter_window filter_by filter_time_s filter_over_s,
            lists: allow_hosts outputs fields letters signal record,
            switches: all_fields header tare strict overwrite verify quiet
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
