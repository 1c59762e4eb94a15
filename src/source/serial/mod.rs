//! Boards on serial lines, many at once, as one source of frames.
//!
//! One thread per port reads and decodes ([`crate::wire`]) without waiting for the consumer; when the queue is full, the
//! oldest frames are dropped and counted. Frames of boards are merged into frames of the skin. `docs/live.md`
//! explains the messages.

mod clock;
mod lines;
mod merge;
mod port;
mod session;
mod taps;

use std::collections::HashSet;
use std::path::Path;
use std::sync::{Arc, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

pub use lines::{BoardAccount, BoardState, Lines, Notice};
pub use taps::{ChannelTap, TapTrouble};

use self::lines::Shared;
use self::merge::{Merge, Pace};
use self::session::{LineConfig, Session};
use super::Source;
use crate::error::{Error, Result, failed};
use crate::signal::{Frame, Wiring};

/// The default speed of a line, baud.
const DEFAULT_BAUD: u32 = 57_600;
/// How often to check whether the lines are closed.
const CLOSE_POLL: Duration = Duration::from_millis(50);

/// How boards on serial lines are read.
#[derive(Clone, Debug, Default)]
pub struct SerialOptions {
    /// The taxel on each channel of each board. Without one, as many boards as ports, numbered from 1, share the body's
    /// taxels in ascending order of their ids ([`Wiring::in_order`]).
    pub wiring: Option<Wiring>,
    /// Rate of merged frames, Hz; 0 for one at each frame of any board. By default one at each frame of the fastest board.
    pub live_rate_hz: Option<f64>,
    /// Frame rate to set on the boards, Hz; 0 is as fast as the line allows. By default their rate is left as it is.
    pub board_rate_hz: Option<f64>,
    /// Maximum age of a value, s; by default three periods of its board, at least 50 ms.
    pub max_age_s: Option<f64>,
}

/// Frames of boards on serial lines.
///
/// Times count from its opening, s. Values of a silent board are [`crate::RawValue::STALE`].
pub struct SerialSource {
    lines: Lines,
    merge: Merge,
    taxels: Vec<u32>,
    wiring: Arc<Wiring>,
    start: Instant,
    read_at: Option<Instant>,
}

impl SerialSource {
    /// Starts to read `ports`, each with its speed in baud where one is given, for a body whose taxels have `ids`.
    ///
    /// It returns at once. Whether boards answer is reported by [`Lines::notices`], and by an error of
    /// [`Source::next_frame`] if no line can be used.
    ///
    /// # Errors
    /// A port is named twice; the wiring has taxels that the body does not have; a rate or an age makes no sense.
    pub fn open(ports: &[(String, Option<u32>)], ids: &[u32], options: &SerialOptions) -> Result<Self> {
        let wiring = match &options.wiring {
            Some(wiring) => wiring.clone(),
            None => Wiring::in_order(ids, 1, ports.len()).map_err(|e| e.at("no --wiring is given"))?,
        };
        check(ports, ids, &wiring)?;
        let pace = pace(options.live_rate_hz)?;
        let rate_mhz = options.board_rate_hz.map(rate_mhz).transpose()?;
        let taxels: Vec<u32> =
            wiring.boards().iter().flat_map(|board| board.taxels.iter().flatten().copied()).collect();
        let mut next = 0..taxels.len();
        let mut place = |taxel: &Option<u32>| taxel.and_then(|_| next.next());
        let places = wiring.boards().iter().map(|board| board.taxels.iter().map(&mut place).collect()).collect();

        let wiring = Arc::new(wiring);
        let start = Instant::now();
        let shared = Arc::new(Shared::new(&wiring, ports.len(), start));
        for (line, (port, baud)) in ports.iter().enumerate() {
            let usual = || wired_baud(&wiring, port).unwrap_or(DEFAULT_BAUD);
            let session = Session::new(LineConfig {
                line,
                port: port.clone(),
                baud: baud.unwrap_or_else(usual),
                fixed: baud.is_some(),
                rate_mhz,
                wiring: Arc::clone(&wiring),
                shared: Arc::clone(&shared),
            });
            thread::Builder::new()
                .name(format!("line {}", line + 1))
                .spawn(move || port::read(session, start))
                .map_err(|e| failed!("cannot start a thread: {e}").at(port))?;
        }
        let merge = Merge::new(places, pace, options.max_age_s);
        Ok(Self { lines: Lines(shared), merge, taxels, wiring, start, read_at: None })
    }

    /// The taxel on each channel of each board.
    #[must_use]
    pub fn wiring(&self) -> &Wiring {
        &self.wiring
    }

    /// State and messages of the lines, for display.
    #[must_use]
    pub fn lines(&self) -> Lines {
        self.lines.clone()
    }
}

/// The wiring's speed for the board expected on `port`, or the speed that all boards share.
fn wired_baud(wiring: &Wiring, port: &str) -> Option<u32> {
    let boards = wiring.boards();
    let own = boards.iter().find(|board| board.port.as_deref() == Some(port)).and_then(|board| board.baud);
    own.or_else(|| boards[0].baud.filter(|_| boards.iter().all(|board| board.baud == boards[0].baud)))
}

fn check(ports: &[(String, Option<u32>)], ids: &[u32], wiring: &Wiring) -> Result<()> {
    let mut named = HashSet::new();
    for (port, _) in ports {
        let same = Path::new(port).canonicalize().unwrap_or_else(|_| port.into());
        if !named.insert(same) {
            return Err(Error::usage("this port is given twice; give each once").at(port));
        }
    }
    let there: HashSet<u32> = ids.iter().copied().collect();
    for board in wiring.boards() {
        let strange = board.taxels.iter().enumerate().find(|(_, taxel)| taxel.is_some_and(|id| !there.contains(&id)));
        if let Some((channel, Some(id))) = strange {
            let what = format!("the body has no taxel {id}; is it the right body?");
            return Err(Error::failed(what).at(format!("wiring: board {}: channel {channel}", board.id)));
        }
    }
    Ok(())
}

fn pace(live_rate_hz: Option<f64>) -> Result<Pace> {
    match live_rate_hz {
        None => Ok(Pace::Fastest),
        Some(0.0) => Ok(Pace::Arrival),
        Some(hz) if (0.001..=1e5).contains(&hz) => Ok(Pace::Every(hz.recip())),
        Some(hz) => Err(Error::usage(format!("--live-rate {hz} is not a rate; give 0.001 to 100000 Hz, or 0"))),
    }
}

fn rate_mhz(hz: f64) -> Result<u32> {
    if hz == 0.0 || (0.001..=1e6).contains(&hz) {
        return Ok((hz * 1e3).round() as u32);
    }
    Err(Error::usage(format!(
        "--board-rate {hz} is not a rate; give 0.001 to 1000000 Hz, or 0 for as many as the line takes"
    )))
}

impl Source for SerialSource {
    fn taxels(&self) -> &[u32] {
        &self.taxels
    }

    fn next_frame(&mut self, frame: &mut Frame) -> Result<bool> {
        let shared = Arc::clone(&self.lines.0);
        let mut state = shared.lock();
        loop {
            if state.closed {
                return Ok(false);
            }
            let due = match state.take() {
                Some((came, read_at)) => {
                    let due = self.merge.take(&came);
                    let (replaced, drift, rate_hz) = self.merge.board_statistics(came.board);
                    let account = &mut state.accounts[came.board];
                    (account.replaced, account.drift, account.rate_hz) = (replaced, drift, rate_hz);
                    self.read_at = Some(read_at);
                    due
                }
                None => {
                    // A frame of silent boards has no time of reading.
                    let has_read_time = self.merge.is_timed() || self.merge.is_waiting();
                    let due = self.merge.tick(self.start.elapsed().as_secs_f64());
                    self.read_at = self.read_at.filter(|_| due.is_none() || has_read_time);
                    due
                }
            };
            if let Some(at_s) = due {
                drop(state);
                frame.values.resize(self.taxels.len(), crate::signal::RawValue::MISSING);
                self.merge.fill(at_s, frame);
                return Ok(true);
            }
            if !state.queue.is_empty() {
                continue;
            }
            if let Some(error) = state.fatal_error() {
                return Err(error);
            }
            let until_due = |due_s: f64| Duration::try_from_secs_f64(due_s - self.start.elapsed().as_secs_f64());
            let wait = self.merge.due_s().map_or(CLOSE_POLL, |due| until_due(due).unwrap_or_default().min(CLOSE_POLL));
            state = shared.arrived.wait_timeout(state, wait).unwrap_or_else(PoisonError::into_inner).0;
        }
    }

    fn read_at(&mut self) -> Option<Instant> {
        self.read_at.take()
    }

    fn losses(&self) -> Vec<String> {
        self.lines.losses()
    }
}

impl Drop for SerialSource {
    fn drop(&mut self) {
        self.lines.close();
    }
}
