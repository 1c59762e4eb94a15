//! Updates a layout in its file: ids, normals and members of fields.

use std::collections::{BTreeMap, BTreeSet};

use glam::DVec3;

use super::details::Details;
use super::document::Document;
use super::json_edit::JsonEdit;
use super::layout::{FIELD_KEY, FieldSpec, NORMAL, TAXEL_ID};
use super::model::Body;
use super::original::Original;
use super::primitives::custom;
use super::stored_edges::{EDGES_KEY, StoredEdges};
use crate::error::Result;

/// New columns of taxel attributes: by mesh and primitive, the name (without underscore) and one number per point.
type Columns = BTreeMap<(usize, usize), Vec<(&'static str, Vec<f32>)>>;

impl Original {
    /// Writes the ids and normals of taxels and the fields of `now` that differ from `read`, the body in the file with its
    /// `details`. Everything else stays unchanged.
    ///
    /// Returns a line for each mesh whose points cannot be changed because several nodes show it.
    ///
    /// # Errors
    /// The file is not a valid body any more.
    pub fn amend(&mut self, read: &Body, now: &Body, details: &Details) -> Result<Vec<String>> {
        let (columns, notes) = self.columns(read, now, details)?;
        let mut addition = self.addition();
        let mut accessors = Vec::new();
        for (place, columns) in columns {
            for (name, values) in columns {
                accessors.push((place, format!("_{name}"), addition.scalars(&values)));
            }
        }
        self.add(&addition);
        let mut edit = JsonEdit::new(&self.text);
        let meshes = edit.list("meshes");
        let mut added: BTreeMap<(usize, usize), Vec<(String, String)>> = BTreeMap::new();
        for ((mesh, primitive), name, accessor) in accessors {
            let primitives = edit.list_in(&meshes[mesh], "primitives");
            let Some(attributes) = primitives.get(primitive).and_then(|p| edit.member(p, "attributes")) else {
                continue;
            };
            match edit.member(&attributes, &name) {
                Some(old) => edit.replace(old, accessor.to_string()),
                None => added.entry((attributes.start, attributes.end)).or_default().push((name, accessor.to_string())),
            }
        }
        for ((start, end), members) in added {
            edit.extend(&(start..end), &members);
        }
        for node in edit.list("nodes") {
            let extras = edit.member(&node, "extras");
            let Some(span) = extras.and_then(|extras| edit.member(&extras, FIELD_KEY)) else { continue };
            let text = serde_json::from_str::<String>(edit.get(&span));
            let Some(old) = text.ok().and_then(|text| FieldSpec::from_json(&text).ok()) else { continue };
            if let Some(new) = now.fields.iter().find(|field| field.name == old.name).filter(|new| **new != old) {
                edit.replace(span, serde_json::Value::from(new.to_json()).to_string());
            }
        }
        self.text = edit.apply();
        Ok(notes)
    }

    /// Writes `edges` between taxels in place of those that it has, if these differ.
    pub fn set_edges(&mut self, edges: &StoredEdges) {
        let mut edit = JsonEdit::new(&self.text);
        let text = edges.to_json();
        let mut is_there = false;
        for node in edit.list("nodes") {
            let Some(extras) = edit.member(&node, "extras") else { continue };
            let Some(span) = edit.member(&extras, EDGES_KEY) else { continue };
            is_there = true;
            // Copies, which editors make, stay copies.
            if serde_json::from_str::<String>(edit.get(&span)).ok().as_ref() != Some(&text) {
                edit.replace(span, serde_json::Value::from(text.as_str()).to_string());
            }
        }
        self.text = edit.apply();
        if !is_there {
            let mut addition = self.addition();
            addition.edges(edges);
            self.add(&addition);
        }
    }

    /// The columns that differ in `now`.
    fn columns(&self, read: &Body, now: &Body, details: &Details) -> Result<(Columns, Vec<String>)> {
        let mut changed: BTreeMap<(usize, usize), Vec<usize>> = BTreeMap::new();
        let (mut points, mut shared) = (BTreeSet::new(), BTreeSet::new());
        for (index, source) in details.taxels.iter().enumerate() {
            let place = (source.mesh, source.primitive);
            if !points.insert((place, source.point)) {
                shared.insert(place);
            }
            if now.taxels[index].id != source.id
                || now.taxels[index].normal_in_link != read.taxels[index].normal_in_link
            {
                changed.entry(place).or_default().push(index);
            }
        }
        let (mut columns, mut notes) = (Columns::new(), Vec::new());
        if changed.is_empty() {
            return Ok((columns, notes));
        }
        let document = Document::parse(&self.to_glb()?, None)?;
        for (place, taxels) in changed {
            let mesh = &document.root.meshes[place.0];
            if shared.contains(&place) {
                let name = mesh.name.clone().unwrap_or_else(|| format!("mesh_{}", place.0));
                notes.push(format!(
                    "several nodes show the taxels of mesh `{name}`, so that they stay as they are; give each its own mesh"
                ));
                continue;
            }
            let primitive = &mesh.primitives[place.1];
            let column = |name: &str| -> Result<Option<Vec<f32>>> {
                let values = custom(primitive, name).map(|accessor| document.floats::<1>(accessor)).transpose()?;
                Ok(values.map(|values| values.into_iter().map(|[x]| x).collect()))
            };
            let new = columns.entry(place).or_default();
            if let Some(mut ids) = column(TAXEL_ID)? {
                taxels.iter().for_each(|&index| ids[details.taxels[index].point] = now.taxels[index].id as f32);
                new.push((TAXEL_ID, ids));
            }
            let moved = |&&index: &&usize| now.taxels[index].normal_in_link != read.taxels[index].normal_in_link;
            let turned: Vec<usize> = taxels.iter().filter(moved).copied().collect();
            if turned.is_empty() {
                continue;
            }
            let own = details.taxels.iter().filter(|source| (source.mesh, source.primitive) == place).count();
            for (axis, name) in NORMAL.into_iter().enumerate() {
                // A missing normal is stored as zero.
                let mut values = column(name)?.unwrap_or_else(|| vec![0.0; own]);
                for &index in &turned {
                    let source = &details.taxels[index];
                    values[source.point] =
                        in_mesh(source.link_from_mesh, now.taxels[index].normal_in_link)[axis] as f32;
                }
                new.push((name, values));
            }
        }
        Ok((columns, notes))
    }
}

/// The link's `normal` in a mesh's coordinates, by the transpose: the inverse of the reader's transform, up to length.
fn in_mesh(link_from_mesh: glam::DAffine3, normal: DVec3) -> DVec3 {
    (link_from_mesh.matrix3.transpose() * normal).normalize_or(normal)
}
