//! What a value may differ by, or why it cannot be held to a bound.

/// What single precision may make of a value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Limit<T = f64> {
    /// Off by as much as this, and absent where the reference has none.
    Within(T),
    /// The reference's own margin to a choice that the value hangs on is under that choice's bound.
    TooClose,
    /// It hangs on what the frame before left, which was too close to call and which the percepts do not tell.
    Unread,
}

impl<T: Default> Default for Limit<T> {
    fn default() -> Self {
        Self::Within(T::default())
    }
}

impl Limit {
    /// Of a value that the reference has if it is `present`, which single precision may see otherwise if that is
    /// `in_doubt`. Without a bound nothing can be told of the value.
    pub(crate) fn of(bound: Option<f64>, present: bool, in_doubt: bool) -> Self {
        match (in_doubt, present, bound) {
            (true, ..) | (false, true, None) => Self::TooClose,
            (false, false, _) => Self::default(),
            (false, true, Some(bound)) => Self::Within(bound),
        }
    }
}

impl<T> Limit<T> {
    /// The same with another bound.
    pub(crate) fn map<V>(self, bound: impl FnOnce(T) -> V) -> Limit<V> {
        match self {
            Self::Within(within) => Limit::Within(bound(within)),
            Self::TooClose => Limit::TooClose,
            Self::Unread => Limit::Unread,
        }
    }
}
