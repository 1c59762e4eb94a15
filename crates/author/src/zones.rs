//! Named zones of fields, such as heel and toes: by shares of the length, or by a table.

use std::collections::{BTreeMap, BTreeSet};

use glam::DVec3;

use crate::body::{Body, FieldSpec, MemberSpec, Original};
use crate::error::{Error, Result, failed};
use crate::field::unions;
use crate::skin::{Authored, add_fields};

/// Which zones a field gets.
#[derive(Clone, Debug, PartialEq)]
pub enum Zones {
    /// Names from the near end of each topmost field to the far end, with their shares of its length. Those without have equal shares of
    /// what is left.
    Shares(Vec<(String, Option<f64>)>),
    /// The zone of each taxel that is in one.
    Table(BTreeMap<u32, String>),
}

impl Zones {
    /// Reads names, each with its share: `heel,midfoot,toes`, or `heel=30%,midfoot=25%,toes`.
    ///
    /// # Errors
    /// A name is empty or there twice, a share is not over 0, or all together are not the length.
    pub fn of_shares(text: &str) -> Result<Self> {
        let mut shares: Vec<(String, Option<f64>)> = Vec::new();
        for part in text.split(',') {
            let (name, share) = part.split_once('=').map_or((part, None), |(name, share)| (name, Some(share)));
            let name = name.trim();
            if name.is_empty() || shares.iter().any(|(other, _)| other == name) {
                return Err(Error::usage(format!(
                    "`{part}`: give each zone a name of its own, such as heel,midfoot,toes"
                )));
            }
            let share = share.map(|share| {
                let number = share.trim().strip_suffix('%').and_then(|number| number.trim().parse::<f64>().ok());
                let share_of =
                    number.filter(|percent| *percent > 0.0 && *percent <= 100.0).map(|percent| percent / 100.0);
                share_of.ok_or_else(|| Error::usage(format!("`{part}`: write a share of the length as heel=30%")))
            });
            shares.push((name.to_owned(), share.transpose()?));
        }
        let given: f64 = shares.iter().filter_map(|(_, share)| *share).sum();
        let are_all_given = shares.iter().all(|(_, share)| share.is_some());
        if given > 1.0 + 1e-9 || (are_all_given && given < 1.0 - 1e-9) || (!are_all_given && given > 1.0 - 1e-9) {
            return Err(Error::usage(format!(
                "the shares are {:.0} % of the length together; make them 100 %, or leave one without a share",
                100.0 * given
            )));
        }
        Ok(Self::Shares(shares))
    }

    /// Reads a table of the columns taxel and zone; a taxel may be left out. Messages use `name`.
    ///
    /// # Errors
    /// A row is no id and a name, or a taxel is there twice; with the line.
    pub fn of_table(name: &str, text: &str) -> Result<Self> {
        let mut zones = BTreeMap::new();
        let text = text.strip_prefix('\u{FEFF}').unwrap_or(text);
        for (line, number) in text.lines().zip(1..) {
            let at = |error: Error| error.at(format!("{name}: line {number}"));
            if line.trim().is_empty() {
                continue;
            }
            let cells = line.split_once([',', ';', '\t']).map(|(taxel, zone)| (taxel.trim(), zone.trim()));
            let row = cells.and_then(|(taxel, zone)| Some((taxel.parse::<u32>().ok()?, zone)));
            match row {
                Some((taxel, zone)) if !zone.is_empty() => {
                    if zones.insert(taxel, zone.to_owned()).is_some() {
                        return Err(at(failed!("taxel {taxel} is there twice; give it one zone")));
                    }
                }
                Some(_) => {}
                None if number == 1 => {}
                None => return Err(at(failed!("`{line}`: write a taxel's id and its zone, such as 17,heel"))),
            }
        }
        if zones.is_empty() {
            return Err(
                failed!("it has no zones; write a taxel's id and its zone in each row, such as 17,heel").at(name)
            );
        }
        Ok(Self::Table(zones))
    }
}

/// Adds `zones` to the topmost fields of the body in `file`, as fields below them. Its taxels and other fields stay.
///
/// # Errors
/// The file has no taxels or no fields, or fields of these names; the table names a taxel that it does not have; a zone is empty.
pub fn author_zones(mut file: Original, zones: &Zones) -> Result<Authored> {
    let (body, details) = file.read()?;
    if body.fields.is_empty() {
        return Err(failed!("it has no fields, which zones are parts of; make a skin first").at(file.name()));
    }
    let unknown = match zones {
        Zones::Table(table) => table.keys().find(|id| body.taxel_index(**id).is_none()),
        Zones::Shares(_) => None,
    };
    if let Some(id) = unknown {
        return Err(failed!("the table names taxel {id}, which it does not have; leave it out").at(file.name()));
    }
    let members = unions(&body.fields);
    let (mut fields, mut notes) = (Vec::new(), Vec::new());
    for (parent, taxels) in body.fields.iter().zip(&members).filter(|(field, _)| field.parent.is_none()) {
        let parts = match zones {
            Zones::Shares(shares) => by_shares(&body, taxels, shares),
            Zones::Table(table) => by_table(taxels, table),
        };
        for (name, ids) in parts {
            let name = format!("{}/{name}", parent.name);
            if body.fields.iter().any(|field| field.name == name) {
                return Err(failed!("it has a field `{name}` already; give the zone another name").at(file.name()));
            }
            if ids.is_empty() {
                return Err(failed!("no taxel lies in `{name}`; make its share larger").at(file.name()));
            }
            notes.push(format!("{name}: {} taxels", ids.len()));
            let members = ids.into_iter().map(|id| (id, MemberSpec::default())).collect();
            fields.push(FieldSpec { name, parent: Some(parent.name.clone()), members, chart: None });
        }
    }
    add_fields(&mut file, &body, &details, &fields);
    let (body, _) = file.read()?;
    Ok(Authored { file, body, places: Vec::new(), notes })
}

