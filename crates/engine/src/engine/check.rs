//! The comparison of a backend's percepts with the reference's.
//!
//! Where the reference cannot tell by its own margin, a backend may choose otherwise and keep another state: of a contact, a
//! centroid, a filter. From there on the reference goes on from the backend's state, field by field, so that what
//! follows is comparable. The percepts compared are those that the backend gives without a comparison, to the bit.

use super::post::{Post, PostFieldState, PostState};
use super::touch_check::TouchCheck;
use crate::backend::bounds::{BoundedReference, CellBound};
use crate::backend::{BackendState, FieldState, RawBatch};
use crate::error::Result;
use crate::percept::{Flags, Outputs, Percepts, Precision};
use crate::scene::{Plan, outputs_of};
use crate::signal::Frame;
use crate::stage::limit::Limit;
use crate::stage::world_motion;

/// The reference's side of a comparison.
pub(super) struct Check {
    pub(super) reference: BoundedReference,
    post: PostState,
    pub(super) right: Percepts,
    pub(super) bounds: Vec<CellBound>,
    /// The bounds of the last frame, where percepts may be kept.
    last_bounds: Vec<CellBound>,
    /// By field, how far its position in the last frame may be off, m, where motion in the world is asked for.
    position_off: Vec<f64>,
    /// Where touches of the whole body are asked for.
    pub(super) touches: Option<TouchCheck>,
}

impl Check {
    /// A comparison that goes on from the states of the engine's backend and post-processing.
    pub(super) fn new(plan: &Plan, backend: &BackendState, post: &PostState) -> Result<Self> {
        let right = Percepts::new(plan.outputs, plan.fields.len(), Precision::F64)
            .with_columns(plan.columns, plan.kept_pressures())
            .with_letters(plan.letter_by_field());
        let last = post.last.as_ref().map(|last| {
            let mut widened = right.clone();
            widened.take_frame(last, 0);
            widened
        });
        let mut check = Self {
            reference: BoundedReference::new(plan),
            post: PostState { last, ..post.clone() },
            right,
            bounds: Vec::new(),
            last_bounds: vec![CellBound::default(); plan.fields.len()],
            position_off: vec![0.0; plan.fields.len()],
            touches: plan.touched_from.map(|_| TouchCheck::default()),
        };
        check.reference.restore(backend)?;
        for (field, state) in post.fields.iter().enumerate() {
            check.reference.restore_filter(field, &state.filter, &state.difference);
        }
        Ok(check)
    }

    pub(super) fn reset(&mut self, frames: usize, first_frame: u64) {
        self.right.reset(frames);
        self.right.first_frame = first_frame;
        self.bounds.clear();
    }

    /// Computes frame `offset` of `raw`, which is `frame`, on the reference. `left` is the state in which the backend left the
    /// fields in this frame, and `after` the state of its post-processing.
    pub(super) fn frame(
        &mut self,
        post: &Post<'_>,
        (offset, frame): (usize, &Frame),
        raw: &RawBatch<'_>,
        left: &[FieldState],
        after: &PostState,
    ) {
        let advances = |field| post.cadence.is_none_or(|cadence| cadence.since(offset, field).is_some());
        let mut bounds = self.reference.run(raw, offset, &mut self.right, advances);
        if let (Some(touches), Some(first)) = (&mut self.touches, post.plan.touched_from) {
            touches.take(&self.reference.pressures()[first..][..post.plan.channels()]);
        }
        post.flag_restart(raw, offset, &mut self.right);
        let before: Vec<world_motion::Memory> = self.post.fields.iter().map(|field| field.world_motion).collect();
        post.place(std::slice::from_ref(frame), raw, offset, &mut self.right, &mut self.post);
        for (field, bound) in post.plan.fields.iter().zip(&mut bounds) {
            // Such a position is made of the raw values alone, alike on both sides.
            if !field.parts.is_empty()
                && post.links.may_pose(frame)
                && bound.limit(Outputs::POSITION) != Limit::TooClose
            {
                bound.set([(Outputs::POSITION, Limit::Within(0.0))]);
            }
        }
        for (field, bound) in post.plan.fields.iter().zip(&mut bounds) {
            // What the host makes of raw values is alike on both sides.
            if !field.sensed.is_empty() {
                let outputs = outputs_of(post.plan.letters()[field.letter].receptor);
                bound.set(outputs.iter().map(|output| (output, Limit::Within(0.0))));
                bound.in_doubt = Flags::empty();
            }
        }
        post.frame(offset, frame, raw, &mut self.right, &mut self.post);
        if post.plan.stages().world_motion {
            self.bound_world_motion(raw.steps[offset].dt_s, &before, &mut bounds);
        }
        for (field, bound) in bounds.iter().enumerate() {
            self.restore_doubtful(field, bound, left[field], &after.fields[field]);
        }
        self.bounds.extend(bounds);
    }

