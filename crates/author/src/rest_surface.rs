//! All surfaces of a body in the body at rest, to place taxels on.

use std::cell::OnceCell;
use std::collections::BTreeSet;

use glam::{DAffine3, DMat3, DVec3};

use super::placed::Placed;
use crate::body::{
    Body, Details, Home, Modality, Paint, Skinning, Taxel, Topology, area_vector, blend_skinning, merged_skinning,
};
use crate::error::{Result, failed, suggestion};
use crate::field::surface_groups;

/// All surfaces of a body as one mesh.
pub(super) struct RestSurface<'a> {
    pub(super) body: &'a Body,
    pub(super) details: &'a Details,
    /// Vertices in the body at rest, m.
    pub(super) positions: Vec<DVec3>,
    /// Counter-clockwise seen from outside, mirrored nodes corrected.
    pub(super) triangles: Vec<[u32; 3]>,
    /// Per triangle its part and its index in the part.
    pub(super) origin: Vec<(u32, u32)>,
    /// Per triangle its link, or the one with the largest weight.
    pub(super) link: Vec<u32>,
    /// Per part its first vertex.
    first_vertex: Vec<u32>,
    /// Per part the group of surfaces that it is in.
    group: Vec<u32>,
    /// Per part the four joints with the largest weights for each vertex.
    skinning: Vec<Option<Skinning>>,
    topology: OnceCell<Topology>,
}

/// A taxel in the coordinates of its mesh, as it is written.
pub(super) struct MeshTaxel {
    pub(super) part: usize,
    /// The taxel; position, normal and area are in the mesh's coordinates.
    pub(super) taxel: Taxel,
    /// Its joints and weights on a skinned mesh.
    pub(super) carriers: Option<([u16; 4], [f32; 4])>,
}

impl<'a> RestSurface<'a> {
    pub(super) fn new(body: &'a Body, details: &'a Details) -> Self {
        let mut rest_surface = Self {
            body,
            details,
            positions: Vec::new(),
            triangles: Vec::new(),
            origin: Vec::new(),
            link: Vec::new(),
            first_vertex: Vec::new(),
            group: surface_groups(body),
            skinning: Vec::new(),
            topology: OnceCell::new(),
        };
        for part in 0..body.surfaces.len() {
            rest_surface.take(part);
        }
        rest_surface
    }

    fn take(&mut self, part: usize) {
        let surface = &self.body.surfaces[part];
        let first = self.positions.len() as u32;
        self.first_vertex.push(first);
        let in_body = |link: usize, link_from_mesh: &DAffine3| self.body.links[link].body_from_link * *link_from_mesh;
        let (skinning, body_from_mesh) = match &surface.home {
            Home::Rigid { link, link_from_mesh } => (None, vec![in_body(*link, link_from_mesh)]),
            Home::Skinned { joints, heaviest, at_rest } => {
                let skinning = merged_skinning(&self.details.parts[part].carriers, joints.len(), heaviest);
                self.positions.extend_from_slice(at_rest);
                (Some(skinning), joints.iter().map(|(link, link_from_mesh)| in_body(*link, link_from_mesh)).collect())
            }
        };
        if skinning.is_none() {
            self.positions.extend(surface.positions.iter().map(|&p| body_from_mesh[0].transform_point3(p)));
        }
        for (index, &[a, b, c]) in surface.triangles.iter().enumerate() {
            let joint = skinning.as_ref().map(|skinning| blend_skinning(skinning, [a, b, c], [1.0 / 3.0; 3]).0[0]);
            let joint = usize::from(joint.unwrap_or(0));
            let link = match &surface.home {
                Home::Rigid { link, .. } => *link,
                Home::Skinned { joints, .. } => joints[joint].0,
            };
            let mirrored = body_from_mesh[joint].matrix3.determinant() < 0.0;
            let [b, c] = if mirrored { [c, b] } else { [b, c] };
            self.triangles.push([first + a, first + b, first + c]);
            self.origin.push((part as u32, index as u32));
            self.link.push(link as u32);
        }
        self.skinning.push(skinning);
    }

    /// The group of surfaces that `vertex` is in; only those of one group are connected where they touch.
    pub(super) fn group_of(&self, vertex: u32) -> u32 {
        let part = self.first_vertex.partition_point(|&first| first <= vertex) - 1;
        self.group[part]
    }

    pub(super) fn topology(&self) -> &Topology {
        self.topology.get_or_init(|| Topology::new(&self.positions, &self.triangles))
    }

    /// The corners of `triangle` in the body, m.
    pub(super) fn corners(&self, triangle: usize) -> [DVec3; 3] {
        self.triangles[triangle].map(|v| self.positions[v as usize])
    }

