//! Carries what a sink is given on a thread of its own, so that a network that blocks never blocks percepts.
//!
//! Items wait in a bounded queue. If it is full, the newest replaces the oldest. Dropped items are counted, and reported
//! when the first is dropped and at the end.

use std::collections::VecDeque;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use crate::error::{Error, Result, failed};

/// Items that are dropped within this time of each other are reported once.
const QUIET: Duration = Duration::from_secs(10);

/// Brings items to where they go, on the thread of a [`Handover`]. It may block.
pub(crate) trait Carrier<T>: Send + 'static {
    /// Sends `item`.
    ///
    /// # Errors
    /// No further item can be sent either.
    fn carry(&mut self, item: &T) -> Result<()>;

    /// Sends what it has held back. Nothing comes after it.
    ///
    /// # Errors
    /// As [`Carrier::carry`].
    fn end(&mut self) -> Result<()> {
        Ok(())
    }
}

/// What became of the items.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Handed {
    /// Items that were handed over.
    pub(crate) given: u64,
    /// Items that newer ones replaced, or that were still waiting at the end.
    pub(crate) left_out: u64,
}

/// The queue between the engine's thread and a carrier's. In the steady state handing over does not allocate: items that have
/// been carried are filled again.
pub(crate) struct Handover<T> {
    shared: Arc<Shared<T>>,
    name: String,
    what: &'static str,
    room: usize,
    handed: Handed,
    last_left_out: Option<Instant>,
}

struct Shared<T> {
    state: Mutex<State<T>>,
    /// Something waits, or the end has been asked for.
    wake: Condvar,
    /// The thread has ended.
    ended: Condvar,
}

struct State<T> {
    waiting: VecDeque<T>,
    spare: Vec<T>,
    is_closing: bool,
    /// How the thread ended.
    outcome: Option<Result<()>>,
}

