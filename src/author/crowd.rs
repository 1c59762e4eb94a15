//! Samples that crowd each other: who is near whom, and which of them stay.

use std::collections::binary_heap::PeekMut;
use std::collections::{BTreeMap, BinaryHeap};

use glam::DVec3;
use rayon::prelude::*;

use super::SurfacePoint;
use super::grid::{Grid, Spot};
use super::place::{Placed, Progress};

/// Samples whose neighbours are listed at a time.
const CHUNK: usize = 4096;

/// Neighbours that room is made for at first; five samples for each point kept have 18 on average.
const LIKELY: usize = 20;

/// cos 90°, and room for the rounding of normals: the two faces of a box's edge are neighbours, the two sides of
/// anything sharper are not.
const LEAST_COSINE: f64 = -1e-9;

/// How many times the largest spacing may be the smallest: beyond it, places count as equally thin.
const MOST_LEVELS: i32 = 24;

/// Whether two samples lie on one side of what they are on. Normals that face apart belong to two sides of a part,
/// which are no neighbours however thin it is.
pub(super) fn same_side(a: &Placed, b: &Placed) -> bool {
    face_alike(&a.point, &b.point)
}

/// The same of two points.
pub(super) fn face_alike(a: &SurfacePoint, b: &SurfacePoint) -> bool {
    a.normal.dot(b.normal) > LEAST_COSINE
}

/// Per sample, the samples within the smaller of the two's reaches on the same side, each with a value made of their
/// distance over that reach.
pub(super) struct Crowd<T> {
    chunks: Vec<Vec<(u32, T)>>,
    /// Per sample its chunk, and where in it its list begins and ends.
    lists: Vec<(u32, u32, u32)>,
}

impl<T: Copy + Send> Crowd<T> {
    /// Lists neighbours; `reaches_m` has a value a sample.
    pub(super) fn new(samples: &[Placed], reaches_m: &[f64], value: impl Fn(f64, f64) -> T + Sync) -> Self {
        let positions: Vec<DVec3> = samples.iter().map(|sample| sample.point.position).collect();
        let grids = grids(&positions, reaches_m);
        let order: Vec<u32> = grids.iter().flat_map(|grid| grid.points().iter().map(|spot| spot.1)).collect();
        let listed: Vec<_> = order
            .par_chunks(CHUNK)
            .map(|chunk| {
                let (mut found, mut ends) = (Vec::with_capacity(LIKELY * chunk.len()), Vec::with_capacity(chunk.len()));
                let mut around: Vec<([u64; 3], [&[Spot]; 9])> = vec![([u64::MAX; 3], [&[]; 9]); grids.len()];
                for &i in chunk {
                    let here = &samples[i as usize];
                    let (p, reach) = (here.point.position, reaches_m[i as usize]);
                    let first = found.len();
                    for (grid, (cube, near)) in grids.iter().zip(&mut around) {
                        // Samples come cube by cube, so that what is around one is around the next.
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
                    // The order in which cubes yield must not reach the sums.
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
    pub(super) fn of(&self, sample: usize) -> &[(u32, T)] {
        let (chunk, begin, end) = self.lists[sample];
        &self.chunks[chunk as usize][begin as usize..end as usize]
    }
}

/// The samples in grids by the size of their reach, to the next power of two.
fn grids(positions: &[DVec3], reaches_m: &[f64]) -> Vec<Grid> {
    let least = reaches_m.iter().copied().fold(f64::INFINITY, f64::min);
    let mut levels: BTreeMap<i32, (f64, Vec<u32>)> = BTreeMap::new();
    for (i, &reach) in reaches_m.iter().enumerate() {
        let mut level = 0;
        let mut up_to = least;
        while up_to < reach && level < MOST_LEVELS {
            (level, up_to) = (level + 1, up_to * 2.0);
        }
        let (side, which) = levels.entry(level).or_insert((0.0, Vec::new()));
        *side = side.max(reach);
        which.push(i as u32);
    }
    levels.into_values().map(|(side, which)| Grid::new(positions, which.iter().copied(), side)).collect()
}

/// How crowded a sample is, and after it which it is, in one number: the most crowded is the largest, the first of equals
/// the larger. The weight is rounded to single precision, which no choice worth making hangs on.
fn standing(weight: f64, sample: usize) -> u64 {
    // The bits of floats from 0 up are in the floats' order; the last subtraction may leave a little under 0.
    (u64::from((weight.max(0.0) as f32).to_bits()) << 32) | u64::from(!(sample as u32))
}

/// The indices, rising, of the `count` samples that are left when the most crowded have gone one by one.
pub(super) fn thin_out(crowd: &Crowd<f64>, samples: usize, count: usize, progress: Progress<'_>) -> Vec<usize> {
    let mut weights: Vec<f64> = (0..samples).map(|i| crowd.of(i).iter().map(|(_, w)| w).sum()).collect();
    let mut alive = vec![true; samples];
    let mut heap: BinaryHeap<u64> = weights.iter().enumerate().map(|(i, &weight)| standing(weight, i)).collect();
    let mut left = samples;
    while left > count {
        let Some(mut top) = heap.peek_mut() else { break };
        let sample = !(*top as u32) as usize;
        // Weights only fall, so an entry that is out of date stands too high and comes up in time to be put right.
        let now = standing(weights[sample], sample);
        if *top > now {
            *top = now;
            continue;
        }
        PeekMut::pop(top);
        alive[sample] = false;
        left -= 1;
        if left.is_multiple_of(CHUNK) {
            progress((samples - left) as f64 / (samples - count) as f64);
        }
        for &(j, weight) in crowd.of(sample) {
            weights[j as usize] -= weight;
        }
    }
    (0..samples).filter(|&i| alive[i]).collect()
}

/// The indices, rising, of as many samples as fit with no two of them neighbours: always the one next that leaves the
/// fewest others without room, so that a front of close neighbours grows over the surface.
pub(super) fn pack<T: Copy + Send>(crowd: &Crowd<T>, samples: usize, progress: Progress<'_>) -> Vec<usize> {
    let mut free: Vec<usize> = (0..samples).map(|i| crowd.of(i).len()).collect();
    let mut open = vec![true; samples];
    // By how many are free around them; an entry that is out of date has another in a lower bucket.
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
            progress(settled as f64 / samples as f64);
        }
        for &(gone, _) in crowd.of(sample) {
            if !std::mem::replace(&mut open[gone as usize], false) {
                continue;
            }
            settled += 1;
            for &(near, _) in crowd.of(gone as usize) {
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
    kept
}
