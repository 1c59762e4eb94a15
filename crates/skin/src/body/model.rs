//! A body: links, surfaces, taxels and field specifications.

use glam::{DAffine3, DMat3, DVec3};

use super::axes::{Up, WORLD_FROM_BODY};
use super::joint::LinkJoint;
use super::kept::Kept;
use super::layout::FieldSpec;
use super::stored_edges::StoredEdges;
use super::tangents::tangent_frame;

/// A rigid part of a robot, from a glTF node.
#[derive(Clone, Debug)]
pub struct Link {
    /// The node's name, made unique within the body.
    pub name: String,
    /// Index of the parent link, if any.
    pub parent: Option<usize>,
    /// Rigid pose in the body at rest, in the body's axes: body_from_link. [`Link::world_from_link`] has it in the world.
    pub body_from_link: DAffine3,
    /// The node's scale and shear: link_from_node.
    pub link_from_node: DAffine3,
    /// How it moves against its parent, if the file has that and it moves.
    pub joint: Option<LinkJoint>,
    /// If it was made from the root of a URDF: the axis that points up there.
    pub urdf_up: Option<Up>,
}

impl Link {
    /// Rigid pose in the world, with the body at rest.
    #[must_use]
    pub fn world_from_link(&self) -> DAffine3 {
        WORLD_FROM_BODY * self.body_from_link
    }
}

/// The triangles of one mesh, in the mesh's own coordinates.
#[derive(Clone, Debug)]
pub struct Surface {
    /// Name of the node that shows it.
    pub name: String,
    /// Vertices in the mesh's coordinates.
    pub positions: Vec<DVec3>,
    /// Vertex indices, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
    /// Its link or joints.
    pub home: Home,
}

/// The link or joints that move a mesh.
#[derive(Clone, Debug)]
pub enum Home {
    /// A rigid mesh of one link.
    Rigid {
        /// The link.
        link: usize,
        /// Takes mesh coordinates to the link's frame.
        link_from_mesh: DAffine3,
    },
    /// A skinned mesh; its node's transform is ignored.
    Skinned {
        /// Per joint its link, and link_from_mesh at bind.
        joints: Vec<(usize, DAffine3)>,
        /// Per vertex the joint with the largest weight.
        heaviest: Vec<usize>,
        /// Per vertex where its four joints with the largest weights put it in the body at rest, m.
        at_rest: Vec<DVec3>,
    },
}

impl Surface {
    /// Takes mesh coordinates to the frame of `link`: at bind for a skinned mesh, at rest for a rigid one.
    #[doc(hidden)]
    pub fn link_from_mesh(&self, body: &Body, link: usize) -> Option<DAffine3> {
        match &self.home {
            Home::Rigid { link: carrier, link_from_mesh } => {
                Some(body.rest_transform(link, *carrier) * *link_from_mesh)
            }
            Home::Skinned { joints, .. } => joints
                .iter()
                .find(|(joint, _)| *joint == link)
                .or(joints.first())
                .map(|(joint, joint_from_mesh)| body.rest_transform(link, *joint) * *joint_from_mesh),
        }
    }

    /// Whether `link` moves it, alone or as a joint.
    #[doc(hidden)]
    pub fn is_carried_by(&self, link: usize) -> bool {
        match &self.home {
            Home::Rigid { link: carrier, .. } => *carrier == link,
            Home::Skinned { joints, .. } => joints.iter().any(|(joint, _)| *joint == link),
        }
    }

    /// The corners of its triangles, transformed by `way`, counter-clockwise seen from outside.
    #[doc(hidden)]
    pub fn corners_through(&self, way: DAffine3) -> impl Iterator<Item = [DVec3; 3]> + '_ {
        let mirrored = way.matrix3.determinant() < 0.0;
        let points: Vec<DVec3> = self.positions.iter().map(|&p| way.transform_point3(p)).collect();
        self.triangles.iter().map(move |triangle| {
            let [a, b, c] = triangle.map(|v| points[v as usize]);
            if mirrored { [a, c, b] } else { [a, b, c] }
        })
    }

    /// The link of vertex `vertex`, or the one with the largest weight.
    #[must_use]
    pub fn carrier(&self, vertex: usize) -> usize {
        match &self.home {
            Home::Rigid { link, .. } => *link,
            Home::Skinned { joints, heaviest, .. } => joints[heaviest[vertex]].0,
        }
    }
}

/// What a taxel measures.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Modality {
    /// Normal force or pressure.
    #[default]
    Pressure,
    /// Temperature.
    Temperature,
    /// Proximity.
    Proximity,
    /// Force along three axes: the normal, and two tangents of the skin.
    Force3,
    /// An unknown modality code.
    Other(u32),
}

impl Modality {
    const KNOWN: [(Self, &str); 4] = [
        (Self::Pressure, "pressure"),
        (Self::Temperature, "temperature"),
        (Self::Proximity, "proximity"),
        (Self::Force3, "force3"),
    ];

