//! Materials and painted attributes of a body's file, for rules.

use crate::body::{Body, Details, Paint};

/// Materials and painted attributes of a body's surfaces. Surfaces and triangles are numbered as in [`Body::surfaces`].
pub trait Painted {
    /// The names of all materials.
    fn materials(&self) -> Vec<String>;

    /// The material of `triangle`.
    fn material(&self, surface: usize, triangle: usize) -> Option<&str>;

    /// The names of all painted attributes with one number per vertex, as in a recipe.
    fn attributes(&self) -> Vec<String>;

    /// Attribute `name` at `barycentric` of `triangle`; `None` if the surface does not have it.
    fn attribute(&self, name: &str, surface: usize, triangle: usize, barycentric: [f64; 3]) -> Option<f64>;
}

/// A body without materials and attributes.
impl Painted for () {
    fn materials(&self) -> Vec<String> {
        Vec::new()
    }

    fn material(&self, _: usize, _: usize) -> Option<&str> {
        None
    }

    fn attributes(&self) -> Vec<String> {
        Vec::new()
    }

    fn attribute(&self, _: &str, _: usize, _: usize, _: [f64; 3]) -> Option<f64> {
        None
    }
}

/// Materials and painted attributes from the body's file.
pub(in crate::author) struct FilePaint<'a> {
    pub(in crate::author) body: &'a Body,
    pub(in crate::author) details: &'a Details,
}

impl Painted for FilePaint<'_> {
    fn materials(&self) -> Vec<String> {
        self.details.parts.iter().filter_map(|part| part.material.clone()).collect()
    }

    fn material(&self, surface: usize, _: usize) -> Option<&str> {
        self.details.parts.get(surface)?.material.as_deref()
    }

    fn attributes(&self) -> Vec<String> {
        self.details.parts.iter().flat_map(|part| &part.paints).flat_map(Paint::names).collect()
    }

    fn attribute(&self, name: &str, surface: usize, triangle: usize, barycentric: [f64; 3]) -> Option<f64> {
        let paints = &self.details.parts.get(surface)?.paints;
        let (paint, place) = paints.iter().find_map(|paint| Some((paint, paint.column(name)?)))?;
        let corners = self.body.surfaces.get(surface)?.triangles.get(triangle)?;
        let at = |v: u32| paint.values.get(v as usize * paint.width + place).copied().map(f64::from);
        let values = [at(corners[0])?, at(corners[1])?, at(corners[2])?];
        Some(values.iter().zip(barycentric).map(|(value, weight)| value * weight).sum())
    }
}
