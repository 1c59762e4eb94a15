//! The program as a process, for what only the command reads.

use std::io::{BufRead as _, BufReader, ErrorKind, Read as _, Write as _};
use std::net::{Shutdown, TcpStream};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

const PROGRAM: &str = env!("CARGO_BIN_EXE_somatic");

/// Memory of a process, KiB.
const MAX_KIB: &str = "4000000";

/// Runs the program with sound `arguments`.
pub(super) fn succeeds(arguments: &[&str]) {
    let output = Command::new(PROGRAM).args(arguments).output().unwrap();
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
}

/// Whether the program takes `arguments`: it must end by itself, and say in a line why it does not.
pub(super) fn verdict(arguments: &[&str]) -> Result<bool, String> {
    let limited = if cfg!(target_os = "linux") { format!("ulimit -v {MAX_KIB}; ") } else { String::new() };
    let started = Command::new("sh")
        .args(["-c", &format!("{limited}exec \"$0\" \"$@\""), PROGRAM])
        .args(arguments)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn();
    let mut child = match started {
        // Nobody can give this many.
        Err(e) if e.kind() == ErrorKind::ArgumentListTooLong => return Ok(false),
        started => started.map_err(|e| format!("cannot start the program: {e}"))?,
    };
    let mut stderr = child.stderr.take().ok_or("no standard error")?;
    let reader = std::thread::spawn(move || {
        let mut text = Vec::new();
        let _ = stderr.read_to_end(&mut text);
        String::from_utf8_lossy(&text).into_owned()
    });
    let started = Instant::now();
    let status = loop {
        if let Some(status) = child.try_wait().map_err(|e| e.to_string())? {
            break status;
        }
        // The machine may be busy: time on the clock.
        if started.elapsed() > Duration::from_secs(30) {
            let _ = child.kill();
            let _ = child.wait();
            return Err(format!("{arguments:?} has not ended after 30 s"));
        }
        std::thread::sleep(Duration::from_millis(2));
    };
    let text = reader.join().unwrap_or_default();
    match status.code() {
        Some(0) => Ok(true),
        Some(1..=3) if !text.trim().is_empty() && !text.contains("panicked") => Ok(false),
        other => Err(format!("{arguments:?} ends with {other:?}: {text}")),
    }
}

/// A page that is served, for requests.
pub(super) struct Page {
    child: Child,
    address: String,
    token: String,
}

impl Page {
    pub(super) fn start() -> Self {
        let mut child = Command::new(PROGRAM)
            .args(["view", "hand", "--listen", "127.0.0.1:0"])
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut lines = BufReader::new(child.stderr.take().unwrap()).lines();
        let url = lines
            .by_ref()
            .map_while(Result::ok)
            .find_map(|line| line.split_whitespace().find(|word| word.starts_with("http://")).map(str::to_owned))
            .expect("it prints its address");
        std::thread::spawn(move || lines.for_each(drop));
        let rest = url.trim_start_matches("http://");
        let (address, fragment) = rest.split_once('/').unwrap();
        let token = fragment.rsplit(['#', '=']).next().unwrap().to_owned();
        Self { child, address: address.to_owned(), token }
    }

    /// `sound` for this page: its address and token are put in.
    pub(super) fn meant(&self, sound: &[u8]) -> Vec<u8> {
        let replaced = |bytes: &[u8], from: &[u8], to: &[u8]| -> Vec<u8> {
            let mut out = Vec::new();
            let mut at = 0;
            while at < bytes.len() {
                if bytes[at..].starts_with(from) {
                    out.extend(to);
                    at += from.len();
                } else {
                    out.push(bytes[at]);
                    at += 1;
                }
            }
            out
        };
        let bytes = replaced(sound, b"ADDRESS", self.address.as_bytes());
        replaced(&bytes, b"0123456789abcdef0123456789abcdef", self.token.as_bytes())
    }

    /// Sends `bytes` and hears the answer to its end; whether it is one of success.
    pub(super) fn verdict(&self, bytes: &[u8]) -> Result<bool, String> {
        let answer = self.answer(bytes)?;
        // Another request is answered still.
        let sound = format!("GET / HTTP/1.1\r\nHost: {}\r\nConnection: close\r\n\r\n", self.address);
        if !self.answer(sound.as_bytes())?.starts_with(b"HTTP/1.1 200") {
            return Err("the page is not served any more".to_owned());
        }
        Ok(answer.starts_with(b"HTTP/1.1 200") || answer.starts_with(b"HTTP/1.1 101"))
    }

    fn answer(&self, bytes: &[u8]) -> Result<Vec<u8>, String> {
        let mut stream = TcpStream::connect(&self.address).map_err(|e| format!("it takes no connection: {e}"))?;
        let _ = stream.set_read_timeout(Some(Duration::from_millis(300)));
        // It may have hung up already.
        let _ = stream.write_all(bytes);
        let mut answer = Vec::new();
        let mut part = [0; 1 << 16];
        let mut ended: Option<Instant> = None;
        loop {
            match stream.read(&mut part) {
                Ok(0) => return Ok(answer),
                Ok(length) => answer.extend(&part[..length]),
                Err(e) if matches!(e.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {
                    // It waits for more: there is none.
                    let _ = stream.shutdown(Shutdown::Write);
                    let since = ended.get_or_insert_with(Instant::now);
                    if since.elapsed() > Duration::from_secs(20) {
                        return Err("the connection is open 20 s after its end".to_owned());
                    }
                }
                Err(_) => return Ok(answer),
            }
        }
    }
}

impl Drop for Page {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
