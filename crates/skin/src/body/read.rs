//! Reads a [`Body`] from a glTF document.

use std::collections::{BTreeMap, HashMap};
use std::path::Path;

use glam::{DAffine3, DMat3, DMat4, DVec3};
use gltf::json;
use json::mesh::{Mode, Primitive, Semantic};
use json::validation::Checked;

use super::document::{Document, refuse_other_formats};
use super::layout::{AREA, FieldSpec, MAX_TAXEL_ID, MODALITY, NORMAL, TANGENT, TAXEL_ID};
use super::model::{Body, Home, Link, Modality, Surface, Taxel};
use super::nodes::{MAX_COORDINATE_M, Nodes, is_in_range, refuse_far};
use super::primitives::{attribute, custom, finite_positions, has_mode, is_taxels};
use super::repair;
use super::skin_weights::skinned_vertices;
use super::stored_edges::StoredEdges;
use crate::error::{Error, Result, failed};
use crate::limits::{self, MAX_BODY_BYTES, MAX_FIELD_DEPTH, MAX_TRIANGLES, MAX_VERTICES};

/// Places in the file of what was read, for writing.
#[derive(Default)]
pub(super) struct Sources {
    /// Per surface its node, and the primitive within the node's mesh.
    pub(super) surfaces: Vec<(usize, usize)>,
    /// Points that are not taxels: the node's name, and positions in the body at rest, m.
    pub(super) points: Vec<(String, Vec<DVec3>)>,
    /// Per taxel of the body, in its order.
    pub(super) taxels: Vec<TaxelSource>,
}

/// A point of the file that is a taxel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TaxelSource {
    /// Index of the glTF mesh.
    pub mesh: usize,
    /// Index of the primitive within it.
    pub primitive: usize,
    /// Index of the point within that.
    pub point: usize,
    /// The taxel's id in the file.
    pub id: u32,
    /// From the file's coordinates there to the link's.
    pub link_from_mesh: DAffine3,
}

impl Body {
    /// Reads the body in the `.glb` or `.gltf` at `path`.
    ///
    /// # Errors
    /// The file cannot be read, is not a valid glTF, is compressed, or its layout is inconsistent; with the place.
    pub fn load(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        let bytes = limits::read(path, MAX_BODY_BYTES).map_err(|e| Error::io(path, &e))?;
        let name = path.display().to_string();
        read(&name, &bytes, path.parent()).map_err(|e| e.at(name))
    }

    /// Reads the body in `bytes`, a whole `.glb` (or a `.gltf` that holds its own buffers), called `name` in messages.
    ///
    /// # Errors
    /// As [`Body::load`].
    pub fn from_bytes(name: &str, bytes: &[u8]) -> Result<Self> {
        read(name, bytes, None).map_err(|e| e.at(name))
    }
}

/// Reads the body called `name` from a whole file's bytes.
fn read(name: &str, bytes: &[u8], folder: Option<&Path>) -> Result<Body> {
    refuse_other_formats(name, bytes)?;
    let document = Document::parse(bytes, folder)?;
    let nodes = Nodes::from_document(&document)?;
    from_document(name, &document, &nodes).map(|(body, _)| body)
}

/// Reads the body called `name` from `document`, and where its parts come from.
pub(super) fn from_document(name: &str, document: &Document, nodes: &Nodes<'_>) -> Result<(Body, Sources)> {
    check_size(document, nodes)?;
    let mut sources = Sources::default();
    let mut body = Body {
        name: name.to_owned(),
        links: nodes.links(),
        surfaces: Vec::new(),
        taxels: Vec::new(),
        fields: Vec::new(),
        edges: None,
        findings: Vec::new(),
        kept: Default::default(),
    };
    for &node in &nodes.in_order {
        read_meshes(document, nodes, node, &mut body, &mut sources)?;
    }
    complete_normals(&mut body)?;
    if let Some(order) = repair::renumber(&mut body)? {
        sources.taxels = order.into_iter().map(|index| sources.taxels[index]).collect();
    }
    body.fields = read_fields(document, nodes, &mut body)?;
    body.edges = StoredEdges::of_nodes(nodes.edges.iter().flatten()).unwrap_or_else(|why| {
        body.findings.push(format!("the edges between taxels in the file are not used: {why}; author it again"));
        None
    });
    repair::suggest_export_options(document, &mut body);
    Ok((body, sources))
}

