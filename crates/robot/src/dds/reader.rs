//! Messages from a topic.

use std::io;
use std::time::Duration;

use ros2_client::dds::rustdds::{mio1, no_key};
use serde::de::DeserializeOwned;

use crate::error::{Result, failed};

/// Reads messages from a topic.
pub(crate) struct Reader<M> {
    reader: no_key::SimpleDataReaderCdr<M>,
    poll: mio1::Poll,
    events: mio1::Events,
    topic: String,
}

impl<M: DeserializeOwned + 'static> Reader<M> {
    /// # Errors
    /// The system cannot wait for messages.
    pub(super) fn new(mut reader: no_key::SimpleDataReaderCdr<M>, topic: &str) -> Result<Self> {
        let failed = |e: io::Error| failed!("topic {topic}: {e}");
        let poll = mio1::Poll::new().map_err(failed)?;
        poll.registry().register(&mut reader, mio1::Token(0), mio1::Interest::READABLE).map_err(failed)?;
        Ok(Self { reader, poll, events: mio1::Events::with_capacity(8), topic: topic.to_owned() })
    }

    /// The next message that has come.
    ///
    /// # Errors
    /// What has come is not such a message.
    pub(crate) fn take(&mut self) -> Result<Option<M>> {
        self.reader.drain_read_notifications();
        let taken = self.reader.try_take_one().map_err(|e| failed!("topic {}: {e}", self.topic))?;
        Ok(taken.map(no_key::DeserializedCacheChange::into_value))
    }

    /// The next message, if one comes within `wait`.
    ///
    /// # Errors
    /// As [`Reader::take`]; the system cannot wait.
    pub(crate) fn next(&mut self, wait: Duration) -> Result<Option<M>> {
        if let Some(message) = self.take()? {
            return Ok(Some(message));
        }
        match self.poll.poll(&mut self.events, Some(wait)) {
            Err(e) if e.kind() != io::ErrorKind::Interrupted => Err(failed!("topic {}: {e}", self.topic)),
            _ => self.take(),
        }
    }
}
