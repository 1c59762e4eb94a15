//! Lines that come as messages of a WebSocket.

use std::io::{self, ErrorKind};
use std::net::TcpStream;

use tungstenite::{Error as WsError, Message, WebSocket};

use crate::error::{Result, failed};

/// Messages of a server, over a connection that was made to it.
pub(super) struct Socket(WebSocket<TcpStream>);

impl Socket {
    /// Greets the server at the other end of `stream`, whose address is `url`.
    ///
    /// # Errors
    /// It is not a server of WebSockets.
    pub(super) fn open(url: &str, stream: TcpStream) -> Result<Self> {
        let greeted = tungstenite::client(url, stream);
        greeted.map(|(socket, _)| Self(socket)).map_err(|e| failed!("it does not answer as a WebSocket: {e}"))
    }

    /// The connection below it.
    pub(super) fn stream(&self) -> &TcpStream {
        self.0.get_ref()
    }

    /// Puts the next message into `buffer`, which grows where it must; gives its bytes, 0 at the end.
    pub(super) fn read(&mut self, buffer: &mut Vec<u8>) -> io::Result<usize> {
        loop {
            let message = match self.0.read() {
                Ok(message) => message,
                Err(WsError::Io(e)) => return Err(e),
                Err(WsError::ConnectionClosed | WsError::AlreadyClosed) => return Ok(0),
                Err(e) => return Err(io::Error::new(ErrorKind::InvalidData, e.to_string())),
            };
            let bytes = match &message {
                Message::Text(text) => text.as_bytes(),
                Message::Binary(bytes) => bytes,
                Message::Close(_) => return Ok(0),
                _ => continue,
            };
            if bytes.is_empty() {
                continue;
            }
            if buffer.len() < bytes.len() {
                buffer.resize(bytes.len(), 0);
            }
            buffer[..bytes.len()].copy_from_slice(bytes);
            return Ok(bytes.len());
        }
    }
}

#[cfg(test)]
mod tests {
    use std::net::TcpListener;
    use std::thread;
    use std::time::Duration;

    use super::super::TextSource;
    use crate::signal::Frame;
    use crate::source::{ArrayMap, Source as _, TextPlace, VendorOptions};

    #[test]
    fn messages_are_frames_and_a_server_that_is_none_is_refused() {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = listener.local_addr().unwrap();
        let server = thread::spawn(move || {
            let mut socket = tungstenite::accept(listener.accept().unwrap().0).unwrap();
            for at in 0.. {
                let text = format!("{{\"t\":{at},\"pads\":[{{\"p\":[{at},7]}},{{\"p\":[-1,9]}}]}}");
                if socket.send(text.into()).is_err() {
                    break;
                }
                thread::sleep(Duration::from_millis(20));
            }
        });
        let map = ArrayMap::parse("values = 'pads[*].p'\nmissing = [-1]").unwrap();
        let options = VendorOptions { map: Some(map), ..VendorOptions::default() };
        let place: TextPlace = format!("ws://{address}").parse().unwrap();
        let mut source = TextSource::open(&place, &options, &mut |_| {}).unwrap();
        let mut frame = Frame::default();
        for at in 0..4 {
            assert!(source.next_frame(&mut frame).unwrap());
            let values: Vec<Option<f64>> = frame.values.iter().map(|value| value.number()).collect();
            assert_eq!((frame.t_s, values), (f64::from(at), vec![Some(f64::from(at)), Some(7.0), None, Some(9.0)]));
        }
        drop(source);
        server.join().unwrap();
        let other = TcpListener::bind("127.0.0.1:0").unwrap();
        let place: TextPlace = format!("ws://{}", other.local_addr().unwrap()).parse().unwrap();
        let server = thread::spawn(move || drop(other.accept().unwrap()));
        let why = TextSource::open(&place, &VendorOptions::default(), &mut |_| {}).unwrap_err().to_string();
        assert!(why.contains("does not answer as a WebSocket") && why.lines().count() == 1, "{why}");
        server.join().unwrap();
    }
}
