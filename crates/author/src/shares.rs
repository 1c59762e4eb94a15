//! How many taxels each link gets, and each connected piece of it: in proportion to the surface that may get any.

use std::collections::BTreeMap;

use glam::DVec3;

use super::ground::Ground;
use super::place::{eliminate, widest_radius};
use super::placed::{Placed, Progress};
use super::scatter::Pieces;
use crate::body::{NONE, Topology, area_vector};
use crate::error::Result;

/// A piece with less surface than this share of a cell gets no taxel.
const LEAST_CELL: f64 = 0.5;

/// Samples per taxel, as for all blue noise.
const OVERSAMPLING: usize = 5;

/// The most samples of a piece per taxel. Only samples on open surface count.
const MAX_OVERSAMPLING: f64 = 100.0;

/// A connected piece of a link's surface.
pub(super) struct LinkPiece {
    pub(super) link: usize,
    /// Ascending.
    triangles: Vec<u32>,
    /// Its surface, m².
    area_m2: f64,
    /// What of it may get taxels, m².
    pub(super) open_m2: f64,
    /// How many taxels it gets.
    pub(super) count: usize,
}

/// The pieces of `triangles` by link, with their shares of `count` taxels; `link_of` has the link of each triangle.
pub(super) fn shares(
    positions: &[DVec3],
    triangles: &[[u32; 3]],
    topology: &Topology,
    link_of: impl Fn(usize) -> usize,
    ground: &Ground<'_>,
    count: usize,
) -> Vec<LinkPiece> {
    let (mut pieces, piece_of) = pieces(positions, triangles, topology, link_of);
    if !ground.is_all() {
        pieces.iter_mut().for_each(|piece| piece.open_m2 = 0.0);
        for sample in ground.open() {
            if let Some(piece) = pieces.get_mut(piece_of[sample.triangle] as usize) {
                piece.open_m2 += ground.each_m2();
            }
        }
        pieces.iter_mut().for_each(|piece| piece.open_m2 = piece.open_m2.min(piece.area_m2));
    }
    let mut by_link: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    pieces.iter().enumerate().for_each(|(index, piece)| by_link.entry(piece.link).or_default().push(index));
    let open_of = |own: &[usize]| own.iter().map(|&piece| pieces[piece].open_m2).sum::<f64>();
    let open: Vec<f64> = by_link.values().map(|own| open_of(own)).collect();
    let cell_m2 = open.iter().sum::<f64>() / count as f64;
    let shares = largest_remainders(&open, count);
    for (own, share) in by_link.values().zip(shares) {
        let areas: Vec<f64> = own.iter().map(|&piece| pieces[piece].open_m2).collect();
        for (&piece, count) in own.iter().zip(within_link(&areas, share, cell_m2)) {
            pieces[piece].count = count;
        }
    }
    pieces
}

/// `count` shared among pieces of a link. Those that are large enough get all, as long as they are for that many; else the next do.
fn within_link(areas_m2: &[f64], count: usize, cell_m2: f64) -> Vec<usize> {
    let large: Vec<f64> = areas_m2.iter().map(|&area| if area >= LEAST_CELL * cell_m2 { area } else { 0.0 }).collect();
    let most: usize = large.iter().map(|area| (area / cell_m2).ceil() as usize).sum();
    let mut counts = largest_remainders(&large, count.min(most));
    let mut left = count - counts.iter().sum::<usize>();
    if left > 0 {
        let mut small: Vec<usize> = (0..areas_m2.len()).filter(|&piece| counts[piece] == 0).collect();
        small.sort_by(|&a, &b| areas_m2[b].total_cmp(&areas_m2[a]).then(a.cmp(&b)));
        for piece in small.into_iter().take(left) {
            counts[piece] = 1;
            left -= 1;
        }
    }
    // More than there are pieces: rounding alone.
    largest_remainders(areas_m2, left).into_iter().zip(&mut counts).for_each(|(more, count)| *count += more);
    counts
}

/// `count` in proportion to `areas`: whole parts first, then one each for the largest remainders.
fn largest_remainders(areas: &[f64], count: usize) -> Vec<usize> {
    let whole: f64 = areas.iter().sum();
    if whole <= 0.0 || !whole.is_finite() || count == 0 {
        return vec![0; areas.len()];
    }
    let exact = |area: &f64| area / whole * count as f64;
    let mut counts: Vec<usize> = areas.iter().map(|area| exact(area).floor() as usize).collect();
    let mut order: Vec<usize> = (0..areas.len()).filter(|&index| areas[index] > 0.0).collect();
    let remainder = |index: usize| exact(&areas[index]) - exact(&areas[index]).floor();
    order.sort_by(|&a, &b| remainder(b).total_cmp(&remainder(a)).then(a.cmp(&b)));
    let left = count.saturating_sub(counts.iter().sum());
    order.iter().cycle().take(left).for_each(|&index| counts[index] += 1);
    counts
}

