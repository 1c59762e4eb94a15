//! Counts received and lost frames per board from sequence numbers, and unwraps the boards' clocks.

use std::collections::BTreeMap;

use super::format::Head;

/// A packet's time and losses relative to the earlier packets of its board.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PacketOrder {
    /// The board's clock at this packet, µs, unwrapped beyond 2³² µs (71.6 min) since the board's first packet or last
    /// restart. Gaps above half of 2³² µs are underestimated.
    pub time_us: u64,
    /// Frames lost between the previous packet and this one.
    pub lost: u32,
    /// Whether the board has restarted since its last packet; frames lost before the restart are not counted.
    pub restarted: bool,
}

/// Frame counts of one board.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BoardCounts {
    /// Frames received intact.
    pub intact: u64,
    /// Frames lost, from gaps in their sequence numbers.
    pub lost: u64,
    /// Restarts of the board.
    pub restarts: u64,
    boot: u8,
    /// Sequence number of the next frame.
    next: u32,
    time_us: u64,
}

/// Frame counts by board id.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct FrameCounts {
    boards: BTreeMap<u16, BoardCounts>,
}

impl FrameCounts {
    /// Boards that have sent packets, with their counts.
    pub fn boards(&self) -> impl Iterator<Item = (u16, &BoardCounts)> {
        self.boards.iter().map(|(&board, counts)| (board, counts))
    }

    /// The counts of `board`, if it has sent packets.
    #[must_use]
    pub fn board(&self, board: u16) -> Option<&BoardCounts> {
        self.boards.get(&board)
    }

    /// Counts a packet, which is a frame or not, and returns its order.
    pub fn count(&mut self, head: &Head, is_frame: bool) -> PacketOrder {
        let after = head.sequence.wrapping_add(u32::from(is_frame));
        let counts = self.boards.entry(head.board).or_insert_with(|| BoardCounts {
            boot: head.boot,
            next: head.sequence,
            time_us: head.time_us.into(),
            ..BoardCounts::default()
        });
        let ahead = head.sequence.wrapping_sub(counts.next);
        // A sequence number that goes back also is a restart: the boot number may not have changed.
        let restarted = head.boot != counts.boot || ahead > u32::MAX / 2;
        let lost = if restarted { head.sequence } else { ahead };
        let time_us = if restarted {
            head.time_us.into()
        } else {
            let forward = head.time_us.wrapping_sub(counts.time_us as u32);
            // Packets are in order, but a clock read before a command was answered may be a little behind the answer's.
            if forward > u32::MAX / 2 {
                counts.time_us.saturating_sub(forward.wrapping_neg().into())
            } else {
                counts.time_us + u64::from(forward)
            }
        };
        counts.boot = head.boot;
        counts.next = after;
        counts.time_us = time_us;
        counts.restarts += u64::from(restarted);
        counts.lost += u64::from(lost);
        counts.intact += u64::from(is_frame);
        PacketOrder { time_us, lost, restarted }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn head(boot: u8, sequence: u32, time_us: u32) -> Head {
        Head { board: 7, boot, sequence, time_us }
    }

    fn counts(frame_counts: &FrameCounts) -> (u64, u64, u64) {
        let counts = frame_counts.board(7).unwrap();
        (counts.intact, counts.lost, counts.restarts)
    }

    #[test]
    fn gaps_are_counted_and_distinguished_from_starts() {
        let mut frame_counts = FrameCounts::default();
        assert_eq!(frame_counts.count(&head(1, 40, 0), true).lost, 0, "what was before listening is not lost");
        assert_eq!(frame_counts.count(&head(1, 41, 0), true).lost, 0);
        assert_eq!(frame_counts.count(&head(1, 45, 0), true).lost, 3);
        assert_eq!(frame_counts.count(&head(1, 48, 0), false).lost, 2, "an answer tells of frames, too");
        assert_eq!(frame_counts.count(&head(1, 48, 0), true).lost, 0);
        assert_eq!(counts(&frame_counts), (4, 5, 0));
        let order = frame_counts.count(&head(2, 3, 9), true);
        assert_eq!((order.restarted, order.lost, order.time_us), (true, 3, 9));
        assert!(frame_counts.count(&head(2, 0, 0), true).restarted, "the number went back");
        assert_eq!(counts(&frame_counts), (6, 8, 2));
    }

    #[test]
    fn sequence_and_clock_wrap() {
        let mut frame_counts = FrameCounts::default();
        frame_counts.count(&head(0, u32::MAX, u32::MAX - 10), true);
        let order = frame_counts.count(&head(0, 1, 20), true);
        assert_eq!((order.lost, order.restarted), (1, false));
        assert_eq!(order.time_us, (1 << 32) + 20);
        assert_eq!(frame_counts.count(&head(0, 2, 15), true).time_us, (1 << 32) + 15, "a step back is a step back");
    }
}
