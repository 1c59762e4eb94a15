//! `somatic tradeoff`: what each knob costs and gives, on one's own body, recording and machine.

mod measured;
mod settled;
mod write_scene;

use std::path::PathBuf;
use std::sync::atomic::Ordering;

use clap::Args;
use console::style;
use somatic::tradeoff::{CallMode, Errors, Measurement, Pick, Report, Store, measure, plot_png, plot_svg};
use somatic::{BackendKind, Engine, Error, OutputPath, Result};

use self::measured::{measure_options, missed, played, software};
use self::settled::driver;
pub(super) use self::settled::{Settled, settled};
use super::bar::Bar;
use super::files::FilesRead;
use super::input::Input;
use super::interrupt::stop_on_signal;
use super::plot_file::PlotFile;
use super::scene::{RunOptions, first, grouped};
use super::stdio::{DONE, FAILED, print, say};
use super::table::{plain, shown};
use super::words::{count, number};

const EXAMPLES: &str = "\
Examples:
  somatic tradeoff                                       the bundled touch on the bundled hand
  somatic tradeoff --source sim:examples/simulations/rod.toml --plot rod.svg     against the truth
  somatic tradeoff robot.scene.toml --within '0.5 mm, 2 deg' --write   the fastest within it
  somatic tradeoff robot.scene.toml --budget 100us                     the most accurate within it
  somatic tradeoff --body mat --source night.csv --json | jq '.rows[] | select(.front)'

Combinations of knobs take turns, so that a machine that slows down slows all of them. A front is
what no other combination beats: none is as true in both and faster. What is measured is kept, and
`somatic run` and `somatic plan` choose by it, on the same recording or live, where a scene leaves
the backend or the knobs to be chosen. docs/tradeoff.md says what to conclude.";

/// Frames that are measured on, unless told otherwise.
const FRAMES: usize = 512;
/// Values that these hold at most, about.
const VALUES: usize = 1 << 24;

/// Measure speed against accuracy, knob by knob, on your own body, recording and machine.
#[derive(Args)]
#[command(after_help = EXAMPLES, hide_possible_values = true, mut_args(grouped), mut_arg("within", first), mut_arg("budget", first))]
pub(super) struct Arguments {
    /// A TOML file whose keys are the flags below; a flag takes the place of its key; docs/scenes.md.
    #[arg(value_name = "SCENE")]
    scene: Option<PathBuf>,

    #[command(flatten)]
    asked: RunOptions,

    /// How long to measure, in seconds; more is steadier.
    #[arg(long, value_name = "S", default_value_t = 10.0)]
    seconds: f64,

    /// Measure on the source's first so many frames [default: 512, or as many as memory is well spent on].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    frames: Option<u32>,

    /// List every combination, also those that others beat.
    #[arg(long)]
    all: bool,

    /// Draw time against error, a .svg or .png file.
    #[arg(long, value_name = "FILE")]
    plot: Option<PathBuf>,

    /// Write the pick into the scene file, whose comments stay.
    #[arg(long)]
    write: bool,

    /// Print JSON.
    #[arg(long)]
    json: bool,
}

