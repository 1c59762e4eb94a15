//! Sends commands to a board, with retries and timeouts. No I/O, no clock: the caller passes events and times in, and
//! sends the bytes that come out.

use std::collections::VecDeque;
use std::time::Duration;

use super::decode::Event;
use super::encode;
use super::format::{ANY_BOARD, Command, MAX_ENCODED_BYTES, Status};

/// Timeout and number of tries of a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RetryPolicy {
    /// Time between two tries.
    pub wait: Duration,
    /// Number of tries.
    pub tries: u32,
}

impl Default for RetryPolicy {
    /// Five tries, 300 ms apart: at 57600 baud an answer waits at most 20 ms for the frame being sent.
    fn default() -> Self {
        Self { wait: Duration::from_millis(300), tries: 5 }
    }
}

/// The result of a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// The board did it.
    Done {
        /// The value that is set now: the rate in mHz, the wiper, or 0.
        value: u32,
    },
    /// The board refused.
    Refused(Status),
    /// No answer came.
    Unanswered,
}

/// A finished request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Ended {
    /// The number that [`Dialogue::ask`] gave.
    pub ticket: u64,
    /// The command.
    pub command: Command,
    /// Its result.
    pub outcome: Outcome,
}

/// A queue of commands to a board, of at most [`Dialogue::MAX_WAITING`].
#[derive(Clone, Debug)]
pub struct Dialogue {
    board: u16,
    retry: RetryPolicy,
    waiting: VecDeque<(u64, Command)>,
    pending: Option<Pending>,
    request: u8,
    tickets: u64,
    bytes: Box<[u8; MAX_ENCODED_BYTES]>,
}

#[derive(Clone, Copy, Debug)]
struct Pending {
    ticket: u64,
    command: Command,
    request: u8,
    sent: u32,
    retry_at: Duration,
}

impl Dialogue {
    /// Maximum number of waiting commands.
    pub const MAX_WAITING: usize = 1024;

    /// A dialogue with `board`, or [`ANY_BOARD`]. The first request gets the number after `first`; a host that reconnects
    /// should pass another number than before, so that it does not mistake a late answer for a new one.
    #[must_use]
    pub fn new(board: u16, retry: RetryPolicy, first: u8) -> Self {
        let bytes = Box::new([0; MAX_ENCODED_BYTES]);
        Self { board, retry, waiting: VecDeque::new(), pending: None, request: first, tickets: 0, bytes }
    }

    /// Queues `command`. Returns its ticket, or `None` if the queue is full.
    pub fn ask(&mut self, command: Command) -> Option<u64> {
        if self.waiting.len() >= Self::MAX_WAITING {
            return None;
        }
        self.tickets += 1;
        self.waiting.push_back((self.tickets, command));
        Some(self.tickets)
    }

    /// Whether nothing waits and nothing is unanswered.
    #[must_use]
    pub fn is_idle(&self) -> bool {
        self.pending.is_none() && self.waiting.is_empty()
    }

    /// When [`Dialogue::send`] and [`Dialogue::give_up`] next have something to do, on the clock that they are given.
    #[must_use]
    pub fn due(&self) -> Option<Duration> {
        match &self.pending {
            Some(pending) => Some(pending.retry_at),
            None => (!self.waiting.is_empty()).then_some(Duration::ZERO),
        }
    }

    /// The bytes to send at `now`, if there are any.
    pub fn send(&mut self, now: Duration) -> Option<&[u8]> {
        let pending = match &mut self.pending {
            Some(pending) if now >= pending.retry_at && pending.sent < self.retry.tries => pending,
            Some(_) => return None,
            none => {
                let (ticket, command) = self.waiting.pop_front()?;
                // 0 marks unrequested packets.
                self.request = self.request.checked_add(1).unwrap_or(1);
                none.insert(Pending { ticket, command, request: self.request, sent: 0, retry_at: now })
            }
        };
        pending.sent += 1;
        pending.retry_at = now + self.retry.wait;
        let length = encode::command(&mut self.bytes[..], self.board, pending.request, pending.command)?;
        Some(&self.bytes[..length])
    }

    /// Ends the pending request if its last try has timed out at `now`.
    pub fn give_up(&mut self, now: Duration) -> Option<Ended> {
        let timed_out = |pending: &mut Pending| pending.sent >= self.retry.tries && now >= pending.retry_at;
        let Pending { ticket, command, .. } = self.pending.take_if(timed_out)?;
        Some(Ended { ticket, command, outcome: Outcome::Unanswered })
    }

