//! Recordings of joint states: CSV under `t,<joint>,...`, or NDJSON with a line `{"t":s,"joints":{"<joint>":position}}` each.
//!
//! Positions are in radians, or metres for prismatic joints. A state need not have every joint.

use std::collections::HashMap;
use std::io::{BufRead as _, BufReader};
use std::path::Path;

use serde::Deserialize;

use super::gzip;
use super::skipped_bad::SkippedBad;
use super::time_column::{TimeColumn, unit_in_head};
use crate::error::{Error, Result, failed};
use crate::limits::{self, MAX_STATES_BYTES};
use crate::signal::FrameTime;

/// Joint states over time.
#[derive(Clone, Debug, Default)]
pub struct JointStates {
    name: String,
    names: Vec<String>,
    index_of: HashMap<String, usize>,
    /// By joint, times and positions; times do not fall.
    tracks: Vec<Vec<(FrameTime, f64)>>,
    losses: Vec<String>,
}

/// A joint's position at a time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointPosition {
    /// The position, rad or m.
    pub position: f64,
    /// The time since the state at or before it, s.
    pub age_s: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Line {
    t: f64,
    joints: HashMap<String, f64>,
}

impl JointStates {
    /// Reads the recording at `path`: NDJSON if its first byte is `{`, else CSV.
    ///
    /// # Errors
    /// It cannot be read, or a line is not a joint state; with the line.
    pub fn open(path: impl AsRef<Path>) -> Result<Self> {
        Self::open_with(path, false)
    }

    /// The same; with `skip_bad`, lines that are not joint states are skipped, and counted in [`JointStates::losses`].
    ///
    /// # Errors
    /// As [`JointStates::open`].
    pub fn open_with(path: impl AsRef<Path>, skip_bad: bool) -> Result<Self> {
        let path = path.as_ref();
        let mut skipped = SkippedBad::new(skip_bad);
        let failed = |e: std::io::Error| Error::io(path, &e);
        let file = limits::open(path, MAX_STATES_BYTES).map_err(failed)?;
        let mut reader = BufReader::new(gzip::unpacked(file, MAX_STATES_BYTES).map_err(failed)?.0);
        let is_json = reader.fill_buf().map_err(failed)?.trim_ascii_start().first() == Some(&b'{');
        let mut states = Self { name: path.display().to_string(), ..Self::default() };
        let read =
            if is_json { states.read_ndjson(reader, &mut skipped) } else { states.read_csv(reader, &mut skipped) };
        read.map_err(|e| e.at(path.display()))?;
        states.losses = skipped.losses().into_iter().map(|what| format!("{}: {what}", path.display())).collect();
        if states.names.is_empty() {
            return Err(Error::failed("it has no joints; write a CSV under t,<joint>,...").at(path.display()));
        }
        if states.span_s().is_none() {
            return Err(Error::failed("it has no states, only a header; write a row for each state under it")
                .at(path.display()));
        }
        Ok(states)
    }

    fn read_ndjson(&mut self, mut reader: impl std::io::BufRead, skipped: &mut SkippedBad) -> Result<()> {
        let mut text = String::new();
        for number in 1.. {
            text.clear();
            let at = |what: String| Error::failed(what).at(format!("line {number}"));
            if reader.read_line(&mut text).map_err(|e| at(e.to_string()))? == 0 {
                break;
            }
            if text.trim().is_empty() {
                continue;
            }
            let read = serde_json::from_str::<Line>(&text).map_err(|e| {
                at(format!("{e}; a joint state is one line like {{\"t\":0.5,\"joints\":{{\"wrist\":0.1}}}}"))
            });
            let read = read.and_then(|Line { t, joints }| {
                let joints: Vec<(usize, f64)> =
                    joints.into_iter().map(|(joint, position)| (self.joint(joint), position)).collect();
                self.push(&joints, t).map_err(|e| e.at(format!("line {number}")))
            });
            read.or_else(|e| skipped.skip("line", "not a joint state", e))?;
        }
        Ok(())
    }

