//! Bodies and backends that several tests share.
#![allow(dead_code)] // Each test binary uses its own part of this.

use std::path::PathBuf;
use std::sync::OnceLock;

use glam::DVec3;
use somatic::body::{ChartKind, ChartSpec, FieldSpec, MemberSpec, Modality, Taxel};
use somatic::internal::body::{Glb, MeshData};
use somatic::scene::{Arithmetic, Cadence, Coverage, Knobs};
use somatic::{BackendKind, Body, Engine, Frame, Options, RawValue};

use somatic_testing::skip;

/// Every backend that can run here. Without an adapter the GPU is skipped.
pub fn backends() -> Vec<BackendKind> {
    let mut backends = vec![BackendKind::Reference, BackendKind::Cpu];
    if has_gpu() {
        backends.push(BackendKind::Gpu);
    }
    backends
}

/// Every backend with every knob that may change how it computes.
pub fn ways() -> Vec<(BackendKind, Knobs)> {
    let mut ways = Vec::new();
    for backend in backends() {
        let arithmetics = match backend {
            BackendKind::Reference => vec![None],
            _ => vec![Some(Arithmetic::OnePass), Some(Arithmetic::Compensated)],
        };
        // A gate stands only before the CPU's live frames; the cadence is everybody's.
        let coverages: &[Coverage] = match backend {
            BackendKind::Cpu => &[Coverage::All, Coverage::Touched],
            _ => &[Coverage::Auto],
        };
        for arithmetic in arithmetics {
            for &coverage in coverages {
                for cadence in [Cadence::EveryFrame, Cadence::OnChange] {
                    ways.push((backend, Knobs::default().arithmetic(arithmetic).coverage(coverage).cadence(cadence)));
                }
            }
        }
    }
    ways
}

/// Whether there is an adapter; where there is none, that is a skip.
pub fn has_gpu() -> bool {
    static FOUND: OnceLock<bool> = OnceLock::new();
    #[cfg(feature = "gpu")]
    let found = *FOUND.get_or_init(|| !somatic::internal::backend::gpu::adapters().is_empty());
    #[cfg(not(feature = "gpu"))]
    let found = *FOUND.get_or_init(|| false);
    if !found {
        skip("GPU", "no adapter answers");
    }
    found
}

/// `part` of the folder of real recordings and meshes, or `None`, and a skip, where it is not there.
pub fn data(part: &str) -> Option<PathBuf> {
    let root = std::env::var_os("SOMATIC_DATA").map_or_else(|| PathBuf::from("../shared/data"), PathBuf::from);
    let path = root.join(part);
    if path.exists() {
        return Some(path);
    }
    skip("DATA", format!("{} is not there; set SOMATIC_DATA to the folder that has it", path.display()));
    None
}

/// Every glTF in the folder of meshes, real and hostile, or `None`, and a skip, where that is not there.
pub fn meshes() -> Option<Vec<PathBuf>> {
    let (mut open, mut files) = (vec![data("meshes")?], Vec::new());
    while let Some(folder) = open.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            match path.extension().and_then(|e| e.to_str()) {
                _ if path.is_dir() => open.push(path),
                Some("glb" | "gltf") => files.push(path),
                _ => {}
            }
        }
    }
    files.sort();
    Some(files)
}

/// A flat skin of taxels at `uv`, looking along +y, in a body of one link; ids count up from 0.
pub struct Flat {
    pub glb: Glb,
    link: usize,
}

impl Flat {
    pub fn new(uv: &[[f64; 2]]) -> Self {
        Self::at(uv, DVec3::ZERO)
    }

    /// The same, with everything shifted in the link's frame.
    pub fn at(uv: &[[f64; 2]], origin: DVec3) -> Self {
        let mut glb = Glb::new();
        let link = glb.node("skin", None, DVec3::ZERO);
        let taxels: Vec<Taxel> = uv
            .iter()
            .enumerate()
            .map(|(id, &[u, v])| Taxel {
                id: id as u32,
                link: 0,
                position_in_link: origin + DVec3::new(u, 0.0, -v),
                normal_in_link: DVec3::Y,
                area: 1e-4,
                modality: Modality::Pressure,
                tangent_in_link: None,
            })
            .collect();
        glb.taxels("taxels", Some(link), &taxels, None);
        Self { glb, link }
    }

    /// Adds a square of surface under the taxels.
    pub fn surface(mut self, half: f32) -> Self {
        let node = self.glb.node("surface", Some(self.link), DVec3::ZERO);
        let mesh = MeshData {
            positions: vec![[-half, 0.0, -half], [-half, 0.0, half], [half, 0.0, half], [half, 0.0, -half]],
            normals: vec![[0.0, 1.0, 0.0]; 4],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            skinning: None,
        };
        self.glb.mesh(node, "surface", &mesh, None, None);
        self
    }

    /// Adds a field over `ids`, its chart's origin at the skin's own, +u along +x and so +v along −z.
    pub fn field(mut self, name: &str, parent: Option<&str>, ids: impl IntoIterator<Item = u32>) -> Self {
        let chart =
            ChartSpec { kind: ChartKind::Plane, origin_in_anchor: Some([0.0; 3]), u_in_anchor: Some([1.0, 0.0, 0.0]) };
        let members = ids.into_iter().map(|id| (id, MemberSpec::default())).collect();
        let spec = FieldSpec { name: name.into(), parent: parent.map(str::to_owned), members, chart: Some(chart) };
        self.glb.field(&spec, Some(self.link), DVec3::ZERO);
        self
    }

    pub fn body(&self) -> Body {
        Body::from_bytes("flat", &self.glb.to_bytes().unwrap()).unwrap()
    }
}

/// An engine on `kind` that computes all that follows from a frame and the one before it.
pub fn engine(body: &Body, kind: BackendKind) -> Engine {
    Engine::new(
        body,
        Options::default()
            .scene(somatic::Scene::default().outputs(somatic::Outputs::USUAL_AND_MOTION))
            .backend(kind)
            .batch(64),
    )
    .unwrap()
}

pub fn frame(t_s: f64, values: &[f64]) -> Frame {
    Frame { t_s, values: values.iter().map(|&v| RawValue::new(v)).collect(), ..Frame::default() }
}
