//! The identities of touches from frame to frame.
//!
//! A touch continues the one of the frame before with which it shares the most pressure, Σ min(P, P′) over the taxels of both.
//! Pairs are made one after the other, the one that shares most first, of equal ones the older identity's, then the higher
//! peak's. A touch that shares pressure with one that another continues is a part of it, with an identity of its own. A touch of
//! the frame before that nothing continues, and that shares pressure with one that continues another, has merged with the one that
//! it shares most with: the older identity of the two stays. Identities count up and are never used again.
//!
//! A region becomes a touch when its total is over `on`; one that continues a touch stays one while its total is over `off`.

use super::options::Options;
use super::trail::Trail;

/// What is kept of a touch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Kept {
    pub(super) id: u64,
    /// When it began, s.
    pub(super) began_s: f64,
    pub(super) link: u32,
    pub(super) trail: Trail,
}

impl Kept {
    /// Its age at `t_s`, s. Clocks tell nanoseconds; what is finer comes from the difference of two numbers.
    pub(super) fn age_s(&self, t_s: f64) -> f64 {
        ((t_s - self.began_s).max(0.0) * 1e9).round() / 1e9
    }
}

/// A pressed taxel of a touch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct KeptTaxel {
    pub(super) node: u32,
    /// Index of its touch.
    pub(super) touch: u32,
    pub(super) pressure: f64,
}

/// What one frame leaves for the next.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Memory {
    pub(super) ids_given: u64,
    /// By ascending id.
    pub(super) touches: Vec<Kept>,
    /// Of all touches, one touch after the other.
    pub(super) taxels: Vec<KeptTaxel>,
    /// Pairs of identities, the older first, that met once and were found to be two; ascending.
    pub(super) two: Vec<[u64; 2]>,
}

/// What a region is in this frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Named {
    pub(super) region: u32,
    pub(super) id: u64,
    /// Index of the touch before that it is the same as, if there is one.
    pub(super) continues: Option<u32>,
    /// It has merged with another in this frame.
    pub(super) merged: bool,
    /// It has lost a part to a new touch in this frame.
    pub(super) parted: bool,
}

/// Pressure that a touch before shares with a region.
#[derive(Clone, Copy, Debug)]
struct Claim {
    shared: f64,
    before: u32,
    region: u32,
}

/// Memory to find identities.
#[derive(Clone, Debug, Default)]
pub(super) struct Identities {
    claims: Vec<Claim>,
    /// By region what a touch before shares with it.
    shared: Vec<f64>,
    /// By region its place in `named`, if it is a touch.
    place: Vec<Option<u32>>,
    /// By touch before the place in `named` of the one that continues it, or that it has merged with.
    went_to: Vec<Option<u32>>,
    /// The touches of the frame, the oldest first.
    named: Vec<Named>,
}

impl Identities {
    /// Names the regions with these `totals`. `region_of` has the region of a node that is pressed, and its P.
    pub(super) fn name(
        &mut self,
        memory: &mut Memory,
        totals: &[f64],
        options: &Options,
        region_of: impl Fn(u32) -> Option<(u32, f64)>,
    ) -> &[Named] {
        self.named.clear();
        self.place.clear();
        self.place.resize(totals.len(), None);
        self.went_to.clear();
        self.went_to.resize(memory.touches.len(), None);
        self.claim(memory, totals.len(), region_of);
        // What is under both thresholds is not a touch.
        let least = options.on.min(options.off);
        self.claims.retain(|claim| totals[claim.region as usize] > least);
        self.claims.sort_unstable_by(|a, b| {
            b.shared.total_cmp(&a.shared).then(a.before.cmp(&b.before)).then(a.region.cmp(&b.region))
        });
        for &Claim { before, region, .. } in &self.claims {
            if self.went_to[before as usize].is_none() && self.place[region as usize].is_none() {
                let place = Some(self.named.len() as u32);
                (self.went_to[before as usize], self.place[region as usize]) = (place, place);
                let id = memory.touches[before as usize].id;
                self.named.push(Named { region, id, continues: Some(before), merged: false, parted: false });
            }
        }
        self.merge(memory);
        for (region, &total) in totals.iter().enumerate() {
            if self.place[region].is_none() && total > options.on {
                memory.ids_given += 1;
                self.part(region as u32);
                self.place[region] = Some(self.named.len() as u32);
                let (region, id) = (region as u32, memory.ids_given);
                self.named.push(Named { region, id, continues: None, merged: false, parted: false });
            }
        }
        self.named.sort_unstable_by_key(|named| named.id);
        &self.named
    }

    fn claim(&mut self, memory: &Memory, regions: usize, region_of: impl Fn(u32) -> Option<(u32, f64)>) {
        self.claims.clear();
        self.shared.clear();
        self.shared.resize(regions, 0.0);
        for own in memory.taxels.chunk_by(|a, b| a.touch == b.touch) {
            let (before, first) = (own[0].touch, self.claims.len());
            for taxel in own {
                let Some((region, pressure)) = region_of(taxel.node) else { continue };
                let shared = &mut self.shared[region as usize];
                if *shared == 0.0 {
                    self.claims.push(Claim { shared: 0.0, before, region });
                }
                *shared += pressure.min(taxel.pressure);
            }
            for claim in &mut self.claims[first..] {
                claim.shared = std::mem::take(&mut self.shared[claim.region as usize]);
            }
        }
    }

