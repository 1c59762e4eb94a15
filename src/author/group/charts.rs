//! Charts of the fields that rules made: laid, measured, and where there can be none split or named.

use glam::{DMat3, DVec2, DVec3};

use super::divide::numbered;
use super::{ChartWish, Grouping, Grower, Made, Wrap};
use crate::body::{Body, ChartKind, ChartSpec, FieldSpec};
use crate::error::{Error, Result};
use crate::field::{Chart, FieldSet, NoChart, unions};

/// A plane chart whose [`crate::field::Distortion`] is at most this is let stand where either kind will do: neighbours
/// 5 mm apart come out 0.25 mm off at worst. A plane goes 18° to each side of its middle by then, and a centroid in a field
/// around a cylinder that far is off by under 2 % of the field's radius.
pub const FLAT: f64 = 0.05;

/// Sectors around a limb that are tried before it is cut across.
const SECTORS: std::ops::RangeInclusive<usize> = 2..=4;

/// Parts that a field is split into at most.
const MOST_PARTS: usize = 64;

/// Rounds in which the patches of a split find their middles.
const SPLIT_ROUNDS: usize = 4;

/// Parts that are tried where a split is only to be proposed.
const MOST_PROPOSED: usize = 12;

/// A field with the chart it gets, and the chart's distortion.
type Fitted = std::result::Result<FieldSpec, NoChart>;

