//! Bodies: links, surfaces, taxels and field specifications, read from and written to glTF.
//!
//! A [`Body`] is the checked content of a glTF file, in metres. `docs/layout.md` specifies the encoding.
//!
//! **Frames.** Every glTF node that is neither a set of taxels nor a field is a [`Link`]. A link's frame is the rigid part
//! of the node's frame, without scale, shear and mirroring, so that coordinates in it are metres; the node's points are
//! transformed into it.

mod amend;
mod clear_layout;
mod details;
mod document;
mod glb;
mod json_edit;
mod layout;
mod nodes;
mod original;
mod read;
mod referenced_files;
mod repair;
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

/// Largest taxel id: integers up to this one are exact as f32.
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
    /// The node's scale and shear: link_from_node.
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
    /// An unknown modality code.
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
    /// Problems of the file that do not prevent its use.
    pub findings: Vec<String>,
}

impl Body {
    /// Reads the body in the `.glb` or `.gltf` at `path`.
    ///
    /// # Errors
    /// The file cannot be read, is no valid glTF, is compressed, or its layout is inconsistent; with the place.
    pub fn load(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        let bytes = std::fs::read(path).map_err(|e| Error::io(path, &e))?;
        let name = path.display().to_string();
        read::body(&name, &bytes, path.parent()).map_err(|e| e.at(name))
    }

    /// The file at `path` and the files of its buffers and images, as far as it can be read. A program that reads the body
    /// must not overwrite them.
    #[must_use]
    pub fn files(path: impl AsRef<Path>) -> Vec<PathBuf> {
        referenced_files::files(path.as_ref())
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
/// A transform whose axes are orthonormal to 1e-6 is returned unchanged.
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
