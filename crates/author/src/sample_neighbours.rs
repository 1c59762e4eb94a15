//! Neighbour lists of samples, and the elimination of samples by them.

use std::collections::binary_heap::PeekMut;
use std::collections::{BTreeMap, BinaryHeap};

use glam::DVec3;
use rayon::prelude::*;

use super::grid::{Grid, GridPoint};
use super::placed::{Placed, Progress, report_progress, same_side};
use crate::error::Result;

/// Samples per unit of parallel work.
const CHUNK: usize = 4096;

/// Initial capacity for neighbours of a sample; with five samples per point there are 18 on average.
const EXPECTED_NEIGHBOURS: usize = 20;

/// Maximum number of grids, each with twice the cell size of the one before.
const MAX_GRID_LEVELS: i32 = 24;

/// Per sample its neighbours: samples on the same side within the smaller of both reaches, with a value computed from
/// distance and reach.
pub(super) struct SampleNeighbours<T> {
    chunks: Vec<Vec<(u32, T)>>,
    /// Per sample its chunk, and the start and end of its list there.
    lists: Vec<(u32, u32, u32)>,
}

impl<T: Copy + Send> SampleNeighbours<T> {
    /// Lists the neighbours; `reaches_m` has one value per sample.
    pub(super) fn new(samples: &[Placed], reaches_m: &[f64], value: impl Fn(f64, f64) -> T + Sync) -> Self {
        let positions: Vec<DVec3> = samples.iter().map(|sample| sample.point.position).collect();
        let grids = grids(&positions, reaches_m);
        let order: Vec<u32> = grids.iter().flat_map(|grid| grid.points().iter().map(|spot| spot.1)).collect();
        let listed: Vec<_> = order
            .par_chunks(CHUNK)
            .map(|chunk| {
                let (mut found, mut ends) =
                    (Vec::with_capacity(EXPECTED_NEIGHBOURS * chunk.len()), Vec::with_capacity(chunk.len()));
                let mut around: Vec<([u64; 3], [&[GridPoint]; 9])> = vec![([u64::MAX; 3], [&[]; 9]); grids.len()];
                for &i in chunk {
                    let here = &samples[i as usize];
                    let (p, reach) = (here.point.position, reaches_m[i as usize]);
                    let first = found.len();
                    for (grid, (cube, near)) in grids.iter().zip(&mut around) {
                        // Consecutive samples often share a cube, and so its surroundings.
                        let own = grid.cube(p);
                        if own != *cube {
                            (*cube, *near) = (own, grid.around(own));
                        }
                        for &(spot, j) in near.iter().copied().flatten() {
                            let squared = p.distance_squared(spot);
                            if squared > reach * reach || j == i || !same_side(here, &samples[j as usize]) {
                                continue;
                            }
                            let reach = reach.min(reaches_m[j as usize]);
                            if squared <= reach * reach {
                                found.push((j, value(squared.sqrt(), reach)));
                            }
                        }
                    }
                    // Sums must not depend on the order of cubes.
                    found[first..].sort_unstable_by_key(|&(j, _)| j);
                    ends.push((i, first as u32, found.len() as u32));
                }
                (found, ends)
            })
            .collect();
        let mut crowd = Self { chunks: Vec::with_capacity(listed.len()), lists: vec![(0, 0, 0); samples.len()] };
        for (index, (found, ends)) in listed.into_iter().enumerate() {
            for (sample, begin, end) in ends {
                crowd.lists[sample as usize] = (index as u32, begin, end);
            }
            crowd.chunks.push(found);
        }
        crowd
    }

    /// The neighbours of `sample`, by rising index.
    pub(super) fn neighbours(&self, sample: usize) -> &[(u32, T)] {
        let (chunk, begin, end) = self.lists[sample];
        &self.chunks[chunk as usize][begin as usize..end as usize]
    }
}

