//! Shear and temperature of touches.
//!
//! Sums, direction, torsion and friction are those of stage *shear*, over the taxels of a touch that have three axes and whose tangential
//! forces are known, in the touch's chart: a taxel counts as in the touch's place, and s and torsion are scaled by ΣP/ΣwP, so that they
//! are in the unit of the touch's total. The force has the normal part of all other taxels of the touch, too. Around a limb, where there is
//! no chart, the torsion is that across the plane of the touch's base. Tangential forces are a part
//! of wrenches.

use glam::{DAffine3, DMat3, DQuat, DVec2, DVec3};

use super::touch_warmth::{Trends, Warmth};
use crate::backend::RawBatch;
use crate::body::Body;
use crate::percept::{LinkShare, Touch, TouchFlags, TouchFrame, TouchOutputs};
use crate::scene::Plan;
use crate::signal::{Axis, RawValue};
use crate::stage::force;
use crate::stage::shear::{Noise, Noisy, Pulled, Sums};
use crate::stage::tangential::{Sides, Tangential, Unknown};
use crate::touch::Skin;

/// What touches have of tangential forces.
const OF_PULLS: TouchOutputs = TouchOutputs::SHEAR.union(TouchOutputs::FRICTION_SIGMA).union(TouchOutputs::WRENCH);

/// A pressure taxel with three axes, on the body at rest.
#[derive(Clone, Debug)]
struct PulledNode {
    /// Its place in the body.
    taxel: usize,
    /// Where its tangential values are among those that the host reads.
    values: [usize; 2],
    tangents_in_body: [DVec3; 2],
    /// How these are read; `None` where there is no gain: touches and fields refuse that, and wrenches are then of normal forces.
    sides: Option<Sides>,
}

impl PulledNode {
    /// s on the body at rest, of what is felt along the tangents.
    fn in_body(&self, felt: &Tangential) -> DVec3 {
        in_space(felt, &self.tangents_in_body)
    }
}

/// s as a vector in the space of these tangents.
fn in_space(felt: &Tangential, tangents: &[DVec3; 2]) -> DVec3 {
    felt.forces[0] * tangents[0] + felt.forces[1] * tangents[1]
}

/// A taxel of a touch. What depends on how it pulls is zero where that is not known.
#[derive(Clone, Copy, Debug, Default)]
struct NodePull {
    node: u32,
    /// P > 0.
    pressure: f64,
    /// What it feels along the skin, where that is known.
    felt: Option<Tangential>,
    tangents_in_body: [DVec3; 2],
    /// In the touch's chart.
    tangents_in_chart: [DVec2; 2],
    place_m: DVec2,
}

impl NodePull {
    /// s on the body at rest, where it is known.
    fn shear(&self) -> Option<DVec3> {
        self.felt.map(|felt| in_space(&felt, &self.tangents_in_body))
    }
}

/// What touches are found by: a plan, and the skin of its body.
#[derive(Clone, Copy)]
pub(super) struct PlanAndSkin<'a> {
    pub(super) plan: &'a Plan,
    pub(super) skin: &'a Skin,
}

/// The frame of a call that touches are of.
#[derive(Clone, Copy)]
pub(super) struct Sensed<'a> {
    pub(super) t_s: f64,
    pub(super) raw: &'a RawBatch<'a>,
    /// Its number in `raw`.
    pub(super) offset: usize,
    /// The values that the host reads.
    pub(super) row: &'a [RawValue],
    /// P by node.
    pub(super) pressures: &'a [f64],
    /// Where links are in the world, by link; empty if none is posed.
    pub(super) poses: &'a [Option<DAffine3>],
}

/// Finds them.
#[derive(Debug)]
pub(super) struct TouchSenses {
    wanted: TouchOutputs,
    /// How often the plan was calibrated when `pulled` were.
    calibration_changes: u64,
    /// By node of the skin.
    pulled: Vec<Option<PulledNode>>,
    warmth: Option<Warmth>,
    /// By link, turns directions of the body at rest into the link.
    link_from_body: Vec<DMat3>,
    /// Memory: the taxels of a touch.
    pulls: Vec<NodePull>,
}

