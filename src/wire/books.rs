//! What became of the frames that boards sent: sequence numbers reconciled, clocks unwrapped.

use std::collections::BTreeMap;

use super::decode::Event;
use super::format::Head;

/// Where a packet stands among those of its board.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Placed {
    /// The board's clock at this packet, µs, counted on over 2³² µs (71.6 min). It begins with the first packet heard
    /// from the board, and anew when the board starts again. A silence of more than half of 2³² µs is not told from a
    /// shorter one.
    pub time_us: u64,
    /// Frames that the board sent before this packet, after the last that came, and that did not come.
    pub lost: u32,
    /// Whether the board has started again since its last packet. What it sent before and did not come is not known.
    pub restarted: bool,
}

/// The count of one board's frames.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Account {
    /// Frames that came intact.
    pub intact: u64,
    /// Frames that were sent and did not come, by their sequence numbers.
    pub lost: u64,
    /// Times that the board started again.
    pub restarts: u64,
    boot: u8,
    /// The number of the next frame.
    next: u32,
    time_us: u64,
}

/// One account a board.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Books {
    accounts: BTreeMap<u16, Account>,
}

impl Books {
    /// Boards that have been heard, and their accounts.
    pub fn accounts(&self) -> impl Iterator<Item = (u16, &Account)> {
        self.accounts.iter().map(|(&board, account)| (board, account))
    }

    /// The account of `board`, if it has been heard.
    #[must_use]
    pub fn account(&self, board: u16) -> Option<&Account> {
        self.accounts.get(&board)
    }

    /// Fills in where `event` stands.
    pub(super) fn enter<'a>(&mut self, mut event: Event<'a>) -> Event<'a> {
        match &mut event {
            Event::Frame { head, placed, .. } => *placed = self.place(head, true),
            Event::Identity { head, placed, .. } | Event::Answer { head, placed, .. } => {
                *placed = self.place(head, false);
            }
            Event::Command { .. } | Event::Corrupt { .. } => {}
        }
        event
    }

    fn place(&mut self, head: &Head, is_frame: bool) -> Placed {
        let after = head.sequence.wrapping_add(u32::from(is_frame));
        let account = self.accounts.entry(head.board).or_insert_with(|| Account {
            boot: head.boot,
            next: head.sequence,
            time_us: head.time_us.into(),
            ..Account::default()
        });
        let ahead = head.sequence.wrapping_sub(account.next);
        // A number that goes back is a start, too: a board may not have another boot number to give.
        let restarted = head.boot != account.boot || ahead > u32::MAX / 2;
        let lost = if restarted { head.sequence } else { ahead };
        let time_us = if restarted {
            head.time_us.into()
        } else {
            let forward = head.time_us.wrapping_sub(account.time_us as u32);
            // Packets are in order, but a clock read before a command was answered may be a little behind the answer's.
            if forward > u32::MAX / 2 {
                account.time_us.saturating_sub(forward.wrapping_neg().into())
            } else {
                account.time_us + u64::from(forward)
            }
        };
        account.boot = head.boot;
        account.next = after;
        account.time_us = time_us;
        account.restarts += u64::from(restarted);
        account.lost += u64::from(lost);
        account.intact += u64::from(is_frame);
        Placed { time_us, lost, restarted }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn head(boot: u8, sequence: u32, time_us: u32) -> Head {
        Head { board: 7, boot, sequence, time_us }
    }

    fn counts(books: &Books) -> (u64, u64, u64) {
        let account = books.account(7).unwrap();
        (account.intact, account.lost, account.restarts)
    }

    #[test]
    fn gaps_are_counted_and_starts_are_told_from_them() {
        let mut books = Books::default();
        assert_eq!(books.place(&head(1, 40, 0), true).lost, 0, "what was before listening is not lost");
        assert_eq!(books.place(&head(1, 41, 0), true).lost, 0);
        assert_eq!(books.place(&head(1, 45, 0), true).lost, 3);
        assert_eq!(books.place(&head(1, 48, 0), false).lost, 2, "an answer tells of frames, too");
        assert_eq!(books.place(&head(1, 48, 0), true).lost, 0);
        assert_eq!(counts(&books), (4, 5, 0));
        let placed = books.place(&head(2, 3, 9), true);
        assert_eq!((placed.restarted, placed.lost, placed.time_us), (true, 3, 9));
        assert!(books.place(&head(2, 0, 0), true).restarted, "the number went back");
        assert_eq!(counts(&books), (6, 8, 2));
    }

    #[test]
    fn sequence_and_clock_wrap() {
        let mut books = Books::default();
        books.place(&head(0, u32::MAX, u32::MAX - 10), true);
        let placed = books.place(&head(0, 1, 20), true);
        assert_eq!((placed.lost, placed.restarted), (1, false));
        assert_eq!(placed.time_us, (1 << 32) + 20);
        assert_eq!(books.place(&head(0, 2, 15), true).time_us, (1 << 32) + 15, "a step back is a step back");
    }
}
