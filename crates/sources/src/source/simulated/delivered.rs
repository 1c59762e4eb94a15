//! The channels of a simulation's frames.

use super::sensor::Sensor;
use crate::body::{Body, Modality};
use crate::signal::{Axis, Channel};

/// What a channel delivers, and of which taxel among those that measure the same.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Delivered {
    Force(usize),
    /// Along the first or the second tangent of a pressed taxel.
    Pull(usize, usize),
    Temperature(usize),
    Distance(usize),
}

/// The channels of `body` that are simulated, ascending.
pub(super) fn channels(body: &Body) -> (Vec<u32>, Vec<Delivered>) {
    let mut made = Vec::new();
    let [mut pressed, mut warm, mut near] = [0; 3];
    let next = |count: &mut usize| {
        *count += 1;
        *count - 1
    };
    for taxel in &body.taxels {
        let delivered = match taxel.modality {
            modality if modality.is_pressed() => Delivered::Force(next(&mut pressed)),
            Modality::Temperature => Delivered::Temperature(next(&mut warm)),
            Modality::Proximity => Delivered::Distance(next(&mut near)),
            _ => continue,
        };
        made.push((taxel.id, delivered));
        if let (Modality::Force3, Delivered::Force(index)) = (taxel.modality, delivered) {
            let along = [Axis::U, Axis::V].into_iter().enumerate();
            made.extend(along.map(|(axis, name)| (Channel::of_taxel(taxel.id, name).0, Delivered::Pull(index, axis))));
        }
    }
    made.sort_unstable_by_key(|(channel, _)| *channel);
    made.into_iter().unzip()
}

/// The calibration's table of tangential forces, of which `friction` is the one that all touches have: empty where none are simulated,
/// and where it says nothing.
pub(super) fn shear_calibration(sensor: &Sensor, pulls_newton: &[[f64; 2]], friction: Option<f64>) -> String {
    let rest = sensor.kind.pull_at_rest();
    if pulls_newton.is_empty() || (rest == 0.0 && friction.is_none()) {
        return String::new();
    }
    let slips_at = friction.map(|friction| format!("slips_at = {friction}\n")).unwrap_or_default();
    format!("\n[shear]\nbaseline = [{rest}, {rest}]\n{slips_at}")
}
