//! What authoring needs of a file beyond a [`Body`]: materials, painted attributes, joint weights, and indices in the file.

use glam::DVec3;
use gltf::json;
use json::mesh::{Primitive, Semantic};
use json::validation::Checked;

use super::document::Document;
use super::glb::Skinning;
use super::model::Body;
use super::nodes::Nodes;
use super::read::{TaxelSource, from_document};
use super::skin_weights::carriers;
use crate::error::{Error, Result};

/// Details of a file's surfaces, marks and taxels.
#[derive(Clone, Debug)]
pub struct Details {
    /// One per surface of the body.
    pub parts: Vec<Part>,
    /// Places that were marked by hand.
    pub marks: Vec<Mark>,
    /// Per link of the body its glTF node.
    pub node_of_link: Vec<usize>,
    /// Per taxel of the body its place in the file.
    pub taxels: Vec<TaxelSource>,
}

/// Details of a surface.
#[derive(Clone, Debug)]
pub struct Part {
    /// Index of the glTF node that shows it.
    pub node: usize,
    /// Name of the mesh.
    pub mesh: Option<String>,
    /// Name of the material.
    pub material: Option<String>,
    /// Index of the glTF skin, if it has one.
    pub skin: Option<usize>,
    /// For a skinned part the joints and weights of each vertex: `JOINTS_n` and `WEIGHTS_n`, set by set.
    pub carriers: Vec<Skinning>,
    /// Colours and custom attributes.
    pub paints: Vec<Paint>,
}

/// A painted vertex attribute.
#[derive(Clone, Debug, PartialEq)]
pub struct Paint {
    /// Its name in the file: `_DENSITY`, `COLOR_0`.
    pub name: String,
    /// Numbers per vertex.
    pub width: usize,
    /// The numbers, vertex by vertex; integers normalised where the file says so.
    pub values: Vec<f32>,
}

impl Paint {
    /// The names of a vertex's numbers, as in a recipe: `_DENSITY`; `COLOR_0.r`, `COLOR_0.g`, ….
    #[doc(hidden)]
    pub fn names(&self) -> Vec<String> {
        match self.width {
            1 => vec![self.name.clone()],
            width => "rgba".chars().take(width).map(|channel| format!("{}.{channel}", self.name)).collect(),
        }
    }

    /// Which of a vertex's numbers is called `name`.
    #[doc(hidden)]
    pub fn column(&self, name: &str) -> Option<usize> {
        let rest = name.strip_prefix(&self.name)?;
        let column = match rest.strip_prefix('.') {
            None => (rest.is_empty() && self.width == 1).then_some(0)?,
            Some(channel) if channel.len() == 1 => ["rgba", "xyzw", "0123"].iter().find_map(|all| all.find(channel))?,
            Some(_) => return None,
        };
        (column < self.width).then_some(column)
    }
}

/// Places marked by hand: an empty node, or the points of a mesh that are not taxels.
#[derive(Clone, Debug, PartialEq)]
pub struct Mark {
    /// The node's name.
    pub name: String,
    /// Positions in the body at rest, m.
    pub positions_in_body: Vec<DVec3>,
}

/// The body called `name` in `bytes`, a file with its own buffers, and its details.
pub(super) fn read(name: &str, bytes: &[u8]) -> Result<(Body, Details)> {
    let document = Document::parse(bytes, None)?;
    let nodes = Nodes::from_document(&document)?;
    let (body, sources) = from_document(name, &document, &nodes)?;
    let mut parts = Vec::with_capacity(sources.surfaces.len());
    for (&(node, primitive), surface) in sources.surfaces.iter().zip(&body.surfaces) {
        let part = part(&document, &nodes, node, primitive, surface.positions.len());
        parts.push(part.map_err(|e| e.at(format!("node `{}`", surface.name)))?);
    }
    let mut marks: Vec<Mark> =
        sources.points.into_iter().map(|(name, positions_in_body)| Mark { name, positions_in_body }).collect();
    let is_mark = |&&node: &&usize| nodes.raw[node].mesh.is_none() && nodes.link[node].is_some();
    for &node in nodes.in_order.iter().filter(is_mark) {
        if let Some(name) = nodes.raw[node].name.clone() {
            marks.push(Mark { name, positions_in_body: vec![nodes.body_from_node[node].translation] });
        }
    }
    let mut node_of_link = vec![0; body.links.len()];
    for (node, link) in nodes.link.iter().enumerate() {
        if let Some(link) = link {
            node_of_link[*link] = node;
        }
    }
    Ok((body, Details { parts, marks, node_of_link, taxels: sources.taxels }))
}

fn part(document: &Document, nodes: &Nodes<'_>, node: usize, primitive: usize, vertices: usize) -> Result<Part> {
    let raw = &nodes.raw[node];
    let mesh = raw.mesh.map(|mesh| &document.root.meshes[mesh.value()]);
    let mesh = mesh.ok_or_else(|| Error::failed("it shows no mesh"))?;
    let primitive = &mesh.primitives[primitive];
    let material = primitive.material.and_then(|material| document.root.materials[material.value()].name.clone());
    let skin = raw.skin.map(|skin| skin.value());
    Ok(Part {
        node,
        mesh: mesh.name.clone(),
        material,
        skin,
        carriers: if skin.is_some() { carriers(document, primitive)? } else { Vec::new() },
        paints: paints(document, primitive, vertices),
    })
}

/// Colours and custom attributes; unreadable ones are skipped.
fn paints(document: &Document, primitive: &Primitive, vertices: usize) -> Vec<Paint> {
    let named = primitive.attributes.iter().filter_map(|(semantic, accessor)| match semantic {
        Checked::Valid(Semantic::Colors(set)) => Some((format!("COLOR_{set}"), accessor.value())),
        Checked::Valid(Semantic::Extras(name)) => Some((format!("_{name}"), accessor.value())),
        _ => None,
    });
    let mut paints: Vec<Paint> = named
        .filter_map(|(name, accessor)| {
            let (width, values) = document.numbers(accessor).ok()?;
            (values.len() == width * vertices).then_some(Paint { name, width, values })
        })
        .collect();
    paints.sort_by(|a, b| a.name.cmp(&b.name));
    paints
}
