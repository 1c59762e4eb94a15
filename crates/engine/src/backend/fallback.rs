//! A GPU that `auto` has chosen, with the CPU in its place should it be lost.

use super::{Backend, BackendState, FieldState, RawBatch, cpu};
use crate::error::{ErrorKind, Result};
use crate::percept::Percepts;
use crate::scene::Plan;

/// The backend that runs, and what the other one needs to go on.
pub(super) struct Fallback {
    running: Box<dyn Backend>,
    plan: Plan,
    /// After the last frame, as far as percepts hold it: what the device knew is lost with it. None once the CPU runs.
    kept: Option<BackendState>,
    notice: Option<String>,
}

impl Fallback {
    /// `gpu`, which runs `plan`.
    pub(super) fn new(gpu: Box<dyn Backend>, plan: &Plan) -> Self {
        Self { running: gpu, plan: plan.clone(), kept: Some(BackendState::initial(plan)), notice: None }
    }

    /// What `call` gives; of the CPU, if the device is lost.
    fn or_on_cpu<T>(&mut self, mut call: impl FnMut(&mut dyn Backend) -> Result<T>) -> Result<T> {
        match call(&mut *self.running) {
            Err(error) if error.kind() == ErrorKind::DeviceLost => {
                let Some(kept) = self.kept.take() else { return Err(error) };
                self.running = Box::new(cpu::Cpu::new(&self.plan));
                self.running.restore(&kept)?;
                self.notice = Some(format!("{error}: the run continues on the CPU, from the last state"));
                call(&mut *self.running)
            }
            given => given,
        }
    }

    /// Keeps what the next frame depends on.
    fn keep(&mut self, raw: &RawBatch<'_>, percepts: &Percepts) {
        let (Some(kept), Some(last)) = (&mut self.kept, raw.frames.checked_sub(1)) else { return };
        kept.fields = FieldState::after(&self.plan, percepts, raw.first + last);
        if self.plan.has_changes() {
            kept.raw.clear();
            kept.raw.extend(raw.rows.row(last));
        }
    }
}

impl Backend for Fallback {
    fn name(&self) -> &'static str {
        self.running.name()
    }

    fn describe(&self) -> String {
        self.running.describe()
    }

    fn notice(&mut self) -> Option<String> {
        self.notice.take()
    }

    fn state(&mut self) -> Result<BackendState> {
        self.or_on_cpu(|backend| backend.state())
    }

    fn restore(&mut self, state: &BackendState) -> Result<()> {
        if let Some(kept) = &mut self.kept {
            kept.clone_from(state);
        }
        self.running.restore(state)
    }

    fn recalibrate(&mut self, plan: &Plan) {
        self.plan.recalibrate(plan);
        self.running.recalibrate(plan);
    }

    fn run(&mut self, raw: &RawBatch<'_>, percepts: &mut Percepts) -> Result<()> {
        self.or_on_cpu(|backend| backend.run(raw, percepts))?;
        self.keep(raw, percepts);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::backend::{Rows, Step};
    use crate::body::Body;
    use crate::error::Error;
    use crate::field::FieldSet;
    use crate::percept::{Flags, Outputs, Precision};
    use crate::scene::Scene;
    use crate::signal::{Calibration, Letter, RawValue, Receptor};

    /// The CPU, until it is lost after `calls` calls.
    struct Lost {
        cpu: cpu::Cpu,
        calls: usize,
    }

    impl Backend for Lost {
        fn name(&self) -> &'static str {
            "gpu"
        }

        fn describe(&self) -> String {
            "a device".to_owned()
        }

        fn state(&mut self) -> Result<BackendState> {
            self.cpu.state()
        }

        fn restore(&mut self, state: &BackendState) -> Result<()> {
            self.cpu.restore(state)
        }

        fn recalibrate(&mut self, plan: &Plan) {
            self.cpu.recalibrate(plan);
        }

        fn run(&mut self, raw: &RawBatch<'_>, percepts: &mut Percepts) -> Result<()> {
            self.calls = self.calls.checked_sub(1).ok_or_else(|| Error::gpu_lost("a device stopped answering"))?;
            self.cpu.run(raw, percepts)
        }
    }

    #[test]
    fn a_run_goes_on_on_the_cpu_from_the_last_state_and_says_so_once() {
        let body = Body::from_bytes("hand", crate::bundled::body("hand").unwrap()).unwrap();
        let ids: Vec<u32> = body.taxels.iter().map(|taxel| taxel.id).collect();
        // A contact that thresholds keep, motion, and a change: all that a state has.
        let calibration = Calibration::parse("[contact]\non = 900\noff = 1\n", &ids).unwrap();
        let letters = Letter::all_of(&[Receptor::Sustained, Receptor::Change], &[]);
        let scene = Scene { outputs: Outputs::USUAL_AND_MOTION, letters, ..Scene::default() };
        let plan = Plan::new(&body, &FieldSet::new(&body).unwrap(), &scene, &calibration).unwrap();
        let lost = |calls| Box::new(Lost { cpu: cpu::Cpu::new(&plan), calls });
        let run = |backend: &mut dyn Backend| {
            let mut all = Vec::new();
            for call in 0..5_u32 {
                let values: Vec<RawValue> = (0..2 * plan.channels())
                    .map(|i| RawValue::new(if call == 0 { 999.0 } else { ((i * 7 + call as usize) % 5) as f64 }))
                    .collect();
                let steps = [Step { dt_s: 0.01, flags: Flags::empty() }; 2];
                let mut percepts = Percepts::new(plan.outputs, plan.fields.len(), Precision::F32)
                    .with_columns(plan.columns, plan.kept_pressures());
                percepts.reset(2);
                let rows = Rows::Packed { values: &values, channels: plan.channels() };
                backend.run(&RawBatch { first: 0, frames: 2, rows, steps: &steps }, &mut percepts).unwrap();
                all.push((percepts, backend.notice()));
            }
            all
        };
        let right = run(&mut cpu::Cpu::new(&plan));
        let mut fallback = Fallback::new(lost(3), &plan);
        let found = run(&mut fallback);
        assert_eq!(fallback.name(), "cpu");
        for (call, ((found, notice), (right, _))) in found.iter().zip(&right).enumerate() {
            assert!(found == right, "call {call}");
            let notice = notice.as_deref().unwrap_or_default();
            assert_eq!(
                (call == 3, call == 3),
                (notice.contains("stopped answering"), notice.contains("continues on the CPU"))
            );
        }
        // Asked for by name it is an error of its own kind.
        let nothing = RawBatch { first: 0, frames: 0, rows: Rows::Packed { values: &[], channels: 1 }, steps: &[] };
        let error = lost(0).run(&nothing, &mut Percepts::new(plan.outputs, 1, Precision::F32)).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::DeviceLost);
    }
}
