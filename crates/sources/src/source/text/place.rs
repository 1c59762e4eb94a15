//! Where lines of text come from, as a command line names it.

use std::fmt;
use std::str::FromStr;

use crate::error::{Error, Result, failed};

/// Where lines of text come from: what follows `text:`.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum TextPlace {
    /// `PORT[@BAUD]`: a board on a serial line.
    Port {
        /// The port's name, such as `/dev/ttyUSB0`.
        port: String,
        /// Its speed, where one is given.
        baud: Option<u32>,
    },
    /// `tcp://HOST:PORT`: what a program or a board sends over a connection that is made to it.
    Tcp(String),
    /// `udp://:PORT`: datagrams that arrive at a port of this computer.
    Udp(String),
    /// `ws://HOST:PORT`: messages of a WebSocket's server, each a line.
    WebSocket(String),
    /// `-`: standard input.
    Stdin,
}

/// The forms, for messages.
const FORMS: &str = "text:PORT[@BAUD], text:tcp://HOST:PORT, text:udp://:PORT, ws://HOST:PORT or text:-";

impl FromStr for TextPlace {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let bad = |what: String| Err(Error::usage(format!("{what}; write {FORMS}")));
        if text == "-" {
            return Ok(Self::Stdin);
        }
        if let Some((scheme, address)) = text.split_once("://") {
            let (address, page) = match scheme {
                "ws" => address.split_once('/').map_or((address, ""), |(address, page)| (address, page)),
                _ => (address, ""),
            };
            let number = address.rsplit_once(':').and_then(|(host, port)| Some((host, port.parse::<u16>().ok()?)));
            return match (scheme, number) {
                ("tcp", Some((host, port))) if !host.is_empty() && port > 0 => Ok(Self::Tcp(address.to_owned())),
                ("udp", Some((host, port))) if port > 0 => {
                    let host = if host.is_empty() { "0.0.0.0" } else { host };
                    Ok(Self::Udp(format!("{host}:{port}")))
                }
                ("ws", Some((host, port))) if !host.is_empty() && port > 0 => {
                    Ok(Self::WebSocket(format!("{address}/{page}")))
                }
                ("tcp" | "udp" | "ws", _) => bad(format!("`{address}` is not an address with a port")),
                _ => bad(format!("lines do not come by `{scheme}://`")),
            };
        }
        match text.rsplit_once('@') {
            None if text.is_empty() => bad("nothing follows `text:`".to_owned()),
            None => Ok(Self::Port { port: text.to_owned(), baud: None }),
            Some((port, baud)) => match baud.parse() {
                Ok(baud) if baud > 0 && !port.is_empty() => Ok(Self::Port { port: port.to_owned(), baud: Some(baud) }),
                _ => Err(failed!("`{baud}` is not a baud rate; write text:PORT@115200").into_usage()),
            },
        }
    }
}

impl fmt::Display for TextPlace {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Port { port, baud: None } => write!(f, "text:{port}"),
            Self::Port { port, baud: Some(baud) } => write!(f, "text:{port}@{baud}"),
            Self::Tcp(address) => write!(f, "text:tcp://{address}"),
            Self::Udp(address) => write!(f, "text:udp://{}", address.strip_prefix("0.0.0.0").unwrap_or(address)),
            Self::WebSocket(address) => write!(f, "text:ws://{}", address.trim_end_matches('/')),
            Self::Stdin => f.write_str("text:-"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_is_named_as_people_write_it() {
        let port = |baud| TextPlace::Port { port: "/dev/ttyUSB0".to_owned(), baud };
        for (text, place) in [
            ("/dev/ttyUSB0", port(None)),
            ("/dev/ttyUSB0@115200", port(Some(115_200))),
            ("tcp://esp.local:3333", TextPlace::Tcp("esp.local:3333".to_owned())),
            ("udp://:9000", TextPlace::Udp("0.0.0.0:9000".to_owned())),
            ("ws://robot:9090", TextPlace::WebSocket("robot:9090/".to_owned())),
            ("ws://robot:9090/a/b", TextPlace::WebSocket("robot:9090/a/b".to_owned())),
            ("-", TextPlace::Stdin),
        ] {
            let parsed: TextPlace = text.parse().unwrap();
            assert_eq!((parsed.to_string(), &parsed), (format!("text:{text}"), &place));
        }
        for (wrong, why) in [
            ("", "nothing follows"),
            ("a@fast", "baud"),
            ("@9600", "baud"),
            ("tcp://:3", "not an address"),
            ("udp://9000", "not an address"),
            ("udp://:0", "not an address"),
            ("ws://robot", "not an address"),
            ("wss://robot:1", "do not come by"),
            ("http://a:1", "do not come by"),
        ] {
            let error = wrong.parse::<TextPlace>().unwrap_err();
            assert!(error.is_usage() && error.to_string().contains(why), "{error}");
        }
    }
}
