//! Recomputes what a layout derives from the surface.

use super::lint::checks::{SurfaceFit, drift};
use super::lint::listed;
use super::surface_search::SurfaceSearch;
use crate::body::{Body, ChartKind};
use crate::field::Unroller;

/// Recomputes the normals of taxels that were moved and the (u, v) of geodesic charts of `body`. Values that are current,
/// as in [`lint`](super::lint), stay unchanged. Returns a line for each change, and for each chart that can no longer be
/// computed; such a chart loses its (u, v).
///
/// Positions and areas stay: a taxel off the surface gets the normal of the nearest surface point.
pub fn refresh(body: &mut Body) -> Vec<String> {
    let mut notes = Vec::new();
    let surface_search = SurfaceSearch::of(body);
    let stale: Vec<_> = body
        .taxels
        .iter()
        .enumerate()
        .filter_map(|(index, taxel)| {
            let fit = SurfaceFit::of(body, &surface_search, taxel).filter(SurfaceFit::is_stale)?;
            Some((index, fit.normal_in_link))
        })
        .collect();
    drop(surface_search);
    if !stale.is_empty() {
        let ids: Vec<u32> = stale.iter().map(|&(index, _)| body.taxels[index].id).collect();
        notes.push(format!(
            "normals worked out again for {} of {} taxels: {}",
            ids.len(),
            body.taxels.len(),
            listed(&ids)
        ));
    }
    for (index, normal) in stale {
        body.taxels[index].normal_in_link = normal;
    }
    let mut laid = Vec::new();
    {
        let mut unroller = Unroller::new(body);
        for (index, spec) in body.fields.iter().enumerate() {
            let geodesic = spec.chart.is_some_and(|chart| chart.kind == ChartKind::Geodesic);
            if !geodesic || body.surfaces.is_empty() || drift(&mut unroller, spec) == Some(0.0) {
                continue;
            }
            match unroller.unroll(spec) {
                Ok(anew) => {
                    notes.push(format!("field `{}` charted again", spec.name));
                    laid.push((index, anew));
                }
                Err(why) => {
                    notes.push(format!("field `{}` has lost its geodesic chart: {why}", spec.name));
                    let mut without = spec.clone();
                    without.members.values_mut().for_each(|member| member.uv = None);
                    laid.push((index, without));
                }
            }
        }
    }
    for (index, spec) in laid {
        body.fields[index] = spec;
    }
    notes
}
