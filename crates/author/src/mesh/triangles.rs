//! Triangles as mesh formats have them: often without shared corners.

use std::collections::HashMap;

use glam::{DAffine3, DVec3};

use crate::body::MeshData;
use crate::error::{Result, failed};
use crate::limits::{MAX_TRIANGLES, MAX_VERTICES};

/// A triangle mesh, m.
#[derive(Clone, Debug, Default)]
pub(super) struct Triangles {
    pub(super) positions: Vec<DVec3>,
    /// Counter-clockwise seen from outside.
    pub(super) triangles: Vec<[u32; 3]>,
}

impl Triangles {
    /// Adds another mesh.
    pub(super) fn extend(&mut self, other: &Self) {
        let first = self.positions.len() as u32;
        self.positions.extend(&other.positions);
        self.triangles.extend(other.triangles.iter().map(|triangle| triangle.map(|v| v + first)));
    }

    /// Adds another mesh where `way` puts it; what was outside stays outside, also if `way` mirrors.
    pub(super) fn extend_placed(&mut self, other: &Self, way: &DAffine3) {
        let first = self.positions.len() as u32;
        self.positions.extend(other.positions.iter().map(|&p| way.transform_point3(p)));
        let is_mirror = way.matrix3.determinant() < 0.0;
        self.triangles.extend(other.triangles.iter().map(|&[a, b, c]| {
            let triangle = if is_mirror { [a, c, b] } else { [a, b, c] };
            triangle.map(|v| v + first)
        }));
    }

    /// Whether `other` can be added, within the limits of a body.
    pub(super) fn check_room_for(&self, other: &Self) -> Result<()> {
        Room { triangles: self.triangles.len(), vertices: self.positions.len() }.take(other)
    }

    /// Adds a face of any number of corners as triangles around its first one: right for convex faces, as nearly all are.
    pub(super) fn fan(&mut self, corners: &[u32]) {
        self.triangles.extend((2..corners.len()).map(|at| [corners[0], corners[at - 1], corners[at]]));
    }

    /// Transforms it; what was outside stays outside, also if `way` mirrors.
    pub(super) fn transform(&mut self, way: &DAffine3) {
        self.positions.iter_mut().for_each(|p| *p = way.transform_point3(*p));
        if way.matrix3.determinant() < 0.0 {
            self.triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
        }
    }

    /// The diagonal of its box.
    pub(super) fn size_m(&self) -> f64 {
        let (low, high) =
            self.positions.iter().fold((DVec3::MAX, DVec3::MIN), |(low, high), &p| (low.min(p), high.max(p)));
        if self.positions.is_empty() { 0.0 } else { low.distance(high) }
    }

    /// Whether every corner is a finite number, and exists.
    pub(super) fn is_sound(&self) -> bool {
        let count = self.positions.len();
        self.positions.iter().all(|p| p.is_finite() && p.abs().max_element() < 1e9)
            && self.triangles.iter().flatten().all(|&v| (v as usize) < count)
    }

    /// As it is written: corners at one place are one, and normals are the mean of those of the triangles around.
    pub(super) fn into_mesh_data(self) -> MeshData {
        let mut index_of: HashMap<[u32; 3], u32> = HashMap::new();
        let mut mesh = MeshData::default();
        let mut normals: Vec<DVec3> = Vec::new();
        let mut places: Vec<DVec3> = Vec::new();
        let welded: Vec<u32> = self
            .positions
            .iter()
            .map(|&p| {
                // −0 and 0 are one place.
                let place = p.as_vec3().to_array().map(|x| x + 0.0);
                *index_of.entry(place.map(f32::to_bits)).or_insert_with(|| {
                    mesh.positions.push(place);
                    normals.push(DVec3::ZERO);
                    places.push(p);
                    mesh.positions.len() as u32 - 1
                })
            })
            .collect();
        for triangle in &self.triangles {
            let [a, b, c] = triangle.map(|v| welded[v as usize]);
            if a == b || b == c || c == a {
                continue;
            }
            let [p, q, r] = [a, b, c].map(|v| places[v as usize]);
            let area = (q - p).cross(r - p);
            [a, b, c].into_iter().for_each(|v| normals[v as usize] += area);
            mesh.triangles.push([a, b, c]);
        }
        mesh.normals =
            normals.into_iter().map(|n| n.try_normalize().unwrap_or(DVec3::Y).as_vec3().to_array()).collect();
        mesh
    }
}

/// How much the meshes of a file have together.
#[derive(Debug, Default)]
pub(super) struct Room {
    triangles: usize,
    vertices: usize,
}

impl Room {
    /// Counts `mesh`, unless that is beyond the limits of a body.
    pub(super) fn take(&mut self, mesh: &Triangles) -> Result<()> {
        self.triangles += mesh.triangles.len();
        self.vertices += mesh.positions.len();
        for (have, most, what) in
            [(self.triangles, MAX_TRIANGLES, "triangles"), (self.vertices, MAX_VERTICES, "vertices")]
        {
            if have > most {
                return Err(failed!("its meshes have over {most} {what} where they are placed; reduce them"));
            }
        }
        Ok(())
    }
}

/// `number` as a count or an index, if it is one.
pub(super) fn whole(number: f64) -> Option<u32> {
    (number.fract() == 0.0 && (0.0..=f64::from(u32::MAX)).contains(&number)).then_some(number as u32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_at_one_place_are_one_and_flat_triangles_go() {
        let (a, b, c, d) = (DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::X + DVec3::Y);
        let soup =
            Triangles { positions: vec![a, b, c, b, d, c, a, a, b], triangles: vec![[0, 1, 2], [3, 4, 5], [6, 7, 8]] };
        let mesh = soup.into_mesh_data();
        assert_eq!((mesh.positions.len(), mesh.triangles.len()), (4, 2));
        assert!(mesh.normals.iter().all(|n| *n == [0.0, 0.0, 1.0]));
    }

    #[test]
    fn a_mirror_keeps_the_outside_outside() {
        let mut one = Triangles { positions: vec![DVec3::ZERO, DVec3::X, DVec3::Y], triangles: vec![[0, 1, 2]] };
        one.transform(&DAffine3::from_scale(DVec3::new(-2.0, 1.0, 1.0)));
        let mesh = one.into_mesh_data();
        assert_eq!(mesh.normals[0], [0.0, 0.0, 1.0]);
    }
}
