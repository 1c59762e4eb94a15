//! A parsed glTF file: its JSON, its buffers, and accessors with all bounds checked.
//!
//! The crate `gltf` knows the format's structure and validates it. Accessors are read here, because its own reader
//! refuses legal ones (without a bufferView, sparse on top of that) and trusts lengths that a damaged file gets wrong.

use std::borrow::Cow;
use std::path::Path;

use base64::Engine as _;
use gltf::json;
use json::accessor::{ComponentType, Type};
use json::validation::{Checked, Validate};

use crate::error::{Error, Result, failed};
use crate::limits::{self, MAX_BODY_BYTES, MAX_JSON_OBJECTS, MAX_ZERO_ELEMENTS};

pub(super) struct Document {
    pub root: json::Root,
    buffers: Vec<Vec<u8>>,
}

impl Document {
    /// Parses `bytes`; external buffers are read from `folder`.
    pub(super) fn parse(bytes: &[u8], folder: Option<&Path>) -> Result<Self> {
        let (text, chunk) = split(bytes)?;
        let text = text.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(text);
        // Parsed, an object takes a hundred times the room that it may have in the text.
        let objects = text.iter().filter(|&&byte| byte == b'{').count();
        if objects > MAX_JSON_OBJECTS {
            return Err(failed!(
                "its JSON has {objects} objects, over the {MAX_JSON_OBJECTS} that a body may have; split it"
            ));
        }
        let root: json::Root = json::deserialize::from_slice(text)
            .map_err(|e| failed!("not a glTF: its JSON does not hold what glTF asks for: {e}"))?;
        refuse_unsupported_extensions(&root)?;
        validate(&root)?;
        let mut chunk = chunk;
        let (mut buffers, mut total) = (Vec::with_capacity(root.buffers.len()), 0);
        for (index, buffer) in root.buffers.iter().enumerate() {
            let bytes = match &buffer.uri {
                Some(uri) => fetch(uri, folder).map_err(|e| e.at(format!("buffer {index}")))?,
                None if index == 0 => chunk.take().map(<[u8]>::to_vec).unwrap_or_default(),
                None => Vec::new(),
            };
            if (bytes.len() as u64) < buffer.byte_length.0 {
                return Err(failed!(
                    "buffer {index} holds {} of its {} bytes: the file is cut short; export or copy it again",
                    bytes.len(),
                    buffer.byte_length.0
                ));
            }
            total += bytes.len() as u64;
            if total > MAX_BODY_BYTES {
                let most = limits::size(MAX_BODY_BYTES);
                return Err(failed!("its buffers have over {most} together, the most that a body may have; split it"));
            }
            buffers.push(bytes);
        }
        Ok(Self { root, buffers })
    }

    pub(super) fn into_buffers(self) -> Vec<Vec<u8>> {
        self.buffers
    }

    /// The numbers of accessor `index`, row by row, and the number of columns.
    pub(super) fn numbers(&self, index: usize) -> Result<(usize, Vec<f32>)> {
        let Some(Checked::Valid(shape)) = self.root.accessors.get(index).map(|accessor| accessor.type_) else {
            return Err(failed!("the type of accessor {index} is not a type of glTF"));
        };
        let flat = match shape {
            Type::Scalar => self.floats::<1>(index)?.into_flattened(),
            Type::Vec2 => self.floats::<2>(index)?.into_flattened(),
            Type::Vec3 => self.floats::<3>(index)?.into_flattened(),
            Type::Vec4 => self.floats::<4>(index)?.into_flattened(),
            _ => return Err(failed!("accessor {index} holds matrices")),
        };
        Ok((shape.multiplicity(), flat))
    }

