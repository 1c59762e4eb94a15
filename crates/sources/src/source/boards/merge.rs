//! Merges the boards' frames into frames of the whole skin. No I/O, no clock: the caller passes host times, s.
//! A board is whatever numbers its frames and stamps them with a clock of its own: on a serial line, or a limb on a network.
//!
//! A channel's value is confirmed by a frame with it, or by a partial frame that omits it as unchanged, if no frame
//! was lost in between. Values that are too old are missing, values of a silent board are stale; neither is zero.

use std::sync::Arc;

use super::clock::Clock;
use crate::signal::{Frame, RawValue};
use crate::source::send_rate::{DEFAULT_PERIOD_S, TAKEOVER_SHARE, leader, max_age_s, updated_period_s, wait_s};

/// Period of frames without values while all boards are silent, s.
const SILENT_PERIOD_S: f64 = 0.1;

#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::source) enum Pace {
    /// At each frame of the fastest board.
    Fastest,
    /// At each frame of any board.
    Arrival,
    /// At regular times, this far apart, s.
    Every(f64),
}

#[derive(Clone, Debug)]
pub(in crate::source) struct BoardFrame {
    /// Index of the board in the wiring.
    pub(in crate::source) board: usize,
    /// The board's clock, unwrapped, µs.
    pub(in crate::source) board_us: u64,
    /// When its last byte was read, s.
    pub(in crate::source) arrived_s: f64,
    /// Frames before it that were lost.
    pub(in crate::source) lost: u32,
    /// Whether the board's clock has restarted.
    pub(in crate::source) restarted: bool,
    /// Whether omitted channels are unchanged.
    pub(in crate::source) partial: bool,
    /// Per channel the index in a frame's values, where the board itself tells what it has.
    pub(in crate::source) places: Option<Arc<[Option<usize>]>>,
    /// Channels with their values.
    pub(in crate::source) values: Vec<(u32, RawValue)>,
}

/// The last value of a channel.
#[derive(Clone, Copy)]
struct Known {
    value: RawValue,
    /// Time of the last frame that confirmed it, s.
    confirmed_s: f64,
    /// Whether no frame was lost since.
    sure: bool,
}

#[derive(Default)]
struct Board {
    /// Per channel, the index of its taxel in a frame's values.
    places: Arc<[Option<usize>]>,
    /// Per channel.
    known: Vec<Option<Known>>,
    clock: Clock,
    period_s: f64,
    /// When the last frame was read: board time, µs, and host time, s.
    last: Option<(u64, f64)>,
    /// When it arrived, s.
    arrived_s: f64,
    /// Whether its last frame is not merged yet.
    waiting: bool,
    replaced: u64,
}

impl Board {
    fn max_age_s(&self, asked: Option<f64>) -> f64 {
        max_age_s(self.period_s, asked)
    }

    fn is_sending(&self, now_s: f64, asked: Option<f64>) -> bool {
        self.last.is_some_and(|(_, at)| now_s - at <= self.max_age_s(asked))
    }

    /// Takes over `frame`'s values. Returns when it was read, host time, s.
    fn take(&mut self, frame: &BoardFrame) -> f64 {
        if frame.restarted {
            self.clock.restart();
            self.last = None;
            self.known.fill(None);
        }
        if let Some(places) = frame.places.as_ref().filter(|places| !Arc::ptr_eq(places, &self.places)) {
            // A value of another channel says nothing of this one.
            (self.known, self.places) = (vec![None; places.len()], Arc::clone(places));
        }
        let at = self.clock.host_time_s(frame.board_us, frame.arrived_s);
        if let Some((before_us, _)) = self.last {
            let frames = f64::from(frame.lost) + 1.0;
            let step = frame.board_us.saturating_sub(before_us) as f64 * 1e-6 / frames;
            self.period_s = updated_period_s(self.period_s, step);
        }
        self.last = Some((frame.board_us, at));
        self.arrived_s = frame.arrived_s;
        for known in self.known.iter_mut().flatten() {
            known.sure &= frame.lost == 0;
            if frame.partial && known.sure {
                known.confirmed_s = at;
            }
        }
        for &(channel, value) in &frame.values {
            if let Some(known) = self.known.get_mut(channel as usize) {
                *known = Some(Known { value, confirmed_s: at, sure: true });
            }
        }
        self.replaced += u64::from(std::mem::replace(&mut self.waiting, true));
        at
    }
}

