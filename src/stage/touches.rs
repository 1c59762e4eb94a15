//! **touches**: the separate touches of one field.
//!
//! Two fingers on a palm have a centroid where nobody touches. A touch is a connected set of pressed taxels: neighbours
//! lie beside each other on one link, within 1.5 times the usual distance between taxels ([`crate::field::neighbours`]).
//! Each has its total S, its pressure-weighted mean place, and an identity that lasts from onset to release.
//!
//! **Identity.** A touch continues the one of the frame before with which it shares the most pressure (Σ min(P, P′) over
//! common taxels); a touch that shares no taxel continues the nearest one left over, within [`LEAP`] spacings. Where one
//! splits, the part that shares most keeps the identity and the others get new ones; where two meet, the one that gave
//! most goes on. Ties go to the older identity. Identities count up and are never used again.
//!
//! This stage is the host's, in f64, on every backend: which taxels connect is a search, not a sum, and it is made only
//! where it is asked for. The pressures are the backend's own.
//!
//! **Bound.** Which taxels are pressed is the same on every backend, and so are the touches. A total carries its pressures'
//! 2u; a mean 2u above and below of places that lie within the unit. Where a pressure may be off by ε more than 2u, with r
//! the largest ε/P, a total is off by r of itself more, and a mean by at most r/(1 − r) of the 2 that places lie apart. From
//! then on identities are certain only while there is one touch and there was no more than one, not as far apart as a
//! touch may leap.

use glam::DVec3;

use super::{SLACK, U};

/// How many spacings a touch may jump between frames without sharing a taxel, and still be the same.
const LEAP: f64 = 3.0;

/// How far a coordinate of a touch's mean may be off, in the unit; relatively, its total by half of it.
const BOUND: f64 = SLACK * 4.0 * U;

/// How far a single-precision touch may be off.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct TouchBound {
    /// Relatively.
    pub(crate) total: f64,
    /// Per coordinate, as a length.
    pub(crate) place: f64,
}

/// The bound, in the unit, of touches whose pressures are off by up to `lost` of themselves more than 2u.
pub(crate) fn bound(lost: f64) -> TouchBound {
    let moved = if lost < 0.5 { 2.0 * lost / (1.0 - lost) } else { 2.0 };
    TouchBound { total: BOUND + SLACK * lost, place: BOUND + SLACK * moved }
}

/// What the doubt about a field's identities hangs on.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Doubt {
    /// Whether identities have been in doubt since the start.
    pub(crate) in_doubt: bool,
    /// Touches in the frame before, the field's mean place then, and how far its pressures may have been off.
    before: (usize, DVec3, f64),
}

impl Doubt {
    /// No identity is certain any more.
    pub(crate) const FOR_GOOD: Self = Self { in_doubt: true, before: (0, DVec3::ZERO, 0.0) };

    /// The doubt after a frame without contact.
    pub(crate) fn release(self) -> Self {
        Self { in_doubt: self.in_doubt, before: (0, DVec3::ZERO, 0.0) }
    }

    /// The doubt after a frame of `pulls`, wP by member, each off by up to `lost` of itself more than 2u.
    pub(crate) fn after(self, skin: &Skin<'_>, pulls: &[f64], place: DVec3, lost: f64) -> Self {
        let count = components(skin.beside, pulls).len();
        let (count_before, place_before, lost_before) = self.before;
        let leap = (place.distance(place_before) - LEAP * skin.spacing).abs();
        // Per coordinate, of which there are three.
        let near_the_limit = count_before > 0 && leap <= 2.0 * (bound(lost).place + bound(lost_before).place);
        let doubtful = count > 1 || count_before > 1 || near_the_limit;
        let in_doubt = self.in_doubt || (lost.max(lost_before) > 0.0 && doubtful);
        Self { in_doubt, before: (count, place, lost) }
    }
}

/// One touch of a field in one frame.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Found {
    pub(crate) id: u64,
    /// Σ wP over its taxels.
    pub(crate) total: f64,
    /// Number of its taxels.
    pub(crate) active: u32,
    /// Σ wPx / Σ wP in the field's unit, in its chart, or without one along its anchor's axes from its origin.
    pub(crate) place: DVec3,
    /// Its members, by index, with their wP.
    members: Vec<(u32, f64)>,
}

/// What identities hang on, field by field.
#[derive(Clone, Debug, Default)]
pub(crate) struct Memory {
    before: Vec<Found>,
    ids_given: u64,
}

/// A field as this stage sees it.
pub(crate) struct Skin<'a> {
    /// Members' places, in the field's unit.
    pub(crate) places: &'a [DVec3],
    /// Per member, the members beside it.
    pub(crate) beside: &'a [Vec<u32>],
    /// About how far members lie apart, in the same.
    pub(crate) spacing: f64,
}

impl Memory {
    /// Ends all touches, as when the field is out of contact.
    pub(crate) fn release(&mut self) {
        self.before.clear();
    }

    /// The touches of a frame, the oldest first; `pulls` is wP by member, 0 where it is not pressed.
    pub(crate) fn follow(&mut self, skin: &Skin<'_>, pulls: &[f64]) -> &[Found] {
        let mut found: Vec<Found> = components(skin.beside, pulls)
            .into_iter()
            .map(|members| {
                let total: f64 = members.iter().map(|(_, pull)| pull).sum();
                let moment: DVec3 = members.iter().map(|&(m, pull)| pull * skin.places[m as usize]).sum();
                Found { id: 0, total, active: members.len() as u32, place: moment / total, members }
            })
            .collect();
        self.name(&mut found, LEAP * skin.spacing);
        found.sort_by_key(|touch| touch.id);
        self.before = found;
        &self.before
    }

