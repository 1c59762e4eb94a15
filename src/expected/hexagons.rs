//! An ideal skin: a flat sheet of hexagonal cells.

use glam::{DAffine3, DVec3};

use super::layout_errors::{LayoutErrors, TestTouches};
use super::presses::presses;
use super::trial::Trial;
use crate::body::{Body, Home, Link, Modality, Surface, Taxel};
use crate::error::Result;

/// Half of the sheet's side, and of the side of the square in its middle that is touched, in spacings: whatever is felt of a line is
/// on the sheet.
const HALF: u32 = 8;
const TOUCHED: f64 = 2.0;

/// The errors of `touches` on an ideal skin with one taxel to the square of `spacing_m`.
pub(super) fn errors(spacing_m: f64, touches: &TestTouches) -> Result<LayoutErrors> {
    let sheet = sheet(spacing_m);
    let mut trial = Trial::new(&sheet)?;
    let touch_spacing_m = touches.spacing_m.unwrap_or(spacing_m);
    let skin = trial.skin(touch_spacing_m);
    let is_inside = |p: DVec3| p.abs().max_element() <= TOUCHED * spacing_m;
    let presses = presses(touches.count, touch_spacing_m, |press| skin.skin_at(press).is_some_and(is_inside));
    Ok(LayoutErrors { spacing_m, ..trial.errors(&skin, &presses, touch_spacing_m)? })
}

/// A square sheet across y, around the origin.
fn sheet(spacing_m: f64) -> Body {
    let (side, half_m) = (2 * HALF, f64::from(HALF) * spacing_m);
    let at = |step: u32| f64::from(step) * spacing_m - half_m;
    let positions = (0..=side).flat_map(|row| (0..=side).map(move |column| DVec3::new(at(column), 0.0, at(row))));
    let squares = (0..side).flat_map(|row| (0..side).map(move |column| row * (side + 1) + column));
    let triangles = squares.flat_map(|a| {
        let below = a + side + 1;
        [[a, below, below + 1], [a, below + 1, a + 1]]
    });
    let surface = Surface {
        name: "sheet".to_owned(),
        positions: positions.collect(),
        triangles: triangles.collect(),
        home: Home::Rigid { link: 0, link_from_mesh: DAffine3::IDENTITY },
    };
    // Cells of one spacing squared: rows are √3/2 of the distance within a row apart.
    let within_m = spacing_m * (2.0 / 3.0_f64.sqrt()).sqrt();
    let between_m = within_m * 3.0_f64.sqrt() / 2.0;
    let steps = |apart_m: f64| (half_m / apart_m).ceil() as i32;
    let (rows, columns) = (steps(between_m), steps(within_m));
    let places = (-rows..=rows).flat_map(|row| {
        let shift = if row.rem_euclid(2) == 0 { 0.0 } else { 0.5 };
        (-columns..=columns)
            .map(move |column| DVec3::new((f64::from(column) + shift) * within_m, 0.0, f64::from(row) * between_m))
    });
    let taxel = |(position_in_link, id): (DVec3, u32)| Taxel {
        id,
        link: 0,
        position_in_link,
        normal_in_link: DVec3::Y,
        area: spacing_m * spacing_m,
        modality: Modality::Pressure,
        tangent_in_link: None,
    };
    let link = Link {
        name: "sheet".to_owned(),
        parent: None,
        body_from_link: DAffine3::IDENTITY,
        link_from_node: DAffine3::IDENTITY,
        joint: None,
        urdf_up: None,
    };
    Body {
        name: "an ideal skin".to_owned(),
        links: vec![link],
        surfaces: vec![surface],
        taxels: places.filter(|p| p.abs().max_element() < half_m).zip(0..).map(taxel).collect(),
        fields: Vec::new(),
        edges: None,
        findings: Vec::new(),
        kept: Default::default(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::TaxelGraph;

    #[test]
    fn every_cell_in_the_middle_is_a_regular_hexagon_of_the_wanted_size() {
        let spacing_m = 0.0162;
        let sheet = sheet(spacing_m);
        let (graph, _) = TaxelGraph::from_body(&sheet);
        let mut inner = 0;
        for (index, taxel) in sheet.taxels.iter().enumerate() {
            if taxel.position_in_link.abs().max_element() < 5.0 * spacing_m {
                let beside = graph.neighbours(index);
                assert_eq!(beside.len(), 6, "{}", taxel.position_in_link);
                inner += 1;
            }
        }
        // As many as squares of that size.
        assert!((95..=105).contains(&inner), "{inner}");
    }

    #[test]
    fn errors_grow_with_the_spacing_and_nothing_else() {
        let touches = TestTouches::default().count(60);
        let [fine, coarse] = [0.01, 0.03].map(|spacing_m| errors(spacing_m, &touches).unwrap());
        assert_eq!((fine.counted().count(), coarse.counted().count()), (60, 60));
        let in_spacings = |errors: &LayoutErrors| errors.place_m().unwrap().median / errors.spacing_m;
        assert!((in_spacings(&fine) / in_spacings(&coarse) - 1.0).abs() < 0.1);
        // Touches of the coarse one on the fine one: more taxels feel them.
        let finer = errors(0.01, &touches.spacing_m(0.03)).unwrap();
        assert!(finer.place_m().unwrap().median < 0.5 * coarse.place_m().unwrap().median);
    }
}
