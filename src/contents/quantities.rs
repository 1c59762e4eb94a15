//! Which quantities a run can give.

use serde::Serialize;

use crate::percept::{COLUMNS, Column, Outputs, TOUCH_COLUMNS, TouchOutputs};

/// A quantity.
#[derive(Serialize)]
pub struct Quantity {
    /// As it is asked for.
    pub name: String,
    /// As it is written; 1 where it has none.
    pub unit: &'static str,
    /// Numbers of a value; 0 of a list.
    pub components: usize,
    /// Whether a run gives it unless other outputs are named.
    pub default: bool,
    /// In words.
    pub what: &'static str,
}

/// What touches have that is not a number.
const LISTS: [(TouchOutputs, &str, &str); 5] = [
    (TouchOutputs::LINKS, "1", "The links that it lies on, with their shares of its total."),
    (TouchOutputs::FIELDS, "1", "The fields that hold parts of it, with their shares of its total."),
    (TouchOutputs::TAXELS, "", "The ids of its taxels."),
    (TouchOutputs::WRENCH, "N, N m", "Force and torque on each link that it lies on."),
    (TouchOutputs::FIT_SIGMAS, "", "The standard deviations of the fit's place, force, direction, width and length."),
];

/// What touches have.
pub fn of_touches() -> Vec<Quantity> {
    let row = |name: String| {
        let output = TouchOutputs::named(&name)?;
        let default = TouchOutputs::USUAL.contains(output);
        let name = format!("touches.{name}");
        let list = LISTS.iter().find(|(of, ..)| *of == output);
        Some(match list {
            Some(&(_, unit, what)) => Quantity { name, unit, components: 0, default, what },
            None => {
                let column = TOUCH_COLUMNS.iter().find(|column| column.output == output)?;
                Quantity { name, unit: column.unit.symbol(), components: column.components, default, what: column.help }
            }
        })
    };
    TouchOutputs::all().names().filter_map(row).collect()
}

/// What fields have.
pub fn of_fields() -> Vec<Quantity> {
    let row = |column: &Column| Quantity {
        name: column.name.to_owned(),
        unit: column.unit.symbol(),
        components: column.components,
        default: Outputs::USUAL.contains(column.output),
        what: column.help,
    };
    let self_contacts = Quantity {
        name: "self_contacts".to_owned(),
        unit: "",
        components: 0,
        default: false,
        what: "Where the robot touches itself: pairs of touches of two links; needs poses.",
    };
    COLUMNS.iter().map(row).chain([self_contacts]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_quantity_is_listed_with_what_it_is() {
        let (touches, fields) = (of_touches(), of_fields());
        assert_eq!(touches.len(), TouchOutputs::all().names().count());
        assert_eq!(fields.len(), Outputs::all().names().count());
        assert!(touches.iter().chain(&fields).all(|row| !row.what.trim().is_empty()));
    }
}