    /// Ends a call, whose bounds begin at `first`.
    pub(super) fn finish(&mut self, post: &Post<'_>, raw: &RawBatch<'_>, first: usize) {
        post.finish(raw, &mut self.right, &mut self.post);
        if let Some(cadence) = post.cadence {
            cadence.bounds(&mut self.bounds[first..], raw.steps, &mut self.last_bounds);
        }
    }

    /// Takes from `percepts` which fields several touches are on: touches are made once, of the backend's own pressures.
    pub(super) fn take_several(&mut self, raw: &RawBatch<'_>, percepts: &Percepts) {
        let cells = raw.first * percepts.fields()..(raw.first + raw.frames) * percepts.fields();
        for (right, flags) in self.right.flags[cells.clone()].iter_mut().zip(&percepts.flags[cells]) {
            *right |= *flags & Flags::SEVERAL;
        }
    }

    /// Adds the bounds of motion in the world, which depend on the bounds of positions, to `bounds`. `before` is what was kept of each
    /// field's position before this frame.
    fn bound_world_motion(&mut self, dt_s: f64, before: &[world_motion::Memory], bounds: &mut [CellBound]) {
        for (field, bound) in bounds.iter_mut().enumerate() {
            let off = &mut self.position_off[field];
            if let Limit::Within(now) = bound.limit(Outputs::POSITION) {
                let limit = before[field].bound(dt_s, self.post.fields[field].world_motion, [*off, now]);
                bound.set([(Outputs::SPEED_IN_WORLD, limit)]);
                *off = now;
            } else {
                // From here on both have the backend's.
                *off = 0.0;
            }
        }
    }

