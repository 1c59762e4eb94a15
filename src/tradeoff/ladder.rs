//! The plans that a plan is made of, each with one stage more, so that a stage's time is what the next plan takes more.

use crate::percept::{Outputs, TouchOutputs};
use crate::scene::Plan;
use crate::signal::Letter;

/// Stages that are timed together, and the outputs of a plan that ends with them.
#[derive(Clone, Debug)]
pub struct Rung {
    /// The outputs of all up to here.
    pub outputs: Outputs,
    /// What is given of touches, where these are among them.
    pub touches: Option<TouchOutputs>,
    /// The letters of all up to here: those of pressures, and others from their own stages on. None stands for the scene's own, which give
    /// touches what no field has.
    pub letters: Vec<Letter>,
    /// Which of [`Plan::explain`] they are; what is timed is shown at the last.
    pub stages: std::ops::Range<usize>,
}

/// What touches have of tangential forces, and of all letters that the host makes.
const OF_SHEAR: TouchOutputs = TouchOutputs::SHEAR.union(TouchOutputs::FRICTION_SIGMA);
const OF_LETTERS: TouchOutputs = OF_SHEAR.union(TouchOutputs::TEMPERATURE);

/// The plans that `plan` is made of, each with one stage more that is asked for. What only serves others comes with the
/// first of those that it serves; calibration comes with contact. Where no letter is of pressures, all else comes with the first letter.
/// If touches have the shear or temperature of taxels that no field reads so, the last is the whole plan, which adds that to *touches*.
#[must_use]
pub fn ladder(plan: &Plan) -> Vec<Rung> {
    let mut rungs: Vec<Rung> = Vec::new();
    let (mut outputs, mut touches) = (Outputs::empty(), None);
    let (mut letters, others): (Vec<Letter>, Vec<Letter>) =
        plan.letters().iter().partition(|letter| letter.receptor.is_of_pressure());
    let explained = plan.explain();
    for (index, stage) in explained.iter().enumerate() {
        let asked = plan.outputs() & stage.gives;
        let is_contact = stage.name == "contact";
        let own = others.iter().find(|letter| Some(letter.receptor) == stage.letter);
        if letters.is_empty() {
            if own.is_none() {
                continue;
            }
            outputs = plan.outputs() - Outputs::OF_OTHER_LETTERS;
        }
        letters.extend(own);
        let asked_of = |of_stage: TouchOutputs| plan.touch_outputs().map(|outputs| outputs & of_stage);
        let of_touches = match stage.name {
            "touches" => asked_of(TouchOutputs::all() - TouchOutputs::FIT - OF_LETTERS),
            "fit" => asked_of(TouchOutputs::all() - OF_LETTERS),
            "shear" => touches.zip(asked_of(OF_SHEAR)).map(|(before, own)| before | own),
            "temperature" => touches.zip(asked_of(TouchOutputs::TEMPERATURE)).map(|(before, own)| before | own),
            _ => None,
        };
        if !(stage.runs && (is_contact || of_touches.is_some() || !asked.is_empty())) {
            continue;
        }
        touches = of_touches.or(touches);
        outputs |= if is_contact && asked.is_empty() { Outputs::TOTAL } else { asked };
        let first = rungs.last().map_or(0, |rung| rung.stages.end);
        rungs.push(Rung { outputs, touches, letters: letters.clone(), stages: first..index + 1 });
    }
    let lacks = |(asked, timed): (TouchOutputs, TouchOutputs)| (asked - timed).intersects(OF_LETTERS);
    if plan.touch_outputs().zip(touches).is_some_and(lacks)
        && let Some(index) = explained.iter().position(|stage| stage.name == "touches")
    {
        let (outputs, touches) = (plan.outputs(), plan.touch_outputs());
        rungs.push(Rung { outputs, touches, letters: Vec::new(), stages: index..index + 1 });
    }
    rungs
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::backend::BackendKind;
    use crate::engine::{Engine, Options};
    use crate::scene::Scene;
    use crate::signal::Receptor;
    use crate::{bundled, touch};
    use somatic_engine::shape::Shape;

    fn plan(outputs: Outputs) -> Plan {
        let shape = Shape { sensors: 64, fields: 8, members: 8, wide: 0, local: true, frames: 2, seed: 1 };
        shape.engine(&shape.body(), BackendKind::Reference, outputs).unwrap().plan().clone()
    }

    #[test]
    fn rungs_have_every_stage_that_runs_and_every_output_once() {
        for outputs in [Outputs::USUAL_AND_MOTION, Outputs::all(), Outputs::SPEED, Outputs::ORIENTATION, Outputs::PEAK]
        {
            let plan = plan(outputs);
            let rungs = ladder(&plan);
            let explained = plan.explain();
            assert_eq!(rungs[0].stages, 0..3, "calibrate and change come with contact");
            assert!(rungs.windows(2).all(|pair| pair[0].stages.end == pair[1].stages.start));
            let above = &explained[rungs.last().unwrap().stages.end..];
            assert!(above.iter().all(|stage| !stage.runs), "{outputs:?}: {above:?}");
            assert!(rungs.last().unwrap().outputs.contains(plan.outputs()), "{outputs:?}");
            let what = |rung: &Rung| (rung.outputs, rung.touches);
            assert!(rungs.windows(2).all(|pair| what(&pair[0]) != what(&pair[1])));
        }
    }

    #[test]
    fn each_letter_that_the_host_makes_is_a_rung_with_what_touches_have_of_it() {
        let body = crate::Body::from_bytes("sensing-hand", bundled::SENSING_HAND).unwrap();
        let plan = |letters: &[Receptor]| {
            let scene = Scene::default().letters(Letter::all_of(letters, &[]));
            let scene = if letters.is_empty() { scene.touches(touch::Options::default()) } else { scene };
            Engine::new(&body, Options::default().scene(scene).backend(BackendKind::Reference)).unwrap().plan().clone()
        };
        let whole = plan(&[]);
        let rungs = ladder(&whole);
        let named = |rung: &Rung| whole.explain()[rung.stages.end - 1].name;
        let last: Vec<&str> = rungs[rungs.len() - 4..].iter().map(named).collect();
        assert_eq!(last, ["touches", "shear", "temperature", "proximity"]);
        let letters: Vec<usize> = rungs.iter().map(|rung| rung.letters.len()).collect();
        assert_eq!(letters[letters.len() - 4..], [1, 2, 3, 4]);
        let touches = |back: usize| rungs[rungs.len() - back].touches.unwrap();
        assert!(!touches(4).intersects(TouchOutputs::SHEAR | TouchOutputs::TEMPERATURE));
        assert_eq!(touches(3), touches(4) | TouchOutputs::SHEAR);
        assert_eq!(Some(touches(1)), whole.touch_outputs());
        // Alone, the first letter has all that comes before it.
        let alone = plan(&[Receptor::Temperature, Receptor::Proximity]);
        let rungs = ladder(&alone);
        assert_eq!(rungs.iter().map(|rung| rung.letters.len()).collect::<Vec<_>>(), [1, 2]);
        assert_eq!((rungs[0].stages.start, rungs[1].outputs), (0, alone.outputs()));
    }

    #[test]
    fn what_touches_have_of_letters_is_timed_whether_fields_have_it_or_not() {
        let body = crate::Body::from_bytes("sensing-hand", bundled::SENSING_HAND).unwrap();
        let engine = |scene: Scene| Engine::new(&body, Options::default().scene(scene).backend(BackendKind::Reference));
        let asked = |outputs: TouchOutputs| touch::Options { outputs, ..touch::Options::default() };
        let usual = Scene::default().touches(asked(TouchOutputs::USUAL));
        let sigma = asked(TouchOutputs::USUAL | TouchOutputs::FRICTION_SIGMA);
        let named = Scene::default().letters(Letter::all_of(&[Receptor::Sustained, Receptor::Shear], &[]));
        let scenes = [
            (usual.clone().outputs(Outputs::empty()), "touches"),
            (usual.clone().outputs(Outputs::TOTAL).touches(sigma), "touches"),
            (usual.clone().fields(["hand/back"]), "touches"),
            (named.outputs(Outputs::TOTAL).touches(sigma), "shear"),
            (usual, "proximity"),
        ];
        for (scene, last_stage) in scenes {
            let whole = engine(scene.clone()).unwrap();
            let rungs = ladder(whole.plan());
            for rung in &rungs {
                let touches = rung.touches.map(asked);
                let mut of_rung = scene.clone().outputs(rung.outputs).touches(touches);
                if !rung.letters.is_empty() {
                    of_rung = of_rung.letters(rung.letters.clone());
                }
                let plan = engine(of_rung).unwrap_or_else(|e| panic!("{rung:?}: {e}")).plan().clone();
                assert_eq!(plan.touch_outputs(), rung.touches);
            }
            let last = rungs.last().unwrap();
            assert_eq!(whole.plan().explain()[last.stages.end - 1].name, last_stage);
            assert_eq!(last.touches, whole.plan().touch_outputs());
            let names = |rung: &Rung| rung.touches.is_some_and(|outputs| outputs.intersects(OF_SHEAR));
            assert_eq!(rungs.iter().filter(|rung| names(rung)).count(), if last_stage == "proximity" { 3 } else { 1 });
        }
    }

    #[test]
    fn touches_are_a_rung_and_their_fits_another() {
        let body = crate::Body::from_bytes("hand", bundled::HAND).unwrap();
        let asked = TouchOutputs::USUAL | TouchOutputs::FIT_PLACE;
        let touches = touch::Options { outputs: asked, ..touch::Options::default() };
        let scene = Scene::default().outputs(Outputs::TOTAL | Outputs::FORCE).touches(touches);
        let engine = Engine::new(&body, Options::default().scene(scene).backend(BackendKind::Reference)).unwrap();
        let rungs = ladder(engine.plan());
        let of_touches: Vec<Option<TouchOutputs>> = rungs.iter().map(|rung| rung.touches).collect();
        assert_eq!(of_touches, [None, Some(TouchOutputs::USUAL), Some(TouchOutputs::USUAL), Some(asked)]);
        let last = &engine.plan().explain()[rungs[3].stages.end - 1];
        assert_eq!((last.name, last.why.as_str()), ("fit", "asked for: touches.fit_place"));
    }
}
