//! `somatic outputs`: which quantities a run can give.

use clap::Args;
use serde::Serialize;
use somatic::percept::{COLUMNS, TOUCH_COLUMNS, TouchOutputs};
use somatic::{Outputs, Result};

use super::stdio::{DONE, print};
use super::table::{plain, shown};

const EXAMPLES: &str = "\
Examples:
  somatic outputs
  somatic run --outputs touches,touches.wrench,centroid    the usual of touches, wrenches, and one of fields";

/// List the quantities that a run can give, with their units.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Arguments {
    /// Print them as JSON.
    #[arg(long)]
    json: bool,
}

/// A quantity.
#[derive(Serialize)]
struct Row {
    /// As `--outputs` spells it.
    name: String,
    unit: &'static str,
    /// Numbers of a value; 0 of a list.
    components: usize,
    /// Whether a run gives it unless other outputs are named.
    default: bool,
    what: &'static str,
}

/// What touches have that is not a number.
const LISTS: [(TouchOutputs, &str, &str); 5] = [
    (TouchOutputs::LINKS, "1", "The links that it lies on, with their shares of its total."),
    (TouchOutputs::FIELDS, "1", "The fields that hold parts of it, with their shares of its total."),
    (TouchOutputs::TAXELS, "", "The ids of its taxels."),
    (TouchOutputs::WRENCH, "N, N m", "Force and torque on each link that it lies on."),
    (TouchOutputs::FIT_SIGMAS, "", "The standard deviations of the fit's place, force, direction, width and length."),
];

pub(super) fn outputs(arguments: &Arguments) -> Result<u8> {
    let [touches, fields] = [of_touches(), of_fields()];
    if arguments.json {
        let all = serde_json::json!({ "touches": touches, "fields": fields });
        print(&format!("{all}\n"))?;
        return Ok(DONE);
    }
    print(&format!(
        "Touches of the whole body: `touches` asks for the default ones, each of these names for one more.\n\n{}\n\
         Percepts of each field:\n\n{}\n\
         P is the calibrated value of a taxel, in the unit that the calibration names.\n",
        table(&touches),
        table(&fields)
    ))?;
    Ok(DONE)
}

fn of_touches() -> Vec<Row> {
    let row = |name: String| {
        let output = TouchOutputs::named(&name)?;
        let default = TouchOutputs::USUAL.contains(output);
        let name = format!("touches.{name}");
        let list = LISTS.iter().find(|(of, ..)| *of == output);
        Some(match list {
            Some(&(_, unit, what)) => Row { name, unit, components: 0, default, what },
            None => {
                let column = TOUCH_COLUMNS.iter().find(|column| column.output == output)?;
                Row { name, unit: column.unit.symbol(), components: column.components, default, what: column.help }
            }
        })
    };
    TouchOutputs::all().names().filter_map(row).collect()
}

fn of_fields() -> Vec<Row> {
    let row = |column: &somatic::Column| Row {
        name: column.name.to_owned(),
        unit: column.unit.symbol(),
        components: column.components,
        default: Outputs::USUAL.contains(column.output),
        what: column.help,
    };
    let self_contacts = Row {
        name: "self_contacts".to_owned(),
        unit: "",
        components: 0,
        default: false,
        what: "Where the robot touches itself: pairs of touches of two links; needs poses.",
    };
    COLUMNS.iter().map(row).chain([self_contacts]).collect()
}

fn table(rows: &[Row]) -> String {
    let mut table = plain(["name", "unit", "numbers", "default", "what it is"], [2]);
    for row in rows {
        let numbers = if row.components == 0 { "list".to_owned() } else { row.components.to_string() };
        let default = if row.default { "yes" } else { "" };
        table.add_row([row.name.as_str(), row.unit, &numbers, default, row.what.trim()]);
    }
    shown(&table)
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