/// The taxels of each zone along the longer side of `taxels`: from the bottom of the page up, or from the left to the right.
fn by_shares(body: &Body, taxels: &BTreeSet<u32>, shares: &[(String, Option<f64>)]) -> Vec<(String, Vec<u32>)> {
    let place = |id: u32| body.taxel_index(id).map_or(DVec3::ZERO, |index| body.taxels[index].position_in_link);
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for &id in taxels {
        (low, high) = (low.min(place(id)), high.max(place(id)));
    }
    let size = high - low;
    let along = |id: u32| {
        let from_low = place(id) - low;
        // A page lies flat: z goes down it.
        if size.z >= size.x && size.z >= size.y {
            1.0 - from_low.z / size.z
        } else if size.x >= size.y {
            from_low.x / size.x
        } else {
            from_low.y / size.y
        }
    };
    let given: f64 = shares.iter().filter_map(|(_, share)| *share).sum();
    let others = shares.iter().filter(|(_, share)| share.is_none()).count().max(1) as f64;
    let mut end = 0.0;
    let ends: Vec<f64> = shares
        .iter()
        .map(|(_, share)| {
            end += share.unwrap_or((1.0 - given) / others);
            end
        })
        .collect();
    let mut parts: Vec<(String, Vec<u32>)> = shares.iter().map(|(name, _)| (name.clone(), Vec::new())).collect();
    for &id in taxels {
        // A row on the line between two zones is in the second one, as nearly as sums of shares can say.
        let at = along(id);
        let zone = ends.iter().position(|end| at < end - 1e-9).unwrap_or(parts.len() - 1);
        parts[zone].1.push(id);
    }
    parts
}

/// The taxels of each zone that `table` has in `taxels`, in the order of their first taxels.
fn by_table(taxels: &BTreeSet<u32>, table: &BTreeMap<u32, String>) -> Vec<(String, Vec<u32>)> {
    let mut parts: Vec<(String, Vec<u32>)> = Vec::new();
    for (&id, zone) in table.iter().filter(|(id, _)| taxels.contains(id)) {
        match parts.iter_mut().find(|(name, _)| name == zone) {
            Some((_, ids)) => ids.push(id),
            None => parts.push((zone.clone(), vec![id])),
        }
    }
    parts
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{SheetGrid, sheets};

    fn insole() -> Original {
        let sheet = SheetGrid::new(10, 3, 0.01).sheet("left").unwrap();
        Original::from_bytes("insole.glb", &sheets(&[sheet]).unwrap().to_bytes().unwrap(), None).unwrap()
    }

    /// The fields of the insole with `zones`, and how many taxels each has.
    fn fields(zones: &Zones) -> Vec<(String, usize)> {
        let body = author_zones(insole(), zones).unwrap().body;
        body.fields.iter().zip(unions(&body.fields)).map(|(field, ids)| (field.name.clone(), ids.len())).collect()
    }

    #[test]
    fn zones_are_shares_of_the_length_from_the_bottom_up() {
        let zones = Zones::of_shares("heel=30%, midfoot, forefoot=20%,toes").unwrap();
        let named = |name: &str, taxels| (name.to_owned(), taxels);
        let right = [
            named("left", 30),
            // A file has the fields below another in the order of their names.
            named("left/forefoot", 6),
            named("left/heel", 9),
            named("left/midfoot", 6),
            named("left/toes", 9),
        ];
        assert_eq!(fields(&zones), right);
        let body = author_zones(insole(), &zones).unwrap().body;
        let heel = body.fields.iter().find(|field| field.name == "left/heel").unwrap();
        // Row 0 is at the top.
        assert_eq!(heel.members.keys().copied().collect::<Vec<_>>(), (21..30).collect::<Vec<_>>());
        assert_eq!(heel.parent.as_deref(), Some("left"));
    }

    #[test]
    fn zones_may_be_listed() {
        let zones = Zones::of_table("z.csv", "taxel,zone\n0,toe\n1,toe\n29, heel\n28,\n").unwrap();
        assert_eq!(fields(&zones)[1..], [("left/heel".to_owned(), 1), ("left/toe".to_owned(), 2)]);
        let why = |text: &str| Zones::of_table("z.csv", text).unwrap_err().to_string();
        assert!(why("taxel,zone\n1,a\nx,b\n").starts_with("z.csv: line 3: `x,b`"));
        assert!(why("1,a\n1,b\n").starts_with("z.csv: line 2: taxel 1 is there twice"));
        assert!(why("taxel,zone\n").contains("it has no zones"));
        let far = Zones::of_table("z.csv", "99,heel\n").unwrap();
        assert!(author_zones(insole(), &far).unwrap_err().to_string().contains("taxel 99"));
    }

    #[test]
    fn what_is_wrong_with_shares_is_named() {
        for wrong in [
            "heel,heel",
            "heel,",
            "heel=0%,toes",
            "heel=x,toes",
            "heel=60%,toes=50%",
            "heel=60%,toes=30%",
            "heel=100%,toes",
        ] {
            assert!(Zones::of_shares(wrong).unwrap_err().is_usage(), "{wrong}");
        }
        let narrow = Zones::of_shares("heel=0.5%,rest").unwrap();
        assert!(author_zones(insole(), &narrow).is_ok(), "the last row lies at the very end");
        let between = Zones::of_shares("heel=12%,gap=5%,rest").unwrap();
        assert!(author_zones(insole(), &between).unwrap_err().to_string().contains("no taxel lies in `left/gap`"));
    }
}
