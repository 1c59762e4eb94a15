//! The key that ends a live table: `q`, heard at once, from a terminal that is put back as it was.

use std::cell::Cell;
use std::os::fd::{AsFd as _, BorrowedFd};
use std::sync::{Mutex, PoisonError};

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::termios::{LocalModes, OptionalActions, Termios, isatty, tcgetattr, tcgetpgrp, tcsetattr};

/// How the terminal was, while it is otherwise.
static BEFORE: Mutex<Option<Termios>> = Mutex::new(None);

/// Keys as they are pressed, without an echo. The terminal is put back when this is dropped.
pub(super) struct Keys {
    is_ended: Cell<bool>,
}

impl Keys {
    /// Listens on standard input, where that is a terminal that this process has in front.
    pub(super) fn listen() -> Option<Self> {
        let stdin = std::io::stdin();
        let terminal = stdin.as_fd();
        // A process in the background would be stopped by its terminal.
        let in_front = || tcgetpgrp(terminal).is_ok_and(|group| group == rustix::process::getpgrp());
        if !isatty(terminal) || !in_front() {
            return None;
        }
        let before = tcgetattr(terminal).ok()?;
        let mut keys = before.clone();
        // Ctrl-C stays a signal.
        keys.local_modes -= LocalModes::ICANON | LocalModes::ECHO;
        *BEFORE.lock().unwrap_or_else(PoisonError::into_inner) = Some(before);
        tcsetattr(terminal, OptionalActions::Now, &keys).ok()?;
        Some(Self { is_ended: Cell::new(false) })
    }

    /// Whether `q` was pressed. Waits for nothing.
    pub(super) fn ends(&self) -> bool {
        let stdin = std::io::stdin();
        let mut pressed = [0; 64];
        while has_more(stdin.as_fd())
            && let Ok(count @ 1..) = rustix::io::read(stdin.as_fd(), &mut pressed)
        {
            if pressed[..count].iter().any(|key| key.eq_ignore_ascii_case(&b'q')) {
                self.is_ended.set(true);
            }
        }
        self.is_ended.get()
    }
}

impl Drop for Keys {
    fn drop(&mut self) {
        restore();
    }
}

fn has_more(terminal: BorrowedFd<'_>) -> bool {
    let mut ask = [PollFd::from_borrowed_fd(terminal, PollFlags::IN)];
    let now = Timespec { tv_sec: 0, tv_nsec: 0 };
    poll(&mut ask, Some(&now)).is_ok() && ask[0].revents().contains(PollFlags::IN)
}

/// Puts the terminal back as it was, if it is otherwise: for ways out on which nothing is dropped.
pub(super) fn restore() {
    if let Some(before) = BEFORE.lock().unwrap_or_else(PoisonError::into_inner).take() {
        let _ = tcsetattr(std::io::stdin(), OptionalActions::Now, &before);
    }
}
