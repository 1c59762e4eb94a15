//! Backends: three ways to run a plan, all with the same percepts.

pub(crate) mod agreement;
pub(crate) mod cpu;
#[cfg(feature = "gpu")]
pub mod gpu;
pub(crate) mod reference;

use std::str::FromStr;
use std::time::{Duration, Instant};

use crate::error::{Error, Result};
use crate::percept::{Flags, Percepts, Precision};
use crate::scene::Plan;
use crate::signal::RawValue;

/// Which backend is asked for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BackendKind {
    /// The fastest of `cpu` and `gpu` on this plan and machine, by a measurement.
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

/// A batch of raw values: frames one after the other, each with one value a channel.
#[derive(Clone, Copy)]
pub(crate) struct RawBatch<'a> {
    /// Where its first frame stands in the percepts.
    pub(crate) first: usize,
    pub(crate) frames: usize,
    pub(crate) values: &'a [RawValue],
    /// Per frame, the time since the one before.
    pub(crate) steps: &'a [Step],
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
            let mut gpu = match choose(BackendKind::Gpu, plan, batch) {
                Ok(gpu) => gpu.backend,
                Err(e) if e.is_no_adapter() => return chosen(cpu, format!("no GPU to compare with: {e}")),
                Err(e) => return chosen(cpu, format!("the GPU cannot run this plan: {e}")),
            };
            let (on_cpu, on_gpu) = (time(&mut *cpu, plan, batch)?, time(&mut *gpu, plan, batch)?);
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

/// The median time of a call with every taxel pressed, over as many calls as fit into some milliseconds.
fn time(backend: &mut dyn Backend, plan: &Plan, batch: usize) -> Result<Duration> {
    const CALLS: usize = 15;
    const ENOUGH: Duration = Duration::from_millis(60);
    let values: Vec<RawValue> = (0..batch * plan.channels()).map(|i| RawValue::new((i % 977 + 1) as f64)).collect();
    let steps = vec![Step { dt_s: 0.01, flags: Flags::empty() }; batch];
    let raw = RawBatch { first: 0, frames: batch, values: &values, steps: &steps };
    let mut percepts = Percepts::new(plan.outputs, plan.fields.len(), Precision::F32)
        .with_columns(plan.columns, plan.kept_pressures());
    let mut times = Vec::with_capacity(CALLS);
    percepts.reset(batch);
    backend.run(&raw, &mut percepts)?;
    let start = Instant::now();
    while times.is_empty() || (times.len() < CALLS && start.elapsed() < ENOUGH) {
        percepts.reset(batch);
        let call = Instant::now();
        backend.run(&raw, &mut percepts)?;
        times.push(call.elapsed());
    }
    backend.restart();
    times.sort();
    Ok(times[times.len() / 2])
}
