//! Writes glTF: a `.glb` as JSON and bytes, to which meshes, taxels and fields are added.
//!
//! Existing content is not changed: accessors, bytes and nodes are appended.

use std::collections::BTreeMap;

use glam::{DAffine3, DVec3};
use serde_json::{Map, Value, json};

use super::axes::Up;
use super::joint::{JOINT_KEY, LinkJoint};
use super::layout::{AREA, FIELD_KEY, FieldSpec, MODALITY, NORMAL, TANGENT, TAXEL_ID};
use super::model::Taxel;
use super::stored_edges::{EDGES_KEY, StoredEdges};
use super::urdf_root::{self, URDF_KEY};
use crate::error::{Error, Result};
use crate::output::OutputPath;

const FLOAT: u32 = 5126;
const UNSIGNED_INT: u32 = 5125;
const UNSIGNED_SHORT: u32 = 5123;
const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;

/// A new `.glb`, or an addition to an existing file.
pub struct Glb {
    pub(super) json: Map<String, Value>,
    pub(super) bin: Vec<u8>,
    pub(super) before: BaseFile,
}

/// The file to which an addition belongs.
#[derive(Clone, Debug, Default)]
pub(super) struct BaseFile {
    pub(super) counts: BTreeMap<String, usize>,
    /// Bytes of its buffer, a multiple of four.
    pub(super) bytes: usize,
    /// New children of its nodes: (parent, child).
    pub(super) adopted: Vec<(usize, usize)>,
}

/// A triangle mesh to write, in metres.
#[derive(Clone, Debug, Default)]
pub struct MeshData {
    /// Vertices.
    pub positions: Vec<[f32; 3]>,
    /// Unit normals, one per vertex.
    pub normals: Vec<[f32; 3]>,
    /// Counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
    /// Joints and weights of each vertex, for a skinned mesh.
    pub skinning: Option<Skinning>,
}

/// The four joints with the largest weights for each vertex; weights sum to 1.
#[derive(Clone, Debug, Default)]
pub struct Skinning {
    /// Indices into the skin's joints.
    pub joints: Vec<[u16; 4]>,
    /// Weights in the same order.
    pub weights: Vec<[f32; 4]>,
}

impl Default for Glb {
    fn default() -> Self {
        Self::new()
    }
}

impl Glb {
    /// An empty file with one empty scene.
    #[must_use]
    pub fn new() -> Self {
        let json = json!({
            "asset": {"version": "2.0", "generator": concat!("somatic ", env!("CARGO_PKG_VERSION"))},
            "scene": 0,
            "scenes": [{"nodes": []}],
        });
        let Value::Object(json) = json else { unreachable!("it was written as an object") };
        Self { json, bin: Vec::new(), before: BaseFile::default() }
    }

    pub(super) fn for_base(before: BaseFile) -> Self {
        Self { before, ..Self::new() }
    }

    fn count_before(&self, key: &str) -> usize {
        self.before.counts.get(key).copied().unwrap_or(0)
    }

    /// Element `index` of a list, if it was added.
    fn element(&mut self, key: &str, index: usize) -> Option<&mut Value> {
        let own = index.checked_sub(self.count_before(key))?;
        self.list(key).get_mut(own)
    }

    fn list(&mut self, key: &str) -> &mut Vec<Value> {
        self.json.entry(key).or_insert_with(|| Value::Array(Vec::new())).as_array_mut().expect("glTF keeps a list here")
    }

    fn push(&mut self, key: &str, value: Value) -> usize {
        let list = self.list(key);
        list.push(value);
        let own = list.len() - 1;
        self.count_before(key) + own
    }

    /// Appends `bytes` as a buffer view of their own, and an accessor over them.
    fn accessor(&mut self, bytes: &[u8], target: Option<u32>, mut accessor: Value) -> usize {
        while !self.bin.len().is_multiple_of(4) {
            self.bin.push(0);
        }
        let offset = self.before.bytes + self.bin.len();
        let mut view = json!({"buffer": 0, "byteOffset": offset, "byteLength": bytes.len()});
        if let Some(target) = target {
            view["target"] = target.into();
        }
        self.bin.extend_from_slice(bytes);
        accessor["bufferView"] = self.push("bufferViews", view).into();
        self.push("accessors", accessor)
    }

    fn positions(&mut self, positions: &[[f32; 3]]) -> usize {
        let extreme = |better: fn(f32, f32) -> f32, start: f32| {
            positions.iter().fold([start; 3], |m, p| [better(m[0], p[0]), better(m[1], p[1]), better(m[2], p[2])])
        };
        let accessor = json!({
            "componentType": FLOAT, "count": positions.len(), "type": "VEC3",
            "min": extreme(f32::min, f32::INFINITY), "max": extreme(f32::max, f32::NEG_INFINITY),
        });
        self.accessor(bytemuck::cast_slice(positions), Some(ARRAY_BUFFER), accessor)
    }

