//! Backends: three ways to run a plan, all with the same percepts.

pub(crate) mod agreement;
pub(crate) mod bounds;
pub(crate) mod cpu;
#[cfg(feature = "gpu")]
pub mod gpu;
pub(crate) mod reference;

use std::ops::Range;
use std::str::FromStr;
use std::time::{Duration, Instant};

use crate::error::{Error, Result};
use crate::percept::{Flags, Percepts, Precision};
use crate::scene::{Arithmetic, Plan};
use crate::signal::{Frame, RawValue};

/// How backend `cpu` computes on this machine, in words: its arithmetic, instructions and threads.
#[must_use]
pub fn processor() -> String {
    cpu::describe()
}

/// Which backend is asked for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BackendKind {
    /// The fastest of `cpu` and `gpu` on this plan and machine, by a measurement; `cpu` where the GPU is software on it.
    #[default]
    Auto,
    /// Double precision, as the equations read.
    Reference,
    /// Single precision on the CPU's cores.
    Cpu,
    /// WGSL compute shaders.
    Gpu,
}

impl BackendKind {
    /// The arithmetic that its percepts are made with.
    #[must_use]
    pub fn precision(self) -> Precision {
        if self == Self::Reference { Precision::F64 } else { Precision::F32 }
    }
}

impl FromStr for BackendKind {
    type Err = Error;

    fn from_str(name: &str) -> Result<Self> {
        match name {
            "auto" => Ok(Self::Auto),
            "reference" => Ok(Self::Reference),
            "cpu" => Ok(Self::Cpu),
            "gpu" => Ok(Self::Gpu),
            _ => Err(Error::usage(format!("there is no backend `{name}`; choose auto, reference, cpu or gpu"))),
        }
    }
}

impl BackendKind {
    /// The backend that computes for `self` with `arithmetic`: where it is double, the reference.
    ///
    /// # Errors
    /// The backend has no such arithmetic.
    pub(crate) fn with(self, arithmetic: Option<Arithmetic>) -> Result<Self> {
        match (self, arithmetic) {
            (Self::Gpu, Some(Arithmetic::Double)) => {
                Err(Error::usage("shaders have no double precision: take backend cpu, or arithmetic compensated"))
            }
            (_, Some(Arithmetic::Double)) => Ok(Self::Reference),
            (Self::Reference, Some(arithmetic)) => Err(Error::usage(format!(
                "the reference is always in double precision: take backend cpu or gpu for arithmetic {arithmetic}"
            ))),
            _ => Ok(self),
        }
    }
}

/// A batch of raw values, frame by frame.
#[derive(Clone, Copy)]
pub(crate) struct RawBatch<'a> {
    /// Where its first frame stands in the percepts.
    pub(crate) first: usize,
    pub(crate) frames: usize,
    pub(crate) rows: Rows<'a>,
    /// Per frame, the time since the one before.
    pub(crate) steps: &'a [Step],
}

/// Tiles of sixteen values that are looked at together.
pub(crate) const BLOCK: usize = 16;

/// Where in a frame a plan finds its values.
#[derive(Clone, Debug)]
pub(crate) struct Picks {
    /// Per slot that is calibrated, which are the channels once for every signal.
    pub(crate) places: Vec<u32>,
    pub(crate) channels: usize,
    /// Per sixteen slots.
    pub(crate) near: Vec<Near>,
    /// Per [`BLOCK`] tiles of sixteen whose values lie one after the other: where they start.
    pub(crate) blocks: Vec<Option<usize>>,
    /// What [`Near::Shuffled`] refers to.
    pub(crate) shuffles: Vec<Shuffle>,
}

/// Where up to sixteen values lie among 32 of a frame. A skin has many, and each is read with its values: it is small.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shuffle {
    pub(crate) from: u32,
    /// From `from` on; [`ELSEWHERE`] for those that do not lie there.
    pub(crate) places: [u8; 16],
    /// How far behind `from` the sixteen begin among which the first eight lie, and the last eight, if all do.
    pub(crate) halves: Option<[u8; 2]>,
}

/// Not among 32 values.
pub(crate) const ELSEWHERE: u8 = 63;

/// So many shuffles bring sixteen values together faster than one by one.
const SHUFFLES: usize = 4;