impl TouchSenses {
    /// `None` where no taxel has three axes and none measures temperature.
    pub(super) fn new(body: &Body, plan: &Plan, skin: &Skin) -> Option<Self> {
        let pulled = plan.body_taxels.iter().map(|&taxel| {
            let own = &body.taxels[taxel];
            let values = [plan.senses.place_of(own.id, Axis::U)?, plan.senses.place_of(own.id, Axis::V)?];
            let turned = |tangent| body.links[own.link].body_from_link.transform_vector3(tangent);
            Some(PulledNode { taxel, values, tangents_in_body: own.tangents_in_link().map(turned), sides: None })
        });
        let pulled: Vec<Option<PulledNode>> =
            if plan.senses.shear.is_some() { pulled.collect() } else { vec![None; plan.body_taxels.len()] };
        let wanted = plan.touch_outputs().unwrap_or(TouchOutputs::empty());
        let warmth = if wanted.contains(TouchOutputs::TEMPERATURE) { Warmth::new(body, plan, skin) } else { None };
        let has_any = pulled.iter().any(Option::is_some) || warmth.is_some();
        let mut senses = has_any.then(|| Self {
            wanted,
            calibration_changes: plan.calibration_changes,
            pulled,
            warmth,
            pulls: Vec::new(),
            link_from_body: body.links.iter().map(|link| link.body_from_link.matrix3.transpose()).collect(),
        });
        senses.iter_mut().for_each(|senses| senses.calibrate(plan));
        senses
    }

    fn calibrate(&mut self, plan: &Plan) {
        self.calibration_changes = plan.calibration_changes;
        let Some(by) = &plan.senses.shear else { return };
        for (channel, (own, calibration)) in self.pulled.iter_mut().zip(&plan.calibrations).enumerate() {
            let Some(own) = own else { continue };
            let has_gain = by.has_gain(own.taxel, calibration.response);
            own.sides = has_gain.then(|| Sides::of(by, own.taxel, (calibration, plan.onset(channel).threshold)));
        }
    }

    /// Whether touches need lists of their taxels for it.
    pub(super) fn needs_taxels(&self) -> bool {
        self.wanted.intersects(OF_PULLS) || self.warmth.is_some()
    }

    /// What the next touches depend on beside the next frames.
    pub(super) fn trends(&self) -> Trends {
        self.warmth.as_ref().map(|warmth| warmth.trends().clone()).unwrap_or_default()
    }

    /// Goes on from these.
    pub(super) fn set_trends(&mut self, trends: &Trends) {
        self.warmth.iter_mut().for_each(|warmth| warmth.set_trends(trends));
    }

    /// Puts them into the touches `found` of a frame, directions in the frames of their links, and what pulls into their wrenches.
    pub(super) fn add(&mut self, of: PlanAndSkin<'_>, sensed: &Sensed<'_>, found: &mut TouchFrame) {
        if self.calibration_changes != of.plan.calibration_changes {
            self.calibrate(of.plan);
        }
        if let Some(warmth) = &mut self.warmth {
            warmth.keep(&found.touches, sensed.raw.steps[sensed.offset].restarts());
        }
        let TouchFrame { touches, links, taxels, .. } = found;
        for touch in touches {
            let [from, to] = touch.taxels.map(|end| end as usize);
            let nodes = &taxels[from..to];
            if let Some(warmth) = &mut self.warmth {
                warmth.add((of.plan, of.skin), (sensed.t_s, sensed.row, sensed.poses), nodes, touch);
            }
            if self.wanted.intersects(OF_PULLS) && self.look(of, sensed, nodes, touch) {
                let [from, to] = touch.links.map(|end| end as usize);
                self.pull(of, sensed, touch, &mut links[from..to]);
            }
        }
    }

    /// Notes what the taxels at `nodes` feel; whether any has three axes. Flags of `touch` say why it is not known how one pulls.
    fn look(&mut self, of: PlanAndSkin<'_>, sensed: &Sensed<'_>, nodes: &[u32], touch: &mut Touch) -> bool {
        let chart = TouchChart::new(of.skin, touch);
        let mut any = false;
        self.pulls.clear();
        for &node in nodes {
            let pressure = sensed.pressures[node as usize];
            let mut pull = NodePull { node, pressure, ..NodePull::default() };
            if let Some((own, felt)) = self.felt(of.plan, sensed.row, (node, pressure)) {
                any = true;
                match felt {
                    Ok(felt) => {
                        pull.felt = Some(felt);
                        pull.tangents_in_body = own.tangents_in_body;
                        pull.tangents_in_chart = chart.tangents(node, own.tangents_in_body);
                        pull.place_m = chart.place(node);
                    }
                    Err(why) => touch.flags |= why.into(),
                }
            }
            self.pulls.push(pull);
        }
        any
    }