    /// The area of `triangle`, m².
    pub(super) fn area(&self, triangle: usize) -> f64 {
        area_vector(self.corners(triangle)).length() / 2.0
    }

    /// Whether `triangle` is one of `link`, or on a skinned mesh one that moves with it to some extent.
    pub(super) fn carries(&self, triangle: usize, link: usize) -> bool {
        let part = self.origin[triangle].0 as usize;
        let (Home::Skinned { joints, .. }, Some(skinning)) = (&self.body.surfaces[part].home, &self.skinning[part])
        else {
            return self.link[triangle] as usize == link;
        };
        let is_held = |corner: u32| {
            let vertex = (corner - self.first_vertex[part]) as usize;
            let mut held = skinning.joints[vertex].iter().zip(&skinning.weights[vertex]);
            held.any(|(&joint, &weight)| weight > 0.0 && joints[usize::from(joint)].0 == link)
        };
        self.triangles[triangle].into_iter().any(is_held)
    }

    /// The numbers painted as `name` (`_DENSITY`, `COLOR_0.r`), per vertex; `None` on parts without it, an error if no part has it.
    pub(super) fn painted(&self, name: &str) -> Result<Vec<Option<f64>>> {
        let mut values = vec![None; self.positions.len()];
        let mut found = false;
        for (part, &first) in self.details.parts.iter().zip(&self.first_vertex) {
            let column = part.paints.iter().find_map(|paint| Some((paint, paint.column(name)?)));
            let Some((paint, column)) = column else { continue };
            found = true;
            for (vertex, row) in paint.values.chunks_exact(paint.width).enumerate() {
                values[first as usize + vertex] = Some(f64::from(row[column]));
            }
        }
        if found {
            return Ok(values);
        }
        let known: Vec<String> =
            self.details.parts.iter().flat_map(|part| &part.paints).flat_map(Paint::names).collect();
        let hint = match known.is_empty() {
            true => "in Blender begin its name with an underscore, and export with `Attributes` on".to_owned(),
            false => suggestion(name, known.iter().map(String::as_str)),
        };
        Err(failed!("no mesh has an attribute `{name}`; {hint}"))
    }

    /// The taxel `id` at `placed`, whose triangle is one of this surface. On a skinned mesh it rides on the heaviest of `links`.
    pub(super) fn mesh_taxel(
        &self,
        placed: &Placed,
        id: u32,
        (modality, tangent_in_body): (Modality, Option<DVec3>),
        links: &BTreeSet<u32>,
    ) -> MeshTaxel {
        let (part, index) = self.origin[placed.triangle];
        let part = part as usize;
        let surface = &self.body.surfaces[part];
        let first = self.first_vertex[part];
        let corners = self.triangles[placed.triangle].map(|v| v - first);
        let at = |corner: usize| surface.positions[corners[corner] as usize] * placed.barycentric[corner];
        let in_mesh = surface.triangles[index as usize].map(|v| surface.positions[v as usize]);
        let normal = area_vector(in_mesh).normalize_or_zero();
        let mut carriers =
            self.skinning[part].as_ref().map(|skinning| blend_skinning(skinning, corners, placed.barycentric));
        if let (Home::Skinned { joints, .. }, Some((own, _))) = (&surface.home, &mut carriers) {
            // At the rim of a region, the heaviest joint may be one outside: it changes places with one inside.
            let is_inside = |joint: u16| links.contains(&(joints[usize::from(joint)].0 as u32));
            let slot = own.iter().position(|&joint| is_inside(joint)).unwrap_or(0);
            own.swap(0, slot);
        }
        let (link, link_from_mesh) = match (&surface.home, &carriers) {
            (Home::Rigid { link, link_from_mesh }, _) => (*link, *link_from_mesh),
            (Home::Skinned { joints, .. }, carriers) => {
                joints[carriers.map_or(0, |(joints, _)| usize::from(joints[0]))]
            }
        };
        // How much the transform to the link stretches areas.
        let DMat3 { x_axis: x, y_axis: y, z_axis: z } = link_from_mesh.matrix3;
        let stretch = (DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y)) * normal).length();
        let area = if stretch > 0.0 { placed.point.area / stretch } else { 0.0 };
        let position_in_link = at(0) + at(1) + at(2);
        let mesh_from_body = (self.body.links[link].body_from_link * link_from_mesh).inverse();
        let tangent_in_link = tangent_in_body.map(|tangent| mesh_from_body.transform_vector3(tangent).normalize());
        let taxel = Taxel { id, link, position_in_link, normal_in_link: normal, area, modality, tangent_in_link };
        MeshTaxel { part, taxel, carriers }
    }
}
