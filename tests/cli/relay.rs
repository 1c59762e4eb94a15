//! A relay of TCP that delays, stalls and cuts what goes through it: a network, as this kernel has no `netem`.

use std::io::{Read as _, Write as _};
use std::net::{Shutdown, TcpListener, TcpStream};
use std::sync::atomic::{AtomicU8, AtomicU64, Ordering};
use std::sync::mpsc::channel;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};
use std::{io, thread};

/// What the relay does with what comes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Link {
    /// It passes on.
    Up,
    /// It holds everything back, as a network does on which packets are lost.
    Stalled,
    /// It reads nothing, so that what the sender's system keeps for it fills up.
    Blocked,
    /// Its connections are cut, and it takes no new ones.
    Cut,
}

/// Connections to it go on to another address.
pub struct Relay {
    pub port: u16,
    state: Arc<State>,
}

struct State {
    link: AtomicU8,
    open: Mutex<Vec<TcpStream>>,
    /// Of numbers that look like chance.
    chance: AtomicU64,
    delay: Duration,
    jitter: Duration,
}

impl Relay {
    /// Listens on `host`, and passes on to `to` after `delay`, give or take `jitter`, in order.
    pub fn start(host: &str, to: String, delay: Duration, jitter: Duration) -> io::Result<Self> {
        let listener = TcpListener::bind((host, 0))?;
        let port = listener.local_addr()?.port();
        let chance = AtomicU64::new(u64::from(port));
        let state = State { link: AtomicU8::new(0), open: Mutex::default(), chance, delay, jitter };
        let state = Arc::new(state);
        let shared = Arc::clone(&state);
        thread::spawn(move || {
            for from in listener.incoming().flatten() {
                if shared.link.load(Ordering::Relaxed) == Link::Cut as u8 {
                    continue;
                }
                let Ok(onward) = TcpStream::connect(&to) else { continue };
                for (from, to) in [(&from, &onward), (&onward, &from)] {
                    let (from, to) = (from.try_clone().unwrap(), to.try_clone().unwrap());
                    shared.open.lock().unwrap().push(from.try_clone().unwrap());
                    let shared = Arc::clone(&shared);
                    thread::spawn(move || pass(&shared, from, to));
                }
            }
        });
        Ok(Self { port, state })
    }

    pub fn set(&self, link: Link) {
        self.state.link.store(link as u8, Ordering::Relaxed);
        if link == Link::Cut {
            for stream in self.state.open.lock().unwrap().drain(..) {
                let _ = stream.shutdown(Shutdown::Both);
            }
        }
    }
}

impl State {
    fn delay(&self) -> Duration {
        let state = self.chance.fetch_add(0x9E37_79B9_7F4A_7C15, Ordering::Relaxed);
        let mixed = (state ^ (state >> 31)).wrapping_mul(0x94D0_49BB_1331_11EB);
        let share = (mixed >> 40) as f64 / f64::from(1 << 24);
        self.delay.saturating_sub(self.jitter) + self.jitter.mul_f64(2.0 * share)
    }
}

fn pass(state: &State, mut from: TcpStream, mut to: TcpStream) {
    let _ = to.set_nodelay(true);
    let (sender, waiting) = channel::<(Instant, Vec<u8>)>();
    thread::scope(|scope| {
        scope.spawn(move || {
            for (due, bytes) in waiting {
                thread::sleep(due.saturating_duration_since(Instant::now()));
                while state.link.load(Ordering::Relaxed) == Link::Stalled as u8 {
                    thread::sleep(Duration::from_millis(2));
                }
                if to.write_all(&bytes).is_err() {
                    break;
                }
            }
            let _ = to.shutdown(Shutdown::Both);
        });
        let mut buffer = [0; 1 << 16];
        loop {
            while state.link.load(Ordering::Relaxed) == Link::Blocked as u8 {
                thread::sleep(Duration::from_millis(2));
            }
            match from.read(&mut buffer) {
                Ok(0) | Err(_) => break,
                Ok(count) => drop(sender.send((Instant::now() + state.delay(), buffer[..count].to_vec()))),
            }
        }
        drop(sender);
    });
}