pub(in crate::source) struct Merge {
    boards: Vec<Board>,
    pace: Pace,
    max_age_s: Option<f64>,
    leader: Option<usize>,
    last_s: f64,
    /// When a frame is due without input, s.
    due_s: Option<f64>,
    /// A frame that waits for other boards: its time and its deadline, s.
    held_s: Option<(f64, f64)>,
}

impl Merge {
    /// `boards` has per board and channel the index in a frame's values.
    pub(in crate::source) fn new(boards: Vec<Vec<Option<usize>>>, pace: Pace, max_age_s: Option<f64>) -> Self {
        let board = |places: Vec<Option<usize>>| {
            let known = vec![None; places.len()];
            Board { known, places: places.into(), period_s: DEFAULT_PERIOD_S, ..Board::default() }
        };
        let boards = boards.into_iter().map(board).collect();
        Self { boards, pace, max_age_s, leader: None, last_s: f64::NEG_INFINITY, due_s: None, held_s: None }
    }

    /// The same for limbs, whose frames a network may hold up.
    #[cfg(feature = "zenoh")]
    pub(in crate::source) fn of_limbs(mut self) -> Self {
        self.boards.iter_mut().for_each(|board| board.clock = Clock::of_limb());
        self
    }

    /// Takes a board's frame. Returns the time of the merged frame that is now due, if any.
    pub(in crate::source) fn take(&mut self, frame: &BoardFrame) -> Option<f64> {
        let at = self.boards.get_mut(frame.board)?.take(frame);
        if let Pace::Every(period_s) = self.pace {
            self.due_s.get_or_insert(frame.arrived_s + period_s);
            return None;
        }
        if self.pace == Pace::Fastest && self.lead(frame.board, at) != frame.board {
            let over = self.held_s.is_some_and(|(_, until)| !self.expects_frame(frame.arrived_s, until));
            return self.held_s.take_if(|_| over).map(|(at, _)| at);
        }
        // While all boards are silent, frames come without input once the values are too old.
        let longest = self.boards.iter().map(|board| board.max_age_s(self.max_age_s)).fold(0.0, f64::max);
        self.due_s = Some(frame.arrived_s + longest + SILENT_PERIOD_S);
        let until = frame.arrived_s + wait_s(self.boards[frame.board].period_s);
        // The next frame ends the wait for the one before.
        let is_waiting = self.held_s.take().is_none() && at > self.last_s && self.expects_frame(frame.arrived_s, until);
        self.held_s = is_waiting.then_some((at, until));
        (at > self.last_s && !is_waiting).then_some(at)
    }

    /// Whether a board as fast as the leader that has sent nothing since the last merged frame is due by `until_s`.
    fn expects_frame(&self, now_s: f64, until_s: f64) -> bool {
        let Some(leader) = self.leader.filter(|_| self.pace == Pace::Fastest) else { return false };
        let period_s = self.boards[leader].period_s;
        self.boards.iter().enumerate().any(|(index, board)| {
            let is_as_fast = TAKEOVER_SHARE * board.period_s < period_s;
            let is_due = board.arrived_s + board.period_s <= until_s;
            index != leader && !board.waiting && is_as_fast && is_due && board.is_sending(now_s, self.max_age_s)
        })
    }

    pub(in crate::source) fn is_waiting(&self) -> bool {
        self.held_s.is_some()
    }

