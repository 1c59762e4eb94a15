//! Lines between neighbouring taxels, where a view sees both.

use glam::DVec3;
use plotters::prelude::*;

use super::shape::Dots;
use super::view::{Arrangement, View};
use crate::body::{Body, Ray, RayTree};
use crate::error::Result;
use crate::field::TaxelGraph;
use crate::ink::cannot;

const LINE: RGBColor = RGBColor(0x30, 0x34, 0x3A);
/// A taxel is seen from directions within this cosine of its normal.
const MIN_FACING: f64 = 0.05;
/// A ray starts at this height over a taxel, in radii of its disc, and ends nowhere.
const LIFT_RADII: f64 = 0.2;

/// By view, which taxels of `body` it sees: those that face it and that nothing of the body hides.
pub(super) fn seen(body: &Body, dots: &Dots, views: &[View]) -> Vec<Vec<bool>> {
    let surface = RayTree::new(body.triangles_at_rest().into_iter().map(|(_, corners)| corners));
    let in_view = |view: &View| {
        let towards = view.axes()[2];
        let is_seen = |taxel: usize| {
            let (place, normal) = (dots.places[taxel], dots.normals[taxel]);
            let from = place + normal * (LIFT_RADII * dots.radii[taxel]);
            normal.dot(towards) > MIN_FACING && !surface.is_hit(&Ray::new(from, towards))
        };
        (0..dots.places.len()).map(is_seen).collect()
    };
    views.iter().map(in_view).collect()
}

/// The lines of a picture, each from disc to disc, pixels.
pub(super) struct Lines {
    lines: Vec<[(i32, i32); 2]>,
    thick: u32,
}

impl Lines {
    /// For the edges between the taxels of `body` that each of `views` sees; `middle` is what they look at, and `thick` how
    /// thick they are, pixels.
    pub(super) fn new(
        body: &Body,
        dots: &Dots,
        views: &[View],
        arrangement: &Arrangement,
        middle: DVec3,
        thick: u32,
    ) -> Self {
        let (graph, _) = TaxelGraph::from_body(body);
        let seen_in_views = seen(body, dots, views);
        let mut lines = Vec::new();
        for (index, seen) in seen_in_views.iter().enumerate() {
            let pixel = |place: DVec3| {
                let [x, y] = arrangement.pixel(index, place - middle);
                (x.round() as i32, y.round() as i32)
            };
            let is_inside = |at: (i32, i32)| arrangement.views[index].holds(at);
            for (a, b) in graph.edges().map(|(a, b)| (a as usize, b as usize)).filter(|&(a, b)| seen[a] && seen[b]) {
                let way = (dots.places[b] - dots.places[a]).normalize_or_zero();
                let ends = [dots.places[a] + way * dots.radii[a], dots.places[b] - way * dots.radii[b]].map(pixel);
                if ends.into_iter().all(is_inside) {
                    lines.push(ends);
                }
            }
        }
        Self { lines, thick }
    }

    /// Draws them into a picture of `size`.
    pub(super) fn draw(&self, [width, height]: [u32; 2], pixels: &mut [u8]) -> Result<()> {
        let area = BitMapBackend::with_buffer(pixels, (width, height)).into_drawing_area();
        for &ends in &self.lines {
            area.draw(&PathElement::new(ends, LINE.stroke_width(self.thick))).map_err(cannot)?;
        }
        area.present().map_err(cannot)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bundled;

    #[test]
    fn a_view_sees_the_taxels_that_face_it_and_that_nothing_hides() {
        let body = Body::from_bytes("humanoid", bundled::body("humanoid").unwrap()).unwrap();
        let dots = Dots::from_body(&body);
        let seen = seen(&body, &dots, &[View::Front, View::Back]);
        let facing = |view: View, taxel: usize| dots.normals[taxel].dot(view.axes()[2]) > MIN_FACING;
        for (view, seen) in [View::Front, View::Back].into_iter().zip(&seen) {
            let count = |wanted: &dyn Fn(usize) -> bool| (0..seen.len()).filter(|&taxel| wanted(taxel)).count();
            assert!(seen.iter().enumerate().all(|(taxel, seen)| !seen || facing(view, taxel)));
            let (all, visible) = (count(&|taxel| facing(view, taxel)), count(&|taxel| seen[taxel]));
            // An arm hides some of the flank, and little else is hidden.
            assert!(visible < all && visible > all / 2, "{view:?}: {visible} of {all}");
        }
        assert!(seen[0].iter().zip(&seen[1]).all(|(front, back)| !(*front && *back)));
    }
}
