//! State shared by the port threads and the consumer of frames, and the public view of the lines.

use std::collections::VecDeque;
use std::fmt;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use super::merge::BoardFrame;
use super::wipers::{self, ChannelWiper, WiperTrouble};
use crate::error::{Error, failed};
use crate::signal::Wiring;

const MAX_QUEUED_FRAMES: usize = 64;
const MAX_NOTICES: usize = 256;
/// Frames' percepts of limbs that wait.
#[cfg(feature = "zenoh")]
const MAX_QUEUED_PERCEPTS: usize = 1024;
const CLOSE_TIMEOUT: Duration = Duration::from_millis(300);

/// The state of a board.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum BoardState {
    /// It has not been found yet.
    #[default]
    Awaited,
    /// It sends frames.
    Speaking,
    /// Its line is open, but no frames come.
    Silent,
    /// Its port is gone.
    Unplugged,
}

impl BoardState {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Awaited, Self::Speaking, Self::Silent, Self::Unplugged];

    /// The state's name.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            Self::Awaited => "awaited",
            Self::Speaking => "speaking",
            Self::Silent => "silent",
            Self::Unplugged => "unplugged",
        }
    }
}

/// Frame counts and state of a board since it was found; it has sent `delivered + lost` frames.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct BoardAccount {
    /// Its id; of a limb its number from 1.
    pub board: u16,
    /// The key of a limb on a network, which is not a board.
    pub limb: Option<String>,
    /// The port it was last found on; of a limb its key, once it was heard.
    pub port: Option<String>,
    /// Bits of its values, once it has been identified.
    pub bits: Option<u8>,
    /// Its state.
    pub state: BoardState,
    /// Frames received intact.
    pub delivered: u64,
    /// Frames lost on the line, from gaps in their sequence numbers.
    pub lost: u64,
    /// Delivered frames that were dropped because the consumer was too slow.
    pub dropped: u64,
    /// Delivered frames that were replaced by a later one of the same board, or too old, before they were merged.
    pub replaced: u64,
    /// Corrupt packets on its line.
    pub corrupt: u64,
    /// Restarts; frames lost right before a restart are not counted.
    pub restarts: u64,
    /// Times that it was unplugged.
    pub unplugs: u64,
    /// Relative error of its clock against this machine's, positive if fast, once known.
    pub drift: Option<f64>,
    /// Frames a second, Hz.
    pub rate_hz: Option<f64>,
}

impl BoardAccount {
    /// What messages call it, such as `board 3`.
    #[must_use]
    pub fn name(&self) -> String {
        self.limb.as_ref().map_or_else(|| format!("board {}", self.board), |key| format!("limb {key}"))
    }

    /// What became of its frames: `board` or `limb`, `port`, `state`, frames `sent`, `delivered`, `lost`, `dropped` and `replaced`,
    /// pieces that were `corrupt`, `restarts`, `unplugs`, the drift of its clock in `drift_ppm`, and `rate_hz`.
    #[must_use]
    pub fn as_json(&self) -> Value {
        let name = self.limb.as_ref().map_or_else(|| ("board", json!(self.board)), |key| ("limb", json!(key)));
        json!({
            (name.0): name.1,
            "port": self.port,
            "state": self.state.word(),
            "sent": self.delivered + self.lost,
            "delivered": self.delivered,
            "lost": self.lost,
            "dropped": self.dropped,
            "replaced": self.replaced,
            "corrupt": self.corrupt,
            "restarts": self.restarts,
            "unplugs": self.unplugs,
            "drift_ppm": self.drift.map(|drift| drift * 1e6),
            "rate_hz": self.rate_hz,
        })
    }
}

/// Percepts that a limb has computed.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct LimbPercepts {
    /// A line of NDJSON as percepts have it, with the limb's key as `limb` and its time as that of the lines, s.
    pub line: String,
    /// When it was read.
    pub read_at: Instant,
    /// The index of its account.
    #[cfg(feature = "zenoh")]
    pub(in crate::source) limb: usize,
}

/// A message about a line.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Notice {
    /// Time since the lines were opened, as in frames, s.
    pub at_s: f64,
    /// What happened: one line that begins with the port.
    pub text: String,
}

impl fmt::Display for Notice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:.2} s: {}", self.at_s, self.text)
    }
}

/// Access to the state of serial lines from any thread while they are read.
#[derive(Clone)]
pub struct Lines(pub(in crate::source) Arc<Shared>);

somatic_skin::debug_by_name!(Lines);

impl Lines {
    /// The potentiometers, one per channel, board by board in the order of the wiring.
    #[must_use]
    pub fn wipers(&self) -> Vec<Vec<ChannelWiper>> {
        self.0.lock().wipers.clone()
    }

