//! Live frames as NDJSON, one line each:
//! `{"t":s,"values":{"<taxel id>":raw},"pose":{"<link>":[x,y,z,qx,qy,qz,qw]},"joints":{"<joint>":position}}`.
//!
//! A taxel that is absent or `null` is missing; `"nan"` and `"inf"` are faulty values. A taxel that the body does not
//! have is named once, and its values are skipped and counted. Lines are parsed directly into the frame.

mod key;
mod value;

use std::collections::HashMap;
use std::fmt;
use std::fs::File;
use std::io::{BufRead, BufReader, Read as _};
use std::path::Path;

use glam::{DQuat, DVec3};
use serde::de::{DeserializeSeed, Deserializer, Error as _, IgnoredAny, MapAccess, SeqAccess, Visitor};

use self::key::{EXAMPLE, Key, KeyVisitor};
use self::value::{Given, ValueVisitor};
use super::Source;
use super::csv::is_csv_row;
use super::skipped_bad::SkippedBad;
use super::unknown_taxels::UnknownTaxels;
use crate::error::{Error, Result, failed};
use crate::limits::MAX_LINE_BYTES;
use crate::signal::{Axis, Channel, Frame, Pose, RawValue};

/// Frames read from NDJSON.
pub struct NdjsonSource {
    name: String,
    reader: Box<dyn BufRead + Send>,
    line: Vec<u8>,
    line_number: u64,
    taxels: Taxels,
    losses: Vec<String>,
    skipped: SkippedBad,
}

somatic_skin::debug_by_name!(NdjsonSource);

/// The body's taxels, and the line on which each last had a value.
struct Taxels {
    ids: Vec<u32>,
    index: HashMap<u32, usize>,
    last_line: Vec<u64>,
    unknown: UnknownTaxels,
}

impl NdjsonSource {
    /// Reads frames from `reader`, called `name` in messages, for a body with the taxels `ids`.
    #[must_use]
    pub fn new(name: impl Into<String>, reader: impl BufRead + Send + 'static, ids: Vec<u32>) -> Self {
        let index = ids.iter().enumerate().map(|(index, &id)| (id, index)).collect();
        let last_line = vec![0; ids.len()];
        Self {
            name: name.into(),
            reader: Box::new(reader),
            line: Vec::new(),
            line_number: 0,
            taxels: Taxels { ids, index, last_line, unknown: UnknownTaxels::default() },
            losses: Vec::new(),
            skipped: SkippedBad::default(),
        }
    }

    /// Reads frames from standard input for a body with the taxels `ids`.
    #[must_use]
    pub fn stdin(ids: Vec<u32>) -> Self {
        Self::new("stdin", BufReader::with_capacity(1 << 16, std::io::stdin()), ids)
    }

    /// Reads frames from the file at `path` for a body with the taxels `ids`.
    ///
    /// # Errors
    /// It cannot be read.
    pub fn open(path: &Path, ids: Vec<u32>) -> Result<Self> {
        let file = File::open(path).map_err(|e| Error::io(path, &e))?;
        Ok(Self::new(path.display().to_string(), BufReader::with_capacity(1 << 16, file), ids))
    }

    /// Makes a taxel that the body does not have an error.
    #[must_use]
    pub fn strict(mut self) -> Self {
        self.taxels.unknown.refused = true;
        self
    }

    /// Skips lines that are wrong, and counts them, if `is_asked`; else the first one is an error.
    #[must_use]
    pub fn skip_bad(mut self, is_asked: bool) -> Self {
        self.skipped = SkippedBad::new(is_asked);
        self
    }

    /// Reads the next line that is not blank into `self.line`. `None` at the end, else whether it ends with a newline.
    fn read_line(&mut self) -> Result<Option<bool>> {
        loop {
            self.line.clear();
            self.line_number += 1;
            let read = (&mut self.reader)
                .take(MAX_LINE_BYTES + 1)
                .read_until(b'\n', &mut self.line)
                .map_err(|e| Error::failed(e.to_string()))?;
            if read == 0 {
                return Ok(None);
            }
            if self.line.len() as u64 > MAX_LINE_BYTES {
                return Err(failed!("a line of over {} MiB; frames are one line of JSON each", MAX_LINE_BYTES >> 20)
                    .at(format!("line {}", self.line_number)));
            }
            let has_newline = self.line.last() == Some(&b'\n');
            if !self.line.trim_ascii().is_empty() {
                return Ok(Some(has_newline));
            }
        }
    }