impl Shuffle {
    /// As few as together bring the values at `places` of a frame of `width` side by side, which is 32 or more; what fills up
    /// the last ones is as good a value as any.
    fn all(places: &[u32], width: u32) -> Vec<Self> {
        // Of the same eight, if these have any.
        let filling = |lane: usize| places.get(lane / 8 * 8).unwrap_or(&places[0]);
        let filled: [u32; 16] = std::array::from_fn(|lane| *places.get(lane).unwrap_or(filling(lane)));
        let mut sorted = filled;
        sorted.sort_unstable();
        let mut shuffles = Vec::<Self>::new();
        for low in sorted {
            if shuffles.last().is_some_and(|last| low < last.from + 32) {
                continue;
            }
            let from = low.min(width - 32);
            let place = |lane: usize| match filled[lane].checked_sub(from) {
                Some(place) if place < 32 => place as u8,
                _ => ELSEWHERE,
            };
            shuffles.push(Self { from, places: std::array::from_fn(place), halves: None });
        }
        if let [only] = &mut shuffles[..] {
            let [first, second] = [&only.places[..8], &only.places[8..]].map(|half| only.half(half, width));
            only.halves = first.zip(second).map(|(first, second)| [first, second]);
        }
        shuffles
    }

    /// Where among those of a frame of `width` sixteen begin that have all of the eight at `places`.
    fn half(&self, places: &[u8], width: u32) -> Option<u8> {
        let (low, high) = (*places.iter().min()?, *places.iter().max()?);
        let start = u32::from(low).min(width - 16 - self.from) as u8;
        (high < start + 16).then_some(start)
    }
}

/// Where sixteen values lie in a frame.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Near {
    /// One after the other from here on.
    Straight(u32),
    /// As these shuffles say, each of some of them.
    Shuffled {
        first: u32,
        count: u32,
    },
    Scattered,
}

impl Picks {
    /// For frames of `width` values, of which the channels' are at `channels`; `calibrated` slots are made of them.
    pub(crate) fn new(channels: &[u32], calibrated: usize, width: usize) -> Self {
        let places: Vec<u32> = channels.iter().copied().cycle().take(calibrated).collect();
        // Places beyond are none.
        let end = u32::try_from(width).unwrap_or(u32::MAX);
        let mut shuffles = Vec::new();
        let near = places.chunks(16).map(|places| {
            let low = places[0];
            if end.saturating_sub(low) >= 16 && places.iter().zip(low..).all(|(&place, at)| place == at) {
                return Near::Straight(low);
            }
            if end < 32 {
                return Near::Scattered;
            }
            let those = Shuffle::all(places, end);
            if those.len() > SHUFFLES {
                return Near::Scattered;
            }
            let (first, count) = (shuffles.len() as u32, those.len() as u32);
            shuffles.extend(those);
            Near::Shuffled { first, count }
        });
        let near: Vec<Near> = near.collect();
        let block = |tiles: &[Near]| {
            let Some(&Near::Straight(from)) = tiles.first().filter(|_| tiles.len() == BLOCK) else { return None };
            let follows =
                |(index, near): (usize, &Near)| matches!(near, Near::Straight(at) if *at == from + index as u32 * 16);
            tiles.iter().enumerate().all(follows).then_some(from as usize)
        };
        let blocks = near.chunks(BLOCK).map(block).collect();
        Self { near, blocks, shuffles, channels: channels.len(), places }
    }
}

/// Where frames' raw values lie.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Rows<'a> {
    /// Gathered: one frame after the other, each with one value a channel.
    Packed { values: &'a [RawValue], channels: usize },
    /// As the source delivered them, each value where `picks` says.
    Picked { frames: &'a [Frame], picks: &'a Picks },
}

