//! `author --grid`: a flat sheet of sensors, without a mesh.

use std::path::PathBuf;
use std::str::FromStr;

use clap::{Args, ValueEnum};
use somatic::author::Authored;
use somatic::internal::author::recipe_values::Length;
use somatic::internal::author::{GridOrder, SheetGrid, author_sheets};
use somatic::internal::limits::{self, MAX_TABLE_BYTES};
use somatic::{Error, Result};

const HEADING: &str = "A flat sheet: a mat, an insole, an array";

#[derive(Args)]
pub(super) struct GridArguments {
    /// A flat sheet instead of a mesh, with this many rows and columns of sensors, such as 31x11.
    ///
    /// Seen from the side that is touched, row 0 is at the top and column 0 at the left, as in a table. The sheet is
    /// one link and one field, called as the output, and a taxel has the area of its cell. In the link's frame, x
    /// runs along the columns, z down the rows, and y is the normal.
    #[arg(long, value_name = "ROWSxCOLUMNS", requires = "pitch", help_heading = HEADING,
        conflicts_with_all = ["recipe", "taxels", "spacing", "region", "seed", "unit", "even", "hidden", "clear", "mirror"])]
    grid: Option<Pair>,

    /// The distance from one sensor to the next, such as 8.6mm.
    ///
    /// Two lengths, as 8.6mm,5mm, are from one row to the next, and from one column to the next.
    #[arg(long, value_name = "LENGTH[,LENGTH]", requires = "grid", help_heading = HEADING)]
    pitch: Option<String>,

    /// How sensors are numbered from 0 on: along each row, or along each column.
    #[arg(long, value_name = "ORDER", requires = "grid", default_value = "rows", help_heading = HEADING)]
    ids: Order,

    /// Where the sheet has sensors: a CSV with a line for each row, 1 for a sensor and 0 for none.
    ///
    /// Ids stay as in the full grid.
    #[arg(long, value_name = "MASK.csv", requires = "grid", help_heading = HEADING)]
    cells: Option<PathBuf>,

    /// Fields of regions below the sheet's field, such as 3x2: three from top to bottom and two from left to right.
    #[arg(long, value_name = "ROWSxCOLUMNS", requires = "grid", help_heading = HEADING)]
    regions: Option<Pair>,
}

/// Two numbers, as `31x11`.
#[derive(Clone, Copy)]
struct Pair([u32; 2]);

impl FromStr for Pair {
    type Err = String;

    fn from_str(text: &str) -> std::result::Result<Self, String> {
        let parts = text.split_once(['x', 'X', '×']);
        let pair = parts.and_then(|(rows, columns)| Some([rows.trim().parse().ok()?, columns.trim().parse().ok()?]));
        pair.map(Self).ok_or_else(|| "write rows and columns as two whole numbers, such as 31x11".to_owned())
    }
}

#[derive(Clone, Copy, ValueEnum)]
enum Order {
    Rows,
    Columns,
}

impl GridArguments {
    /// Whether there is a sheet to make.
    pub(super) fn is_asked(&self) -> bool {
        self.grid.is_some()
    }

    /// The files that it reads.
    pub(super) fn files(&self) -> Option<&PathBuf> {
        self.cells.as_ref()
    }

    /// The sheet called `name`.
    pub(super) fn author(&self, name: &str) -> Result<Authored> {
        let usage = |e: &Error| Error::usage(e.to_string());
        let Some(Pair([rows, columns])) = self.grid else { return Err(Error::usage("give the sheet's --grid")) };
        let pitch = self.pitch.as_deref().unwrap_or_default();
        let pitches: Result<Vec<Length>> = pitch.split(',').map(str::parse).collect();
        let pitches = pitches.map_err(|e| usage(&e).at("--pitch"))?;
        let (row_pitch_m, column_pitch_m) = match pitches[..] {
            [both] => (both.metres, both.metres),
            [row, column] => (row.metres, column.metres),
            _ => return Err(Error::usage("give one length, or two as 8.6mm,5mm").at("--pitch")),
        };
        let mut grid = SheetGrid::new(rows, columns, row_pitch_m);
        grid.column_pitch_m = column_pitch_m;
        grid.order = match self.ids {
            Order::Rows => GridOrder::Rows,
            Order::Columns => GridOrder::Columns,
        };
        grid.regions = self.regions.map(|Pair(regions)| regions);
        if let Some(path) = &self.cells {
            let text = limits::read_to_string(path, MAX_TABLE_BYTES).map_err(|e| Error::io(path, &e))?;
            grid = grid.with_mask(&path.display().to_string(), &text)?;
        }
        author_sheets(&format!("{name}.glb"), &[grid.sheet(name).map_err(|e| usage(&e).at("--grid"))?])
    }
}
