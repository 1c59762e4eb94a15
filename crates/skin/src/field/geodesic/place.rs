//! Points of a triangulated surface.

use glam::DVec3;

use crate::body::Topology;

/// Barycentric weight that keeps a start away from its triangle's edges, where directions are ambiguous.
const EDGE_MARGIN: f64 = 1e-6;

/// A point of a [`Topology`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePlace {
    /// Index of the triangle.
    pub triangle: u32,
    /// Weights of its three corners, from 0 up, summing to 1.
    pub barycentric: [f64; 3],
}

impl SurfacePlace {
    /// The point of `triangle` nearest to `p`, m, which is on it up to rounding.
    #[must_use]
    pub fn in_triangle(topology: &Topology, triangle: u32, p: DVec3) -> Self {
        Self { triangle, barycentric: barycentric(topology.corners(triangle), p) }
    }

    /// It moved slightly off the edges of its triangle.
    #[must_use]
    pub fn inward(self) -> Self {
        let barycentric = self.barycentric.map(|weight| weight * (1.0 - 3.0 * EDGE_MARGIN) + EDGE_MARGIN);
        Self { barycentric, ..self }
    }

    /// Its position, m.
    #[must_use]
    pub fn position(&self, topology: &Topology) -> DVec3 {
        let [a, b, c] = topology.corners(self.triangle);
        a * self.barycentric[0] + b * self.barycentric[1] + c * self.barycentric[2]
    }
}

/// The barycentric coordinates of `p` in the triangle, none of them negative.
pub fn barycentric([a, b, c]: [DVec3; 3], p: DVec3) -> [f64; 3] {
    let normal = (b - a).cross(c - a);
    let part = |from: DVec3, to: DVec3| normal.dot((to - from).cross(p - from)).max(0.0);
    let parts = [part(b, c), part(c, a), part(a, b)];
    let sum: f64 = parts.iter().sum();
    if sum > 0.0 { parts.map(|part| part / sum) } else { [1.0, 0.0, 0.0] }
}
