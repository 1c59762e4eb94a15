//! A user's file to which a layout is added; everything else stays unchanged, to the byte where glTF allows.
//!
//! The JSON is edited as text and the buffer only grows. External buffers and images are embedded.

use std::path::Path;

use base64::Engine as _;
use serde_json::{Value, json};

use super::details::{self, Details};
use super::document::{Document, fetch, refuse_other_formats, split};
use super::glb::{BaseFile, Glb, container};
use super::json_edit::JsonEdit;
use super::model::Body;
use crate::error::{Error, Result};
use crate::limits::{self, MAX_BODY_BYTES};
use crate::output::OutputPath;

const LAYOUT_LISTS: [&str; 4] = ["accessors", "bufferViews", "meshes", "nodes"];

/// Key in the extras of a node that scales a file to metres: the file's unit.
const UNIT_KEY: &str = "somatic_unit";

/// A glTF file that is to get a layout.
#[derive(Clone, Debug)]
pub struct Original {
    pub(super) name: String,
    pub(super) text: String,
    /// The one buffer.
    pub(super) bin: Vec<u8>,
    /// The chunks that a `.glb` has after the buffer.
    rest: Vec<u8>,
    /// External files that could not be embedded.
    pub notes: Vec<String>,
}

impl Original {
    /// Opens the `.glb` or `.gltf` at `path`.
    ///
    /// # Errors
    /// The file cannot be read or is not a valid glTF.
    pub fn open(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        let bytes = limits::read(path, MAX_BODY_BYTES).map_err(|e| Error::io(path, &e))?;
        Self::from_bytes(&path.display().to_string(), &bytes, path.parent())
    }

    /// Opens the file in `bytes`, called `name` in messages; external files are read from `folder`.
    ///
    /// # Errors
    /// As [`Original::open`].
    pub fn from_bytes(name: &str, bytes: &[u8], folder: Option<&Path>) -> Result<Self> {
        Self::read_file(name, bytes, folder).map_err(|e| e.at(name))
    }

    fn read_file(name: &str, bytes: &[u8], folder: Option<&Path>) -> Result<Self> {
        refuse_other_formats(name, bytes)?;
        let buffers = Document::parse(bytes, folder)?.into_buffers();
        let (text, chunk) = split(bytes)?;
        let text = text.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(text);
        let text = std::str::from_utf8(text).map_err(|_| Error::failed("its JSON is not UTF-8; export it again"))?;
        let rest = rest_of(bytes).to_vec();
        let mut original =
            Self { name: name.to_owned(), text: text.trim_end().to_owned(), bin: Vec::new(), rest, notes: Vec::new() };
        original.merge_buffers(buffers, chunk)?;
        if let Some(folder) = folder {
            original.embed_images(folder);
        }
        Ok(original)
    }

    fn merge_buffers(&mut self, buffers: Vec<Vec<u8>>, chunk: Option<&[u8]>) -> Result<()> {
        let mut edit = JsonEdit::new(&self.text);
        let spans = edit.list("buffers");
        let Some(first) = spans.first().cloned() else {
            self.bin = chunk.unwrap_or_default().to_vec();
            return Ok(());
        };
        let is_alone = spans.len() == 1 && edit.member(&first, "uri").is_none();
        let mut bases = Vec::with_capacity(buffers.len());
        for (mut bytes, span) in buffers.into_iter().zip(&spans) {
            // Bytes after a buffer's length are ignored; a chunk may be padded.
            if !is_alone {
                let length = edit.number_in(span, "byteLength");
                bytes.truncate(length.ok_or_else(|| Error::failed("a buffer has no length; export the file again"))?);
            }
            self.bin.resize(self.bin.len().next_multiple_of(4), 0);
            bases.push(self.bin.len());
            self.bin.extend(bytes);
        }
        if is_alone {
            return Ok(());
        }
        for view in edit.list("bufferViews") {
            let Some(buffer) = edit.member(&view, "buffer") else { continue };
            let base = edit.number(&buffer).and_then(|index| bases.get(index)).copied().unwrap_or(0);
            if base > 0 {
                edit.replace(buffer, "0".to_owned());
                let offset = base + edit.number_in(&view, "byteOffset").unwrap_or(0);
                edit.set(&view, "byteOffset", offset.to_string());
            }
        }
        edit.remove_members(&first, |key| key == "uri");
        if spans.len() > 1 {
            if let Some(span) = edit.member(&first, "byteLength") {
                edit.replace(span, self.bin.len().to_string());
            }
            if let Some(list) = edit.member(&edit.root(), "buffers") {
                edit.remove_elements(&list, |index| index > 0);
            }
        }
        self.text = edit.apply();
        Ok(())
    }

