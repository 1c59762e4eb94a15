//! How a link moves against its parent: kept in a body that was made from a URDF.

use glam::{DAffine3, DQuat, DVec3};
use serde::{Deserialize, Serialize};

use crate::error::{Error, Result, failed};

/// Version of the joint JSON that is written, and the latest that is read.
const VERSION: u32 = 1;

/// Key in the `extras` of a link's node whose value is the JSON of the joint to its parent, as one string.
pub(super) const JOINT_KEY: &str = "somatic_joint";

/// The joint between a link and its parent. At position 0 the link is where the body has it at rest.
#[derive(Clone, Debug, PartialEq)]
pub struct LinkJoint {
    /// Its name, unique among the body's joints; empty if it has none.
    pub name: String,
    /// How it moves the link.
    pub motion: LinkMotion,
    /// The least and the greatest position, rad or m, if there is a range.
    pub limits: Option<[f64; 2]>,
    /// The joint that it follows, if any.
    pub mimic: Option<LinkMimic>,
}

/// How a joint moves its link, around or along a unit axis in the link's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LinkMotion {
    /// It turns, rad.
    Revolute(DVec3),
    /// It turns without end, rad.
    Continuous(DVec3),
    /// It slides, m.
    Prismatic(DVec3),
}

/// A joint's position is `multiplier` · that of `joint` + `offset`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LinkMimic {
    /// The name of the joint that it follows.
    pub joint: String,
    /// Factor.
    pub multiplier: f64,
    /// Summand, rad or m.
    pub offset: f64,
}

impl LinkMotion {
    /// The transform of the link at `position` (rad or m), relative to its place at position 0.
    #[must_use]
    pub fn at(self, position: f64) -> DAffine3 {
        match self {
            Self::Revolute(axis) | Self::Continuous(axis) => {
                DAffine3::from_rotation_translation(DQuat::from_axis_angle(axis, position), DVec3::ZERO)
            }
            Self::Prismatic(axis) => DAffine3::from_translation(axis * position),
        }
    }

    fn axis(self) -> DVec3 {
        let (Self::Revolute(axis) | Self::Continuous(axis) | Self::Prismatic(axis)) = self;
        axis
    }
}

#[derive(Clone, Copy, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Kind {
    Revolute,
    Continuous,
    Prismatic,
}

/// The JSON string under [`JOINT_KEY`].
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct JointJson {
    version: u32,
    #[serde(default, skip_serializing_if = "String::is_empty")]
    name: String,
    #[serde(rename = "type")]
    kind: Kind,
    axis: [f64; 3],
    #[serde(default, skip_serializing_if = "Option::is_none")]
    limits: Option<[f64; 2]>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    mimic: Option<LinkMimic>,
}

impl LinkJoint {
    /// The joint in the JSON string `text`.
    #[doc(hidden)]
    pub fn from_json(text: &str) -> Result<Self> {
        let version = serde_json::from_str::<serde_json::Value>(text)
            .ok()
            .and_then(|value| value.get("version").and_then(serde_json::Value::as_u64));
        if let Some(version) = version.filter(|&v| v > u64::from(VERSION)) {
            return Err(failed!("joint version {version} is newer than this program; update it"));
        }
        let json: JointJson = serde_json::from_str(text)
            .map_err(|e| failed!("its joint is not the JSON of a joint: {e}; repair or remove `{JOINT_KEY}`"))?;
        let axis = DVec3::from_array(json.axis).try_normalize();
        let axis = axis.ok_or_else(|| Error::failed("the axis of its joint has no direction; give it one"))?;
        if let Some([least, greatest]) = json.limits
            && !(least.is_finite() && greatest.is_finite() && least <= greatest)
        {
            return Err(failed!(
                "its joint has the limits {least} to {greatest}; give the least first, or leave them out"
            ));
        }
        let is_finite = |mimic: &LinkMimic| mimic.multiplier.is_finite() && mimic.offset.is_finite();
        if json.mimic.as_ref().is_some_and(|mimic| !is_finite(mimic)) {
            return Err(Error::failed("its joint follows another by a number that is not finite; repair it"));
        }
        let motion = match json.kind {
            Kind::Revolute => LinkMotion::Revolute(axis),
            Kind::Continuous => LinkMotion::Continuous(axis),
            Kind::Prismatic => LinkMotion::Prismatic(axis),
        };
        Ok(Self { name: json.name, motion, limits: json.limits, mimic: json.mimic })
    }

    /// The JSON string that [`LinkJoint::from_json`] reads back.
    #[doc(hidden)]
    pub fn to_json(&self) -> String {
        let kind = match self.motion {
            LinkMotion::Revolute(_) => Kind::Revolute,
            LinkMotion::Continuous(_) => Kind::Continuous,
            LinkMotion::Prismatic(_) => Kind::Prismatic,
        };
        let json = JointJson {
            version: VERSION,
            name: self.name.clone(),
            kind,
            axis: self.motion.axis().to_array(),
            limits: self.limits,
            mimic: self.mimic.clone(),
        };
        serde_json::to_string(&json).expect("a joint is plain data")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_joint_survives_its_json() {
        let joint = LinkJoint {
            name: "elbow".into(),
            motion: LinkMotion::Revolute(DVec3::new(0.6, 0.0, -0.8)),
            limits: Some([-2.5, 0.1]),
            mimic: Some(LinkMimic { joint: "shoulder".into(), multiplier: -2.0, offset: 0.25 }),
        };
        assert_eq!(LinkJoint::from_json(&joint.to_json()).unwrap(), joint);
        let plain =
            LinkJoint { motion: LinkMotion::Prismatic(DVec3::Y), limits: None, mimic: None, name: String::new() };
        assert_eq!(LinkJoint::from_json(&plain.to_json()).unwrap(), plain);
        assert_eq!(plain.to_json(), r#"{"version":1,"type":"prismatic","axis":[0.0,1.0,0.0]}"#);
    }

    #[test]
    fn a_wrong_joint_is_named() {
        let why = |text: &str| LinkJoint::from_json(text).unwrap_err().to_string();
        assert!(why(r#"{"version":2,"type":"revolute","axis":[0,0,1]}"#).contains("newer"));
        assert!(why(r#"{"version":1,"type":"ball","axis":[0,0,1]}"#).contains("ball"));
        assert!(why(r#"{"version":1,"type":"revolute","axis":[0,0,0]}"#).contains("no direction"));
        assert!(why(r#"{"version":1,"type":"revolute","axis":[0,0,1],"limits":[2,1]}"#).contains("2 to 1"));
        assert!(why(r#"{"version":1,"type":"revolute","axis":[0,0,1],"limit":[1,2]}"#).contains("limit"));
    }
}
