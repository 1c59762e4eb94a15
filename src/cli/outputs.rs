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
        table(&touches),
        table(&fields)
    ))?;
    Ok(DONE)
}

fn table(rows: &[Quantity]) -> String {
    let mut table = plain(["name", "unit", "numbers", "default", "what it is"], [2]);
    for row in rows {
        let numbers = if row.components == 0 { "list".to_owned() } else { row.components.to_string() };
        let default = if row.default { "yes" } else { "" };
        table.add_row([row.name.as_str(), row.unit, &numbers, default, row.what.trim()]);
    }
    shown(&table)
}
