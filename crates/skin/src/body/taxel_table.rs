//! Tables of taxels as CSV: a line for each, with its id, place and whatever else is known of it.

use std::collections::HashMap;
use std::fmt::Write as _;
use std::io::Read;

use glam::DVec3;

use super::layout::MAX_TAXEL_ID;
use super::model::{Body, Modality};
use crate::error::{Error, Result, failed};
use crate::limits::MAX_TAXELS;

/// The columns that a table may have, in the order in which they are written; the last three only where a taxel has a tangent.
const COLUMNS: [&str; 13] = [
    "id", "link", "x", "y", "z", NORMAL[0], NORMAL[1], NORMAL[2], "area", "modality", TANGENT[0], TANGENT[1],
    TANGENT[2],
];

/// Sine of the angle to its normal under which a tangent has no direction along the skin.
const ALONG_NORMAL: f64 = 1e-3;

/// The columns of a taxel's tangent.
const TANGENT: [&str; 3] = ["tx", "ty", "tz"];
/// The same of normals.
const NORMAL: [&str; 3] = ["nx", "ny", "nz"];

/// Maximum area of a taxel, m²; larger ones are in another unit.
const MAX_TAXEL_AREA_M2: f64 = 1.0;

/// A line of a table.
#[derive(Clone, Debug, PartialEq)]
pub struct TaxelRow {
    /// Its line in the file, from 1.
    pub line: u64,
    /// The taxel's id.
    pub id: u32,
    /// The link in whose frame its place and normal are, if it is named.
    pub link: Option<String>,
    /// Its place, m; z is 0 where a flat table leaves it out.
    pub position: DVec3,
    /// Its outward unit normal, if given.
    pub normal: Option<DVec3>,
    /// Its area, m², if given.
    pub area_m2: Option<f64>,
    /// What it measures, if given.
    pub modality: Option<Modality>,
    /// The unit direction along which the second value of a taxel with three axes is, if given.
    pub tangent: Option<DVec3>,
}

/// Reads a table with the columns `id`, `x`, `y` and `z`, and optionally `link`, `nx`, `ny`, `nz`, `area`, `modality`, `tx`, `ty`
/// and `tz`; a `flat` one may leave out `z`. Ids are unique for each link if `flat`, else in all of the table.
///
/// # Errors
/// It is not such a table; with the line.
pub fn read_taxel_table(reader: impl Read, flat: bool) -> Result<Vec<TaxelRow>> {
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).comment(Some(b'#')).from_reader(reader);
    let broken = |e: &csv::Error| {
        let row = e.position().map_or(0, csv::Position::line);
        failed!("not a valid table: {e}; give the columns id,x,y,z").at(format!("line {row}"))
    };
    let header = reader.headers().map_err(|e| broken(&e))?.clone();
    let columns = Columns::from_header(&header, flat)?;
    let mut rows: Vec<TaxelRow> = Vec::new();
    let mut seen = HashMap::new();
    for record in reader.records() {
        let record = record.map_err(|e| broken(&e))?;
        let line = record.position().map_or(0, csv::Position::line);
        let row = columns.row(&record, line).map_err(|e| e.at(format!("line {line}")))?;
        let scope = if flat { row.link.clone() } else { None };
        if let Some(before) = seen.insert((scope, row.id), line) {
            let what = failed!("id {} is on line {before} already; give each taxel its own", row.id);
            return Err(what.at(format!("line {line}")));
        }
        rows.push(row);
        if rows.len() > MAX_TAXELS {
            return Err(
                failed!("the table has over {MAX_TAXELS} taxels, the most that is read").at(format!("line {line}"))
            );
        }
    }
    if rows.is_empty() {
        return Err(Error::failed("it has no rows; give each taxel one, as id,x,y,z"));
    }
    Ok(rows)
}

/// Where in a record each column is.
struct Columns {
    id: usize,
    place: [Option<usize>; 3],
    normal: Option<[usize; 3]>,
    link: Option<usize>,
    area: Option<usize>,
    modality: Option<usize>,
    tangent: Option<[usize; 3]>,
}

impl Columns {
    fn from_header(header: &csv::StringRecord, flat: bool) -> Result<Self> {
        if let Some(unknown) = header.iter().find(|own| !COLUMNS.iter().any(|known| own.eq_ignore_ascii_case(known))) {
            return Err(failed!(
                "there is no column `{unknown}` in a table of taxels; it may have {}: rename or remove it",
                COLUMNS.join(", ")
            )
            .at("line 1"));
        }
        let column = |name: &str| header.iter().position(|own| own.eq_ignore_ascii_case(name));
        let needed = |name: &str| {
            let all = if flat { "id, x, y" } else { "id, x, y, z" };
            column(name).ok_or_else(|| {
                failed!("there is no column `{name}`; the first line names {all} and optionally link and area")
            })
        };
        let z = if flat { column("z") } else { Some(needed("z")?) };
        let direction = |what: &str, names: [&str; 3]| match names.map(column) {
            [Some(x), Some(y), Some(z)] => Ok(Some([x, y, z])),
            [None, None, None] => Ok(None),
            _ => Err(failed!("a {what} has three columns, {}; add those that are missing", names.join(", "))),
        };
        Ok(Self {
            id: needed("id")?,
            place: [Some(needed("x")?), Some(needed("y")?), z],
            normal: direction("normal", NORMAL)?,
            tangent: direction("tangent", TANGENT)?,
            link: column("link"),
            area: column("area"),
            modality: column("modality"),
        })
    }

