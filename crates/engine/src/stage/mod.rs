//! The stages that turn raw values into percepts: one file each, with its equations, its plain f64 reference and the
//! bound on what single precision may lose.
//!
//! A stage has one name everywhere: `crates/engine/src/stage/<stage>.rs` says what is right, `shaders/<stage>.wgsl` and
//! `crates/engine/src/backend/cpu/<stage>.rs` compute it in f32. The stages shear, temperature and proximity are the host's alone, in f64
//! (`crates/engine/src/engine/letters.rs`): they have neither a shader nor a bound, and give the same bits on every backend.
//!
//! **Bounds.** u = 2⁻²⁴ is the unit roundoff of single precision. WebGPU promises correctly rounded +, −, ×, and ÷ to
//! 2.5 ulp (5u); a product may be fused into a sum, which only takes a rounding away. Every bound here is first order in
//! u times `SLACK` for the higher orders, and holds for any order of summation. Coordinates are in the field's unit, a
//! power of two at least its radius, so that nothing overflows or underflows whatever the body's size.

pub mod angle;
pub mod calibrate;
pub(crate) mod centroid;
pub(crate) mod change;
pub(crate) mod contact;
pub(crate) mod difference;
pub(crate) mod filter;
pub(crate) mod fit;
pub(crate) mod force;
pub(crate) mod hysteresis;
pub(crate) mod layout;
pub(crate) mod limit;
pub(crate) mod motion;
pub(crate) mod orientation;
pub mod position;
pub(crate) mod principal_axis;
pub(crate) mod proximity;
pub(crate) mod self_contacts;
pub(crate) mod shear;
pub(crate) mod sigma;
pub(crate) mod tangential;
pub(crate) mod temperature;
pub(crate) mod window;
pub(crate) mod world_motion;

use glam::DVec3;

use self::limit::Limit;
use crate::percept::Outputs;

/// Unit roundoff of binary32.
pub(crate) const U: f64 = 1.0 / 16_777_216.0;

/// Division to 2.5 ulp, as WebGPU promises it.
pub(crate) const DIVISION: f64 = 5.0 * U;

/// Room for the terms of second and higher order that the bounds leave out: n·u stays under 0.1 for 10⁶ members.
pub(crate) const SLACK: f64 = 1.1;
/// How far a pose or a far origin puts a place wrong, as a share of its distance from the origin: some roundings of f64, on both
/// sides of a comparison.
pub(crate) const POSE_ROUNDING: f64 = 4e-15;

/// What a stage gives for a field: an output, and its components if it has a value, a scalar first.
pub(crate) type Given = (Outputs, Option<[f64; 2]>);

/// How far single precision may be off there.
pub(crate) type GivenLimit = (Outputs, Limit);

/// A scalar as components.
pub(crate) fn scalar(value: f64) -> [f64; 2] {
    [value, 0.0]
}

/// How a sum is made in single precision.
///
/// **Bound.** Added up one by one, in whatever order, each of n terms goes through at most n − 1 roundings. A compensated
/// sum (Kahan) adds y = fl(x − c) and keeps exactly what the addition lost, so that s − c = Σ y: a term carries its own
/// rounding, and one more where it is larger than the sum so far, of x and of c, which is at most u·Σ|x|. That is
/// (2 + 2n·u)u·Σ|x|, one rounding for s − c, and one for each time that it is joined with another.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Sums {
    OnePass,
    Compensated {
        /// How often a sum is joined with another, at most.
        joined: usize,
    },
}

impl Sums {
    /// Compensated ones over a field of `count` members. 64 sums are joined in a tree of six levels; of a wide field's parts
    /// every 64th is joined with the one before, and what that makes in another tree.
    pub(crate) fn compensated(count: usize) -> Self {
        let parts = count.div_ceil(layout::WIDE);
        Self::Compensated { joined: if parts > 1 { 6 + parts.div_ceil(64) + 6 } else { 6 } }
    }

    /// How far the sum of `n` terms may be off, in u times the sum of their sizes.
    pub(crate) fn roundings(self, n: usize) -> f64 {
        let n = n as f64;
        match self {
            Self::OnePass => n - 1.0,
            Self::Compensated { joined } => 3.0 + joined as f64 + 2.0 * n * U,
        }
    }
}

/// One pressed taxel of a field in one frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Pressed {
    /// w > 0.
    pub(crate) weight: f64,
    /// By how much single precision's w is off.
    pub(crate) weight_rounding: f64,
    /// P > 0.
    pub(crate) pressure: f64,
    /// By how much more than 2u·P single precision's P may be off, in the unit of P: what a curve loses.
    pub(crate) excess: f64,
    /// (u, v, depth) in the field's unit.
    pub(crate) place: DVec3,
    /// m².
    pub(crate) area: f64,
}

impl Pressed {
    /// wP.
    pub(crate) fn pull(&self) -> f64 {
        self.weight * self.pressure
    }

    /// How far that may be off for the excess, and for the rounding of the weight.
    pub(crate) fn pull_excess(&self) -> f64 {
        self.weight * self.excess + self.weight_rounding * (self.pressure + self.excess)
    }
}

/// Taxels of weight 1 at (u, v), each with its pressure.
#[cfg(test)]
pub(crate) fn pressed_at(taxels: &[(f64, f64, f64)]) -> Vec<Pressed> {
    let places = taxels.iter().map(|&(u, v, pressure)| (DVec3::new(u, v, 0.0), pressure));
    places.map(|(place, pressure)| Pressed { weight: 1.0, pressure, place, ..Pressed::default() }).collect()
}