impl Grower<'_> {
    /// Lays all charts.
    ///
    /// # Errors
    /// A field is to be refused, as it cannot have the chart it asks for; the line says what split would do. With it comes
    /// which of the rules applied, from 0, made the field.
    pub fn finish(mut self) -> Result<Grouping, (usize, Error)> {
        let specs: Vec<FieldSpec> = self.made.iter().map(|made| made.spec.clone()).collect();
        let members = unions(&specs);
        let mut bare = Body { fields: Vec::new(), ..self.body.clone() };
        bare.fields = specs.iter().zip(&self.made).map(|(spec, made)| planar(spec.clone(), made.u)).collect();
        let planes: Vec<_> =
            FieldSet::new(&bare).map_err(|e| (0, e))?.fields.into_iter().map(|field| field.chart).collect();
        let has_children = |name: &str| specs.iter().any(|spec| spec.parent.as_deref() == Some(name));
        let mut fields = Vec::with_capacity(specs.len());
        let made = std::mem::take(&mut self.made);
        for ((made, plane), ids) in made.into_iter().zip(planes).zip(members) {
            let name = made.spec.name.clone();
            let whole = made.spec.clone().with_members(ids);
            let why = match self.fit(&made, &whole, plane.clone()) {
                Ok(spec) => {
                    // Where a plane does, a parent needs no members of its own for it.
                    let unrolled = spec.chart.is_some_and(|chart| chart.kind == ChartKind::Geodesic);
                    fields.push(if unrolled { spec } else { FieldSpec { chart: spec.chart, ..made.spec } });
                    continue;
                }
                Err(why) => why,
            };
            // What a plane could be laid for by default must say that it shall not.
            let none = ChartSpec { kind: ChartKind::None, origin_in_anchor: None, u_in_anchor: None };
            let uncharted = FieldSpec { chart: plane.is_ok().then_some(none), ..made.spec.clone() };
            let parent = has_children(&name);
            match made.wrap {
                Wrap::Refuse => {
                    let parts = if parent { None } else { self.split(&made, &whole, &mut bare, MOST_PROPOSED) };
                    let advice = advice(&why, parts.as_deref(), parent);
                    let what = format!("field `{name}` cannot have the chart it asks for: {why}{advice}");
                    return Err((made.rule, Error::failed(what)));
                }
                Wrap::Split if !parent => {
                    fields.push(uncharted);
                    match self.split(&made, &whole, &mut bare, MOST_PARTS) {
                        Some(parts) => {
                            self.notes.push(format!("field `{name}` is split into {}: {why}", parts.len()));
                            fields.extend(parts);
                        }
                        None => self.notes.push(format!(
                            "field `{name}` has no chart: {why}; and no split into {MOST_PARTS} or fewer has"
                        )),
                    }
                }
                _ => {
                    if !made.is_level {
                        let proposed = !parent && !matches!(why, NoChart::SeveralLinks(_) | NoChart::NoSurface);
                        let parts = if proposed { self.split(&made, &whole, &mut bare, MOST_PROPOSED) } else { None };
                        let advice = advice(&why, parts.as_deref(), parent);
                        self.notes.push(format!("field `{name}` has no chart: {why}{advice}"));
                    }
                    fields.push(uncharted);
                }
            }
        }
        Ok(Grouping { fields, notes: self.notes })
    }

    /// `whole`, which has all members of `made` for its own, with the chart that `made` asks for; `plane` is what a plane
    /// chart of it would be.
    fn fit(&mut self, made: &Made, whole: &FieldSpec, plane: std::result::Result<Chart, NoChart>) -> Fitted {
        let asked = |kind, whole: &FieldSpec| {
            let chart = Some(ChartSpec { kind, origin_in_anchor: None, u_in_anchor: made.u });
            FieldSpec { chart, ..whole.clone() }
        };
        match made.chart {
            ChartWish::None => Ok(asked(ChartKind::None, whole)),
            ChartWish::Plane => plane.map(|_| planar(whole.clone(), made.u)),
            ChartWish::Geodesic => self.unroller.unroll(&asked(ChartKind::Geodesic, whole)),
            ChartWish::Auto => {
                let flat = plane.as_ref().is_ok_and(|chart| chart.distortion <= FLAT);
                if flat || matches!(plane, Err(NoChart::SeveralLinks(_))) {
                    return plane.map(|_| planar(whole.clone(), made.u));
                }
                match (self.unroller.unroll(&asked(ChartKind::Geodesic, whole)), plane) {
                    (Ok(unrolled), _) => Ok(unrolled),
                    (Err(why), Ok(chart)) => {
                        self.notes.push(format!(
                            "field `{}` keeps a plane chart that is up to {:.0} % off, as it cannot be unrolled: {why}",
                            whole.name,
                            chart.distortion * 100.0
                        ));
                        Ok(planar(whole.clone(), made.u))
                    }
                    (Err(why), Err(_)) => Err(why),
                }
            }
        }
    }

    /// Parts of `whole` that each have the chart that `made` asks for, at most `most`: the fewest sectors around a limb, or
    /// else its two halves, and of each half that has no chart the same again.
    fn split(&mut self, made: &Made, whole: &FieldSpec, bare: &mut Body, most: usize) -> Option<Vec<FieldSpec>> {
        let taxels: Vec<usize> = whole.members.keys().filter_map(|&id| self.body.taxel_index(id)).collect();
        let notes = self.notes.len();
        let parts = self.parts(made, whole, bare, &taxels, most);
        self.notes.truncate(notes);
        let mut parts = parts?;
        parts.sort_by_key(|part| part.members.keys().next().copied());
        let names = numbered("part", vec![Vec::new(); parts.len()]);
        for (part, (name, _)) in parts.iter_mut().zip(names) {
            part.name = format!("{}/{name}", whole.name);
        }
        Some(parts)
    }

    /// The parts that `taxels` of `whole` are split into, without their names.
    fn parts(
        &mut self,
        made: &Made,
        whole: &FieldSpec,
        bare: &mut Body,
        taxels: &[usize],
        most: usize,
    ) -> Option<Vec<FieldSpec>> {
        for count in SECTORS {
            let sectors = self.sectors(taxels, count);
            if sectors.len() > 1
                && sectors.len() <= most
                && let Some(parts) = sectors.iter().map(|taxels| self.part(made, whole, bare, taxels)).collect()
            {
                return Some(parts);
            }
        }
        let halves = self.patches(taxels, 2, SPLIT_ROUNDS);
        let mut parts = Vec::new();
        for half in &halves {
            match self.part(made, whole, bare, half) {
                Some(part) => parts.push(part),
                None if halves.len() < 2 || parts.len() >= most => return None,
                None => parts.extend(self.parts(made, whole, bare, half, most - parts.len())?),
            }
        }
        (parts.len() <= most).then_some(parts)
    }

    /// The child of `whole` with `taxels`, if it has its chart.
    fn part(&mut self, made: &Made, whole: &FieldSpec, bare: &mut Body, taxels: &[usize]) -> Option<FieldSpec> {
        let member = |&taxel: &usize| {
            let id = self.body.taxels[taxel].id;
            (id, whole.members.get(&id).copied().unwrap_or_default())
        };
        let members = taxels.iter().map(member).collect();
        let part = FieldSpec { name: whole.name.clone(), parent: Some(whole.name.clone()), members, chart: None };
        bare.fields = vec![planar(FieldSpec { parent: None, ..part.clone() }, made.u)];
        let plane = FieldSet::new(bare).ok()?.fields.pop()?.chart;
        self.fit(made, &part, plane).ok()
    }

    /// `taxels` in `count` sectors by where their normals point around the axis that these are most across.
    fn sectors(&self, taxels: &[usize], count: usize) -> Vec<Vec<usize>> {
        let normals: Vec<DVec3> = taxels.iter().map(|&taxel| self.body.taxels[taxel].normal_in_link).collect();
        let axis = least_axis(&normals);
        let mean = normals.iter().sum::<DVec3>();
        let front = (mean - axis * mean.dot(axis)).try_normalize().unwrap_or(axis.any_orthonormal_vector());
        let side = axis.cross(front);
        let mut sectors = vec![Vec::new(); count];
        for (&taxel, normal) in taxels.iter().zip(&normals) {
            let around = DVec2::new(normal.dot(front), normal.dot(side));
            let turn = libm::atan2(around.y, around.x) / std::f64::consts::TAU + 0.5;
            sectors[((turn * count as f64) as usize).min(count - 1)].push(taxel);
        }
        sectors.retain(|sector| !sector.is_empty());
        sectors
    }
}

