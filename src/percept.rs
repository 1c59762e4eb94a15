//! What a field reports for a frame: quantities that are present or absent with a reason.
//!
//! [`Percepts`] holds a whole batch in columns, in the precision of the backend that made it; [`Percept`] is one field
//! in one frame, copied out for reading. A quantity is `Some` or it is absent, and then [`Flags`] say why; nothing here
//! is ever NaN or infinite.

mod batch;
mod cells;
mod keep;

use bitflags::bitflags;
use bytemuck::{Pod, Zeroable};

pub use batch::Percepts;
pub(crate) use batch::{Columns, Values};
pub(crate) use cells::{CellsMut, PlaceCells};

bitflags! {
    /// Why a quantity is absent or in doubt, and what was wrong with the input.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Pod, Zeroable)]
    #[repr(transparent)]
    pub struct Flags: u32 {
        /// The field is not in contact: everything that needs a touch is absent.
        const NO_CONTACT = 1 << 0;
        /// Only one taxel is pressed: there is no line through two points, and no spread.
        const ONE_TAXEL = 1 << 1;
        /// The second and third farthest points are as good as equally far (R₂ − R₃ ≤ 2⁻¹⁴ R₁): orientation is in doubt.
        const TIE = 1 << 2;
        /// The points that would define a line fall together: orientation (or axis) is absent.
        const COINCIDENT = 1 << 3;
        /// The pressure spreads equally in all directions (anisotropy under 10⁻³): the axis is absent.
        const ISOTROPIC = 1 << 4;
        /// The centroid did not move, or its filtered steps cancel each other out: there is no direction of motion.
        const STILL = 1 << 5;
        /// A pressed taxel is above its P_max; its value is kept.
        const SATURATED = 1 << 6;
        /// A taxel's value was masked or altered: not finite, unbelievable, or distrusted by the calibration's checks.
        const FAULTY_INPUT = 1 << 7;
        /// A taxel's raw value lies outside the range that the calibration says the sensor has; it is kept.
        const OUT_OF_RANGE = 1 << 8;
        /// A taxel's value is missing and left out of every sum.
        const INCOMPLETE = 1 << 9;
        /// The field has no chart: what needs (u, v) is absent.
        const NO_CHART = 1 << 10;
        /// There is no previous frame to measure motion from.
        const NO_PREVIOUS = 1 << 11;
        /// The time step is zero, negative, or longer than the scene allows.
        const BAD_DT = 1 << 12;
        /// The field's channels have not been heard from for too long.
        const STALE = 1 << 13;
        /// The field is touched in several places: its centroid may lie where nobody touches.
        const SEVERAL = 1 << 14;
        // From here on the host's alone: a word of the device has no room for them.
        /// The centroid has not come as far as the filter's window from the last one that counted: filtered displacement
        /// and speed are absent, the filtered direction stays what it was.
        const HELD = 1 << 16;
        /// The centroid went farther at once than the filter's window: it is taken for another touch, and filtered motion
        /// starts anew.
        const JUMPED = 1 << 17;
        /// A taxel has been touched for long while too few others were untouched to tell its drift: its baseline is that of
        /// the onset.
        const DRIFT_UNKNOWN = 1 << 18;
    }
}

impl Flags {
    /// The flags' names as percept NDJSON spells them, in order.
    pub fn names(self) -> impl Iterator<Item = String> {
        self.iter_names().map(|(name, _)| name.to_lowercase())
    }
}

bitflags! {
    /// Quantities a percept can hold: what is asked for, and what is present.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Pod, Zeroable)]
    #[repr(transparent)]
    pub struct Outputs: u32 {
        /// S = Σ wᵢPᵢ.
        const TOTAL = 1 << 0;
        /// max Pᵢ.
        const PEAK = 1 << 1;
        /// Number of taxels with P > 0.
        const ACTIVE = 1 << 2;
        /// Summed area of the taxels with P > 0, m².
        const AREA = 1 << 3;
        /// Pressure-weighted mean (u, v) in the field's chart, m (eq. 1–2).
        const CENTROID = 1 << 4;
        /// The same point on the surface, m.
        const POSITION = 1 << 5;
        /// The outward unit normal there.
        const NORMAL = 1 << 6;
        /// Angle of the line through the two farthest points, rad in [0, π) (eq. 9–19).
        const ORIENTATION = 1 << 7;
        /// Principal axis of the pressure-weighted second moments, rad in [0, π).
        const AXIS = 1 << 8;
        /// (λ₁ − λ₂)/(λ₁ + λ₂) of those moments, in [0, 1].
        const ANISOTROPY = 1 << 9;
        /// (Δu, Δv) of the centroid since the frame before, m (eq. 3–4).
        const DISPLACEMENT = 1 << 10;
        /// Its direction, rad in (−π, π] (eq. 5).
        const DIRECTION = 1 << 11;
        /// Its length, m.
        const DISTANCE = 1 << 12;
        /// The change of the centroid's distance from the chart's origin, m (eq. 6–7): blind to motion around it.
        const RADIAL_DISTANCE = 1 << 13;
        /// Distance over time, m/s.
        const SPEED = 1 << 14;
        /// Radial distance over time, m/s (eq. 8).
        const RADIAL_SPEED = 1 << 15;
        /// The separate touches of the field, each with an identity; only on request.
        const TOUCHES = 1 << 16;
        /// (Δu, Δv) since the last centroid that counted, m, where this one counts too; only on request, as is the rest of
        /// filtered motion ([`crate::scene::MotionFilter`]).
        const FILTERED_DISPLACEMENT = 1 << 17;
        /// The direction of such steps, averaged over time, rad in (−π, π].
        const FILTERED_DIRECTION = 1 << 18;
        /// The length of such a step over the time that it took, m/s.
        const FILTERED_SPEED = 1 << 19;
    }
}

