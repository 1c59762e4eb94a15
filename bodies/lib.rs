//! Bodies that come with the library, and a touch, so that everything can be tried without a robot.
//!
//! What each of them is, and the recipe that makes it, is in `README.md` beside them.

/// A right hand of four digits with 40 taxels, after the paper's.
pub const HAND: &[u8] = include_bytes!("hand.glb");

/// A pressure mat for a bed: 64 × 32 taxels.
pub const MAT: &[u8] = include_bytes!("mat.glb");

/// A humanoid of a small child's shape with 960 taxels, skinned to 17 links.
pub const HUMANOID: &[u8] = include_bytes!("humanoid.glb");

/// [`HAND`] with more senses: three-axis taxels in its palm and fingers, temperature and proximity in its palm.
pub const SENSING_HAND: &[u8] = include_bytes!("sensing-hand.glb");

/// Some seconds of touch on [`HAND`], as CSV. It is computed, not measured.
pub const TOUCH: &[u8] = include_bytes!("touch.csv");

/// Another hand comes near the palm of [`SENSING_HAND`], presses and warms it and is dragged over it; then a fingertip is dragged along
/// its index finger; as CSV, in N, °C and mm. It is computed, not measured.
pub const MEETING: &[u8] = include_bytes!("meeting.csv");

/// The calibration of [`SENSING_HAND`] in [`MEETING`]: its units, the range of its distance sensors, and when it slips; TOML.
pub const MEETING_CALIBRATION: &str = include_str!("sensing-hand.toml");

/// What the bundled bodies are called.
pub const BODIES: [&str; 4] = ["hand", "mat", "humanoid", "sensing-hand"];

/// The bundled body called `name`, one of [`BODIES`].
#[must_use]
pub fn body(name: &str) -> Option<&'static [u8]> {
    match name {
        "hand" => Some(HAND),
        "mat" => Some(MAT),
        "humanoid" => Some(HUMANOID),
        "sensing-hand" => Some(SENSING_HAND),
        _ => None,
    }
}
