//! The requests of a browser: bytes in, a decision out. GET and HEAD of exact paths, without bodies, and the upgrade to the
//! one WebSocket.

use super::files::{PageFile, file};
use super::guard::{Hosts, Refusal, check_origin};

/// The most bytes of a request's head.
pub(super) const MAX_HEAD_BYTES: usize = 8 << 10;
/// The most headers of a request.
const MAX_HEADERS: usize = 64;
/// The path of the WebSocket.
const SOCKET_PATH: &str = "/socket";
/// The paths of the second of two pages begin with this.
const BESIDE: &str = "/beside";
/// The page that has both in frames.
pub(super) const PAIR_PATH: &str = "/pair.html";

/// What is served, and to whom.
#[derive(Clone, Debug, Default)]
pub(super) struct Site {
    /// The host names that requests may be for.
    pub(super) hosts: Hosts,
    /// Whether there are two pages, which one page of the same site has in frames.
    pub(super) is_pair: bool,
}

/// What is to be done about a request.
#[derive(Debug)]
pub(super) enum Decision {
    /// Its head is not complete yet.
    NeedMore,
    /// Send a file, or its headers alone.
    Serve {
        /// The file.
        file: &'static PageFile,
        /// Whether its bytes follow the headers.
        with_body: bool,
    },
    /// Go on as a WebSocket.
    Upgrade {
        /// The client's key.
        key: String,
        /// Bytes of the head; what follows is of the WebSocket.
        head_bytes: usize,
        /// Whether it is of the second of two pages.
        is_beside: bool,
    },
    /// Refuse it with a status.
    Refuse(Status),
}

/// A status and what it says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Status(pub(super) u16, pub(super) &'static str);

const BAD_REQUEST: Status = Status(400, "Bad Request");
const FORBIDDEN: Status = Status(403, "Forbidden");
const NOT_FOUND: Status = Status(404, "Not Found");
const BAD_METHOD: Status = Status(405, "Method Not Allowed");
const TOO_LATE: Status = Status(408, "Request Timeout");
const MISDIRECTED: Status = Status(421, "Misdirected Request");
const UPGRADE_REQUIRED: Status = Status(426, "Upgrade Required");
const TOO_LARGE: Status = Status(431, "Request Header Fields Too Large");

/// What to answer to a head that does not come in time.
pub(super) const LATE: Decision = Decision::Refuse(TOO_LATE);

/// What is to be done about the request that begins with `bytes`.
pub(super) fn decide(bytes: &[u8], site: &Site) -> Decision {
    let mut headers = [httparse::EMPTY_HEADER; MAX_HEADERS];
    let mut request = httparse::Request::new(&mut headers);
    let head_bytes = match request.parse(bytes) {
        Ok(httparse::Status::Complete(length)) if length <= MAX_HEAD_BYTES => length,
        Ok(httparse::Status::Partial) if bytes.len() < MAX_HEAD_BYTES => return Decision::NeedMore,
        Ok(_) | Err(httparse::Error::TooManyHeaders) => return Decision::Refuse(TOO_LARGE),
        Err(_) => return Decision::Refuse(BAD_REQUEST),
    };
    answer(&request, head_bytes, site).unwrap_or_else(Decision::Refuse)
}

fn answer(request: &httparse::Request<'_, '_>, head_bytes: usize, site: &Site) -> Result<Decision, Status> {
    let host = site.hosts.check(&values(request, "host")?).map_err(|refusal| match refusal {
        Refusal::NoHost => BAD_REQUEST,
        _ => MISDIRECTED,
    })?;
    let (method, path) = (request.method.unwrap_or_default(), request.path.unwrap_or_default());
    if !matches!(method, "GET" | "HEAD") {
        return Err(BAD_METHOD);
    }
    let has_body = values(request, "content-length")?.iter().any(|length| *length != "0");
    if has_body || !values(request, "transfer-encoding")?.is_empty() {
        return Err(BAD_REQUEST);
    }
    let beside = path.strip_prefix(BESIDE).filter(|rest| site.is_pair && rest.starts_with('/'));
    let (path, is_beside) = (beside.unwrap_or(path), beside.is_some());
    if path == PAIR_PATH && (is_beside || !site.is_pair) {
        return Err(NOT_FOUND);
    }
    if path != SOCKET_PATH {
        let file = file(path).ok_or(NOT_FOUND)?;
        return Ok(Decision::Serve { file, with_body: method == "GET" });
    }
    check_origin(&values(request, "origin")?, host).map_err(|_| FORBIDDEN)?;
    let has = |name, word: &str| {
        let values = values(request, name)?;
        Ok(values.iter().flat_map(|value| value.split(',')).any(|value| value.trim().eq_ignore_ascii_case(word)))
    };
    if method != "GET" || request.version != Some(1) {
        return Err(BAD_REQUEST);
    }
    if !has("upgrade", "websocket")? || !has("connection", "upgrade")? || !has("sec-websocket-version", "13")? {
        return Err(UPGRADE_REQUIRED);
    }
    match values(request, "sec-websocket-key")?[..] {
        // Sixteen bytes in base64.
        [key] if key.len() == 24 && key.ends_with("==") => {
            Ok(Decision::Upgrade { key: key.to_owned(), head_bytes, is_beside })
        }
        _ => Err(BAD_REQUEST),
    }
}

