//! Materials and painted attributes of a body's file, for rules.

use crate::body::{Body, Details, Paint};

/// Materials and painted attributes of a body's surfaces, none by default. Surfaces and triangles are numbered as in
/// [`Body::surfaces`].
pub trait Painted {
    /// The names of all materials.
    fn materials(&self) -> Vec<String> {
        Vec::new()
    }

    /// The material of a triangle.
    fn material(&self, _surface: usize, _triangle: usize) -> Option<&str> {
        None
    }

    /// The names of all painted attributes with one number per vertex, as in a recipe.
    fn attributes(&self) -> Vec<String> {
        Vec::new()
    }

    /// An attribute at a place of a triangle; `None` if the surface does not have it.
    fn attribute(&self, _name: &str, _surface: usize, _triangle: usize, _barycentric: [f64; 3]) -> Option<f64> {
        None
    }
}

impl Painted for () {}

/// Materials and painted attributes from the body's file.
pub(crate) struct FilePaint<'a> {
    pub(crate) body: &'a Body,
    pub(crate) details: &'a Details,
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
