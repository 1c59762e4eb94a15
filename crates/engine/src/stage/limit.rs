//! How much a value may differ, or why it cannot be compared with a bound.

/// What single precision may make of a value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Limit<T = f64> {
    /// Off by as much as this, and absent where the reference has none.
    Within(T),
    /// The value depends on a choice whose margin in the reference is under the choice's bound.
    TooClose,
    /// The value depends on the state after the previous frame, which was too close to call and is not in the percepts.
    Unread,
}

impl<T: Default> Default for Limit<T> {
    fn default() -> Self {
        Self::Within(T::default())
    }
}

impl Limit {
    /// The limit of a value that the reference has if it is `present`; single precision may differ in that if it is
    /// `in_doubt`. Without a bound nothing is known of the value.
    pub(crate) fn from_bound(bound: Option<f64>, present: bool, in_doubt: bool) -> Self {
        match (in_doubt, present, bound) {
            (true, ..) | (false, true, None) => Self::TooClose,
            (false, false, _) => Self::default(),
            (false, true, Some(bound)) => Self::Within(bound),
        }
    }
}

impl<T> Limit<T> {
    /// The same limit with another bound.
    pub(crate) fn map<V>(self, bound: impl FnOnce(T) -> V) -> Limit<V> {
        match self {
            Self::Within(within) => Limit::Within(bound(within)),
            Self::TooClose => Limit::TooClose,
            Self::Unread => Limit::Unread,
        }
    }
}
