//! How warm touches are: of the taxels of temperature whose nearest pressure taxel on the same side of the same link, within 1.5 widths of
//! its cell, is one of a touch's taxels.
//!
//! All of them count alike. Mean, extremes and gradient are those of stage *temperature*, the gradient in the touch's chart. The rate is
//! that of a [`Trend`], so that a touch that comes over a taxel, or leaves it, does not seem to warm.

use std::collections::BTreeMap;

use glam::{DAffine3, DVec3};

use crate::body::{Body, Modality};
use crate::percept::{Touch, TouchFlags};
use crate::scene::Plan;
use crate::signal::{Axis, RawValue, Reading, SenseCalibration};
use crate::stage::temperature::{self, Warm};
use crate::stage::window::Trend;
use crate::touch::{Skin, SkinTaxel};

/// How far a taxel of temperature may be from its nearest pressure taxel, in widths of that one's cell.
const REACH: f64 = 1.5;

/// A taxel of temperature that is near the skin.
#[derive(Clone, Copy, Debug)]
struct WarmTaxel {
    /// Its place in the body.
    taxel: usize,
    id: u32,
    link: u32,
    /// Where its value is among those that the host reads.
    value: usize,
    /// On the body at rest.
    position: DVec3,
    /// The mean normal of the skin at its nearest pressure taxel.
    mean_normal: DVec3,
}

impl WarmTaxel {
    /// Where it is, in the world if the touch's link is posed, else in that link's frame: there, and if its own link is not posed, as on
    /// the body at rest.
    fn in_frame_of(&self, touch: &Touch, skin: &Skin, poses: &[Option<DAffine3>]) -> DVec3 {
        let pose_of = |link: u32| poses.get(link as usize).copied().flatten();
        let (link, world_from_link) = match (pose_of(touch.link), pose_of(self.link)) {
            (None, _) => (touch.link, DAffine3::IDENTITY),
            (Some(world_from_link), None) => (touch.link, world_from_link),
            (Some(_), Some(world_from_link)) => (self.link, world_from_link),
        };
        world_from_link.transform_point3(skin.link_from_body(link).transform_point3(self.position))
    }
}

/// How the temperature under each touch went, by the touch's id.
pub(super) type Trends = Vec<(u64, Trend)>;

/// Finds them.
#[derive(Debug)]
pub(super) struct Warmth {
    taxels: Vec<WarmTaxel>,
    /// By node of the skin, which of `taxels` are nearest to it.
    by_node: BTreeMap<u32, Vec<usize>>,
    trends: Trends,
    /// Memory: trends of touches that ended.
    spare: Vec<Trend>,
    /// Memory: those of `taxels` that are under a touch.
    under: Vec<usize>,
    /// Memory: which of those have a reading, and it, °C.
    read: Vec<(usize, f64)>,
    warm: Vec<Warm>,
}

impl Warmth {
    /// `None` where no taxel of the skin has one of temperature beside it, or nobody asks for it.
    pub(super) fn new(body: &Body, plan: &Plan, skin: &Skin) -> Option<Self> {
        plan.senses.temperature.as_ref()?;
        let mut by_link: BTreeMap<usize, Vec<(u32, &SkinTaxel)>> = BTreeMap::new();
        for (number, node) in (0_u32..).zip(skin.taxels()) {
            by_link.entry(node.link as usize).or_default().push((number, node));
        }
        let mut taxels = Vec::new();
        let mut by_node: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
        for (taxel, own) in body.taxels.iter().enumerate().filter(|(_, own)| own.modality == Modality::Temperature) {
            let position = body.links[own.link].body_from_link.transform_point3(own.position_in_link);
            let normal = body.links[own.link].body_from_link.transform_vector3(own.normal_in_link);
            let far = |node: &SkinTaxel| node.position.distance_squared(position);
            // A thin shell has skin on its other side, too.
            let faces_alike = |node: &SkinTaxel| node.normal.dot(normal) > 0.0;
            let on_link = by_link.get(&own.link).into_iter().flatten().filter(|(_, node)| faces_alike(node));
            let nearest = on_link.min_by(|(_, a), (_, b)| far(a).total_cmp(&far(b)));
            if let Some(((number, node), value)) = nearest.zip(plan.senses.place_of(own.id, Axis::Normal))
                && far(node) <= REACH.powi(2) * node.cell_m2
            {
                by_node.entry(*number).or_default().push(taxels.len());
                let (link, mean_normal) = (own.link as u32, node.mean_normal);
                taxels.push(WarmTaxel { taxel, id: own.id, link, value, position, mean_normal });
            }
        }
        (!taxels.is_empty()).then(|| Self {
            taxels,
            by_node,
            trends: Trends::new(),
            spare: Vec::new(),
            under: Vec::new(),
            read: Vec::new(),
            warm: Vec::new(),
        })
    }

    /// How the temperature under each touch went.
    pub(super) fn trends(&self) -> &Trends {
        &self.trends
    }

    /// Goes on from these.
    pub(super) fn set_trends(&mut self, trends: &Trends) {
        self.trends.clone_from(trends);
    }

