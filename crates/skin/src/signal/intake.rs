//! Selects the raw values that a plan reads from a source's frames; holds missing values, marks rejected ones faulty, and corrects normal
//! values for what is along the skin.
//!
//! It runs on the host, frame by frame, so that all backends get the same input for any batch size.

use std::collections::BTreeMap;

use super::leak::Leak;
use super::{Calibration, RawValue};

/// What selects values.
#[derive(Clone, Debug)]
pub struct Intake {
    calibration: Calibration,
    /// Per taxel its neighbours, for the check of isolated values; empty if that is off.
    neighbours: Vec<Vec<u32>>,
    max_age_s: f64,
    /// Per channel of the body, the taxel that it is of. The first ones are the taxels' own, in their order.
    taxel_of_channel: Vec<usize>,
    /// Per value of a source's frame, the channel it belongs to.
    taxel_of_value: Vec<usize>,
    /// Of taxels whose normal values are corrected, ascending.
    corrected: Vec<Corrected>,
    state: IntakeState,
    /// Whether the last frame was rejected.
    is_rejected: bool,
    /// Per channel its value in this frame.
    now: Vec<RawValue>,
    /// Per taxel its distance from rest, raw units, for the check of isolated values.
    rise: Vec<f64>,
    /// Per frame since [`Intake::forget_stale`] its stale taxels; `None` if they are not tracked.
    stale: Option<Vec<Vec<usize>>>,
}

/// A taxel whose normal value is corrected.
#[derive(Clone, Debug)]
struct Corrected {
    leak: Leak,
    /// Its channels: its own, and those along t and n × t.
    channels: [usize; 3],
    /// Where the last two are in a frame.
    places: [Option<usize>; 2],
}

/// What it knows of the frames so far.
#[derive(Clone, Debug)]
pub struct IntakeState {
    /// Per channel, the last value that arrived, and when.
    last: Vec<(RawValue, f64)>,
    frames_seen: u64,
}

impl IntakeState {
    /// The number of channels.
    pub fn taxels(&self) -> usize {
        self.last.len()
    }
}

impl Intake {
    /// For channels that are of these taxels of `calibration`; frames have their order until [`Intake::set_channels`] changes it.
    pub fn new(
        calibration: Calibration,
        neighbours: Vec<Vec<u32>>,
        max_age_s: f64,
        taxel_of_channel: Vec<usize>,
    ) -> Self {
        let (taxels, channels) = (calibration.taxels.len(), taxel_of_channel.len());
        let mut made = Self {
            corrected: corrected(&calibration, &taxel_of_channel),
            calibration,
            neighbours,
            max_age_s,
            taxel_of_channel,
            taxel_of_value: Vec::new(),
            is_rejected: false,
            state: IntakeState { last: vec![(RawValue::MISSING, 0.0); channels], frames_seen: 0 },
            now: vec![RawValue::MISSING; channels],
            rise: vec![0.0; taxels],
            stale: None,
        };
        made.set_channels((0..channels).collect());
        made
    }

    /// From now on, value i of a frame belongs to channel `taxel_of_value[i]`.
    pub fn set_channels(&mut self, taxel_of_value: Vec<usize>) {
        for own in &mut self.corrected {
            let place = |of: usize| taxel_of_value.iter().position(|&channel| channel == own.channels[of]);
            own.places = [place(1), place(2)];
        }
        self.taxel_of_value = taxel_of_value;
    }

    /// Per value of a frame the channel that it belongs to.
    pub fn taxel_of_value(&self) -> &[usize] {
        &self.taxel_of_value
    }

    /// What the next frames depend on.
    pub fn state(&self) -> &IntakeState {
        &self.state
    }

    /// Goes on from `state`, of the same calibration.
    pub fn restore(&mut self, state: &IntakeState) {
        self.state.clone_from(state);
    }

    /// From now on keeps the stale taxels of each frame.
    pub fn track_stale(&mut self) {
        self.stale = Some(Vec::new());
    }

    /// Per frame since [`Intake::forget_stale`] its stale taxels; empty if they are not tracked.
    pub fn stale(&self) -> &[Vec<usize>] {
        self.stale.as_deref().unwrap_or_default()
    }

    /// Forgets the stale taxels of the frames so far.
    pub fn forget_stale(&mut self) {
        self.stale.iter_mut().for_each(Vec::clear);
    }

    /// The number of values of a frame.
    pub fn width(&self) -> usize {
        self.taxel_of_value.len()
    }

