//! The skin of a body as a table or a URDF.

use std::path::Path;

use crate::author::mesh::urdf_of_skin;
use crate::body::{Body, Modality, taxel_table};
use crate::bundled;

fn ending(path: &Path) -> Option<String> {
    path.extension().map(|ending| ending.to_string_lossy().to_ascii_lowercase())
}

/// Whether `name` is a body's rather than a recording's.
pub fn is_body(name: &str) -> bool {
    matches!(ending(Path::new(name)).as_deref(), Some("glb" | "gltf")) || bundled::body(name).is_some()
}

/// What the skin of a body becomes.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum SkinFormat {
    /// A row for each taxel.
    Table,
    /// The tactile sensors of a robot.
    Urdf,
}

impl SkinFormat {
    /// As the ending of a file says it.
    pub fn of(path: &Path) -> Option<Self> {
        match ending(path).as_deref() {
            Some("csv") => Some(Self::Table),
            Some("urdf") => Some(Self::Urdf),
            _ => None,
        }
    }

    /// The taxels of `body`, and what is to be said of them.
    pub fn text(self, body: &Body) -> (String, Vec<String>) {
        match self {
            Self::Table => (taxel_table(body), Vec::new()),
            Self::Urdf => urdf_of_skin(body),
        }
    }

    /// How many taxels of `body` it has.
    pub fn taxels(self, body: &Body) -> usize {
        let is_written = |modality: Modality| self == Self::Table || modality.is_pressed();
        body.taxels.iter().filter(|taxel| is_written(taxel.modality)).count()
    }

    /// That it has no fields, if `body` has some.
    pub fn without_fields(self, body: &Body) -> Option<String> {
        let what = if self == Self::Table { "table" } else { "URDF" };
        let fields = body.fields.len();
        let s = if fields == 1 { "" } else { "s" };
        (fields > 0).then(|| format!("a {what} has no place for fields: {fields} field{s} left out"))
    }
}
