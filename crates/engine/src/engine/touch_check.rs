//! Compares touches of the whole body with their definition.
//!
//! Touches are found in double precision from the backend's pressures. Here the same frame's right pressures go through the definition
//! ([`crate::touch::reference`]), which starts from what the engine kept of the frame before: each frame is compared from the one before,
//! and what was too close to call there does not go on. How far the backend's pressures may be off is the largest share of itself by which
//! a taxel's P may be; from it follow the bounds of a touch (`touch/bound.rs`). A touch whose taxels or identity depend on a choice that is
//! closer than this is counted, and not compared.
//!
//! The normal, standard deviations and fits are not compared: `tests/it` holds them to their equations.

use std::collections::{BTreeMap, BTreeSet};

use glam::DVec3;

use crate::backend::agreement::{Agreement, Comparison};
use crate::percept::{Touch, TouchFlags, TouchFrame, TouchOutputs};
use crate::stage::calibrate::Pressure;
use crate::touch::reference::{Frame, Reference, RightTouch};
use crate::touch::{Input, TouchState, Touches};

/// Rounding of angles between unit vectors, rad.
const ANGLE_ROUNDING: f64 = 1e-7;
/// Rounding of lengths, m.
const ROUNDING_M: f64 = 1e-12;
/// Disagreements that are put in words.
const MOST_WORDS: usize = 10;

/// What the definition tells nothing of: what is wrong with values, fits and standard deviations.
const NOT_COMPARED: TouchFlags = TouchFlags::SATURATED
    .union(TouchFlags::FAULTY_INPUT)
    .union(TouchFlags::OUT_OF_RANGE)
    .union(TouchFlags::INCOMPLETE)
    .union(TouchFlags::STALE)
    .union(TouchFlags::NO_UNIT)
    .union(TouchFlags::FEW_TAXELS)
    .union(TouchFlags::OFF_SKIN)
    .union(TouchFlags::POOR_FIT)
    .union(TouchFlags::NO_LAYER)
    .union(TouchFlags::NOISE_UNKNOWN)
    .union(TouchFlags::UNSURE)
    .union(TouchFlags::YOUNG_FIT);

/// Compares the touches of a call with their definition.
#[derive(Debug, Default)]
pub(super) struct TouchCheck {
    /// The right pressures of the frames that are to come, by node.
    right: Vec<Vec<Pressure>>,
    agreement: Agreement,
}

impl TouchCheck {
    /// Takes the right pressures of the next frame, by node.
    pub(super) fn take(&mut self, right: &[Pressure]) {
        self.right.push(right.to_vec());
    }

    /// Forgets pressures of frames that were looked at.
    pub(super) fn end_of_run(&mut self) {
        self.right.clear();
    }

    /// What was found since the last time.
    pub(super) fn found(&mut self) -> Agreement {
        std::mem::take(&mut self.agreement)
    }

