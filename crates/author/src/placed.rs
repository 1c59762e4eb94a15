//! Points placed on a surface.

use glam::DVec3;

use crate::error::{Error, Result};
use crate::field::CellPoint;

/// cos 90° with a tolerance for rounding: the two faces at a box's edge are neighbours, those of a sharper edge are not.
const MIN_NORMAL_COSINE: f64 = -1e-9;

/// Taxels nearer to each other than this are coincident, m.
pub(super) const COINCIDENT_M: f64 = crate::field::COINCIDENT_M;

/// A point on a surface, in the coordinates of its mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// Its position, m.
    pub position: DVec3,
    /// Outward unit normal.
    pub normal: DVec3,
    /// The area of its cell: the surface nearer to it than to other points, by paths along the surface, m².
    pub area: f64,
}

/// A point and its place on the mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placed {
    /// The point; its normal is that of the triangle.
    pub point: SurfacePoint,
    /// Index of the triangle.
    pub triangle: usize,
    /// Weights of the triangle's three corners, summing to 1.
    pub barycentric: [f64; 3],
}

impl Placed {
    pub(super) fn cell_point(&self) -> CellPoint {
        let SurfacePoint { position, normal, .. } = self.point;
        CellPoint { position, normal, triangle: self.triangle }
    }
}

/// Whether two samples are on the same side of a part: normals over 90° apart belong to two sides of a thin part.
pub(super) fn same_side(a: &Placed, b: &Placed) -> bool {
    points_on_same_side(&a.point, &b.point)
}

/// The same for two points.
pub(super) fn points_on_same_side(a: &SurfacePoint, b: &SurfacePoint) -> bool {
    a.normal.dot(b.normal) > MIN_NORMAL_COSINE
}

/// Called with the share of the work that is done; says whether to go on.
pub type Progress<'a> = &'a mut dyn FnMut(f64) -> bool;

/// Calls `progress`; an error where it says to stop.
pub(super) fn report_progress(progress: Progress<'_>, share: f64) -> Result<()> {
    if progress(share) { Ok(()) } else { Err(Error::failed("stopped before all taxels were placed")) }
}
