//! Frames: a time stamp and the raw values of some taxels.

use bytemuck::{Pod, Zeroable};
use glam::{DQuat, DVec3};

/// One taxel's raw value: a single-precision number, or missing, or faulty.
///
/// Stored as bits, because shader compilers may assume that NaN never occurs; backends compare them as integers.
#[derive(Clone, Copy, PartialEq, Eq, Pod, Zeroable)]
#[repr(transparent)]
pub struct RawValue(u32);

impl RawValue {
    /// No value arrived.
    pub const MISSING: Self = Self(0xFFFF_FFFF);
    /// No value arrived, as the sensor's board is silent. Only for engines that track it ([`crate::Engine::track_stale`]);
    /// others get [`RawValue::MISSING`].
    pub const STALE: Self = Self(0xFFFF_FFFE);
    /// Something arrived that is no number.
    pub const FAULTY: Self = Self(0x7FC0_0000);

    /// `value` rounded to single precision. NaN and infinities become faulty. An underflow becomes the smallest denormal
    /// instead of 0, so that calibration can detect that the value is altered.
    #[must_use]
    pub fn new(value: f64) -> Self {
        let single = value as f32;
        if !single.is_finite() {
            return Self::FAULTY;
        }
        if single == 0.0 && value != 0.0 {
            return Self(f32::from_bits(1).copysign(single).to_bits());
        }
        Self(single.to_bits())
    }

    /// The bits a backend reads.
    #[must_use]
    pub fn to_bits(self) -> u32 {
        self.0
    }

    /// Whether no value arrived.
    #[must_use]
    pub fn is_missing(self) -> bool {
        self == Self::MISSING || self == Self::STALE
    }

    /// The number, if it is one.
    #[must_use]
    pub fn number(self) -> Option<f64> {
        let value = f32::from_bits(self.0);
        value.is_finite().then(|| value.into())
    }
}

impl Default for RawValue {
    fn default() -> Self {
        Self::MISSING
    }
}

impl std::fmt::Debug for RawValue {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.number() {
            Some(value) => write!(f, "{value}"),
            None if *self == Self::STALE => f.write_str("stale"),
            None if self.is_missing() => f.write_str("missing"),
            None => f.write_str("faulty"),
        }
    }
}

/// A rigid pose in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Translation, m.
    pub translation: DVec3,
    /// Rotation, a unit quaternion.
    pub rotation: DQuat,
}

/// The raw values of one instant, in the order of the source's taxel ids.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Frame {
    /// Time, s.
    pub t_s: f64,
    /// One value per taxel, [`RawValue::MISSING`] where none arrived.
    pub values: Vec<RawValue>,
    /// Poses of links by name, if the frame has them: world_from_link.
    pub pose: Vec<(String, Pose)>,
}

impl Frame {
    /// A frame at `t_s` in which all of `taxels` values are missing.
    #[must_use]
    pub fn missing(t_s: f64, taxels: usize) -> Self {
        Self { t_s, values: vec![RawValue::MISSING; taxels], pose: Vec::new() }
    }

    /// Makes every value missing and drops the pose, keeping the allocations.
    pub fn clear(&mut self) {
        self.values.fill(RawValue::MISSING);
        self.pose.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_raw_value_keeps_what_it_was() {
        assert_eq!(RawValue::new(1023.0).number(), Some(1023.0));
        assert_eq!(RawValue::new(f64::NAN), RawValue::FAULTY);
        assert_eq!(RawValue::new(1e39), RawValue::FAULTY);
        assert!(RawValue::default().is_missing() && RawValue::STALE.is_missing());
        assert_eq!(RawValue::STALE.number(), None);
        assert_eq!(RawValue::MISSING.number(), None);
        assert_ne!(RawValue::new(1e-60).number(), Some(0.0));
        assert!(RawValue::new(-1e-60).number().unwrap() < 0.0);
    }
}
