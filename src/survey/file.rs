//! A survey's findings as a calibration file.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use super::known_curve::KnownCurve;
use super::{Findings, Found, median};

/// What most sensors share.
struct Shared {
    baseline: f64,
    dead_band: f64,
    /// `None` where no sensor's is known.
    p_max: Option<f64>,
    noise: Option<f64>,
    shear_gain: Option<f64>,
    shear_noise: Option<f64>,
}

impl Findings {
    /// The calibration, as `docs/reference/calibration.md` describes it, for the body called `body`. What most sensors share stands
    /// under `[all]`, the rest under each taxel.
    #[must_use]
    pub fn calibration(&self, body: &str) -> String {
        let shared = self.shared();
        let mut text = self.for_all(body, &shared);
        if shared.shear_noise.is_some() || shared.shear_gain.is_some() {
            text += "\n[shear]\n";
        }
        if let Some(gain) = shared.shear_gain {
            let _ = write!(
                text,
                "# As the heaviest known force has it, on average: none pulled along the skin.\ngain = {gain}\n"
            );
        }
        if let Some(noise) = shared.shear_noise {
            let _ = writeln!(text, "noise = {noise}");
        }
        for found in &self.sensors {
            let own = self.own(found, &shared);
            if !own.is_empty() {
                let _ = write!(text, "\n[taxel.{}]\n", found.id);
                for (name, value) in own {
                    let _ = writeln!(text, "{name} = {value}");
                }
            }
        }
        for curve in &self.curves {
            let column = |part: usize| curve.knots.iter().map(|knot| number(knot[part])).collect::<Vec<_>>();
            let _ = write!(text, "\n[curve.{}]\nraw = {:?}\np = {:?}\n", curve.name(), column(0), column(1));
        }
        text
    }

    fn shared(&self) -> Shared {
        let sound = || self.sensors.iter().filter(|found| !self.is_lost(found));
        let is_full_known = sound().any(|found| found.full.is_some());
        let mut sigmas: Vec<f64> = sound().filter_map(|found| found.sigma).map(number).collect();
        let usual = self.curves.last().filter(|_| !self.with_axes.is_empty());
        Shared {
            baseline: commonest(sound().filter_map(|found| found.baseline)),
            dead_band: commonest(sound().map(|found| number(self.p_of(found, found.dead_band)))),
            p_max: is_full_known.then(|| commonest(sound().filter_map(|found| self.p_max_of(found)))),
            noise: median(&mut sigmas),
            shear_gain: usual.and_then(KnownCurve::gain).map(number),
            shear_noise: self.usual_shear_noise(sound().map(|found| found.id)).map(number),
        }
    }

    /// What the file says of the body and under `[all]`.
    fn for_all(&self, body: &str, shared: &Shared) -> String {
        let mut text = format!(
            "body = {}\n\n# From a survey of {} sensors: baselines are medians at rest, dead bands 1.5 times what one value in a\n\
             # thousand strays from them.\n\n[all]\nbaseline = {}\ngain = 1\nunit = \"{}\"\ndead_band = {}\ninvert = {}\n",
            quoted(body),
            self.sensors.len(),
            shared.baseline,
            self.unit,
            shared.dead_band,
            self.invert
        );
        let mut line = |name: &str, value: String| {
            let _ = writeln!(text, "{name} = {value}");
        };
        if let Some(scale) = self.scale {
            line("scale", scale.to_string());
        }
        if let Some(usual) = self.curves.last() {
            line("curve", quoted(&usual.name()));
        }
        if let Some(p_max) = shared.p_max {
            line("p_max", p_max.to_string());
        }
        if let Some(noise) = shared.noise {
            line("noise", noise.to_string());
        }
        if let Some([low, high]) = self.raw_range {
            line("raw_range", format!("[{low}, {high}]"));
        }
        if !self.missing.is_empty() {
            line("missing", format!("{:?}", self.missing));
        }
        text
    }