/// Grids of the samples by reach, rounded up to powers of two.
fn grids(positions: &[DVec3], reaches_m: &[f64]) -> Vec<Grid> {
    let least = reaches_m.iter().copied().fold(f64::INFINITY, f64::min);
    let mut levels: BTreeMap<i32, (f64, Vec<u32>)> = BTreeMap::new();
    for (i, &reach) in reaches_m.iter().enumerate() {
        let mut level = 0;
        let mut up_to = least;
        while up_to < reach && level < MAX_GRID_LEVELS {
            (level, up_to) = (level + 1, up_to * 2.0);
        }
        let (side, which) = levels.entry(level).or_insert((0.0, Vec::new()));
        *side = side.max(reach);
        which.push(i as u32);
    }
    levels.into_values().map(|(side, which)| Grid::new(positions, which.iter().copied(), side)).collect()
}

/// Weight (in single precision) and index of a sample in one sortable number; of equal weights the first index is larger.
fn priority(weight: f64, sample: usize) -> u64 {
    // Non-negative floats sort like their bits; rounding may leave a weight slightly below 0.
    (u64::from((weight.max(0.0) as f32).to_bits()) << 32) | u64::from(!(sample as u32))
}

/// Eliminates the most crowded samples one by one. Returns the ascending indices of the `count` that remain.
pub(super) fn eliminate_crowded(
    crowd: &SampleNeighbours<f64>,
    samples: usize,
    count: usize,
    progress: Progress<'_>,
) -> Result<Vec<usize>> {
    let mut weights: Vec<f64> = (0..samples).map(|i| crowd.neighbours(i).iter().map(|(_, w)| w).sum()).collect();
    let mut alive = vec![true; samples];
    let mut heap: BinaryHeap<u64> = weights.iter().enumerate().map(|(i, &weight)| priority(weight, i)).collect();
    let mut left = samples;
    while left > count {
        let Some(mut top) = heap.peek_mut() else { break };
        let sample = !(*top as u32) as usize;
        // Weights only fall, so an outdated entry comes up early and is corrected.
        let now = priority(weights[sample], sample);
        if *top > now {
            *top = now;
            continue;
        }
        PeekMut::pop(top);
        alive[sample] = false;
        left -= 1;
        if left.is_multiple_of(CHUNK) {
            report_progress(progress, (samples - left) as f64 / (samples - count) as f64)?;
        }
        for &(j, weight) in crowd.neighbours(sample) {
            weights[j as usize] -= weight;
        }
    }
    Ok((0..samples).filter(|&i| alive[i]).collect())
}

/// Selects samples that are not neighbours of each other, always the one that blocks the fewest others. Returns ascending indices.
pub(super) fn pack<T: Copy + Send>(
    crowd: &SampleNeighbours<T>,
    samples: usize,
    progress: Progress<'_>,
) -> Result<Vec<usize>> {
    let mut free: Vec<usize> = (0..samples).map(|i| crowd.neighbours(i).len()).collect();
    let mut open = vec![true; samples];
    // By the number of free neighbours; an outdated entry has a newer one in a lower bucket.
    let mut buckets: Vec<Vec<u32>> = vec![Vec::new(); free.iter().max().map_or(0, |most| most + 1)];
    for (i, &free) in free.iter().enumerate().rev() {
        buckets[free].push(i as u32);
    }
    let mut kept = Vec::new();
    let (mut lowest, mut settled) = (0, 0_usize);
    while lowest < buckets.len() {
        let Some(sample) = buckets[lowest].pop() else {
            lowest += 1;
            continue;
        };
        let sample = sample as usize;
        if !open[sample] || free[sample] != lowest {
            continue;
        }
        open[sample] = false;
        kept.push(sample);
        settled += 1;
        if kept.len().is_multiple_of(CHUNK) {
            report_progress(progress, settled as f64 / samples as f64)?;
        }
        for &(gone, _) in crowd.neighbours(sample) {
            if !std::mem::replace(&mut open[gone as usize], false) {
                continue;
            }
            settled += 1;
            for &(near, _) in crowd.neighbours(gone as usize) {
                let near = near as usize;
                if open[near] {
                    free[near] -= 1;
                    buckets[free[near]].push(near as u32);
                    lowest = lowest.min(free[near]);
                }
            }
        }
    }
    kept.sort_unstable();
    Ok(kept)
}
