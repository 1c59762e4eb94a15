//! Points sorted into cubes, for neighbour searches.
//!
//! Cubes are numbered along x, then y, then z. Three adjacent cubes along x are one range of the sorted points, so that the
//! 27 cubes around a place are nine ranges.

use glam::DVec3;

/// Bits of each coordinate in a cube's number.
const BITS: u32 = 21;

/// Points in cubes of one size.
pub(super) struct Grid {
    low: DVec3,
    cubes_per_m: f64,
    /// Ascending numbers of the occupied cubes, each with the start of its points.
    cubes: Vec<(u64, u32)>,
    /// The points with their indices, cube by cube, ascending within each.
    points: Vec<GridPoint>,
}

/// A point and its index.
pub(super) type GridPoint = (DVec3, u32);

impl Grid {
    /// The points `which` of `positions` in cubes of `side_m`, or larger ones if there would be too many.
    pub(super) fn new(positions: &[DVec3], which: impl Iterator<Item = u32> + Clone, side_m: f64) -> Self {
        let at = |i: u32| positions[i as usize];
        let (low, high) = which
            .clone()
            .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), i| (low.min(at(i)), high.max(at(i))));
        // A margin of one cube, so that all neighbours of a cube have a number.
        let max_cubes = f64::from((1_u32 << BITS) - 4);
        let extent = (high - low).max_element().max(0.0);
        let cubes_per_m = 1.0 / side_m.max(extent / max_cubes).max(f64::MIN_POSITIVE);
        let mut grid = Self { low, cubes_per_m, cubes: Vec::new(), points: Vec::new() };
        let mut sorted: Vec<(u64, u32)> = which.map(|i| (number(grid.cube(at(i))), i)).collect();
        sorted.sort_unstable();
        for (place, &(cube, point)) in sorted.iter().enumerate() {
            if grid.cubes.last().is_none_or(|&(last, _)| last != cube) {
                grid.cubes.push((cube, place as u32));
            }
            grid.points.push((at(point), point));
        }
        grid
    }

    /// All points, those of a cube together.
    pub(super) fn points(&self) -> &[GridPoint] {
        &self.points
    }

    /// The cube that `p` is in, from 1 up in each direction.
    pub(super) fn cube(&self, p: DVec3) -> [u64; 3] {
        ((p - self.low) * self.cubes_per_m).to_array().map(|steps| steps as u64 + 1)
    }

    /// The points in `cube` and the 26 around it, as nine ranges.
    pub(super) fn around(&self, cube: [u64; 3]) -> [&[GridPoint]; 9] {
        let [x, y, z] = cube;
        std::array::from_fn(|row| {
            let (dy, dz) = (row as u64 % 3, row as u64 / 3);
            let first = number([x - 1, y + dy - 1, z + dz - 1]);
            let begin = self.cubes.partition_point(|&(cube, _)| cube < first);
            let within = self.cubes[begin..].iter().take_while(|&&(cube, _)| cube <= first + 2).count();
            let start = |index: usize| self.cubes.get(index).map_or(self.points.len(), |&(_, start)| start as usize);
            &self.points[start(begin)..start(begin + within)]
        })
    }
}

/// A cube's number; cubes beyond the grid get one without points.
fn number(cube: [u64; 3]) -> u64 {
    let [x, y, z] = cube.map(|c| c.min((1 << BITS) - 1));
    (z << (2 * BITS)) | (y << BITS) | x
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    #[test]
    fn every_point_within_a_side_is_around() {
        let mut random = Random::new(3);
        let positions: Vec<DVec3> = (0..800)
            .map(|_| DVec3::new(random.unit(), random.unit() * 0.1, random.unit() * 3.0) + DVec3::splat(-7.0))
            .collect();
        for side in [0.03, 0.2, 10.0] {
            let grid = Grid::new(&positions, 0..800, side);
            assert_eq!(grid.points().len(), 800);
            for &p in &positions {
                let mut around: Vec<u32> = grid.around(grid.cube(p)).concat().iter().map(|spot| spot.1).collect();
                around.sort_unstable();
                assert!(around.windows(2).all(|pair| pair[0] < pair[1]));
                let near = (0..800).filter(|&i| positions[i as usize].distance(p) <= side);
                assert!(near.into_iter().all(|i| around.binary_search(&i).is_ok()));
            }
        }
    }

    #[test]
    fn cubes_grow_where_there_would_be_too_many() {
        let positions = [DVec3::ZERO, DVec3::X * 1e6, DVec3::X * 1e6 + DVec3::Y * 1e-9];
        let grid = Grid::new(&positions, 0..3, 1e-9);
        let around = grid.around(grid.cube(positions[1])).concat();
        assert_eq!(around.iter().map(|spot| spot.1).collect::<Vec<_>>(), [1, 2]);
    }
}
