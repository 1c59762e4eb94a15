//! `somatic plan`: what a scene costs, and what it leaves out.

use std::hint::black_box;
use std::path::PathBuf;
use std::time::Instant;

use clap::Args;
use comfy_table::ColumnConstraint;
use console::style;
use serde_json::{Value, json};
use somatic::scene::PlannedStage;
use somatic::tradeoff::Combination;
use somatic::{Agreement, BackendKind, Body, Engine, Error, Frame, Options, Outputs, RawValue, Result};

use super::input::Input;
use super::run::RECORDED_BATCH;
use super::scene::Asked;
use super::table::{plain, right, shown};
use super::tradeoff::{Settled, settled};
use super::words::count;
use super::{DONE, print};

const EXAMPLES: &str = "\
Examples:
  somatic plan robot.scene.toml
  somatic plan --body humanoid --fields 'left_arm/**' --outputs centroid
  somatic plan robot.scene.toml --json | jq '.stages[] | select(.runs) | [.stage, .us]'
  somatic plan --schema > scene.schema.json      for editors that know JSON Schema

Times are measured, now and here, on the source's first frames where it is a recording, else with every taxel pressed. A
stage's time is what a plan with it takes more than a plan without.";

/// Rounds that are measured, in which every plan has its turn.
const ROUNDS: usize = 15;
/// A round's turn, s.
const TURN_S: f64 = 2e-3;
/// Values that made-up frames hold, about.
const VALUES: usize = 1 << 22;
/// From the last frame to the first one of the next time, s.
const STEP_S: f64 = 0.01;

/// Say what a scene computes and what not, why, and what each stage costs.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Arguments {
    /// What is asked for, a TOML file; docs/scenes.md [default: the flags alone].
    #[arg(value_name = "SCENE")]
    scene: Option<PathBuf>,

    #[command(flatten)]
    asked: Asked,

    /// Print JSON: bytes of a frame, times of a frame in µs.
    #[arg(long)]
    json: bool,

    /// Print the JSON Schema of scene files, and nothing else.
    #[arg(long)]
    schema: bool,
}

pub(super) fn plan(arguments: &Arguments) -> Result<u8> {
    if arguments.schema {
        let schema = serde_json::to_string_pretty(&schemars::schema_for!(Asked));
        print(&(schema.map_err(|e| Error::failed(e.to_string()))? + "\n"))?;
        return Ok(DONE);
    }
    let asked = arguments.asked.with(arguments.scene.as_deref())?;
    let input = Input::named_or_none(&asked)?;
    let body = match &input {
        Some(input) => asked.body_for(input)?,
        None => super::load_body(asked.body.as_deref().unwrap_or("hand"))?,
    };
    let bill = Bill::of(&asked, input.as_ref(), &body)?;
    print(&if arguments.json { format!("{}\n", bill.json()) } else { bill.text() })?;
    Ok(DONE)
}

/// What a scene costs.
struct Bill {
    body: String,
    /// Of how many.
    taxels: [usize; 2],
    fields: [usize; 2],
    memberships: usize,
    bytes: [usize; 2],
    backend: (String, String, String),
    knobs: Combination,
    /// Fields that cannot have the charts that are asked for, and why.
    kept_charts: Vec<String>,
    /// What `somatic tradeoff` measured of this, and when.
    kept: Option<String>,
    /// Frames a call.
    batch: usize,
    on: String,
    stages: Vec<(PlannedStage, Option<f64>)>,
    /// A frame, µs.
    whole_us: f64,
    /// None on the reference.
    agreement: Option<Agreement>,
}

