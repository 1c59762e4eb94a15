//! The touches that a picture shows.

use std::path::{Path, PathBuf};

use clap::Args;
use somatic::field::Field;
use somatic::internal::scene_file::{hertz, seconds};
use somatic::internal::setup::Setup;
use somatic::internal::signal::{Channel, Receptor};
use somatic::picture::{
    Moment, Moments, Options, Picture, Times, TouchPicture, letters_of, part_of, shown_letter, usual_letter,
};
use somatic::scene::Coordinates;
use somatic::scene::file::SceneFile;
use somatic::{BackendKind, Body, Engine, Error, Frame, Outputs, Result, Scene};

use super::super::bar::Bar;
use super::super::stdio::say;

/// Endings of recordings, which bodies do not have.
const RECORDINGS: [&str; 8] = ["mcap", "csv", "asf", "lst", "asc", "txt", "tsv", "gz"];

/// Which touch.
#[derive(Args)]
pub(super) struct Flags {
    /// Show the pressures and touches of this recording: csv:FILE, mcap:FILE or sim:FILE.toml.
    #[arg(long, value_name = "SOURCE", conflicts_with = "fields")]
    source: Option<String>,

    /// The calibration of the sensors, a TOML file [default: the source's own, if it has one].
    #[arg(long, value_name = "FILE")]
    calibration: Option<PathBuf>,

    /// What taxels are coloured by: pressure, shear, temperature or proximity [default: pressure if there is any].
    ///
    /// Taxels with three axes have arrows of their tangential forces with pressure and shear.
    #[arg(long, value_name = "LETTER", value_parser = shown_letter)]
    letter: Option<Receptor>,

    /// The time to show, such as 2.9s [default: when most is pressed or pulled, or it is warmest, or nearest].
    ///
    /// A bare number is in seconds. It is compared with the times of the recording's frames, which need not begin at 0.
    #[arg(long, value_name = "TIME", value_parser = seconds, conflicts_with_all = ["from", "to"])]
    at: Option<f64>,

    /// Show an animation from this time on, such as 1s.
    ///
    /// A bare number is in seconds. It is compared with the times of the recording's frames, which need not begin at 0.
    #[arg(long, value_name = "TIME", value_parser = seconds)]
    from: Option<f64>,

    /// Show an animation up to this time, such as 4s.
    ///
    /// A bare number is in seconds. It is compared with the times of the recording's frames, which need not begin at 0.
    #[arg(long, value_name = "TIME", value_parser = seconds)]
    to: Option<f64>,

    /// Pictures per second of an animation.
    ///
    /// A bare number is in Hz.
    #[arg(long, value_name = "RATE", default_value = "12Hz", value_parser = hertz)]
    rate: f64,
}

impl Flags {
    /// What is shown: the body `named`, with the source if there is one; or a recording of that name with its own body.
    pub(super) fn asked(&self, named: Option<&str>) -> Result<Setup> {
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
            ("--letter", self.letter.is_some()),
            ("--at", self.at.is_some()),
            ("--from", self.from.is_some()),
            ("--to", self.to.is_some()),
        ];
        if let Some((flag, _)) = given.into_iter().find(|(_, given)| *given && sources.is_empty()) {
            return Err(Error::usage("it is about a touch: give its recording with --source").at(flag));
        }
        let body = named.filter(|_| recording.is_none()).map(str::to_owned);
        let mut scene = SceneFile::default();
        scene.sources = sources.iter().map(|source| source.parse()).collect::<Result<_>>()?;
        (scene.body, scene.calibration) = (body, self.calibration.clone());
        Ok(crate::cli::scene::set_up(scene))
    }

    /// A PNG of `body` with the touch that is `asked` for; of the chart of one of the `fields` where there is one.
    pub(super) fn draw(
        &self,
        asked: &Setup,
        body: &Body,
        (fields, chart): (&[Field], Option<usize>),
        options: &Options,
        ids: bool,
    ) -> Result<Vec<u8>> {
        let times = match (self.at, self.from, self.to) {
            (Some(t_s), ..) => Times::At(t_s),
            (None, None, None) => Times::Most,
            (None, from, to) => Times::Span {
                from_s: from.unwrap_or(f64::NEG_INFINITY),
                to_s: to.unwrap_or(f64::INFINITY),
                rate_hz: self.rate,
            },
        };
        times.check().map_err(|e| e.at("--rate"))?;
        let part = part_of(body, fields, chart, options.look_at.as_deref())?;
        let taxels: Vec<u32> = body.taxels.iter().map(|taxel| taxel.id).collect();
        let input = crate::cli::scene::input(asked)?;
        if !input.is_recording() {
            return Err(Error::usage("a picture is of a recording; record the touch first").at(&input.name));
        }
        let mut source = input.open(&Channel::all_of(body), asked)?;
        let engine_options = asked.options(body, &taxels, 1)?;
        // Pictures are of the body at rest, and show touches whatever else is computed.
        let scene: Scene = engine_options.scene.clone().outputs(Outputs::TOTAL).coordinates(Coordinates::Anchor);
        let letter = self.letter.unwrap_or_else(|| usual_letter(body, fields));
        let letters = letters_of(body, fields, letter);
        let has_pressure = letters.iter().any(|letter| letter.receptor == Receptor::Sustained);
        let touches = scene.touches.unwrap_or_default();
        let scene = scene.letters(letters);
        let scene = scene.touches(has_pressure.then_some(touches));
        let mut engine = Engine::new(body, engine_options.scene(scene).backend(BackendKind::Cpu))?;
        engine.set_channels(source.taxels()).map_err(|e| e.at("header").at(&input.name))?;
        let width = source.taxels().len();
        let mut bar = Bar::new("reading");
        let frames = std::iter::from_fn(|| {
            let mut frame = Frame::missing(0.0, width);
            bar.show(source.progress().unwrap_or(0.0));
            source.next_frame(&mut frame).map(|is_there| is_there.then_some(frame)).transpose()
        });
        let shown = (letter, times, &part[..]);
        let moments = Moments::compute(&mut engine, body, shown, &input.name, frames)?;
        source.notices().iter().for_each(|notice| say(notice));
        let mut bar = Bar::new("drawing");
        let progress = |share| {
            bar.show_with_time_left(share);
            true
        };
        let pictures = match chart {
            Some(index) => moments.draw_chart(body, (fields, index), options, ids, progress),
            None => moments.draw(body, fields, options, ids, progress),
        };
        Picture::animation(&pictures?, times.picture_s())
    }
}

/// A PNG of `body` without a touch, its taxels labelled with their ids.
pub(super) fn without(body: &Body, fields: &[Field], options: &Options) -> Result<Vec<u8>> {
    let values = vec![Some(0.0); body.taxels.len()];
    let moment = Moment::of_pressures(&values);
    TouchPicture::new(body, fields, options, true)?.draw(&moment)?.png()
}
