//! Reads position files of the iCub's skin and accounts for every row.
//!
//! The format is that of the robot's skin configuration: `name`, `spatial_sampling` and `taxel2Repr ( … )`, then
//! `[calibration]` and a row per channel, `x y z nx ny nz` in metres in the link's frame. Six zeros mean no taxel.
//! `taxel2Repr` has per row the representative taxel of its group (a triangle of up to 12), −1 for no taxel, and −2 for a
//! thermal pad. Irregular files are accepted with notes: another number of ids than rows, coincident taxels, ids without a
//! place, places without an id, normals that are not unit vectors.

use std::collections::BTreeMap;

use glam::DVec3;

use crate::body::{FieldSpec, Glb, MemberSpec, Modality, Taxel};
use crate::error::{Error, Result, failed};

/// Rows of one triangle of the skin.
const TRIANGLE_ROWS: u32 = 12;

/// The id of a row without a taxel.
const NO_TAXEL: i64 = -1;

const THERMAL: i64 = -2;

/// Maximum coordinate in metres on a robot of this size.
const MAX_COORDINATE_M: f64 = 10.0;

/// Tolerance of a unit normal's length: files have three digits.
const UNIT_TOLERANCE: f64 = 1e-3;

const NORMAL_NEIGHBOURS: usize = 4;

/// A row of the file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum IcubRow {
    /// A taxel.
    Taxel(IcubTaxel),
    /// Six zeros, with no id or −1: no taxel.
    Absent,
    /// Six zeros with an id (of the group, or −2): a taxel at an unknown place.
    Unplaced(i64),
    /// A place with the id −1: no taxel.
    Disowned,
}

/// A taxel of a position file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IcubTaxel {
    /// Its position in the link's frame, m.
    pub position_in_link: DVec3,
    /// Outward unit normal in the link's frame.
    pub normal_in_link: DVec3,
    /// The channel of its group's representative, if given.
    pub group: Option<u32>,
    /// Pressure, or temperature for a thermal pad.
    pub modality: Modality,
    /// The origin of its normal.
    pub normal: NormalFrom,
}

/// The origin of a normal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NormalFrom {
    /// A unit vector in the file.
    File,
    /// A vector of another length in the file, normalised.
    Scaled,
    /// The mean of its neighbours' normals, as the file has none.
    Neighbours,
}

/// A position file.
#[derive(Clone, Debug)]
pub struct IcubFile {
    /// The part that the file names, like `l_forearm`.
    pub part: String,
    /// One per channel, from 0.
    pub rows: Vec<IcubRow>,
    /// Number of ids in `taxel2Repr`.
    pub ids: usize,
    /// Notes for the user, a line each; every row that is not an ordinary taxel is counted in one of them.
    pub notes: Vec<String>,
}

impl IcubFile {
    /// Reads the file's `text`.
    ///
    /// # Errors
    /// There is no `[calibration]`, a row does not have six numbers that are finite and of a robot's size, an id is no
    /// number, a taxel's id has no row, or no row has a taxel. The line is named.
    pub fn read(text: &str) -> Result<Self> {
        let lines: Vec<&str> = text.trim_start_matches('\u{feff}').lines().map(str::trim).collect();
        let start = lines.iter().position(|line| line.eq_ignore_ascii_case("[calibration]")).ok_or_else(|| {
            Error::failed("there is no line `[calibration]`: this is not a position file of the iCub's skin")
        })?;
        let (part, ids) = header(&lines[..start])?;
        let mut raw = Vec::new();
        for (line, number) in lines[start + 1..].iter().zip(start + 2..).filter(|(line, _)| !line.is_empty()) {
            if line.starts_with('[') {
                break;
            }
            raw.push(row(line).map_err(|e| e.at(format!("line {number}")))?);
        }
        // Ids −1 beyond the last row are harmless.
        if let Some(last) = ids.iter().rposition(|&id| id != NO_TAXEL).filter(|&last| last >= raw.len()) {
            return Err(failed!(
                "taxel2Repr gives row {last} the id {} and there are only {} rows: the file is cut short",
                ids[last],
                raw.len()
            ));
        }
        let mut rows: Vec<IcubRow> =
            raw.iter().enumerate().map(|(i, &row)| classify(row, ids.get(i).copied())).collect();
        if !rows.iter().any(|row| matches!(row, IcubRow::Taxel(_))) {
            return Err(Error::failed("none of its rows has a taxel with a place"));
        }
        complete_normals(&mut rows);
        let mut file = Self { part, rows, ids: ids.len(), notes: Vec::new() };
        file.notes = file.describe();
        Ok(file)
    }

