//! The touch that a picture shows.

use std::path::{Path, PathBuf};

use clap::Args;
use somatic::field::Field;
use somatic::picture::{Moment, Options, TouchPicture, View};
use somatic::scene::Coordinates;
use somatic::signal::Quantity;
use somatic::{BackendKind, Body, Engine, Error, Frame, Percept, Result, Scene};

use super::super::bar::Bar;
use super::super::input::Input;
use super::super::scene::RunOptions;

/// Pictures of an animation at most: each is held in memory.
const MAX_PICTURES: usize = 1000;
/// Sides that a touch is shown from, unless others are asked for.
const MAX_SIDES: usize = 2;
/// Endings of recordings, which bodies do not have.
const RECORDINGS: [&str; 7] = ["mcap", "csv", "asf", "lst", "asc", "txt", "tsv"];

/// Which touch.
#[derive(Args)]
pub(super) struct Flags {
    /// Show the pressures and percepts of this recording: csv:FILE, mcap:FILE or sim:FILE.toml.
    #[arg(long, value_name = "SOURCE", conflicts_with_all = ["uv", "fields"])]
    source: Option<String>,

    /// The calibration of the sensors, a TOML file [default: the source's own, if it has one].
    #[arg(long, value_name = "FILE")]
    calibration: Option<PathBuf>,

    /// The time to show, in seconds [default: where most is pressed].
    #[arg(long, value_name = "S", conflicts_with_all = ["from", "to"])]
    at: Option<f64>,

    /// Show an animation from this time on, in seconds.
    #[arg(long, value_name = "S")]
    from: Option<f64>,

    /// Show an animation up to this time, in seconds.
    #[arg(long, value_name = "S")]
    to: Option<f64>,

    /// Pictures a second of an animation.
    #[arg(long, value_name = "HZ", default_value_t = 12.0)]
    rate: f64,
}

/// What is shown of one frame.
struct Shown {
    t_s: f64,
    pressures: Vec<Option<f64>>,
    percepts: Vec<(usize, Percept)>,
}

impl Flags {
    /// What is shown: the body `named`, with the source if there is one; or a recording of that name with its own body.
    pub(super) fn asked(&self, named: Option<&str>) -> Result<RunOptions> {
        let is_recording = |name: &&str| {
            let ending = Path::new(name).extension().map(|ending| ending.to_string_lossy().to_ascii_lowercase());
            name.starts_with("sim:") || ending.is_some_and(|ending| RECORDINGS.contains(&&*ending))
        };
        let recording = named.filter(is_recording);
        if let (Some(recording), Some(source)) = (recording, &self.source) {
            return Err(Error::usage(format!("`{recording}` and --source {source}: give one of them")));
        }
        let sources: Vec<String> = recording.or(self.source.as_deref()).map(str::to_owned).into_iter().collect();
        let given = [
            ("--calibration", self.calibration.is_some()),
            ("--at", self.at.is_some()),
            ("--from", self.from.is_some()),
            ("--to", self.to.is_some()),
        ];
        if let Some((flag, _)) = given.into_iter().find(|(_, given)| *given && sources.is_empty()) {
            return Err(Error::usage("it is about a touch: give its recording with --source").at(flag));
        }
        let body = named.filter(|_| recording.is_none()).map(str::to_owned);
        Ok(RunOptions { sources, body, calibration: self.calibration.clone(), ..RunOptions::default() })
    }

    /// A PNG of `body` with the touch that is `asked` for.
    pub(super) fn draw(
        &self,
        asked: &RunOptions,
        body: &Body,
        fields: &[Field],
        mut options: Options,
        ids: bool,
    ) -> Result<Vec<u8>> {
        if !(self.rate > 0.0 && self.rate <= 100.0) {
            return Err(Error::usage(format!("--rate {} is not a rate of pictures; give up to 100 Hz", self.rate)));
        }
        if asked.sources.is_empty() {
            let pressures = vec![Some(0.0); body.taxels.len()];
            let picture = TouchPicture::new(body, fields, &options, ids)?;
            let moment = Moment { pressures: &pressures, max_pressure: None, unit: "", percepts: &[], t_s: None };
            return picture.png(&[picture.draw(&moment)?], 1.0);
        }
        let (shown, max_pressure, quantity) = self.shown(asked, body, fields)?;
        let (factor, unit) = quantity.readable(max_pressure);
        let max_pressure = max_pressure * factor;
        if options.views.is_empty() {
            let pressed = |taxel: &usize| shown.iter().any(|shown| shown.pressures[*taxel] > Some(0.0));
            let normals = (0..body.taxels.len()).filter(pressed).map(|taxel| {
                let taxel = &body.taxels[taxel];
                body.links[taxel.link].world_from_link.transform_vector3(taxel.normal_in_link)
            });
            options.views = View::best(&normals.collect::<Vec<_>>());
            options.views.truncate(MAX_SIDES);
        }
        let picture = TouchPicture::new(body, fields, &options, ids)?;
        let mut bar = Bar::new("drawing");
        let mut pictures = Vec::with_capacity(shown.len());
        for (index, Shown { t_s, pressures, percepts }) in shown.iter().enumerate() {
            let pressures: Vec<Option<f64>> = pressures.iter().map(|p| p.map(|p| p * factor)).collect();
            let moment =
                Moment { pressures: &pressures, max_pressure: Some(max_pressure), unit, percepts, t_s: Some(*t_s) };
            pictures.push(picture.draw(&moment)?);
            bar.show_with_time_left((index + 1) as f64 / shown.len() as f64);
        }
        picture.png(&pictures, 1.0 / self.rate)
    }

