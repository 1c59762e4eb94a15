//! `somatic outputs`: which quantities a run can give.

use clap::Args;
use somatic::Result;
use somatic::internal::contents::{Quantity, of_fields, of_touches};

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
        tables(&touches),
        tables(&fields)
    ))?;
    Ok(DONE)
}

/// What stands over the quantities of a letter.
const HEADINGS: [(Option<&str>, &str); 4] = [
    (None, ""),
    (Some("shear"), "\nOf letter `shear`, for taxels with three axes:\n\n"),
    (Some("temperature"), "\nOf letter `temperature`, for taxels that measure it:\n\n"),
    (Some("proximity"), "\nOf letter `proximity`, for taxels that measure distances:\n\n"),
];

/// A table for each letter that has any of `rows`.
fn tables(rows: &[Quantity]) -> String {
    let of = |letter: Option<&str>| rows.iter().filter(move |row| row.letter == letter).collect::<Vec<_>>();
    let tables = HEADINGS.iter().map(|&(letter, heading)| (heading, of(letter))).filter(|(_, rows)| !rows.is_empty());
    tables.map(|(heading, rows)| format!("{heading}{}", table(&rows))).collect()
}

fn table(rows: &[&Quantity]) -> String {
    let mut table = plain(["name", "unit", "numbers", "default", "what it is"], [2]);
    for row in rows {
        let numbers = if row.components == 0 { "list".to_owned() } else { row.components.to_string() };
        let default = if row.default { "yes" } else { "" };
        table.add_row([row.name.as_str(), row.unit, &numbers, default, row.what.trim()]);
    }
    shown(&table)
}