    fn read_csv(&mut self, reader: impl std::io::Read, skipped: &mut SkippedBad) -> Result<()> {
        let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).flexible(true).from_reader(reader);
        let header = reader.headers().map_err(|e| Error::failed(e.to_string()))?.clone();
        let first = header.get(0).map(|name| name.trim_start_matches('\u{feff}')).unwrap_or_default();
        let Some(unit) = unit_in_head(first).map_err(|e| e.at("header"))? else {
            let what = match header.get(0) {
                None | Some("") => "it is empty".to_owned(),
                Some(_) => format!("its first column is `{first}`, not `t`"),
            };
            return Err(failed!("{what}; write a CSV under t,<joint>,...").at("header"));
        };
        let mut time = TimeColumn::new(unit);
        for name in header.iter().skip(1) {
            if self.index_of.contains_key(name) {
                return Err(failed!("two columns are called `{name}`; give each joint one").at("header"));
            }
            self.joint(name.to_owned());
        }
        let mut row = csv::StringRecord::new();
        while reader.read_record(&mut row).map_err(|e| Error::failed(e.to_string()))? {
            let line = row.position().map_or(0, csv::Position::line);
            self.read_row(&row, &header, &mut time)
                .or_else(|e| skipped.skip("row", "not a joint state", e.at(format!("line {line}"))))?;
        }
        Ok(())
    }

    fn read_row(&mut self, row: &csv::StringRecord, header: &csv::StringRecord, time: &mut TimeColumn) -> Result<()> {
        if row.len() != header.len() {
            return Err(failed!(
                "{} cells, and the header has {}; complete or delete the row",
                row.len(),
                header.len()
            ));
        }
        let t_s = time.read(&row[0], row[0].parse().ok())?;
        let number = |column: usize| {
            let text = &row[column];
            let wrong = |_| failed!("column `{}` is `{text}`; write a number", &header[column]);
            text.parse::<f64>().map(|position| (column - 1, position)).map_err(wrong)
        };
        // An empty cell is a joint of which nothing is told.
        let joints = (1..header.len()).filter(|&column| !row[column].is_empty()).map(number);
        self.push(&joints.collect::<Result<Vec<_>>>()?, t_s)
    }

    /// The index of the joint called `name`, which may be new.
    fn joint(&mut self, name: String) -> usize {
        if let Some(&index) = self.index_of.get(&name) {
            return index;
        }
        self.index_of.insert(name.clone(), self.names.len());
        self.names.push(name);
        self.tracks.push(Vec::new());
        self.names.len() - 1
    }

    /// Adds a state of `joints` at `t_s`; all of it or nothing.
    fn push(&mut self, joints: &[(usize, f64)], t_s: f64) -> Result<()> {
        for &(joint, position) in joints {
            let name = &self.names[joint];
            if !t_s.is_finite() || !position.is_finite() {
                return Err(failed!("joint `{name}` is at {position} at {t_s} s; write finite numbers"));
            }
            if let Some((last, _)) = self.tracks[joint].last().filter(|(last, _)| t_s < last.s) {
                return Err(failed!("time goes back from {} s to {t_s} s; sort the states by time", last.s));
            }
        }
        for &(joint, position) in joints {
            self.tracks[joint].push((t_s.into(), position));
        }
        Ok(())
    }

    /// States without joints so far, which people call `name`: for [`JointStates::add`].
    #[cfg(feature = "mcap")]
    pub fn named(name: String) -> Self {
        Self { name, ..Self::default() }
    }

    /// Adds that the joint called `name` is at `position` (rad or m) at `time`, which may be before what is there;
    /// [`JointStates::sort`] comes last.
    #[cfg(feature = "mcap")]
    pub fn add(&mut self, name: &str, time: FrameTime, position: f64) {
        let joint = self.joint_index(name).unwrap_or_else(|| self.joint(name.to_owned()));
        self.tracks[joint].push((time, position));
    }

    /// Puts the states of each joint into the order of their times, and keeps what of them was not read.
    #[cfg(feature = "mcap")]
    pub fn sort(&mut self, losses: Vec<String>) {
        for track in &mut self.tracks {
            track.sort_by(|(a, _), (b, _)| a.total_cmp(b));
        }
        self.losses = losses;
    }

    /// What of the recording was not read, in a line each.
    #[must_use]
    pub fn losses(&self) -> &[String] {
        &self.losses
    }

    /// What people call the recording.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The times of the first and the last state, s; `None` without states.
    #[must_use]
    pub fn span_s(&self) -> Option<[f64; 2]> {
        let ends = self.tracks.iter().filter_map(|track| Some([track.first()?.0.s, track.last()?.0.s]));
        ends.reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])])
    }

    /// The joints' names.
    #[must_use]
    pub fn joint_names(&self) -> &[String] {
        &self.names
    }

    /// The joint called `name`, if any state has it.
    #[must_use]
    pub fn joint_index(&self, name: &str) -> Option<usize> {
        self.index_of.get(name).copied()
    }

    /// The position of `joint` at `time`, in seconds or a [`FrameTime`], linear between two states; of a joint that `is_continuous`, the
    /// shorter way around. After the last state, its position; `None` before the first.
    #[must_use]
    pub fn at(&self, joint: usize, time: impl Into<FrameTime>, is_continuous: bool) -> Option<JointPosition> {
        let (track, time) = (&self.tracks[joint], time.into());
        let next = track.partition_point(|(state, _)| state.since(time) <= 0.0);
        let before = *track.get(next.checked_sub(1)?)?;
        let age_s = time.since(before.0);
        let Some(after) = track.get(next).copied() else {
            return Some(JointPosition { position: before.1, age_s });
        };
        let position = position_between(before, after, time, is_continuous);
        Some(JointPosition { position, age_s })
    }
}

