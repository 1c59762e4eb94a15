//! Tuning: the wiper positions at which sensors use most of their converter's range. No I/O, no clock.
//!
//! A sensor and its potentiometer divide the supply, as [`FsrCircuit`] documents: of the reading's share x of the range,
//! x/(1 − x) is the sensor's resistance over D(wiper) where readings fall when pressed, and (1 − x)/x where they rise. So
//! one look at a rest and a firm press tells what both would read at every other wiper position, and the best of all 256 is chosen:
//! the one with the longest way from rest to press at which the press stays [`HEADROOM`] of the range from its end.
//!
//! A sensor's own circuit is not quite the model's, and a press that stands at the end of the range says only that it is
//! at least so firm. So what is chosen is looked at anew, in rounds, until every press is where it should be.

use super::at_rest::rest_of;
use super::{MIN_TRAVEL_BANDS, Pressed, Survey, Wishes};
use crate::error::Result;
use crate::signal::{FsrCircuit, RawValue};

/// Share of the range that a firm press leaves unused.
pub const HEADROOM: f64 = 1.0 / 16.0;
/// A press that leaves less than this share may be cut off.
const CUT_OFF: f64 = 1.0 / 64.0;
/// Minimum gain, as a share of the range, for which a wiper is moved.
const MIN_GAIN: f64 = 0.06;
/// A sensor that uses less than this share of the range at an extreme wiper position is reported.
const POOR_SHARE: f64 = 0.5;
/// Minimum travel of a press, as a share of the expected travel.
const MIN_EXPECTED_SHARE: f64 = 0.25;
pub const MAX_ROUNDS: usize = 5;

/// What a sensor read at one wiper position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look {
    /// Untouched, in raw units.
    pub rest: f64,
    /// Pressed firmly, in raw units.
    pub press: f64,
}

/// A converter with a sensor and its potentiometer before it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Divider {
    /// The highest reading; the lowest is 0.
    pub most: f64,
    /// Whether readings fall when the sensor is pressed.
    pub falls: bool,
}

impl Divider {
    /// The sensor's resistance when it reads `raw` at `wiper`, Ω; infinite where it reads what an open one does.
    #[must_use]
    pub fn ohm(self, raw: f64, wiper: u8) -> f64 {
        let open = if self.falls { raw >= self.most } else { raw <= 0.0 };
        if open {
            return f64::INFINITY;
        }
        // A reading stands for the middle of its step.
        let x = (raw.clamp(0.0, self.most) + 0.5) / (self.most + 1.0);
        let ratio = if self.falls { x / (1.0 - x) } else { (1.0 - x) / x };
        ratio * FsrCircuit { wiper }.divider_ohm()
    }

    /// The reading of a resistance of `ohm` at `wiper`, before it is cut down to a whole number.
    #[must_use]
    pub fn raw(self, ohm: f64, wiper: u8) -> f64 {
        let x = if ohm.is_infinite() { 1.0 } else { ohm / (ohm + FsrCircuit { wiper }.divider_ohm()) };
        let x = if self.falls { x } else { 1.0 - x };
        (x * (self.most + 1.0) - 0.5).clamp(0.0, self.most)
    }

    /// The share of the range between rest and press.
    #[must_use]
    pub fn share(self, look: Look) -> f64 {
        (look.rest - look.press).abs() / self.most
    }

    /// The share of the range that the press leaves.
    #[must_use]
    pub fn headroom(self, look: Look) -> f64 {
        (if self.falls { look.press } else { self.most - look.press }) / self.most
    }

    /// What was looked at with `wiper`, at another.
    #[must_use]
    pub fn moved(self, look: Look, wiper: u8, to: u8) -> Look {
        let at = |raw| self.raw(self.ohm(raw, wiper), to);
        Look { rest: at(look.rest), press: at(look.press) }
    }

    /// The best wiper position for a sensor that was looked at with `wiper`; the lowest one where no wiper position leaves the headroom.
    #[must_use]
    pub fn best(self, look: Look, wiper: u8) -> u8 {
        let mut best = (0, f64::NEG_INFINITY);
        for to in 0..=255 {
            let moved = self.moved(look, wiper, to);
            if self.headroom(moved) >= HEADROOM && self.share(moved) > best.1 {
                best = (to, self.share(moved));
            }
        }
        best.0
    }

    /// The wiper position that is worth going to from `wiper`, if one is.
    fn better(self, look: Look, wiper: u8) -> Option<u8> {
        let best = self.best(look, wiper);
        let gain = self.share(self.moved(look, wiper, best)) - self.share(look);
        (best != wiper && (self.headroom(look) < CUT_OFF || gain > MIN_GAIN)).then_some(best)
    }
}