    fn read_frame(&mut self, frame: &mut Frame) -> Result<bool> {
        while let Some(has_newline) = self.read_line()? {
            match self.frame_of_line(has_newline, frame) {
                Ok(has_frame) => return Ok(has_frame),
                Err((wrong, error)) => self.skipped.skip("line", wrong, error)?,
            }
        }
        Ok(false)
    }

    /// Reads the current line; or says what is wrong with it, in short and in full. `false` where it is the last and cut short.
    fn frame_of_line(&mut self, has_newline: bool, frame: &mut Frame) -> Result<bool, (&'static str, Error)> {
        frame.clear();
        frame.values.resize(self.taxels.ids.len(), RawValue::MISSING);
        let line = if self.line_number == 1 {
            self.line.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(&self.line)
        } else {
            &self.line
        };
        let mut json = serde_json::Deserializer::from_slice(line);
        let parse = Parse(FrameVisitor { frame, taxels: &mut self.taxels, line: self.line_number });
        match parse.deserialize(&mut json).and_then(|()| json.end()) {
            Ok(()) => Ok(true),
            Err(e) if e.is_eof() && !has_newline => {
                self.losses.push(format!(
                    "{}: line {}: last line truncated after {} bytes",
                    self.name,
                    self.line_number,
                    self.line.len()
                ));
                Ok(false)
            }
            Err(_) if is_csv_row(line) => {
                let error = Error::failed("this is CSV, and `-` reads a line of JSON a frame; use --source csv:-")
                    .at(format!("line {}", self.line_number));
                Err(("CSV", error))
            }
            Err(e) => {
                let wrong = if e.is_data() { "not a frame" } else { "not JSON" };
                Err((wrong, explained(&e, self.line_number)))
            }
        }
    }
}

impl Source for NdjsonSource {
    fn taxels(&self) -> &[u32] {
        &self.taxels.ids
    }

    fn next_frame(&mut self, frame: &mut Frame) -> Result<bool> {
        self.read_frame(frame).map_err(|e| e.at(&self.name))
    }

    fn notices(&mut self) -> Vec<String> {
        let place = |what: String| format!("{}: line {}: {what}", self.name, self.line_number);
        let unknown = self.taxels.unknown.notice().map(place);
        let skipped = self.skipped.take_notices().into_iter().map(|what| format!("{}: {what}", self.name));
        unknown.into_iter().chain(skipped).collect()
    }

    fn losses(&self) -> Vec<String> {
        let unknown = self.taxels.unknown.loss().map(|what| format!("{}: {what}", self.name));
        let skipped = self.skipped.losses().into_iter().map(|what| format!("{}: {what}", self.name));
        self.losses.iter().cloned().chain(unknown).chain(skipped).collect()
    }
}

/// `error` with the line number of the input instead of the parser's, which sees one line at a time.
fn explained(error: &serde_json::Error, line: u64) -> Error {
    let text = error.to_string();
    let place = format!(" at line {} column {}", error.line(), error.column());
    let what = text.strip_suffix(&place).unwrap_or(&text);
    let what = if error.is_data() { what.to_owned() } else { format!("{what}; a frame is one line like {EXAMPLE}") };
    Error::failed(what).at(format!("line {line}, column {}", error.column()))
}

/// The time that `value` is, s; else what to write.
fn time_of(value: &serde_json::Value) -> Result<f64, String> {
    value.as_f64().ok_or_else(|| {
        let given: String = value.to_string().chars().take(40).collect();
        format!("`t` is {given}; give the time in seconds, a number without quotes")
    })
}

/// Passes whatever is there to a visitor.
struct Parse<V>(V);

impl<'de, V: Visitor<'de>> DeserializeSeed<'de> for Parse<V> {
    type Value = V::Value;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<V::Value, D::Error> {
        deserializer.deserialize_any(self.0)
    }
}

/// Parses a line's object into `frame`.
struct FrameVisitor<'a> {
    frame: &'a mut Frame,
    taxels: &'a mut Taxels,
    line: u64,
}