    /// The nodes beside which a taxel lies whose value `is` so.
    pub(super) fn nodes_with(&self, is: impl Fn(usize) -> bool) -> impl Iterator<Item = u32> {
        let by_node = self.by_node.iter();
        by_node
            .filter(move |(_, places)| places.iter().any(|&place| is(self.taxels[place].value)))
            .map(|(&node, _)| node)
    }

    /// Forgets the touches that are not among `touches`, or all if time `restarts`.
    pub(super) fn keep(&mut self, touches: &[Touch], restarts: bool) {
        let mut place = 0;
        while let Some((id, _)) = self.trends.get(place) {
            if !restarts && touches.iter().any(|touch| touch.id == *id) {
                place += 1;
                continue;
            }
            let (_, mut trend) = self.trends.swap_remove(place);
            trend.clear();
            self.spare.push(trend);
        }
    }

    /// Gives `touch`, whose taxels are `nodes`, what it has of temperature at `t_s`. `row` has the values that the host reads,
    /// and `poses` where links are in the world, by link.
    pub(super) fn add(
        &mut self,
        (plan, skin): (&Plan, &Skin),
        (t_s, row, poses): (f64, &[RawValue], &[Option<DAffine3>]),
        nodes: &[u32],
        touch: &mut Touch,
    ) {
        let Some(by) = &plan.senses.temperature else { return };
        if !self.read_under(by, row, nodes, touch) {
            return;
        }
        self.place((skin, touch));
        touch.temperature_celsius = Some(temperature::mean(&self.warm));
        if let Some(warmest) = temperature::extreme(&self.warm, |a, b| a > b) {
            touch.warmest_celsius = Some(self.warm[warmest].celsius);
            let own = &self.taxels[self.read[warmest].0];
            (touch.warmest_taxel, touch.warmest_position) = (Some(own.id), Some(own.in_frame_of(touch, skin, poses)));
        }
        if let Some(coldest) = temperature::extreme(&self.warm, |a, b| a < b) {
            touch.coldest_celsius = Some(self.warm[coldest].celsius);
            let own = &self.taxels[self.read[coldest].0];
            (touch.coldest_taxel, touch.coldest_position) = (Some(own.id), Some(own.in_frame_of(touch, skin, poses)));
        }
        // Around a limb there is no chart.
        let is_wrapped = touch.flags.contains(TouchFlags::WRAPPED);
        let gradient = if is_wrapped { None } else { temperature::gradient(&self.warm) };
        touch.temperature_gradient_kelvin_per_m = gradient.map(|gradient| gradient.to_array());
        touch.flags.set(TouchFlags::NO_GRADIENT, gradient.is_none());
        let rate = self.trend_of(touch.id, t_s, by.window_s);
        touch.temperature_rate_kelvin_per_s = rate;
        touch.flags.set(TouchFlags::NO_PREVIOUS, rate.is_none());
    }

    /// Reads the taxels at `nodes`; whether any has a reading. What is wrong with the others is said by flags of `touch`.
    fn read_under(&mut self, by: &SenseCalibration, row: &[RawValue], nodes: &[u32], touch: &mut Touch) -> bool {
        self.under.clear();
        self.under.extend(nodes.iter().filter_map(|node| self.by_node.get(node)).flatten());
        // By ascending id, as a field has them.
        self.under.sort_unstable();
        self.read.clear();
        for &place in &self.under {
            let own = self.taxels[place];
            match by.of_taxel(own.taxel).read(row[own.value]) {
                Reading::Value(celsius, is_in_range) => {
                    self.read.push((place, celsius));
                    if !is_in_range {
                        touch.flags |= TouchFlags::OUT_OF_RANGE;
                    }
                }
                Reading::Missing => touch.flags |= TouchFlags::INCOMPLETE,
                Reading::Faulty => touch.flags |= TouchFlags::FAULTY_INPUT,
            }
        }
        !self.read.is_empty()
    }

    /// Lays what was read into the chart of `touch`.
    fn place(&mut self, (skin, touch): (&Skin, &Touch)) {
        let [u, v, _] = skin.chart_axes(touch.base, touch.link);
        self.warm.clear();
        for &(place, celsius) in &self.read {
            let own = self.taxels[place];
            // Around a limb there is no chart, and nothing is made of places.
            let place_m = skin.place_in_chart(touch.base, [u, v], own.position, own.mean_normal).unwrap_or_default();
            self.warm.push(Warm { weight: 1.0, celsius, place_m });
        }
    }

    /// How fast the mean of what was read changes under touch `id`, K/s.
    fn trend_of(&mut self, id: u64, t_s: f64, window_s: f64) -> Option<f64> {
        let known = self.trends.iter().position(|(of, _)| *of == id);
        let place = known.unwrap_or_else(|| {
            self.trends.push((id, self.spare.pop().unwrap_or_default()));
            self.trends.len() - 1
        });
        self.trends[place]
            .1
            .take(t_s, &self.read, window_s, |read| temperature::mean_of(read.map(|(_, celsius)| [1.0, celsius])))
    }
}
