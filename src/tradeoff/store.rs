//! Stores measurements, one file per body and scene, and checks whether they are still valid.

use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

use serde::{Deserialize, Serialize};

use super::Report;
use crate::body::Body;
use crate::engine::Options;
use crate::error::{Error, Result};
use crate::limits::{self, MAX_SYSTEM_BYTES};
use crate::output::OutputPaths;
use crate::scene::Knobs;

/// Version of the files.
const VERSION: u32 = 3;

/// A folder of measurements.
#[derive(Clone, Debug)]
pub struct Store {
    folder: PathBuf,
}

#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
struct Key {
    version: u32,
    program: String,
    machine: String,
    driver: String,
    body: String,
    scene: String,
}

/// A stored measurement.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Stored {
    key: Key,
    /// The recording it was made on, as given to [`Store::keep`].
    recording: String,
    /// When it was made, s since 1970-01-01.
    pub taken_at_s: u64,
    /// The measurement.
    pub report: Report,
}

/// The result of a search in a store.
#[derive(Clone, Debug)]
pub enum Found {
    /// A valid measurement.
    Fresh(Box<Stored>),
    /// No measurement.
    Nothing,
    /// An invalid measurement, and why.
    Useless(String),
}

impl Store {
    /// The recording of measurements on touches that were simulated on the body: they are for every recording.
    pub const TOUCHES: &str = "touches";

    /// The user's store: `somatic/tradeoff` in `$XDG_CACHE_HOME` or `~/.cache`. `None` without such a folder.
    #[must_use]
    pub fn of_user() -> Option<Self> {
        let set = |name: &str| std::env::var_os(name).filter(|value| !value.is_empty()).map(PathBuf::from);
        let cache = set("XDG_CACHE_HOME").filter(|folder| folder.is_absolute());
        let cache = cache.or_else(|| set("LOCALAPPDATA")).or_else(|| set("HOME").map(|home| home.join(".cache")))?;
        Some(Self::at(cache.join("somatic").join("tradeoff")))
    }

    /// The store in `folder`.
    #[must_use]
    pub fn at(folder: PathBuf) -> Self {
        Self { folder }
    }

    /// The file for measurements of `options` on `body`.
    #[must_use]
    pub fn file(&self, body: &Body, options: &Options) -> PathBuf {
        self.folder.join(format!("{:016x}.json", hash(&[&body.name, &requested(options)])))
    }

    /// The measurement of `options` on `body` that is valid on this machine with this `driver`.
    ///
    /// It must be of the same `recording`, or of [`Store::TOUCHES`]. `None` accepts any recording, for live frames.
    #[must_use]
    pub fn find(&self, body: &Body, options: &Options, driver: &str, recording: Option<&str>) -> Found {
        let path = self.file(body, options);
        let Ok(text) = limits::read_to_string(&path, MAX_SYSTEM_BYTES) else { return Found::Nothing };
        let useless = |why: &str| Found::Useless(format!("{}: kept measurements {why}", path.display()));
        let now = Key::new(body, options, driver);
        // Another version may have another structure.
        let version =
            serde_json::from_str::<serde_json::Value>(&text).ok().and_then(|all| all["key"]["version"].as_u64());
        if version.is_some_and(|version| version != u64::from(now.version)) {
            return useless("are of another version");
        }
        let Ok(stored) = serde_json::from_str::<Stored>(&text) else { return useless("are damaged") };
        let differs = [
            (stored.key.program != now.program, "are of another version"),
            (stored.key.machine != now.machine, "are of another machine"),
            (stored.key.driver != now.driver, "are with other GPU drivers"),
            (stored.key.body != now.body, "are of the body before it changed"),
            (stored.key.scene != now.scene, "are of the scene before it changed"),
            (stored.report.rows.iter().any(|row| row.combination().is_err()), "are damaged"),
        ];
        match differs.iter().find(|(differs, _)| *differs) {
            Some((_, why)) => useless(why),
            None if recording.is_some_and(|of| ![of, Self::TOUCHES].contains(&&*stored.recording)) => Found::Nothing,
            None => Found::Fresh(Box::new(stored)),
        }
    }

    /// Stores `report`, made on `recording`, and replaces an earlier one.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn keep(&self, body: &Body, options: &Options, driver: &str, recording: &str, report: &Report) -> Result<()> {
        let (key, recording) = (Key::new(body, options, driver), recording.to_owned());
        let stored = Stored { key, recording, taken_at_s: now_s(), report: report.clone() };
        self.write(&self.file(body, options), &stored)
    }

    fn write(&self, path: &Path, stored: &impl Serialize) -> Result<()> {
        let text = serde_json::to_string_pretty(stored).map_err(|e| Error::failed(e.to_string()))?;
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        // The store's files may be overwritten.
        let mut folder = OutputPaths::new(true, [""; 0]).add_folder(&self.folder, [&*name])?;
        folder.make()?;
        folder.take(&name).write(text.as_bytes())
    }
}

fn now_s() -> u64 {
    SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs())
}