impl<'de> Visitor<'de> for FrameVisitor<'_> {
    type Value = ();

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a frame, {\"t\":seconds,\"values\":{\"<taxel id>\":number}}")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<(), A::Error> {
        let (mut has_time, mut has_values, mut has_pose, mut has_joints) = (false, false, false, false);
        while let Some(key) = map.next_key_seed(Parse(KeyVisitor))? {
            let seen = match key {
                Key::Time => {
                    self.frame.t_s = time_of(&map.next_value()?).map_err(A::Error::custom)?;
                    &mut has_time
                }
                Key::Values => {
                    let values = ValuesVisitor { frame: self.frame, taxels: self.taxels, line: self.line };
                    map.next_value_seed(Parse(values))?;
                    &mut has_values
                }
                Key::Pose => {
                    map.next_value_seed(Parse(PosesVisitor { poses: &mut self.frame.pose }))?;
                    &mut has_pose
                }
                Key::Joints => {
                    map.next_value_seed(Parse(JointsVisitor { joints: &mut self.frame.joints }))?;
                    &mut has_joints
                }
            };
            if std::mem::replace(seen, true) {
                return Err(A::Error::custom(format!("`{key}` appears twice; give it once")));
            }
        }
        if !has_time {
            return Err(A::Error::custom(
                "the frame has no `t`; give its time in seconds, as in {\"t\":0.5,\"values\":{\"7\":12}}",
            ));
        }
        Ok(())
    }
}

struct ValuesVisitor<'a> {
    frame: &'a mut Frame,
    taxels: &'a mut Taxels,
    line: u64,
}

impl<'de> Visitor<'de> for ValuesVisitor<'_> {
    type Value = ();

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("values by taxel id, {\"<taxel id>\":number}")
    }

    fn visit_map<A: MapAccess<'de>>(mut self, mut map: A) -> Result<(), A::Error> {
        while let Some(id) = map.next_key_seed(Parse(IdVisitor))? {
            let Some(&index) = self.taxels.index.get(&id) else {
                self.taxels.unknown.check(id).map_err(A::Error::custom)?;
                // One that is null is missing, as it would be without the key.
                if map.next_value::<Option<IgnoredAny>>()?.is_some() {
                    self.taxels.unknown.leave_out(id);
                }
                continue;
            };
            if std::mem::replace(&mut self.taxels.last_line[index], self.line) == self.line {
                return Err(A::Error::custom(format!("taxel {} appears twice; give each taxel once", Channel(id))));
            }
            match map.next_value_seed(ValueVisitor { id })? {
                Given::One(value) => self.frame.values[index] = value,
                Given::Three(values) => self.take_three(id, values).map_err(A::Error::custom)?,
            }
        }
        Ok(())
    }
}

impl ValuesVisitor<'_> {
    /// Takes the values of a taxel with three axes: along the normal, t and n × t.
    fn take_three(&mut self, id: u32, values: [RawValue; 3]) -> Result<(), String> {
        for (axis, value) in [Axis::Normal, Axis::U, Axis::V].into_iter().zip(values) {
            let channel = Channel::of_taxel(Channel(id).taxel(), axis);
            let own = self.taxels.index.get(&channel.0).filter(|_| Channel(id).axis() == Axis::Normal);
            let Some(&index) = own else {
                return Err(format!(
                    "taxel {} has one value, and three are given; its modality is not force3",
                    Channel(id)
                ));
            };
            if axis != Axis::Normal && std::mem::replace(&mut self.taxels.last_line[index], self.line) == self.line {
                return Err(format!("taxel {channel} appears twice; give each taxel once"));
            }
            self.frame.values[index] = value;
        }
        Ok(())
    }
}

struct IdVisitor;

impl Visitor<'_> for IdVisitor {
    type Value = u32;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a taxel id")
    }

    fn visit_str<E: serde::de::Error>(self, key: &str) -> Result<u32, E> {
        Channel::named(key).map(|channel| channel.0).ok_or_else(|| {
            E::custom(format!("`{key}` is not a taxel id; ids are whole numbers in quotes, as in {EXAMPLE}"))
        })
    }
}

struct PosesVisitor<'a> {
    poses: &'a mut Vec<(String, Pose)>,
}

