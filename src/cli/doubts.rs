//! Warnings in the first second of a run: a source for another body, sensors that are pressed at rest, or links that are nowhere.

use somatic::internal::signal::{Axis, Channel};
use somatic::{Body, Frame, Outputs, Plan, Receptor};

use super::words::count;

/// Fields with fewer taxels may be touched as a whole and are not checked.
const MIN_FIELD_TAXELS: usize = 4;
/// Length of the check, s.
const CHECK_TIME_S: f64 = 1.0;

/// What a taxel delivered so far.
#[derive(Clone, Copy, Default)]
struct ValueHistory {
    /// Whether any value was a number.
    came: bool,
    /// Whether any value was at or below 0.
    rested: bool,
}

/// Checks the first second of a run, or all of a shorter one.
pub(super) struct Doubts {
    source: String,
    body: String,
    /// The ids of the body's taxels.
    ids: Vec<u32>,
    /// Per value of a frame, the index of its taxel in the body; `None` of a tangential one.
    taxel_of_value: Vec<Option<usize>>,
    /// Per value of a frame, the index of the taxel whose tangential value it is.
    pulled_of_value: Vec<Option<usize>>,
    /// Whether frames have a slot for every taxel of the body, as on standard input.
    holds_any: bool,
    /// Whether a taxel's pressure is its raw value.
    is_raw: bool,
    begin_s: Option<f64>,
    is_over: bool,
    seen: Vec<ValueHistory>,
    /// Whether any frame said where links are, or that this is not known for now.
    has_poses: bool,
    /// Whether what is doubtful in the frames has been told.
    is_told: bool,
    /// What is still to be told of recordings that have ended.
    held: Vec<String>,
}

impl Doubts {
    /// For frames of the taxels `ids` of `body` from the source named `source`.
    pub(super) fn new(source: &str, body: &Body, ids: &[u32], holds_any: bool, is_raw: bool) -> Self {
        let of_body: Vec<u32> = body.taxels.iter().map(|taxel| taxel.id).collect();
        Self {
            source: source.to_owned(),
            body: body.name.clone(),
            taxel_of_value: indices(ids, &of_body),
            pulled_of_value: pulled(ids, &of_body),
            ids: of_body,
            holds_any,
            is_raw,
            begin_s: None,
            is_over: false,
            seen: vec![ValueHistory::default(); ids.len()],
            has_poses: false,
            is_told: false,
            held: Vec::new(),
        }
    }

    /// Begins anew, for frames of the taxels `ids` of another recording, named `source`, whose fields are those of `plan`, too. Returns
    /// what is to be told of the one before, and of these taxels.
    pub(super) fn restart(&mut self, source: &str, ids: &[u32], plan: &Plan) -> Vec<String> {
        let mut told = self.told(plan);
        source.clone_into(&mut self.source);
        self.taxel_of_value = indices(ids, &self.ids);
        self.pulled_of_value = pulled(ids, &self.ids);
        self.seen = vec![ValueHistory::default(); ids.len()];
        (self.begin_s, self.is_over, self.has_poses, self.is_told) = (None, false, false, false);
        told.extend(self.of_taxels(plan));
        told
    }

    /// Keeps lines until [`Doubts::told`].
    pub(super) fn hold(&mut self, lines: Vec<String>) {
        self.held.extend(lines);
    }

    /// Before the first frame: a warning if the source lacks taxels of the fields of `plan`.
    pub(super) fn of_taxels(&self, plan: &Plan) -> Option<String> {
        if self.holds_any { None } else { self.of_body(plan, |_| true).or_else(|| self.of_axes(plan, |_| true)) }
    }

    /// Checks `frames`; returns whether the check is over.
    pub(super) fn see(&mut self, frames: &[Frame]) -> bool {
        for frame in frames {
            if self.is_over {
                break;
            }
            self.has_poses |= !frame.pose.is_empty() || frame.has_stale_pose;
            // The check starts with the first value.
            if self.begin_s.is_none() && frame.values.iter().all(|value| value.is_missing()) {
                continue;
            }
            self.is_over = frame.t_s - *self.begin_s.get_or_insert(frame.t_s) > CHECK_TIME_S;
            for (seen, value) in self.seen.iter_mut().zip(&frame.values) {
                if let Some(value) = value.number() {
                    seen.came = true;
                    seen.rested |= value <= 0.0;
                }
            }
        }
        self.is_over
    }

    /// What is doubtful in the frames so far, once.
    pub(super) fn told(&mut self, plan: &Plan) -> Vec<String> {
        let mut told = std::mem::take(&mut self.held);
        if !std::mem::replace(&mut self.is_told, true) {
            told.extend(self.of_frames(plan));
        }
        told
    }

    fn of_frames(&self, plan: &Plan) -> Vec<String> {
        // Single frames on standard input may have few taxels.
        let came = |seen: &ValueHistory| seen.came;
        let is_told = !(self.holds_any && self.is_over);
        let of_body = if is_told { None } else { self.of_body(plan, came).or_else(|| self.of_axes(plan, came)) };
        let rests = self.is_raw.then(|| self.of_rest(plan)).flatten();
        of_body.into_iter().chain(rests).chain(self.of_poses(plan)).collect()
    }

