//! Frames: a time stamp and the raw values of some taxels.

use bytemuck::{Pod, Zeroable};
use glam::{DQuat, DVec3};
use serde::{Serialize, Serializer};

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

/// A number; `null` if missing, else `"stale"` or `"faulty"`.
impl Serialize for RawValue {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self.number() {
            Some(_) => serializer.serialize_f32(f32::from_bits(self.0)),
            None if *self == Self::STALE => serializer.serialize_str("stale"),
            None if self.is_missing() => serializer.serialize_none(),
            None => serializer.serialize_str("faulty"),
        }
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

/// `[x, y, z, qx, qy, qz, qw]`.
impl Serialize for Pose {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(self.translation.to_array().into_iter().chain(self.rotation.to_array()))
    }
}

/// The raw values of one instant, in the order of the source's taxel ids.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Frame {
    /// Time, s.
    #[serde(rename = "t")]
    pub t_s: f64,
    /// One value per taxel, [`RawValue::MISSING`] where none arrived.
    pub values: Vec<RawValue>,
    /// Poses of links by name, if the frame has them: world_from_link.
    #[serde(skip_serializing_if = "Vec::is_empty", serialize_with = "as_map")]
    pub pose: Vec<(String, Pose)>,
    /// Positions of joints by name (rad, or m for prismatic ones), if the frame has them.
    #[serde(skip_serializing_if = "Vec::is_empty", serialize_with = "positions_as_map")]
    pub joints: Vec<(String, f64)>,
    /// Whether poses are missing because the joints' states are missing or too old.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub has_stale_pose: bool,
}

fn positions_as_map<S: Serializer>(joints: &[(String, f64)], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_map(joints.iter().map(|(joint, position)| (joint, position)))
}

fn as_map<S: Serializer>(pose: &[(String, Pose)], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_map(pose.iter().map(|(link, pose)| (link, pose)))
}

impl Frame {
    /// A frame at `t_s` in which all of `taxels` values are missing.
    #[must_use]
    pub fn missing(t_s: f64, taxels: usize) -> Self {
        Self { t_s, values: vec![RawValue::MISSING; taxels], ..Self::default() }
    }

    /// Makes every value missing and drops poses and joints, keeping the allocations.
    pub fn clear(&mut self) {
        self.values.fill(RawValue::MISSING);
        self.pose.clear();
        self.joints.clear();
        self.has_stale_pose = false;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_frame_is_json() {
        let pose = Pose { translation: DVec3::X, rotation: DQuat::IDENTITY };
        let values = vec![RawValue::new(0.1), RawValue::MISSING, RawValue::STALE, RawValue::FAULTY];
        let frame = Frame { t_s: 0.5, values, pose: vec![("arm".to_owned(), pose)], ..Frame::default() };
        let expected = r#"{"t":0.5,"values":[0.1,null,"stale","faulty"],"pose":{"arm":[1.0,0.0,0.0,0.0,0.0,0.0,1.0]}}"#;
        assert_eq!(serde_json::to_string(&frame).unwrap(), expected);
    }

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
