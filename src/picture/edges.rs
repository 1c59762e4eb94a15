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
        let (graph, _) = TaxelGraph::of(body);
        let surface = RayTree::new(body.triangles_at_rest().into_iter().map(|(_, corners)| corners));
        let mut lines = Vec::new();
        for (index, view) in views.iter().enumerate() {
            let towards = view.axes()[2];
            let is_seen = |taxel: usize| {
                let (place, normal) = (dots.places[taxel], dots.normals[taxel]);
                let from = place + normal * (LIFT_RADII * dots.radii[taxel]);
                normal.dot(towards) > MIN_FACING && !surface.is_hit(&Ray::new(from, towards))
            };
            let seen: Vec<bool> = (0..dots.places.len()).map(is_seen).collect();
            let [left, top, width, height] = arrangement.views[index].part.map(|pixels| pixels as i32);
            let pixel = |place: DVec3| {
                let [x, y] = arrangement.pixel(index, place - middle);
                (x.round() as i32, y.round() as i32)
            };
            // A view may show less than the body.
            let is_inside = |(x, y): (i32, i32)| (left..left + width).contains(&x) && (top..top + height).contains(&y);
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
