//! What a scene costs: counted and measured.

use std::collections::BTreeSet;

use somatic::field::{Field, FieldSet};
use somatic::internal::scene::{PlannedStage, SensedTaxels};
use somatic::internal::setup::Setup;
use somatic::internal::setup::{Input, RECORDED_BATCH};
use somatic::internal::signal::Letter;
use somatic::internal::tradeoff::{Combination, TestFrames, ladder};
use somatic::scene::OrientationBy;
use somatic::{Agreement, BackendKind, Body, Engine, Frame, Outputs, Plan, Result, TouchOutputs, touch};

use super::timed::{Played, measured};
use crate::cli::tradeoff::{Settled, settled};
use crate::cli::words::count;

/// What a scene costs.
pub(super) struct Bill {
    pub(super) body: String,
    /// Of how many.
    pub(super) taxels: [usize; 2],
    /// Of how many of the body that have taxels of a letter.
    pub(super) named_fields: [usize; 2],
    /// Once for each letter that they have taxels of.
    pub(super) fields: [usize; 2],
    pub(super) letters: usize,
    pub(super) memberships: usize,
    pub(super) bytes: [usize; 2],
    pub(super) backend: (String, String, String),
    pub(super) knobs: Combination,
    /// Fields that cannot have the charts that are asked for, and why.
    pub(super) kept_charts: Vec<String>,
    /// What `somatic tradeoff` measured of this, and when.
    pub(super) kept: Option<String>,
    /// Frames a call.
    pub(super) batch: usize,
    pub(super) stages: Vec<Stage>,
    pub(super) measured: Measured,
    /// Where a limb sends to another computer.
    #[cfg(feature = "zenoh")]
    pub(super) network: Option<super::network::Network>,
}

/// A stage, and its time in a frame, µs, where it is timed by itself.
pub(super) struct Stage {
    pub(super) planned: PlannedStage,
    pub(super) measured_us: Option<f64>,
}

pub(super) struct Measured {
    /// On what, in words.
    pub(super) on: String,
    /// A frame, µs.
    pub(super) whole_us: f64,
    /// None on the reference.
    pub(super) agreement: Option<Agreement>,
}

impl Bill {
    pub(super) fn for_run(asked: &Setup, input: Option<&Input>, body: &Body) -> Result<Self> {
        let recorded = input.filter(|input| input.is_recording());
        let gather = recorded.is_some() && asked.playback_speed.is_none();
        let batch = asked.batch.map_or(if gather { RECORDED_BATCH } else { 1 }, |batch| batch as usize);
        let Settled { options, why: picked, measured: kept } = settled(asked, input, body, batch)?;
        let engine = Engine::new(body, options.clone())?;
        let chosen = engine.backend();
        let kind: BackendKind = chosen.name.parse()?;
        let backend = (chosen.name.to_owned(), chosen.device, picked.unwrap_or_else(|| chosen.reason.to_owned()));
        let plan = engine.plan().clone();
        let knobs = Combination { backend: kind, knobs: plan.knobs() };
        let kept_charts = engine.kept_charts().map(|(name, why)| format!("{name}: {why}")).collect();
        let rungs = ladder(&plan);
        let made = |outputs: Outputs, of_touches: Option<TouchOutputs>, letters: &[Letter]| -> Result<Engine> {
            let mut options = options.clone().backend(kind);
            options.scene.outputs = outputs;
            if !letters.is_empty() {
                options.scene.letters = letters.to_vec();
            }
            let touches = options.scene.touches.unwrap_or_default();
            options.scene.touches = of_touches.map(|outputs| touch::Options { outputs, ..touches });
            let fits = of_touches.is_some_and(|outputs| outputs.intersects(TouchOutputs::FIT));
            let has_orientation = outputs.intersects(Outputs::ORIENTATION | Outputs::PRINCIPAL_AXIS);
            if options.scene.knobs.orientation_by.steps().map_or(!has_orientation, |_| !fits) {
                // A way to an orientation is for those that have one.
                options.scene.knobs.orientation_by = OrientationBy::AsAsked;
            }
            Engine::new(body, options)
        };
        let planned = plan.explain().into_iter();
        let mut stages: Vec<Stage> = planned.map(|planned| Stage { planned, measured_us: None }).collect();
        let mut engines =
            rungs.iter().map(|rung| made(rung.outputs, rung.touches, &rung.letters)).collect::<Result<Vec<_>>>()?;
        // What is compared is what a run has: the scene as it is asked for.
        engines.extend((kind != BackendKind::Reference).then_some(engine));
        let (mut played, on) = played(asked, recorded, body, batch, &mut engines)?;
        let mut compared = (kind != BackendKind::Reference).then(|| engines.pop()).flatten();
        let us = measured(&mut engines, &mut played)?;
        let below = std::iter::once(0.0).chain(us.iter().copied());
        for ((rung, us), below) in rungs.iter().zip(&us).zip(below) {
            *stages[rung.stages.end - 1].measured_us.get_or_insert(0.0) += (us - below).max(0.0);
        }
        #[cfg(feature = "zenoh")]
        let network = match engines.last_mut() {
            Some(engine) => {
                super::network::Network::for_calls((asked, body), engine, &played.calls, recorded.is_some())?
            }
            None => None,
        };
        let names: BTreeSet<&str> = plan.fields().map(|field| field.name).collect();
        let of_letters = letters_by_field(&plan, body)?;
        let agreement = compared.as_mut().map(|engine| played.compared(engine)).transpose()?;
        Ok(Self {
            body: body.name.clone(),
            taxels: [taxels_read(&plan, body), body.taxels.len()],
            named_fields: [names.len(), of_letters.iter().filter(|letters| **letters > 0).count()],
            fields: [plan.fields().len(), of_letters.iter().sum()],
            letters: plan.letters().len(),
            memberships: plan.memberships(),
            bytes: [plan.bytes_up(), plan.bytes_down()],
            backend,
            knobs,
            kept_charts,
            kept,
            batch,
            stages,
            measured: Measured { on, whole_us: us[us.len() - 1], agreement },
            #[cfg(feature = "zenoh")]
            network,
        })
    }
}

