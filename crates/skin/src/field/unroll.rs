//! Computes geodesic charts: the (u, v) of a field's taxels that a layout stores.

use std::f64::consts::PI;

use glam::{DVec2, DVec3};

use super::by_normals;
use super::chart::NoChart;
use super::distortion::Distortion;
use super::geodesic::{FIRST_LIMIT, LogMap, MAX_WINDOWS, SurfacePlace};
use super::link_surface::Surfaces;
use crate::body::{Body, ChartKind, ChartSpec, FieldSpec, Topology, area_vector, tangent_frame};

/// Maximum bend of a path at one point, 20°.
const MAX_BEND: f64 = PI / 9.0;

/// Maximum stretch of the distance of neighbours.
const MAX_STRETCH: f64 = 3.0;

/// How often the limit is doubled before a member counts as unreachable.
const MAX_DOUBLINGS: u32 = 6;

/// Minimum distance of an origin from the edges of its triangle, as a share of its height: far above rounding errors.
const EDGE_MARGIN: f64 = 1e-6;

/// Computes geodesic charts on a body's surface.
pub struct Unroller<'a> {
    body: &'a Body,
    surfaces: Surfaces<'a>,
    /// How many windows charts may still take; without it each map has a limit of its own.
    windows_left: Option<usize>,
}

impl<'a> Unroller<'a> {
    /// For `body`; surfaces are computed on demand.
    #[must_use]
    pub fn new(body: &'a Body) -> Self {
        Self { body, surfaces: Surfaces::new(body), windows_left: None }
    }

    /// How many windows charts may take from now on, to bound the time on meshes that are fine or have very thin triangles;
    /// `None` for as many as each needs.
    #[doc(hidden)]
    pub fn windows_left(&mut self) -> &mut Option<usize> {
        &mut self.windows_left
    }

    #[doc(hidden)]
    pub fn surfaces(&mut self) -> &mut Surfaces<'a> {
        &mut self.surfaces
    }

    /// `spec` with a geodesic chart, or with one by normals if it asks for that, and its own members' (u, v). The origin and the direction
    /// of +u are those of `spec`'s chart, else the defaults of a plane chart. A parent needs its descendants' taxels among its own:
    /// [`FieldSpec::with_members`].
    ///
    /// # Errors
    /// Why there is no such chart.
    pub fn unroll(&mut self, spec: &FieldSpec) -> Result<FieldSpec, NoChart> {
        let body = self.body;
        if spec.chart.is_some_and(|chart| chart.kind == ChartKind::Normals) {
            return by_normals::unroll(body, spec);
        }
        let (link, taxels) = by_normals::taxels_on_one_link(body, spec)?;
        let point = |&taxel: &usize| (body.taxels[taxel].position_in_link, body.taxels[taxel].normal_in_link);
        let members: Vec<(DVec3, DVec3)> = taxels.iter().map(point).collect();
        let surface = self.surfaces.in_link(link);
        let topology = &surface.topology;
        let locate = |(p, normal): (DVec3, DVec3)| surface.locate(p, normal).ok_or(NoChart::NoSurface);

        let asked = |of: fn(&ChartSpec) -> Option<[f64; 3]>| spec.chart.as_ref().and_then(of).map(DVec3::from_array);
        let mean = members.iter().map(|(position, _)| *position).sum::<DVec3>() / members.len() as f64;
        let places: Vec<SurfacePlace> = members.iter().copied().map(locate).collect::<Result<_, _>>()?;
        let ids = taxels.iter().map(|&taxel| body.taxels[taxel].id).collect();
        let patch = Patch { topology, members, places, ids, u: asked(|chart| chart.u_in_anchor) };
        let origin = asked(|chart| chart.origin_in_anchor);
        let nearest = surface.nearest(origin.unwrap_or(mean)).ok_or(NoChart::NoSurface)?;
        let left = &mut self.windows_left;
        match patch.chart_around(spec, off_edges(nearest), left) {
            // The mean of a bent field is off the surface, and the nearest point may be on another part.
            Err(why) if origin.is_none() => {
                patch.chart_around(spec, off_edges(patch.middle(mean)), left).map_err(|other| match why {
                    NoChart::Unreachable(..) => other,
                    why => why,
                })
            }
            laid => laid,
        }
    }
}

/// `place`, moved off the edges of its triangle, so that a chart computed from the stored origin is the same.
fn off_edges(place: SurfacePlace) -> SurfacePlace {
    if place.barycentric.iter().all(|&weight| weight >= 0.5 * EDGE_MARGIN) {
        return place;
    }
    let inward = place.barycentric.map(|weight| weight.max(0.0) + EDGE_MARGIN);
    let sum: f64 = inward.iter().sum();
    SurfacePlace { barycentric: inward.map(|weight| weight / sum), ..place }
}

