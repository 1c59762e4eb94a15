//! Selects the raw values that a plan reads from a source's frames; holds missing values, marks rejected ones faulty, and corrects normal
//! values for what is along the skin.
//!
//! It runs on the host, frame by frame, so that all backends get the same input for any batch size.

use super::leak::{Corrected, corrected};
use super::{Calibration, RawValue, Reading};

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
    /// Per frame since [`Intake::forget_notes`] its stale taxels; `None` if they are not tracked.
    stale: Option<Vec<Vec<usize>>>,
    /// Per frame since then what is wrong with values that corrected ones are made of; empty if none are corrected.
    notes: Vec<Vec<(usize, Reading)>>,
    /// Per frame since then the taxels whose values were at an end of their range before they were corrected; empty if none are corrected.
    at_ends: Vec<Vec<usize>>,
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
            notes: Vec::new(),
            at_ends: Vec::new(),
        };
        made.set_channels((0..channels).collect());
        made
    }

    /// From now on, value i of a frame belongs to channel `taxel_of_value[i]`.
    pub fn set_channels(&mut self, taxel_of_value: Vec<usize>) {
        self.taxel_of_value = taxel_of_value;
        let place_of = self.place_of_channel();
        for own in &mut self.corrected {
            let [_, u, v] = own.channels;
            own.places = [u, v].map(|channel| place_of[channel]);
        }
    }

    /// Per channel where it is in a frame.
    fn place_of_channel(&self) -> Vec<Option<usize>> {
        let mut place_of = vec![None; self.now.len()];
        for (place, &channel) in self.taxel_of_value.iter().enumerate() {
            place_of[channel] = Some(place);
        }
        place_of
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

    /// Per frame since [`Intake::forget_notes`] its stale channels, ascending; empty if they are not tracked. A taxel whose value is
    /// corrected is stale with each of those that correct it.
    pub fn stale(&self) -> &[Vec<usize>] {
        self.stale.as_deref().unwrap_or_default()
    }

    /// Per frame since [`Intake::forget_notes`] the taxels whose values are corrected in part, or are out of range as they are measured,
    /// and with what reading; empty if none are corrected. The values count.
    pub fn notes(&self) -> &[Vec<(usize, Reading)>] {
        &self.notes
    }

    /// Per frame since [`Intake::forget_notes`] the taxels, ascending, whose values were at an end of their range, or beyond, before they
    /// were corrected; empty if none are corrected.
    pub fn at_ends(&self) -> &[Vec<usize>] {
        &self.at_ends
    }

    /// Forgets what was noted of the frames so far.
    pub fn forget_notes(&mut self) {
        self.stale.iter_mut().for_each(Vec::clear);
        self.notes.clear();
        self.at_ends.clear();
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
        let place_of = self.place_of_channel();
        slots.iter().map(|&slot| place_of[slot].and_then(|place| u32::try_from(place).ok())).collect()
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
            self.notes.extend((!self.corrected.is_empty()).then(Vec::new));
            self.at_ends.extend((!self.corrected.is_empty()).then(Vec::new));
            out.extend(
                slots
                    .iter()
                    .map(|&slot| if self.now[slot].is_missing() { RawValue::MISSING } else { RawValue::FAULTY }),
            );
            return;
        }
        self.correct();
        if let Some(ratio) = self.calibration.checks.isolated_ratio {
            self.reject_isolated(ratio);
        }
        if let Some(noted) = self.notes.last_mut() {
            noted.retain(|(taxel, _)| self.now[*taxel].number().is_some());
        }
        out.extend(slots.iter().map(|&slot| self.now[slot]));
    }

    /// Corrects values, and notes what is wrong with what they are made of.
    fn correct(&mut self) {
        if self.corrected.is_empty() {
            return;
        }
        let (mut noted, mut at_ends) = (Vec::new(), Vec::new());
        for Corrected { leak, channels: [normal, u, v], .. } in &self.corrected {
            at_ends.extend(Some(*normal).filter(|&normal| leak.is_at_end(self.now[normal])));
            let note = |reading| noted.push((*normal, reading));
            self.now[*normal] = leak.corrected(self.now[*normal], [self.now[*u], self.now[*v]], note);
        }
        self.notes.push(noted);
        self.at_ends.push(at_ends);
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
    /// corrected. Values that `values` is too short for are missing.
    pub fn read_alone(&self, place: usize, values: &[RawValue]) -> RawValue {
        let read = |place: usize| {
            let value = values.get(place).copied().unwrap_or_default();
            self.taxel_of_value.get(place).map_or(RawValue::MISSING, |&channel| self.read(channel, value))
        };
        let own = self.taxel_of_value.get(place).and_then(|channel| {
            let at = self.corrected.binary_search_by_key(channel, |own| own.channels[0]).ok()?;
            self.corrected.get(at)
        });
        match own {
            Some(own) => {
                let sides = own.places.map(|place| place.map_or(RawValue::MISSING, read));
                own.leak.corrected(read(place), sides, |_| {})
            }
            None => read(place),
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
        if !noted.is_empty() {
            let is_noted = |channel: &usize| noted.binary_search(channel).is_ok();
            let with_sides = self.corrected.iter().filter(|own| own.channels[1..].iter().any(is_noted));
            let mut normals: Vec<usize> = with_sides.map(|own| own.channels[0]).collect();
            noted.append(&mut normals);
            noted.sort_unstable();
            noted.dedup();
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
        intake.forget_notes();
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
        // What is not known is not taken out, and what is out of range is not believed; the rest is.
        let [missing, off, faulty] = [Reading::Missing, Reading::Value(51.0, false), Reading::Faulty];
        for (place, value, taxel, left, note) in [
            (5, RawValue::MISSING, 0, 111.0, missing),
            (3, RawValue::new(51.0), 0, 107.0, off),
            (5, RawValue::FAULTY, 0, 111.0, faulty),
            (4, RawValue::STALE, 1, 96.0, missing),
        ] {
            let mut seen = seen.clone();
            seen.values[place] = value;
            let mut right = expected;
            right[taxel] = Some(left);
            intake.forget_notes();
            assert_eq!(numbers(&take(&mut intake, &seen)), right);
            assert_eq!(intake.notes(), [[(taxel, note)]]);
            assert_eq!(alone(&intake, &seen)[..3], right);
            assert_eq!(intake.read_alone(taxel, &seen.values[..3]).number(), seen.values[taxel].number());
            assert!(intake.read_alone(5, &seen.values[..3]).is_missing());
        }
        let mut rest = seen.clone();
        rest.values[0] = RawValue::MISSING;
        assert!(take(&mut intake, &rest)[0].is_missing());
        // In another order, without one of the axes.
        intake.set_channels(vec![6, 4, 1, 0, 3]);
        let other = frame(0.0, &[26.0, 14.0, 90.0, 110.0, 14.0].map(Some));
        assert_eq!(numbers(&take(&mut intake, &other)), [Some(111.0), expected[1], None]);
        assert_eq!(alone(&intake, &other)[2..4], [expected[1], Some(111.0)]);
        // A frame that ends before its tangential values.
        assert_eq!(intake.read_alone(3, &other.values[..4]).number(), Some(110.0));
    }

    #[test]
    fn a_corrected_value_is_in_range_as_it_is_measured_and_stale_with_what_corrects_it() {
        let text = "[all]\nraw_range = [0, 100]\n[checks]\nisolated_ratio = 5\nisolated_above = 1000\n[shear]\n\
                    cross_axis = [[2, 0, 1], [0, 1, 0], [0, 0, 1]]\n[taxel.2]\nmask = true\n";
        let calibration = Calibration::parse(text, &[1, 2, 3]).unwrap();
        let neighbours = vec![vec![1], vec![0, 2], vec![1]];
        let mut intake = Intake::new(calibration, neighbours, 0.0, vec![0, 1, 2, 0, 1, 2, 0, 1, 2]);
        intake.track_stale();
        // 2 · 60 is inside, 2 · 101 is not, and a taxel that is masked has nothing to note. No share of u is in P.
        let mut seen = frame(0.0, &[60.0, 200.0, 101.0, 0.0, 0.0, 0.0, -30.0, 0.0, 5.0].map(Some));
        seen.values[3] = RawValue::MISSING;
        assert_eq!(numbers(&take(&mut intake, &seen)), [Some(90.0), Some(200.0), Some(207.0)]);
        assert_eq!(intake.notes(), [[(2, Reading::Value(101.0, false))]]);
        assert_eq!(intake.at_ends(), [[2]]);
        assert_eq!(intake.stale(), [[0_usize; 0]]);
        seen.values[6] = RawValue::STALE;
        seen.values[2] = RawValue::new(900.0);
        // At the end itself it is in range.
        seen.values[0] = RawValue::new(100.0);
        intake.forget_notes();
        assert!(intake.at_ends().is_empty());
        // Taxel 3 is not believed alone: nothing more is to be said of it.
        assert_eq!(numbers(&take(&mut intake, &seen)), [Some(200.0), Some(200.0), None]);
        assert_eq!(intake.at_ends(), [[0, 2]]);
        assert_eq!((intake.stale(), intake.notes()), (&[vec![0, 6]][..], &[vec![(0, Reading::Missing)]][..]));
    }
    #[test]
    fn the_channels_of_a_large_skin_are_found_at_once() {
        let ids: Vec<u32> = (0..60_000).collect();
        let leak = "[shear]\ncross_axis = [[1, 1, 2], [0, 1, 0], [0, 0, 1]]\n";
        let calibration = Calibration::parse(leak, &ids).unwrap();
        let (began, taxels) = (std::time::Instant::now(), ids.len());
        let mut intake = Intake::new(calibration, Vec::new(), 0.0, (0..3 * taxels).map(|at| at % taxels).collect());
        intake.set_channels((0..3 * taxels).rev().collect());
        assert!(began.elapsed().as_secs_f64() < 1.0, "{:?}", began.elapsed());
        let values: Vec<RawValue> =
            (0..3 * taxels).rev().map(|channel| RawValue::new((channel / taxels) as f64)).collect();
        assert_eq!(intake.read_alone(3 * taxels - 1, &values).number(), Some(5.0));
    }
}
