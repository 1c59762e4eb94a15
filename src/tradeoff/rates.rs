//! What a plan should take, worked out before it runs: its own counts times what this machine takes for each of them.
//!
//! The machine's rates are learned once, on made-up skins that are nobody's: what is estimated so and what is then measured
//! know nothing of each other, and their difference says how far counts alone tell the cost.

use std::collections::BTreeMap;
use std::hint::black_box;
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};

use crate::backend::BackendKind;
use crate::engine::{Engine, Options};
use crate::error::Result;
use crate::experiments::shape::Shape;
use crate::percept::Outputs;
use crate::scene::{Arithmetic, Coverage, Knobs, Plan, PlannedStage, Scene};

/// Skins to learn on: few of everything; many small fields; few long ones; many values; one field over all.
const SKINS: [Shape; 5] =
    [skin(64, 8, 8, 0), skin(256, 128, 8, 0), skin(256, 16, 64, 0), skin(2048, 128, 16, 0), skin(2048, 2, 8, 2048)];
/// On a GPU, where each engine compiles its shaders, the two that differ most.
const SKINS_OF_GPU: [Shape; 2] = [SKINS[0], SKINS[3]];
/// Frames a call, at most: what one more costs is the same by then.
const MOST_FRAMES: usize = 64;
/// A turn, at least.
const TURN: Duration = Duration::from_micros(200);
/// Rounds in which every engine has its turn, the first of which warms up: no more than so many, and after so long no more
/// than the fewest.
const ROUNDS: usize = 7;
const FEWEST_ROUNDS: usize = 3;
const LONG_ENOUGH: Duration = Duration::from_millis(120);

const fn skin(sensors: usize, fields: usize, members: usize, wide: usize) -> Shape {
    Shape { sensors, fields, members, wide, local: true, frames: 2, seed: 1 }
}

/// What a stage is counted by: a frame, and the values, fields, memberships and memberships of wide fields in it.
const COUNTS: usize = 5;

/// Stages that are timed together, and the outputs of a plan that ends with them.
#[derive(Clone, Debug)]
pub struct Rung {
    /// The outputs of all up to here.
    pub outputs: Outputs,
    /// Which of [`Plan::explain`] they are; what is timed is shown at the last.
    pub stages: std::ops::Range<usize>,
}

/// The plans that `plan` is made of, each with one stage more that is asked for. What only serves others comes with the
/// first of those that it serves; calibration comes with contact.
#[must_use]
pub fn ladder(plan: &Plan) -> Vec<Rung> {
    let mut rungs: Vec<Rung> = Vec::new();
    let mut outputs = Outputs::empty();
    let explained = plan.explain();
    for (index, stage) in explained.iter().enumerate() {
        let asked = plan.outputs() & stage.gives;
        let is_contact = stage.name == "contact";
        if !(stage.runs && (is_contact || !asked.is_empty())) {
            continue;
        }
        outputs |= if is_contact && asked.is_empty() { Outputs::TOTAL } else { asked };
        let first = rungs.last().map_or(0, |rung| rung.stages.end);
        rungs.push(Rung { outputs, stages: first..index + 1 });
    }
    rungs
}

/// What a machine takes of each stage, learned of one backend, arithmetic and number of frames a call.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Rates {
    /// Per stage, µs for each of its counts.
    us: BTreeMap<String, [f64; COUNTS]>,
}

impl Rates {
    /// Learns them, in a moment.
    ///
    /// # Errors
    /// The backend cannot run here.
    pub fn learn(backend: BackendKind, arithmetic: Option<Arithmetic>, batch: usize) -> Result<Self> {
        let batch = batch.clamp(1, MOST_FRAMES);
        let skins = if backend == BackendKind::Gpu { &SKINS_OF_GPU[..] } else { &SKINS[..] };
        let knobs = Knobs { arithmetic, coverage: Coverage::All, ..Knobs::default() };
        let mut trials = Vec::new();
        for skin in skins {
            trials.push(Trial::new(Shape { frames: batch.max(2), ..*skin }, backend, knobs, batch)?);
        }
        let start = Instant::now();
        for round in 0..ROUNDS {
            if round > FEWEST_ROUNDS && start.elapsed() > LONG_ENOUGH {
                break;
            }
            for trial in &mut trials {
                trial.turn(round > 0)?;
            }
        }
        let seen: Vec<Seen> = trials.into_iter().flat_map(Trial::seen).collect();
        let mut us = BTreeMap::new();
        for name in seen.iter().map(|seen| &seen.stage) {
            let of_stage: Vec<&Seen> = seen.iter().filter(|other| other.stage == *name).collect();
            us.entry(name.clone()).or_insert_with(|| fitted(&of_stage));
        }
        Ok(Self { us })
    }