    /// Compares `found`, which `touches` found in frame `offset` of the run, frame `number` of all, after `before`.
    pub(super) fn compare(
        &mut self,
        (offset, number): (usize, u64),
        input: &Input<'_, f64>,
        (before, touches): (&TouchState, &Touches),
        found: &TouchFrame,
    ) {
        let Some(right) = self.right.get(offset) else { return };
        let is_pressed = |right: &&Pressure| right.value > 0.0 && !right.in_doubt;
        let share = right.iter().filter(is_pressed).map(|right| right.bound / right.value).fold(0.0, f64::max);
        let unsure = right.iter().enumerate().filter(|(_, right)| right.in_doubt).map(|(node, _)| node as u32);
        let frame = Frame {
            t_s: input.t_s,
            restarts: input.restarts,
            pressures: right.iter().map(|right| right.value).collect(),
            without_value: input.without_value.iter().copied().collect(),
            unsure: unsure.collect(),
        };
        let (all, _) = Reference::after(before).step(touches.skin(), touches.options(), &frame, share);
        let is_certain = !all.iter().any(|touch| touch.in_doubt) && frame.unsure.is_empty();
        let mut nodes: Vec<BTreeSet<u32>> = touches.taxels().map(|nodes| nodes.iter().copied().collect()).collect();
        nodes.resize_with(found.touches.len(), BTreeSet::new);
        let mut is_matched = vec![false; nodes.len()];
        for right in &all {
            let same = nodes.iter().position(|nodes| *nodes == right.nodes);
            if let Some(same) = same {
                is_matched[same] = true;
            }
            self.agreement.touches += 1;
            let mut beside = Beside { quantities: &mut self.agreement.quantities, failure: None };
            match same {
                _ if right.in_doubt => beside.too_close("touches"),
                // Ids are given one after the other: one in doubt moves all new ones.
                Some(same) if right.id != found.touches[same].id && !is_certain => beside.too_close("touches"),
                Some(same) => beside.compare(touches, right, (found, &found.touches[same]), is_certain),
                None if is_certain => beside.fails("touches", format!("touch {} is not found", right.id)),
                // What is in doubt beside it may have taken it.
                None => beside.too_close("touches"),
            }
            let failure = beside.failure;
            self.note(number, failure);
        }
        for (touch, _) in found.touches.iter().zip(is_matched).filter(|(_, is_matched)| !is_matched && is_certain) {
            let mut beside = Beside { quantities: &mut self.agreement.quantities, failure: None };
            beside.fails("touches", format!("touch {} is not one", touch.id));
            let failure = beside.failure;
            self.note(number, failure);
        }
    }

    fn note(&mut self, frame: u64, failure: Option<String>) {
        if let Some(what) = failure {
            self.agreement.failed += 1;
            if self.agreement.failures.len() < MOST_WORDS {
                self.agreement.failures.push(format!("frame {frame}: {what}"));
            }
        }
    }
}

/// A touch beside what is right.
struct Beside<'a> {
    quantities: &'a mut BTreeMap<String, Comparison>,
    failure: Option<String>,
}

