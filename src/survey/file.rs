//! A survey's findings as a calibration file.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use somatic::error::{Error, Result};
use somatic::internal::signal::UnitOfP;

use super::known::{KnownForce, PressedOn};
use super::{Findings, Found, median, rounded};

impl Findings {
    /// Gives the sensors gains with which the presses of the survey were `force` on what it pressed on. A sensor that was not
    /// pressed has the middle one of the others' gains.
    ///
    /// # Errors
    /// No sensor was pressed.
    pub fn know(&mut self, KnownForce(newtons): KnownForce, on: PressedOn) -> Result<()> {
        let mut travels: Vec<f64> = self.sensors.iter().filter_map(|found| found.travel).collect();
        let Some(usual) = median(&mut travels) else {
            return Err(Error::failed("no sensor was pressed, so that nothing is known of the force"));
        };
        let whole: f64 = travels.iter().sum();
        for found in &mut self.sensors {
            found.gain = rounded(match on {
                PressedOn::Taxel => newtons / found.travel.unwrap_or(usual),
                PressedOn::Field => newtons / whole,
            });
        }
        self.unit = "N".parse::<UnitOfP>()?;
        Ok(())
    }

    /// The calibration, as `docs/reference/calibration.md` describes it, for the body called `body`. What most sensors share stands
    /// under `[all]`, the rest under each taxel.
    #[must_use]
    pub fn calibration(&self, body: &str) -> String {
        let sound = || self.sensors.iter().filter(|found| !self.is_lost(found));
        let baseline = commonest(sound().filter_map(|found| found.baseline));
        let dead_band = commonest(sound().map(|found| found.dead_band));
        let p_max = commonest(sound().filter_map(p_max));
        let mut sigmas: Vec<f64> = sound().filter_map(|found| found.sigma).map(number).collect();
        let sigma = median(&mut sigmas);
        let mut text = format!(
            "# From a survey of {} sensors: baselines are medians at rest, dead bands 1.5 times what one value in a\n\
             # thousand strays from them.\n\n[all]\nbaseline = {baseline}\ngain = 1\nunit = \"{}\"\ndead_band = {dead_band}\ninvert = {}\n",
            self.sensors.len(),
            self.unit,
            self.invert
        );
        text = format!("body = {}\n\n{text}", quoted(body));
        let mut line = |name: &str, value: String| {
            let _ = writeln!(text, "{name} = {value}");
        };
        if sound().any(|found| found.full.is_some()) {
            line("p_max", p_max.to_string());
        }
        if let Some(sigma) = sigma {
            line("noise", sigma.to_string());
        }
        if let Some([low, high]) = self.raw_range {
            line("raw_range", format!("[{low}, {high}]"));
        }
        if !self.missing.is_empty() {
            line("missing", format!("{:?}", self.missing));
        }
        for found in &self.sensors {
            let mut own: Vec<(&str, String)> = Vec::new();
            if self.is_lost(found) {
                own.push(("mask", "true".to_owned()));
            } else {
                let all = [
                    ("baseline", found.baseline.unwrap_or(baseline), baseline),
                    ("gain", found.gain, 1.0),
                    ("dead_band", found.dead_band * found.gain, dead_band),
                    ("p_max", self::p_max(found).unwrap_or(p_max), p_max),
                ];
                let differs = all.iter().filter(|(_, own, all)| own != all);
                own.extend(differs.map(|(name, own, _)| (*name, number(*own).to_string())));
                if let Some(noise) = found.sigma.map(number).filter(|own| Some(*own) != sigma) {
                    own.push(("noise", noise.to_string()));
                }
            }
            if !own.is_empty() {
                let _ = write!(text, "\n[taxel.{}]\n", found.id);
                for (name, value) in own {
                    let _ = writeln!(text, "{name} = {value}");
                }
            }
        }
        text
    }
}

/// Above which P a sensor is at the end of its range.
fn p_max(found: &Found) -> Option<f64> {
    found.full.map(|full| full * found.gain)
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
    use super::*;
    use somatic::internal::signal::UnitOfP;
    use somatic::signal::Calibration;

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
        let findings = Findings { sensors, invert: true, raw_range: Some([0.0, 255.0]), missing, unit: UnitOfP::COUNT };
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
}
