//! The node tree of a glTF: transforms, and the role of each node: a link, taxels, a field, or edges.

use std::collections::{HashMap, HashSet};

use glam::{DAffine3, DMat4, DQuat, DVec3};
use gltf::json;

use super::axes::Up;
use super::document::Document;
use super::joint::{JOINT_KEY, LinkJoint};
use super::layout::FIELD_KEY;
use super::model::{Link, rigid_part};
use super::primitives::is_taxels;
use super::stored_edges::EDGES_KEY;
use super::urdf_root::{self, URDF_KEY};
use crate::error::{Error, Result, failed};
use crate::limits::{MAX_NODE_DEPTH, MAX_NODES};

/// Maximum coordinate, m; sums and products of smaller ones do not overflow.
pub(super) const MAX_COORDINATE_M: f64 = 1e9;

pub(super) struct Nodes<'a> {
    pub(super) raw: &'a [json::Node],
    pub(super) parent: Vec<Option<usize>>,
    /// Every node, a parent before its children.
    pub(super) in_order: Vec<usize>,
    pub(super) body_from_node: Vec<DAffine3>,
    /// The link that a node is; `None` for nodes that hold taxels, a field or edges.
    pub(super) link: Vec<Option<usize>>,
    pub(super) field: Vec<Option<String>>,
    /// The JSON of edges between taxels, or what stands in its place.
    pub(super) edges: Vec<Option<String>>,
    joint: Vec<Option<LinkJoint>>,
    urdf_up: Vec<Option<Up>>,
}

impl<'a> Nodes<'a> {
    pub(super) fn from_document(document: &'a Document) -> Result<Self> {
        let raw = &document.root.nodes[..];
        if raw.len() > MAX_NODES {
            return Err(failed!("it has {} nodes, over the {MAX_NODES} that a body may have; merge some", raw.len()));
        }
        let mut parent = vec![None; raw.len()];
        for (index, node) in raw.iter().enumerate() {
            for child in node.children.iter().flatten() {
                if parent[child.value()].replace(index).is_some() {
                    return Err(failed!(
                        "node {} has two parents: the file is damaged; export it again",
                        child.value()
                    ));
                }
            }
        }
        let mut in_order = Vec::with_capacity(raw.len());
        let mut to_visit: Vec<usize> = (0..raw.len()).rev().filter(|&n| parent[n].is_none()).collect();
        while let Some(node) = to_visit.pop() {
            in_order.push(node);
            to_visit.extend(raw[node].children.iter().flatten().rev().map(json::Index::value));
        }
        if in_order.len() < raw.len() {
            return Err(Error::failed("its nodes form a ring: the file is damaged; export it again"));
        }
        let mut body_from_node = vec![DAffine3::IDENTITY; raw.len()];
        let mut depth = vec![1_usize; raw.len()];
        for &node in &in_order {
            depth[node] = parent[node].map_or(1, |up: usize| depth[up] + 1);
            if depth[node] > MAX_NODE_DEPTH {
                return Err(failed!(
                    "node {node} has {MAX_NODE_DEPTH} nodes above it, one too many; is the file damaged?"
                ));
            }
            let local = local_transform(&raw[node]);
            if !local.is_finite() {
                return Err(failed!("node {node} has a transform that is not finite; export it again"));
            }
            body_from_node[node] = parent[node].map_or(local, |up| body_from_node[up] * local);
            if !is_in_range(&body_from_node[node]) {
                return Err(failed!(
                    "node {node} is moved or scaled by over {MAX_COORDINATE_M:e}; check the scene's units and export it again"
                ));
            }
        }
        let all = || raw.iter().enumerate();
        let field = all().map(|(index, node)| text_under(FIELD_KEY, index, node)).collect::<Result<Vec<_>>>()?;
        let edges: Vec<Option<String>> = raw.iter().map(edges_of).collect();
        let joint = all().map(|(index, node)| joint_of(index, node)).collect::<Result<Vec<_>>>()?;
        let urdf_up = all().map(|(index, node)| urdf_up_of(index, node)).collect::<Result<Vec<_>>>()?;
        let mut link = vec![None; raw.len()];
        let mut links = 0;
        for &node in &in_order {
            // Taxels need a link above them, or joints.
            let carried = parent[node].is_some() || raw[node].skin.is_some();
            if field[node].is_none() && edges[node].is_none() && !(holds_taxels(document, &raw[node]) && carried) {
                link[node] = Some(links);
                links += 1;
            }
        }
        Ok(Self { raw, parent, in_order, body_from_node, link, field, edges, joint, urdf_up })
    }