    /// The taxels with their channels.
    pub fn taxels(&self) -> impl Iterator<Item = (u32, &IcubTaxel)> {
        let numbered = (0..).zip(&self.rows);
        numbered
            .filter_map(|(channel, row)| if let IcubRow::Taxel(taxel) = row { Some((channel, taxel)) } else { None })
    }

    /// The channels of coincident taxels, place by place.
    #[must_use]
    pub fn shared_places(&self) -> Vec<Vec<u32>> {
        let mut at: BTreeMap<[u64; 3], Vec<u32>> = BTreeMap::new();
        for (channel, taxel) in self.taxels() {
            // Adding 0 turns −0 into 0.
            let place = taxel.position_in_link.to_array().map(|x| (x + 0.0).to_bits());
            at.entry(place).or_default().push(channel);
        }
        let mut shared: Vec<Vec<u32>> = at.into_values().filter(|channels| channels.len() > 1).collect();
        shared.sort();
        shared
    }

    /// The fields that follow from the file, with `first_id` added to each channel: `part`, and below it one for each group
    /// of `taxel2Repr`, `part/group_099` called by the channel that stands for it, or where the file has no ids one for each
    /// triangle of 12 rows, `part/triangle_081` counted from 0. Thermal pads are in none of them.
    #[must_use]
    pub fn fields(&self, first_id: u32) -> Vec<FieldSpec> {
        let part = self.part.replace('/', "_");
        let mut children: BTreeMap<String, BTreeMap<u32, MemberSpec>> = BTreeMap::new();
        let mut alone = BTreeMap::new();
        let width = (self.rows.len().saturating_sub(1)).to_string().len();
        for (channel, taxel) in self.taxels().filter(|(_, taxel)| taxel.modality.is_pressed()) {
            let name = match taxel.group {
                Some(group) => Some(format!("{part}/group_{group:0width$}")),
                None if channel as usize >= self.ids => {
                    Some(format!("{part}/triangle_{:0width$}", channel / TRIANGLE_ROWS))
                }
                None => None,
            };
            let members = name.map_or(&mut alone, |name| children.entry(name).or_default());
            members.insert(first_id + channel, MemberSpec::default());
        }
        let whole = FieldSpec { name: part.clone(), members: alone, ..FieldSpec::default() };
        let below = children.into_iter().map(|(name, members)| FieldSpec {
            name,
            parent: Some(part.clone()),
            members,
            chart: None,
        });
        std::iter::once(whole).chain(below).collect()
    }

    /// A body of one link without a surface, called as the part is, with the file's taxels and [`IcubFile::fields`].
    #[must_use]
    pub fn to_glb(&self) -> Glb {
        let mut glb = Glb::new();
        let link = glb.node(&self.part, None, DVec3::ZERO);
        let taxel = |(id, taxel): (u32, &IcubTaxel)| Taxel {
            id,
            link: 0,
            position_in_link: taxel.position_in_link,
            normal_in_link: taxel.normal_in_link,
            area: 0.0,
            modality: taxel.modality,
            tangent_in_link: None,
        };
        let taxels: Vec<Taxel> = self.taxels().map(taxel).collect();
        glb.taxels(&format!("{} taxels", self.part), Some(link), &taxels, None);
        for field in self.fields(0) {
            let first = field.members.keys().next();
            let at = taxels.iter().find(|taxel| Some(&taxel.id) == first).map_or(DVec3::ZERO, |t| t.position_in_link);
            glb.field(&field, Some(link), at);
        }
        glb
    }

