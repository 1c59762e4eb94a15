//! Rules of integration.

use std::f64::consts::PI;

/// Gauss's and Legendre's nodes from 0 to 1, with their weights.
pub(super) fn gauss_legendre(count: u32) -> Vec<(f64, f64)> {
    let n = f64::from(count);
    let node = |k: u32| {
        let mut x = libm::cos(PI * (f64::from(k) + 0.75) / (n + 0.5));
        let mut slope = 1.0;
        // Newton's steps from this start end within four; more do no harm.
        for _ in 0..8 {
            let (mut before, mut value) = (1.0, x);
            for j in 2..=count {
                let j = f64::from(j);
                (before, value) = (value, ((2.0 * j - 1.0) * x * value - (j - 1.0) * before) / j);
            }
            slope = n * (before - x * value) / (1.0 - x * x);
            x -= value / slope;
        }
        ((1.0 - x) / 2.0, 1.0 / ((1.0 - x * x) * slope * slope))
    };
    (0..count).map(node).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gausss_nodes_integrate_polynomials() {
        for count in [2, 3, 8, 35] {
            let nodes = gauss_legendre(count);
            for power in 0..=(2 * count - 1) as i32 {
                let integral: f64 = nodes.iter().map(|&(x, w)| w * x.powi(power)).sum();
                assert!((integral * f64::from(power + 1) - 1.0).abs() < 1e-12, "{count} nodes, x^{power}: {integral}");
            }
            let beyond: f64 = nodes.iter().map(|&(x, w)| w * x.powi(2 * count as i32)).sum();
            assert!(count > 8 || (beyond * f64::from(2 * count + 1) - 1.0).abs() > 1e-12, "one power more is too many");
        }
    }
}
