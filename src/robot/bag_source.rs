//! Frames from a bag of ROS 2, by the code that reads live topics.

use super::messages::{Float32MultiArray, Message as _, PointCloud2};
use super::places::{FRAME_TYPES, Places, not_read};
use crate::body::Body;
use crate::error::Result;
use crate::recording::{BagReader, WantedTopic};
use crate::signal::Frame;
use crate::source::{BagName, Source};

/// What is read of a bag, where frames are.
pub(super) fn frames_of(bag: &BagName) -> Result<BagReader> {
    let named: Vec<&str> = bag.kind.as_deref().into_iter().collect();
    if let Some(kind) = named.iter().find(|kind| !FRAME_TYPES.contains(kind)) {
        return Err(not_read(kind).at(bag.path.display()));
    }
    let kinds = if named.is_empty() { &FRAME_TYPES[..] } else { &named };
    BagReader::open(&bag.path, &WantedTopic { topic: bag.topic.as_deref(), kinds })
}

/// Frames from a topic of a bag in MCAP, for the taxels of a body: clouds of points, or numbers in the body's order.
///
/// The time of a frame is its cloud's stamp. Where that is 0, and of numbers, which have none, it is when the message came, by
/// the recorder's clock.
pub struct BagSource {
    name: String,
    bag: BagReader,
    places: Places,
    is_cloud: bool,
}

impl BagSource {
    /// Opens the topic that is named, or the only one that frames are read from.
    ///
    /// # Errors
    /// The bag cannot be read, or has no such topic, or several.
    pub fn open(bag: &BagName, body: &Body) -> Result<Self> {
        let reader = frames_of(bag)?;
        Ok(Self {
            name: format!("{}: {}", bag.path.display(), reader.topic()),
            is_cloud: reader.kind() == PointCloud2::TYPE,
            bag: reader,
            places: Places::new(body),
        })
    }
}

impl Source for BagSource {
    fn taxels(&self) -> &[u32] {
        self.places.ids()
    }

    fn next_frame(&mut self, frame: &mut Frame) -> Result<bool> {
        loop {
            let Some(message) = self.bag.next()? else { return Ok(false) };
            let (bytes, log_s) = (message.data.len(), message.log_ns as f64 / 1e9);
            let read = if self.is_cloud {
                PointCloud2::from_cdr(message.data).map(|cloud| {
                    self.places.cloud(&cloud, frame)?;
                    if cloud.header.stamp.nanoseconds() == 0 {
                        frame.t_s = log_s;
                    }
                    Ok(())
                })
            } else {
                Float32MultiArray::from_cdr(message.data).map(|array| self.places.array(&array, log_s, frame))
            };
            match read {
                Some(Ok(())) => {
                    self.bag.saw(frame.t_s);
                    return Ok(true);
                }
                Some(Err(e)) => return Err(e.at(format!("{}: the message of {log_s} s", self.name))),
                None => self.bag.damaged(bytes),
            }
        }
    }

    fn progress(&self) -> Option<f64> {
        Some(self.bag.progress())
    }

    fn losses(&self) -> Vec<String> {
        self.bag.losses().to_vec()
    }
}