impl Bill {
    fn of(asked: &Asked, input: Option<&Input>, body: &Body) -> Result<Self> {
        let ids: Vec<u32> = body.taxels.iter().map(|taxel| taxel.id).collect();
        let recorded = input.filter(|input| input.is_recording());
        let gather = recorded.is_some() && asked.speed.is_none();
        let batch = asked.batch.map_or(if gather { RECORDED_BATCH } else { 1 }, |batch| batch as usize);
        let Settled { options, why: picked, measured: kept } = settled(asked, input, body, batch)?;
        let mut engine = Engine::new(body, options.clone())?;
        let mut source = recorded.map(|input| input.open(&ids, asked)).transpose()?;
        let mut frames = Vec::new();
        if let (Some(source), Some(input)) = (&mut source, recorded) {
            engine.listen(source.taxels()).map_err(|e| e.at("header").at(&input.name))?;
            let mut frame = Frame::missing(0.0, source.taxels().len());
            while frames.len() < batch.max(RECORDED_BATCH) && source.next_frame(&mut frame)? {
                frames.push(frame.clone());
            }
        }
        let on = match frames.len() {
            0 => "with every taxel pressed".to_owned(),
            some => format!("on the first {} of {}", count(some as u64, "frame"), input.map_or("", |i| &i.name)),
        };
        let listened: Option<Vec<u32>> = source.filter(|_| !frames.is_empty()).map(|s| s.taxels().to_vec());
        if frames.is_empty() {
            frames = pressed(ids.len(), batch);
        }
        let (name, what, why) = engine.backend();
        let backend = (name.to_owned(), what, picked.unwrap_or_else(|| why.to_owned()));
        let kind: BackendKind = name.parse()?;
        let made = |scene_outputs: Outputs| -> Result<Engine> {
            let mut options = Options { backend: kind, ..options.clone() };
            options.scene.outputs = scene_outputs;
            let mut engine = Engine::new(body, options)?;
            listened.as_ref().map_or(Ok(()), |ids| engine.listen(ids))?;
            Ok(engine)
        };
        let plan = engine.plan();
        let explained = plan.explain();
        // A plan a stage, each with one more of those that run.
        let mut outputs = plan.outputs() & Outputs::TOTAL;
        if outputs.is_empty() {
            outputs = Outputs::TOTAL;
        }
        let mut engines = vec![made(outputs)?];
        let mut timed = vec![None; explained.len()];
        for (index, stage) in explained.iter().enumerate() {
            let more = if stage.name == "contact" { stage.gives } else { stage.gives & plan.outputs() };
            // What only serves others comes with the first of those that it serves.
            if stage.runs && !(plan.outputs() & more).is_empty() && stage.name != "contact" {
                outputs |= plan.outputs() & more;
                engines.push(made(outputs)?);
                timed[index] = Some(engines.len() - 1);
            }
        }
        let fields = [plan.fields().len(), body.fields.len() * plan.letters().len()];
        let knobs = Combination { backend: kind, knobs: plan.knobs() };
        let kept_charts = engine.kept_charts().map(|(name, why)| format!("{name}: {why}")).collect();
        let (channels, memberships) = (plan.channels(), plan.memberships());
        let bytes = [plan.bytes_up(), plan.bytes_down()];
        let mut frames = Played { calls: frames.chunks(batch).map(<[Frame]>::to_vec).collect() };
        let us = measured(&mut engines, &mut frames)?;
        let stages = explained.into_iter().zip(&timed).map(|(stage, timed)| {
            let took = match (stage.name, timed) {
                ("contact", _) => Some(us[0]),
                (_, Some(last)) => Some((us[*last] - us[last - 1]).max(0.0)),
                _ => None,
            };
            (stage, took)
        });
        let agreement = (kind != BackendKind::Reference)
            .then(|| frames.compared(&mut made(engine.plan().outputs())?))
            .transpose()?;
        Ok(Self {
            body: body.name.clone(),
            taxels: [channels, body.taxels.len()],
            fields,
            memberships,
            bytes,
            backend,
            knobs,
            kept_charts,
            kept,
            batch,
            on,
            stages: stages.collect(),
            whole_us: us[us.len() - 1],
            agreement,
        })
    }

    fn text(&self) -> String {
        let mut text = format!("{}\n", style(&self.body).bold());
        let mut line = |what: &str, value: String| text += &format!("  {what:<12}{value}\n");
        line("fields", format!("{} of {}", self.fields[0], self.fields[1]));
        line("taxels", format!("{} of {} are read", self.taxels[0], self.taxels[1]));
        line("memberships", self.memberships.to_string());
        line(
            "a frame",
            format!("{} B up, {} B down, {:.2} µs {}", self.bytes[0], self.bytes[1], self.whole_us, self.on),
        );
        let (name, what, why) = &self.backend;
        line("backend", format!("{name} ({what}): {why}; {} a call", count(self.batch as u64, "frame")));
        let [_, knobs @ ..] = self.knobs.words();
        line("knobs", knobs.join(", "));
        if let Some(kept) = &self.kept {
            line("measured", kept.clone());
        }
        self.kept_charts.iter().for_each(|kept| line("kept chart", kept.clone()));
        if let Some(agreement) = &self.agreement {
            line("accuracy", accuracy(agreement));
        }
        let mut table = plain(["stage", "over", "memberships", "µs a frame", "where", "why"]);
        table.set_constraints((0..5).map(|_| ColumnConstraint::ContentWidth));
        for column in 1..4 {
            right(&mut table, column);
        }
        for (stage, us) in &self.stages {
            let number = |count: usize| if count == 0 { String::new() } else { count.to_string() };
            let place = if stage.on_host { "host" } else { &self.backend.0 };
            let over = if ["calibrate", "change"].contains(&stage.name) { "value" } else { "field" };
            table.add_row([
                stage.name.to_owned(),
                if stage.runs { count(stage.over as u64, over) } else { "–".to_owned() },
                number(stage.memberships),
                us.map_or(String::new(), |us| format!("{us:.3}")),
                if stage.runs { place.to_owned() } else { String::new() },
                stage.why.clone(),
            ]);
        }
        text + "\n" + &shown(&table)
    }

