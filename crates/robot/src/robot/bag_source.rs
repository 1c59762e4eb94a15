//! Frames from a bag of ROS 2, by the code that reads live topics.

use super::cloud_merge::{CloudMerge, TopicCloud};
use super::messages::{Float32MultiArray, Message as _, PointCloud2};
use super::places::{FRAME_TYPES, Places, not_read};
use crate::body::Body;
use crate::error::{Error, Result, failed};
use crate::recording::{BagMessage, BagReader, WantedTopics};
use crate::signal::{Channel, Frame, FrameTime};
use crate::source::{BagName, SkippedBad, Source};

/// The time `log_ns` by a recorder's clock.
pub(super) fn time_of(log_ns: u64) -> FrameTime {
    FrameTime::from_ns(i64::try_from(log_ns).unwrap_or(i64::MAX))
}

/// What is read of a bag, where frames are.
pub(super) fn frames_of(bag: &BagName) -> Result<BagReader> {
    let named: Vec<&str> = bag.kind.as_deref().into_iter().collect();
    if let Some(kind) = named.iter().find(|kind| !FRAME_TYPES.contains(kind)) {
        return Err(not_read(kind).at(bag.path.display()));
    }
    let kinds = if named.is_empty() { &FRAME_TYPES[..] } else { &named };
    let wanted = WantedTopics { topics: &bag.topics, kinds, merged: Some(PointCloud2::TYPE) };
    BagReader::open(&bag.path, &wanted)
}

/// Frames from topics of a bag in MCAP or SQLite, for the taxels of a body: clouds of points, or numbers in the body's order.
///
/// The time of a frame is its cloud's stamp. Where that is 0, and of numbers, which have none, it is when the message came, by
/// the recorder's clock. Clouds of several topics are merged as frames of several boards are: a topic whose last cloud is older
/// than three of its periods, and than 50 ms, leaves its taxels stale.
pub struct BagSource {
    path: String,
    bag: BagReader,
    /// Their names.
    topics: Vec<String>,
    places: Places,
    kind: Kind,
    notices: Vec<String>,
    skipped: SkippedBad,
}

somatic_skin::debug_by_name!(BagSource);

/// What is read.
enum Kind {
    Array,
    Cloud,
    /// Clouds of several topics.
    Clouds(Box<CloudMerge>),
}

impl BagSource {
    /// Opens the topics that are named; or the only one that frames are read from, or all where they are clouds.
    ///
    /// # Errors
    /// The bag cannot be read, or has no such topics, or some that are not read together.
    pub fn open(bag: &BagName, body: &Body) -> Result<Self> {
        let reader = frames_of(bag)?;
        let places = Places::new(body);
        let kind = match reader.topics().len() {
            1 if reader.kind() == PointCloud2::TYPE => Kind::Cloud,
            1 => Kind::Array,
            topics => Kind::Clouds(Box::new(CloudMerge::new(topics, places.ids().len()))),
        };
        Ok(Self {
            path: bag.path.display().to_string(),
            topics: reader.topics().to_vec(),
            bag: reader,
            places,
            kind,
            notices: Vec::new(),
            skipped: SkippedBad::default(),
        })
    }

    /// Skips messages that do not fit the body, and counts them, if `is_asked`; else the first one is an error.
    #[must_use]
    pub fn skip_bad(mut self, is_asked: bool) -> Self {
        self.skipped = SkippedBad::new(is_asked);
        self
    }

    /// `error` of a message of topic `topic` that came at `log_s`.
    fn placed(&self, error: Error, topic: usize, log_s: f64) -> Error {
        let (path, name) = (&self.path, &self.topics[topic]);
        let others: Vec<&str> = self.topics.iter().filter(|other| *other != name).map(String::as_str).collect();
        let error = match others.is_empty() {
            true => error,
            false => failed!("{error}; or leave this topic out: ros2-mcap:{path}:{}", others.join(",")),
        };
        error.at(format!("{path}: {name}: the message of {log_s} s"))
    }

    /// Tells, at the end, which topics are not in all frames.
    fn tell_of_topics(&mut self) {
        let Kind::Clouds(merge) = &mut self.kind else { return };
        for (topic, summary) in merge.summaries() {
            self.notices.push(format!("{}: {}: {summary}", self.path, self.topics[topic]));
        }
    }
}

