//! Mirror images of places on a body's surface, in the plane y = 0 of the world.

use std::cell::OnceCell;

use glam::DVec3;

use super::link_pairs::LinkPairs;
use super::placed::{Placed, SurfacePoint};
use super::recipe::shown;
use super::rest_surface::RestSurface;
use crate::body::SurfaceIndex;
use crate::error::{Error, failed};
use crate::field::geodesic::barycentric;

/// A mirror image may be off the surface by this share of the spacing of taxels.
const REACH: f64 = 0.1;

/// `v` mirrored in the plane: a body's x is the world's y.
pub(super) fn mirrored(v: DVec3) -> DVec3 {
    DVec3::new(-v.x, v.y, v.z)
}

/// The triangles of a link, by their numbers, and their index.
type LinkIndex = (Vec<usize>, SurfaceIndex);

/// What finds the mirror images of places: on the other link of a pair, else on the same link.
pub(super) struct Mirror<'a> {
    rest_surface: &'a RestSurface<'a>,
    /// The triangles of the place, ascending.
    chosen: &'a [usize],
    pairs: LinkPairs,
    /// Per link what a taxel of it may be on.
    of_link: Vec<OnceCell<LinkIndex>>,
    /// How far images may be off the surface, m.
    reach_m: f64,
}

impl<'a> Mirror<'a> {
    /// For the triangles `chosen` of `rest_surface`, on which taxels will be about `spacing_m` apart.
    pub(super) fn new(rest_surface: &'a RestSurface<'a>, chosen: &'a [usize], spacing_m: f64) -> Self {
        let pairs = LinkPairs::new(rest_surface.body);
        let of_link = rest_surface.body.links.iter().map(|_| OnceCell::new()).collect();
        Self { rest_surface, chosen, pairs, of_link, reach_m: REACH * spacing_m }
    }

    /// The mirror image of the point at `position` of `link`, which looks along `normal`: its triangle is one of those chosen, by its
    /// number there. Where none is near that faces alike, how far off the nearest is, m.
    pub(super) fn image(&self, link: usize, position: DVec3, normal: DVec3) -> Result<Placed, f64> {
        let (triangles, index) = self.of_link(self.pairs.image(link));
        let (at, facing) = (mirrored(position), mirrored(normal));
        let hit = index.nearest_facing(at, facing).ok_or(f64::INFINITY)?;
        let off_m = hit.position.distance(at);
        if off_m > self.reach_m || hit.normal.dot(facing) <= 0.0 {
            return Err(off_m);
        }
        let triangle = triangles[hit.triangle];
        let corners = self.rest_surface.corners(self.chosen[triangle]);
        let point = SurfacePoint { position: hit.position, normal: hit.normal, area: 0.0 };
        Ok(Placed { point, triangle, barycentric: barycentric(corners, hit.position) })
    }

    /// The link of the triangle of `image`.
    pub(super) fn link_of(&self, image: &Placed) -> usize {
        self.rest_surface.link[self.chosen[image.triangle]] as usize
    }

    fn of_link(&self, link: usize) -> &LinkIndex {
        self.of_link[link].get_or_init(|| {
            let is_own = |triangle: &usize| self.rest_surface.carries(self.chosen[*triangle], link);
            let own: Vec<usize> = (0..self.chosen.len()).filter(is_own).collect();
            let corners = own.iter().map(|&triangle| self.rest_surface.corners(self.chosen[triangle]));
            let index = SurfaceIndex::of_triangles(corners);
            (own, index)
        })
    }

    /// Why there is no mirrored layout: `alone`, points of links with their normals, have no image; they are `share` of the surface.
    pub(super) fn refusal(&self, alone: &[(usize, DVec3, DVec3)], share: f64) -> Error {
        let off_m = |&(link, position, normal): &(usize, DVec3, DVec3)| {
            (link, self.image(link, position, normal).err().unwrap_or(0.0))
        };
        let worst = alone.iter().map(off_m).reduce(|worst, next| if next.1 > worst.1 { next } else { worst });
        let (link, off_m) = worst.unwrap_or_default();
        let name = |link: usize| self.rest_surface.body.links.get(link).map_or("", |link| link.name.as_str());
        let other = match self.pairs.partner(link) {
            Some(partner) => format!("link `{}`", name(partner)),
            None => "that link itself, which has no partner on the other side by its name".to_owned(),
        };
        let off = match off_m.is_finite() {
            true => format!("lies up to {} off the mirror image, in the plane y = 0, of {other}", shown(off_m)),
            false => format!("has no mirror image, as there is no surface here of {other}"),
        };
        failed!(
            "`mirror`: the two halves are not alike: link `{}` {off}; {} is allowed, and {:.1} % of the surface is farther off; leave \
             `mirror` out, or place taxels by regions that are alike",
            name(link),
            shown(self.reach_m),
            100.0 * share
        )
    }
}
