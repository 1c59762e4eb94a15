//! Charts of the fields that rules made: laid, measured, and where there can be none split or named.

use glam::{DMat3, DVec2, DVec3};

use super::divide::numbered;
use super::words::{self, Words};
use super::{ChartWish, Grouping, Grower, Made, Wrap};
use crate::body::{Body, ChartKind, ChartSpec, FieldSpec, MemberSpec};
use crate::error::{Error, Result};
use crate::field::{Chart, Distortion, FieldSet, NoChart, unions};

/// A plane chart whose [`crate::field::Distortion`] is at most this is let stand where either kind will do: neighbours
/// 5 mm apart come out 0.25 mm off at worst. Around a cylinder of radius R a plane goes to θ = arccos 0.95 = 18° on each side
/// of its middle by then. What lies that far out, Rθ, is drawn at R sin θ: 1.7 % of the way short, and a centroid by no more.
pub const FLAT: f64 = 0.05;

/// A chart that is further from true than this is no good where a split can give better ones.
pub(super) const POOR: f64 = 0.25;

/// A sector with fewer taxels is no part of a split: they would say little of orientation.
const LEAST_IN_SECTOR: usize = 3;

/// Sectors around a limb that are tried before it is cut across.
const SECTORS: std::ops::RangeInclusive<usize> = 2..=4;

/// Parts that a field is split into at most.
const MOST_PARTS: usize = 64;

/// Rounds in which the patches of a split find their middles.
const SPLIT_ROUNDS: usize = 4;

/// Parts that are tried where a split is only to be proposed, to somebody whose field is refused.
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
        let mut words = Words::default();
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
                    let advice = words::advice(&why, parts.map(|parts| parts.len()), parent, MOST_PROPOSED);
                    let why = words::plain(&why);
                    let what = format!("field `{name}` cannot have the chart it asks for: {why}{advice}");
                    return Err((made.rule, Error::failed(what)));
                }
                Wrap::Split if !parent => {
                    fields.push(uncharted);
                    match self.split(&made, &whole, &mut bare, MOST_PARTS) {
                        Some(parts) => {
                            let why = words::plain(&why);
                            words.split.push((name, parts.len(), why));
                            fields.extend(parts);
                        }
                        None => self.notes.push(format!(
                            "field `{name}` has no chart: {}; no {MOST_PARTS} parts or fewer have one: choose fewer \
                             taxels",
                            words::plain(&why)
                        )),
                    }
                }
                _ => {
                    // A level that nobody asked a chart of leaves that to what is below it.
                    if !parent || made.chart != ChartWish::Auto {
                        words.bare.push((name, why, parent));
                    }
                    fields.push(uncharted);
                }
            }
        }
        words.poor = std::mem::take(&mut self.poor);
        self.notes.extend(words.lines());
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
                let unrolled = self.unroller.unroll(&asked(ChartKind::Geodesic, whole));
                let unrolled = unrolled.map(|unrolled| (self.distortion(&unrolled), unrolled));
                let plane = plane.map(|chart| (chart.distortion, planar(whole.clone(), made.u)));
                let (off, truer) = match (unrolled, plane) {
                    (Ok(unrolled), Ok(plane)) if plane.0 < unrolled.0 => plane,
                    (Ok(unrolled), _) => unrolled,
                    (Err(_), Ok(plane)) => plane,
                    (Err(why), Err(_)) => return Err(why),
                };
                if off > POOR && made.wrap == Wrap::Split {
                    return Err(NoChart::Untrue(off));
                }
                if off > POOR {
                    self.poor.push((whole.name.clone(), off));
                }
                Ok(truer)
            }
        }
    }

    /// How far the geodesic chart of `unrolled` is from true.
    fn distortion(&self, unrolled: &FieldSpec) -> f64 {
        let of_member = |(&id, member): (&u32, &MemberSpec)| {
            let taxel = &self.body.taxels[self.body.taxel_index(id)?];
            Some(((taxel.position_in_link, taxel.normal_in_link), DVec2::from_array(member.uv?)))
        };
        let (members, places): (Vec<_>, Vec<_>) = unrolled.members.iter().filter_map(of_member).unzip();
        Distortion::of(&members, &places).largest
    }

    /// Parts of `whole` that each have the chart that `made` asks for, at most `most`: the fewest sectors around a limb, or
    /// else its two halves, and of each half that has no chart the same again.
    fn split(&mut self, made: &Made, whole: &FieldSpec, bare: &mut Body, most: usize) -> Option<Vec<FieldSpec>> {
        let taxels: Vec<usize> = whole.members.keys().filter_map(|&id| self.body.taxel_index(id)).collect();
        let parts = self.parts(made, whole, bare, &taxels, most);
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
                && sectors.iter().all(|sector| sector.len() >= LEAST_IN_SECTOR)
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
