//! Recomputes what a layout derives from the surface.

use super::lint::{SurfaceFit, drift, may_be_stale};
use super::surface_search::SurfaceSearch;
use crate::body::{Body, listed};
use crate::field::Unroller;

/// A surface farther off than this is not that of a taxel, m.
const MAX_OFF_M: f64 = 0.03;

/// Recomputes the normals of taxels that were moved and the (u, v) of geodesic charts of `body`. Values that are current,
/// as in [`lint`](super::lint), stay unchanged. Returns a line for each change, and for each chart that can no longer be
/// computed; such a chart loses its (u, v).
///
/// Positions and areas stay: a taxel off the surface gets the normal of the nearest surface point, if
/// that is within 30 mm.
pub fn refresh(body: &mut Body) -> Vec<String> {
    let mut notes = Vec::new();
    let surface_search = SurfaceSearch::from_body(body);
    let is_stale = |fit: &SurfaceFit| fit.is_stale() && fit.off_m < MAX_OFF_M;
    let fit = |(index, taxel)| Some((index, SurfaceFit::for_taxel(body, &surface_search, taxel).filter(is_stale)?));
    let stale: Vec<(usize, SurfaceFit)> = body.taxels.iter().enumerate().filter_map(fit).collect();
    if !stale.is_empty() {
        let ids: Vec<u32> = stale.iter().map(|&(index, _)| body.taxels[index].id).collect();
        notes.push(format!("normals recomputed for {} of {} taxels: {}", ids.len(), body.taxels.len(), listed(&ids)));
    }
    for (index, fit) in stale {
        body.taxels[index].normal_in_link = fit.normal_in_link;
    }
    let mut fields = body.fields.clone();
    let mut unroller = Unroller::new(body);
    for spec in fields.iter_mut().filter(|spec| may_be_stale(body, spec)) {
        if drift(&mut unroller, spec) == Some(0.0) {
            continue;
        }
        match unroller.unroll(spec) {
            Ok(current) => {
                notes.push(format!("chart of field `{}` recomputed", spec.name));
                *spec = current;
            }
            Err(why) => {
                notes.push(format!("field `{}` lost its stored chart: {why}", spec.name));
                spec.members.values_mut().for_each(|member| member.uv = None);
            }
        }
    }
    body.fields = fields;
    notes
}
