//! From chart coordinates back to the surface.
//!
//! A centroid is a point (u, v) of a chart; where that is on the skin, and which way the skin looks there, is read from
//! a grid over the chart that holds the surface's depth and normal at its nodes, bilinear in between. The grid is made
//! once from the body's triangles, at half the members' spacing, so that a frame costs a few multiplications instead of
//! a search through the mesh.

use glam::{DVec2, DVec3};

use rstar::RTree;
use rstar::primitives::GeomWithData;

use super::{Chart, Field, anchor_from_link};
use crate::body::{Body, SurfaceIndex};

/// A field's grid has at most this many nodes a side.
const MOST_NODES: f64 = 96.0;

/// The surface over a field's chart.
#[derive(Clone, Debug)]
pub struct Lift {
    corner: DVec2,
    cell_m: DVec2,
    columns: usize,
    rows: usize,
    /// Depth along the chart's normal, m, and the normal in chart axes; row by row.
    nodes: Vec<(f64, DVec3)>,
    steepest: (f64, f64),
}

impl Lift {
    /// The surface over `field`'s chart, or `None` where it has no chart.
    #[must_use]
    pub fn new(body: &Body, field: &Field) -> Option<Self> {
        let chart = field.chart.as_ref().ok()?;
        let anchor = field.anchor?;
        let places: Vec<DVec2> = field.members.iter().map(|m| m.place.truncate()).collect();
        let low = places.iter().copied().fold(places[0], DVec2::min);
        let high = places.iter().copied().fold(places[0], DVec2::max);
        let step = 0.5 * field.spacing_m();
        // Centroids lie within the members' box; a point field still gets a grid of its own.
        let extent = high - low;
        let cells = if step > 0.0 {
            (extent / step).ceil().clamp(DVec2::ONE, DVec2::splat(MOST_NODES - 1.0))
        } else {
            DVec2::ONE
        };
        let least = 1e-9_f64.max(field.radius_m() * 1e-9);
        let cell_m = (extent / cells).max(DVec2::splat(least));
        let (columns, rows) = (cells.x as usize + 1, cells.y as usize + 1);

        let reach = 2.0 * field.radius_m() + 1e-3;
        let members = field.members.iter().enumerate();
        let sampler = Sampler {
            body,
            field,
            chart,
            surface: body.surface_in_link(anchor, Some((field.origin_in_anchor, reach))),
            reach,
            members: RTree::bulk_load(
                members.map(|(i, m)| GeomWithData::new(m.place.truncate().to_array(), i)).collect(),
            ),
        };
        let mut nodes = Vec::with_capacity(columns * rows);
        for row in 0..rows {
            for column in 0..columns {
                let uv = low + cell_m * DVec2::new(column as f64, row as f64);
                nodes.push(sampler.at(uv));
            }
        }
        let mut lift = Self { corner: low, cell_m, columns, rows, nodes, steepest: (0.0, 0.0) };
        lift.steepest = lift.steepest_change();
        Some(lift)
    }

    /// Depth (m) and outward unit normal, in chart axes, of the surface over (u, v); beyond the grid, those of its rim.
    #[must_use]
    pub fn at(&self, uv: DVec2) -> (f64, DVec3) {
        let last = DVec2::new((self.columns - 1) as f64, (self.rows - 1) as f64);
        let at = ((uv - self.corner) / self.cell_m).clamp(DVec2::ZERO, last);
        let low = at.floor().min(last - DVec2::ONE).max(DVec2::ZERO);
        let part = at - low;
        let (column, row) = (low.x as usize, low.y as usize);
        let node = |dx: usize, dy: usize| {
            self.nodes[(row + dy).min(self.rows - 1) * self.columns + (column + dx).min(self.columns - 1)]
        };
        let mix = |a: (f64, DVec3), b: (f64, DVec3), t: f64| (a.0 + (b.0 - a.0) * t, a.1 + (b.1 - a.1) * t);
        let (depth, normal) = mix(mix(node(0, 0), node(1, 0), part.x), mix(node(0, 1), node(1, 1), part.x), part.y);
        (depth, normal.normalize_or(DVec3::Z))
    }

    /// How much depth and normal change at most per metre of (u, v): Lipschitz constants of [`Lift::at`].
    ///
    /// Along a cell's edges the interpolant is linear; inside, its gradient lies between those of opposite edges. A
    /// normalised vector turns by at most twice the change over the shorter length, and no node's normal falls below
    /// cos 75° along the chart's normal, hence the factor 2/0.2588.
    #[must_use]
    pub fn lipschitz(&self) -> (f64, f64) {
        self.steepest
    }

    fn steepest_change(&self) -> (f64, f64) {
        let (mut depth, mut normal) = (DVec2::ZERO, DVec2::ZERO);
        for row in 0..self.rows {
            for column in 0..self.columns {
                let here = self.nodes[row * self.columns + column];
                if column + 1 < self.columns {
                    let right = self.nodes[row * self.columns + column + 1];
                    depth.x = depth.x.max((right.0 - here.0).abs() / self.cell_m.x);
                    normal.x = normal.x.max(right.1.distance(here.1) / self.cell_m.x);
                }
                if row + 1 < self.rows {
                    let above = self.nodes[(row + 1) * self.columns + column];
                    depth.y = depth.y.max((above.0 - here.0).abs() / self.cell_m.y);
                    normal.y = normal.y.max(above.1.distance(here.1) / self.cell_m.y);
                }
            }
        }
        (depth.length(), normal.length() * 2.0 / 0.258_8)
    }
}

/// What a node's depth and normal are made from.
struct Sampler<'a> {
    body: &'a Body,
    field: &'a Field,
    chart: &'a Chart,
    surface: SurfaceIndex,
    reach: f64,
    members: RTree<GeomWithData<[f64; 2], usize>>,
}

impl Sampler<'_> {
    /// Depth and normal of the surface over `uv`: where the line along the chart's normal meets it, nearest to the
    /// members' own depth there; off the surface's edge, or without a surface, those of the nearest member.
    fn at(&self, uv: DVec2) -> (f64, DVec3) {
        let nearest = self.members.nearest_neighbor(uv.to_array()).expect("a field has members").data;
        let nearest = &self.field.members[nearest];
        let start = self.field.origin_in_anchor + self.chart.unproject(uv.extend(nearest.place.z));
        match self.surface.along(start, self.chart.normal_in_anchor, self.reach) {
            Some(hit) => {
                (self.chart.project(hit.position - self.field.origin_in_anchor).z, self.chart.project(hit.normal))
            }
            None => {
                let taxel = &self.body.taxels[nearest.taxel];
                let anchor_from_link = anchor_from_link(self.body, self.field.anchor, taxel.link);
                (nearest.place.z, self.chart.project(anchor_from_link.transform_vector3(taxel.normal_in_link)))
            }
        }
    }
}
