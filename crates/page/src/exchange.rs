//! What the engine's thread, the server's thread and a player share.

use std::collections::VecDeque;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, TryLockError};

use super::log::EventLog;
use super::series::{Series, Trail};
use super::snapshot::Snapshot;
use super::wake::Waker;
use crate::signal::BoardHealth;
use somatic_engine::scene::Plan;

/// Replies that wait for the server's thread at most.
const MAX_REPLIES: usize = 1024;
/// Rows of values that wait for the server's thread, before neighbours are merged.
pub(super) const WAITING_ROWS: usize = 4096;

/// A viewer, as long as it is connected.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ViewerId(pub(super) u64);

/// Locks are held only to swap or copy.
#[derive(Debug)]
pub(super) struct Exchange {
    shared: Mutex<Shared>,
    replies: Mutex<VecDeque<Reply>>,
    waker: Waker,
    viewers: AtomicUsize,
    /// Whether somebody plays, and answers requests.
    pub(super) has_player: AtomicBool,
    /// Whether somebody explains percepts, though nobody plays.
    pub(super) has_explainer: AtomicBool,
    /// Whether the server is to end.
    pub(super) stops: AtomicBool,
}

/// The newest frame and what belongs to it.
#[derive(Debug)]
pub(super) struct Shared {
    pub(super) snapshot: Box<Snapshot>,
    /// Whether the server has not yet taken it.
    pub(super) is_new: bool,
    pub(super) log: EventLog,
    /// What any viewer plots.
    pub(super) series: Arc<[Series]>,
    /// Of those.
    pub(super) trail: Trail,
    pub(super) boards: Option<Vec<BoardHealth>>,
    pub(super) ended: Option<String>,
}

/// A message of the player to one viewer, or to all.
#[derive(Debug)]
pub(super) struct Reply {
    pub(super) to: Option<ViewerId>,
    pub(super) message: Payload,
}

/// What a message holds.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Payload {
    Text(String),
    Binary(Vec<u8>),
}

impl Exchange {
    pub(super) fn new(plan: &Plan, waker: Waker) -> Self {
        let shared = Shared {
            snapshot: Box::new(Snapshot::new(plan)),
            is_new: false,
            log: EventLog::new(),
            series: Arc::default(),
            trail: Trail::default(),
            boards: None,
            ended: None,
        };
        Self {
            shared: Mutex::new(shared),
            replies: Mutex::default(),
            waker,
            viewers: AtomicUsize::new(0),
            has_player: AtomicBool::new(false),
            has_explainer: AtomicBool::new(false),
            stops: AtomicBool::new(false),
        }
    }

    pub(super) fn lock(&self) -> MutexGuard<'_, Shared> {
        self.shared.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The same, unless it would have to wait.
    pub(super) fn try_lock(&self) -> Option<MutexGuard<'_, Shared>> {
        match self.shared.try_lock() {
            Ok(shared) => Some(shared),
            Err(TryLockError::Poisoned(poisoned)) => Some(poisoned.into_inner()),
            Err(TryLockError::WouldBlock) => None,
        }
    }

    pub(super) fn waker(&self) -> &Waker {
        &self.waker
    }

    /// Wakes the server if a viewer waits for something.
    pub(super) fn wake_for_viewers(&self) {
        if self.viewers() > 0 {
            self.waker.wake();
        }
    }

    pub(super) fn viewers(&self) -> usize {
        self.viewers.load(Ordering::Relaxed)
    }

    pub(super) fn set_viewers(&self, viewers: usize) {
        self.viewers.store(viewers, Ordering::Relaxed);
    }

    pub(super) fn take_replies(&self) -> VecDeque<Reply> {
        std::mem::take(&mut *self.replies.lock().unwrap_or_else(PoisonError::into_inner))
    }

    fn reply(&self, to: Option<ViewerId>, message: Payload) {
        let mut replies = self.replies.lock().unwrap_or_else(PoisonError::into_inner);
        if replies.len() == MAX_REPLIES {
            replies.pop_front();
        }
        replies.push_back(Reply { to, message });
        drop(replies);
        self.waker.wake();
    }
}

/// Sends messages of a player to viewers; they are those of the protocol, and sent in order. To a viewer that has gone they
/// go nowhere, and one that does not read is cut off.
#[derive(Clone, Debug)]
pub struct Replies(pub(super) Arc<Exchange>);

impl Replies {
    /// Sends a message of text to one viewer.
    pub fn text(&self, viewer: ViewerId, message: String) {
        self.0.reply(Some(viewer), Payload::Text(message));
    }

    /// Sends a binary message to one viewer.
    pub fn binary(&self, viewer: ViewerId, message: Vec<u8>) {
        self.0.reply(Some(viewer), Payload::Binary(message));
    }

    /// Sends a message of text to every viewer.
    pub fn all(&self, message: String) {
        self.0.reply(None, Payload::Text(message));
    }
}
