//! A robot in URDF as a glTF: its links as nodes, with their geometry.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use glam::DAffine3;

use super::options::{MeshOptions, doubt};
use super::triangles::Triangles;
use super::urdf_file::{JointMotion, Robot, RobotJoint, RobotLink, ShapeKind};
use super::urdf_tree::order;
use super::{formats, shapes};
use crate::body::{Glb, LinkJoint, LinkMimic, LinkMotion, StoredEdges};
use crate::error::{Error, Result};
use crate::lint::MAX_LIKELY_LINK_M;

/// A robot of over this size was probably not meant in metres, m.
const MAX_LIKELY_ROBOT_M: f64 = 20.0;

/// A robot's links as nodes.
pub(super) struct Linked {
    pub(super) glb: Glb,
    /// By name.
    pub(super) nodes: BTreeMap<String, usize>,
    /// What is doubtful, and what is assumed.
    pub(super) notes: Vec<String>,
    has_triangles: bool,
}

/// The robot at `path`, and what is doubtful.
pub(super) fn robot(path: &Path, options: &MeshOptions) -> Result<(Glb, Vec<String>)> {
    if options.unit_m.is_some() {
        return Err(
            Error::usage("a URDF is in metres, and scales its meshes itself; leave --unit out").at(path.display())
        );
    }
    let robot = Robot::load(path, options)?;
    let Linked { glb, notes, has_triangles, .. } = links(&robot, options).map_err(|e| e.at(path.display()))?;
    if has_triangles {
        return Ok((glb, notes));
    }
    let what = "none of its links has geometry of this kind; try --geometry visual or collision";
    Err(Error::failed(what).at(path.display()))
}

/// The links of `robot` as nodes, with what they look like.
pub(super) fn links(robot: &Robot, options: &MeshOptions) -> Result<Linked> {
    let (up, said) = options.robot_up();
    let order = order(robot)?;
    let joined = fixed_links(&order);
    let mut glb = Glb::new();
    let material = glb.material("robot", [0.6, 0.62, 0.66], 0.8);
    let mut nodes: BTreeMap<&str, (usize, DAffine3)> = BTreeMap::new();
    let mut known: BTreeMap<PathBuf, Triangles> = BTreeMap::new();
    let mut whole = Triangles::default();
    let mut doubts = Vec::new();
    for (link, joint) in order {
        let above = joint.and_then(|joint| Some((nodes.get(joint.parent.as_str())?, joint)));
        // A URDF's root stands in the world, a glTF's in glTF's axes: the roots are turned, and with them all below.
        let (parent, parent_from_link, body_from_link) = match above {
            Some((&(parent, body_from_parent), joint)) => {
                (Some(parent), joint.parent_from_child, body_from_parent * joint.parent_from_child)
            }
            None => (None, up.body_from_root(), up.body_from_root()),
        };
        let node = glb.placed_node(&link.name, parent, parent_from_link);
        if parent.is_none() {
            glb.urdf_root(node, up);
        }
        if let Some(joint) = joint.and_then(kept) {
            glb.joint(node, &joint);
        }
        nodes.insert(&link.name, (node, body_from_link));
        let mesh = geometry(link, &mut known)?;
        if mesh.triangles.is_empty() {
            continue;
        }
        glb.mesh(node, &link.name, &mesh.clone().into_mesh_data(), Some(material), None);
        doubts.extend(doubt(&format!("link `{}`", link.name), mesh.size_m(), MAX_LIKELY_LINK_M));
        whole.check_room_for(&mesh)?;
        whole.extend_placed(&mesh, &body_from_link);
    }
    if !joined.is_empty() {
        glb.edges(&StoredEdges { joined, ..StoredEdges::default() });
    }
    let nodes = nodes.into_iter().map(|(name, (node, _))| (name.to_owned(), node)).collect();
    if doubts.is_empty() {
        doubts.extend(doubt("it", whole.size_m(), MAX_LIKELY_ROBOT_M));
    }
    let what_to_do = "write metres into the URDF, or a `scale` of its meshes";
    let doubts = doubts.into_iter().map(|doubt| format!("{doubt}, {what_to_do}"));
    let notes = said.into_iter().chain(doubts).collect();
    Ok(Linked { glb, nodes, notes, has_triangles: !whole.triangles.is_empty() })
}

