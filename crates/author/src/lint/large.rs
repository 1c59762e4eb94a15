//! Links that are so large that their numbers are probably millimetres.

use glam::DVec3;

use super::finding::{Finding, FindingKind};
use crate::body::{Body, listed};

/// A link of over this size was probably not meant in metres, m.
pub(crate) const MAX_LIKELY_LINK_M: f64 = 10.0;

/// Links whose surface and taxels are over [`MAX_LIKELY_LINK_M`] across.
pub(super) fn large(body: &Body) -> Option<Finding> {
    let mut boxes = vec![(DVec3::INFINITY, DVec3::NEG_INFINITY); body.links.len()];
    let mut hold = |link: usize, place: DVec3| {
        let (low, high) = &mut boxes[link];
        (*low, *high) = (low.min(place), high.max(place));
    };
    for (link, corners) in body.triangles_at_rest() {
        corners.into_iter().for_each(|corner| hold(link, corner));
    }
    for taxel in &body.taxels {
        hold(taxel.link, body.links[taxel.link].body_from_link.transform_point3(taxel.position_in_link));
    }
    let sizes = boxes.iter().map(|(low, high)| if low.x <= high.x { low.distance(*high) } else { 0.0 });
    let large: Vec<(f64, &str)> = sizes
        .zip(&body.links)
        .filter(|(size, _)| *size > MAX_LIKELY_LINK_M)
        .map(|(size, link)| (size, &*link.name))
        .collect();
    let &(worst, name) = large.iter().max_by(|a, b| a.0.total_cmp(&b.0))?;
    let names: Vec<&str> = large.iter().map(|(_, name)| *name).collect();
    let links = if names.len() == 1 { "1 link".to_owned() } else { format!("{} links", names.len()) };
    let what =
        format!("{links} over {MAX_LIKELY_LINK_M} m across, up to {worst:.0} m; millimetres? {}", listed(&names));
    let place = Some(format!("link `{name}`"));
    Some(Finding { worst: Some(worst), place, ..Finding::of_taxels(FindingKind::LargeLink, Vec::new(), what) })
}
