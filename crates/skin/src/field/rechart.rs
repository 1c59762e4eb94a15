//! Fields of a body with charts of another kind.

use super::chart::NoChart;
use super::set::{Field, FieldSet, unions};
use super::unroll::Unroller;
use crate::body::{Body, ChartKind, ChartSpec, FieldSpec};
use crate::error::Result;

/// Fields with other charts than the layout's, and those that could not have one.
#[derive(Clone)]
pub struct Recharted {
    /// All fields.
    pub fields: FieldSet,
    /// Names of unchanged fields, and why.
    pub kept: Vec<(String, NoChart)>,
}

impl FieldSet {
    /// These fields of `body`, with charts of `kind` for the fields `which`, with the same origins and directions. Fields that
    /// cannot have one, or that request none, stay unchanged.
    #[doc(hidden)]
    pub fn recharted(&self, body: &Body, which: &[usize], kind: ChartKind) -> Result<Recharted> {
        let mut specs = body.fields.clone();
        let taxels = unions(&specs);
        let mut unroller = Unroller::new(body);
        let mut kept = Vec::new();
        for &index in which {
            let field = &self.fields[index];
            let other = match &field.chart {
                Ok(chart) if chart.kind == kind => continue,
                Err(NoChart::ByChoice) => continue,
                _ => FieldSpec { chart: Some(spec(field, kind)), ..specs[index].clone() },
            };
            let made = match kind {
                ChartKind::Geodesic => unroller.unroll(&other.with_members(taxels[index].iter().copied())),
                _ => self.plane(body, index, other),
            };
            match made {
                Ok(spec) => specs[index] = spec,
                // A field that had no chart before is not reported.
                Err(why) if field.chart.is_ok() => kept.push((field.name.clone(), why)),
                Err(_) => {}
            }
        }
        Ok(Recharted { fields: Self::from_specs(body, &specs)?, kept })
    }

    /// `spec` of field `index`, if it can have a plane chart.
    fn plane(&self, body: &Body, index: usize, spec: FieldSpec) -> std::result::Result<FieldSpec, NoChart> {
        let taxels: Vec<usize> = self.fields[index].members.iter().map(|member| member.taxel).collect();
        let alone = FieldSpec { parent: None, ..spec.clone() }.with_members(taxels.iter().map(|&t| body.taxels[t].id));
        let made = Self::from_specs(body, &[alone]).ok().and_then(|mut set| set.fields.pop());
        made.map_or(Err(NoChart::NoTaxels), |field| field.chart.map(|_| spec))
    }
}

/// A chart of `kind` with the origin and direction of `field`'s.
fn spec(field: &Field, kind: ChartKind) -> ChartSpec {
    match &field.chart {
        Ok(chart) => ChartSpec {
            kind,
            origin_in_anchor: Some(field.origin_in_anchor.to_array()),
            u_in_anchor: Some(chart.u_in_anchor.to_array()),
        },
        Err(_) => ChartSpec { kind, origin_in_anchor: None, u_in_anchor: None },
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use somatic_bodies as bundled;

    fn recharted(bytes: &[u8], kind: ChartKind) -> (FieldSet, Recharted) {
        let body = Body::from_bytes("body.glb", bytes).unwrap();
        let fields = FieldSet::new(&body).unwrap();
        let all: Vec<usize> = (0..fields.fields.len()).collect();
        let other = fields.recharted(&body, &all, kind).unwrap();
        (fields, other)
    }

    #[test]
    fn charts_of_the_other_kind_have_the_origins_and_directions_of_the_old() {
        for (bytes, kind) in [
            (bundled::HAND, ChartKind::Geodesic),
            (bundled::HUMANOID, ChartKind::Plane),
            (bundled::HUMANOID, ChartKind::Geodesic),
        ] {
            let (before, Recharted { fields, kept }) = recharted(bytes, kind);
            let mut changed = 0;
            for (old, new) in before.fields.iter().zip(&fields.fields) {
                let (Ok(old_chart), Ok(new_chart)) = (&old.chart, &new.chart) else { continue };
                if old_chart.kind == new_chart.kind {
                    assert!(old_chart.kind == kind || kept.iter().any(|(name, _)| *name == old.name), "{}", old.name);
                    continue;
                }
                changed += 1;
                assert_eq!(new_chart.kind, kind);
                assert!(old.origin_in_anchor.distance(new.origin_in_anchor) < 1e-6, "{}", old.name);
                assert!(old_chart.u_in_anchor.dot(new_chart.u_in_anchor) > 0.9, "{}", old.name);
            }
            assert!(changed > 0, "{kind:?}: {kept:?}");
            assert!(kept.iter().all(|(name, _)| before.fields.iter().any(|field| field.name == *name)));
        }
    }

    #[test]
    fn what_a_plane_cannot_show_is_reported_by_name() {
        let (before, Recharted { fields, kept }) = recharted(bundled::HUMANOID, ChartKind::Plane);
        for (name, why) in &kept {
            let at = before.fields.iter().position(|field| field.name == *name).unwrap();
            assert_eq!(before.fields[at].chart, fields.fields[at].chart, "{name}: {why}");
        }
    }
}
