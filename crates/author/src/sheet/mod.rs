//! Flat sheets of sensors: mats, insoles and arrays, which need no mesh of their own.
//!
//! A [`Sheet`] is one link with its cells; [`SheetGrid`] makes one of rows and columns:
//!
//! ```
//! use somatic_author::{SheetGrid, sheets};
//! use somatic_skin::body::Body;
//!
//! // An insole of 31 rows and 11 columns, 8.6 mm apart.
//! let insole = SheetGrid::new(31, 11, 0.0086).sheet("insole")?;
//! let body = Body::from_bytes("insole.glb", &sheets(&[insole])?.to_bytes()?)?;
//! assert_eq!((body.taxels.len(), body.fields[0].name.as_str()), (341, "insole"));
//! # Ok::<(), somatic_skin::Error>(())
//! ```

mod author;
mod grid;
mod mask;

pub use author::author_sheets;
pub use grid::{GridOrder, SheetGrid};

pub use crate::body::{Sheet, SheetCell, sheets};

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::Body;
    use crate::field::FieldSet;
    use glam::DVec3;

    fn body(sheets_of: &[Sheet]) -> Body {
        Body::from_bytes("made.glb", &sheets(sheets_of).unwrap().to_bytes().unwrap()).unwrap()
    }

    #[test]
    fn a_grid_reads_as_its_file_does_row_0_on_top() {
        let sheet = SheetGrid::new(3, 2, 0.01).sheet("mat").unwrap();
        let body = body(&[sheet]);
        let place = |id: u32| body.taxels[body.taxel_index(id).unwrap()].position_in_link;
        assert!((place(1) - place(0) - DVec3::new(0.01, 0.0, 0.0)).length() < 1e-8, "columns go right");
        assert!((place(2) - place(0) - DVec3::new(0.0, 0.0, 0.01)).length() < 1e-8, "rows go down");
        assert!(body.taxels.iter().all(|t| (t.area - 1e-4).abs() < 1e-10 && t.normal_in_link == DVec3::Y));
        let fields = FieldSet::new(&body).unwrap().fields;
        let chart = fields[0].chart.as_ref().expect("it is flat");
        assert!(chart.normal_in_anchor.distance(DVec3::Y) < 1e-6 && chart.u_in_anchor.distance(DVec3::X) < 1e-6);
        assert!(body.findings.is_empty(), "{:?}", body.findings);
    }

    #[test]
    fn two_sheets_are_two_links() {
        let left = SheetGrid::new(3, 2, 0.01).sheet("left").unwrap();
        let right = SheetGrid { first_id: 6, ..SheetGrid::new(3, 2, 0.01) }.sheet("right").unwrap();
        let two = body(&[left.clone(), right.clone().at(DVec3::X * 0.1)]);
        assert_eq!(two.links.iter().map(|link| link.name.as_str()).collect::<Vec<_>>(), ["left", "right"]);
        assert_eq!(two.taxels.iter().filter(|taxel| taxel.link == 1).count(), 6);
        let twice = sheets(&[left.clone(), left.clone()]).err().unwrap().to_string();
        assert!(twice.contains("`left`"), "{twice}");
        let clash =
            sheets(&[left, Sheet { cells: right.cells[..1].to_vec(), ..right.clone() }, Sheet::new("x", right.cells)]);
        assert!(clash.err().unwrap().to_string().contains("id 6 is used twice"));
    }

    #[test]
    fn what_is_wrong_with_a_sheet_is_reported() {
        let good = SheetGrid::new(1, 2, 0.01).sheet("a").unwrap();
        let why = |sheet: Sheet| sheets(&[sheet]).err().expect("it is wrong").to_string();
        assert!(why(Sheet::new("a", Vec::new())).contains("no cells"));
        assert!(why(Sheet { name: " ".into(), ..good.clone() }).contains("no name"));
        assert!(why(Sheet { parts: vec![("toe".into(), vec![7])], ..good.clone() }).contains("cell 7"));
        let mut nowhere = good;
        nowhere.cells[1].centre[0] = f64::NAN;
        assert!(why(nowhere).contains("cell 1"));
    }
}
