//! How long it takes to fit what presses, a touch of the whole body: `cargo bench --bench fit`.

use divan::Bencher;
use divan::counter::ItemsCount;
use somatic::source::{SimulatedSource, Source as _};
use somatic::{BackendKind, Body, Calibration, Engine, Frame, Options, Outputs, Scene, TouchOutputs, touch};

fn main() {
    divan::main();
}

/// A rod that turns over the nine sensors of the hand's back.
const ROD: &str = "rate_hz = 100\nduration_s = 2.56\n[layer]\nthickness_m = 0.007\n[sensor]\nkind = \"fsr\"\nnoise_sigma = 1\n\
                   [[touch]]\non = \"hand/back\"\nindenter = \"rod\"\nradius_m = 0.0127\nlength_m = 0.05\n\
                   angle_deg = [[0, 0], [2.56, 180]]\npath = [[0, 0.002]]\nhold = { newton = 30 }\n";
/// A stamp on the nine of the palm, under a layer so thick that all of them feel it.
const FINGER: &str = "rate_hz = 100\nduration_s = 2.56\n[layer]\nthickness_m = 0.03\n[sensor]\nkind = \"ideal\"\n\
                      noise_sigma = 0.002\n[[touch]]\non = \"hand/palm\"\nindenter = \"flat\"\nradius_m = 0.004\n\
                      path = [[-0.004, -0.002], [0.004, 0.002]]\ntimes_s = [0, 2.56]\nhold = { newton = 20 }\n";

/// What is asked for.
#[derive(Clone, Copy, Debug)]
enum Asked {
    Axis,
    Fit,
}

impl Asked {
    const ALL: [Self; 2] = [Self::Axis, Self::Fit];

    fn outputs(self) -> TouchOutputs {
        match self {
            Self::Axis => TouchOutputs::USUAL,
            Self::Fit => TouchOutputs::USUAL | TouchOutputs::FIT,
        }
    }
}

/// An engine over the field that `text` touches, and the frames that this gives.
fn touched(text: &str, field: &str, asked: Asked, backend: BackendKind) -> (Engine, Vec<Frame>) {
    let body = Body::from_bytes("hand", somatic::bundled::HAND).unwrap();
    let mut source = SimulatedSource::on_body("simulation", text, body.clone()).unwrap();
    let ids: Vec<u32> = body.taxels.iter().map(|taxel| taxel.id).collect();
    let calibration = Calibration::parse(&source.calibration(), &ids).unwrap();
    let touches = touch::Options { outputs: asked.outputs(), ..touch::Options::default() };
    let scene = Scene::default().outputs(Outputs::TOTAL).touches(touches).fields([field]);
    let options = Options::default().scene(scene).calibration(calibration).backend(backend).batch(256);
    let mut engine = Engine::new(&body, options).unwrap();
    engine.set_channels(source.taxels()).unwrap();
    let (mut frames, mut frame) = (Vec::new(), Frame::missing(0.0, source.taxels().len()));
    while source.next_frame(&mut frame).unwrap() {
        frames.push(frame.clone());
    }
    let fitted = engine.process(&frames).unwrap();
    let touches = |at: usize| fitted.touches(at).map_or(&[][..], |found| &found.touches);
    let count = (0..frames.len()).filter(|&at| touches(at).iter().any(|touch| touch.fit.is_some())).count();
    assert!(matches!(asked, Asked::Axis) || count > frames.len() / 2, "{count} of {} are fitted", frames.len());
    (engine, frames)
}

#[divan::bench(args = Asked::ALL, max_time = 2)]
fn rods_in_batches_of_256(bencher: Bencher<'_, '_>, asked: Asked) {
    let (mut engine, frames) = touched(ROD, "hand/back", asked, BackendKind::Cpu);
    bencher.counter(ItemsCount::new(frames.len())).bench_local(|| engine.process(&frames).unwrap().frames());
}

#[divan::bench(args = Asked::ALL, max_time = 2)]
fn one_rod_live(bencher: Bencher<'_, '_>, asked: Asked) {
    let (mut engine, frames) = touched(ROD, "hand/back", asked, BackendKind::Cpu);
    let mut at = 0;
    bencher.counter(ItemsCount::new(1_usize)).bench_local(|| {
        at = (at + 1) % frames.len();
        engine.process_one(&frames[at]).unwrap().frames()
    });
}

#[divan::bench(args = Asked::ALL, max_time = 2)]
fn points_in_batches_of_256(bencher: Bencher<'_, '_>, asked: Asked) {
    let (mut engine, frames) = touched(FINGER, "hand/palm", asked, BackendKind::Cpu);
    bencher.counter(ItemsCount::new(frames.len())).bench_local(|| engine.process(&frames).unwrap().frames());
}
