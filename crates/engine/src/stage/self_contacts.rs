//! **self_contacts**: touches of two links that are at one place in the world.
//!
//! Two touches are one contact where their links differ, their places are at most a tolerance apart, and their outward
//! normals are more than 120° apart: surfaces that press on each other face each other. Of several touches on a pair of
//! links the two nearest are paired first, then the nearest of those that remain; a touch is in one contact with each
//! other link at most.
//!
//! This stage is the host's, in f64, on every backend. It has no bound of its own: it is made of touches, which have theirs.

use glam::DVec3;

/// The cosine of the least angle between normals of surfaces that face each other, 120°.
const FACING: f64 = -0.5;

/// A touch whose place in the world is known.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Side {
    pub(crate) touch: u64,
    /// Of the body.
    pub(crate) link: usize,
    pub(crate) total: f64,
    /// In the world, m.
    pub(crate) position: DVec3,
    /// In the world.
    pub(crate) normal: DVec3,
}

/// Two sides that are one contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Pair {
    /// Their indices.
    pub(crate) sides: [usize; 2],
    pub(crate) distance_m: f64,
    /// Between their normals.
    pub(crate) angle_rad: f64,
}

/// The pairs of `sides` that are self-contacts, in the order of `sides`. `tolerance_m` of two links is how far they may be apart.
pub(crate) fn pairs(sides: &[Side], tolerance_m: impl Fn(usize, usize) -> f64) -> Vec<Pair> {
    let mut near = Vec::new();
    for (i, a) in sides.iter().enumerate() {
        for (j, b) in sides.iter().enumerate().skip(i + 1) {
            if a.link == b.link {
                continue;
            }
            let distance_m = a.position.distance(b.position);
            // A distance that is not a number is not a contact.
            if !matches!(distance_m.partial_cmp(&tolerance_m(a.link, b.link)), Some(order) if order.is_le()) {
                continue;
            }
            let cosine = a.normal.dot(b.normal).clamp(-1.0, 1.0);
            if cosine < FACING {
                near.push(Pair { sides: [i, j], distance_m, angle_rad: cosine.acos() });
            }
        }
    }
    near.sort_by(|a, b| a.distance_m.total_cmp(&b.distance_m).then(a.sides.cmp(&b.sides)));
    // Each side, and the other link that it has a contact with.
    let mut taken: Vec<(usize, usize)> = Vec::new();
    near.retain(|pair| {
        let [i, j] = pair.sides;
        let both = [(i, sides[j].link), (j, sides[i].link)];
        let is_free = !both.iter().any(|of| taken.contains(of));
        if is_free {
            taken.extend(both);
        }
        is_free
    });
    near.sort_by_key(|pair| pair.sides);
    near
}

/// Which self-contacts there are, so that each keeps its identity while both of its touches last.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Memory {
    known: Vec<Known>,
    next: u64,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Known {
    /// The touch of either side.
    sides: [u64; 2],
    id: u64,
}

impl Memory {
    /// Forgets all self-contacts; their identities are never used again.
    pub(crate) fn restart(&mut self) {
        self.known.clear();
    }

    /// Forgets self-contacts with an ended touch: `lasts` is false for it.
    pub(crate) fn release(&mut self, lasts: impl Fn(u64) -> bool) {
        self.known.retain(|known| known.sides.iter().all(|&touch| lasts(touch)));
    }

    /// The identity of the contact of two touches.
    pub(crate) fn id_of(&mut self, sides: [&Side; 2]) -> u64 {
        let sides = sides.map(|side| side.touch);
        if let Some(known) = self.known.iter().find(|known| known.sides == sides) {
            return known.id;
        }
        let id = self.next;
        self.next += 1;
        self.known.push(Known { sides, id });
        id
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn side(touch: u64, link: usize, x: f64, normal: DVec3) -> Side {
        Side { touch, link, total: 1.0, position: DVec3::X * x, normal }
    }

    fn found(sides: &[Side], tolerance_m: f64) -> Vec<[usize; 2]> {
        pairs(sides, |_, _| tolerance_m).into_iter().map(|pair| pair.sides).collect()
    }

    #[test]
    fn a_contact_is_near_on_another_link_and_faces_the_other_way() {
        let up = side(0, 0, 0.0, DVec3::Z);
        let down = |x: f64| side(1, 1, x, -DVec3::Z);
        assert_eq!(found(&[up, down(0.01)], 0.01), [[0, 1]]);
        assert!(found(&[up, down(0.010_001)], 0.01).is_empty());
        assert!(found(&[up, Side { link: 0, ..down(0.0) }], 0.01).is_empty());
        assert!(found(&[up, down(f64::NAN)], 0.01).is_empty());
        // 120°, a little less and a little more.
        let turned = |degrees: f64| {
            let (sine, cosine) = degrees.to_radians().sin_cos();
            [up, side(1, 1, 0.0, DVec3::new(sine, 0.0, cosine))]
        };
        assert!(found(&turned(119.9), 0.01).is_empty());
        let pair = pairs(&turned(120.1), |_, _| 0.01)[0];
        assert!((pair.angle_rad - 120.1_f64.to_radians()).abs() < 1e-9);
    }

    #[test]
    fn the_nearest_are_paired_first_and_each_touch_once_a_link() {
        let a = |x: f64| side(0, 0, x, DVec3::Z);
        let b = |x: f64| side(1, 1, x, -DVec3::Z);
        assert_eq!(found(&[a(0.0), a(0.003), b(0.001), b(0.006)], 0.01), [[0, 2], [1, 3]]);
        // One on the other side: nothing is left for the farther one.
        assert_eq!(found(&[a(0.0), a(0.003), b(0.002)], 0.01), [[1, 2]]);
        // Between two other links, one with each.
        let c = side(2, 2, 0.004, -DVec3::Z);
        assert_eq!(found(&[a(0.003), b(0.002), c], 0.01), [[0, 1], [0, 2]]);
    }

    #[test]
    fn an_identity_lasts_as_long_as_both_touches() {
        let (a, b) = (side(1, 0, 0.0, DVec3::Z), side(2, 1, 0.0, -DVec3::Z));
        let mut memory = Memory::default();
        assert_eq!(memory.id_of([&a, &b]), 0);
        assert_eq!(memory.id_of([&a, &Side { touch: 3, ..b }]), 1);
        memory.release(|touch| touch < 3);
        assert_eq!(memory.id_of([&a, &b]), 0);
        assert_eq!(memory.id_of([&a, &Side { touch: 3, ..b }]), 2);
    }
}