impl<T> Shared<T> {
    fn lock(&self) -> MutexGuard<'_, State<T>> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl<T: Default + Send + 'static> Handover<T> {
    /// Starts a thread on which `carrier` sends items. Up to `room` of them wait. Messages call the sink `name`, and the items
    /// `what`, such as `frames`.
    ///
    /// # Errors
    /// The system gives no thread.
    pub(crate) fn start(name: &str, what: &'static str, room: usize, carrier: impl Carrier<T>) -> Result<Self> {
        let state =
            State { waiting: VecDeque::with_capacity(room), spare: Vec::new(), is_closing: false, outcome: None };
        let shared = Arc::new(Shared { state: Mutex::new(state), wake: Condvar::new(), ended: Condvar::new() });
        let theirs = Ended(Arc::clone(&shared));
        thread::Builder::new()
            .name("sink".to_owned())
            .spawn(move || {
                keep_out_of_the_way();
                let outcome = carry_all(&theirs.0, carrier);
                theirs.0.lock().outcome = Some(outcome);
            })
            .map_err(|e| failed!("the thread of the sink did not start: {e}; end other programs").at(name))?;
        let handed = Handed::default();
        Ok(Self { shared, name: name.to_owned(), what, room: room.max(1), handed, last_left_out: None })
    }

    /// Hands over an item that `fill` makes of an older one, whatever that holds. It never waits for the carrier.
    ///
    /// # Errors
    /// The carrier has failed.
    pub(crate) fn hand_over(&mut self, fill: impl FnOnce(&mut T)) -> Result<()> {
        let mut state = self.shared.lock();
        if let Some(outcome) = &state.outcome {
            let failure = outcome.clone().err();
            return Err(
                failure.unwrap_or_else(|| Error::failed("the sink has ended; start the run again").at(&self.name))
            );
        }
        let mut item = state.spare.pop().unwrap_or_default();
        drop(state);
        fill(&mut item);
        self.handed.given += 1;
        let mut state = self.shared.lock();
        let oldest = if state.waiting.len() >= self.room { state.waiting.pop_front() } else { None };
        let is_full = oldest.is_some();
        state.spare.extend(oldest);
        state.waiting.push_back(item);
        drop(state);
        self.shared.wake.notify_one();
        if is_full {
            self.leave_out();
        }
        Ok(())
    }

    /// Counts an item that gave way, and tells of it unless that was done shortly before.
    fn leave_out(&mut self) {
        self.handed.left_out += 1;
        let now = Instant::now();
        if self.last_left_out.replace(now).is_none_or(|last| now - last > QUIET) {
            tell(&format!(
                "{}: {} come faster than they can be sent; older ones are left out; --speed 1 gives a \
                 recording its own pace",
                self.name, self.what
            ));
        }
    }

    /// What became of the items so far.
    #[cfg(test)]
    pub(crate) fn handed(&self) -> Handed {
        self.handed
    }

    /// Has all that waits sent, for at most `within`; then tells how many items were left out.
    ///
    /// # Errors
    /// The carrier has failed.
    pub(crate) fn finish(mut self, within: Duration) -> Result<Handed> {
        let mut state = self.shared.lock();
        state.is_closing = true;
        self.shared.wake.notify_one();
        let (mut state, _) = self
            .shared
            .ended
            .wait_timeout_while(state, within, |state| state.outcome.is_none())
            .unwrap_or_else(PoisonError::into_inner);
        // A carrier that is blocked for good finds nothing more to do if it ever goes on.
        let waiting = state.waiting.drain(..).count();
        let outcome = state.outcome.take();
        let is_stuck = outcome.is_none();
        drop(state);
        self.handed.left_out += waiting as u64;
        outcome.unwrap_or(Ok(()))?;
        let Handed { given, left_out } = self.handed;
        if left_out > 0 {
            tell(&format!("{}: {left_out} of {given} {} were left out", self.name, self.what));
        } else if is_stuck {
            tell(&format!("{}: the last of {given} {} were not sent within {within:?}", self.name, self.what));
        }
        Ok(self.handed)
    }
}

impl<T> Drop for Handover<T> {
    fn drop(&mut self) {
        self.shared.lock().is_closing = true;
        self.shared.wake.notify_one();
    }
}

/// Tells, when it goes, that the thread has ended: also where that panicked.
struct Ended<T>(Arc<Shared<T>>);

impl<T> Drop for Ended<T> {
    fn drop(&mut self) {
        self.0.lock().outcome.get_or_insert_with(|| Err(Error::failed("the thread that sends has failed")));
        self.0.ended.notify_all();
    }
}

/// Lets the calling thread run beside the engine's, but not in its place. Woken on the engine's core, it would otherwise take the
/// engine's turn at once: measured, that was 20 of the 22 µs which handing a limb's frame over took, and the sending itself took
/// twice as long. A policy that somebody has chosen for this process stays as it is.
#[cfg(target_os = "linux")]
fn keep_out_of_the_way() {
    let no_priority = libc::sched_param { sched_priority: 0 };
    #[expect(unsafe_code, reason = "the system has no other way, and rustix does not have this call")]
    // SAFETY: 0 is the calling thread, and the call only reads what it is pointed at. Where it fails, all stays as it was.
    unsafe {
        if libc::sched_getscheduler(0) == libc::SCHED_OTHER {
            libc::sched_setscheduler(0, libc::SCHED_BATCH, &raw const no_priority);
        }
    }
}

#[cfg(not(target_os = "linux"))]
fn keep_out_of_the_way() {}

fn carry_all<T>(shared: &Shared<T>, mut carrier: impl Carrier<T>) -> Result<()> {
    loop {
        let state = shared.lock();
        let mut state = shared
            .wake
            .wait_while(state, |state| state.waiting.is_empty() && !state.is_closing)
            .unwrap_or_else(PoisonError::into_inner);
        let Some(item) = state.waiting.pop_front() else { break };
        drop(state);
        carrier.carry(&item)?;
        shared.lock().spare.push(item);
    }
    carrier.end()
}

/// Tells people something. A closed standard error is not a reason to stop.
pub(crate) fn tell(line: &str) {
    crate::plain::say(line);
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc::{Receiver, Sender, channel};

    use super::*;

    const LONG: Duration = Duration::from_secs(20);

    /// Sends each item on when it is let.
    struct Gate {
        lets: Receiver<()>,
        sent: Sender<u32>,
    }

    impl Carrier<u32> for Gate {
        fn carry(&mut self, item: &u32) -> Result<()> {
            let _ = self.lets.recv();
            self.sent.send(*item).unwrap();
            if *item == 99 { Err(Error::failed("no route")) } else { Ok(()) }
        }

        fn end(&mut self) -> Result<()> {
            self.sent.send(1000).unwrap();
            Ok(())
        }
    }

    fn gate(room: usize) -> (Handover<u32>, Sender<()>, Receiver<u32>) {
        let ((open, lets), (sent, got)) = (channel(), channel());
        (Handover::start("sink `test`", "frames", room, Gate { lets, sent }).unwrap(), open, got)
    }

    #[test]
    fn everything_arrives_in_order_where_nothing_blocks() {
        let (mut handover, open, got) = gate(64);
        for item in 0..50 {
            open.send(()).unwrap();
            handover.hand_over(|to| *to = item).unwrap();
        }
        assert_eq!(handover.finish(LONG).unwrap(), Handed { given: 50, left_out: 0 });
        let expected: Vec<u32> = (0..50).chain([1000]).collect();
        assert_eq!(got.iter().collect::<Vec<_>>(), expected);
    }

    #[test]
    fn the_newest_win_where_the_carrier_blocks_and_nobody_waits() {
        let (mut handover, open, got) = gate(4);
        handover.hand_over(|to| *to = 7).unwrap();
        // The carrier has taken the first, and blocks with it.
        while !handover.shared.lock().waiting.is_empty() {
            thread::yield_now();
        }
        let begin = Instant::now();
        for item in 10..30 {
            handover.hand_over(|to| *to = item).unwrap();
        }
        assert!(begin.elapsed() < Duration::from_secs(5), "it waited for the carrier");
        assert_eq!(handover.handed(), Handed { given: 21, left_out: 16 });
        (0..5).for_each(|_| open.send(()).unwrap());
        assert_eq!(handover.finish(LONG).unwrap(), Handed { given: 21, left_out: 16 });
        assert_eq!(got.iter().collect::<Vec<_>>(), [7, 26, 27, 28, 29, 1000]);
    }

    #[test]
    fn the_end_does_not_wait_for_ever() {
        let (mut handover, open, _got) = gate(4);
        for item in 0..3 {
            handover.hand_over(|to| *to = item).unwrap();
        }
        while handover.shared.lock().waiting.len() > 2 {
            thread::yield_now();
        }
        let handed = handover.finish(Duration::from_millis(50)).unwrap();
        assert_eq!(handed, Handed { given: 3, left_out: 2 });
        drop(open);
    }

    #[test]
    fn a_carrier_that_fails_is_reported_with_the_next_item() {
        let (mut handover, open, _got) = gate(4);
        open.send(()).unwrap();
        handover.hand_over(|to| *to = 99).unwrap();
        // Not before it has been taken: it would give way to the next.
        while !handover.shared.lock().waiting.is_empty() {
            thread::yield_now();
        }
        let begin = Instant::now();
        let error = loop {
            match handover.hand_over(|to| *to = 1) {
                Ok(()) => assert!(begin.elapsed() < LONG, "it goes on"),
                Err(error) => break error,
            }
        };
        assert_eq!(error.to_string(), "no route");
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn the_thread_that_sends_does_not_take_the_engine_s_turn() {
        struct Policy(Sender<String>);
        impl Carrier<u32> for Policy {
            fn carry(&mut self, _: &u32) -> Result<()> {
                self.0.send(std::fs::read_to_string("/proc/thread-self/stat").unwrap()).unwrap();
                Ok(())
            }
        }
        // proc(5): the policy is the 41st number, the name before the third may hold spaces.
        let policy = |stat: &str| stat.rsplit_once(')').unwrap().1.split_whitespace().nth(38).unwrap().to_owned();
        let own = policy(&std::fs::read_to_string("/proc/thread-self/stat").unwrap());
        let (sent, got) = channel();
        let mut handover = Handover::start("sink `test`", "frames", 2, Policy(sent)).unwrap();
        handover.hand_over(|to| *to = 1).unwrap();
        // 0 is SCHED_OTHER, 3 SCHED_BATCH.
        assert_eq!(policy(&got.recv_timeout(LONG).unwrap()), if own == "0" { "3" } else { &own });
    }

    #[test]
    fn items_are_filled_again() {
        struct Keep;
        impl Carrier<Vec<u8>> for Keep {
            fn carry(&mut self, _: &Vec<u8>) -> Result<()> {
                Ok(())
            }
        }
        let mut handover = Handover::start("sink `test`", "frames", 2, Keep).unwrap();
        handover.hand_over(|to| to.reserve(4096)).unwrap();
        while handover.shared.lock().spare.is_empty() {
            thread::yield_now();
        }
        handover.hand_over(|to| assert!(to.capacity() >= 4096)).unwrap();
    }
}
