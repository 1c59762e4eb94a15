//! Which sensors answer while somebody presses one after the other: what shows whether the order of pads is the right one.
//!
//! Values of P are what they are. Raw values are compared with those of the first second, in which nothing is pressed. As in surveys, a
//! value counts as far as it is the middle one of three in succession, so that a single wrong value is not a press.

use super::at_rest::{MIN_TRAVEL_BANDS, middle, rest_of};

/// How long raw values are taken for those at rest, s.
pub const REST_S: f64 = 1.0;
/// Values at rest that are kept of a sensor.
const MAX_REST_VALUES: usize = 1024;
/// A group answers from this share of the most that any group was pressed so far,
const ON_SHARE: f64 = 0.05;
/// and no longer below this share. Sensors that creep back after a press do not answer.
const OFF_SHARE: f64 = 0.025;
/// Another group answers in its place where it is pressed this many times as hard.
const CLEARER: f64 = 1.25;
/// A press is reported so long after its begin, with the most that it had until then, s.
const SETTLES_S: f64 = 0.2;

/// Sensors that answer as one.
#[derive(Clone, Debug, PartialEq)]
pub struct SensorGroup {
    /// As people call it.
    pub name: String,
    /// Its sensors, by their places in a frame's values.
    pub sensors: Vec<usize>,
}

/// How values are to be read.
#[derive(Clone, Debug, PartialEq)]
pub enum Reading {
    /// As raw values, of which the distance from rest counts.
    Raw,
    /// As P; each is multiplied by the sensor's factor, such as its area.
    Pressures(Vec<f64>),
}

/// A group that was pressed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Answer {
    /// The group, by its place.
    pub group: usize,
    /// The most that its sensors had together.
    pub most: f64,
    /// The sensor that had most of it, by its place in a frame's values.
    pub sensor: usize,
}

/// A press that lasts.
#[derive(Clone, Copy, Debug)]
struct Lasting {
    answer: Answer,
    since_s: f64,
    is_reported: bool,
}

/// Follows which group of sensors is pressed.
#[derive(Clone, Debug)]
pub struct PressOrder {
    groups: Vec<SensorGroup>,
    reading: Reading,
    begin_s: Option<f64>,
    /// Of raw values: by sensor those at rest, then each one's baseline and noise.
    rest: Vec<Vec<f32>>,
    at_rest: Vec<Option<(f64, f64)>>,
    /// The last two values of each sensor.
    last: Vec<[Option<f32>; 2]>,
    /// How far each sensor is pressed.
    pressed: Vec<f64>,
    has_answered: Vec<bool>,
    most: f64,
    lasting: Option<Lasting>,
}

impl PressOrder {
    /// Begins with frames of `sensors` values, of which `groups` answer together.
    #[must_use]
    pub fn new(groups: Vec<SensorGroup>, sensors: usize, reading: Reading) -> Self {
        let rest = if reading == Reading::Raw { vec![Vec::new(); sensors] } else { Vec::new() };
        Self {
            has_answered: vec![false; groups.len()],
            groups,
            reading,
            begin_s: None,
            rest,
            at_rest: vec![None; sensors],
            last: vec![[None; 2]; sensors],
            pressed: vec![0.0; sensors],
            most: 0.0,
            lasting: None,
        }
    }

    /// The groups.
    #[must_use]
    pub fn groups(&self) -> &[SensorGroup] {
        &self.groups
    }

    /// Whether raw values are still taken for those at rest.
    #[must_use]
    pub fn is_at_rest(&self) -> bool {
        !self.rest.is_empty()
    }

    /// The groups that did not answer so far.
    pub fn silent(&self) -> impl Iterator<Item = &SensorGroup> {
        self.groups.iter().zip(&self.has_answered).filter(|(_, has)| !**has).map(|(group, _)| group)
    }

