//! A robot in URDF as a glTF: its links as nodes, with their geometry.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use glam::DAffine3;

use super::options::{MeshOptions, Up, y_up_from};
use super::triangles::Triangles;
use super::urdf_file::{Robot, RobotJoint, RobotLink, ShapeKind};
use super::{formats, shapes};
use crate::body::Glb;
use crate::error::{Error, Result, failed};

/// The robot at `path`, and its size at rest, m.
pub(super) fn robot(path: &Path, options: &MeshOptions) -> Result<(Glb, f64)> {
    if options.unit_m.is_some() {
        return Err(
            Error::usage("a URDF is in metres, and scales its meshes itself; leave --unit out").at(path.display())
        );
    }
    let robot = Robot::load(path, options)?;
    build(&robot, options.up.unwrap_or(Up::Z)).map_err(|e| e.at(path.display()))
}

fn build(robot: &Robot, up: Up) -> Result<(Glb, f64)> {
    let (glb, whole, _) = links(robot, up)?;
    if whole.triangles.is_empty() {
        return Err(Error::failed("none of its links has geometry of this kind; try --geometry visual or collision"));
    }
    Ok((glb, whole.size_m()))
}

/// The links of `robot` as nodes, what they look like together, and their nodes by name.
pub(super) fn links(robot: &Robot, up: Up) -> Result<(Glb, Triangles, BTreeMap<String, usize>)> {
    let order = order(robot)?;
    let mut glb = Glb::new();
    let material = glb.material("robot", [0.6, 0.62, 0.66], 0.8);
    let mut nodes: BTreeMap<&str, (usize, DAffine3)> = BTreeMap::new();
    let mut known: BTreeMap<PathBuf, Triangles> = BTreeMap::new();
    let mut whole = Triangles::default();
    for (link, joint) in order {
        let above = joint.and_then(|joint| Some((nodes.get(joint.parent.as_str())?, joint)));
        // URDF is z up, glTF y up: the roots are turned, and with them all below.
        let (parent, parent_from_link, world_from_link) = match above {
            Some((&(parent, world_from_parent), joint)) => {
                (Some(parent), joint.parent_from_child, world_from_parent * joint.parent_from_child)
            }
            None => (None, y_up_from(up), y_up_from(up)),
        };
        let node = glb.placed_node(&link.name, parent, parent_from_link);
        nodes.insert(&link.name, (node, world_from_link));
        let mut mesh = geometry(link, &mut known)?;
        if mesh.triangles.is_empty() {
            continue;
        }
        glb.mesh(node, &link.name, &mesh.clone().into_mesh_data(), Some(material), None);
        mesh.transform(&world_from_link);
        whole.extend(&mesh);
    }
    let nodes = nodes.into_iter().map(|(name, (node, _))| (name.to_owned(), node)).collect();
    Ok((glb, whole, nodes))
}

/// The links, a parent before its children, each with the joint to its parent.
pub(crate) fn order(robot: &Robot) -> Result<Vec<(&RobotLink, Option<&RobotJoint>)>> {
    let mut names = BTreeSet::new();
    for link in &robot.links {
        if !names.insert(link.name.as_str()) {
            return Err(failed!("two links are called `{}`", link.name));
        }
    }
    let mut joint_of = BTreeMap::new();
    for joint in &robot.joints {
        let at = |what: String| Error::failed(what).at(format!("line {}", joint.line));
        if let Some(unknown) = [&joint.parent, &joint.child].into_iter().find(|name| !names.contains(name.as_str())) {
            return Err(at(format!("there is no link `{unknown}`")));
        }
        if joint_of.insert(joint.child.as_str(), joint).is_some() {
            return Err(at(format!("`{}` is the child of two joints; a link has one parent", joint.child)));
        }
    }
    let mut ordered = Vec::new();
    let mut done = BTreeSet::new();
    while ordered.len() < robot.links.len() {
        let before = ordered.len();
        for link in &robot.links {
            let joint = joint_of.get(link.name.as_str()).copied();
            let is_ready = joint.is_none_or(|joint| done.contains(joint.parent.as_str()));
            if is_ready && done.insert(link.name.as_str()) {
                ordered.push((link, joint));
            }
        }
        if ordered.len() == before {
            return Err(Error::failed("its joints go round in a ring; a link cannot be above itself"));
        }
    }
    Ok(ordered)
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
                    let (mut mesh, up) = formats::load(path, None).map_err(at)?;
                    // A COLLADA file with y up is turned to the z up of the URDF.
                    if up == Some(Up::Y) {
                        mesh.transform(&y_up_from(Up::Z).inverse());
                    }
                    known.insert(path.clone(), mesh);
                }
                let mut mesh = known[path].clone();
                mesh.transform(&DAffine3::from_scale(*scale));
                mesh
            }
        };
        mesh.transform(&shape.link_from_shape);
        all.extend(&mesh);
    }
    Ok(all)
}
