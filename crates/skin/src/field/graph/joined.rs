//! Links that carry one skin, as far as edges go.

use std::collections::HashMap;

use crate::body::Body;
use crate::field::leaders::Leaders;

/// Per link of `body` the first of those that the layout joins it with, or itself.
pub(super) fn skin_of_links(body: &Body) -> Vec<usize> {
    let mut skins = Leaders::alone(body.links.len());
    let joined = body.edges.as_ref().map_or(&[][..], |edges| &edges.joined);
    if !joined.is_empty() {
        let index: HashMap<&str, usize> = body.links.iter().map(|link| link.name.as_str()).zip(0..).collect();
        for names in joined {
            let links: Vec<usize> = names.iter().filter_map(|name| index.get(name.as_str()).copied()).collect();
            links.windows(2).for_each(|pair| skins.join(pair[0], pair[1]));
        }
    }
    (0..body.links.len()).map(|link| skins.of(link)).collect()
}
