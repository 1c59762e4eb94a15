//! A survey's findings as a picture: where every sensor rests, and how far it goes.

use super::{Findings, Found};
use crate::error::Result;
use crate::figure::{Arrangement, Axis, Colour, Figure, Layer, Mark, Panel};

const TRAVEL: Colour = [120, 170, 220];
const DEAD: Colour = [225, 150, 60];
const BASE: Colour = [30, 60, 110];
const LOST: Colour = [200, 40, 40];
const ALONG: Colour = [60, 150, 90];

impl Findings {
    /// The figure as SVG, text being text.
    pub fn svg(&self) -> Result<String> {
        self.figure().svg()
    }

    /// The figure as PNG.
    pub fn png(&self) -> Result<Vec<u8>> {
        self.figure().png()
    }

    fn figure(&self) -> Figure {
        let side = if self.invert { -1.0 } else { 1.0 };
        let place = |found: &Found| f64::from(found.id);
        let ends = self.sensors.iter().flat_map(|found| {
            let baseline = found.baseline.unwrap_or(0.0);
            let [u, v] = self.tangential_baselines(found.id).map(|along| along.unwrap_or(baseline));
            [baseline, baseline + side * found.travel.unwrap_or(0.0), u, v]
        });
        let mut range = ends.fold([0.0_f64, 1.0_f64], |[low, high], end| [low.min(end), high.max(end)]);
        if let Some([low, high]) = self.raw_range {
            range = [range[0].min(low), range[1].max(high)];
        }
        let first = self.sensors.iter().map(place).fold(f64::INFINITY, f64::min);
        let last = self.sensors.iter().map(place).fold(0.0, f64::max);
        let upright = |of: &dyn Fn(&Found) -> Option<[f64; 2]>| -> Vec<Vec<(f64, f64)>> {
            let run = |found: &Found| of(found).map(|[from, to]| vec![(place(found), from), (place(found), to)]);
            self.sensors.iter().filter_map(run).collect()
        };
        let travels = upright(&|found| Some([found.baseline?, found.baseline? + side * found.travel?]));
        let bands = upright(&|found| Some([found.baseline? - found.dead_band, found.baseline? + found.dead_band]));
        let dots = |is: &dyn Fn(&Found) -> bool, at: &dyn Fn(&Found) -> f64| Mark::Dots {
            points: self.sensors.iter().filter(|found| is(found)).map(|found| (place(found), at(found))).collect(),
            radius: 2.2,
        };
        let width = (600.0 / self.sensors.len().max(1) as f64).clamp(0.6, 6.0);
        let layer = |mark: Mark, colour: Colour, name: &'static str| Layer { mark, colour, name: Some(name.into()) };
        let mut layers = vec![
            layer(Mark::Lines { runs: travels, width }, TRAVEL, "pressed"),
            layer(Mark::Lines { runs: bands, width: 1.4 * width }, DEAD, "dead band"),
            layer(dots(&|f| !self.is_lost(f), &|f| f.baseline.unwrap_or(0.0)), BASE, "at rest"),
            layer(
                dots(&|f| self.is_lost(f) || f.travel.is_none(), &|f| f.baseline.unwrap_or(0.0)),
                LOST,
                "never pressed, or lost",
            ),
        ];
        let along = |found: &Found| self.tangential_baselines(found.id).map(|at| Some((place(found), at?)));
        let points: Vec<(f64, f64)> = self.sensors.iter().flat_map(along).flatten().collect();
        if !points.is_empty() {
            layers.push(layer(Mark::Dots { points, radius: 1.6 }, ALONG, "u and v at rest"));
        }
        let margin = 0.03 * (range[1] - range[0]);
        let x = Axis { label: "taxel", range: [first - 1.0, last + 1.0], ticks: ticks(first, last) };
        let y = Axis {
            label: "raw value",
            range: [range[0] - margin, range[1] + margin],
            ticks: ticks(range[0], range[1]),
        };
        let title = format!(
            "{} sensors, raw values {} when pressed",
            self.sensors.len(),
            if self.invert { "falling" } else { "rising" }
        );
        Figure {
            title: "Survey",
            panels: vec![Panel { title, x, y, layers }],
            key: Vec::new(),
            arrangement: Arrangement::Stacked { width: 720, height: 320 },
        }
    }
}

/// Round numbers from `low` to `high`, about six.
fn ticks(low: f64, high: f64) -> Vec<f64> {
    let rough = ((high - low) / 6.0).max(1e-12);
    let power = 10.0_f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].map(|m| m * power).into_iter().find(|step| *step >= rough).unwrap_or(rough);
    let from = (low / step).ceil() as i64;
    let to = (high / step).floor() as i64;
    (from..=to).map(|n| n as f64 * step).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::signal::UnitOfP;

    #[test]
    fn ticks_are_round_and_within() {
        assert_eq!(ticks(0.0, 1023.0), [0.0, 200.0, 400.0, 600.0, 800.0, 1000.0]);
        assert_eq!(ticks(3.0, 3.0), [3.0]);
    }

    #[test]
    fn every_sensor_is_drawn_where_it_rests_and_as_far_as_it_goes() {
        let sensor = |id: u32, travel| Found {
            id,
            baseline: Some(250.0),
            noise: 1.0,
            sigma: None,
            dead_band: 2.0,
            travel,
            full: None,
            gain: 1.0,
            moved: false,
            went_other_way: false,
        };
        let findings = Findings {
            sensors: vec![sensor(0, Some(200.0)), sensor(1, None)],
            invert: true,
            raw_range: None,
            missing: Vec::new(),
            unit: UnitOfP::COUNT,
            ..Findings::default()
        };
        let svg = findings.svg().unwrap();
        assert!(svg.contains("never pressed") && svg.contains("2 sensors, raw values falling when pressed"));
        assert_eq!(findings.figure().panels[0].layers.len(), 4);
    }
}