    /// Accessor `index` as rows of `N` numbers, integers normalised where the file says so.
    pub(super) fn floats<const N: usize>(&self, index: usize) -> Result<Vec<[f32; N]>> {
        let elements = self.elements(index)?;
        elements.expect_width(N).map_err(|e| e.at(format!("accessor {index}")))?;
        let scale = |max: f32| if elements.normalized { 1.0 / max } else { 1.0 };
        let number: &dyn Fn(&[u8]) -> f32 = match elements.component {
            ComponentType::F32 => &|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]]),
            ComponentType::U8 => &|b| f32::from(b[0]) * scale(255.0),
            ComponentType::U16 => &|b| f32::from(u16::from_le_bytes([b[0], b[1]])) * scale(65535.0),
            ComponentType::I8 => &|b| (f32::from(b[0].cast_signed()) * scale(127.0)).max(-1.0),
            ComponentType::I16 => &|b| (f32::from(i16::from_le_bytes([b[0], b[1]])) * scale(32767.0)).max(-1.0),
            ComponentType::U32 => &|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]) as f32,
        };
        Ok(elements.rows(number))
    }

    /// Accessor `index` as rows of `N` unsigned integers.
    pub(super) fn integers<const N: usize>(&self, index: usize) -> Result<Vec<[u32; N]>> {
        let elements = self.elements(index)?;
        elements.expect_width(N).map_err(|e| e.at(format!("accessor {index}")))?;
        let number: &dyn Fn(&[u8]) -> u32 = match elements.component {
            ComponentType::U8 => &|b| u32::from(b[0]),
            ComponentType::U16 => &|b| u32::from(u16::from_le_bytes([b[0], b[1]])),
            ComponentType::U32 => &|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]),
            _ => return Err(failed!("accessor {index} should hold unsigned integers")),
        };
        Ok(elements.rows(number))
    }

    /// The number of elements that accessor `index` says it has.
    pub(super) fn count(&self, index: usize) -> u64 {
        self.root.accessors.get(index).map_or(0, |accessor| accessor.count.0)
    }

    /// Refuses an accessor that claims more than the file holds.
    pub(super) fn check(&self, index: usize) -> Result<()> {
        self.elements(index).map(drop)
    }

    /// Whether accessor `index` holds single floats, as every attribute of a layout must.
    pub(super) fn is_scalar_float(&self, index: usize) -> bool {
        self.root.accessors.get(index).is_some_and(|accessor| {
            matches!(accessor.type_, Checked::Valid(Type::Scalar))
                && matches!(accessor.component_type, Checked::Valid(c) if c.0 == ComponentType::F32)
        })
    }

    fn elements(&self, index: usize) -> Result<Elements<'_>> {
        self.elements_of(index).map_err(|e| e.at(format!("accessor {index}")))
    }

    fn elements_of(&self, index: usize) -> Result<Elements<'_>> {
        let damaged = |what: &str| failed!("{what}: the file is damaged; export it again");
        let accessor = self.root.accessors.get(index).ok_or_else(|| damaged("there is no such accessor"))?;
        let (Checked::Valid(component), Checked::Valid(shape)) = (accessor.component_type, accessor.type_) else {
            return Err(damaged("its type is not a type of glTF"));
        };
        let component = component.0;
        let width = shape.multiplicity();
        let size = component.size() * width;
        let count = accessor.count.0;
        let bytes = match accessor.buffer_view {
            Some(view) => self.strided(view.value(), accessor.byte_offset.map_or(0, |o| o.0), count, size)?,
            None if count > MAX_ZERO_ELEMENTS as u64 => {
                return Err(damaged(&format!("it claims {count} elements and has no data")));
            }
            None => Cow::Owned(vec![0; count as usize * size]),
        };
        let bytes = match &accessor.sparse {
            None => bytes,
            Some(sparse) => {
                let Checked::Valid(kind) = sparse.indices.component_type else {
                    return Err(damaged("the type of its sparse indices is not a type of glTF"));
                };
                let (changed, offset) = (sparse.count.0, sparse.indices.byte_offset.0);
                let places = self.strided(sparse.indices.buffer_view.value(), offset, changed, kind.0.size())?;
                let view = sparse.values.buffer_view.value();
                let values = self.strided(view, sparse.values.byte_offset.0, changed, size)?;
                let mut bytes = bytes.into_owned();
                for (place, value) in places.chunks_exact(kind.0.size()).zip(values.chunks_exact(size)) {
                    let place = place.iter().rev().fold(0_usize, |n, &b| n << 8 | usize::from(b));
                    bytes
                        .get_mut(place.saturating_mul(size)..)
                        .and_then(|rest| rest.get_mut(..size))
                        .ok_or_else(|| damaged("a sparse index lies beyond its end"))?
                        .copy_from_slice(value);
                }
                Cow::Owned(bytes)
            }
        };
        Ok(Elements { bytes, component, width, normalized: accessor.normalized })
    }

    /// `count` elements of `size` bytes from a buffer view, contiguous.
    fn strided(&self, view: usize, offset: u64, count: u64, size: usize) -> Result<Cow<'_, [u8]>> {
        let beyond =
            || failed!("it reaches beyond bufferView {view}: the file is damaged or cut short; export it again");
        let view = self.root.buffer_views.get(view).ok_or_else(beyond)?;
        let buffer = self.buffers.get(view.buffer.value()).ok_or_else(beyond)?;
        let start = usize::try_from(view.byte_offset.map_or(0, |o| o.0)).map_err(|_| beyond())?;
        let length = usize::try_from(view.byte_length.0).map_err(|_| beyond())?;
        let window = start.checked_add(length).and_then(|end| buffer.get(start..end)).ok_or_else(beyond)?;
        let stride = view.byte_stride.map_or(size, |s| s.0).max(1);
        let (offset, count) = (usize::try_from(offset), usize::try_from(count));
        let (Ok(offset), Ok(count)) = (offset, count) else { return Err(beyond()) };
        if count == 0 {
            return Ok(Cow::Borrowed(&[]));
        }
        let end = (count - 1)
            .checked_mul(stride)
            .and_then(|n| n.checked_add(size))
            .and_then(|n| n.checked_add(offset))
            .filter(|&end| end <= window.len())
            .ok_or_else(beyond)?;
        if stride == size {
            return Ok(Cow::Borrowed(&window[offset..end]));
        }
        let mut packed = Vec::with_capacity(count * size);
        for element in 0..count {
            let at = offset + element * stride;
            packed.extend_from_slice(&window[at..at + size]);
        }
        Ok(Cow::Owned(packed))
    }
}

