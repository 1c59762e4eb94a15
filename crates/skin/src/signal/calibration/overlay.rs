//! A calibration laid over the one that comes with a file: keys that are given replace the file's own, others stay.

use toml::{Table, Value};

use super::Calibration;
use crate::body::Modality;
use crate::error::{Error, Result, parse_toml};

/// A calibration laid over another one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LaidOver {
    /// Both as one file, TOML.
    pub text: String,
    /// What stays of the lower one, as people write it: `unit = "kPa"`, `[taxel] of 3 taxels`, `[contact]`.
    pub stays: Vec<String>,
    /// The unit of the lower one and that which replaces it, where they differ.
    pub replaced_unit: Option<[String; 2]>,
}

/// Keys that mean something for the paper's circuit only.
const OF_CIRCUIT: [&str; 3] = ["wiper", "signal", "full_scale_newton"];

impl Calibration {
    /// Lays the calibration `given` over `own`, both TOML. A key of `given` under `[all]` also replaces those under the
    /// `[taxel.N]` of `own`, as it holds for every taxel; so does one under `[shear]`. For bodies whose taxels
    /// all feel pressure; for others there is [`Calibration::lay_over_for`].
    ///
    /// # Errors
    /// One of them is not TOML. Whether the result makes sense is for [`Calibration::parse`].
    pub fn lay_over(own: &str, given: &str) -> Result<LaidOver> {
        Self::laid_over(own, given, |_| Modality::Pressure)
    }

    /// Lays `given` over `own` for `taxels`, ids and what they measure, ascending by id. Under the `[taxel.N]` of `own` a key of `[all]`
    /// replaces those of taxels that feel pressure, `missing` of all; one of `[temperature]` or `[proximity]` those of taxels that measure
    /// that; one of `[shear]` those of tangential forces.
    ///
    /// # Errors
    /// As [`Calibration::lay_over`].
    pub fn lay_over_for(own: &str, given: &str, taxels: &[(u32, Modality)]) -> Result<LaidOver> {
        Self::laid_over(own, given, |id| {
            let at = taxels.binary_search_by_key(&id, |(id, _)| *id);
            at.map_or(Modality::default(), |at| taxels[at].1)
        })
    }

    fn laid_over(own: &str, given: &str, kind_of: impl Fn(u32) -> Modality) -> Result<LaidOver> {
        let (mut own, given): (Table, Table) = (parse_toml(own)?, parse_toml(given)?);
        let unit_before = unit_of(&own);
        let mut given_names: Vec<[String; 2]> = Vec::new();
        for (name, value) in &given {
            match (name.as_str(), value) {
                ("all", Value::Table(keys)) => {
                    for (id, taxel) in taxels_in(&mut own) {
                        let is_pressed = kind_of(id).is_pressed();
                        let holds = keys.iter().filter(|(key, _)| is_pressed || *key == "missing");
                        holds.for_each(|(key, value)| without_rivals(taxel, key, value));
                    }
                    lay_keys(table(&mut own, "all"), keys);
                }
                ("temperature" | "proximity", Value::Table(keys)) => {
                    for (_, taxel) in taxels_in(&mut own).filter(|(id, _)| kind_of(*id).name() == *name) {
                        keys.iter().for_each(|(key, value)| without_rivals(taxel, key, value));
                    }
                    lay_keys(table(&mut own, name), keys);
                }
                ("shear", Value::Table(keys)) => {
                    for (_, taxel) in taxels_in(&mut own) {
                        keys.keys().for_each(|key| drop(taxel.remove(&format!("shear_{key}"))));
                    }
                    lay_keys(table(&mut own, "shear"), keys);
                }
                ("taxel", Value::Table(taxels)) => {
                    for (id, keys) in taxels {
                        let Value::Table(keys) = keys else { continue };
                        lay_keys(table(table(&mut own, "taxel"), &plain_id(id)), keys);
                    }
                }
                ("curve", Value::Table(curves)) => table(&mut own, "curve").extend(curves.clone()),
                (_, Value::Table(keys)) => lay_keys(table(&mut own, name), keys),
                _ => {
                    own.insert(name.clone(), value.clone());
                }
            }
            if let Value::Table(keys) = value {
                given_names.extend(keys.keys().map(|key| [name.clone(), plain_id(key)]));
            }
        }
        drop_emptied(&mut own);
        let replaced_unit = match (unit_before, unit_of(&own)) {
            (Some(before), Some(after)) if before != after => Some([before, after]),
            _ => None,
        };
        let text = toml::to_string(&own).map_err(|e| Error::failed(e.to_string()))?;
        Ok(LaidOver { text, stays: stays(&own, &given_names), replaced_unit })
    }
}

