//! A pseudo-terminal as a virtual serial port.

use std::os::fd::OwnedFd;
use std::path::PathBuf;
use std::time::Duration;

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fs::{Mode, OFlags};
use rustix::io::Errno;
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{ControlModes, tcgetattr};
use somatic::{Error, Result};

/// This process's end.
pub(super) struct Pty {
    end: OwnedFd,
    /// The device to open on the other side.
    pub(super) path: PathBuf,
}

fn failed(what: &str, error: Errno) -> Error {
    Error::failed(format!("{what}: {}", std::io::Error::from(error))).at("pseudo-terminal")
}

impl Pty {
    pub(super) fn open() -> Result<Self> {
        let end = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).map_err(|e| failed("cannot open one", e))?;
        let ready = grantpt(&end).and_then(|()| unlockpt(&end)).and_then(|()| rustix::io::ioctl_fionbio(&end, true));
        ready.map_err(|e| failed("cannot set it up", e))?;
        let name = ptsname(&end, Vec::new()).map_err(|e| failed("it has no name", e))?;
        let path = PathBuf::from(name.to_string_lossy().into_owned());
        // After one open and close it reports a hang-up while nobody has it open.
        drop(rustix::fs::open(&path, OFlags::RDWR | OFlags::NOCTTY | OFlags::CLOEXEC, Mode::empty()));
        Ok(Self { end, path })
    }

    pub(super) fn is_open(&self) -> bool {
        let mut ask = [PollFd::new(&self.end, PollFlags::IN)];
        let now = Timespec { tv_sec: 0, tv_nsec: 0 };
        poll(&mut ask, Some(&now)).is_ok() && !ask[0].revents().contains(PollFlags::HUP)
    }

    /// Reads what the other side sent.
    pub(super) fn read<'a>(&self, buffer: &'a mut [u8]) -> &'a [u8] {
        let count = rustix::io::read(&self.end, &mut *buffer).unwrap_or(0);
        &buffer[..count]
    }

    /// Sends `bytes`; returns how many fit.
    pub(super) fn write(&self, bytes: &[u8]) -> usize {
        let mut written = 0;
        while written < bytes.len() {
            match rustix::io::write(&self.end, &bytes[written..]) {
                Ok(count) if count > 0 => written += count,
                Err(Errno::INTR) => {}
                _ => break,
            }
        }
        written
    }

    /// The other side's speed over `baud`: 1 within the 2 % that a UART tolerates, and not 1 with another framing.
    pub(super) fn baud_ratio(&self, baud: u32) -> f64 {
        let Ok(set) = tcgetattr(&self.end) else { return 1.0 };
        let ratio = f64::from(set.output_speed()) / f64::from(baud);
        let framing = set.control_modes & (ControlModes::CSIZE | ControlModes::PARENB | ControlModes::CSTOPB);
        match (ratio - 1.0).abs() <= 0.02 {
            true if framing == ControlModes::CS8 => 1.0,
            true => 0.98,
            false => ratio,
        }
    }
}

/// Sleeps until one of `ends` can be read, for at most `most`.
pub(super) fn wait<'a>(ends: impl Iterator<Item = &'a Pty>, most: Duration) {
    // An end that is not open is always ready.
    let mut ask: Vec<PollFd<'_>> =
        ends.filter(|pty| pty.is_open()).map(|pty| PollFd::new(&pty.end, PollFlags::IN)).collect();
    let most = Timespec { tv_sec: 0, tv_nsec: most.subsec_nanos().into() };
    let _ = poll(&mut ask, Some(&most));
}
