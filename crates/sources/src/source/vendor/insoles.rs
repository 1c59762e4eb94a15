//! Where an insole's sensors are, from a table beside a recording that does not say it.

use std::path::Path;

use super::layout::Cell;
use crate::body::{TaxelRow, read_taxel_table};
use crate::error::{Error, Result, failed};
use crate::limits::{self, MAX_TABLE_BYTES};

/// The panel whose places are those of the other one, mirrored.
const MIRRORED: &str = "right";

/// The places of a table with the columns `id`, `x`, `y`, and optionally `area` and `link`. An id is the number of a sensor in
/// its insole. Rows whose `link` is blank are of every panel, and mirrored in x for the right one.
pub(super) struct Insoles {
    /// As messages call the table.
    name: String,
    rows: Vec<TaxelRow>,
}

impl Insoles {
    pub(super) fn load(path: &Path) -> Result<Self> {
        let file = limits::open(path, MAX_TABLE_BYTES).map_err(|e| Error::io(path, &e))?;
        let rows = read_taxel_table(file, true).map_err(|e| e.at(path.display()))?;
        Ok(Self { name: path.display().to_string(), rows })
    }

    /// Refuses a table without some of the sensors `numbers` of `panel`.
    pub(super) fn check(&self, panel: &str, numbers: &[u32]) -> Result<()> {
        match numbers.iter().find(|&&number| self.row(panel, number).is_none()) {
            None => Ok(()),
            Some(number) => Err(failed!(
                "it has no row for sensor {number} of panel `{panel}`; give each of its {} sensors one, as id,x,y,area",
                numbers.len()
            )
            .at(&self.name)),
        }
    }

    /// The cell of the sensor `number` of `panel`, without its id: a square of its area.
    pub(super) fn cell(&self, panel: &str, number: u32) -> Cell {
        let Some(row) = self.row(panel, number) else { return Cell::default() };
        let is_mirrored = row.link.is_none() && panel == MIRRORED;
        let x = if is_mirrored { -row.position.x } else { row.position.x };
        let area_m2 = row.area_m2.unwrap_or(0.0);
        Cell::rectangle(0, [x, row.position.y], [area_m2.sqrt(); 2], area_m2)
    }

    fn row(&self, panel: &str, number: u32) -> Option<&TaxelRow> {
        let row_on = |link: Option<&str>| self.rows.iter().find(|row| row.id == number && row.link.as_deref() == link);
        row_on(Some(panel)).or_else(|| row_on(None))
    }
}