/// The position at `time` between two states, each a time and a position; the shorter way around if asked.
pub fn position_between(
    (before_at, before): (FrameTime, f64),
    (after_at, after): (FrameTime, f64),
    time: FrameTime,
    shorter_way: bool,
) -> f64 {
    let mut way = after - before;
    if shorter_way {
        way -= (way / std::f64::consts::TAU).round() * std::f64::consts::TAU;
    }
    before + way * (time.since(before_at) / after_at.since(before_at))
}

#[cfg(test)]
mod tests {
    use std::io::Write as _;

    use super::*;

    fn read(text: &str) -> Result<JointStates> {
        let mut file = tempfile::NamedTempFile::new().unwrap();
        file.write_all(text.as_bytes()).unwrap();
        JointStates::open(file.path())
    }

    #[test]
    fn states_are_csv_or_ndjson() {
        let csv = read("t, wrist,slide\n0,1,\n1,2,0.5\n3,,0.25\n").unwrap();
        let lines = "{\"t\":0,\"joints\":{\"wrist\":1}}\n\n{\"t\":1,\"joints\":{\"wrist\":2,\"slide\":0.5}}\n{\"t\":3,\"joints\":{\"slide\":0.25}}";
        for states in [csv, read(lines).unwrap()] {
            let at = |joint: &str, t_s: f64| {
                states.at(states.joint_index(joint).unwrap(), t_s, false).map(|found| (found.position, found.age_s))
            };
            assert_eq!(at("wrist", 0.25), Some((1.25, 0.25)));
            assert_eq!(at("wrist", 3.0), Some((2.0, 2.0)), "the last stays");
            assert_eq!(at("slide", 2.0), Some((0.375, 1.0)));
            assert_eq!((at("slide", 0.5), at("wrist", -1.0)), (None, None));
        }
    }

    #[test]
    fn times_are_in_the_unit_of_their_head() {
        for text in ["t [ms],a\n500,1\n1500,2\n", "time,a\n0.5,1\n1.5,2\n"] {
            assert_eq!(read(text).unwrap().span_s(), Some([0.5, 1.5]), "{text}");
        }
    }

    #[test]
    fn a_joint_without_end_turns_the_shorter_way() {
        let states = read("t,wheel\n0,3\n1,-3\n").unwrap();
        let at = |is_continuous| states.at(0, 0.5, is_continuous).unwrap().position;
        assert_eq!(at(false), 0.0);
        assert!((at(true) - std::f64::consts::PI).abs() < 1e-15);
    }

    #[test]
    fn what_is_wrong_has_its_line() {
        let why = |text: &str| read(text).unwrap_err().to_string();
        assert!(
            why("t,a\n0,1\n1,x\n").ends_with("line 3: column `a` is `x`; write a number"),
            "{}",
            why("t,a\n0,1\n1,x\n")
        );
        assert!(why("t,a\n1,1\n0,1\n").contains("line 3: time goes back from 1 s to 0 s"));
        assert!(why("t,a,a\n").contains("header: two columns"));
        assert!(why("a,t\n0,1\n").contains("header: its first column"));
        assert!(why("t,a\n0,inf\n").contains("finite"));
        assert!(why("{\"t\":0,\"joints\":{}}\n{\"t\":1}\n").contains("line 2: missing field `joints`"));
        assert!(why("").contains("header: it is empty; write a CSV under t,<joint>"));
        assert!(why("t\n0\n").contains("no joints"));
    }
}
