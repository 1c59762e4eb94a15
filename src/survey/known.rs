//! Presses with known forces, such as weights from a kitchen scale: what makes newtons of raw units.

use std::str::FromStr;

use crate::error::{Error, Result};
use crate::signal::{Quantity, UnitOfP};

use super::known_curve::KnownCurve;
use super::{Findings, median, rounded};

/// Most forces of one calibration.
const MOST: usize = 32;
/// What presses less than that share of what the lightest force should is no press.
const CLEAR_SHARE: f64 = 0.25;

/// Forces of presses that follow each other, N; one of all presses.
#[derive(Clone, Debug, PartialEq)]
pub struct KnownForces(pub Vec<f64>);

impl FromStr for KnownForces {
    type Err = Error;

    /// `4.9N`, a weight such as `500g`, or several as `1N,2N,5N`.
    fn from_str(text: &str) -> Result<Self> {
        let forces = text.split(',').map(force).collect::<Result<Vec<f64>>>()?;
        match forces.len() {
            0..=MOST => Ok(Self(forces)),
            many => Err(Error::usage(format!("these are {many} forces; give {MOST} at most"))),
        }
    }
}

/// The force that `text` names, N.
fn force(text: &str) -> Result<f64> {
    let bad = || Error::usage(format!("{text} is not a force; write it as 4.9N, or as a weight, 500g"));
    let text = text.trim();
    let end = text.find(|c: char| c.is_alphabetic()).unwrap_or(text.len());
    let unit = match text[end..].trim() {
        "g" => "gf",
        "kg" => "kgf",
        other => other,
    };
    let number: f64 = text[..end].trim().parse().map_err(|_| bad())?;
    let unit: UnitOfP = unit.parse().map_err(|_| bad())?;
    let force = number * unit.factor;
    let is_force = unit.quantity == Quantity::Newton && force.is_finite() && force > 0.0;
    if is_force { Ok(force) } else { Err(bad()) }
}

/// What the known forces pressed on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PressedOn {
    /// Each sensor by itself.
    Taxel,
    /// All of them together.
    Field,
}

impl FromStr for PressedOn {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        match text {
            "taxel" => Ok(Self::Taxel),
            "field" => Ok(Self::Field),
            _ => Err(Error::usage(format!("there is no `{text}`; taxel or field"))),
        }
    }
}

impl Findings {
    /// Makes the presses of the survey `forces` on what they pressed `on`.
    ///
    /// One force is that of all presses. Sensors get gains by it, and one that was not pressed the middle one of the others'; a field gets
    /// one scale for all. Several forces are those of presses that follow each other: with each sensor they give a curve, with a field
    /// the scale that fits them best.
    ///
    /// # Errors
    /// No sensor was pressed; there were more or fewer presses than forces; a sensor went no farther under more force.
    pub fn know(&mut self, forces: &KnownForces, on: PressedOn) -> Result<()> {
        let mut travels: Vec<f64> = self.sensors.iter().filter_map(|found| found.travel).collect();
        let Some(usual) = median(&mut travels) else {
            return Err(Error::failed("no sensor was pressed, so that nothing is known of the force"));
        };
        match (on, &forces.0[..]) {
            (PressedOn::Taxel, &[newtons]) => {
                for found in &mut self.sensors {
                    found.gain = rounded(newtons / found.travel.unwrap_or(usual));
                }
            }
            (PressedOn::Taxel, forces) => self.curves = self.curves_by(forces)?,
            (PressedOn::Field, &[newtons]) => {
                let whole = self.sensors.iter().filter_map(|found| Some(found.travel? * found.gain)).sum::<f64>();
                self.scale = Some(rounded(newtons / whole));
            }
            (PressedOn::Field, _) if self.sensors.iter().any(|found| found.gain != 1.0) => {
                return Err(Error::usage(
                    "several forces give one scale beside gains of a file; write the gains first, and give them as --calibration",
                ));
            }
            (PressedOn::Field, forces) => {
                let wholes: Vec<f64> = clear(self.presses.iter().map(|press| press.whole), forces).collect();
                let (scale, remark) = scale_of(&wholes, forces)?;
                (self.scale, self.forces_agree) = (Some(scale), Some(remark));
            }
        }
        self.unit = "N".parse::<UnitOfP>()?;
        Ok(())
    }

    /// The curve of each sensor that was pressed with all of `forces`, and the middle of these.
    fn curves_by(&self, forces: &[f64]) -> Result<Vec<KnownCurve>> {
        let mut order: Vec<usize> = (0..forces.len()).collect();
        order.sort_by(|&a, &b| forces[a].total_cmp(&forces[b]));
        let mut curves = Vec::new();
        for (sensor, found) in self.sensors.iter().enumerate() {
            let travels = self.presses.iter().filter(|press| press.sensor == sensor).map(|press| press.travel);
            let own: Vec<f64> = clear(travels, forces).collect();
            if own.is_empty() {
                continue;
            }
            if own.len() != forces.len() {
                return Err(Error::failed(format!(
                    "sensor {} was pressed {} times, and {} forces are known; press each sensor once with each, in their order",
                    found.id,
                    own.len(),
                    forces.len()
                )));
            }
            let knots = order.iter().map(|&at| [rounded(own[at]), forces[at]]);
            let mut knots: Vec<[f64; 2]> = std::iter::once([0.0; 2]).chain(knots).collect();
            if let Some(pair) = knots.windows(2).find(|pair| pair[1][0] <= pair[0][0] || pair[1][1] <= pair[0][1]) {
                let ([less, low], [more, high]) = (pair[0], pair[1]);
                return Err(Error::failed(format!(
                    "sensor {} went {less} under {low} N and {more} under {high} N; it must go farther under more: is it at its \
                     end, or were the weights put on in another order?",
                    found.id
                )));
            }
            continued(&mut knots, found.full);
            curves.push(KnownCurve { id: Some(found.id), knots });
        }
        if curves.is_empty() {
            return Err(Error::failed("no sensor was pressed, so that nothing is known of the force"));
        }
        let middle = |knot: usize, part: usize| {
            let mut all: Vec<f64> = curves.iter().map(|curve| curve.knots[knot][part]).collect();
            median(&mut all)
        };
        let length = curves.iter().map(|curve| curve.knots.len()).min().unwrap_or(0);
        let usual = (0..length).filter_map(|knot| Some([middle(knot, 0)?, middle(knot, 1)?])).collect();
        curves.push(KnownCurve { id: None, knots: usual });
        Ok(curves)
    }
}

