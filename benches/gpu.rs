//! What the GPU of a machine makes of the backend `gpu`, in one command that needs nothing but Rust and a driver:
//!
//!     cargo bench --bench gpu > gpu.json
//!
//! First the percepts of every shape are held to the f64 reference. Then, as JSON: what the machine copies (on the device,
//! up, down), and for each shape and number of frames a call the programs by themselves, by the device's clock where it
//! may be read, with the share of the copy bandwidth that their least bytes make; and whole calls, frames in memory to
//! percepts in memory, in turns with empty ones: the same bytes up and down, as many groups, and nothing computed.

// The skins of `somatic bench`.

use std::time::{Duration, Instant};

use serde_json::{Value, json};
use somatic::internal::backend::gpu::adapters;
use somatic::internal::backend::gpu::{Bandwidth, EmptyCall, bandwidth, device_time};
use somatic::internal::shape::Shape;
use somatic::{BackendKind, Body, Outputs, Result};

/// Sensors, fields, members, and of one field more.
const SKINS: [(usize, usize, usize, usize); 5] = [
    (1000, 100, 16, 0),
    (7560, 600, 24, 0),
    (100_000, 10_000, 100, 0),
    (100_000, 100, 100, 100_000),
    (1_000_000, 1, 1, 1_000_000),
];
const FRAMES: [usize; 4] = [1, 64, 1024, 9984];
/// Memberships of a call at most: more takes a processor that stands in for a GPU too long.
const MOST: u128 = 40_000_000;
/// Values of a call at most.
const MOST_VALUES: usize = 20_000_000;
/// Memberships of a comparison with the reference at most.
const MOST_COMPARED: u128 = 4_000_000;
const OUTPUTS: Outputs = Outputs::CENTROID.union(Outputs::ORIENTATION);

fn main() -> Result<()> {
    let Some(adapter) = adapters().into_iter().next() else {
        eprintln!("no GPU driver answers: nothing to measure");
        return Ok(());
    };
    let bandwidth = bandwidth()?;
    let mut cases = Vec::new();
    for (sensors, fields, members, wide) in SKINS {
        let one = Shape { sensors, fields, members, wide, local: false, frames: 1, seed: 1 };
        let body = one.body();
        compare(&one, &body)?;
        for frames in FRAMES {
            let shape = Shape { frames, ..one };
            let values = frames.saturating_mul(sensors);
            if frames > 1 && (shape.memberships() > MOST || values > MOST_VALUES) {
                continue;
            }
            eprintln!("{sensors} sensors, {} fields, {frames} frames a call", shape.all_fields());
            cases.push(case(&shape, &body, &bandwidth)?);
        }
    }
    let report = json!({
        "adapter": { "name": adapter.name, "api": adapter.api, "kind": adapter.kind, "driver": adapter.driver },
        "copy_bytes_per_s": { "on_device": bandwidth.on_device, "up": bandwidth.up, "down": bandwidth.down },
        "cases": cases,
    });
    println!("{report:#}");
    Ok(())
}

/// Holds a few frames' percepts to the reference.
fn compare(shape: &Shape, body: &Body) -> Result<()> {
    let frames = (MOST_COMPARED / shape.memberships()).clamp(1, 30) as usize;
    let shape = Shape { frames, ..*shape };
    let mut engine =
        shape.engine(body, BackendKind::Gpu, Outputs::USUAL_AND_MOTION - Outputs::POSITION - Outputs::NORMAL)?;
    let (_, agreement) = engine.process_and_compare(&shape.frames())?;
    match agreement.holds() {
        true => Ok(()),
        false => Err(somatic::Error::failed(format!("{} sensors: {agreement}", shape.sensors))),
    }
}

fn case(shape: &Shape, body: &Body, bandwidth: &Bandwidth) -> Result<Value> {
    let mut engine = shape.engine(body, BackendKind::Gpu, OUTPUTS)?;
    let device = device_time(engine.plan(), shape.frames)?;
    let mut frames = shape.frames();
    engine.process(&frames)?;
    // In turns, as both wobble with whatever else the machine does.
    let mut empty = EmptyCall::new(engine.plan(), shape.frames)?;
    empty.run()?;
    let (start, mut seconds, mut empty_seconds) = (Instant::now(), Vec::new(), Vec::new());
    while seconds.len() < 3 || (seconds.len() < 2000 && start.elapsed() < Duration::from_secs(1)) {
        shape.advance(&mut frames);
        let call = Instant::now();
        engine.process(&frames)?;
        seconds.push(call.elapsed().as_secs_f64());
        let call = Instant::now();
        empty.run()?;
        empty_seconds.push(call.elapsed().as_secs_f64());
    }
    let median = |seconds: &mut Vec<f64>| {
        seconds.sort_by(f64::total_cmp);
        seconds[seconds.len() / 2]
    };
    let (call_s, empty_s) = (median(&mut seconds), median(&mut empty_seconds));
    let memberships = shape.memberships() as f64;
    let of_submission = memberships * device.frames as f64 / shape.frames as f64;
    let moved = device.least_bytes as f64 / device.programs_s;
    // What goes over the link in a call, at best, as the two ways may be used at once.
    let times = shape.frames as f64 / device.frames as f64;
    let link_s = times * (device.bytes_up as f64 / bandwidth.up).max(device.bytes_down as f64 / bandwidth.down);
    Ok(json!({
        "sensors": shape.sensors, "fields": shape.all_fields(), "memberships": shape.memberships() as u64,
        "frames": shape.frames, "outputs": "centroid,orientation",
        "device": {
            "frames": device.frames, "us": device.programs_s * 1e6, "by_device_clock": device.by_device,
            "memberships_per_s": of_submission / device.programs_s,
            "least_bytes": device.least_bytes,
            // A copy moves each of its bytes twice, in and out.
            "share_of_copy": moved / (2.0 * bandwidth.on_device),
        },
        "call": {
            "us": call_s * 1e6, "memberships_per_s": memberships / call_s, "share_of_link": link_s / call_s,
            "empty_dispatch_us": empty_s * 1e6,
        },
    }))
}
