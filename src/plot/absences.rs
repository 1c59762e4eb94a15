//! Why a quantity is absent in all frames, in a few words.

use crate::percept::{Column, Flags, Outputs};
use crate::scene::receptor_of;
use crate::signal::Receptor;

/// What needs (u, v).
const CHARTED: Outputs = Outputs::CENTROID
    .union(Outputs::ORIENTATION)
    .union(AXIS)
    .union(Outputs::MOTION)
    .union(Outputs::FILTERED)
    .union(Outputs::CENTROID_SIGMA)
    .union(Outputs::SHEAR)
    .union(Outputs::SHEAR_DIRECTION)
    .union(Outputs::TORSION)
    .union(Outputs::TEMPERATURE_GRADIENT)
    .union(Outputs::PROXIMITY_CENTROID);
const AXIS: Outputs = Outputs::PRINCIPAL_AXIS.union(Outputs::ANISOTROPY).union(Outputs::PRINCIPAL_AXIS_SIGMA);
const RATES: Outputs = Outputs::TEMPERATURE_RATE.union(Outputs::APPROACH_SPEED);
const MOTION: Outputs = Outputs::MOTION.union(Outputs::FILTERED).union(Outputs::SPEED_IN_WORLD);
const SIGMAS: Outputs = Outputs::SIGMAS.union(Outputs::FRICTION_SIGMA);

/// By a flag the outputs that it explains, and how; the first that is true says it.
const REASONS: [(Flags, Outputs, &str); 17] = [
    (Flags::STALE, Outputs::all(), "values too old"),
    (Flags::NO_CHART, CHARTED, "no chart"),
    (Flags::ONE_TAXEL, Outputs::ORIENTATION.union(AXIS).union(Outputs::TORSION), "only one taxel pressed"),
    (Flags::COINCIDENT, Outputs::ORIENTATION.union(AXIS), "points fall together"),
    (Flags::ISOTROPIC, AXIS, "spread equally in all directions"),
    (Flags::STILL, Outputs::DIRECTION.union(Outputs::FILTERED_DIRECTION), "no motion"),
    (Flags::STILL, Outputs::SHEAR_DIRECTION, "nothing pulls"),
    (Flags::NO_PREVIOUS, RATES, "less than half a window"),
    (Flags::NO_PREVIOUS, MOTION, "no frame before"),
    (Flags::BAD_DT, MOTION, "time steps too long, or none"),
    (Flags::HELD.union(Flags::JUMPED), Outputs::FILTERED, "no step that counts"),
    (Flags::NO_UNIT, Outputs::FORCE.union(Outputs::FORCE_VECTOR), "no unit or no areas"),
    (Flags::NO_GRADIENT, Outputs::TEMPERATURE_GRADIENT, "under three taxels, or in a line"),
    (Flags::NOISE_UNKNOWN, SIGMAS, "no noise in the calibration"),
    (Flags::UNSURE, SIGMAS, "too noisy"),
    (Flags::NO_POSE, Outputs::all(), "no poses"),
    (Flags::STALE_POSE, Outputs::all(), "poses too old"),
];
/// What was wrong with the input: the same of any quantity.
const INPUT: [(Flags, &str); 3] = [
    (Flags::INCOMPLETE, "values missing"),
    (Flags::FAULTY_INPUT, "values faulty"),
    (Flags::OUT_OF_RANGE, "values out of range"),
];
const NO_CONTACT: &str = "no contact";
const NOTHING_NEAR: &str = "nothing in range";
/// Where no taxel of a field measures what the quantity is made of.
const NOT_MEASURED: &str = "no taxel measures it";