    /// The indices in a frame of the taxels `slots`, if values pass unchanged and the source delivers all of them.
    pub fn picks(&self, slots: &[usize]) -> Option<Vec<u32>> {
        let checks = &self.calibration.checks;
        let checked =
            checks.settle_frames > 0 || checks.broken_frame_share.is_some() || checks.isolated_ratio.is_some();
        let checked = checked || !self.calibration.missing.is_empty() || !self.corrected.is_empty();
        if checked || self.max_age_s > 0.0 || self.stale.is_some() {
            return None;
        }
        self.places(slots).into_iter().collect()
    }

    /// The indices in a frame of the channels `slots`, of those that the source delivers.
    pub fn places(&self, slots: &[usize]) -> Vec<Option<u32>> {
        let mut value_of = vec![None; self.now.len()];
        for (value, &channel) in self.taxel_of_value.iter().enumerate() {
            value_of[channel] = u32::try_from(value).ok();
        }
        slots.iter().map(|&slot| value_of[slot]).collect()
    }

    /// Appends to `out` the values of the taxels `slots` in the frame at `t_s` with `values`.
    pub fn take(&mut self, t_s: f64, values: &[RawValue], slots: &[usize], out: &mut Vec<RawValue>) {
        self.now.fill(RawValue::MISSING);
        for (&taxel, &value) in self.taxel_of_value.iter().zip(values) {
            self.now[taxel] = self.read(taxel, value);
        }
        if self.max_age_s > 0.0 {
            self.hold(t_s);
        }
        self.note_stale();
        let settling = self.state.frames_seen < self.calibration.checks.settle_frames;
        self.state.frames_seen += 1;
        self.is_rejected = settling || self.is_broken();
        if self.is_rejected {
            out.extend(
                slots
                    .iter()
                    .map(|&slot| if self.now[slot].is_missing() { RawValue::MISSING } else { RawValue::FAULTY }),
            );
            return;
        }
        for Corrected { leak, channels: [normal, u, v], .. } in &self.corrected {
            self.now[*normal] = leak.corrected(self.now[*normal], [self.now[*u], self.now[*v]]);
        }
        if let Some(ratio) = self.calibration.checks.isolated_ratio {
            self.reject_isolated(ratio);
        }
        out.extend(slots.iter().map(|&slot| self.now[slot]));
    }

    /// Appends to `out` the values of the channels `slots` in the last frame taken.
    pub fn take_more(&self, slots: &[usize], out: &mut Vec<RawValue>) {
        let value = |&slot: &usize| match self.now[slot] {
            value if self.is_rejected && !value.is_missing() => RawValue::FAULTY,
            value => value,
        };
        out.extend(slots.iter().map(value));
    }

    /// `value` of channel `channel`, missing if it is one of those that the calibration calls no reading.
    pub fn read(&self, channel: usize, value: RawValue) -> RawValue {
        if self.calibration.is_no_reading(self.taxel_of_channel[channel], value) { RawValue::MISSING } else { value }
    }

    /// What value `place` of a frame of `values` is by itself, without what the frames before tell: missing as [`Intake::read`] has it, and
    /// corrected.
    pub fn read_alone(&self, place: usize, values: &[RawValue]) -> RawValue {
        let read = |place: usize| self.read(self.taxel_of_value[place], values[place]);
        let own = self.corrected.binary_search_by_key(&self.taxel_of_value[place], |own| own.channels[0]);
        match own.map(|at| (&self.corrected[at].leak, self.corrected[at].places)) {
            Ok((leak, [Some(u), Some(v)])) => leak.corrected(read(place), [read(u), read(v)]),
            _ => read(place),
        }
    }

    /// Records stale values, if they are tracked, and makes them missing.
    fn note_stale(&mut self) {
        let Some(stale) = &mut self.stale else { return };
        let mut noted = Vec::new();
        for (taxel, value) in self.now.iter_mut().enumerate() {
            if *value == RawValue::STALE {
                *value = RawValue::MISSING;
                noted.push(taxel);
            }
        }
        stale.push(noted);
    }

    /// Replaces missing values by the last ones that arrived within `max_age_s`.
    fn hold(&mut self, t_s: f64) {
        for (now, (last, at)) in self.now.iter_mut().zip(&mut self.state.last) {
            if !now.is_missing() {
                (*last, *at) = (*now, t_s);
            } else if (0.0..=self.max_age_s).contains(&(t_s - *at)) {
                *now = *last;
            }
        }
    }

    /// Whether too many values lie outside the sensors' range.
    fn is_broken(&self) -> bool {
        let Some(share) = self.calibration.checks.broken_frame_share else { return false };
        let (mut present, mut outside) = (0_u32, 0_u32);
        for (value, taxel) in self.now.iter().zip(&self.calibration.taxels) {
            if !value.is_missing() && !taxel.mask {
                present += 1;
                let [low, high] = taxel.raw_range.map(f64::from);
                outside += u32::from(value.number().is_none_or(|value| !(low..=high).contains(&value)));
            }
        }
        f64::from(outside) > share * f64::from(present)
    }

