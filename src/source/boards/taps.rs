//! The taps of the boards' potentiometers: requested and confirmed.

use crate::signal::Wiring;

/// The potentiometer of a board's channel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct ChannelTap {
    /// The tap requested by the wiring or [`super::Lines::set_tap`].
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
    pub(in crate::source) fn due(self) -> Option<u8> {
        self.wanted.filter(|_| self.wanted != self.set && self.trouble.is_none())
    }

    /// Whether the channel's readings are still invalid: a tap is requested, and the present one is unknown.
    pub(in crate::source) fn is_unknown(self) -> bool {
        self.due().is_some() && self.set.is_none()
    }

    /// Forgets the tap after its board has restarted.
    pub(in crate::source) fn forget(&mut self) {
        (self.set, self.trouble) = (None, None);
    }
}

/// The taps requested by `wiring`, board by board.
pub(in crate::source) fn wanted(wiring: &Wiring) -> Vec<Vec<ChannelTap>> {
    let tap = |wanted: &Option<u8>| ChannelTap { wanted: *wanted, ..ChannelTap::default() };
    wiring.boards().iter().map(|board| board.taps.iter().map(tap).collect()).collect()
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