/// Those of `presses`, by how much they pressed, that one of `forces` can be: what only flickers is none.
pub(super) fn clear(presses: impl Iterator<Item = f64> + Clone, forces: &[f64]) -> impl Iterator<Item = f64> {
    let most = presses.clone().fold(0.0, f64::max);
    let lightest = forces.iter().copied().fold(f64::INFINITY, f64::min);
    let heaviest = forces.iter().copied().fold(0.0, f64::max);
    let least = CLEAR_SHARE * most * lightest / heaviest;
    presses.filter(move |&pressed| pressed >= least)
}

/// Goes on after the last of `knots` as before it, to the end of the sensor's range or to twice as far.
fn continued(knots: &mut Vec<[f64; 2]>, full: Option<f64>) {
    let ([from, low], [to, high]) = (knots[knots.len() - 2], knots[knots.len() - 1]);
    let end = full.filter(|&full| full > to).unwrap_or(2.0 * to);
    // Rounded to fewer digits than the force before has, it could be less.
    knots.push([end, high + (end - to) * (high - low) / (to - from)]);
}

/// The factor that makes `wholes`, what presses were all together, the `forces` that follow each other; and how well it does. One
/// force is that of all presses.
pub(super) fn scale_of(wholes: &[f64], forces: &[f64]) -> Result<(f64, String)> {
    let presses = wholes.len();
    if presses == 0 {
        return Err(Error::failed("no sensor was pressed, so that nothing is known of the force"));
    }
    if forces.len() > 1 && forces.len() != presses {
        return Err(Error::failed(format!(
            "there were {presses} presses, and {} forces are known; put each weight on once, in their order",
            forces.len()
        )));
    }
    let force = |press: usize| forces[press.min(forces.len() - 1)];
    let mut factors: Vec<f64> = (0..presses).map(|press| force(press) / wholes[press]).collect();
    let scale = median(&mut factors).unwrap_or(1.0);
    let off = (0..presses).map(|press| (scale * wholes[press] / force(press) - 1.0).abs()).fold(0.0, f64::max);
    let times = if presses == 1 { "1 press".to_owned() } else { format!("{presses} presses") };
    Ok((rounded(scale), format!("one scale for {times}; it is at most {:.1} % off", 100.0 * off)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_force_is_written_with_its_unit() {
        let newtons = |text: &str| text.parse::<KnownForces>().unwrap().0;
        assert_eq!((newtons("4.9N"), newtons("500 mN, 2N")), (vec![4.9], vec![0.5, 2.0]));
        assert!((newtons("500g")[0] - 4.903_325).abs() < 1e-12 && (newtons("0.5 kg")[0] - 4.903_325).abs() < 1e-12);
        for wrong in ["4.9", "N", "-1N", "0g", "3kPa", "1 m", "nanN", "1N,", "1N,2"] {
            assert!(wrong.parse::<KnownForces>().unwrap_err().is_usage(), "{wrong}");
        }
        assert!("elbow".parse::<PressedOn>().unwrap_err().is_usage());
    }

    #[test]
    fn a_curve_goes_through_its_knots_and_on() {
        let mut knots = vec![[0.0, 0.0], [100.0, 1.0], [200.0, 4.0]];
        continued(&mut knots, None);
        let curve = KnownCurve { id: Some(3), knots };
        assert_eq!(
            [0.0, 50.0, 100.0, 150.0, 200.0, 300.0, 500.0].map(|raw| curve.at(raw)),
            [0.0, 0.5, 1.0, 2.5, 4.0, 7.0, 13.0]
        );
        let mut knots = curve.knots[..3].to_vec();
        continued(&mut knots, Some(250.0));
        assert_eq!(knots[3], [250.0, 5.5]);
        // Just before its end it still rises.
        let mut knots = vec![[0.0, 0.0], [100.0, 1.0], [200.0, 4.903_33]];
        continued(&mut knots, Some(200.01));
        assert!(knots[3][1] > knots[2][1], "{knots:?}");
    }

    #[test]
    fn one_scale_is_the_middle_of_what_presses_say() {
        let (scale, remark) = scale_of(&[100.0, 200.0, 440.0], &[1.0, 2.0, 4.0]).unwrap();
        assert_eq!((scale, remark.as_str()), (0.01, "one scale for 3 presses; it is at most 10.0 % off"));
        assert_eq!(scale_of(&[50.0, 50.0], &[4.0]).unwrap().0, 0.08);
        assert!(scale_of(&[1.0], &[1.0, 2.0]).unwrap_err().to_string().contains("1 presses, and 2 forces"));
        let pressed = [0.1, 0.2, 100.0, 24.0, 200.0];
        assert_eq!(clear(pressed.into_iter(), &[1.0, 2.0]).collect::<Vec<_>>(), [100.0, 200.0]);
        assert!(scale_of(&[], &[1.0]).unwrap_err().to_string().contains("no sensor was pressed"));
    }
}