/// What of `merged` is in no table of `given`, in words.
fn stays(merged: &Table, given: &[[String; 2]]) -> Vec<String> {
    let mut words = Vec::new();
    for (name, value) in merged {
        let Value::Table(keys) = value else { continue };
        let left: Vec<(&String, &Value)> =
            keys.iter().filter(|(key, _)| !given.iter().any(|[table, own]| table == name && own == *key)).collect();
        match name.as_str() {
            _ if left.is_empty() => {}
            "all" => words.extend(left.iter().map(|(key, value)| format!("{key} = {value}"))),
            "taxel" if left.len() == 1 => words.push(format!("[taxel.{}]", left[0].0)),
            "taxel" => words.push(format!("[taxel] of {} taxels", left.len())),
            name => words.push(format!("[{name}]")),
        }
    }
    words
}

fn unit_of(file: &Table) -> Option<String> {
    file.get("all")?.get("unit")?.as_str().map(str::to_owned)
}

/// An id as it is written without what does not count, so that `[taxel.017]` is laid over `[taxel.17]`.
fn plain_id(id: &str) -> String {
    id.parse::<u32>().map_or_else(|_| id.to_owned(), |id| id.to_string())
}

/// The table `name` of `of`, made where there is none.
fn table<'t>(of: &'t mut Table, name: &str) -> &'t mut Table {
    let entry = of.entry(name.to_owned()).or_insert_with(|| Value::Table(Table::new()));
    if !entry.is_table() {
        *entry = Value::Table(Table::new());
    }
    match entry {
        Value::Table(table) => table,
        _ => unreachable!("it was made a table"),
    }
}

/// The tables of single taxels in `of`, and whose they are.
fn taxels_in(of: &mut Table) -> impl Iterator<Item = (u32, &mut Table)> {
    let all = of.get_mut("taxel").and_then(Value::as_table_mut);
    all.into_iter().flatten().filter_map(|(id, keys)| Some((id.parse().ok()?, keys.as_table_mut()?)))
}

/// Removes the tables of single taxels that nothing is left in.
fn drop_emptied(of: &mut Table) {
    let Some(Value::Table(taxels)) = of.get_mut("taxel") else { return };
    taxels.retain(|_, keys| keys.as_table().is_none_or(|keys| !keys.is_empty()));
    if taxels.is_empty() {
        of.remove("taxel");
    }
}

/// Puts `keys` into `to`, in place of what they replace there.
fn lay_keys(to: &mut Table, keys: &Table) {
    keys.iter().for_each(|(key, value)| without_rivals(to, key, value));
    to.extend(keys.clone());
}

