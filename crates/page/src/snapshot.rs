//! A frame as the engine's thread hands it over: as little work as possible, in memory that is used again.

use std::collections::BTreeMap;
use std::time::Instant;

use crate::signal::{Pose, RawValue};
use somatic_engine::percept::{Percept, SelfContact, TouchFrame, TouchTrails};
use somatic_engine::scene::Plan;

/// The newest frame of a call, and the percepts made of it.
#[derive(Debug)]
pub(super) struct Snapshot {
    /// Number of the frame since the engine started.
    pub(super) number: u64,
    /// Frames that have been handed over, with this one.
    pub(super) published: u64,
    pub(super) t_s: f64,
    /// When it arrived.
    pub(super) arrived: Instant,
    /// What a frame took in the engine's call, µs.
    pub(super) call_us: f32,
    /// By the plan's channels.
    pub(super) raw: Vec<RawValue>,
    /// The plan's channels, ascending, that were out of range, or what corrects them was, before they were corrected.
    pub(super) out_of_range: Vec<usize>,
    /// By the channels of other letters than pressure.
    pub(super) sensed: Vec<RawValue>,
    /// How often the calibration had changed for the baselines.
    pub(super) calibration_changes: u64,
    /// By the plan's channels, the baseline and whether the taxel is left out.
    pub(super) baselines: Vec<(f64, bool)>,
    /// By taxel, the raw tangential values at rest of those that have their own.
    pub(super) tangential_baselines: BTreeMap<usize, [f64; 2]>,
    /// The links that the frame poses: world_from_link.
    pub(super) poses: Vec<(u32, Pose)>,
    /// Of the fields in contact, in their order.
    pub(super) percepts: Vec<Percept>,
    /// Of the whole body; none where none are looked for.
    pub(super) touches: TouchFrame,
    /// Where these were.
    pub(super) trails: TouchTrails,
    /// Between links, where they are asked for and known.
    pub(super) self_contacts: Vec<SelfContact>,
    pub(super) self_contacts_are_known: bool,
}

impl Snapshot {
    /// Nothing yet, with room for what `plan` gives.
    pub(super) fn new(plan: &Plan) -> Self {
        let mut snapshot = Self {
            number: 0,
            published: 0,
            t_s: 0.0,
            arrived: Instant::now(),
            call_us: f32::NAN,
            raw: vec![RawValue::MISSING; plan.channels()],
            out_of_range: Vec::new(),
            sensed: Vec::new(),
            calibration_changes: 0,
            baselines: Vec::new(),
            tangential_baselines: BTreeMap::new(),
            poses: Vec::new(),
            percepts: Vec::with_capacity(plan.fields.len()),
            touches: TouchFrame::default(),
            trails: TouchTrails::default(),
            self_contacts: Vec::new(),
            self_contacts_are_known: false,
        };
        snapshot.take_baselines(plan);
        snapshot
    }

    /// Takes over the calibration's baselines, if they have changed.
    pub(super) fn take_baselines(&mut self, plan: &Plan) {
        if self.baselines.is_empty() || self.calibration_changes != plan.calibration_changes {
            self.calibration_changes = plan.calibration_changes;
            self.baselines.clear();
            self.baselines.extend(plan.calibrations.iter().map(|taxel| (taxel.baseline, taxel.mask)));
            // Drift compensation leaves them as they are, and each copy takes memory.
            let changed = plan.tangential_baselines().filter(|own| **own != self.tangential_baselines);
            changed.into_iter().for_each(|own| self.tangential_baselines.clone_from(own));
        }
    }
}
