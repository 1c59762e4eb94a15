//! Damaged input for every parser: no panic, no hang, no huge allocation, nothing lost in silence.
//!
//! A target has sound inputs and a check. Case `n` of a target is made from `SOMATIC_FUZZ_SEED` (default 1) and `n` alone, so that
//! every run repeats; `SOMATIC_FUZZ_SECONDS` is the time per target (by default all of them take a minute together), or
//! `SOMATIC_FUZZ_INPUTS` their number.
//! A failing input stays in the folder that the message names; `SOMATIC_FUZZ_FILE` gives a target that one input. The run of an hour:
//! `tests/long/fuzz`; that of a million inputs for each format of text: `tests/long/lines`.

mod mutate;
mod program;
mod seeds;
mod targets;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};

use mutate::Mutator;

/// A case may take this much processor time of its thread, and this long on the clock: it may wait for others.
const MAX_CPU_S: f64 = 5.0;
const MAX_WAIT: Duration = Duration::from_secs(60);

/// Memory that a case may hold at once, bytes.
const MAX_BYTES: u64 = 1 << 29;

/// A sound input, or one made from it.
pub(crate) struct Case<'a> {
    pub(crate) bytes: &'a [u8],
    /// A file with these bytes, alone in its folder but for what the target puts there.
    pub(crate) path: &'a Path,
    /// The sound input from which it was made.
    pub(crate) sound: &'a [u8],
}

impl Case<'_> {
    pub(crate) fn text(&self) -> std::borrow::Cow<'_, str> {
        String::from_utf8_lossy(self.bytes)
    }
}

/// What a parser makes of a case: whether it takes it, or why something is wrong with the parser.
pub(crate) type Verdict = Result<bool, String>;

pub(crate) struct Target {
    pub(crate) name: &'static str,
    /// The name of the file that holds a case.
    pub(crate) file: &'static str,
    pub(crate) seeds: Vec<Vec<u8>>,
    pub(crate) check: Box<dyn Fn(&Case<'_>) -> Verdict + Send>,
}

/// How far the thread is that runs the cases.
#[derive(Default)]
struct Progress {
    cases: AtomicU64,
    taken: AtomicU64,
    has_ended: AtomicBool,
}

/// What all targets take together by default, s.
const TOGETHER_S: f64 = 60.0;

fn number<T: std::str::FromStr>(name: &str, default: T) -> T {
    std::env::var(name)
        .map_or(default, |text| text.parse().unwrap_or_else(|_| panic!("{name} is not a number that fits: {text}")))
}

/// Runs `target`, and fails with the input that shows a fault.
pub(crate) fn fuzz(make: impl FnOnce() -> Target) {
    let target = make();
    let name = target.name;
    let seed: u64 = number("SOMATIC_FUZZ_SEED", 1);
    let inputs: u64 = number("SOMATIC_FUZZ_INPUTS", u64::MAX);
    // Where their number is given, time is no end.
    let together_s = if inputs < u64::MAX { f64::from(u32::MAX) } else { TOGETHER_S };
    let seconds: f64 = number("SOMATIC_FUZZ_SECONDS", together_s / NAMES.len() as f64);
    let length = Length { time: Duration::from_secs_f64(seconds), inputs };
    let folder = std::env::temp_dir().join(format!("somatic-fuzz-{}", std::process::id())).join(name);
    std::fs::create_dir_all(&folder).unwrap();
    let path = folder.join(target.file);
    let only = std::env::var_os("SOMATIC_FUZZ_FILE").map(|file| std::fs::read(file).unwrap());
    let progress = Arc::new(Progress::default());
    let (sender, receiver) = std::sync::mpsc::channel();
    let (shown, file) = (Arc::clone(&progress), path.clone());
    // What a main thread has; without optimisation frames are several times as large.
    let stack = if cfg!(debug_assertions) { 64 << 20 } else { 8 << 20 };
    let thread = std::thread::Builder::new().stack_size(stack).spawn(move || {
        let _ = sender.send(Note::Thread(std::fs::read_link("/proc/thread-self").ok()));
        let result = run(&target, seed, &length, &file, only, &shown);
        shown.has_ended.store(true, Ordering::Relaxed);
        let _ = sender.send(Note::Ended(result));
    });
    thread.unwrap();
    let what = |fault: &str| format!("fuzz target {name}, seed {seed}: {fault}; the input is {}", path.display());
    let mut thread = None;
    let (mut last, mut since, mut cpu_s) = (u64::MAX, Instant::now(), 0.0);
    let result = loop {
        match receiver.recv_timeout(Duration::from_millis(200)) {
            Ok(Note::Thread(of)) => thread = of,
            Ok(Note::Ended(result)) => break result,
            Err(std::sync::mpsc::RecvTimeoutError::Disconnected) => panic!("{}", what("its thread ended")),
            Err(std::sync::mpsc::RecvTimeoutError::Timeout) => {
                let cases = progress.cases.load(Ordering::Relaxed);
                if cases != last {
                    (last, since, cpu_s) = (cases, Instant::now(), cpu_time_s(thread.as_deref()).unwrap_or(0.0));
                }
                let spent_s = cpu_time_s(thread.as_deref()).map_or(since.elapsed().as_secs_f64(), |now| now - cpu_s);
                assert!(spent_s <= MAX_CPU_S, "{}", what(&format!("not done after {MAX_CPU_S} s")));
                assert!(since.elapsed() <= MAX_WAIT, "{}", what("it waits without end"));
            }
        }
    };
    if let Err(fault) = result {
        panic!("{}", what(&fault));
    }
    let (cases, taken) = (progress.cases.load(Ordering::Relaxed), progress.taken.load(Ordering::Relaxed));
    eprintln!("fuzz\t{name}\t{cases}\t{taken}");
    let _ = std::fs::remove_dir_all(&folder);
}

/// How long a target is tried.
struct Length {
    time: Duration,
    inputs: u64,
}

enum Note {
    Thread(Option<PathBuf>),
    Ended(Result<(), String>),
}

/// Processor time of a thread of this process, s, if the system tells it.
fn cpu_time_s(thread: Option<&Path>) -> Option<f64> {
    let stat = std::fs::read_to_string(Path::new("/proc").join(thread?).join("stat")).ok()?;
    let numbers: Vec<&str> = stat.rsplit_once(')')?.1.split_whitespace().collect();
    let ticks = |at: usize| numbers.get(at)?.parse::<f64>().ok();
    // Hundredths of a second on every Linux.
    Some((ticks(11)? + ticks(12)?) / 100.0)
}

fn run(
    target: &Target,
    seed: u64,
    length: &Length,
    path: &Path,
    only: Option<Vec<u8>>,
    progress: &Progress,
) -> Result<(), String> {
    let name_hash = target
        .name
        .bytes()
        .fold(0xCBF2_9CE4_8422_2325, |hash: u64, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01B3));
    let try_one = |bytes: &[u8], sound: &[u8]| -> Verdict {
        // Before it is parsed: a crash of the whole process leaves it there.
        std::fs::write(path, bytes).map_err(|e| format!("cannot write the case: {e}"))?;
        let case = Case { bytes, path, sound };
        let mut verdict = Ok(false);
        let used = allocation_counter::measure(|| {
            verdict = catch_unwind(AssertUnwindSafe(|| (target.check)(&case))).unwrap_or_else(|panic| {
                let text = panic.downcast_ref::<String>().map(String::as_str);
                Err(format!("it panicked: {}", text.or(panic.downcast_ref::<&str>().copied()).unwrap_or("?")))
            });
        });
        if used.bytes_max > MAX_BYTES {
            return Err(format!("it held {} MiB at once", used.bytes_max >> 20));
        }
        verdict
    };
    if let Some(bytes) = only {
        return try_one(&bytes, &target.seeds[0]).map(|_| ());
    }
    for sound in &target.seeds {
        if !try_one(sound, sound)? {
            return Err("it refuses a sound input".to_owned());
        }
        progress.cases.fetch_add(1, Ordering::Relaxed);
    }
    let started = Instant::now();
    let mut case = 0_u64;
    while started.elapsed() < length.time && case < length.inputs {
        let mut mutator = Mutator::new(seed ^ name_hash.wrapping_add(case.wrapping_mul(0x9E37_79B9_7F4A_7C15)));
        let sound = &target.seeds[mutator.below(target.seeds.len())];
        let bytes = mutator.damaged(sound, &target.seeds);
        let taken = try_one(&bytes, sound).map_err(|fault| format!("case {case}: {fault}"))?;
        progress.taken.fetch_add(u64::from(taken), Ordering::Relaxed);
        progress.cases.fetch_add(1, Ordering::Relaxed);
        case += 1;
    }
    Ok(())
}

