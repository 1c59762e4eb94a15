//! `author --compare`: two layouts side by side, by what touches on them are off by.

use std::path::{Path, PathBuf};

use clap::Args;
use comfy_table::Cell;
use somatic::body::Body;
use somatic::internal::author::cell_spread;
use somatic::internal::expected::{ComparedLayouts, LayoutErrors, TestTouches, compare_layouts};
use somatic::internal::setup::FilesRead;
use somatic::internal::setup::bodies::load_body;
use somatic::{Error, Result};

use super::compare_figure::figure;
use crate::cli::expected;
use crate::cli::plot_file::PlotFile;
use crate::cli::stdio::{DONE, print};
use crate::cli::table::{plain, shown};
use crate::cli::words::{bullet, millimetres, span, spread, title};

const HEADING: &str = "Two layouts side by side";

/// The median and the 95th percentile of an error, where it is known.
type Percentiles = fn(&LayoutErrors) -> Option<[String; 2]>;

#[derive(Args)]
pub(super) struct CompareArguments {
    /// Compare the layouts of two bodies by simulated touches; nothing is placed.
    ///
    /// The comparison has how far off place, axis and force are on each, how alike their cells are, and how long a
    /// frame takes. With -o FILE.svg or FILE.png the errors are drawn.
    #[arg(long, num_args = 2, value_names = ["A.glb", "B.glb"], help_heading = HEADING,
        conflicts_with_all = ["mesh", "recipe", "taxels", "spacing", "region", "seed", "unit", "even", "hidden", "clear", "mirror", "grid",
            "icub", "urdf_skin", "mjcf_skin", "csv_skin", "up", "packages", "geometry"])]
    compare: Vec<String>,
}

impl CompareArguments {
    /// The two bodies that are compared, if that is asked for.
    pub(super) fn bodies(&self) -> Result<Option<[&str; 2]>> {
        match &self.compare[..] {
            [] => Ok(None),
            [first, second] => Ok(Some([first, second])),
            _ => Err(Error::usage("--compare takes two bodies; give it once")),
        }
    }
}

/// Compares `names`, and draws that at `output`.
pub(super) fn run(names: [&str; 2], output: Option<&Path>, force: bool, as_json: bool) -> Result<u8> {
    let owned = names.map(str::to_owned);
    let mut outputs = FilesRead::default().bodies(&owned).outputs(force);
    let plot = output.map(|path| PlotFile::at(path, "-o", &mut outputs)).transpose()?;
    let bodies = [load_body(names[0])?, load_body(names[1])?];
    let compared = compare_layouts([&bodies[0], &bodies[1]], &TestTouches::default())?;
    if let Some(plot) = plot {
        let figure = figure(names, &compared);
        plot.draw(|| figure.svg(), || figure.png())?;
    }
    print(&match as_json {
        true => format!("{}\n", compared.as_json(names, [&bodies[0], &bodies[1]])),
        false => text(names, &bodies, &compared),
    })?;
    Ok(DONE)
}

fn text(names: [&str; 2], bodies: &[Body; 2], compared: &ComparedLayouts) -> String {
    let mut table = plain(["", "A", "ideal A", "B", "ideal B"], 1..5);
    let mut row = |what: &str, of: &dyn Fn(usize) -> [String; 2]| {
        let [[a, ideal_a], [b, ideal_b]] = [of(0), of(1)];
        table.add_row([what.to_owned(), a, ideal_a, b, ideal_b].map(Cell::new));
    };
    let dash = || "–".to_owned();
    row("taxels", &|side| [compared.layouts[side].taxels.to_string(), String::new()]);
    row("spacing mm", &|side| [millimetres(compared.layouts[side].spacing_m), String::new()]);
    row("cells", &|side| [cells(&bodies[side]).map_or_else(dash, spread), String::new()]);
    let errors: [(&str, Percentiles); 3] =
        [("place mm", expected::place), ("axis °", expected::axis), ("force %", expected::force)];
    for (what, of) in errors {
        row(what, &|side| {
            [&compared.layouts[side], &compared.ideal[side]]
                .map(|errors| of(errors).map_or_else(dash, |[median, p95]| format!("{median}, {p95}")))
        });
    }
    row("touches", &|side| {
        let layout = &compared.layouts[side];
        [format!("{} of {}", layout.counted().count(), layout.touches.len()), String::new()]
    });
    row("a frame", &|side| [span(compared.frame_s[side]), String::new()]);
    let mut text =
        format!("{}\n{}\n\n{}", title(&format!("A  {}", names[0])), title(&format!("B  {}", names[1])), shown(&table));
    text += "\n";
    let sized = millimetres(compared.layouts[0].touch_spacing_m);
    text += &bullet(&format!(
        "errors are the median and the 95th percentile; touches are sized for a spacing of {sized} mm, {}",
        if compared.same_places {
            "at the same places on both"
        } else {
            "at random places of each, as their surfaces differ"
        }
    ));
    text += &bullet(
        "ideal: the same touches on a flat sheet of regular hexagons, as dense; a frame: measured now, on the CPU",
    );
    if let Some(share) = compared.second_is_nearer() {
        let (nearer, share) = if share >= 0.5 { ("B", share) } else { ("A", 1.0 - share) };
        text += &bullet(&format!("{nearer} is nearer to the true place in {:.0} % of the touches", 100.0 * share));
    }
    text
}

fn cells(body: &Body) -> Option<[f64; 2]> {
    cell_spread(body.taxels.iter().map(|taxel| taxel.area))
}

/// The output of a command that places taxels: only a comparison has none.
pub(super) fn body_output(output: Option<&PathBuf>) -> Result<&PathBuf> {
    output.ok_or_else(|| Error::usage("name the body to write with -o BODY.glb"))
}
