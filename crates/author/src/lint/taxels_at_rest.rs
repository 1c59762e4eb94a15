//! Where the taxels of a body are at rest, on skinned meshes as well.

use std::cell::OnceCell;

use glam::{DAffine3, DVec3};

use super::posed_surface::{BodyPoint, START_M, is_skin_mirrored};

use crate::body::{Body, Home, Surface, SurfaceIndex, Taxel, area_vector};
use crate::field::geodesic::barycentric;

/// Where each taxel of `body` is at rest. One on a skinned mesh is where the weights of the joints put the surface there, which is not
/// where its own link alone would.
pub(super) fn taxels_at_rest(body: &Body) -> Vec<BodyPoint> {
    let rest: Vec<DAffine3> = body.links.iter().map(|link| link.body_from_link).collect();
    let skins: Vec<Skin<'_>> = body.surfaces.iter().filter_map(|surface| Skin::at_rest(surface, &rest)).collect();
    let point = |taxel: &Taxel| {
        let on_skin = skins.iter().filter_map(|skin| skin.point(taxel));
        let nearest = on_skin.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, point)| point);
        let way = &rest[taxel.link];
        nearest.unwrap_or_else(|| BodyPoint {
            link: taxel.link,
            position: way.transform_point3(taxel.position_in_link),
            normal: way.transform_vector3(taxel.normal_in_link),
        })
    };
    body.taxels.iter().map(point).collect()
}

/// A skinned mesh.
struct Skin<'a> {
    surface: &'a Surface,
    joints: &'a [(usize, DAffine3)],
    at_rest: &'a [DVec3],
    is_mirrored: bool,
    /// Its triangles in its own coordinates.
    index: OnceCell<SurfaceIndex>,
}

impl<'a> Skin<'a> {
    fn at_rest(surface: &'a Surface, rest: &[DAffine3]) -> Option<Self> {
        let Home::Skinned { joints, at_rest, .. } = &surface.home else { return None };
        let is_mirrored = is_skin_mirrored(joints, rest);
        Some(Self { surface, joints, at_rest, is_mirrored, index: OnceCell::new() })
    }

    /// Where `taxel` is, if it is on this mesh, and how far from it, m.
    fn point(&self, taxel: &Taxel) -> Option<(f64, BodyPoint)> {
        let (_, link_from_mesh) = self.joints.iter().find(|(link, _)| *link == taxel.link)?;
        let mesh_from_link = link_from_mesh.inverse();
        let at = mesh_from_link.transform_point3(taxel.position_in_link);
        if !at.is_finite() {
            return None;
        }
        let positions = &self.surface.positions;
        let corners = |triangle: &[u32; 3]| triangle.map(|v| positions[v as usize]);
        let index = self.index.get_or_init(|| SurfaceIndex::of_triangles(self.surface.triangles.iter().map(corners)));
        let facing = (link_from_mesh.matrix3.transpose() * taxel.normal_in_link).normalize_or_zero();
        let hit = index.nearest_facing(at, facing)?;
        let away_m = link_from_mesh.transform_point3(hit.position).distance(taxel.position_in_link);
        if away_m > START_M {
            return None;
        }
        let triangle = self.surface.triangles[hit.triangle];
        let weights = barycentric(corners(&triangle), hit.position);
        let [a, b, c] = triangle.map(|v| self.at_rest[v as usize]);
        let outward = area_vector(if self.is_mirrored { [a, c, b] } else { [a, b, c] }).try_normalize()?;
        let is_inward = hit.normal.dot(facing) < 0.0;
        let position = a * weights[0] + b * weights[1] + c * weights[2];
        Some((away_m, BodyPoint { link: taxel.link, position, normal: if is_inward { -outward } else { outward } }))
    }
}
