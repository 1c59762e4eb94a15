//! What touches of the whole body cost: live frames and recordings with and without them, in the same run.
//!
//!     cargo bench --bench touches                                    the bundled humanoid
//!     SOMATIC_BENCH_BODY=body.glb cargo bench --bench touches        another body
//!
//! Both engines take turns, some frames each, so that whatever else the machine does falls on both.

use std::hint::black_box;
use std::time::Instant;

use somatic::{BackendKind, Body, Engine, Frame, Options, RawValue, Scene, bundled, touch};

/// Touches on the skin, and the taxels of each.
const TOUCHES: usize = 10;
const TAXELS: usize = 30;
const ROUNDS: usize = 40;
/// Frames of a turn.
const TURN: usize = 25;
/// Frames of a recording.
const BATCH: usize = 256;

fn body() -> Body {
    match std::env::var("SOMATIC_BENCH_BODY") {
        Ok(path) => Body::load(&path).expect("the body can be read"),
        Err(_) => Body::from_bytes("humanoid", bundled::HUMANOID).expect("a bundled body is whole"),
    }
}

fn engine(body: &Body, with_touches: bool) -> Engine {
    let scene = Scene::default().touches(with_touches.then(touch::Options::default));
    Engine::new(body, Options::default().scene(scene).backend(BackendKind::Cpu).batch(BATCH)).expect("the CPU is here")
}

/// Per touch its taxels, places of `engine.skin()`'s nodes among a frame's values: those around a taxel, ring by ring.
fn places(engine: &Engine, body: &Body) -> Vec<Vec<(usize, f64)>> {
    let skin = engine.skin().expect("it looks for touches");
    let nodes = skin.nodes();
    let mut is_taken = vec![false; nodes];
    let mut all = Vec::new();
    for touch in 0..TOUCHES {
        let mut around = vec![(nodes * (2 * touch + 1) / (2 * TOUCHES)) as u32];
        let mut next = 0;
        while around.len() < TAXELS && next < around.len() {
            for &other in skin.beside(around[next]) {
                if around.len() < TAXELS && !around.contains(&other) && !is_taken[other as usize] {
                    around.push(other);
                }
            }
            next += 1;
        }
        let middle = skin.taxels()[around[0] as usize].position;
        let taxel = |&node: &u32| {
            is_taken[node as usize] = true;
            let taxel = &skin.taxels()[node as usize];
            let away = taxel.position.distance(middle) / taxel.cell_m2.sqrt();
            let value = body.taxel_index(taxel.id).expect("it is one of the body's");
            (value, 900.0 * (-away * away / 8.0).exp() + 20.0)
        };
        all.push(around.iter().map(taxel).collect());
    }
    all
}

/// A frame in which the touches press, at each `turn` a little harder or softer.
fn press(frame: &mut Frame, touches: &[Vec<(usize, f64)>], turn: usize) {
    frame.t_s = turn as f64 * 0.004;
    for (index, touch) in touches.iter().enumerate() {
        let by = 1.0 + 0.1 * (turn as f64 * 0.1 + index as f64).sin();
        touch.iter().for_each(|&(value, pressure)| frame.values[value] = RawValue::new(pressure * by));
    }
}

fn median(mut times: Vec<f64>) -> f64 {
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}

fn main() {
    let body = body();
    let began = Instant::now();
    let mut engines = [false, true].map(|with_touches| engine(&body, with_touches));
    let made_s = began.elapsed().as_secs_f64();
    let touches = places(&engines[1], &body);
    println!("{}: {} taxels, both engines made in {made_s:.2} s", body.name, body.taxels.len());
    let all: Vec<Vec<(usize, f64)>> = vec![(0..body.taxels.len()).map(|value| (value, 500.0)).collect()];
    println!("one frame a call, µs, median        without      with      more");
    for (name, pressed) in [("at rest", &[][..]), ("ten touches of thirty taxels", &touches), ("all pressed", &all)] {
        let mut times = [Vec::new(), Vec::new()];
        let mut frame = engines[0].frame(0.0);
        frame.values.fill(RawValue::new(0.0));
        for round in 0..=ROUNDS {
            for (engine, times) in engines.iter_mut().zip(&mut times) {
                for turn in 0..TURN {
                    press(&mut frame, pressed, round * TURN + turn);
                    let start = Instant::now();
                    black_box(engine.process(black_box(std::slice::from_ref(&frame))).expect("a frame is a frame"));
                    // The first round warms up.
                    if round > 0 {
                        times.push(start.elapsed().as_secs_f64() * 1e6);
                    }
                }
            }
        }
        let [without, with] = times.map(median);
        println!("  {name:<32}{without:9.2} {with:9.2} {:9.2}", with - without);
    }
    println!("recordings of {BATCH} frames, µs a frame, median");
    for (name, pressed) in [("at rest", &[][..]), ("ten touches of thirty taxels", &touches)] {
        let mut frames = vec![engines[0].frame(0.0); BATCH];
        for (turn, frame) in frames.iter_mut().enumerate() {
            frame.values.fill(RawValue::new(0.0));
            press(frame, pressed, turn);
        }
        let mut times = [Vec::new(), Vec::new()];
        for round in 0..=ROUNDS {
            for (engine, times) in engines.iter_mut().zip(&mut times) {
                let start = Instant::now();
                black_box(engine.process(black_box(&frames)).expect("frames are frames"));
                if round > 0 {
                    times.push(start.elapsed().as_secs_f64() * 1e6 / BATCH as f64);
                }
            }
        }
        let [without, with] = times.map(median);
        println!("  {name:<32}{without:9.2} {with:9.2} {:9.2} ×", with / without);
    }
}
