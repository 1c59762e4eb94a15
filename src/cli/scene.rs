//! Options of a run: the flags of `somatic run` and `somatic plan`, and the same keys in scene files.

mod accuracy;
mod calibrated;
mod check;
mod deserialize;
mod flags;
mod jointed;
mod joints_delay;
mod outputs;
mod touches;
mod within;

use std::path::{Path, PathBuf};

use clap::Args;
use schemars::JsonSchema;
use serde::Deserialize;
use somatic::author::mesh::Up;
use somatic::error::parse_toml;
use somatic::limits::{self, MAX_TOML_BYTES};
use somatic::scene::{AskedOutputs, Coordinates, FilterBy};
use somatic::signal::{FsrSignal, Letter, Receptor};
use somatic::sink::{RecordPart, RosTime, SinkSpec};
use somatic::source::{SourceSpec, VendorFormat};
use somatic::{BackendKind, Body, Error, Options, Outputs, Result, Scene, bundled};

use self::accuracy::Accuracy;
use self::deserialize::{OneOrMany, batch, names_of, outputs, window, word, words};
use self::flags::{ACCURACY, COMPUTED, OUTPUT, RECORDINGS, ROBOT};
pub(super) use self::flags::{LIVE, first, grouped, one_of};
use self::joints_delay::JointsDelay;
use self::outputs::output_names;
pub(super) use self::outputs::{output, outputs_help, outputs_or_usual};
use self::touches::TouchKeys;
use self::within::{sink_within, source_within, states_within};
use super::first_source::FirstSource;
use super::ports::LineFlags;
use super::text_flags::TextFlags;

/// What `somatic run` is asked to do. Each flag of the command is a key of a scene file, with `_` for `-` and the unit in
/// its name; of `--force` and `--speed` keys say more: `overwrite`, `playback_speed`. Paths in a file are relative to that file.
/// Flags come before keys.
#[derive(Args, Clone, Debug, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
#[schemars(title = "somatic scene", description = "What `somatic run SCENE` is asked to do")]
pub(super) struct RunOptions {
    /// The robot's body: a .glb or .gltf file, or the bundled hand, mat or humanoid [default: the source's own, or
    /// hand].
    #[arg(long, value_name = "BODY")]
    pub(super) body: Option<String>,

    /// Where touch frames come from: csv:FILE, mcap:FILE, ros2-mcap:PATH[:/TOPIC,...] for a bag of ROS 2, sim:FILE.toml, a pressure system's export (.csv, .asf, .lst,
    /// .asc, .txt), one or more serial:PORT[@BAUD], text:PORT[@BAUD] (also text:tcp://HOST:PORT, text:udp://:PORT, text:-) for a board that prints numbers, ros2:/TOPIC, one or more zenoh:KEY for limbs on other computers, or from standard input - for NDJSON and csv:- for CSV [default: a bundled touch].
    #[arg(long = "source", value_name = "SOURCE")]
    #[serde(rename = "source", deserialize_with = "names_of::<SourceSpec, _>")]
    #[schemars(with = "OneOrMany")]
    pub(super) sources: Vec<String>,

    /// Where percepts go: ndjson:FILE, csv:FILE or parquet:FILE for a table, mcap:FILE, ros2-mcap:FOLDER for a bag of ROS 2, ros2[:/NAMESPACE] for its topics, page[:HOST:PORT] for browsers, zenoh:KEY or zenoh-percepts:KEY to send frames or percepts of a limb to another computer, or -
    /// for NDJSON on standard output; may be repeated [default: a table at a terminal, else -].
    #[arg(long = "sink", value_name = "SINK")]
    #[serde(rename = "sink", deserialize_with = "names_of::<SinkSpec, _>")]
    #[schemars(with = "OneOrMany")]
    pub(super) sinks: Vec<String>,

