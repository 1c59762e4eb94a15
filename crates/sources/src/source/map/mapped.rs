//! Frames from arrays within messages, wherever these come from.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

use super::super::Source;
use super::super::skipped_bad::SkippedBad;
use super::array_map::ArrayMap;
use super::body;
use super::taxels::MappedTaxels;
use crate::error::{Error, Result, failed};
use crate::signal::{Frame, FrameTime, RawValue};

/// What was read of a message.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Came {
    /// A message with this time.
    Message(FrameTime),
    /// One that was not whole, which the reader counts.
    Damaged,
    /// There is no other one.
    End,
}

/// Messages with arrays of values.
pub trait Messages {
    /// Puts the values of the next message at the end of `values`.
    ///
    /// # Errors
    /// It cannot be read, or has not what the map says.
    fn next(&mut self, values: &mut Vec<RawValue>) -> Result<Came>;

    /// Whether its last error is of what sends messages, and not of one message: the next ones would be errors too, so that it is never
    /// skipped.
    fn has_failed(&self) -> bool {
        false
    }

    /// As [`Source::stop_by`]: then there is no other message.
    fn stop_by(&mut self, _stopped: &Arc<AtomicBool>) {}

    /// The names of the last message's sensors, with how many values each has, or taxels with three axes; none where they have no names.
    fn named(&self) -> &[(String, usize)] {
        &[]
    }

    /// How messages call it: a file or a topic.
    fn name(&self) -> String;

    /// What was taken for what, on a line, for the place before ": 9 values".
    fn taken(&self) -> String;

    /// The share of the input that has been read, 0..=1, if known.
    fn progress(&self) -> Option<f64> {
        None
    }

    /// Messages about what came since the last call, a line each.
    fn notices(&mut self) -> Vec<String> {
        Vec::new()
    }

    /// What was not read, a line each.
    fn losses(&self) -> Vec<String> {
        Vec::new()
    }

    /// Whether any value so far was stale.
    fn has_stale(&self) -> bool {
        false
    }

    /// When the last message was read, where it comes live.
    fn read_at(&mut self) -> Option<Instant> {
        None
    }
}

/// Frames from arrays within messages.
pub struct MappedSource {
    messages: Box<dyn Messages + Send>,
    map: ArrayMap,
    taxels: MappedTaxels,
    /// How many values a message has; 0 before the first one.
    count: usize,
    /// The names of sensors, with how many values each has.
    named: Vec<(String, usize)>,
    /// The first message, until it is given.
    first: Option<(FrameTime, Vec<RawValue>)>,
    values: Vec<RawValue>,
    skipped: SkippedBad,
    notices: Vec<String>,
}

somatic_skin::debug_by_name!(MappedSource);

impl MappedSource {
    /// Reads the first of `messages`, which says how many values there are. Wrong ones are skipped and counted with `skip_bad`.
    ///
    /// # Errors
    /// There is no message; it has not what the map says, or not as many values as the map has taxels.
    pub fn new(messages: Box<dyn Messages + Send>, map: &ArrayMap, skip_bad: bool) -> Result<Self> {
        let mut source = Self {
            messages,
            map: map.clone(),
            taxels: MappedTaxels::default(),
            count: 0,
            named: Vec::new(),
            first: None,
            values: Vec::new(),
            skipped: SkippedBad::new(skip_bad),
            notices: Vec::new(),
        };
        let Some(time) = source.read()? else {
            return Err(
                Error::failed("no message has values; is it the right file and map?").at(source.messages.name())
            );
        };
        let count = source.values.len();
        if count == 0 {
            return Err(
                failed!("{}: the array has no values in the first message", map.paths()).at(source.messages.name())
            );
        }
        source.first = Some((time, source.values.clone()));
        let taxels = MappedTaxels::new(Some(map), None, count, None);
        let taxels = taxels.map_err(|e| e.at(&map.name).at(source.messages.name()))?;
        (source.taxels, source.count) = (taxels, count);
        source.named = source.messages.named().to_vec();
        let of_sensors = match &source.named[..] {
            [] => String::new(),
            [(one, _)] => format!(" of the sensor {one}"),
            [(first, _), .., (last, _)] => format!(" of {} sensors, {first} to {last}", source.named.len()),
        };
        if !source.named.is_empty() {
            source.map.pads = map.pads_of(&source.named);
        }
        let taken = source.messages.taken();
        source.notices.push(format!("{taken}: {count} values a message{of_sensors}{}", map.treatment()));
        let own = map.notes.iter().map(|note| format!("{}: {note}", map.name));
        source.notices.extend(own);
        Ok(source)
    }

