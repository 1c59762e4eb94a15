//! Joints and weights of points on a skinned surface.

use glam::{DAffine3, DVec3};
use gltf::json::mesh::{Primitive, Semantic};

use super::document::Document;
use super::glb::Skinning;
use super::primitives::attribute;
use crate::error::Result;

/// The joints and weights of the point at `barycentric` of the triangle `corners`: those of its corners, blended, and
/// reduced by [`heaviest_four`].
///
/// # Panics
/// A corner is not a vertex of `skinning`.
#[must_use]
pub fn blend_skinning(skinning: &Skinning, corners: [u32; 3], barycentric: [f64; 3]) -> ([u16; 4], [f32; 4]) {
    let mut carriers: Vec<(u16, f64)> = Vec::new();
    for (corner, part) in corners.into_iter().zip(barycentric) {
        let vertex = corner as usize;
        for (&joint, &weight) in skinning.joints[vertex].iter().zip(&skinning.weights[vertex]) {
            let weight = part * f64::from(weight);
            match carriers.iter_mut().find(|(known, _)| *known == joint) {
                Some((_, sum)) => *sum += weight,
                None => carriers.push((joint, weight)),
            }
        }
    }
    heaviest_four(carriers)
}

/// The four largest weights of `carriers` (joint, weight), in descending order and normalised to the sum 1, as a row of
/// [`Skinning`]. Unused entries are joint 0 with weight 0.
#[must_use]
pub fn heaviest_four(mut carriers: Vec<(u16, f64)>) -> ([u16; 4], [f32; 4]) {
    carriers.retain(|(_, weight)| *weight > 0.0);
    carriers.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
    carriers.truncate(4);
    let sum: f64 = carriers.iter().map(|(_, weight)| weight).sum();
    let (mut joints, mut weights) = ([0; 4], [0.0; 4]);
    for (slot, (joint, weight)) in carriers.into_iter().enumerate() {
        joints[slot] = joint;
        weights[slot] = (weight / sum) as f32;
    }
    (joints, weights)
}

/// All sets of joints and weights; their lengths were checked when the body was read.
pub(super) fn carriers(document: &Document, primitive: &Primitive) -> Result<Vec<Skinning>> {
    let mut sets = Vec::new();
    while let (Some(joints), Some(weights)) = (
        attribute(primitive, &Semantic::Joints(sets.len() as u32)),
        attribute(primitive, &Semantic::Weights(sets.len() as u32)),
    ) {
        let joints = document.integers::<4>(joints)?;
        let joints = joints.into_iter().map(|row| row.map(|joint| u16::try_from(joint).unwrap_or(u16::MAX))).collect();
        sets.push(Skinning { joints, weights: document.floats::<4>(weights)? });
    }
    Ok(sets)
}

/// Per vertex the four joints with the largest weights of all `sets`, of a skin with `joints`; a vertex without weights gets the joint in
/// `heaviest`.
pub fn merged_skinning(sets: &[Skinning], joints: usize, heaviest: &[usize]) -> Skinning {
    let mut merged = Skinning::default();
    for (vertex, &heaviest) in heaviest.iter().enumerate() {
        let rows = sets.iter().flat_map(|set| set.joints[vertex].into_iter().zip(set.weights[vertex]));
        let mut carriers: Vec<(u16, f64)> = Vec::new();
        for (joint, weight) in rows.filter(|&(joint, weight)| usize::from(joint) < joints && weight.is_finite()) {
            match carriers.iter_mut().find(|(known, _)| *known == joint) {
                Some((_, sum)) => *sum += f64::from(weight),
                None => carriers.push((joint, f64::from(weight))),
            }
        }
        let (mut row, mut weights) = heaviest_four(carriers);
        if weights[0] == 0.0 {
            (row[0], weights[0]) = (heaviest as u16, 1.0);
        }
        merged.joints.push(row);
        merged.weights.push(weights);
    }
    merged
}

/// The vertices `positions` of `primitive` where their joints put them by their weights: `ways` has the transform of each joint,
/// `heaviest` the heaviest joint of each vertex.
pub(super) fn skinned_vertices(
    document: &Document,
    primitive: &Primitive,
    positions: &[DVec3],
    heaviest: &[usize],
    ways: &[DAffine3],
) -> Result<Vec<DVec3>> {
    let skinning = merged_skinning(&carriers(document, primitive)?, ways.len(), heaviest);
    let at = |(vertex, &p): (usize, &DVec3)| {
        let rows = skinning.joints[vertex].iter().zip(&skinning.weights[vertex]);
        let carried = rows.filter(|(_, weight)| **weight > 0.0);
        carried.map(|(&joint, &weight)| ways[usize::from(joint)].transform_point3(p) * f64::from(weight)).sum()
    };
    Ok(positions.iter().enumerate().map(at).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blended_weights_keep_the_heaviest_four_and_sum_to_one() {
        let skinning = Skinning {
            joints: vec![[0, 1, 2, 3], [1, 4, 0, 0], [5, 0, 0, 0]],
            weights: vec![[0.4, 0.3, 0.2, 0.1], [0.5, 0.5, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0]],
        };
        let (joints, weights) = blend_skinning(&skinning, [0, 1, 2], [0.5, 0.3, 0.2]);
        assert_eq!(joints, [1, 0, 5, 4]);
        assert!((weights.iter().sum::<f32>() - 1.0).abs() < 1e-6);
        assert!((f64::from(weights[0]) - 0.3 / 0.85).abs() < 1e-6);
    }
}
