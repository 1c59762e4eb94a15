//! Messages as lines of JSON.

use std::fs::File;
use std::io::{BufRead, BufReader, Read as _};
use std::path::Path;
use std::time::Instant;

use serde_json::Value;

use super::array_map::{ArrayMap, MapTime};
use super::json;
use super::mapped::{Came, Messages};
use super::path::ArrayPath;
use super::sensor_names::named_sensors;
use crate::error::{Error, Result, failed};
use crate::limits::MAX_LINE_BYTES;
use crate::signal::{FrameTime, RawValue};

/// What the time of a message is usually called, and in how many of them there are in a second.
const TIMES: [(&str, f64); 8] = [
    ("t", 1.0),
    ("time", 1.0),
    ("timestamp", 1.0),
    ("stamp", 1.0),
    ("header.stamp", 1.0),
    ("ms", 1e3),
    ("time_ms", 1e3),
    ("t_ms", 1e3),
];

/// Messages as lines of JSON, from a file or a stream.
pub struct JsonLines {
    name: String,
    reader: Box<dyn BufRead + Send>,
    /// The bytes of the file and those that were read, where it is a file.
    length: Option<u64>,
    read: u64,
    map: ArrayMap,
    /// Found out from the first line, and what it is in words.
    time: Option<(Time, String)>,
    /// The names of the last message's sensors.
    named: Vec<(String, usize)>,
    line: Vec<u8>,
    line_number: u64,
    start: Instant,
    read_at: Option<Instant>,
    losses: Vec<String>,
    /// Whether the last read went wrong.
    has_failed: bool,
}

somatic_skin::debug_by_name!(JsonLines);

/// Where the time of a line is.
#[derive(Clone)]
enum Time {
    Arrival,
    At(ArrayPath, f64),
}

impl JsonLines {
    /// Reads `reader`, which messages call `name`.
    #[must_use]
    pub fn new(name: impl Into<String>, reader: impl BufRead + Send + 'static, map: &ArrayMap) -> Self {
        Self {
            name: name.into(),
            reader: Box::new(reader),
            length: None,
            read: 0,
            map: map.clone(),
            time: None,
            named: Vec::new(),
            line: Vec::new(),
            line_number: 0,
            start: Instant::now(),
            read_at: None,
            losses: Vec::new(),
            has_failed: false,
        }
    }

    /// Reads standard input.
    #[must_use]
    pub fn stdin(map: &ArrayMap) -> Self {
        Self::new("stdin", BufReader::with_capacity(1 << 16, std::io::stdin()), map)
    }

    /// Reads the file at `path`.
    ///
    /// # Errors
    /// It cannot be read.
    pub fn open(path: &Path, map: &ArrayMap) -> Result<Self> {
        let file = File::open(path).map_err(|e| Error::io(path, &e))?;
        let length = file.metadata().ok().map(|there| there.len());
        let reader = BufReader::with_capacity(1 << 16, file);
        Ok(Self { length, ..Self::new(path.display().to_string(), reader, map) })
    }

    /// Reads the next line that is not blank. `None` at the end, else whether it ends with a newline.
    fn read_line(&mut self) -> Result<Option<bool>> {
        loop {
            self.line.clear();
            self.line_number += 1;
            let most = (&mut self.reader).take(MAX_LINE_BYTES + 1).read_until(b'\n', &mut self.line);
            self.has_failed = most.is_err();
            let read = most.map_err(|e| Error::failed(e.to_string()))?;
            self.read_at = self.length.is_none().then(Instant::now);
            self.read += read as u64;
            if read == 0 {
                return Ok(None);
            }
            if self.line.len() as u64 > MAX_LINE_BYTES {
                return Err(failed!("a line of over {} MiB; a message is one line of JSON", MAX_LINE_BYTES >> 20));
            }
            let has_newline = self.line.last() == Some(&b'\n');
            if !self.line.trim_ascii().is_empty() {
                return Ok(Some(has_newline));
            }
        }
    }

    /// The current line's message; `None` where it is of another topic.
    fn message(&self, line: Value) -> Option<Value> {
        let Some(topic) = &self.map.message else { return Some(line) };
        let Value::Object(mut fields) = line else { return None };
        if fields.get("topic").and_then(Value::as_str) != Some(topic) {
            return None;
        }
        // As rosbridge sends it.
        Some(fields.remove("msg").unwrap_or(Value::Object(fields)))
    }

    /// The time of `message`.
    fn time(&mut self, message: &Value) -> Result<FrameTime> {
        if self.time.is_none() {
            self.time = Some(self.found_time(message)?);
        }
        match &self.time {
            Some((Time::At(path, per_second), _)) => {
                let value = json::one(message, path).map_err(|e| failed!("time: {e}"))?;
                let time = value.and_then(|value| time_of(value, *per_second));
                time.ok_or_else(|| failed!("time: `{path}` is not a time; a number or a stamp is"))
            }
            _ => Ok(FrameTime::from(self.start.elapsed().as_secs_f64())),
        }
    }

