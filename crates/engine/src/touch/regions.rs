//! The regions of a frame: connected pressed taxels, divided at saddles.
//!
//! Taxels are swept by falling P, of equal ones the lower node first. One without a swept neighbour is the peak of a new region;
//! another joins the region of its highest neighbour. Further regions that it meets, by falling peak, meet there, at the height
//! s = its P. With p the lower of the two peaks and σ the noise there, they are candidates for two touches if s < 0.85 p − 3σ, and
//! two if the mean pressure between the peaks dips below `split` of its lower end ([`super::profile`]). Else they are one, with the
//! higher peak. Peaks that were in two touches in the frame before, which had met and were found to be two, need not be candidates,
//! and are one only when the dip is over `join`. Two regions that were found to be two stay so for the rest of the sweep.

use super::bridges::Bridges;
use super::options::Splits;
use super::profile::Profile;
use super::skin::Skin;

/// Not swept, or the end of a list.
const NONE: u32 = u32::MAX;

/// The regions of a frame, and memory to find them.
#[derive(Clone, Debug, Default)]
pub(super) struct Regions {
    /// Pressed nodes by falling pressure: the complement of its bits first.
    order: Vec<(u64, u32)>,
    /// By node its place in `order`, [`NONE`] until it is swept.
    rank: Vec<u32>,
    /// By swept node one nearer to the peak of its region, which is its own.
    towards_peak: Vec<u32>,
    /// By swept node the next of its region, and by peak the last.
    next: Vec<u32>,
    last: Vec<u32>,
    /// Pairs of peaks, the higher first, whose regions met and are two.
    two: Vec<[u32; 2]>,
    /// Swept neighbours of a node, then the peaks of their regions.
    met: Vec<u32>,
    profile: Profile,
    /// The members of all regions, one region after the other, in the order of peaks; and where each region ends.
    members: Vec<u32>,
    ends: Vec<u32>,
}

/// What regions are found in.
pub(super) struct Pressures<'a> {
    pub(super) skin: &'a Skin,
    pub(super) bridges: &'a Bridges,
    /// P by node: 0 where it is not pressed, or has no value.
    pub(super) of: &'a [f64],
}

impl Regions {
    /// Finds the regions of the `pressed` nodes. `were_two` says of two peaks, the higher first, whether they were in touches that had
    /// been found to be two.
    pub(super) fn find(
        &mut self,
        on: &Pressures<'_>,
        pressed: &[u32],
        splits: &Splits,
        were_two: impl Fn(u32, u32) -> bool,
    ) {
        self.reset(on.skin.nodes());
        self.order.extend(pressed.iter().map(|&node| (!on.of[node as usize].to_bits(), node)));
        self.order.sort_unstable();
        for rank in 0..self.order.len() {
            let node = self.order[rank].1;
            let joined = self.join(on, node);
            self.rank[node as usize] = rank as u32;
            if joined {
                self.meet(on, node, splits, &were_two);
            }
        }
        self.list();
    }

    fn reset(&mut self, nodes: usize) {
        for &(_, node) in &self.order {
            if let Some(rank) = self.rank.get_mut(node as usize) {
                *rank = NONE;
            }
        }
        self.rank.resize(nodes, NONE);
        for list in [&mut self.towards_peak, &mut self.next, &mut self.last] {
            list.resize(nodes, NONE);
        }
        self.order.clear();
        self.two.clear();
        self.members.clear();
        self.ends.clear();
    }

    /// Puts `node` into the region of its highest neighbour, or into a new one; whether it has joined one. `met` has its swept
    /// neighbours then.
    fn join(&mut self, on: &Pressures<'_>, node: u32) -> bool {
        self.met.clear();
        let (rank, met) = (&self.rank, &mut self.met);
        let mut highest = NONE;
        on.bridges.beside(on.skin, node, |other| {
            if rank[other as usize] != NONE {
                if highest == NONE || rank[other as usize] < rank[highest as usize] {
                    highest = other;
                }
                met.push(other);
            }
        });
        self.next[node as usize] = NONE;
        if highest == NONE {
            self.towards_peak[node as usize] = node;
            self.last[node as usize] = node;
            return false;
        }
        let peak = self.peak(highest);
        self.towards_peak[node as usize] = peak;
        let last = std::mem::replace(&mut self.last[peak as usize], node);
        self.next[last as usize] = node;
        true
    }