/// Refuses more vertices or triangles than a body may have, before any is read.
fn check_size(document: &Document, nodes: &Nodes<'_>) -> Result<()> {
    let (mut vertices, mut triangles) = (0_u64, 0_u64);
    let meshes = nodes.raw.iter().filter_map(|node| document.root.meshes.get(node.mesh?.value()));
    for primitive in meshes.flat_map(|mesh| &mesh.primitives) {
        let Some(positions) = attribute(primitive, &Semantic::Positions) else { continue };
        let of_positions = document.count(positions);
        vertices = vertices.saturating_add(of_positions);
        let own = primitive.indices.map_or(of_positions, |indices| document.count(indices.value()));
        // Triangles of a strip or fan have a corner of their own each.
        let own = match primitive.mode {
            Checked::Valid(Mode::Triangles) => own / 3,
            Checked::Valid(Mode::TriangleStrip | Mode::TriangleFan) => own,
            _ => 0,
        };
        triangles = triangles.saturating_add(own);
        for (count, most, what) in [(vertices, MAX_VERTICES, "vertices"), (triangles, MAX_TRIANGLES, "triangles")] {
            if count > most as u64 {
                // One that claims more than the file holds has a message of its own.
                document.check(positions)?;
                return Err(failed!("it has over {most} {what}, the most that a body may have; simplify its meshes"));
            }
        }
    }
    Ok(())
}

/// Per joint of a skinned node its link, and link_from_mesh.
fn joints_of(
    document: &Document,
    nodes: &Nodes<'_>,
    node: usize,
    links: &[Link],
) -> Result<Option<Vec<(usize, DAffine3)>>> {
    let Some(skin) = nodes.raw[node].skin else { return Ok(None) };
    let skin = &document.root.skins[skin.value()];
    let inverse_binds: Vec<[f32; 16]> = match skin.inverse_bind_matrices {
        Some(accessor) => document.floats(accessor.value())?,
        None => Vec::new(),
    };
    if skin.inverse_bind_matrices.is_some() && inverse_binds.len() < skin.joints.len() {
        return Err(failed!(
            "the skin has {} inverse bind matrices for {} joints; export the file again",
            inverse_binds.len(),
            skin.joints.len()
        ));
    }
    let mut joints = Vec::with_capacity(skin.joints.len());
    for (index, joint) in skin.joints.iter().enumerate() {
        let link = nodes
            .link_above(joint.value())
            .ok_or_else(|| Error::failed("a joint is not a link; export the file again"))?;
        let joint_from_mesh = match inverse_binds.get(index) {
            Some(m) => DAffine3::from_mat4(DMat4::from_cols_array(&m.map(f64::from))),
            None => DAffine3::IDENTITY,
        };
        if !is_in_range(&joint_from_mesh) {
            return Err(failed!(
                "the inverse bind matrix of joint `{}` is not finite or beyond {MAX_COORDINATE_M:e}; export the file again",
                links[link].name
            ));
        }
        joints.push((link, links[link].link_from_node * joint_from_mesh));
    }
    Ok(Some(joints))
}

/// For each point of a skinned primitive the joint with the largest weight.
fn heaviest_joints(document: &Document, primitive: &Primitive, points: usize, joints: usize) -> Result<Vec<usize>> {
    let mut best = vec![(0.0_f32, 0_usize); points];
    for set in 0.. {
        let (Some(indices), Some(weights)) =
            (attribute(primitive, &Semantic::Joints(set)), attribute(primitive, &Semantic::Weights(set)))
        else {
            break;
        };
        let (indices, weights) = (document.integers::<4>(indices)?, document.floats::<4>(weights)?);
        if indices.len() != points || weights.len() != points {
            return Err(failed!(
                "{} joint and {} weight rows for {points} vertices; export the file again",
                indices.len(),
                weights.len()
            ));
        }
        for (best, (indices, weights)) in best.iter_mut().zip(indices.iter().zip(&weights)) {
            for (&joint, &weight) in indices.iter().zip(weights) {
                if weight > best.0 {
                    *best = (weight, joint as usize);
                }
            }
        }
    }
    if let Some((_, joint)) = best.iter().find(|(_, joint)| *joint >= joints) {
        return Err(failed!("a vertex names joint {joint} of {joints}; export the file again"));
    }
    Ok(best.into_iter().map(|(_, joint)| joint).collect())
}