    /// Requests `wiper` on a channel of the wiring's board at index `board`, now and after every restart of the board;
    /// [`Lines::wipers`] has the result. Does nothing if there is no such channel.
    pub fn set_wiper(&self, board: usize, channel: usize, wiper: u8) {
        let mut state = self.0.lock();
        if let Some(channel) = state.wipers.get_mut(board).and_then(|channels| channels.get_mut(channel)) {
            (channel.wanted, channel.trouble) = (Some(wiper), None);
        }
    }

    /// The notices since the last call.
    #[must_use]
    pub fn notices(&self) -> Vec<Notice> {
        self.0.lock().notices.drain(..).collect()
    }

    /// The percepts of limbs since the last call: in order for each limb; those of several in the order of their arrival.
    #[must_use]
    pub fn percepts(&self) -> Vec<LimbPercepts> {
        self.0.lock().percepts.drain(..).collect()
    }

    /// Has `wake` called whenever percepts of a limb come, on a thread that it must not hold up.
    pub fn on_percepts(&self, wake: impl Fn() + Send + Sync + 'static) {
        self.0.lock().wake = Some(Arc::new(wake));
    }

    /// One account per board, in the order of the wiring.
    #[must_use]
    pub fn accounts(&self) -> Vec<BoardAccount> {
        self.0.lock().accounts.clone()
    }

    /// Lost and dropped frames, a line for each board with any.
    #[must_use]
    pub fn losses(&self) -> Vec<String> {
        let losses = |account: &BoardAccount| {
            let sent = account.delivered + account.lost;
            let mut parts = Vec::new();
            if account.lost > 0 {
                parts.push(format!("{} of {sent} frames lost on the line", account.lost));
            }
            if account.dropped > 0 {
                parts.push(format!("{} of {sent} frames came faster than they were read", account.dropped));
            }
            (!parts.is_empty()).then(|| format!("{}: {}", account.name(), parts.join(", ")))
        };
        self.0.lock().accounts.iter().filter_map(losses).collect()
    }

    /// Ends the source: stops the boards that it started and closes the ports, waiting a limited time.
    pub fn close(&self) {
        let mut state = self.0.lock();
        state.closed = true;
        self.0.arrived.notify_all();
        self.0.closing.notify_all();
        let until = Instant::now() + CLOSE_TIMEOUT;
        while state.readers > 0
            && let Some(left) = until.checked_duration_since(Instant::now())
        {
            state = self.0.arrived.wait_timeout(state, left).unwrap_or_else(PoisonError::into_inner).0;
        }
    }
}

/// The result of looking for a board on a line.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::source) enum Verdict {
    Pending,
    /// A board of the wiring was found.
    Good,
    /// The line cannot be used.
    Bad(Error),
}

pub(in crate::source) struct State {
    pub(in crate::source) queue: VecDeque<(BoardFrame, Instant)>,
    pub(in crate::source) accounts: Vec<BoardAccount>,
    /// One per channel, board by board.
    pub(in crate::source) wipers: Vec<Vec<ChannelWiper>>,
    percepts: VecDeque<LimbPercepts>,
    /// Whom to tell of percepts.
    wake: Option<Arc<dyn Fn() + Send + Sync>>,
    start: Instant,
    notices: VecDeque<Notice>,
    verdicts: Vec<Verdict>,
    /// Per board, the line it was found on.
    owners: Vec<Option<usize>>,
    /// Per board, frames dropped since the last that was kept.
    gaps: Vec<u32>,
    pub(in crate::source) closed: bool,
    pub(in crate::source) readers: usize,
}

pub(in crate::source) struct Shared {
    state: Mutex<State>,
    pub(in crate::source) arrived: Condvar,
    /// The lines are closed.
    pub(in crate::source) closing: Condvar,
    lines: usize,
}

impl Shared {
    pub(in crate::source) fn of_boards(wiring: &Wiring, lines: usize, start: Instant) -> Self {
        let account = |board: u16| BoardAccount { board, ..BoardAccount::default() };
        let accounts = wiring.boards().iter().map(|board| account(board.id)).collect();
        Self::new(accounts, wipers::wanted(wiring), lines, start)
    }

    /// The state of whatever `accounts` stand for, with potentiometers or none, that `lines` readers read.
    pub(in crate::source) fn new(
        accounts: Vec<BoardAccount>,
        wipers: Vec<Vec<ChannelWiper>>,
        lines: usize,
        start: Instant,
    ) -> Self {
        let state = State {
            queue: VecDeque::new(),
            percepts: VecDeque::new(),
            wake: None,
            start,
            notices: VecDeque::new(),
            verdicts: vec![Verdict::Pending; lines],
            owners: vec![None; accounts.len()],
            gaps: vec![0; accounts.len()],
            wipers,
            accounts,
            closed: false,
            readers: lines,
        };
        Self { state: Mutex::new(state), arrived: Condvar::new(), closing: Condvar::new(), lines }
    }

