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
//! Fits of fields are made of them. This stage is the host's, in f64, on every backend: which taxels connect is a search, not a
//! sum, and it is made only where it is asked for. The pressures are the backend's own.
//!
//! **Doubt.** Where it is certain which taxels are pressed, it is certain which touches there are.
//!
//! Identities are certain while every choice between claims is. With e the whole error of a pull, Σ min(P, P′) is off by
//! Σ max(e, e′) at most and a mean by Σ e‖x − c‖/(S − Σ e). In doubt are two claims of one touch that differ by less than
//! both their errors, and a leap that is as near to the farthest one. Where pulls are not off at all nothing is.

use glam::DVec3;

use super::{SLACK, U};

/// How many spacings a touch may jump between frames without sharing a taxel, and still be the same.
const LEAP: f64 = 3.0;

/// What the doubt about a field's identities hangs on.
#[derive(Clone, Debug, Default)]
pub(crate) struct Doubt {
    right: Memory,
    /// By member, how far the pulls that are remembered may be off; empty where they are not.
    off: Vec<f64>,
}

impl Doubt {
    /// After a frame that left `memory` for certain.
    pub(crate) fn after(memory: &Memory) -> Self {
        Self { right: memory.clone(), off: Vec::new() }
    }

    /// After a frame without contact.
    pub(crate) fn release(&mut self) {
        self.right.release();
        self.off.clear();
    }

    /// Takes the next frame, of `pulls` by member that may each be `off`: whether its touches may have other identities.
    pub(crate) fn follow(&mut self, skin: &Skin<'_>, pulls: &[f64], off: Vec<f64>) -> bool {
        let found = found(skin, pulls);
        let in_doubt = self.right.is_close(&found, skin, &off, &self.off);
        self.right.follow(skin, pulls);
        self.off = off;
        in_doubt
    }
}