fn read_meshes(
    document: &Document,
    nodes: &Nodes<'_>,
    node: usize,
    body: &mut Body,
    sources: &mut Sources,
) -> Result<()> {
    let Some(mesh) = nodes.raw[node].mesh else { return Ok(()) };
    let mesh_name = document.root.meshes[mesh.value()].name.clone();
    let place = nodes.raw[node].name.clone().or(mesh_name).unwrap_or_else(|| format!("node_{node}"));
    let in_place = |e: Error| e.at(format!("node `{place}`"));
    let joints = joints_of(document, nodes, node, &body.links).map_err(in_place)?;
    let carrier = nodes
        .link_above(node)
        .or_else(|| joints.as_ref()?.first().map(|(link, _)| *link))
        .ok_or_else(|| in_place(Error::failed("nothing carries it: put it under a link, or give its skin joints")))?;
    for (index, primitive) in document.root.meshes[mesh.value()].primitives.iter().enumerate() {
        let Some(positions) = finite_positions(document, primitive).map_err(in_place)? else { continue };
        let heaviest = match &joints {
            Some(joints) if !joints.is_empty() => {
                heaviest_joints(document, primitive, positions.len(), joints.len()).map_err(in_place)?
            }
            _ => Vec::new(),
        };
        // link_from_mesh of a point: its heaviest joint's, or its node's.
        let link_from_node = body.links[carrier].body_from_link.inverse() * nodes.body_from_node[node];
        let of_point = |point: usize| match (&joints, heaviest.get(point)) {
            (Some(joints), Some(&joint)) => joints[joint],
            _ => (carrier, link_from_node),
        };
        let in_link =
            |(point, p): (usize, &[f32; 3])| of_point(point).1.transform_point3(DVec3::from_array(p.map(f64::from)));
        refuse_far(positions.iter().enumerate().map(in_link)).map_err(in_place)?;
        if is_taxels(primitive) {
            let taxels = read_taxels(document, primitive, &positions, of_point).map_err(in_place)?;
            let source = |(point, taxel): (usize, &Taxel)| TaxelSource {
                mesh: mesh.value(),
                primitive: index,
                point,
                id: taxel.id,
                link_from_mesh: of_point(point).1,
            };
            sources.taxels.extend(taxels.iter().enumerate().map(source));
            body.taxels.extend(taxels);
            continue;
        }
        let triangles = read_triangles(document, primitive, positions.len()).map_err(in_place)?;
        if triangles.is_empty() {
            if has_mode(primitive, Mode::Points) {
                let in_body = |(point, p): (usize, &[f32; 3])| {
                    let (link, link_from_mesh) = of_point(point);
                    let body_from_mesh = body.links[link].body_from_link * link_from_mesh;
                    body_from_mesh.transform_point3(DVec3::from_array(p.map(f64::from)))
                };
                sources.points.push((place.clone(), positions.iter().enumerate().map(in_body).collect()));
            }
            continue;
        }
        sources.surfaces.push((node, index));
        let positions: Vec<DVec3> = positions.iter().map(|p| DVec3::from_array(p.map(f64::from))).collect();
        let home = match &joints {
            Some(joints) if !heaviest.is_empty() => {
                let ways: Vec<DAffine3> =
                    joints.iter().map(|(link, way)| body.links[*link].body_from_link * *way).collect();
                let at_rest = skinned_vertices(document, primitive, &positions, &heaviest, &ways).map_err(in_place)?;
                Home::Skinned { joints: joints.clone(), heaviest, at_rest }
            }
            _ => Home::Rigid { link: carrier, link_from_mesh: link_from_node },
        };
        body.surfaces.push(Surface { name: place.clone(), positions, triangles, home });
    }
    Ok(())
}