    /// Makes the regions that meet at `node` one, or leaves them two.
    fn meet(&mut self, on: &Pressures<'_>, node: u32, splits: &Splits, were_two: &impl Fn(u32, u32) -> bool) {
        let own = self.peak(node);
        for index in 0..self.met.len() {
            self.met[index] = self.peak(self.met[index]);
        }
        if self.met.iter().all(|&peak| peak == own) {
            return;
        }
        let mut met = std::mem::take(&mut self.met);
        met.sort_unstable_by_key(|&peak| self.rank[peak as usize]);
        met.dedup();
        for &other in &met {
            let (own, other) = (self.peak(node), self.peak(other));
            let [high, low] =
                if self.rank[own as usize] <= self.rank[other as usize] { [own, other] } else { [other, own] };
            if high == low || self.two.contains(&[high, low]) {
                continue;
            }
            if self.are_two(on, on.of[node as usize], [high, low], splits, were_two(high, low)) {
                self.two.push([high, low]);
            } else {
                self.merge(high, low);
            }
        }
        self.met = met;
    }

    fn are_two(
        &mut self,
        on: &Pressures<'_>,
        saddle: f64,
        [high, low]: [u32; 2],
        splits: &Splits,
        were_two: bool,
    ) -> bool {
        let sigma = on.skin.taxel(low).reading.sigma;
        if !were_two && !splits.is_candidate(saddle, on.of[low as usize], sigma) {
            return false;
        }
        let Self { profile, next, .. } = self;
        let members = listed(next, high).chain(listed(next, low));
        let dip = profile.dip(on.skin, on.bridges, on.of, members, [high, low]);
        dip.is_some_and(|dip| splits.are_two(dip.least, dip.lower_end, were_two))
    }

    fn merge(&mut self, high: u32, low: u32) {
        self.towards_peak[low as usize] = high;
        let last = self.last[high as usize];
        self.next[last as usize] = low;
        self.last[high as usize] = self.last[low as usize];
    }

    /// The peak of the region of a swept node.
    fn peak(&mut self, node: u32) -> u32 {
        let mut at = node;
        loop {
            let towards = self.towards_peak[at as usize];
            if towards == at {
                return at;
            }
            // Halves the way for the next time.
            let beyond = self.towards_peak[towards as usize];
            self.towards_peak[at as usize] = beyond;
            at = beyond;
        }
    }

    fn list(&mut self) {
        for rank in 0..self.order.len() {
            let node = self.order[rank].1;
            if self.towards_peak[node as usize] == node {
                self.members.extend(listed(&self.next, node));
                self.ends.push(self.members.len() as u32);
            }
        }
    }

    /// Number of regions.
    pub(super) fn count(&self) -> usize {
        self.ends.len()
    }

    /// The members of a region, its peak first; regions are in the order of their peaks, the highest first.
    pub(super) fn members(&self, region: usize) -> &[u32] {
        let first = region.checked_sub(1).map_or(0, |before| self.ends[before]);
        &self.members[first as usize..self.ends[region] as usize]
    }

    /// Pairs of peaks whose regions met and are two. Some of the peaks may have lost their regions to others later on.
    pub(super) fn two(&self) -> &[[u32; 2]] {
        &self.two
    }
}

/// `node` and those after it in its list.
fn listed(next: &[u32], node: u32) -> impl Iterator<Item = u32> + '_ {
    std::iter::successors(Some(node), |&node| Some(next[node as usize]).filter(|&next| next != NONE))
}
