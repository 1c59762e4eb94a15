//! What is in a recording, without a look at what it says.

use std::collections::BTreeMap;

use super::reader::Reader;
use crate::error::Result;
use crate::signal::Frame;

/// Steps after which it is known how far frames usually lie apart.
const FIRST_STEPS: usize = 1000;
/// A step this many times the usual one is a gap.
const GAP: f64 = 2.5;

/// How frames follow each other.
#[derive(Clone, Debug, Default)]
pub struct Rhythm {
    /// Number of frames.
    pub frames: u64,
    /// Time of the first, and the latest of all, s.
    pub span_s: Option<[f64; 2]>,
    /// Steps that go back in time, or nowhere.
    pub backwards: u64,
    /// Steps over 2.5 times the usual one.
    pub gaps: u64,
    /// The longest of them: how long, and at what time it begins, s.
    pub longest_gap_s: Option<[f64; 2]>,
    usual_s: Option<f64>,
    steps: Vec<[f64; 2]>,
    last_s: f64,
}

impl Rhythm {
    /// Adds a frame at `t_s`.
    pub fn see(&mut self, t_s: f64) {
        self.frames += 1;
        let Some([_, latest]) = &mut self.span_s else {
            self.span_s = Some([t_s, t_s]);
            self.last_s = t_s;
            return;
        };
        *latest = latest.max(t_s);
        let step = [t_s - self.last_s, self.last_s];
        self.last_s = t_s;
        if step[0] <= 0.0 {
            self.backwards += 1;
        } else if let Some(usual) = self.usual_s {
            self.judge(step, usual);
        } else {
            self.steps.push(step);
            if self.steps.len() == FIRST_STEPS {
                self.settle();
            }
        }
    }

    /// Ends the count.
    pub fn finish(&mut self) {
        if self.usual_s.is_none() {
            self.settle();
        }
    }

    /// Frames a second while they come as usual, Hz.
    #[must_use]
    pub fn rate_hz(&self) -> Option<f64> {
        self.usual_s.map(|usual| 1.0 / usual)
    }

    fn settle(&mut self) {
        let steps = std::mem::take(&mut self.steps);
        let mut lengths: Vec<f64> = steps.iter().map(|step| step[0]).collect();
        lengths.sort_by(f64::total_cmp);
        let Some(&usual) = lengths.get(lengths.len() / 2) else { return };
        self.usual_s = Some(usual);
        for step in steps {
            self.judge(step, usual);
        }
    }

    fn judge(&mut self, step: [f64; 2], usual: f64) {
        if step[0] > GAP * usual {
            self.gaps += 1;
            if self.longest_gap_s.is_none_or(|longest| step[0] > longest[0]) {
                self.longest_gap_s = Some(step);
            }
        }
    }
}

/// A topic of a recording.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Topic {
    /// Its name.
    pub name: String,
    /// How its messages are encoded.
    pub encoding: String,
    /// How many there are.
    pub messages: u64,
    /// Their bytes.
    pub bytes: u64,
}

/// What is in a recording.
#[derive(Clone, Debug, Default)]
pub struct Survey {
    /// Its topics by name.
    pub topics: Vec<Topic>,
    /// Its frames.
    pub rhythm: Rhythm,
    /// Frames that pose links.
    pub posed: u64,
}

impl Survey {
    /// Reads all of `reader`, calling `progress` with how much of it is done.
    ///
    /// # Errors
    /// The file cannot be read, or is compressed.
    pub fn read(reader: &mut Reader, mut progress: impl FnMut(f64)) -> Result<Self> {
        let mut survey = Self::default();
        let mut counts: BTreeMap<u16, (u64, u64)> = BTreeMap::new();
        let mut frame = Frame::default();
        while let Some(message) = reader.next_message()? {
            let (messages, bytes) = counts.entry(message.channel).or_default();
            *messages += 1;
            *bytes += reader.data(&message).len() as u64;
            if reader.frame_of(&message, &mut frame) == Some(true) {
                survey.rhythm.see(frame.t_s);
                survey.posed += u64::from(!frame.pose.is_empty());
                if survey.rhythm.frames.is_multiple_of(64) {
                    progress(reader.progress());
                }
            }
        }
        survey.rhythm.finish();
        for (id, (messages, bytes)) in counts {
            let (name, encoding) = match reader.channels.get(&id) {
                Some(channel) => (channel.topic.clone(), channel.encoding.clone()),
                None => (format!("channel {id}"), String::new()),
            };
            survey.topics.push(Topic { name, encoding, messages, bytes });
        }
        survey.topics.sort_by(|a, b| a.name.cmp(&b.name));
        Ok(survey)
    }
}