impl<'de> Visitor<'de> for PosesVisitor<'_> {
    type Value = ();

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("poses by link, {\"<link>\":[x,y,z,qx,qy,qz,qw]}")
    }

    fn visit_unit<E>(self) -> Result<(), E> {
        Ok(())
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<(), A::Error> {
        while let Some(link) = map.next_key::<String>()? {
            let pose = map.next_value_seed(Parse(PoseVisitor { link: &link }))?;
            if self.poses.iter().any(|(known, _)| *known == link) {
                return Err(A::Error::custom(format!("the pose of `{link}` appears twice; give it once")));
            }
            self.poses.push((link, pose));
        }
        Ok(())
    }
}

struct JointsVisitor<'a> {
    joints: &'a mut Vec<(String, f64)>,
}

impl<'de> Visitor<'de> for JointsVisitor<'_> {
    type Value = ();

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("positions by joint, {\"<joint>\":number}")
    }

    fn visit_unit<E>(self) -> Result<(), E> {
        Ok(())
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<(), A::Error> {
        while let Some((joint, position)) = map.next_entry::<String, f64>()? {
            if self.joints.iter().any(|(known, _)| *known == joint) {
                return Err(A::Error::custom(format!("joint `{joint}` appears twice; give it once")));
            }
            self.joints.push((joint, position));
        }
        Ok(())
    }
}

struct PoseVisitor<'a> {
    link: &'a str,
}

