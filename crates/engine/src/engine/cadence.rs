//! Cadence `on-change`: a field none of whose values has changed keeps its percept, motion too.
//!
//! A source that repeats values until its sensors have new ones would otherwise tell of touches that stand still, and then
//! leap. What is measured from frame to frame is measured from change to change instead. Coverage `touched` leaves out work
//! and changes no bit; this changes what motion says.

use crate::backend::bounds::CellBound;
use crate::backend::{RawBatch, Step};
use crate::percept::{Flags, Outputs, Percepts};
use crate::scene::Plan;
use crate::signal::{Frame, FrameTime, RawValue};
use crate::stage::motion::SHORTEST_STEP_S;

/// Which fields' values changed in each frame.
pub(super) struct OnChange {
    fields: usize,
    /// By channel, where its fields begin in `readers`, and one beyond the last.
    starts: Vec<usize>,
    readers: Vec<usize>,
    max_gap_s: f64,
    pub(super) state: ChangeState,
    /// By frame and field, of the frames looked at last: the time since the change before, for a field that has changed.
    cells: Vec<Option<Step>>,
}

/// What is kept from frame to frame.
#[derive(Clone, Debug)]
pub(super) struct ChangeState {
    /// The frame before, by channel; empty where there is none that counts.
    before: Vec<RawValue>,
    /// Per field, when it last changed.
    changed_at: Vec<Option<FrameTime>>,
}

impl OnChange {
    pub(super) fn new(plan: &Plan, max_gap_s: f64) -> Self {
        let mut of_channel = vec![Vec::new(); plan.channels()];
        for (index, field) in plan.fields.iter().enumerate() {
            for member in plan.members_of(field) {
                let readers: &mut Vec<usize> = &mut of_channel[plan.channel_of(member.slot as usize)];
                if readers.last() != Some(&index) {
                    readers.push(index);
                }
            }
        }
        let mut starts = vec![0];
        starts.extend(of_channel.iter().scan(0, |end, readers| {
            *end += readers.len();
            Some(*end)
        }));
        Self {
            fields: plan.fields.len(),
            starts,
            readers: of_channel.concat(),
            max_gap_s,
            state: ChangeState { before: Vec::new(), changed_at: vec![None; plan.fields.len()] },
            cells: Vec::new(),
        }
    }

    /// Takes all fields for changed in the next frame, as when values mean something else from then on.
    pub(super) fn forget(&mut self) {
        self.state.before.clear();
    }

    pub(super) fn look(&mut self, raw: &RawBatch<'_>, frames: &[Frame]) {
        let ChangeState { before, changed_at } = &mut self.state;
        self.cells.clear();
        self.cells.resize(raw.frames * self.fields, None);
        for (index, frame) in frames.iter().enumerate() {
            let cells = &mut self.cells[index * self.fields..][..self.fields];
            let mut changed = |field: usize| {
                cells[field].get_or_insert_with(|| {
                    let since = step(changed_at[field], frame.time(), self.max_gap_s);
                    changed_at[field] = Some(frame.time());
                    since
                });
            };
            // Nothing is kept over a restart of time.
            if raw.steps[index].restarts() {
                before.clear();
            }
            if before.is_empty() {
                (0..self.fields).for_each(&mut changed);
                before.extend(raw.rows.row(index));
                continue;
            }
            for (channel, (before, now)) in before.iter_mut().zip(raw.rows.row(index)).enumerate() {
                if before.to_bits() != now.to_bits() {
                    *before = now;
                    self.readers[self.starts[channel]..self.starts[channel + 1]].iter().copied().for_each(&mut changed);
                }
            }
        }
    }

    /// The time since the change before, if field `field` has changed in frame `frame` of those looked at last.
    pub(super) fn since(&self, frame: usize, field: usize) -> Option<&Step> {
        self.cells[frame * self.fields + field].as_ref()
    }

    /// Gives `bounds`, which are those of frames looked at last, what kept percepts and their rates need; `last` are those
    /// of the frame before, and become those of the last one.
    pub(super) fn bounds(&self, bounds: &mut [CellBound], steps: &[Step], last: &mut Vec<CellBound>) {
        for cell in 0..bounds.len() {
            let (frame, field) = (cell / self.fields, cell % self.fields);
            match self.cells[cell] {
                None if frame > 0 => bounds[cell] = bounds[cell - self.fields],
                None => bounds[cell] = last.get(field).copied().unwrap_or(bounds[cell]),
                Some(since) => {
                    let Some(times) = times(&steps[frame], &since) else { continue };
                    let bound = &mut bounds[cell];
                    // One rounding more, where a rate's bound has six.
                    for rate in [Outputs::SPEED, Outputs::RADIAL_SPEED] {
                        bound.set([(rate, bound.limit(rate).map(|limit| limit * (times * 7.0 / 6.0)))]);
                    }
                }
            }
        }
        last.clear();
        last.extend_from_slice(&bounds[bounds.len() - self.fields..]);
    }
}

/// By how much a rate over `step` is to be multiplied to be one over `since`; `None` where it stays.
fn times(step: &Step, since: &Step) -> Option<f64> {
    (step.flags.is_empty() && since.flags.is_empty() && step.dt_s != since.dt_s).then(|| step.dt_s / since.dt_s)
}

/// Makes a cell's rates those over the time `since` its field's last change, where they are over `step`.
pub(super) fn rates(percepts: &mut Percepts, cell: usize, step: &Step, since: &Step) {
    let moved = percepts.present(cell).intersects(Outputs::MOTION);
    if moved && step.flags.is_empty() && !since.flags.is_empty() {
        percepts.remove_present(cell, Outputs::MOTION);
        percepts.flags[cell] = (percepts.flags[cell] - Flags::STILL) | since.flags;
    } else if let Some(times) = times(step, since).filter(|_| moved) {
        percepts.scale_speeds(cell, times);
    }
}

/// The time from the frame at `last` to the one at `now`, and whether motion can be measured over it.
pub(super) fn step(last: Option<FrameTime>, now: FrameTime, max_gap_s: f64) -> Step {
    let Some(last) = last else { return Step { dt_s: 0.0, flags: Flags::NO_PREVIOUS } };
    let dt_s = now.since(last);
    // A step too short for single precision is none.
    let usable = dt_s > SHORTEST_STEP_S && dt_s <= max_gap_s;
    Step { dt_s, flags: if usable { Flags::empty() } else { Flags::BAD_DT } }
}
