//! Bodies: links, their surfaces, and the taxels and field outlines authored on them, read from and written to glTF.
//!
//! A [`Body`] is what a glTF file says, checked and brought to metres; it knows nothing of channels, calibration or
//! percepts. `docs/layout.md` specifies the encoding.
//!
//! **Frames.** Every glTF node that is not itself a set of taxels or a field is a [`Link`]. A link's frame is the
//! node's frame with scale and shear taken out, so that coordinates in it are metres whatever the file's units; a
//! mirrored or scaled node keeps its rigid part as the frame and its points are stretched into it.

mod amend;
mod beside;
mod details;
mod document;
mod glb;
mod layout;
mod mend;
mod nodes;
mod original;
mod read;
mod splice;
mod strip;
mod surface;
mod topology;

use std::path::{Path, PathBuf};

use glam::{DAffine3, DMat3, DVec3};

pub use details::{Details, Mark, Paint, Part, TaxelSource};
pub use glb::{Glb, MeshData, Skinning};
pub use layout::{ChartKind, ChartSpec, FieldSpec, MemberSpec};
pub use original::Original;
pub(crate) use surface::Nearest;
pub use surface::{Hit, Home, Surface, SurfaceIndex};
pub(crate) use topology::next;
pub use topology::{Flaws, NONE, Topology};

use crate::error::{Error, Result};

/// Largest taxel id: the largest integer up to which a float attribute is exact.
pub const MAX_TAXEL_ID: u32 = 1 << 24;

/// A rigid part of a robot, from a glTF node.
#[derive(Clone, Debug)]
pub struct Link {
    /// The node's name, made unique within the body.
    pub name: String,
    /// Index of the parent link, if any.
    pub parent: Option<usize>,
    /// Rigid pose in the body at rest: world_from_link.
    pub world_from_link: DAffine3,
    /// What the node's scale and shear do to its own coordinates: link_from_node.
    pub link_from_node: DAffine3,
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
    /// A number that this version has no name for.
    Other(u32),
}

impl Modality {
    /// The modality with the number that the layout stores.
    #[must_use]
    pub fn from_code(code: u32) -> Self {
        match code {
            0 => Self::Pressure,
            1 => Self::Temperature,
            2 => Self::Proximity,
            other => Self::Other(other),
        }
    }

    /// The number that the layout stores.
    #[must_use]
    pub fn code(self) -> u32 {
        match self {
            Self::Pressure => 0,
            Self::Temperature => 1,
            Self::Proximity => 2,
            Self::Other(code) => code,
        }
    }

    /// The name for people and JSON.
    #[must_use]
    pub fn name(self) -> String {
        match self {
            Self::Pressure => "pressure".to_owned(),
            Self::Temperature => "temperature".to_owned(),
            Self::Proximity => "proximity".to_owned(),
            Self::Other(code) => format!("modality {code}"),
        }
    }
}

/// One sensor on the surface.
#[derive(Clone, Debug, PartialEq)]
pub struct Taxel {
    /// Stable id, unique in the body, at most [`MAX_TAXEL_ID`].
    pub id: u32,
    /// Index of the link it rides on.
    pub link: usize,
    /// Where it is in the link's frame, m.
    pub position_in_link: DVec3,
    /// Outward unit normal in the link's frame.
    pub normal_in_link: DVec3,
    /// Surface it stands for, m²; 0 where the layout does not say.
    pub area: f64,
    /// What it measures.
    pub modality: Modality,
}

/// A robot's shape and the layout of its skin.
#[derive(Clone, Debug)]
pub struct Body {
    /// The file's name, or whatever the loader was told.
    pub name: String,
    /// Links; a parent comes before its children.
    pub links: Vec<Link>,
    /// Triangles, per mesh.
    pub surfaces: Vec<Surface>,
    /// Taxels by ascending id.
    pub taxels: Vec<Taxel>,
    /// Fields as the file outlines them, a parent before its children.
    pub fields: Vec<FieldSpec>,
    /// What is odd about the file without making it unusable.
    pub findings: Vec<String>,
}

impl Body {
    /// Reads the body in the `.glb` or `.gltf` at `path`.
    ///
    /// # Errors
    /// The file cannot be read, is no sound glTF, is compressed, or its layout contradicts itself. One line says where.
    pub fn load(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        let bytes = std::fs::read(path).map_err(|e| Error::io(path, &e))?;
        let name = path.display().to_string();
        read::body(&name, &bytes, path.parent()).map_err(|e| e.at(name))
    }

    /// The file at `path` and those beside it that it takes buffers and images from, as far as it can be read: what a
    /// program that reads the body must not write over.
    #[must_use]
    pub fn files(path: impl AsRef<Path>) -> Vec<PathBuf> {
        beside::files(path.as_ref())
    }

    /// Reads the body in `bytes`, a whole `.glb` (or a `.gltf` that holds its own buffers), called `name` in messages.
    ///
    /// # Errors
    /// As [`Body::load`].
    pub fn from_bytes(name: &str, bytes: &[u8]) -> Result<Self> {
        read::body(name, bytes, None).map_err(|e| e.at(name))
    }

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

    /// The lowest link that all of `links` are, or descend from. `None` for links of separate trees, or none at all.
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
        self.links[to].world_from_link.inverse() * self.links[from].world_from_link
    }

    /// From the root down to `link`, itself included.
    pub(crate) fn path_from_root(&self, link: usize) -> Vec<usize> {
        let mut path = vec![link];
        while let Some(parent) = self.links[path[path.len() - 1]].parent {
            path.push(parent);
        }
        path.reverse();
        path
    }
}

/// The rigid part of `world_from_node`: its translation, and its axes made orthonormal and right-handed.
///
/// A transform without scale comes back unchanged in its bits as far as its axes already are orthonormal to 1e-6.
pub(crate) fn rigid_part(world_from_node: &DAffine3) -> DAffine3 {
    let m = world_from_node.matrix3;
    let right_handed = m.determinant() > 0.0;
    let skew = (m.transpose() * m - DMat3::IDENTITY).to_cols_array();
    if right_handed && skew.iter().all(|e| e.abs() < 1e-6) {
        return *world_from_node;
    }
    let unit = |v: DVec3, or: DVec3| v.try_normalize().unwrap_or(or);
    let x = unit(m.x_axis, DVec3::X);
    let y = unit(m.y_axis - x * x.dot(m.y_axis), x.any_orthonormal_vector());
    DAffine3::from_mat3_translation(DMat3::from_cols(x, y, x.cross(y)), world_from_node.translation)
}