impl Kind {
    /// Reads `message` into `frame`, or to be merged; gives its time, s. `None` where it is damaged.
    fn read(
        &mut self,
        message: &BagMessage<'_>,
        places: &mut Places,
        topics: &[String],
        frame: &mut Frame,
    ) -> Option<Result<f64>> {
        let log = time_of(message.log_ns);
        let time_of = |cloud: &PointCloud2| match cloud.header.stamp.nanoseconds() {
            0 => log,
            _ => cloud.header.stamp.frame_time(),
        };
        Some(match self {
            Self::Array => {
                let array = Float32MultiArray::from_cdr(message.data)?;
                places.array(&array, log, frame).map(|()| log.s)
            }
            Self::Cloud => {
                let cloud = PointCloud2::from_cdr(message.data)?;
                places.cloud(&cloud, time_of(&cloud), frame).map(|()| frame.t_s)
            }
            Self::Clouds(merge) => {
                let cloud = PointCloud2::from_cdr(message.data)?;
                let time = time_of(&cloud);
                let mut values = Vec::new();
                places.points(&cloud, |index, value| values.push((index, value))).and_then(|()| {
                    let cloud = TopicCloud { topic: message.topic, time, log_s: log.s, values };
                    merge.push(cloud).map(|()| time.s).map_err(|(index, other)| {
                        let (taxel, other) = (Channel(places.ids()[index]), &topics[other]);
                        failed!("taxel {taxel} is in clouds of {other}, too; record each taxel on one topic")
                    })
                })
            }
        })
    }
}

impl Source for BagSource {
    fn taxels(&self) -> &[u32] {
        self.places.ids()
    }

    fn next_frame(&mut self, frame: &mut Frame) -> Result<bool> {
        loop {
            if let Kind::Clouds(merge) = &mut self.kind {
                if merge.next_frame(frame) {
                    return Ok(true);
                }
                if merge.has_ended() {
                    self.tell_of_topics();
                    return Ok(false);
                }
            }
            let Some(message) = self.bag.next_message()? else {
                let Kind::Clouds(merge) = &mut self.kind else { return Ok(false) };
                merge.end();
                continue;
            };
            let (topic, bytes, log_s) = (message.topic, message.data.len(), time_of(message.log_ns).s);
            match self.kind.read(&message, &mut self.places, &self.topics, frame) {
                Some(Ok(t_s)) => self.bag.saw(t_s),
                Some(Err(e)) => {
                    let error = self.placed(e, topic, log_s);
                    self.skipped.skip("message", "values that do not fit", error)?;
                    continue;
                }
                None => {
                    self.bag.damaged(bytes);
                    continue;
                }
            }
            if !matches!(self.kind, Kind::Clouds(_)) {
                return Ok(true);
            }
        }
    }

    fn progress(&self) -> Option<f64> {
        Some(self.bag.progress())
    }

    fn report_stale(&mut self) {
        if let Kind::Clouds(merge) = &mut self.kind {
            merge.report_stale();
        }
    }

    fn has_stale(&self) -> bool {
        matches!(&self.kind, Kind::Clouds(merge) if merge.has_stale())
    }

    fn notices(&mut self) -> Vec<String> {
        let of_places = std::mem::take(&mut self.places.notices);
        let mut notices: Vec<String> = of_places.into_iter().map(|what| format!("{}: {what}", self.path)).collect();
        notices.append(&mut self.notices);
        notices.extend(self.skipped.take_notices());
        notices
    }

