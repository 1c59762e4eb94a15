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
    /// Whether a run gives it unless other outputs are named; of a letter, whether it does so where taxels are of that kind.
    pub default: bool,
    /// The letter that has it; absent for what is made of pressures.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub letter: Option<&'static str>,
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

/// What the other letters give touches, with words of its own where it is more than one quantity.
const OF_LETTERS: [(TouchOutputs, &str, Option<&str>); 3] = [
    (
        TouchOutputs::SHEAR,
        "shear",
        Some(
            "Σs over its taxels that have three axes, weighted as its place; also shear_in_chart, shear_direction, force_vector, torsion, friction and \
             slip_ratio.",
        ),
    ),
    (TouchOutputs::FRICTION_SIGMA, "shear", None),
    (
        TouchOutputs::TEMPERATURE,
        "temperature",
        Some(
            "Mean of the temperature taxels whose nearest pressure taxel (same side of the same link, within 1.5 cell widths) is one of its, °C; \
             also warmest, warmest_taxel, warmest_position, coldest, coldest_taxel, coldest_position, temperature_gradient and \
             temperature_rate.",
        ),
    ),
];

/// What letters give touches unless other outputs are named.
const USUAL_OF_LETTERS: TouchOutputs = TouchOutputs::SHEAR.union(TouchOutputs::TEMPERATURE);

/// What touches have.
pub fn of_touches() -> Vec<Quantity> {
    let row = |name: String| {
        let output = TouchOutputs::named(&name)?;
        let default = TouchOutputs::USUAL.union(USUAL_OF_LETTERS).contains(output);
        let of_letter = OF_LETTERS.iter().find(|(of, ..)| *of == output);
        let letter = of_letter.map(|(_, letter, _)| *letter);
        let name = format!("touches.{name}");
        let list = LISTS.iter().find(|(of, ..)| *of == output);
        Some(match list {
            Some(&(_, unit, what)) => Quantity { name, unit, components: 0, default, letter, what },
            None => {
                let column = TOUCH_COLUMNS.iter().find(|column| column.output == output)?;
                let what = of_letter.and_then(|(.., what)| *what).unwrap_or(column.help);
                Quantity { name, unit: column.unit.symbol(), components: column.components, default, letter, what }
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
        default: (Outputs::USUAL | (Outputs::OF_OTHER_LETTERS - Outputs::FRICTION_SIGMA)).contains(column.output),
        letter: Outputs::OF_OTHER_LETTERS.contains(column.output).then_some(column.stage),
        what: column.help,
    };
    let self_contacts = Quantity {
        name: "self_contacts".to_owned(),
        unit: "",
        components: 0,
        default: false,
        letter: None,
        what: "Where the robot touches itself: pairs of touches of two links; needs poses.",
    };
    COLUMNS.iter().map(row).chain([self_contacts]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::signal::Receptor;

    #[test]
    fn every_quantity_is_listed_with_what_it_is() {
        let (touches, fields) = (of_touches(), of_fields());
        assert_eq!(touches.len(), TouchOutputs::all().names().count());
        assert_eq!(fields.len(), Outputs::all().names().count());
        assert!(touches.iter().chain(&fields).all(|row| !row.what.trim().is_empty()));
    }

    #[test]
    fn what_letters_have_is_under_their_names_and_comes_by_default() {
        for letter in ["shear", "temperature", "proximity"] {
            let receptor: Receptor = letter.parse().unwrap();
            assert_eq!(receptor.to_string(), letter, "a stage is called as its letter is");
            let of_letter = of_fields().into_iter().filter(|row| row.letter == Some(letter));
            let (default, asked): (Vec<_>, Vec<_>) = of_letter.partition(|row| row.default);
            let asked: Vec<String> = asked.into_iter().map(|row| row.name).collect();
            assert!(default.len() >= 7 && asked == if letter == "shear" { &["friction_sigma"][..] } else { &[] });
        }
        let touches = of_touches();
        let of = |name: &str| touches.iter().find(|row| row.name == name).unwrap();
        assert!(of("touches.shear").default && of("touches.temperature").default);
        assert!(!of("touches.friction_sigma").default && of("touches.friction_sigma").letter == Some("shear"));
        assert!(of("touches.total").letter.is_none());
    }
}