    fn embed_images(&mut self, folder: &Path) {
        let mut edit = JsonEdit::new(&self.text);
        let first = edit.list("bufferViews").len();
        let mut views = Vec::new();
        for image in edit.list("images") {
            let Some(uri) = edit.member(&image, "uri") else { continue };
            let Ok(uri) = serde_json::from_str::<String>(edit.get(&uri)) else { continue };
            if uri.starts_with("data:") {
                continue;
            }
            let bytes = fetch(&uri, Some(folder));
            let kind = match bytes.as_deref() {
                Ok([0x89, b'P', b'N', b'G', ..]) => "\"image/png\"",
                Ok([0xFF, 0xD8, 0xFF, ..]) => "\"image/jpeg\"",
                _ => {
                    self.notes.push(format!("the image `{uri}` was not included; keep it next to the file"));
                    continue;
                }
            };
            let bytes = bytes.unwrap_or_default();
            self.bin.resize(self.bin.len().next_multiple_of(4), 0);
            let view = json!({"buffer": 0, "byteOffset": self.bin.len(), "byteLength": bytes.len()});
            let mut members = vec![("bufferView".to_owned(), (first + views.len()).to_string())];
            if edit.member(&image, "mimeType").is_none() {
                members.push(("mimeType".to_owned(), kind.to_owned()));
            }
            views.push(view.to_string());
            self.bin.extend(bytes);
            // Replaced in place, as the object may have no other member.
            let written: Vec<String> = members.iter().map(|(key, value)| format!("\"{key}\":{value}")).collect();
            if let Some(span) = edit.member_with_key(&image, "uri") {
                edit.replace(span, written.join(","));
            }
        }
        if !views.is_empty() {
            edit.append_to(&edit.root(), "bufferViews", &views);
            set_length(&mut edit, self.bin.len());
            self.text = edit.apply();
        }
    }

    /// Its name in messages.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Sets the unit of its numbers to `unit` of `metres`: adds a root node with that scale.
    ///
    /// # Errors
    /// It has another unit already, or two of its scenes share nodes.
    pub fn set_unit(&mut self, unit: &str, metres: f64) -> Result<()> {
        let mut edit = JsonEdit::new(&self.text);
        let nodes = edit.list("nodes");
        let extras = nodes.iter().filter_map(|node| edit.member(node, "extras"));
        let known = extras.filter_map(|extras| edit.member(&extras, UNIT_KEY)).next();
        if let Some(known) = known.map(|span| edit.get(&span).trim_matches('"')) {
            return match known == unit {
                true => Ok(()),
                false => Err(Error::usage(format!("it is in {known} already; leave `unit` out")).at(&self.name)),
            };
        }
        if metres == 1.0 {
            return Ok(());
        }
        let mut is_root = vec![true; nodes.len()];
        for child in nodes.iter().flat_map(|node| edit.list_in(node, "children")) {
            if let Some(child) = edit.number(&child).and_then(|child| is_root.get_mut(child)) {
                *child = false;
            }
        }
        let wrapper = |children: &[usize]| json!({"name": format!("unit {unit}"), "scale": [metres, metres, metres], "children": children, "extras": {UNIT_KEY: unit}});
        let mut wrappers = Vec::new();
        for scene in edit.list("scenes") {
            let Some(list) = edit.member(&scene, "nodes") else { continue };
            let roots: Vec<usize> = edit.elements(&list).iter().filter_map(|span| edit.number(span)).collect();
            for &root in &roots {
                if !is_root.get_mut(root).is_some_and(|is_root| std::mem::replace(is_root, false)) {
                    let what = "two of its scenes share nodes, so that a unit cannot be given to each; keep one scene";
                    return Err(Error::failed(what).at(&self.name));
                }
            }
            if !roots.is_empty() {
                edit.replace(list, format!("[{}]", nodes.len() + wrappers.len()));
                wrappers.push(wrapper(&roots).to_string());
            }
        }
        let unseen: Vec<usize> = (0..nodes.len()).filter(|&node| is_root[node]).collect();
        if !unseen.is_empty() {
            wrappers.push(wrapper(&unseen).to_string());
        }
        edit.append_to(&edit.root(), "nodes", &wrappers);
        self.text = edit.apply();
        Ok(())
    }

    /// The body that it holds now, and its details.
    ///
    /// # Errors
    /// As [`Body::load`].
    pub fn read(&self) -> Result<(Body, Details)> {
        self.to_glb().and_then(|bytes| details::read(&self.name, &bytes)).map_err(|e| e.at(&self.name))
    }

