//! Colours that tell fields apart, for people who see colours differently too.

use std::collections::BTreeSet;

/// The seven colours of Okabe and Ito (*Color Universal Design*, 2008), then five darker ones after Paul Tol's *muted*
/// scheme, in an order in which neighbours differ most. sRGB.
pub(super) const PALETTE: [[u8; 3]; 12] = [
    [0x00, 0x72, 0xB2],
    [0xE6, 0x9F, 0x00],
    [0x00, 0x9E, 0x73],
    [0xCC, 0x79, 0xA7],
    [0xD5, 0x5E, 0x00],
    [0x56, 0xB4, 0xE9],
    [0xF0, 0xE4, 0x42],
    [0x33, 0x22, 0x88],
    [0x88, 0x22, 0x55],
    [0x44, 0xAA, 0x99],
    [0x99, 0x99, 0x33],
    [0x66, 0x11, 0x00],
];

/// Of taxels in no field that is shown.
pub(super) const REST: [u8; 3] = [0xF2, 0xF2, 0xF0];
/// Around every taxel.
pub(super) const RIM: [u8; 3] = [0x38, 0x38, 0x3A];
/// Behind everything.
pub(super) const PAPER: [u8; 3] = [0xFB, 0xFB, 0xFA];

/// Linear light, as sRGB has it (IEC 61966-2-1).
pub(super) fn linear(colour: [u8; 3]) -> [f64; 3] {
    colour.map(|part| {
        let part = f64::from(part) / 255.0;
        if part <= 0.040_45 { part / 12.92 } else { libm::pow((part + 0.055) / 1.055, 2.4) }
    })
}

/// A colour for each of `count` fields, as its number in [`PALETTE`], and whether no two fields share one. Where there are
/// more fields than colours, the two of a pair in `beside` differ as far as that can be, and colours are used about
/// equally often.
pub(super) fn assign(count: usize, beside: &BTreeSet<(usize, usize)>) -> (Vec<usize>, bool) {
    if count <= PALETTE.len() {
        return ((0..count).collect(), true);
    }
    let mut around = vec![Vec::new(); count];
    for &(one, other) in beside {
        around[one].push(other);
        around[other].push(one);
    }
    let mut used = [0_usize; PALETTE.len()];
    let mut colours: Vec<usize> = Vec::with_capacity(count);
    for neighbours in &around {
        let clashes = |colour: usize| neighbours.iter().filter(|&&n| colours.get(n) == Some(&colour)).count();
        let best = (0..PALETTE.len()).min_by_key(|&colour| (clashes(colour), used[colour])).unwrap_or(0);
        used[best] += 1;
        colours.push(best);
    }
    (colours, false)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbours_differ_where_colours_are_too_few() {
        // A ring of 40 fields, each beside the next three.
        let beside = (0..40).flat_map(|i| (1..4).map(move |step| (i, (i + step) % 40))).collect();
        let (colours, own) = assign(40, &beside);
        assert!(!own && beside.iter().all(|&(a, b)| colours[a] != colours[b]));
        assert_eq!(colours.iter().collect::<BTreeSet<_>>().len(), PALETTE.len());
        assert_eq!(assign(3, &BTreeSet::new()), (vec![0, 1, 2], true));
    }

    #[test]
    fn light_runs_from_none_to_all() {
        assert_eq!(linear([0, 255, 0]), [0.0, 1.0, 0.0]);
        assert!((linear([188, 0, 0])[0] - 0.502_886).abs() < 1e-6);
    }
}
