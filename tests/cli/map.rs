//! Arrays within messages of types that other programs define, by a map.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::BufWriter;
use std::path::Path;

use serde_json::Value;

use super::bags::refused;
use super::bags_db3::write_db3;
use super::{done, file, frames, output, stderr, text_of};

const STATE: &str = "unitree_hg/msg/HandState";
const TOPIC: &str = "/dex3/left/state";

/// All of a hand's message, as its maker publishes it.
const DEFINITION: &str = "\
MotorState[] motor_state
PressSensorState[] press_sensor_state
IMUState imu_state

float32 power_v
float32 power_a
float32 system_v
float32 device_v
uint32[2] error
uint32[2] reserve
================================================================================
MSG: unitree_hg/MotorState
uint8 mode
float32 q
float32 dq
float32 ddq
float32 tau_est
int16[2] temperature
float32 vol
uint32[2] sensor
uint32 motorstate
uint32[4] reserve
================================================================================
MSG: unitree_hg/PressSensorState
float32[12] pressure
float32[12] temperature
uint32 lost
uint32 reserve
================================================================================
MSG: unitree_hg/IMUState
float32[4] quaternion
float32[3] gyroscope
float32[3] accelerometer
float32[3] rpy
int16 temperature
";

/// Bytes at multiples of their size, as CDR has them.
struct Bytes(Vec<u8>);

impl Bytes {
    fn put(&mut self, bytes: &[u8]) {
        self.0.resize(self.0.len().next_multiple_of(bytes.len()), 0);
        self.0.extend_from_slice(bytes);
    }

    fn floats(&mut self, floats: impl IntoIterator<Item = f32>) {
        floats.into_iter().for_each(|float| self.put(&float.to_le_bytes()));
    }

    fn words(&mut self, words: &[u32]) {
        words.iter().for_each(|word| self.put(&word.to_le_bytes()));
    }
}

/// A hand's message with nine pads: value `at` of pad `pad` is `value(pad, at)`.
fn state(value: impl Fn(usize, usize) -> f32) -> Vec<u8> {
    let mut bytes = Bytes(Vec::new());
    bytes.words(&[7]);
    for motor in 0..7 {
        bytes.put(&[1]);
        bytes.floats([motor as f32, 0.0, 0.0, 0.0]);
        [25_i16, 26].iter().for_each(|degrees| bytes.put(&degrees.to_le_bytes()));
        bytes.floats([24.0]);
        bytes.words(&[0; 7]);
    }
    bytes.words(&[9]);
    for pad in 0..9 {
        bytes.floats((0..12).map(|at| value(pad, at)));
        bytes.floats([30.0; 12]);
        bytes.words(&[0, 0]);
    }
    bytes.floats([0.0; 13]);
    bytes.put(&25_i16.to_le_bytes());
    bytes.floats([24.0; 4]);
    bytes.words(&[0; 4]);
    [&[0, 1, 0, 0][..], &bytes.0].concat()
}

/// Three messages: pad 4 is pressed in the second, and one value of pad 0 counts as missing.
fn messages() -> Vec<(String, String, i64, Vec<u8>)> {
    let pressed = |frame: usize| {
        state(move |pad, at| match (pad, at) {
            (0, 0) => 30_000.0,
            (4, 5) if frame == 1 => 150_000.0,
            _ => 100_000.0,
        })
    };
    (0..3).map(|frame| (TOPIC.to_owned(), STATE.to_owned(), 10_000_000 * frame as i64, pressed(frame))).collect()
}

fn write_mcap(path: &Path, messages: &[(String, String, i64, Vec<u8>)]) {
    let to = BufWriter::new(File::create(path).unwrap());
    let mut writer = mcap::WriteOptions::new().compression(None).profile("ros2").create(to).unwrap();
    for (sequence, (topic, kind, log_ns, data)) in (0..).zip(messages) {
        let schema = writer.add_schema(kind, "ros2msg", DEFINITION.as_bytes()).unwrap();
        let channel_id = writer.add_channel(schema, topic, "cdr", &BTreeMap::new()).unwrap();
        let (log_time, publish_time) = (*log_ns as u64, *log_ns as u64);
        let header = mcap::records::MessageHeader { channel_id, sequence, log_time, publish_time };
        writer.write_to_known_channel(&header, data).unwrap();
    }
    writer.finish().unwrap();
}

/// The totals of the fields in each frame.
fn totals(text: &str) -> Vec<BTreeMap<String, f64>> {
    let of = |frame: &Value| {
        let fields = frame["fields"].as_array().unwrap().iter();
        fields.map(|field| (field["field"].as_str().unwrap().to_owned(), field["total"].as_f64().unwrap())).collect()
    };
    frames(text).iter().map(of).collect()
}

const ASKED: [&str; 6] = ["--backend", "reference", "--outputs", "total", "--all-fields", "--source"];