    /// The notes: everything that is not an ordinary taxel, with its channels.
    fn describe(&self) -> Vec<String> {
        let rows = self.rows.len();
        let that = |is: &dyn Fn(&IcubRow) -> bool| -> Vec<u32> {
            (0..).zip(&self.rows).filter(|(_, row)| is(row)).map(|(channel, _)| channel).collect()
        };
        let taxel = |is: fn(&IcubTaxel) -> bool| that(&|row| matches!(row, IcubRow::Taxel(taxel) if is(taxel)));
        let mut notes = vec![format!("`{}`: {} of {rows} rows have a taxel", self.part, self.taxels().count())];
        let mut note = |channels: &[u32], what: &str| {
            if !channels.is_empty() {
                notes.push(format!("{} {what}: {}", channels.len(), spans(channels)));
            }
        };
        note(&that(&|row| matches!(row, IcubRow::Absent)), "absent, six zeros");
        note(&that(&|row| matches!(row, IcubRow::Unplaced(id) if *id != THERMAL)), "with an id and no place, left out");
        note(&that(&|row| *row == IcubRow::Unplaced(THERMAL)), "thermal pads (id -2) without a place, left out");
        note(&that(&|row| *row == IcubRow::Disowned), "with a place and the id -1, which says there is none, left out");
        note(&taxel(|taxel| taxel.modality == Modality::Temperature), "thermal pads (id -2), of modality temperature");
        let without: Vec<u32> = that(&|_| true).into_iter().filter(|&channel| channel as usize >= self.ids).collect();
        note(&without, "rows beyond the last id, kept where they have a place");
        let beyond: Vec<u32> = (self.rows.len()..self.ids).map(|channel| channel as u32).collect();
        note(&beyond, "ids -1 beyond the last row, which say that there is no taxel");
        note(&taxel(|taxel| taxel.normal == NormalFrom::Scaled), "normals of another length than 1, made 1");
        note(&taxel(|taxel| taxel.normal == NormalFrom::Neighbours), "normals missing, made from their neighbours'");
        let shared = self.shared_places();
        let each: Vec<String> = shared.iter().map(|place| spans(place)).collect();
        match &shared[..] {
            [] => {}
            [place] => notes.push(format!("{} taxels on one point, all kept: {}", place.len(), each[0])),
            places => notes.push(format!(
                "{} taxels share {} points, all kept: {}",
                places.iter().map(Vec::len).sum::<usize>(),
                places.len(),
                each.join("; ")
            )),
        }
        let mut normals = self.taxels().map(|(_, taxel)| taxel.normal_in_link);
        let first = normals.next();
        if self.taxels().count() > 2 && normals.all(|normal| Some(normal) == first) {
            notes.push("all normals are the same: they may not be normals of a surface".into());
        }
        notes
    }
}

/// The part's name and the ids of `taxel2Repr`.
fn header(lines: &[&str]) -> Result<(String, Vec<i64>)> {
    let value = |key: &str| {
        let rest = lines
            .iter()
            .filter_map(|line| line.strip_prefix(key))
            .find(|rest| rest.starts_with(char::is_whitespace) || (key == "taxel2Repr" && rest.starts_with('(')));
        rest.map(str::trim)
    };
    let part = value("name").filter(|name| !name.is_empty());
    let part = part.ok_or_else(|| Error::failed("there is no line `name`, which says which part of the skin it is"))?;
    if let Some(sampling) = value("spatial_sampling")
        && sampling != "taxel"
    {
        return Err(failed!("its `spatial_sampling` is `{sampling}`; only files with a row a `taxel` can be read"));
    }
    // The list may run over several lines.
    let text = lines.join(" ");
    let Some((_, rest)) = text.split_once("taxel2Repr") else { return Ok((part.to_owned(), Vec::new())) };
    let list = rest.trim_start().strip_prefix('(').and_then(|rest| rest.split_once(')'));
    let (list, _) = list.ok_or_else(|| Error::failed("its `taxel2Repr` should be a list in parentheses"))?;
    let id = |word: &str| match word.parse::<i64>() {
        Ok(id) if id >= THERMAL => Ok(id),
        _ => Err(failed!("`{word}` in taxel2Repr is not an id; ids are -2, -1, or count from 0")),
    };
    Ok((part.to_owned(), list.split_whitespace().map(id).collect::<Result<_>>()?))
}

