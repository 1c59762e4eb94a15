//! Maps chart coordinates to the surface.
//!
//! The surface point and normal at (u, v), such as a centroid, are interpolated bilinearly in a grid over the chart. The
//! grid is computed once from the body's triangles, at half the members' spacing, so that a frame needs no search in the
//! mesh.

use glam::{DVec2, DVec3};
use rstar::RTree;
use rstar::primitives::GeomWithData;

use super::chart::Chart;
use super::geodesic_surface::GeodesicSurface;
use super::set::{Field, anchor_from_link};
use crate::body::{Body, ChartKind, Near, Nearest};

/// Maximum number of a grid's nodes per side.
const MAX_NODES: f64 = 96.0;

/// The surface over a field's chart.
#[derive(Clone, Debug)]
pub struct Lift {
    grid: Grid,
    steepest: (f64, f64),
}

/// Nodes over a chart, at least two per side.
#[derive(Clone, Debug)]
pub struct Grid {
    pub corner: DVec2,
    pub cell_m: DVec2,
    pub columns: usize,
    pub rows: usize,
    /// The surface point less (u, v, 0), m, and the normal, both in chart axes; row by row.
    pub nodes: Vec<(DVec3, DVec3)>,
}

impl Lift {
    /// The surface over `field`'s chart; `None` if it has no chart.
    #[must_use]
    pub fn new(body: &Body, field: &Field) -> Option<Self> {
        Self::on(&Nearest::new(body), field)
    }

    /// The same, for many fields of a body.
    #[doc(hidden)]
    pub fn on(nearest: &Nearest<'_>, field: &Field) -> Option<Self> {
        let body = nearest.body();
        let chart = field.chart.as_ref().ok()?;
        let anchor = field.anchor?;
        let places: Vec<DVec2> = field.members.iter().map(|m| m.place.truncate()).collect();
        let low = places.iter().copied().fold(places[0], DVec2::min);
        let high = places.iter().copied().fold(places[0], DVec2::max);
        let step = 0.5 * field.spacing_m();
        // Centroids are within the members' bounding box; a field at one point gets a minimal grid.
        let extent = high - low;
        let cells = if step > 0.0 {
            (extent / step).ceil().clamp(DVec2::ONE, DVec2::splat(MAX_NODES - 1.0))
        } else {
            DVec2::ONE
        };
        let least = 1e-9_f64.max(field.radius_m() * 1e-9);
        let cell_m = (extent / cells).max(DVec2::splat(least));
        let (columns, rows) = (cells.x as usize + 1, cells.y as usize + 1);

        let reach = 2.0 * field.radius_m() + 1e-3;
        let surface = nearest.near(anchor, field.origin_in_anchor, reach);
        let uvs = (0..rows).flat_map(|row| (0..columns).map(move |column| (column, row)));
        let uvs = uvs.map(|(column, row)| low + cell_m * DVec2::new(column as f64, row as f64));
        let nodes = match chart.kind {
            ChartKind::Geodesic | ChartKind::Normals => {
                let curved = GeodesicSurface::new(body, field, chart.u_in_anchor, &surface);
                let node = |uv: DVec2| {
                    let (offset, normal) = curved.at(uv);
                    (chart.project(offset) - uv.extend(0.0), chart.project(normal))
                };
                uvs.map(node).collect()
            }
            ChartKind::Plane | ChartKind::None => {
                let members = field.members.iter().enumerate();
                let places = members.map(|(i, m)| GeomWithData::new(m.place.truncate().to_array(), i)).collect();
                let sampler = Sampler { body, field, chart, surface, reach, members: RTree::bulk_load(places) };
                uvs.map(|uv| sampler.at(uv)).map(|(depth, normal)| (DVec3::Z * depth, normal)).collect()
            }
        };
        let grid = Grid { corner: low, cell_m, columns, rows, nodes };
        let steepest = match chart.kind {
            ChartKind::Geodesic | ChartKind::Normals => grid.steepest_anywhere(),
            ChartKind::Plane | ChartKind::None => grid.steepest_over_plane(),
        };
        Some(Self { grid, steepest })
    }

    #[doc(hidden)]
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// Whether (u, v) is within the members' bounding box and a cell around it.
    #[must_use]
    pub fn covers(&self, uv: DVec2) -> bool {
        let Grid { corner, cell_m, columns, rows, .. } = self.grid;
        let last = DVec2::new((columns - 1) as f64, (rows - 1) as f64);
        let at = (uv - corner) / cell_m;
        at.cmpge(DVec2::NEG_ONE).all() && at.cmple(last + DVec2::ONE).all()
    }