    fn row(&self, record: &csv::StringRecord, line: u64) -> Result<TaxelRow> {
        let cell = |column: usize| record.get(column).unwrap_or_default();
        let given = |column: Option<usize>| column.map(cell).filter(|text| !text.is_empty());
        let number = |column: usize| {
            let number = cell(column).parse().ok().filter(|x: &f64| x.is_finite());
            number.ok_or_else(|| failed!("`{}` is not a coordinate; give metres", cell(column)))
        };
        let id = cell(self.id).parse().ok().filter(|id| *id <= MAX_TAXEL_ID);
        let id = id.ok_or_else(|| {
            failed!("`{}` is not an id; ids are whole numbers from 0 to {MAX_TAXEL_ID}", cell(self.id))
        })?;
        let [x, y, z] = self.place.map(|column| column.map_or(Ok(0.0), number));
        let direction = |what: &str, columns: Option<[usize; 3]>| match columns {
            Some(columns) if columns.iter().any(|&column| !cell(column).is_empty()) => {
                let [first, .., last] = if what == "tangent" { TANGENT } else { NORMAL };
                let part = |column: usize| {
                    let part = cell(column).parse().ok().filter(|x: &f64| x.is_finite());
                    part.ok_or_else(|| match cell(column) {
                        "" => failed!("a {what} needs all three of {first} to {last}, or none"),
                        text => {
                            failed!("`{text}` is not a number; a {what} has three, {first} to {last}, without a unit")
                        }
                    })
                };
                let [x, y, z] = columns.map(part);
                let direction = DVec3::new(x?, y?, z?);
                // What is a unit vector to the digits of single precision stays as it is written.
                let is_unit = (direction.length_squared() - 1.0).abs() < 1e-6;
                let unit = if is_unit { Some(direction) } else { direction.try_normalize() };
                unit.map(Some).ok_or_else(|| failed!("its {what} is zero; give a direction, or leave it blank"))
            }
            _ => Ok(None),
        };
        let modality = given(self.modality).map(modality_of).transpose()?;
        let tangent = direction("tangent", self.tangent)?;
        if let Some(known) = modality.filter(|&known| tangent.is_some() && known != Modality::Force3) {
            return Err(failed!("it measures {} and has a tangent; leave that blank, or write force3", known.name()));
        }
        let normal = direction("normal", self.normal)?;
        if let Some((tangent, normal)) = tangent.zip(normal)
            && tangent.cross(normal).length() < ALONG_NORMAL
        {
            return Err(failed!("its tangent is along its normal; give one along the skin, or leave it blank"));
        }
        Ok(TaxelRow {
            line,
            id,
            link: given(self.link).map(str::to_owned),
            position: DVec3::new(x?, y?, z?),
            normal,
            area_m2: given(self.area).map(area_of).transpose()?,
            modality,
            tangent,
        })
    }
}

fn area_of(text: &str) -> Result<f64> {
    let area = text.parse().ok().filter(|area: &f64| *area > 0.0 && *area <= MAX_TAXEL_AREA_M2);
    area.ok_or_else(|| failed!("`{text}` is not an area of a taxel; give square metres, 1e-4 for a square centimetre"))
}

fn modality_of(text: &str) -> Result<Modality> {
    let other = text.strip_prefix("modality ").and_then(|code| code.parse().ok()).map(Modality::from_code);
    let known = (0..4).map(Modality::from_code).find(|known| known.name().eq_ignore_ascii_case(text));
    known.or(other).ok_or_else(|| {
        let names: Vec<&str> = Modality::names().collect();
        failed!("there is no modality `{text}`; write one of {}", names.join(", "))
    })
}

/// The taxels of `body` as a table with all columns: places, normals and tangents in the frames of their links, an unknown area
/// blank. Tangents have columns where a taxel has one.
#[must_use]
pub fn taxel_table(body: &Body) -> String {
    let has_tangents = body.taxels.iter().any(|taxel| taxel.tangent_in_link.is_some());
    let shown = if has_tangents { COLUMNS.len() } else { COLUMNS.len() - TANGENT.len() };
    let mut text = COLUMNS[..shown].join(",") + "\n";
    for taxel in &body.taxels {
        let link = quoted(&body.links[taxel.link].name);
        let _ = write!(text, "{},{link}", taxel.id);
        for x in taxel.position_in_link.to_array().into_iter().chain(taxel.normal_in_link.to_array()) {
            // −0 is 0.
            let _ = write!(text, ",{}", x + 0.0);
        }
        let area = if taxel.area > 0.0 { taxel.area.to_string() } else { String::new() };
        let _ = write!(text, ",{area},{}", taxel.modality.name());
        if has_tangents {
            match taxel.tangent_in_link {
                Some(tangent) => tangent.to_array().into_iter().for_each(|x| {
                    let _ = write!(text, ",{}", x + 0.0);
                }),
                None => text.push_str(",,,"),
            }
        }
        text.push('\n');
    }
    text
}

