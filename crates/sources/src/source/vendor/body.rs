//! The body of a recording: each panel a flat sheet that looks up, with a field of all its cells.

use glam::DVec3;

use super::layout::{Cell, Layout, Panel};
use crate::body::{Sheet, SheetCell, sheets};
use crate::error::Result;

/// A `.glb` with the sensors of `layout`. The page's x is x and its y is −z; y is the normal.
pub(super) fn glb(layout: &Layout) -> Result<Vec<u8>> {
    sheets(&layout.panels.iter().map(sheet).collect::<Vec<_>>())?.to_bytes()
}

fn sheet(panel: &Panel) -> Sheet {
    let [x, y] = panel.offset_m;
    let mut sheet = Sheet::new(&panel.name, panel.cells.iter().map(cell).collect()).at(DVec3::new(x, 0.0, -y));
    sheet.has_places = panel.is_placed;
    sheet.parts.clone_from(&panel.parts);
    sheet
}

fn cell(&Cell { id, centre_m, corners_m, area_m2 }: &Cell) -> SheetCell {
    SheetCell { id, centre: centre_m, corners: corners_m, area_m2 }
}
