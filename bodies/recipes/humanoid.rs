//! A humanoid robot of a small child's shape, 0.75 m tall, with one skin over its whole body.
//!
//! Its frame: y up from the ground, +z forward, +x its left. Links are the bones of its skeleton, with axes parallel
//! to the body's at rest. `humanoid.toml` says where its taxels are and what fields they form.

use std::collections::BTreeMap;
use std::path::Path;

use glam::{DMat4, DVec3};
use somatic::Result;
use somatic::author::{Recipe, author};
use somatic::internal::author::heaviest_four;
use somatic::internal::body::{Glb, Original, Skinning};

use super::figure::{Figure, figure};
use super::solid::{Solid, mesh};

/// Edge of the mesh's triangles, m.
const EDGE: f64 = 0.0075;
/// How far beyond the nearest bone's flesh another's still has a hold on the skin, m.
const HOLD: f64 = 0.030;

/// Which bones carry the skin at each of `positions`, and how much: those whose flesh is nearest, among neighbours in
/// the skeleton, so that one leg never drags the other's skin along.
fn skinning(figure: &Figure, positions: &[[f32; 3]]) -> Skinning {
    let mut skinning = Skinning::default();
    for position in positions {
        let p = DVec3::from_array(position.map(f64::from));
        let distances: Vec<f64> = figure.bones.iter().map(|bone| bone.distance(p)).collect();
        let nearest = (0..distances.len()).fold(0, |best, i| if distances[i] < distances[best] { i } else { best });
        let next_to = |i: usize| {
            i == nearest || figure.bones[i].parent == Some(nearest) || figure.bones[nearest].parent == Some(i)
        };
        let holds = (0..distances.len()).filter(|&i| next_to(i)).map(|i| {
            let hold = (1.0 - (distances[i] - distances[nearest]) / HOLD).max(0.0);
            (i as u16, hold * hold)
        });
        let (joints, weights) = heaviest_four(holds.collect());
        skinning.joints.push(joints);
        skinning.weights.push(weights);
    }
    skinning
}

/// Makes the humanoid: a bare body, and what the recipe beside this file puts on it.
pub(crate) fn make() -> Result<Vec<u8>> {
    let recipe = Recipe::parse("humanoid.toml", include_str!("humanoid.toml"), Path::new(""))?;
    let file = Original::from_bytes("humanoid", &bare().to_bytes()?, None)?;
    author(file, &recipe, |_| {})?.file.to_glb()
}

/// The humanoid's mesh, skinned to its skeleton, without a taxel.
fn bare() -> Glb {
    let figure = figure();
    let mut mesh = mesh(&figure, DVec3::new(-0.34, -0.01, -0.14), DVec3::new(0.34, 0.77, 0.16), EDGE);
    mesh.skinning = Some(skinning(&figure, &mesh.positions));

    let mut glb = Glb::new();
    glb.describe(&BTreeMap::from([("title", "A humanoid of a small child's shape, with a skin by humanoid.toml")]));
    let shell = glb.material("shell", [0.86, 0.88, 0.90], 0.55);
    let mut nodes: Vec<usize> = Vec::new();
    for bone in &figure.bones {
        let (parent, origin) = match bone.parent {
            Some(parent) => (Some(nodes[parent]), figure.bones[parent].joint),
            None => (None, DVec3::ZERO),
        };
        nodes.push(glb.node(&bone.link, parent, bone.joint - origin));
    }
    // The same steps down the skeleton as a reader takes, so that single precision cancels out.
    let mut joints: Vec<DVec3> = Vec::new();
    for bone in &figure.bones {
        let origin = bone.parent.map_or(DVec3::ZERO, |parent| figure.bones[parent].joint);
        let step = (bone.joint - origin).as_vec3().as_dvec3();
        joints.push(bone.parent.map_or(DVec3::ZERO, |parent| joints[parent]) + step);
    }
    let binds: Vec<[f32; 16]> =
        joints.iter().map(|&joint| DMat4::from_translation(-joint).as_mat4().to_cols_array()).collect();
    let skeleton = glb.skin("skeleton", &nodes, &binds);
    let shown = glb.node("humanoid", None, DVec3::ZERO);
    glb.mesh(shown, "humanoid", &mesh, Some(shell), Some(skeleton));

    glb
}