    /// Where the time is, as `message` has it.
    fn found_time(&self, message: &Value) -> Result<(Time, String)> {
        match &self.map.time {
            MapTime::Arrival => Ok((Time::Arrival, "time is when a line comes".to_owned())),
            MapTime::At(path, per_second) => {
                Ok((Time::At(path.clone(), *per_second), format!("time is {path}{}", unit_of(*per_second))))
            }
            MapTime::Usual => {
                for (name, per_second) in TIMES {
                    let path: ArrayPath = name.parse()?;
                    let value = json::one(message, &path).ok().flatten();
                    if value.and_then(|value| time_of(value, per_second)).is_some() {
                        return Ok((Time::At(path, per_second), format!("time is {name}{}", unit_of(per_second))));
                    }
                }
                Err(Error::failed(
                    "it has no t, time or timestamp; name its time in the map, as time = \"header.stamp\", or time = \"arrival\"",
                ))
            }
        }
    }
}

/// The unit of a time with so many units in a second, in words; nothing for seconds.
fn unit_of(per_second: f64) -> &'static str {
    match per_second {
        1e3 => " in ms",
        1e6 => " in µs",
        1e9 => " in ns",
        _ => " in s",
    }
}

/// The time that `value` is: a number with so many units in a second, or a stamp of ROS.
fn time_of(value: &Value, per_second: f64) -> Option<FrameTime> {
    let part = |names: [&str; 2]| names.into_iter().find_map(|name| value.get(name)?.as_i64());
    if let (Some(seconds), Some(ns)) = (part(["sec", "secs"]), part(["nanosec", "nsecs"])) {
        return seconds.checked_mul(1_000_000_000)?.checked_add(ns).map(FrameTime::from_ns);
    }
    let number = value.as_f64()? / per_second;
    number.is_finite().then(|| FrameTime::from(number))
}

impl Messages for JsonLines {
    fn next(&mut self, values: &mut Vec<RawValue>) -> Result<Came> {
        loop {
            let name = self.name.clone();
            let Some(has_newline) = self.read_line().map_err(|e| e.at(name))? else { return Ok(Came::End) };
            let line = self.line.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(&self.line);
            let place = format!("{}: line {}", self.name, self.line_number);
            let parsed: Value = match serde_json::from_slice(line) {
                Ok(parsed) => parsed,
                Err(e) if e.is_eof() && !has_newline => {
                    let bytes = self.line.len();
                    self.losses.push(format!("{place}: last line truncated after {bytes} bytes"));
                    return Ok(Came::End);
                }
                Err(_) => {
                    let first: String = String::from_utf8_lossy(line).chars().take(30).collect();
                    let what = failed!("`{}` is not JSON; a message is a line of JSON", first.trim());
                    return Err(what.at(place));
                }
            };
            let Some(message) = self.message(parsed) else { continue };
            let time = self.time(&message).map_err(|e| e.at(&place))?;
            for path in &self.map.values {
                let mut put = |number: Option<f64>| {
                    values.push(number.map_or(RawValue::MISSING, |number| self.map.value(number)));
                };
                let counts = json::values(&message, path, self.map.decoder, &mut put).map_err(|e| e.at(&place))?;
                if let Some(names) = &self.map.names {
                    let mut all = Vec::new();
                    json::texts(&message, names, &mut |name| all.push(name.to_owned()))
                        .map_err(|e| failed!("names: {e}").at(&place))?;
                    self.named = named_sensors(all, &counts).map_err(|e| e.at(&place))?;
                }
            }
            return Ok(Came::Message(time));
        }
    }

    fn has_failed(&self) -> bool {
        self.has_failed
    }

    fn named(&self) -> &[(String, usize)] {
        &self.named
    }

    fn name(&self) -> String {
        self.name.clone()
    }

    fn taken(&self) -> String {
        let time = self.time.as_ref().map_or("", |(_, words)| words);
        format!("{}: {}; {time}", self.name, self.map.paths())
    }

    fn progress(&self) -> Option<f64> {
        Some((self.read as f64 / self.length?.max(1) as f64).min(1.0))
    }

    fn losses(&self) -> Vec<String> {
        self.losses.clone()
    }

    fn read_at(&mut self) -> Option<Instant> {
        self.read_at.take()
    }
}

#[cfg(test)]
mod tests {
    use super::super::mapped::MappedSource;
    use super::*;
    use crate::signal::Frame;
    use crate::source::Source as _;

    type Frames = Vec<(f64, Vec<Option<f64>>)>;

