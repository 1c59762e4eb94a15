//! The engine on made-up skins of four sizes, live (one frame a call) and over a recording, on every backend; and what
//! each stage adds. `somatic bench` measures one of these by itself, and any other.
//!
//!     cargo bench                          everything, a minute or two after the build
//!     cargo bench --bench engine -- live   what has this in its name
//!     cargo bench -- --max-time 5          longer, and so steadier

// The skins of `somatic bench`.

use divan::Bencher;
use divan::counter::ItemsCount;
use somatic::internal::shape::Shape;
use somatic::{BackendKind, Body, Outputs};

fn main() {
    divan::main();
}

const BACKENDS: [(&str, BackendKind); 3] =
    [("reference", BackendKind::Reference), ("cpu", BackendKind::Cpu), ("gpu", BackendKind::Gpu)];

/// Name, sensors, fields, members.
const SKINS: [(&str, usize, usize, usize); 4] =
    [("paper-hand", 40, 9, 9), ("hundreds", 400, 60, 9), ("whole-robot", 1000, 100, 16), ("tum-h1", 7560, 600, 24)];

const RECORDING: usize = 9984;

/// What slow backends get of the recordings, in memberships: more takes them seconds a call.
const MOST_FOR_SLOW: u128 = 20_000_000;

/// A case as divan names it.
struct Case {
    name: String,
    shape: Shape,
    backend: BackendKind,
    outputs: Outputs,
}

impl std::fmt::Display for Case {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.name)
    }
}

/// The paper's own work.
fn paper() -> Outputs {
    Outputs::CENTROID | Outputs::ORIENTATION
}

/// Whether there is an adapter, and whether it is hardware.
fn gpu() -> (bool, bool) {
    #[cfg(feature = "gpu")]
    let kinds: Vec<&str> = somatic::internal::backend::gpu::adapters().iter().map(|adapter| adapter.kind).collect();
    #[cfg(not(feature = "gpu"))]
    let kinds: Vec<&str> = Vec::new();
    (!kinds.is_empty(), kinds.iter().any(|kind| *kind != "software"))
}

/// Every skin on every backend that runs here, with `frames` a call.
fn cases(frames: usize) -> Vec<Case> {
    let (has_gpu, in_hardware) = gpu();
    let mut cases = Vec::new();
    for (skin, sensors, fields, members) in SKINS {
        let shape = Shape { sensors, fields, members, wide: 0, local: false, frames, seed: 1 };
        for (name, backend) in BACKENDS {
            let (runs, is_fast) = match backend {
                BackendKind::Gpu => (has_gpu, in_hardware),
                backend => (true, backend == BackendKind::Cpu),
            };
            if runs && (is_fast || shape.memberships() <= MOST_FOR_SLOW) {
                cases.push(Case { name: format!("{skin} {name}"), shape, backend, outputs: paper() });
            }
        }
    }
    cases
}

/// What each stage adds: outputs that need only it, after what it needs itself.
fn stages(frames: usize) -> Vec<Case> {
    let named = [
        ("1 contact", Outputs::TOTAL),
        ("2 centroid", Outputs::CENTROID),
        ("3 centroid, orientation", paper()),
        ("3 centroid, principal_axis", Outputs::CENTROID | Outputs::PRINCIPAL_AXIS | Outputs::ANISOTROPY),
        ("3 centroid, motion", Outputs::CENTROID | Outputs::DISPLACEMENT | Outputs::DIRECTION | Outputs::SPEED),
        ("3 centroid, position", Outputs::CENTROID | Outputs::POSITION | Outputs::NORMAL),
        ("4 all but touches", Outputs::USUAL_AND_MOTION),
    ];
    let (_, sensors, fields, members) = SKINS[2];
    let shape = Shape { sensors, fields, members, wide: 0, local: false, frames, seed: 1 };
    let case = |(name, outputs): (&str, _)| Case { name: name.to_owned(), shape, backend: BackendKind::Cpu, outputs };
    named.map(case).into()
}

fn measure(bencher: Bencher<'_, '_>, case: &Case) {
    let Case { shape, backend, outputs, .. } = case;
    let body: Body = shape.body();
    let mut frames = shape.frames();
    let mut engine = match shape.engine(&body, *backend, *outputs) {
        Ok(engine) => engine,
        Err(error) => return eprintln!("{}: {error}", case.name),
    };
    bencher.counter(ItemsCount::new(shape.memberships() as u64)).bench_local(|| {
        shape.advance(&mut frames);
        engine.process(&frames).map(somatic::Percepts::frames)
    });
}

#[divan::bench(args = cases(1), min_time = 0.1, max_time = 0.2)]
fn live(bencher: Bencher<'_, '_>, case: &Case) {
    measure(bencher, case);
}

#[divan::bench(args = cases(RECORDING), max_time = 1, sample_size = 1)]
fn recording(bencher: Bencher<'_, '_>, case: &Case) {
    measure(bencher, case);
}

#[divan::bench(args = stages(1), min_time = 0.1, max_time = 0.2)]
fn stages_live(bencher: Bencher<'_, '_>, case: &Case) {
    measure(bencher, case);
}

#[divan::bench(args = stages(RECORDING), max_time = 1, sample_size = 1)]
fn stages_recording(bencher: Bencher<'_, '_>, case: &Case) {
    measure(bencher, case);
}
