//! How often, how long and how hard each field is touched in a recording.

use somatic::internal::contents::Contacts;

use crate::cli::table::{plain, shown};
use crate::cli::words::{number, span};

/// A table of the fields that are touched.
pub(super) fn text(contacts: &Contacts) -> String {
    let mut touched = contacts.touched().peekable();
    if touched.peek().is_none() {
        return String::new();
    }
    let mut table = plain(["field", "contacts", "longest", "stance, mean", "load, mean", "load, peak"], 1..6);
    for field in touched {
        let load = |value: f64| {
            let (factor, unit) = field.load_quantity().readable(field.load_peak);
            format!("{} {unit}", number(value * factor))
        };
        table.add_row([
            field.name.clone(),
            field.contacts.to_string(),
            span(field.longest_s),
            field.stance_s().map_or("–".to_owned(), span),
            field.load_mean().map_or("–".to_owned(), load),
            load(field.load_peak),
        ]);
    }
    format!("\n{}", shown(&table))
}