/// The values of all headers called `name`.
fn values<'a>(request: &httparse::Request<'_, 'a>, name: &str) -> Result<Vec<&'a str>, Status> {
    let named = request.headers.iter().filter(|header| header.name.eq_ignore_ascii_case(name));
    named.map(|header| std::str::from_utf8(header.value).map_err(|_| BAD_REQUEST)).collect()
}

/// What every answer says: nothing from elsewhere, nothing inline, nothing kept, and only two pages of a site in frames, in a
/// page of the same site.
fn security(is_pair: bool) -> String {
    let frames = if is_pair { "frame-ancestors 'self'; frame-src 'self'" } else { "frame-ancestors 'none'" };
    format!(
        "Content-Security-Policy: default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; img-src \
         'self' data:; {frames}; base-uri 'none'; form-action 'none'\r\nX-Content-Type-Options: nosniff\r\n\
         Referrer-Policy: no-referrer\r\nCache-Control: no-store\r\n"
    )
}

/// The answer that sends `file`, of two pages if `is_pair`.
pub(super) fn file_answer(file: &PageFile, with_body: bool, is_pair: bool) -> Vec<u8> {
    let head = format!(
        "HTTP/1.1 200 OK\r\nContent-Type: {}\r\nContent-Length: {}\r\nConnection: close\r\n{}\r\n",
        file.media_type,
        file.bytes.len(),
        security(is_pair)
    );
    let mut answer = head.into_bytes();
    if with_body {
        answer.extend_from_slice(file.bytes);
    }
    answer
}

/// The answer that refuses a request.
pub(super) fn refusal(Status(code, reason): Status) -> Vec<u8> {
    let more = match code {
        405 => "Allow: GET, HEAD\r\n",
        426 => "Upgrade: websocket\r\nSec-WebSocket-Version: 13\r\n",
        _ => "",
    };
    let security = security(false);
    format!("HTTP/1.1 {code} {reason}\r\nContent-Length: 0\r\nConnection: close\r\n{more}{security}\r\n").into_bytes()
}