/// The connected pieces of each link, by link, all of them open; and per triangle its piece, or [`NONE`].
fn pieces(
    positions: &[DVec3],
    triangles: &[[u32; 3]],
    topology: &Topology,
    link_of: impl Fn(usize) -> usize,
) -> (Vec<LinkPiece>, Vec<u32>) {
    let link = |triangle: u32| link_of(topology.given[triangle as usize] as usize);
    let count = topology.triangles.len() as u32;
    let mut piece_of = vec![NONE; triangles.len()];
    let mut is_seen = vec![false; count as usize];
    let mut pieces: Vec<LinkPiece> = Vec::new();
    for start in 0..count {
        if std::mem::replace(&mut is_seen[start as usize], true) {
            continue;
        }
        let own = link(start);
        let (mut members, mut open) = (Vec::new(), vec![start]);
        while let Some(triangle) = open.pop() {
            members.push(topology.given[triangle as usize]);
            for edge in 3 * triangle..3 * triangle + 3 {
                let beyond = topology.across[edge as usize];
                if beyond != NONE && !is_seen[beyond as usize / 3] && link(beyond / 3) == own {
                    is_seen[beyond as usize / 3] = true;
                    open.push(beyond / 3);
                }
            }
        }
        members.sort_unstable();
        let area =
            |&triangle: &u32| area_vector(triangles[triangle as usize].map(|v| positions[v as usize])).length() / 2.0;
        let area_m2 = members.iter().map(area).sum();
        pieces.push(LinkPiece { link: own, triangles: members, area_m2, open_m2: area_m2, count: 0 });
    }
    pieces.sort_by_key(|piece| (piece.link, piece.triangles[0]));
    for (index, piece) in (0..).zip(&pieces) {
        piece.triangles.iter().for_each(|&triangle| piece_of[triangle as usize] = index);
    }
    (pieces, piece_of)
}

/// Scatters over `pieces` as many points as each gets, on open surface as far as `ground` knows.
pub(super) fn scatter(
    positions: &[DVec3],
    triangles: &[[u32; 3]],
    pieces: &[LinkPiece],
    ground: &Ground<'_>,
    seed: u64,
    progress: Progress<'_>,
) -> Result<Vec<Placed>> {
    let count: usize = pieces.iter().map(|piece| piece.count).sum();
    let mut found = Vec::with_capacity(count);
    for (index, piece) in pieces.iter().enumerate().filter(|(_, piece)| piece.count > 0) {
        let own: Vec<[u32; 3]> = piece.triangles.iter().map(|&triangle| triangles[triangle as usize]).collect();
        let surface = Pieces::whole(positions, &own)?;
        let more =
            (piece.area_m2 / piece.open_m2.max(f64::MIN_POSITIVE)).clamp(1.0, MAX_OVERSAMPLING / OVERSAMPLING as f64);
        let many = ((OVERSAMPLING * piece.count) as f64 * more).ceil() as usize;
        let seed = seed.wrapping_add((index as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15));
        let (mut samples, closed): (Vec<Placed>, Vec<Placed>) = surface
            .scatter(many, seed)
            .into_iter()
            .partition(|one| ground.is_all() || ground.is_open(one.point.position, one.point.normal));
        // Too few are open where an open spot is small: others are moved there later.
        let missing = piece.count.saturating_sub(samples.len());
        samples.extend(closed.into_iter().take(missing));
        let reaches_m = vec![2.0 * widest_radius(piece.open_m2, piece.count); samples.len()];
        let done = found.len() as f64 / count as f64;
        let share = piece.count as f64 / count as f64;
        let kept = eliminate(&samples, &reaches_m, piece.count, &mut |part| progress(done + share * part))?;
        found.extend(kept.into_iter().map(|one| Placed { triangle: piece.triangles[one.triangle] as usize, ..one }));
    }
    found.sort_by_key(|one| one.triangle);
    Ok(found)
}

/// Per link with open pieces that get no taxel: how many these are, and their open area, m².
pub(super) fn left_out(pieces: &[LinkPiece]) -> BTreeMap<usize, (usize, f64)> {
    let mut left = BTreeMap::new();
    for piece in pieces.iter().filter(|piece| piece.count == 0 && piece.open_m2 > 0.0) {
        let (count, area_m2) = left.entry(piece.link).or_insert((0, 0.0));
        *count += 1;
        *area_m2 += piece.open_m2;
    }
    left
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_are_exact_in_number_and_near_in_proportion() {
        assert_eq!(largest_remainders(&[1.0, 1.0, 1.0], 10), [4, 3, 3]);
        assert_eq!(largest_remainders(&[0.0, 5.0, 2.6, 2.4], 4), [0, 2, 1, 1]);
        assert_eq!(largest_remainders(&[0.0, 0.0], 4), [0, 0]);
        for count in [1, 7, 100, 1001] {
            let areas: Vec<f64> = (1..40).map(|i| f64::from(i * i % 17)).collect();
            let shares = largest_remainders(&areas, count);
            assert_eq!(shares.iter().sum::<usize>(), count);
            let whole: f64 = areas.iter().sum();
            for (area, share) in areas.iter().zip(shares) {
                assert!((area / whole * count as f64 - share as f64).abs() < 1.0);
            }
        }
    }

    #[test]
    fn small_pieces_get_taxels_only_where_large_ones_are_full() {
        // A cell is 1: the piece of 0.4 gets none, its surface counts for the others.
        assert_eq!(within_link(&[3.0, 0.4, 1.6], 5, 1.0), [3, 0, 2]);
        // Crumbs alone, worth two taxels: the largest two have one each.
        assert_eq!(within_link(&[0.3, 0.45, 0.2, 0.4, 0.45, 0.2], 2, 1.0), [0, 1, 0, 0, 1, 0]);
        assert_eq!(within_link(&[1.0], 3, 1.0), [3]);
        assert_eq!(within_link(&[], 0, 1.0), Vec::<usize>::new());
    }
}
