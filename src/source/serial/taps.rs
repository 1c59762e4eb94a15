//! The taps of the boards' potentiometers: requested and confirmed.

use super::lines::{Lines, State};
use crate::signal::Wiring;

/// The potentiometer of a board's channel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct ChannelTap {
    /// The tap requested by the wiring or [`Lines::set_tap`].
    pub wanted: Option<u8>,
    /// The tap confirmed by the board since its last start.
    pub set: Option<u8>,
    /// Why it is not as requested.
    pub trouble: Option<TapTrouble>,
}

/// Why a tap is not set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum TapTrouble {
    /// The board refuses this tap, or does not know the command.
    Refused,
    /// The board does not answer.
    Unanswered,
}

impl TapTrouble {
    /// The problem as a predicate of the board.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            Self::Refused => "refuses `tap`",
            Self::Unanswered => "does not answer `tap`",
        }
    }
}

impl ChannelTap {
    /// The tap to request, unless it is set or the board has refused it.
    pub(super) fn due(self) -> Option<u8> {
        self.wanted.filter(|_| self.wanted != self.set && self.trouble.is_none())
    }

    /// Whether the channel's readings are still invalid: a tap is requested, and the present one is unknown.
    pub(super) fn is_unknown(self) -> bool {
        self.due().is_some() && self.set.is_none()
    }

    /// Forgets the tap after its board has restarted.
    pub(super) fn forget(&mut self) {
        (self.set, self.trouble) = (None, None);
    }
}

/// The taps requested by `wiring`, board by board.
pub(super) fn wanted(wiring: &Wiring) -> Vec<Vec<ChannelTap>> {
    let tap = |wanted: &Option<u8>| ChannelTap { wanted: *wanted, ..ChannelTap::default() };
    wiring.boards().iter().map(|board| board.taps.iter().map(tap).collect()).collect()
}

impl Lines {
    /// The potentiometers, one per channel, board by board in the order of the wiring.
    #[must_use]
    pub fn taps(&self) -> Vec<Vec<ChannelTap>> {
        self.0.lock().taps.clone()
    }

    /// Requests `tap` on a channel of the wiring's board at index `board`, now and after every restart of the board;
    /// [`Lines::taps`] has the result. Does nothing if there is no such channel.
    pub fn set_tap(&self, board: usize, channel: usize, tap: u8) {
        let mut state = self.0.lock();
        if let Some(channel) = state.taps.get_mut(board).and_then(|channels| channels.get_mut(channel)) {
            (channel.wanted, channel.trouble) = (Some(tap), None);
        }
    }
}

impl State {
    /// The next channel of `board` to set, and its tap.
    pub(super) fn next_tap(&self, board: usize) -> Option<(u16, u8)> {
        (0..).zip(&self.taps[board]).find_map(|(channel, tap)| Some((channel, tap.due()?)))
    }

    /// Stops requesting taps of `board`. Returns the number of channels without the requested tap.
    pub(super) fn abandon_taps(&mut self, board: usize, why: TapTrouble) -> usize {
        let due = self.taps[board].iter_mut().filter(|tap| tap.due().is_some());
        due.map(|tap| tap.trouble = Some(why)).count()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tap_is_due_until_it_is_confirmed_and_unknown_until_it_was_once() {
        let mut tap = ChannelTap { wanted: Some(7), ..ChannelTap::default() };
        assert!(tap.due() == Some(7) && tap.is_unknown());
        tap.set = Some(7);
        assert!(tap.due().is_none() && !tap.is_unknown());
        tap.wanted = Some(9);
        assert!(tap.due() == Some(9) && !tap.is_unknown(), "it has one of two known taps");
        tap.forget();
        assert!(tap.due() == Some(9) && tap.is_unknown());
        tap.trouble = Some(TapTrouble::Refused);
        assert!(tap.due().is_none() && !tap.is_unknown(), "nothing more is to be known");
        assert!(!ChannelTap::default().is_unknown(), "nobody wants any");
    }
}