    /// The frames to show, the largest pressure of the whole recording, and what it is.
    fn shown(&self, asked: &RunOptions, body: &Body, fields: &[Field]) -> Result<(Vec<Shown>, f64, Quantity)> {
        let ids: Vec<u32> = body.taxels.iter().map(|taxel| taxel.id).collect();
        let input = Input::named(asked)?;
        if !input.is_recording() {
            return Err(Error::usage("a picture is of a recording; record the touch first").at(&input.name));
        }
        let mut source = input.open(&ids, asked)?;
        let options = asked.options(body, &ids, 1)?;
        let scene: Scene = options.scene.clone().coordinates(Coordinates::Anchor);
        let mut engine = Engine::new(body, options.scene(scene).backend(BackendKind::Cpu))?;
        engine.set_channels(source.taxels()).map_err(|e| e.at("header").at(&input.name))?;
        let drawn = marked(&engine, fields);
        let animated = self.from.is_some() || self.to.is_some();
        let (from_s, to_s) = match self.at {
            Some(t_s) => (f64::NEG_INFINITY, t_s),
            None => (self.from.unwrap_or(f64::NEG_INFINITY), self.to.unwrap_or(f64::INFINITY)),
        };
        let mut frame = Frame::missing(0.0, source.taxels().len());
        let (mut shown, mut max_pressure) = (Vec::<Shown>::new(), 0.0_f64);
        let (mut next_s, mut most) = (f64::NEG_INFINITY, f64::NEG_INFINITY);
        let mut list = Vec::new();
        while source.next_frame(&mut frame)? {
            let percepts = engine.process_one(&frame)?;
            let of_frame: Vec<(usize, Percept)> =
                percepts.touched(0).filter_map(|percept| Some((drawn[percept.field]?, percept))).collect();
            engine.pressures(&frame, &mut list);
            let sum: f64 = list.iter().map(|&(_, pressure)| pressure).sum();
            max_pressure = list.iter().map(|&(_, pressure)| pressure).fold(max_pressure, f64::max);
            if !(from_s..=to_s).contains(&frame.t_s) {
                continue;
            }
            // The last one up to a time, every one that is due, or the one where most is pressed.
            // A picture may be early by less than recordings tell times apart.
            let is_due = if animated { frame.t_s >= next_s - 1e-6 } else { self.at.is_some() || sum > most };
            if !is_due {
                continue;
            }
            next_s = if next_s.is_finite() { next_s + 1.0 / self.rate } else { frame.t_s + 1.0 / self.rate };
            most = sum;
            if !animated {
                shown.clear();
            } else if shown.len() == MAX_PICTURES {
                return Err(Error::usage(format!(
                    "over {MAX_PICTURES} pictures; choose a shorter part or a lower --rate"
                )));
            }
            let mut pressures = vec![None; ids.len()];
            for &(id, pressure) in &list {
                if let Ok(taxel) = ids.binary_search(&id) {
                    pressures[taxel] = Some(pressure);
                }
            }
            shown.push(Shown { t_s: frame.t_s, pressures, percepts: of_frame });
        }
        if shown.is_empty() {
            return Err(Error::usage("the recording has no frames at that time").at(&input.name));
        }
        let quantity = engine.plan().common_quantity().unwrap_or_default();
        Ok((shown, if max_pressure > 0.0 { max_pressure } else { 1.0 }, quantity))
    }
}

/// By field of the engine's plan, its index in `fields` if it is marked: the largest fields with charts, and fields without
/// children in none of those.
fn marked(engine: &Engine, fields: &[Field]) -> Vec<Option<usize>> {
    let above = |index: usize| std::iter::successors(fields[index].parent, |&parent| fields[parent].parent);
    let index = |name: &str| {
        let index = fields.iter().position(|field| field.name == name)?;
        let is_leaf = fields.iter().all(|field| field.parent != Some(index));
        let within_another = above(index).any(|parent| fields[parent].chart.is_ok());
        ((fields[index].chart.is_ok() || is_leaf) && !within_another).then_some(index)
    };
    engine.plan().fields().map(|(name, _)| index(name)).collect()
}
