//! The percepts that a recording holds.

use super::PERCEPTS;
use super::reader::Reader;
use crate::error::Result;

impl Reader {
    /// Reads the next percepts that the recording holds, as NDJSON has them, into `line`; frames are passed over. `false` at
    /// the end.
    ///
    /// # Errors
    /// As [`Reader::next_frame`].
    pub fn next_percepts(&mut self, line: &mut Vec<u8>) -> Result<bool> {
        while let Some(message) = self.next_message()? {
            if self.channels.get(&message.channel).is_some_and(|channel| channel.topic == PERCEPTS) {
                line.clear();
                line.extend_from_slice(self.data(&message));
                return Ok(true);
            }
        }
        Ok(false)
    }
}
