//! What touches are beside pressure: how they pull along the skin, and how warm they are.
//!
//! Σs and Σ(x − c) × s · n go over the taxels of a touch that have three axes and whose tangential forces are known, x being
//! where they are on the body at rest, c the mean of x by P and n the normal of the taxel at which the touch's chart is based. In
//! that chart each s is turned by the smallest turn that takes its taxel's normal to the chart's; the friction is ‖Σs‖/ΣP of
//! these. The force has the normal part of the others, too, also where there are only those. Tangential forces are a part of wrenches. A
//! touch is as warm as the mean
//! of the taxels of temperature whose nearest pressure taxel on the same link is one of its taxels.

use std::collections::BTreeMap;

use glam::{DMat3, DQuat, DVec3};

use super::pulls::{Sides, tangential};
use crate::backend::RawBatch;
use crate::body::{Body, Modality};
use crate::percept::{Flags, LinkShare, Touch, TouchFlags, TouchFrame, TouchOutputs};
use crate::scene::Plan;
use crate::signal::{Axis, Channel, RawValue, Reading};
use crate::stage::shear::{Noise, ROUNDING};
use crate::stage::{calibrate, force};
use crate::touch::Skin;

/// How far a taxel of temperature may be from its nearest pressure taxel, in widths of that one's cell.
const REACH: f64 = 1.5;

/// What touches have of tangential forces.
const OF_PULLS: TouchOutputs = TouchOutputs::SHEAR.union(TouchOutputs::FRICTION_SIGMA).union(TouchOutputs::WRENCH);

/// A pressure taxel with three axes, on the body at rest.
#[derive(Clone, Debug)]
struct PulledTaxel {
    /// Its place in the body.
    taxel: usize,
    /// Where its tangential values are among those that are read beside pressures.
    values: [usize; 2],
    tangents_in_body: [DVec3; 2],
}

/// What such a taxel feels along the skin.
#[derive(Clone, Copy, Debug)]
struct Pull {
    node: u32,
    /// P > 0.
    pressure: f64,
    /// s on the body at rest.
    shear: DVec3,
    /// P for a raw unit of each tangential value.
    gains: [f64; 2],
}

/// The frame of a call that touches are of.
#[derive(Clone, Copy)]
pub(super) struct Sensed<'a> {
    pub(super) raw: &'a RawBatch<'a>,
    /// Its number in `raw`.
    pub(super) offset: usize,
    /// The values that are read beside pressures.
    pub(super) row: &'a [RawValue],
    /// P by node.
    pub(super) pressures: &'a [f64],
}

