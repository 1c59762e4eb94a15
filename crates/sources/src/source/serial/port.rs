//! The thread of a port, which opens, reads and writes it. The only user of serial ports.

use std::io::{ErrorKind, Read as _, Write as _};
use std::thread;
use std::time::{Duration, Instant};

use serialport::SerialPort;

use super::session::Session;
use crate::error::Error;

/// Timeout of a read, and so the resolution of other deadlines.
const READ_TIMEOUT: Duration = Duration::from_millis(15);
/// Time between two tries to open a port.
const REOPEN_INTERVAL: Duration = Duration::from_millis(100);
/// Size of the read buffer: a tenth of a second at 400,000 baud.
const READ_BYTES: usize = 4096;

/// Reads the port of `session` until its lines are closed. Times count from `start`.
pub(super) fn read(mut session: Session, start: Instant) {
    let is_closed = |session: &Session| session.config().shared.lock().closed;
    while !is_closed(&session) {
        match open(&session) {
            Ok(port) => {
                session.opened(start.elapsed());
                if let Err(error) = serve(&mut session, port, start) {
                    let error = Error::failed(error.to_string()).at(&session.config().port);
                    session.gone(start.elapsed(), || error);
                }
            }
            Err(error) => {
                let name = session.config().port.clone();
                session.gone(start.elapsed(), || explained(&name, &error));
            }
        }
        if !is_closed(&session) {
            thread::sleep(REOPEN_INTERVAL);
        }
    }
    let shared = &session.config().shared;
    shared.lock().readers -= 1;
    shared.arrived.notify_all();
}

fn open(session: &Session) -> serialport::Result<Box<dyn SerialPort>> {
    serialport::new(&session.config().port, session.baud()).timeout(READ_TIMEOUT).open()
}

/// Why the port `name` could not be opened, and what to do.
pub(in crate::source) fn explained(name: &str, error: &serialport::Error) -> Error {
    let what = match error.kind {
        serialport::ErrorKind::Io(ErrorKind::NotFound) => format!("there is no such port; {}", ports()),
        serialport::ErrorKind::Io(ErrorKind::PermissionDenied) => {
            "no permission to open it; join the group that owns it (often dialout), and log in again".to_owned()
        }
        serialport::ErrorKind::NoDevice => "it cannot be opened; does another program use it?".to_owned(),
        _ => format!("it cannot be opened: {error}"),
    };
    Error::failed(what).at(name)
}

/// A list of this machine's serial ports for a message.
pub(super) fn ports() -> String {
    let names: Vec<String> =
        serialport::available_ports().unwrap_or_default().into_iter().map(|port| port.port_name).collect();
    if names.is_empty() { "no port found".to_owned() } else { format!("ports found: {}", names.join(", ")) }
}

/// Serves an open port until its lines are closed, or it is gone.
fn serve(session: &mut Session, mut port: Box<dyn SerialPort>, start: Instant) -> std::io::Result<()> {
    let mut baud = session.baud();
    let mut buffer = [0; READ_BYTES];
    loop {
        if session.config().shared.lock().closed {
            if let Some(bytes) = session.stop_command(start.elapsed()) {
                // A board that is gone need not be stopped.
                let _ = port.write_all(bytes);
            }
            return Ok(());
        }
        session.poll(start.elapsed());
        if session.baud() != baud {
            baud = session.baud();
            port.set_baud_rate(baud)?;
        }
        if let Some(bytes) = session.send(start.elapsed()) {
            match port.write_all(bytes) {
                // The dialogue sends it again later.
                Err(error) if error.kind() == ErrorKind::TimedOut => {}
                other => other?,
            }
        }
        match port.read(&mut buffer) {
            Ok(0) => return Err(ErrorKind::UnexpectedEof.into()),
            Ok(count) => {
                let read_at = Instant::now();
                session.receive(&buffer[..count], read_at - start, read_at);
                if session.baud() != baud {
                    baud = session.baud();
                    port.set_baud_rate(baud)?;
                }
            }
            Err(error)
                if matches!(error.kind(), ErrorKind::TimedOut | ErrorKind::Interrupted | ErrorKind::WouldBlock) => {}
            Err(error) => return Err(error),
        }
    }
}
