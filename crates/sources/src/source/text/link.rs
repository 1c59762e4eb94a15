//! What lines come by: a serial port, a connection, datagrams, standard input.

use std::io::{self, ErrorKind, Read};
use std::net::{TcpStream, ToSocketAddrs, UdpSocket};
use std::sync::mpsc::{Receiver, RecvTimeoutError, sync_channel};
use std::thread;
use std::time::{Duration, Instant};

use super::place::TextPlace;
#[cfg(feature = "websocket")]
use super::web_socket::Socket;
use crate::error::{Error, Result, failed};

/// How long a read waits before it says that nothing came.
const READ_TIMEOUT: Duration = Duration::from_millis(100);
/// Time between two tries to open what is gone.
const REOPEN_INTERVAL: Duration = Duration::from_millis(200);
const CONNECT_TIMEOUT: Duration = Duration::from_secs(3);
/// Bytes that are read at once; a datagram has no more.
const READ_BYTES: usize = 1 << 16;
/// Speeds of boards that print text, most likely first.
#[cfg(feature = "serial")]
const USUAL_BAUDS: [u32; 8] = [115_200, 9_600, 57_600, 230_400, 460_800, 921_600, 38_400, 19_200];

/// What came.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Came {
    /// So many bytes, in [`Link::bytes`].
    Bytes(usize),
    /// Nothing yet.
    Nothing,
    /// The connection is gone; it is tried again.
    Gone,
    /// It is back.
    Back,
    /// The end: nothing comes any more.
    End,
}

enum Open {
    #[cfg(feature = "serial")]
    Port(Box<dyn serialport::SerialPort>),
    Tcp(TcpStream),
    Udp(UdpSocket),
    #[cfg(feature = "websocket")]
    WebSocket(Box<Socket>),
    Stdin(Receiver<Vec<u8>>),
    /// What is there already.
    Given(io::Cursor<Vec<u8>>),
    Gone(Instant),
    Ended,
}

/// A connection, which is opened again when it is gone.
pub(super) struct Link {
    place: TextPlace,
    open: Open,
    buffer: Vec<u8>,
    /// The speed among the usual ones, where none is given.
    #[cfg_attr(not(feature = "serial"), allow(dead_code))]
    speed: usize,
}

impl Link {
    /// # Errors
    /// It cannot be opened.
    pub(super) fn open(place: &TextPlace) -> Result<Self> {
        let mut link = Self { place: place.clone(), open: Open::Ended, buffer: vec![0; READ_BYTES], speed: 0 };
        link.open = link.connect().map_err(|e| if e.place().is_some() { e } else { e.at(place) })?;
        Ok(link)
    }

    /// A link over which `bytes` come, and then the end.
    pub(super) fn given(bytes: Vec<u8>) -> Self {
        let open = Open::Given(io::Cursor::new(bytes));
        Self { place: TextPlace::Stdin, open, buffer: vec![0; READ_BYTES], speed: 0 }
    }

    /// The bytes that came last.
    pub(super) fn bytes(&self, count: usize) -> &[u8] {
        &self.buffer[..count]
    }

    /// Whether lines may begin in the middle of one.
    pub(super) fn joins_midway(&self) -> bool {
        matches!(self.place, TextPlace::Port { .. } | TextPlace::Tcp(_))
    }

    /// Whether what comes at once ends with a line.
    pub(super) fn is_in_datagrams(&self) -> bool {
        matches!(self.place, TextPlace::Udp(_) | TextPlace::WebSocket(_))
    }

    /// The speed of the line, if it has one that is given or tried.
    #[cfg(feature = "serial")]
    pub(super) fn baud(&self) -> Option<u32> {
        match self.place {
            TextPlace::Port { baud, .. } => Some(baud.unwrap_or(USUAL_BAUDS[self.speed])),
            _ => None,
        }
    }

    #[cfg(not(feature = "serial"))]
    pub(super) fn baud(&self) -> Option<u32> {
        None
    }

    /// Tries the next usual speed; `false` where one is given, or all were tried.
    #[cfg(feature = "serial")]
    pub(super) fn next_baud(&mut self) -> bool {
        let Open::Port(port) = &mut self.open else { return false };
        if !matches!(self.place, TextPlace::Port { baud: None, .. }) || self.speed + 1 == USUAL_BAUDS.len() {
            return false;
        }
        self.speed += 1;
        port.set_baud_rate(USUAL_BAUDS[self.speed]).is_ok()
    }

    #[cfg(not(feature = "serial"))]
    pub(super) fn next_baud(&mut self) -> bool {
        false
    }