    /// Compute only the fields whose names match, such as 'hand/palm*' or '**/thumb'; may be repeated.
    #[arg(long, value_name = "GLOB")]
    #[serde(deserialize_with = "words")]
    #[schemars(with = "OneOrMany")]
    pub(super) fields: Vec<String>,

    /// Compute only these quantities [default: all but touches, self_contacts, speed_in_world, filtered_* and *_sigma;
    /// force only where P has a unit].
    #[arg(long, value_name = "OUTPUT,...", value_delimiter = ',', help = outputs_help())]
    #[serde(deserialize_with = "outputs")]
    #[schemars(with = "Vec<String>", transform = output_names)]
    pub(super) outputs: Vec<AskedOutputs>,

    /// When touches of the whole body begin and end: `on` and `off`, in the unit of P.
    #[arg(skip)]
    pub(super) touch: Option<TouchKeys>,

    /// The calibration of the sensors, a TOML file; without one, pressures are raw values [default: the source's own,
    /// if it has one].
    #[arg(long, value_name = "FILE")]
    pub(super) calibration: Option<PathBuf>,

    /// What computes: reference in double precision, cpu or gpu in single precision, or auto, the faster of cpu and gpu
    /// [default: auto].
    #[arg(long, value_parser = one_of::<BackendKind>(BackendKind::WORDS))]
    #[serde(deserialize_with = "word")]
    #[schemars(with = "Option<String>", extend("enum" = BackendKind::WORDS))]
    pub(super) backend: Option<BackendKind>,

    /// Play a recording at this many times its own speed [default: as fast as possible; 1 with a page].
    #[arg(long, value_name = "X")]
    #[serde(rename = "playback_speed")]
    pub(super) speed: Option<f64>,

    /// Compare every percept with the double-precision reference; exit with 1 where they disagree.
    #[arg(long)]
    pub(super) verify: bool,

    /// Replace output files that exist; a file that is read is never replaced.
    #[arg(long)]
    #[serde(rename = "overwrite")]
    pub(super) force: bool,