/// A test a target, called as it.
macro_rules! targets {
    ($($name:ident)*) => {
        $(
            #[test]
            fn $name() {
                fuzz(targets::$name);
            }
        )*

        /// The names of all targets.
        const NAMES: &[&str] = &[$(stringify!($name)),*];
    };
}

targets! {
    csv csv_skin ndjson text xsensor xsensor_groups tekscan emed pedar pliance loadsol footscan stappone matrix insoles mcap bag_metadata bag bag_db3 point_cloud joint_state transforms
    number_array urdf urdf_joints mjcf collada stl obj ply glb gltf body_extras icub recipe scene calibration wiring simulation
    map mapped_lines board_line http web_socket source_names sink_names grid regions joint_states
}

#[test]
fn a_fault_is_found() {
    let target = |check: fn(&Case<'_>) -> Verdict| Target {
        name: "control",
        file: "case",
        seeds: vec![b"a sound input of some length".to_vec()],
        check: Box::new(check),
    };
    let found = |check: fn(&Case<'_>) -> Verdict| {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("case");
        let progress = Progress::default();
        let length = Length { time: Duration::from_secs(1), inputs: u64::MAX };
        run(&target(check), 1, &length, &path, None, &progress).map(|()| progress.cases.into_inner())
    };
    assert!(found(|_| Ok(true)).unwrap() > 100, "so few cases");
    let panics = |case: &Case<'_>| {
        assert!(case.bytes.len() > 3, "too short");
        Ok(true)
    };
    assert!(found(panics).unwrap_err().contains("it panicked: too short"));
    let allocates = |case: &Case<'_>| {
        if case.bytes != case.sound {
            drop(std::hint::black_box(vec![0_u8; 1 << 30]));
        }
        Ok(true)
    };
    assert!(found(allocates).unwrap_err().contains("it held 1024 MiB"));
    assert!(found(|_| Ok(false)).unwrap_err().contains("refuses a sound input"));
}