/// How a sensor's tuning ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Tuned {
    /// A firm press uses its range, and leaves some.
    Fits,
    /// It delivered nothing at rest, and stays as it was.
    Silent,
    /// It was not pressed, and stays as it was.
    NotPressed,
    /// Its wiper was set, and it was not pressed again: what it reads now is not known.
    NotPressedAgain,
    /// At the highest wiper position a firm press uses less than half of the range.
    Weak,
    /// At the lowest wiper position a firm press reaches the end of the range.
    CutOff,
    /// It was still off after the last round.
    Unsettled,
    /// Its wiper could not be set.
    NotSet,
}

impl Tuned {
    /// What a person should know of it; nothing of one that fits.
    #[must_use]
    pub fn words(self) -> Option<&'static str> {
        Some(match self {
            Self::Fits => return None,
            Self::Silent => "delivered nothing",
            Self::NotPressed => "never pressed; left as it was",
            Self::NotPressedAgain => "set, but not pressed again to see it",
            Self::Weak => {
                "even the highest wiper position uses less than half of the range; press harder, or is it the right sensor?"
            }
            Self::CutOff => "even the lowest wiper position lets a firm press reach the end of the range",
            Self::Unsettled => "still off after the last round; is its circuit different?",
            Self::NotSet => "its board does not set it",
        })
    }
}

/// A sensor while it is tuned.
#[derive(Clone, Debug)]
pub struct Sensor {
    pub id: u32,
    /// The highest reading of its converter.
    pub most: f64,
    /// The wiper that it had at first.
    pub before: u8,
    /// The wiper that it has.
    pub wiper: u8,
    /// What it read at first, if it was pressed.
    pub first: Option<Look>,
    /// What it read last, and at which wiper position.
    looked: Option<(u8, Look)>,
    settable: bool,
    /// A way of at most this, raw units, may be noise.
    noise: f64,
    /// A way of at most this, raw units, is not a press.
    clear: f64,
    seen: Pressed,
    tuned: Tuned,
}

/// Sensors that are being tuned, in the order of the frames' values.
#[derive(Clone, Debug)]
pub struct Tuning {
    survey: Survey,
    sensors: Vec<Sensor>,
    falls: bool,
    rounds: usize,
}

impl Tuning {
    /// Begins with sensors of these ids, highest readings and wipers.
    #[must_use]
    pub fn new(sensors: &[(u32, f64, u8)]) -> Self {
        let ids: Vec<u32> = sensors.iter().map(|(id, ..)| *id).collect();
        let sensor = |&(id, most, wiper): &(u32, f64, u8)| Sensor {
            id,
            most,
            before: wiper,
            wiper,
            first: None,
            looked: None,
            settable: true,
            noise: f64::INFINITY,
            clear: f64::INFINITY,
            seen: Pressed::default(),
            tuned: Tuned::NotPressed,
        };
        Self { survey: Survey::new(&ids), sensors: sensors.iter().map(sensor).collect(), falls: false, rounds: 0 }
    }

    /// Takes the values of a frame in which nothing touches the robot, before the first round of presses.
    pub fn rest(&mut self, values: &[RawValue]) {
        self.survey.rest(values);
    }

    /// Takes the values of a frame in which sensors are pressed.
    pub fn press(&mut self, values: &[RawValue]) {
        if self.rounds == 0 {
            if self.sensors.iter().all(|sensor| sensor.noise.is_infinite()) {
                self.learn_noise();
            }
            self.survey.press(values);
        }
        for (sensor, value) in self.sensors.iter_mut().zip(values) {
            if let Some(value) = value.number() {
                sensor.seen.see(value as f32);
            }
        }
    }

    fn learn_noise(&mut self) {
        for (sensor, kept) in self.sensors.iter_mut().zip(&self.survey.rest) {
            let noise = rest_of(kept, 1.0)
                .map(|(_, noise)| MIN_TRAVEL_BANDS * (super::DEAD_BAND_MARGIN * noise).ceil().max(1.0));
            sensor.noise = noise.unwrap_or(f64::INFINITY);
            sensor.clear = sensor.noise;
        }
    }

    /// The sensors that still await a press in this round.
    pub fn awaited(&self) -> impl Iterator<Item = u32> {
        let awaited = |sensor: &&Sensor| !sensor.was_pressed() && (self.rounds == 0 || sensor.moved());
        self.sensors.iter().filter(awaited).map(|sensor| sensor.id)
    }

