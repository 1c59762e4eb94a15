//! Patches and discs by distance along the surface.

use glam::DVec2;

use super::distances::{LinkDistances, TaxelDistance};

/// How often the distance limit is doubled if a taxel is not reached.
const MAX_DOUBLINGS: u32 = 8;

/// Seeds among the taxels of one link, and each taxel's distance to the nearest seed.
struct Seeding {
    seeds: Vec<usize>,
    nearest_m: Vec<f64>,
}

impl Seeding {
    fn new(distances: &LinkDistances) -> Self {
        Self { seeds: Vec::new(), nearest_m: vec![f64::INFINITY; distances.len()] }
    }

    /// The taxel farthest from all seeds, and its distance; the first of equals.
    fn farthest(&self) -> (usize, f64) {
        let all = self.nearest_m.iter().copied().enumerate();
        all.reduce(|best, next| if next.1 > best.1 { next } else { best }).unwrap_or((0, f64::NEG_INFINITY))
    }

    /// Adds the farthest taxel as a seed; on a surface part without seeds, one at its rim.
    ///
    /// The seed is a taxel whose distance is over 0, if any is, and becomes 0: there are never more seeds than taxels.
    fn add(&mut self, distances: &mut LinkDistances) {
        let (mut seed, limit_m) = self.farthest();
        let is_first = limit_m == f64::INFINITY;
        if is_first {
            let from_here = distances.all_from_taxel(seed);
            let reached = from_here.iter().map(|way| way.distance_m).enumerate();
            // Only taxels that no seed reaches: where a way does not lead back, the rim has a seed already.
            let reached = reached.filter(|&(i, m)| m < f64::INFINITY && self.nearest_m[i] == f64::INFINITY);
            seed = reached.reduce(|best, next| if next.1 > best.1 { next } else { best }).map_or(seed, |(i, _)| i);
        }
        let reached = if is_first { distances.all_from_taxel(seed) } else { distances.near_taxel(seed, limit_m) };
        for (nearest, reach) in self.nearest_m.iter_mut().zip(&reached) {
            *nearest = nearest.min(reach.distance_m);
        }
        self.seeds.push(seed);
    }
}

/// Splits all taxels of `links` into `count` compact patches, or more if there are more surface parts: each a list of
/// indices into its link's taxels. A patch is on one link and one connected part.
///
/// Seeds are taken each as far along the surface as possible from those before it (Gonzalez 1985), then moved to the middles
/// of what is nearest to them (Lloyd) until they rest, or `most_rounds` times.
pub(super) fn patches(links: &mut [LinkDistances], count: usize, most_rounds: usize) -> Vec<(usize, Vec<usize>)> {
    let mut seedings: Vec<Seeding> = links.iter().map(Seeding::new).collect();
    let mut taken = 0;
    loop {
        let farthest = seedings.iter().map(|seeding| seeding.farthest().1).enumerate();
        let Some((link, distance)) = farthest.reduce(|best, next| if next.1 > best.1 { next } else { best }) else {
            break;
        };
        // If all taxels are at seeds, further seeds would have no taxels. Before that, each one is another taxel.
        if distance <= 0.0 || (taken >= count && distance < f64::INFINITY) {
            break;
        }
        seedings[link].add(&mut links[link]);
        taken += 1;
    }
    let mut patches = Vec::new();
    for (link, (distances, seeding)) in links.iter_mut().zip(seedings).enumerate() {
        patches.extend(refine(distances, seeding, most_rounds).into_iter().map(|patch| (link, patch)));
    }
    patches
}

/// Lloyd's iteration from `seeding`.
fn refine(distances: &mut LinkDistances, seeding: Seeding, most_rounds: usize) -> Vec<Vec<usize>> {
    let Seeding { mut seeds, nearest_m } = seeding;
    if seeds.len() < 2 {
        return if distances.len() == 0 { Vec::new() } else { vec![(0..distances.len()).collect()] };
    }
    let mut limit_m = nearest_m.iter().copied().fold(0.0, f64::max);
    let mut patches = Vec::new();
    for _ in 0..most_rounds.max(1) {
        let (maps, widest_m);
        (patches, maps, widest_m) = assign(distances, &seeds, limit_m);
        let moved: Vec<usize> = patches
            .iter()
            .zip(&maps)
            .zip(&seeds)
            .map(|((patch, map), &seed)| middle(distances, patch, map, seed))
            .collect();
        if moved == seeds {
            break;
        }
        let shift = moved.iter().zip(&maps).map(|(&to, map)| map[to].distance_m).filter(|d| d.is_finite());
        limit_m = widest_m + shift.fold(0.0, f64::max);
        seeds = moved;
    }
    patches.retain(|patch| !patch.is_empty());
    patches
}

/// Assigns each taxel to the nearest of `seeds`. Returns the patches, the distances from each seed, and the longest one.
///
/// No taxel should be further than `limit_m` from its seed, unless distances are approximate; then the limit is raised.
fn assign(
    distances: &mut LinkDistances,
    seeds: &[usize],
    mut limit_m: f64,
) -> (Vec<Vec<usize>>, Vec<Vec<TaxelDistance>>, f64) {
    let mut raised = 0;
    loop {
        // Another path to the same place may be longer by rounding.
        let maps: Vec<Vec<TaxelDistance>> =
            seeds.iter().map(|&seed| distances.near_taxel(seed, limit_m * (1.0 + 1e-9))).collect();
        let mut patches = vec![Vec::new(); seeds.len()];
        let (mut widest_m, mut out): (f64, bool) = (0.0, false);
        for i in 0..distances.len() {
            let mut own = 0;
            for (k, map) in maps.iter().enumerate() {
                if map[i].distance_m < maps[own][i].distance_m {
                    own = k;
                }
            }
            match maps[own][i].distance_m {
                f64::INFINITY => out = true,
                distance_m => widest_m = widest_m.max(distance_m),
            }
            patches[own].push(i);
        }
        if !out || raised == MAX_DOUBLINGS {
            return (patches, maps, widest_m);
        }
        (limit_m, raised) = (2.0 * limit_m, raised + 1);
    }
}

/// The taxel of `patch` nearest to its mean, in the coordinates of `map` around its seed, or else in space.
fn middle(distances: &LinkDistances, patch: &[usize], map: &[TaxelDistance], seed: usize) -> usize {
    let count = patch.len() as f64;
    let uv: Option<Vec<DVec2>> = patch.iter().map(|&i| map[i].uv).collect();
    let off: Vec<f64> = match uv {
        Some(uv) => {
            let mean = uv.iter().copied().sum::<DVec2>() / count;
            uv.iter().map(|uv| uv.distance_squared(mean)).collect()
        }
        None => {
            let at = |&i: &usize| distances.points[i].0;
            let mean = patch.iter().map(at).sum::<glam::DVec3>() / count;
            patch.iter().map(|i| at(i).distance_squared(mean)).collect()
        }
    };
    let nearest = patch.iter().zip(&off).min_by(|a, b| a.1.total_cmp(b.1).then(a.0.cmp(b.0)));
    nearest.map_or(seed, |(&i, _)| i)
}

/// Seeds spread over the taxels of `distances` so that each taxel is less than `apart_m` from one, and no two are nearer than
/// that to each other.
pub(super) fn spread(distances: &mut LinkDistances, apart_m: f64) -> Vec<usize> {
    let mut seeding = Seeding::new(distances);
    // Each seed is another taxel: see `Seeding::add`.
    while seeding.seeds.len() < distances.len() && seeding.farthest().1 >= apart_m {
        seeding.add(distances);
    }
    seeding.seeds
}