/// An accessor's elements, contiguous.
struct Elements<'a> {
    bytes: Cow<'a, [u8]>,
    component: ComponentType,
    width: usize,
    normalized: bool,
}

impl Elements<'_> {
    fn expect_width(&self, width: usize) -> Result<()> {
        if self.width == width {
            return Ok(());
        }
        Err(failed!("it has {} numbers an element instead of {width}; export the mesh again", self.width))
    }

    fn rows<T: Copy + Default, const N: usize>(&self, number: &dyn Fn(&[u8]) -> T) -> Vec<[T; N]> {
        let size = self.component.size();
        self.bytes
            .chunks_exact(size * N)
            .map(|element| {
                let mut row = [T::default(); N];
                for (value, bytes) in row.iter_mut().zip(element.chunks_exact(size)) {
                    *value = number(bytes);
                }
                row
            })
            .collect()
    }
}

/// How far into a file its first element is looked for.
const MJCF_HEAD: usize = 4096;

/// Rejects `bytes` of a file called `name` whose extension is that of another format.
pub(super) fn refuse_other_formats(name: &str, bytes: &[u8]) -> Result<()> {
    let text = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes).trim_ascii_start();
    let ending = Path::new(name).extension().map(|ending| ending.to_string_lossy().to_ascii_lowercase());
    let what = match ending.as_deref() {
        _ if bytes.is_empty() || bytes.starts_with(b"glTF") || text.starts_with(b"{") => return Ok(()),
        Some("stl") => "an STL mesh",
        Some("obj") => "an OBJ mesh",
        Some("dae") => "a COLLADA mesh",
        Some("ply") => "a PLY mesh",
        Some("urdf" | "xacro") => "a URDF",
        _ if text.starts_with(b"<") && text.windows(7).take(MJCF_HEAD).any(|word| word == b"<mujoco") => {
            return Err(failed!(
                "this is an MJCF, not a glTF; make one of its tactile sensors: somatic author --mjcf-skin {name} -o body.glb, or place \
                 taxels on the robot's URDF or mesh: somatic author robot.urdf --taxels 500 -o body.glb"
            ));
        }
        _ => return Ok(()),
    };
    Err(failed!("this is {what}, not a glTF; make one of it: somatic author {name} --taxels 500 -o body.glb"))
}

/// The JSON text and the binary chunk of a `.glb`, or the whole of a `.gltf`.
pub(super) fn split(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>)> {
    if bytes.is_empty() {
        return Err(Error::failed("the file is empty; give a .glb or .gltf"));
    }
    if !bytes.starts_with(b"glTF") {
        let text = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes);
        return match text.iter().find(|b| !b.is_ascii_whitespace()) {
            Some(b'{') => Ok((text, None)),
            _ => Err(Error::failed("not a glTF: it starts neither with `glTF` nor with `{`; give a .glb or .gltf")),
        };
    }
    // The crate's reader subtracts the header from this length unchecked.
    let length = bytes.get(8..12).map_or(0, |b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
    if length < 12 {
        return Err(Error::failed("its glTF header is damaged or cut short; export or copy the file again"));
    }
    let cut = bytes.len() < length as usize;
    // Bytes after the container are ignored.
    let container = bytes.get(..length as usize).unwrap_or(bytes);
    let glb = gltf::binary::Glb::from_slice(container).map_err(|e| {
        let why = if cut {
            format!("the file is cut short, {} of {length} bytes; export or copy it again", bytes.len())
        } else {
            match e {
                gltf::Error::Io(_) | gltf::Error::Binary(gltf::binary::Error::Io(_)) => {
                    "its glTF container is damaged: it ends inside a chunk; export it again".to_owned()
                }
                e => format!("its glTF container is damaged: {e}; export it again"),
            }
        };
        Error::failed(why)
    })?;
    // Borrowed from `bytes`, as `from_slice` never copies.
    match (glb.json, glb.bin) {
        (Cow::Borrowed(text), Some(Cow::Borrowed(chunk))) => Ok((text, Some(chunk))),
        (Cow::Borrowed(text), _) => Ok((text, None)),
        (Cow::Owned(_), _) => Err(Error::failed("its glTF container could not be read; export it again")),
    }
}

