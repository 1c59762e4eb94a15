//! The layout of an array: in which order its values are rows and columns.

use crate::error::{Error, Result, failed};

/// A dimension of an array, as `std_msgs/MultiArrayDimension` has it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Dimension {
    /// What it is called.
    pub label: String,
    /// How many items it has.
    pub size: usize,
    /// Its stride, in values.
    pub stride: usize,
}

/// How the values of an array lie.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lies {
    /// One after the other.
    Plainly,
    /// Rows one after the other, or with a gap between them.
    ByRows,
    /// Columns one after the other.
    ByColumns,
}

/// From one item to the next of each dimension, in values; and how they lie.
fn steps(dimensions: &[Dimension]) -> Option<(Vec<usize>, Lies)> {
    let sizes: Vec<usize> = dimensions.iter().map(|one| one.size).collect();
    let strides: Vec<usize> = dimensions.iter().map(|one| one.stride).collect();
    let last = sizes.len() - 1;
    let by_rows = |strides: &[usize]| (0..last).all(|at| strides[at] >= sizes[at].saturating_mul(strides[at + 1]));
    // As the definition has it: a stride is the size of the dimension with all that is within it.
    if by_rows(&strides) && strides[last] >= sizes[last] {
        let own = strides.iter().skip(1).copied().chain([1]).collect();
        return Some((own, Lies::ByRows));
    }
    // Nobody filled them in.
    if strides.iter().all(|stride| *stride == 0) {
        let mut own = vec![1; sizes.len()];
        for at in (0..last).rev() {
            own[at] = sizes[at + 1].saturating_mul(own[at + 1]);
        }
        return Some((own, Lies::ByRows));
    }
    // As others have it: a stride is the way to the next item.
    let by_items = |strides: &[usize]| (0..last).all(|at| strides[at] >= sizes[at + 1].saturating_mul(strides[at + 1]));
    if by_items(&strides) && strides[last] == 1 {
        return Some((strides, Lies::ByRows));
    }
    let by_columns = |strides: &[usize]| (0..last).all(|at| strides[at + 1] >= sizes[at].saturating_mul(strides[at]));
    if strides[0] == 1 && by_columns(&strides) {
        return Some((strides, Lies::ByColumns));
    }
    let is_whole = |strides: &[usize]| (0..last).all(|at| strides[at + 1] >= sizes[at + 1].saturating_mul(strides[at]));
    if strides[0] >= sizes[0] && is_whole(&strides) {
        let own = std::iter::once(1).chain(strides[..last].iter().copied()).collect();
        return Some((own, Lies::ByColumns));
    }
    None
}

