//! Messages to a topic, and how many of them have no receipt.

use std::cell::Cell;
use std::convert::Infallible;
use std::time::Duration;

use ros2_client::dds::rustdds::bytes::Bytes;
use ros2_client::dds::rustdds::dds::WriteError;
use ros2_client::dds::rustdds::{RepresentationIdentifier, Timestamp, no_key};

use crate::error::{Result, failed};

/// The header of CDR, which DDS adds itself.
const CDR_HEADER_BYTES: usize = 4;

/// A message of little-endian CDR, without its header.
pub(super) struct Message(Bytes);

/// Sends a message's bytes as they are.
pub(super) struct AsTheyAre;

impl no_key::SerializerAdapter<Message> for AsTheyAre {
    type Error = Infallible;

    fn output_encoding() -> RepresentationIdentifier {
        RepresentationIdentifier::CDR_LE
    }

    fn to_bytes(message: &Message) -> std::result::Result<Bytes, Infallible> {
        Ok(message.0.clone())
    }
}

/// Writes messages to a topic.
pub struct Writer {
    writer: no_key::DataWriter<Message, AsTheyAre>,
    topic: String,
    /// Messages that were written, and how many of them were written when last all had receipts.
    written: Cell<u64>,
    received: Cell<u64>,
}

impl Writer {
    pub(super) fn new(writer: no_key::DataWriter<Message, AsTheyAre>, topic: &str) -> Self {
        Self { writer, topic: topic.to_owned(), written: Cell::new(0), received: Cell::new(0) }
    }

    /// Sends a message of little-endian CDR with its header. `false` where too many messages have no receipt yet.
    ///
    /// # Errors
    /// It cannot be sent, nor can others.
    pub fn write(&self, message: Vec<u8>) -> Result<bool> {
        self.without_receipt(Duration::ZERO);
        let message = Message(Bytes::from(message).slice(CDR_HEADER_BYTES..));
        match self.writer.write(message, Some(Timestamp::now())) {
            Ok(()) => {
                self.written.set(self.written.get() + 1);
                Ok(true)
            }
            Err(WriteError::WouldBlock { .. }) => Ok(false),
            Err(e) => Err(failed!("topic {}: {e}", self.topic)),
        }
    }

    /// How many messages may still lack the receipt of a reliable reader, after waiting for at most `wait`. It is 0 as soon as
    /// all have theirs, and where nobody gives any; else it counts from the last message before which all had theirs.
    pub fn without_receipt(&self, wait: Duration) -> u64 {
        if self.writer.wait_for_acknowledgments(wait).unwrap_or(false) {
            self.received.set(self.written.get());
        }
        self.written.get() - self.received.get()
    }
}
