//! Values of a survey's frames that no press shows: tangential ones, and those of sensors that feel something else.

use std::collections::BTreeMap;

use super::at_rest::{median, rest_of, sigma_of};
use super::{Apart, AtRest, Findings, MIN_SIGMA_VALUES, Survey, several};
use crate::signal::{Axis, Channel, RawValue};

impl Apart {
    /// The channels among `ids` that feel what presses on them, and the others; `None` where there are no others.
    pub(super) fn of(ids: &[u32], is_pressed: impl Fn(u32) -> bool) -> Option<(Vec<u32>, Self)> {
        let is_pressed = |index: &usize| is_pressed(Channel(ids[*index]).taxel());
        let is_own = |index: &usize| Channel(ids[*index]).axis() == Axis::Normal;
        let (own, tangential): (Vec<usize>, Vec<usize>) = (0..ids.len()).filter(is_pressed).partition(is_own);
        if own.len() == ids.len() {
            return None;
        }
        let of = |places: &[usize]| -> Vec<u32> { places.iter().map(|&place| ids[place]).collect() };
        let survey = Survey::of_pressed(&of(&tangential));
        Some((of(&own), Self { all: ids.to_vec(), own, tangential, survey }))
    }

    /// Takes a frame at rest; gives the values that are not apart.
    pub(super) fn rest(&mut self, values: &[RawValue]) -> Vec<RawValue> {
        self.survey.rest(&of(values, &self.tangential));
        of(values, &self.own)
    }

    /// Takes a frame in which sensors are pressed; gives the values that are not apart.
    pub(super) fn press(&mut self, values: &[RawValue]) -> Vec<RawValue> {
        self.survey.press(&of(values, &self.tangential));
        of(values, &self.own)
    }

    /// By tangential channel its raw value at rest, by the rule for pressures, whose raw `range` is known or was seen; `None` where it
    /// delivered nothing, or moved. What was seen of tangential values alone is no measure: perhaps nothing pulled.
    pub(super) fn baselines(&self, range: f64, is_range_known: bool) -> BTreeMap<u32, Option<f64>> {
        let survey = &self.survey;
        let at_rest: Vec<AtRest> = survey.rest.iter().map(|kept| rest_of(kept, survey.step())).collect();
        let moved = survey.moved(&at_rest, range.max(survey.seen_range()), is_range_known);
        let baseline = |place: usize| at_rest[place].filter(|_| !moved[place]).map(|(baseline, _)| baseline);
        survey.ids.iter().enumerate().map(|(place, &id)| (id, baseline(place))).collect()
    }

    /// By tangential channel the standard deviation of its raw value at rest, with that of rounding, where it delivered enough to tell.
    pub(super) fn sigmas(&self) -> BTreeMap<u32, f64> {
        let survey = &self.survey;
        let delivered = survey.ids.iter().zip(&survey.rest).filter(|(_, kept)| kept.len() >= MIN_SIGMA_VALUES);
        delivered.map(|(&id, kept)| (id, sigma_of(kept, survey.step()))).collect()
    }
}

fn of(values: &[RawValue], places: &[usize]) -> Vec<RawValue> {
    places.iter().map(|&place| values[place]).collect()
}

impl Findings {
    /// The raw values of taxel `id` at rest along t and n × t, where they are known.
    #[must_use]
    pub fn tangential_baselines(&self, id: u32) -> [Option<f64>; 2] {
        [Axis::U, Axis::V].map(|axis| *self.tangential.get(&Channel::of_taxel(id, axis).0)?)
    }

    /// The same if both are known and not both 0.
    pub(super) fn shear_baseline(&self, id: u32) -> Option<[f64; 2]> {
        let [Some(u), Some(v)] = self.tangential_baselines(id) else { return None };
        ([u, v] != [0.0; 2]).then_some([u, v])
    }

    /// The noise of the tangential values of taxel `id`, raw units: the larger of its two, if both are known.
    #[must_use]
    pub fn shear_noise(&self, id: u32) -> Option<f64> {
        let along = |axis| self.tangential_sigmas.get(&Channel::of_taxel(id, axis).0).copied();
        Some(along(Axis::U)?.max(along(Axis::V)?))
    }