    /// Compute the fields from pressures (sustained), from their change per second (change), or once from each [default:
    /// sustained].
    #[arg(long, help_heading = COMPUTED, value_name = "LETTER,...", value_delimiter = ',',
        value_parser = one_of::<Receptor>(&["sustained", "change"]))]
    #[serde(deserialize_with = "words")]
    #[schemars(with = "OneOrMany")]
    pub(super) letters: Vec<Receptor>,

    /// Compute from the raw or linear signal of force-sensing resistors, not the one in the calibration; with both,
    /// every field is computed once from each.
    #[arg(long, help_heading = COMPUTED, value_name = "SIGNAL,...", value_delimiter = ',',
        value_parser = one_of::<FsrSignal>(&["raw", "linear"]))]
    #[serde(deserialize_with = "words")]
    #[schemars(with = "OneOrMany")]
    pub(super) signal: Vec<FsrSignal>,

    /// Take the first frame's values as the sensors' baselines; nothing may touch the robot then.
    #[arg(long, help_heading = COMPUTED)]
    pub(super) tare: bool,

    /// Frame of positions and normals: the world where frames carry poses, or always the field's anchor [default:
    /// world].
    #[arg(long, help_heading = COMPUTED, value_name = "FRAME",
        value_parser = one_of::<Coordinates>(Coordinates::WORDS))]
    #[serde(deserialize_with = "word")]
    #[schemars(with = "Option<String>", extend("enum" = Coordinates::WORDS))]
    pub(super) coordinates: Option<Coordinates>,

    /// Put positions, normals and self-contacts into the frame of this link instead of the world, where frames carry poses.
    #[arg(long, help_heading = COMPUTED, value_name = "LINK")]
    pub(super) relative_to: Option<String>,

    /// How far the places of two touches may be apart that are one contact, in metres [default: by the taxels' spacing].
    #[arg(long, help_heading = COMPUTED, value_name = "M")]
    #[serde(rename = "contact_tolerance_m")]
    pub(super) contact_tolerance: Option<f64>,

    /// The longest time between two frames over which motion is measured, in seconds [default: 10].
    #[arg(long, help_heading = COMPUTED, value_name = "S")]
    #[serde(rename = "max_gap_s")]
    pub(super) max_gap: Option<f64>,

    /// How far a centroid must move until the filtered_* outputs count it, and how far it moves at most within one
    /// touch, such as 0.5mm..20mm; either end may be left out [default: 1/16 and 3 times the spacing of the field's
    /// taxels].
    #[arg(long, help_heading = COMPUTED, value_name = "LOW..HIGH", allow_hyphen_values = true)]
    #[serde(deserialize_with = "window")]
    pub(super) filter_window: Option<String>,

    /// What --filter-window measures: how far the centroid moves (distance), or how much its distance from the chart's
    /// origin changes, as in the paper (radial) [default: distance].
    #[arg(long, help_heading = COMPUTED, value_name = "MEASURE",
        value_parser = one_of::<FilterBy>(&["distance", "radial"]))]
    #[serde(deserialize_with = "word")]
    #[schemars(with = "Option<String>", extend("enum" = ["distance", "radial"]))]
    pub(super) filter_by: Option<FilterBy>,

    /// Time constant of filtered_direction, in seconds; 0 follows at once [default: 0.1].
    #[arg(long, help_heading = COMPUTED, value_name = "S", allow_hyphen_values = true)]
    #[serde(rename = "filter_time_s")]
    pub(super) filter_time: Option<f64>,

    /// Measure the filtered_* outputs over this time, in seconds, from where the centroid was that long ago, instead of by
    /// --filter-window, of which the high end still counts. 0.2 is steady where few sensors feel a touch.
    #[arg(long, help_heading = COMPUTED, value_name = "S", allow_hyphen_values = true)]
    #[serde(rename = "filter_over_s")]
    pub(super) filter_over: Option<f64>,

    /// Play a recording from this time after its start, in seconds [default: 0].
    #[arg(long, help_heading = RECORDINGS, value_name = "S")]
    #[serde(rename = "from_s")]
    pub(super) from: Option<f64>,

    /// Play a recording up to this time after its start, in seconds [default: its end].
    #[arg(long, help_heading = RECORDINGS, value_name = "S")]
    #[serde(rename = "to_s")]
    pub(super) to: Option<f64>,

    /// Play a recording N times, or without N until interrupted; its time goes on.
    #[arg(long = "loop", help_heading = RECORDINGS, value_name = "N",
        num_args = 0..=1, require_equals = true, default_missing_value = "0")]
    #[serde(rename = "loop")]
    pub(super) repeat: Option<u64>,

    /// Frames per second of a recording that has no times, in Hz.
    #[arg(long, help_heading = RECORDINGS, value_name = "HZ")]
    #[serde(rename = "rate_hz")]
    pub(super) rate: Option<f64>,

    /// Read the source as a pressure system's export: xsensor, tekscan, emed, pliance, pedar, or matrix for plain numbers
    /// [default: as its content says].
    #[arg(long, help_heading = RECORDINGS, value_name = "FORMAT",
        value_parser = one_of::<VendorFormat>(VendorFormat::WORDS))]
    #[serde(deserialize_with = "word")]
    #[schemars(with = "Option<String>", extend("enum" = VendorFormat::WORDS))]
    pub(super) format: Option<VendorFormat>,

    /// Rows and columns of a frame of plain numbers, such as 31x11.
    #[arg(long, help_heading = RECORDINGS, value_name = "ROWSxCOLUMNS")]
    pub(super) grid: Option<String>,

    /// From one row and column of them to the next, such as 8.6mm, or 8.6mm,5mm for rows and columns.
    #[arg(long, help_heading = RECORDINGS, value_name = "LENGTH")]
    pub(super) pitch: Option<String>,

    /// The unit of an export's values where it does not say it: kPa, mmHg, N/cm2, psi, N, and others.
    #[arg(long, help_heading = RECORDINGS, value_name = "UNIT")]
    pub(super) unit: Option<String>,

    /// Where the sensors of pedar's insoles are, which its files do not say: a CSV with the columns id, x, y and area, in
    /// metres and square metres.
    #[arg(long, help_heading = RECORDINGS, value_name = "FILE.csv")]
    pub(super) layout: Option<PathBuf>,

    /// What mcap:FILE holds: raw frames (frames), percepts, and what viewers show (view) [default: all].
    #[arg(long, help_heading = RECORDINGS, value_name = "PART,...", value_delimiter = ',',
        value_parser = one_of::<RecordPart>(&["frames", "percepts", "view"]))]
    #[serde(deserialize_with = "words")]
    #[schemars(with = "OneOrMany")]
    pub(super) record: Vec<RecordPart>,

    /// How long a taxel that frames leave out keeps its value, in seconds; after that it counts as missing [default: 0;
    /// for boards three of their frames, and at least 0.05].
    #[arg(long, help_heading = LIVE, value_name = "S")]
    #[serde(rename = "max_age_s")]
    pub(super) max_age: Option<f64>,

    /// Fail at the first taxel on standard input that the body does not have [default: leave its values out and exit
    /// with 3].
    #[arg(long, help_heading = LIVE)]
    pub(super) strict: bool,

    /// Which taxel is on which channel of which board, a TOML file as `somatic board --help` shows [default: the boards, one per port,
    /// share the taxels in ascending order of their ids].
    #[arg(long, help_heading = LIVE, value_name = "FILE")]
    pub(super) wiring: Option<PathBuf>,

    /// Merge the boards' frames at this rate, in Hz; 0 gives one for each frame of any board [default: one for each
    /// frame of the fastest board].
    #[arg(long, help_heading = LIVE, value_name = "HZ")]
    #[serde(rename = "live_rate_hz")]
    pub(super) live_rate: Option<f64>,

    /// Tell the boards to send frames at this rate, in Hz; 0 is as fast as the line allows [default: leave them as they
    /// are].
    #[arg(long, help_heading = LIVE, value_name = "HZ")]
    #[serde(rename = "board_rate_hz")]
    pub(super) board_rate: Option<f64>,

    #[command(flatten)]
    #[schemars(description = "How lines of `text:` are written, where that is not to be found out.")]
    pub(super) text: TextFlags,

    /// Zenoh's own configuration, JSON5, for zenoh: sources and sinks [default: this computer alone, on port 7447].
    #[arg(long, help_heading = LIVE, value_name = "FILE.json5")]
    pub(super) zenoh_config: Option<PathBuf>,

    /// The robot's URDF: joint states, which frames carry or --joint-states has, say where links are.
    #[arg(long, help_heading = ROBOT, value_name = "FILE.urdf")]
    pub(super) joints: Option<PathBuf>,

    /// Joint states in a recording of their own: a CSV under t,<joint>,..., NDJSON, a bag of ROS 2 in MCAP (a .mcap, a folder, or
    /// ros2-mcap:PATH:/TOPIC), or ros2:/TOPIC, live [default: those in the frames, or in their bag].
    #[arg(long, help_heading = ROBOT, value_name = "FILE")]
    pub(super) joint_states: Option<PathBuf>,

    /// The axis that points up in the URDF: z, or y where its axes are glTF's [default: what the body was made with, else z].
    #[arg(long, help_heading = ROBOT, value_name = "AXIS", value_parser = one_of::<Up>(Up::WORDS))]
    #[serde(deserialize_with = "word")]
    #[schemars(with = "Option<String>", extend("enum" = Up::WORDS))]
    pub(super) up: Option<Up>,

    /// How much later the clock of --joint-states stamps an instant than that of the frames, in seconds; auto estimates it
    /// for frames and states from one bag of ROS 2 [default: 0].
    #[arg(long, help_heading = ROBOT, value_name = "S", allow_hyphen_values = true)]
    #[serde(rename = "joints_delay_s")]
    #[schemars(with = "Option<f64>", extend("type" = ["number", "string", "null"], "pattern" = "^auto$"))]
    pub(super) joints_delay: Option<JointsDelay>,

    /// The age of a joint's last state from which on positions stay in links, flagged stale_pose, in seconds [default:
    /// 0.1].
    #[arg(long, help_heading = ROBOT, value_name = "S")]
    #[serde(rename = "joints_max_age_s")]
    pub(super) joints_max_age: Option<f64>,

    /// The times of ROS messages: those of the frames (recording), or this computer's when the first frame comes and as the
    /// frames go on (wall) [default: recording].
    #[arg(long, help_heading = ROBOT, value_name = "TIME", value_parser = one_of::<RosTime>(RosTime::WORDS))]
    #[serde(deserialize_with = "word")]
    #[schemars(with = "Option<String>", extend("enum" = RosTime::WORDS))]
    pub(super) ros_time: Option<RosTime>,

    #[command(flatten)]
    #[schemars(description = "How far percepts may be off and how long a frame may take, or the knobs themselves.")]
    pub(super) accuracy: Accuracy,

    /// Compute at most this many frames in one call: more is faster, fewer is sooner [default: 256 for recordings, 1
    /// live].
    #[arg(long, help_heading = ACCURACY, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=65536))]
    #[serde(deserialize_with = "batch")]
    #[schemars(range(min = 1, max = 65536))]
    pub(super) batch: Option<u32>,

    /// Let browsers reach the page by this host name too; without one it is for this machine alone. May be repeated.
    #[arg(long = "allow-host", value_name = "NAME", help_heading = OUTPUT)]
    #[serde(rename = "allow_host", deserialize_with = "words")]
    #[schemars(with = "OneOrMany")]
    pub(super) allow_hosts: Vec<String>,

    /// Begin NDJSON with a line that says units and body.
    #[arg(long, help_heading = OUTPUT)]
    pub(super) header: bool,

    /// Write fields without contact too.
    #[arg(long, help_heading = OUTPUT)]
    pub(super) all_fields: bool,

    /// Show no table, progress or remarks.
    #[arg(short, long, help_heading = OUTPUT)]
    pub(super) quiet: bool,

    #[arg(skip)]
    #[serde(skip)]
    #[schemars(skip)]
    pub(super) first: FirstSource,
}

