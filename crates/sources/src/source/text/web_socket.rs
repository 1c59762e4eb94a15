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
    use crate::body::{Body, Modality};
    use crate::signal::{Channel, Frame};
    use crate::source::{ArrayMap, Source as _, TextPlace, VendorOptions};

    /// What a server of XELA sends of a number of sensors: of each sixteen taxels with three numbers each, as counts and as forces; of
    /// taxel `at` these are `at`, −`at` and 2·`at`, 100 more for each sensor before, and half of one more as forces. Its sensors stand in
    /// the order of their names as texts.
    fn xela_line(message: usize, sensors: u16) -> String {
        let sensor = |number: u16| {
            let more = 100 * (number - 1);
            let counts: Vec<String> = (0..16)
                .flat_map(|at: u16| [32_768 + at, 32_768 - at, 32_768 + 2 * at])
                .map(|raw| format!("{:04X}", raw + more))
                .collect();
            let force = |own: i32| (f64::from(own + i32::from(more)) + 0.5).to_string();
            let forces = (0..16).flat_map(|at| [at, -at, 2 * at]).map(force);
            format!(
                "\"{number}\":{{\"time\":{message}.25,\"model\":\"uSPa44\",\"sensor\":\"{number}\",\"taxels\":16,\"data\":\"{}\",\
                 \"calibrated\":[{}]}}",
                counts.join(","),
                forces.collect::<Vec<_>>().join(",")
            )
        };
        let mut all: Vec<String> = (1..=sensors).map(sensor).collect();
        all.sort();
        format!(
            "{{\"type\":\"routine\",\"message\":{message},\"time\":{}.25,\"sensors\":{sensors},{}}}",
            1_695_690_788 + message,
            all.join(",")
        )
    }

    /// A server that welcomes whoever comes, and then sends such lines.
    fn xela_server(sensors: u16) -> (TextPlace, thread::JoinHandle<()>) {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let place = format!("ws://{}", listener.local_addr().unwrap()).parse().unwrap();
        let server = thread::spawn(move || {
            let mut socket = tungstenite::accept(listener.accept().unwrap().0).unwrap();
            let welcome = "{\"ip\":\"127.0.0.1\",\"port\":5000,\"connections\":0,\"sensors\":[\"uSPa44\"],\"message\":\"Welcome\"}";
            let lines = (1..).map(|message| xela_line(message, sensors));
            let mut lines = std::iter::once(welcome.to_owned()).chain(lines);
            while lines.next().is_some_and(|line| socket.send(line.into()).is_ok()) {
                thread::sleep(Duration::from_millis(20));
            }
        });
        (place, server)
    }

    #[test]
    fn a_server_of_three_axis_sensors_is_read_by_name_as_forces_and_by_a_map_as_counts() {
        let counts = "values = '[*].data'\ndecoder = 'hex16'\naxes = 'uvn'\ngrid = '4x4'\npitch = '4.7mm'";
        let named = || ArrayMap::named("xela").unwrap();
        for (map, zero, sensors) in
            [(named(), 0.5, 1), (named(), 0.5, 11), (ArrayMap::parse(counts).unwrap(), 32_768.0, 11)]
        {
            let (place, server) = xela_server(sensors);
            let taxels = 16 * usize::from(sensors);
            let options = VendorOptions { map: Some(map), ..VendorOptions::default() };
            let mut source = TextSource::open(&place, &options, &mut |_| {}).unwrap();
            let names: Vec<String> = source.taxels().iter().map(|&id| Channel(id).to_string()).collect();
            assert_eq!((names.len(), names[..4].join(" ").as_str()), (3 * taxels, "0.u 0.v 0 1.u"));
            let body = Body::from_bytes("pad", &source.body().unwrap()).unwrap();
            assert!(body.taxels.len() == taxels && body.taxels.iter().all(|taxel| taxel.modality == Modality::Force3));
            let mut frame = Frame::default();
            for _ in 0..3 {
                assert!(source.next_frame(&mut frame).unwrap());
                // Sensor 10 comes after sensor 9.
                for sensor in [0, 9].into_iter().take(usize::from(sensors)) {
                    let own = [0, 1, 2].map(|axis| frame.values[3 * (16 * sensor + 7) + axis].number().unwrap());
                    assert_eq!(own, [7.0, -7.0, 14.0].map(|value| zero + 100.0 * sensor as f64 + value));
                }
            }
            let said = source.notices().join("\n");
            assert!(
                said.contains("a message has nothing that the map names")
                    && (sensors > 1 || said.contains("are a 4 × 4 grid")),
                "{said}"
            );
            let about = source.about_body();
            assert!(
                sensors == 1 || about.contains("11 pads (pad_1 to pad_11), side by side, of 4 × 4 sensors each"),
                "{about}"
            );
            assert!(source.losses().is_empty(), "{:?}", source.losses());
            drop(source);
            server.join().unwrap();
        }
    }

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
