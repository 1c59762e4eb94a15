//! Columns that are the totals of others, which a table may have after its sensors.

use super::text::Word;

/// Most totals of a row: of two feet, say, and of both.
const MAX_TOTALS: usize = 4;
/// Least sensors of a total.
const MIN_SENSORS: usize = 3;
/// A sum of rounded numbers is off by so much of the last digit, times the root of their count: twice its standard deviation.
const ROUNDING: f64 = 0.6;
/// And never by more than this share.
const MAX_SHARE: f64 = 0.05;

/// The columns `first` to before `end`, from 0, whose sum another column is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Total {
    pub(super) first: usize,
    pub(super) end: usize,
}

/// The rows' sums from the first sensor on: `[row][column]`.
struct Sums {
    values: Vec<Vec<f64>>,
    sums: Vec<Vec<f64>>,
    /// By row, the last digit that is printed; 0 for whole numbers.
    digits: Vec<f64>,
}

/// The totals that the columns before `end` end with, of all columns from `first` on between them: each of the columns after those
/// of the one before, or of all. Empty if the rows do not show it.
pub(super) fn totals(rows: &[Vec<Word<'_>>], first: usize, end: usize) -> Vec<Total> {
    let sums = Sums::from_rows(rows, first, end);
    let most = MAX_TOTALS.min(end.saturating_sub(first + MIN_SENSORS));
    (1..=most).rev().find_map(|count| sums.tiled(first, end, count)).unwrap_or_default()
}

impl Sums {
    fn from_rows(rows: &[Vec<Word<'_>>], first: usize, end: usize) -> Self {
        let number = |word: &Word<'_>| word.number().filter(|number| number.is_finite()).unwrap_or(0.0);
        let values: Vec<Vec<f64>> = rows.iter().map(|row| row[..end].iter().map(number).collect()).collect();
        let sums = values.iter().map(|row| {
            let mut sum = 0.0;
            let so_far = |(column, value): (usize, &f64)| {
                let before = sum;
                sum += if column < first { 0.0 } else { *value };
                before
            };
            let mut sums: Vec<f64> = row.iter().enumerate().map(so_far).collect();
            sums.push(sum);
            sums
        });
        let sums = sums.collect();
        let digits = rows.iter().map(|row| {
            let places = row[first..end].iter().map(|word| decimals(&word.text())).max().unwrap_or(0);
            if places == 0 { 0.0 } else { 10_f64.powi(-places) }
        });
        Self { digits: digits.collect(), values, sums }
    }

    /// The last `count` columns before `end` as totals of those before.
    fn tiled(&self, first: usize, end: usize, count: usize) -> Option<Vec<Total>> {
        let sensors_end = end - count;
        let (mut at, mut has_whole, mut found) = (first, false, Vec::new());
        for column in sensors_end..end {
            let tile = (at + MIN_SENSORS..=sensors_end).find(|&to| self.is_sum(column, at, to));
            match tile {
                Some(to) => {
                    // Sensors that were never pressed belong to the last one.
                    let is_last = column + 1 == end;
                    let to = if is_last && self.is_sum(column, at, sensors_end) { sensors_end } else { to };
                    found.push(Total { first: at, end: to });
                    at = to;
                }
                None if self.is_sum(column, first, sensors_end) => {
                    found.push(Total { first, end: sensors_end });
                    has_whole = true;
                }
                None => return None,
            }
        }
        let is_whole = at == sensors_end || (has_whole && at == first);
        (is_whole && self.is_shown(first, sensors_end, end)).then_some(found)
    }

    /// Whether `column` is the sum of the columns `first` to before `end` in each row.
    fn is_sum(&self, column: usize, first: usize, end: usize) -> bool {
        (0..self.values.len()).all(|row| {
            let (total, sum) = (self.values[row][column], self.sums[row][end] - self.sums[row][first]);
            let rounding = ROUNDING * ((end - first) as f64).sqrt() * self.digits[row] + 1e-6 * total.abs();
            (total - sum).abs() <= rounding.min(MAX_SHARE * total.abs())
        })
    }

    /// Whether two rows with different totals have several sensors pressed each: else chance may do it.
    fn is_shown(&self, first: usize, sensors_end: usize, end: usize) -> bool {
        let is_pressed =
            |row: &&Vec<f64>| row[first..sensors_end].iter().filter(|&&value| value != 0.0).count() >= MIN_SENSORS;
        let mut shown = self.values.iter().filter(is_pressed).map(|row| &row[sensors_end..end]);
        let Some(one) = shown.next() else { return false };
        shown.any(|other| other != one)
    }
}

/// Digits after the point.
fn decimals(word: &str) -> i32 {
    word.rsplit_once(['.', ',']).map_or(0, |(_, digits)| digits.len().min(9) as i32)
}

#[cfg(test)]
mod tests {
    use super::super::text::Separator;
    use super::*;

    fn found(lines: &[&str], first: usize) -> Vec<(usize, usize)> {
        let rows: Vec<Vec<Word<'_>>> =
            lines.iter().map(|line| Separator::Blanks.cells(line.as_bytes()).collect()).collect();
        totals(&rows, first, rows[0].len()).into_iter().map(|total| (total.first, total.end)).collect()
    }

    #[test]
    fn columns_that_are_sums_of_all_the_others_are_found() {
        assert_eq!(found(&["0 1 2 3 4 5 6 6 15", "1 1 2 3 4 5 7 6 16"], 1), [(1, 4), (4, 7)]);
        assert_eq!(found(&["1 2 3 4 5 6 6 15 21", "1 2 3 4 5 7 6 16 22"], 0), [(0, 3), (3, 6), (0, 6)]);
        assert_eq!(found(&["1.25 2.5 3 6.75", "1.25 2.5 4 7.75"], 0), [(0, 3)]);
        // Rounded one by one, and a sensor at the end that is never pressed.
        assert_eq!(found(&["1.1 2.2 3.3 0.0 6.7", "1.1 2.2 4.3 0.0 7.7"], 0), [(0, 4)]);
        // Chance, one row alone, too few sensors, or a row in which it does not hold.
        for lines in [
            &["1 2 3 4", "1 2 4 4"][..],
            &["1 2 3 6"],
            &["1 2 3 6", "1 2 3 6"],
            &["1 2 3", "2 3 5"],
            &["1 2 3 6", "1 2 4 7", "1 2 5 9"],
            &["0 0 5 5", "0 0 6 6"],
            &["0 0 0 0", "0 0 0 0"],
        ] {
            assert_eq!(found(lines, 0), [], "{lines:?}");
        }
    }
}