struct Patch<'a> {
    topology: &'a Topology,
    /// Per member its position and normal.
    members: Vec<(DVec3, DVec3)>,
    places: Vec<SurfacePlace>,
    ids: Vec<u32>,
    u: Option<DVec3>,
}

impl Patch<'_> {
    /// The place of the member nearest to `mean`, preferably with a normal like the mean.
    fn middle(&self, mean: DVec3) -> SurfacePlace {
        let facing = self.members.iter().map(|(_, normal)| *normal).sum::<DVec3>().normalize_or_zero();
        let off = |i: usize| self.members[i].0.distance(mean) * (2.0 - self.members[i].1.dot(facing));
        let middle = (0..self.members.len()).min_by(|&a, &b| off(a).total_cmp(&off(b)));
        self.places[middle.unwrap_or(0)]
    }

    /// `spec` with a geodesic chart around `origin`.
    fn chart_around(
        &self,
        spec: &FieldSpec,
        origin: SurfacePlace,
        left: &mut Option<usize>,
    ) -> Result<FieldSpec, NoChart> {
        let Self { topology, members, places, ids, u } = self;
        let normal = area_vector(topology.corners(origin.triangle)).normalize_or(DVec3::Z);
        let [u, ..] = tangent_frame(normal, *u);
        let part = |place: &SurfacePlace| topology.part[place.triangle as usize];
        let beyond: Vec<usize> = (0..places.len()).filter(|&i| part(&places[i]) != part(&origin)).collect();
        let id = |i: usize| ids[i];
        if let Some(&first) = beyond.first() {
            return Err(NoChart::Unreachable(id(first), beyond.len()));
        }
        let from = origin.position(topology);
        let farthest = members.iter().map(|(position, _)| position.distance(from)).fold(0.0, f64::max);
        let mut limit = farthest * FIRST_LIMIT;
        let mut doublings = 0;
        let (map, reached) = loop {
            let mut own = MAX_WINDOWS;
            let map = LogMap::with_windows(topology, origin, u, limit, left.as_mut().unwrap_or(&mut own));
            let map = map.map_err(|why| NoChart::TooRough(why.to_string()))?;
            let reached: Vec<_> = places.iter().map(|place| map.reach(place)).collect();
            // A path beyond the limit may not be the shortest.
            let out: Vec<usize> =
                (0..reached.len()).filter(|&i| reached[i].is_none_or(|way| way.distance_m > limit)).collect();
            match out[..] {
                [] => break (map, reached),
                [first, ..] if doublings == MAX_DOUBLINGS => return Err(NoChart::Unreachable(id(first), out.len())),
                _ => (limit, doublings) = (2.0 * limit, doublings + 1),
            }
        };
        let ways: Vec<_> = reached.into_iter().flatten().collect();
        let uv: Vec<DVec2> = ways.iter().map(|way| way.uv).collect();
        let distortion = Distortion::measure(members, &uv);
        let nearest = |i: usize| {
            let others = members.iter().map(|(position, _)| position.distance(members[i].0)).filter(|&d| d > 0.0);
            others.fold(f64::INFINITY, f64::min)
        };
        for (i, way) in ways.iter().enumerate() {
            if way.bend_rad > MAX_BEND {
                return Err(NoChart::Bent(id(i), way.bend_rad));
            }
            // The taxel's place in the chart is ambiguous by more than the distance to its neighbour.
            if let Some(rival) = way.rival
                && rival.distance_m - way.distance_m < 0.5 * nearest(i)
                && 2.0 * way.distance_m * (rival.apart_rad / 2.0).sin() > nearest(i)
            {
                return Err(NoChart::CutLocus { taxel: id(i), distance_m: way.distance_m });
            }
        }
        if let Some((a, b, factor)) = distortion.worst.filter(|&(.., factor)| factor > MAX_STRETCH) {
            return Err(NoChart::Torn(id(a), id(b), factor));
        }

        let [origin, u, ..] = map.frame();
        let mut spec = spec.clone();
        spec.chart = Some(ChartSpec {
            kind: ChartKind::Geodesic,
            origin_in_anchor: Some(origin.to_array()),
            u_in_anchor: Some(u.to_array()),
        });
        for (i, uv) in uv.iter().enumerate() {
            if let Some(member) = spec.members.get_mut(&id(i)) {
                member.uv = Some(uv.to_array());
            }
        }
        Ok(spec)
    }
}
