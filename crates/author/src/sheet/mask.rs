//! Which cells of a grid are there, as a table of 0 and 1.

use crate::error::{Result, failed};

/// The mask in `text`, row by row.
pub(super) fn read(text: &str, rows: u32, columns: u32) -> Result<Vec<bool>> {
    let mut present = Vec::new();
    let mut number_of_rows = 0;
    let text = text.strip_prefix('\u{FEFF}').unwrap_or(text);
    for (line, number) in text.lines().zip(1..) {
        let cells = cells_of(line);
        if cells.iter().all(|cell| cell.is_empty()) && !line.contains([',', ';', '\t']) {
            continue;
        }
        number_of_rows += 1;
        if cells.len() != columns as usize {
            let what =
                failed!("it has {} cells, and the grid {columns} columns; write one number for each", cells.len());
            return Err(what.at(format!("line {number}")));
        }
        for cell in cells {
            match cell {
                "1" | "1.0" => present.push(true),
                "0" | "0.0" | "" => present.push(false),
                _ => {
                    let what = failed!("`{cell}` is neither 0 nor 1; write 1 for a cell that is there, and 0 else");
                    return Err(what.at(format!("line {number}")));
                }
            }
        }
    }
    if number_of_rows != rows {
        return Err(failed!("it has {number_of_rows} rows, and the grid {rows}; write a line for each"));
    }
    Ok(present)
}

/// The cells of a line, which stand between commas, semicolons or tabs if it has any, else between spaces.
fn cells_of(line: &str) -> Vec<&str> {
    match [',', ';', '\t'].into_iter().find(|&mark| line.contains(mark)) {
        Some(mark) => line.split(mark).map(str::trim).collect(),
        None => line.split_whitespace().collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mask_is_read_however_its_cells_are_parted() {
        for text in
            ["1,0\n0,1", "1;0\r\n0;1\r\n", "\u{FEFF}1\t0\n\n0\t1\n", "1 0\n0  1\n", "1,\n,1\n", "1, 0\n 0, 1\n\n"]
        {
            assert_eq!(read(text, 2, 2).unwrap(), [true, false, false, true], "{text:?}");
        }
    }

    #[test]
    fn what_is_wrong_has_its_line() {
        let why = |text: &str| read(text, 2, 2).unwrap_err().to_string();
        assert!(why("1,1\n1,1,1\n").starts_with("line 2: it has 3 cells"));
        assert!(why("1,1\n1,x\n").starts_with("line 2: `x`"));
        assert!(why("1,1\n").contains("1 rows"));
        assert!(why("1,1\n1,1\n1,1\n").contains("3 rows"));
    }
}
