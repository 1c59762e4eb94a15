//! Charts of the fields that rules made: computed, checked, and if there is none split or reported.

use std::collections::{BTreeMap, BTreeSet};

use glam::{DVec2, DVec3};

use super::axis::least_axis;
use super::chart_notes::{self, ChartNotes, POOR_DISTORTION, SPLIT_DISTORTION};
use super::grouper::{FieldDraft, Grouper, Grouping};
use super::rule::{ChartWish, Wrap};
use crate::body::{Body, ChartKind, ChartSpec, FieldSpec, MemberSpec};
use crate::error::{Error, Result};
use crate::field::geodesic::MAX_WINDOWS;
use crate::field::{Chart, Distortion, Field, FieldSet, NoChart, unions};
use crate::placed::{Progress, report_progress};

/// Maximum [`crate::field::Distortion`] at which `auto` takes a plane chart: neighbours 5 mm apart are at most 0.25 mm
/// off. On a cylinder of radius R that allows θ = arccos 0.95 = 18° on each side of the middle; a point at Rθ is drawn at
/// R sin θ, 1.7 % too near.
pub const MAX_PLANE_DISTORTION: f64 = 0.05;

/// Minimum number of taxels in a sector of a split, for an orientation.
const MIN_SECTOR_TAXELS: usize = 3;

/// Numbers of sectors around a limb to try before it is cut across.
const SECTOR_COUNTS: std::ops::RangeInclusive<usize> = 2..=4;

const MAX_PARTS: usize = 64;

/// Rounds of Lloyd's iteration for the patches of a split.
const SPLIT_ROUNDS: usize = 4;

/// Maximum number of parts of a split that is only proposed in an error.
const MAX_PROPOSED_PARTS: usize = 12;

/// Windows that the search for the chart of a field and its parts may take: about 0.1 s. What is left goes to the next ones.
const WINDOWS_OF_FIELD: usize = 150_000;

/// A field with a chart, and its distortion.
type Measured = (f64, FieldSpec);

type Fitted = std::result::Result<FieldSpec, NoChart>;

/// By the taxels of a field on the left half of a mirrored layout, those of the parts into which it or its image is split; none where
/// it is whole.
type PartsOnLeft = BTreeMap<Vec<usize>, Vec<Vec<usize>>>;

/// Fields that have been through it, so far.
struct Charted {
    fields: Vec<FieldSpec>,
    notes: ChartNotes,
    parts_on_left: PartsOnLeft,
    /// The body whose fields have plane charts alone; see [`Grouper::bare`].
    bare: Body,
}

