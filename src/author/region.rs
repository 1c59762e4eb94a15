//! Regions: which triangles of a body a recipe means.

use std::collections::{BTreeMap, BTreeSet};

use glam::DVec3;

use super::canvas::Canvas;
use super::glob::Globs;
use super::recipe::Origin;
use crate::error::{Error, Result, nearest};

/// What a triangle must have to be in a region; all of it has to hold.
#[derive(Clone, Debug)]
pub(super) struct Region {
    /// Names of nodes with meshes, of those meshes, or of links.
    pub(super) node: Option<Globs>,
    pub(super) material: Option<Globs>,
    /// A painted attribute whose mean over the corners is over a half.
    pub(super) attribute: Option<String>,
    /// Two corners of a box that the triangle's middle is in, in the world at rest, m.
    pub(super) bounds: Option<[DVec3; 2]>,
    /// Names of regions that it is not in.
    pub(super) except: Vec<String>,
    /// Where it stands in the recipe.
    pub(super) at: Origin,
}

/// The regions of a recipe on a body, worked out as they are asked for.
pub(super) struct Regions<'a> {
    canvas: &'a Canvas<'a>,
    known: &'a BTreeMap<String, Region>,
    found: BTreeMap<String, Vec<bool>>,
}

impl<'a> Regions<'a> {
    pub(super) fn new(canvas: &'a Canvas<'a>, known: &'a BTreeMap<String, Region>) -> Self {
        Self { canvas, known, found: BTreeMap::new() }
    }

    /// Per triangle whether it is in one of the regions `names`, asked for at `at`.
    pub(super) fn union(&mut self, names: &[String], at: &Origin) -> Result<Vec<bool>> {
        let mut all = vec![false; self.canvas.triangles.len()];
        for name in names {
            self.find(name, at, &mut BTreeSet::new())?;
            for (all, own) in all.iter_mut().zip(&self.found[name]) {
                *all |= own;
            }
        }
        Ok(all)
    }

    /// Works out the region `name`; `above` are those that wait for it.
    fn find(&mut self, name: &str, asked_at: &Origin, above: &mut BTreeSet<String>) -> Result<()> {
        if self.found.contains_key(name) {
            return Ok(());
        }
        let Some(region) = self.known.get(name) else {
            let near = nearest(name, self.known.keys().map(String::as_str));
            let hint = near
                .map_or_else(|| "write a [regions] table for it".to_owned(), |near| format!("did you mean `{near}`?"));
            return Err(asked_at.wrong(format!("there is no region `{name}`; {hint}")));
        };
        if !above.insert(name.to_owned()) {
            return Err(asked_at.wrong(format!("region `{name}` takes itself away through `except`; break the ring")));
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
        let canvas = self.canvas;
        let (surfaces, details) = (&canvas.body.surfaces, &canvas.details.parts);
        let painted = region.attribute.as_ref().map(|name| canvas.painted(name)).transpose()?;
        let by_part: Vec<(bool, bool)> = surfaces
            .iter()
            .zip(details)
            .map(|(surface, part)| {
                let named = region.node.as_ref().is_none_or(|globs| {
                    globs.is_match(&surface.name) || part.mesh.as_ref().is_some_and(|mesh| globs.is_match(mesh))
                });
                let material = region
                    .material
                    .as_ref()
                    .is_none_or(|globs| part.material.as_ref().is_some_and(|name| globs.is_match(name)));
                (named, material)
            })
            .collect();
        let links: Vec<bool> = (canvas.body.links.iter())
            .map(|link| region.node.as_ref().is_some_and(|globs| globs.is_match(&link.name)))
            .collect();
        let is_in = |triangle: usize| {
            let (named, material) = by_part[canvas.origin[triangle].0 as usize];
            let [a, b, c] = canvas.corners(triangle);
            let middle = (a + b + c) / 3.0;
            let full = |values: &Vec<Option<f64>>| {
                let corners = canvas.triangles[triangle].map(|v| values[v as usize]);
                matches!(corners, [Some(a), Some(b), Some(c)] if a + b + c > 1.5)
            };
            (named || links[canvas.link[triangle] as usize])
                && material
                && painted.as_ref().is_none_or(full)
                && region.bounds.is_none_or(|[low, high]| middle.cmpge(low).all() && middle.cmple(high).all())
        };
        Ok((0..canvas.triangles.len()).map(is_in).collect())
    }

    fn why_empty(&self, name: &str, region: &Region) -> String {
        let canvas = self.canvas;
        let mut reasons = Vec::new();
        let list = |names: BTreeSet<&str>| {
            let shown: Vec<&str> = names.iter().copied().take(12).collect();
            let more = if names.len() > shown.len() { ", …" } else { "" };
            format!("{}{more}", shown.join(", "))
        };
        let mut look = |globs: &Option<Globs>, what: &str, names: BTreeSet<&str>| {
            let Some(globs) = globs else { return };
            if names.iter().any(|name| globs.is_match(name)) {
                return;
            }
            let hint = match nearest(globs.first(), names.iter().copied()) {
                Some(near) => format!("did you mean `{near}`?"),
                None if names.is_empty() => "there is none with a name".to_owned(),
                None => format!("there is {}", list(names)),
            };
            reasons.push(format!("no {what} is called `{}`; {hint}", globs.text()));
        };
        let mut nodes: BTreeSet<&str> = canvas.body.surfaces.iter().map(|surface| surface.name.as_str()).collect();
        nodes.extend(canvas.details.parts.iter().filter_map(|part| part.mesh.as_deref()));
        nodes.extend(canvas.link.iter().map(|&link| canvas.body.links[link as usize].name.as_str()));
        look(&region.node, "node with a mesh", nodes);
        look(&region.material, "material", canvas.details.parts.iter().filter_map(|p| p.material.as_deref()).collect());
        if reasons.is_empty() {
            let all = canvas.triangles.iter().flatten().map(|&v| canvas.positions[v as usize]);
            let (low, high) =
                all.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)));
            reasons
                .push(format!("no triangle has all that it asks for; the skin lies between {low:.3} and {high:.3} m"));
        }
        format!("region `{name}` is empty: {}", reasons.join("; "))
    }
}

/// The error where a place is on no triangle at all.
pub(super) fn nothing_left(name: &str) -> Error {
    Error::failed(format!("place `{name}` has no skin: its regions are all kept bare"))
}
