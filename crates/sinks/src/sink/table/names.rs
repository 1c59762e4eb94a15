//! What columns are called, and their units.

use crate::percept::{Column, Unit};
use crate::sink::{Session, header};

pub(super) const U_AND_V: [&str; 2] = ["u", "v"];
pub(super) const X_Y_AND_Z: [&str; 3] = ["x", "y", "z"];

/// What the components of an output are called.
pub(super) fn suffixes(components: usize) -> &'static [&'static str] {
    match components {
        1 => &[""],
        2 => &U_AND_V,
        _ => &X_Y_AND_Z,
    }
}

/// The unit of a column of fields, as the session has it.
pub(super) fn unit_of_fields(column: &Column, session: &Session<'_>) -> String {
    let unit = unit_of(column.unit, session);
    match session.plan {
        Some(plan) => header::per_second(plan, column, unit),
        None => unit,
    }
}

/// The unit of a column, as the session has it.
pub(super) fn unit_of(unit: Unit, session: &Session<'_>) -> String {
    match unit {
        Unit::Force if session.p_unit == "Pa" => "N".to_owned(),
        Unit::P | Unit::Force if !session.p_unit.is_empty() => session.p_unit.to_owned(),
        Unit::PMetre if !session.p_unit.is_empty() => format!("{} m", session.p_unit),
        unit => unit.symbol().to_owned(),
    }
}
