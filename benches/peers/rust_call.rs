//! The Rust call that Python's `Engine.process` is compared with, in turns: for each line on standard input one call, whose time in seconds
//! is a line on standard output.
//!
//!     cargo build --release --example rust_call; tests/python/test_cost.py starts it
//!
//! Arguments: a body, a scene file, and the values of all frames of a call as little-endian float32, frame by frame, by ascending id.

use std::io::{BufRead as _, Error as IoError, ErrorKind, Write as _};
use std::time::Instant;

use somatic::internal::signal::FrameBlock;
use somatic::scene::file::SceneFile;
use somatic::{Body, Engine, RawValue};

/// Between frames, s.
const STEP_S: f64 = 0.01;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let [_, body, scene, values] = <[String; 4]>::try_from(std::env::args().collect::<Vec<_>>())
        .map_err(|_| IoError::new(ErrorKind::InvalidInput, "give a body, a scene file and a file of values"))?;
    let body = Body::load(&body)?;
    let values: Vec<RawValue> = std::fs::read(values)?
        .as_chunks::<4>()
        .0
        .iter()
        .map(|bytes| RawValue::new(f64::from(f32::from_le_bytes(*bytes))))
        .collect();
    let frames = values.len() / body.taxels.len();
    let scene = SceneFile::parse(&std::fs::read_to_string(scene)?)?;
    let mut engine = Engine::new(&body, scene.engine_options(None, true, frames)?)?;
    let mut t_s: Vec<f64> = (0..frames).map(|frame| frame as f64 * STEP_S).collect();
    let mut spare = None;
    for line in std::io::stdin().lock().lines() {
        line?;
        let began = Instant::now();
        engine.process_block(&FrameBlock { t_s: &t_s, values: &values, poses: &[] })?;
        // As a program that keeps them for a while.
        spare = Some(engine.take_percepts(spare));
        let took_s = began.elapsed().as_secs_f64();
        t_s.iter_mut().for_each(|t_s| *t_s += frames as f64 * STEP_S);
        let mut out = std::io::stdout().lock();
        writeln!(out, "{took_s}")?;
        out.flush()?;
    }
    Ok(())
}