    fn reject_isolated(&mut self, ratio: f64) {
        for (index, (rise, value)) in self.rise.iter_mut().zip(&self.now).enumerate() {
            let masked = self.calibration.taxels[index].mask;
            let number = value.number().filter(|_| !masked);
            *rise = number.map_or(0.0, |value| self.calibration.rise(index, value).max(0.0));
        }
        for (index, neighbours) in self.neighbours.iter().enumerate() {
            let rise = self.rise[index];
            let highest = neighbours.iter().map(|&n| self.rise[n as usize]).fold(0.0, f64::max);
            if !neighbours.is_empty() && rise > self.calibration.checks.isolated_above && rise > ratio * highest {
                self.now[index] = RawValue::FAULTY;
            }
        }
    }
}

/// The taxels whose channels are of all three axes and whose normal values have something of the others in them.
fn corrected(calibration: &Calibration, taxel_of_channel: &[usize]) -> Vec<Corrected> {
    if !calibration.shear.leaks_into_normal() {
        return Vec::new();
    }
    let mut sides_of: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for (channel, &taxel) in taxel_of_channel.iter().enumerate().skip(calibration.taxels.len()) {
        sides_of.entry(taxel).or_default().push(channel);
    }
    let made = sides_of.into_iter().filter_map(|(taxel, sides)| match sides[..] {
        [u, v] => Some(Corrected { leak: calibration.leak_of(taxel)?, channels: [taxel, u, v], places: [None; 2] }),
        _ => None,
    });
    made.collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::signal::Frame;

    fn frame(t_s: f64, values: &[Option<f64>]) -> Frame {
        let values = values.iter().map(|v| v.map_or(RawValue::MISSING, RawValue::new)).collect();
        Frame { t_s, values, ..Frame::default() }
    }

    fn take(intake: &mut Intake, frame: &Frame) -> Vec<RawValue> {
        let mut out = Vec::new();
        intake.take(frame.t_s, &frame.values, &[0, 1, 2], &mut out);
        out
    }

    fn numbers(values: &[RawValue]) -> Vec<Option<f64>> {
        values.iter().map(|v| v.number()).collect()
    }

    #[test]
    fn a_missing_value_is_held_for_its_age_and_no_longer() {
        let mut intake = Intake::new(Calibration::identity(3), Vec::new(), 0.5, vec![0, 1, 2]);
        take(&mut intake, &frame(1.0, &[Some(7.0), None, Some(9.0)]));
        let held = take(&mut intake, &frame(1.5, &[None, None, Some(10.0)]));
        assert_eq!(numbers(&held), [Some(7.0), None, Some(10.0)]);
        let late = take(&mut intake, &frame(1.6, &[None, None, None]));
        assert_eq!(numbers(&late), [None, None, Some(10.0)]);
        assert!(late[0].is_missing());
    }

    #[test]
    fn what_is_stale_is_missing_and_noted() {
        let mut intake = Intake::new(Calibration::identity(3), Vec::new(), 0.0, vec![0, 1, 2]);
        assert!(intake.picks(&[0, 1]).is_some() && intake.stale().is_empty());
        intake.track_stale();
        assert!(intake.picks(&[0, 1]).is_none());
        let mut seen = frame(0.0, &[Some(1.0), None, None]);
        seen.values[2] = RawValue::STALE;
        assert_eq!(take(&mut intake, &seen)[1..], [RawValue::MISSING; 2]);
        assert_eq!(intake.stale(), [vec![2]]);
        intake.forget_stale();
        take(&mut intake, &frame(0.0, &[None, None, Some(1.0)]));
        assert_eq!(intake.stale(), [Vec::<usize>::new()]);
    }

    #[test]
    fn a_raw_value_that_is_not_a_reading_is_missing_and_held_as_such() {
        let calibration = Calibration::parse("[taxel.2]\nmissing = [30000]", &[1, 2, 3]).unwrap();
        let mut intake = Intake::new(calibration.clone(), Vec::new(), 0.0, vec![0, 1, 2]);
        assert!(intake.picks(&[0, 1, 2]).is_none());
        let codes = frame(0.0, &[Some(30_000.0), Some(30_000.0), None]);
        assert_eq!(numbers(&take(&mut intake, &codes)), [Some(30_000.0), None, None]);
        assert!(take(&mut intake, &codes)[1].is_missing());
        let mut held = Intake::new(calibration, Vec::new(), 0.5, vec![0, 1, 2]);
        take(&mut held, &frame(0.0, &[None, Some(7.0), None]));
        assert_eq!(take(&mut held, &codes)[1].number(), Some(7.0));
    }

    #[test]
    fn a_garbled_frame_and_a_settling_one_are_not_believed() {
        let text = "[all]\nraw_range = [0, 100]\n[checks]\nsettle_frames = 1\nbroken_frame_share = 0.4";
        let mut intake = Intake::new(Calibration::parse(text, &[1, 2, 3]).unwrap(), Vec::new(), 0.0, vec![0, 1, 2]);
        let fine = frame(0.0, &[Some(1.0), Some(200.0), None]);
        assert_eq!(take(&mut intake, &fine), [RawValue::FAULTY, RawValue::FAULTY, RawValue::MISSING]);
        let one_of_three = frame(0.0, &[Some(1.0), Some(200.0), Some(3.0)]);
        assert_eq!(numbers(&take(&mut intake, &one_of_three)), [Some(1.0), Some(200.0), Some(3.0)]);
        let two_of_three = frame(0.0, &[Some(1.0), Some(200.0), Some(-3.0)]);
        assert_eq!(take(&mut intake, &two_of_three), [RawValue::FAULTY; 3]);
    }

    #[test]
    fn a_hot_taxel_without_company_is_not_believed() {
        let text = "[checks]\nisolated_ratio = 5\nisolated_above = 50";
        let calibration = Calibration::parse(text, &[1, 2, 3]).unwrap();
        let mut intake = Intake::new(calibration, vec![vec![1], vec![0, 2], vec![1]], 0.0, vec![0, 1, 2]);
        let hot = take(&mut intake, &frame(0.0, &[Some(10.0), Some(100.0), Some(19.0)]));
        assert_eq!(numbers(&hot), [Some(10.0), None, Some(19.0)]);
        let in_company = take(&mut intake, &frame(0.0, &[Some(10.0), Some(100.0), Some(21.0)]));
        assert_eq!(in_company[1].number(), Some(100.0));
        let faint = take(&mut intake, &frame(0.0, &[Some(0.0), Some(50.0), Some(0.0)]));
        assert_eq!(faint[1].number(), Some(50.0));
    }

    #[test]
    fn normal_values_are_without_what_is_along_the_skin() {
        let text = "[all]\nbaseline = 100\ngain = 2\nunit = \"kPa\"\n[shear]\nbaseline = [10, 20]\ngain = [1, 4]\nraw_range = [0, 50]\n\
                    cross_axis = [[1, 0.5, -0.25], [0, 1, 0], [0, 0, 1]]\n[taxel.3]\ngain = 1\ninvert = true\n";
        let calibration = Calibration::parse(text, &[1, 3, 4]).unwrap();
        // Taxels 1 and 3 have three axes.
        let mut intake = Intake::new(calibration, Vec::new(), 0.0, vec![0, 1, 2, 0, 1, 0, 1]);
        assert!(intake.picks(&[0, 1, 2]).is_none());
        let values = |of: [f64; 7]| frame(0.0, &of.map(Some));
        // P = 2 (raw − 100) + 0.5 (u − 10) − 0.25 · 4 (v − 20).
        let seen = values([110.0, 90.0, 130.0, 14.0, 14.0, 26.0, 26.0]);
        let expected = [Some(110.0 + (2.0 - 6.0) / 2.0), Some(90.0 - (2.0 - 6.0)), Some(130.0)];
        assert_eq!(numbers(&take(&mut intake, &seen)), expected);
        let alone = |intake: &Intake, frame: &Frame| {
            (0..frame.values.len()).map(|place| intake.read_alone(place, &frame.values).number()).collect::<Vec<_>>()
        };
        assert_eq!(alone(&intake, &seen)[..3], expected);
        // What is not known is not taken out, and what is out of range is not believed.
        for (place, value) in [(5, None), (3, Some(51.0)), (5, Some(f64::NAN))] {
            let mut seen = seen.clone();
            seen.values[place] = value.map_or(RawValue::MISSING, RawValue::new);
            assert_eq!(numbers(&take(&mut intake, &seen))[..2], [Some(110.0), expected[1]]);
            assert_eq!(alone(&intake, &seen)[..2], [Some(110.0), expected[1]]);
        }
        let mut rest = seen.clone();
        rest.values[0] = RawValue::MISSING;
        assert!(take(&mut intake, &rest)[0].is_missing());
        // In another order, without one of the axes.
        intake.set_channels(vec![6, 4, 1, 0, 3]);
        let other = frame(0.0, &[26.0, 14.0, 90.0, 110.0, 14.0].map(Some));
        assert_eq!(numbers(&take(&mut intake, &other)), [Some(110.0), expected[1], None]);
        assert_eq!(alone(&intake, &other)[2..4], [expected[1], Some(110.0)]);
    }
}