impl<'a> Rows<'a> {
    /// The values of frame `frame`, by channel.
    pub(crate) fn row(self, frame: usize) -> impl Iterator<Item = RawValue> + 'a {
        let (values, picks, channels): (&[RawValue], &[u32], usize) = match self {
            Self::Packed { values, channels } => (&values[frame * channels..], &[], channels),
            Self::Picked { frames, picks } => (&frames[frame].values, &picks.places, picks.channels),
        };
        (0..channels).map(move |channel| values[picks.get(channel).map_or(channel, |&pick| pick as usize)])
    }

    /// The bits of frame `frame` for the sixteen slots from 16 · `tile` on, where they lie one after the other.
    #[inline(always)]
    pub(crate) fn straight(self, frame: usize, tile: usize) -> Option<&'a [u32; 16]> {
        let (values, from) = match self {
            Self::Packed { values, channels } => {
                let first = tile * 16;
                let straight = first + 16 <= channels;
                (&values[frame * channels..][..channels], straight.then_some(first)?)
            }
            Self::Picked { frames, picks } => match picks.near[tile] {
                Near::Straight(from) => (&frames[frame].values[..], from as usize),
                _ => return None,
            },
        };
        bytemuck::cast_slice(&values[from..]).first_chunk()
    }

    /// The bits of frame `frame` for the 16 · [`BLOCK`] slots of block `block`, where they lie one after the other.
    pub(crate) fn straight_block(self, frame: usize, block: usize) -> Option<&'a [u32]> {
        const SLOTS: usize = 16 * BLOCK;
        let values = match self {
            Self::Packed { values, channels } => {
                let first = block * SLOTS;
                values[frame * channels..][..channels].get(first..first + SLOTS)?
            }
            Self::Picked { frames, picks } => {
                let from = (*picks.blocks.get(block)?)?;
                &frames[frame].values[from..from + SLOTS]
            }
        };
        Some(bytemuck::cast_slice(values))
    }

    /// The bits of frame `frame` for the slots from `first` on, as far as `bits` goes; zeros after the last.
    #[inline(always)]
    pub(crate) fn read(self, frame: usize, first: usize, calibrated: usize, bits: &mut [u32]) {
        let count = bits.len().min(calibrated - first);
        bits[count..].fill(0);
        match self {
            Self::Packed { values, channels } => {
                let values: &[u32] = bytemuck::cast_slice(&values[frame * channels..][..channels]);
                if first + count <= channels {
                    bits[..count].copy_from_slice(&values[first..first + count]);
                } else {
                    for (bits, slot) in bits[..count].iter_mut().zip(first..) {
                        *bits = values[slot % channels];
                    }
                }
            }
            Self::Picked { frames, picks } => {
                let values = &frames[frame].values[..];
                for (bits, &pick) in bits.iter_mut().zip(&picks.places[first..first + count]) {
                    *bits = values[pick as usize].to_bits();
                }
            }
        }
    }

    /// The rows of `frames`.
    pub(crate) fn part(self, part: Range<usize>) -> Self {
        match self {
            Self::Packed { values, channels } => {
                Self::Packed { values: &values[part.start * channels..part.end * channels], channels }
            }
            Self::Picked { frames, picks } => Self::Picked { frames: &frames[part], picks },
        }
    }
}

/// The time since the frame before.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Step {
    /// s; formed in double precision from the frames' times.
    pub(crate) dt_s: f64,
    /// Why it cannot be used; empty when it can.
    pub(crate) flags: Flags,
}

/// Something that runs a plan.
pub(crate) trait Backend: Send {
    /// As the command line calls it.
    fn name(&self) -> &'static str;

    /// What it runs on, for people.
    fn describe(&self) -> String;

    /// Forgets all frames so far.
    fn restart(&mut self);

    /// Calibrates from now on as `plan` does, which differs in nothing but its taxels' calibration.
    fn recalibrate(&mut self, plan: &Plan);

