//! `somatic plot`: a recording as a picture.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

use clap::Args;
use somatic::internal::plot::{Gathered, Gatherer, outputs_for, png, svg, wanted_of};
use somatic::internal::run::left_out;
use somatic::internal::scene::AskedOutputs;
use somatic::internal::scene_file::seconds;
use somatic::internal::setup::FilesRead;
use somatic::internal::setup::RECORDED_BATCH;
use somatic::internal::setup::Setup;
use somatic::internal::signal::Channel;
use somatic::percept::Unit;
use somatic::signal::Quantity;
use somatic::{BackendKind, COLUMNS, Engine, Error, Frame, Outputs, Result};

use super::bar::Bar;
use super::exports::ExportFlags;
use super::interrupt::stop_soon_on_signal;
use super::plot_file::PlotFile;
use super::scene::{input, output, set_up};
use super::stdio::{DONE, say, tell_losses};

const EXAMPLES: &str = "\
Examples:
  somatic plot -o touch.svg                          the bundled touch on the bundled hand
  somatic plot --body insole.glb walk.csv -o walk.png
  somatic plot touch.mcap --from 60s --to 90s --outputs total,speed,orientation -o minute.svg
  somatic plot --body mat before.csv after.csv -o compared.png     side by side, with one scale
  somatic plot touch.mcap --fields 'hand/palm*' -o palm.svg

Above, quantities over time: load and area, or the --outputs. Below, for each field with a
chart, the highest pressure that each taxel felt, with the path of the centre of pressure from its
first contact (ring) to its last (dot), and the pressure–time integral. All recordings have the
same scales. Without --fields, it shows the topmost fields, or the fields below a single one.";

/// Most recordings of a plot.
const MAX_RECORDINGS: usize = 8;

/// Draw recordings: load over time, highest pressures, path of the centre.
///
/// Also the area in contact and pressure–time integrals.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Arguments {
    /// The recordings: csv:FILE, mcap:FILE or sim:FILE.toml, a pressure system's export, or just the file [default: a
    /// bundled touch].
    #[arg(value_name = "SOURCE")]
    sources: Vec<String>,

    /// The robot's body: a .glb or .gltf file, or the bundled hand, sensing-hand, mat or humanoid [default: the recording's own, or hand].
    #[arg(long, value_name = "BODY")]
    body: Option<String>,

    /// The calibration of the sensors, a TOML file [default: the recording's own].
    #[arg(long, value_name = "FILE")]
    calibration: Option<PathBuf>,

    /// Show only the fields whose names match, such as 'hand/palm*'; may be repeated [default: the topmost].
    #[arg(long, value_name = "GLOB")]
    fields: Vec<String>,

    /// Plot these quantities over time instead of load and area.
    #[arg(long, value_name = "OUTPUT,...", value_delimiter = ',', value_parser = output, help = plot_outputs_help())]
    outputs: Vec<Outputs>,

    #[command(flatten)]
    export: ExportFlags,

    /// Begin at this time after the recording's start, such as 60s [default: 0].
    ///
    /// A bare number is in seconds. The axis has the recording's own times.
    #[arg(long, value_name = "TIME", value_parser = seconds)]
    from: Option<f64>,

    /// End at this time after the recording's start, such as 90s [default: its end].
    ///
    /// A bare number is in seconds.
    #[arg(long, value_name = "TIME", value_parser = seconds)]
    to: Option<f64>,

    /// The plot to write, .svg or .png.
    #[arg(short, long, value_name = "PLOT")]
    output: PathBuf,

    /// Replace the output if it is there.
    #[arg(long)]
    force: bool,
}

fn plot_outputs_help() -> String {
    let names: Vec<&str> = COLUMNS.iter().map(|column| column.name).collect();
    format!(
        "Plot these quantities over time: {} [default: load and area, or what taxels measure that are not pressed]",
        names.join(", ")
    )
}

