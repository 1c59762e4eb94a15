//! The drift compensation of an engine's calibration: its state, and what it needs of the plan.

use std::collections::HashMap;
use std::sync::Arc;

use crate::body::Body;
use crate::percept::Flags;
use crate::scene::Plan;
use crate::signal::{DriftCompensation, DriftKeys, Kept, MIN_UNTOUCHED, RawValue, Receptor, Wiring};
use crate::stage::{calibrate, layout};
use crate::touch::Skin;

/// Fields that are looked at to find one that leaves enough taxels untouched.
const MOST_LOOKED_AT: usize = 16;

/// A touch reaches this many spacings of taxels from a pressed one, or this many σ of the layer, if that is more,
const REACH_SPACINGS: f64 = 2.2;
const REACH_SIGMAS: f64 = 4.0;
/// but no more spacings than this: a taxel has some 200 others within them.
const MOST_SPACINGS: f64 = 8.0;

/// Drift compensation, and what it needs of the engine.
#[derive(Clone, Debug)]
pub(super) struct DriftState {
    pub(super) compensation: DriftCompensation,
    /// The taxels as the calibration has them, slot by slot.
    made: Vec<layout::Taxel>,
    /// Per channel, the groups that are warmed together, the nearest first: a board where that is known, a link, the body.
    groups: Vec<Vec<Option<usize>>>,
    /// Per field, whether it was in contact in this epoch.
    touched: Vec<bool>,
    /// Where pressures of all channels are known, as touches of the whole body are looked for: per channel those that a touch of it may
    /// reach, itself included. Otherwise all of a field counts as touched.
    near: Option<Arc<Vec<Vec<u32>>>>,
    /// Which of them were pressed in this epoch.
    pressed: Vec<bool>,
    /// Per field, whether the drift of one of its taxels is unknown.
    unknown: Vec<bool>,
}

impl DriftState {
    pub(super) fn new(plan: &Plan, keys: DriftKeys, body: &Body) -> Option<Self> {
        let links = plan.body_taxels.iter().map(|&taxel| Some(body.taxels[taxel].link)).collect();
        Self::in_groups(plan, keys, vec![links, vec![Some(0); plan.channels()]])
    }

    fn in_groups(plan: &Plan, keys: DriftKeys, groups: Vec<Vec<Option<usize>>>) -> Option<Self> {
        Some(Self {
            near: None,
            pressed: vec![false; plan.channels()],
            compensation: DriftCompensation::new(
                keys,
                (0..plan.channels()).map(|channel| kept(plan, channel)),
                groups.clone(),
            )?,
            made: plan.taxels.clone(),
            groups,
            touched: vec![false; plan.fields.len()],
            unknown: vec![false; plan.fields.len()],
        })
    }

    /// Starts again with the calibration that `plan` has now.
    pub(super) fn restart(&mut self, plan: &Plan) {
        let restarted = Self::in_groups(plan, self.compensation.keys(), self.groups.clone());
        let near = self.near.take();
        *self = restarted.unwrap_or_else(|| unreachable!("it was on before"));
        self.near = near;
    }

    /// Takes what a touch reaches from `skin`, whose nodes are the channels, under a layer of `sigma_m`: from then on only the taxels
    /// around pressed ones count as touched, whatever the fields.
    pub(super) fn follow_touches(&mut self, skin: &Skin, sigma_m: Option<f64>) {
        let around = |node: u32| {
            let at = skin.taxels()[node as usize].position;
            let distance_m = |other: u32| skin.taxels()[other as usize].position.distance(at);
            let beside = skin.beside(node);
            let spacing_m = beside.iter().map(|&other| distance_m(other)).sum::<f64>() / beside.len().max(1) as f64;
            let by_layer_m = sigma_m.map_or(0.0, |sigma_m| REACH_SIGMAS * sigma_m);
            let reach_m = by_layer_m.clamp(REACH_SPACINGS * spacing_m, MOST_SPACINGS * spacing_m);
            let mut near = vec![node];
            let mut from = 0;
            while from < near.len() {
                for &other in skin.beside(near[from]) {
                    if distance_m(other) <= reach_m && !near.contains(&other) {
                        near.push(other);
                    }
                }
                from += 1;
            }
            near
        };
        self.near = Some(Arc::new((0..self.pressed.len() as u32).map(around).collect()));
    }

    /// Taxels of one board are warmed together more than those of a link; `id_of` gives each channel's taxel.
    pub(super) fn wire(&mut self, plan: &Plan, wiring: &Wiring, id_of: impl Fn(usize) -> u32) {
        let numbered = wiring.boards().iter().enumerate();
        let board_of: HashMap<u32, usize> =
            numbered.flat_map(|(number, board)| board.taxels.iter().flatten().map(move |&id| (id, number))).collect();
        let boards = (0..plan.channels()).map(|channel| board_of.get(&id_of(channel)).copied()).collect();
        self.groups.insert(0, boards);
        self.restart(plan);
    }

