//! The definition of touches, written plainly and slowly: other code for the same equations, with the margins of its choices.
//!
//! A choice whose margin is less than `within` of what it compares is in doubt, and with it all touches that it may change. These
//! are left out of comparisons, and counted. Where P may be off by more than rounding, `within` is that share. If it is
//! not certain whether a taxel is pressed, all touches that it is part of or lies beside are in doubt.

mod divided;
mod measure;
mod name;

use std::collections::{BTreeMap, BTreeSet};

use glam::DVec3;

use super::bound::Bound;
use super::options::Options;
use super::skin::Skin;
use super::touches::TouchState;
use crate::percept::TouchFlags;

/// A touch as it is right.
#[derive(Clone, Debug)]
pub(crate) struct RightTouch {
    pub(crate) id: u64,
    pub(crate) age_s: f64,
    pub(crate) link: u32,
    pub(crate) nodes: BTreeSet<u32>,
    pub(crate) total: f64,
    pub(crate) force_newton: Option<f64>,
    pub(crate) position: DVec3,
    pub(crate) centre: DVec3,
    pub(crate) axis: Option<DVec3>,
    pub(crate) anisotropy: Option<f64>,
    pub(crate) spread_m: Option<[f64; 2]>,
    pub(crate) orientation: Option<DVec3>,
    pub(crate) velocity: Option<DVec3>,
    /// By link.
    pub(crate) wrenches: BTreeMap<u32, RightWrench>,
    /// Of the flags about form and identity.
    pub(crate) flags: TouchFlags,
    /// Which taxels it has, or its identity, may be chosen otherwise.
    pub(crate) in_doubt: bool,
    /// Its chart may have another base, which may change axis, anisotropy and spread.
    pub(crate) base_in_doubt: bool,
    pub(crate) link_in_doubt: bool,
    /// How far it may be off.
    pub(crate) bound: Bound,
}

/// What presses on a link about its origin, in its frame.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct RightWrench {
    pub(crate) force_newton: DVec3,
    pub(crate) torque_newton_m: DVec3,
    /// Σ‖F‖ of its taxels, what a share of the force is a share of.
    pub(crate) forces_newton: f64,
    /// Σ‖x‖‖F‖, with the distances from the origins of both the link and the body, in which x is rounded.
    pub(crate) torques_newton_m: f64,
}

/// What is kept of a touch.
#[derive(Clone, Debug)]
pub(super) struct Past {
    began_s: f64,
    link: u32,
    positions: Vec<(f64, DVec3)>,
    pressures: BTreeMap<u32, f64>,
}

/// The definition, frame after frame.
#[derive(Clone, Debug, Default)]
pub(crate) struct Reference {
    ids_given: u64,
    touches: BTreeMap<u64, Past>,
    two: BTreeSet<(u64, u64)>,
}

/// Some connected taxels.
#[derive(Clone, Debug)]
pub(super) struct Region {
    peak: u32,
    nodes: BTreeSet<u32>,
    in_doubt: bool,
}

/// A frame for the reference.
#[derive(Clone, Debug)]
pub struct Frame {
    pub(crate) t_s: f64,
    pub(crate) restarts: bool,
    pub(crate) pressures: Vec<f64>,
    pub(crate) without_value: BTreeSet<u32>,
    /// Nodes that may be pressed or not.
    pub(crate) unsure: BTreeSet<u32>,
}

/// What regions are found with.
pub struct Scene<'a> {
    skin: &'a Skin,
    options: &'a Options,
    frame: &'a Frame,
    beside: Vec<BTreeSet<u32>>,
    within: f64,
}

impl Reference {
    /// One that goes on from `state`.
    pub(crate) fn after(state: &TouchState) -> Self {
        let memory = &state.0;
        let mut touches: BTreeMap<u64, Past> = BTreeMap::new();
        for kept in &memory.touches {
            let positions = kept.trail.positions().collect();
            let past = Past { began_s: kept.began_s, link: kept.link, positions, pressures: BTreeMap::new() };
            touches.insert(kept.id, past);
        }
        for taxel in &memory.taxels {
            let touch = memory.touches.get(taxel.touch as usize).and_then(|kept| touches.get_mut(&kept.id));
            if let Some(past) = touch {
                past.pressures.insert(taxel.node, taxel.pressure);
            }
        }
        Self { ids_given: memory.ids_given, touches, two: memory.two.iter().map(|[a, b]| (*a, *b)).collect() }
    }