/// How far the mean place of `touch` may be off for pulls that are `off`.
fn place_off(touch: &Found, skin: &Skin<'_>, off: &[f64]) -> f64 {
    let off_of = |member: u32| off.get(member as usize).copied().unwrap_or_default();
    let whole: f64 = touch.members.iter().map(|&(member, _)| off_of(member)).sum();
    if whole == 0.0 {
        return 0.0;
    }
    let moment: f64 =
        touch.members.iter().map(|&(m, _)| off_of(m) * skin.places[m as usize].distance(touch.place)).sum();
    if whole < touch.total { SLACK * moment / (touch.total - whole) + U * U } else { f64::INFINITY }
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

impl Found {
    fn of(skin: &Skin<'_>, members: Vec<(u32, f64)>) -> Self {
        let total: f64 = members.iter().map(|(_, pull)| pull).sum();
        let moment: DVec3 = members.iter().map(|&(m, pull)| pull * skin.places[m as usize]).sum();
        Self { id: 0, total, active: members.len() as u32, place: moment / total, members }
    }

    /// Its members, by index, ascending.
    pub(crate) fn members(&self) -> impl Iterator<Item = u32> {
        self.members.iter().map(|&(member, _)| member)
    }
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
        let mut found = found(skin, pulls);
        self.name(&mut found, LEAP * skin.spacing);
        found.sort_by_key(|touch| touch.id);
        self.before = found;
        &self.before
    }

    /// Whether the touches in `found` may continue others, if their pulls are `off` and those before `off_before`.
    fn is_close(&self, found: &[Found], skin: &Skin<'_>, off: &[f64], off_before: &[f64]) -> bool {
        let reach = LEAP * skin.spacing;
        // (claim, how far it may be off, old, new)
        let mut claims: Vec<(f64, f64, usize, usize)> = Vec::new();
        let places_off = |touches: &[Found], off: &[f64]| -> Vec<f64> {
            touches.iter().map(|touch| place_off(touch, skin, off)).collect()
        };
        let (place_off, place_off_before) = (places_off(found, off), places_off(&self.before, off_before));
        let off_of = |off: &[f64], member: u32| off.get(member as usize).copied().unwrap_or_default();
        for (new, touch) in found.iter().enumerate() {
            for (old, before) in self.before.iter().enumerate() {
                let most = |member: u32| off_of(off, member).max(off_of(off_before, member));
                let shared_off = both(&touch.members, &before.members, |member, _, _| most(member));
                let shared = shared(&touch.members, &before.members);
                let apart = touch.place.distance(before.place);
                let apart_off = place_off[new] + place_off_before[old];
                if shared > 0.0 {
                    claims.push((shared, shared_off, old, new));
                } else if apart_off > 0.0 && (apart - reach).abs() <= apart_off {
                    return true;
                } else if apart <= reach {
                    claims.push((-apart, apart_off, old, new));
                }
            }
        }
        claims.iter().enumerate().any(|(index, a)| {
            claims[index + 1..].iter().any(|b| {
                let (apart, off) = ((a.0 - b.0).abs(), SLACK * (a.1 + b.1));
                (a.2 == b.2 || a.3 == b.3) && off > 0.0 && apart <= off
            })
        })
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

/// The touches of a frame, still without identities: the connected sets of pressed members, in the order of their first ones.
fn found(skin: &Skin<'_>, pulls: &[f64]) -> Vec<Found> {
    let mut left = pulls.iter().filter(|pull| **pull > 0.0).count();
    let mut seen = vec![false; pulls.len()];
    let mut found = Vec::new();
    for (first, &pull) in pulls.iter().enumerate() {
        let is_first = pull > 0.0 && !std::mem::replace(&mut seen[first], true);
        if !is_first {
            continue;
        }
        let (mut members, mut at) = (Vec::with_capacity(left), 0);
        members.push((first as u32, pull));
        // Those beside each go to the end.
        while let Some(&(member, _)) = members.get(at) {
            at += 1;
            for &next in &skin.beside[member as usize] {
                let pull = pulls[next as usize];
                if pull > 0.0 && !std::mem::replace(&mut seen[next as usize], true) {
                    members.push((next, pull));
                }
            }
        }
        left -= members.len();
        members.sort_unstable_by_key(|&(member, _)| member);
        found.push(Found::of(skin, members));
    }
    found
}

/// Σ min(a, b) over the members in both; both ascend.
fn shared(a: &[(u32, f64)], b: &[(u32, f64)]) -> f64 {
    both(a, b, |_, a, b| a.min(b))
}

/// The sum of `what` over the members in both, each with its pulls; both ascend.
fn both(a: &[(u32, f64)], b: &[(u32, f64)], what: impl Fn(u32, f64, f64) -> f64) -> f64 {
    let (mut i, mut j, mut sum) = (0, 0, 0.0);
    while i < a.len() && j < b.len() {
        match a[i].0.cmp(&b[j].0) {
            std::cmp::Ordering::Less => i += 1,
            std::cmp::Ordering::Greater => j += 1,
            std::cmp::Ordering::Equal => {
                sum += what(a[i].0, a[i].1, b[j].1);
                (i, j) = (i + 1, j + 1);
            }
        }
    }
    sum
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

    #[test]
    fn identities_are_in_doubt_where_two_claims_are_as_good_as_equal_and_nowhere_else() {
        let row = Row::new();
        let skin = Skin { places: &row.places, beside: &row.beside, spacing: 1.0 };
        // Of frames one after the other, whether the last one's identities are in doubt.
        let doubt = |frames: &[[f64; 10]], off: f64| {
            let mut doubt = Doubt::default();
            frames.iter().map(|pulls| doubt.follow(&skin, pulls, pulls.map(|pull| off * pull).to_vec())).last().unwrap()
        };
        // One touch of five splits into two that share as much with it, or nearly.
        let split = |right: f64| [[1.0; 10], [1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, right]];
        assert!(doubt(&split(1.0), 1e-7) && doubt(&split(0.9999999), 1e-7) && !doubt(&split(0.99), 1e-7));
        // Where nothing is off the tie is decided alike.
        assert!(!doubt(&split(1.0), 0.0));
        // Two touches that stay where they are do not compete.
        let two = [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0];
        assert!(!doubt(&[two, two], 1e-7));
        // A leap of three spacings is the farthest that there is: by a taxel's place alone it is certain, by the mean of two
        // not.
        let at = |a: usize, b: usize| std::array::from_fn(|i| if i == a || i == b { 1.0 } else { 0.0 });
        assert!(!doubt(&[at(0, 0), at(4, 4)], 1e-7) && doubt(&[at(0, 1), at(3, 4)], 1e-7));
        assert!(!doubt(&[at(0, 1), at(3, 4)], 0.0));
        // From a state that is certain the next frame is again.
        let mut memory = Memory::default();
        memory.follow(&skin, &two);
        assert!(!Doubt::after(&memory).follow(&skin, &two, two.map(|pull| 1e-7 * pull).to_vec()));
    }
}