fn row(line: &str) -> Result<[DVec3; 2]> {
    let wrong = || failed!("`{line}` is not a row; write six numbers, x y z nx ny nz");
    let words: Vec<&str> = line.split_whitespace().collect();
    let numbers: Option<Vec<f64>> = words.iter().map(|word| word.parse().ok()).collect();
    let Some(&[x, y, z, nx, ny, nz]) = numbers.as_deref() else { return Err(wrong()) };
    let (position, normal) = (DVec3::new(x, y, z), DVec3::new(nx, ny, nz));
    if !position.is_finite() || !normal.is_finite() {
        return Err(failed!("`{line}` has a number that is not finite"));
    }
    if position.abs().max_element() > MAX_COORDINATE_M || normal.abs().max_element() > MAX_COORDINATE_M {
        return Err(failed!("`{line}` is over {MAX_COORDINATE_M} m away; positions are in metres"));
    }
    Ok([position, normal])
}

/// Classifies a row by its numbers and id.
fn classify([position, normal]: [DVec3; 2], id: Option<i64>) -> IcubRow {
    if position == DVec3::ZERO && normal == DVec3::ZERO {
        return match id {
            None | Some(NO_TAXEL) => IcubRow::Absent,
            Some(id) => IcubRow::Unplaced(id),
        };
    }
    if id == Some(NO_TAXEL) {
        return IcubRow::Disowned;
    }
    let length = normal.length();
    IcubRow::Taxel(IcubTaxel {
        position_in_link: position,
        normal_in_link: normal.try_normalize().unwrap_or(DVec3::ZERO),
        group: id.and_then(|id| u32::try_from(id).ok()),
        modality: if id == Some(THERMAL) { Modality::Temperature } else { Modality::Pressure },
        normal: if normal.try_normalize().is_none() {
            NormalFrom::Neighbours
        } else if (length - 1.0).abs() <= UNIT_TOLERANCE {
            NormalFrom::File
        } else {
            NormalFrom::Scaled
        },
    })
}

/// Sets missing normals to the mean of the nearest neighbours', or else away from the middle of all taxels.
fn complete_normals(rows: &mut [IcubRow]) {
    let all: Vec<IcubTaxel> =
        rows.iter().filter_map(|row| if let IcubRow::Taxel(t) = row { Some(*t) } else { None }).collect();
    let known: Vec<&IcubTaxel> = all.iter().filter(|taxel| taxel.normal != NormalFrom::Neighbours).collect();
    let middle = all.iter().map(|taxel| taxel.position_in_link).sum::<DVec3>() / all.len().max(1) as f64;
    for row in rows {
        let IcubRow::Taxel(taxel) = row else { continue };
        if taxel.normal != NormalFrom::Neighbours {
            continue;
        }
        let here = taxel.position_in_link;
        let mut near = known.clone();
        near.sort_by(|a, b| a.position_in_link.distance(here).total_cmp(&b.position_in_link.distance(here)));
        let mean = near.iter().take(NORMAL_NEIGHBOURS).map(|taxel| taxel.normal_in_link).sum::<DVec3>().try_normalize();
        let nearest = near.first().map(|taxel| taxel.normal_in_link);
        taxel.normal_in_link = mean.or(nearest).or((here - middle).try_normalize()).unwrap_or(DVec3::Z);
    }
}

