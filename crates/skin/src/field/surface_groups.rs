//! Surfaces that are connected where they touch: those of one link, and those that joints of the same links move.

use super::leaders::Leaders;
use crate::body::{Body, Home};

/// Per surface of `body` its group: rigid ones of one link are one group; skinned ones are one if the same link moves both,
/// also by way of others.
pub fn surface_groups(body: &Body) -> Vec<u32> {
    let mut leaders = Leaders::alone(body.links.len());
    for surface in &body.surfaces {
        let Home::Skinned { joints, .. } = &surface.home else { continue };
        joints.windows(2).for_each(|pair| leaders.join(pair[0].0, pair[1].0));
    }
    let group = |home: &Home| match home {
        Home::Rigid { link, .. } => *link,
        Home::Skinned { joints, .. } => body.links.len() + joints.first().map_or(0, |&(link, _)| leaders.of(link)),
    };
    body.surfaces.iter().map(|surface| &surface.home).map(group).map(|group| group as u32).collect()
}
