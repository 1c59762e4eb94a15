//! What makes a run's percepts doubtful though it goes on: a source for another body, and sensors that rest pressed.

use somatic::{Body, Frame, Plan};

use super::words::count;

/// Fields of so many taxels and more tell whether sensors rest pressed; all of fewer may well be touched.
const MANY_TAXELS: usize = 4;
/// How long is looked at, s.
const LOOK_S: f64 = 1.0;

/// What a frame's values were so far.
#[derive(Clone, Copy, Default)]
struct Seen {
    /// Whether one was a number.
    came: bool,
    /// Whether one was no pressure.
    rested: bool,
}

/// Looks at the first second of a run, or at all of a shorter one, and says once what is doubtful in it.
pub(super) struct Doubts {
    source: String,
    body: String,
    taxels: usize,
    /// Per value of a frame, the index of its taxel in the body.
    taxel_of_value: Vec<usize>,
    /// Whether frames hold a taxel that never comes: those on standard input may hold any of the body's.
    holds_any: bool,
    /// Whether a taxel's pressure is its raw value.
    is_raw: bool,
    begin_s: Option<f64>,
    /// Whether that second is over.
    is_over: bool,
    seen: Vec<Seen>,
}

impl Doubts {
    /// For frames of the taxels `ids` of `body` from what is called `source`.
    pub(super) fn new(source: &str, body: &Body, ids: &[u32], holds_any: bool, is_raw: bool) -> Self {
        let index_of = |id: &u32| body.taxels.binary_search_by_key(id, |taxel| taxel.id).ok();
        Self {
            source: source.to_owned(),
            body: body.name.clone(),
            taxels: body.taxels.len(),
            taxel_of_value: ids.iter().filter_map(index_of).collect(),
            holds_any,
            is_raw,
            begin_s: None,
            is_over: false,
            seen: vec![Seen::default(); ids.len()],
        }
    }

    /// Before the first frame: whether the source has the taxels of the fields of `plan`.
    pub(super) fn of_taxels(&self, plan: &Plan) -> Option<String> {
        if self.holds_any { None } else { self.of_body(plan, |_| true) }
    }

    /// Looks at `frames`; whether the second is over.
    pub(super) fn see(&mut self, frames: &[Frame]) -> bool {
        for frame in frames {
            if self.is_over {
                break;
            }
            // Boards that do not speak yet begin nothing.
            if self.begin_s.is_none() && frame.values.iter().all(|value| value.is_missing()) {
                continue;
            }
            self.is_over = frame.t_s - *self.begin_s.get_or_insert(frame.t_s) > LOOK_S;
            for (seen, value) in self.seen.iter_mut().zip(&frame.values) {
                if let Some(value) = value.number() {
                    seen.came = true;
                    seen.rested |= value <= 0.0;
                }
            }
        }
        self.is_over
    }

    /// What is doubtful in what was seen.
    pub(super) fn of_frames(&self, plan: &Plan) -> Vec<String> {
        // A frame or two on standard input may well be of a few taxels alone.
        let of_body = (self.holds_any && self.is_over).then(|| self.of_body(plan, |seen| seen.came)).flatten();
        let rests = self.is_raw.then(|| self.of_rest(plan)).flatten();
        of_body.into_iter().chain(rests).collect()
    }

    /// Says so where over half of the taxels of a field never come.
    fn of_body(&self, plan: &Plan, comes: impl Fn(&Seen) -> bool) -> Option<String> {
        let there = self.where_in_body(comes);
        let lacks = |field: &usize| {
            let (here, all) = self.among(plan, *field, &there);
            2 * (all - here) > all
        };
        let fields = plan.fields().len();
        let lacking: Vec<usize> = (0..fields).filter(lacks).collect();
        let &first = lacking.first()?;
        let (here, all) = self.among(plan, first, &there);
        Some(format!(
            "{} has {} of the {} taxels of {}; {} of {} lack over half of theirs, such as {} ({here} of {all}); is it the \
             right body?",
            self.source,
            there.iter().filter(|there| **there).count(),
            self.taxels,
            self.body,
            lacking.len(),
            count(fields as u64, "field"),
            plan.label(first)
        ))
    }

    /// Says so where most fields are wholly pressed all the time.
    fn of_rest(&self, plan: &Plan) -> Option<String> {
        let pressed = self.where_in_body(|seen| seen.came && !seen.rested);
        let many: Vec<(usize, usize)> = (0..plan.fields().len())
            .map(|field| self.among(plan, field, &pressed))
            .filter(|(_, all)| *all >= MANY_TAXELS)
            .collect();
        let whole = many.iter().filter(|(pressed, all)| pressed == all).count();
        (2 * whole > many.len()).then(|| {
            format!(
                "{whole} of {} of {MANY_TAXELS} taxels and more are wholly pressed from the start on; do readings fall \
                 when pressed, or rest above 0? Set `invert` or `baseline` in a calibration (somatic calibrate)",
                count(many.len() as u64, "field")
            )
        })
    }

    /// Per taxel of the body, whether it has a value of which `is` holds.
    fn where_in_body(&self, is: impl Fn(&Seen) -> bool) -> Vec<bool> {
        let mut there = vec![false; self.taxels];
        for (&taxel, seen) in self.taxel_of_value.iter().zip(&self.seen) {
            there[taxel] = is(seen);
        }
        there
    }

    /// How many of the taxels of a field are `among`, and how many it has.
    fn among(&self, plan: &Plan, field: usize, among: &[bool]) -> (usize, usize) {
        plan.taxels_of(field).fold((0, 0), |(here, all), taxel| (here + usize::from(among[taxel]), all + 1))
    }
}
