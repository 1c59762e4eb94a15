//! The body of sensors without known places: a grid, or a row of dots.

use crate::body::{Sheet, SheetCell, sheets};
use crate::error::Result;
use crate::signal::Channel;

/// A `.glb` of the taxels of the channels `ids` in rows and columns as they are printed, `pitch_m` from one row, and from one column, to
/// the next.
pub(super) fn glb(ids: &[u32], [rows, columns]: [usize; 2], pitch_m: [f64; 2]) -> Result<Vec<u8>> {
    let from_middle = |index: usize, count: usize| index as f64 - (count as f64 - 1.0) / 2.0;
    let taxels = Channel::taxels_of(ids);
    let cells = taxels.iter().enumerate().map(|(index, &(id, has_axes))| {
        let (row, column) = (index / columns, index % columns);
        let centre = [from_middle(column, columns) * pitch_m[1], -from_middle(row, rows) * pitch_m[0]];
        SheetCell::rectangle(id, centre, pitch_m[1], pitch_m[0]).with_axes(has_axes)
    });
    let name = if rows > 1 { "grid" } else { "row" };
    sheets(&[Sheet::new(name, cells.collect())])?.to_bytes()
}