    /// The keys of `found` alone, with their values.
    fn own(&self, found: &Found, shared: &Shared) -> Vec<(&'static str, String)> {
        if self.is_lost(found) {
            return vec![("mask", "true".to_owned())];
        }
        let mut own = Vec::new();
        if let Some(curve) = self.curves.iter().find(|curve| curve.id == Some(found.id)) {
            own.push(("curve", quoted(&curve.name())));
        }
        let p_max = shared.p_max.unwrap_or_default();
        let all = [
            ("baseline", found.baseline.unwrap_or(shared.baseline), shared.baseline),
            ("gain", found.gain, 1.0),
            ("dead_band", number(self.p_of(found, found.dead_band)), shared.dead_band),
            ("p_max", self.p_max_of(found).unwrap_or(p_max), p_max),
        ];
        let differs = all.into_iter().filter(|(_, own, all)| own != all);
        own.extend(differs.map(|(name, own, _)| (name, number(own).to_string())));
        if let Some(noise) = found.sigma.map(number).filter(|own| Some(*own) != shared.noise) {
            own.push(("noise", noise.to_string()));
        }
        if let Some([u, v]) = self.shear_baseline(found.id) {
            own.push(("shear_baseline", format!("[{u}, {v}]")));
        }
        if let Some(gain) = self.shear_gain(found).filter(|own| Some(*own) != shared.shear_gain) {
            own.push(("shear_gain", gain.to_string()));
        }
        let shear_noise = self.shear_noise(found.id).map(number);
        if let Some(noise) = shear_noise.filter(|own| Some(*own) != shared.shear_noise) {
            own.push(("shear_noise", noise.to_string()));
        }
        own
    }

    /// The P of `found` at the end of its range.
    fn p_max_of(&self, found: &Found) -> Option<f64> {
        found.full.map(|full| number(self.p_of(found, full)))
    }

    /// The P of `found` where it went `raw` units.
    fn p_of(&self, found: &Found, raw: f64) -> f64 {
        let p = self.curve_of(found).map_or(raw, |curve| curve.at(raw));
        p * found.gain * self.scale.unwrap_or(1.0)
    }

    fn curve_of(&self, found: &Found) -> Option<&KnownCurve> {
        self.curves.iter().find(|curve| curve.id == Some(found.id)).or(self.curves.last())
    }

    /// P for each raw unit of tangential values of `found`, if it has three axes and its curve says nothing of them. Without a curve it
    /// is its gain.
    fn shear_gain(&self, found: &Found) -> Option<f64> {
        let curve = self.curve_of(found).filter(|_| self.with_axes.contains(&found.id))?;
        Some(number(curve.gain()? * found.gain))
    }
}

/// With six significant digits: more than a converter has.
fn number(value: f64) -> f64 {
    format!("{value:.5e}").parse().unwrap_or(value)
}

fn quoted(text: &str) -> String {
    format!("\"{}\"", text.replace('\\', "\\\\").replace('"', "\\\""))
}

/// The value that occurs most often, the lowest of several; 0 where there is none.
fn commonest(values: impl Iterator<Item = f64>) -> f64 {
    let mut counts: BTreeMap<u64, (f64, usize)> = BTreeMap::new();
    for value in values {
        counts.entry(value.to_bits()).or_insert((value, 0)).1 += 1;
    }
    let best = counts.into_values().max_by(|(a, count_a), (b, count_b)| count_a.cmp(count_b).then(b.total_cmp(a)));
    best.map_or(0.0, |(value, _)| value)
}

#[cfg(test)]
mod tests {
    use super::super::Press;
    use super::super::known::PressedOn;
    use super::*;
    use crate::signal::{Calibration, UnitOfP};

    fn found(id: u32, baseline: Option<f64>) -> Found {
        let full = baseline.map(|baseline| baseline - 0.5);
        let sigma = Some(0.5);
        Found {
            id,
            baseline,
            noise: 1.0,
            sigma,
            dead_band: 2.0,
            travel: Some(200.0),
            full,
            gain: 1.0,
            moved: false,
            went_other_way: false,
        }
    }

