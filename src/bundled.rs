//! The bodies and the touch that come with the crate; `bodies/README.md` says what they are and how they were made.

/// The hand of the paper: 40 taxels on four boards and four digits.
pub const HAND: &[u8] = include_bytes!("../bodies/hand.glb");

/// A pressure mat of 64 × 32 taxels.
pub const MAT: &[u8] = include_bytes!("../bodies/mat.glb");

/// A humanoid of 0.75 m.
pub const HUMANOID: &[u8] = include_bytes!("../bodies/humanoid.glb");

/// A touch of the hand, as CSV: taps, a rod rolled over the back, a stroke across the palm.
pub const TOUCH: &[u8] = include_bytes!("../bodies/touch.csv");
