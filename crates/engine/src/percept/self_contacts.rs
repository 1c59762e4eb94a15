//! Self-contacts: touches of two links at one place in the world.

/// A touch of each of two links, at one place in the world: the robot touches itself there.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct SelfContact {
    /// Lasts as long as both touches do, and is never used again.
    pub id: u64,
    /// The touch on either link, that of the body's earlier link first.
    pub sides: [SelfContactSide; 2],
    /// Halfway between the places of both touches, in the world, m.
    pub position: [f64; 3],
    /// How far these places are apart, m.
    pub distance: f64,
    /// The angle between the outward normals there, rad in [0, π]: π where they oppose.
    pub angle: f64,
}

impl SelfContact {
    /// A contact of `sides`.
    pub(crate) const fn new(
        id: u64,
        sides: [SelfContactSide; 2],
        position: [f64; 3],
        distance: f64,
        angle: f64,
    ) -> Self {
        Self { id, sides, position, distance, angle }
    }
}

/// One side of a [`SelfContact`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct SelfContactSide {
    /// Index of the link with most of the touch.
    pub link: u32,
    /// The touch, as [`Touch::id`](crate::percept::Touch::id) has it.
    pub touch: u64,
    /// ΣP of the touch, in the unit of P.
    pub total: f64,
}