/// How many of the taxels of `body` a letter of `plan` reads.
fn taxels_read(plan: &Plan, body: &Body) -> usize {
    let sensed = SensedTaxels::new(plan, body);
    let read: BTreeSet<usize> = plan.body_taxels.iter().copied().chain(sensed.all().map(|(taxel, ..)| taxel)).collect();
    read.len()
}

/// By field of `body`, of how many letters of `plan` it has taxels.
fn letters_by_field(plan: &Plan, body: &Body) -> Result<Vec<usize>> {
    let set = FieldSet::new(body)?;
    let has = |field: &Field, letter: &Letter| {
        field.members.iter().any(|member| letter.receptor.reads(body.taxels[member.taxel].modality))
    };
    let letters = |field: &Field| plan.letters().iter().filter(|letter| has(field, letter)).count();
    Ok(set.fields.iter().map(letters).collect())
}

/// The frames that `engines` are measured on, and what they are, in words.
fn played(
    asked: &Setup,
    recorded: Option<&Input>,
    body: &Body,
    batch: usize,
    engines: &mut [Engine],
) -> Result<(Played, String)> {
    let mut frames = Vec::new();
    let pressed = body.taxels.iter().filter(|taxel| taxel.modality.is_pressed()).count();
    let mut on = match pressed {
        0 => "with every taxel read",
        _ if pressed < body.taxels.len() => "with every taxel pressed or read",
        _ => "with every taxel pressed",
    }
    .to_owned();
    if let Some(input) = recorded {
        let mut source = input.open_posed(body, asked)?;
        let mut frame = Frame::missing(0.0, source.taxels().len());
        while frames.len() < batch.max(RECORDED_BATCH) && source.next_frame(&mut frame)? {
            frames.push(frame.clone());
        }
        if !frames.is_empty() {
            on = format!("on the first {} of {}", count(frames.len() as u64, "frame"), input.name);
            for engine in engines {
                engine.set_channels(source.taxels()).map_err(|e| e.at("header").at(&input.name))?;
            }
        }
    }
    if frames.is_empty() {
        frames = TestFrames::made_up(body, batch).frames;
    }
    Ok((Played { calls: frames.chunks(batch).map(<[Frame]>::to_vec).collect() }, on))
}