    /// The next message's time, with its values in `self.values`. `None` at the end.
    fn read(&mut self) -> Result<Option<FrameTime>> {
        loop {
            self.values.clear();
            let wrong = match self.messages.next(&mut self.values) {
                Ok(Came::End) => return Ok(None),
                Ok(Came::Damaged) => continue,
                Ok(Came::Message(time)) if self.count == 0 => return Ok(Some(time)),
                Ok(Came::Message(time)) if self.values.len() == self.count => {
                    if self.messages.named() == self.named {
                        return Ok(Some(time));
                    }
                    let what = Error::failed(
                        "its sensors have other names than those of the first message, or stand elsewhere",
                    );
                    (
                        "other names of sensors",
                        what.at(format!("{}: the message of {} s", self.messages.name(), time.s)),
                    )
                }
                Ok(Came::Message(time)) => {
                    let what = failed!("it has {} values, the first one {}", self.values.len(), self.count);
                    let error = what.at(format!("{}: the message of {} s", self.messages.name(), time.s));
                    ("another number of values", error)
                }
                Err(e) if self.messages.has_failed() => return Err(e),
                Err(e) => ("not what the map says", e),
            };
            self.skipped.skip("message", wrong.0, wrong.1)?;
        }
    }

    /// A body for its values, a `.glb`: the map's pads, a grid, or a row.
    ///
    /// # Errors
    /// The map has pads or a grid for another number of values.
    pub fn body(&self) -> Result<Vec<u8>> {
        body::glb(&self.map, &self.taxels.channels).map_err(|e| e.at(&self.map.name))
    }

    /// What is to be said of [`MappedSource::body`].
    #[must_use]
    pub fn about_body(&self) -> String {
        body::about(&self.map, &self.taxels.channels)
    }

    /// Makes its taxels those of a body that has `taxels`: where the map does not name them, they are the body's in ascending order, or by
    /// `mujoco`, the indices of values. Named ones that the body lacks are skipped, and a notice counts them.
    ///
    /// # Errors
    /// There are more or fewer values than taxels, or the body lacks all of them, or their axes.
    pub fn for_body(mut self, taxels: &[u32]) -> Result<Self> {
        if self.map.ids.is_none() {
            let named = MappedTaxels::new(Some(&self.map), None, self.count, Some(taxels));
            self.taxels = named.map_err(|e| {
                failed!("{e}; name the values' taxels in the map: ids = \"0-15\"").at(self.messages.name())
            })?;
        }
        let skipped = self.taxels.skip_absent(taxels, true, "ids in the map names the values' taxels");
        let skipped = skipped.map_err(|e| e.at(self.messages.name()))?;
        self.notices.extend(skipped.map(|what| format!("{}: {what}", self.messages.name())));
        Ok(self)
    }

    /// What was taken for what, a line each, once.
    pub fn take_notices(&mut self) -> Vec<String> {
        std::mem::take(&mut self.notices)
    }
}

impl Source for MappedSource {
    fn taxels(&self) -> &[u32] {
        &self.taxels.channels
    }

    fn next_frame(&mut self, frame: &mut Frame) -> Result<bool> {
        let time = match self.first.take() {
            Some((time, values)) => {
                self.values = values;
                time
            }
            None => match self.read()? {
                Some(time) => time,
                None => return Ok(false),
            },
        };
        frame.clear();
        frame.values.clone_from(&self.values);
        self.taxels.arrange(&mut frame.values);
        frame.set_time(time);
        Ok(true)
    }

    fn stop_by(&mut self, stopped: &Arc<AtomicBool>) {
        self.messages.stop_by(stopped);
    }

    fn progress(&self) -> Option<f64> {
        self.messages.progress()
    }

    fn has_stale(&self) -> bool {
        self.messages.has_stale()
    }

    fn read_at(&mut self) -> Option<Instant> {
        self.messages.read_at()
    }

    fn notices(&mut self) -> Vec<String> {
        let mut notices = self.take_notices();
        notices.extend(self.messages.notices());
        notices.extend(self.skipped.take_notices());
        notices
    }