    /// The wiper of the sensor number `index` could not be set: it has `wiper`, as far as is known.
    pub fn not_set(&mut self, index: usize, wiper: u8) {
        let sensor = &mut self.sensors[index];
        (sensor.wiper, sensor.settable) = (wiper, false);
    }

    /// Ends a round: which sensors are to have which wipers now. Nothing is left to do where there are none.
    ///
    /// # Errors
    /// In the first round: nothing was delivered at rest, or nothing pressed.
    pub fn next_round(&mut self) -> Result<Vec<(usize, u8)>> {
        self.rounds += 1;
        if self.rounds == 1 {
            let findings = self.survey.finish(Wishes { mask_moved: true, ..Wishes::default() })?;
            self.falls = findings.invert;
            let side = if self.falls { -1.0 } else { 1.0 };
            for (sensor, found) in self.sensors.iter_mut().zip(&findings.sensors) {
                let way = found.baseline.zip(found.travel);
                sensor.first = way.map(|(rest, travel)| Look { rest, press: rest + side * travel });
                sensor.looked = sensor.first.map(|look| (sensor.wiper, look));
                sensor.tuned = if found.baseline.is_none() { Tuned::Silent } else { Tuned::NotPressed };
            }
        }
        let (first, last) = (self.rounds == 1, self.rounds == MAX_ROUNDS);
        let mut wipers = Vec::new();
        for (index, sensor) in self.sensors.iter_mut().enumerate() {
            let divider = Divider { most: sensor.most, falls: self.falls };
            if !first {
                sensor.look(self.falls);
            }
            sensor.seen = Pressed::default();
            let Some(look) = sensor.last() else {
                if sensor.first.is_some() {
                    sensor.tuned = Tuned::NotPressedAgain;
                }
                continue;
            };
            let better = divider.better(look, sensor.wiper);
            sensor.tuned = match better {
                None if divider.headroom(look) < CUT_OFF => Tuned::CutOff,
                None if divider.share(look) < POOR_SHARE && sensor.wiper == 255 => Tuned::Weak,
                None => Tuned::Fits,
                Some(_) if !sensor.settable => Tuned::NotSet,
                Some(_) => Tuned::Unsettled,
            };
            if let Some(wiper) = better.filter(|_| sensor.settable && !last) {
                let expected = divider.share(divider.moved(look, sensor.wiper, wiper)) * divider.most;
                sensor.clear = sensor.noise.max(MIN_EXPECTED_SHARE * expected);
                (sensor.wiper, sensor.tuned) = (wiper, Tuned::NotPressedAgain);
                wipers.push((index, wiper));
            }
        }
        Ok(wipers)
    }

    #[must_use]
    pub fn rounds(&self) -> usize {
        self.rounds
    }

    /// Whether raw values fall when sensors are pressed; known after the first round.
    #[must_use]
    pub fn falls(&self) -> bool {
        self.falls
    }

    #[must_use]
    pub fn sensors(&self) -> &[Sensor] {
        &self.sensors
    }

    /// How the sensors ended, and the shares of their ranges that they used at first and use now.
    pub fn outcomes(&self) -> impl Iterator<Item = (&Sensor, Tuned, [Option<f64>; 2])> {
        self.sensors.iter().map(|sensor| {
            let divider = Divider { most: sensor.most, falls: self.falls };
            (sensor, sensor.tuned, [sensor.first, sensor.last()].map(|look| look.map(|look| divider.share(look))))
        })
    }
}

impl Sensor {
    /// What it reads at the wiper that it has, if it was pressed since.
    #[must_use]
    pub fn last(&self) -> Option<Look> {
        self.looked.filter(|(wiper, _)| *wiper == self.wiper).map(|(_, look)| look)
    }

    /// Whether it has another wiper position than when it was looked at last.
    fn moved(&self) -> bool {
        self.first.is_some() && self.last().is_none()
    }

    fn was_pressed(&self) -> bool {
        self.seen.seen > 2 && f64::from(self.seen.high - self.seen.low) > self.clear
    }