    /// The same with another number of threads that read.
    #[cfg(feature = "zenoh")]
    pub(in crate::source) fn with_readers(self, readers: usize) -> Self {
        self.lock().readers = readers;
        self
    }

    /// Queues percepts that a limb has computed; drops the oldest if nobody takes them.
    #[cfg(feature = "zenoh")]
    pub(in crate::source) fn deliver_percepts(&self, percepts: LimbPercepts) {
        let mut state = self.lock();
        let account = &mut state.accounts[percepts.limb];
        account.delivered += 1;
        account.state = BoardState::Speaking;
        state.percepts.push_back(percepts);
        if state.percepts.len() > MAX_QUEUED_PERCEPTS
            && let Some(oldest) = state.percepts.pop_front()
        {
            state.accounts[oldest.limb].dropped += 1;
        }
        let wake = state.wake.clone();
        drop(state);
        if let Some(wake) = wake {
            wake();
        }
    }

    pub(in crate::source) fn lock(&self) -> MutexGuard<'_, State> {
        // A thread that panicked has left the state valid.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Queues `frame`; drops the oldest one if the queue is full.
    pub(in crate::source) fn deliver(&self, frame: BoardFrame, read_at: Instant) {
        let mut state = self.lock();
        let account = &mut state.accounts[frame.board];
        account.delivered += 1;
        account.state = BoardState::Speaking;
        state.queue.push_back((frame, read_at));
        if state.queue.len() > MAX_QUEUED_FRAMES * self.lines
            && let Some((oldest, _)) = state.queue.pop_front()
        {
            state.accounts[oldest.board].dropped += 1;
            // The next frame of this board must count the dropped one as lost before it.
            let gap = oldest.lost + 1;
            match state.queue.iter_mut().find(|(frame, _)| frame.board == oldest.board) {
                Some((next, _)) => {
                    next.lost += gap;
                    next.restarted |= oldest.restarted;
                }
                None => state.gaps[oldest.board] += gap,
            }
        }
        drop(state);
        self.arrived.notify_all();
    }
}

impl State {
    /// The next channel of `board` to set, and its wiper.
    pub(in crate::source) fn next_wiper(&self, board: usize) -> Option<(u16, u8)> {
        (0..).zip(&self.wipers[board]).find_map(|(channel, wiper)| Some((channel, wiper.due()?)))
    }

    /// Stops requesting wipers of `board`. Returns the number of channels without the requested wiper.
    pub(in crate::source) fn abandon_wipers(&mut self, board: usize, why: WiperTrouble) -> usize {
        let due = self.wipers[board].iter_mut().filter(|wiper| wiper.due().is_some());
        due.map(|wiper| wiper.trouble = Some(why)).count()
    }

    pub(in crate::source) fn take(&mut self) -> Option<(BoardFrame, Instant)> {
        let (mut frame, read_at) = self.queue.pop_front()?;
        frame.lost += std::mem::take(&mut self.gaps[frame.board]);
        Some((frame, read_at))
    }

    pub(in crate::source) fn notify(&mut self, text: String) {
        if self.notices.len() < MAX_NOTICES {
            self.notices.push_back(Notice { at_s: self.start.elapsed().as_secs_f64(), text });
        }
    }

    /// Assigns `board` to the line `line`. Returns the line that has it already, if another does.
    pub(in crate::source) fn claim(&mut self, board: usize, line: usize) -> Option<usize> {
        let owner = self.owners[board].get_or_insert(line);
        (*owner != line).then_some(*owner)
    }

    pub(in crate::source) fn release(&mut self, line: usize) {
        self.owners.iter_mut().filter(|owner| **owner == Some(line)).for_each(|owner| *owner = None);
    }

    /// Sets the result of a line. An error gives a notice, unless it ends the source.
    pub(in crate::source) fn set_verdict(&mut self, line: usize, verdict: Verdict) {
        if self.verdicts[line] != Verdict::Good {
            self.verdicts[line] = verdict.clone();
        }
        let ends_all = self.verdicts.len() == 1 && self.verdicts[line] != Verdict::Good;
        if let Verdict::Bad(error) = verdict
            && !ends_all
        {
            self.notify(error.to_string());
        }
    }

    /// The error that ends the source, if no line can be used.
    pub(in crate::source) fn fatal_error(&self) -> Option<Error> {
        let bad = self.verdicts.iter().filter(|verdict| matches!(verdict, Verdict::Bad(_))).count();
        match &self.verdicts[..] {
            [Verdict::Bad(error)] => Some(error.clone()),
            all if bad == all.len() => Some(failed!("none of {bad} lines can be used")),
            _ => None,
        }
    }
}