    /// The middle one of these of the taxels `ids`.
    pub(super) fn usual_shear_noise(&self, ids: impl Iterator<Item = u32>) -> Option<f64> {
        median(&mut ids.filter_map(|id| self.shear_noise(id)).collect::<Vec<f64>>())
    }

    /// Where gains of tangential values are from that no known force has told, in words.
    pub(super) fn assumed_gains(&self) -> Option<String> {
        let are_assumed = !self.curves.is_empty() && !self.with_axes.is_empty();
        are_assumed.then(|| {
            "no known force pulled along the skin: tangential values have the average gain of their curves, in [shear]".to_owned()
        })
    }

    /// Which axes have no baseline, in words.
    pub(super) fn unknown_axes(&self) -> Option<String> {
        let unknown: Vec<u32> =
            self.tangential.iter().filter(|(_, baseline)| baseline.is_none()).map(|(&id, _)| id).collect();
        (!unknown.is_empty()).then(|| {
            format!(
                "{} of {} tangential values delivered nothing at rest, or moved, and have no baseline: {}",
                unknown.len(),
                self.tangential.len(),
                several(&unknown)
            )
        })
    }
}

#[cfg(test)]
mod tests {
    use crate::body::{Body, Modality, Sheet, SheetCell, sheets};
    use crate::signal::{Channel, RawValue};
    use crate::survey::{Survey, Wishes};
    use crate::{Calibration, Engine, Options};

    fn channels(names: &[&str]) -> Vec<u32> {
        names.iter().map(|name| Channel::named(name).unwrap().0).collect()
    }

    /// Two taxels with three axes and a thermometer. The first's tangential values rest at 510 and 530, `moving` adds to the second's.
    fn survey(moving: impl Fn(usize) -> f64) -> (Survey, Body) {
        let cell = |id: u32| SheetCell::rectangle(id, [0.01 * f64::from(id), 0.0], 0.01, 0.01).with_axes(id < 3);
        let mut cells = [1, 2, 3].map(cell);
        cells[2].modality = Modality::Temperature;
        let bytes = sheets(&[Sheet::new("pad", cells.to_vec())]).unwrap().to_bytes().unwrap();
        let body = Body::from_bytes("pad", &bytes).unwrap();
        let ids = channels(&["1.u", "1", "1.v", "3", "2", "2.u", "2.v"]);
        let mut survey = Survey::new(&ids).on(&body).unwrap();
        let values = |raw: [f64; 7]| raw.map(RawValue::new);
        for n in 0..300 {
            let noise = [0.0, 1.0, 0.0, -1.0][n % 4];
            survey.rest(&values([
                510.0 + noise,
                100.0 + noise,
                530.0 - noise,
                2000.0 + n as f64,
                90.0,
                7.0 + moving(n),
                9.0,
            ]));
        }
        for n in 0..100 {
            let depth = f64::from(n.min(99 - n));
            survey.press(&values([
                510.0 + 4.0 * depth,
                100.0 + 8.0 * depth,
                530.0,
                2300.0,
                90.0 + 8.0 * depth,
                7.0,
                9.0 - depth,
            ]));
        }
        (survey, body)
    }

    #[test]
    fn tangential_values_get_baselines_and_tell_nothing_of_presses() {
        let (survey, body) = survey(|_| 0.0);
        let found = survey.finish(Wishes::default()).unwrap();
        assert_eq!(found.sensors.iter().map(|found| found.id).collect::<Vec<u32>>(), [1, 2]);
        assert!(!found.invert && !found.remarks().join(" ").contains("tangential"), "{:?}", found.remarks());
        let text = found.calibration("pad");
        assert!(text.contains("[taxel.1]\n") && text.contains("shear_baseline = [510, 530]"), "{text}");
        assert!(text.contains("shear_baseline = [7, 9]"), "{text}");
        assert_eq!([1, 2, 3].map(|id| found.tangential_baselines(id)[0]), [Some(510.0), Some(7.0), None]);
        // At rest there is no shear, as `run` reads the file.
        let kinds: Vec<_> = body.taxels.iter().map(|taxel| (taxel.id, taxel.modality)).collect();
        let calibration = Calibration::parse_for(&text, &kinds).unwrap();
        assert_eq!(calibration.shear.own_baselines[&0], [510.0, 530.0]);
        // The first's tangential values stray as its normal ones do; the second's are whole numbers that stay.
        let [first, second] = [0, 1].map(|taxel| calibration.shear.noise_of(taxel).unwrap());
        assert_eq!(Some(first), calibration.taxels[0].noise);
        assert!((0.6..0.8).contains(&first) && (second - 1.0 / 12.0_f64.sqrt()).abs() < 1e-6, "{text}");
        assert!(Engine::new(&body, Options::default().calibration(calibration)).is_ok());
    }