#[test]
fn a_hand_is_read_from_a_bag_by_a_map_and_by_its_name() {
    let folder = tempfile::tempdir().unwrap();
    let [bag, old, map] = ["hand.mcap", "hand.db3", "hand.toml"].map(|name| folder.path().join(name));
    write_mcap(&bag, &messages());
    // Without definitions, as bags up to Humble are.
    write_db3(&old, &messages());
    fs::write(
        &map,
        format!("message = '{TOPIC}'\nvalues = 'press_sensor_state[*].pressure'\ngrid = '9x12'\nmissing = [30000]\nscale = 1e-4\n"),
    )
    .unwrap();
    let run = output(&[&["run", "--map", text_of(&map)], &ASKED[..], &[text_of(&bag)]].concat());
    let said = stderr(&run);
    assert_eq!(run.status.code(), Some(0), "{said}");
    assert!(said.contains(&format!("{TOPIC} ({STATE}): press_sensor_state[*].pressure")), "{said}");
    assert!(said.contains("108 values a message; 30000 counts as missing; numbers are multiplied by 0.0001"), "{said}");
    assert!(said.contains("a body is made: a grid of 9 × 12 sensors"), "{said}");
    let sums: Vec<f64> = totals(&String::from_utf8(run.stdout).unwrap()).iter().map(|own| own["grid"]).collect();
    for (sum, right) in sums.iter().zip([1070.0, 1075.0, 1070.0]) {
        assert!((sum - right).abs() < 1e-3, "{sums:?}");
    }
    // A preset has pads of its own, also where the bag has no definitions.
    for source in [&bag, &old] {
        let run = output(&[&["run", "--map", "dex3"], &ASKED[..], &[text_of(source)]].concat());
        let said = stderr(&run);
        assert_eq!(run.status.code(), Some(0), "{said}");
        for says in ["untested", "public sources differ", "9 pads (pad_0 to pad_8) of 108 sensors"] {
            assert!(said.contains(says), "{says}: {said}");
        }
        let totals = totals(&String::from_utf8(run.stdout).unwrap());
        assert_eq!(totals[0]["pad_0"], 1_100_000.0);
        assert_eq!([0, 1, 2].map(|frame| totals[frame]["pad_4"]), [1_200_000.0, 1_250_000.0, 1_200_000.0]);
    }
    let described = done(&["info", text_of(&bag), "--map", "dex3", "--json"]);
    let described: Value = serde_json::from_str(&described).unwrap();
    assert_eq!((&described["frames"], &described["taxels"]), (&3.into(), &108.into()));
    let table = folder.path().join("hand.csv");
    done(&["convert", text_of(&bag), text_of(&table), "--map", text_of(&map)]);
    let text = fs::read_to_string(&table).unwrap();
    assert!(text.lines().count() == 4 && text.starts_with("t,0,1,"), "{text}");
}

#[test]
fn lines_of_json_are_read_from_files_and_live() {
    let lines = "{\"time\":0,\"sensordata\":[1,2,3,4]}\n{\"time\":0.5,\"sensordata\":[2,2,-1,4]}\n";
    let (folder, path) = file("touch.ndjson", lines);
    let map = folder.path().join("map.toml");
    fs::write(&map, "values = 'sensordata'\ngrid = '2x2'\npitch = '5mm'\nmissing = [-1]\ntime = 'time:s'\n").unwrap();
    let of_file = done(&[&["run", "--map", text_of(&map)], &ASKED[..], &[text_of(&path)]].concat());
    assert_eq!(totals(&of_file).iter().map(|own| own["grid"]).collect::<Vec<f64>>(), [10.0, 8.0]);
    for source in ["-", "text:-"] {
        let mut command = super::somatic(&[&["run", "--map", text_of(&map)], &ASKED[..], &[source]].concat());
        let run = command.stdin(File::open(&path).unwrap()).output().unwrap();
        assert_eq!(run.status.code(), Some(0), "{source}: {}", stderr(&run));
        let said = stderr(&run);
        assert!(String::from_utf8(run.stdout).unwrap() == of_file, "{source}: {said}");
    }
    let by_name = done(&[&["run", "--map", "mujoco"], &ASKED[..], &[text_of(&path)]].concat());
    assert_eq!(totals(&by_name)[0]["row"], 10.0);
}

#[test]
fn what_a_map_does_not_fit_is_refused_in_a_line() {
    let folder = tempfile::tempdir().unwrap();
    let (bag, map) = (folder.path().join("hand.mcap"), folder.path().join("map.toml"));
    write_mcap(&bag, &messages());
    let source = format!("ros2-mcap:{}", text_of(&bag));
    for (text, says) in [
        (
            "values = 'press_sensor_stat[*].pressure'\nmessage = '/dex3/left/state'",
            "did you mean `press_sensor_state`?",
        ),
        ("values = 'press_sensor_state[*].presure'\nmessage = '/dex3/left/state'", "did you mean `pressure`?"),
        ("values = 'power_v'\nmessage = '/dex3/right/state'", "there is no topic /dex3/right/state: it has"),
        ("values = 'press_sensor_state[9].pressure'", "`press_sensor_state` has 9 items, and [9] is asked for"),
        ("values = 'press_sensor_state[*].pressure'\ngrid = '3x4'", "grid: 3 × 4 are 12 sensors"),
    ] {
        fs::write(&map, text).unwrap();
        let why = refused(1, &["run", "--source", &source, "--map", text_of(&map), "--sink", "-"]);
        assert!(why.contains(says), "{text}: {why}");
    }
    fs::write(&map, "value = 'a'").unwrap();
    let why = refused(2, &["run", "--source", &source, "--map", text_of(&map), "--sink", "-"]);
    assert!(why.contains("line 1") && why.contains("`value`"), "{why}");
    let why = refused(2, &["run", "--source", &source, "--map", "dex4", "--sink", "-"]);
    assert!(why.contains("did you mean `dex3`?"), "{why}");
    let why = refused(2, &["run", "--source", "csv:a.csv", "--map", "dex3", "--sink", "-"]);
    assert!(why.contains("--map is for one ROS 2 bag or topic, NDJSON, or lines of JSON"), "{why}");
    // A message that is cut short is left out and counted.
    let mut cut = messages();
    cut[1].3.truncate(200);
    write_mcap(&bag, &cut);
    let run = output(&["run", "--source", &source, "--map", "dex3", "--sink", "-"]);
    assert_eq!(run.status.code(), Some(3), "{}", stderr(&run));
    assert!(stderr(&run).contains("damaged in one place"), "{}", stderr(&run));
}