    /// The board that sets the pace after a frame of `board`.
    fn lead(&mut self, board: usize, now_s: f64) -> usize {
        let is_sending = |leader: usize| self.boards[leader].is_sending(now_s, self.max_age_s);
        let leads = leader(self.leader, board, is_sending, |board| self.boards[board].period_s);
        self.leader = Some(leads);
        leads
    }

    pub(in crate::source) fn is_timed(&self) -> bool {
        matches!(self.pace, Pace::Every(_))
    }

    /// When [`Merge::tick`] next has something to do, s.
    pub(in crate::source) fn due_s(&self) -> Option<f64> {
        let held = self.held_s.map(|(_, until)| until);
        held.into_iter().chain(self.due_s).reduce(f64::min)
    }

    /// The time of the merged frame that is due at `now_s`, if any.
    pub(in crate::source) fn tick(&mut self, now_s: f64) -> Option<f64> {
        if let Some((at, _)) = self.held_s.take_if(|(_, until)| now_s >= *until) {
            return (at > self.last_s).then_some(at);
        }
        let due = self.due_s.filter(|due| now_s >= *due)?;
        let period_s = if let Pace::Every(period_s) = self.pace { period_s } else { SILENT_PERIOD_S };
        // Missed frames are not made up for.
        let next = due + period_s;
        self.due_s = Some(if next < now_s { now_s + period_s } else { next });
        (now_s > self.last_s).then_some(now_s)
    }

    /// Fills `frame` with the values valid at `at_s`.
    pub(in crate::source) fn fill(&mut self, at_s: f64, frame: &mut Frame) {
        frame.clear();
        frame.t_s = at_s;
        self.last_s = at_s;
        for board in &mut self.boards {
            let max_age_s = board.max_age_s(self.max_age_s);
            let is_sending = board.is_sending(at_s, self.max_age_s);
            let absent = if is_sending { RawValue::MISSING } else { RawValue::STALE };
            // A frame that is too old by now has come for nothing.
            board.replaced += u64::from(std::mem::take(&mut board.waiting) && !is_sending);
            for (place, known) in board.places.iter().zip(&board.known) {
                let Some(place) = *place else { continue };
                let young = known.filter(|known| at_s - known.confirmed_s <= max_age_s);
                frame.values[place] = young.map_or(absent, |known| known.value);
            }
        }
    }