impl Grouper<'_> {
    /// Computes all charts.
    ///
    /// # Errors
    /// A field cannot have its chart and its rule says to refuse it; the message says which split would work. With it comes
    /// the index of the rule that made the field.
    pub fn finish(self) -> Result<Grouping, (usize, Error)> {
        self.finish_while(&mut |_| true)
    }

    /// The same until `progress`, which gets the share of the fields that are done, says to stop.
    pub(crate) fn finish_while(mut self, progress: Progress<'_>) -> Result<Grouping, (usize, Error)> {
        let specs: Vec<FieldSpec> = self.made.iter().map(|made| made.spec.clone()).collect();
        let members = unions(&specs);
        let bare = self.bare(&specs);
        let planes: Vec<_> =
            FieldSet::new(&bare).map_err(|e| (0, e))?.fields.into_iter().map(|field| field.chart).collect();
        let parents: BTreeSet<&str> = specs.iter().filter_map(|spec| spec.parent.as_deref()).collect();
        let mut charted = Charted {
            fields: Vec::with_capacity(specs.len()),
            notes: ChartNotes::default(),
            parts_on_left: PartsOnLeft::new(),
            bare,
        };
        let made = std::mem::take(&mut self.made);
        let count = made.len();
        let (mut pool, mut bounded) = (MAX_WINDOWS - 1, 0);
        for (index, ((made, plane), ids)) in made.into_iter().zip(planes).zip(members).enumerate() {
            report_progress(progress, index as f64 / count as f64).map_err(|e| (made.rule, e))?;
            // What a field leaves, the next ones may use.
            if let Some(left) = *self.unroller.windows_left() {
                bounded += usize::from(left == 0);
                pool = left;
            }
            pool = (pool + WINDOWS_OF_FIELD).min(MAX_WINDOWS - 1);
            *self.unroller.windows_left() = (made.chart != ChartWish::Geodesic).then_some(pool);
            let whole = made.spec.clone().with_members(ids);
            let is_parent = parents.contains(made.spec.name.as_str());
            self.chart(made, &whole, plane, is_parent, &mut charted)?;
        }
        bounded += usize::from(*self.unroller.windows_left() == Some(0));
        self.notes.extend((bounded > 0).then(|| chart_notes::bounded(bounded)));
        charted.notes.poor = self.poor(&charted.fields).map_err(|e| (0, e))?;
        self.notes.extend(charted.notes.lines());
        Ok(Grouping { fields: charted.fields, notes: self.notes })
    }

    /// Those of `fields` whose charts are distorted, though nobody asked for their kind, and how much.
    fn poor(&self, fields: &[FieldSpec]) -> Result<Vec<(String, f64)>> {
        let fields = FieldSet::from_specs(self.body, fields)?.fields.into_iter();
        let distortion = |field: Field| Some((field.name, field.chart.ok()?.distortion));
        Ok(fields.filter_map(distortion).filter(|(_, off)| *off > POOR_DISTORTION).collect())
    }

    /// Adds field `made` to `charted`, with its chart or in parts with theirs. With all its members it is `whole`, and in the plane it
    /// has chart `plane`.
    fn chart(
        &mut self,
        made: FieldDraft,
        whole: &FieldSpec,
        plane: std::result::Result<Chart, NoChart>,
        is_parent: bool,
        charted: &mut Charted,
    ) -> Result<(), (usize, Error)> {
        let Charted { fields, notes, parts_on_left, bare } = charted;
        let name = made.spec.name.clone();
        let none = ChartSpec { kind: ChartKind::None, origin_in_anchor: None, u_in_anchor: None };
        // A field that could have a plane chart by default must state that it has none.
        let uncharted = FieldSpec { chart: plane.is_ok().then_some(none), ..made.spec.clone() };
        let on_left = self.on_left(whole);
        let image_parts = on_left.as_ref().and_then(|taxels| parts_on_left.get(taxels));
        if let Some(parts) = image_parts.filter(|parts| !parts.is_empty()) {
            let parts = self.parts_like(&made, whole, bare, parts);
            notes.split.push((name, parts.len(), "its mirror image is".to_owned()));
            notes.few.extend(bare_of(&parts));
            fields.push(uncharted);
            fields.extend(parts);
            return Ok(());
        }
        let image_is_whole = image_parts.is_some();
        let why = match self.fit(&made, whole, plane) {
            Ok(spec) => {
                parts_on_left.extend(on_left.map(|taxels| (taxels, Vec::new())));
                // With a plane chart, a parent needs no members of its own.
                let unrolled = spec.chart.is_some_and(|chart| chart.kind.is_stored());
                fields.push(if unrolled { spec } else { FieldSpec { chart: spec.chart, ..made.spec } });
                return Ok(());
            }
            Err(why) => why,
        };
        match made.wrap {
            Wrap::Refuse => {
                let parts = if is_parent { None } else { self.split(&made, whole, bare, MAX_PROPOSED_PARTS) };
                let advice = chart_notes::advice(&why, parts.map(|parts| parts.len()), is_parent, MAX_PROPOSED_PARTS);
                let why = chart_notes::plain(&why);
                let what = format!("field `{name}` cannot have the chart it asks for: {why}{advice}");
                return Err((made.rule, Error::failed(what)));
            }
            Wrap::Split if !is_parent && !image_is_whole => {
                fields.push(uncharted);
                match self.split(&made, whole, bare, MAX_PARTS) {
                    Some(parts) => {
                        let of_left = parts.iter().filter_map(|part| self.on_left(part)).collect();
                        parts_on_left.extend(on_left.map(|taxels| (taxels, of_left)));
                        notes.split.push((name, parts.len(), chart_notes::plain(&why)));
                        notes.few.extend(bare_of(&parts));
                        fields.extend(parts);
                    }
                    None => self.notes.push(format!(
                        "field `{name}` has no chart: {}; no {MAX_PARTS} parts or fewer have one: choose fewer taxels",
                        chart_notes::plain(&why)
                    )),
                }
            }
            _ => {
                // A parent without a requested chart is not reported.
                if !is_parent || made.chart != ChartWish::Auto {
                    notes.bare.push((name, why, is_parent));
                }
                fields.push(uncharted);
            }
        }
        Ok(())
    }

    /// The body with fields `specs`, each with a plane chart, and without a surface: only the origin of a plane chart depends on that,
    /// which is not stored.
    fn bare(&self, specs: &[FieldSpec]) -> Body {
        let Body { name, links, taxels, .. } = self.body;
        let (name, links, taxels) = (name.clone(), links.clone(), taxels.clone());
        let fields = specs.iter().zip(&self.made).map(|(spec, made)| planar(spec.clone(), made.u)).collect();
        Body {
            name,
            links,
            taxels,
            surfaces: Vec::new(),
            fields,
            edges: None,
            findings: Vec::new(),
            kept: Default::default(),
        }
    }

    /// `whole`, the field `made` with all its members as own members, with the chart that `made` requests; `plane` is its
    /// plane chart.
    fn fit(&mut self, made: &FieldDraft, whole: &FieldSpec, plane: std::result::Result<Chart, NoChart>) -> Fitted {
        let asked = |kind, whole: &FieldSpec| {
            let chart = Some(ChartSpec { kind, origin_in_anchor: None, u_in_anchor: made.u });
            FieldSpec { chart, ..whole.clone() }
        };
        match made.chart {
            ChartWish::None => Ok(asked(ChartKind::None, whole)),
            ChartWish::Plane => plane.map(|_| planar(whole.clone(), made.u)),
            ChartWish::Geodesic => self.unroller.unroll(&asked(ChartKind::Geodesic, whole)),
            ChartWish::Normals => self.unroller.unroll(&asked(ChartKind::Normals, whole)),
            ChartWish::Auto => {
                let flat = plane.as_ref().is_ok_and(|chart| chart.distortion <= MAX_PLANE_DISTORTION);
                if flat || matches!(plane, Err(NoChart::SeveralLinks(_))) {
                    return plane.map(|_| planar(whole.clone(), made.u));
                }
                let on_surface = self.unroller.unroll(&asked(ChartKind::Geodesic, whole));
                let on_surface = on_surface.map(|unrolled| (self.distortion(&unrolled), unrolled));
                let most = if on_surface.is_ok() { POOR_DISTORTION } else { SPLIT_DISTORTION };
                let plane = plane.map(|chart| (chart.distortion, planar(whole.clone(), made.u)));
                let truer = |one: Measured, other: Measured| if other.0 < one.0 { other } else { one };
                let best = match (on_surface, plane) {
                    (Ok(unrolled), Ok(plane)) => Ok(truer(unrolled, plane)),
                    (Err(_), Ok(plane)) if plane.0 <= POOR_DISTORTION => Ok(plane),
                    // Ways over the surface lead around holes, or nowhere.
                    (Err(why), plane) => {
                        let by_normals = self.unroller.unroll(&asked(ChartKind::Normals, whole)).ok();
                        let by_normals = by_normals.map(|unrolled| (self.distortion(&unrolled), unrolled));
                        // More would be folded.
                        match by_normals.filter(|(off, _)| *off <= SPLIT_DISTORTION) {
                            Some(by_normals) => Ok(plane.map_or(by_normals.clone(), |plane| truer(plane, by_normals))),
                            None => plane.map_err(|_| why),
                        }
                    }
                    (unrolled, Err(_)) => unrolled,
                };
                let (off, truer) = best?;
                if off > most && made.wrap == Wrap::Split {
                    return Err(NoChart::Untrue(off));
                }
                Ok(truer)
            }
        }
    }

    /// The distortion of the stored chart of `unrolled`.
    fn distortion(&self, unrolled: &FieldSpec) -> f64 {
        let of_member = |(&id, member): (&u32, &MemberSpec)| {
            let taxel = &self.body.taxels[self.body.taxel_index(id)?];
            Some(((taxel.position_in_link, taxel.normal_in_link), DVec2::from_array(member.uv?)))
        };
        let (members, places): (Vec<_>, Vec<_>) = unrolled.members.iter().filter_map(of_member).unzip();
        Distortion::measure(&members, &places).largest
    }

    /// The taxels of a field that is on one half of a mirrored layout, or their images, whichever are on the left; ascending.
    fn on_left(&self, field: &FieldSpec) -> Option<Vec<usize>> {
        let taxels = self.taxels_of(field);
        let is_right = self.halves.is_right(&taxels)?;
        Some(if is_right { self.halves.images(&taxels) } else { taxels })
    }

    /// The body's taxels that are own members of `field`, ascending.
    fn taxels_of(&self, field: &FieldSpec) -> Vec<usize> {
        let mut taxels: Vec<usize> = field.members.keys().filter_map(|&id| self.body.taxel_index(id)).collect();
        taxels.sort_unstable();
        taxels
    }

    /// `whole` in parts that mirror those of the other side; `on_left` has their taxels on the left. A part has no chart if
    /// this side has none.
    fn parts_like(
        &mut self,
        made: &FieldDraft,
        whole: &FieldSpec,
        bare: &mut Body,
        on_left: &[Vec<usize>],
    ) -> Vec<FieldSpec> {
        let is_right = self.halves.is_right(&self.taxels_of(whole)) == Some(true);
        let part = |part: &Vec<usize>| if is_right { self.halves.images(part) } else { part.clone() };
        let taxels: Vec<Vec<usize>> = on_left.iter().map(part).collect();
        let parts = taxels.iter().map(|taxels| self.part(made, whole, bare, taxels).0);
        let parts = parts.collect();
        self.with_side_names(whole, parts)
    }

    /// At most `most` parts of `whole` that each have the chart that `made` requests: the fewest sectors around a limb, else
    /// two halves, which are split again if they have no chart.
    fn split(&mut self, made: &FieldDraft, whole: &FieldSpec, bare: &mut Body, most: usize) -> Option<Vec<FieldSpec>> {
        let taxels: Vec<usize> = whole.members.keys().filter_map(|&id| self.body.taxel_index(id)).collect();
        let parts = self.parts(made, whole, bare, &taxels, most)?;
        Some(self.with_side_names(whole, parts))
    }

    /// `parts` of `whole`, called by their sides, by ascending lowest id.
    fn with_side_names(&self, whole: &FieldSpec, mut parts: Vec<FieldSpec>) -> Vec<FieldSpec> {
        parts.sort_by_key(|part| part.members.keys().next().copied());
        let members = |part: &FieldSpec| part.members.keys().filter_map(|&id| self.body.taxel_index(id)).collect();
        let names = self.side_names(&parts.iter().map(members).collect::<Vec<_>>());
        for (part, name) in parts.iter_mut().zip(names) {
            part.name = format!("{}/{name}", whole.name);
        }
        parts
    }

    /// The parts into which `taxels` of `whole` are split, unnamed.
    fn parts(
        &mut self,
        made: &FieldDraft,
        whole: &FieldSpec,
        bare: &mut Body,
        taxels: &[usize],
        most: usize,
    ) -> Option<Vec<FieldSpec>> {
        let halves = self.halves.split(taxels);
        if halves.iter().all(|half| !half.is_empty()) {
            // A mirrored layout is divided where it is mirrored.
            let mut parts = Vec::new();
            for (half, after) in halves.iter().zip([1, 0]) {
                let room = most.checked_sub(parts.len() + after).filter(|&room| room > 0)?;
                match self.part(made, whole, bare, half) {
                    (part, true) => parts.push(part),
                    _ => parts.extend(self.parts(made, whole, bare, half, room)?),
                }
            }
            return Some(parts);
        }
        for count in SECTOR_COUNTS {
            let sectors = self.sectors(taxels, count);
            if sectors.len() > 1
                && sectors.len() <= most
                && sectors.iter().all(|sector| sector.len() >= MIN_SECTOR_TAXELS)
                && let Some(parts) = sectors.iter().map(|taxels| self.charted(made, whole, bare, taxels)).collect()
            {
                return Some(parts);
            }
        }
        // Halves are smaller than what they are of, so this ends; each becomes a part or more, so it ends after twice `most`
        // halves at the latest.
        let halves = self.halves_of(taxels);
        if halves.len() < 2 || halves.len() > most {
            return None;
        }
        let mut parts = Vec::new();
        for (half, after) in halves.iter().zip((0..halves.len()).rev()) {
            match self.part(made, whole, bare, half) {
                (part, true) => parts.push(part),
                // What is left of so few has no orientation.
                (part, false) if half.len() < 2 * MIN_SECTOR_TAXELS => parts.push(part),
                _ => {
                    let room = most.checked_sub(parts.len() + after).filter(|&room| room > 1)?;
                    parts.extend(self.parts(made, whole, bare, half, room)?);
                }
            }
        }
        Some(parts)
    }

    /// `taxels` in two halves, or more on several parts of the surface.
    fn halves_of(&mut self, taxels: &[usize]) -> Vec<Vec<usize>> {
        if self.are_apart(taxels) {
            let halves = self.even_patches(taxels, taxels.len().div_ceil(2));
            if halves.len() > 1 {
                return halves;
            }
        }
        self.patches(taxels, 2, SPLIT_ROUNDS)
    }

    /// The child of `whole` with `taxels`, and whether it has its chart.
    fn part(&mut self, made: &FieldDraft, whole: &FieldSpec, bare: &mut Body, taxels: &[usize]) -> (FieldSpec, bool) {
        let member = |&taxel: &usize| {
            let id = self.body.taxels[taxel].id;
            (id, whole.members.get(&id).copied().unwrap_or_default())
        };
        let members = taxels.iter().map(member).collect();
        let part = FieldSpec { name: whole.name.clone(), parent: Some(whole.name.clone()), members, chart: None };
        bare.fields = vec![planar(FieldSpec { parent: None, ..part.clone() }, made.u)];
        let plane = FieldSet::new(bare).ok().and_then(|mut set| set.fields.pop()).map(|field| field.chart);
        let none = ChartSpec { kind: ChartKind::None, origin_in_anchor: None, u_in_anchor: None };
        match plane.and_then(|plane| self.fit(made, &part, plane).ok()) {
            Some(charted) => (charted, true),
            None => (FieldSpec { chart: Some(none), ..part }, false),
        }
    }

    /// The same if it has its chart.
    fn charted(
        &mut self,
        made: &FieldDraft,
        whole: &FieldSpec,
        bare: &mut Body,
        taxels: &[usize],
    ) -> Option<FieldSpec> {
        Some(self.part(made, whole, bare, taxels)).filter(|(_, has_chart)| *has_chart).map(|(part, _)| part)
    }

    /// `taxels` in `count` sectors by the direction of their normals around the axis most perpendicular to them; on the right half of a
    /// mirrored layout the images of those of their images.
    fn sectors(&self, taxels: &[usize], count: usize) -> Vec<Vec<usize>> {
        if self.halves.is_right(taxels) == Some(true) {
            let of_images = self.sectors(&self.halves.images(taxels), count);
            return of_images.iter().map(|sector| self.halves.images(sector)).collect();
        }
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

/// The names of `parts` without a chart.
fn bare_of(parts: &[FieldSpec]) -> impl Iterator<Item = String> {
    let is_bare = |part: &&FieldSpec| part.chart.is_some_and(|chart| chart.kind == ChartKind::None);
    parts.iter().filter(is_bare).map(|part| part.name.clone())
}

/// `spec` with a plane chart, and +u along `u` if that is given.
fn planar(spec: FieldSpec, u: Option<[f64; 3]>) -> FieldSpec {
    let chart = u.map(|u| ChartSpec { kind: ChartKind::Plane, origin_in_anchor: None, u_in_anchor: Some(u) });
    FieldSpec { chart, ..spec }
}