impl RunOptions {
    /// What the scene file at `path` asks for, its paths made relative to where we are.
    fn load(path: &Path) -> Result<Self> {
        let text = limits::read_to_string(path, MAX_TOML_BYTES).map_err(|e| Error::io(path, &e))?;
        let mut asked: Self = parse_toml(&text).map_err(|e| e.into_usage().at(path.display()))?;
        asked.check_accuracy().map_err(|(key, e)| Accuracy::placed(&text, key, e).at(path.display()))?;
        let folder = path.parent().unwrap_or(Path::new(""));
        let there = |file: &Path| folder.join(file).display().to_string();
        asked.calibration = asked.calibration.map(|file| folder.join(file));
        asked.wiring = asked.wiring.map(|file| folder.join(file));
        asked.layout = asked.layout.map(|file| folder.join(file));
        asked.zenoh_config = asked.zenoh_config.map(|file| folder.join(file));
        asked.joints = asked.joints.map(|file| folder.join(file));
        asked.joint_states = asked.joint_states.map(|states| states_within(folder, states)).transpose()?;
        // A bundled body, unless a file is called the same.
        asked.body = asked.body.map(|body| match there(Path::new(&body)) {
            file if Path::new(&file).exists() || bundled::body(&body).is_none() => file,
            _ => body,
        });
        asked.sources = asked.sources.iter().map(|source| source_within(folder, source)).collect::<Result<_>>()?;
        asked.sinks = asked.sinks.iter().map(|sink| sink_within(folder, sink)).collect::<Result<_>>()?;
        Ok(asked)
    }

