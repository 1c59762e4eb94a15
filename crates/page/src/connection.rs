//! One connection, from its first byte to its last.

use std::io::{ErrorKind, Read as _, Write as _};
use std::net::TcpStream;
use std::time::{Duration, Instant};

use super::http::{Decision, LATE, MAX_HEAD_BYTES, Site, decide, file_answer, refusal, upgrade_answer};
use super::socket::{CloseReason, Received, Socket, accept_key, discard, end_sending};
use super::viewer::Viewer;
use super::wake::Interest;

/// The longest that the head of a request takes, and an answer.
const HEAD_TIME: Duration = Duration::from_secs(5);
/// The longest that a WebSocket takes to say hello.
const HELLO_TIME: Duration = Duration::from_secs(2);
/// The longest that the other side may take to read what it was sent last.
const LINGER_TIME: Duration = Duration::from_secs(1);
/// A connection that has said nothing for so long makes room for others.
const IDLE_TIME: Duration = Duration::from_millis(250);
/// Messages of one connection before it is another's turn.
const MESSAGES_AT_ONCE: usize = 64;

/// A connection and when it came to what it is doing.
#[derive(Debug)]
pub(super) struct Connection {
    state: State,
    since: Instant,
    was_viewer: bool,
}

#[derive(Debug)]
enum State {
    /// The head of a request.
    Head(TcpStream, Vec<u8>),
    /// The answer, and how much of it has been sent; what comes then.
    Answer(TcpStream, Vec<u8>, usize, Then),
    /// A WebSocket that has not said hello, and whether it is of the second of two pages.
    Greeting(Box<Socket>, bool),
    /// A viewer.
    Viewing(Box<Socket>, Box<Viewer>),
    /// A WebSocket whose last words are being sent.
    Closing(Box<Socket>),
    /// Nothing more is sent.
    Lingering(TcpStream),
    Over,
}

#[derive(Debug)]
enum Then {
    End,
    /// A WebSocket, which begins with these bytes; whether it is of the second of two pages.
    Socket(Vec<u8>, bool),
}

impl Connection {
    /// A new connection.
    pub(super) fn new(stream: TcpStream, now: Instant) -> Self {
        // Without these it would hold up others; such a connection is of no use.
        let is_ready = stream.set_nonblocking(true).and_then(|()| stream.set_nodelay(true)).is_ok();
        Self {
            state: if is_ready { State::Head(stream, Vec::new()) } else { State::Over },
            since: now,
            was_viewer: false,
        }
    }

    pub(super) fn is_over(&self) -> bool {
        matches!(self.state, State::Over)
    }

    /// Whether it is a WebSocket of the second of two pages.
    pub(super) fn is_beside(&self) -> bool {
        matches!(self.state, State::Greeting(_, true))
    }

    /// The viewer that it has become.
    pub(super) fn viewer(&mut self) -> Option<(&mut Socket, &mut Viewer)> {
        if let State::Viewing(socket, viewer) = &mut self.state { Some((socket, viewer)) } else { None }
    }

    /// The same to look at.
    pub(super) fn seen(&self) -> Option<&Viewer> {
        if let State::Viewing(_, viewer) = &self.state { Some(viewer) } else { None }
    }

    /// Whether it has been a viewer and is none any more; said once.
    pub(super) fn has_left(&mut self) -> bool {
        self.was_viewer && !matches!(self.state, State::Viewing(..)) && {
            self.was_viewer = false;
            true
        }
    }

    /// Whether it has said nothing for so long that others come first.
    pub(super) fn is_idle(&self, now: Instant) -> bool {
        match &self.state {
            State::Head(..) | State::Greeting(..) | State::Lingering(_) => now - self.since >= IDLE_TIME,
            _ => false,
        }
    }

    /// Since when its viewer has not said that it has drawn what it was sent.
    pub(super) fn owes_since(&self) -> Option<Instant> {
        let State::Viewing(_, viewer) = &self.state else { return None };
        viewer.owes_since()
    }

    /// When it is to be looked at again although nothing comes.
    pub(super) fn due_at(&self) -> Option<Instant> {
        match &self.state {
            State::Head(..) | State::Answer(..) => Some(self.since + HEAD_TIME),
            State::Greeting(..) => Some(self.since + HELLO_TIME),
            State::Closing(_) | State::Lingering(_) => Some(self.since + LINGER_TIME),
            State::Viewing(..) | State::Over => None,
        }
    }

    /// When its viewer gets the next message about its taxel, if it has read everything before.
    pub(super) fn taxel_due_at(&self, published: u64) -> Option<Instant> {
        match &self.state {
            State::Viewing(socket, viewer) if socket.is_idle() => viewer.taxel_due_at(published),
            _ => None,
        }
    }

    /// What it waits for.
    pub(super) fn interest(&self) -> Option<(&TcpStream, Interest)> {
        let read = Interest { read: true, write: false };
        match &self.state {
            State::Head(stream, _) | State::Lingering(stream) => Some((stream, read)),
            State::Answer(stream, ..) => Some((stream, Interest { read: false, write: true })),
            State::Greeting(socket, _) | State::Viewing(socket, _) => {
                Some((socket.stream(), Interest { read: true, write: socket.is_blocked() }))
            }
            State::Closing(socket) => Some((socket.stream(), Interest { read: false, write: true })),
            State::Over => None,
        }
    }