    /// Handles `event`, which may answer the pending request.
    pub fn receive(&mut self, event: &Event<'_>) -> Option<Ended> {
        let (board, request, kind, outcome) = match event {
            Event::Answer { head, answer, .. } => {
                let outcome = match answer.status {
                    Status::Done => Outcome::Done { value: answer.value },
                    refused => Outcome::Refused(refused),
                };
                (head.board, answer.request, answer.command, outcome)
            }
            Event::Identity { head, identity, .. } => {
                (head.board, identity.request, Command::Identify.kind(), Outcome::Done { value: 0 })
            }
            _ => return None,
        };
        let ours = self.board == ANY_BOARD || self.board == board;
        let answers = |pending: &mut Pending| ours && pending.request == request && pending.command.kind() == kind;
        let Pending { ticket, command, .. } = self.pending.take_if(answers)?;
        Some(Ended { ticket, command, outcome })
    }
}

#[cfg(test)]
mod tests {
    use super::super::format::{Answer, Head};
    use super::super::frame_counts::PacketOrder;
    use super::*;

    const PATIENCE: RetryPolicy = RetryPolicy { wait: Duration::from_millis(100), tries: 3 };

    fn answer(board: u16, request: u8, command: Command, status: Status) -> Event<'static> {
        let head = Head { board, boot: 0, sequence: 0, time_us: 0 };
        let answer = Answer { request, command: command.kind(), status, value: 5 };
        Event::Answer { head, order: PacketOrder::default(), answer }
    }

    fn at(ms: u64) -> Duration {
        Duration::from_millis(ms)
    }

    #[test]
    fn a_command_is_sent_again_until_it_is_answered_and_the_next_waits() {
        let mut dialogue = Dialogue::new(7, PATIENCE, 254);
        assert!(dialogue.due().is_none() && dialogue.send(at(0)).is_none());
        let first = dialogue.ask(Command::Start).unwrap();
        let second = dialogue.ask(Command::Stop).unwrap();
        let sent = dialogue.send(at(0)).unwrap().to_vec();
        assert_eq!(dialogue.send(at(99)), None);
        assert_eq!(dialogue.due(), Some(at(100)));
        assert_eq!(dialogue.send(at(100)), Some(&sent[..]), "the same request");
        for other in [
            answer(8, 255, Command::Start, Status::Done),
            answer(7, 254, Command::Start, Status::Done),
            answer(7, 255, Command::Stop, Status::Done),
        ] {
            assert_eq!(dialogue.receive(&other), None);
        }
        let ended = dialogue.receive(&answer(7, 255, Command::Start, Status::Done)).unwrap();
        assert_eq!((ended.ticket, ended.outcome), (first, Outcome::Done { value: 5 }));
        assert_eq!(dialogue.receive(&answer(7, 255, Command::Start, Status::Done)), None, "once is enough");
        assert_ne!(dialogue.send(at(101)).unwrap(), sent);
        let ended = dialogue.receive(&answer(7, 1, Command::Stop, Status::Bad)).unwrap();
        assert_eq!((ended.ticket, ended.outcome), (second, Outcome::Refused(Status::Bad)), "0 is not a request");
        assert!(dialogue.is_idle());
    }

    #[test]
    fn what_is_never_answered_is_given_up_after_its_last_wait() {
        let mut dialogue = Dialogue::new(ANY_BOARD, PATIENCE, 0);
        dialogue.ask(Command::Identify).unwrap();
        let mut sent = 0;
        for ms in (0..=300).step_by(10) {
            assert_eq!((sent == 3 && ms == 300, dialogue.is_idle()), (ms == 300, false));
            match dialogue.give_up(at(ms)) {
                Some(ended) => assert_eq!((ms, ended.outcome), (300, Outcome::Unanswered)),
                None => sent += u32::from(dialogue.send(at(ms)).is_some()),
            }
        }
        assert!(dialogue.is_idle());
        assert!((0..Dialogue::MAX_WAITING).all(|_| dialogue.ask(Command::Start).is_some()));
        assert_eq!(dialogue.ask(Command::Start), None, "too many");
    }
}
