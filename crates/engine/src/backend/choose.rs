//! Which backend runs a plan: as asked for, or by a measurement.

use std::ops::Range;
use std::time::{Duration, Instant};

use super::fallback::Fallback;
#[cfg(feature = "gpu")]
use super::gpu;
use super::{Backend, BackendKind, BackendState, RawBatch, Rows, Step, cpu, reference};
#[cfg(not(feature = "gpu"))]
use crate::error::Error;
use crate::error::{ErrorKind, Result};
use crate::percept::{Flags, Percepts, Precision};
use crate::scene::Plan;
use crate::signal::RawValue;

/// How backend `cpu` computes on this machine, in words: its arithmetic, instructions and threads.
#[must_use]
pub fn processor() -> String {
    cpu::describe()
}

/// A backend, and what is to be said about how it was chosen.
pub(crate) struct Chosen {
    pub(crate) backend: Box<dyn Backend>,
    pub(crate) why: String,
}

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
                Err(e) if e.kind() == ErrorKind::NoAdapter => {
                    return chosen(cpu, format!("no GPU to compare with: {e}"));
                }
                Err(e) => return chosen(cpu, format!("the GPU cannot run this plan: {e}")),
            };
            let [on_cpu, on_gpu] = least_times([&mut *cpu, &mut *gpu], plan, batch)?;
            let why = format!(
                "measured on this plan, {batch} frame{} a call: cpu {:.0} µs, gpu {:.0} µs",
                if batch == 1 { "" } else { "s" },
                on_cpu.as_secs_f64() * 1e6,
                on_gpu.as_secs_f64() * 1e6
            );
            chosen(if on_gpu < on_cpu { Box::new(Fallback::new(gpu, plan)) } else { cpu }, why)
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
    let initial = BackendState::initial(plan);
    backends.iter_mut().try_for_each(|backend| backend.restore(&initial))?;
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

        fn state(&mut self) -> Result<BackendState> {
            Ok(BackendState { raw: Vec::new(), fields: Vec::new() })
        }

        fn restore(&mut self, _: &BackendState) -> Result<()> {
            Ok(())
        }

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
