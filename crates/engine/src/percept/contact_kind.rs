//! The kinds of contact that are distinguished.

use serde::Serialize;

/// What kind of contact presses.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
#[serde(into = "&'static str")]
pub enum ContactKind {
    /// Something round: a fingertip, a ball.
    Point,
    /// Something straight that goes on beyond the sensors.
    Line,
    /// Something straight with both ends on the sensors.
    Segment,
    /// Something that is wider one way than the other.
    Blob,
}

impl ContactKind {
    /// All of them, in the order of their numbers in columns.
    pub const ALL: [Self; 4] = [Self::Point, Self::Line, Self::Segment, Self::Blob];

    /// As data files spell it.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Point => "point",
            Self::Line => "line",
            Self::Segment => "segment",
            Self::Blob => "blob",
        }
    }
}

impl From<ContactKind> for &'static str {
    fn from(kind: ContactKind) -> Self {
        kind.name()
    }
}