    /// Goes on from the backend's state where it may differ from the reference's.
    fn restore_doubtful(&mut self, field: usize, bound: &CellBound, left: FieldState, after: &PostFieldState) {
        let (may_remember, own) = (bound.may_remember, &mut self.post.fields[field]);
        if may_remember.contact {
            self.reference.restore_field(field, left);
            own.contact = after.contact;
            own.world_motion = after.world_motion;
        }
        if may_remember.filter {
            own.filter = after.filter;
            own.difference.clone_from(&after.difference);
            self.reference.restore_filter(field, &after.filter, &after.difference);
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::{DQuat, DVec3};

    use super::*;
    use crate::backend::BackendKind;
    use crate::backend::agreement::{Agreement, compare};
    use crate::body::Body;
    use crate::engine::{Engine, Options};
    use crate::percept::{COLUMNS, Column, Measure, Outputs, Percept, Store, Values};
    use crate::scene::Scene;
    use crate::signal::{Pose, RawValue};
    use crate::stage::limit::Limit;

    /// What a backend said of some frames, and what is right.
    struct Compared {
        engine: Engine,
        check: Box<Check>,
    }

    impl Compared {
        /// A touch that moves over the bundled hand, under a calibration that single precision has to round.
        fn on(backend: BackendKind) -> Option<Self> {
            let body = Body::from_bytes("hand", crate::bundled::HAND).unwrap();
            let ids: Vec<u32> = body.taxels.iter().map(|taxel| taxel.id).collect();
            let calibration = Some(
                crate::signal::Calibration::parse("[all]\ngain = 0.7\nunit = \"mmHg\"\nnoise = 0.4\n", &ids).unwrap(),
            );
            // Over so few frames motion over a time has no values.
            let filter = crate::scene::MotionFilter::default().over_s(None);
            let scene = Scene { outputs: Outputs::all(), filter, ..Scene::default() };
            let options = Options { backend, scene, calibration, batch: 64, ..Options::default() };
            let mut engine = match Engine::new(&body, options) {
                Err(error) if error.kind() == crate::error::ErrorKind::NoAdapter => return None,
                made => made.unwrap(),
            };
            let root = body.links[0].name.clone();
            let frame = |index: usize| {
                let mut frame = engine.frame(0.01 * index as f64);
                let value = |i: usize| 100.0 + 37.0 * ((i * (index + 3)) % 11) as f64;
                frame.values = (0..frame.values.len()).map(|i| RawValue::new(value(i))).collect();
                let translation = DVec3::new(0.003 * index as f64, 0.0, 0.0);
                frame.pose.push((root.clone(), Pose { translation, rotation: DQuat::IDENTITY }));
                frame
            };
            let frames: Vec<Frame> = (0..8).map(frame).collect();
            let (_, agreement) = engine.process_and_compare(&frames).unwrap();
            let of_fields = agreement.quantities.keys().filter(|name| !name.starts_with("touches")).count();
            assert!(agreement.holds() && of_fields == 26, "{backend:?}: {agreement}");
            let check = engine.check.take().unwrap();
            Some(Self { engine, check })
        }

        fn with(&self, percepts: &Percepts) -> Agreement {
            let names = vec!["field"; percepts.fields()];
            compare(&self.check.right, &self.check.bounds, percepts, &names)
        }

        /// The last percept for which `right` and `limit` give a value and a bound over 0.
        fn find(
            &self,
            right: impl Fn(&Percept) -> Option<f64>,
            limit: impl Fn(&CellBound) -> Limit,
        ) -> (usize, f64, f64) {
            let right_of = |cell: usize| right(&self.right(cell));
            let mut cells = (0..self.check.bounds.len()).rev();
            let found = cells.find_map(|cell| match limit(&self.check.bounds[cell]) {
                Limit::Within(bound) if bound > 0.0 => Some((cell, right_of(cell)?, bound)),
                _ => None,
            });
            found.expect("a value that is compared")
        }

        fn right(&self, cell: usize) -> Percept {
            let (frame, field) = (cell / self.check.right.fields(), cell % self.check.right.fields());
            self.check.right.get(frame, field)
        }
    }

    type Change = fn(&mut Percepts);
    /// Puts `value` into component `component` of `column`; whether that is kept in single precision.
    fn put(percepts: &mut Percepts, cell: usize, column: &Column, component: usize, value: f64) -> bool {
        match column.store {
            Store::Backend(parts) => {
                let Values::F32(kept) = &mut percepts.values else { unreachable!("this is not the reference") };
                kept[parts[component]][cell] = value as f32;
                true
            }
            Store::Host(host) => {
                let (frame, field) = (cell / percepts.fields(), cell % percepts.fields());
                let mut components = percepts.get(frame, field).value(column).unwrap();
                components[component] = value;
                percepts.set_host(host, cell, &components[..column.components]);
                false
            }
            Store::Active => unreachable!("it has no bound"),
        }
    }

    /// The numbers next to each other that are within `bound` of `right` and beyond it, in what the column holds.
    fn around(right: f64, bound: f64, single: bool) -> [f64; 2] {
        if single {
            let near = (right + bound) as f32;
            [near.next_down().into(), near.next_up().into()]
        } else {
            // A small part of the bound is more than what f64 makes of the comparison itself.
            [right + 0.99 * bound, right + 1.01 * bound]
        }
    }

    #[test]
    fn an_error_just_over_the_bound_is_a_disagreement_and_one_just_under_it_is_not() {
        let mut backends = 0;
        for backend in [BackendKind::Cpu, BackendKind::Gpu] {
            let Some(compared) = Compared::on(backend) else { continue };
            backends += 1;
            let hold = |name: &str, [under, over]: [f64; 2], put: &dyn Fn(&mut Percepts, f64)| {
                let with = |value: f64| {
                    let mut percepts = compared.engine.percepts.clone();
                    put(&mut percepts, value);
                    compared.with(&percepts)
                };
                let agreement = with(under);
                assert!(agreement.holds(), "{backend:?}, {name} under its bound: {agreement}");
                let agreement = with(over);
                assert!(!agreement.holds(), "{backend:?}, {name} over its bound: {agreement}");
                assert!(agreement.failures[0].contains(&format!(": {name} is")), "{name}: {agreement}");
                let comparison = agreement.quantities[name];
                assert_eq!(comparison.compared - comparison.agreeing, 1, "{name}: {agreement}");
            };
            let is_of_pressure = |column: &Column| !Outputs::OF_OTHER_LETTERS.contains(column.output);
            let has_bound = |column: &&Column| column.store != Store::Active && is_of_pressure(column);
            for column in COLUMNS.iter().filter(has_bound) {
                for component in 0..column.components {
                    let limit = |bound: &CellBound| match (column.measure, bound.centroid) {
                        (Measure::Place, Limit::Within(bounds)) => Limit::Within(bounds[component]),
                        (Measure::Place, _) => Limit::TooClose,
                        _ => bound.limit(column.output),
                    };
                    let (cell, right, bound) = compared.find(|percept| Some(percept.value(column)?[component]), limit);
                    let single = matches!(column.store, Store::Backend(_));
                    let [under, over] = around(right, bound, single);
                    // Of a vector the other parts are off by something of their own.
                    let under = if column.measure == Measure::Vector { right + 0.5 * bound } else { under };
                    hold(column.name, [under, over], &|percepts, value| {
                        assert_eq!(put(percepts, cell, column, component, value), single);
                    });
                }
            }
            // What has no bound differs by the least that it can.
            let choices: [(&str, Change); 3] = [
                ("active", |p| p.active[0] += 1),
                ("flags", |p| p.flags[0] ^= Flags::SATURATED),
                ("contact", |p| p.flags[0] ^= Flags::NO_CONTACT),
            ];
            for (name, change) in choices {
                let mut percepts = compared.engine.percepts.clone();
                change(&mut percepts);
                let agreement = compared.with(&percepts);
                let comparison = agreement.quantities[name];
                assert!(
                    !agreement.holds() && comparison.compared - comparison.agreeing == 1,
                    "{backend:?}, {name}: {agreement}"
                );
            }
        }
        assert!(backends > 0);
    }
}
