//! Presses one after the other: when each begins and ends, which sensor it pressed most, and how far.

use super::at_rest::{MIN_TRAVEL_BANDS, middle};

/// Most presses that are kept.
const MOST: usize = 1 << 16;
/// A press ends where no more than this share of the most is left of it: what a sensor keeps of a weight that was taken off is less.
const LEFT_SHARE: f64 = 0.5;
/// The next press begins where that share of the last one is added to the least that was left of it.
const ADDED_SHARE: f64 = 0.05;

/// Divides a number that rises with every press into presses.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Divider {
    is_pressed: bool,
    most: f64,
    least: f64,
}

/// What a value is to the presses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Part {
    Between,
    Within,
    /// The press ended with the value before.
    Ended,
}

impl Divider {
    pub(super) fn see(&mut self, pressed: f64) -> Part {
        if self.is_pressed {
            self.most = self.most.max(pressed);
            if pressed > LEFT_SHARE * self.most {
                return Part::Within;
            }
            (self.is_pressed, self.least) = (false, pressed);
            return Part::Ended;
        }
        self.least = self.least.min(pressed);
        if pressed > self.least + ADDED_SHARE * self.most {
            (self.is_pressed, self.most) = (true, pressed);
            return Part::Within;
        }
        Part::Between
    }

    /// Whether a press lasts.
    pub(super) fn is_pressed(&self) -> bool {
        self.is_pressed
    }
}

/// A press.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Press {
    /// The sensor that went farthest, by its place in the survey.
    pub sensor: usize,
    /// How far that went, in raw units.
    pub travel: f64,
    /// How far all sensors together went, in raw units.
    pub whole: f64,
}

/// Follows the presses of a survey.
#[derive(Clone, Debug, Default)]
pub(super) struct Presses {
    divider: Divider,
    /// The last two values of each sensor, and how many there were.
    last: Vec<([f32; 2], usize)>,
    /// How far each sensor is from its rest, and how far it went in the press that lasts.
    away: Vec<f64>,
    farthest: Vec<f64>,
    all: Vec<Press>,
}

impl Presses {
    /// Takes the values of a frame of sensors with the baselines and dead bands `at_rest`, where raw values have steps of `step`.
    pub(super) fn see(&mut self, values: impl Iterator<Item = Option<f64>>, at_rest: &[Option<(f64, f64)>], step: f64) {
        self.last.resize(at_rest.len(), ([0.0; 2], 0));
        self.away.resize(at_rest.len(), 0.0);
        self.farthest.resize(at_rest.len(), 0.0);
        for (sensor, (value, rest)) in values.zip(at_rest).enumerate() {
            let (Some(value), Some((baseline, band))) = (value, *rest) else { continue };
            let (last, seen) = &mut self.last[sensor];
            let value = value as f32;
            let middle = if *seen >= 2 { middle(last[0], last[1], value) } else { value };
            (*last, *seen) = ([last[1], value], *seen + 1);
            let away = (f64::from(middle) - baseline).abs();
            self.away[sensor] = if *seen > 2 && away > MIN_TRAVEL_BANDS * band.max(step) { away } else { 0.0 };
        }
        match self.divider.see(self.away.iter().sum()) {
            Part::Within => {
                self.farthest.iter_mut().zip(&self.away).for_each(|(most, away)| *most = most.max(*away));
            }
            Part::Ended => self.end(),
            Part::Between => {}
        }
    }

    fn end(&mut self) {
        let farthest = self.farthest.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1).then(b.0.cmp(&a.0)));
        if let Some((sensor, &travel)) = farthest.filter(|_| self.all.len() < MOST) {
            self.all.push(Press { sensor, travel, whole: self.farthest.iter().sum() });
        }
        self.farthest.fill(0.0);
    }

    /// All presses, with the one that lasts.
    pub(super) fn all(&self) -> Vec<Press> {
        let mut ended = self.clone();
        if ended.divider.is_pressed() {
            ended.end();
        }
        ended.all
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Presses of two sensors, each five frames long, of these sensors and travels.
    fn pressed(presses: &[(usize, f64)], left: f64) -> Vec<Press> {
        let mut all = Presses::default();
        let mut see = |first: f64, second: f64| {
            all.see(
                [Some(100.0 + first), Some(300.0 - second)].into_iter(),
                &[Some((100.0, 1.0)), Some((300.0, 1.0))],
                1.0,
            );
        };
        (0..5).for_each(|_| see(0.0, 0.0));
        for &(sensor, travel) in presses {
            for part in [0.3, 0.9, 1.0, 1.0, 1.0, 0.6, left, left, left, 0.5 * left] {
                let away = travel * part;
                // The other one feels a twentieth.
                let both = if sensor == 0 { [away, away / 20.0] } else { [away / 20.0, away] };
                see(both[0], both[1]);
            }
        }
        all.all()
    }

    #[test]
    fn presses_are_told_apart_with_the_sensor_that_went_farthest() {
        for left in [0.0, 0.2] {
            let all = pressed(&[(0, 200.0), (1, 400.0), (0, 100.0), (0, 600.0)], left);
            let found: Vec<(usize, f64)> = all.iter().map(|press| (press.sensor, press.travel)).collect();
            assert_eq!(found, [(0, 200.0), (1, 400.0), (0, 100.0), (0, 600.0)], "{left}");
            assert!((all[1].whole - 420.0).abs() < 1e-9, "{all:?}");
        }
        assert!(pressed(&[(0, 2.0)], 0.0).is_empty(), "it does not leave its dead band");
    }

    #[test]
    fn a_press_that_lasts_at_the_end_counts() {
        let mut all = Presses::default();
        for value in [5.0, 5.0, 5.0, 90.0, 90.0, 90.0] {
            all.see([Some(value)].into_iter(), &[Some((5.0, 1.0))], 1.0);
        }
        assert_eq!(all.all(), [Press { sensor: 0, travel: 85.0, whole: 85.0 }]);
        assert_eq!(all.all().len(), 1);
    }
}