    /// Turns `raw` into those frames of `percepts` that stand for it; `percepts` hold this backend's precision.
    fn run(&mut self, raw: &RawBatch<'_>, percepts: &mut Percepts) -> Result<()>;
}

/// A backend, and what is to be said about how it was chosen.
pub(crate) struct Chosen {
    pub(crate) backend: Box<dyn Backend>,
    pub(crate) why: String,
}

/// Makes the backend that `kind` asks for.
pub(crate) fn choose(kind: BackendKind, plan: &Plan, batch: usize) -> Result<Chosen> {
    let chosen = |backend: Box<dyn Backend>, why: String| Ok(Chosen { backend, why });
    match kind {
        BackendKind::Reference => chosen(Box::new(reference::Reference::new(plan)), "asked for".into()),
        BackendKind::Cpu => chosen(Box::new(cpu::Cpu::new(plan)), "asked for".into()),
        #[cfg(feature = "gpu")]
        BackendKind::Gpu => chosen(Box::new(gpu::Gpu::new(plan, batch)?), "asked for".into()),
        #[cfg(not(feature = "gpu"))]
        BackendKind::Gpu => {
            Err(Error::no_adapter("this build has no GPU backend; build with feature `gpu`, or use cpu"))
        }
        BackendKind::Auto => {
            let mut cpu: Box<dyn Backend> = Box::new(cpu::Cpu::new(plan));
            let mut gpu = match hardware(plan, batch) {
                Ok(gpu) => gpu,
                Err(e) if e.is_no_adapter() => return chosen(cpu, format!("no GPU to compare with: {e}")),
                Err(e) => return chosen(cpu, format!("the GPU cannot run this plan: {e}")),
            };
            let [on_cpu, on_gpu] = least_times([&mut *cpu, &mut *gpu], plan, batch)?;
            let why = format!(
                "measured on this plan, {batch} frame{} a call: cpu {:.0} µs, gpu {:.0} µs",
                if batch == 1 { "" } else { "s" },
                on_cpu.as_secs_f64() * 1e6,
                on_gpu.as_secs_f64() * 1e6
            );
            chosen(if on_gpu < on_cpu { gpu } else { cpu }, why)
        }
    }
}

/// The backend on a GPU that is not the CPU itself: one that is would be slower than the `cpu` backend on the same cores,
/// and takes long to start.
fn hardware(plan: &Plan, batch: usize) -> Result<Box<dyn Backend>> {
    #[cfg(feature = "gpu")]
    return Ok(Box::new(gpu::Gpu::on_hardware(plan, batch)?));
    #[cfg(not(feature = "gpu"))]
    return choose(BackendKind::Gpu, plan, batch).map(|chosen| chosen.backend);
}

/// The least time that each of `backends` takes for a call with every taxel pressed. They take turns, so that what else
/// the machine does meanwhile slows neither alone.
fn least_times<const N: usize>(
    mut backends: [&mut dyn Backend; N],
    plan: &Plan,
    batch: usize,
) -> Result<[Duration; N]> {
    /// Rounds at least, and at most, and how long is enough in between.
    const ROUNDS: Range<usize> = 3..12;
    const ENOUGH: Duration = Duration::from_millis(120);
    /// Calls of a turn, if they are short: the first one after another's finds the caches cold.
    const CALLS: usize = 3;
    const SHORT: Duration = Duration::from_millis(5);
    let values: Vec<RawValue> = (0..batch * plan.channels()).map(|i| RawValue::new((i % 977 + 1) as f64)).collect();
    let steps = vec![Step { dt_s: 0.01, flags: Flags::empty() }; batch];
    let raw = RawBatch {
        first: 0,
        frames: batch,
        rows: Rows::Packed { values: &values, channels: plan.channels() },
        steps: &steps,
    };
    let mut percepts = Percepts::new(plan.outputs, plan.fields.len(), Precision::F32)
        .with_columns(plan.columns, plan.kept_pressures());
    let mut least = [Duration::MAX; N];
    let start = Instant::now();
    for round in 0..ROUNDS.end {
        if round >= ROUNDS.start && start.elapsed() >= ENOUGH {
            break;
        }
        for (backend, least) in backends.iter_mut().zip(&mut least) {
            let turn = Instant::now();
            for call in 0..CALLS {
                if call > 0 && turn.elapsed() >= SHORT {
                    break;
                }
                percepts.reset(batch);
                let start = Instant::now();
                backend.run(&raw, &mut percepts)?;
                *least = start.elapsed().min(*least);
            }
        }
    }
    backends.iter_mut().for_each(|backend| backend.restart());
    Ok(least)
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicU64, Ordering};

    use super::*;
    use crate::body::Body;
    use crate::field::FieldSet;
    use crate::scene::Scene;
    use crate::signal::Calibration;

    /// Takes so long a call, but for the first ones of all, while the machine is busy with something else.
    struct Timed {
        takes: Duration,
        busy_calls: &'static AtomicU64,
    }

    impl Backend for Timed {
        fn name(&self) -> &'static str {
            "timed"
        }

        fn describe(&self) -> String {
            String::new()
        }

        fn restart(&mut self) {}

        fn recalibrate(&mut self, _: &Plan) {}

        fn run(&mut self, _: &RawBatch<'_>, _: &mut Percepts) -> Result<()> {
            let left = self.busy_calls.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |n| n.checked_sub(1));
            std::thread::sleep(self.takes + if left.is_ok() { Duration::from_millis(20) } else { Duration::ZERO });
            Ok(())
        }
    }

    #[test]
    fn a_busy_moment_does_not_make_the_faster_backend_the_slower() {
        static BUSY_CALLS: AtomicU64 = AtomicU64::new(4);
        let body = Body::from_bytes("hand", crate::bundled::body("hand").unwrap()).unwrap();
        let (fields, calibration) = (FieldSet::new(&body).unwrap(), Calibration::identity(body.taxels.len()));
        let plan = Plan::new(&body, &fields, &Scene::default(), &calibration).unwrap();
        let timed = |millis| Timed { takes: Duration::from_millis(millis), busy_calls: &BUSY_CALLS };
        let (mut fast, mut slow) = (timed(1), timed(8));
        let [on_fast, on_slow] = least_times([&mut fast, &mut slow], &plan, 1).unwrap();
        assert_eq!(BUSY_CALLS.load(Ordering::Relaxed), 0);
        assert!(on_fast < on_slow && on_slow >= Duration::from_millis(8), "{on_fast:?} {on_slow:?}");
    }
}
