//! What touches are beside pressure: how they pull along the skin, and how warm they are.
//!
//! Σs, ‖Σs‖/ΣP and Σ(x − c) × s · n go over the taxels of a touch that have three axes and whose tangential forces are known, x being
//! where they are on the body at rest, c the touch's position and n its normal. A touch is as warm as the mean of the taxels of
//! temperature whose nearest pressure taxel on the same link is one of its taxels.

use std::collections::BTreeMap;

use glam::{DMat3, DVec3};

use super::pulls::{tangential, tangential_gain};
use crate::body::{Body, Modality};
use crate::percept::{Flags, Touch, TouchFlags, TouchFrame};
use crate::scene::Plan;
use crate::signal::{Axis, Channel, RawValue, Reading};
use crate::stage::force;
use crate::touch::Skin;

/// How far a taxel of temperature may be from its nearest pressure taxel, in widths of that one's cell.
const REACH: f64 = 1.5;

/// A pressure taxel with three axes, on the body at rest.
#[derive(Clone, Debug)]
struct PulledTaxel {
    /// Its place in the body.
    taxel: usize,
    /// Where its tangential values are among those that are read beside pressures.
    values: [usize; 2],
    tangents_in_body: [DVec3; 2],
}

/// Finds them.
#[derive(Debug)]
pub(super) struct TouchSenses {
    /// By node of the skin.
    pulled: Vec<Option<PulledTaxel>>,
    /// By node, the taxels of temperature nearest to it: place in the body, and where its value is.
    warm: BTreeMap<u32, Vec<[usize; 2]>>,
    /// By node, where it is on the body at rest, and its normal.
    nodes: Vec<[DVec3; 2]>,
    /// By link, turns directions of the body at rest into the link.
    link_from_body: Vec<DMat3>,
}

impl TouchSenses {
    /// `None` where no taxel has three axes and none measures temperature.
    pub(super) fn new(body: &Body, plan: &Plan, skin: &Skin) -> Option<Self> {
        let all = Channel::all_of(body);
        let value = |id: u32, axis: Axis| {
            let channel = all.binary_search(&Channel::of_taxel(id, axis).0).ok()?;
            plan.senses.channels.binary_search(&channel).ok()
        };
        let pulled = plan.body_taxels.iter().map(|&taxel| {
            let own = &body.taxels[taxel];
            let values = [value(own.id, Axis::U)?, value(own.id, Axis::V)?];
            let turned = |tangent| body.links[own.link].body_from_link.transform_vector3(tangent);
            Some(PulledTaxel { taxel, values, tangents_in_body: own.tangents_in_link().map(turned) })
        });
        let pulled: Vec<Option<PulledTaxel>> =
            if plan.senses.shear.is_some() { pulled.collect() } else { vec![None; plan.body_taxels.len()] };
        let mut warm: BTreeMap<u32, Vec<[usize; 2]>> = BTreeMap::new();
        let is_warm =
            |taxel: usize| plan.senses.temperature.is_some() && body.taxels[taxel].modality == Modality::Temperature;
        for taxel in (0..body.taxels.len()).filter(|&taxel| is_warm(taxel)) {
            let own = &body.taxels[taxel];
            let at = body.links[own.link].body_from_link.transform_point3(own.position_in_link);
            let Some(value) = value(own.id, Axis::Normal) else { continue };
            let on_link = skin.taxels().iter().zip(0_u32..).filter(|(node, _)| node.link as usize == own.link);
            let nearest = on_link.min_by(|(a, _), (b, _)| a.position.distance(at).total_cmp(&b.position.distance(at)));
            if let Some((node, number)) = nearest
                && node.position.distance(at) <= REACH * node.cell_m2.sqrt()
            {
                warm.entry(number).or_default().push([taxel, value]);
            }
        }
        let has_any = pulled.iter().any(Option::is_some) || !warm.is_empty();
        has_any.then(|| Self {
            pulled,
            warm,
            nodes: skin.taxels().iter().map(|node| [node.position, node.normal]).collect(),
            link_from_body: body.links.iter().map(|link| link.body_from_link.matrix3.transpose()).collect(),
        })
    }

