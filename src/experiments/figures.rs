//! The paper's Figs. 3, 6 and 7, from simulation.

use std::f64::consts::PI;

use super::trial::{self, Moment, Signal, Trial};
use somatic::body::Body;
use somatic::error::Result;
use somatic::field::FieldSet;
use somatic::internal::figure::{Arrangement, Axis, Colour, Figure, Layer, Mark, Panel, Point};
use somatic::signal::FsrCircuit;

/// Simulations that users can run, too.
const TAPS: &str = include_str!("../../examples/simulations/taps.toml");
const ROD: &str = include_str!("../../examples/simulations/rod.toml");

/// The taxel under the finger that taps.
const TAPPED_TAXEL: u32 = 4;
/// Times of the panels of Fig. 6, s.
const PANEL_TIMES_S: [f64; 6] = [0.8, 1.3, 1.8, 2.3, 2.8, 3.3];
/// Half the side of a panel of Fig. 6, mm.
const PANEL_HALF_MM: f64 = 18.0;
/// Of an Interlink 400's sensing disc, mm.
const SENSOR_RADIUS_MM: f64 = 2.5;

const GREEN: Colour = [0, 150, 0];
const BLUE: Colour = [0, 0, 230];
const RED: Colour = [230, 0, 0];
const CYAN: Colour = [0, 190, 210];
const GREY: Colour = [165, 165, 165];
const FAINT_GREEN: Colour = [150, 215, 150];
const FAINT_BLUE: Colour = [165, 165, 245];
const DOTTED: Colour = [110, 110, 220];
/// The paper's colours of [`Signal::ALL`].
const LINES: [Colour; 2] = [GREEN, BLUE];
const NAMES: [&str; 2] = ["logarithmic raw", "linearised"];

/// A figure and the name of its files.
pub(super) struct NamedFigure {
    pub(super) name: &'static str,
    pub(super) figure: Figure,
}

/// All three on the bundled hand.
pub(super) fn figures(body: &Body) -> Result<[NamedFigure; 3]> {
    let taps = trial::run("taps", TAPS, body, "hand/palm")?;
    let rod = trial::run("rod", ROD, body, "hand/back")?;
    Ok([
        NamedFigure { name: "fig3", figure: taps_figure(&taps) },
        NamedFigure { name: "fig6", figure: rod_figure(&rod, body)? },
        NamedFigure { name: "fig7", figure: time_figure(&rod) },
    ])
}

fn lines(points: Vec<Point>, colour: Colour, width: f64, name: Option<&'static str>) -> Layer {
    Layer { mark: Mark::Lines { runs: vec![points], width }, colour, name: name.map(Into::into) }
}

/// An axis over `range` with a tick every `step`.
fn axis(label: &'static str, range: [f64; 2], step: f64) -> Axis {
    let count = ((range[1] - range[0]) / step) as u32;
    Axis { label, range, ticks: (0..=count).map(|i| range[0] + step * f64::from(i)).collect() }
}

/// Fig. 3: taps on one sensor in counts and in both signals.
fn taps_figure(taps: &Trial) -> Figure {
    let tapped = taps.ids.iter().position(|&id| id == TAPPED_TAXEL).unwrap_or(0);
    let over_time = |value: &dyn Fn(&Moment) -> f64| -> Vec<Point> {
        taps.moments.iter().map(|moment| (moment.t_s, value(moment))).collect()
    };
    let panel = |title: &str, y: Axis, layers| {
        let x = axis("time (s)", [0.0, 8.0], 1.0);
        Panel { title: title.to_owned(), x, y, layers }
    };
    // The linearised signal's scale, so that force and signal would coincide if nothing were lost.
    let per_newton = FsrCircuit::FULL_SIGNAL / FsrCircuit::SATURATION_NEWTON;
    let force = over_time(&|moment| (moment.forces_newton[tapped] * per_newton).min(FsrCircuit::FULL_SIGNAL));
    let signal = |which: usize| {
        let points = over_time(&|moment| Signal::ALL[which].value(moment.counts[tapped]));
        lines(points, LINES[which], 1.5, Some(NAMES[which]))
    };
    let counts = over_time(&|moment| moment.counts[tapped].into());
    Figure {
        title: "Fig. 3: finger taps on one force-sensing resistor",
        panels: vec![
            panel(
                "as converted: less when pressed",
                axis("counts (0–1023)", [0.0, 1060.0], 250.0),
                vec![lines(counts, [60, 60, 60], 1.5, Some("converter"))],
            ),
            panel("logarithmic raw", axis("signal (0–1000)", [0.0, 1060.0], 250.0), vec![signal(0)]),
            panel(
                "linearised",
                axis("signal (0–1000)", [0.0, 420.0], 100.0),
                vec![lines(force, GREY, 3.0, Some("force on the sensor, true (1000 = 10 N)")), signal(1)],
            ),
        ],
        key: Vec::new(),
        arrangement: Arrangement::Stacked { width: 720, height: 150 },
    }
}

