//! Arrays within messages of types that other programs define, by a map.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{BufWriter, Read as _, Write as _};
use std::net::TcpListener;
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
    write_defined(path, DEFINITION, messages);
}

fn write_defined(path: &Path, definition: &str, messages: &[(String, String, i64, Vec<u8>)]) {
    let to = BufWriter::new(File::create(path).unwrap());
    let mut writer = mcap::WriteOptions::new().compression(None).profile("ros2").create(to).unwrap();
    for (sequence, (topic, kind, log_ns, data)) in (0..).zip(messages) {
        let schema = writer.add_schema(kind, "ros2msg", definition.as_bytes()).unwrap();
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
        ("values = 'press_sensor_state[*].pressure'\ngrid = '3x5'", "grid: 3 × 5 are 15 sensors"),
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
    assert!(why.contains("--map is for ROS 2 bags and topics, NDJSON, lines of JSON, Modbus, or PaXini"), "{why}");
    // A message that is cut short is left out and counted.
    let mut cut = messages();
    cut[1].3.truncate(200);
    write_mcap(&bag, &cut);
    let run = output(&["run", "--source", &source, "--map", "dex3", "--sink", "-"]);
    assert_eq!(run.status.code(), Some(3), "{}", stderr(&run));
    assert!(stderr(&run).contains("damaged in one place"), "{}", stderr(&run));
}

/// Values of four sensors in frame `frame`, 50 a second: 2 s of rest at 100, then each is pressed for a fifth of a second.
fn pressed(frame: usize) -> [i64; 4] {
    let noise = [0, 1, -1][frame % 3];
    [0, 1, 2, 3].map(|sensor| 100 + noise + if frame >= 100 && frame / 10 == 11 + 2 * sensor { 300 } else { 0 })
}

#[test]
fn what_a_map_reads_is_calibrated_as_a_table_is() {
    const FRAMES: usize = 190;
    let folder = tempfile::tempdir().unwrap();
    let [lines, table, map, body, by_map, by_table] =
        ["s.ndjson", "s.csv", "map.toml", "row.glb", "by-map.toml", "by-table.toml"]
            .map(|name| folder.path().join(name));
    fs::write(&map, "values = 'pads[*].force'\nmissing = [-1]\n").unwrap();
    let line = |frame: usize| {
        let [a, b, c, d] = pressed(frame);
        let t_s = frame as f64 / 50.0;
        // A code that is no reading, where the table has a blank.
        let code = |value: i64| if frame == 7 { -1 } else { value };
        format!("{{\"t\":{t_s},\"pads\":[{{\"force\":[{a},{}]}},{{\"force\":[{c},{d}]}}]}}\n", code(b))
    };
    fs::write(&lines, (0..FRAMES).map(line).collect::<String>()).unwrap();
    let row = |frame: usize| {
        let [a, b, c, d] = pressed(frame);
        let b = if frame == 7 { String::new() } else { b.to_string() };
        format!("{},{a},{b},{c},{d}\n", frame as f64 / 50.0)
    };
    fs::write(&table, "t,0,1,2,3\n".to_owned() + &(0..FRAMES).map(row).collect::<String>()).unwrap();
    done(&["author", "--grid", "1x4", "--pitch", "10mm", "-o", text_of(&body)]);
    let of_table = ["calibrate", "--body", text_of(&body), "--source", text_of(&table), "--rest", "2", "--json"];
    let of_table = done(&[&of_table[..], &["-o", text_of(&by_table)]].concat());
    // The body is the map's where none is named.
    let of_map = ["calibrate", "--map", text_of(&map), "--rest", "2", "--json", "-o", text_of(&by_map), "--force"];
    let source = ["--source", text_of(&lines)];
    assert_eq!(done(&[&of_map[..], &source].concat()), of_table);
    let (own, other) = (fs::read_to_string(&by_map).unwrap(), fs::read_to_string(&by_table).unwrap());
    assert!(own.contains("body = \"map\"") && other.contains("body = \"row\""), "{own}{other}");
    assert_eq!(own.replace("body = \"map\"", "body = \"row\""), other);
    // Live, and with a body.
    let live = [&of_map[..], &["--source", "-", "--body", text_of(&body)]].concat();
    let calibrated = super::somatic(&live).stdin(File::open(&lines).unwrap()).output().unwrap();
    assert_eq!(calibrated.status.code(), Some(0), "{}", stderr(&calibrated));
    assert_eq!(String::from_utf8(calibrated.stdout).unwrap(), of_table);
    // Under it rest is nothing, and a press is felt.
    done(&[&of_map[..], &source].concat());
    let run = ["run", "--map", text_of(&map), "--calibration", text_of(&by_map), "--backend", "reference"];
    let all = totals(&done(&[&run[..], &["--outputs", "total", "--all-fields"], &source].concat()));
    assert!((0..100).all(|frame| all[frame]["row"] == 0.0) && (295.0..305.0).contains(&all[115]["row"]), "{all:?}");
    // A source that says nothing of its robot is not taken for the hand.
    let why = refused(2, &["calibrate", "--source", text_of(&table), "-o", text_of(&by_map), "--force"]);
    assert!(why.contains("name the robot as --body"), "{why}");
    let why =
        refused(2, &["calibrate", "--source", text_of(&table), "--map", "dex3", "-o", text_of(&by_map), "--force"]);
    assert!(why.contains("--map is for ROS 2 bags"), "{why}");
    let why =
        refused(2, &["calibrate", "--map", text_of(&map), "--source", text_of(&lines), "-o", text_of(&map), "--force"]);
    assert!(why.contains("this is the input"), "{why}");
}

#[test]
fn a_hand_is_calibrated_from_its_bag() {
    let folder = tempfile::tempdir().unwrap();
    let [bag, to] = ["hand.mcap", "hand.toml"].map(|name| folder.path().join(name));
    let raw = |frame: usize| {
        move |pad: usize, at: usize| match (pad, at) {
            // A sensor that is not there.
            (8, 11) => 30_000.0,
            _ if frame >= 210 && frame / 10 == 21 + 2 * pad => 150_000.0,
            _ => 100_000.0 + [0.0, 10.0, -10.0][(frame + at) % 3],
        }
    };
    let message = |frame: usize| (TOPIC.to_owned(), STATE.to_owned(), 10_000_000 * frame as i64, state(raw(frame)));
    write_mcap(&bag, &(0..400).map(message).collect::<Vec<_>>());
    let found =
        done(&["calibrate", "--map", "dex3", "--source", text_of(&bag), "--rest", "2", "--json", "-o", text_of(&to)]);
    let found: Value = serde_json::from_str(&found).unwrap();
    let sensors = found["sensors"].as_array().unwrap();
    assert_eq!((sensors.len(), &found["invert"]), (108, &false.into()));
    let travels =
        sensors.iter().filter(|sensor| (49_000.0..51_000.0).contains(&sensor["travel"].as_f64().unwrap_or(0.0)));
    assert_eq!(travels.count(), 107, "{found}");
    assert!(sensors[107]["baseline"].is_null(), "{found}");
    done(&["run", "--map", "dex3", "--source", text_of(&bag), "--calibration", text_of(&to), "--sink", "-"]);
}

const TACTILE: &str = "tactile_msgs/msg/TactileState";

/// A message with these sensors, each with its values.
fn tactile(sec: u32, sensors: &[(&str, &[f32])]) -> Vec<u8> {
    let mut bytes = Bytes(Vec::new());
    let text = |bytes: &mut Bytes, text: &str| {
        bytes.words(&[text.len() as u32 + 1]);
        bytes.0.extend_from_slice(text.as_bytes());
        bytes.0.push(0);
    };
    bytes.words(&[sec, 0]);
    text(&mut bytes, "hand");
    bytes.words(&[sensors.len() as u32]);
    for (name, values) in sensors {
        text(&mut bytes, name);
        bytes.words(&[values.len() as u32]);
        bytes.floats(values.iter().copied());
    }
    [&[0, 1, 0, 0][..], &bytes.0].concat()
}

#[test]
fn sensors_that_have_names_are_fields() {
    let folder = tempfile::tempdir().unwrap();
    let bag = folder.path().join("touch.db3");
    let message = |sec: u32, sensors: &[(&str, &[f32])]| {
        ("/tactile".to_owned(), TACTILE.to_owned(), i64::from(sec) * 1_000_000_000, tactile(sec, sensors))
    };
    let thumb =
        |tip: f32| message(tip as u32, &[("thumb_tip", &[tip, 1.0, 2.0]), ("palm", &[4.0]), ("palm", &[5.0, 6.0])]);
    write_db3(&bag, &[thumb(1.0), thumb(2.0)]);
    let run =
        |more: &[&str]| output(&[&["run", "--map", "tactile-state"], &ASKED[..], &[text_of(&bag)], more].concat());
    let reported = run(&[]);
    let said = stderr(&reported);
    assert_eq!(reported.status.code(), Some(0), "{said}");
    assert!(said.contains("6 values a message of 3 sensors, thumb_tip to palm"), "{said}");
    assert!(
        said.contains("a body is made: 3 pads (thumb_tip to palm_2) of 6 sensors; where they lie is a guess"),
        "{said}"
    );
    let all = totals(&String::from_utf8(reported.stdout).unwrap());
    let fields = |tip: f64| {
        [("palm", 4.0), ("palm_2", 11.0), ("thumb_tip", tip + 3.0)].map(|(name, sum)| (name.to_owned(), sum))
    };
    assert_eq!(all, [BTreeMap::from(fields(1.0)), BTreeMap::from(fields(2.0))]);
    // A message whose sensors stand in another order is not taken for the first ones.
    let turned = message(3, &[("palm", &[4.0]), ("thumb_tip", &[1.0, 1.0, 2.0]), ("palm", &[5.0, 6.0])]);
    fs::remove_file(&bag).unwrap();
    write_db3(&bag, &[thumb(1.0), turned, thumb(2.0)]);
    assert!(stderr(&run(&[])).contains("its sensors have other names than those of the first message"));
    let skipped = run(&["--skip-bad"]);
    assert_eq!(skipped.status.code(), Some(3), "{}", stderr(&skipped));
    assert_eq!(frames(&String::from_utf8(skipped.stdout).unwrap()).len(), 2);
    // The same as lines of JSON, as rosbridge sends them.
    let line = r#"{"header":{"stamp":{"sec":1,"nanosec":0}},"sensors":[{"name":"thumb_tip","values":[1,1,2]},{"name":"palm","values":[4]},{"name":"palm","values":[5,6]}]}"#;
    let path = folder.path().join("touch.ndjson");
    fs::write(&path, line).unwrap();
    let of_lines = done(&[&["run", "--map", "tactile-state"], &ASKED[..], &[text_of(&path)]].concat());
    assert_eq!(totals(&of_lines), all[..1]);
}

/// A hand that answers reads of registers over Modbus TCP: the thumb's tip is pressed from the twentieth round of its pads on.
fn hand() -> String {
    const THUMB_TIP: u16 = 4480;
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap().to_string();
    std::thread::spawn(move || {
        let (mut stream, _) = listener.accept().unwrap();
        let (mut request, mut rounds) = ([0; 12], 0);
        while stream.read_exact(&mut request).is_ok() {
            let number = |at: usize| u16::from_be_bytes([request[at], request[at + 1]]);
            let (first, count) = (number(8), number(10));
            rounds += usize::from(first == THUMB_TIP);
            let value: u16 = if first == THUMB_TIP && rounds > 20 { 500 } else { 40 };
            let length = (3 + 2 * count).to_be_bytes();
            let head = [&request[..4], &length, &[request[6], 3, 2 * count as u8]].concat();
            let registers: Vec<u8> = (0..count).flat_map(|_| value.to_be_bytes()).collect();
            if stream.write_all(&[head, registers].concat()).is_err() {
                break;
            }
        }
    });
    address
}

#[test]
fn registers_of_a_hand_are_frames() {
    let source = format!("modbus://{}", hand());
    let run = output(&[&["run", "--map", "inspire", "--for", "2s", "--sink", "-"], &ASKED[..], &[&source]].concat());
    let said = stderr(&run);
    assert_eq!(run.status.code(), Some(0), "{said}");
    for says in
        ["registers of fingerone_tip_touch to palm_touch; time is when they come: 1062 values", "untested", "17 pads"]
    {
        assert!(said.contains(says), "{says}: {said}");
    }
    let all = totals(&String::from_utf8(run.stdout).unwrap());
    assert!(all.len() > 25, "{} frames", all.len());
    assert_eq!((all[0]["thumb_tip"], all[0]["palm"], all[24]["thumb_tip"]), (360.0, 4480.0, 4500.0));
    let why = refused(2, &["run", "--source", "modbus://127.0.0.1:1", "--body", "hand", "--sink", "-"]);
    assert!(why.contains("a map names the registers that are sensors; add --map FILE, or --map inspire"), "{why}");
    let why = refused(2, &["run", "--source", &source, "--map", "dex3", "--sink", "-"]);
    assert!(why.contains("dex3: registers: name them, as registers = { palm = [4900, 112] }"), "{why}");
    let why = refused(2, &["run", "--source", "modbus://hand:x", "--map", "inspire", "--sink", "-"]);
    assert!(why.contains("`hand:x` is not a device; write modbus://HOST:PORT"), "{why}");
}

/// Sixteen taxels of a XELA sensor: of taxel `at` the forces are `at`, 1 and 2·`at` in frame 1, and nothing else.
fn xela(frame: u32) -> Vec<u8> {
    let mut bytes = Bytes(Vec::new());
    bytes.words(&[1, 7 + frame]);
    bytes.put(&1_695_696_620.5_f64.to_le_bytes());
    bytes.words(&[7]);
    bytes.0.extend_from_slice(b"uSPa44\0");
    bytes.put(&[1]);
    bytes.words(&[16]);
    (0..48).for_each(|_| bytes.put(&49_331_u16.to_le_bytes()));
    bytes.words(&[16]);
    bytes
        .floats((0..16).flat_map(|at: u8| [f32::from(at), 1.0, 2.0 * f32::from(at)]).map(|force| force * frame as f32));
    [&[0, 1, 0, 0][..], &bytes.0].concat()
}

/// Nine pillars as the manual has them, with ids of 32 bits and no header: the forces of pillar `at` are −`at`, 0.5 and `at` in frame 1.
fn papillarray(frame: u32) -> Vec<u8> {
    let mut bytes = Bytes(Vec::new());
    bytes.put(&123_i64.to_le_bytes());
    bytes.words(&[9]);
    for at in 0..9_u8 {
        bytes.words(&[at.into()]);
        bytes.floats([0.0, 0.0, 0.0]);
        bytes.floats([-f32::from(at), 0.5, f32::from(at)].map(|force| force * frame as f32));
        bytes.put(&[1]);
        bytes.words(&[2]);
    }
    bytes.floats([0.0; 8]);
    bytes.put(&[0]);
    bytes.put(&[0]);
    [&[0, 1, 0, 0][..], &bytes.0].concat()
}

const PILLARS: &str = "\
int64 tus
PillarState[] pillars
float32 gfx
float32 gfy
float32 gfz
float32 gtx
float32 gty
float32 gtz
float32 friction_est
float32 target_grip_force
bool is_sd_active
bool is_ref_loaded
================================================================================
MSG: sensor_interfaces/PillarState
int32 id
float32 dx
float32 dy
float32 dz
float32 fx
float32 fy
float32 fz
bool in_contact
int32 slip_state
";

#[test]
fn sensors_with_three_axes_come_from_bags_by_their_names() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let pillars: Vec<_> = (0..2)
        .map(|frame| {
            let kind = "sensor_interfaces/msg/SensorState".to_owned();
            ("/hub_0/sensor_0".to_owned(), kind, 10_000_000 * i64::from(frame), papillarray(frame))
        })
        .collect();
    write_defined(&path("pillars.mcap"), PILLARS, &pillars);
    // Without a definition, as recorders before Iron have it.
    let xela_kind = "xela_server_ros2/msg/SensStream".to_owned();
    let sent: Vec<_> = (0..2)
        .map(|frame| ("/xServTopic".to_owned(), xela_kind.clone(), 10_000_000 * i64::from(frame), xela(frame)))
        .collect();
    write_db3(&path("xela.db3"), &sent);
    for (bag, map, says, taxels, last) in [
        ("pillars.mcap", "contactile", "3 × 3 sensors", 9, ["-8", "0.5", "8"]),
        ("xela.db3", "xela-ros2", "a grid of 4 × 4 sensors", 16, ["15", "1", "30"]),
    ] {
        let (table, bag) = (path(&format!("{map}.csv")), path(bag));
        let source = format!("ros2-mcap:{}", bag.display());
        let made = output(&["convert", &source, text_of(&table), "--map", map]);
        assert!(made.status.success() && stderr(&made).contains("untested"), "{}", stderr(&made));
        let text = fs::read_to_string(&table).unwrap();
        let rows: Vec<Vec<&str>> = text.lines().map(|line| line.split(',').collect()).collect();
        assert_eq!((rows.len(), rows[0].len()), (3, 1 + 3 * taxels), "{text}");
        let at = |name: String| rows[0].iter().position(|head| **head == name).unwrap();
        let number = taxels - 1;
        let found =
            [at(format!("{number}.u")), at(format!("{number}.v")), at(number.to_string())].map(|at| rows[2][at]);
        assert_eq!(found, last, "{text}");
        let run =
            output(&["run", "--source", &source, "--map", map, "--backend", "reference", "--outputs", "total,shear"]);
        assert!(stderr(&run).contains(says) && stderr(&run).contains("each has three axes"), "{}", stderr(&run));
        let field = &frames(&String::from_utf8_lossy(&run.stdout))[1]["fields"];
        assert!(field.as_array().unwrap().iter().any(|field| field["shear"].is_array()), "{field}");
    }
}
