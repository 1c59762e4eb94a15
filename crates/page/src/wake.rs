//! Waits for sockets, or to be woken by another thread.

#[cfg(not(unix))]
pub(super) use self::other::{Waits, Waker};
#[cfg(unix)]
pub(super) use self::unix::{Waits, Waker};

/// What a socket is waited for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Interest {
    /// That there is something to read, or the end.
    pub(super) read: bool,
    /// That there is room to write.
    pub(super) write: bool,
}

#[cfg(unix)]
mod unix {
    use std::net::{TcpListener, TcpStream};
    use std::os::fd::{AsFd, OwnedFd};
    use std::sync::atomic::{AtomicBool, Ordering};
    use std::time::Duration;

    use rustix::event::{PollFd, PollFlags, Timespec, poll};
    use rustix::io::{read, write};
    use rustix::pipe::pipe;

    use super::Interest;
    use crate::error::{Error, Result};

    /// Wakes the thread that waits.
    #[derive(Debug)]
    pub(in super::super) struct Waker {
        end: OwnedFd,
        /// Whether a byte is in the pipe already.
        woken: AtomicBool,
    }

    impl Waker {
        pub(in super::super) fn wake(&self) {
            if !self.woken.swap(true, Ordering::AcqRel) {
                // A full pipe wakes too.
                let _ = write(&self.end, &[1]);
            }
        }
    }

    /// The thread's end.
    #[derive(Debug)]
    pub(in super::super) struct Waits {
        end: OwnedFd,
    }

    impl Waits {
        /// Gives the calling thread a lower priority where the system has one for threads: when few cores are busy, the
        /// engine's thread is not put aside each time that it wakes this one.
        pub(in super::super) fn lower_priority() {
            #[cfg(target_os = "linux")]
            // Without it frames are handed over more slowly, and that is all.
            let _ = rustix::process::nice(5);
        }

        pub(in super::super) fn new() -> Result<(Self, Waker)> {
            let made = pipe().and_then(|(out, into)| {
                rustix::io::ioctl_fionbio(&out, true)?;
                rustix::io::ioctl_fionbio(&into, true)?;
                rustix::io::fcntl_setfd(&out, rustix::io::FdFlags::CLOEXEC)?;
                rustix::io::fcntl_setfd(&into, rustix::io::FdFlags::CLOEXEC)?;
                Ok((Self { end: out }, Waker { end: into, woken: AtomicBool::new(false) }))
            });
            made.map_err(|e| Error::failed(format!("cannot make a pipe: {e}")))
        }

        /// Waits until `listener` has a connection, a socket is as wanted, `waker` wakes, or the time is up. Says nothing
        /// of what it was: sockets do not block.
        pub(in super::super) fn wait<'a>(
            &self,
            waker: &Waker,
            listener: Option<&TcpListener>,
            sockets: impl Iterator<Item = (&'a TcpStream, Interest)>,
            most: Option<Duration>,
        ) {
            let mut fds = vec![PollFd::from_borrowed_fd(self.end.as_fd(), PollFlags::IN)];
            fds.extend(listener.map(|listener| PollFd::new(listener, PollFlags::IN)));
            fds.extend(sockets.map(|(socket, interest)| {
                let mut flags = PollFlags::empty();
                flags.set(PollFlags::IN, interest.read);
                flags.set(PollFlags::OUT, interest.write);
                PollFd::new(socket, flags)
            }));
            let most = most.map(|most| Timespec { tv_sec: most.as_secs() as _, tv_nsec: most.subsec_nanos().into() });
            // An interrupted wait is a short one.
            let _ = poll(&mut fds, most.as_ref());
            let mut bytes = [0; 16];
            let _ = read(&self.end, &mut bytes);
            // In this order: whoever wakes in between finds that there will be a look at what it left.
            waker.woken.store(false, Ordering::Release);
        }
    }
}

#[cfg(not(unix))]
mod other {
    use std::net::{TcpListener, TcpStream};
    use std::sync::{Condvar, Mutex};
    use std::time::Duration;

    use super::Interest;
    use crate::error::Result;

    /// How often sockets are looked at.
    const PERIOD: Duration = Duration::from_millis(4);

    /// Wakes the thread that waits.
    #[derive(Debug, Default)]
    pub(in super::super) struct Waker {
        woken: Mutex<bool>,
        change: Condvar,
    }

    impl Waker {
        pub(in super::super) fn wake(&self) {
            if let Ok(mut woken) = self.woken.try_lock() {
                *woken = true;
            }
            self.change.notify_one();
        }
    }

    /// The thread's end.
    #[derive(Debug)]
    pub(in super::super) struct Waits;

    impl Waits {
        pub(in super::super) fn lower_priority() {}

        pub(in super::super) fn new() -> Result<(Self, Waker)> {
            Ok((Self, Waker::default()))
        }

        /// Waits until `waker` wakes or it is time to look at the sockets again.
        pub(in super::super) fn wait<'a>(
            &self,
            waker: &Waker,
            _: Option<&TcpListener>,
            _: impl Iterator<Item = (&'a TcpStream, Interest)>,
            most: Option<Duration>,
        ) {
            let Ok(woken) = waker.woken.lock() else { return };
            let most = most.map_or(PERIOD, |most| most.min(PERIOD));
            if let Ok((mut woken, _)) = waker.change.wait_timeout_while(woken, most, |woken| !*woken) {
                *woken = false;
            }
        }
    }
}

#[cfg(all(test, unix))]
mod tests {
    use std::time::{Duration, Instant};

    use super::*;

    #[test]
    fn a_wait_ends_when_woken_and_not_before() {
        let (waits, waker) = Waits::new().unwrap();
        let wait = |most: u64| {
            let start = Instant::now();
            waits.wait(&waker, None, std::iter::empty(), Some(Duration::from_millis(most)));
            start.elapsed()
        };
        assert!(wait(20) >= Duration::from_millis(19));
        waker.wake();
        waker.wake();
        assert!(wait(10_000) < Duration::from_secs(5));
        assert!(wait(20) >= Duration::from_millis(19), "woken once");
        std::thread::scope(|scope| {
            scope.spawn(|| {
                std::thread::sleep(Duration::from_millis(20));
                waker.wake();
            });
            assert!(wait(10_000) < Duration::from_secs(5));
        });
    }
}