    /// Gives every touch in `found` its identity.
    fn name(&mut self, found: &mut [Found], reach: f64) {
        let mut pairs: Vec<(f64, usize, usize)> = Vec::new();
        for (new, touch) in found.iter().enumerate() {
            for (old, before) in self.before.iter().enumerate() {
                let shared = shared(&touch.members, &before.members);
                let apart = touch.place.distance(before.place);
                if shared > 0.0 {
                    pairs.push((shared, old, new));
                } else if apart <= reach {
                    // Below every shared pressure; the nearer the better.
                    pairs.push((-apart, old, new));
                }
            }
        }
        // The best claim first; of equal ones the older identity's, which stands first in `before`.
        pairs.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)).then(a.2.cmp(&b.2)));
        let mut continued = vec![false; self.before.len()];
        for (_, old, new) in pairs {
            if !continued[old] && found[new].id == 0 {
                continued[old] = true;
                found[new].id = self.before[old].id;
            }
        }
        for touch in found.iter_mut().filter(|touch| touch.id == 0) {
            self.ids_given += 1;
            touch.id = self.ids_given;
        }
    }
}

/// Σ min(a, b) over the members in both; both ascend.
fn shared(a: &[(u32, f64)], b: &[(u32, f64)]) -> f64 {
    let (mut i, mut j, mut sum) = (0, 0, 0.0);
    while i < a.len() && j < b.len() {
        match a[i].0.cmp(&b[j].0) {
            std::cmp::Ordering::Less => i += 1,
            std::cmp::Ordering::Greater => j += 1,
            std::cmp::Ordering::Equal => {
                sum += a[i].1.min(b[j].1);
                (i, j) = (i + 1, j + 1);
            }
        }
    }
    sum
}

/// The connected sets of pressed members, each ascending, in the order of their first members.
fn components(beside: &[Vec<u32>], pulls: &[f64]) -> Vec<Vec<(u32, f64)>> {
    let mut seen = vec![false; pulls.len()];
    let mut components = Vec::new();
    let mut to_visit = Vec::new();
    for first in 0..pulls.len() {
        if pulls[first] <= 0.0 || std::mem::replace(&mut seen[first], true) {
            continue;
        }
        let mut members = Vec::new();
        to_visit.push(first as u32);
        while let Some(member) = to_visit.pop() {
            members.push((member, pulls[member as usize]));
            for &next in &beside[member as usize] {
                if pulls[next as usize] > 0.0 && !std::mem::replace(&mut seen[next as usize], true) {
                    to_visit.push(next);
                }
            }
        }
        members.sort_unstable_by_key(|&(member, _)| member);
        components.push(members);
    }
    components
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Ten taxels in a row, a metre apart.
    struct Row {
        places: Vec<DVec3>,
        beside: Vec<Vec<u32>>,
        memory: Memory,
    }

    impl Row {
        fn new() -> Self {
            let beside = (0..10_u32).map(|i| (0..10).filter(|j| i.abs_diff(*j) == 1).collect()).collect();
            Self { places: (0..10).map(|i| DVec3::X * f64::from(i)).collect(), beside, memory: Memory::default() }
        }

        /// (identity, total, place) of each touch.
        fn press(&mut self, pulls: [u8; 10]) -> Vec<(u64, f64, f64)> {
            let skin = Skin { places: &self.places, beside: &self.beside, spacing: 1.0 };
            let found = self.memory.follow(&skin, &pulls.map(f64::from));
            found.iter().map(|touch| (touch.id, touch.total, touch.place.x)).collect()
        }
    }

    #[test]
    fn two_fingers_are_two_touches_with_names_that_last() {
        let mut row = Row::new();
        assert_eq!(row.press([1, 1, 0, 0, 0, 0, 0, 0, 4, 0]), [(1, 2.0, 0.5), (2, 4.0, 8.0)]);
        assert_eq!(row.press([0, 2, 0, 0, 0, 0, 0, 2, 0, 0]), [(1, 2.0, 1.0), (2, 2.0, 7.0)]);
        // They may pass over several taxels in a frame, but not over the field.
        assert_eq!(row.press([0, 0, 0, 2, 0, 0, 0, 2, 0, 0]), [(1, 2.0, 3.0), (2, 2.0, 7.0)]);
        assert_eq!(row.press([0; 10]), []);
        assert_eq!(row.press([0, 0, 0, 0, 0, 0, 0, 2, 0, 0]), [(3, 2.0, 7.0)]);
        assert_eq!(row.press([2, 0, 0, 0, 0, 0, 0, 0, 0, 0]), [(4, 2.0, 0.0)]);
    }

    #[test]
    fn a_split_and_a_meeting_keep_the_stronger_name() {
        let mut row = Row::new();
        assert_eq!(row.press([0, 0, 1, 1, 1, 3, 3, 0, 0, 0]), [(1, 9.0, 4.666_666_666_666_667)]);
        assert_eq!(row.press([0, 0, 1, 1, 0, 3, 3, 0, 0, 0]), [(1, 6.0, 5.5), (2, 2.0, 2.5)]);
        assert_eq!(row.press([0, 0, 1, 1, 1, 3, 3, 0, 0, 0]), [(1, 9.0, 4.666_666_666_666_667)]);
    }
}
