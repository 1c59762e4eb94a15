//! Quantities as people read them: in which unit, and on which axis.

use super::ticks::Numbers;
use crate::percept::{Column, Measure, Unit};

/// A quantity as people read it: times this, in this unit. `p_unit` is that of pressures.
pub(super) fn for_people(column: &Column, p_unit: &str) -> (f64, String) {
    let (factor, unit) = match column.unit {
        Unit::P => p_for_people(p_unit),
        Unit::Pascal => p_for_people("Pa"),
        Unit::Force if p_unit == "Pa" => (1.0, "N"),
        Unit::Force => (1.0, p_unit),
        Unit::PMetre if p_unit == "N" => (1e3, "N mm"),
        Unit::PMetre => return (1.0, format!("{p_unit} m")),
        Unit::Metre => (1e3, "mm"),
        Unit::SquareMetre => (1e4, "cm²"),
        Unit::MetrePerSecond => (1e3, "mm/s"),
        Unit::Radian => (180.0 / std::f64::consts::PI, "°"),
        Unit::One | Unit::Kind => (1.0, ""),
        unit @ (Unit::Newton | Unit::Celsius | Unit::KelvinPerMetre | Unit::KelvinPerSecond) => (1.0, unit.symbol()),
    };
    (factor, unit.to_owned())
}

/// The same of a pressure in `unit`.
pub(super) fn p_for_people(unit: &str) -> (f64, &str) {
    if unit == "Pa" { (1e-3, "kPa") } else { (1.0, unit) }
}

/// After how much an angle is the same again, rad: an axis after half a turn, a direction after a whole one.
pub(super) fn period(column: &Column) -> Option<f64> {
    match column.measure {
        Measure::Line => Some(std::f64::consts::PI),
        Measure::Direction => Some(std::f64::consts::TAU),
        _ => None,
    }
}

/// What the axis of a quantity counts.
pub(super) fn numbers(column: &Column) -> Numbers {
    match column.unit {
        Unit::Radian => Numbers::Degrees,
        _ if column.is_whole() => Numbers::Whole,
        _ => Numbers::Any,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::percept::COLUMNS;

    #[test]
    fn no_unit_is_left_in_letters_that_stand_for_another() {
        for p_unit in ["Pa", "N", "count"] {
            for column in COLUMNS {
                let (factor, unit) = for_people(column, p_unit);
                assert!(factor > 0.0 && !unit.contains('P') || unit.contains("Pa"), "{}: {unit}", column.name);
            }
        }
        let named =
            |name: &str, p_unit: &str| for_people(COLUMNS.iter().find(|column| column.name == name).unwrap(), p_unit);
        assert_eq!(named("torsion", "Pa"), (1.0, "Pa m".to_owned()));
        assert_eq!(named("torsion", "N"), (1e3, "N mm".to_owned()));
        assert_eq!(named("torsion", "count"), (1.0, "count m".to_owned()));
        assert_eq!(named("shear", "Pa"), (1e-3, "kPa".to_owned()));
        assert_eq!(named("active", "Pa"), (1.0, String::new()));
    }

    #[test]
    fn angles_come_back_as_they_are_compared() {
        let of = |name: &str| period(COLUMNS.iter().find(|column| column.name == name).unwrap());
        let [half, whole] = [std::f64::consts::PI, std::f64::consts::TAU];
        assert_eq!(["orientation", "principal_axis"].map(of), [Some(half); 2]);
        assert_eq!(["direction", "shear_direction", "filtered_direction"].map(of), [Some(whole); 3]);
        assert_eq!(["principal_axis_sigma", "total"].map(of), [None; 2]);
    }
}