/// How often a quantity of a field was absent, by why.
#[derive(Clone, Debug, Default)]
pub(super) struct Absences(Vec<(&'static str, u64)>);

impl Absences {
    /// Counts a frame in which `column` is absent, with the field's `flags`; `has_friction` is whether its friction is known.
    pub(super) fn see(&mut self, column: &Column, flags: Flags, has_friction: bool) {
        self.add(why(column, flags, has_friction), 1);
    }

    /// Adds those of another field.
    pub(super) fn join(&mut self, other: &Self) {
        other.0.iter().for_each(|&(why, frames)| self.add(why, frames));
    }

    fn add(&mut self, why: &'static str, frames: u64) {
        match self.0.iter_mut().find(|(known, _)| *known == why) {
            Some((_, count)) => *count += frames,
            None => self.0.push((why, frames)),
        }
    }

    /// Why there is no value: the most frequent reason, of frames in which something was felt if there are any.
    pub(super) fn most(&self) -> &'static str {
        let is_idle = |why: &str| [NO_CONTACT, NOTHING_NEAR].contains(&why);
        // Of reasons as frequent the first that was seen.
        let rank = |&&(why, frames): &&(&'static str, u64)| (!is_idle(why), frames);
        self.0.iter().rev().max_by_key(rank).map_or(NOT_MEASURED, |&(why, _)| why)
    }
}

fn why(column: &Column, flags: Flags, has_friction: bool) -> &'static str {
    let of_flag =
        |&&(flag, outputs, _): &&(Flags, Outputs, &str)| flags.intersects(flag) && outputs.contains(column.output);
    let of_input = || INPUT.iter().find(|(flag, _)| flags.contains(*flag)).map(|&(_, why)| why);
    if flags.contains(Flags::NO_CONTACT) && !flags.contains(Flags::STALE) {
        return match receptor_of(column) {
            Receptor::Proximity if flags.contains(Flags::OUT_OF_RANGE) => NOTHING_NEAR,
            Receptor::Proximity | Receptor::Temperature => of_input().unwrap_or("no values"),
            _ => NO_CONTACT,
        };
    }
    if column.output == Outputs::SLIP_RATIO && has_friction {
        return "no slips_at in the calibration";
    }
    REASONS.iter().find(of_flag).map(|&(_, _, why)| why).or_else(of_input).unwrap_or("absent in all frames")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::percept::COLUMNS;

    fn of(name: &str, flags: Flags) -> &'static str {
        why(COLUMNS.iter().find(|column| column.name == name).unwrap(), flags, false)
    }

    #[test]
    fn a_flag_explains_what_it_is_about() {
        let none = Flags::NO_CONTACT;
        assert_eq!(of("nearest", none | Flags::OUT_OF_RANGE | Flags::NO_CHART), "nothing in range");
        assert_eq!(of("temperature", none | Flags::FAULTY_INPUT), "values faulty");
        assert_eq!(of("total", none | Flags::OUT_OF_RANGE), "no contact");
        assert_eq!(of("shear", Flags::NO_CHART), "no chart");
        assert_eq!(of("friction", Flags::NO_CHART | Flags::INCOMPLETE), "values missing");
        assert_eq!(of("direction", Flags::STILL), "no motion");
        assert_eq!(of("shear_direction", Flags::STILL), "nothing pulls");
        assert_eq!(of("approach_speed", Flags::NO_PREVIOUS), "less than half a window");
        assert_eq!(of("speed", Flags::NO_PREVIOUS), "no frame before");
        assert_eq!(of("force", Flags::NO_UNIT), "no unit or no areas");
    }

    #[test]
    fn a_ratio_is_missed_where_its_friction_is_known() {
        let column = COLUMNS.iter().find(|column| column.name == "slip_ratio").unwrap();
        let mut absences = Absences::default();
        (0..9).for_each(|_| absences.see(column, Flags::NO_CONTACT, false));
        assert_eq!(absences.most(), "no contact");
        // Frames in which something is felt say more than all others.
        absences.see(column, Flags::INCOMPLETE, true);
        assert_eq!(absences.most(), "no slips_at in the calibration");
        let mut joined = Absences::default();
        assert_eq!(joined.most(), "no taxel measures it");
        joined.join(&absences);
        assert_eq!(joined.most(), "no slips_at in the calibration");
    }
}
