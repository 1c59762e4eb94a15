//! A WebSocket that never blocks and holds little: large messages go out in pieces, each when the one before has gone.

use std::collections::VecDeque;
use std::io::{self, ErrorKind, Read, Write};
use std::net::{Shutdown, TcpStream};

use tungstenite::error::{CapacityError, ProtocolError};
use tungstenite::protocol::frame::coding::{CloseCode, Data, OpCode};
use tungstenite::protocol::frame::{CloseFrame, Frame};
use tungstenite::protocol::{Role, WebSocketConfig};
use tungstenite::{Bytes, Error, Message, WebSocket};

use super::exchange::Payload;
use super::message::MAX_MESSAGE_BYTES;

/// The most bytes that are handed to the system at once.
const PIECE_BYTES: usize = 64 << 10;

/// The most bytes that one connection is read in its turn. What matters is bytes and not messages: whoever sends nothing but pings, or
/// empty parts of a message that never ends, would otherwise keep the server to itself.
const BYTES_AT_ONCE: usize = 16 << 10;

/// Why the server ends a connection, as the protocol numbers it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum CloseReason {
    /// The server ends.
    GoingAway,
    /// What was sent is not a WebSocket.
    Protocol,
    /// A binary message.
    Unsupported,
    /// Text that is not UTF-8.
    Invalid,
    /// What the page's protocol does not know, or no token.
    Policy,
    /// A message over the limit.
    TooLarge,
    /// Too much waits for the viewer, or there are too many.
    Overload,
}

/// What came.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Received {
    Text(String),
    /// Nothing more for now.
    Nothing,
    /// The connection is to be closed.
    Wrong(CloseReason, &'static str),
    /// The other side has gone.
    Gone,
}

/// A message that several viewers are sent.
pub(super) type SharedBytes = Bytes;

/// A WebSocket and what waits to be sent.
#[derive(Debug)]
pub(super) struct Socket {
    socket: WebSocket<InTurns>,
    waiting: VecDeque<Waiting>,
    waiting_bytes: usize,
    /// Whether the system takes nothing at present.
    is_blocked: bool,
}

/// A stream that is read up to [`BYTES_AT_ONCE`] in a turn; beyond, it seems to have nothing more.
#[derive(Debug)]
struct InTurns {
    stream: TcpStream,
    left: usize,
}

impl Read for InTurns {
    fn read(&mut self, to: &mut [u8]) -> io::Result<usize> {
        let room = to.len().min(self.left);
        if room == 0 {
            return Err(ErrorKind::WouldBlock.into());
        }
        let count = self.stream.read(&mut to[..room])?;
        self.left -= count;
        Ok(count)
    }
}

impl Write for InTurns {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.stream.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.stream.flush()
    }
}

#[derive(Debug)]
struct Waiting {
    bytes: Bytes,
    kind: Data,
    /// How much of it has gone.
    sent: usize,
}

/// The value of a header that accepts an upgrade with `key`.
pub(super) fn accept_key(key: &str) -> String {
    tungstenite::handshake::derive_accept_key(key.as_bytes())
}

impl Socket {
    /// Continues with `stream`; `received` was read from it after the upgrade.
    pub(super) fn new(stream: TcpStream, received: Vec<u8>) -> Self {
        let config = WebSocketConfig::default()
            .read_buffer_size(4 << 10)
            .write_buffer_size(0)
            .max_message_size(Some(MAX_MESSAGE_BYTES))
            .max_frame_size(Some(MAX_MESSAGE_BYTES));
        let stream = InTurns { stream, left: BYTES_AT_ONCE };
        Self {
            socket: WebSocket::from_partially_read(stream, received, Role::Server, Some(config)),
            waiting: VecDeque::new(),
            waiting_bytes: 0,
            is_blocked: false,
        }
    }

    pub(super) fn stream(&self) -> &TcpStream {
        &self.socket.get_ref().stream
    }

    /// Whether everything has been handed to the system.
    pub(super) fn is_idle(&self) -> bool {
        self.waiting.is_empty() && !self.is_blocked
    }

    pub(super) fn is_blocked(&self) -> bool {
        self.is_blocked
    }

    /// Bytes that wait.
    pub(super) fn waiting_bytes(&self) -> usize {
        self.waiting_bytes
    }

    /// Sends `message` when everything before it has gone.
    pub(super) fn push(&mut self, message: Payload) {
        match message {
            Payload::Text(text) => self.add(text.into(), Data::Text),
            Payload::Binary(bytes) => self.add(bytes.into(), Data::Binary),
        }
    }