fn refuse_unsupported_extensions(root: &json::Root) -> Result<()> {
    const KNOWN: [&str; 8] = [
        "KHR_materials_unlit",
        "KHR_materials_emissive_strength",
        "KHR_materials_ior",
        "KHR_materials_specular",
        "KHR_materials_transmission",
        "KHR_materials_volume",
        "KHR_texture_transform",
        "KHR_lights_punctual",
    ];
    for name in &root.extensions_required {
        let remedy = match name.as_str() {
            "KHR_draco_mesh_compression" | "EXT_meshopt_compression" | "KHR_meshopt_compression" => {
                "its meshes are compressed; export without compression, or run `gltf-transform copy IN OUT`"
            }
            "KHR_mesh_quantization" => {
                "its meshes are quantized; export without, or run `gltf-transform dequantize IN OUT`"
            }
            name if KNOWN.contains(&name) => continue,
            _ => "it needs an extension that is not supported here; export without it",
        };
        return Err(failed!("{remedy} (extension {name})"));
    }
    Ok(())
}

/// The crate's validation, without the one rule that is stricter than glTF.
fn validate(root: &json::Root) -> Result<()> {
    // The crate follows this one index before it has checked it.
    let positions = Checked::Valid(json::mesh::Semantic::Positions);
    for (mesh, primitive) in root.meshes.iter().enumerate().flat_map(|(i, m)| m.primitives.iter().map(move |p| (i, p)))
    {
        if primitive.attributes.get(&positions).is_some_and(|accessor| accessor.value() >= root.accessors.len()) {
            return Err(failed!(
                "not a sound glTF: the positions of mesh {mesh} point at something that is not in the file; export it again"
            ));
        }
    }
    let mut first = None;
    root.validate(root, json::Path::new, &mut |path, error| {
        let path = path().to_string();
        let no_view = path.starts_with("accessors[") && path.ends_with("].bufferView");
        let extension = path.starts_with("extensionsRequired");
        if first.is_none() && !extension && !(no_view && error == json::validation::Error::Missing) {
            first = Some((path, error));
        }
    });
    match first {
        None => Ok(()),
        Some((path, error)) => {
            let what = match error {
                json::validation::Error::IndexOutOfBounds => "points at something that is not in the file",
                json::validation::Error::Missing => "is missing",
                json::validation::Error::Oversize => "is larger than this machine can address",
                _ => "is not what glTF allows",
            };
            Err(failed!("not a sound glTF: `{path}` {what}; export it again"))
        }
    }
}

pub(super) fn fetch(uri: &str, folder: Option<&Path>) -> Result<Vec<u8>> {
    if let Some(data) = uri.strip_prefix("data:") {
        let (kind, body) =
            data.split_once(',').ok_or_else(|| Error::failed("its data URI has no data; export it again"))?;
        if !kind.ends_with(";base64") {
            return Err(Error::failed("its data URI is not base64; export it again"));
        }
        return base64::engine::general_purpose::STANDARD
            .decode(body)
            .map_err(|e| failed!("its data URI is not base64: {e}; export it again"));
    }
    if uri.contains("://") {
        return Err(failed!("it lies at {uri}, and nothing is fetched from a network; save it next to the file"));
    }
    let folder =
        folder.ok_or_else(|| failed!("it lies in a file of its own, `{uri}`; give a .glb, which holds everything"))?;
    let name = percent_encoding::percent_decode_str(uri)
        .decode_utf8()
        .map_err(|_| failed!("its name `{uri}` is not UTF-8; rename it"))?;
    let path = folder.join(name.as_ref());
    let kind = std::fs::metadata(&path).map_err(|e| Error::io(&path, &e))?;
    if !kind.is_file() {
        // A device may be endless.
        return Err(Error::failed("this is not a regular file; save the buffer next to the body").at(path.display()));
    }
    limits::read(&path, MAX_BODY_BYTES).map_err(|e| Error::io(&path, &e))
}