/// Removes from `table` what cannot stand beside `key`, and the key itself.
fn without_rivals(table: &mut Table, key: &str, value: &Value) {
    table.remove(key);
    match key {
        "curve" | "sensor" | "ntc" => {
            ["curve", "sensor", "ntc"].iter().for_each(|key| drop(table.remove(*key)));
            if value.as_str() != Some("fsr") {
                OF_CIRCUIT.iter().for_each(|key| drop(table.remove(*key)));
            }
            if key == "ntc" {
                ["unit", "baseline", "gain"].iter().for_each(|key| drop(table.remove(*key)));
            }
        }
        // Without it, it is `on`.
        "on" => drop(table.remove("off")),
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::signal::{Quantity, Response};

    fn laid(own: &str, given: &str) -> (LaidOver, Calibration) {
        let laid = Calibration::lay_over(own, given).unwrap();
        let read = Calibration::parse(&laid.text, &[3, 17]).unwrap_or_else(|e| panic!("{e}: {}", laid.text));
        (laid, read)
    }

    #[test]
    fn what_is_given_replaces_and_the_rest_stays() {
        let own = "body = \"mat.glb\"\n[all]\nunit = \"kPa\"\ngain = 2\n[taxel.17]\ndead_band = 9\nmask = true\n[contact]\non = 5\noff = 4\n";
        let (laid, read) = laid(own, "[all]\ndead_band = 3\n[taxel.003]\ngain = 4\n[contact]\non = 2\n");
        assert_eq!(read.body.as_deref(), Some("mat.glb"));
        let [a, b] = read.taxels[..] else { panic!("two taxels") };
        assert_eq!((a.quantity, a.gain, a.dead_band), (Quantity::Pascal, 4000.0, 3000.0));
        assert_eq!((b.gain, b.dead_band, b.mask), (2000.0, 3000.0, true), "[all] holds for every taxel");
        assert_eq!((read.contact.on, read.contact.off), (2000.0, 2000.0));
        assert_eq!(laid.stays, ["gain = 2", "unit = \"kPa\"", "[taxel.17]"]);
        assert_eq!(laid.replaced_unit, None);
    }

    #[test]
    fn what_is_given_of_three_axes_holds_for_every_taxel() {
        let own = "[shear]\nslips_at = 0.5\n[taxel.3]\nshear_gain = 4\nshear_baseline = [1, 2]\n";
        let (_, read) = laid(own, "[shear]\ngain = [2, 3]\nraw_range = [0, 9]\n[taxel.17]\nshear_gain = 5\n");
        assert_eq!([0, 1].map(|taxel| read.shear.gains_of(taxel, 1.0, 1.0)), [[2.0, 3.0], [5.0, 5.0]]);
        assert_eq!((read.shear.rest_of(0), read.shear.range_of(0)), ([1.0, 2.0], [0.0, 9.0]));
        assert_eq!(read.shear.slips_at, Some(0.5));
    }

    #[test]
    fn what_is_given_of_a_kind_replaces_what_single_taxels_of_that_kind_have() {
        use crate::signal::{RawValue, Reading};
        let taxels = [(1, Modality::Pressure), (2, Modality::Temperature), (3, Modality::Proximity)];
        let laid = |own: &str, given: &str| {
            let laid = Calibration::lay_over_for(own, given, &taxels).unwrap();
            let read = Calibration::parse_for(&laid.text, &taxels).unwrap_or_else(|e| panic!("{e}: {}", laid.text));
            (laid.stays, read)
        };
        let own =
            "[taxel.1]\ngain = 3\n[taxel.002]\ngain = 0.1\nbaseline = 5\nmissing = [7]\n[taxel.3]\nbaseline = 9\n";
        let celsius = |read: &Calibration| read.temperature.of_taxel(1).read(RawValue::new(255.0));
        let (stays, read) = laid(own, "[all]\ngain = 2\nbaseline = 1\nraw_range = [0, 255]\n");
        assert_eq!((celsius(&read), read.taxels[0].gain), (Reading::Value(25.0, true), 2.0));
        assert_eq!((stays, read.proximity.of_taxel(2).baseline), (vec!["[taxel] of 2 taxels".to_owned()], 9.0));
        // The others are as they were.
        let given = "[curve.a]\nraw = [0, 300]\np = [0, 30]\n[temperature]\ngain = 2\nbaseline = 155\ncurve = \"a\"\n";
        let (stays, read) = laid(own, given);
        assert_eq!((celsius(&read), read.taxels[0].gain), (Reading::Value(20.0, true), 3.0));
        assert_eq!((stays, read.proximity.of_taxel(2).baseline), (vec!["[taxel] of 3 taxels".to_owned()], 9.0));
        let (stays, read) = laid(own, "[proximity]\nbaseline = 4\n[all]\nmissing = [8]\n[taxel.1]\ngain = 6\n");
        assert_eq!((celsius(&read), read.taxels[0].gain), (Reading::Value(25.0, true), 6.0));
        assert_eq!((&stays[..], read.proximity.of_taxel(2).baseline), (&["[taxel.002]".to_owned()][..], 4.0));
        assert_eq!(read.missing, vec![vec![8.0]; 3]);
        // One response for another, and tables that are emptied.
        let ntc = "ntc = { ohm_at_25 = 1e4, b_k = 3950, series_ohm = 1e4, full_raw = 1023 }\n";
        let own = "[curve.a]\nraw = [0, 300]\np = [0, 30]\n[taxel.2]\ncurve = \"a\"\n";
        let (stays, read) = laid(own, &format!("[temperature]\n{ntc}"));
        assert!(stays == ["[curve]"] && read.temperature.own.is_empty(), "{stays:?}");
        let laid_back =
            Calibration::lay_over_for(&format!("[temperature]\n{ntc}"), "[temperature]\ngain = 2\n", &taxels);
        assert!(laid_back.unwrap().text.contains("ohm_at_25"));
    }

    #[test]
    fn a_unit_that_is_replaced_is_named() {
        let (laid, read) = laid("[all]\nunit = \"kPa\"\n", "[all]\nunit = \"N\"\n");
        assert_eq!(laid.replaced_unit, Some(["kPa".to_owned(), "N".to_owned()]));
        assert_eq!((read.taxels[0].quantity, laid.stays.len()), (Quantity::Newton, 0));
    }

    #[test]
    fn a_response_replaces_another_with_its_keys() {
        let own = "[all]\nsensor = \"fsr\"\nwiper = 12\n[taxel.3]\nwiper = 7\n";
        let (_, read) = laid(own, "[curve.a]\nraw = [0, 1]\np = [0, 2]\n[all]\ncurve = \"a\"\n");
        assert_eq!([0, 1].map(|taxel| read.taxels[taxel].response), [Response::Curve(0); 2]);
        assert!(Calibration::lay_over(own, "[all").is_err());
    }
}
