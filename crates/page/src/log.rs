//! The log of events: the newest ones, numbered, in bounded memory.

use std::collections::VecDeque;

/// Events that are kept.
const CAPACITY: usize = 4096;

/// What an event is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EventKind {
    /// A touch begins, or a field is touched.
    Onset,
    /// A touch ends, or a field is no longer touched.
    Release,
    /// A board comes, goes, or loses frames.
    Board,
    /// Another message to the user.
    Notice,
}

impl EventKind {
    /// As messages spell it.
    pub(super) fn word(self) -> &'static str {
        match self {
            Self::Onset => "onset",
            Self::Release => "release",
            Self::Board => "board",
            Self::Notice => "notice",
        }
    }
}

/// What an event is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum About {
    /// The whole run.
    Run,
    /// A field.
    Field(u32),
    /// A touch of the whole body.
    Touch {
        /// Which one.
        id: u64,
        /// The link with most of it.
        link: u32,
    },
}

/// An event.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Event {
    /// Counts all events, from 1; given by the log.
    pub(super) seq: u64,
    pub(super) t_s: f64,
    pub(super) kind: EventKind,
    pub(super) about: About,
    /// Absent where the kind and what it is about say it.
    pub(super) text: Option<String>,
}

/// The newest events.
#[derive(Debug)]
pub(super) struct EventLog {
    events: VecDeque<Event>,
    newest: u64,
}

impl EventLog {
    pub(super) fn new() -> Self {
        Self { events: VecDeque::with_capacity(CAPACITY), newest: 0 }
    }

    /// Numbers `event` and keeps it, in place of the oldest where there are too many.
    pub(super) fn push(&mut self, event: Event) {
        if self.events.len() == CAPACITY {
            self.events.pop_front();
        }
        self.newest += 1;
        self.events.push_back(Event { seq: self.newest, ..event });
    }

    /// The newest event's number, 0 before there is any.
    pub(super) fn newest(&self) -> u64 {
        self.newest
    }

    /// The number before that of the oldest event that is kept.
    pub(super) fn forgotten(&self) -> u64 {
        self.newest - self.events.len() as u64
    }

    /// At most `most` events after number `seen`, and how many between are no longer known.
    pub(super) fn after(&self, seen: u64, most: usize) -> (u64, Vec<Event>) {
        // A number that was never given is of another log.
        let seen = if seen > self.newest { 0 } else { seen };
        let first = seen.max(self.forgotten());
        let skip = (first - self.forgotten()) as usize;
        (first - seen, self.events.iter().skip(skip).take(most).cloned().collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn event(t_s: f64) -> Event {
        Event { seq: 0, t_s, kind: EventKind::Onset, about: About::Field(1), text: None }
    }

    #[test]
    fn what_fell_out_is_counted() {
        let mut log = EventLog::new();
        assert_eq!(log.after(0, 10), (0, vec![]));
        for number in 0..CAPACITY + 10 {
            log.push(event(number as f64));
        }
        assert_eq!(log.newest(), CAPACITY as u64 + 10);
        let (lost, events) = log.after(0, 3);
        assert_eq!((lost, events.len(), events[0].seq, events[0].t_s), (10, 3, 11, 10.0));
        let (lost, events) = log.after(4, 1);
        assert_eq!((lost, events[0].seq), (6, 11));
        let (lost, events) = log.after(log.newest() - 2, 10);
        assert_eq!((lost, events.len()), (0, 2));
        assert_eq!(log.after(log.newest(), 10), (0, vec![]));
        assert_eq!(log.after(u64::MAX, 1).1[0].seq, 11, "a number of another run");
        assert_eq!(log.events.capacity().next_power_of_two(), CAPACITY);
    }
}