fn read_triangles(document: &Document, primitive: &Primitive, vertices: usize) -> Result<Vec<[u32; 3]>> {
    let Checked::Valid(mode) = primitive.mode else { return Ok(Vec::new()) };
    if !matches!(mode, Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan) {
        return Ok(Vec::new());
    }
    let order: Vec<u32> = match primitive.indices {
        Some(indices) => document.integers::<1>(indices.value())?.into_iter().map(|[i]| i).collect(),
        None => (0..u32::try_from(vertices).unwrap_or(u32::MAX)).collect(),
    };
    if let Some(beyond) = order.iter().find(|&&i| i as usize >= vertices) {
        return Err(failed!("a triangle names vertex {beyond} of {vertices}: the file is damaged; export it again"));
    }
    let triangles: Vec<[u32; 3]> = match mode {
        Mode::Triangles => order.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect(),
        Mode::TriangleStrip => order
            .windows(3)
            .enumerate()
            .map(|(i, t)| if i % 2 == 0 { [t[0], t[1], t[2]] } else { [t[1], t[0], t[2]] })
            .collect(),
        _ => order.get(1..).unwrap_or(&[]).windows(2).map(|t| [order[0], t[0], t[1]]).collect(),
    };
    // Triangles with a repeated vertex have no area.
    Ok(triangles.into_iter().filter(|[a, b, c]| a != b && b != c && c != a).collect())
}

fn read_taxels(
    document: &Document,
    primitive: &Primitive,
    positions: &[[f32; 3]],
    of_point: impl Fn(usize) -> (usize, DAffine3),
) -> Result<Vec<Taxel>> {
    let column = |name: &str| -> Result<Option<Vec<f32>>> {
        let Some(accessor) = custom(primitive, name) else { return Ok(None) };
        if !document.is_scalar_float(accessor) {
            return Err(failed!("attribute _{name} is not SCALAR FLOAT; other types are lost or changed by editors"));
        }
        let column: Vec<f32> = document.floats::<1>(accessor)?.into_iter().map(|[x]| x).collect();
        if column.len() != positions.len() {
            return Err(failed!(
                "attribute _{name} has {} values for {} points; export the file again",
                column.len(),
                positions.len()
            ));
        }
        Ok(Some(column))
    };
    let ids = column(TAXEL_ID)?.unwrap_or_default();
    let normals = [column(NORMAL[0])?, column(NORMAL[1])?, column(NORMAL[2])?];
    let tangents = [column(TANGENT[0])?, column(TANGENT[1])?, column(TANGENT[2])?];
    let areas = column(AREA)?;
    let modalities = column(MODALITY)?;
    let mut taxels = Vec::with_capacity(ids.len());
    for (point, (&id, position)) in ids.iter().zip(positions).enumerate() {
        if !(id >= 0.0 && id <= MAX_TAXEL_ID as f32 && id.fract() == 0.0) {
            return Err(failed!("point {point} has taxel id {id}; ids are whole numbers from 0 to {MAX_TAXEL_ID}"));
        }
        let (link, link_from_mesh) = of_point(point);
        let normal = match &normals {
            [Some(x), Some(y), Some(z)] => DVec3::new(x[point].into(), y[point].into(), z[point].into()),
            _ => DVec3::ZERO,
        }
        .normalize_or_zero();
        // The cofactor matrix transforms normals (as the inverse transpose) and scales areas, also for a singular node.
        let DMat3 { x_axis: x, y_axis: y, z_axis: z } = link_from_mesh.matrix3;
        let cofactor = DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y));
        let mirrored = link_from_mesh.matrix3.determinant() < 0.0;
        let stretched = cofactor * if mirrored { -normal } else { normal };
        let area = areas.as_ref().map_or(0.0, |areas| f64::from(areas[point]));
        if !(area.is_finite() && area >= 0.0) {
            return Err(failed!("taxel {id} has area {area}; areas are m², 0 where unknown"));
        }
        let stretch = if normal == DVec3::ZERO { 1.0 } else { stretched.length() };
        let modality = modalities.as_ref().map_or(0.0, |m| m[point]);
        let tangent = match &tangents {
            [Some(x), Some(y), Some(z)] => DVec3::new(x[point].into(), y[point].into(), z[point].into()),
            _ => DVec3::ZERO,
        };
        let normal_in_link = stretched.normalize_or_zero();
        let tangent_in_link = link_from_mesh.transform_vector3(tangent).reject_from(normal_in_link).try_normalize();
        taxels.push(Taxel {
            id: id as u32,
            link,
            position_in_link: link_from_mesh.transform_point3(DVec3::from_array(position.map(f64::from))),
            normal_in_link,
            area: area * stretch,
            modality: Modality::from_code(if modality >= 0.0 { modality as u32 } else { 0 }),
            tangent_in_link,
        });
    }
    Ok(taxels)
}