    /// The surface point at (u, v) and its outward unit normal, in chart axes from the field's origin, m; outside the grid
    /// those of its rim.
    #[must_use]
    pub fn at(&self, uv: DVec2) -> (DVec3, DVec3) {
        let Grid { corner, cell_m, columns, rows, ref nodes } = self.grid;
        let last = DVec2::new((columns - 1) as f64, (rows - 1) as f64);
        let at = ((uv - corner) / cell_m).clamp(DVec2::ZERO, last);
        let low = at.floor().min(last - DVec2::ONE);
        let part = at - low;
        let (column, row) = (low.x as usize, low.y as usize);
        let node = |dx: usize, dy: usize| nodes[(row + dy) * columns + column + dx];
        let mix = |a: (DVec3, DVec3), b: (DVec3, DVec3), t: f64| (a.0 + (b.0 - a.0) * t, a.1 + (b.1 - a.1) * t);
        let (beyond, normal) = mix(mix(node(0, 0), node(1, 0), part.x), mix(node(0, 1), node(1, 1), part.x), part.y);
        (uv.extend(0.0) + beyond, normal.normalize_or(DVec3::Z))
    }

    /// Maximum change of point and normal per metre of (u, v): Lipschitz constants of [`Lift::at`].
    ///
    /// Along a cell's edges the interpolant is linear; inside, its gradient lies between those of opposite edges. Over a
    /// plane, a depth of slope L changes the point by √(1 + L²); else all three coordinates are taken together. A
    /// normalised vector turns by at most twice the change over the shorter length. Over a plane no node's normal falls
    /// below cos 75° along the chart's normal, hence the factor 2/0.2588; else the shortest that a cell's normals can make
    /// is found, and where they may cancel out there is no bound.
    #[must_use]
    pub fn lipschitz(&self) -> (f64, f64) {
        self.steepest
    }
}

impl Grid {
    fn steepest_over_plane(&self) -> (f64, f64) {
        let (depth, normal) = self.slopes(|beyond, _| beyond);
        ((1.0 + depth.length_squared()).sqrt(), normal.length() * 2.0 / 0.258_8)
    }

    fn steepest_anywhere(&self) -> (f64, f64) {
        let (point, normal) = self.slopes(|beyond, step| beyond + step.extend(0.0));
        let mut shortest: f64 = 1.0;
        for row in 0..self.rows - 1 {
            for column in 0..self.columns - 1 {
                let at = |dx: usize, dy: usize| self.nodes[(row + dy) * self.columns + column + dx].1;
                let corners = [at(0, 0), at(1, 0), at(0, 1), at(1, 1)];
                // The length of any mean is at least its component along their middle.
                let middle = corners.iter().sum::<DVec3>().normalize_or_zero();
                shortest = corners.iter().map(|corner| corner.dot(middle)).fold(shortest, f64::min);
            }
        }
        (point.length(), if shortest > 0.0 { normal.length() * 2.0 / shortest } else { f64::INFINITY })
    }

    /// Per direction the maximum change per metre of a node's point, computed by `of` from the change of the offset and the
    /// step in (u, v), and of the normal.
    fn slopes(&self, of: impl Fn(DVec3, DVec2) -> DVec3) -> (DVec2, DVec2) {
        let (mut point, mut normal) = (DVec2::ZERO, DVec2::ZERO);
        for (index, here) in self.nodes.iter().enumerate() {
            let right = Some(index + 1).filter(|right| right % self.columns != 0);
            for (axis, next) in [(0, right), (1, Some(index + self.columns))] {
                let Some(there) = next.and_then(|next| self.nodes.get(next)) else { continue };
                let step = DVec2::AXES[axis] * self.cell_m[axis];
                point[axis] = point[axis].max(of(there.0 - here.0, step).length() / step.length());
                normal[axis] = normal[axis].max(there.1.distance(here.1) / step.length());
            }
        }
        (point, normal)
    }
}

/// The data for a node's depth and normal over a plane chart.
struct Sampler<'a> {
    body: &'a Body,
    field: &'a Field,
    chart: &'a Chart,
    surface: Near,
    reach: f64,
    members: RTree<GeomWithData<[f64; 2], usize>>,
}

impl Sampler<'_> {
    /// Depth and normal of the surface over `uv` along the chart's normal, nearest to the members' depth there; off the
    /// surface's edge, or without a surface, those of the nearest member.
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