/// The unit vector that `normals` have least along them.
fn least_axis(normals: &[DVec3]) -> DVec3 {
    let products = |m: DMat3, n: &DVec3| m + DMat3::from_cols(*n * n.x, *n * n.y, *n * n.z);
    let moments = normals.iter().fold(DMat3::ZERO, products);
    let trace = moments.x_axis.x + moments.y_axis.y + moments.z_axis.z;
    let inverted = DMat3::from_diagonal(DVec3::splat(trace)) - moments;
    // Power iteration; a start that is across none of the axes.
    (0..200).fold(DVec3::new(0.48, 0.6, 0.64), |axis, _| (inverted * axis).try_normalize().unwrap_or(axis))
}

/// `spec` with a plane chart, and +u along `u` if that is given.
fn planar(spec: FieldSpec, u: Option<[f64; 3]>) -> FieldSpec {
    let chart = u.map(|u| ChartSpec { kind: ChartKind::Plane, origin_in_anchor: None, u_in_anchor: Some(u) });
    FieldSpec { chart, ..spec }
}

/// What to do about a field without a chart.
fn advice(why: &NoChart, parts: Option<&[FieldSpec]>, is_parent: bool) -> String {
    match (why, parts) {
        (NoChart::SeveralLinks(_), _) => "; one field for each of them (`each = \"link\"`) may have".into(),
        (_, Some(parts)) => format!("; {} parts would have (`wrap = \"split\"`)", parts.len()),
        _ if is_parent => "; fields below it may have".into(),
        (NoChart::NoSurface, _) => String::new(),
        _ => format!("; no split into {MOST_PROPOSED} or fewer has"),
    }
}
