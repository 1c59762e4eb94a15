//! What a person should know of a survey.

use super::at_rest::median;
use super::{AtRest, Findings, Found, LOUD_RATIO, Survey, several};
use crate::error::Error;

impl Survey {
    /// The error that names the sensors that `moved`.
    pub(super) fn not_at_rest(&self, at_rest: &[AtRest], moved: &[bool], range: f64) -> Error {
        let those = || (0..self.ids.len()).filter(|&sensor| moved[sensor]);
        let bands = those().filter_map(|sensor| at_rest[sensor]).map(|(_, noise)| self.dead_band(noise));
        let widest = bands.fold(0.0, f64::max);
        let ids: Vec<u32> = those().map(|sensor| self.ids[sensor]).collect();
        Error::failed(format!(
            "{} of {} sensors moved during the rest: {}; their dead bands would be up to {widest} of a raw range of {range}. Keep \
             everything off the robot until the rest is over; --mask-moved leaves broken sensors out",
            ids.len(),
            self.ids.len(),
            several(&ids)
        ))
    }
}

impl Findings {
    /// What a person should know of it, a line each.
    #[must_use]
    pub fn remarks(&self) -> Vec<String> {
        let ids = |is: &dyn Fn(&Found) -> bool| -> Vec<u32> {
            self.sensors.iter().filter(|found| is(found)).map(|found| found.id).collect()
        };
        let mut noises: Vec<f64> = self.sensors.iter().filter(|f| f.baseline.is_some()).map(|f| f.noise).collect();
        let usual = median(&mut noises).unwrap_or(0.0);
        let at_its_end = |found: &Found| match (self.raw_range, found.baseline) {
            (Some([low, high]), Some(baseline)) => baseline == if self.invert { low } else { high },
            _ => false,
        };
        let kinds: [(&str, Vec<u32>); 6] = [
            ("delivered nothing at rest, and are masked", ids(&|found| found.baseline.is_none())),
            ("are at the end of their range untouched, and are masked", ids(&at_its_end)),
            (
                "were not pressed, and so have no travel",
                ids(&|f| f.baseline.is_some() && f.travel.is_none() && !self.is_lost(f)),
            ),
            (
                "move the other way than the rest of them, and are masked (were they pressed during the rest?)",
                ids(&|found| found.went_other_way && !found.moved && !at_its_end(found)),
            ),
            ("moved at rest, and are masked", ids(&|found| found.moved && !at_its_end(found))),
            (
                "are far noisier than the others at rest",
                ids(&|found| usual > 0.0 && found.noise > LOUD_RATIO * usual && !found.moved),
            ),
        ];
        kinds
            .into_iter()
            .filter(|(_, ids)| !ids.is_empty())
            .map(|(what, ids)| format!("{} of {} sensors {what}: {}", ids.len(), self.sensors.len(), several(&ids)))
            .chain(self.crosstalk.map(|found| found.to_string()))
            .chain(self.forces_agree.clone())
            .chain(self.unknown_axes())
            .chain(self.assumed_gains())
            .collect()
    }

    /// Whether nothing can be felt through `found`.
    pub(super) fn is_lost(&self, found: &Found) -> bool {
        let end = self.raw_range.map(|[low, high]| if self.invert { low } else { high });
        found.baseline.is_none() || found.moved || found.went_other_way || found.baseline == end
    }
}
