//! `somatic tradeoff`: what each option costs and gives, on one's own body, recording and machine.

mod measured;
mod settled;

use std::path::PathBuf;
use std::sync::atomic::Ordering;

use clap::Args;
use console::style;
use somatic::internal::scene_file::seconds;
use somatic::internal::setup::bodies::load_body;
use somatic::internal::setup::{FilesRead, Setup};
use somatic::internal::tradeoff::{
    CallMode, Errors, Measurement, Pick, Report, Store, Tested, TrueErrors, plot_png, plot_svg, software, usual_frames,
    write_pick,
};
use somatic::{BackendKind, Engine, Error, OutputPath, Result};

use self::measured::{in_words, measure_options, missed, nothing_to_choose, played, recording};
use self::settled::driver;
pub(super) use self::settled::{Settled, settled};
use super::bar::Bar;
use super::interrupt::stop_soon_on_signal;
use super::plot_file::PlotFile;
use super::scene::{RunFlags, first, grouped, in_flags};
use super::stdio::{DONE, FAILED, print, say};
use super::table::{plain, shown};
use super::words::{count, number, one_line, title};

const EXAMPLES: &str = "\
Examples:
  somatic tradeoff --body robot.glb                      on touches simulated on the robot
  somatic tradeoff --body robot.glb --calibration robot.toml --source night.csv   timed on a recording
  somatic tradeoff --source sim:examples/simulations/rod.toml --plot rod.svg     on a simulation
  somatic tradeoff robot.scene.toml --within '3 mm, 5 deg' --write     the fastest within it
  somatic tradeoff robot.scene.toml --budget 100us                     the most accurate within it
  somatic tradeoff --body mat --source night.csv --json | jq '.rows[] | select(.front)'

Methods are compared with the truth: of touches simulated on the body, under the layer that the
calibration names in [layer], or of the source if it is a simulation. Options of rounding are compared
with the reference. Shear, temperature and proximity are the same with every option: only what they cost
is reported. Combinations take turns, so that a machine that slows down slows all of them.
The front has those that no other combination beats: none is as true and faster. Results are kept.
With them `somatic run` and `somatic plan` choose the backend and the options that a scene leaves
open, on the same recording or live.";

/// Measure speed against accuracy on your body and machine.
///
/// Each option is measured, on touches simulated on your body or on a recording.
#[derive(Args)]
#[command(after_help = EXAMPLES, hide_possible_values = true, mut_args(grouped), mut_arg("within", first), mut_arg("budget", first))]
pub(super) struct Arguments {
    /// A scene, a TOML file; a flag overrides its key.
    ///
    /// Its keys are the flags below, with _ for -. `somatic plan --schema` has all keys.
    #[arg(value_name = "SCENE")]
    scene: Option<PathBuf>,

    #[command(flatten)]
    asked: RunFlags,

    /// How long to measure; longer is steadier.
    ///
    /// A bare number is in seconds.
    #[arg(long, value_name = "TIME", default_value = "10s", value_parser = seconds)]
    seconds: f64,

    /// Measure on this many first frames of the source [default: 512, or as many as memory is well spent on].
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
    tradeoff_asked(arguments, &asked).map_err(in_flags)
}

