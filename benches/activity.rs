//! What an idle skin costs: live frames of a large skin on the CPU, wholly and partly touched, with and without a gate.
//!
//! The skins take turns, some frames each, so that whatever else the machine does falls on all of them; a robot has but one,
//! and finds its memory as it left it.

// The skins of `somatic bench`.

use std::hint::black_box;
use std::time::Instant;

use somatic::body::MemberSpec;
use somatic::internal::shape::Shape;
use somatic::scene::{Coverage, Knobs};
use somatic::{BackendKind, Body, Engine, Frame, Options, Outputs, RawValue, Scene};

const SENSORS: usize = 100_000;
const MEMBERS: usize = 16;
const ROUNDS: usize = 30;
/// Frames of a turn.
const TURN: usize = 20;

/// Patches of neighbours side by side, each sensor in one of them.
fn skin() -> Body {
    let shape = Shape {
        sensors: SENSORS,
        fields: SENSORS / MEMBERS,
        members: MEMBERS,
        wide: 0,
        local: false,
        frames: 1,
        seed: 1,
    };
    let mut body = shape.body();
    for (index, field) in body.fields.iter_mut().enumerate() {
        let ids = (index * MEMBERS) as u32..((index + 1) * MEMBERS) as u32;
        field.members = ids.map(|id| (id, MemberSpec::default())).collect();
    }
    body
}

/// A frame in which the first `touched` sensors are pressed, at each `turn` otherwise; noise under the dead band is none.
fn press(frame: &mut Frame, touched: usize, turn: usize) {
    frame.t_s = turn as f64 * 0.01;
    for (index, value) in frame.values[..touched].iter_mut().enumerate() {
        *value = RawValue::new(((index * 7 + turn * 131) % 977 + 1) as f64);
    }
}

fn main() {
    // Cargo passes `--bench`; a name may follow, as for other benches.
    let body = skin();
    let engine = |coverage| {
        let knobs = Knobs::default().coverage(coverage);
        let scene = Scene::default().outputs(Outputs::CENTROID | Outputs::ORIENTATION).knobs(knobs);
        Engine::new(&body, Options::default().scene(scene).backend(BackendKind::Cpu)).expect("the CPU is here")
    };
    let cases = [
        ("all touched, no gate", SENSORS, Coverage::All),
        ("all touched, gate as it pays", SENSORS, Coverage::Auto),
        ("all touched, gate always", SENSORS, Coverage::Touched),
        ("2 % touched, no gate", SENSORS / 50, Coverage::All),
        ("2 % touched, gate as it pays", SENSORS / 50, Coverage::Auto),
        ("idle, gate as it pays", 0, Coverage::Auto),
    ];
    let mut runs: Vec<(Engine, Frame, Vec<f64>)> = Vec::new();
    for (_, _, coverage) in cases {
        let engine = engine(coverage);
        let mut frame = engine.frame(0.0);
        frame.values.fill(RawValue::new(0.0));
        runs.push((engine, frame, Vec::with_capacity(ROUNDS * TURN)));
    }
    for round in 0..=ROUNDS {
        for ((_, touched, _), (engine, frame, times_us)) in cases.iter().zip(&mut runs) {
            for turn in 0..TURN {
                press(frame, *touched, round * TURN + turn);
                let start = Instant::now();
                black_box(engine.process(black_box(std::slice::from_ref(frame))).expect("a frame is a frame"));
                // The first round warms up.
                if round > 0 {
                    times_us.push(start.elapsed().as_secs_f64() * 1e6);
                }
            }
        }
    }
    println!("{SENSORS} taxels in {} fields, a frame a call, µs", SENSORS / MEMBERS);
    let mut whole = None;
    for ((name, ..), (_, _, mut times_us)) in cases.into_iter().zip(runs) {
        times_us.sort_by(f64::total_cmp);
        let (median, p99) = (times_us[times_us.len() / 2], times_us[times_us.len() * 99 / 100]);
        let share = median / *whole.get_or_insert(median);
        println!("  {name:<30}{median:8.1}   99 % within {p99:8.1}   {:5.1} % of the first", 100.0 * share);
    }
}