    /// Gives each touch before that nothing continues to the one that shares most with it. Claims are the largest first.
    fn merge(&mut self, memory: &Memory) {
        for before in 0..memory.touches.len() as u32 {
            if self.went_to[before as usize].is_some() {
                continue;
            }
            let Some(claim) = self.claims.iter().find(|claim| claim.before == before) else { continue };
            // Its region continues another, or this one would.
            let Some(place) = self.place[claim.region as usize] else { continue };
            self.went_to[before as usize] = Some(place);
            let into = &mut self.named[place as usize];
            into.merged = true;
            let id = memory.touches[before as usize].id;
            if id < into.id {
                (into.id, into.continues) = (id, Some(before));
            }
        }
    }

    /// Notes that the touches that share pressure with the new one in `region` have lost it.
    fn part(&mut self, region: u32) {
        for claim in self.claims.iter().filter(|claim| claim.region == region) {
            if let Some(place) = self.went_to[claim.before as usize] {
                self.named[place as usize].parted = true;
            }
        }
    }

    /// The touches of the frame, the oldest first.
    pub(super) fn named(&self) -> &[Named] {
        &self.named
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Names the regions of a row of taxels; a digit is a region.
    struct Row {
        memory: Memory,
        identities: Identities,
        options: Options,
    }

    impl Row {
        fn new(on: f64, off: f64) -> Self {
            let options = Options { on, off, ..Options::default() };
            Self { memory: Memory::default(), identities: Identities::default(), options }
        }

        /// Per touch, by region: its region's digit, identity, whether it merged and whether it parted.
        fn press(&mut self, regions: &str, pressures: &[f64]) -> Vec<(u32, u64, bool, bool)> {
            let digits: Vec<Option<u32>> = regions.chars().map(|c| c.to_digit(10)).collect();
            let count = digits.iter().flatten().max().map_or(0, |most| *most as usize + 1);
            let pressed = || digits.iter().zip(pressures).filter_map(|(digit, &p)| Some(((*digit)?, p)));
            let mut totals = vec![0.0; count];
            pressed().for_each(|(region, pressure)| totals[region as usize] += pressure);
            let region_at = |node: u32| digits[node as usize].map(|region| (region, pressures[node as usize]));
            let named = self.identities.name(&mut self.memory, &totals, &self.options, region_at).to_vec();
            self.memory.touches =
                named.iter().map(|n| Kept { id: n.id, began_s: 0.0, link: 0, trail: Trail::default() }).collect();
            self.memory.taxels.clear();
            for (touch, named) in (0..).zip(&named) {
                let own = (0..).zip(&digits).filter(|(_, digit)| **digit == Some(named.region));
                let taxel = |(node, _): (u32, _)| KeptTaxel { node, touch, pressure: pressures[node as usize] };
                self.memory.taxels.extend(own.map(taxel));
            }
            named.iter().map(|n| (n.region, n.id, n.merged, n.parted)).collect()
        }
    }

    #[test]
    fn parts_and_wholes_keep_the_right_names() {
        let mut row = Row::new(0.0, 0.0);
        assert_eq!(row.press("00.11", &[1.0; 5]), [(0, 1, false, false), (1, 2, false, false)]);
        // A step to the right, regions named in another order.
        assert_eq!(row.press(".11.0", &[1.0; 5]), [(1, 1, false, false), (0, 2, false, false)]);
        // They meet: the older goes on, whichever is stronger.
        assert_eq!(row.press(".0000", &[1.0, 1.0, 1.0, 9.0, 9.0]), [(0, 1, true, false)]);
        // They part: the part that shares most goes on.
        assert_eq!(row.press(".00.1", &[1.0, 1.0, 1.0, 0.0, 9.0]), [(1, 1, false, true), (0, 3, false, false)]);
        assert_eq!(row.press(".....", &[0.0; 5]), []);
        assert_eq!(row.press(".0...", &[1.0; 5]), [(0, 4, false, false)]);
    }

    #[test]
    fn a_touch_that_moves_onto_anothers_place_takes_no_name() {
        let mut row = Row::new(0.0, 0.0);
        row.press("000.1111", &[1.0; 8]);
        // The first moves away, and the second onto its place in part.
        assert_eq!(row.press("1..00000", &[1.0; 8]), [(1, 1, false, false), (0, 2, false, false)]);
        // A third that shares less with the first than the second does has a name of its own.
        assert_eq!(row.press("00.11.22", &[1.0; 8]), [(0, 1, false, false), (1, 2, false, true), (2, 3, false, false)]);
    }

    #[test]
    fn thresholds_have_hysteresis() {
        let mut row = Row::new(3.0, 1.0);
        assert_eq!(row.press("0..", &[2.0; 3]), []);
        assert_eq!(row.press("0..", &[4.0; 3]), [(0, 1, false, false)]);
        assert_eq!(row.press("0..", &[2.0; 3]), [(0, 1, false, false)]);
        assert_eq!(row.press("0.1", &[2.0; 3]), [(0, 1, false, false)]);
        assert_eq!(row.press("0..", &[1.0; 3]), []);
        assert_eq!(row.press("0..", &[3.0; 3]), []);
    }

    #[test]
    fn ties_go_to_the_older_then_to_the_higher_peak() {
        let mut row = Row::new(0.0, 0.0);
        row.press("0.1", &[1.0; 3]);
        assert_eq!(row.press("000", &[1.0; 3]), [(0, 1, true, false)]);
        assert_eq!(row.press("1.0", &[1.0; 3]), [(0, 1, false, true), (1, 3, false, false)]);
    }
}