impl<'de> Visitor<'de> for PoseVisitor<'_> {
    type Value = Pose;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "[x,y,z,qx,qy,qz,qw] for link `{}`", self.link)
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Pose, A::Error> {
        let wrong = |found: usize| {
            A::Error::custom(format!("the pose of `{}` has {found} numbers; give x,y,z,qx,qy,qz,qw", self.link))
        };
        let mut numbers = [0.0; 7];
        for (found, number) in numbers.iter_mut().enumerate() {
            *number = seq.next_element::<f64>()?.ok_or_else(|| wrong(found))?;
        }
        let mut found = numbers.len();
        while seq.next_element::<IgnoredAny>()?.is_some() {
            found += 1;
        }
        if found > numbers.len() {
            return Err(wrong(found));
        }
        let [x, y, z, qx, qy, qz, qw] = numbers;
        let pose = Pose { translation: DVec3::new(x, y, z), rotation: DQuat::from_xyzw(qx, qy, qz, qw) };
        pose.check(self.link).map_err(A::Error::custom)?;
        Ok(Pose { rotation: pose.rotation.normalize(), ..pose })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn source(text: &str) -> NdjsonSource {
        NdjsonSource::new("stdin", std::io::Cursor::new(text.as_bytes().to_vec()), vec![4, 7, 9])
    }

    fn read(text: &str) -> Result<(Vec<Frame>, Vec<String>)> {
        let mut source = source(text);
        let mut frame = Frame::missing(0.0, 3);
        let mut frames = Vec::new();
        while source.next_frame(&mut frame)? {
            frames.push(frame.clone());
        }
        Ok((frames, source.losses()))
    }

    fn why(text: &str) -> String {
        read(text).unwrap_err().to_string()
    }

    #[test]
    fn a_time_that_is_no_number_is_told_in_plain_words() {
        let of = |t: &str| why(&format!("{{\"t\":{t},\"values\":{{}}}}\n"));
        assert!(
            of("\"0\"").ends_with("`t` is \"0\"; give the time in seconds, a number without quotes"),
            "{}",
            of("\"0\"")
        );
        assert!(of("null").contains("`t` is null; give the time in seconds"));
        let long = of(&format!("[{}1]", "1,".repeat(1000)));
        assert!(long.contains("; give the time in seconds") && long.len() < 160, "{long}");
    }

    #[test]
    fn a_line_is_a_frame() {
        let text = "\u{feff}{\"t\":0.5,\"values\":{\"9\":12,\"4\":-1.5}}\r\n\n\
            {\"values\":{\"7\":\"nan\",\"4\":\"-INF\",\"9\":null},\"t\":1}\n{\"t\":2,\"values\":{\"7\":1e60,\"9\":0}}";
        let (frames, losses) = read(text).unwrap();
        let words: Vec<String> = frames.iter().map(|f| format!("{} {:?}", f.t_s, f.values)).collect();
        assert_eq!(words, ["0.5 [-1.5, missing, 12]", "1 [faulty, faulty, missing]", "2 [missing, faulty, 0]"]);
        assert!(losses.is_empty());
    }

    #[test]
    fn wrong_lines_are_skipped_on_request_and_counted_by_kind() {
        let text = "{\"t\":0}\n{\"t\":1,\"joints\":{\"a\":null}}\nboot\n{\"t\":2,\"values\":{\"4\":\"x\",\"7\":1}}\n1,2\n\
            {\"t\":3,\"joints\":{\"a\":NaN}}\n{\"t\":4,\"values\":{\"7\":5}}\n";
        let mut source = source(text).skip_bad(true);
        let mut frame = Frame::missing(0.0, 3);
        let mut found = Vec::new();
        while source.next_frame(&mut frame).unwrap() {
            found.push(format!("{} {:?} {}", frame.t_s, frame.values, frame.joints.len()));
        }
        assert_eq!(found, ["0 [missing, missing, missing] 0", "4 [missing, 5, missing] 0"]);
        let said = source.notices();
        assert!(said.len() == 3 && said[0].starts_with("stdin: a line is skipped: line 2, column "), "{said:?}");
        let losses = source.losses();
        assert!(losses[0].starts_with("stdin: 2 lines skipped, not a frame; the first one: line 2"), "{losses:?}");
        assert!(losses[1].starts_with("stdin: 2 lines skipped, not JSON; the first one: line 3"), "{losses:?}");
        assert!(losses[2].starts_with("stdin: 1 line skipped, CSV: line 5"), "{losses:?}");
    }

    #[test]
    fn a_frame_may_carry_poses() {
        let (frames, _) =
            read("{\"t\":0,\"pose\":{\"hand\":[1,2,3,0,0,0,2],\"arm\":[0,0,0,0,0,1,0]},\"values\":{}}\n{\"t\":1,\"pose\":null}\n").unwrap();
        let (link, pose) = &frames[0].pose[0];
        assert_eq!((link.as_str(), pose.translation), ("hand", DVec3::new(1.0, 2.0, 3.0)));
        assert_eq!(pose.rotation, DQuat::IDENTITY);
        assert_eq!(frames[0].pose[1].0, "arm");
        assert!(frames[1].pose.is_empty());
        let pose = |numbers: &str| why(&format!("{{\"t\":0,\"pose\":{{\"hand\":[{numbers}]}}}}\n"));
        assert!(pose("1,2,3").contains("`hand` has 3 numbers"), "{}", pose("1,2,3"));
        assert!(pose("1,2,3,0,0,0,1,9").contains("has 8 numbers"));
        assert!(pose("1,2,3,0,0,0,0").contains("length 0e0"));
        assert!(pose("1,2,3,0,0,0,1e4").contains("length 1e4"));
        assert!(pose("1,2,3,0,0,0,null").contains("null"));
        assert!(why("{\"t\":0,\"pose\":{\"a\":[0,0,0,0,0,0,1],\"a\":[0,0,0,0,0,0,1]}}\n").contains("twice"));
    }

    #[test]
    fn a_frame_may_carry_joints() {
        let (frames, _) =
            read("{\"t\":0,\"joints\":{\"wrist\":0.5,\"slide\":-1}}\n{\"t\":1,\"joints\":null}\n").unwrap();
        assert_eq!(frames[0].joints, [("wrist".to_owned(), 0.5), ("slide".to_owned(), -1.0)]);
        assert!(frames[1].joints.is_empty());
        assert!(why("{\"t\":0,\"joints\":{\"a\":1,\"a\":1}}\n").contains("joint `a` appears twice"));
        assert!(why("{\"t\":0,\"joints\":[1]}\n").contains("positions by joint"));
        assert!(why("{\"t\":0,\"joints\":{\"a\":null}}\n").contains("line 1"));
    }

    #[test]
    fn errors_name_line_and_what_is_wrong() {
        let second = |line: &str| why(&format!("{{\"t\":0}}\n{line}\n"));
        assert!(second("{\"t\":1,\"values\":{\"4\":1,\"4\":1}}").starts_with("stdin: line 2, column"));
        assert!(second("{\"t\":1,\"values\":{\"4\":1,\"4\":1}}").contains("taxel 4 appears twice"));
        assert!(second("{\"t\":1,\"values\":{\"palm\":1}}").contains("`palm` is not a taxel id"));
        assert!(second("{\"t\":1,\"values\":{\"4\":\"1\"}}").contains("without quotes"));
        assert!(second("{\"t\":1,\"values\":{\"4\":true}}").contains("for taxel 4"));
        assert!(second("{\"t\":1,\"values\":[1,2]}").contains("values by taxel id"));
        assert!(second("{\"t\":1,\"t\":1}").contains("`t` appears twice"));
        assert!(second("{\"t\":1,\"vals\":{}}").contains("no `vals`"));
        assert!(second("{\"values\":{}}").contains("no `t`"));
        assert!(second("{\"t\":\"now\"}").starts_with("stdin: line 2"));
        assert!(second("{\"t\":1}}").contains("line 2"));
        assert!(second("hello").contains("one line like"));
        // With its newline, a line that is cut short is an error.
        assert!(second("{\"t\":1,\"val").contains("line 2"));
        // The same taxel on the next line is not a duplicate.
        assert_eq!(read("{\"t\":0,\"values\":{\"4\":1}}\n{\"t\":1,\"values\":{\"4\":1}}\n").unwrap().0.len(), 2);
    }

    #[test]
    fn values_of_taxels_that_the_body_does_not_have_are_left_out_named_once_and_counted() {
        let mut source = source(
            "{\"t\":0,\"values\":{\"5\":1,\"4\":2,\"6\":null}}\n{\"t\":1,\"values\":{\"5\":1,\"8\":\"nan\",\"9\":3}}\n",
        );
        let mut frame = Frame::missing(0.0, 3);
        assert!(source.next_frame(&mut frame).unwrap());
        assert_eq!(format!("{:?}", frame.values), "[2, missing, missing]");
        let start = "stdin: line 1: the body has no taxel 5; its values are left out";
        assert!(source.notices()[0].starts_with(start) && source.notices().is_empty());
        assert!(source.next_frame(&mut frame).unwrap());
        assert_eq!(format!("{:?}", frame.values), "[missing, missing, 3]");
        assert!(source.notices()[0].contains("no taxel 8;"));
        assert_eq!(source.losses(), ["stdin: 3 values of taxels that the body does not have (5, 8)"]);
        assert!(!source.next_frame(&mut frame).unwrap());
    }

    #[test]
    fn strictly_a_taxel_that_the_body_does_not_have_is_an_error() {
        let mut source = source("{\"t\":0}\n{\"t\":1,\"values\":{\"5\":1}}\n").strict();
        let mut frame = Frame::missing(0.0, 3);
        assert!(source.next_frame(&mut frame).unwrap());
        let error = source.next_frame(&mut frame).unwrap_err().to_string();
        assert!(error.starts_with("stdin: line 2, column") && error.contains("no taxel 5; leave it out"), "{error}");
    }

    #[test]
    fn csv_is_distinguished_from_json() {
        for line in ["t,4,7", "0.5, 1,-2e3,", "\u{feff}t,4", "4,7\r"] {
            assert!(why(&format!("{line}\n0,1,2\n")).ends_with("use --source csv:-"), "{}", why(line));
        }
        for line in ["hello, world", "7", "{\"t\":0,}", "[0,1,2]"] {
            assert!(!why(&format!("{line}\n")).contains("csv:-"), "{line}");
        }
    }

    #[test]
    fn a_last_line_cut_short_anywhere_is_a_loss() {
        let last =
            "{\"t\":1.25,\"values\":{\"4\":null,\"7\":\"nan\",\"9\":-1.5e-3},\"pose\":{\"hand\":[0,0,0,0,0,0,1]}}";
        for cut in 1..last.len() {
            let (frames, losses) = read(&format!("{{\"t\":0}}\n{}", &last[..cut])).unwrap();
            assert_eq!((frames.len(), losses.len()), (1, 1), "cut at {cut}");
            assert!(losses[0].starts_with("stdin: line 2: last line truncated"));
        }
        assert_eq!(read(&format!("{{\"t\":0}}\n{last}")).unwrap().0.len(), 2);
    }

    #[test]
    fn a_line_without_end_does_not_fill_the_memory() {
        let endless = BufReader::new(std::io::repeat(b' '));
        let error = NdjsonSource::new("stdin", endless, vec![]).next_frame(&mut Frame::default()).unwrap_err();
        assert!(error.to_string().contains("line 1: a line of over 64 MiB"), "{error}");
    }
}
