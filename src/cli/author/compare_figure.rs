//! The picture of two layouts: which share of touches is off by how much.

use somatic::internal::expected::{ComparedLayouts, LayoutErrors, TouchError};
use somatic::internal::figure::{Arrangement, Axis, Colour, Figure, Layer, Mark, Panel, Point};

const FIRST: Colour = [214, 96, 20];
const SECOND: Colour = [31, 119, 180];
const IDEAL: [Colour; 2] = [[120, 120, 120], [185, 185, 185]];
/// Ideal skins whose spacings differ by less are drawn once.
const ALIKE: f64 = 0.02;
/// Steps between marked values.
const TICKS: f64 = 5.0;

/// Two panels: places, and axes.
pub(super) fn figure(names: [&str; 2], compared: &ComparedLayouts) -> Figure {
    let place = |touch: &TouchError| Some(1e3 * touch.place_m);
    let axis = |touch: &TouchError| touch.axis_rad.map(f64::to_degrees);
    let [first, second] = names.map(short_name);
    let panels = vec![
        panel("place", "off by, mm", [&first, &second], compared, place),
        panel("axis of lines", "off by, degrees", [&first, &second], compared, axis),
    ];
    Figure {
        title: "Errors of simulated touches",
        panels,
        key: Vec::new(),
        arrangement: Arrangement::SideBySide { side: 300 },
    }
}

/// The file's name, without its folder; as long as a title can be.
fn short_name(name: &str) -> String {
    const MOST: usize = 28;
    let name = std::path::Path::new(name).file_name().map_or_else(|| name.into(), |name| name.to_string_lossy());
    let count = name.chars().count();
    let cut: String = name.chars().skip(count.saturating_sub(MOST)).collect();
    if count > MOST { format!("…{cut}") } else { cut }
}

fn panel(
    title: &str,
    label: &'static str,
    names: [&str; 2],
    compared: &ComparedLayouts,
    of: fn(&TouchError) -> Option<f64>,
) -> Panel {
    let [a, b] = &compared.layouts;
    let [ideal_a, ideal_b] = &compared.ideal;
    let [first, second] = [("A", names[0]), ("B", names[1])].map(|(letter, name)| format!("{letter}: {name}"));
    let mut curves = vec![(ideal_a, IDEAL[0], "ideal A".to_owned()), (a, FIRST, first), (b, SECOND, second)];
    if (ideal_a.spacing_m / ideal_b.spacing_m - 1.0).abs() > ALIKE {
        curves.insert(1, (ideal_b, IDEAL[1], "ideal B".to_owned()));
    } else {
        "ideal".clone_into(&mut curves[0].2);
    }
    let sorted: Vec<(Vec<f64>, Colour, String)> =
        curves.into_iter().map(|(errors, colour, name)| (sorted(errors, of), colour, name)).collect();
    // All but the last percent, as a few touches may be far off.
    let far = |errors: &Vec<f64>| errors.get((0.99 * errors.len() as f64) as usize).copied();
    let (end, ticks) = scale(sorted.iter().filter_map(|(errors, ..)| far(errors)).fold(0.0, f64::max));
    let layers = sorted.into_iter().map(|(errors, colour, name)| Layer {
        mark: Mark::Lines { runs: vec![shares(&errors, end)], width: 2.0 },
        colour,
        name: Some(name.into()),
    });
    Panel {
        title: title.to_owned(),
        x: Axis { label, range: [0.0, end], ticks },
        y: Axis {
            label: "touches, %",
            range: [0.0, 100.0],
            ticks: (0..=4).map(|quarter| 25.0 * f64::from(quarter)).collect(),
        },
        layers: layers.collect(),
    }
}

fn sorted(errors: &LayoutErrors, of: fn(&TouchError) -> Option<f64>) -> Vec<f64> {
    let mut errors: Vec<f64> = errors.counted().filter_map(of).collect();
    errors.sort_by(f64::total_cmp);
    errors
}

/// The per cent of `errors` up to each of them, as far as `end`.
fn shares(errors: &[f64], end: f64) -> Vec<Point> {
    let share = |number: usize| 100.0 * number as f64 / errors.len() as f64;
    let within = errors.iter().take_while(|error| **error <= end).enumerate();
    let steps = within.flat_map(|(number, &error)| [(error, share(number)), (error, share(number + 1))]);
    std::iter::once((0.0, 0.0)).chain(steps).collect()
}

/// A round value from `most` on, and round values up to it.
fn scale(most: f64) -> (f64, Vec<f64>) {
    let rough = if most > 0.0 { most } else { 1.0 } / TICKS;
    let decade = 10_f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].into_iter().map(|factor| factor * decade).find(|step| *step >= rough);
    let step = step.unwrap_or(10.0 * decade);
    let steps = (most / step).ceil().max(1.0);
    (steps * step, (0..=steps as u32).map(|number| f64::from(number) * step).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scales_are_round_and_hold_the_largest() {
        for (most, end, ticks) in [(2.3, 2.5, 6), (0.7, 0.8, 5), (31.0, 40.0, 5), (0.0, 0.2, 2)] {
            let (to, marked) = scale(most);
            assert!((to - end).abs() < 1e-9 && marked.len() == ticks, "{most}: {to} {marked:?}");
        }
    }

    #[test]
    fn shares_rise_in_steps_to_the_whole() {
        let steps = shares(&[1.0, 3.0], 5.0);
        assert_eq!(steps, [(0.0, 0.0), (1.0, 0.0), (1.0, 50.0), (3.0, 50.0), (3.0, 100.0)]);
        assert_eq!(shares(&[1.0, 3.0], 2.0).last(), Some(&(1.0, 50.0)));
        assert_eq!(short_name("a/b/relaxed.glb"), "relaxed.glb");
        assert_eq!(short_name(&"x".repeat(40)).chars().count(), 29);
    }
}
