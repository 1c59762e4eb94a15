//! Which way sensors go when they are pressed, and where their range ends.

use crate::error::{Error, Result};

use super::{AtRest, Survey, several};

/// Sensors that fall and stay there are a press if at least one in this many does.
const FEW: usize = 4;

impl Survey {
    /// Whether raw values fall when sensors are pressed, by most of those that left their rest. A sensor that moved at rest
    /// has no say, and few that fall and stay there have none: they may have been pressed during the rest and released after it.
    pub(super) fn falls(
        &self,
        at_rest: &[AtRest],
        travels: &[[f64; 2]],
        moved: &[bool],
        goes: impl Fn(usize, usize) -> bool,
    ) -> Result<bool> {
        let who = |side: usize| (0..self.ids.len()).filter(|&sensor| !moved[sensor] && goes(sensor, side)).collect();
        let (falling, rising): (Vec<usize>, Vec<usize>) = (who(0), who(1));
        if falling.is_empty() && rising.is_empty() {
            return Err(Error::failed("no sensor left its rest; press every sensor firmly once the rest is over"));
        }
        if falling.len() <= rising.len() {
            return Ok(false);
        }
        let came_back = |&sensor: &usize| {
            let baseline = at_rest[sensor].map_or(0.0, |(baseline, _)| baseline);
            self.pressed[sensor].came_back(baseline, travels[sensor][0])
        };
        let sure = falling.iter().filter(|sensor| came_back(sensor)).count();
        let delivering = at_rest.iter().flatten().count();
        if sure > rising.len() || FEW * falling.len() > delivering {
            return Ok(true);
        }
        if !rising.is_empty() {
            return Ok(false);
        }
        let ids: Vec<u32> = falling.iter().map(|&sensor| self.ids[sensor]).collect();
        Err(Error::failed(format!(
            "{} of {} sensors left their rest, and fell without coming back: {}; they may have been pressed during the rest. \
             Keep everything off the robot until it is over, then press every sensor and let go",
            ids.len(),
            self.ids.len(),
            several(&ids)
        )))
    }

    /// The lowest and the highest raw value of any sensor, at rest and pressed, without single wrong ones.
    pub(super) fn reach(&self, at_rest: &[AtRest]) -> [f64; 2] {
        let pressed = self.pressed.iter().filter(|pressed| pressed.seen > 2);
        let pressed = pressed.flat_map(|pressed| [pressed.low.into(), pressed.high.into()]);
        let all = at_rest.iter().flatten().map(|(baseline, _)| *baseline).chain(pressed);
        all.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], value: f64| [low.min(value), high.max(value)])
    }

    /// The raw value that at least three pressed sensors, and a tenth of them, went to and never beyond.
    pub(super) fn stop_of_many(
        &self,
        at_rest: &[AtRest],
        invert: bool,
        is_pressed: impl Fn(usize) -> bool,
    ) -> Option<f64> {
        let ends = (0..self.ids.len()).filter(|&sensor| is_pressed(sensor));
        let mut ends: Vec<f32> =
            ends.map(|i| if invert { self.pressed[i].low } else { self.pressed[i].high }).collect();
        ends.sort_by(f32::total_cmp);
        let end = if invert { *ends.first()? } else { *ends.last()? };
        let there = ends.iter().filter(|&&other| other == end).count();
        let [lowest, highest] = self.reach(at_rest);
        let is_passed = if invert { lowest < f64::from(end) } else { highest > f64::from(end) };
        (there >= 3 && 10 * there >= ends.len() && !is_passed).then(|| end.into())
    }
}
