//! The plans that a plan is made of, each with one stage more, so that a stage's time is what the next plan takes more.

use crate::percept::Outputs;
use crate::scene::Plan;

/// Stages that are timed together, and the outputs of a plan that ends with them.
#[derive(Clone, Debug)]
pub struct Rung {
    /// The outputs of all up to here.
    pub outputs: Outputs,
    /// Whether touches are among them.
    pub touches: bool,
    /// Which of [`Plan::explain`] they are; what is timed is shown at the last.
    pub stages: std::ops::Range<usize>,
}

/// The plans that `plan` is made of, each with one stage more that is asked for. What only serves others comes with the
/// first of those that it serves; calibration comes with contact.
#[must_use]
pub fn ladder(plan: &Plan) -> Vec<Rung> {
    let mut rungs: Vec<Rung> = Vec::new();
    let (mut outputs, mut touches) = (Outputs::empty(), false);
    let explained = plan.explain();
    for (index, stage) in explained.iter().enumerate() {
        let asked = plan.outputs() & stage.gives;
        let (is_contact, is_touches) = (stage.name == "contact", stage.name == "touches");
        if !(stage.runs && (is_contact || is_touches || !asked.is_empty())) {
            continue;
        }
        touches |= is_touches;
        outputs |= if is_contact && asked.is_empty() { Outputs::TOTAL } else { asked };
        let first = rungs.last().map_or(0, |rung| rung.stages.end);
        rungs.push(Rung { outputs, touches, stages: first..index + 1 });
    }
    rungs
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::backend::BackendKind;
    use crate::shape::Shape;

    fn plan(outputs: Outputs) -> Plan {
        let shape = Shape { sensors: 64, fields: 8, members: 8, wide: 0, local: true, frames: 2, seed: 1 };
        shape.engine(&shape.body(), BackendKind::Reference, outputs).unwrap().plan().clone()
    }

    #[test]
    fn rungs_have_every_stage_that_runs_and_every_output_once() {
        for outputs in [Outputs::USUAL, Outputs::all(), Outputs::SPEED, Outputs::ORIENTATION, Outputs::PEAK] {
            let plan = plan(outputs);
            let rungs = ladder(&plan);
            let explained = plan.explain();
            assert_eq!(rungs[0].stages, 0..3, "calibrate and change come with contact");
            assert!(rungs.windows(2).all(|pair| pair[0].stages.end == pair[1].stages.start));
            let above = &explained[rungs.last().unwrap().stages.end..];
            assert!(above.iter().all(|stage| !stage.runs), "{outputs:?}: {above:?}");
            assert!(rungs.last().unwrap().outputs.contains(outputs), "{outputs:?}");
            let what = |rung: &Rung| (rung.outputs, rung.touches);
            assert!(rungs.windows(2).all(|pair| what(&pair[0]) != what(&pair[1])));
        }
    }
}
