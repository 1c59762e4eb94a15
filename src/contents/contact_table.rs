//! Contacts of recordings as a table in CSV.

use csv::Writer;

use super::contacts::FoundContacts;
use super::episodes::{Episode, Summary};
use crate::error::{Result, failed};

/// The columns.
const COLUMNS: [&str; 15] = [
    "recording",
    "field",
    "contact",
    "onset [s]",
    "offset [s]",
    "whole",
    "force_peak [N]",
    "impulse [N s]",
    "total_peak",
    "total_time",
    "pressure_peak",
    "pressure_time",
    "unit",
    "area [m²]",
    "path [m]",
];

/// A table with a row for each contact of each field of each recording. What is not known is blank.
pub struct ContactTable {
    writer: Writer<Vec<u8>>,
    rows: u64,
}

impl ContactTable {
    /// A table without rows.
    ///
    /// # Errors
    /// There is no memory for it.
    pub fn new() -> Result<Self> {
        let mut table = Self { writer: Writer::from_writer(Vec::new()), rows: 0 };
        table.record(COLUMNS)?;
        Ok(table)
    }

    /// Adds the contacts `found` in `recording`.
    ///
    /// # Errors
    /// There is no memory for them.
    pub fn add(&mut self, recording: &str, found: &FoundContacts) -> Result<()> {
        for field in found.fields() {
            let unit = field.quantity().symbol();
            for (number, (contact, of_contact)) in (1_usize..).zip(field.summaries(found.times_s())) {
                let cells = row([recording, &field.name], [unit, &number.to_string()], contact, &of_contact);
                self.record(cells.iter().map(String::as_str))?;
                self.rows += 1;
            }
        }
        Ok(())
    }

    /// How many contacts it has.
    pub fn rows(&self) -> u64 {
        self.rows
    }

    /// Its text.
    ///
    /// # Errors
    /// There is no memory for it.
    pub fn into_bytes(self) -> Result<Vec<u8>> {
        self.writer.into_inner().map_err(|e| failed!("cannot write a table: {}", e.error()))
    }

    fn record<'a>(&mut self, cells: impl IntoIterator<Item = &'a str>) -> Result<()> {
        self.writer.write_record(cells).map_err(|e| failed!("cannot write a table: {e}"))
    }
}

/// The cells of a contact of `[recording, field]`, in `[unit, number]`.
fn row(
    [recording, field]: [&str; 2],
    [unit, number]: [&str; 2],
    contact: &Episode,
    of_contact: &Summary,
) -> [String; COLUMNS.len()] {
    let or_blank = |value: Option<f64>| value.map_or(String::new(), digits);
    let both = |pair: Option<[f64; 2]>| pair.map_or([const { String::new() }; 2], |pair| pair.map(digits));
    let ([force, impulse], [pressure, pressure_time]) = (both(of_contact.force), both(of_contact.peak));
    let [total, total_time] = of_contact.total.map(digits);
    [
        recording.to_owned(),
        field.to_owned(),
        number.to_owned(),
        contact.onset_s.to_string(),
        contact.offset_s.to_string(),
        contact.is_whole.to_string(),
        force,
        impulse,
        total,
        total_time,
        pressure,
        pressure_time,
        unit.to_owned(),
        or_blank(of_contact.area_m2),
        or_blank(of_contact.path_m),
    ]
}

/// With seven digits, as many as single precision has.
fn digits(value: f64) -> String {
    format!("{value:.6e}").parse::<f64>().map_or_else(|_| value.to_string(), |value| value.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_contact_is_a_row_with_names_as_they_are() {
        let contact = Episode { onset_s: 0.1, offset_s: 0.5, is_whole: true, from: 0, to: 2 };
        let of_contact = Summary {
            force: Some([12.5, 3.0]),
            total: [0.1_f32.into(), 7.0],
            peak: None,
            area_m2: Some(1e-4),
            path_m: None,
        };
        let mut table = ContactTable::new().unwrap();
        let cells = row(["a, b.csv", "left \"heel\""], ["Pa", "1"], &contact, &of_contact);
        table.record(cells.iter().map(String::as_str)).unwrap();
        let text = String::from_utf8(table.into_bytes().unwrap()).unwrap();
        let right = "\"a, b.csv\",\"left \"\"heel\"\"\",1,0.1,0.5,true,12.5,3,0.1,7,,,Pa,0.0001,";
        assert_eq!(text.lines().collect::<Vec<_>>(), [COLUMNS.join(",").as_str(), right]);
    }
}
