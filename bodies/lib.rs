//! Bodies that come with the library, and a touch, so that everything can be tried without a robot.
//!
//! What each of them is, and the recipe that makes it, is in `README.md` beside them.

/// A right hand of four digits with 40 taxels, after the paper's.
pub const HAND: &[u8] = include_bytes!("hand.glb");

/// A pressure mat for a bed: 64 × 32 taxels.
pub const MAT: &[u8] = include_bytes!("mat.glb");

/// A humanoid of a small child's shape with 960 taxels, skinned to 17 links.
pub const HUMANOID: &[u8] = include_bytes!("humanoid.glb");

/// Some seconds of touch on [`HAND`], as CSV. It is computed, not measured.
pub const TOUCH: &[u8] = include_bytes!("touch.csv");

/// What the bundled bodies are called.
pub const BODIES: [&str; 3] = ["hand", "mat", "humanoid"];

/// The bundled body called `name`, one of [`BODIES`].
#[must_use]
pub fn body(name: &str) -> Option<&'static [u8]> {
    match name {
        "hand" => Some(HAND),
        "mat" => Some(MAT),
        "humanoid" => Some(HUMANOID),
        _ => None,
    }
}