/// A name as a cell, in quotation marks where commas or the like need them.
fn quoted(name: &str) -> String {
    let is_plain = !name.contains([',', '"', '\n', '\r', '#']) && name.trim() == name;
    if is_plain { name.to_owned() } else { format!("\"{}\"", name.replace('"', "\"\"")) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Vec<TaxelRow>> {
        read_taxel_table(text.as_bytes(), false)
    }

    #[test]
    fn columns_may_come_in_any_order_and_be_left_out() {
        let rows = read("Y,X,id,z,area\n2,1,7,3,1e-4\n0,0,8,0,\n").unwrap();
        assert_eq!((rows[0].id, rows[0].position, rows[0].area_m2), (7, DVec3::new(1.0, 2.0, 3.0), Some(1e-4)));
        assert_eq!((rows[1].line, rows[1].area_m2, &rows[1].link, rows[1].normal), (3, None, &None, None));
        let rows = read("id,x,y,z,nx,ny,nz,modality,link\n1,0,0,0,0,0,2,proximity,\"a, b\"\n").unwrap();
        let known = (rows[0].normal, rows[0].modality, rows[0].link.as_deref());
        assert_eq!(known, (Some(DVec3::Z), Some(Modality::Proximity), Some("a, b")));
        let rows = read("id,x,y,z,modality,tx,ty,tz\n1,0,0,0,force3,0,2,0\n2,0,0,0,pressure,,,\n").unwrap();
        assert_eq!(
            (rows[0].modality, rows[0].tangent, rows[1].tangent),
            (Some(Modality::Force3), Some(DVec3::Y), None)
        );
        let flat = read_taxel_table("id,x,y,link\n1,0,0,left\n1,0,0,right\n".as_bytes(), true).unwrap();
        assert_eq!((flat.len(), flat[1].position), (2, DVec3::ZERO));
    }

    #[test]
    fn what_is_wrong_has_its_line() {
        let why = |text: &str| read(text).unwrap_err().to_string();
        assert!(why("id,x,y\n1,0,0\n").contains("no column `z`; the first line names id, x, y, z"));
        assert!(why("id,x,y,z,weight\n").contains("line 1: there is no column `weight`"));
        assert!(why("id,x,y,z,nx\n1,0,0,0,1\n").contains("three columns"));
        assert!(why("id,x,y,z\n1,0,0,0\n1,0,0,0\n").contains("line 3: id 1 is on line 2 already"));
        assert!(why("id,x,y,z\n1,0,zero,0\n").contains("line 2: `zero` is not a coordinate"));
        assert!(why("id,x,y,z,area\n1,0,0,0,25\n").contains("line 2: `25` is not an area"));
        assert!(why("id,x,y,z,nx,ny,nz\n1,0,0,0,0,0,0\n").contains("its normal is zero"));
        assert!(why("id,x,y,z,modality\n1,0,0,0,taste\n").contains("no modality `taste`"));
        assert!(why("id,x,y,z,tx\n1,0,0,0,1\n").contains("a tangent has three columns, tx, ty"));
        let tangent = "id,x,y,z,tx,ty,tz,modality\n1,0,0,0";
        assert!(why(&format!("{tangent},0,0,0,force3\n")).contains("its tangent is zero"));
        for (given, says) in [
            ("1,,", "line 2: a tangent needs all three of tx to tz, or none"),
            ("1,a,0", "line 2: `a` is not a number; a tangent has three, tx to tz, without a unit"),
        ] {
            let why = why(&format!("{tangent},{given},force3\n"));
            assert!(why.contains(says) && !why.contains("metres"), "{why}");
        }
        assert!(why("id,x,y,z,nx,ny,nz\n1,0,0,0,0,1,\n").contains("a normal needs all three of nx to nz, or none"));
        let normal = "id,x,y,z,nx,ny,nz,tx,ty,tz,modality\n1,0,0,0,0,0,1";
        assert!(why(&format!("{normal},0,0,-2,force3\n")).contains("line 2: its tangent is along its normal"));
        assert!(read(&format!("{normal},0.1,0,-2,force3\n")).is_ok());
        assert!(why(&format!("{tangent},0,1,0,temperature\n")).contains("it measures temperature and has a tangent"));
        assert!(why("id,x,y,z\n").contains("no rows"));
    }
}
