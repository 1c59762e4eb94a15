//! Contacts fitted to touches: [`crate::stage::fit`] over a batch.
//!
//! It starts from the raw values in double precision, whatever the backend: which taxels are one touch is the backend's to say,
//! and where a descent ends on a device of its own; what taxels feel, and what is made of an end, is the same on all.

use crate::backend::cpu::fit::{fit_each, judge_each};
use crate::backend::{Backend, RawBatch};
use crate::error::Result;
use crate::parallel;
use crate::percept::{Column, Fit, Flags, Host, Outputs, Percepts, Store};
use crate::scene::Plan;
use crate::stage::fit::{OVER_S, Taxel, Touch, Trail};
use crate::stage::touches::Found;

/// What makes the descents; without it the CPU, as for the reference.
pub(super) type On<'a> = Option<&'a mut (dyn Backend + 'static)>;

/// Cells whose touches one thread makes ready at a time: some microseconds of work.
const CELLS: usize = 32;

/// What is kept for fits, from frame to frame and until a batch is complete.
#[derive(Clone, Debug)]
pub(super) struct FitState {
    /// Touches of the frames at hand that are still to be fitted.
    pub(super) waiting: Vec<Waiting>,
    /// By field, where its contact was.
    trails: Vec<Trail>,
}

impl FitState {
    /// The state before the first frame.
    pub(super) fn initial(fields: usize) -> Self {
        Self { waiting: Vec::new(), trails: vec![Trail::default(); fields] }
    }
}

/// A cell whose touches wait to be fitted.
#[derive(Clone, Debug)]
pub(super) struct Waiting {
    field: usize,
    cell: usize,
    /// The frame in the raw batch.
    offset: usize,
    /// Of each of its touches the identity, and the members.
    touches: Vec<(u64, Vec<u32>)>,
}

/// A touch of a cell that can be fitted.
struct Ready {
    /// Its index among the cell's.
    index: usize,
    total: f64,
    touch: Touch,
}

/// Room for the taxels of a touch.
#[derive(Default)]
struct Room {
    near: Vec<u32>,
    is_near: Vec<bool>,
    taxels: Vec<Taxel>,
}

impl Waiting {
    /// The touches `found` in field `field`.
    pub(super) fn new((field, cell, offset): (usize, usize, usize), found: &[Found]) -> Self {
        let touches = found.iter().map(|touch| (touch.id, touch.members().collect())).collect();
        Self { field, cell, offset, touches }
    }

    /// Its touch with the most pressure as the fit takes it, with the members beside it, of those taxels that can be used.
    fn ready(&self, plan: &Plan, raw: &RawBatch<'_>, room: &mut Room) -> Vec<Ready> {
        let field = &plan.fields[self.field];
        let Ok(layer) = &field.layer else { return Vec::new() };
        let Room { near, is_near, taxels } = room;
        let mut ready = Vec::with_capacity(1);
        for (index, (_, members)) in self.touches.iter().enumerate() {
            near.clone_from(members);
            is_near.clear();
            is_near.resize(field.count, false);
            members.iter().for_each(|&member| is_near[member as usize] = true);
            let beside = members.iter().flat_map(|&member| &field.beside[member as usize]);
            near.extend(beside.filter(|&&beside| !std::mem::replace(&mut is_near[beside as usize], true)));
            near.sort_unstable();
            taxels.clear();
            taxels.extend(near.iter().filter_map(|&member| {
                let (member, slot) = (member as usize, plan.members_of(field)[member as usize].slot as usize);
                plan.pressed_taxel(field, member, raw.rows.value(self.offset, plan.channel_of(slot)))
            }));
            let total = taxels.iter().map(|taxel| taxel.pressure).sum();
            // The first of those that are equal.
            if total > 0.0 && ready.last().is_none_or(|strongest: &Ready| total > strongest.total) {
                ready.clear();
                ready.push(Ready { index, total, touch: Touch::new(taxels, layer) });
            }
        }
        ready
    }
}

/// Fits the touches that wait, and puts what comes of the one with the most pressure into its cell.
///
/// # Errors
/// The device does not answer.
pub(super) fn all(
    plan: &Plan,
    raw: &RawBatch<'_>,
    state: &mut FitState,
    percepts: &mut Percepts,
    on: On<'_>,
) -> Result<()> {
    if state.waiting.is_empty() {
        return Ok(());
    }
    let waiting = std::mem::take(&mut state.waiting);
    let mut ready: Vec<Vec<Ready>> = waiting.iter().map(|_| Vec::new()).collect();
    let cells = waiting.chunks(CELLS).zip(ready.chunks_mut(CELLS));
    parallel::for_each(parallel::threads().min(cells.len()), cells, |(waiting, ready)| {
        let mut room = Room::default();
        for (waiting, ready) in waiting.iter().zip(ready) {
            *ready = waiting.ready(plan, raw, &mut room);
        }
    });
    let touches: Vec<&Touch> = ready.iter().flatten().map(|ready| &ready.touch).collect();
    let mut fitted = fitted(&touches, on)?.into_iter();
    for (waiting, ready) in waiting.iter().zip(&ready) {
        let mut strongest: Option<(f64, usize, Option<Fit>, Flags)> = None;
        for (Ready { index, total, .. }, (fit, flags)) in ready.iter().zip(&mut fitted) {
            if strongest.is_none_or(|(most, ..)| *total > most) {
                strongest = Some((*total, *index, fit, flags));
            }
        }
        let Some((_, index, fit, flags)) = strongest else { continue };
        percepts.flags[waiting.cell] |= flags;
        if let Some(fit) = fit {
            put(plan, &fit, waiting.cell, percepts);
            if plan.outputs.intersects(Outputs::FIT_MOTION) {
                let (touch, _) = waiting.touches[index];
                put_motion(plan, (waiting, touch), &fit, &mut state.trails[waiting.field], percepts);
            }
        }
    }
    Ok(())
}

/// What each touch is fitted with, and why not: descents are those of the backend's own device, if it has one.
fn fitted(touches: &[&Touch], on: On<'_>) -> Result<Vec<(Option<Fit>, Flags)>> {
    let ends = match on {
        Some(backend) => backend.descend(touches)?,
        None => None,
    };
    Ok(match ends {
        Some(ends) => judge_each(touches, &ends, Touch::conclude),
        None => fit_each(touches, Touch::conclude),
    })
}

/// Puts the motion of a cell's touch since it was fitted before.
fn put_motion(plan: &Plan, (waiting, touch): (&Waiting, u64), fit: &Fit, trail: &mut Trail, percepts: &mut Percepts) {
    let (cell, over_s) = (waiting.cell, plan.fields[waiting.field].filter.over_s.unwrap_or(OVER_S));
    let t_s = percepts.t_s[cell / plan.fields.len()];
    match trail.follow(over_s, t_s, touch, fit) {
        Ok(moved) => {
            percepts.add_present(cell, plan.outputs & Outputs::FIT_MOTION);
            percepts.set_host(Host::FitDisplacement, cell, &moved.displacement.to_array());
            percepts.set_host(Host::FitSpeed, cell, &[moved.speed]);
        }
        Err(why) => percepts.flags[cell] |= why,
    }
}

fn put(plan: &Plan, fit: &Fit, cell: usize, percepts: &mut Percepts) {
    for column in (plan.outputs & Outputs::FIT).difference(Outputs::FIT_MOTION).columns() {
        let &Column { output, components: count, store: Store::Host(host), .. } = column else { continue };
        if let Some(components) = fit.components(host) {
            percepts.add_present(cell, output);
            percepts.set_host(host, cell, &components[..count]);
        }
    }
}