    fn losses(&self) -> Vec<String> {
        self.messages.losses().into_iter().chain(self.skipped.losses()).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::signal::Channel;

    struct Given(Vec<Result<Vec<f64>>>);

    impl Messages for Given {
        fn next(&mut self, values: &mut Vec<RawValue>) -> Result<Came> {
            if self.0.is_empty() {
                return Ok(Came::End);
            }
            values.extend(self.0.remove(0)?.into_iter().map(RawValue::new));
            Ok(Came::Message(FrameTime::from_ns(5)))
        }

        fn name(&self) -> String {
            "given".to_owned()
        }

        fn taken(&self) -> String {
            "given: a".to_owned()
        }
    }

    /// Messages up to where what sends them breaks, and is asked again.
    struct Breaks(u32);

    impl Messages for Breaks {
        fn next(&mut self, values: &mut Vec<RawValue>) -> Result<Came> {
            self.0 += 1;
            values.push(RawValue::new(1.0));
            match self.0 {
                ..3 => Ok(Came::Message(FrameTime::from_ns(5))),
                3..9 => Err(Error::failed("the line is cut")),
                _ => panic!("it is asked for ever"),
            }
        }

        fn has_failed(&self) -> bool {
            self.0 > 2
        }

        fn name(&self) -> String {
            "line".to_owned()
        }

        fn taken(&self) -> String {
            "line: a".to_owned()
        }
    }

    #[test]
    fn what_breaks_is_not_skipped() {
        let map = ArrayMap::parse("values = 'a'").unwrap();
        let mut source = MappedSource::new(Box::new(Breaks(0)), &map, true).unwrap();
        let mut frame = Frame::default();
        assert!(source.next_frame(&mut frame).unwrap() && source.next_frame(&mut frame).unwrap());
        assert_eq!(source.next_frame(&mut frame).unwrap_err().to_string(), "the line is cut");
        assert!(source.losses().is_empty());
    }

    fn frames(given: Vec<Result<Vec<f64>>>, map: &str, skip_bad: bool) -> Result<(Vec<Vec<RawValue>>, Vec<String>)> {
        let map = ArrayMap::parse(map)?;
        let mut source = MappedSource::new(Box::new(Given(given)), &map, skip_bad)?;
        let (mut frame, mut all) = (Frame::default(), Vec::new());
        while source.next_frame(&mut frame)? {
            assert_eq!(frame.values.len(), source.taxels().len());
            all.push(frame.values.clone());
        }
        Ok((all, source.losses()))
    }

    #[test]
    fn a_message_that_does_not_fit_is_an_error_or_skipped() {
        let given = || vec![Ok(vec![1.0, 2.0]), Ok(vec![1.0]), Err(Error::failed("odd")), Ok(vec![3.0, 4.0])];
        let why = frames(given(), "values = 'a'", false).unwrap_err().to_string();
        assert!(why.contains("given: the message of") && why.contains("it has 1 values, the first one 2"), "{why}");
        let (all, losses) = frames(given(), "values = 'a'", true).unwrap();
        assert_eq!((all.len(), losses.len()), (2, 2), "{losses:?}");
        let why = frames(vec![], "values = 'a'", false).unwrap_err().to_string();
        assert!(why.contains("no message has values"), "{why}");
        let why = frames(given(), "values = 'a'\nids = '1-3'", false).unwrap_err().to_string();
        assert!(why.contains("ids names 3 taxels, and a message has 2 values"), "{why}");
    }

    #[test]
    fn taxels_with_three_axes_have_three_values() {
        let named = |name: &str| Channel::named(name).unwrap().0;
        let read = |map: &str, values: &[f64]| {
            let map = ArrayMap::parse(map).unwrap();
            MappedSource::new(Box::new(Given(vec![Ok(values.to_vec())])), &map, false)
        };
        let mut source = read("values = 'a'\naxes = 'uv-n'", &[1.0, 2.0, -3.0, 4.0, 5.0, -6.0]).unwrap();
        assert_eq!(source.taxels(), ["0.u", "0.v", "0", "1.u", "1.v", "1"].map(named));
        assert!(source.about_body().ends_with("each has three axes"), "{}", source.about_body());
        let mut frame = Frame::default();
        source.next_frame(&mut frame).unwrap();
        let values: Vec<f64> = frame.values.iter().filter_map(|value| value.number()).collect();
        assert_eq!(values, [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
        let body = crate::body::Body::from_bytes("pad", &source.body().unwrap()).unwrap();
        assert!(
            body.taxels.len() == 2 && body.taxels.iter().all(|taxel| taxel.modality == crate::body::Modality::Force3)
        );
        let channels = Channel::all_of(&body);
        assert_eq!(source.for_body(&channels).unwrap().taxels(), ["0.u", "0.v", "0", "1.u", "1.v", "1"].map(named));
        let apart = "values = ['x', 'y', 'z']\naxes = 'u,v,n'\nids = '9,4'";
        let source = read(apart, &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]).unwrap();
        assert_eq!(source.taxels(), ["9.u", "4.u", "9.v", "4.v", "9", "4"].map(named));
        let why = read("values = 'a'\naxes = 'uvn'", &[1.0; 5]).unwrap_err().to_string();
        assert!(why.contains("axes: 5 values are not three for each taxel"), "{why}");
        let pressure =
            read("values = 'a'\naxes = 'uvn'", &[1.0; 6]).unwrap().for_body(&[4, 9]).unwrap_err().to_string();
        assert!(pressure.contains("a message has 2 taxels with three axes, and the body 0 taxels"), "{pressure}");
    }

    #[test]
    fn taxels_are_the_maps_or_the_bodys() {
        let source = |map: &str| {
            let map = ArrayMap::parse(map).unwrap();
            MappedSource::new(Box::new(Given(vec![Ok(vec![1.0, 2.0])])), &map, false).unwrap()
        };
        assert_eq!(source("values = 'a'").for_body(&[9, 4]).unwrap().taxels(), [4, 9]);
        assert_eq!(source("values = 'a'\nids = '9,4'").for_body(&[4, 5, 9]).unwrap().taxels(), [9, 4]);
        assert!(
            source("values = 'a'").for_body(&[4]).unwrap_err().to_string().contains("2 values, and the body 1 taxels")
        );
        let [four_u, four_v] = ["4.u", "4.v"].map(|name| Channel::named(name).unwrap().0);
        assert_eq!(source("values = 'a'\nids = '4.v,4'").for_body(&[4, four_u, four_v]).unwrap().taxels(), [four_v, 4]);
        assert!(source("values = 'a'\nids = '9,4'").for_body(&[5]).unwrap_err().to_string().contains("no taxel 9"));
    }

    /// What `map` reads of one message with `values` for a body with these channels: names, numbers, notices.
    fn read_for(map: &ArrayMap, values: &[f64], body: &[&str]) -> Result<(Vec<String>, Vec<f64>, Vec<String>)> {
        let body: Vec<u32> = body.iter().map(|name| Channel::named(name).unwrap().0).collect();
        let source = MappedSource::new(Box::new(Given(vec![Ok(values.to_vec())])), map, false)?;
        let mut source = source.for_body(&body)?;
        let mut frame = Frame::default();
        source.next_frame(&mut frame)?;
        let names = source.taxels().iter().map(|&channel| Channel(channel).to_string()).collect();
        Ok((names, frame.values.iter().filter_map(|value| value.number()).collect(), source.notices().split_off(1)))
    }

    #[test]
    fn taxels_that_the_body_lacks_are_skipped_and_counted() {
        let map = ArrayMap::parse("values = 'a'\naxes = 'nu-v'\nids = '8,4,2'").unwrap();
        let values = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0];
        let (names, numbers, notices) = read_for(&map, &values, &["4", "4.u", "4.v", "9"]).unwrap();
        assert_eq!((names.join(" ").as_str(), &numbers[..]), ("4 4.u 4.v", &[4.0, 5.0, -6.0][..]));
        assert_eq!(notices, ["given: the body lacks 2 of 3 taxels, which are skipped: 2, 8"]);
        for (body, says) in [(["9", "10"], "no taxel 8;"), (["4", "8"], "no taxel 8.u;")] {
            let why = read_for(&map, &values, &body).unwrap_err().to_string();
            assert!(why.contains(says) && why.lines().count() == 1, "{why}");
        }
    }

    #[test]
    fn a_skin_of_mujoco_reads_its_own_data() {
        let map = ArrayMap::named("mujoco").unwrap();
        let values: Vec<f64> = (0..12).map(f64::from).collect();
        // Of four bins two meet the shape: all normals come first, then the site's x, then its y, against n × t.
        let (names, numbers, notices) = read_for(&map, &values, &["1", "1.u", "1.v", "2", "2.u", "2.v"]).unwrap();
        assert_eq!(names.join(" "), "1 2 1.u 2.u 1.v 2.v");
        assert_eq!(numbers, [1.0, 2.0, 5.0, 6.0, -9.0, -10.0]);
        assert_eq!(notices, ["given: the body lacks 2 of 4 taxels, which are skipped: 0, 3"]);
        let (names, numbers, notices) = read_for(&map, &values, &["1", "11"]).unwrap();
        assert_eq!((names.join(" ").as_str(), &numbers[..]), ("1 11", &[1.0, 11.0][..]));
        assert!(notices[0].contains("lacks 10 of 12 taxels, which are skipped: 0, 2, 3 …"), "{notices:?}");
        // A second sensor with three axes, or one with other values among them.
        for (body, count) in [(&["0", "0.u", "0.v", "6", "6.u", "6.v"][..], 12), (&["0", "0.u", "0.v"], 5)] {
            let why = read_for(&map, &values[..count], body).unwrap_err().to_string();
            assert!(why.contains("are not all of one sensor with three axes"), "{why}");
        }
        let mixed = read_for(&map, &values, &["0", "1", "1.u", "1.v"]).unwrap_err().to_string();
        assert!(mixed.contains("name the values' taxels in the map"), "{mixed}");
        assert!(
            read_for(&map, &values, &["7", "12"]).unwrap_err().to_string().contains("12 values, and the body 2 taxels")
        );
    }
}