    fn losses(&self) -> Vec<String> {
        self.bag.losses().into_iter().chain(self.skipped.losses()).collect()
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::super::messages::{Header, JointState, PointField, Time};
    use somatic_testing::{damage, numbers};

    use super::*;
    use crate::bundled;
    use crate::output::OutputPaths;
    use crate::recording::{BAG_METADATA, BagType, BagWriter};

    const FIRST_NS: u64 = 1_700_000_000_000_000_000;
    const NAME: &str = "a.mcap";

    /// Writes a bag at `path` with a cloud, an array and a state at each of `stamps`, ns.
    fn write(path: &Path, body: &Body, stamps: &[u64]) {
        let none: [&str; 0] = [];
        let output = OutputPaths::new(false, none).add_folder(path, [NAME, BAG_METADATA]).unwrap();
        let mut bag = BagWriter::create(output, NAME, true).unwrap();
        let kind = |name, hash, definition| BagType { name, hash, definition };
        let [clouds, arrays, states] = [
            ("/clouds", kind(PointCloud2::TYPE, PointCloud2::HASH, PointCloud2::definition())),
            ("/arrays", kind(Float32MultiArray::TYPE, Float32MultiArray::HASH, Float32MultiArray::definition())),
            ("/joints", kind(JointState::TYPE, JointState::HASH, JointState::definition())),
        ]
        .map(|(name, kind)| bag.topic(name, &kind).unwrap());
        let count = body.taxels.len() as u32;
        for (index, &ns) in stamps.iter().enumerate() {
            let header = Header { stamp: Time::from_ns(ns), frame_id: String::new() };
            let cloud = PointCloud2 {
                header: header.clone(),
                height: 1,
                width: count,
                fields: vec![PointField { name: "value".to_owned(), offset: 0, datatype: 7, count: 1 }],
                point_step: 4,
                row_step: 4 * count,
                data: (0..count).flat_map(|at| ((at + index as u32) as f32).to_le_bytes()).collect(),
                ..PointCloud2::default()
            };
            bag.write(clouds, ns, &cloud.to_cdr()).unwrap();
            let array = Float32MultiArray { data: vec![0.0; count as usize], ..Float32MultiArray::default() };
            bag.write(arrays, ns, &array.to_cdr()).unwrap();
            let (name, position) = (vec!["wrist".to_owned()], vec![index as f64]);
            let state = JointState { header, name, position, ..JointState::default() };
            bag.write(states, ns, &state.to_cdr()).unwrap();
        }
        bag.finish().unwrap();
    }

    /// The frames of `topic` in the bag at `path`, and what is lost.
    fn read(path: &Path, topic: &str, body: &Body) -> Result<(Vec<Frame>, Vec<String>)> {
        let mut source = BagSource::open(&BagName { topics: vec![topic.into()], ..BagName::new(path) }, body)?;
        let mut frame = Frame::default();
        let mut frames = Vec::new();
        while source.next_frame(&mut frame)? {
            frames.push(frame.clone());
        }
        Ok((frames, source.losses()))
    }

    #[test]
    fn stamps_since_1970_keep_every_nanosecond() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("bag");
        let body = Body::from_bytes("hand", bundled::HAND).unwrap();
        // Steps that a double of seconds since 1970 does not have.
        let stamps: Vec<u64> = (0..20).map(|index| FIRST_NS + index * 10_000_077).collect();
        write(&path, &body, &stamps);
        for topic in ["/clouds", "/arrays"] {
            let times: Vec<FrameTime> = read(&path, topic, &body).unwrap().0.iter().map(Frame::time).collect();
            let ns: Vec<u64> = times.iter().map(|time| time.ns() as u64).collect();
            assert_eq!(ns, stamps, "{topic}");
            assert!(times.windows(2).all(|pair| pair[1].since(pair[0]) == 0.010_000_077), "{topic}");
            // In a double alone they are not.
            assert!(times.windows(2).any(|pair| (pair[1].s - pair[0].s - 0.010_000_077).abs() > 1e-7), "{topic}");
        }
        let states = super::super::joint_states_of_bag(&BagName::new(&path), false).unwrap();
        let at = FrameTime::from_ns((FIRST_NS + 10_000_077 + 100) as i64);
        let found = states.at(0, at, false).unwrap();
        assert_eq!((found.age_s, found.position), (1e-7, 1.0 + 1e-7 / 0.010_000_077));
    }

    /// Reads damaged bags for `seconds`, or `rounds` times; for harnesses.
    pub(super) fn fuzz(seed: u64, rounds: u64, seconds: u64) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("bag");
        let body = Body::from_bytes("hand", bundled::HAND).unwrap();
        write(&path, &body, &(0..20).map(|index| FIRST_NS + index * 10_000_077).collect::<Vec<u64>>());
        let (whole, _) = read(&path, "/clouds", &body).unwrap();
        let originals = [NAME, BAG_METADATA].map(|name| std::fs::read(path.join(name)).unwrap());
        let (mut chance, start) = (numbers(seed), std::time::Instant::now());
        let mut reported = 0;
        for round in 0..rounds {
            if start.elapsed().as_secs() >= seconds {
                break;
            }
            // The metadata now and then.
            let which = usize::from(chance().is_multiple_of(8));
            for (index, (name, bytes)) in [NAME, BAG_METADATA].iter().zip(&originals).enumerate() {
                let mut bytes = bytes.clone();
                if index == which {
                    damage(&mut bytes, &mut chance);
                }
                std::fs::write(path.join(name), bytes).unwrap();
            }
            let began = std::time::Instant::now();
            match read(&path, "/clouds", &body) {
                Ok((frames, losses)) => {
                    let what = format!("round {round} of seed {seed}: {} frames", frames.len());
                    assert!(frames == whole || !losses.is_empty(), "{what}, and not a word");
                    assert!(losses.iter().all(|loss| loss.lines().count() == 1), "{what}: {losses:?}");
                    reported += u64::from(!losses.is_empty());
                }
                Err(e) => assert_eq!(e.to_string().lines().count(), 1, "{e}"),
            }
            if let Err(e) = super::super::joint_states_of_bag(&BagName::new(&path), false) {
                assert_eq!(e.to_string().lines().count(), 1, "{e}");
            }
            assert!(began.elapsed().as_secs() < 5, "round {round} of seed {seed} took {:?}", began.elapsed());
        }
        assert!(reported > 0, "nothing was damaged");
    }

    #[test]
    fn a_damaged_bag_is_read_unchanged_or_reported() {
        fuzz(1, 400, 60);
    }
}
