//! Materials and painted attributes of a body's file, for rules.

use super::Painted;
use crate::body::{Body, Details};

/// Materials and painted attributes from the body's file.
pub(in crate::author) struct FilePaint<'a> {
    pub(in crate::author) body: &'a Body,
    pub(in crate::author) details: &'a Details,
}

/// Names of the channels of a colour.
const CHANNELS: [&str; 4] = ["r", "g", "b", "a"];

impl Painted for FilePaint<'_> {
    fn materials(&self) -> Vec<String> {
        self.details.parts.iter().filter_map(|part| part.material.clone()).collect()
    }

    fn material(&self, surface: usize, _: usize) -> Option<&str> {
        self.details.parts.get(surface)?.material.as_deref()
    }

    fn attributes(&self) -> Vec<String> {
        let paints = self.details.parts.iter().flat_map(|part| &part.paints);
        let names = paints.flat_map(|paint| match paint.width {
            1 => vec![paint.name.clone()],
            width => CHANNELS.iter().take(width).map(|channel| format!("{}.{channel}", paint.name)).collect(),
        });
        names.collect()
    }

    fn attribute(&self, name: &str, surface: usize, triangle: usize, barycentric: [f64; 3]) -> Option<f64> {
        let paints = &self.details.parts.get(surface)?.paints;
        let (paint, place) = paints.iter().find_map(|paint| {
            if paint.width == 1 && paint.name == name {
                return Some((paint, 0));
            }
            let channel = name.strip_prefix(&paint.name)?.strip_prefix('.')?;
            let place = CHANNELS.iter().position(|own| *own == channel)?;
            (place < paint.width).then_some((paint, place))
        })?;
        let corners = self.body.surfaces.get(surface)?.triangles.get(triangle)?;
        let at = |v: u32| paint.values.get(v as usize * paint.width + place).copied().map(f64::from);
        let values = [at(corners[0])?, at(corners[1])?, at(corners[2])?];
        Some(values.iter().zip(barycentric).map(|(value, weight)| value * weight).sum())
    }
}
