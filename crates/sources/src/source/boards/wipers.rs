//! The wipers of the boards' potentiometers: requested and confirmed.

use crate::signal::Wiring;

/// The potentiometer of a board's channel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct ChannelWiper {
    /// The wiper requested by the wiring or [`super::Lines::set_wiper`].
    pub wanted: Option<u8>,
    /// The wiper confirmed by the board since its last start.
    pub set: Option<u8>,
    /// Why it is not as requested.
    pub trouble: Option<WiperTrouble>,
}

/// Why a wiper is not set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum WiperTrouble {
    /// The board refuses this wiper, or does not know the command.
    Refused,
    /// The board does not answer.
    Unanswered,
}

impl WiperTrouble {
    /// The problem as a predicate of the board.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            Self::Refused => "refuses `wiper`",
            Self::Unanswered => "does not answer `wiper`",
        }
    }
}

impl ChannelWiper {
    /// The wiper to request, unless it is set or the board has refused it.
    pub(in crate::source) fn due(self) -> Option<u8> {
        self.wanted.filter(|_| self.wanted != self.set && self.trouble.is_none())
    }

    /// Whether the channel's readings are still invalid: a wiper is requested, and the present one is unknown.
    pub(in crate::source) fn is_unknown(self) -> bool {
        self.due().is_some() && self.set.is_none()
    }

    /// Forgets the wiper after its board has restarted.
    pub(in crate::source) fn forget(&mut self) {
        (self.set, self.trouble) = (None, None);
    }
}

/// The wipers requested by `wiring`, board by board.
pub(in crate::source) fn wanted(wiring: &Wiring) -> Vec<Vec<ChannelWiper>> {
    let wiper = |wanted: &Option<u8>| ChannelWiper { wanted: *wanted, ..ChannelWiper::default() };
    wiring.boards().iter().map(|board| board.wipers.iter().map(wiper).collect()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wiper_is_due_until_it_is_confirmed_and_unknown_until_it_was_once() {
        let mut wiper = ChannelWiper { wanted: Some(7), ..ChannelWiper::default() };
        assert!(wiper.due() == Some(7) && wiper.is_unknown());
        wiper.set = Some(7);
        assert!(wiper.due().is_none() && !wiper.is_unknown());
        wiper.wanted = Some(9);
        assert!(wiper.due() == Some(9) && !wiper.is_unknown(), "it has one of two known wipers");
        wiper.forget();
        assert!(wiper.due() == Some(9) && wiper.is_unknown());
        wiper.trouble = Some(WiperTrouble::Refused);
        assert!(wiper.due().is_none() && !wiper.is_unknown(), "nothing more is to be known");
        assert!(!ChannelWiper::default().is_unknown(), "nobody wants any");
    }
}
