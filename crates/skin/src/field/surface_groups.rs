//! Surfaces that are connected where they touch: those of one link, and those that joints of the same links move.

use crate::body::{Body, Home};

/// Per surface of `body` its group: rigid ones of one link are one group; skinned ones are one if the same link moves both,
/// also by way of others.
pub fn surface_groups(body: &Body) -> Vec<u32> {
    let mut leader: Vec<usize> = (0..body.links.len()).collect();
    fn find(leader: &mut [usize], mut link: usize) -> usize {
        while leader[link] != link {
            leader[link] = leader[leader[link]];
            link = leader[link];
        }
        link
    }
    for surface in &body.surfaces {
        let Home::Skinned { joints, .. } = &surface.home else { continue };
        for pair in joints.windows(2) {
            let [a, b] = [pair[0].0, pair[1].0].map(|link| find(&mut leader, link));
            leader[a.max(b)] = a.min(b);
        }
    }
    let group = |home: &Home| match home {
        Home::Rigid { link, .. } => *link,
        Home::Skinned { joints, .. } => {
            body.links.len() + joints.first().map_or(0, |&(link, _)| find(&mut leader, link))
        }
    };
    body.surfaces.iter().map(|surface| &surface.home).map(group).map(|group| group as u32).collect()
}