    fn read(text: &str, map: &str) -> Result<(Frames, Vec<String>, Vec<String>)> {
        let map = ArrayMap::parse(map)?;
        let lines = JsonLines::new("lines", std::io::Cursor::new(text.as_bytes().to_vec()), &map);
        let mut source = MappedSource::new(Box::new(lines), &map, false)?;
        let (mut frame, mut all) = (Frame::default(), Vec::new());
        while source.next_frame(&mut frame)? {
            all.push((frame.t_s, frame.values.iter().map(|value| value.number()).collect()));
        }
        Ok((all, source.notices(), source.losses()))
    }

    #[test]
    fn lines_are_frames_by_the_map() {
        let text = "{\"time\":0.5,\"sensordata\":[1,30000]}\n\n{\"time\":1,\"sensordata\":[null,4]}\n";
        let (frames, notices, losses) = read(text, "values = 'sensordata'\nmissing = [30000]\nscale = 2").unwrap();
        assert_eq!(frames, [(0.5, vec![Some(2.0), None]), (1.0, vec![None, Some(8.0)])]);
        assert_eq!(
            notices,
            [
                "lines: sensordata; time is time in s: 2 values a message; 30000 counts as missing; numbers are multiplied by 2"
            ]
        );
        assert!(losses.is_empty());
        let cut = read("{\"t\":1,\"a\":[1]}\n{\"t\":2,\"a\":[", "values = 'a'").unwrap();
        assert_eq!((cut.0.len(), cut.2.len()), (1, 1));
    }

    #[test]
    fn a_topic_of_several_is_read_and_stamps_are_times() {
        let text = "{\"op\":\"publish\",\"topic\":\"/b\",\"msg\":{\"data\":[9]}}\n\
            {\"op\":\"publish\",\"topic\":\"/a\",\"msg\":{\"header\":{\"stamp\":{\"sec\":3,\"nanosec\":500000000}},\"data\":[1]}}\n";
        let (frames, ..) = read(text, "message = '/a'\nvalues = 'data'").unwrap();
        assert_eq!(frames, [(3.5, vec![Some(1.0)])]);
        let (frames, ..) = read("{\"clock_ms\":1500,\"d\":[1]}", "values = 'd'\ntime = 'clock_ms'").unwrap();
        assert_eq!(frames[0].0, 1.5);
        assert_eq!(read("{\"d\":[1]}", "values = 'd'\ntime = 'arrival'").unwrap().0.len(), 1);
    }

    #[test]
    fn names_of_sensors_go_with_their_arrays() {
        let line = |names: [&str; 2]| {
            format!(
                "{{\"t\":0,\"s\":[{{\"name\":\"{}\",\"v\":[1,2]}},{{\"name\":\"{}\",\"v\":[3]}}]}}\n",
                names[0], names[1]
            )
        };
        let map = "values = 's[*].v'\nnames = 's[*].name'";
        let (frames, notices, _) = read(&(line(["a", "b"]) + &line(["a", "b"])), map).unwrap();
        assert_eq!(frames.len(), 2);
        assert!(notices[0].contains("3 values a message of 2 sensors, a to b"), "{notices:?}");
        let why = read(&(line(["a", "b"]) + &line(["b", "a"])), map).unwrap_err().to_string();
        assert!(why.contains("other names than those of the first message"), "{why}");
        let why = read(&line(["a", "b"]), "values = 's[*].v'\nnames = 's[0].name'").unwrap_err().to_string();
        assert!(why.contains("it has 1 name, 2 arrays and 3 values"), "{why}");
        let why = read(&line(["a", "b"]), "values = 's[*].v'\nnames = 's[*].v'").unwrap_err().to_string();
        assert!(why.contains("names: `s[0].v` is an array, not text"), "{why}");
    }

    #[test]
    fn what_is_wrong_is_said_in_a_line_with_its_place() {
        for (text, map, says) in [
            ("{\"d\":[1]}", "values = 'd'", "lines: line 1: it has no t, time or timestamp"),
            ("{\"t\":0,\"d\":[1]}\nhello\n", "values = 'd'", "lines: line 2: `hello` is not JSON"),
            ("{\"t\":0,\"data\":[1]}", "values = 'dat'", "line 1: the line has no `dat`; did you mean `data`?"),
            ("{\"t\":\"x\",\"d\":[1]}", "values = 'd'\ntime = 't'", "time: `t` is not a time"),
            ("", "values = 'd'", "no message has values"),
            ("{\"t\":0,\"d\":[]}", "values = 'd'", "no values in the first message"),
        ] {
            let why = read(text, map).unwrap_err().to_string();
            assert!(why.contains(says) && why.lines().count() == 1, "{text}: {why}");
        }
    }
}