    fn vectors(&mut self, kind: &str, count: usize, bytes: &[u8]) -> usize {
        self.accessor(bytes, Some(ARRAY_BUFFER), json!({"componentType": FLOAT, "count": count, "type": kind}))
    }

    /// Adds a column of numbers and returns the index of its accessor.
    pub(super) fn scalars(&mut self, values: &[f32]) -> usize {
        self.vectors("SCALAR", values.len(), bytemuck::cast_slice(values))
    }

    /// Adds a node under `parent`, or to the scene, and returns its index.
    pub fn node(&mut self, name: &str, parent: Option<usize>, translation: DVec3) -> usize {
        let mut node = json!({"name": name});
        if translation != DVec3::ZERO {
            node["translation"] = json!(translation.as_vec3().to_array());
        }
        let index = self.push("nodes", node);
        let (owner, key) = match parent {
            Some(parent) => match self.element("nodes", parent) {
                Some(parent) => (parent, "children"),
                None => {
                    self.before.adopted.push((parent, index));
                    return index;
                }
            },
            None => (&mut self.list("scenes")[0], "nodes"),
        };
        match owner.get_mut(key).and_then(Value::as_array_mut) {
            Some(children) => children.push(index.into()),
            None => owner[key] = json!([index]),
        }
        index
    }

    /// Adds a node as [`Self::node`] does, moved and turned by the rigid transform `parent_from_node`.
    pub fn placed_node(&mut self, name: &str, parent: Option<usize>, parent_from_node: DAffine3) -> usize {
        let (_, rotation, translation) = parent_from_node.to_scale_rotation_translation();
        let index = self.node(name, parent, translation);
        let own = self.element("nodes", index).expect("it was just added");
        if rotation.xyz().length() > 0.0 {
            own["rotation"] = json!(rotation.as_quat().to_array());
        }
        index
    }

    /// Keeps `joint`, which moves the added link `node` against its parent.
    pub fn joint(&mut self, node: usize, joint: &LinkJoint) {
        let own = self.element("nodes", node).expect("only nodes that were added get joints");
        own["extras"][JOINT_KEY] = joint.to_json().into();
    }

    /// Keeps that the added link `node` is the root of a URDF in which `up` points up.
    pub fn urdf_root(&mut self, node: usize, up: Up) {
        let own = self.element("nodes", node).expect("only nodes that were added are roots");
        own["extras"][URDF_KEY] = urdf_root::to_json(up).into();
    }

    /// Adds a plain material and returns its index.
    pub fn material(&mut self, name: &str, rgb: [f32; 3], roughness: f32) -> usize {
        let [r, g, b] = rgb;
        let material = json!({
            "name": name,
            "pbrMetallicRoughness": {"baseColorFactor": [r, g, b, 1.0], "metallicFactor": 0.0, "roughnessFactor": roughness},
        });
        self.push("materials", material)
    }

    /// Adds a skin whose joints are the nodes `joints`; `inverse_binds` are column-major, one per joint.
    pub fn skin(&mut self, name: &str, joints: &[usize], inverse_binds: &[[f32; 16]]) -> usize {
        let accessor = json!({"componentType": FLOAT, "count": inverse_binds.len(), "type": "MAT4"});
        let binds = self.accessor(bytemuck::cast_slice(inverse_binds), None, accessor);
        self.push("skins", json!({"name": name, "joints": joints, "inverseBindMatrices": binds}))
    }

    /// Shows `mesh` at `node`.
    pub fn mesh(&mut self, node: usize, name: &str, mesh: &MeshData, material: Option<usize>, skin: Option<usize>) {
        let indices = json!({"componentType": UNSIGNED_INT, "count": 3 * mesh.triangles.len(), "type": "SCALAR"});
        let mut attributes = json!({
            "POSITION": self.positions(&mesh.positions),
            "NORMAL": self.vectors("VEC3", mesh.normals.len(), bytemuck::cast_slice(&mesh.normals)),
        });
        if let Some(skinning) = &mesh.skinning {
            self.skinning(&mut attributes, skinning);
        }
        let indices = self.accessor(bytemuck::cast_slice(&mesh.triangles), Some(ELEMENT_ARRAY_BUFFER), indices);
        let mut primitive = json!({"attributes": attributes, "indices": indices});
        if let Some(material) = material {
            primitive["material"] = material.into();
        }
        self.show(node, name, &primitive, skin);
    }

    fn skinning(&mut self, attributes: &mut Value, skinning: &Skinning) {
        let joints = json!({"componentType": UNSIGNED_SHORT, "count": skinning.joints.len(), "type": "VEC4"});
        attributes["JOINTS_0"] =
            self.accessor(bytemuck::cast_slice(&skinning.joints), Some(ARRAY_BUFFER), joints).into();
        attributes["WEIGHTS_0"] =
            self.vectors("VEC4", skinning.weights.len(), bytemuck::cast_slice(&skinning.weights)).into();
    }