    /// What these arguments and the scene file at `scene` ask for together; an argument comes before a key.
    pub(super) fn with(&self, scene: Option<&Path>) -> Result<Self> {
        let file = scene.map(Self::load).transpose()?.unwrap_or_default();
        macro_rules! merged {
            (values: $($value:ident)*, lists: $($list:ident)*, switches: $($switch:ident)*) => {
                Self {
                    $($value: self.$value.clone().or(file.$value),)*
                    $($list: if self.$list.is_empty() { file.$list } else { self.$list.clone() },)*
                    $($switch: self.$switch || file.$switch,)*
                    accuracy: self.accuracy.or(file.accuracy),
                    text: self.text.or(file.text),
                    first: FirstSource::default(),
                }
            };
        }
        let asked = merged! {
            values: zenoh_config ros_time joints joint_states up joints_delay joints_max_age body backend calibration rate wiring format grid pitch unit layout live_rate board_rate batch speed from to repeat max_age max_gap contact_tolerance
                coordinates relative_to touch filter_window filter_by filter_time filter_over,
            lists: sources sinks allow_hosts outputs fields letters signal record,
            switches: all_fields header tare strict force verify quiet
        };
        asked.check().map_err(|e| scene.map_or(e.clone(), |path| e.at(path.display())))?;
        Ok(asked)
    }