    /// Takes the values of a frame at the time `t_s`; gives a press that is to be reported.
    pub fn see(&mut self, t_s: f64, values: impl Iterator<Item = Option<f64>>) -> Option<Answer> {
        let since_s = t_s - *self.begin_s.get_or_insert(t_s);
        if !self.rest.is_empty() && since_s < REST_S {
            for (kept, value) in self.rest.iter_mut().zip(values) {
                kept.extend(value.filter(|_| kept.len() < MAX_REST_VALUES).map(|value| value as f32));
            }
            return None;
        }
        if !self.rest.is_empty() {
            let step = if self.rest.iter().flatten().all(|value| value.fract() == 0.0) { 1.0 } else { 0.0 };
            self.at_rest = self.rest.drain(..).map(|kept| rest_of(&kept, step)).collect();
            self.at_rest.iter_mut().flatten().for_each(|(_, noise)| *noise = noise.max(step));
        }
        self.press(values);
        self.follow(t_s)
    }

    /// The press that lasts at the end, if it was not reported.
    pub fn finish(&mut self) -> Option<Answer> {
        self.lasting.take().and_then(|lasting| self.reported(lasting))
    }

    /// Finds how far each sensor is pressed.
    fn press(&mut self, values: impl Iterator<Item = Option<f64>>) {
        for (sensor, value) in values.enumerate().take(self.pressed.len()) {
            let value = value.map(|value| value as f32);
            let [before, last] = self.last[sensor];
            self.last[sensor] = [last, value];
            self.pressed[sensor] = match (before, last, value) {
                (Some(before), Some(last), Some(value)) => self.away(sensor, middle(before, last, value).into()),
                // It has just begun, or a value is missing.
                _ => 0.0,
            };
        }
    }

    /// How far `value` of a sensor is from rest, where that is clear.
    fn away(&self, sensor: usize, value: f64) -> f64 {
        match &self.reading {
            Reading::Pressures(factors) => value.max(0.0) * factors.get(sensor).copied().unwrap_or(1.0),
            Reading::Raw => {
                let Some((baseline, noise)) = self.at_rest[sensor] else { return 0.0 };
                let away = (value - baseline).abs();
                if away > MIN_TRAVEL_BANDS * noise { away } else { 0.0 }
            }
        }
    }

    /// Which group is pressed now, and what is to be reported of that.
    fn follow(&mut self, t_s: f64) -> Option<Answer> {
        let sums: Vec<f64> = self.groups.iter().map(|group| self.sum(group)).collect();
        let (strongest, sum) = sums.iter().copied().enumerate().max_by(|a, b| a.1.total_cmp(&b.1))?;
        self.most = self.most.max(sum);
        let goes_on = self.lasting.is_some_and(|lasting| {
            let own = sums[lasting.answer.group];
            own > OFF_SHARE * self.most && sum <= CLEARER * own
        });
        if goes_on {
            return self.go_on(&sums, t_s);
        }
        let ended = self.lasting.take();
        if sum > 0.0 && sum >= ON_SHARE * self.most {
            let answer = Answer { group: strongest, most: sum, sensor: self.sensor_of(strongest) };
            self.lasting = Some(Lasting { answer, since_s: t_s, is_reported: false });
        }
        ended.and_then(|lasting| self.reported(lasting))
    }

    /// Goes on with the press that lasts.
    fn go_on(&mut self, sums: &[f64], t_s: f64) -> Option<Answer> {
        let mut lasting = self.lasting?;
        let group = lasting.answer.group;
        if sums[group] > lasting.answer.most {
            lasting.answer = Answer { group, most: sums[group], sensor: self.sensor_of(group) };
        }
        let settled = (t_s - lasting.since_s >= SETTLES_S).then(|| self.reported(lasting)).flatten();
        self.lasting = Some(Lasting { is_reported: lasting.is_reported || settled.is_some(), ..lasting });
        settled
    }

    /// What is to be reported of a press.
    fn reported(&mut self, lasting: Lasting) -> Option<Answer> {
        self.has_answered[lasting.answer.group] = true;
        (!lasting.is_reported).then_some(lasting.answer)
    }

    fn sum(&self, group: &SensorGroup) -> f64 {
        group.sensors.iter().map(|&sensor| self.pressed[sensor]).sum()
    }

