//! What is derived from the surface, derived again.

use super::ground::Ground;
use super::lint::checks::{Footing, drift};
use super::lint::listed;
use crate::body::{Body, ChartKind};
use crate::field::Unroller;

/// Brings up to date what `body` stores and its surface gives: the normals of taxels that were moved, and the (u, v) of
/// geodesic charts. What is current, as [`lint`](super::lint) has it, keeps its bits. A line each of what changed, and
/// of charts that can no longer be laid; those lose their (u, v), so that nothing wrong is felt.
///
/// Positions are the author's: a taxel off the surface stays there and takes the normal of the nearest surface. Areas
/// stay too.
pub fn refresh(body: &mut Body) -> Vec<String> {
    let mut notes = Vec::new();
    let ground = Ground::of(body);
    let stale: Vec<_> = body
        .taxels
        .iter()
        .enumerate()
        .filter_map(|(index, taxel)| {
            let footing = Footing::of(body, &ground, taxel).filter(Footing::is_stale)?;
            Some((index, footing.normal_in_link))
        })
        .collect();
    drop(ground);
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