/// Fig. 6: the rod over the back board at some instants.
fn rod_figure(rod: &Trial, body: &Body) -> Result<Figure> {
    let fields = FieldSet::new(body)?.fields;
    let places: Vec<(usize, Point)> = fields
        .iter()
        .filter(|field| field.name == "hand/back")
        .flat_map(|field| &field.members)
        .filter_map(|member| {
            let value = rod.ids.iter().position(|&id| id == body.taxels[member.taxel].id)?;
            Some((value, (member.place.x * 1e3, member.place.y * 1e3)))
        })
        .collect();
    let panels = PANEL_TIMES_S.iter().filter_map(|&t_s| {
        let moment = rod.moments.iter().min_by(|a, b| (a.t_s - t_s).abs().total_cmp(&(b.t_s - t_s).abs()))?;
        Some(instant(moment, &places))
    });
    Ok(Figure {
        title: "Fig. 6: a rod of 2.54 cm rolled over the nine sensors of the back of the hand, from top to bottom",
        panels: panels.collect(),
        key: vec![sensor((0.0, 0.0), 0.0, Some("0")), sensor((0.0, 0.0), 1.0, Some("1000: sensor, logarithmic raw"))],
        arrangement: Arrangement::SideBySide { side: 170 },
    })
}

/// A sensor in its colour: black at 0, bright red at full signal.
fn sensor(centre: Point, signal: f64, name: Option<&'static str>) -> Layer {
    let colour = [(255.0 * signal).round() as u8, 0, 0];
    Layer { mark: Mark::Disc { centre, radius: SENSOR_RADIUS_MM }, colour, name: name.map(Into::into) }
}

fn instant(moment: &Moment, places: &[(usize, Point)]) -> Panel {
    let mut layers = Vec::new();
    if let Some(([u, v], angle)) = moment.truth.as_ref().and_then(|truth| truth.uv.zip(truth.angle)) {
        layers.push(line_through((u * 1e3, v * 1e3), angle, GREY, 5.0, "rod, true"));
    }
    for &(value, centre) in places {
        let signal = Signal::Raw.value(moment.counts[value]) / FsrCircuit::FULL_SIGNAL;
        layers.push(sensor(centre, signal, None));
    }
    let names = ["orientation, logarithmic raw", "orientation, linearised"];
    let centroids = moment.percepts.map(|percept| percept.centroid.map(|[u, v]| (u * 1e3, v * 1e3)));
    for signal in 0..2 {
        if let Some((centroid, angle)) = centroids[signal].zip(moment.percepts[signal].orientation) {
            layers.push(line_through(centroid, angle, LINES[signal], 2.0, names[signal]));
        }
    }
    if let Some(at) = centroids[0] {
        layers.push(Layer {
            mark: Mark::Plus { at, size: 7.0 },
            colour: RED,
            name: Some("centroid, logarithmic raw".into()),
        });
    }
    if let Some(at) = centroids[1] {
        layers.push(Layer {
            mark: Mark::Asterisk { at, size: 6.0 },
            colour: CYAN,
            name: Some("centroid, linearised".into()),
        });
    }
    let axis = |label| Axis { label, range: [-PANEL_HALF_MM, PANEL_HALF_MM], ticks: vec![-12.0, 0.0, 12.0] };
    Panel { title: format!("{:.1} s", moment.t_s), x: axis("u (mm)"), y: axis("v (mm)"), layers }
}

/// The line through `point` at `angle`, as far as a panel of Fig. 6 goes.
fn line_through(point: Point, angle: f64, colour: Colour, width: f64, name: &'static str) -> Layer {
    let direction = (libm::cos(angle), libm::sin(angle));
    // Clip the line to the panel.
    let (mut from, mut to) = (-4.0 * PANEL_HALF_MM, 4.0 * PANEL_HALF_MM);
    for (start, slope) in [(point.0, direction.0), (point.1, direction.1)] {
        if slope.abs() > 1e-12 {
            let ends = [(-PANEL_HALF_MM - start) / slope, (PANEL_HALF_MM - start) / slope];
            from = from.max(ends[0].min(ends[1]));
            to = to.min(ends[0].max(ends[1]));
        }
    }
    let at = |length: f64| (point.0 + length * direction.0, point.1 + length * direction.1);
    lines(if from < to { vec![at(from), at(to)] } else { Vec::new() }, colour, width, Some(name))
}