    /// What the stages of a rung should take in a frame in which every field is touched, µs. `None` where nothing was
    /// learned of one of them. Hysteresis, two comparisons a field, is taken for nothing.
    #[must_use]
    pub fn estimate_us(&self, stages: &[PlannedStage]) -> Option<f64> {
        let counted = |stage: &&PlannedStage| stage.runs && !["calibrate", "hysteresis"].contains(&stage.name);
        let running = stages.iter().filter(counted);
        let us = running.map(|stage| {
            let counts = counts(stage, stages);
            self.us.get(stage.name).map(|rates| dot(rates, &counts))
        });
        us.sum()
    }
}

/// What `stage` is counted by. Values are counted to contact, which is timed with their calibration.
fn counts(stage: &PlannedStage, stages: &[PlannedStage]) -> [f64; COUNTS] {
    let calibrated = stages.iter().find(|other| other.name == "calibrate" && stage.name == "contact");
    let values = calibrated.map_or(0, |calibrate| calibrate.over);
    [1, values, stage.over, stage.memberships - stage.wide, stage.wide].map(|count| count as f64)
}

fn dot(a: &[f64; COUNTS], b: &[f64; COUNTS]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// What a stage took on a skin.
struct Seen {
    stage: String,
    counts: [f64; COUNTS],
    us: f64,
    /// What the whole frame took, which says how exact `us` can be.
    whole_us: f64,
}

/// A skin, with an engine for each rung of a plan for everything.
struct Trial {
    frames: Vec<crate::Frame>,
    batch: usize,
    shape: Shape,
    stages: Vec<PlannedStage>,
    rungs: Vec<Rung>,
    engines: Vec<(Engine, Vec<f64>)>,
}

impl Trial {
    fn new(shape: Shape, backend: BackendKind, knobs: Knobs, batch: usize) -> Result<Self> {
        let body = shape.body();
        let engine = |outputs: Outputs| {
            let scene = Scene { outputs, knobs, ..Scene::default() };
            Engine::new(&body, Options { scene, backend, batch, ..Options::default() })
        };
        let whole = engine(Outputs::all())?;
        let rungs = ladder(whole.plan());
        let stages = whole.plan().explain();
        let below = rungs.iter().rev().skip(1).rev();
        let mut engines = below.map(|rung| Ok((engine(rung.outputs)?, Vec::new()))).collect::<Result<Vec<_>>>()?;
        engines.push((whole, Vec::new()));
        Ok(Self { frames: shape.frames(), batch, shape, stages, rungs, engines })
    }

    /// A turn of each engine.
    fn turn(&mut self, counts: bool) -> Result<()> {
        for (engine, times) in &mut self.engines {
            let (mut took, mut frames) = (Duration::ZERO, 0);
            while took < TURN {
                self.shape.advance(&mut self.frames);
                let start = Instant::now();
                for call in self.frames.chunks(self.batch) {
                    black_box(engine.process(black_box(call))?);
                }
                took += start.elapsed();
                frames += self.frames.len();
            }
            if counts {
                times.push(took.as_secs_f64() * 1e6 / frames as f64);
            }
        }
        Ok(())
    }

    fn seen(self) -> Vec<Seen> {
        let medians = self.engines.into_iter().map(|(_, mut times)| {
            times.sort_by(f64::total_cmp);
            times[times.len() / 2]
        });
        let mut below = 0.0;
        let seen = self.rungs.iter().zip(medians).map(|(rung, whole_us)| {
            let us = (whole_us - below).max(0.0);
            below = whole_us;
            let stage = &self.stages[rung.stages.end - 1];
            Seen { stage: stage.name.to_owned(), counts: counts(stage, &self.stages), us, whole_us }
        });
        seen.collect()
    }
}

/// The rates, none negative, that are off from what was seen by the least squares: relative ones, down to a twentieth of
/// the whole frame, under which a difference of two times says little.
fn fitted(seen: &[&Seen]) -> [f64; COUNTS] {
    const SWEEPS: usize = 2000;
    let rows: Vec<([f64; COUNTS], f64)> = seen
        .iter()
        .map(|seen| {
            let scale = seen.us.max(seen.whole_us / 20.0).max(f64::MIN_POSITIVE);
            (seen.counts.map(|count| count / scale), seen.us / scale)
        })
        .collect();
    let mut rates = [0.0; COUNTS];
    // One rate at a time, as well as can be with the others as they are.
    for _ in 0..SWEEPS {
        for index in 0..COUNTS {
            let own: f64 = rows.iter().map(|(counts, _)| counts[index] * counts[index]).sum();
            let left: f64 = rows.iter().map(|(counts, us)| counts[index] * (us - dot(&rates, counts))).sum();
            if own > 0.0 {
                rates[index] = (rates[index] + left / own).max(0.0);
            }
        }
    }
    rates
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plan(shape: &Shape, outputs: Outputs) -> Plan {
        shape.engine(&shape.body(), BackendKind::Reference, outputs).unwrap().plan().clone()
    }

    #[test]
    fn rates_are_found_from_what_they_make() {
        let right = [2.0, 0.01, 0.1, 0.02, 0.003];
        let seen: Vec<Seen> = SKINS
            .iter()
            .map(|skin| {
                let stages = plan(skin, Outputs::all()).explain();
                let counts = counts(stages.iter().find(|stage| stage.name == "contact").unwrap(), &stages);
                let us = dot(&right, &counts);
                Seen { stage: "contact".into(), counts, us, whole_us: us }
            })
            .collect();
        let got = fitted(&seen.iter().collect::<Vec<_>>());
        // Skins of other sizes are told by them.
        for (values, fields, members, wide) in [(500, 60, 20, 0), (4000, 300, 12, 1000), (100, 1, 90, 0)] {
            let counts = [1, values, fields, fields * members, wide].map(|count| count as f64);
            let (got, right) = (dot(&got, &counts), dot(&right, &counts));
            assert!((got / right - 1.0).abs() < 0.05, "{values} values, {fields} fields: {got} for {right}");
        }
        // Of what takes no time nothing is made up, and no rate gives time back.
        let none: Vec<Seen> = seen.into_iter().map(|seen| Seen { us: 0.0, ..seen }).collect();
        assert_eq!(fitted(&none.iter().collect::<Vec<_>>()), [0.0; COUNTS]);
    }

    #[test]
    fn rungs_have_every_stage_that_runs_and_every_output_once() {
        for outputs in [Outputs::USUAL, Outputs::all(), Outputs::SPEED, Outputs::ORIENTATION, Outputs::PEAK] {
            let plan = plan(&SKINS[0], outputs);
            let rungs = ladder(&plan);
            let explained = plan.explain();
            assert_eq!(rungs[0].stages, 0..3, "calibrate and change come with contact");
            assert!(rungs.windows(2).all(|pair| pair[0].stages.end == pair[1].stages.start));
            let above = &explained[rungs.last().unwrap().stages.end..];
            assert!(above.iter().all(|stage| !stage.runs), "{outputs:?}: {above:?}");
            assert!(rungs.last().unwrap().outputs.contains(outputs), "{outputs:?}");
            assert!(rungs.windows(2).all(|pair| pair[0].outputs != pair[1].outputs));
        }
    }

    #[test]
    fn what_is_learned_grows_with_what_there_is_to_do() {
        let rates = Rates::learn(BackendKind::Cpu, None, 1).unwrap();
        let us = |fields: usize, members: usize| -> f64 {
            let shape = skin(1000, fields, members, 0);
            let plan = plan(&shape, Outputs::all());
            let stages = plan.explain();
            let rungs = ladder(&plan);
            rungs.iter().map(|rung| rates.estimate_us(&stages[rung.stages.clone()]).unwrap()).sum()
        };
        let (few, fields, members) = (us(10, 16), us(160, 16), us(160, 100));
        assert!(0.0 < few && few < fields && fields < members, "{few} {fields} {members}");
        let said = serde_json::to_string(&rates).unwrap();
        assert_eq!(serde_json::from_str::<Rates>(&said).unwrap(), rates);
        // Nothing is said of a stage that nothing was learned of.
        let mut stages = plan(&SKINS[0], Outputs::TOTAL).explain();
        stages[1].runs = true;
        assert_eq!(rates.estimate_us(&stages[..3]), None);
    }
}
