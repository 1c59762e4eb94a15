//! What sensors feel in place of the force on them: hysteresis of their material, crosstalk of their wires.

use crate::field::Lattice;

/// The rows and columns of a simulation's taxels.
#[derive(Clone, Debug)]
pub(super) struct Wires {
    /// The line of each taxel in the order of the source, rows before columns, of all lattices; `None` outside of lattices.
    lines_of: Vec<Option<[usize; 2]>>,
    /// The force on each line, N.
    on_line_newton: Vec<f64>,
}

impl Wires {
    /// The wires of `taxels`, indices into the body's taxels; `None` where none lies in rows and columns.
    pub(super) fn new(lattices: &[Lattice], taxels: &[usize]) -> Option<Self> {
        let mut lines_of = vec![None; taxels.len()];
        let mut first = 0;
        for lattice in lattices {
            let [rows, columns] = lattice.size();
            let among = lattice.among(taxels);
            for ((&index, row), column) in among.taxels.iter().zip(&among.rows).zip(&among.columns) {
                lines_of[index] = Some([first + row, first + rows + column]);
            }
            first += rows + columns;
        }
        (first > 0).then(|| Self { lines_of, on_line_newton: vec![0.0; first] })
    }
}

/// The state of sensors that do not feel just the force on them.
#[derive(Clone, Debug)]
pub(super) struct Disturbed {
    /// The share of a force that all other taxels of its row and of its column feel too.
    crosstalk: f64,
    wires: Option<Wires>,
    /// By what share a sensor feels more while its force falls than while it rises.
    hysteresis: f64,
    /// What each sensor's material feels, N.
    held_newton: Vec<f64>,
    felt_newton: Vec<f64>,
}

impl Disturbed {
    /// `wires` is what crosstalk goes along.
    pub(super) fn new(taxels: usize, crosstalk: f64, wires: Option<Wires>, hysteresis: f64) -> Self {
        Self { crosstalk, wires, hysteresis, held_newton: vec![0.0; taxels], felt_newton: vec![0.0; taxels] }
    }

    /// Forgets which forces there were.
    pub(super) fn rest(&mut self) {
        self.held_newton.fill(0.0);
    }

    /// What the sensors feel of these forces, N.
    pub(super) fn felt<'a>(&'a mut self, forces_newton: &'a [f64]) -> &'a [f64] {
        if self.hysteresis == 0.0 && self.wires.is_none() {
            return forces_newton;
        }
        // A play whose width is a share of the force: it follows a rising force from below, a falling one from above.
        let half = self.hysteresis / 2.0;
        for (held, &force) in self.held_newton.iter_mut().zip(forces_newton) {
            *held = held.clamp((1.0 - half) * force, (1.0 + half) * force);
        }
        self.felt_newton.copy_from_slice(&self.held_newton);
        let Some(Wires { lines_of, on_line_newton }) = &mut self.wires else { return &self.felt_newton };
        on_line_newton.fill(0.0);
        for (lines, held) in lines_of.iter().zip(&self.held_newton) {
            lines.iter().flatten().for_each(|&line| on_line_newton[line] += held);
        }
        for ((lines, held), felt) in lines_of.iter().zip(&self.held_newton).zip(&mut self.felt_newton) {
            let others: f64 = lines.iter().flatten().map(|&line| on_line_newton[line] - held).sum();
            *felt += self.crosstalk * others;
        }
        &self.felt_newton
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_falling_force_is_felt_as_more_than_a_rising_one() {
        let mut sensor = Disturbed::new(1, 0.0, None, 0.08);
        let felt = [1.0, 10.0, 9.9, 5.0, 5.2, 0.0].map(|force| sensor.felt(&[force])[0]);
        let right = [0.96, 9.6, 9.6, 5.2, 5.2, 0.0];
        assert!(felt.iter().zip(right).all(|(felt, right)| (felt - right).abs() < 1e-12), "{felt:?}");
        sensor.felt(&[4.0]);
        sensor.rest();
        assert_eq!(sensor.felt(&[0.0]), [0.0]);
    }

    #[test]
    fn a_press_leaks_along_its_row_and_its_column() {
        // Two rows of three, and one taxel without wires.
        let lattice =
            Lattice { taxels: vec![0, 1, 2, 3, 4, 5], rows: vec![0, 0, 0, 1, 1, 1], columns: vec![0, 1, 2, 0, 1, 2] };
        let wires = Wires::new(&[lattice], &[0, 1, 2, 3, 4, 5, 6]);
        let mut sensors = Disturbed::new(7, 0.01, wires, 0.0);
        let felt = sensors.felt(&[0.0, 10.0, 0.0, 0.0, 0.0, 2.0, 8.0]);
        let right = [0.1, 10.0, 0.12, 0.02, 0.12, 2.0, 8.0];
        assert!(felt.iter().zip(right).all(|(felt, right)| (felt - right).abs() < 1e-12), "{felt:?}");
        assert!(Wires::new(&[], &[0, 1]).is_none());
    }
}