/// Ascending numbers as ranges: `0–11, 14, 18–20`.
fn spans(numbers: &[u32]) -> String {
    let runs = numbers.chunk_by(|a, b| a + 1 == *b);
    let span = |run: &[u32]| match run {
        [one] => one.to_string(),
        run => format!("{}–{}", run[0], run[run.len() - 1]),
    };
    runs.map(span).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    const FILE: &str = "name  l_palm\r\nspatial_sampling taxel\r\ntaxel2Repr ( 0 0 -2 -1\r\n 0 -1 -2 )\r\n[calibration]\r\n\
                        0.01 0 0 0 0 2\r\n0.02 0 0 0 0 0\r\n0.03 0 0 0 1 0\r\n0 0 0 0 0 0\r\n0 0 0 0 0 0\r\n0.04 0 0 1 0 0\r\n\
                        0 0 0 0 0 0\r\n0.01 0 -0 0 0 1\r\n0 0 0 0 0 0\r\n\r\n";

    #[test]
    fn every_row_is_accounted_for() {
        let file = IcubFile::read(FILE).unwrap();
        assert_eq!((file.part.as_str(), file.rows.len(), file.ids), ("l_palm", 9, 7));
        let channels: Vec<u32> = file.taxels().map(|(channel, _)| channel).collect();
        assert_eq!(channels, [0, 1, 2, 7]);
        assert_eq!(
            (file.rows[3], file.rows[4], file.rows[5]),
            (IcubRow::Absent, IcubRow::Unplaced(0), IcubRow::Disowned)
        );
        assert_eq!((file.rows[6], file.rows[8]), (IcubRow::Unplaced(-2), IcubRow::Absent));
        let IcubRow::Taxel(scaled) = file.rows[0] else { panic!("{:?}", file.rows[0]) };
        assert_eq!((scaled.normal_in_link, scaled.normal, scaled.group), (DVec3::Z, NormalFrom::Scaled, Some(0)));
        let IcubRow::Taxel(made) = file.rows[1] else { panic!("{:?}", file.rows[1]) };
        assert_eq!(made.normal, NormalFrom::Neighbours);
        // Its neighbours look along z, z and y.
        assert!(made.normal_in_link.distance(DVec3::new(0.0, 1.0, 2.0).normalize()) < 1e-15);
        let IcubRow::Taxel(pad) = file.rows[2] else { panic!("{:?}", file.rows[2]) };
        assert_eq!((pad.modality, pad.group), (Modality::Temperature, None));
        assert_eq!(file.shared_places(), [[0, 7]]);
        let notes = file.notes.join("\n");
        for part in
            ["4 of 9 rows", "2 absent, six zeros: 3, 8", "no place, left out: 4", "id -1", "beyond the last id", "0, 7"]
        {
            assert!(notes.contains(part), "{part}: {notes}");
        }
    }

    #[test]
    fn its_fields_are_its_groups_and_where_there_are_no_ids_its_triangles() {
        let fields = IcubFile::read(FILE).unwrap().fields(100);
        let members = |i: usize| fields[i].members.keys().copied().collect::<Vec<_>>();
        assert_eq!((fields[0].name.as_str(), members(0).len()), ("l_palm", 0));
        assert_eq!((fields[1].name.as_str(), members(1)), ("l_palm/group_0", vec![100, 101]));
        assert_eq!((fields[2].name.as_str(), members(2)), ("l_palm/triangle_0", vec![107]));
    }

    #[test]
    fn ids_beyond_the_rows_may_only_say_that_there_is_no_taxel() {
        let file = |ids: &str| format!("name a\ntaxel2Repr ({ids})\n[calibration]\n0 0 1 0 0 1\n0 0 2 0 0 1\n");
        let read = IcubFile::read(&file("0 0 -1 -1 -1")).unwrap();
        assert_eq!((read.rows.len(), read.ids, read.taxels().count()), (2, 5, 2));
        assert!(
            read.notes.iter().any(|note| note.starts_with("3 ids -1 beyond the last row") && note.ends_with("2–4"))
        );
        assert_eq!(read.fields(0).len(), 2);
        for (ids, row) in [("0 0 -1 0 -1", 3), ("0 0 7", 2), ("0 0 -2", 2)] {
            let why = IcubFile::read(&file(ids)).unwrap_err().to_string();
            assert!(why.contains(&format!("gives row {row} the id")) && why.contains("cut short"), "{why}");
        }
    }

    #[test]
    fn what_is_no_such_file_is_named() {
        let why = |text: &str| IcubFile::read(text).unwrap_err().to_string();
        assert!(why("").contains("[calibration]"));
        assert!(why("[calibration]\n0 0 1 0 0 1").contains("`name`"));
        let after = |rows: &str| why(&format!("name a\ntaxel2Repr (0 1)\n[calibration]\n{rows}"));
        assert!(after("0 0 1 0 0 1\n1 2 3").contains("line 5: `1 2 3`"));
        assert!(after("0 0 1 0 0 1").contains("row 1 the id 1 and there are only 1 rows: the file is cut short"));
        assert!(after("0 0 1 0 0 1\n0 0 nan 0 0 1").contains("line 5") && after("0 0 99 0 0 1").contains("metres"));
        assert!(after("0 0 0 0 0 0\n0 0 0 0 0 0").contains("none of its rows"));
        assert!(why("name a\ntaxel2Repr (0 x)\n[calibration]\n").contains("`x`"));
        assert!(why("name a\ntaxel2Repr 0 1\n[calibration]\n").contains("parentheses"));
        assert!(why("name a\nspatial_sampling triangle\n[calibration]\n").contains("triangle"));
    }
}
