//! Levenberg and Marquardt's descent, for a fixed number of steps.

use super::kinds::Kind;
use super::objective::{Objective, Sensor};
use super::real::Real;
use super::shape::Shape;

/// How many steps a whole descent tries.
pub(crate) const STEPS: usize = 6;
/// The damping of the first step, and by how much it falls after a step that helps and rises after one that does not.
const DAMPING: f64 = 0.01;
const DAMPING_CHANGES: f64 = 10.0;
/// Nothing on A's diagonal counts as less: what no sensor tells of stays where it is.
const LEAST: f64 = 1e-12;

/// Where a descent ended.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Fitted<R, const K: usize> {
    pub(crate) shape: Shape<R>,
    /// χ² and the prior.
    pub(crate) cost: R,
    pub(crate) chi_squared: R,
    /// How much cost a full step would still take away, to first order.
    pub(crate) ahead: R,
    /// (JᵀJ)⁻¹ there, its lower half.
    pub(crate) covariance: [[R; K]; K],
}

/// Descends from `start` for kind M in `steps` steps.
#[inline(always)]
pub(crate) fn descend<R: Real, M: Kind<K>, const K: usize>(
    sensors: &[Sensor<R>],
    gain_variance: R,
    start: Shape<R>,
    steps: usize,
) -> Fitted<R, K> {
    let zero = start.force.all(0.0);
    let (mut shape, mut now, mut damping) = (start, Objective::none(zero), zero.all(DAMPING));
    // The objective stands in the code once: it is long, and there are eight of it side by side.
    for step in 0..=steps {
        let tried = if step == 0 { start } else { shape.moved(M::FREE, Factor::new(&now.a, damping).solve(now.g)) };
        let then = Objective::at::<M>(sensors, gain_variance, &tried);
        if step == 0 {
            now = then;
            continue;
        }
        let better = then.cost.is_below(now.cost);
        shape = Shape::choose(better, &tried, &shape);
        now = Objective::choose(better, &then, &now);
        damping = R::choose(better, damping * (1.0 / DAMPING_CHANGES), damping * DAMPING_CHANGES);
    }
    let factor = Factor::new(&now.a, damping.all(0.0));
    let step = factor.solve(now.g);
    let mut ahead = -(step[0] * now.g[0]);
    for k in 1..K {
        ahead = ahead - step[k] * now.g[k];
    }
    Fitted { shape, cost: now.cost, chi_squared: now.chi_squared, ahead, covariance: factor.inverse() }
}

/// Cholesky's lower factor of A + damping · diag A, with the inverses of its diagonal there.
struct Factor<R, const K: usize>([[R; K]; K]);

impl<R: Real, const K: usize> Factor<R, K> {
    #[inline(always)]
    fn new(a: &[[R; K]; K], damping: R) -> Self {
        let mut l = *a;
        for i in 0..K {
            for j in 0..i {
                let mut rest = a[i][j];
                for k in 0..j {
                    rest = rest - l[i][k] * l[j][k];
                }
                l[i][j] = rest * l[j][j];
            }
            let mut rest = a[i][i] * (damping + 1.0);
            for k in 0..i {
                rest = rest - l[i][k] * l[i][k];
            }
            l[i][i] = rest.all(1.0) / rest.at_least(LEAST).sqrt();
        }
        Self(l)
    }

    /// −A⁻¹g.
    #[inline(always)]
    fn solve(&self, g: [R; K]) -> [R; K] {
        let (l, mut x) = (&self.0, g);
        for i in 0..K {
            let mut rest = -g[i];
            for k in 0..i {
                rest = rest - l[i][k] * x[k];
            }
            x[i] = rest * l[i][i];
        }
        for i in (0..K).rev() {
            for k in i + 1..K {
                x[i] = x[i] - l[k][i] * x[k];
            }
            x[i] = x[i] * l[i][i];
        }
        x
    }

    /// A⁻¹, its lower half.
    #[inline(always)]
    fn inverse(&self) -> [[R; K]; K] {
        let mut l = self.0;
        // First the factor's own inverse, in its place.
        for i in 0..K {
            for j in 0..i {
                let mut sum = l[i][j] * l[j][j];
                for k in j + 1..i {
                    sum = sum + l[i][k] * l[k][j];
                }
                l[i][j] = -(sum * l[i][i]);
            }
        }
        let mut inverse = l;
        for i in 0..K {
            for j in 0..=i {
                let mut sum = l[i][i] * l[i][j];
                for k in i + 1..K {
                    sum = sum + l[k][i] * l[k][j];
                }
                inverse[i][j] = sum;
            }
        }
        inverse
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_factor_solves_and_inverts() {
        let a = [[4.0, 0.0, 0.0], [1.0, 5.0, 0.0], [-2.0, 0.5, 6.0]];
        let whole = |i: usize, j: usize| if i < j { a[j][i] } else { a[i][j] };
        let factor = Factor::new(&a, 0.0);
        let x = factor.solve([1.0, -2.0, 0.5]);
        let inverse = factor.inverse();
        for i in 0..3 {
            let g: f64 = -(0..3).map(|k| whole(i, k) * x[k]).sum::<f64>();
            assert!((g - [1.0, -2.0, 0.5][i]).abs() < 1e-14, "{g}");
            for j in 0..3 {
                let product: f64 =
                    (0..3).map(|k| whole(i, k) * if k < j { inverse[j][k] } else { inverse[k][j] }).sum();
                assert!((product - if i == j { 1.0 } else { 0.0 }).abs() < 1e-14, "{i} {j}: {product}");
            }
        }
    }
}
