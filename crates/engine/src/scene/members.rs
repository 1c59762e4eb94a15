//! What a plan makes of a field: its members' weights, its thresholds, its unit.

use std::collections::BTreeMap;
use std::sync::Arc;

use glam::DVec3;

use crate::body::{BitsHasher, Body, KeptOfShape, Nearest};
use crate::error::{Result, failed};
use crate::field::{Chart, Field, Lift};
use crate::signal::{Calibration, ContactThresholds, Quantity, Receptor};
use crate::stage::hysteresis::Thresholds;
use crate::stage::position::Surface;

/// The members of a field that lie on one link.
#[derive(Clone, Debug)]
pub(crate) struct LinkPart {
    /// The link's index in the body.
    pub(crate) link: usize,
    /// Members, ascending, each with its position in that link, m.
    pub(crate) members: Vec<(u32, DVec3)>,
}

/// The members of `field` by their links; none where they all lie on one.
pub(super) fn parts(body: &Body, field: &Field) -> Arc<[LinkPart]> {
    let mut parts: BTreeMap<usize, Vec<_>> = BTreeMap::new();
    for (index, member) in field.members.iter().enumerate() {
        let taxel = &body.taxels[member.taxel];
        parts.entry(taxel.link).or_default().push((index as u32, taxel.position_in_link));
    }
    let parts = if parts.len() > 1 { parts } else { BTreeMap::new() };
    parts.into_iter().map(|(link, members)| LinkPart { link, members }).collect()
}

/// Per member of `field` its weight; empty where single precision holds each.
pub(super) fn weights(field: &Field) -> Vec<f64> {
    let weights = field.members.iter().map(|member| member.weight);
    if weights.clone().all(|weight| f64::from(weight as f32) == weight) { Vec::new() } else { weights.collect() }
}

/// When `field` counts as touched, as `receptor` feels it.
pub(super) fn thresholds(calibration: &Calibration, field: &str, receptor: Receptor) -> Thresholds {
    let contact: ContactThresholds = match receptor {
        Receptor::Sustained => calibration.fields.get(field).copied().unwrap_or(calibration.contact),
        Receptor::Change => calibration.change.contact,
        Receptor::Shear | Receptor::Temperature | Receptor::Proximity => ContactThresholds::default(),
    };
    Thresholds { on: contact.on, off: contact.off }
}

/// What P is in `field`.
pub(super) fn quantity_of(body: &Body, field: &Field, calibration: &Calibration) -> Result<Quantity> {
    let used = field.members.iter().map(|member| member.taxel).filter(|&taxel| !calibration.taxels[taxel].mask);
    let mut quantities = used.map(|taxel| (body.taxels[taxel].id, calibration.taxels[taxel].quantity));
    let Some((first, quantity)) = quantities.next() else { return Ok(Quantity::Count) };
    match quantities.find(|(_, other)| *other != quantity) {
        None => Ok(quantity),
        Some((id, other)) => Err(failed!(
            "field `{}` mixes quantities: taxel {first} measures in {quantity} and taxel {id} in {other}; calibrate both \
             in one, or give them fields of their own",
            field.name
        )
        .at(&body.name)),
    }
}

/// The least power of two that is at least `radius_m`, within what single precision can square.
pub(super) fn unit_of(radius_m: f64) -> f32 {
    let exponent = if radius_m > 0.0 { radius_m.log2().ceil().clamp(-60.0, 60.0) } else { 0.0 };
    exponent.exp2() as f32
}

pub(super) fn surface(nearest: &Nearest<'_>, kept: &KeptOfShape<'_>, field: &Field) -> Option<Surface> {
    let chart = field.chart.as_ref().ok()?;
    let surface =
        kept.get(key(field, chart), || Some(Surface::new(chart, &Lift::on(nearest, field)?, field.origin_in_anchor)));
    surface.as_ref().clone()
}

/// A hash of what the surface over `field` depends on, beside the body's shape.
fn key(field: &Field, chart: &Chart) -> u64 {
    let mut hash = BitsHasher::default();
    hash.number(field.anchor.unwrap_or(usize::MAX));
    hash.vector(field.origin_in_anchor);
    hash.number(chart.kind as u64);
    [chart.u_in_anchor, chart.v_in_anchor, chart.normal_in_anchor].into_iter().for_each(|axis| hash.vector(axis));
    for member in &field.members {
        hash.number(member.taxel);
        hash.vector(member.place);
    }
    hash.finish()
}
