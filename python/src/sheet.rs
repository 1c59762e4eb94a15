//! Flat sheets of sensors: what `Body.grid` makes.

use pyo3::prelude::*;
use somatic::internal::author::{GridOrder, SheetGrid, author_sheets};

use crate::body::PyBody;
use crate::error::{OrRaise, usage};
use crate::field::PitchOfGrid;
use crate::threads::free;

/// The keywords of `Body.grid`.
pub(crate) struct Sheet<'a, 'py> {
    pub(crate) size: [u32; 2],
    pub(crate) pitch_m: PitchOfGrid,
    pub(crate) name: &'a str,
    pub(crate) order: &'a str,
    pub(crate) regions: Option<(u32, u32)>,
    pub(crate) cells: Option<&'a Bound<'py, PyAny>>,
}

impl Sheet<'_, '_> {
    /// A body of it.
    pub(crate) fn body(self, py: Python<'_>) -> PyResult<PyBody> {
        let Self { size: [rows, columns], pitch_m, name, order, regions, cells } = self;
        let (row_pitch_m, column_pitch_m) = match pitch_m {
            PitchOfGrid::Both(pitch) => (pitch, pitch),
            PitchOfGrid::Each(rows, columns) => (rows, columns),
        };
        let order = match order {
            "rows" => GridOrder::Rows,
            "columns" => GridOrder::Columns,
            other => return Err(usage(py, format!("there is no order `{other}`; it is rows or columns"))),
        };
        let regions = regions.map(|(rows, columns)| [rows, columns]);
        let mask = cells.map(|cells| mask_of(cells, [rows, columns])).transpose()?;
        let grid =
            SheetGrid { row_pitch_m, column_pitch_m, order, regions, ..SheetGrid::new(rows, columns, row_pitch_m) };
        free(py, || {
            let grid = match &mask {
                Some(mask) => grid.with_mask("cells", mask)?,
                None => grid,
            };
            let authored = author_sheets(name, &[grid.sheet(name)?])?;
            PyBody::of_bytes(name, authored.file.to_glb()?)
        })
        .or_raise(py)
    }
}

/// Which cells there are, as the file of the command's `--cells` has them: a line for each row, 1 for a sensor and 0 for none.
fn mask_of(cells: &Bound<'_, PyAny>, [rows, columns]: [u32; 2]) -> PyResult<String> {
    let py = cells.py();
    let rows_of = || -> PyResult<Vec<Vec<bool>>> {
        py.import("numpy")?.call_method1("asarray", (cells, "bool"))?.call_method0("tolist")?.extract()
    };
    let cells = rows_of().unwrap_or_default();
    if cells.len() != rows as usize || cells.iter().any(|row| row.len() != columns as usize) {
        return Err(usage(py, format!("cells should be bool of shape [rows, columns] = [{rows}, {columns}]")));
    }
    let line = |row: &Vec<bool>| row.iter().map(|&cell| if cell { "1" } else { "0" }).collect::<Vec<_>>().join(",");
    Ok(cells.iter().map(line).collect::<Vec<_>>().join("\n") + "\n")
}