/// Fig. 7: direction and orientation over time.
fn time_figure(rod: &Trial) -> Figure {
    let true_direction = |moment: &Moment| {
        let [du, dv] = moment.truth.as_ref()?.velocity_uv?;
        (libm::hypot(du, dv) > 0.0).then(|| libm::atan2(dv, du))
    };
    let mut direction = vec![curve(rod, &true_direction, PI, GREY, 4.0, "true")];
    for (signal, faint) in [FAINT_GREEN, FAINT_BLUE].into_iter().enumerate() {
        let frame_by_frame =
            rod.moments.iter().filter_map(|moment| Some((moment.t_s, moment.percepts[signal].direction?.to_degrees())));
        let mark = Mark::Dots { points: frame_by_frame.collect(), radius: 1.2 };
        let names = ["raw, frame by frame", "linearised, frame by frame"];
        direction.push(Layer { mark, colour: faint, name: Some(names[signal].into()) });
    }
    for signal in 0..2 {
        let filtered = |moment: &Moment| moment.percepts[signal].filtered_direction;
        direction.push(curve(rod, &filtered, PI, LINES[signal], 2.0, NAMES[signal]));
    }
    let true_angle = |moment: &Moment| moment.truth.as_ref()?.angle;
    let mut orientation = vec![curve(rod, &true_angle, PI / 2.0, GREY, 4.0, "true")];
    for signal in 0..2 {
        let angle = |moment: &Moment| moment.percepts[signal].orientation;
        orientation.push(curve(rod, &angle, PI / 2.0, LINES[signal], 2.0, NAMES[signal]));
    }
    let panel = |title: &str, label, range: [f64; 2], step: f64, layers: Vec<Layer>| {
        let grid = axis(label, range, 45.0).ticks.into_iter().map(|y| Layer {
            mark: Mark::Dashed { from: (0.0, y), to: (4.0, y) },
            colour: DOTTED,
            name: Some("each 45°".into()),
        });
        let layers = grid.chain(layers).collect();
        let (x, y) = (axis("time (s)", [0.0, 4.0], 0.5), axis(label, range, step));
        Panel { title: title.to_owned(), x, y, layers }
    };
    Figure {
        title: "Fig. 7: direction of motion and orientation over time, for the rod of Fig. 6",
        panels: vec![
            panel("filtered direction of motion", "direction (°)", [-180.0, 180.0], 90.0, direction),
            panel("orientation: 0° is 180°", "orientation (°)", [0.0, 180.0], 45.0, orientation),
        ],
        key: Vec::new(),
        arrangement: Arrangement::Stacked { width: 820, height: 230 },
    }
}

fn curve(
    trial: &Trial,
    angle: &dyn Fn(&Moment) -> Option<f64>,
    jump: f64,
    colour: Colour,
    width: f64,
    name: &'static str,
) -> Layer {
    broken_line(trial.moments.iter().map(|moment| (moment.t_s, angle(moment))), jump, colour, width, name)
}

/// Angles over time in degrees, broken where one is absent, or where it jumps over the seam by more than `jump`, rad.
fn broken_line(
    points: impl Iterator<Item = (f64, Option<f64>)>,
    jump: f64,
    colour: Colour,
    width: f64,
    name: &'static str,
) -> Layer {
    let mut runs: Vec<Vec<Point>> = vec![Vec::new()];
    let mut before: Option<f64> = None;
    for (t_s, angle) in points {
        let joined = before.zip(angle).is_some_and(|(before, angle)| (before - angle).abs() <= jump);
        if !joined {
            runs.push(Vec::new());
        }
        if let (Some(angle), Some(run)) = (angle, runs.last_mut()) {
            run.push((t_s, angle.to_degrees()));
        }
        before = angle;
    }
    Layer { mark: Mark::Lines { runs, width }, colour, name: Some(name.into()) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_broken_at_the_seam_and_where_nothing_is_known() {
        let angles = [Some(3.1), Some(3.0), Some(0.1), None, Some(0.2), Some(0.3)];
        let points = angles.into_iter().enumerate().map(|(i, angle)| (i as f64, angle));
        let Mark::Lines { runs, .. } = broken_line(points, PI / 2.0, RED, 1.0, "x").mark else { panic!() };
        let lengths: Vec<usize> = runs.iter().map(Vec::len).filter(|&length| length > 0).collect();
        assert_eq!(lengths, [2, 1, 2]);
    }

    #[test]
    fn a_line_ends_where_its_panel_does() {
        for degrees in [0.0_f64, 30.0, 90.0, 135.0] {
            let layer = line_through((3.0, -5.0), degrees.to_radians(), RED, 1.0, "x");
            let Mark::Lines { runs, .. } = layer.mark else { panic!() };
            assert_eq!(runs[0].len(), 2);
            for (x, y) in &runs[0] {
                assert!((x.abs().max(y.abs()) - PANEL_HALF_MM).abs() < 1e-9, "{degrees}: {x} {y}");
            }
        }
    }
}