    /// Gives `touch` what is wanted of what its taxels feel; its wrenches are in `links`.
    fn pull(&self, of: PlanAndSkin<'_>, sensed: &Sensed<'_>, touch: &mut Touch, links: &mut [LinkShare]) {
        let found = self.sums(of);
        if self.wanted.contains(TouchOutputs::SHEAR) {
            let turn = self.link_from_body[touch.link as usize];
            touch.force_vector_newton = found.force().map(|force| turn * force);
        }
        if found.pull <= 0.0 {
            // It is not known how any of them pulls.
            return;
        }
        let (by, charted) = (of.plan.senses.shear.as_ref(), !touch.flags.contains(TouchFlags::WRAPPED));
        if self.wanted.contains(TouchOutputs::SHEAR) {
            let friction = found.friction(charted);
            touch.friction = Some(friction);
            touch.slip_ratio = by.and_then(|by| by.slips_at).map(|at| friction / at);
            self.shear(&found, touch);
        }
        if self.wanted.contains(TouchOutputs::FRICTION_SIGMA) {
            touch.friction_sigma = by.and_then(|by| found.friction_sigma(charted, by, self.noisy(of, sensed)));
            if touch.friction_sigma.is_none() {
                touch.flags |= TouchFlags::NOISE_UNKNOWN;
            }
        }
        if self.wanted.contains(TouchOutputs::WRENCH) {
            for (node, shear) in self.pulls.iter().filter_map(|pull| Some((pull.node, pull.shear()?))) {
                add_to_wrench(of, (node, shear), links);
            }
        }
    }

    /// Adds what pulls at the `pressed` taxels to the wrenches of their links, of which `row` has the values that the host reads. A wrench
    /// of which a part is not known is absent, as nothing would say so.
    pub(super) fn add_to_links(
        &self,
        of: PlanAndSkin<'_>,
        row: &[RawValue],
        pressed: impl Iterator<Item = (u32, f64)>,
        links: &mut [LinkShare],
    ) {
        for (node, pressure) in pressed {
            match self.felt(of.plan, row, (node, pressure)) {
                Some((own, Ok(felt))) => add_to_wrench(of, (node, own.in_body(&felt)), links),
                Some((_, Err(_))) => {
                    let link = of.skin.taxels()[node as usize].link;
                    links.iter_mut().filter(|share| share.link == link).for_each(|share| share.wrench = None);
                }
                None => {}
            }
        }
    }

    /// The taxel of `node` if it has three axes, and what it feels along the skin, pressed by P; or why that is not known.
    fn felt(
        &self,
        plan: &Plan,
        row: &[RawValue],
        (node, pressure): (u32, f64),
    ) -> Option<(&PulledNode, Result<Tangential, Unknown>)> {
        let by = plan.senses.shear.as_ref()?;
        let own = self.pulled[node as usize].as_ref()?;
        let values = own.values.map(|value| row.get(value).copied().unwrap_or(RawValue::MISSING));
        Some((own, own.sides.as_ref()?.read(by, pressure, values)))
    }