/// The answer after which the connection is a WebSocket; `accept` is made of the client's key.
pub(super) fn upgrade_answer(accept: &str) -> Vec<u8> {
    let security = security(false);
    format!(
        "HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n\
         Sec-WebSocket-Accept: {accept}\r\n{security}\r\n"
    )
    .into_bytes()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn status(bytes: &[u8]) -> u16 {
        status_of(bytes, &Site::default())
    }

    fn status_of(bytes: &[u8], site: &Site) -> u16 {
        match decide(bytes, site) {
            Decision::NeedMore => 0,
            Decision::Serve { .. } => 200,
            Decision::Upgrade { .. } => 101,
            Decision::Refuse(status) => status.0,
        }
    }

    const UPGRADE: &str = "GET /socket HTTP/1.1\r\nHost: localhost:7879\r\nOrigin: http://localhost:7879\r\n\
                           Upgrade: WebSocket\r\nConnection: keep-alive, Upgrade\r\nSec-WebSocket-Version: 13\r\n\
                           Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n";

    #[test]
    fn an_upgrade_is_the_pages_own() {
        assert_eq!(status(UPGRADE.as_bytes()), 101);
        for (what, with, code) in [
            ("Host: localhost:7879", "Host: evil.example", 421),
            ("Host: localhost:7879\r\n", "", 400),
            ("Host: localhost:7879", "Host: localhost:7879\r\nHost: localhost:7879", 400),
            ("Origin: http://localhost:7879", "Origin: http://evil.example", 403),
            ("Origin: http://localhost:7879", "Origin: null", 403),
            ("Origin: http://localhost:7879\r\n", "", 403),
            ("Origin: http://localhost:7879", "Origin: http://localhost:7878", 403),
            ("Upgrade: WebSocket\r\n", "", 426),
            ("Connection: keep-alive, Upgrade", "Connection: keep-alive", 426),
            ("Version: 13", "Version: 8", 426),
            ("HTTP/1.1", "HTTP/1.0", 400),
            ("GET", "HEAD", 400),
            ("GET", "POST", 405),
            ("dGhlIHNhbXBsZSBub25jZQ==", "short", 400),
            ("Upgrade: W", "Content-Length: 5\r\nUpgrade: W", 400),
            ("Upgrade: W", "Transfer-Encoding: chunked\r\nUpgrade: W", 400),
        ] {
            assert!(UPGRADE.contains(what));
            assert_eq!(status(UPGRADE.replacen(what, with, 1).as_bytes()), code, "{what} → {with}");
        }
    }

    #[test]
    fn the_head_of_an_upgrade_ends_where_the_socket_begins() {
        let bytes = [UPGRADE.as_bytes(), b"\x81\x80abcd"].concat();
        let Decision::Upgrade { head_bytes, key, is_beside } = decide(&bytes, &Site::default()) else {
            panic!("refused")
        };
        assert_eq!((head_bytes, key.as_str(), is_beside), (UPGRADE.len(), "dGhlIHNhbXBsZSBub25jZQ==", false));
    }

    #[test]
    fn only_a_pair_has_a_second_page_and_frames() {
        let (alone, pair) = (Site::default(), Site { is_pair: true, ..Site::default() });
        let get = |path: &str| format!("GET {path} HTTP/1.1\r\nHost: localhost\r\n\r\n");
        for (path, of_pair) in [
            ("/pair.html", 200),
            ("/beside/", 200),
            ("/beside/main.js", 200),
            ("/beside/pair.html", 404),
            ("/beside", 404),
            ("/besides/", 404),
            ("/beside/beside/", 404),
        ] {
            assert_eq!(status_of(get(path).as_bytes(), &alone), 404, "{path}");
            assert_eq!(status_of(get(path).as_bytes(), &pair), of_pair, "{path}");
        }
        assert_eq!(status_of(get("/").as_bytes(), &pair), 200);
        let beside = UPGRADE.replacen("/socket", "/beside/socket", 1);
        assert_eq!(status_of(beside.as_bytes(), &alone), 404);
        for (bytes, expected) in [(UPGRADE, false), (beside.as_str(), true)] {
            let Decision::Upgrade { is_beside, .. } = decide(bytes.as_bytes(), &pair) else { panic!("refused") };
            assert_eq!(is_beside, expected);
        }
        // Another site's page is refused as for one page alone.
        let foreign = beside.replacen("Origin: http://localhost", "Origin: http://evil.example", 1);
        assert_eq!(status_of(foreign.as_bytes(), &pair), 403);
        let file = PageFile { path: "/a.js", media_type: "text/javascript", bytes: b"let a;" };
        let text = String::from_utf8(file_answer(&file, true, true)).unwrap();
        assert!(text.contains("default-src 'none'") && text.contains("frame-ancestors 'self'; frame-src 'self'"));
    }

    #[test]
    fn a_head_comes_in_any_pieces_up_to_its_limit() {
        for end in 0..UPGRADE.len() {
            assert_eq!(status(&UPGRADE.as_bytes()[..end]), 0, "{end}");
        }
        let endless = |length: usize| format!("GET / HTTP/1.1\r\nX: {}", "a".repeat(length));
        assert_eq!(status(endless(100).as_bytes()), 0);
        assert_eq!(status(endless(MAX_HEAD_BYTES).as_bytes()), 431);
        let many = format!("GET / HTTP/1.1\r\n{}", "A: b\r\n".repeat(MAX_HEADERS + 1));
        assert_eq!(status(many.as_bytes()), 431);
        assert_eq!(status(b"\x16\x03\x01\x02\x00\x01"), 400);
        assert_eq!(status(b"GET /nowhere HTTP/1.1\r\nHost: localhost\r\n\r\n"), 404);
        assert_eq!(status(b"GET http://evil.example/ HTTP/1.1\r\nHost: localhost\r\n\r\n"), 404);
        assert_eq!(status(b"DELETE / HTTP/1.1\r\nHost: localhost\r\n\r\n"), 405);
    }

    #[test]
    fn every_answer_carries_the_security_headers() {
        let file = PageFile { path: "/a.js", media_type: "text/javascript", bytes: b"let a;" };
        let answers = [
            file_answer(&file, true, false),
            file_answer(&file, false, false),
            refusal(NOT_FOUND),
            upgrade_answer("x"),
        ];
        for answer in &answers {
            let text = std::str::from_utf8(answer).unwrap();
            for header in ["default-src 'none'", "frame-ancestors 'none'", "nosniff", "no-referrer", "no-store"] {
                assert!(text.contains(header), "{text}");
            }
            assert!(!text.contains("unsafe") && !text.to_lowercase().contains("access-control"), "{text}");
            assert!(text.contains("\r\n\r\n"));
        }
        assert!(answers[0].ends_with(b"\r\n\r\nlet a;") && answers[1].ends_with(b"\r\n\r\n"));
        assert!(answers[1].windows(17).any(|part| part == b"Content-Length: 6"));
    }
}