impl Beside<'_> {
    /// `is_certain`: nothing in the frame is in doubt, so that no other touch may merge with this one or be a part of it.
    fn compare(
        &mut self,
        touches: &Touches,
        right: &RightTouch,
        (frame, found): (&TouchFrame, &Touch),
        is_certain: bool,
    ) {
        let (skin, bound) = (touches.skin(), &right.bound);
        if right.id != found.id {
            return self.fails("touches", format!("touch {} has the id {}", right.id, found.id));
        }
        self.agrees("touches");
        self.number("touches.total", Some(found.total), Some(right.total), Some(bound.share * right.total));
        self.number("touches.age", Some(found.age_s), Some(right.age_s), Some(1e-12));
        let [force, right_force] = [found.force_newton, right.force_newton];
        self.number("touches.force", force, right_force, right_force.map(|force| bound.share * force));
        if right.link_in_doubt {
            return self.too_close("touches.link");
        }
        if found.link != right.link {
            return self
                .fails("touches.link", format!("touch {} is on link {}, not {}", right.id, found.link, right.link));
        }
        self.agrees("touches.link");
        let way = skin.link_from_body(right.link);
        self.place("touches.centre", found.centre, way.transform_point3(right.centre), Some(ROUNDING_M));
        // Without a surface it lies on the plane of the base.
        let hangs_on_base = right.base_in_doubt && !skin.has_surface(found.base);
        let position_m = (!hangs_on_base).then_some(bound.position_m);
        self.place("touches.position", found.position, way.transform_point3(right.position), position_m);
        if let (Some(found), Some(velocity)) = (found.velocity, right.velocity) {
            // The older position is the same on both sides.
            let off = position_m.map(|off_m| off_m / touches.options().velocity_over_s * (1.0 + 1e-5));
            self.place("touches.velocity", found, way.transform_vector3(velocity), off);
        }
        for share in frame.links(found) {
            let (Some(wrench), Some(right)) = (share.wrench, right.wrenches.get(&share.link)) else { continue };
            let force = Some(bound.share * right.forces_newton);
            self.place("touches.wrench", wrench.force_newton, right.force_newton, force);
            let torque = Some(bound.share * right.torques_newton_m);
            self.place("touches.wrench", wrench.torque_newton_m, right.torque_newton_m, torque);
        }
        let is_oriented = touches.options().outputs.contains(TouchOutputs::ORIENTATION);
        self.flags(right, found.flags, is_certain, is_oriented);
        let known = |off: f64| (!right.base_in_doubt && off.is_finite()).then_some(off);
        self.number("touches.anisotropy", found.anisotropy, right.anisotropy, known(bound.anisotropy));
        let spread = |spread: Option<[f64; 2]>, k: usize| spread.map(|spread| spread[k]);
        for k in 0..2 {
            self.number(
                "touches.spread",
                spread(found.spread_m, k),
                spread(right.spread_m, k),
                known(bound.spread_m[k]),
            );
        }
        let turned = |line: Option<DVec3>| line.map(|line| way.transform_vector3(line));
        let axis = bound.axis_rad.filter(|_| !bound.isotropic_in_doubt).and_then(known);
        self.line("touches.principal_axis", found.principal_axis, turned(right.axis), axis);
        let orientation = bound.orientation_rad.filter(|_| !bound.tie_in_doubt).and_then(known);
        if found.orientation.is_some() {
            self.line("touches.orientation", found.orientation, turned(right.orientation), orientation);
        }
    }

    /// Compares the flags `found`, but for those that a doubt may change.
    fn flags(&mut self, right: &RightTouch, found: TouchFlags, is_certain: bool, is_oriented: bool) {
        let doubts = [
            (!is_oriented, TouchFlags::TIE | TouchFlags::COINCIDENT),
            (!is_certain, TouchFlags::MERGED | TouchFlags::YOUNG),
            (right.bound.tie_in_doubt, TouchFlags::TIE | TouchFlags::COINCIDENT),
            (right.bound.isotropic_in_doubt, TouchFlags::ISOTROPIC),
            (
                right.base_in_doubt,
                TouchFlags::WRAPPED | TouchFlags::TIE | TouchFlags::COINCIDENT | TouchFlags::ISOTROPIC,
            ),
        ];
        let in_doubt = doubts.into_iter().filter(|(is_so, _)| *is_so).fold(NOT_COMPARED, |all, (_, flags)| all | flags);
        if (found ^ right.flags).intersects(in_doubt.complement()) {
            let names = |flags: TouchFlags| (flags - in_doubt).names().collect::<Vec<_>>().join(" ");
            self.fails(
                "touches.flags",
                format!("touch {} has flags [{}], not [{}]", right.id, names(found), names(right.flags)),
            );
        } else {
            self.agrees("touches.flags");
        }
    }

    fn comparison(&mut self, name: &str) -> &mut Comparison {
        self.quantities.entry(name.to_owned()).or_default()
    }

    fn agrees(&mut self, name: &str) {
        let comparison = self.comparison(name);
        (comparison.compared, comparison.agreeing) = (comparison.compared + 1, comparison.agreeing + 1);
    }

    fn too_close(&mut self, name: &str) {
        self.comparison(name).too_close += 1;
    }

    fn fails(&mut self, name: &str, what: String) {
        self.comparison(name).compared += 1;
        self.failure.get_or_insert(what);
    }

    /// A quantity that is off by `error`, and may be by `bound`; `None`: too close to call.
    fn off(&mut self, name: &str, error: f64, bound: Option<f64>, shown: impl Fn() -> String) {
        let Some(bound) = bound else { return self.too_close(name) };
        let comparison = self.comparison(name);
        let share = if error == 0.0 { 0.0 } else { error / bound };
        comparison.worst_error = comparison.worst_error.max(error);
        comparison.worst_share = comparison.worst_share.max(share);
        if share <= 1.0 {
            self.agrees(name);
        } else {
            self.fails(name, format!("{name} is {}: off by {error:.3e}, bound {bound:.3e}", shown()));
        }
    }

    fn number(&mut self, name: &str, found: Option<f64>, right: Option<f64>, bound: Option<f64>) {
        match (found, right) {
            (None, None) => {}
            (Some(found), Some(right)) => {
                self.off(name, (found - right).abs(), bound, || format!("{found:?}, not {right:?}"));
            }
            _ if bound.is_none() => self.too_close(name),
            _ => self.fails(name, format!("{name} is {found:?}, not {right:?}")),
        }
    }

    fn place(&mut self, name: &str, found: DVec3, right: DVec3, bound: Option<f64>) {
        let bound = bound.map(|bound| bound + ROUNDING_M + 1e-14 * right.length());
        self.off(name, found.distance(right), bound, || format!("{found}, not {right}"));
    }

    /// A line without a direction.
    fn line(&mut self, name: &str, found: Option<DVec3>, right: Option<DVec3>, bound: Option<f64>) {
        match (found, right) {
            (None, None) => {}
            (Some(found), Some(right)) => {
                let between = found.cross(right).length().atan2(found.dot(right).abs());
                self.off(name, between, bound.map(|bound| bound + ANGLE_ROUNDING), || format!("{found}, not {right}"));
            }
            _ if bound.is_none() => self.too_close(name),
            _ => self.fails(name, format!("{name} is {found:?}, not {right:?}")),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::DAffine3;

    use super::*;
    use crate::touch::{Options, Reading, Skin, SkinParts, SkinTaxel};

    const BOUND: f64 = 1e-6;

    /// A sheet of 12 × 12 taxels, a centimetre apart.
    fn skin() -> Arc<Skin> {
        let mut parts = SkinParts { body_from_link: vec![DAffine3::IDENTITY], ..SkinParts::default() };
        for node in 0..144_u32 {
            let [x, y] = [node % 12, node / 12];
            let position = DVec3::new(f64::from(x), f64::from(y), 0.0) * 0.01;
            let reading = Reading { newton_at_one: 1e-4, ..Reading::default() };
            let [normal, mean_normal] = [DVec3::Z; 2];
            parts.taxels.push(SkinTaxel {
                id: node,
                link: 0,
                position,
                normal,
                mean_normal,
                cell_m2: 1e-4,
                area_m2: 1e-4,
                reading,
            });
            parts.edges.extend(
                [(x < 11, node + 1), (y < 11, node + 12)]
                    .iter()
                    .filter(|(is_one, _)| *is_one)
                    .map(|(_, to)| (node, *to)),
            );
        }
        Arc::new(Skin::from_parts(parts))
    }

    /// Pressures of two bumps; the second is `height` high.
    fn bumps(height: f64) -> Vec<f64> {
        let bump = |x: f64, y: f64, node: u32| {
            let [u, v] = [f64::from(node % 12), f64::from(node / 12)];
            (-((u - x).powi(2) / 2.2 + (v - y).powi(2) / 1.4)).exp()
        };
        let pressure = |node| 10.0 * bump(2.7, 3.1, node) + height * bump(8.4, 8.2, node);
        (0..144).map(|node| if pressure(node) > 0.1 { pressure(node) } else { 0.0 }).collect()
    }

    /// Compares the touches of three frames; `change` changes those of the last frame.
    fn compared(right: impl Fn(&mut [Pressure]), change: impl Fn(&mut TouchFrame)) -> Agreement {
        let (mut touches, mut check) = (Touches::new(skin(), Options::default()), TouchCheck::default());
        for index in 0..14_u32 {
            let pressures = bumps(8.0 + f64::from(index) * 0.1);
            let input = Input::new(0.02 * f64::from(index), &pressures[..]);
            let mut found = TouchFrame::default();
            let before = touches.state();
            touches.step(input, &mut found);
            let pressure = |&value: &f64| Pressure { value, bound: BOUND * value, ..Pressure::default() };
            let mut all: Vec<Pressure> = pressures.iter().map(pressure).collect();
            if index == 13 {
                right(&mut all);
                change(&mut found);
            }
            check.take(&all);
            check.compare((0, index.into()), &input, (&before, &touches), &found);
            check.end_of_run();
        }
        check.found()
    }

    #[test]
    fn what_is_right_agrees_and_what_is_off_by_more_than_its_bound_does_not() {
        let right = compared(|_| {}, |_| {});
        assert!(right.holds() && right.touches == 28 && right.quantities["touches.velocity"].compared == 8, "{right}");
        let within = compared(|_| {}, |found| found.touches[0].total *= 1.0 + 0.5 * BOUND);
        assert!(within.holds(), "{within}");
        type Change = fn(&mut Touch);
        let changes: [(&str, Change); 10] = [
            ("touches.total", |touch| touch.total *= 1.0 + 2.0 * BOUND),
            ("touches.force", |touch| touch.force_newton = touch.force_newton.map(|force| force * (1.0 + 2.0 * BOUND))),
            ("touches.force", |touch| touch.force_newton = None),
            ("touches.centre", |touch| touch.centre.x += 1e-10),
            ("touches.position", |touch| touch.position.x += 1e-6),
            ("touches.velocity", |touch| touch.velocity = touch.velocity.map(|velocity| velocity + 1e-5)),
            ("touches.anisotropy", |touch| touch.anisotropy = touch.anisotropy.map(|of| of + 1e-4)),
            ("touches.spread", |touch| touch.spread_m = touch.spread_m.map(|[a, b]| [a, b + 1e-5])),
            ("touches.principal_axis", |touch| touch.principal_axis = Some(DVec3::new(1.0, 1e-3, 0.0).normalize())),
            ("touches.flags", |touch| touch.flags |= TouchFlags::WRAPPED),
        ];
        for (name, change) in changes {
            let agreement = compared(|_| {}, |found| change(&mut found.touches[0]));
            assert!(!agreement.holds() && agreement.failures[0].contains("frame 13"), "{name}: {agreement}");
            let comparison = agreement.quantities[name];
            assert_eq!(comparison.compared - comparison.agreeing, 1, "{name}: {agreement}");
        }
        let other_id = compared(|_| {}, |found| found.touches[1].id = 7);
        assert!(!other_id.holds() && other_id.quantities["touches"].compared == 28, "{other_id}");
    }

    #[test]
    fn a_touch_that_is_not_there_or_not_found_is_a_disagreement() {
        let without = |all: &mut [Pressure]| all[72..].iter_mut().for_each(|pressure| pressure.value = 0.0);
        let agreement = compared(without, |_| {});
        assert!(!agreement.holds() && agreement.failures[0].contains("touch 2 is not one"), "{agreement}");
        let more = |all: &mut [Pressure]| all[11].value = 3.0;
        let agreement = compared(more, |_| {});
        assert!(!agreement.holds() && agreement.failures[0].contains("touch 3 is not found"), "{agreement}");
    }

    #[test]
    fn what_hangs_on_a_taxel_that_may_be_pressed_or_not_is_too_close_to_call() {
        // One at the border of the second touch.
        let unsure = |all: &mut [Pressure]| {
            let last = (0..144).rev().find(|&node| all[node].value > 0.0).unwrap();
            (all[last].in_doubt, all[last].value) = (true, 0.0);
        };
        let agreement = compared(unsure, |_| {});
        assert!(agreement.holds() && agreement.quantities["touches"].too_close == 1, "{agreement}");
        // The other one is compared all the same.
        let agreement = compared(unsure, |found| found.touches[0].total *= 1.1);
        assert!(!agreement.holds(), "{agreement}");
    }
}