    #[test]
    fn what_is_written_is_read_as_what_was_found() {
        let mut sensors = vec![found(4, Some(250.0)), found(5, Some(250.0)), found(6, Some(243.0)), found(7, None)];
        (sensors[2].gain, sensors[2].dead_band, sensors[2].sigma) = (1.25, 5.0, Some(0.75));
        let missing = vec![-1.0, 30_000.0];
        let findings = Findings {
            sensors,
            invert: true,
            raw_range: Some([0.0, 255.0]),
            missing,
            unit: UnitOfP::COUNT,
            ..Findings::default()
        };
        let text = findings.calibration("the \"left\" hand");
        let read = Calibration::parse(&text, &[4, 5, 6, 7]).unwrap();
        assert_eq!(read.body.as_deref(), Some("the \"left\" hand"));
        let [a, b, c, d] = &read.taxels[..] else { panic!("four were written") };
        assert_eq!((a.baseline, a.gain, a.dead_band, a.p_max), (250.0, -1.0, 2.0, 249.5));
        assert_eq!((a, a.raw_range), (b, [0.0, 255.0]));
        assert_eq!((c.baseline, c.gain, c.dead_band, c.p_max), (243.0, -1.25, 6.25, 303.125));
        assert_eq!([a, b, c].map(|taxel| taxel.noise), [Some(0.5), Some(0.5), Some(0.75)]);
        assert_eq!(read.missing[0], [-1.0, 30_000.0]);
        assert!(d.mask && !a.mask && !c.mask);
    }

    #[test]
    fn known_forces_become_a_scale_or_curves_that_are_read_as_they_were_found() {
        let mut findings = Findings {
            sensors: vec![found(4, Some(250.0)), found(5, Some(250.0)), found(6, Some(250.0))],
            invert: true,
            raw_range: Some([0.0, 255.0]),
            missing: Vec::new(),
            unit: UnitOfP::COUNT,
            ..Findings::default()
        };
        // One factor, beside gains that were found before.
        findings.sensors[1].gain = 2.0;
        let mut by_field = findings.clone();
        by_field.know(&"8N".parse().unwrap(), PressedOn::Field).unwrap();
        let text = by_field.calibration("mat");
        assert!(text.contains("\nscale = 0.01\n") && text.contains("unit = \"N\""), "{text}");
        let read = Calibration::parse(&text, &[4, 5, 6]).unwrap();
        assert_eq!(read.taxels.iter().map(|taxel| taxel.gain).collect::<Vec<_>>(), [-0.01, -0.02, -0.01]);
        assert_eq!(read.taxels.iter().map(|taxel| taxel.dead_band).collect::<Vec<_>>(), [0.02, 0.04, 0.02]);
        // Curves of the two that were pressed, and the middle one of the third.
        findings.sensors[1].gain = 1.0;
        let press = |sensor, travel| Press { sensor, travel, whole: travel };
        findings.presses = vec![press(0, 100.0), press(1, 120.0), press(1, 180.0), press(0, 150.0)];
        findings.know(&"1N,3N".parse().unwrap(), PressedOn::Taxel).unwrap();
        let text = findings.calibration("mat");
        let read = Calibration::parse(&text, &[4, 5, 6]).unwrap();
        let curve = |taxel: usize| read.curve_of(&read.taxels[taxel], None).unwrap().unwrap();
        assert_eq!(curve(0).written(), [[-249.5, 6.98], [-150.0, 3.0], [-100.0, 1.0], [0.0, 0.0]]);
        assert_eq!(curve(1).written()[1..3], [[-180.0, 3.0], [-120.0, 1.0]]);
        assert_eq!(read.taxels[0].p_max, 6.98);
        assert_eq!(read.taxels[0].dead_band, 0.02);
        assert!(text.contains("curve = \"usual\"") && curve(2).written()[2][1] == 1.0, "{text}");
        // What does not fit is named.
        let why = |presses: Vec<Press>| {
            let mut wrong = findings.clone();
            wrong.presses = presses;
            wrong.know(&"1N,3N".parse().unwrap(), PressedOn::Taxel).unwrap_err().to_string()
        };
        assert!(why(vec![press(1, 100.0)]).contains("sensor 5 was pressed 1 times, and 2 forces are known"));
        assert!(why(vec![press(1, 100.0), press(1, 90.0)]).contains("sensor 5 went 100 under 1 N and 90 under 3 N"));
    }
}
