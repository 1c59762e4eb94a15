//! What limbs send.

/// What a limb sends to the computer that brings limbs together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LimbSends {
    /// Raw frames; the host makes percepts of them.
    Frames,
    /// Percepts, as in NDJSON.
    Percepts,
}

impl LimbSends {
    /// What they are called.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            Self::Frames => "frames",
            Self::Percepts => "percepts",
        }
    }
}