impl Outputs {
    /// What is given unless something else is asked for: all but [`Outputs::TOUCHES`] and [`Outputs::FILTERED`].
    pub const USUAL: Self = Self::all().difference(Self::TOUCHES).difference(Self::FILTERED);

    /// Motion that counts, of [`crate::scene::MotionFilter`].
    pub const FILTERED: Self = Self::FILTERED_DISPLACEMENT.union(Self::FILTERED_DIRECTION).union(Self::FILTERED_SPEED);

    /// What the stage *motion* gives.
    pub(crate) const MOTION: Self = Self::DISPLACEMENT
        .union(Self::DIRECTION)
        .union(Self::DISTANCE)
        .union(Self::RADIAL_DISTANCE)
        .union(Self::SPEED)
        .union(Self::RADIAL_SPEED);

    /// The outputs' names as the command line and NDJSON spell them, in order.
    pub fn names(self) -> impl Iterator<Item = String> {
        self.iter_names().map(|(name, _)| name.to_lowercase())
    }

    /// The one output called `name`, if there is one.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        (name == name.to_lowercase()).then(|| Self::from_name(&name.to_uppercase())).flatten()
    }
}

/// The arithmetic that made the numbers, and so the digits worth printing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Precision {
    /// IEEE 754 binary32: backends `cpu` and `gpu`.
    F32,
    /// IEEE 754 binary64: backend `reference`.
    F64,
}

/// One of a field's separate touches.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Touch {
    /// Lasts from onset to release, and is never used again for the field.
    pub id: u64,
    /// Σ wᵢPᵢ over its taxels.
    pub total: f64,
    /// Number of its taxels.
    pub active: u32,
    /// Its centroid (u, v), m; absent where the field has no chart.
    pub centroid: Option<[f64; 2]>,
    /// The same point on the surface, as [`Percept::position`] and in the same frame, m.
    pub position: [f64; 3],
}

/// One field's percept for one frame. Lengths in metres, angles in radians.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Percept {
    /// Index of the field, as [`crate::Plan::fields`] counts: once for each letter.
    pub field: usize,
    /// Which of the run's letters it is of, as [`crate::Plan::letters`] counts.
    pub letter: usize,
    /// Whether the field is touched.
    pub contact: bool,
    /// Why quantities are absent, or in doubt.
    pub flags: Flags,
    /// S = Σ wᵢPᵢ, in the unit of P.
    pub total: Option<f64>,
    /// max Pᵢ, in the unit of P.
    pub peak: Option<f64>,
    /// Number of taxels with P > 0.
    pub active: Option<u32>,
    /// Summed area of those taxels, m².
    pub area: Option<f64>,
    /// Centroid (u, v) in the field's chart, m.
    pub centroid: Option<[f64; 2]>,
    /// The touched point, m: on the surface, or for a field without a chart the pressure-weighted mean.
    pub position: Option<[f64; 3]>,
    /// Outward unit normal at that point.
    pub normal: Option<[f64; 3]>,
    /// Two-point orientation, rad in [0, π).
    pub orientation: Option<f64>,
    /// Principal axis, rad in [0, π).
    pub axis: Option<f64>,
    /// Anisotropy, in [0, 1].
    pub anisotropy: Option<f64>,
    /// Displacement (Δu, Δv) since the frame before, m.
    pub displacement: Option<[f64; 2]>,
    /// Direction of motion, rad in (−π, π].
    pub direction: Option<f64>,
    /// Distance moved, m.
    pub distance: Option<f64>,
    /// Change of the distance from the chart's origin, m.
    pub radial_distance: Option<f64>,
    /// Distance over time, m/s.
    pub speed: Option<f64>,
    /// Radial distance over time, m/s.
    pub radial_speed: Option<f64>,
    /// Displacement (Δu, Δv) since the last centroid that counted, m; only where this one counts too.
    pub filtered_displacement: Option<[f64; 2]>,
    /// Direction of such steps, averaged over time, rad in (−π, π].
    pub filtered_direction: Option<f64>,
    /// Length of such a step over the time that it took, m/s.
    pub filtered_speed: Option<f64>,
    /// Whether position and normal are in the world, because the frame carried a pose, or in the field's anchor.
    pub in_world: bool,
}