    fn knobs_json(&self) -> Value {
        let [_, arithmetic, charts, orientation_by, coverage, cadence] = self.knobs.words();
        json!({
            "arithmetic": arithmetic,
            "charts": charts,
            "orientation_by": orientation_by,
            "coverage": coverage,
            "cadence": cadence,
        })
    }

    fn json(&self) -> Value {
        let (name, what, why) = &self.backend;
        let stages: Vec<Value> = self
            .stages
            .iter()
            .map(|(stage, us)| {
                json!({
                    "stage": stage.name,
                    "runs": stage.runs,
                    "why": stage.why,
                    "where": if stage.on_host { "host" } else { "backend" },
                    "over": stage.over,
                    "memberships": stage.memberships,
                    "us": us.map(rounded),
                })
            })
            .collect();
        let mut bill = json!({
            "body": self.body,
            "fields": self.fields[0],
            "of_fields": self.fields[1],
            "taxels": self.taxels[0],
            "of_taxels": self.taxels[1],
            "memberships": self.memberships,
            "bytes_up": self.bytes[0],
            "bytes_down": self.bytes[1],
            "backend": name,
            "adapter": what,
            "why": why,
            "knobs": self.knobs_json(),
            "kept_charts": self.kept_charts,
            "measured": self.kept,
            "batch": self.batch,
            "us": rounded(self.whole_us),
            "stages": stages,
        });
        if let Some(agreement) = &self.agreement {
            let errors = agreement.quantities.iter().map(|(name, of)| (name.clone(), of.worst_error.into()));
            bill["worst_errors"] = Value::Object(errors.collect());
            bill["agrees"] = agreement.holds().into();
        }
        bill
    }
}

fn rounded(us: f64) -> f64 {
    (us * 1e3).round() / 1e3
}

/// What single precision costs, in the units that people think in.
fn accuracy(agreement: &Agreement) -> String {
    let worst = |name: &str| agreement.quantities.get(name).filter(|of| of.compared > 0).map(|of| of.worst_error);
    let mut words = Vec::new();
    if let Some(metres) = worst("centroid") {
        words.push(format!("centroid within {:.1e} mm", metres * 1e3));
    }
    for name in ["orientation", "axis", "direction"] {
        if let Some(radians) = worst(name) {
            words.push(format!("{name} within {:.1e}°", radians.to_degrees()));
        }
    }
    let verdict =
        if agreement.holds() { "as the reference, to rounding" } else { "NOT as the reference; run --verify" };
    if words.is_empty() { verdict.to_owned() } else { format!("{verdict}: {}", words.join(", ")) }
}

/// Frames in which every one of `taxels` is pressed, each time otherwise: enough for a call of `batch`, and for motion.
pub(super) fn pressed(taxels: usize, batch: usize) -> Vec<Frame> {
    let frames = batch.max((VALUES / taxels.max(1)).clamp(2, 64));
    let value = |index: usize, frame: usize| RawValue::new(((index * 7 + frame * 131) % 977 + 1) as f64);
    let values = |frame| (0..taxels).map(|index| value(index, frame)).collect();
    let frame = |frame: usize| Frame { t_s: frame as f64 * 0.01, values: values(frame), pose: Vec::new() };
    (0..frames).map(frame).collect()
}

/// Frames as calls get them, again and again, in a time that goes on.
struct Played {
    calls: Vec<Vec<Frame>>,
}

impl Played {
    /// Puts all frames after what was.
    fn again(&mut self) {
        let times = || self.calls.iter().flatten().map(|frame| frame.t_s);
        let (first, last) = (times().fold(f64::INFINITY, f64::min), times().fold(f64::NEG_INFINITY, f64::max));
        let later = last - first + STEP_S;
        self.calls.iter_mut().flatten().for_each(|frame| frame.t_s += later);
    }

    fn compared(&mut self, engine: &mut Engine) -> Result<Agreement> {
        let mut sum = Agreement::default();
        for frames in &self.calls {
            sum.merge(engine.process_and_compare(frames)?.1);
        }
        Ok(sum)
    }
}

/// The median time of a frame on each of `engines`, which take turns, µs.
fn measured(engines: &mut [Engine], played: &mut Played) -> Result<Vec<f64>> {
    let mut times = vec![Vec::with_capacity(ROUNDS); engines.len()];
    for round in 0..=ROUNDS {
        for (engine, times) in engines.iter_mut().zip(&mut times) {
            let (mut took_s, mut frames) = (0.0, 0);
            while took_s < TURN_S {
                played.again();
                let start = Instant::now();
                for call in &played.calls {
                    black_box(engine.process(black_box(call))?);
                    frames += call.len();
                }
                took_s += start.elapsed().as_secs_f64();
            }
            // The first round warms up.
            if round > 0 {
                times.push(took_s * 1e6 / frames as f64);
            }
        }
    }
    let median = |mut times: Vec<f64>| {
        times.sort_by(f64::total_cmp);
        times[times.len() / 2]
    };
    Ok(times.into_iter().map(median).collect())
}
