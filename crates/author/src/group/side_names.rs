//! Names of patches that say where they are: the side of their link that they are on, and a number.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use glam::DVec3;

use super::grouper::Grouper;
use crate::body::WORLD_FROM_BODY;

/// Patches whose mean normal is shorter go around their part: no side is theirs.
const LEAST_NORMAL: f64 = 0.25;

/// Sides that a normal is between belong to the first of them, up to this difference: rounding decides nothing.
const SAME: f64 = 1e-6;

/// Heights and the like are equal up to this, m.
const SAME_M: f64 = 1e-5;

/// A side of the body at rest, by the axes of the world.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Side {
    Front,
    Back,
    Left,
    Right,
    Top,
    Bottom,
    Around,
}

impl Side {
    /// The side that `normal`, the mean of unit normals in the world, looks to.
    fn from_normal(normal: DVec3) -> Self {
        if normal.length() < LEAST_NORMAL {
            return Self::Around;
        }
        let most = normal.abs().max_element() - SAME;
        let [forward, left, up] = normal.to_array();
        if forward.abs() >= most {
            if forward > 0.0 { Self::Front } else { Self::Back }
        } else if left.abs() >= most {
            if left > 0.0 { Self::Left } else { Self::Right }
        } else if up > 0.0 {
            Self::Top
        } else {
            Self::Bottom
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::Front => "front",
            Self::Back => "back",
            Self::Left => "left",
            Self::Right => "right",
            Self::Top => "top",
            Self::Bottom => "bottom",
            Self::Around => "around",
        }
    }
}

/// Where a patch is.
struct Spot {
    word: String,
    /// What it is numbered by, the largest first.
    order: [i64; 3],
}

impl Grouper<'_> {
    /// A name for each of `patches`, which have one parent: its side, and its number there. Numbers go from top to bottom, on the top and
    /// the bottom from front to back, and have as many digits as the largest of their side.
    pub(super) fn side_names(&self, patches: &[Vec<usize>]) -> Vec<String> {
        let halves: Vec<Option<bool>> = patches.iter().map(|patch| self.halves.is_right(patch)).collect();
        let has_both = halves.contains(&Some(true)) && halves.contains(&Some(false));
        let spots: Vec<Spot> =
            patches.iter().zip(halves).map(|(patch, half)| self.spot(patch, half, has_both)).collect();
        let mut order: Vec<usize> = (0..patches.len()).collect();
        order.sort_by(|&a, &b| spots[b].order.cmp(&spots[a].order).then(patches[a].cmp(&patches[b])));
        let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
        let mut numbers = vec![0; patches.len()];
        for index in order {
            let count = counts.entry(&spots[index].word).or_insert(0);
            *count += 1;
            numbers[index] = *count;
        }
        let name = |(spot, number): (&Spot, &usize)| {
            let width = counts[spot.word.as_str()].to_string().len();
            format!("{}_{number:0width$}", spot.word)
        };
        spots.iter().zip(&numbers).map(name).collect()
    }

    /// Where `patch` is. On the right half of a mirrored layout, that is where its image on the left half is; `has_both` says whether
    /// its parent has patches on both.
    fn spot(&self, patch: &[usize], is_right: Option<bool>, has_both: bool) -> Spot {
        let taxels = if is_right == Some(true) { self.halves.images(patch) } else { patch.to_vec() };
        let body = self.body;
        let (mut normal, mut position) = (DVec3::ZERO, DVec3::ZERO);
        for taxel in taxels.iter().map(|&taxel| &body.taxels[taxel]) {
            let body_from_link = body.links[taxel.link].body_from_link;
            normal += WORLD_FROM_BODY.transform_vector3(body_from_link.transform_vector3(taxel.normal_in_link));
            position += WORLD_FROM_BODY.transform_point3(body_from_link.transform_point3(taxel.position_in_link));
        }
        let count = taxels.len().max(1) as f64;
        let (side, at) = (Side::from_normal(normal / count), position / count);
        // The left half of a mirrored layout has the mirror plane on its right, as a left link of a pair has.
        let is_left = match is_right {
            Some(_) => Some(true),
            None => taxels.first().and_then(|&taxel| self.pairs.is_left(body.taxels[taxel].link)),
        };
        let faces = match (side, is_left) {
            (Side::Left, Some(is_left)) => Some(!is_left),
            (Side::Right, Some(is_left)) => Some(is_left),
            _ => None,
        };
        let mut word = match faces {
            Some(true) => "inner".to_owned(),
            Some(false) => "outer".to_owned(),
            None => side.name().to_owned(),
        };
        if let (Some(is_right), true) = (is_right, has_both) {
            let half = if is_right { "right" } else { "left" };
            match word.as_str() {
                "outer" => half.clone_into(&mut word),
                _ => write!(word, "_{half}").unwrap_or_default(),
            }
        }
        let steps = |metres: f64| (metres / SAME_M).round() as i64;
        let [forward, left, up] = at.to_array().map(steps);
        let across = if is_left == Some(true) { -left } else { left };
        let order = match side {
            Side::Top | Side::Bottom => [forward, across, up],
            Side::Front | Side::Back | Side::Around => [up, across, forward],
            Side::Left | Side::Right => [up, forward, across],
        };
        Spot { word, order }
    }
}
