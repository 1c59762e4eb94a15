//! How the layer over the taxels gives way, and how it spreads what presses on it, along a curved surface.

use super::super::contact;
use super::super::layer::Kernel;
use super::super::radial::Radial;

/// A Gaussian is cut off at this many standard deviations: 4 · 10⁻⁶ of a force lie beyond.
const CUTOFF_SIGMAS: f64 = 5.0;
/// A layer counts as spreading at least this much, m.
const MIN_SIGMA_M: f64 = 5e-4;
/// Pieces of the surface are at most this large, m, or this share of the smallest cell, whichever is more: a body of four metres with
/// taxels 120 mm apart needs no pieces of 2 mm.
const MAX_PIECE_M: f64 = 2e-3;
const MAX_PIECE_SHARE: f64 = 0.1;

/// The layer over the taxels.
#[derive(Clone, Copy, Debug)]
pub(super) struct Layer {
    kernel: Kernel,
    /// Standard deviation of the Gaussian, or of the one with the same peak.
    sigma_m: f64,
    /// Pressure per depth, Pa/m.
    pub(super) stiffness_pa_m: f64,
    /// Pieces of the surface are at most this large, m.
    max_piece_m: f64,
}

impl Layer {
    /// The layer that the file describes, which has a thickness, over taxels with cells of at least `least_side_m` square.
    pub(super) fn new(given: &contact::Layer, least_side_m: f64) -> Self {
        Self {
            kernel: given.kernel,
            sigma_m: given.sigma_m().max(MIN_SIGMA_M),
            stiffness_pa_m: given.stiffness_pa / given.thickness_m,
            max_piece_m: MAX_PIECE_M.max(MAX_PIECE_SHARE * least_side_m),
        }
    }

    fn depth_m(&self, kernel: Radial) -> f64 {
        self.sigma_m / kernel.spread()
    }

    /// How far along the surface a point force is felt, m.
    pub(super) fn reach_m(&self) -> f64 {
        match self.kernel {
            Kernel::Gaussian => CUTOFF_SIGMAS * self.sigma_m,
            Kernel::Radial(kernel) => kernel.near_reach() * self.depth_m(kernel),
        }
    }

    /// The edges of pieces that are small enough for this layer, m.
    pub(super) fn piece_m(&self) -> f64 {
        (self.sigma_m / 2.0).min(self.max_piece_m)
    }

    /// The edges of cubes in which forces may be put together, m.
    pub(super) fn cube_m(&self) -> f64 {
        self.sigma_m / 4.0
    }

    /// The pressure at this distance from a force, as a share of that below it.
    pub(super) fn share_at(&self, distance_m: f64) -> f64 {
        if distance_m > self.reach_m() {
            return 0.0;
        }
        match self.kernel {
            Kernel::Gaussian => {
                let sigmas = distance_m / self.sigma_m;
                libm::exp(-0.5 * sigmas * sigmas)
            }
            Kernel::Radial(kernel) => kernel.fall(distance_m / self.depth_m(kernel)),
        }
    }
}
