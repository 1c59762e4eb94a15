//! glTF put together by hand, for bodies that no tool would write.
#![allow(dead_code, unreachable_pub)] // Each test uses its own part of this.

use base64::Engine as _;
use serde_json::{Value, json};
use somatic::{Body, Result};

pub const FLOAT: u32 = 5126;
pub const U16: u32 = 5123;

/// A `.gltf` put together by hand; its numbers go into one buffer that the JSON carries along.
pub struct Draft {
    pub json: Value,
    pub bytes: Vec<u8>,
}

impl Default for Draft {
    fn default() -> Self {
        let json = json!({
            "asset": {"version": "2.0"}, "nodes": [], "meshes": [], "accessors": [], "bufferViews": [],
        });
        Self { json, bytes: Vec::new() }
    }
}

impl Draft {
    pub fn push(&mut self, list: &str, value: Value) -> usize {
        let list = self.json[list].as_array_mut().unwrap();
        list.push(value);
        list.len() - 1
    }

    pub fn node(&mut self, node: Value) -> usize {
        self.push("nodes", node)
    }

    pub fn view(&mut self, bytes: &[u8]) -> usize {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let view = json!({"buffer": 0, "byteOffset": self.bytes.len(), "byteLength": bytes.len()});
        self.bytes.extend_from_slice(bytes);
        self.push("bufferViews", view)
    }

    pub fn accessor(&mut self, component: u32, kind: &str, count: usize, bytes: &[u8]) -> usize {
        let view = self.view(bytes);
        let accessor = json!({"bufferView": view, "componentType": component, "type": kind, "count": count});
        self.push("accessors", accessor)
    }

    pub fn scalars(&mut self, values: &[f32]) -> usize {
        self.accessor(FLOAT, "SCALAR", values.len(), bytemuck::cast_slice(values))
    }

    /// An accessor over points, with the bounds that glTF asks of positions.
    pub fn points(&mut self, points: &[[f32; 3]]) -> usize {
        let accessor = self.accessor(FLOAT, "VEC3", points.len(), bytemuck::cast_slice(points));
        self.bounds(accessor);
        accessor
    }

    pub fn bounds(&mut self, accessor: usize) {
        self.json["accessors"][accessor]["min"] = json!([-1e3, -1e3, -1e3]);
        self.json["accessors"][accessor]["max"] = json!([1e3, 1e3, 1e3]);
    }

    pub fn indices(&mut self, indices: &[u16]) -> usize {
        self.accessor(U16, "SCALAR", indices.len(), bytemuck::cast_slice(indices))
    }

    pub fn mesh(&mut self, primitive: &Value) -> usize {
        self.push("meshes", json!({"primitives": [primitive]}))
    }

    /// A mesh of taxels at `points`, all facing +z, with ids from `ids` and 1 mm² each.
    pub fn taxels(&mut self, points: &[[f32; 3]], ids: &[f32]) -> usize {
        let count = points.len();
        let attributes = json!({
            "POSITION": self.points(points),
            "_TAXEL_ID": self.scalars(ids),
            "_NX": self.scalars(&vec![0.0; count]),
            "_NY": self.scalars(&vec![0.0; count]),
            "_NZ": self.scalars(&vec![1.0; count]),
            "_AREA": self.scalars(&vec![1e-6; count]),
        });
        self.mesh(&json!({"mode": 0, "attributes": attributes}))
    }

    pub fn field(&mut self, text: &str) -> usize {
        self.node(json!({"name": "outline", "extras": {"somatic_field": text}}))
    }

    pub fn to_bytes(&self) -> Vec<u8> {
        let mut json = self.json.clone();
        // glTF has no empty lists.
        json.as_object_mut().unwrap().retain(|_, value| value.as_array().is_none_or(|list| !list.is_empty()));
        if !self.bytes.is_empty() {
            let text = base64::engine::general_purpose::STANDARD.encode(&self.bytes);
            let uri = format!("data:application/octet-stream;base64,{text}");
            json["buffers"] = json!([{"byteLength": self.bytes.len(), "uri": uri}]);
        }
        serde_json::to_vec(&json).unwrap()
    }

    pub fn load(&self) -> Result<Body> {
        Body::from_bytes("draft.gltf", &self.to_bytes())
    }

    /// The one line that refuses this file.
    pub fn why(&self) -> String {
        self.load().expect_err("the file should be refused").to_string()
    }
}