    /// The board's frames replaced before they were merged, its clock's drift and its rate, Hz.
    pub(in crate::source) fn board_statistics(&self, board: usize) -> (u64, Option<f64>, Option<f64>) {
        let board = &self.boards[board];
        (board.replaced, board.clock.drift(), board.last.map(|_| board.period_s.recip()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::source::send_rate::MAX_WAIT_S;

    fn frame(board: usize, at_s: f64, values: &[(u32, u16)]) -> BoardFrame {
        let board_us = (at_s * 1e6).round() as u64;
        let values = values.iter().map(|&(channel, value)| (channel, RawValue::new(value.into()))).collect();
        BoardFrame { board, board_us, arrived_s: at_s, lost: 0, restarted: false, partial: false, places: None, values }
    }

    fn two_boards(pace: Pace, max_age_s: Option<f64>) -> Merge {
        Merge::new(vec![vec![Some(0), Some(1)], vec![None, Some(2)]], pace, max_age_s)
    }

    fn numbers(merge: &mut Merge, at_s: f64) -> Vec<Option<f64>> {
        let mut frame = Frame::missing(0.0, 3);
        merge.fill(at_s, &mut frame);
        assert_eq!(frame.t_s, at_s);
        frame.values.iter().map(|value| value.number()).collect()
    }

    #[test]
    fn the_fastest_board_sets_the_pace_and_another_takes_over() {
        let mut merge = two_boards(Pace::Fastest, None);
        let mut came = Vec::new();
        for tick in 0..200_u32 {
            let at = 1.0 + 0.01 * f64::from(tick);
            // Board 1 is twice as fast until it falls silent.
            for (board, sends) in [(0, tick % 2 == 0), (1, tick < 100)] {
                if sends && let Some(at) = merge.take(&frame(board, at + 0.001 * board as f64, &[(1, tick as u16)])) {
                    merge.fill(at, &mut Frame::missing(0.0, 3));
                    came.push((tick, board));
                }
            }
        }
        let leaders: Vec<usize> = came.iter().map(|&(_, board)| board).collect();
        assert!(leaders[30..90].iter().all(|&board| board == 1), "{leaders:?}");
        assert!(came.iter().filter(|(tick, _)| (105..).contains(tick)).all(|&(_, board)| board == 0));
        assert!(came.iter().filter(|(tick, _)| *tick >= 110).count() == 45, "every frame of the other");
        // Board 1 is known to be faster after three frames of the other. Board 0 takes over when 50 ms are over.
        assert!(
            merge.board_statistics(0).0 <= 4 && merge.board_statistics(1).0 <= 5,
            "{} {}",
            merge.board_statistics(0).0,
            merge.board_statistics(1).0
        );
    }

    /// Boards that send 50 times a second, the second `late_s` after the first and now a millisecond sooner, now later:
    /// frames that none of the skin had, of 1000 each; how many they would be if nothing waited; and how long frames of the
    /// skin waited at most, s.
    fn together(late_s: f64) -> (u64, usize, f64) {
        let mut merge = two_boards(Pace::Fastest, None);
        let mut arrivals = Vec::new();
        for tick in 0..1000_u32 {
            let at = 1.0 + 0.02 * f64::from(tick);
            let jitter = 0.001 * f64::from((tick * 7919) % 11) / 5.0 - 0.001;
            arrivals.extend([(0, at, at), (1, at, at + late_s + jitter)]);
        }
        arrivals.sort_by(|a, b| a.2.total_cmp(&b.2));
        let twice = arrivals.windows(2).filter(|pair| (pair[0].0, pair[1].0) == (1, 1)).count();
        let (mut longest_s, mut came_s, mut skin) = (0.0_f64, 0.0, Frame::missing(0.0, 3));
        for (board, read_s, arrived_s) in arrivals {
            while let Some(due_s) = merge.due_s().filter(|due| *due < arrived_s && merge.is_waiting()) {
                let at = merge.tick(due_s).unwrap();
                longest_s = longest_s.max(due_s - came_s);
                merge.fill(at, &mut skin);
            }
            let held = merge.is_waiting();
            let frame = BoardFrame { arrived_s, ..frame(board, read_s, &[(1, 1)]) };
            if let Some(at) = merge.take(&frame) {
                longest_s = longest_s.max(if held { arrived_s - came_s } else { 0.0 });
                merge.fill(at, &mut skin);
            } else if !held {
                came_s = arrived_s;
            }
        }
        (merge.board_statistics(0).0 + merge.board_statistics(1).0, twice, longest_s)
    }

    #[test]
    fn boards_that_send_together_are_in_one_frame() {
        for (late_s, least) in [(0.0, 50), (0.0005, 50), (0.002, 0)] {
            let (replaced, twice, longest_s) = together(late_s);
            assert!(twice >= least, "{late_s}: {twice} are to be mended");
            assert!(replaced <= 20 && longest_s <= MAX_WAIT_S + 1e-9, "{late_s}: {replaced}, {longest_s}");
        }
        // What is not about to come is not waited for.
        let (replaced, _, longest_s) = together(0.01);
        assert!(replaced <= 4 && longest_s == 0.0, "{replaced}, {longest_s}");
    }

    #[test]
    fn what_is_too_old_is_missing_and_a_silent_board_is_stale() {
        let mut merge = two_boards(Pace::Arrival, Some(0.1));
        assert_eq!(merge.take(&frame(0, 1.0, &[(0, 5), (1, 6)])), Some(1.0));
        assert_eq!(numbers(&mut merge, 1.0), [Some(5.0), Some(6.0), None], "board 1 was never heard");
        merge.take(&frame(1, 1.05, &[(0, 9), (1, 7)]));
        assert_eq!(numbers(&mut merge, 1.05), [Some(5.0), Some(6.0), Some(7.0)]);
        // A full frame without channel 1: it ages alone.
        merge.take(&frame(0, 1.09, &[(0, 4)]));
        merge.take(&frame(0, 1.12, &[(0, 3)]));
        let mut seen = Frame::missing(0.0, 3);
        merge.fill(1.12, &mut seen);
        assert_eq!(seen.values, [RawValue::new(3.0), RawValue::MISSING, RawValue::new(7.0)]);
        merge.take(&frame(0, 1.2, &[(0, 3)]));
        merge.fill(1.2, &mut seen);
        assert_eq!(seen.values, [RawValue::new(3.0), RawValue::MISSING, RawValue::STALE]);
    }

    #[test]
    fn a_partial_frame_confirms_what_it_leaves_out_unless_something_was_lost() {
        let mut merge = two_boards(Pace::Arrival, Some(0.1));
        merge.take(&frame(0, 1.0, &[(0, 5), (1, 6)]));
        let partial = |at, lost, values: &[(u32, u16)]| BoardFrame { partial: true, lost, ..frame(0, at, values) };
        merge.take(&partial(1.09, 0, &[(0, 8)]));
        assert_eq!(numbers(&mut merge, 1.15), [Some(8.0), Some(6.0), None]);
        merge.take(&partial(1.18, 1, &[(0, 9)]));
        assert_eq!(numbers(&mut merge, 1.18), [Some(9.0), Some(6.0), None], "still young");
        merge.take(&partial(1.24, 0, &[]));
        // Channel 1 may have changed in the frame that was lost: what leaves it out says nothing more of it.
        assert_eq!(numbers(&mut merge, 1.24), [Some(9.0), None, None]);
        merge.take(&partial(1.25, 0, &[(1, 7)]));
        assert_eq!(numbers(&mut merge, 1.25), [Some(9.0), Some(7.0), None]);
        let restarted = BoardFrame { restarted: true, ..frame(0, 0.5, &[(0, 1)]) };
        merge.take(&BoardFrame { arrived_s: 1.3, ..restarted });
        assert_eq!(numbers(&mut merge, 1.3), [Some(1.0), None, None]);
    }

    #[test]
    fn frames_come_at_the_rate_that_was_asked_for() {
        let mut merge = two_boards(Pace::Every(0.1), None);
        assert_eq!((merge.due_s(), merge.tick(5.0)), (None, None), "nobody has spoken");
        assert_eq!(merge.take(&frame(0, 10.0, &[(0, 1)])), None);
        assert_eq!(merge.tick(10.05), None);
        assert_eq!(merge.tick(10.11), Some(10.11));
        assert!((merge.due_s().unwrap() - 10.2).abs() < 1e-9);
        assert_eq!(merge.tick(12.0), Some(12.0), "late");
        assert!((merge.due_s().unwrap() - 12.1).abs() < 1e-9, "and not made up for");
    }

    #[test]
    fn while_nobody_speaks_frames_say_so() {
        let mut merge = two_boards(Pace::Fastest, Some(0.1));
        merge.take(&frame(0, 1.0, &[(0, 5)]));
        assert_eq!(numbers(&mut merge, 1.0)[0], Some(5.0));
        assert_eq!(merge.tick(1.15), None);
        assert_eq!(merge.tick(1.25), Some(1.25));
        let mut seen = Frame::missing(0.0, 3);
        merge.fill(1.25, &mut seen);
        assert_eq!(seen.values, [RawValue::STALE; 3]);
    }
}
