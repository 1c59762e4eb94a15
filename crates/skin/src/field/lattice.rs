//! Rows and columns of sensors, as matrices are wired.

use std::collections::{BTreeMap, BTreeSet};

use super::set::{Field, FieldSet};

/// A row holds sensors that lie within this share of a spacing across it.
const ACROSS: f64 = 0.25;
/// Rows and columns have at least this many sensors in the mean.
const MIN_PER_LINE: usize = 3;
/// At least this share of the crossings of rows and columns has a sensor.
const MIN_FILLED: f64 = 0.5;

/// Taxels that lie in rows and columns along the axes of a chart.
#[derive(Clone, Debug, PartialEq)]
pub struct Lattice {
    /// Indices into the body's taxels, or whatever they are counted in after [`Lattice::among`].
    pub taxels: Vec<usize>,
    /// The row of each, counted along +v.
    pub rows: Vec<usize>,
    /// The column of each, counted along +u.
    pub columns: Vec<usize>,
}

impl Lattice {
    /// The lattices of `fields`, the largest field first; a taxel is in one at most.
    #[must_use]
    pub fn all(fields: &FieldSet) -> Vec<Self> {
        let mut by_size: Vec<&Field> = fields.fields.iter().filter(|field| field.chart.is_ok()).collect();
        by_size.sort_by_key(|field| std::cmp::Reverse(field.members.len()));
        let mut lattices: Vec<Self> = Vec::new();
        let mut taken = BTreeSet::new();
        for field in by_size {
            if field.members.iter().any(|member| taken.contains(&member.taxel)) {
                continue;
            }
            if let Some(lattice) = Self::from_field(field) {
                taken.extend(lattice.taxels.iter().copied());
                lattices.push(lattice);
            }
        }
        lattices
    }

    /// The same of the `taxels` alone, indices into the body's taxels: by their places among these.
    #[must_use]
    pub fn among(&self, taxels: &[usize]) -> Self {
        let place_of: BTreeMap<usize, usize> =
            taxels.iter().enumerate().map(|(place, &taxel)| (taxel, place)).collect();
        let mut among = Self { taxels: Vec::new(), rows: Vec::new(), columns: Vec::new() };
        for ((taxel, &row), &column) in self.taxels.iter().zip(&self.rows).zip(&self.columns) {
            let Some(&place) = place_of.get(taxel) else { continue };
            among.taxels.push(place);
            among.rows.push(row);
            among.columns.push(column);
        }
        among
    }

    /// How many rows and columns there are.
    #[must_use]
    pub fn size(&self) -> [usize; 2] {
        [&self.rows, &self.columns].map(|lines| lines.iter().max().map_or(0, |last| last + 1))
    }

    /// The members of a field with a chart as a lattice; `None` where they do not lie in rows and columns.
    fn from_field(field: &Field) -> Option<Self> {
        let spacing_m = field.spacing_m();
        let along = |axis: fn(glam::DVec3) -> f64| {
            lines(&field.members.iter().map(|member| axis(member.place)).collect::<Vec<f64>>(), ACROSS * spacing_m)
        };
        let (rows, columns) = (along(|place| place.y)?, along(|place| place.x)?);
        let lattice = Self { taxels: field.members.iter().map(|member| member.taxel).collect(), rows, columns };
        let (count, size) = (field.members.len(), lattice.size());
        let is_lattice = size.iter().all(|&lines| lines > 1 && count >= MIN_PER_LINE * lines)
            && count as f64 >= MIN_FILLED * (size[0] * size[1]) as f64;
        is_lattice.then_some(lattice)
    }
}

/// The line of each coordinate; `None` where a line would be wider than `across_m`.
fn lines(at_m: &[f64], across_m: f64) -> Option<Vec<usize>> {
    let mut order: Vec<usize> = (0..at_m.len()).collect();
    order.sort_by(|&a, &b| at_m[a].total_cmp(&at_m[b]));
    let mut line_of = vec![0; at_m.len()];
    let (mut line, mut first_m) = (0, *at_m.get(*order.first()?)?);
    for pair in order.windows(2) {
        let [before, at] = [pair[0], pair[1]].map(|index| at_m[index]);
        if at - before > across_m {
            (line, first_m) = (line + 1, at);
        } else if at - first_m > across_m {
            return None;
        }
        line_of[pair[1]] = line;
    }
    Some(line_of)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_separated_and_a_slope_has_none() {
        assert_eq!(lines(&[0.0, 1.0, 0.01, 2.0, 0.99], 0.1), Some(vec![0, 1, 0, 2, 1]));
        assert_eq!(lines(&(0..9).map(f64::from).collect::<Vec<_>>(), 1.0), None);
        assert_eq!(lines(&[], 1.0), None);
    }

    #[test]
    fn a_mat_has_rows_and_columns_and_a_scattered_skin_none() {
        let lattice_of = |glb: &[u8]| {
            let body = crate::body::Body::from_bytes("body", glb).unwrap();
            (body.taxels.len(), Lattice::all(&FieldSet::new(&body).unwrap()))
        };
        let (count, mat) = lattice_of(somatic_bodies::MAT);
        assert_eq!(mat.iter().map(|lattice| lattice.taxels.len()).sum::<usize>(), count, "each once");
        // Only every other taxel, the last one first.
        let (whole, some) = (&mat[0], (0..count).rev().step_by(2).collect::<Vec<_>>());
        let among = whole.among(&some);
        assert!(among.taxels.len() * 2 + 2 > whole.taxels.len() && among.taxels.len() < whole.taxels.len());
        for ((place, row), column) in among.taxels.iter().zip(&among.rows).zip(&among.columns) {
            let at = whole.taxels.iter().position(|taxel| *taxel == some[*place]).unwrap();
            assert_eq!((whole.rows[at], whole.columns[at]), (*row, *column));
        }
        let (_, humanoid) = lattice_of(somatic_bodies::HUMANOID);
        assert_eq!(humanoid, []);
    }
}