    /// Puts them into the touches `found` of a frame, in the frames of their links. `row` has the values
    /// that are read beside pressures, and `pressures` has P by node.
    pub(super) fn add(&self, plan: &Plan, row: &[RawValue], pressures: &[f64], found: &mut TouchFrame) {
        for index in 0..found.touches.len() {
            let nodes = found.taxels(&found.touches[index]);
            let touch = &found.touches[index];
            let felt = self.felt(plan, row, pressures, nodes, touch);
            let temperature = self.temperature(plan, row, nodes);
            let touch = &mut found.touches[index];
            touch.temperature_celsius = temperature;
            touch.flags |= felt.flags;
            if felt.pull > 0.0 {
                let turn = self.link_from_body[touch.link as usize];
                touch.shear = Some(turn * felt.shear);
                touch.torsion = Some(felt.torsion);
                touch.friction = Some(felt.shear.length() / felt.pull);
                touch.force_vector_newton = felt.force.map(|force| turn * force);
            }
        }
    }

    fn felt(&self, plan: &Plan, row: &[RawValue], pressures: &[f64], nodes: &[u32], touch: &Touch) -> Felt {
        let mut felt = Felt { force: Some(DVec3::ZERO), ..Felt::default() };
        let Some(by) = &plan.senses.shear else { return felt };
        // The touch's place in the body: its chart's base is the taxel nearest to that.
        let [_, outward] = self.nodes[touch.base as usize];
        let known = || nodes.iter().filter_map(|&node| Some((node as usize, self.pulled[node as usize].as_ref()?)));
        let pull: f64 = known().map(|(node, _)| pressures[node]).sum();
        let middle = known().map(|(node, _)| pressures[node] * self.nodes[node][0]).sum::<DVec3>() / pull;
        for (node, own) in known() {
            let calibration = &plan.calibrations[node];
            let gain = tangential_gain(by, own.taxel, calibration);
            let values = own.values.map(|value| row[value]);
            let [su, sv] = match tangential(by, own.taxel, gain, pressures[node], values) {
                Ok(pulls) => pulls,
                Err(why) => {
                    felt.flags |=
                        if why.contains(Flags::INCOMPLETE) { TouchFlags::INCOMPLETE } else { TouchFlags::FAULTY_INPUT };
                    continue;
                }
            };
            let [tu, tv] = own.tangents_in_body;
            let [position, normal] = self.nodes[node];
            let shear = su * tu + sv * tv;
            felt.pull += pressures[node];
            felt.shear += shear;
            felt.torsion += (position - middle).cross(shear).dot(outward);
            let newtons = force::newtons_per_p(calibration.quantity, plan.areas[node]);
            felt.force = felt.force.zip(newtons).map(|(sum, each)| sum + each * (shear - pressures[node] * normal));
        }
        felt
    }

    fn temperature(&self, plan: &Plan, row: &[RawValue], nodes: &[u32]) -> Option<f64> {
        let by = plan.senses.temperature.as_ref()?;
        let under = nodes.iter().filter_map(|node| self.warm.get(node)).flatten();
        let read = under.filter_map(|&[taxel, value]| match by.of_taxel(taxel).read(row[value]) {
            Reading::Value(celsius, _) => Some(celsius),
            Reading::Missing | Reading::Faulty => None,
        });
        let [sum, count] = read.fold([0.0; 2], |[sum, count], celsius| [sum + celsius, count + 1.0]);
        (count > 0.0).then(|| sum / count)
    }
}

/// What the taxels of a touch feel together, on the body at rest.
#[derive(Default)]
struct Felt {
    pull: f64,
    shear: DVec3,
    torsion: f64,
    force: Option<DVec3>,
    flags: TouchFlags,
}