pub(super) fn plot(arguments: &Arguments) -> Result<u8> {
    let wanted = arguments.outputs.iter().fold(Outputs::empty(), |all, &one| all | one);
    if arguments.sources.len() > MAX_RECORDINGS {
        return Err(Error::usage(format!("at most {MAX_RECORDINGS} recordings have room side by side")));
    }
    let runs: Vec<Setup> = match &arguments.sources[..] {
        [] => vec![asked(arguments, None, wanted)?],
        sources => sources.iter().map(|source| asked(arguments, Some(source), wanted)).collect::<Result<_>>()?,
    };
    let read = runs.iter().fold(FilesRead::default(), |read, asked| {
        read.files(asked.calibration.iter().chain(&asked.layout))
            .files(&asked.map)
            .bodies(&asked.body)
            .sources(&asked.sources)
    });
    let mut outputs = read.outputs(arguments.force);
    let file = PlotFile::at(&arguments.output, "-o", &mut outputs)?;
    let stop = stop_soon_on_signal()?;
    let (mut all, mut losses) = (Vec::new(), Vec::new());
    for asked in &runs {
        let (gathered, lost) = gather(asked, wanted, &stop, &arguments.output)?;
        losses.extend(lost);
        match gathered {
            Some(gathered) => all.push(gathered),
            None => return Ok(tell_losses(&losses)),
        }
    }
    file.draw(|| svg(&all), || png(&all))?;
    say(&format!("{} is drawn", arguments.output.display()));
    Ok(if losses.is_empty() { DONE } else { tell_losses(&losses) })
}

/// What is run for the recording `source`.
fn asked(arguments: &Arguments, source: Option<&String>, wanted: Outputs) -> Result<Setup> {
    let mut scene = arguments.export.keys();
    scene.body.clone_from(&arguments.body);
    scene.sources = source.map(|source| source.parse()).transpose()?.into_iter().collect();
    scene.fields.clone_from(&arguments.fields);
    scene.outputs = vec![AskedOutputs::from(outputs_for(wanted))];
    scene.calibration.clone_from(&arguments.calibration);
    scene.backend = Some(BackendKind::Cpu);
    (scene.from_s, scene.to_s) = (arguments.from, arguments.to);
    Ok(set_up(scene))
}

/// Runs a recording and keeps what is plotted of it, unless it was interrupted and the plot `to` is not drawn; also gives what of
/// the source was never processed.
fn gather(asked: &Setup, wanted: Outputs, stop: &AtomicBool, to: &Path) -> Result<(Option<Gathered>, Vec<String>)> {
    let input = input(asked)?;
    if !input.is_recording() {
        return Err(Error::usage("only recordings are plotted; record what is live with `somatic run`").at(&input.name));
    }
    let body = input.body(asked)?;
    let ids: Vec<u32> = body.taxels.iter().map(|taxel| taxel.id).collect();
    let mut source = input.open(&Channel::all_of(&body), asked)?;
    source.report_stale();
    let [wanted, computed] = wanted_of(&body, &asked.fields, wanted)?;
    let mut options = asked.options(&body, &ids, RECORDED_BATCH)?;
    options.scene.outputs = computed;
    let mut engine = Engine::new(&body, options)?;
    engine.set_channels(source.taxels()).map_err(|e| e.at("header").at(&input.name))?;
    let p_unit = engine.plan().common_quantity().map_or(Unit::P.symbol(), Quantity::symbol);
    let gatherer = Gatherer::new(&input.name, &body, &engine, wanted, !asked.fields.is_empty())?;
    let mut gatherer = gatherer.with_p_unit(p_unit);
    let mut bar = Bar::new("reading");
    let width = source.taxels().len();
    let (mut seen, mut last_s) = (0, 0.0);
    let mut frames: Vec<Frame> = Vec::with_capacity(RECORDED_BATCH);
    loop {
        frames.clear();
        while frames.len() < RECORDED_BATCH {
            let mut frame = Frame::missing(0.0, width);
            if !source.next_frame(&mut frame)? {
                break;
            }
            frames.push(frame);
        }
        if frames.is_empty() {
            break;
        }
        if stop.load(Ordering::Relaxed) {
            let absent = [to.display().to_string()];
            let left = left_out(&input.name, seen, last_s, source.progress(), &absent);
            return Ok((None, [source.losses(), vec![left]].concat()));
        }
        (seen, last_s) = (seen + frames.len() as u64, frames[frames.len() - 1].t_s);
        engine.process(&frames)?;
        gatherer.see(&engine, &frames);
        bar.show(source.progress().unwrap_or(0.0));
    }
    source.notices().iter().for_each(|notice| say(notice));
    Ok((Some(gatherer.finish()), source.losses()))
}
