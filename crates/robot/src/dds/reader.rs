//! Messages from a topic.

use std::convert::Infallible;
use std::io;
use std::time::Duration;

use ros2_client::dds::rustdds::{CDRDeserializerAdapter, RepresentationIdentifier, mio1, no_key};

use crate::error::{Result, failed};

/// A message's bytes as a bag has them: CDR with its header.
pub(crate) struct MessageBytes(pub(crate) Vec<u8>);

/// Gives a message's bytes as they came.
pub(crate) struct AsTheyCame;

/// Puts the header before a message's bytes, which DDS keeps apart.
#[derive(Clone)]
pub(crate) struct WithHeader;

impl no_key::DeserializerAdapter<MessageBytes> for AsTheyCame {
    type Error = Infallible;
    type Decoded = MessageBytes;

    fn supported_encodings() -> &'static [RepresentationIdentifier] {
        &[RepresentationIdentifier::CDR_LE, RepresentationIdentifier::CDR_BE]
    }

    fn transform_decoded(decoded: MessageBytes) -> MessageBytes {
        decoded
    }
}

impl no_key::DefaultDecoder<MessageBytes> for AsTheyCame {
    type Decoder = WithHeader;
    const DECODER: WithHeader = WithHeader;
}

impl no_key::Decode<'_, MessageBytes> for WithHeader {
    type Error = Infallible;

    fn decode_bytes(
        self,
        bytes: &[u8],
        encoding: RepresentationIdentifier,
    ) -> std::result::Result<MessageBytes, Infallible> {
        let is_little = encoding == RepresentationIdentifier::CDR_LE;
        Ok(MessageBytes([&[0, u8::from(is_little), 0, 0], bytes].concat()))
    }
}

/// Reads messages from a topic.
pub(crate) struct Reader<M, A: no_key::DeserializerAdapter<M> = CDRDeserializerAdapter<M>> {
    reader: no_key::SimpleDataReader<M, A>,
    poll: mio1::Poll,
    events: mio1::Events,
    topic: String,
}

/// Reads messages of any type from a topic.
pub(crate) type BytesReader = Reader<MessageBytes, AsTheyCame>;

impl<M: 'static, A: no_key::DefaultDecoder<M> + 'static> Reader<M, A> {
    /// # Errors
    /// The system cannot wait for messages.
    pub(super) fn new(mut reader: no_key::SimpleDataReader<M, A>, topic: &str) -> Result<Self> {
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
