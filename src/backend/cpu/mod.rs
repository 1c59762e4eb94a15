//! Backend `cpu`: single precision, sixteen cells abreast, all cores, with the widest instructions of the machine.
//!
//! A batch has sixteen frames of a field abreast ([`batch`]), a single frame sixteen fields ([`live`]); what is computed
//! is written once ([`touch`] and the stages). Every lane does the operations of its cell in one fixed order, never
//! fused, so that percepts have the same bits however a recording is cut and whatever instructions there are.

mod angle;
mod axis;
mod batch;
mod calibrate;
mod centroid;
mod change;
mod columns;
mod compensated;
mod contact;
mod gate;
mod groups;
mod hysteresis;
mod in_view;
mod lines;
mod live;
mod lot;
mod motion;
mod orientation;
mod pick;
mod put;
mod rest;
#[cfg(feature = "gpu")]
pub(super) mod side_by_side;
mod simd;
mod sixteen;
#[cfg(test)]
mod tests;
mod touch;
mod transpose;
mod wide;
mod window;

use std::sync::{Arc, Mutex, PoisonError};

pub(crate) use fearless_simd::Level;

use self::simd::LANES;
pub(crate) use self::simd::with_widest;
use super::{Backend, RawBatch, Rows, Step};
use crate::error::Result;
use crate::parallel;
use crate::percept::{CellsMut, Percepts};
use crate::scene::Plan;
use crate::signal::RawValue;
use crate::stage::layout::Member;

/// Memberships that one task takes at least, if it can: some ten microseconds.
const TASK: usize = 1 << 14;

/// The backend, with the memory it needs from frame to frame.
pub(crate) struct Cpu {
    plan: Plan,
    tables: Tables,
    level: Level,
    live: live::Live,
    /// What tasks work in, one for each that runs.
    scratches: Mutex<Vec<batch::Scratch>>,
    /// The raw values of the frame before, where the plan has changes.
    before: Vec<RawValue>,
    /// Per field, whether the frame before was in contact.
    touched: Vec<bool>,
    /// The frame before, as motion looks at it.
    last: motion::Before,
}

/// The plan as lanes read it.
struct Tables {
    tiles: calibrate::Tiles,
    window: window::Window,
    /// The plan's members, each with its slot's place in the window.
    seen: Arc<[Member]>,
    /// By field.
    briefs: Vec<batch::Brief>,
    rest: rest::Rest,
    motion: motion::Fields,
    /// The members of the fields that have many.
    wide: Vec<wide::Table>,
}

impl Cpu {
    pub(crate) fn new(plan: &Plan) -> Self {
        Self::with_level(plan, Level::new())
    }

    /// With the instructions of `level`.
    fn with_level(plan: &Plan, level: Level) -> Self {
        let wide = plan.fields.iter().filter(|field| field.is_wide()).map(|field| {
            let members = plan.members_of(field).iter().zip(&field.depths);
            wide::Table::new(members.map(|(member, &depth)| {
                let area = plan.taxels[member.slot as usize].area;
                (member.slot, [member.weight, member.u, member.v, depth, area])
            }))
        });
        let window = window::Window::new(plan);
        let seen = window.members(plan);
        Self {
            tables: Tables {
                briefs: batch::Brief::all(plan),
                rest: rest::Rest::new(&plan.fields, &seen),
                motion: motion::Fields::new(plan),
                seen,
                window,
                tiles: calibrate::Tiles::new(plan),
                wide: wide.collect(),
            },
            level,
            live: live::Live::new(plan),
            scratches: Mutex::new(Vec::new()),
            before: vec![RawValue::MISSING; plan.channels()],
            touched: vec![false; plan.fields.len()],
            last: motion::Before::none(plan.fields.len()),
            plan: plan.clone(),
        }
    }

    /// Runs a batch on all threads, this one among them: each takes a part of what is left, ever smaller ones, so that none
    /// waits long for the others and frames that follow each other mostly stay together.
    fn batch(&self, raw: &RawBatch<'_>, cells: CellsMut<'_>) {
        let least = (TASK / self.plan.memberships().max(1)).max(1).next_multiple_of(LANES);
        let threads = parallel::threads().min(cells.frames().div_ceil(least));
        let rest = Mutex::new((0, Some(cells)));
        let take = || {
            let (first, rest) = &mut *rest.lock().unwrap_or_else(PoisonError::into_inner);
            let cells = rest.take().filter(|cells| cells.frames() > 0)?;
            let frames = (cells.frames() / (2 * threads)).max(least).next_multiple_of(LANES).min(cells.frames());
            let (part, later) = cells.split_at(frames);
            *rest = Some(later);
            *first += frames;
            Some((*first - frames, part))
        };
        let work = || {
            while let Some((first, part)) = take() {
                self.part(raw, first, part);
            }
        };
        parallel::on_threads(threads, work);
    }

