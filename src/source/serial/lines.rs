//! What reading threads and the reader of frames share, and what anyone may know of the lines.

use std::collections::VecDeque;
use std::fmt;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use super::merge::BoardFrame;
use super::taps::{self, ChannelTap};
use crate::error::Error;
use crate::signal::Wiring;

/// Frames of boards that wait at most, a line.
const MOST_WAITING: usize = 64;
/// Things said that wait at most for somebody who wants to know.
const MOST_NOTICES: usize = 256;
/// How long lines may take to close.
const CLOSING: Duration = Duration::from_millis(300);

/// How a board is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum BoardState {
    /// Not heard yet.
    #[default]
    Awaited,
    /// It sends frames.
    Speaking,
    /// Its line is there, and no frame comes.
    Silent,
    /// Its port has gone.
    Unplugged,
}

impl BoardState {
    /// In a word.
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

/// What became of a board's frames since it was first known: it sent `delivered + lost`.
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct BoardAccount {
    /// Its id.
    pub board: u16,
    /// The port where it was heard last.
    pub port: Option<String>,
    /// Bits of its values, once it has said so.
    pub bits: Option<u8>,
    /// How it is.
    pub state: BoardState,
    /// Frames that came intact.
    pub delivered: u64,
    /// Frames that it sent and that did not come intact, by their sequence numbers.
    pub lost: u64,
    /// Of those delivered, how many nobody took in time: the oldest were left out.
    pub dropped: u64,
    /// Of those delivered, how many a later one of the same board replaced before a frame of the skin was put together.
    pub replaced: u64,
    /// Times that bytes on its line were no packet.
    pub corrupt: u64,
    /// Times that it started again. What it sent before and did not come then is not known.
    pub restarts: u64,
    /// Times that its port was gone.
    pub unplugs: u64,
    /// How much faster its clock runs than this machine's, as a part of one, once that is known.
    pub drift: Option<f64>,
    /// Frames a second, Hz.
    pub rate_hz: Option<f64>,
}

/// Something that is to be said of a line.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Notice {
    /// When it happened, s since the lines were opened: the clock of the frames.
    pub at_s: f64,
    /// What happened, one line that begins with the port.
    pub text: String,
}

impl fmt::Display for Notice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:.2} s: {}", self.at_s, self.text)
    }
}

/// What is to be known of serial lines while they are read, from any thread.
#[derive(Clone)]
pub struct Lines(pub(super) Arc<Shared>);

impl Lines {
    /// What was said since the last call.
    #[must_use]
    pub fn notices(&self) -> Vec<Notice> {
        self.0.lock().notices.drain(..).collect()
    }

    /// One account a board, in the order of the wiring.
    #[must_use]
    pub fn accounts(&self) -> Vec<BoardAccount> {
        self.0.lock().accounts.clone()
    }

    /// What arrived and was never processed, or was sent and did not arrive, a line for each board that this is so of.
    #[must_use]
    pub fn losses(&self) -> Vec<String> {
        let told = |account: &BoardAccount| {
            let sent = account.delivered + account.lost;
            let mut parts = Vec::new();
            if account.lost > 0 {
                parts.push(format!("{} of {sent} frames lost on the line", account.lost));
            }
            if account.dropped > 0 {
                parts.push(format!("{} of {sent} frames came faster than they were taken", account.dropped));
            }
            (!parts.is_empty()).then(|| format!("board {}: {}", account.board, parts.join(", ")))
        };
        self.0.lock().accounts.iter().filter_map(told).collect()
    }

    /// Ends the source: boards that were started are stopped, ports closed. Waits for that, but not for long.
    pub fn close(&self) {
        let mut state = self.0.lock();
        state.closed = true;
        self.0.arrived.notify_all();
        let until = Instant::now() + CLOSING;
        while state.readers > 0
            && let Some(left) = until.checked_duration_since(Instant::now())
        {
            state = self.0.arrived.wait_timeout(state, left).unwrap_or_else(PoisonError::into_inner).0;
        }
    }
}

/// What became of a line at the start.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Verdict {
    Pending,
    /// A board of the wiring has spoken on it.
    Good,
    /// It cannot be used as it is.
    Bad(Error),
}