/// The places of an array's values in its data, row by row, for an array of `count` values; and how they lie.
///
/// # Errors
/// Strides do not fit sizes, or the array is longer than the data.
pub fn order(dimensions: &[Dimension], offset: usize, count: usize) -> Result<(Vec<usize>, Lies)> {
    if dimensions.is_empty() {
        return if offset <= count {
            Ok(((offset..count).collect(), Lies::Plainly))
        } else {
            Err(failed!("its layout begins at {offset}, and it has {count} values"))
        };
    }
    let words =
        |of: fn(&Dimension) -> usize| dimensions.iter().map(|one| of(one).to_string()).collect::<Vec<_>>().join(", ");
    let (mut own, mut lies) = steps(dimensions).ok_or_else(|| {
        failed!(
            "its layout has sizes {} and strides {}, which do not go together",
            words(|one| one.size),
            words(|one| one.stride)
        )
    })?;
    let mut sizes: Vec<usize> = dimensions.iter().map(|one| one.size).collect();
    // The dimensions are named in the order of their places: columns before rows.
    let is = |at: usize, names: &[&str]| names.contains(&dimensions[at].label.to_ascii_lowercase().as_str());
    if let [_, _] = dimensions
        && is(0, &["columns", "column", "cols", "col", "width", "x"])
        && is(1, &["rows", "row", "height", "y"])
    {
        own.reverse();
        sizes.reverse();
        lies = if lies == Lies::ByRows { Lies::ByColumns } else { Lies::ByRows };
    }
    let all = sizes.iter().try_fold(1_usize, |all, size| all.checked_mul(*size)).filter(|all| *all <= count);
    let ends = own
        .iter()
        .zip(&sizes)
        .try_fold(offset, |end, (step, size)| end.checked_add(step.checked_mul(size.saturating_sub(1))?));
    let (Some(all), Some(_)) = (all, ends.filter(|end| *end < count)) else {
        return Err(failed!(
            "its layout has {} values from {offset} on, and it has {count}",
            words(|one| one.size).replace(", ", " × ")
        ));
    };
    if all == 0 {
        return Err(Error::failed("its layout has a dimension of no items"));
    }
    let place = |index: usize| {
        let (mut rest, mut at) = (index, offset);
        for (step, size) in own.iter().zip(&sizes).rev() {
            at += step * (rest % size);
            rest /= size;
        }
        at
    };
    Ok(((0..all).map(place).collect(), if sizes.len() > 1 { lies } else { Lies::Plainly }))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn dimensions(all: &[(&str, usize, usize)]) -> Vec<Dimension> {
        all.iter().map(|&(label, size, stride)| Dimension { label: label.to_owned(), size, stride }).collect()
    }

    fn ordered(all: &[(&str, usize, usize)], offset: usize, count: usize) -> (Vec<usize>, Lies) {
        order(&dimensions(all), offset, count).unwrap()
    }

    #[test]
    fn rows_and_columns_come_row_by_row() {
        let rows = [0, 1, 2, 3, 4, 5];
        let columns = [0, 2, 4, 1, 3, 5];
        // As the definition has it, with nothing filled in, and with strides from item to item.
        for strides in [[6, 3], [0, 0], [3, 1]] {
            let own = [("rows", 2, strides[0]), ("columns", 3, strides[1])];
            assert_eq!(ordered(&own, 0, 6), (rows.to_vec(), Lies::ByRows), "{strides:?}");
        }
        for strides in [[1, 2], [2, 6]] {
            let own = [("rows", 2, strides[0]), ("columns", 3, strides[1])];
            assert_eq!(ordered(&own, 0, 6), (columns.to_vec(), Lies::ByColumns), "{strides:?}");
        }
        let named = [("columns", 3, 6), ("rows", 2, 2)];
        assert_eq!(ordered(&named, 0, 6), (columns.to_vec(), Lies::ByColumns));
        // With an offset, and a gap after each row.
        assert_eq!(ordered(&[("rows", 2, 8), ("columns", 3, 4)], 1, 9).0, [1, 2, 3, 5, 6, 7]);
        assert_eq!(ordered(&[("rows", 3, 2), ("columns", 2, 1)], 0, 6).0, rows);
        assert_eq!(ordered(&[], 2, 5), (vec![2, 3, 4], Lies::Plainly));
        assert_eq!(ordered(&[("x", 3, 3)], 1, 4), (vec![1, 2, 3], Lies::Plainly));
        let deep = ordered(&[("a", 2, 12), ("b", 2, 6), ("c", 3, 3)], 0, 12).0;
        assert_eq!(deep, (0..12).collect::<Vec<usize>>());
    }

    #[test]
    fn a_layout_that_does_not_fit_is_refused_in_a_line() {
        for (all, offset, count) in [
            (&[("a", 2, 6), ("b", 3, 3)][..], 0, 5),
            (&[("a", 2, 6), ("b", 3, 3)], 1, 6),
            (&[("a", 2, 5), ("b", 3, 7)], 0, 100),
            (&[("a", 0, 0)], 0, 5),
            (&[], 6, 5),
            (&[("a", usize::MAX, 0), ("b", 2, 0)], 0, 5),
        ] {
            let why = order(&dimensions(all), offset, count).unwrap_err().to_string();
            assert!(why.lines().count() == 1 && why.contains("its layout"), "{why}");
        }
    }
}