/// Finds them.
#[derive(Debug)]
pub(super) struct TouchSenses {
    wanted: TouchOutputs,
    /// By node of the skin.
    pulled: Vec<Option<PulledTaxel>>,
    /// By node, the taxels of temperature nearest to it: place in the body, and where its value is.
    warm: BTreeMap<u32, Vec<[usize; 2]>>,
    /// By link, turns directions of the body at rest into the link.
    link_from_body: Vec<DMat3>,
    /// Memory: those of a touch.
    pulls: Vec<Pull>,
    /// Memory: the taxels of a touch whose tangential forces are not known, and their P.
    normal_only: Vec<(u32, f64)>,
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
            wanted: plan.touch_outputs().unwrap_or(TouchOutputs::empty()),
            pulled,
            warm,
            pulls: Vec::new(),
            normal_only: Vec::new(),
            link_from_body: body.links.iter().map(|link| link.body_from_link.matrix3.transpose()).collect(),
        })
    }

    /// Whether touches need lists of their taxels for it.
    pub(super) fn needs_taxels(&self) -> bool {
        self.wanted.intersects(OF_PULLS) || !self.warm.is_empty()
    }

    /// Puts them into the touches `found` of a frame, in the frames of their links, and what pulls into their wrenches.
    pub(super) fn add(&mut self, (plan, skin): (&Plan, &Skin), sensed: &Sensed<'_>, found: &mut TouchFrame) {
        for index in 0..found.touches.len() {
            let nodes = found.taxels(&found.touches[index]);
            let (temperature, mut flags) = self.temperature(plan, sensed.row, nodes);
            self.pulls.clear();
            self.normal_only.clear();
            if self.wanted.intersects(OF_PULLS) {
                for &node in nodes {
                    let pressed = (node, sensed.pressures[node as usize]);
                    match self.pull(plan, sensed.row, pressed) {
                        Some(Ok(pull)) => self.pulls.push(pull),
                        Some(Err(why)) => {
                            flags |= why;
                            self.normal_only.push(pressed);
                        }
                        None => {}
                    }
                }
            }
            let touch = &mut found.touches[index];
            touch.temperature_celsius = temperature;
            touch.flags |= flags;
            if self.pulls.is_empty() && self.normal_only.is_empty() {
                continue;
            }
            if self.wanted.contains(TouchOutputs::SHEAR) {
                let turn = self.link_from_body[touch.link as usize];
                touch.force_vector_newton = self.force(plan, skin).map(|force| turn * force);
            }
            if self.pulls.is_empty() {
                // It is not known how any of them pulls.
                continue;
            }
            if self.wanted.contains(TouchOutputs::SHEAR) {
                self.shear((plan, skin), touch);
            }
            if self.wanted.contains(TouchOutputs::FRICTION_SIGMA) {
                touch.friction_sigma = self.friction_sigma((plan, skin), sensed, touch);
                if touch.friction_sigma.is_none() {
                    touch.flags |= TouchFlags::NOISE_UNKNOWN;
                }
            }
            if self.wanted.contains(TouchOutputs::WRENCH) {
                let [from, to] = touch.links.map(|end| end as usize);
                self.pulls.iter().for_each(|pull| add_to_wrench((plan, skin), pull, &mut found.links[from..to]));
            }
        }
    }

    /// Adds what pulls at the `pressed` taxels to the wrenches of their links, of which `row` has the values that are read beside
    /// pressures. A wrench of which a part is missing or faulty is absent, as nothing would say so.
    pub(super) fn add_to_links(
        &self,
        (plan, skin): (&Plan, &Skin),
        row: &[RawValue],
        pressed: impl Iterator<Item = (u32, f64)>,
        links: &mut [LinkShare],
    ) {
        for (node, pressure) in pressed {
            match self.pull(plan, row, (node, pressure)) {
                Some(Ok(pull)) => add_to_wrench((plan, skin), &pull, links),
                Some(Err(_)) => {
                    let link = skin.taxels()[node as usize].link;
                    links.iter_mut().filter(|share| share.link == link).for_each(|share| share.wrench = None);
                }
                None => {}
            }
        }
    }

    /// What the taxel of `node` feels along the skin, pressed by P, if it has three axes; or why that is not known.
    fn pull(&self, plan: &Plan, row: &[RawValue], (node, pressure): (u32, f64)) -> Option<Result<Pull, TouchFlags>> {
        let by = plan.senses.shear.as_ref()?;
        let own = self.pulled[node as usize].as_ref()?;
        let calibration = &plan.calibrations[node as usize];
        // Touches and fields refuse that; wrenches are then of normal forces.
        if !by.has_gain(own.taxel, calibration.response) {
            return None;
        }
        let sides = Sides::of(by, own.taxel, calibration);
        let values = own.values.map(|value| row.get(value).copied().unwrap_or(RawValue::MISSING));
        let pulls = tangential(by, sides, pressure, values);
        Some(match pulls {
            Ok([su, sv]) => {
                let [tu, tv] = own.tangents_in_body;
                Ok(Pull { node, pressure, shear: su * tu + sv * tv, gains: sides.gains })
            }
            Err(why) if why.contains(Flags::INCOMPLETE) => Err(TouchFlags::INCOMPLETE),
            Err(why) if why.contains(Flags::OUT_OF_RANGE) => Err(TouchFlags::OUT_OF_RANGE),
            Err(_) => Err(TouchFlags::FAULTY_INPUT),
        })
    }

    /// The nodes of which some value beside pressure is `stale`: channels of the body, ascending.
    pub(super) fn stale_nodes<'a>(&'a self, plan: &'a Plan, stale: &'a [usize]) -> impl Iterator<Item = u32> + 'a {
        let is_stale = |value: usize| stale.binary_search(&plan.senses.channels[value]).is_ok();
        let pulled = self
            .pulled
            .iter()
            .zip(0..)
            .filter(move |(own, _)| own.as_ref().is_some_and(|own| own.values.into_iter().any(is_stale)));
        let warm = self.warm.iter().filter(move |(_, taxels)| taxels.iter().any(|&[_, value]| is_stale(value)));
        pulled.map(|(_, node)| node).chain(warm.map(|(&node, _)| node))
    }

    /// The force on the skin by the taxels of a touch that have three axes, with their normal part alone where it is not known how they
    /// pull: N on the body at rest, where it is known.
    fn force(&self, plan: &Plan, skin: &Skin) -> Option<DVec3> {
        let pushed = self.normal_only.iter().map(|&(node, pressure)| (node, pressure, DVec3::ZERO));
        let pulled = self.pulls.iter().map(|pull| (pull.node, pull.pressure, pull.shear));
        pulled.chain(pushed).try_fold(DVec3::ZERO, |sum, (node, pressure, shear)| {
            let normal = skin.taxels()[node as usize].normal;
            Some(sum + newtons_per_p(plan, node)? * (shear - pressure * normal))
        })
    }

    /// What the taxels of `touch` that are pulled feel together.
    fn shear(&self, (plan, skin): (&Plan, &Skin), touch: &mut Touch) {
        let taxel = |pull: &Pull| &skin.taxels()[pull.node as usize];
        let outward = skin.taxels()[touch.base as usize].normal;
        let [u, v, up] = skin.chart_axes(touch.base, touch.link);
        let total: f64 = self.pulls.iter().map(|pull| pull.pressure).sum();
        let middle = self.pulls.iter().map(|pull| pull.pressure * taxel(pull).position).sum::<DVec3>() / total;
        let (mut shear, mut torsion, mut size) = (DVec3::ZERO, 0.0, 0.0);
        let mut in_chart = DVec3::ZERO;
        for pull in &self.pulls {
            let own = taxel(pull);
            shear += pull.shear;
            size += pull.shear.length();
            torsion += (own.position - middle).cross(pull.shear).dot(outward);
            in_chart += DQuat::from_rotation_arc(own.normal.normalize(), up) * pull.shear;
        }
        let turn = self.link_from_body[touch.link as usize];
        // Around a limb there is no chart.
        let is_wrapped = touch.flags.contains(TouchFlags::WRAPPED);
        let friction = if is_wrapped { shear.length() } else { in_chart.length() } / total;
        touch.shear = Some(turn * shear);
        // One taxel has no arm. Where it is not known how others with three axes pull, that is said.
        touch.torsion = (self.pulls.len() > 1).then_some(torsion);
        if touch.torsion.is_none() && self.normal_only.is_empty() {
            touch.flags |= TouchFlags::ONE_TAXEL;
        }
        touch.friction = Some(friction);
        touch.slip_ratio = plan.senses.shear.as_ref().and_then(|by| by.slips_at).map(|slips_at| friction / slips_at);
        if is_wrapped {
            return;
        }
        // −0 becomes 0, so that what points along −u is at π, and never at −π.
        let [along_u, along_v] = [u, v].map(|axis| in_chart.dot(axis) + 0.0);
        touch.shear_in_chart = Some([along_u, along_v]);
        let is_still = libm::hypot(along_u, along_v) <= ROUNDING * size;
        touch.shear_direction_rad = (!is_still).then(|| libm::atan2(along_v, along_u));
        touch.flags.set(TouchFlags::STILL, is_still);
    }

    /// The standard deviation of the friction of `touch`, as stage *shear* has it; `None` where a taxel's noise is not known.
    fn friction_sigma(&self, (plan, skin): (&Plan, &Skin), sensed: &Sensed<'_>, touch: &Touch) -> Option<f64> {
        let (friction, by) = (touch.friction?, plan.senses.shear.as_ref()?);
        let first_slot = plan.touched_from.unwrap_or(0);
        let up = (!touch.flags.contains(TouchFlags::WRAPPED)).then(|| skin.chart_axes(touch.base, touch.link)[2]);
        let turned = |node: u32, vector: DVec3| match up {
            Some(up) => DQuat::from_rotation_arc(skin.taxels()[node as usize].normal.normalize(), up) * vector,
            None => vector,
        };
        let direction = self.pulls.iter().map(|pull| turned(pull.node, pull.shear)).sum::<DVec3>().normalize_or_zero();
        let (mut total, mut variance) = (0.0, 0.0);
        for pull in &self.pulls {
            let node = pull.node as usize;
            let (calibration, own) = (&plan.calibrations[node], self.pulled[node].as_ref()?);
            let noise = calibration.noise?;
            let number = sensed.raw.rows.value(sensed.offset, node).number()?;
            let noise = Noise {
                of_pressure: calibrate::sigma(number, noise, calibration, plan.curve_of(first_slot + node)),
                of_sides: pull.gains.map(|gain| gain.abs() * by.noise_of(own.taxel).unwrap_or(noise)),
            };
            let along = own.tangents_in_body.map(|tangent| turned(pull.node, tangent).dot(direction));
            // Where nothing pulls, every direction is as good.
            let along = if direction == DVec3::ZERO { [1.0, 0.0] } else { along };
            total += pull.pressure;
            variance += noise.variance(by, along, friction);
        }
        Some(variance.sqrt() / total)
    }

    /// How warm the touch of `nodes` is, °C, and what is to be said of the taxels under it.
    fn temperature(&self, plan: &Plan, row: &[RawValue], nodes: &[u32]) -> (Option<f64>, TouchFlags) {
        let (mut sum, mut count, mut flags) = (0.0, 0.0, TouchFlags::empty());
        let by = plan.senses.temperature.as_ref().filter(|_| self.wanted.contains(TouchOutputs::TEMPERATURE));
        let Some(by) = by else { return (None, flags) };
        for &[taxel, value] in nodes.iter().filter_map(|node| self.warm.get(node)).flatten() {
            match by.of_taxel(taxel).read(row[value]) {
                Reading::Value(celsius, is_in_range) => {
                    (sum, count) = (sum + celsius, count + 1.0);
                    flags.set(TouchFlags::OUT_OF_RANGE, flags.contains(TouchFlags::OUT_OF_RANGE) || !is_in_range);
                }
                Reading::Missing => flags |= TouchFlags::INCOMPLETE,
                Reading::Faulty => flags |= TouchFlags::FAULTY_INPUT,
            }
        }
        ((count > 0.0).then(|| sum / count), flags)
    }
}

/// N for each unit of P at `node`, where that is known.
fn newtons_per_p(plan: &Plan, node: u32) -> Option<f64> {
    force::newtons_per_p(plan.calibrations[node as usize].quantity, plan.areas[node as usize])
}

/// Adds what `pull` does to the wrench of its link among `links`, if that is known.
fn add_to_wrench((plan, skin): (&Plan, &Skin), pull: &Pull, links: &mut [LinkShare]) {
    let taxel = &skin.taxels()[pull.node as usize];
    let share = links.iter_mut().find(|share| share.link == taxel.link);
    let Some((wrench, newtons)) = share.and_then(|share| share.wrench.as_mut()).zip(newtons_per_p(plan, pull.node))
    else {
        return;
    };
    let link_from_body = skin.link_from_body(taxel.link);
    let force = newtons * link_from_body.transform_vector3(pull.shear);
    wrench.force_newton += force;
    wrench.torque_newton_m += link_from_body.transform_point3(taxel.position).cross(force);
}
