//! Borders of links and seams, which taxels may be kept clear of.

use glam::DVec3;
use rstar::RTree;
use rstar::primitives::Line;

use super::rest_surface::RestSurface;
use crate::body::{NONE, Topology};

/// Borders of a surface, and how far from them taxels are.
pub(super) struct Borders {
    lines: RTree<Line<[f64; 3]>>,
    clear_m: f64,
}

impl Borders {
    /// The borders of `topology`, whose triangles are `chosen` of `rest_surface`: its ends, and between links and meshes.
    pub(super) fn new(rest_surface: &RestSurface<'_>, chosen: &[usize], topology: &Topology, clear_m: f64) -> Self {
        let owner = |triangle: u32| {
            let triangle = chosen[topology.given[triangle as usize] as usize];
            (rest_surface.link[triangle], rest_surface.origin[triangle].0)
        };
        let mut lines = Vec::new();
        for (edge, &beyond) in (0..).zip(&topology.across) {
            let is_inner = beyond != NONE && (beyond < edge || owner(edge / 3) == owner(beyond / 3));
            if !is_inner {
                let (from, to) = topology.ends(edge);
                let [from, to] = [from, to].map(|vertex| topology.positions[vertex as usize].to_array());
                lines.push(Line::new(from, to));
            }
        }
        Self { lines: RTree::bulk_load(lines), clear_m }
    }

    /// Whether `position` is far enough from all borders, in a straight line.
    pub(super) fn are_clear_of(&self, position: DVec3) -> bool {
        let reach = self.clear_m * self.clear_m;
        self.lines.locate_within_distance(position.to_array(), reach).next().is_none()
    }
}
