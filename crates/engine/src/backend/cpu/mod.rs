//! Backend `cpu`: single precision, sixteen cells abreast, all cores, with the widest instructions of the machine.
//!
//! A batch has sixteen frames of a field abreast ([`recording`]), a single frame sixteen fields ([`live`]); what is computed
//! is written once ([`pipeline`] and the stages). Every lane does the operations of its cell in one fixed order, never
//! fused, so that percepts have the same bits however a recording is cut and whatever instructions there are.

mod calibrate;
mod change;
mod contact;
pub(crate) mod fit;
mod gate;
mod hysteresis;
mod lanes;
mod live;
mod members;
mod motion;
mod orientation;
mod pipeline;
mod principal_axis;
#[cfg_attr(not(any(feature = "gpu", test)), expect(dead_code, reason = "the GPU's frames go up side by side"))]
pub(super) mod read;
mod recording;
#[cfg(test)]
mod tests;
mod wide;
mod window;
mod write;

pub(crate) use fearless_simd::Level;

use self::lanes::LANES;
pub(crate) use self::lanes::with_widest;
use super::{Backend, BackendState, FieldState, RawBatch};
use crate::error::Result;
use crate::parallel;
use crate::percept::{CellsMut, Percepts};
use crate::scene::Plan;
use crate::signal::RawValue;

/// The backend, with the memory it needs from frame to frame.
pub(crate) struct Cpu {
    plan: Plan,
    level: Level,
    tiles: calibrate::Tiles,
    live: live::Live,
    recording: recording::Recording,
    motion: motion::Fields,
    /// The raw values of the frame before, where the plan has changes.
    before: Vec<RawValue>,
    /// Per field, whether the frame before was in contact.
    touched: Vec<bool>,
    /// The frame before, as motion looks at it.
    last: motion::Before,
}

impl Cpu {
    pub(crate) fn new(plan: &Plan) -> Self {
        Self::with_level(plan, Level::new())
    }

    fn with_level(plan: &Plan, level: Level) -> Self {
        Self {
            level,
            tiles: calibrate::Tiles::new(plan),
            live: live::Live::new(plan),
            recording: recording::Recording::new(plan),
            motion: motion::Fields::new(plan),
            before: vec![RawValue::MISSING; plan.channels()],
            touched: vec![false; plan.fields.len()],
            last: motion::Before::new(plan.fields.iter().map(|_| None)),
            plan: plan.clone(),
        }
    }
}

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

    fn state(&mut self) -> Result<BackendState> {
        let centroids = self.last.centroids().zip(&self.touched);
        let fields = centroids.map(|(centroid, &touched)| {
            let centroid = centroid.filter(|_| self.plan.stages().motion);
            FieldState { contact: touched || centroid.is_some(), centroid }
        });
        Ok(BackendState { raw: self.before.clone(), fields: fields.collect() })
    }

    fn restore(&mut self, state: &BackendState) -> Result<()> {
        self.before.clone_from(&state.raw);
        self.touched = state.fields.iter().map(|field| field.contact).collect();
        self.last = motion::Before::new(state.fields.iter().map(|field| field.centroid));
        self.live.forget();
        Ok(())
    }

    fn recalibrate(&mut self, plan: &Plan) {
        self.plan.recalibrate(plan);
        self.tiles = calibrate::Tiles::new(plan);
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
            let mut frame = |frame: usize, cells: &mut CellsMut<'_>| {
                let moment = live::Moment::new(raw, frame, &self.before);
                self.live.frame(self.level, &self.plan, &self.tiles, &moment, cells);
            };
            if raw.frames == 1 {
                frame(0, &mut cells);
            } else {
                let mut rest = cells.reborrow();
                for index in 0..raw.frames {
                    let (mut first, later) = rest.split_at(1);
                    frame(index, &mut first);
                    rest = later;
                }
            }
        } else {
            let Self { level, plan, tiles, before, .. } = self;
            let call = recording::Call { level: *level, plan, tiles, raw, before };
            self.recording.run(call, cells.reborrow());
        }
        if self.plan.has_changes() && raw.frames > 0 {
            self.before.clear();
            self.before.extend(raw.rows.row(raw.frames - 1));
        }
        // What depends on the frame before goes through the frames in order.
        let stages = self.plan.stages();
        if stages.hysteresis {
            hysteresis::scan(&self.plan, raw.frames, &mut cells, &mut self.touched);
        }
        if stages.motion {
            let fields = &self.motion;
            motion::all_frames(self.level, self.plan.outputs, fields, raw.steps, cells, &mut self.last);
        }
        Ok(())
    }
}
