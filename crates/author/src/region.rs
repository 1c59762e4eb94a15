//! Regions: sets of triangles selected by a recipe.

use std::collections::{BTreeMap, BTreeSet};

use glam::DVec3;

use super::origin::Origin;
use super::recipe_values::Globs;
use super::rest_surface::RestSurface;
use crate::error::{Result, suggestion};

/// The conditions for a triangle to be in a region; all must hold.
#[derive(Clone, Debug)]
pub(super) struct Region {
    /// Names of nodes with meshes, of those meshes, or of links.
    pub(super) node: Option<Globs>,
    pub(super) material: Option<Globs>,
    /// A painted attribute whose mean over the corners is over a half.
    pub(super) attribute: Option<String>,
    /// Two corners of a box that the triangle's middle is in, in the body at rest, m.
    pub(super) bounds: Option<[DVec3; 2]>,
    /// Names of regions that it is not in.
    pub(super) except: Vec<String>,
    pub(super) at: Origin,
}

/// The regions of a recipe on a body, computed on demand.
pub(super) struct Regions<'a> {
    rest_surface: &'a RestSurface<'a>,
    known: &'a BTreeMap<String, Region>,
    found: BTreeMap<String, Vec<bool>>,
}

impl<'a> Regions<'a> {
    pub(super) fn new(rest_surface: &'a RestSurface<'a>, known: &'a BTreeMap<String, Region>) -> Self {
        Self { rest_surface, known, found: BTreeMap::new() }
    }

    /// Per triangle whether it is in one of the regions `names`, requested at `at`.
    pub(super) fn union(&mut self, names: &[String], at: &Origin) -> Result<Vec<bool>> {
        let mut all = vec![false; self.rest_surface.triangles.len()];
        for name in names {
            self.find(name, at, &mut BTreeSet::new())?;
            for (all, own) in all.iter_mut().zip(&self.found[name]) {
                *all |= own;
            }
        }
        Ok(all)
    }

    /// Computes the region `name`; `above` are the regions that depend on it.
    fn find(&mut self, name: &str, asked_at: &Origin, above: &mut BTreeSet<String>) -> Result<()> {
        if self.found.contains_key(name) {
            return Ok(());
        }
        let Some(region) = self.known.get(name) else {
            return Err(asked_at.wrong(format!("there is no region `{name}`")));
        };
        if !above.insert(name.to_owned()) {
            return Err(
                asked_at.wrong(format!("region `{name}` excludes itself through `except`; remove one of these"))
            );
        }
        let mut own = self.select(region).map_err(|e| region.at.put(e))?;
        if !own.contains(&true) {
            return Err(region.at.wrong(self.why_empty(name, region)));
        }
        for other in &region.except {
            self.find(other, &region.at, above)?;
            for (own, gone) in own.iter_mut().zip(&self.found[other]) {
                *own &= !gone;
            }
        }
        if !own.contains(&true) {
            return Err(region.at.wrong(format!("nothing is left of region `{name}` after its `except`")));
        }
        above.remove(name);
        self.found.insert(name.to_owned(), own);
        Ok(())
    }

    fn select(&self, region: &Region) -> Result<Vec<bool>> {
        let rest_surface = self.rest_surface;
        let (surfaces, details) = (&rest_surface.body.surfaces, &rest_surface.details.parts);
        let painted = region.attribute.as_ref().map(|name| rest_surface.painted(name)).transpose()?;
        let by_part: Vec<(bool, bool)> = surfaces
            .iter()
            .zip(details)
            .map(|(surface, part)| {
                let named = region.node.as_ref().is_none_or(|globs| {
                    globs.matches(&surface.name) || part.mesh.as_ref().is_some_and(|mesh| globs.matches(mesh))
                });
                let material = region
                    .material
                    .as_ref()
                    .is_none_or(|globs| part.material.as_ref().is_some_and(|name| globs.matches(name)));
                (named, material)
            })
            .collect();
        let links: Vec<bool> = (rest_surface.body.links.iter())
            .map(|link| region.node.as_ref().is_some_and(|globs| globs.matches(&link.name)))
            .collect();
        let is_in = |triangle: usize| {
            let (named, material) = by_part[rest_surface.origin[triangle].0 as usize];
            let [a, b, c] = rest_surface.corners(triangle);
            let middle = (a + b + c) / 3.0;
            let full = |values: &Vec<Option<f64>>| {
                let corners = rest_surface.triangles[triangle].map(|v| values[v as usize]);
                matches!(corners, [Some(a), Some(b), Some(c)] if a + b + c > 1.5)
            };
            (named || links[rest_surface.link[triangle] as usize])
                && material
                && painted.as_ref().is_none_or(full)
                && region.bounds.is_none_or(|[low, high]| middle.cmpge(low).all() && middle.cmple(high).all())
        };
        Ok((0..rest_surface.triangles.len()).map(is_in).collect())
    }

    fn why_empty(&self, name: &str, region: &Region) -> String {
        let rest_surface = self.rest_surface;
        let mut reasons = Vec::new();
        let mut look = |globs: &Option<Globs>, what: &str, names: BTreeSet<&str>| {
            if let Some(globs) = globs.as_ref().filter(|globs| !names.iter().any(|name| globs.matches(name))) {
                let asked = globs.listed();
                reasons.push(format!("no {what} is called `{asked}`; {}", suggestion(&asked, names)));
            }
        };
        let mut nodes: BTreeSet<&str> =
            rest_surface.body.surfaces.iter().map(|surface| surface.name.as_str()).collect();
        nodes.extend(rest_surface.details.parts.iter().filter_map(|part| part.mesh.as_deref()));
        nodes.extend(rest_surface.link.iter().map(|&link| rest_surface.body.links[link as usize].name.as_str()));
        look(&region.node, "node with a mesh", nodes);
        look(
            &region.material,
            "material",
            rest_surface.details.parts.iter().filter_map(|p| p.material.as_deref()).collect(),
        );
        if reasons.is_empty() {
            let all = rest_surface.triangles.iter().flatten().map(|&v| rest_surface.positions[v as usize]);
            let (low, high) =
                all.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)));
            reasons
                .push(format!("no triangle meets all conditions; the surface lies between {low:.3} and {high:.3} m"));
        }
        format!("region `{name}` is empty: {}", reasons.join("; "))
    }
}
