//! Links that are the left and the right one of a pair, by their names.

use std::collections::BTreeMap;
use std::ops::Range;

use glam::DVec3;

use crate::body::{Body, Link, WORLD_FROM_BODY};

/// Words of names for the two sides: left and right, also of a front, rear, hind or back leg.
const SIDES: [[&str; 2]; 10] = [
    ["left", "right"],
    ["l", "r"],
    ["fl", "fr"],
    ["rl", "rr"],
    ["hl", "hr"],
    ["bl", "br"],
    ["lf", "rf"],
    ["lh", "rh"],
    ["lb", "rb"],
    ["lr", "rr"],
];

/// Links of a pair are beside each other if so much of the way from one to the other is to the left or right.
const BESIDE: f64 = 0.5;

/// Per link of a body its partner on the other side.
pub(super) struct LinkPairs {
    partners: Vec<Option<usize>>,
    /// Whether it is on the left of its partner, in the world at rest.
    is_left: Vec<Option<bool>>,
}

impl LinkPairs {
    /// The pairs of `body`: two links are a pair if the words for sides in their names are opposite, and all else is the same.
    pub(super) fn new(body: &Body) -> Self {
        let partners = partners(&body.links.iter().map(|link| link.name.as_str()).collect::<Vec<_>>());
        let middles = middles(body);
        let is_left = |(link, partner): (usize, &Option<usize>)| {
            let way = middles[link] - middles[(*partner)?];
            (way.y.abs() > BESIDE * way.length()).then_some(way.y > 0.0)
        };
        let is_left = partners.iter().enumerate().map(is_left).collect();
        Self { partners, is_left }
    }

    /// The partner of `link`, if it has one.
    pub(super) fn partner(&self, link: usize) -> Option<usize> {
        self.partners[link]
    }

    /// Whether `link` is on the left of its partner; `None` if it has none, or one that is not beside it.
    pub(super) fn is_left(&self, link: usize) -> Option<bool> {
        self.is_left[link]
    }

    /// The link that a mirror image of `link` is on: its partner, else itself.
    pub(super) fn image(&self, link: usize) -> usize {
        self.partners[link].unwrap_or(link)
    }
}

/// Per link of `body` the mean place of its taxels in the world at rest, or without any its origin, m.
fn middles(body: &Body) -> Vec<DVec3> {
    let mut sums = vec![(DVec3::ZERO, 0.0_f64); body.links.len()];
    for taxel in &body.taxels {
        let (sum, count) = &mut sums[taxel.link];
        *sum += taxel.position_in_link;
        *count += 1.0;
    }
    let in_world = |(link, (sum, count)): (&Link, (DVec3, f64))| {
        WORLD_FROM_BODY.transform_point3(link.body_from_link.transform_point3(sum / count.max(1.0)))
    };
    body.links.iter().zip(sums).map(in_world).collect()
}

/// Per one of `names` the one of its partner.
fn partners(names: &[&str]) -> Vec<Option<usize>> {
    let index: BTreeMap<&str, usize> = names.iter().copied().zip(0..).collect();
    let candidate = |name: &&str| other_sides(name).into_iter().find_map(|name| index.get(name.as_str()).copied());
    let first: Vec<Option<usize>> = names.iter().map(candidate).collect();
    let is_mutual = |(link, partner): (usize, &Option<usize>)| partner.filter(|&other| first[other] == Some(link));
    first.iter().enumerate().map(is_mutual).collect()
}

/// `name` with all words for a side exchanged; none if it has no such word, two if a word has two opposites.
fn other_sides(name: &str) -> Vec<String> {
    let sides: Vec<(Range<usize>, Vec<String>)> = words(name)
        .into_iter()
        .map(|word| (word.clone(), opposites(&name[word])))
        .filter(|(_, opposites)| !opposites.is_empty())
        .collect();
    let most = sides.iter().map(|(_, opposites)| opposites.len()).max().unwrap_or(0);
    let exchanged = |choice: usize| {
        let (mut other, mut from) = (String::new(), 0);
        for (word, opposites) in &sides {
            other += &name[from..word.start];
            other += &opposites[choice.min(opposites.len() - 1)];
            from = word.end;
        }
        other + &name[from..]
    };
    (0..most).map(exchanged).collect()
}

/// The word opposite to `word`, with the same capitals.
fn opposites(word: &str) -> Vec<String> {
    let low = word.to_ascii_lowercase();
    let other = |[left, right]: &[&'static str; 2]| match low.as_str() {
        word if word == *left => Some(*right),
        word if word == *right => Some(*left),
        _ => None,
    };
    let spelt = |other: &str| {
        if word.bytes().all(|byte| byte.is_ascii_uppercase()) {
            other.to_ascii_uppercase()
        } else if word.starts_with(|first: char| first.is_ascii_uppercase()) {
            other[..1].to_ascii_uppercase() + &other[1..]
        } else {
            other.to_owned()
        }
    };
    SIDES.iter().filter_map(other).map(spelt).collect()
}

/// The words of `name`: runs of letters, parted where a capital begins one, as in `LeftArm` and `LArm`.
fn words(name: &str) -> Vec<Range<usize>> {
    let bytes = name.as_bytes();
    let mut words: Vec<Range<usize>> = Vec::new();
    for (at, byte) in bytes.iter().enumerate().filter(|(_, byte)| byte.is_ascii_alphabetic()) {
        let before = at.checked_sub(1).map(|before| bytes[before]).filter(u8::is_ascii_alphabetic);
        let is_lower = |byte: Option<&u8>| byte.is_some_and(u8::is_ascii_lowercase);
        let begins = byte.is_ascii_uppercase() && (is_lower(before.as_ref()) || is_lower(bytes.get(at + 1)));
        match words.last_mut() {
            Some(word) if before.is_some() && !begins => word.end = at + 1,
            _ => words.push(at..at + 1),
        }
    }
    words
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_word_for_a_side_is_a_whole_word() {
        let other = |name: &str| other_sides(name).join(" ");
        for (left, right) in [
            ("left_forearm", "right_forearm"),
            ("mixamorig:LeftArm", "mixamorig:RightArm"),
            ("l_hand", "r_hand"),
            ("arm_L", "arm_R"),
            ("hand.l.001", "hand.r.001"),
            ("LShoulderPitch", "RShoulderPitch"),
            ("FL_calf", "FR_calf"),
            ("LF_HIP", "RF_HIP"),
            ("arm_left_1_link", "arm_right_1_link"),
            ("LEFT-foot", "RIGHT-foot"),
            ("left_hand_left_pad", "right_hand_right_pad"),
        ] {
            assert_eq!([other(left), other(right)], [right, left]);
        }
        for none in ["leftover", "torso", "lever_3", "calf", "FLhip", "", "élan", "shoulder"] {
            assert!(other(none).is_empty(), "{none}: {}", other(none));
        }
        assert_eq!(other("RR_hip"), "RL_hip LR_hip");
    }

    #[test]
    fn links_are_pairs_where_both_are_there() {
        let names = ["torso", "LR_hip", "RR_hip", "left_eye", "l_arm", "r_arm"];
        assert_eq!(partners(&names), [None, Some(2), Some(1), None, Some(5), Some(4)]);
    }
}