    /// A warning if something is asked for that needs to know where links are, which no frame says.
    fn of_poses(&self, plan: &Plan) -> Option<String> {
        let asked = plan.outputs();
        let what = [
            (asked.contains(Outputs::SELF_CONTACTS), "self_contacts"),
            (asked.contains(Outputs::SPEED_IN_WORLD), "speed_in_world"),
            (plan.relative_to().is_some(), "--relative-to"),
        ];
        let needs: Vec<&str> = what.into_iter().filter_map(|(is_asked, what)| is_asked.then_some(what)).collect();
        (!self.has_poses && self.begin_s.is_some() && !needs.is_empty()).then(|| {
            format!(
                "{}: no frame says where links are, as {} needs; give the robot's --joints, or frames with `pose`",
                self.source,
                needs.join(", ")
            )
        })
    }

    /// A warning if over half of the taxels of a field never deliver a value.
    fn of_body(&self, plan: &Plan, comes: impl Fn(&ValueHistory) -> bool) -> Option<String> {
        let there = self.where_in_body(comes);
        let lacks = |field: &usize| {
            let (here, all) = self.among(plan, *field, &there);
            2 * (all - here) > all
        };
        let fields = plan.fields().len();
        let lacking: Vec<usize> = (0..fields).filter(lacks).collect();
        let &first = lacking.first()?;
        let (here, all) = self.among(plan, first, &there);
        let are_several = [" boards", " limbs"].iter().any(|several| self.source.ends_with(several));
        Some(format!(
            "{} {} {} of the {} taxels of {}; {} of {} lack over half of theirs, such as {} ({here} of {all}); {}is it \
             the right body?",
            self.source,
            if are_several { "have" } else { "has" },
            there.iter().filter(|there| **there).count(),
            self.ids.len(),
            self.body,
            lacking.len(),
            count(fields as u64, "field"),
            plan.label(first),
            if are_several { "are these all, and " } else { "" }
        ))
    }

    /// A warning if over half of the taxels with three axes of a field of letter `shear` never deliver both tangential values.
    fn of_axes(&self, plan: &Plan, comes: impl Fn(&ValueHistory) -> bool) -> Option<String> {
        let mut axes = vec![0; self.ids.len()];
        for (taxel, seen) in self.pulled_of_value.iter().zip(&self.seen) {
            if let Some(taxel) = taxel.filter(|_| comes(seen)) {
                axes[taxel] += 1;
            }
        }
        let there: Vec<bool> = axes.iter().map(|&axes| axes == 2).collect();
        let is_of_shear = |field: &usize| plan.letters()[plan.letter_of(*field)].receptor == Receptor::Shear;
        let field = (0..plan.fields().len()).filter(is_of_shear).find(|&field| {
            let (here, all) = self.among(plan, field, &there);
            2 * (all - here) > all
        })?;
        let (here, all) = self.among(plan, field, &there);
        let first = plan.taxels_of(field).next().map_or(0, |taxel| self.ids[taxel]);
        Some(format!(
            "{} has both tangential values, such as `{first}.u` and `{first}.v`, of {here} of the {all} taxels of {}; without them there is no \
             shear or friction, and fields are incomplete; add them, or leave that letter out with --letters",
            self.source,
            plan.label(field),
        ))
    }

    /// A warning if all taxels of most fields of pressures are pressed all the time.
    fn of_rest(&self, plan: &Plan) -> Option<String> {
        let pressed = self.where_in_body(|seen| seen.came && !seen.rested);
        let is_pressed = |field: &usize| plan.letters()[plan.letter_of(*field)].receptor.is_of_pressure();
        let many: Vec<(usize, usize)> = (0..plan.fields().len())
            .filter(is_pressed)
            .map(|field| self.among(plan, field, &pressed))
            .filter(|(_, all)| *all >= MIN_FIELD_TAXELS)
            .collect();
        let whole = many.iter().filter(|(pressed, all)| pressed == all).count();
        (2 * whole > many.len()).then(|| {
            format!(
                "{whole} of {} of {MIN_FIELD_TAXELS} taxels and more are wholly pressed from the start on; do readings fall \
                 when pressed, or rest above 0? Set `invert` or `baseline` in a calibration (somatic calibrate)",
                count(many.len() as u64, "field")
            )
        })
    }

    /// Per taxel of the body, whether it has a value that satisfies `is`.
    fn where_in_body(&self, is: impl Fn(&ValueHistory) -> bool) -> Vec<bool> {
        let mut there = vec![false; self.ids.len()];
        for (&taxel, seen) in self.taxel_of_value.iter().zip(&self.seen) {
            if let Some(taxel) = taxel {
                there[taxel] = is(seen);
            }
        }
        there
    }

    /// How many taxels of a field are in `among`, and how many it has.
    fn among(&self, plan: &Plan, field: usize, among: &[bool]) -> (usize, usize) {
        plan.taxels_of(field).fold((0, 0), |(here, all), taxel| (here + usize::from(among[taxel]), all + 1))
    }
}

/// Per channel of `ids`, the place of its taxel among those of the body, if that is its own value.
fn indices(ids: &[u32], of_body: &[u32]) -> Vec<Option<usize>> {
    ids.iter().map(|id| of_body.binary_search(id).ok()).collect()
}

/// Per channel of `ids`, the place of its taxel among those of the body, if that is one of its tangential values.
fn pulled(ids: &[u32], of_body: &[u32]) -> Vec<Option<usize>> {
    let is_tangential = |channel: &Channel| channel.axis() != Axis::Normal;
    let taxel = |&id: &u32| of_body.binary_search(&Some(Channel(id)).filter(is_tangential)?.taxel()).ok();
    ids.iter().map(taxel).collect()
}