    /// Takes what was seen in this round, if it was pressed: one end of it is its rest.
    fn look(&mut self, falls: bool) {
        if self.was_pressed() {
            let (low, high) = (f64::from(self.seen.low), f64::from(self.seen.high));
            let (rest, press) = if falls { (high, low) } else { (low, high) };
            self.looked = Some((self.wiper, Look { rest, press }));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A sensor that is not the model's: its potentiometer has another resistance, and so has its wiper.
    #[derive(Clone, Copy, Debug)]
    struct Real {
        potentiometer_ohm: f64,
        wiper_ohm: f64,
        rest_ohm: f64,
        press_ohm: f64,
        falls: bool,
        most: f64,
    }

    impl Real {
        fn read(&self, ohm: f64, wiper: u8) -> RawValue {
            let divider_ohm = self.potentiometer_ohm * f64::from(wiper) / 256.0 + self.wiper_ohm;
            let x = if ohm.is_infinite() { 1.0 } else { ohm / (ohm + divider_ohm) };
            let x = if self.falls { x } else { 1.0 - x };
            RawValue::new((x * (self.most + 1.0)).floor().min(self.most))
        }

        /// Tunes it beside a sound sensor, pressed `times` times as softly in each round.
        fn tune(&self, wiper: u8, softer: [f64; MAX_ROUNDS]) -> Tuning {
            let other = Real { rest_ohm: f64::INFINITY, press_ohm: 1e3, ..*self };
            let mut tuning = Tuning::new(&[(4, self.most, wiper), (5, self.most, 38)]);
            let frame = |tuning: &Tuning, own: f64, others: f64| {
                [self.read(own, tuning.sensors()[0].wiper), other.read(others, tuning.sensors()[1].wiper)]
            };
            for _ in 0..50 {
                let values = frame(&tuning, self.rest_ohm, other.rest_ohm);
                tuning.rest(&values);
            }
            for softer in softer {
                for n in 0..10 {
                    let pressed = (3..7).contains(&n);
                    let own = if pressed { self.press_ohm * softer } else { self.rest_ohm };
                    let values = frame(&tuning, own, if pressed { other.press_ohm } else { other.rest_ohm });
                    tuning.press(&values);
                }
                if tuning.next_round().unwrap().is_empty() {
                    break;
                }
            }
            tuning
        }
    }

    fn paper() -> Real {
        let (potentiometer_ohm, wiper_ohm) = (FsrCircuit::POTENTIOMETER_OHM, FsrCircuit::WIPER_OHM);
        let rest_ohm = f64::INFINITY;
        Real { potentiometer_ohm, wiper_ohm, rest_ohm, press_ohm: 1000.0, falls: true, most: 1023.0 }
    }

    #[test]
    fn the_best_wiper_is_as_by_hand() {
        for falls in [true, false] {
            let divider = Divider { most: 1023.0, falls };
            // 1 kΩ under 52 Ω reads 973 (FsrCircuit's own test); turned round, 50.
            let look = if falls { Look { rest: 1023.0, press: 973.0 } } else { Look { rest: 0.0, press: 50.0 } };
            assert!((divider.ohm(look.press, 0) - 1000.0).abs() < 11.0, "half a step is 1 %");
            // A sixteenth is left where D = 15 R: 15 kΩ is wiper 76.5.
            let best = divider.best(look, 0);
            assert!((75..=78).contains(&best), "{best}");
            assert_eq!(divider.better(divider.moved(look, 0, best), best), None, "it is good as it is");
            // One that is open for all that is done to it uses nothing at any wiper position.
            assert_eq!(divider.best(Look { press: look.rest, ..look }, 255), 0);
            // With a rest of 4 kΩ over a press of 1 kΩ the way is longest at √(4 · 1) kΩ = 2 kΩ, wiper 10.
            let preloaded = Look { rest: divider.raw(4000.0, 0), press: divider.raw(1000.0, 0) };
            assert!((9..=11).contains(&divider.best(preloaded, 0)), "{}", divider.best(preloaded, 0));
        }
    }

    #[test]
    fn what_cannot_be_tuned_is_distinguished_from_what_fits() {
        let outcome = |real: Real, wiper| {
            let tuning = real.tune(wiper, [1.0; MAX_ROUNDS]);
            let (sensor, tuned, _) = tuning.outcomes().next().unwrap();
            (tuned, sensor.before, sensor.wiper)
        };
        assert_eq!(outcome(paper(), 3).0, Tuned::Fits);
        assert_eq!(outcome(Real { press_ohm: f64::INFINITY, ..paper() }, 3), (Tuned::NotPressed, 3, 3));
        assert_eq!(outcome(Real { press_ohm: 80_000.0, ..paper() }, 3), (Tuned::Weak, 3, 255));
        assert_eq!(outcome(Real { press_ohm: 0.4, ..paper() }, 60), (Tuned::CutOff, 60, 0));
        // One that fits is left alone.
        assert_eq!(outcome(paper(), 70), (Tuned::Fits, 70, 70));
    }

    #[test]
    fn a_press_that_was_softer_by_chance_is_not_chased() {
        // 66 % of the range at first, then 57 % of a softer press: the highest wiper position would give 5 % more.
        let (potentiometer_ohm, press_ohm) = (9_897.0, 4_881.0);
        let real = Real { potentiometer_ohm, wiper_ohm: 20.0, press_ohm, ..paper() };
        let tuning = Real { falls: false, ..real }.tune(199, [0.8, 1.206, 0.8, 0.8, 0.8]);
        let (sensor, tuned, [before, now]) = tuning.outcomes().next().unwrap();
        assert_eq!((tuned, sensor.wiper), (Tuned::Fits, 199));
        assert!((before.unwrap() - 0.66).abs() < 0.01 && (now.unwrap() - 0.57).abs() < 0.01, "{before:?} {now:?}");
    }

    #[test]
    fn a_sensor_that_is_not_set_or_not_pressed_again_is_reported() {
        let mut tuning = Tuning::new(&[(4, 1023.0, 0), (5, 1023.0, 0)]);
        let sensor = paper();
        let both = |tuning: &Tuning, ohm| {
            let at = |index: usize| sensor.read(ohm, tuning.sensors()[index].wiper);
            [at(0), at(1)]
        };
        (0..9).for_each(|_| tuning.rest(&both(&tuning.clone(), f64::INFINITY)));
        (0..9).for_each(|_| tuning.press(&both(&tuning.clone(), 1000.0)));
        assert_eq!(tuning.awaited().count(), 2, "nobody has seen them let go");
        (0..9).for_each(|_| tuning.press(&both(&tuning.clone(), f64::INFINITY)));
        assert_eq!(tuning.awaited().count(), 0);
        let wipers = tuning.next_round().unwrap();
        assert_eq!(wipers.len(), 2);
        tuning.not_set(1, 0);
        // A light touch in the next round is not a firm press.
        (0..9).for_each(|n| tuning.press(&both(&tuning.clone(), if n < 5 { f64::INFINITY } else { 90_000.0 })));
        assert!(tuning.next_round().unwrap().is_empty());
        let ended: Vec<(Tuned, u8, bool)> =
            tuning.outcomes().map(|(s, t, _)| (t, s.wiper, s.last().is_some())).collect();
        assert_eq!(ended, [(Tuned::NotPressedAgain, wipers[0].1, false), (Tuned::NotSet, 0, true)]);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(3000))]

        #[test]
        fn forward_undoes_backward(wiper: u8, log_ohm in 2.0..16.0_f64, falls: bool) {
            let divider = Divider { most: 1023.0, falls };
            let raw = divider.raw(libm::exp(log_ohm), wiper);
            prop_assume!((1.0..=1022.0).contains(&raw));
            prop_assert!((divider.raw(divider.ohm(raw, wiper), wiper) - raw).abs() < 1e-6);
        }

        #[test]
        fn other_circuits_and_other_presses_come_into_range(
            wiper in 4..=255_u8,
            log_pot in 9.2..11.5_f64,
            wiper_ohm in 20.0..200.0_f64,
            log_press in 5.5..8.5_f64,
            softer in prop::array::uniform5(0.8..1.25_f64),
            falls: bool,
            bits in prop::sample::select(vec![10_u32, 12, 16]),
        ) {
            let most = f64::from((1_u32 << bits) - 1);
            let (potentiometer_ohm, press_ohm) = (libm::exp(log_pot), libm::exp(log_press));
            let real = Real { potentiometer_ohm, wiper_ohm, press_ohm, falls, most, ..paper() };
            let tuning = real.tune(wiper, softer);
            let (sensor, tuned, [_, share]) = tuning.outcomes().next().unwrap();
            prop_assert_eq!(tuned, Tuned::Fits, "{:?}", sensor);
            // From 245 Ω to 5 kΩ, every potentiometer of 10 to 100 kΩ has a wiper position that uses two thirds or more of the range. A
            // softer press uses less, and what is not worth another wiper is left; a hundredth for the model's other wiper.
            let softest_ohm = press_ohm * softer.into_iter().fold(0.0, f64::max);
            let most_ohm = potentiometer_ohm * 255.0 / 256.0 + wiper_ohm;
            let least = (most_ohm / (most_ohm + softest_ohm) - MIN_GAIN - 0.01).min(0.6);
            prop_assert!(share.unwrap() > least, "{share:?} {least} {sensor:?}");
            let divider = Divider { most, falls };
            prop_assert!(divider.headroom(sensor.last().unwrap()) >= CUT_OFF);
        }
    }
}
