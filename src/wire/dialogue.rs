//! What the host asks of a board: numbered, sent again until answered, given up in the end. No I/O, no clock: bytes to
//! send come out, events and the time go in.

use std::collections::VecDeque;
use std::time::Duration;

use super::decode::Event;
use super::encode;
use super::format::{ANY_BOARD, Command, MOST_ON_LINE, Status};

/// How long an answer is waited for, and how often a command is sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Patience {
    /// From sending to sending again.
    pub wait: Duration,
    /// Times that it is sent in all.
    pub tries: u32,
}

impl Default for Patience {
    /// Five times, 300 ms apart: at 57600 baud an answer waits for at most one frame, 20 ms.
    fn default() -> Self {
        Self { wait: Duration::from_millis(300), tries: 5 }
    }
}

/// How a request ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// The board did it; what is set now (0 where there is nothing to set).
    Done {
        /// The rate in thousandths of a hertz, the tap, or 0.
        value: u32,
    },
    /// The board would not.
    Refused(Status),
    /// No answer came.
    Unanswered,
}

/// A request that has ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Ended {
    /// The number that [`Dialogue::ask`] gave.
    pub ticket: u64,
    /// What was asked.
    pub command: Command,
    /// How it ended.
    pub outcome: Outcome,
}

/// The commands that wait: more than [`Dialogue::MOST`] are refused.
#[derive(Clone, Debug)]
pub struct Dialogue {
    board: u16,
    patience: Patience,
    waiting: VecDeque<(u64, Command)>,
    asked: Option<Asked>,
    request: u8,
    tickets: u64,
    bytes: Box<[u8; MOST_ON_LINE]>,
}

#[derive(Clone, Copy, Debug)]
struct Asked {
    ticket: u64,
    command: Command,
    request: u8,
    sent: u32,
    again_at: Duration,
}

impl Dialogue {
    /// Commands that may wait at once.
    pub const MOST: usize = 1024;

    /// A dialogue with `board`, or [`ANY_BOARD`]. `first` is the number before that of the first request: a host that
    /// comes again should begin elsewhere than it did before, so that no late answer is taken for a new one.
    #[must_use]
    pub fn new(board: u16, patience: Patience, first: u8) -> Self {
        let bytes = Box::new([0; MOST_ON_LINE]);
        Self { board, patience, waiting: VecDeque::new(), asked: None, request: first, tickets: 0, bytes }
    }

    /// Whom it speaks to from now on.
    pub fn speak_to(&mut self, board: u16) {
        self.board = board;
    }

    /// Asks for `command` when those before are done; gives its ticket, or `None` where too many wait.
    pub fn ask(&mut self, command: Command) -> Option<u64> {
        if self.waiting.len() >= Self::MOST {
            return None;
        }
        self.tickets += 1;
        self.waiting.push_back((self.tickets, command));
        Some(self.tickets)
    }

    /// Whether nothing waits and nothing is unanswered.
    #[must_use]
    pub fn is_idle(&self) -> bool {
        self.asked.is_none() && self.waiting.is_empty()
    }

    /// When [`Dialogue::send`] and [`Dialogue::give_up`] next have something to do, on the clock that they are given.
    #[must_use]
    pub fn due(&self) -> Option<Duration> {
        match &self.asked {
            Some(asked) => Some(asked.again_at),
            None => (!self.waiting.is_empty()).then_some(Duration::ZERO),
        }
    }

    /// The bytes to send at `now`, if there are any.
    pub fn send(&mut self, now: Duration) -> Option<&[u8]> {
        let asked = match &mut self.asked {
            Some(asked) if now >= asked.again_at && asked.sent < self.patience.tries => asked,
            Some(_) => return None,
            none => {
                let (ticket, command) = self.waiting.pop_front()?;
                // 0 is what boards say unasked.
                self.request = self.request.checked_add(1).unwrap_or(1);
                none.insert(Asked { ticket, command, request: self.request, sent: 0, again_at: now })
            }
        };
        asked.sent += 1;
        asked.again_at = now + self.patience.wait;
        let length = encode::command(&mut self.bytes[..], self.board, asked.request, asked.command)?;
        Some(&self.bytes[..length])
    }

    /// Gives up at `now` what has been asked often enough.
    pub fn give_up(&mut self, now: Duration) -> Option<Ended> {
        let over = |asked: &mut Asked| asked.sent >= self.patience.tries && now >= asked.again_at;
        let Asked { ticket, command, .. } = self.asked.take_if(over)?;
        Some(Ended { ticket, command, outcome: Outcome::Unanswered })
    }

    /// Hears `event`, which may answer what was asked.
    pub fn hear(&mut self, event: &Event<'_>) -> Option<Ended> {
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
        let answers = |asked: &mut Asked| ours && asked.request == request && asked.command.kind() == kind;
        let Asked { ticket, command, .. } = self.asked.take_if(answers)?;
        Some(Ended { ticket, command, outcome })
    }
}

#[cfg(test)]
mod tests {
    use super::super::books::Placed;
    use super::super::format::{Answer, Head};
    use super::*;

    const PATIENCE: Patience = Patience { wait: Duration::from_millis(100), tries: 3 };

    fn answer(board: u16, request: u8, command: Command, status: Status) -> Event<'static> {
        let head = Head { board, boot: 0, sequence: 0, time_us: 0 };
        let answer = Answer { request, command: command.kind(), status, value: 5 };
        Event::Answer { head, placed: Placed::default(), answer }
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
            assert_eq!(dialogue.hear(&other), None);
        }
        let ended = dialogue.hear(&answer(7, 255, Command::Start, Status::Done)).unwrap();
        assert_eq!((ended.ticket, ended.outcome), (first, Outcome::Done { value: 5 }));
        assert_eq!(dialogue.hear(&answer(7, 255, Command::Start, Status::Done)), None, "once is enough");
        assert_ne!(dialogue.send(at(101)).unwrap(), sent);
        let ended = dialogue.hear(&answer(7, 1, Command::Stop, Status::Bad)).unwrap();
        assert_eq!((ended.ticket, ended.outcome), (second, Outcome::Refused(Status::Bad)), "0 is no request");
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
        assert!((0..Dialogue::MOST).all(|_| dialogue.ask(Command::Start).is_some()));
        assert_eq!(dialogue.ask(Command::Start), None, "too many");
    }
}