    /// Runs the frames from `first` on, sixteen after the other.
    fn part(&self, raw: &RawBatch<'_>, first: usize, cells: CellsMut<'_>) {
        let frames = cells.frames();
        let free = self.scratches.lock().unwrap_or_else(PoisonError::into_inner).pop();
        let mut scratch = free.unwrap_or_else(|| batch::Scratch::new(&self.plan, &self.tables));
        let (mut rest, mut done) = (cells, 0);
        while done < frames {
            let (mut cells, later) = rest.split_at(LANES.min(frames - done));
            let job =
                batch::Job { raw, first: first + done, before: the_one_before(raw.rows, first + done, &self.before) };
            for stretch in self.tables.window.stretches() {
                batch::stretch(self.level, &self.plan, &self.tables, &job, stretch, &mut scratch, &mut cells);
            }
            (rest, done) = (later, done + LANES);
        }
        self.scratches.lock().unwrap_or_else(PoisonError::into_inner).push(scratch);
    }
}

/// Where the frame before frame `frame` of `rows` is; `before` has the one before the first.
fn the_one_before<'a>(rows: Rows<'a>, frame: usize, before: &'a [RawValue]) -> (Rows<'a>, usize) {
    match frame.checked_sub(1) {
        Some(last) => (rows, last),
        None => (Rows::Packed { values: before, channels: before.len() }, 0),
    }
}

/// A frame, the one before it, and the time between them.
struct Moment<'a> {
    now: (Rows<'a>, usize),
    before: (Rows<'a>, usize),
    step: &'a Step,
}

impl<'a> Moment<'a> {
    /// Frame `frame` of `raw`; `before` has the values of the frame before the first.
    fn new(raw: &RawBatch<'a>, frame: usize, before: &'a [RawValue]) -> Self {
        Self { now: (raw.rows, frame), before: the_one_before(raw.rows, frame, before), step: &raw.steps[frame] }
    }
}

/// What `level` is called.
fn instructions(level: Level) -> &'static str {
    let name = format!("{level:?}");
    let known = [("Avx512", "AVX-512"), ("Avx2", "AVX2"), ("Sse", "SSE"), ("Neon", "NEON"), ("Wasm", "SIMD128")];
    known.into_iter().find(|(start, _)| name.starts_with(start)).map_or("scalar code", |(_, name)| name)
}

/// How this machine's processor is used.
pub(crate) fn describe() -> String {
    describe_with(Level::new())
}

fn describe_with(level: Level) -> String {
    format!("single precision, {}, {} threads", instructions(level), parallel::threads())
}

impl Backend for Cpu {
    fn name(&self) -> &'static str {
        "cpu"
    }

    fn describe(&self) -> String {
        describe_with(self.level)
    }

    fn restart(&mut self) {
        self.touched.fill(false);
        self.last = motion::Before::none(self.plan.fields.len());
    }

    fn recalibrate(&mut self, plan: &Plan) {
        self.plan.recalibrate(plan);
        self.tables.tiles = calibrate::Tiles::new(plan);
        self.live.forget();
    }

    fn run(&mut self, raw: &RawBatch<'_>, percepts: &mut Percepts) -> Result<()> {
        let Some(all) = percepts.cells_f32() else { unreachable!("the engine made percepts of this precision") };
        let mut cells = if raw.first == 0 && raw.frames == all.frames() {
            all
        } else {
            all.split_at(raw.first).1.split_at(raw.frames).0
        };
        if raw.frames < LANES {
            let mut rest = cells.reborrow();
            for frame in 0..raw.frames {
                let (mut first, later) = rest.split_at(1);
                let moment = Moment::new(raw, frame, &self.before);
                self.live.frame(self.level, &self.plan, &self.tables, &moment, &mut first);
                rest = later;
            }
        } else {
            self.batch(raw, cells.reborrow());
        }
        if self.plan.has_changes() && raw.frames > 0 {
            self.before.clear();
            self.before.extend(raw.rows.row(raw.frames - 1));
        }
        // What hangs on the frame before goes through the frames in order.
        let stages = self.plan.stages();
        if stages.hysteresis {
            hysteresis::scan(&self.plan, raw.frames, &mut cells, &mut self.touched);
        }
        if stages.motion {
            let fields = &self.tables.motion;
            motion::all_frames(self.level, self.plan.outputs, fields, raw.steps, cells, &mut self.last);
        }
        Ok(())
    }
}