fn tradeoff_asked(arguments: &Arguments, asked: &Setup) -> Result<u8> {
    let target = asked.accuracy.target();
    if !(arguments.seconds.is_finite() && arguments.seconds > 0.0) {
        return Err(Error::usage(format!("--seconds {} is not a time span; give seconds over 0", arguments.seconds)));
    }
    let mut outputs = FilesRead::from_scene(asked, arguments.scene.as_deref()).outputs(asked.overwrite);
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
    let input = if asked.sources.is_empty() { None } else { Some(super::scene::input(asked)?) };
    if input.as_ref().is_some_and(|input| !input.is_recording()) {
        return Err(Error::usage("a trade is measured on a recording or a simulation; name one as --source"));
    }
    let body =
        input.as_ref().map_or_else(|| load_body(asked.body.as_deref().unwrap_or("hand")), |input| input.body(asked))?;
    let ids: Vec<u32> = body.taxels.iter().map(|taxel| taxel.id).collect();
    let options = asked.options(&body, &ids, 1)?;
    let most = arguments.frames.map_or_else(|| usual_frames(ids.len()), |frames| frames as usize);
    let played = input.as_ref().map(|input| played(input, asked, &body, most)).transpose()?;
    let tested = Tested::new(&body, &options, played, most)?;
    let measure_options = measure_options(asked, &options, arguments.seconds)?;
    let stop = stop_soon_on_signal()?;
    let mut bar = Bar::new("measured");
    let report = tested.measure(&body, &measure_options, &mut |share| {
        bar.show_with_time_left(share);
        !stop.load(Ordering::Relaxed)
    });
    drop(bar);
    let mut report = report?;
    report.left_out.extend(software().filter(|_| options.backend == BackendKind::Auto && !report.rows.is_empty()));
    // A run that was cut short, or with knobs that are held, is not what others would measure.
    if !stop.load(Ordering::Relaxed)
        && options.scene.knobs == somatic::scene::Knobs::default()
        && let Some(store) = Store::of_user()
        && let Some(recording) = recording(input.as_ref())
        && let Err(e) = store.keep(&body, &options, &driver(), &recording, &report)
    {
        say(&format!("cannot save the measurements: {e}"));
    }
    let way = if asked.batch.is_some_and(|batch| batch > 1) { CallMode::Batch } else { CallMode::Live };
    if stop.load(Ordering::Relaxed) {
        print(&if arguments.json { json(&report, None)? } else { text(&report, arguments.all) })?;
        say("interrupted: that is what was measured until then; nothing is picked, drawn or kept");
        return Ok(FAILED);
    }
    if report.rows.is_empty() && !target.is_empty() {
        return Err(nothing_to_choose(&target));
    }
    let pick = if target.is_empty() { None } else { target.pick(&report, way) };
    if report.rows.is_empty() && plot.is_some() {
        return Err(Error::usage("there is nothing to draw: no letter is made of pressures").at("--plot"));
    }
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
    let words = in_words(pick.row);
    say(&format!("{} for {}: {combination}; {words}", picked(way), target.words()));
    if let Some((path, edit)) = scene {
        write_pick(edit, &pick.row.words.in_scene(&report.asked_by)?, &target)?;
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
    let mut text = format!("{}, {frames} of {}\n", title(&report.body), one_line(&report.source));
    const KEPT: usize = 3;
    for line in report.kept_charts.iter().take(KEPT).chain(&report.left_out) {
        text += &format!("  not measured  {}\n", one_line(line));
    }
    if report.kept_charts.len() > KEPT {
        let more = report.kept_charts.len() - KEPT;
        text += &format!("  and {more} more fields in their own charts; --json lists them\n");
    }
    if report.truth {
        text += &truth(report);
    }
    for way in CallMode::ALL {
        text += &rounding(report, way, all);
    }
    text + &letters(report)
}

/// What letters cost that the host makes, of which nothing is to be traded.
fn letters(report: &Report) -> String {
    if report.letters.is_empty() {
        return String::new();
    }
    let of_way = |way: CallMode| report.letters.iter().filter(move |cost| cost.way == way);
    let ways: Vec<CallMode> = CallMode::ALL.into_iter().filter(|&way| of_way(way).next().is_some()).collect();
    let headings: Vec<String> =
        ways.iter().flat_map(|way| [format!("{}, µs", way.word()), "of all fields".to_owned()]).collect();
    let mut table = plain(headings.iter().map(String::as_str).chain(["letter"]), 0..2 * ways.len());
    for first in of_way(ways[0]) {
        let costs = ways.iter().filter_map(|&way| of_way(way).find(|cost| cost.letter == first.letter));
        let cells = costs.flat_map(|cost| [number(cost.us), format!("{:.0} %", 100.0 * cost.share)]);
        table.add_row(cells.chain([first.letter.clone()]));
    }
    let what = "the host makes them in double precision, the same bits with every option: nothing to trade";
    let how = "timed on the CPU, without touches";
    format!("\n{}: {what}; {how}\n{}", style("other letters").bold(), shown(&table))
}

/// A number, or a dash where nothing was compared.
fn said(value: f64, errors: &Errors) -> String {
    if errors.compared > 0 { number(value) } else { "–".to_owned() }
}

/// How far each method is from the truth, and what it costs.
fn truth(report: &Report) -> String {
    let touches = if report.touches.is_empty() { "touches of the source" } else { &report.touches };
    let mut text = format!("\n{}: {touches}\n", style("from the truth").bold());
    text += &rungs(report, &|row| row.truth.as_ref());
    let fitted = report.rows.iter().find_map(|row| row.truth_with_fit.as_ref());
    if let Some(fitted) = fitted.filter(|fitted| fitted.touches > 0) {
        text += &format!("\nof these the {} touches that have a fit\n", fitted.touches);
        text += &rungs(report, &|row| row.truth_with_fit.as_ref());
    }
    text
}

/// A table of the methods by their errors `of` some touches.
fn rungs(report: &Report, of: &dyn Fn(&Measurement) -> Option<&TrueErrors>) -> String {
    let ways: Vec<CallMode> = CallMode::ALL.into_iter().filter(|way| !report.measurements(*way).is_empty()).collect();
    let times = ways.iter().map(|way| format!("{}, µs", way.word()));
    let errors =
        ["round, mm: median", "p95", "across rods, mm: median", "p95", "angle, °: median", "p95", "rms", "given"];
    let headings: Vec<String> = times.chain(errors.map(str::to_owned)).collect();
    let headings = headings.iter().map(String::as_str).chain(["orientation_by"]);
    let mut table = plain(headings, 0..ways.len() + errors.len());
    let rungs: Vec<Vec<&Measurement>> = ways.iter().map(|way| report.rungs(*way)).collect();
    for row in rungs.first().into_iter().flatten() {
        let Some(errors) = of(row) else { continue };
        let by = &row.words.orientation_by;
        let time = |rows: &Vec<&Measurement>| {
            let row = rows.iter().find(|other| other.words.orientation_by == *by);
            row.map_or("–".to_owned(), |row| number(row.p50_us))
        };
        let mut cells: Vec<String> = rungs.iter().map(time).collect();
        for part in [&errors.round_mm, &errors.across_mm, &errors.orientation_deg] {
            cells.extend([part.median, part.p95].map(|value| said(value, part)));
        }
        cells.push(said(errors.orientation_deg.rms, &errors.orientation_deg));
        cells.push(format!("{:.0} %", 100.0 * errors.given));
        cells.push(by.clone());
        table.add_row(cells.into_iter().map(|cell| if row.front { cell } else { style(cell).dim().to_string() }));
    }
    shown(&table)
}

/// What rounding costs and gives: the combinations of the other options against the reference.
fn rounding(report: &Report, way: CallMode, all: bool) -> String {
    let rows = report.measurements(way);
    if rows.is_empty() {
        return String::new();
    }
    let best = report.rounding(way);
    let is_best = |row: &Measurement| best.iter().any(|best| std::ptr::eq(*best, row));
    let text = format!(
        "\n{}: {} of {} combinations that no other beats; {} of touched fields against the reference, {} ties left out\n",
        style(way.word()).bold(),
        best.len(),
        rows.len(),
        count(report.touched, "percept"),
        report.ties
    );
    let headings = ["µs", "p99", "mm: rms", "p99", "worst", "°: rms", "p99", "worst", "combination"];
    let mut table = plain(headings, 0..8);
    for row in rows.iter().filter(|row| all || is_best(row)) {
        let mut cells = vec![number(row.p50_us), number(row.p99_us)];
        for errors in [&row.centroid_mm, &row.orientation_deg] {
            cells.extend([errors.rms, errors.p99, errors.worst].map(|value| said(value, errors)));
        }
        cells.push(row.combination().map_or(String::new(), |combination| combination.to_string()));
        table.add_row(cells.into_iter().map(|cell| if is_best(row) { cell } else { style(cell).dim().to_string() }));
    }
    text + &shown(&table)
}

/// Says once which fields stay in charts that the scene does not ask for.
pub(super) fn say_kept(engine: &Engine) {
    for (name, why) in engine.kept_charts() {
        say(&format!("field `{name}` stays in the chart of the layout: {why}"));
    }
    engine.remarks().iter().for_each(|remark| say(remark));
}
