//! Links that carry one skin, as far as edges go.

use crate::body::Body;

/// Per link of `body` a number that those links have in common which the layout joins.
pub(super) fn skin_of_links(body: &Body) -> Vec<usize> {
    let mut skins: Vec<usize> = (0..body.links.len()).collect();
    for names in body.edges.iter().flat_map(|edges| &edges.joined) {
        let mut links = names.iter().filter_map(|name| body.link_index(name));
        let Some(first) = links.next().map(|link| skins[link]) else { continue };
        for link in links {
            let other = skins[link];
            skins.iter_mut().filter(|skin| **skin == other).for_each(|skin| *skin = first);
        }
    }
    skins
}