pub(super) fn tradeoff(arguments: &Arguments) -> Result<u8> {
    let asked = arguments.asked.with(arguments.scene.as_deref())?;
    let target = asked.accuracy.target();
    if !(arguments.seconds.is_finite() && arguments.seconds > 0.0) {
        return Err(Error::usage(format!("--seconds {} is not a time span; give seconds over 0", arguments.seconds)));
    }
    let mut outputs = FilesRead::of(&asked, arguments.scene.as_deref()).outputs(asked.force);
    let plot = arguments.plot.as_deref().map(|path| PlotFile::at(path, "--plot", &mut outputs)).transpose()?;
    let scene = match (&arguments.scene, arguments.write) {
        (None, true) => return Err(Error::usage("--write writes into a scene file; name one")),
        (Some(_), true) if target.is_empty() => {
            return Err(Error::usage("--write needs --within or --budget, which pick what to write"));
        }
        // The one input that is written: to change it is what is asked for.
        (Some(path), true) => Some((path, OutputPath::edit(path)?)),
        _ => None,
    };
    let input = Input::named(&asked)?;
    if !input.is_recording() {
        return Err(Error::usage("a trade is measured on a recording or a simulation; name one as --source"));
    }
    let body = input.body(&asked)?;
    let ids: Vec<u32> = body.taxels.iter().map(|taxel| taxel.id).collect();
    let options = asked.options(&body, &ids, 1)?;
    let most = arguments.frames.map_or_else(|| FRAMES.min(VALUES / ids.len().max(1)).max(8), |frames| frames as usize);
    let played = played(&input, &asked, &ids, most)?;
    let measure_options = measure_options(&asked, &options, arguments.seconds)?;
    let stop = stop_on_signal()?;
    let mut bar = Bar::new("measured");
    let report = measure(&body, &options, &played, &measure_options, &mut |share| {
        bar.show_with_time_left(share);
        !stop.load(Ordering::Relaxed)
    });
    drop(bar);
    let mut report = report?;
    report.left_out.extend(software().filter(|_| options.backend == BackendKind::Auto));
    // A run that was cut short, or with knobs that are held, is not what others would measure.
    if !stop.load(Ordering::Relaxed)
        && options.scene.knobs == somatic::scene::Knobs::default()
        && let Some(store) = Store::of_user()
        && let Some(recording) = input.recording()
        && let Err(e) = store.keep(&body, &options, &driver(), &recording, &report)
    {
        say(&format!("cannot save the measurements: {e}"));
    }
    let way = if asked.batch.is_some_and(|batch| batch > 1) { CallMode::Batch } else { CallMode::Live };
    let pick = if target.is_empty() { None } else { target.pick(&report, way) };
    if let Some(plot) = plot {
        plot.draw(|| plot_svg(&report), || plot_png(&report))?;
    }
    print(&if arguments.json { json(&report, pick.as_ref())? } else { text(&report, arguments.all) })?;
    let Some(pick) = pick else { return Ok(DONE) };
    let combination = pick.row.combination()?;
    if !pick.missed.is_empty() {
        say(&missed(&target, &pick)?);
        return Ok(FAILED);
    }
    say(&format!("{} for {}: {combination}; {:.2} µs a frame", picked(way), target.words(), pick.row.p50_us));
    if let Some((path, edit)) = scene {
        write_scene::write(edit, &settled::of_row(pick.row, &report)?, &target)?;
        say(&format!("written into {}", path.display()));
    }
    Ok(DONE)
}

fn picked(way: CallMode) -> String {
    format!("picked ({})", way.word())
}

fn json(report: &Report, pick: Option<&Pick<'_>>) -> Result<String> {
    let broken = |e: serde_json::Error| Error::failed(e.to_string());
    let mut value = serde_json::to_value(report).map_err(broken)?;
    if let Some(pick) = pick {
        value["pick"] = serde_json::to_value(pick.row).map_err(broken)?;
        value["missed"] = pick.missed.clone().into();
    }
    Ok(serde_json::to_string_pretty(&value).map_err(broken)? + "\n")
}

fn text(report: &Report, all: bool) -> String {
    let frames = count(report.frames as u64, "frame");
    let mut text = format!("{}, {frames} of {}\n", style(&report.body).bold(), report.source);
    text += &format!(
        "  {} of touched fields, {} ties left out of orientations\n",
        count(report.touched, "percept"),
        report.ties
    );
    for line in report.kept_charts.iter().chain(&report.left_out) {
        text += &format!("  not measured  {line}\n");
    }
    for way in CallMode::ALL {
        let rows = report.of(way);
        if rows.is_empty() {
            continue;
        }
        let listed: Vec<&&Measurement> = rows.iter().filter(|row| all || row.front).collect();
        let beaten = rows.len() - rows.iter().filter(|row| row.front).count();
        text += &format!(
            "\n{}: {} of {} combinations, of which {beaten} are beaten\n",
            way.word(),
            listed.len(),
            rows.len()
        );
        let headings = ["µs", "p99", "mm: rms", "p99", "worst", "°: rms", "p99", "worst"].into_iter();
        let of_truth = if report.truth { ["true mm: p99", "°: p99"] } else { [""; 2] };
        let mut table = plain(headings.chain(of_truth).chain(["combination"]), 0..10);
        for row in listed {
            let said = |value: f64, errors: &Errors| if errors.compared > 0 { number(value) } else { "–".to_owned() };
            let of_truth = |errors: &Option<Errors>| errors.map_or(String::new(), |errors| said(errors.p99, &errors));
            let mut cells = vec![number(row.p50_us), number(row.p99_us)];
            for errors in [&row.centroid_mm, &row.orientation_deg] {
                cells.extend([errors.rms, errors.p99, errors.worst].map(|value| said(value, errors)));
            }
            cells.extend([of_truth(&row.true_centroid_mm), of_truth(&row.true_orientation_deg)]);
            cells.push(row.combination().map_or(String::new(), |combination| combination.to_string()));
            table.add_row(cells.into_iter().map(|cell| if row.front { cell } else { style(cell).dim().to_string() }));
        }
        text += &shown(&table);
    }
    text
}

/// Says once which fields stay in charts that the scene does not ask for.
pub(super) fn say_kept(engine: &Engine) {
    for (name, why) in engine.kept_charts() {
        say(&format!("field `{name}` stays in the chart of the layout: {why}"));
    }
}
