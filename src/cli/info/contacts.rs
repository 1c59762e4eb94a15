//! How often, how long and how hard each field is touched in a recording.

use somatic::internal::contents::FoundContacts;

use crate::cli::table::{plain, shown};
use crate::cli::words::{number, span};

/// A table of the fields that are touched, and where contacts begin.
pub(super) fn text(contacts: &FoundContacts) -> String {
    if contacts.fields().is_empty() {
        return String::new();
    }
    // A sum of pressures is no load.
    let what = match contacts.fields().iter().filter(|field| field.is_force).count() {
        0 => "total",
        forces if forces == contacts.fields().len() => "force",
        _ => "force or total",
    };
    let [mean, peak] = ["mean", "peak"].map(|which| format!("{what}, {which}"));
    let mut table = plain(["field", "contacts", "over", "longest", "stance, mean", mean.as_str(), peak.as_str()], 1..7);
    for field in contacts.fields() {
        let quantity = field.load_quantity();
        let load = |value: f64| {
            let (factor, unit) = quantity.readable(value);
            format!("{} {unit}", number(value * factor))
        };
        table.add_row([
            field.name.clone(),
            field.contacts.len().to_string(),
            load(field.over),
            span(field.longest_s()),
            field.stance_s().map_or("–".to_owned(), span),
            field.mean().map_or("–".to_owned(), load),
            load(field.peak()),
        ]);
    }
    let shortest = span(contacts.shortest_s());
    format!("\n{}  a contact begins over that much, ends at half, and lasts {shortest} or more\n", shown(&table))
}
