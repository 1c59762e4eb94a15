//! Names of columns that hold no sensor, and words for columns in messages.

/// What is beside the sensors of a frame: its label, and totals of them.
const NO_SENSORS: [&str; 22] = [
    "label",
    "labels",
    "class",
    "activity",
    "event",
    "marker",
    "note",
    "notes",
    "comment",
    "tag",
    "target",
    "subject",
    "trial",
    "total",
    "totals",
    "sum",
    "force",
    "cop_x",
    "cop_y",
    "copx",
    "copy",
    "temperature",
];

/// Whether a column that is headed `word` holds no sensor.
pub(super) fn is_beside_sensors(word: &str) -> bool {
    let word = word.trim().to_lowercase();
    NO_SENSORS.contains(&word.as_str())
}

/// Rows and columns in which this number of sensors may stand, as `--grid` takes them: a square if they make one.
pub(super) fn grid_of(sensors: usize) -> String {
    let side = sensors.isqrt();
    if side > 1 && side * side == sensors { format!("{side}x{side}") } else { format!("1x{sensors}") }
}

/// The columns `first` to `last`, from 1.
pub(super) fn columns(first: usize, last: usize) -> String {
    match last.saturating_sub(first) {
        0 => format!("column {first}"),
        1 => format!("columns {first} and {last}"),
        _ => format!("columns {first} to {last}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_named_and_grids_are_square_where_they_can_be() {
        assert!(is_beside_sensors(" Label") && is_beside_sensors("sum") && !is_beside_sensors("palm"));
        assert_eq!([1, 4, 12, 81].map(grid_of), ["1x1", "2x2", "1x12", "9x9"]);
        assert_eq!(
            [(2, 2), (2, 3), (2, 9)].map(|(a, b)| columns(a, b)),
            ["column 2", "columns 2 and 3", "columns 2 to 9"]
        );
    }
}