    /// The touches of the next frame, the oldest first, and the identities that end.
    pub(crate) fn step(
        &mut self,
        skin: &Skin,
        options: &Options,
        frame: &Frame,
        within: f64,
    ) -> (Vec<RightTouch>, Vec<u64>) {
        let before: Vec<u64> = self.touches.keys().copied().collect();
        if frame.restarts {
            self.touches.clear();
            self.two.clear();
        }
        let scene = Scene { skin, options, frame, beside: neighbours(skin, &frame.without_value), within };
        let (mut regions, pairs) = self.regions(&scene);
        for region in &mut regions {
            let is_unsure = |node: &u32| frame.unsure.contains(node);
            region.in_doubt |=
                region.nodes.iter().any(|node| is_unsure(node) || scene.beside[*node as usize].iter().any(is_unsure));
        }
        let named = self.name(&scene, &regions);
        let mut right = Vec::new();
        let mut kept = BTreeMap::new();
        for (&id, named) in &named {
            let region = &regions[named.region];
            let (mut touch, mut past) = scene.measure(region);
            touch.id = id;
            touch.in_doubt = region.in_doubt || named.in_doubt;
            if named.merged {
                touch.flags |= TouchFlags::MERGED;
            }
            if let Some(then) = named.continues.map(|id| &self.touches[&id]) {
                past.began_s = then.began_s;
                if then.link == touch.link && !named.merged && !named.parted {
                    past.positions = then.positions.clone();
                }
            }
            touch.age_s = ((frame.t_s - past.began_s).max(0.0) * 1e9).round() / 1e9;
            touch.velocity = velocity(&mut past.positions, frame.t_s, touch.position, options.velocity_over_s);
            if touch.velocity.is_none() {
                touch.flags |= TouchFlags::YOUNG;
            }
            right.push(touch);
            kept.insert(id, past);
        }
        let id_of = |peak: u32| named.iter().find(|(_, named)| regions[named.region].peak == peak).map(|(&id, _)| id);
        for (a, b) in pairs {
            if let (Some(a), Some(b)) = (id_of(a), id_of(b)) {
                self.two.insert((a.min(b), a.max(b)));
            }
        }
        self.two.retain(|(a, b)| kept.contains_key(a) && kept.contains_key(b));
        self.touches = kept;
        let released = before.into_iter().filter(|id| !self.touches.contains_key(id)).collect();
        (right, released)
    }

    fn touch_before(&self, node: u32) -> Option<u64> {
        self.touches.iter().find(|(_, past)| past.pressures.contains_key(&node)).map(|(&id, _)| id)
    }
}

/// Per node its neighbours; taxels without a value are bridges.
fn neighbours(skin: &Skin, without: &BTreeSet<u32>) -> Vec<BTreeSet<u32>> {
    let mut beside: Vec<BTreeSet<u32>> =
        (0..skin.nodes() as u32).map(|node| skin.beside(node).iter().copied().collect()).collect();
    // One after the other: the neighbours of each become each other's, then it is gone.
    for &gone in without {
        let around: Vec<u32> = std::mem::take(&mut beside[gone as usize]).into_iter().collect();
        for &a in &around {
            beside[a as usize].remove(&gone);
            beside[a as usize].extend(around.iter().filter(|&&b| b != a));
        }
    }
    beside
}

/// The velocity over `over_s`, m/s; `positions` are those kept.
fn velocity(positions: &mut Vec<(f64, DVec3)>, t_s: f64, position: DVec3, over_s: f64) -> Option<DVec3> {
    let is_old = |then_s: f64, by_s: f64| t_s - then_s >= by_s * (1.0 - 1e-6);
    let then = positions.iter().rev().find(|(then_s, _)| is_old(*then_s, over_s)).copied();
    if positions.last().is_none_or(|&(last_s, _)| t_s > last_s && is_old(last_s, over_s / 16.0)) {
        positions.push((t_s, position));
    }
    then.map(|(then_s, then)| (position - then) / (t_s - then_s))
}
