//! Limbs and a head as commands on this computer, for tests, and what the head has seen.

use std::collections::{BTreeMap, BTreeSet};
use std::io::{BufRead as _, BufReader, Write as _};
use std::net::TcpListener;
use std::path::PathBuf;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::{Arc, Mutex};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use serde_json::{Value, json};
use tempfile::TempDir;

use super::{code_of, somatic};

/// Outputs that one frame alone decides, so that they are the same whatever frames came before.
pub const OUTPUTS: &str = "total,peak,active,area,centroid,orientation,principal_axis";
/// Fields of the hand that share no taxel, each a limb of its own.
pub const LIMBS: [&str; 4] = ["hand/midhand/thumb", "hand/midhand/index", "hand/midhand/middle", "hand/midhand/ring"];
pub const PERIOD: Duration = Duration::from_millis(20);

/// A port that nobody listens on.
pub fn free_port() -> u16 {
    TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port()
}

/// Files of Zenoh's configuration, and what else the commands write.
pub struct Place(TempDir);

impl Place {
    pub fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    pub fn path(&self, name: &str) -> String {
        self.0.path().join(name).display().to_string()
    }

    /// A configuration of a peer that listens on `listen` and connects to `connect`, if there are any.
    pub fn config(&self, name: &str, listen: Option<u16>, connect: Option<u16>) -> String {
        let at = |port: u16| format!("127.0.0.1:{port}");
        self.config_of(name, "peer", listen.map(at), connect.map(at))
    }

    /// The same in another mode, at addresses.
    pub fn config_of(&self, name: &str, mode: &str, listen: Option<String>, connect: Option<String>) -> String {
        let endpoint = |at: Option<String>| -> Vec<String> { at.iter().map(|at| format!("tcp/{at}")).collect() };
        let config = json!({
            "mode": mode,
            "listen": {"endpoints": endpoint(listen)},
            // As often as a test wants it.
            "connect": {"endpoints": endpoint(connect), "timeout_ms": -1, "exit_on_failure": false, "retry": {"period_init_ms": 200, "period_max_ms": 400}},
            "scouting": {"multicast": {"enabled": false}, "gossip": {"enabled": false}},
        });
        std::fs::write(self.path(name), config.to_string()).unwrap();
        self.path(name)
    }
}

/// Lines that a command writes, as they come.
#[derive(Clone, Default)]
pub struct Lines(pub Arc<Mutex<Vec<(Instant, String)>>>);

impl Lines {
    pub fn read(from: impl std::io::Read + Send + 'static) -> (Self, JoinHandle<()>) {
        let lines = Self::default();
        let to = lines.clone();
        let reader = thread::spawn(move || {
            for line in BufReader::new(from).lines().map_while(Result::ok) {
                to.0.lock().unwrap().push((Instant::now(), line));
            }
        });
        (lines, reader)
    }

    pub fn has(&self, part: &str) -> bool {
        self.0.lock().unwrap().iter().any(|(_, line)| line.contains(part))
    }

    pub fn all(&self) -> Vec<String> {
        self.0.lock().unwrap().iter().map(|(_, line)| line.clone()).collect()
    }
}

/// A command that runs, whose standard output and standard error are read.
pub struct Running {
    child: Child,
    pub out: Lines,
    pub reported: Lines,
    readers: Vec<JoinHandle<()>>,
}

impl Running {
    /// Starts it, in the network namespace `space` if there is one.
    pub fn start(space: Option<&str>, arguments: &[&str]) -> Self {
        let mut command = somatic(arguments);
        if let Some(space) = space {
            let mut within = Command::new("ip");
            within.args(["netns", "exec", space]).arg(command.get_program()).args(command.get_args());
            command = within;
        }
        let mut child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        let (out, first) = Lines::read(child.stdout.take().unwrap());
        let (reported, second) = Lines::read(child.stderr.take().unwrap());
        Self { child, out, reported, readers: vec![first, second] }
    }

    pub fn take_input(&mut self) -> ChildStdin {
        self.child.stdin.take().unwrap()
    }