    /// The sensor of a group that is pressed most.
    fn sensor_of(&self, group: usize) -> usize {
        let own = self.groups[group].sensors.iter().copied();
        own.max_by(|a, b| self.pressed[*a].total_cmp(&self.pressed[*b])).unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn order(reading: Reading) -> PressOrder {
        let group = |name: &str, sensors: &[usize]| SensorGroup { name: name.to_owned(), sensors: sensors.to_vec() };
        PressOrder::new(vec![group("thumb", &[0, 1]), group("index", &[2]), group("palm", &[3])], 4, reading)
    }

    /// Frames at 100 Hz; what is reported, with the time of that.
    fn seen(order: &mut PressOrder, frames: usize, value: impl Fn(usize, usize) -> Option<f64>) -> Vec<(f64, Answer)> {
        let mut all = Vec::new();
        for frame in 0..frames {
            let t_s = frame as f64 / 100.0;
            let answer = order.see(t_s, (0..4).map(|sensor| value(frame, sensor)));
            all.extend(answer.map(|answer| (t_s, answer)));
        }
        all.extend(order.finish().map(|answer| (f64::INFINITY, answer)));
        all
    }

    #[test]
    fn raw_values_that_rise_or_fall_are_presses_in_their_order() {
        let mut order = order(Reading::Raw);
        // Sensor 1 rises by 400 from 1.5 s on, 2 falls from 2 s on for a tenth of a second, and 1 again at the end; 3 has one odd value.
        let value = |frame: usize, sensor: usize| {
            let noise = [0.0, 1.0, -1.0][frame % 3];
            let pressed = match (sensor, frame) {
                (1, 150..200 | 240..) => 400.0,
                (2, 200..210) => -300.0,
                (3, 170) => 5000.0,
                _ => 0.0,
            };
            Some(1000.0 + noise + pressed)
        };
        let all = seen(&mut order, 250, value);
        let found: Vec<(usize, usize)> = all.iter().map(|(_, answer)| (answer.group, answer.sensor)).collect();
        assert_eq!(found, [(0, 1), (1, 2), (0, 1)]);
        assert!((1.70..1.73).contains(&all[0].0) && (2.09..2.14).contains(&all[1].0), "{all:?}");
        assert!((all[0].1.most - 400.0).abs() < 3.0 && (all[1].1.most - 300.0).abs() < 3.0, "{all:?}");
        assert_eq!(order.silent().map(|group| group.name.as_str()).collect::<Vec<_>>(), ["palm"]);
    }

    #[test]
    fn pressures_count_from_the_first_frame_and_what_is_left_of_a_press_is_none() {
        let mut order = order(Reading::Pressures(vec![1.0, 1.0, 1.0, 10.0]));
        // What is left of the thumb's press is 2 %; the palm's factor makes 1 a press as large as 10.
        let value = |frame: usize, sensor: usize| {
            Some(match (sensor, frame) {
                (0, 0..40) => 5.0,
                (0, 40..) => 0.1,
                (3, 100..) => 1.0,
                _ => 0.0,
            })
        };
        let all = seen(&mut order, 200, value);
        let found: Vec<(usize, f64)> = all.iter().map(|(_, answer)| (answer.group, answer.most)).collect();
        assert_eq!(found, [(0, 5.0), (2, 10.0)]);
        assert_eq!(order.silent().count(), 1);
    }

    #[test]
    fn a_finger_that_slides_on_is_reported_where_it_comes_to() {
        let mut order = order(Reading::Pressures(vec![1.0; 4]));
        let value = |frame: usize, sensor: usize| {
            let to = frame as f64 / 100.0;
            Some([4.0 * (1.0 - to), 0.0, 4.0 * to, 0.0][sensor])
        };
        let all = seen(&mut order, 100, value);
        assert_eq!(all.iter().map(|(_, answer)| answer.group).collect::<Vec<_>>(), [0, 1]);
        // Missing values are no press, nor is nothing at all.
        let mut none = self::order(Reading::Raw);
        assert!(seen(&mut none, 300, |frame, _| (frame % 2 == 0).then_some(5.0)).is_empty());
        assert_eq!(none.silent().count(), 3);
    }
}
