//! Taxels around the base of a touch, laid out in its chart; and places of the chart on the skin again.

use glam::{DQuat, DVec2, DVec3};

use super::chart::{self, WRAPPED_COSINE};
use super::skin::Skin;

/// Some taxels in the chart of a touch.
#[derive(Clone, Debug, Default)]
pub struct Unrolled {
    base: u32,
    axes: [DVec3; 2],
    /// The taxels, as ascending nodes.
    pub nodes: Vec<u32>,
    /// Their places (u, v), m.
    pub places_m: Vec<DVec2>,
}

impl Skin {
    /// +u, +v and the normal of the chart that is based at `base`, whose u is that of `link`, on the body at rest.
    pub(crate) fn chart_axes(&self, base: u32, link: u32) -> [DVec3; 3] {
        let normal = self.taxel(base).mean_normal;
        let [u, v] = chart::directions(normal, self.axes_of(link));
        [u, v, normal]
    }

    /// The taxels `nodes` in the chart that is based at `base`, whose u is that of `link`; those on the other side of a limb, over 120°
    /// from the base, are left out.
    #[must_use]
    pub fn unrolled(&self, base: u32, link: u32, nodes: impl IntoIterator<Item = u32>) -> Unrolled {
        let axes = chart::directions(self.taxel(base).mean_normal, self.axes_of(link));
        let mut unrolled = Unrolled { base, axes, ..Unrolled::default() };
        for node in nodes {
            let taxel = self.taxel(node);
            if let Some(place_m) = self.place_in_chart(base, axes, taxel.position, taxel.mean_normal) {
                unrolled.nodes.push(node);
                unrolled.places_m.push(place_m);
            }
        }
        unrolled
    }

    /// Where a point of the skin with this normal, on the body at rest, is in the chart that is based at `base`, along its `axes`, m;
    /// `None` where it is on the other side of a limb, over 120° from the base.
    pub(crate) fn place_in_chart(
        &self,
        base: u32,
        axes: [DVec3; 2],
        position: DVec3,
        mean_normal: DVec3,
    ) -> Option<DVec2> {
        let origin = self.taxel(base);
        (mean_normal.dot(origin.mean_normal) >= WRAPPED_COSINE).then(|| {
            let place = chart::place(position - origin.position, origin.mean_normal, mean_normal);
            DVec2::new(place.dot(axes[0]), place.dot(axes[1]))
        })
    }
}

impl Unrolled {
    /// Cosine of the angle between the mean normals of `node` and of the base.
    #[must_use]
    pub fn cosine_to_base(&self, skin: &Skin, node: u32) -> f64 {
        skin.taxel(node).mean_normal.dot(skin.taxel(self.base).mean_normal)
    }

    /// Where `place_m` of the chart is on the skin, within the cells of the taxels, and the direction at `angle_rad` there; both on
    /// the body at rest. It is laid down from the nearest of the taxels, so that little of the chart lies between.
    #[must_use]
    pub fn on_skin(&self, skin: &Skin, place_m: DVec2, angle_rad: Option<f64>) -> (DVec3, Option<DVec3>) {
        let far = |place: &DVec2| place.distance_squared(place_m);
        let nearest = (0..self.nodes.len()).min_by(|a, b| far(&self.places_m[*a]).total_cmp(&far(&self.places_m[*b])));
        let (node, from) = nearest.map_or((self.base, DVec2::ZERO), |at| (self.nodes[at], self.places_m[at]));
        let taxel = skin.taxel(node);
        let turn = DQuat::from_rotation_arc(skin.taxel(self.base).mean_normal, taxel.mean_normal);
        let in_space = |way: DVec2| turn * (self.axes[0] * way.x + self.axes[1] * way.y);
        let place = taxel.position + in_space(place_m - from);
        let cells = std::iter::once(node).chain(self.nodes.iter().copied().filter(|&other| other != node));
        let on_surface = skin.surface().nearest(cells.map(|node| skin.cell_of(node)), place);
        let along = angle_rad.map(|angle| in_space(DVec2::new(libm::cos(angle), libm::sin(angle))));
        (on_surface.map_or(place, |nearest| nearest.position), along)
    }
}
