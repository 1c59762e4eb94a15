//! Reads values and times of messages by a map, wherever these come from.

use super::plan::{Plan, TimePlace};
use super::walk::{Stamp, Taken, Trouble};
use crate::error::{Error, Result};
use crate::signal::{FrameTime, RawValue};
use crate::source::{ArrayMap, Lies, named_sensors};

/// Reads messages of one type by a map.
pub(in crate::robot) struct MessageReading {
    map: ArrayMap,
    plan: Plan,
    taken: Taken,
    named: Vec<(String, usize)>,
    /// Whether a message had no stamp.
    is_unstamped: bool,
}

impl MessageReading {
    pub(in crate::robot) fn new(map: &ArrayMap, plan: Plan) -> Self {
        Self { map: map.clone(), plan, taken: Taken::default(), named: Vec::new(), is_unstamped: false }
    }

    /// Puts the values of `message` at the end of `values`; gives its time, which is that of its coming, `came`, where it has none.
    /// `None` of a message that is not whole.
    ///
    /// # Errors
    /// It has not what the map says.
    pub(in crate::robot) fn read(
        &mut self,
        message: &[u8],
        came: FrameTime,
        values: &mut Vec<RawValue>,
    ) -> Result<Option<FrameTime>> {
        match self.plan.read(message, &mut self.taken) {
            Ok(()) => {}
            Err(Trouble::Damaged) => return Ok(None),
            Err(Trouble::Wrong(e)) => return Err(e),
        }
        if self.map.names.is_some() {
            self.named = named_sensors(std::mem::take(&mut self.taken.names), &self.taken.counts)?;
        }
        values.extend(self.taken.values.iter().flatten().map(|number| self.map.value(*number)));
        let time = match (self.plan.time, self.taken.time) {
            (TimePlace::Named(per_second), Some(Stamp::Number(number))) => FrameTime::from(number / per_second),
            (TimePlace::Named(_) | TimePlace::Stamp, Some(Stamp::Ns(ns))) if ns != 0 => FrameTime::from_ns(ns),
            (place, _) => {
                self.is_unstamped |= place != TimePlace::Arrival;
                came
            }
        };
        if time.s.is_finite() { Ok(Some(time)) } else { Err(Error::failed("time: it is not a finite number")) }
    }

    /// The names of the last message's sensors.
    pub(in crate::robot) fn named(&self) -> &[(String, usize)] {
        &self.named
    }

    /// What was taken for what, in words; `unstamped` says what time is where messages have none.
    pub(in crate::robot) fn taken(&self, unstamped: &str) -> String {
        let lies = match self.taken.lies {
            Some(Lies::ByColumns) => ", column by column in the message",
            Some(Lies::ByRows) => ", row by row",
            Some(Lies::Plainly) | None => "",
        };
        let time = match self.plan.time {
            TimePlace::Stamp if !self.is_unstamped => "time is header.stamp",
            TimePlace::Named(_) if !self.is_unstamped => "time is as the map names it",
            _ => unstamped,
        };
        format!("{}{lies}; {time}", self.map.paths())
    }
}
