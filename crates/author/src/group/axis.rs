//! The axis that a part of the surface goes around.

use glam::{DMat3, DVec3};

/// The unit vector most perpendicular to `normals`.
pub(super) fn least_axis(normals: &[DVec3]) -> DVec3 {
    let products = |m: DMat3, n: &DVec3| m + DMat3::from_cols(*n * n.x, *n * n.y, *n * n.z);
    let moments = normals.iter().fold(DMat3::ZERO, products);
    let trace = moments.x_axis.x + moments.y_axis.y + moments.z_axis.z;
    let inverted = DMat3::from_diagonal(DVec3::splat(trace)) - moments;
    // Power iteration, from a vector that is perpendicular to no axis.
    (0..200).fold(DVec3::new(0.48, 0.6, 0.64), |axis, _| (inverted * axis).try_normalize().unwrap_or(axis))
}
