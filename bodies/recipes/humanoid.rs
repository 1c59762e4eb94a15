//! A humanoid robot of a small child's shape, 0.75 m tall, with one skin of 960 taxels over its whole body.
//!
//! Its frame: y up from the ground, +z forward, +x its left. Links are the bones of its skeleton, with axes parallel
//! to the body's at rest. Taxel ids run through the links in the skeleton's order, in each from the top down.

use std::collections::BTreeMap;

use glam::{DMat4, DVec3};
use somatic::Result;
use somatic::author::{
    PatchRules, Placed, SurfacePoint, blend_skinning, heaviest_four, mean_normal, place_evenly, split_into_patches,
};
use somatic::body::{FieldSpec, Glb, MemberSpec, MeshData, Modality, Skinning, Taxel};

use super::figure::{Figure, figure};
use super::solid::{Solid, mesh};

/// How many taxels there are.
pub(crate) const TAXELS: usize = 960;
/// Which of many equally even placements.
const SEED: u64 = 2;
/// Edge of the mesh's triangles, m.
const EDGE: f64 = 0.0075;
/// How far beyond the nearest bone's flesh another's still has a hold on the skin, m.
const HOLD: f64 = 0.030;
/// Taxels in a patch, about.
const PATCH_TAXELS: usize = 12;

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

/// The taxels of one bone.
struct OnBone {
    first_id: u32,
    points: Vec<SurfacePoint>,
}

/// The taxels in the order of their ids, what carries each, and the same bone by bone.
struct Skin {
    taxels: Vec<Taxel>,
    skinning: Skinning,
    by_bone: Vec<OnBone>,
}

/// A place for a taxel with the joints that carry it and their weights.
type Carried = (Placed, ([u16; 4], [f32; 4]));

fn skin(mesh: &MeshData, bones: usize) -> Result<Skin> {
    let positions: Vec<DVec3> = mesh.positions.iter().map(|p| DVec3::from_array(p.map(f64::from))).collect();
    let carriers = mesh.skinning.as_ref().expect("the mesh has its skinning by now");
    let carried = |placed: &Placed| blend_skinning(carriers, mesh.triangles[placed.triangle], placed.barycentric);
    let mut placed: Vec<Carried> = place_evenly(&positions, &mesh.triangles, TAXELS, SEED)?
        .into_iter()
        .map(|placed| (placed, carried(&placed)))
        .collect();
    // The sort is stable: equals stay in the order of the triangles.
    placed.sort_by(|(a, (a_joints, _)), (b, (b_joints, _))| {
        a_joints[0].cmp(&b_joints[0]).then(b.point.position.y.total_cmp(&a.point.position.y))
    });
    let mut skin = Skin { taxels: Vec::new(), skinning: Skinning::default(), by_bone: Vec::new() };
    for bone in 0..bones {
        let first_id = skin.taxels.len() as u32;
        let mut points = Vec::new();
        for (placed, (joints, weights)) in placed.iter().filter(|(_, (joints, _))| usize::from(joints[0]) == bone) {
            skin.taxels.push(Taxel {
                id: skin.taxels.len() as u32,
                link: bone,
                position_in_link: placed.point.position,
                normal_in_link: placed.point.normal,
                area: placed.point.area,
                modality: Modality::Pressure,
            });
            skin.skinning.joints.push(*joints);
            skin.skinning.weights.push(*weights);
            points.push(placed.point);
        }
        skin.by_bone.push(OnBone { first_id, points });
    }
    Ok(skin)
}

/// Makes the humanoid.
pub(crate) fn make() -> Result<Glb> {
    let figure = figure();
    let mut mesh = mesh(&figure, DVec3::new(-0.34, -0.01, -0.14), DVec3::new(0.34, 0.77, 0.16), EDGE);
    mesh.skinning = Some(skinning(&figure, &mesh.positions));

    let mut glb = Glb::new();
    glb.describe(&BTreeMap::from([
        ("title", "A humanoid of a small child's shape with a skin of 960 taxels"),
        ("taxel_id", "link by link in the skeleton's order, in each from the top down"),
    ]));
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

    let skin = skin(&mesh, figure.bones.len())?;
    glb.taxels("skin taxels", None, &skin.taxels, Some((skeleton, &skin.skinning)));
    add_fields(&mut glb, &figure, &nodes, &joints, &skin)?;
    Ok(glb)
}

/// Adds the whole body, its limbs, and each limb's patches.
fn add_fields(glb: &mut Glb, figure: &Figure, nodes: &[usize], joints: &[DVec3], skin: &Skin) -> Result<()> {
    let empty = |name: &str, parent: Option<&str>| FieldSpec {
        name: name.to_owned(),
        parent: parent.map(str::to_owned),
        ..FieldSpec::default()
    };
    glb.field(&empty("body", None), Some(nodes[0]), DVec3::ZERO);
    let mut limbs: Vec<&str> = Vec::new();
    for (index, (bone, on_bone)) in figure.bones.iter().zip(&skin.by_bone).enumerate() {
        if !limbs.contains(&bone.limb.as_str()) {
            limbs.push(&bone.limb);
            glb.field(&empty(&bone.limb, Some("body")), Some(nodes[index]), DVec3::ZERO);
        }
        for (number, patch) in patches(&on_bone.points).map_err(|e| e.at(&bone.link))?.iter().enumerate() {
            let field = FieldSpec {
                name: format!("{}/{}/patch_{:02}", bone.limb, bone.segment, number + 1),
                parent: Some(bone.limb.clone()),
                members: patch.iter().map(|&i| (on_bone.first_id + i as u32, MemberSpec::default())).collect(),
                chart: None,
            };
            glb.field(&field, Some(nodes[index]), middle(&on_bone.points, patch) - joints[index]);
        }
    }
    Ok(())
}

/// Patches of one bone's taxels, from the top down.
fn patches(points: &[SurfacePoint]) -> Result<Vec<Vec<usize>>> {
    let rules = PatchRules { patches: points.len().div_ceil(PATCH_TAXELS), least_members: 4, ..PatchRules::default() };
    let mut patches = split_into_patches(points, &rules)?;
    patches.sort_by(|a, b| middle(points, b).y.total_cmp(&middle(points, a).y));
    Ok(patches)
}

/// The member nearest to the patch's mean, among those that face as it does: a place on the surface to show it at.
fn middle(points: &[SurfacePoint], patch: &[usize]) -> DVec3 {
    let mean = patch.iter().map(|&i| points[i].position).sum::<DVec3>() / patch.len() as f64;
    let facing = mean_normal(patch.iter().map(|&i| points[i])).unwrap_or(DVec3::Y);
    let off = |i: usize| points[i].position.distance(mean) * (2.0 - points[i].normal.dot(facing));
    let nearest = patch.iter().copied().min_by(|&a, &b| off(a).total_cmp(&off(b)));
    nearest.map_or(mean, |i| points[i].position)
}