    fn show(&mut self, node: usize, name: &str, primitive: &Value, skin: Option<usize>) {
        let mesh = self.push("meshes", json!({"name": name, "primitives": [primitive]}));
        let node = self.element("nodes", node).expect("only nodes that were added show meshes");
        node["mesh"] = mesh.into();
        if let Some(skin) = skin {
            node["skin"] = skin.into();
        }
    }

    /// Adds `taxels` as points of a new node under `parent`. Positions and normals are in that node's frame; with `skin`, in
    /// the skinned mesh's, with joints and weights.
    pub fn taxels(
        &mut self,
        name: &str,
        parent: Option<usize>,
        taxels: &[Taxel],
        skin: Option<(usize, &Skinning)>,
    ) -> usize {
        let node = self.node(name, parent, DVec3::ZERO);
        let positions: Vec<[f32; 3]> = taxels.iter().map(|t| t.position_in_link.as_vec3().to_array()).collect();
        let mut attributes = json!({"POSITION": self.positions(&positions)});
        if let Some((_, skinning)) = skin {
            self.skinning(&mut attributes, skinning);
        }
        let mut column = |name: &str, value: &dyn Fn(&Taxel) -> f64| {
            let values: Vec<f32> = taxels.iter().map(|t| value(t) as f32).collect();
            attributes[format!("_{name}")] = self.scalars(&values).into();
        };
        column(TAXEL_ID, &|t| t.id.into());
        column(NORMAL[0], &|t| t.normal_in_link.x);
        column(NORMAL[1], &|t| t.normal_in_link.y);
        column(NORMAL[2], &|t| t.normal_in_link.z);
        column(AREA, &|t| t.area);
        column(MODALITY, &|t| t.modality.code().into());
        if taxels.iter().any(|taxel| taxel.tangent_in_link.is_some()) {
            for (name, axis) in TANGENT.into_iter().zip(0..) {
                column(name, &|t| t.tangent_in_link.map_or(0.0, |tangent| tangent[axis]));
            }
        }
        let primitive = json!({"attributes": attributes, "mode": 0});
        self.show(node, name, &primitive, skin.map(|(skin, _)| skin));
        node
    }

    /// Adds `field` as an empty node under `parent`, at `origin` in that node's frame.
    pub fn field(&mut self, field: &FieldSpec, parent: Option<usize>, origin: DVec3) -> usize {
        let node = self.node(&field.name, parent, origin);
        let own = self.element("nodes", node).expect("it was just added");
        own["extras"] = json!({FIELD_KEY: field.to_json()});
        node
    }

    /// Adds `edges` between taxels as an empty node of the scene.
    pub fn edges(&mut self, edges: &StoredEdges) -> usize {
        let node = self.node("taxel edges", None, DVec3::ZERO);
        let own = self.element("nodes", node).expect("it was just added");
        own["extras"] = json!({EDGES_KEY: edges.to_json()});
        node
    }

    /// Sets the scene's description for people who open the file.
    pub fn describe(&mut self, notes: &BTreeMap<&str, &str>) {
        self.list("scenes")[0]["extras"] = json!(notes);
    }

    /// The whole file.
    ///
    /// # Errors
    /// The file would pass the 4 GiB a `.glb` can hold.
    pub fn to_bytes(&self) -> Result<Vec<u8>> {
        let mut json = self.json.clone();
        if !self.bin.is_empty() {
            let length = self.bin.len().next_multiple_of(4);
            json.insert("buffers".into(), json!([{"byteLength": length}]));
        }
        container(&serde_json::to_string(&json).expect("JSON values print"), &self.bin, &[])
    }

    /// Writes the file to `output` atomically.
    ///
    /// # Errors
    /// The folder cannot be written to, or the disk is full.
    pub fn save(&self, output: OutputPath) -> Result<()> {
        output.write(&self.to_bytes()?)
    }
}

/// A `.glb` of the JSON `text`, the buffer `bin` and `rest`, further chunks; an error over the 4 GiB that it can hold.
pub(super) fn container(text: &str, bin: &[u8], rest: &[u8]) -> Result<Vec<u8>> {
    let (text_end, bin_length) = (20 + text.len().next_multiple_of(4), bin.len().next_multiple_of(4));
    let length = text_end + if bin.is_empty() { 0 } else { 8 + bin_length } + rest.len();
    let Ok(whole) = u32::try_from(length) else {
        return Err(Error::failed("the body would pass the 4 GiB that a .glb can hold; split it"));
    };
    let mut bytes = Vec::with_capacity(length);
    bytes.extend(b"glTF");
    for number in [2, whole, text_end as u32 - 20] {
        bytes.extend(number.to_le_bytes());
    }
    bytes.extend(b"JSON");
    bytes.extend(text.as_bytes());
    bytes.resize(text_end, b' ');
    if !bin.is_empty() {
        bytes.extend((bin_length as u32).to_le_bytes());
        bytes.extend(b"BIN\0");
        bytes.extend(bin);
        bytes.resize(text_end + 8 + bin_length, 0);
    }
    bytes.extend(rest);
    Ok(bytes)
}