    pub(super) fn links(&self) -> Vec<Link> {
        let mut taken = HashSet::new();
        let mut numbers: HashMap<&str, u64> = HashMap::new();
        let mut links: Vec<Link> = Vec::new();
        for &node in self.in_order.iter().filter(|&&node| self.link[node].is_some()) {
            let unnamed = format!("node_{node}");
            let wanted = self.raw[node].name.as_deref();
            let mut name = wanted.unwrap_or(&unnamed).to_owned();
            while !taken.insert(name.clone()) {
                let number = numbers.entry(wanted.unwrap_or_default()).or_insert(1);
                *number += 1;
                name = format!("{}#{number}", wanted.unwrap_or(&unnamed));
            }
            let body_from_link = rigid_part(&self.body_from_node[node]);
            links.push(Link {
                name,
                parent: self.parent[node].and_then(|up| self.link_above(up)),
                body_from_link,
                link_from_node: body_from_link.inverse() * self.body_from_node[node],
                joint: self.joint[node].clone(),
                urdf_up: self.urdf_up[node],
            });
        }
        links
    }

    /// The link that `node` is, or its nearest ancestor that is one.
    pub(super) fn link_above(&self, node: usize) -> Option<usize> {
        std::iter::successors(Some(node), |&node| self.parent[node]).find_map(|node| self.link[node])
    }
}

fn local_transform(node: &json::Node) -> DAffine3 {
    if let Some(m) = node.matrix {
        return DAffine3::from_mat4(DMat4::from_cols_array(&m.map(f64::from)));
    }
    let three = |v: Option<[f32; 3]>, or: f32| DVec3::from_array(v.unwrap_or([or; 3]).map(f64::from));
    let rotation = node.rotation.map_or(DQuat::IDENTITY, |q| {
        let q = DQuat::from_array(q.0.map(f64::from));
        if q.length_squared() > 0.0 { q.normalize() } else { DQuat::IDENTITY }
    });
    DAffine3::from_scale_rotation_translation(three(node.scale, 1.0), rotation, three(node.translation, 0.0))
}

/// Whether all numbers in `transform` are finite and within [`MAX_COORDINATE_M`].
pub(super) fn is_in_range(transform: &DAffine3) -> bool {
    transform.to_cols_array().iter().all(|x| x.abs() <= MAX_COORDINATE_M)
}

/// The string under `key` in a node's extras, if it has one.
fn text_under(key: &str, index: usize, node: &json::Node) -> Result<Option<String>> {
    let Some(extras) = &node.extras else { return Ok(None) };
    let Ok(extras) = serde_json::from_str::<serde_json::Value>(extras.get()) else { return Ok(None) };
    match extras.get(key) {
        None => Ok(None),
        Some(serde_json::Value::String(text)) => Ok(Some(text.clone())),
        Some(_) => {
            let example = match key {
                FIELD_KEY => r#"a field as JSON, such as {"version":1,"name":"palm","members":{"1":[1]}}"#,
                URDF_KEY => r#"JSON, {"version":1,"up":"z"}"#,
                _ => r#"a joint as JSON, such as {"version":1,"type":"revolute","axis":[0,0,1]}"#,
            };
            Err(failed!("`{key}` should be one string, {example}").at(place(key, index, node)))
        }
    }
}

/// The JSON of edges in a node's extras, if it has some. They are derived, so that damaged ones do no harm.
fn edges_of(node: &json::Node) -> Option<String> {
    let extras: serde_json::Value = serde_json::from_str(node.extras.as_ref()?.get()).ok()?;
    let edges = extras.get(EDGES_KEY)?;
    Some(edges.as_str().map_or_else(|| edges.to_string(), str::to_owned))
}

/// The joint in a node's extras, if it has one.
fn joint_of(index: usize, node: &json::Node) -> Result<Option<LinkJoint>> {
    let text = text_under(JOINT_KEY, index, node)?;
    text.map(|text| LinkJoint::from_json(&text).map_err(|e| e.at(place(JOINT_KEY, index, node)))).transpose()
}

/// What points up in the URDF whose root `node` is, if it is one.
fn urdf_up_of(index: usize, node: &json::Node) -> Result<Option<Up>> {
    let text = text_under(URDF_KEY, index, node)?;
    text.map(|text| urdf_root::from_json(&text).map_err(|e| e.at(place(URDF_KEY, index, node)))).transpose()
}

fn place(key: &str, index: usize, node: &json::Node) -> String {
    let kind = match key {
        FIELD_KEY => "field node",
        JOINT_KEY => "joint node",
        _ => "node",
    };
    format!("{kind} `{}`", node.name.clone().unwrap_or_else(|| format!("node_{index}")))
}

fn holds_taxels(document: &Document, node: &json::Node) -> bool {
    node.mesh.is_some_and(|mesh| {
        let primitives = &document.root.meshes[mesh.value()].primitives;
        !primitives.is_empty() && primitives.iter().all(is_taxels)
    })
}

/// Refuses vertices that are beyond [`MAX_COORDINATE_M`] from the origin of their link.
pub(super) fn refuse_far(mut vertices_in_links: impl Iterator<Item = DVec3>) -> Result<()> {
    match vertices_in_links.position(|vertex| vertex.abs().max_element() > MAX_COORDINATE_M) {
        Some(vertex) => Err(failed!(
            "vertex {vertex} lies over {MAX_COORDINATE_M:e} m away; check the scene's units and export it again"
        )),
        None => Ok(()),
    }
}
