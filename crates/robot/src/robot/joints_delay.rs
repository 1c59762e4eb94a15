//! How much later the joints' clock stamps an instant than the frames', from when their messages came to one recorder.

use std::fmt;
use std::path::PathBuf;

use super::bag_source::frames_of;
use super::bag_states::states_of;
use super::messages::{Cdr as _, CdrReader, Float32MultiArray, Header, Message as _};
use crate::error::{Error, Result};
use crate::recording::BagReader;
use crate::source::BagName;

/// How long messages of a stream took from their stamps, by their own clock, to a recorder, by its clock.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Transport {
    /// Messages that have a stamp.
    pub messages: usize,
    least_ns: i128,
    median_ns: i128,
}

impl Transport {
    /// The transport times `took_ns`. `None` if there are none.
    fn from_spans(mut took_ns: Vec<i128>) -> Option<Self> {
        took_ns.sort_unstable();
        let (least_ns, median_ns) = (*took_ns.first()?, *took_ns.get(took_ns.len() / 2)?);
        Some(Self { messages: took_ns.len(), least_ns, median_ns })
    }

    /// The median of the spans less the least of them, s.
    #[must_use]
    pub fn spread_s(&self) -> f64 {
        (self.median_ns - self.least_ns) as f64 * 1e-9
    }
}

/// An estimate of how much later the joints' clock stamps an instant than the frames' clock.
///
/// It takes the fastest message of each stream to have been as long on its way as that of the other, and the clocks not to drift.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DelayEstimate {
    /// Of frames.
    pub frames: Transport,
    /// Of joint states.
    pub joints: Transport,
}

impl DelayEstimate {
    /// Estimates it from the frames and the joint states of one bag, whose recorder had one clock for both.
    ///
    /// # Errors
    /// They are of two bags, or messages of one have no stamps; or as for reading them.
    pub fn of_bags(frames: &BagName, joints: &BagName) -> Result<Self> {
        let (mut of_frames, mut of_joints) = (frames_of(frames)?, states_of(joints)?);
        let place =
            |name: &BagName, reader: &BagReader| format!("{}: {}", name.path.display(), reader.topics().join(", "));
        let (frames_at, joints_at) = (place(frames, &of_frames), place(joints, &of_joints));
        if of_frames.kind() == Float32MultiArray::TYPE {
            let what = "messages of std_msgs/msg/Float32MultiArray have no stamps, and --joints-delay auto compares stamps; \
                        record sensor_msgs/msg/PointCloud2, or give --joints-delay in seconds";
            return Err(Error::failed(what).at(frames_at));
        }
        let canonical = |file: &PathBuf| file.canonicalize().unwrap_or_else(|_| file.clone());
        let files: Vec<PathBuf> = of_frames.files().iter().map(canonical).collect();
        if !of_joints.files().iter().any(|file| files.contains(&canonical(file))) {
            let what = format!(
                "--joints-delay auto needs joint states and frames that one recorder took, and {} is another bag; record both \
                 topics into one, or give the delay in seconds",
                frames.path.display()
            );
            return Err(Error::failed(what).at(joints.path.display()));
        }
        Ok(Self { frames: transport(&mut of_frames, &frames_at)?, joints: transport(&mut of_joints, &joints_at)? })
    }

    /// How much later the joints' clock stamps an instant than the frames' clock, s.
    #[must_use]
    pub fn delay_s(&self) -> f64 {
        (self.frames.least_ns - self.joints.least_ns) as f64 * 1e-9
    }
}

impl fmt::Display for DelayEstimate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { frames, joints } = self;
        write!(
            f,
            "--joints-delay auto is {:.6} s, from {} clouds and {} states, as if the fastest of each took equally long to the \
             recorder; at the median, clouds took {:.1} ms longer than their fastest, and states {:.1} ms",
            self.delay_s(),
            frames.messages,
            joints.messages,
            frames.spread_s() * 1e3,
            joints.spread_s() * 1e3
        )
    }
}

/// How long the messages of `reader`, which begin with a header, took.
fn transport(reader: &mut BagReader, place: &str) -> Result<Transport> {
    let mut took_ns = Vec::new();
    while let Some(message) = reader.next_message()? {
        let header = CdrReader::new(message.data).and_then(|mut from| Header::read(&mut from));
        let stamp_ns = header.map_or(0, |header| header.stamp.nanoseconds());
        if stamp_ns != 0 {
            took_ns.push(i128::from(message.log_ns) - i128::from(stamp_ns));
        }
    }
    Transport::from_spans(took_ns).ok_or_else(|| {
        let what =
            "its messages have no stamps, and --joints-delay auto compares stamps; give --joints-delay in seconds";
        Error::failed(what).at(place)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_delay_is_the_difference_of_the_least_spans() {
        let transport = |took_ms: &[i128]| Transport::from_spans(took_ms.iter().map(|ms| ms * 1_000_000).collect());
        // The joints' clock is 250 ms ahead: less seems to pass until their messages come.
        let estimate =
            DelayEstimate { frames: transport(&[9, 2, 5]).unwrap(), joints: transport(&[-240, -248, -246]).unwrap() };
        assert!((estimate.delay_s() - 0.25).abs() < 1e-12);
        assert!((estimate.frames.spread_s() - 0.003).abs() < 1e-12);
        let line = estimate.to_string();
        assert!(line.starts_with("--joints-delay auto is 0.250000 s, from 3 clouds and 3 states"), "{line}");
        assert!(line.ends_with("clouds took 3.0 ms longer than their fastest, and states 2.0 ms"), "{line}");
        assert_eq!(transport(&[]), None);
    }
}