    /// An empty addition; nodes are given parents by their index in the file.
    #[must_use]
    pub fn addition(&self) -> Glb {
        let edit = JsonEdit::new(&self.text);
        let counts = LAYOUT_LISTS.iter().map(|&key| (key.to_owned(), edit.list(key).len())).collect();
        Glb::for_base(BaseFile { counts, bytes: self.bin.len().next_multiple_of(4), adopted: Vec::new() })
    }

    /// Adds `addition`, which was made for the file in its present state.
    pub fn add(&mut self, addition: &Glb) {
        let mut edit = JsonEdit::new(&self.text);
        for key in LAYOUT_LISTS {
            let elements = addition.json.get(key).and_then(Value::as_array).map_or(&[][..], Vec::as_slice);
            let written: Vec<String> = elements.iter().map(ToString::to_string).collect();
            edit.append_to(&edit.root(), key, &written);
        }
        let nodes = edit.list("nodes");
        let mut adopted = addition.before.adopted.clone();
        adopted.sort_unstable();
        for children in adopted.chunk_by(|a, b| a.0 == b.0) {
            let written: Vec<String> = children.iter().map(|(_, child)| child.to_string()).collect();
            let Some(parent) = nodes.get(children[0].0) else { continue };
            edit.append_to(parent, "children", &written);
        }
        let in_scene = addition.json["scenes"][0]["nodes"].as_array().map_or(&[][..], Vec::as_slice);
        let in_scene: Vec<String> = in_scene.iter().map(ToString::to_string).collect();
        let shown = edit.number_in(&edit.root(), "scene").unwrap_or(0);
        if let Some(scene) = edit.list("scenes").get(shown) {
            edit.append_to(scene, "nodes", &in_scene);
        }
        if !addition.bin.is_empty() {
            self.bin.resize(addition.before.bytes, 0);
            self.bin.extend(&addition.bin);
            set_length(&mut edit, self.bin.len());
        }
        self.text = edit.apply();
    }

    /// The whole file as a `.glb`.
    ///
    /// # Errors
    /// It would pass the 4 GiB that a `.glb` can hold.
    pub fn to_glb(&self) -> Result<Vec<u8>> {
        container(&self.text, &self.bin, &self.rest)
    }

    /// The whole file as a `.gltf` with an embedded buffer.
    #[must_use]
    pub fn to_gltf(&self) -> String {
        let mut edit = JsonEdit::new(&self.text);
        if let Some(buffer) = edit.list("buffers").first() {
            let data = base64::engine::general_purpose::STANDARD.encode(&self.bin);
            let uri = format!("\"data:application/octet-stream;base64,{data}\"");
            edit.extend(buffer, &[("uri".to_owned(), uri)]);
        }
        edit.apply()
    }

    /// Writes the file to `output` atomically: a `.gltf` if that is its extension, else a `.glb`.
    ///
    /// # Errors
    /// The folder cannot be written to, or the disk is full.
    pub fn save(&self, output: OutputPath) -> Result<()> {
        let is_text = output.name().extension().is_some_and(|ending| ending.eq_ignore_ascii_case("gltf"));
        let bytes = if is_text { self.to_gltf().into_bytes() } else { self.to_glb()? };
        output.write(&bytes)
    }
}

/// Sets the length of the one buffer.
pub(super) fn set_length(edit: &mut JsonEdit<'_>, length: usize) {
    match edit.list("buffers").first() {
        Some(buffer) => edit.set(buffer, "byteLength", length.to_string()),
        None => edit.append_to(&edit.root(), "buffers", &[json!({"byteLength": length}).to_string()]),
    }
}

/// The chunks of a `.glb` after JSON and buffer.
fn rest_of(bytes: &[u8]) -> &[u8] {
    let number = |at: usize| bytes.get(at..at + 4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]) as usize);
    if !bytes.starts_with(b"glTF") {
        return &[];
    }
    let container = &bytes[..number(8).unwrap_or(0).min(bytes.len())];
    let after_json = number(12).map_or(container.len(), |length| length.saturating_add(20));
    let is_bin = container.get(after_json.saturating_add(4)..).is_some_and(|rest| rest.starts_with(b"BIN\0"));
    let after = match number(after_json).filter(|_| is_bin) {
        Some(length) => after_json.saturating_add(8).saturating_add(length),
        None => after_json,
    };
    container.get(after..).filter(|rest| rest.len() >= 8).unwrap_or(&[])
}