    pub(super) fn outputs(&self) -> Outputs {
        AskedOutputs::all_of(&self.outputs).of_fields
    }

    /// Whether accuracy, backend and outputs go together; if not, by which key.
    fn check_accuracy(&self) -> Result<(), (&'static str, Error)> {
        self.accuracy.check(self.backend.unwrap_or_default(), self.outputs())
    }

    /// How boards on serial lines are read.
    pub(super) fn line_flags(&self) -> LineFlags {
        LineFlags { wiring: self.wiring.clone(), live_rate: self.live_rate, board_rate: self.board_rate }
    }

    /// The recording whose body and calibration are used, which is so where no body is named.
    pub(super) fn recording(&self) -> Result<Option<PathBuf>> {
        let spec = self.first_source()?.filter(|_| self.body.is_none());
        Ok(if let Some(SourceSpec::Mcap(path)) = spec { Some(path) } else { None })
    }

    /// The engine's options on `body`, whose taxels have `ids`, for calls of `batch` frames.
    pub(super) fn options(&self, body: &Body, ids: &[u32], batch: usize) -> Result<Options> {
        let calibration = self.calibration_for(body, ids)?;
        let outputs = self.outputs_with(calibration.as_ref())?;
        let letters = if self.letters.is_empty() { &[Receptor::Sustained][..] } else { &self.letters };
        let usual = Scene::default();
        let live = self.sources.iter().any(|source| ["serial:", "zenoh:"].iter().any(|kind| source.starts_with(kind)));
        // Boards' values have their age where frames are put together.
        let max_age_s = self.max_age.filter(|_| !live).unwrap_or(usual.max_age_s);
        let scene = Scene::default()
            .outputs(outputs)
            .fields(self.fields.clone())
            .max_age_s(max_age_s)
            .max_gap_s(self.max_gap.unwrap_or(usual.max_gap_s))
            .letters(Letter::all_of(letters, &self.signal))
            .filter(self.filter(outputs)?)
            .knobs(self.accuracy.knobs())
            .contact_tolerance_m(self.contact_tolerance)
            .touches(self.touches())
            .relative_to(self.relative_to.clone())
            .coordinates(self.coordinates.unwrap_or(usual.coordinates));
        Ok(Options::default()
            .scene(scene)
            .calibration(calibration)
            .backend(self.backend.unwrap_or_default())
            .tare(self.tare)
            .batch(batch))
    }
}