    fn connect(&self) -> Result<Open> {
        match &self.place {
            TextPlace::Port { port, .. } => self.port(port),
            TextPlace::Tcp(address) => connected(address, READ_TIMEOUT).map(Open::Tcp),
            #[cfg(feature = "websocket")]
            TextPlace::WebSocket(address) => {
                let host = address.split('/').next().unwrap_or(address);
                let socket = Socket::open(&format!("ws://{address}"), connected(host, CONNECT_TIMEOUT)?)?;
                let set = socket.stream().set_read_timeout(Some(READ_TIMEOUT));
                set.map_err(|e| Error::failed(e.to_string()))?;
                Ok(Open::WebSocket(Box::new(socket)))
            }
            #[cfg(not(feature = "websocket"))]
            TextPlace::WebSocket(_) => {
                Err(Error::failed("built without the feature `websocket`: cargo install --path . --features websocket"))
            }
            TextPlace::Udp(address) => {
                let bound = UdpSocket::bind(address).and_then(|socket| {
                    socket.set_read_timeout(Some(READ_TIMEOUT))?;
                    Ok(Open::Udp(socket))
                });
                bound.map_err(|e| failed!("this port cannot be listened to: {e}; does another program use it?"))
            }
            TextPlace::Stdin => {
                let (sender, receiver) = sync_channel(16);
                let read = move || {
                    let mut input = io::stdin().lock();
                    loop {
                        let mut bytes = vec![0; READ_BYTES];
                        match input.read(&mut bytes) {
                            Ok(0) => return,
                            Ok(count) => {
                                bytes.truncate(count);
                                if sender.send(bytes).is_err() {
                                    return;
                                }
                            }
                            Err(e) if e.kind() == ErrorKind::Interrupted => {}
                            Err(_) => return,
                        }
                    }
                };
                let thread = thread::Builder::new().name("stdin".to_owned()).spawn(read);
                thread.map_err(|e| failed!("cannot start a thread: {e}"))?;
                Ok(Open::Stdin(receiver))
            }
        }
    }

    #[cfg(feature = "serial")]
    fn port(&self, name: &str) -> Result<Open> {
        if std::path::Path::new(name).is_file() {
            let what = format!(
                "this is a file, not a port; read it with `cat {name} | somatic run --source text:-`, or as csv:{name}"
            );
            return Err(Error::failed(what));
        }
        let baud = self.baud().unwrap_or(USUAL_BAUDS[0]);
        let opened = serialport::new(name, baud).timeout(READ_TIMEOUT).open();
        let mut port = opened.map_err(|error| super::super::serial::explained(name, &error))?;
        // Boards with USB of their own send only to who says that they listen; pseudo-terminals have no such line.
        let _ = port.write_data_terminal_ready(true);
        Ok(Open::Port(port))
    }

    #[cfg(not(feature = "serial"))]
    fn port(&self, _: &str) -> Result<Open> {
        Err(Error::failed("this build reads no serial lines; build with feature `serial`"))
    }

    /// Reads what has come, or waits a moment for it.
    pub(super) fn read(&mut self) -> Came {
        let read = match &mut self.open {
            #[cfg(feature = "serial")]
            Open::Port(port) => port.read(&mut self.buffer),
            Open::Tcp(stream) => stream.read(&mut self.buffer),
            #[cfg(feature = "websocket")]
            Open::WebSocket(socket) => socket.read(&mut self.buffer),
            Open::Udp(socket) => match socket.recv(&mut self.buffer) {
                // An empty datagram is not an end.
                Ok(0) => return Came::Nothing,
                other => other,
            },
            Open::Stdin(receiver) => match receiver.recv_timeout(READ_TIMEOUT) {
                Ok(bytes) => {
                    self.buffer[..bytes.len()].copy_from_slice(&bytes);
                    Ok(bytes.len())
                }
                Err(RecvTimeoutError::Timeout) => return Came::Nothing,
                Err(RecvTimeoutError::Disconnected) => {
                    self.open = Open::Ended;
                    return Came::End;
                }
            },
            Open::Given(bytes) => match bytes.read(&mut self.buffer) {
                Ok(0) => {
                    self.open = Open::Ended;
                    return Came::End;
                }
                other => other,
            },
            Open::Gone(since) => {
                if since.elapsed() < REOPEN_INTERVAL {
                    thread::sleep(READ_TIMEOUT);
                    return Came::Nothing;
                }
                return match self.connect() {
                    Ok(open) => {
                        self.open = open;
                        Came::Back
                    }
                    Err(_) => {
                        self.open = Open::Gone(Instant::now());
                        Came::Nothing
                    }
                };
            }
            Open::Ended => return Came::End,
        };
        match read {
            Ok(0) => self.gone(),
            Ok(count) => Came::Bytes(count),
            Err(e) if matches!(e.kind(), ErrorKind::TimedOut | ErrorKind::Interrupted | ErrorKind::WouldBlock) => {
                Came::Nothing
            }
            Err(_) => self.gone(),
        }
    }

    fn gone(&mut self) -> Came {
        self.open = Open::Gone(Instant::now());
        Came::Gone
    }
}

/// A connection to `address`, whose reads wait as long as `wait`.
fn connected(address: &str, wait: Duration) -> Result<TcpStream> {
    let all = address.to_socket_addrs().map_err(|e| failed!("there is no such host: {e}"))?;
    let mut last = Error::failed("the host has no address");
    for one in all {
        match TcpStream::connect_timeout(&one, CONNECT_TIMEOUT) {
            Ok(stream) => {
                stream.set_read_timeout(Some(wait)).map_err(|e| Error::failed(e.to_string()))?;
                return Ok(stream);
            }
            Err(e) => last = failed!("nothing answers there: {e}; does the board or program listen?"),
        }
    }
    Err(last)
}