impl Key {
    fn new(body: &Body, options: &Options, driver: &str) -> Self {
        let laid = format!("{:?} {:?} {:?}", body.taxels, body.fields, body.links);
        let calibration = options.calibration.as_ref().map(|calibration| format!("{calibration:?}"));
        let scene = [&requested(options), calibration.as_deref().unwrap_or_default()];
        Self {
            version: VERSION,
            program: env!("CARGO_PKG_VERSION").to_owned(),
            machine: machine(),
            driver: driver.to_owned(),
            body: format!("{:016x}", hash(&[&laid])),
            scene: format!("{:016x}", hash(&scene)),
        }
    }
}

/// The requested options without knobs, as all of these are measured.
fn requested(options: &Options) -> String {
    let scene = options.scene.clone().knobs(Knobs::default());
    format!("{:?} {scene:?}", options.backend)
}

/// The processor and its number of threads.
fn machine() -> String {
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let cpu_info = limits::read_to_string("/proc/cpuinfo", MAX_SYSTEM_BYTES).unwrap_or_default();
    let name = cpu_info.lines().find_map(|line| line.strip_prefix("model name")?.split_once(':'));
    let name = name.map_or("", |(_, name)| name.trim());
    format!("{} {} {name} {threads}", std::env::consts::OS, std::env::consts::ARCH)
}

/// FNV-1a, which is the same in every version.
fn hash(texts: &[&str]) -> u64 {
    let bytes = texts.iter().flat_map(|text| text.bytes().chain([0xff]));
    bytes.fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
}

/// The day of a time in s since 1970, UTC: `2026-11-20`.
#[must_use]
pub fn day(at_s: u64) -> String {
    // Counted from 0000-03-01, so that a leap day ends its year; 146,097 days are four centuries.
    let days = at_s / 86_400 + 719_468;
    let (era, of_era) = (days / 146_097, days % 146_097);
    let year = (of_era - of_era / 1460 + of_era / 36_524 - of_era / 146_096) / 365;
    let of_year = of_era - (365 * year + year / 4 - year / 100);
    let month = (5 * of_year + 2) / 153;
    let day = of_year - (153 * month + 2) / 5 + 1;
    let (month, later) = if month < 10 { (month + 3, 0) } else { (month - 9, 1) };
    format!("{:04}-{month:02}-{day:02}", era * 400 + year + later)
}

#[cfg(test)]
mod tests {
    use super::super::tests::{report, row};
    use super::*;
    use crate::bundled;
    use crate::percept::Outputs;
    use crate::scene::Scene;

    #[test]
    fn days_are_those_of_the_calendar() {
        let at = [0, 951_782_400, 951_868_800, 1_583_020_800, 1_798_675_199, 4_102_444_800];
        assert_eq!(at.map(day), ["1970-01-01", "2000-02-29", "2000-03-01", "2020-03-01", "2026-12-30", "2100-01-01"]);
    }

    #[test]
    fn what_is_kept_is_found_until_something_changes() {
        let folder = tempfile::tempdir().unwrap();
        let store = Store::at(folder.path().join("new/folder"));
        let body = Body::from_bytes("hand", bundled::HAND).unwrap();
        let options = Options::default();
        let why = |found: Found| match found {
            Found::Useless(why) => why,
            other => panic!("{other:?}"),
        };
        let find = |body: &Body, options: &Options, driver: &str| store.find(body, options, driver, Some("touch"));
        assert!(matches!(find(&body, &options, "a"), Found::Nothing));
        let report = report(vec![row("cpu", 1.0, 2.0, 3.0)]);
        store.keep(&body, &options, "a", "touch", &report).unwrap();
        for recording in [Some("touch"), None] {
            match store.find(&body, &options, "a", recording) {
                Found::Fresh(stored) => assert_eq!(stored.report, report),
                other => panic!("{other:?}"),
            }
        }
        assert!(matches!(store.find(&body, &options, "a", Some("another")), Found::Nothing));
        store.keep(&body, &options, "a", Store::TOUCHES, &report).unwrap();
        assert!(matches!(store.find(&body, &options, "a", Some("another")), Found::Fresh(_)));
        store.keep(&body, &options, "a", "touch", &report).unwrap();
        assert!(why(find(&body, &options, "b")).contains("other GPU drivers"));
        let mut moved = body.clone();
        moved.taxels[0].position_in_link.x += 1e-3;
        assert!(why(find(&moved, &options, "a")).contains("the body before it changed"));
        // Another scene has another file; knobs are not part of it.
        let other = |scene: Scene| options.clone().scene(scene);
        let total = other(Scene::default().outputs(Outputs::TOTAL));
        assert!(matches!(find(&body, &total, "a"), Found::Nothing));
        let knobs = Knobs::default().coverage(crate::scene::Coverage::All);
        assert!(matches!(find(&body, &other(Scene::default().knobs(knobs)), "a"), Found::Fresh(_)));
        let path = store.file(&body, &options);
        let text = std::fs::read_to_string(&path).unwrap();
        std::fs::write(&path, text.replace("\"version\": 3", "\"version\": 1").replace("\"recording\"", "\"other\""))
            .unwrap();
        assert!(why(find(&body, &options, "a")).contains("another version"));
        std::fs::write(&path, &text[..text.len() / 2]).unwrap();
        assert!(why(find(&body, &options, "a")).contains("damaged"));
    }
}