pub(super) struct State {
    pub(super) queue: VecDeque<(BoardFrame, Instant)>,
    pub(super) accounts: Vec<BoardAccount>,
    /// One a channel, board by board.
    pub(super) taps: Vec<Vec<ChannelTap>>,
    start: Instant,
    notices: VecDeque<Notice>,
    verdicts: Vec<Verdict>,
    /// Per board, the line that it was heard on.
    owners: Vec<Option<usize>>,
    /// Per board, frames dropped since the last that was kept.
    gaps: Vec<u32>,
    pub(super) closed: bool,
    pub(super) readers: usize,
}

pub(super) struct Shared {
    state: Mutex<State>,
    pub(super) arrived: Condvar,
    lines: usize,
}

impl Shared {
    pub(super) fn new(wiring: &Wiring, lines: usize, start: Instant) -> Self {
        let account = |board: u16| BoardAccount { board, ..BoardAccount::default() };
        let accounts: Vec<_> = wiring.boards().iter().map(|board| account(board.id)).collect();
        let state = State {
            queue: VecDeque::new(),
            start,
            notices: VecDeque::new(),
            verdicts: vec![Verdict::Pending; lines],
            owners: vec![None; accounts.len()],
            gaps: vec![0; accounts.len()],
            taps: taps::wanted(wiring),
            accounts,
            closed: false,
            readers: lines,
        };
        Self { state: Mutex::new(state), arrived: Condvar::new(), lines }
    }

    pub(super) fn lock(&self) -> MutexGuard<'_, State> {
        // Whoever broke down left nothing half done.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Hands `frame` on. Where nobody takes frames, the oldest goes.
    pub(super) fn deliver(&self, frame: BoardFrame, read_at: Instant) {
        let mut state = self.lock();
        let account = &mut state.accounts[frame.board];
        account.delivered += 1;
        account.state = BoardState::Speaking;
        state.queue.push_back((frame, read_at));
        if state.queue.len() > MOST_WAITING * self.lines
            && let Some((oldest, _)) = state.queue.pop_front()
        {
            state.accounts[oldest.board].dropped += 1;
            // What comes next of this board must know that something is missing before it.
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
    /// The next frame of a board.
    pub(super) fn take(&mut self) -> Option<(BoardFrame, Instant)> {
        let (mut frame, read_at) = self.queue.pop_front()?;
        frame.lost += std::mem::take(&mut self.gaps[frame.board]);
        Some((frame, read_at))
    }

    pub(super) fn say(&mut self, text: String) {
        if self.notices.len() < MOST_NOTICES {
            self.notices.push_back(Notice { at_s: self.start.elapsed().as_secs_f64(), text });
        }
    }

    /// Takes `board` for the line `line`; the line that has it already, if another does.
    pub(super) fn claim(&mut self, board: usize, line: usize) -> Option<usize> {
        let owner = self.owners[board].get_or_insert(line);
        (*owner != line).then_some(*owner)
    }

    /// Gives back what `line` has claimed.
    pub(super) fn release(&mut self, line: usize) {
        self.owners.iter_mut().filter(|owner| **owner == Some(line)).for_each(|owner| *owner = None);
    }

    /// Notes what became of a line. A reason is said, except where it ends all.
    pub(super) fn judge(&mut self, line: usize, verdict: Verdict) {
        if self.verdicts[line] != Verdict::Good {
            self.verdicts[line] = verdict.clone();
        }
        let ends_all = self.verdicts.len() == 1 && self.verdicts[line] != Verdict::Good;
        if let Verdict::Bad(error) = verdict
            && !ends_all
        {
            self.say(error.to_string());
        }
    }

    /// The error that ends all, where no line can be used.
    pub(super) fn hopeless(&self) -> Option<Error> {
        let bad = self.verdicts.iter().filter(|verdict| matches!(verdict, Verdict::Bad(_))).count();
        match &self.verdicts[..] {
            [Verdict::Bad(error)] => Some(error.clone()),
            all if bad == all.len() => Some(Error::failed(format!("none of {bad} serial lines can be used"))),
            _ => None,
        }
    }
}
