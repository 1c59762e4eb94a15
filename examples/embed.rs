//! Touch in your own control loop: frames from your driver in, percepts out, without files or threads.
//!
//!     cargo run --example embed

use somatic::{Body, Engine, Options, RawValue};

fn main() -> somatic::Result<()> {
    // Your robot would be `Body::load("robot.glb")?`. The default options ask for everything, on whatever is fastest.
    let body = Body::from_bytes("hand", somatic::bundled::HAND)?;
    let mut engine = Engine::new(&body, Options::default())?;
    let fields: Vec<String> =
        engine.plan().fields().map(|field| format!("{}, from {}", field.name, field.link)).collect();

    // One frame to fill again and again. What your driver leaves missing stays missing: it is never taken for zero.
    let mut frame = engine.frame(0.0);
    for tick in 0..100 {
        frame.t_s = f64::from(tick) * 0.01;
        // Values stand in the order of the body's taxels, by ascending id.
        for (value, taxel) in frame.values.iter_mut().zip(&body.taxels) {
            *value = RawValue::new(read_sensor(taxel.id, tick));
        }
        // This does no I/O. A quantity that is `None` is not defined for this touch, and the percept's flags say why.
        let percepts = engine.process(std::slice::from_ref(&frame))?;
        for percept in percepts.touched(0) {
            let (total, place) = (percept.total, percept.position);
            println!("{:.2} s  {}: {total:?} at {place:?} m", frame.t_s, fields[percept.field]);
        }
    }
    Ok(())
}

/// Stands for your driver: here, something presses two sensors of the palm harder and harder.
fn read_sensor(id: u32, tick: u32) -> f64 {
    match id {
        4 if tick >= 90 => f64::from(tick),
        5 if tick >= 95 => f64::from(tick) * 0.5,
        _ => 0.0,
    }
}