    /// Waits for its end; gives what it has printed.
    pub fn end(mut self, codes: &[i32]) -> (Vec<String>, Vec<String>) {
        let code = code_of(&mut self.child);
        assert!(code.is_some_and(|code| codes.contains(&code)), "{code:?}: {:?}", self.reported.all());
        self.readers.drain(..).for_each(|reader| reader.join().unwrap());
        (self.out.all(), self.reported.all())
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// A computer of a limb: a command that gets frames on standard input.
pub struct Limb {
    pub running: Running,
    input: Option<ChildStdin>,
    /// The ids of the limb's taxels.
    pub taxels: Vec<u32>,
    begin: Instant,
    /// When each frame was written.
    pub written: Vec<Instant>,
}

impl Limb {
    pub fn start(field: &str, key: &str, config: &str) -> Self {
        Self::start_in(None, field, key, config)
    }

    /// The same in a network namespace.
    pub fn start_in(space: Option<&str>, field: &str, key: &str, config: &str) -> Self {
        Self::start_as(space, field, key, config, &["--outputs", OUTPUTS, "--all-fields"])
    }

    /// The same with any outputs and further sinks.
    pub fn start_as(space: Option<&str>, field: &str, key: &str, config: &str, more: &[&str]) -> Self {
        let sink = if key.contains(':') { key.to_owned() } else { format!("zenoh:{key}") };
        let arguments =
            ["run", "--fields", field, "--source", "-", "--backend", "cpu", "--sink", &sink, "--zenoh-config", config];
        let mut running = Running::start(space, &[&arguments[..], more].concat());
        let input = Some(running.take_input());
        Self { running, input, taxels: taxels_of(field), begin: Instant::now(), written: Vec::new() }
    }

    /// Sends the frame `row`, at `t_s` on the limb's clock.
    pub fn send_at(&mut self, row: u64, t_s: f64) {
        self.send_values(t_s, |index| value(row, index));
    }

    /// Sends a frame in which every taxel has the same raw value.
    pub fn send_all(&mut self, value: f64) {
        self.send_values(self.begin.elapsed().as_secs_f64(), |_| value);
    }

    fn send_values(&mut self, t_s: f64, value: impl Fn(usize) -> f64) {
        self.send_line(t_s, |index| json!(value(index)));
    }

    /// Sends a frame in which taxel `index` of the limb has this value, which is an array of a taxel with three axes.
    pub fn send_line(&mut self, t_s: f64, value: impl Fn(usize) -> Value) {
        let values: BTreeMap<String, Value> =
            self.taxels.iter().enumerate().map(|(index, id)| (id.to_string(), value(index))).collect();
        let line = json!({"t": t_s, "values": values});
        self.written.push(Instant::now());
        writeln!(self.input.as_mut().unwrap(), "{line}").unwrap();
    }

    pub fn send(&mut self, row: u64) {
        self.send_at(row, self.begin.elapsed().as_secs_f64());
    }

    /// Ends it: no more frames come.
    pub fn end(mut self) -> Vec<String> {
        drop(self.input.take());
        self.running.end(&[0]).1
    }
}

/// The raw value of a limb's taxel in a row: of every row another total.
pub fn value(row: u64, taxel: usize) -> f64 {
    (100 + row * 3 + [7, 0, 90, 31, 52][taxel % 5]) as f64
}

/// The ids of the members of `field` on the hand.
pub fn taxels_of(field: &str) -> Vec<u32> {
    let inspected: Value = serde_json::from_str(&super::done(&["inspect", "hand", "--json"])).unwrap();
    let fields = inspected["fields"].as_array().unwrap();
    let members = &fields.iter().find(|own| own["name"] == field).unwrap()["members"];
    members.as_array().unwrap().iter().map(|member| member["taxel"].as_u64().unwrap() as u32).collect()
}

/// The percepts of `field` in each of `rows` rows where nothing is distributed, as text; and the row of each.
pub fn undistributed(place: &Place, field: &str, rows: u64) -> BTreeMap<String, u64> {
    let taxels = taxels_of(field);
    let mut text = format!("t,{}\n", taxels.iter().map(u32::to_string).collect::<Vec<_>>().join(","));
    for row in 0..rows {
        let values: Vec<String> = (0..taxels.len()).map(|taxel| value(row, taxel).to_string()).collect();
        text += &format!("{},{}\n", row as f64 * PERIOD.as_secs_f64(), values.join(","));
    }
    let lines = run_undistributed(place, field, &text, &["--outputs", OUTPUTS]);
    let all: BTreeMap<String, u64> =
        lines.iter().zip(0..).map(|(line, row)| (line["fields"][0].to_string(), row)).collect();
    assert_eq!(all.len() as u64, rows, "every row has percepts of its own");
    all
}

/// What a run of `field` alone writes for the frames of the table `text`.
pub fn run_undistributed(place: &Place, field: &str, text: &str, more: &[&str]) -> Vec<Value> {
    let path = place.path("undistributed.csv");
    std::fs::write(&path, text).unwrap();
    let source = format!("csv:{path}");
    let arguments =
        ["run", "-q", "--source", &source, "--fields", field, "--backend", "cpu", "--all-fields", "--sink", "-"];
    super::frames(&super::done(&[&arguments[..], more].concat()))
}

/// A head that hears limbs under `keys`, its arguments, and where it writes its summary.
pub struct Head {
    pub running: Running,
    summary: String,
}

impl Head {
    pub fn start(place: &Place, keys: &[&str], config: &str, more: &[&str]) -> Self {
        let fields = ["--outputs", OUTPUTS, "--fields", "hand/midhand/*", "--all-fields"];
        Self::start_with(place, keys, config, &[&fields, more].concat())
    }

    /// The same with any fields and outputs.
    pub fn start_with(place: &Place, keys: &[&str], config: &str, more: &[&str]) -> Self {
        let summary = place.path("summary.json");
        let sources: Vec<String> =
            keys.iter().flat_map(|key| ["--source".to_owned(), format!("zenoh:{key}")]).collect();
        let mut arguments = vec![
            "run",
            "--backend",
            "cpu",
            "--sink",
            "-",
            "--zenoh-config",
            config,
            "--summary",
            &summary,
            // A busy machine is no silent limb.
            "--max-age",
            "0.5",
            "--force",
        ];
        arguments.extend(sources.iter().map(String::as_str));
        arguments.extend(more);
        Self { running: Running::start(None, &arguments), summary: summary.clone() }
    }

    /// Ends it as Ctrl-C does. Its lines of percepts, its messages, and its summary by limb.
    pub fn end(self, codes: &[i32]) -> (Vec<Value>, Vec<String>, BTreeMap<String, Value>) {
        let id = self.running.child.id().to_string();
        assert!(Command::new("kill").args(["-INT", &id]).status().unwrap().success());
        let summary = PathBuf::from(&self.summary);
        let (out, reported) = self.running.end(codes);
        let summary: Value = serde_json::from_str(&std::fs::read_to_string(summary).unwrap()).unwrap();
        let limbs = summary["boards"].as_array().unwrap();
        let by_key = limbs.iter().map(|limb| (limb["limb"].as_str().unwrap().to_owned(), limb.clone())).collect();
        (super::frames(&out.join("\n")), reported, by_key)
    }
}

pub fn wait_for(what: &str, mut until: impl FnMut() -> bool) {
    let begin = Instant::now();
    while !until() {
        assert!(begin.elapsed() < Duration::from_secs(30), "{what} does not happen");
        thread::sleep(Duration::from_millis(5));
    }
}

/// Has all `limbs` send frames, from `row` on, until `until`; the row after the last.
pub fn play(limbs: &mut [Limb], row: u64, until: impl FnMut(u64) -> bool) -> u64 {
    play_by(limbs, row, Limb::send, until)
}

/// The same, with frames that `send` sends.
pub fn play_by(
    limbs: &mut [Limb],
    mut row: u64,
    send: impl Fn(&mut Limb, u64),
    mut until: impl FnMut(u64) -> bool,
) -> u64 {
    let begin = Instant::now();
    let mut due = begin;
    while !until(row) {
        thread::sleep(due.saturating_duration_since(Instant::now()));
        due += PERIOD;
        limbs.iter_mut().for_each(|limb| send(limb, row));
        row += 1;
        assert!(begin.elapsed() < Duration::from_secs(40), "it goes on and on");
    }
    row
}

pub fn number(of: &Value) -> u64 {
    of.as_u64().unwrap_or_else(|| panic!("{of} is not a number"))
}

/// What a head saw of a limb's field.
#[derive(Debug, Default)]
pub struct Seen {
    /// The rows whose percepts came, each once.
    pub rows: BTreeSet<u64>,
    pub stale: u64,
    pub others: u64,
}

/// Compares the head's percepts of `field` with those of the undistributed run: each is that of a row, and no row comes after
/// a later one.
pub fn compared(lines: &[Value], field: &str, undistributed: &BTreeMap<String, u64>) -> Seen {
    let mut seen = Seen::default();
    let mut last = None;
    for line in lines {
        let Some(percept) = line["fields"].as_array().unwrap().iter().find(|own| own["field"] == field) else {
            continue;
        };
        let flags = percept["flags"].as_array().unwrap();
        if flags.iter().any(|flag| flag == "stale") {
            assert!(percept.get("total").is_none_or(|total| total == 0.0), "nothing is filled in: {percept}");
            seen.stale += 1;
            continue;
        }
        match undistributed.get(&percept.to_string()) {
            Some(&row) => {
                assert!(last.is_none_or(|last| last <= row), "row {row} after {last:?}");
                last = Some(row);
                seen.rows.insert(row);
            }
            // Before a limb is heard its taxels are missing.
            None if flags.iter().any(|flag| flag == "incomplete") => seen.others += 1,
            None => panic!("no row has this: {percept}"),
        }
    }
    seen
}

/// Whether the head has percepts of all four limbs.
pub fn limbs_are_read(head: &Head) -> bool {
    let lines = head.running.out.0.lock().unwrap();
    let Some(last) = lines.last().and_then(|(_, line)| serde_json::from_str::<Value>(line).ok()) else { return false };
    let fields = last["fields"].as_array().unwrap();
    fields.iter().filter(|field| field["contact"] == true).count() == 4
}
