//! When a search knows enough: all places that it is for have their shortest paths.

use super::SurfacePlace;
use crate::body::Topology;

/// Ratio of the distances at which a search looks whether it knows enough.
const STEP: f64 = 1.04;

/// Relative tolerance in comparing a path with the distance that is searched: more than rounding over a sequence of triangles.
const ROUNDING: f64 = 1e-9;

/// A place to which a path is looked for.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Wanted {
    /// The place.
    pub(crate) place: SurfacePlace,
    /// How much longer than the shortest path others are looked for, m.
    pub(crate) margin_m: f64,
}

/// The places that a search is for, and the distance from which on it may know enough.
pub(super) struct Enough<'a> {
    wanted: &'a [Wanted],
    /// The place that was unknown last.
    unknown: usize,
    next_m: f64,
}

impl<'a> Enough<'a> {
    /// For a search from `start`; without places it goes up to its limit.
    pub(super) fn new(topology: &Topology, start: &SurfacePlace, wanted: &'a [Wanted]) -> Self {
        let from = start.position(topology);
        // No path is shorter than the way in space.
        let apart = wanted.iter().map(|it| it.place.position(topology).distance(from) + it.margin_m);
        let next_m = if wanted.is_empty() { f64::INFINITY } else { apart.fold(0.0, f64::max) };
        Self { wanted, unknown: 0, next_m }
    }

    /// Whether the paths to all places are known, and others up to the margins, if all paths up to `searched_m` are.
    /// `distance_m` has the length of the shortest known path.
    pub(super) fn is_known(&mut self, searched_m: f64, distance_m: impl Fn(&SurfacePlace) -> Option<f64>) -> bool {
        if searched_m < self.next_m {
            return false;
        }
        self.next_m = searched_m * STEP;
        let up_to_m = searched_m * (1.0 - ROUNDING);
        let is_known = |it: &Wanted| distance_m(&it.place).is_some_and(|length_m| length_m + it.margin_m <= up_to_m);
        // Mostly the one that was unknown before still is.
        while let Some(it) = self.wanted.get(self.unknown) {
            if !is_known(it) {
                return false;
            }
            self.unknown += 1;
        }
        // A path that was known stays known.
        true
    }
}