/// Sets missing or zero normals of taxels to that of the nearest surface.
fn complete_normals(body: &mut Body) -> Result<()> {
    let mut without: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for (index, taxel) in body.taxels.iter().enumerate() {
        if taxel.normal_in_link == DVec3::ZERO {
            without.entry(taxel.link).or_default().push(index);
        }
    }
    for (link, taxels) in without {
        let surface = body.surface_in_link(link);
        if surface.is_empty() {
            return Err(failed!(
                "taxel {} has no normal, and there is no surface to take it from; add _NX, _NY, _NZ or a mesh",
                body.taxels[taxels[0]].id
            ));
        }
        body.findings.push(format!(
            "{} taxels on link `{}` have no normal of their own; the surface's are used",
            taxels.len(),
            body.links[link].name
        ));
        for taxel in taxels {
            let hit = surface.nearest(body.taxels[taxel].position_in_link);
            body.taxels[taxel].normal_in_link = hit.map_or(DVec3::Z, |hit| hit.normal);
        }
    }
    Ok(())
}

fn read_fields(document: &Document, nodes: &Nodes<'_>, body: &mut Body) -> Result<Vec<FieldSpec>> {
    let mut fields: Vec<FieldSpec> = Vec::new();
    for &node in &nodes.in_order {
        let Some(text) = &nodes.field[node] else { continue };
        let place = document.root.nodes[node].name.clone().unwrap_or_else(|| format!("node_{node}"));
        fields.push(FieldSpec::from_json(text).map_err(|e| e.at(format!("field node `{place}`")))?);
    }
    fields.sort_by(|a, b| a.name.cmp(&b.name));
    if let Some(pair) = fields.windows(2).find(|pair| pair[0].name == pair[1].name) {
        return Err(failed!("two fields are called `{}`; rename one", pair[0].name));
    }
    repair::remove_absent_members(body, &mut fields);
    parents_first(fields)
}

/// The fields sorted by name, with parents before children.
fn parents_first(fields: Vec<FieldSpec>) -> Result<Vec<FieldSpec>> {
    let names: HashMap<&str, usize> = fields.iter().enumerate().map(|(i, f)| (f.name.as_str(), i)).collect();
    let mut depths = Vec::with_capacity(fields.len());
    for field in &fields {
        let mut depth = 0;
        let mut at = field;
        while let Some(parent) = &at.parent {
            depth += 1;
            at = names.get(parent.as_str()).map(|&i| &fields[i]).ok_or_else(|| {
                failed!(
                    "field `{}` has the parent `{parent}`, which is not a field of this body; name another",
                    at.name
                )
            })?;
            if depth > MAX_FIELD_DEPTH {
                let above = |at: &&FieldSpec| Some(&fields[*names.get(at.parent.as_deref()?)?]);
                let is_ring = std::iter::successors(Some(field), above).take(fields.len() + 1).count() > fields.len();
                let name = &field.name;
                return Err(match is_ring {
                    true => failed!("field `{name}` is its own ancestor; break the ring"),
                    false => failed!(
                        "field `{name}` has over {MAX_FIELD_DEPTH} fields above it; put fewer within each other"
                    ),
                });
            }
        }
        depths.push(depth);
    }
    let mut in_order: Vec<(usize, FieldSpec)> = depths.into_iter().zip(fields).collect();
    in_order.sort_by_key(|(depth, _)| *depth);
    Ok(in_order.into_iter().map(|(_, field)| field).collect())
}
