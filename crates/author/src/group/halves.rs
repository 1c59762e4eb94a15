//! The two halves of a mirrored layout: which taxels are mirror images of each other.

use std::collections::BTreeMap;

use crate::body::Body;

/// Taxels that are mirror images, by their indices in a body.
#[derive(Default)]
pub(super) struct Halves {
    /// Per taxel its image, and whether it is on the right itself.
    image_of: BTreeMap<usize, (usize, bool)>,
}

impl Halves {
    /// The halves of `body`; `pairs` are ids of its taxels, each the left one and the right one.
    pub(super) fn new(body: &Body, pairs: &[[u32; 2]]) -> Self {
        let indices =
            pairs.iter().filter_map(|&[left, right]| Some([body.taxel_index(left)?, body.taxel_index(right)?]));
        Self { image_of: indices.flat_map(|[left, right]| [(left, (right, false)), (right, (left, true))]).collect() }
    }

    /// Whether all of `taxels` are on the right (`true`), or all on the left.
    pub(super) fn is_right(&self, taxels: &[usize]) -> Option<bool> {
        let mut sides = taxels.iter().map(|taxel| self.image_of.get(taxel).map(|(_, is_right)| *is_right));
        let first = sides.next()??;
        sides.all(|side| side == Some(first)).then_some(first)
    }

    /// The images of `taxels`, ascending.
    pub(super) fn images(&self, taxels: &[usize]) -> Vec<usize> {
        let image = |taxel: &usize| self.image_of.get(taxel).map_or(*taxel, |(image, _)| *image);
        let mut images: Vec<usize> = taxels.iter().map(image).collect();
        images.sort_unstable();
        images
    }

    /// Splits `taxels` into those on the left, with those that have no image, and those on the right.
    pub(super) fn split(&self, taxels: &[usize]) -> [Vec<usize>; 2] {
        let (right, left) = taxels.iter().partition(|taxel| self.image_of.get(taxel).is_some_and(|(_, right)| *right));
        [left, right]
    }
}
