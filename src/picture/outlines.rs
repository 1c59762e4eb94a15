//! Outlines of taxels under something thin, such as a cover: it hides their discs, and they still feel through it.

use std::f64::consts::TAU;

use glam::DVec3;
use plotters::prelude::*;

use super::shape::Dots;
use super::view::{Arrangement, View};
use crate::body::{Body, Ray, RayTree};
use crate::error::Result;
use crate::ink::cannot;

/// A taxel is seen from directions within this cosine of its normal.
const MIN_FACING: f64 = 0.05;
/// Discs are drawn so far towards the eye, in their radii: what is lower does not hide them.
const LIFT_RADII: f64 = 0.7;
/// What is lower over a taxel than this is its own surface, in radii of its disc.
const OWN_RADII: f64 = 0.2;
/// What hides a taxel is thin if it is lower than this over it, in typical distances of neighbours.
const THIN_SPACINGS: f64 = 1.0;
/// Corners of an outline.
const CORNERS: usize = 24;
/// From this radius on an outline has a rim, pixels.
const MIN_RIM_RADIUS: f64 = 4.0;

/// The outlines of a picture, pixels.
pub(super) struct Outlines {
    /// By outline, its taxel and its corners.
    circles: Vec<(usize, Vec<(i32, i32)>)>,
    has_rims: bool,
}

impl Outlines {
    /// For the taxels of `body` that something thin hides from `views`; `middle` is what these look at.
    pub(super) fn new(body: &Body, dots: &Dots, views: &[View], arrangement: &Arrangement, middle: DVec3) -> Self {
        let surface = RayTree::new(body.triangles_at_rest().into_iter().map(|(_, corners)| corners));
        let mut circles = Vec::new();
        for (index, view) in views.iter().enumerate() {
            let towards = view.axes()[2];
            for taxel in (0..dots.places.len()).filter(|&taxel| is_under_thin(&surface, dots, taxel, towards)) {
                let (across, along) = dots.normals[taxel].any_orthonormal_pair();
                let corner = |corner: usize| {
                    let (sine, cosine) = (TAU * corner as f64 / CORNERS as f64).sin_cos();
                    let place = dots.places[taxel] + dots.radii[taxel] * (cosine * across + sine * along);
                    let [x, y] = arrangement.pixel(index, place - middle);
                    (x.round() as i32, y.round() as i32)
                };
                let circle: Vec<(i32, i32)> = (0..=CORNERS).map(corner).collect();
                if circle.iter().all(|&at| arrangement.views[index].holds(at)) {
                    circles.push((taxel, circle));
                }
            }
        }
        Self { circles, has_rims: dots.mean_radius() * arrangement.scale >= MIN_RIM_RADIUS }
    }

    /// Draws them into a picture of `size`: `colours` gives a taxel's own colour and that of its rim.
    pub(super) fn draw(
        &self,
        colours: impl Fn(usize) -> [[u8; 3]; 2],
        [width, height]: [u32; 2],
        pixels: &mut [u8],
    ) -> Result<()> {
        if self.circles.is_empty() {
            return Ok(());
        }
        let area = BitMapBackend::with_buffer(pixels, (width, height)).into_drawing_area();
        for (taxel, circle) in &self.circles {
            let [own, rim] = colours(*taxel).map(|[r, g, b]| RGBColor(r, g, b));
            let lines: &[(RGBColor, u32)] = if self.has_rims { &[(rim, 4), (own, 2)] } else { &[(own, 1)] };
            for (colour, thick) in lines {
                area.draw(&PathElement::new(circle.clone(), colour.stroke_width(*thick))).map_err(cannot)?;
            }
        }
        area.present().map_err(cannot)
    }
}

/// Whether `surface` hides a taxel that looks towards an eye, and only by what lies low over it: a bulge beside a taxel that is
/// seen from its side is none.
fn is_under_thin(surface: &RayTree, dots: &Dots, taxel: usize, towards: DVec3) -> bool {
    let (place, normal) = (dots.places[taxel], dots.normals[taxel]);
    let is_hit = |from: DVec3, way: DVec3| surface.is_hit(&Ray::new(from, way));
    normal.dot(towards) > MIN_FACING
        && is_hit(place + LIFT_RADII * dots.radii[taxel] * towards, towards)
        && is_hit(place + OWN_RADII * dots.radii[taxel] * normal, normal)
        && !is_hit(place + THIN_SPACINGS * dots.spacing_m() * normal, towards)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A square of `half` m to each side of the middle, `height` m above it.
    fn plate(half: f64, height: f64) -> [[DVec3; 3]; 2] {
        let corner = |x: f64, y: f64| DVec3::new(x * half, y * half, height);
        let [a, b, c, d] = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
        [[a, b, c], [a, c, d]]
    }

    #[test]
    fn only_what_is_thin_over_a_taxel_lets_its_outline_through() {
        // 10 mm apart: radii of 4 mm.
        let places = (0..25).map(|i| 0.01 * DVec3::new(f64::from(i % 5 - 2), f64::from(i / 5 - 2), 0.0)).collect();
        let dots = Dots::at(places, vec![DVec3::Z; 25], 0.05);
        let outlined = |plates: &[(f64, f64)], towards: DVec3| {
            let surface = RayTree::new(plates.iter().flat_map(|&(half, height)| plate(half, height)));
            (0..25).filter(|&taxel| is_under_thin(&surface, &dots, taxel, towards)).count()
        };
        let ground = (0.03, 0.0);
        assert_eq!(outlined(&[ground], DVec3::Z), 0, "nothing hides them");
        assert_eq!(outlined(&[ground, (0.03, 0.006)], DVec3::Z), 25, "a cover");
        assert_eq!(outlined(&[ground, (0.015, 0.006)], DVec3::Z), 9, "a cover of a part");
        assert_eq!(outlined(&[ground, (0.03, 0.002)], DVec3::Z), 0, "discs are drawn over it");
        assert_eq!(outlined(&[ground, (0.03, 0.012)], DVec3::Z), 0, "too far away");
        assert_eq!(outlined(&[ground, (0.03, 0.006), (0.03, 0.05)], DVec3::Z), 0, "something else hides both");
        assert_eq!(outlined(&[ground, (0.03, 0.006)], DVec3::NEG_Z), 0, "they look away");
        // Seen from far to the side, the edge of the cover hides some that it is not over.
        let aside = DVec3::new(-2.0, 0.0, 1.0).normalize();
        assert_eq!(outlined(&[ground, (0.015, 0.006)], aside), 6);
    }
}