    #[test]
    fn sensors_that_nothing_pulls_have_baselines_too() {
        let ids = channels(&["1", "1.u", "1.v"]);
        let cell = SheetCell::rectangle(1, [0.0; 2], 0.01, 0.01).with_axes(true);
        let bytes = sheets(&[Sheet::new("pad", vec![cell])]).unwrap().to_bytes().unwrap();
        for bits in [Some(12), None] {
            let mut survey = Survey::new(&ids).on(&Body::from_bytes("pad", &bytes).unwrap()).unwrap();
            let values = |n: usize, depth: f64| {
                let noise = [0.0, 2.0, -1.0, 1.0, -2.0][n % 5];
                [40.0 + depth, 2048.0 + noise, 2047.0 - noise].map(RawValue::new)
            };
            (0..300).for_each(|n| survey.rest(&values(n, 0.0)));
            (0..100).for_each(|n| survey.press(&values(n, 10.0 * n.min(99 - n) as f64)));
            let text = survey.finish(Wishes { bits, ..Wishes::default() }).unwrap().calibration("pad");
            assert!(
                text.contains("shear_baseline = [2048, 2047]") || text.contains("\nbaseline = [2048, 2047]"),
                "{text}"
            );
        }
    }

    /// A sheet of taxels of these kinds, in a row.
    fn row_of(kinds: &[Modality]) -> Body {
        let cell = |(id, &kind): (usize, &Modality)| {
            let mut cell = SheetCell::rectangle(id as u32, [0.01 * id as f64, 0.0], 0.01, 0.01);
            cell.modality = kind;
            cell.with_axes(kind == Modality::Force3)
        };
        let cells = kinds.iter().enumerate().map(cell).collect();
        let bytes = sheets(&[Sheet::new("pad", cells)]).unwrap().to_bytes().unwrap();
        Body::from_bytes("pad", &bytes).unwrap()
    }

    /// What is found where each taxel that feels pressure is pressed `presses` times, harder and harder, by which all its values rise or
    /// fall.
    fn pressed_in_turns(
        body: &Body,
        ids: &[u32],
        presses: usize,
        invert: bool,
        wishes: Wishes,
    ) -> crate::survey::Findings {
        let mut survey = Survey::new(ids).on(body).unwrap();
        let toward = if invert { -1.0 } else { 1.0 };
        let mut frame = |n: usize, pressed: Option<(u32, f64)>| {
            let value = |&id: &u32| {
                let (channel, noise) = (Channel(id), [0.0, 1.0, 0.0, -1.0][(n + id as usize) % 4]);
                let depth = pressed.filter(|(taxel, _)| *taxel == channel.taxel()).map_or(0.0, |(_, depth)| depth);
                RawValue::new((500.0 + noise + toward * depth * (1.0 + 0.1 * f64::from(channel.taxel()))).round())
            };
            let values: Vec<RawValue> = ids.iter().map(value).collect();
            if pressed.is_some() { survey.press(&values) } else { survey.rest(&values) }
        };
        (0..300).for_each(|n| frame(n, None));
        for taxel in body.taxels.iter().filter(|taxel| taxel.modality.is_pressed()) {
            for press in 1..=presses {
                (0..40).for_each(|n| frame(n, Some((taxel.id, f64::from(n.min(39 - n) as u32) * 4.0 * press as f64))));
            }
        }
        survey.finish(wishes).unwrap()
    }