    /// Whether the drift of taxels is followed, and none can tell that of `plan` while it is touched anywhere: too few taxels
    /// stay untouched then.
    pub(super) fn cannot_tell_drift(&self, plan: &Plan) -> bool {
        if self.compensation.keys().time_constant_s.is_none() {
            return false;
        }
        if let Some(near) = &self.near {
            return !near.iter().any(|near| near.len() + MIN_UNTOUCHED <= self.pressed.len());
        }
        let mut touched = vec![false; plan.fields.len()];
        let leaves_enough = |field: usize| {
            touched[field] = true;
            let channels = plan.touched_channels(&touched);
            touched[field] = false;
            let untouched =
                channels.iter().zip(&plan.calibrations).filter(|(touched, taxel)| !**touched && !taxel.mask);
            untouched.count() >= MIN_UNTOUCHED
        };
        let lasting = |field: &usize| plan.letters()[plan.fields[*field].letter].receptor == Receptor::Sustained;
        // A field whose parts are fields of their own is touched where one of these is.
        let own = |field: &usize| lasting(field) && !plan.fields[*field].divided;
        !(0..plan.fields.len()).filter(own).take(MOST_LOOKED_AT).any(leaves_enough)
    }

    /// Notes which fields are in contact, by the flags of frames, cell by cell.
    pub(super) fn note_contact(&mut self, seen: &[Flags]) {
        let fields = self.touched.len();
        for frame in seen.chunks_exact(fields) {
            for (touched, flags) in self.touched.iter_mut().zip(frame) {
                *touched |= !flags.contains(Flags::NO_CONTACT);
            }
        }
    }

    /// Notes which channels are pressed in a frame, by channel.
    pub(super) fn note_pressed(&mut self, pressures: &[f64]) {
        for (pressed, &pressure) in self.pressed.iter_mut().zip(pressures) {
            *pressed |= pressure > 0.0;
        }
    }

    pub(super) fn flag_unknown_drift(&self, cells: &mut [Flags]) {
        for frame in cells.chunks_exact_mut(self.unknown.len()) {
            for (flags, &unknown) in frame.iter_mut().zip(&self.unknown) {
                // A percept that is kept from the frame before has that one's.
                flags.set(Flags::DRIFT_UNKNOWN, unknown);
            }
        }
    }

    /// Judges the epoch that ends, and puts the outcome into `plan`. Returns whether anything changed in it.
    pub(super) fn close(&mut self, plan: &mut Plan) -> bool {
        let contact = match &self.near {
            Some(near) => reached(near, &self.pressed),
            None => plan.touched_channels(&self.touched),
        };
        self.touched.fill(false);
        self.pressed.fill(false);
        let near = self.near.as_deref();
        let changed = self.compensation.close(&contact, |pressed| {
            if let Some(near) = near {
                return reached(near, pressed);
            }
            let holds = |field| plan.members_of(field).iter().any(|m| pressed[plan.channel_of(m.slot as usize)]);
            plan.touched_channels(&plan.fields.iter().map(holds).collect::<Vec<_>>())
        });
        let unknown: Vec<bool> = self.compensation.unknown().collect();
        for (flagged, field) in self.unknown.iter_mut().zip(plan.fields.iter()) {
            let lasting = plan.letters()[field.letter].receptor == Receptor::Sustained;
            *flagged = lasting && plan.members_of(field).iter().any(|m| unknown[plan.channel_of(m.slot as usize)]);
        }
        if changed {
            for (channel, (baseline, unfit)) in self.compensation.taxels().enumerate() {
                plan.keep_up(channel, baseline, unfit.is_some(), &self.made);
            }
        }
        changed
    }
}

/// The channels that are near one for which `of` is true.
fn reached(near: &[Vec<u32>], of: &[bool]) -> Vec<bool> {
    let mut reached = vec![false; of.len()];
    for (near, _) in near.iter().zip(of).filter(|(_, of)| **of) {
        near.iter().for_each(|&channel| reached[channel as usize] = true);
    }
    reached
}

/// What drift compensation is to know of the taxel at `channel`.
fn kept(plan: &Plan, channel: usize) -> Kept {
    let (taxel, onset) = (&plan.calibrations[channel], plan.onset(channel));
    let threshold = taxel.dead_band + onset.threshold;
    let (falls, felt) = match plan.curve_of(channel).rounded {
        [] => (taxel.gain < 0.0, f64::from(threshold as f32) / f64::from(taxel.gain.abs() as f32)),
        [first, .., last] => (last.p < first.p, felt(plan, channel, [first.raw, last.raw].map(f64::from))),
        [_] => (false, 0.0),
    };
    let baseline = (taxel.baseline - onset.shift) as f32;
    Kept { baseline, raw_range: taxel.raw_range, felt, falls, mask: taxel.mask }
}

/// How far the raw value of a taxel with a curve must go from its baseline for it to be felt, between `ends` of the curve.
/// 0 where it is felt at the baseline already.
fn felt(plan: &Plan, channel: usize, ends: [f64; 2]) -> f64 {
    let (taxel, curve) = (&plan.calibrations[channel], plan.curve_of(channel));
    let is_felt = |step: f64| calibrate::reference(RawValue::new(taxel.baseline + step), taxel, curve).value > 0.0;
    let Some(end) = ends.into_iter().find(|&end| is_felt(end)).filter(|_| !is_felt(0.0)) else { return 0.0 };
    let (mut still, mut felt) = (0.0, end);
    for _ in 0..32 {
        let middle: f64 = 0.5 * (still + felt);
        *(if is_felt(middle) { &mut felt } else { &mut still }) = middle;
    }
    felt.abs()
}