    /// The nodes of which some value that the host reads is `stale`: channels of the body, ascending.
    pub(super) fn stale_nodes<'a>(&'a self, plan: &'a Plan, stale: &'a [usize]) -> impl Iterator<Item = u32> + 'a {
        let is_stale = |value: usize| stale.binary_search(&plan.senses.channels[value]).is_ok();
        let pulled = self
            .pulled
            .iter()
            .zip(0..)
            .filter(move |(own, _)| own.as_ref().is_some_and(|own| own.values.into_iter().any(is_stale)));
        let warm = self.warmth.iter().flat_map(move |warmth| warmth.nodes_with(is_stale));
        pulled.map(|(_, node)| node).chain(warm)
    }

    /// The sums over the taxels of a touch, in its chart.
    fn sums(&self, of: PlanAndSkin<'_>) -> Sums {
        let mut sums = Sums::default();
        for pull in &self.pulls {
            let own = &of.skin.taxels()[pull.node as usize];
            sums.add(&Pulled {
                weight: own.weight(),
                pressure: pull.pressure,
                felt: pull.felt,
                tangents_in_chart: &pull.tangents_in_chart,
                tangents: &pull.tangents_in_body,
                normal: own.normal,
                place_m: pull.place_m,
                newtons_per_p: newtons_per_p(of.plan, pull.node),
            });
        }
        sums
    }

    /// Gives `touch` what it `found` of shear.
    fn shear(&self, found: &Sums, touch: &mut Touch) {
        let known = self.pulls.iter().filter(|pull| pull.felt.is_some());
        let scale = known.map(|pull| pull.pressure).sum::<f64>() / found.pull;
        touch.shear = Some(self.link_from_body[touch.link as usize] * (scale * found.in_space()));
        touch.torsion = found.torsion().map(|torsion| scale * torsion);
        // One taxel has no arm. Where it is not known how others with three axes pull, that is said; and where no other is pressed.
        let mut others = self.pulls.iter().filter(|pull| pull.felt.is_none());
        let are_of_one_axis = others.all(|pull| self.pulled[pull.node as usize].is_none());
        touch.flags.set(TouchFlags::ONE_PULLED, touch.torsion.is_none() && are_of_one_axis && self.pulls.len() > 1);
        if touch.flags.contains(TouchFlags::WRAPPED) {
            return;
        }
        // −0 becomes 0.
        touch.shear_in_chart = Some((scale * found.along_chart).to_array().map(|along| along + 0.0));
        touch.shear_direction_rad = found.direction();
        touch.flags.set(TouchFlags::STILL, touch.shear_direction_rad.is_none());
    }

    /// The taxels of a touch of which it is known how they pull, with their noise; `None` where that is not known.
    fn noisy<'a>(&'a self, of: PlanAndSkin<'a>, sensed: &'a Sensed<'_>) -> impl Iterator<Item = Option<Noisy<'a>>> {
        let first_slot = of.plan.touched_from.unwrap_or(0);
        let noise = move |node: usize| {
            let calibration = (&of.plan.calibrations[node], of.plan.curve_of(first_slot + node));
            let sides = self.pulled[node].as_ref()?.sides.as_ref()?;
            Noise::of(sensed.raw.rows.value(sensed.offset, node), calibration, sides)
        };
        let known = self.pulls.iter().filter_map(|pull| Some((pull, pull.felt?)));
        known.map(move |(pull, felt)| {
            let weight = of.skin.taxels()[pull.node as usize].weight();
            let tangents_in_chart = &pull.tangents_in_chart;
            Some(Noisy { weight, felt, noise: noise(pull.node as usize)?, tangents_in_chart })
        })
    }
}

/// The chart of a touch; around a limb, the plane of its base.
struct TouchChart<'a> {
    skin: &'a Skin,
    base: u32,
    /// u, v and the normal.
    axes: [DVec3; 3],
    is_wrapped: bool,
}

impl<'a> TouchChart<'a> {
    fn new(skin: &'a Skin, touch: &Touch) -> Self {
        let is_wrapped = touch.flags.contains(TouchFlags::WRAPPED);
        Self { skin, base: touch.base, axes: skin.chart_axes(touch.base, touch.link), is_wrapped }
    }

    /// Where the taxel of `node` is, m.
    fn place(&self, node: u32) -> DVec2 {
        let ([u, v, _], taxels) = (self.axes, self.skin.taxels());
        let own = &taxels[node as usize];
        let in_chart = self.skin.place_in_chart(self.base, [u, v], own.position, own.mean_normal);
        in_chart.filter(|_| !self.is_wrapped).unwrap_or_else(|| {
            let offset = own.position - taxels[self.base as usize].position;
            DVec2::new(offset.dot(u), offset.dot(v))
        })
    }

    /// The `tangents` of the taxel of `node` along u and v.
    fn tangents(&self, node: u32, tangents: [DVec3; 2]) -> [DVec2; 2] {
        let [u, v, up] = self.axes;
        let normal = self.skin.taxels()[node as usize].normal.normalize();
        let turn = if self.is_wrapped { DQuat::IDENTITY } else { DQuat::from_rotation_arc(normal, up) };
        tangents.map(|tangent| {
            let turned = turn * tangent;
            DVec2::new(turned.dot(u), turned.dot(v))
        })
    }
}

/// N for each unit of P at `node`, where that is known.
fn newtons_per_p(plan: &Plan, node: u32) -> Option<f64> {
    force::newtons_per_p(plan.calibrations[node as usize].quantity, plan.areas[node as usize])
}

/// Adds the tangential force s of `node`, on the body at rest, to the wrench of its link among `links`, if that is known.
fn add_to_wrench(PlanAndSkin { plan, skin }: PlanAndSkin<'_>, (node, shear): (u32, DVec3), links: &mut [LinkShare]) {
    let taxel = &skin.taxels()[node as usize];
    let share = links.iter_mut().find(|share| share.link == taxel.link);
    let Some((wrench, newtons)) = share.and_then(|share| share.wrench.as_mut()).zip(newtons_per_p(plan, node)) else {
        return;
    };
    let link_from_body = skin.link_from_body(taxel.link);
    let force = newtons * link_from_body.transform_vector3(shear);
    wrench.force_newton += force;
    wrench.torque_newton_m += link_from_body.transform_point3(taxel.position).cross(force);
}
