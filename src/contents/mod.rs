//! What is in a recording, and which quantities a run can give: for `somatic info` and `somatic outputs`, and for Python.

mod bag;
mod contact_table;
mod contacts;
mod episodes;
mod quantities;
mod recording;

pub use self::bag::{bag_as_json, read_as, seconds_of};
pub use self::contact_table::ContactTable;
pub use self::contacts::{Contacts, FieldContacts, FoundContacts};
pub use self::episodes::{Episode, Rule, Threshold};
pub use self::quantities::{Quantity, of_fields, of_touches};
pub use self::recording::Contents;

/// The time from `first` to `last`, s, without digits that come from rounding these: the nearest number with as many decimals
/// as both have.
pub fn between_s(first: f64, last: f64) -> f64 {
    let step = f64::EPSILON * first.abs().max(last.abs());
    let decimals = if step > 0.0 { (-step.log10()).floor().clamp(0.0, 12.0) as usize } else { 12 };
    let apart = last - first;
    format!("{apart:.decimals$}").parse().unwrap_or(apart)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_difference_has_the_digits_of_its_ends() {
        for (first, last, apart) in [
            (0.01, 6.538, 6.528),
            (0.1, 0.3, 0.2),
            (0.0, 0.026, 0.026),
            (1_700_000_000.25, 1_700_000_001.35, 1.1),
            (-0.3, 0.1, 0.4),
            (0.0, 0.0, 0.0),
            (2.0, 1.9, -0.1),
        ] {
            assert_eq!(between_s(first, last), apart);
        }
    }
}