    /// Goes on as far as it can without waiting.
    pub(super) fn advance(&mut self, site: &Site, now: Instant) {
        loop {
            let before = std::mem::discriminant(&self.state);
            self.state = match std::mem::replace(&mut self.state, State::Over) {
                State::Head(stream, bytes) => read_head(stream, bytes, site, now - self.since >= HEAD_TIME),
                State::Answer(..) if now - self.since >= HEAD_TIME => State::Over,
                State::Answer(stream, bytes, sent, then) => answer(stream, bytes, sent, then),
                State::Greeting(mut socket, _) if now - self.since >= HELLO_TIME => {
                    socket.close(CloseReason::Policy, "no hello within 2 s");
                    State::Closing(socket)
                }
                State::Closing(_) if now - self.since >= LINGER_TIME => State::Over,
                State::Closing(mut socket) => {
                    // After its last words a socket says that it is closed.
                    let is_open = socket.send();
                    if is_open && socket.is_blocked() {
                        State::Closing(socket)
                    } else {
                        let stream = socket.into_stream();
                        end_sending(&stream);
                        State::Lingering(stream)
                    }
                }
                State::Lingering(_) if now - self.since >= LINGER_TIME => State::Over,
                State::Lingering(stream) => {
                    if discard(&stream) {
                        State::Lingering(stream)
                    } else {
                        State::Over
                    }
                }
                other => other,
            };
            if std::mem::discriminant(&self.state) == before {
                return;
            }
            self.since = now;
        }
    }

    /// Takes the messages that have come; whether there may be more. The number per call is limited so that others get their turn.
    pub(super) fn receive(&mut self, mut each: impl FnMut(&mut Self, String)) -> bool {
        if let State::Greeting(socket, _) | State::Viewing(socket, _) = &mut self.state {
            socket.begin_turn();
        }
        for _ in 0..MESSAGES_AT_ONCE {
            let (State::Greeting(socket, _) | State::Viewing(socket, _)) = &mut self.state else { return false };
            match socket.receive() {
                Received::Text(text) => each(self, text),
                Received::Nothing => return socket.has_more(),
                Received::Wrong(reason, text) => self.close(reason, text),
                Received::Gone => {
                    // What answers a close frame is sent.
                    let _ = socket.send();
                    self.state = State::Over;
                }
            }
        }
        true
    }

    /// Makes a WebSocket that has said hello a viewer.
    pub(super) fn admit(&mut self, viewer: Viewer) {
        if let State::Greeting(socket, _) = std::mem::replace(&mut self.state, State::Over) {
            self.state = State::Viewing(socket, Box::new(viewer));
            self.was_viewer = true;
        }
    }

    /// Ends a WebSocket with a reason.
    pub(super) fn close(&mut self, reason: CloseReason, text: &str) {
        self.state = match std::mem::replace(&mut self.state, State::Over) {
            State::Greeting(mut socket, _) | State::Viewing(mut socket, _) => {
                socket.close(reason, text);
                self.since = Instant::now();
                State::Closing(socket)
            }
            other => other,
        };
    }

    /// Sends what waits for a viewer.
    pub(super) fn send(&mut self) {
        if let State::Viewing(socket, _) = &mut self.state
            && !socket.send()
        {
            self.state = State::Over;
        }
    }
}

fn read_head(mut stream: TcpStream, mut bytes: Vec<u8>, site: &Site, is_late: bool) -> State {
    let mut piece = [0; 2048];
    loop {
        let decision = if is_late { LATE } else { decide(&bytes, site) };
        let (answer, then) = match decision {
            Decision::NeedMore => {
                let room = piece.len().min(MAX_HEAD_BYTES + 1 - bytes.len());
                match stream.read(&mut piece[..room]) {
                    Ok(0) => return State::Over,
                    Ok(count) => bytes.extend_from_slice(&piece[..count]),
                    Err(e) if e.kind() == ErrorKind::Interrupted => {}
                    Err(e) if e.kind() == ErrorKind::WouldBlock => return State::Head(stream, bytes),
                    Err(_) => return State::Over,
                }
                continue;
            }
            Decision::Serve { file, with_body } => (file_answer(file, with_body, site.is_pair), Then::End),
            Decision::Refuse(status) => (refusal(status), Then::End),
            Decision::Upgrade { key, head_bytes, is_beside } => {
                (upgrade_answer(&accept_key(&key)), Then::Socket(bytes.split_off(head_bytes), is_beside))
            }
        };
        return State::Answer(stream, answer, 0, then);
    }
}

fn answer(mut stream: TcpStream, bytes: Vec<u8>, mut sent: usize, then: Then) -> State {
    while sent < bytes.len() {
        match stream.write(&bytes[sent..]) {
            Ok(0) => return State::Over,
            Ok(count) => sent += count,
            Err(e) if e.kind() == ErrorKind::Interrupted => {}
            Err(e) if e.kind() == ErrorKind::WouldBlock => return State::Answer(stream, bytes, sent, then),
            Err(_) => return State::Over,
        }
    }
    match then {
        Then::Socket(received, is_beside) => State::Greeting(Box::new(Socket::new(stream, received)), is_beside),
        Then::End => {
            end_sending(&stream);
            State::Lingering(stream)
        }
    }
}
