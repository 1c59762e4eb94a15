//! Fills a place of a recipe with the same taxels on its two sides.

use super::borders::Borders;
use super::fill::{Fill, Filled, Surface};
use super::ground::{Ground, Rules};
use super::half::Half;
use super::mirror::Mirror;
use super::place::widest_radius;
use super::placed::{Placed, Progress};
use super::recipe::Placement;
use crate::body::Topology;
use crate::error::{Error, Result, failed};
use crate::field::geodesic::barycentric;

/// Progress when the taxels of the left half are placed.
const PROGRESS_HALF: f64 = 0.8;

impl Fill<'_> {
    /// Taxels on the left half of the triangles `chosen`, each followed by its mirror image.
    pub(super) fn sample_mirrored(&self, chosen: &[usize], progress: Progress<'_>) -> Result<Filled> {
        let count = self.mirrored_count()?;
        let rest_surface = self.rest_surface;
        let area_m2: f64 = chosen.iter().map(|&triangle| rest_surface.area(triangle)).sum();
        let mirror = Mirror::new(rest_surface, chosen, 2.0 * widest_radius(area_m2, count));
        let whole = self.surface(chosen);
        let borders = || self.clear_m.map(|clear_m| Borders::new(rest_surface, chosen, &whole.topology, clear_m));

        let half = Half::new(rest_surface, chosen);
        if half.triangles.is_empty() {
            return Err(Error::failed(
                "`mirror`: there is no surface to the left of the plane y = 0, in which taxels are mirrored; move the body \
                 across it",
            ));
        }
        let Half { positions, triangles, chosen: of_half, .. } = &half;
        let topology = Topology::of_groups(positions, triangles, &|vertex| half.group_of(vertex));
        let left = Surface { positions, triangles: triangles.clone(), chosen: of_half, topology };
        let touchable = self.touchable;
        let rules = Rules { rest_surface, chosen: of_half, touchable, borders: borders(), mirror: Some(&mirror) };
        let mut filled = Filled { is_mirrored: true, ..Filled::default() };
        let tick = &mut |share| progress(0.5 * PROGRESS_HALF * share);
        let ground = Ground::new(rules, positions, triangles, count / 2, tick)?;
        let tick = &mut |share| progress(PROGRESS_HALF * (0.5 + 0.5 * share));
        let placed = self.evenly(&left, &ground, count / 2, &mut filled.notes, tick)?;

        let mut both = Vec::with_capacity(count);
        let mut alone = Vec::new();
        for one in placed {
            let triangle = of_half[one.triangle];
            let (link, point) = (rest_surface.link[triangle] as usize, one.point);
            match mirror.image(link, point.position, point.normal) {
                Ok(image) => {
                    let number = chosen.binary_search(&triangle).unwrap_or(0);
                    let barycentric = barycentric(rest_surface.corners(triangle), point.position);
                    both.extend([Placed { triangle: number, barycentric, ..one }, image]);
                }
                Err(_) => alone.push((link, point.position, point.normal)),
            }
        }
        if !alone.is_empty() {
            return Err(mirror.refusal(&alone, 2.0 * alone.len() as f64 / count as f64));
        }
        let rules = Rules { rest_surface, chosen, touchable, borders: borders(), mirror: None };
        let tick = &mut |share| progress(PROGRESS_HALF + (1.0 - PROGRESS_HALF) * share);
        let whole_ground = Ground::new(rules, whole.positions, &whole.triangles, count, tick)?;
        self.set_areas(&whole, &whole_ground, None, both, &mut filled);
        if let Some(alone) = self.listed_areas(&ground.alone_m2()) {
            let name = &self.place.name;
            filled.notes.push(format!(
                "place `{name}`: surface without a mirror image gets no taxel: {alone} of the left half"
            ));
        }
        Ok(filled)
    }

    /// How many taxels a mirrored place gets.
    fn mirrored_count(&self) -> Result<usize> {
        let Placement::Evenly { count, apart_m: None } = self.place.how else {
            return Err(Error::failed(
                "`mirror` is for a number of `taxels`, without `spacing` and `density`; leave it out, or give their number",
            ));
        };
        if self.is_scattered {
            return Err(Error::failed("`mirror` is for taxels that are spread evenly; leave it or `even` out"));
        }
        if count % 2 == 1 {
            let (less, more) = (count - 1, count + 1);
            let fewer = if less > 0 { format!("{less} or ") } else { String::new() };
            return Err(failed!(
                "`mirror` makes pairs, so it needs an even number of taxels; ask for {fewer}{more}, not {count}"
            ));
        }
        Ok(count)
    }
}
