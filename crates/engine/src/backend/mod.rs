//! Backends: three ways to run a plan, all with the same percepts.

pub(crate) mod agreement;
pub(crate) mod bounds;
mod choose;
pub(crate) mod cpu;
mod fallback;
#[cfg(feature = "gpu")]
pub mod gpu;
mod raw;
pub mod reference;
pub(crate) mod sigma;
mod state;

pub(crate) use self::choose::choose;
pub use self::choose::processor;
pub(crate) use self::raw::{Delivered, Picks, RawBatch, Rows, Step};
pub(crate) use self::state::{BackendState, FieldState};
use crate::error::{Error, Result};
use crate::percept::{Percepts, Precision};
use crate::scene::{Arithmetic, Plan};

words! {"backend",
    /// Which backend is asked for.
    #[derive(Default)]
    BackendKind {
        /// The fastest of `cpu` and `gpu` on this plan and machine, by a measurement; `cpu` where the GPU is software on it.
        #[default]
        Auto = "auto",
        /// Double precision, as the equations read.
        Reference = "reference",
        /// Single precision on the CPU's cores.
        Cpu = "cpu",
        /// WGSL compute shaders.
        Gpu = "gpu",
    }
}

impl BackendKind {
    /// The arithmetic that its percepts are made with.
    #[must_use]
    pub fn precision(self) -> Precision {
        if self == Self::Reference { Precision::F64 } else { Precision::F32 }
    }

    /// The backend that computes for `self` with `arithmetic`: where it is double, the reference.
    #[doc(hidden)]
    pub fn with(self, arithmetic: Option<Arithmetic>) -> Result<Self> {
        match (self, arithmetic) {
            (Self::Gpu, Some(Arithmetic::Double)) => {
                Err(Error::usage("shaders have no double precision; use backend cpu, or arithmetic compensated"))
            }
            (_, Some(Arithmetic::Double)) => Ok(Self::Reference),
            (Self::Reference, Some(arithmetic)) => Err(Error::usage(format!(
                "the reference is always in double precision; use backend cpu or gpu for arithmetic {arithmetic}"
            ))),
            _ => Ok(self),
        }
    }
}

/// Something that runs a plan.
pub(crate) trait Backend: Send {
    /// As the command line calls it.
    fn name(&self) -> &'static str;

    /// What it runs on, for people.
    fn describe(&self) -> String;

    /// What has changed about how it runs, to be said once.
    fn notice(&mut self) -> Option<String> {
        None
    }

    /// What the next frame depends on.
    fn state(&mut self) -> Result<BackendState>;

    /// Goes on from `state`, of the same plan.
    fn restore(&mut self, state: &BackendState) -> Result<()>;

    /// Calibrates from now on as `plan` does, which differs in nothing but its taxels' calibration.
    fn recalibrate(&mut self, plan: &Plan);

    /// Turns `raw` into those frames of `percepts` that stand for it; `percepts` hold this backend's precision.
    fn run(&mut self, raw: &RawBatch<'_>, percepts: &mut Percepts) -> Result<()>;
}