/// Sets of links that are fixed to each other, of all links in `order`, each with the joint above it. A robot none of whose joints moves
/// does not say how its links move.
fn fixed_links(order: &[(&RobotLink, Option<&RobotJoint>)]) -> Vec<Vec<String>> {
    let motions = || order.iter().filter_map(|(_, joint)| Some(joint.as_ref()?.motion));
    if motions().all(|motion| matches!(motion, JointMotion::Fixed | JointMotion::Free)) {
        return Vec::new();
    }
    let mut set_of: BTreeMap<&str, usize> = BTreeMap::new();
    let mut sets: Vec<Vec<String>> = Vec::new();
    for (link, joint) in order {
        let fixed = joint.filter(|joint| joint.motion == JointMotion::Fixed);
        let set = fixed.and_then(|joint| set_of.get(joint.parent.as_str()).copied()).unwrap_or(sets.len());
        if set == sets.len() {
            sets.push(Vec::new());
        }
        sets[set].push(link.name.clone());
        set_of.insert(&link.name, set);
    }
    sets.retain(|set| set.len() > 1);
    sets
}

/// What a body keeps of `joint`, if that moves by one number.
fn kept(joint: &RobotJoint) -> Option<LinkJoint> {
    let motion = match joint.motion {
        JointMotion::Fixed | JointMotion::Free => return None,
        JointMotion::Revolute { axis, is_continuous: true } => LinkMotion::Continuous(axis),
        JointMotion::Revolute { axis, is_continuous: false } => LinkMotion::Revolute(axis),
        JointMotion::Prismatic { axis } => LinkMotion::Prismatic(axis),
    };
    let is_finite = |limits: &[f64; 2]| limits.iter().all(|limit| limit.is_finite());
    let limits = joint.limits.filter(is_finite).filter(|_| !matches!(motion, LinkMotion::Continuous(_)));
    let mimic = joint.mimic.as_ref().map(|mimic| LinkMimic {
        joint: mimic.joint.clone(),
        multiplier: mimic.multiplier,
        offset: mimic.offset,
    });
    Some(LinkJoint { name: joint.name.clone(), motion, limits, mimic })
}

/// The geometry of a link in its frame. Meshes that are used again are read once.
fn geometry(link: &RobotLink, known: &mut BTreeMap<PathBuf, Triangles>) -> Result<Triangles> {
    let mut all = Triangles::default();
    for shape in &link.shapes {
        let mut mesh = match &shape.kind {
            ShapeKind::Box(size) => shapes::cuboid(*size),
            ShapeKind::Cylinder { radius_m, length_m } => shapes::cylinder(*radius_m, *length_m),
            ShapeKind::Sphere { radius_m } => shapes::sphere(*radius_m),
            ShapeKind::Mesh { path, scale } => {
                if !known.contains_key(path) {
                    let at = |e: Error| e.at(path.display()).at(format!("line {}: link `{}`", shape.line, link.name));
                    // What a COLLADA file says is up does not count, as in RViz: many that say y up are z up. Nor is a glTF turned.
                    let mesh = formats::load_part(path).map_err(at)?;
                    known.insert(path.clone(), mesh);
                }
                let mut mesh = known[path].clone();
                mesh.transform(&DAffine3::from_scale(*scale));
                mesh
            }
        };
        mesh.transform(&shape.link_from_shape);
        all.check_room_for(&mesh).map_err(|e| e.at(format!("line {}: link `{}`", shape.line, link.name)))?;
        all.extend(&mesh);
    }
    Ok(all)
}