    #[test]
    fn what_is_written_is_accepted_for_every_kind_of_taxel_and_form_of_curve() {
        use Modality::{Force3, Other, Pressure, Proximity, Temperature};
        let bodies: [&[Modality]; 6] = [
            &[Pressure; 3],
            &[Force3; 3],
            &[Pressure, Force3],
            &[Force3, Temperature, Proximity, Force3],
            &[Temperature, Pressure, Proximity],
            &[Other(9), Force3],
        ];
        let known: [Option<(&str, &str)>; 5] = [
            None,
            Some(("2N", "taxel")),
            Some(("1N,2N,4.90333N", "taxel")),
            Some(("2N", "field")),
            Some(("1N,2N,4N", "field")),
        ];
        let mut curves = 0;
        for ((kinds, known), invert) in bodies
            .iter()
            .flat_map(|kinds| known.map(|known| (kinds, known)))
            .flat_map(|both| [true, false].map(|invert| (both, invert)))
        {
            let body = row_of(kinds);
            let (all, normal): (Vec<u32>, Vec<u32>) =
                (Channel::all_of(&body), body.taxels.iter().map(|taxel| taxel.id).collect());
            for (ids, bits, equalise) in [(&all, None, false), (&all, Some(10), true), (&normal, None, false)] {
                let presses =
                    if known.is_some_and(|(forces, on)| forces.contains(',') && on == "taxel") { 3 } else { 1 };
                let wishes = Wishes { bits, equalise, ..Wishes::default() };
                let mut found = pressed_in_turns(&body, ids, presses, invert, wishes);
                if let Some((forces, on)) = known {
                    // One scale for all is found from as many presses as there are forces.
                    match found.know(&forces.parse().unwrap(), on.parse().unwrap()) {
                        Err(why) if on == "field" && forces.contains(',') => {
                            assert!(why.to_string().contains("presses, and 3 forces") || why.is_usage(), "{why}");
                            continue;
                        }
                        done => done.unwrap(),
                    }
                }
                let text = found.calibration("pad");
                let kinds: Vec<_> = body.taxels.iter().map(|taxel| (taxel.id, taxel.modality)).collect();
                let read = Calibration::parse_for(&text, &kinds).unwrap_or_else(|e| panic!("{e}\n{text}"));
                let options = Options::default().backend(crate::BackendKind::Cpu).calibration(read.clone());
                let engine = Engine::new(&body, options);
                assert!(engine.is_ok(), "{:?}\n{text}", engine.err());
                let is_curved = text.contains("[curve.");
                let is_told = found.remarks().join("\n").contains("no known force pulled along the skin");
                curves += usize::from(is_curved);
                assert_eq!(is_told, text.contains("[shear]\n#"));
                assert_eq!(
                    text.contains("shear_gain") || text.contains("[shear]\n#"),
                    is_curved && kinds.iter().any(|(_, kind)| *kind == Force3)
                );
                for (index, _) in kinds.iter().enumerate().filter(|(_, (_, kind))| is_curved && *kind == Force3) {
                    // 4.90333 N at three presses of 76 raw units, and 10 % more from taxel to taxel.
                    let gain = read.shear.gains_of(index, 1.0, 1.0)[0] * read.taxels[index].gain.abs().recip();
                    let wanted = 4.903_33 / (228.0 * (1.0 + 0.1 * f64::from(body.taxels[index].id)));
                    assert!((gain / wanted - 1.0).abs() < 0.02, "{gain} {wanted}\n{text}");
                }
            }
        }
        assert!(curves >= 24, "{curves}");
    }

    #[test]
    fn a_body_without_pressures_is_no_matter_of_a_survey() {
        let mut cell = SheetCell::rectangle(3, [0.0, 0.0], 0.01, 0.01);
        cell.modality = Modality::Temperature;
        let bytes = sheets(&[Sheet::new("pad", vec![cell])]).unwrap().to_bytes().unwrap();
        let body = Body::from_bytes("pad", &bytes).unwrap();
        let why = Survey::new(&[3]).on(&body).map(|_| ()).unwrap_err();
        assert!(why.is_usage() && why.to_string().contains("no taxel measures pressure"), "{why}");
    }

    #[test]
    fn an_axis_that_moved_at_rest_has_no_baseline_and_is_named() {
        let (survey, _) = survey(|n| if (100..200).contains(&n) { 300.0 } else { 0.0 });
        let found = survey.finish(Wishes::default()).unwrap();
        assert!(!found.calibration("pad").contains("[7, 9]"));
        let remarks = found.remarks().join("\n");
        assert!(
            remarks.contains("1 of 4 tangential values delivered nothing at rest, or moved")
                && remarks.ends_with("2.u"),
            "{remarks}"
        );
    }
}