    /// The names of all kinds that there are.
    pub fn names() -> impl Iterator<Item = &'static str> {
        Self::KNOWN.into_iter().map(|(_, name)| name)
    }

    /// Whether it feels what presses on it: pressure, also as the normal part of a force.
    #[must_use]
    pub fn is_pressed(self) -> bool {
        matches!(self, Self::Pressure | Self::Force3)
    }

    /// The modality with the number that the layout stores.
    #[must_use]
    pub fn from_code(code: u32) -> Self {
        Self::KNOWN.get(code as usize).map_or(Self::Other(code), |(known, _)| *known)
    }

    /// The number that the layout stores.
    #[must_use]
    pub fn code(self) -> u32 {
        match self {
            Self::Pressure => 0,
            Self::Temperature => 1,
            Self::Proximity => 2,
            Self::Force3 => 3,
            Self::Other(code) => code,
        }
    }

    /// The name for people and JSON.
    #[must_use]
    pub fn name(self) -> String {
        let known = Self::KNOWN.into_iter().find(|(known, _)| *known == self);
        known.map_or_else(|| format!("modality {}", self.code()), |(_, name)| name.to_owned())
    }
}

/// One sensor on the surface.
#[derive(Clone, Debug, PartialEq)]
pub struct Taxel {
    /// Stable id, unique in the body, at most [`crate::body::MAX_TAXEL_ID`].
    pub id: u32,
    /// Index of its link.
    pub link: usize,
    /// Position in the link's frame, m.
    pub position_in_link: DVec3,
    /// Outward unit normal in the link's frame.
    pub normal_in_link: DVec3,
    /// Its area, m²; 0 if unknown.
    pub area: f64,
    /// What it measures.
    pub modality: Modality,
    /// Of a taxel of [`Modality::Force3`], the unit tangent along which its second value is; the third is along n × t. `None` is
    /// the link's x as far as it is tangential, or its z where x is within 10° of the normal.
    pub tangent_in_link: Option<DVec3>,
}

impl Taxel {
    /// The directions of its second and third value in the link, units at right angles to the normal and to each other.
    #[must_use]
    pub fn tangents_in_link(&self) -> [DVec3; 2] {
        let [u, v, _] = tangent_frame(self.normal_in_link, self.tangent_in_link);
        [u, v]
    }
}

/// A robot's shape, taxels and fields.
#[derive(Clone, Debug)]
pub struct Body {
    /// The file's name, or the name given to the loader.
    pub name: String,
    /// Links; a parent comes before its children.
    pub links: Vec<Link>,
    /// Triangles, per mesh.
    pub surfaces: Vec<Surface>,
    /// Taxels by ascending id.
    pub taxels: Vec<Taxel>,
    /// Field specifications, a parent before its children.
    pub fields: Vec<FieldSpec>,
    /// The edges between taxels that the file holds, current or not.
    pub edges: Option<StoredEdges>,
    /// Problems of the file that do not prevent its use.
    pub findings: Vec<String>,
    /// What was worked out of its shape once; [`Default`] for a new body.
    #[doc(hidden)]
    pub kept: Kept,
}

impl Body {
    /// Index of the taxel with `id`.
    #[must_use]
    pub fn taxel_index(&self, id: u32) -> Option<usize> {
        self.taxels.binary_search_by_key(&id, |taxel| taxel.id).ok()
    }

    /// Index of the link called `name`.
    #[must_use]
    pub fn link_index(&self, name: &str) -> Option<usize> {
        self.links.iter().position(|link| link.name == name)
    }

    /// The lowest common ancestor of `links`, possibly one of them. `None` for links of separate trees, or no links.
    #[must_use]
    pub fn common_ancestor(&self, links: impl IntoIterator<Item = usize>) -> Option<usize> {
        let mut common: Option<Vec<usize>> = None;
        for link in links {
            let path = self.path_from_root(link);
            common = Some(match common {
                None => path,
                Some(known) => known.iter().zip(&path).take_while(|(a, b)| a == b).map(|(a, _)| *a).collect(),
            });
        }
        common?.last().copied()
    }

    /// At rest, the transform that takes coordinates in link `from` to coordinates in link `to`.
    #[must_use]
    pub fn rest_transform(&self, to: usize, from: usize) -> DAffine3 {
        if to == from {
            return DAffine3::IDENTITY;
        }
        self.links[to].body_from_link.inverse() * self.links[from].body_from_link
    }

    /// If it was made from a URDF: the axis that points up there.
    #[must_use]
    pub fn urdf_up(&self) -> Option<Up> {
        self.links.iter().find_map(|link| link.urdf_up)
    }

    /// From the root down to `link`, itself included.
    #[doc(hidden)]
    pub fn path_from_root(&self, link: usize) -> Vec<usize> {
        let mut path: Vec<usize> = std::iter::successors(Some(link), |&link| self.links[link].parent).collect();
        path.reverse();
        path
    }
}

/// The rigid part of `body_from_node`: its translation, and its axes made orthonormal and right-handed.
///
/// A transform whose axes are orthonormal to 1e-6 is returned unchanged.
pub(super) fn rigid_part(body_from_node: &DAffine3) -> DAffine3 {
    let m = body_from_node.matrix3;
    let right_handed = m.determinant() > 0.0;
    let skew = (m.transpose() * m - DMat3::IDENTITY).to_cols_array();
    if right_handed && skew.iter().all(|e| e.abs() < 1e-6) {
        return *body_from_node;
    }
    let unit = |v: DVec3, or: DVec3| v.try_normalize().unwrap_or(or);
    let x = unit(m.x_axis, DVec3::X);
    let y = unit(m.y_axis - x * x.dot(m.y_axis), x.any_orthonormal_vector());
    DAffine3::from_mat3_translation(DMat3::from_cols(x, y, x.cross(y)), body_from_node.translation)
}
