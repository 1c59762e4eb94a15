//! Frames: a time stamp and the raw values of some taxels.

use std::fmt;

use bytemuck::{Pod, Zeroable};
use glam::{DAffine3, DQuat, DVec3};
use serde::{Serialize, Serializer};

use super::frame_time::FrameTime;

/// One taxel's raw value: a single-precision number, or missing, or faulty.
///
/// Stored as bits, because shader compilers may assume that NaN never occurs; backends compare them as integers.
#[derive(Clone, Copy, PartialEq, Eq, Pod, Zeroable)]
#[repr(transparent)]
pub struct RawValue(u32);

impl RawValue {
    /// No value arrived.
    pub const MISSING: Self = Self(0xFFFF_FFFF);
    /// No value arrived, as the sensor's board is silent. Only for engines that track it (`Engine::track_stale`);
    /// others get [`RawValue::MISSING`].
    pub const STALE: Self = Self(0xFFFF_FFFE);
    /// Something arrived that is not a number.
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

/// Exactly; NaN and infinities become faulty.
impl From<f32> for RawValue {
    fn from(value: f32) -> Self {
        if value.is_finite() { Self(value.to_bits()) } else { Self::FAULTY }
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

impl fmt::Debug for RawValue {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

/// The number, or `missing`, `stale` or `faulty`.
impl fmt::Display for RawValue {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.number() {
            Some(value) => write!(f, "{value}"),
            None if *self == Self::STALE => f.write_str("stale"),
            None if self.is_missing() => f.write_str("missing"),
            None => f.write_str("faulty"),
        }
    }
}

/// A rigid pose in the world, which is z up, x forward, y left.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Translation, m.
    pub translation: DVec3,
    /// Rotation, a unit quaternion.
    pub rotation: DQuat,
}

/// How far a pose may be from the world's origin, m, along each axis: beyond, double precision puts places off by over 0.1 µm.
pub const FARTHEST_POSE_M: f64 = 1e9;
/// Lengths that a quaternion may have to be taken for a rotation.
const QUATERNION_LENGTHS: std::ops::RangeInclusive<f64> = 1e-3..=1e3;
/// By how much the square of a unit quaternion's length may be off 1 for roundings.
const UNIT: f64 = 1e-12;

impl Pose {
    /// Whether it can be computed with: finite numbers, at most [`FARTHEST_POSE_M`] away, and a quaternion that has a length;
    /// else what is wrong with the pose of `link`.
    #[doc(hidden)]
    pub fn check(&self, link: &str) -> Result<(), String> {
        let Self { translation, rotation } = self;
        if !translation.is_finite() || translation.abs().max_element() > FARTHEST_POSE_M {
            let [x, y, z] = translation.to_array();
            return Err(format!(
                "the pose of `{link}` is at {x:e}, {y:e}, {z:e} m; poses may be {FARTHEST_POSE_M:e} m from the origin at most"
            ));
        }
        if !QUATERNION_LENGTHS.contains(&rotation.length()) {
            return Err(format!(
                "the quaternion of `{link}` has length {:e}; give a unit quaternion qx,qy,qz,qw",
                rotation.length()
            ));
        }
        Ok(())
    }

    /// world_from_link; of a quaternion that is not unit the direction counts.
    #[doc(hidden)]
    pub fn transform(&self) -> DAffine3 {
        let is_unit = (self.rotation.length_squared() - 1.0).abs() <= UNIT;
        let rotation = if is_unit { self.rotation } else { self.rotation.normalize() };
        DAffine3::from_rotation_translation(rotation, self.translation)
    }
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
    /// What is left of the time, ns, where its clock is finer than `t_s`; see [`FrameTime`].
    #[serde(skip)]
    pub t_rest_ns: i64,
    /// One value per taxel, [`RawValue::MISSING`] where none arrived.
    pub values: Vec<RawValue>,
    /// Poses of links by name, if the frame has them: world_from_link. A link without one is carried by the nearest above it
    /// that has one, as at rest, unless [`Frame::has_stale_pose`].
    #[serde(skip_serializing_if = "Vec::is_empty", serialize_with = "as_map")]
    pub pose: Vec<(String, Pose)>,
    /// Positions of joints by name (rad, or m for prismatic ones), if the frame has them.
    #[serde(skip_serializing_if = "Vec::is_empty", serialize_with = "positions_as_map")]
    pub joints: Vec<(String, f64)>,
    /// Whether poses are missing because the joints' states are missing or too old: links without a pose of their own are then
    /// nowhere in the world.
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

    /// The time.
    #[must_use]
    pub fn time(&self) -> FrameTime {
        FrameTime { s: self.t_s, rest_ns: self.t_rest_ns }
    }

    /// Gives it the time `time`.
    pub fn set_time(&mut self, time: FrameTime) {
        (self.t_s, self.t_rest_ns) = (time.s, time.rest_ns);
    }

    /// Makes every value missing and drops poses and joints, keeping the allocations.
    pub fn clear(&mut self) {
        self.t_rest_ns = 0;
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
    fn a_single_is_taken_exactly_and_what_is_no_number_is_faulty() {
        for value in [0.1_f32, -0.0, f32::MAX, f32::from_bits(1)] {
            assert_eq!(RawValue::from(value).number(), Some(f64::from(value)));
        }
        assert!([f32::NAN, f32::INFINITY].map(RawValue::from).iter().all(|value| *value == RawValue::FAULTY));
        let words = [RawValue::from(0.5), RawValue::MISSING, RawValue::STALE, RawValue::FAULTY].map(|v| v.to_string());
        assert_eq!(words, ["0.5", "missing", "stale", "faulty"]);
    }

    #[test]
    fn a_pose_that_cannot_be_computed_with_is_refused() {
        let check = |x: f64, rotation: DQuat| Pose { translation: DVec3::X * x, rotation }.check("arm");
        assert_eq!(check(-FARTHEST_POSE_M, DQuat::IDENTITY * 2.0), Ok(()));
        for x in [1.1e9, 1e160, -1e308, f64::NAN, f64::INFINITY] {
            let why = check(x, DQuat::IDENTITY).unwrap_err();
            assert!(
                why.starts_with("the pose of `arm` is at ")
                    && why.ends_with("poses may be 1e9 m from the origin at most")
            );
        }
        for w in [0.0, 1e-4, 1e4, f64::NAN, f64::INFINITY] {
            let why = check(0.0, DQuat::from_xyzw(0.0, 0.0, 0.0, w)).unwrap_err();
            assert!(why.starts_with("the quaternion of `arm` has length ") && why.len() < 100, "{why}");
        }
        // What is off by more than rounding does not scale places.
        let pose = Pose { translation: DVec3::X, rotation: DQuat::from_rotation_z(0.3) * 1.5 };
        let right = DVec3::X + DQuat::from_rotation_z(0.3) * DVec3::Y;
        assert!(pose.transform().transform_point3(DVec3::Y).distance(right) < 1e-15);
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