    /// The same of a binary message that others are sent too.
    pub(super) fn push_shared(&mut self, message: &SharedBytes) {
        self.add(message.clone(), Data::Binary);
    }

    fn add(&mut self, bytes: Bytes, kind: Data) {
        self.waiting_bytes += bytes.len();
        self.waiting.push_back(Waiting { bytes, kind, sent: 0 });
    }

    /// Sends as much as the system takes; false where the other side has gone.
    pub(super) fn send(&mut self) -> bool {
        loop {
            self.is_blocked = false;
            match self.socket.flush() {
                Ok(()) => {}
                Err(Error::Io(e)) if e.kind() == ErrorKind::WouldBlock => {
                    self.is_blocked = true;
                    return true;
                }
                Err(_) => return false,
            }
            let Some(next) = self.waiting.front_mut() else { return true };
            let end = next.bytes.len().min(next.sent + PIECE_BYTES);
            let (piece, is_last) = (next.bytes.slice(next.sent..end), end == next.bytes.len());
            let kind = if next.sent == 0 { next.kind } else { Data::Continue };
            self.waiting_bytes -= piece.len();
            next.sent = end;
            if is_last {
                self.waiting.pop_front();
            }
            match self.socket.write(Message::Frame(Frame::message(piece, OpCode::Data(kind), is_last))) {
                Ok(()) => {}
                Err(Error::Io(e)) if e.kind() == ErrorKind::WouldBlock => {}
                Err(_) => return false,
            }
        }
    }

    /// Begins its turn of being read.
    pub(super) fn begin_turn(&mut self) {
        self.socket.get_mut().left = BYTES_AT_ONCE;
    }

    /// Whether its turn ended before everything was read.
    pub(super) fn has_more(&self) -> bool {
        self.socket.get_ref().left == 0
    }

    /// The next message of this turn.
    pub(super) fn receive(&mut self) -> Received {
        loop {
            return match self.socket.read() {
                Ok(Message::Text(text)) => Received::Text(text.as_str().to_owned()),
                Ok(Message::Binary(_)) => Received::Wrong(CloseReason::Unsupported, "the page sends text"),
                Ok(Message::Close(_)) => Received::Gone,
                Ok(_) => continue,
                Err(Error::Io(e)) if e.kind() == ErrorKind::WouldBlock => Received::Nothing,
                Err(Error::Capacity(CapacityError::MessageTooLong { .. })) => {
                    Received::Wrong(CloseReason::TooLarge, "a message is over 64 KiB")
                }
                Err(Error::Utf8(_)) => Received::Wrong(CloseReason::Invalid, "text that is not UTF-8"),
                Err(Error::Protocol(ProtocolError::ResetWithoutClosingHandshake)) => Received::Gone,
                Err(Error::Protocol(_)) => Received::Wrong(CloseReason::Protocol, "not a WebSocket's frame"),
                Err(_) => Received::Gone,
            };
        }
    }

    /// Says that the connection ends, in place of what waits.
    pub(super) fn close(&mut self, reason: CloseReason, text: &str) {
        self.waiting.clear();
        self.waiting_bytes = 0;
        let code = match reason {
            CloseReason::GoingAway => CloseCode::Away,
            CloseReason::Protocol => CloseCode::Protocol,
            CloseReason::Unsupported => CloseCode::Unsupported,
            CloseReason::Invalid => CloseCode::Invalid,
            CloseReason::Policy => CloseCode::Policy,
            CloseReason::TooLarge => CloseCode::Size,
            CloseReason::Overload => CloseCode::Again,
        };
        let closed = self.socket.close(Some(CloseFrame { code, reason: text.into() }));
        self.is_blocked = matches!(closed, Err(Error::Io(e)) if e.kind() == ErrorKind::WouldBlock);
    }

    /// Its connection, for its last moments.
    pub(super) fn into_stream(self) -> TcpStream {
        self.socket.into_inner().stream
    }
}

/// Says on `stream` that nothing more is sent.
pub(super) fn end_sending(stream: &TcpStream) {
    // It may be closed already.
    let _ = stream.shutdown(Shutdown::Write);
}

/// Discards what comes on `stream`, so that the other side can read what it was sent last; false where it has ended.
pub(super) fn discard(mut stream: &TcpStream) -> bool {
    let mut bytes = [0; 16 << 10];
    // A bounded amount at once.
    for _ in 0..16 {
        match stream.read(&mut bytes) {
            Ok(0) => return false,
            Ok(_) => {}
            Err(e) => return matches!(e.kind(), ErrorKind::WouldBlock | ErrorKind::Interrupted),
        }
    }
    true
}
