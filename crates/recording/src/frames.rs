//! A frame as a message, `somatic.Frame`: its values as single-precision numbers, what is missing listed beside them.
//!
//! Where most values are missing, as in what boards deliver live, those that came are listed instead. Of what is missing,
//! what is stale is listed once more.

use glam::{DQuat, DVec3};
use prost::Message as _;

use crate::signal::{Frame, Pose, RawValue};

/// `somatic.Frame`.
#[derive(Clone, PartialEq, prost::Message)]
pub(super) struct FrameMessage {
    #[prost(double, optional, tag = "1")]
    t: Option<f64>,
    /// `repeated float` in the schema, whose bytes these are: they are copied in one piece.
    #[prost(bytes = "vec", optional, tag = "2")]
    values: Option<Vec<u8>>,
    #[prost(uint32, repeated, tag = "3")]
    missing: Vec<u32>,
    #[prost(uint32, repeated, tag = "4")]
    present: Vec<u32>,
    #[prost(message, repeated, tag = "5")]
    poses: Vec<LinkPose>,
    #[prost(uint32, repeated, tag = "6")]
    stale: Vec<u32>,
    #[prost(message, repeated, tag = "7")]
    joints: Vec<JointPosition>,
    #[prost(bool, tag = "8")]
    has_stale_pose: bool,
    #[prost(int64, tag = "9")]
    t_rest: i64,
}

/// `somatic.JointPosition`.
#[derive(Clone, PartialEq, prost::Message)]
struct JointPosition {
    #[prost(string, tag = "1")]
    joint: String,
    #[prost(double, tag = "2")]
    position: f64,
}

/// `somatic.LinkPose`.
#[derive(Clone, PartialEq, prost::Message)]
struct LinkPose {
    #[prost(string, tag = "1")]
    link: String,
    /// The translation's x, y, z and the rotation's x, y, z, w.
    #[prost(double, repeated, tag = "2")]
    pose: Vec<f64>,
}

/// Puts `frame` into `to`, in place of what it holds.
pub(super) fn encode(frame: &Frame, to: &mut Vec<u8>) {
    let values = &frame.values;
    let indices = |are_missing: bool| -> Vec<u32> {
        let chosen = (0..).zip(values).filter(|(_, value)| value.is_missing() == are_missing);
        chosen.map(|(index, _)| index).collect()
    };
    let missing = indices(true);
    let stale = missing.iter().copied().filter(|&index| values[index as usize] == RawValue::STALE).collect();
    let pose = |(link, Pose { translation: p, rotation: q }): &(String, Pose)| LinkPose {
        link: link.clone(),
        pose: vec![p.x, p.y, p.z, q.x, q.y, q.z, q.w],
    };
    let poses = frame.pose.iter().map(pose).collect();
    let joint = |(joint, position): &(String, f64)| JointPosition { joint: joint.clone(), position: *position };
    let joints = frame.joints.iter().map(joint).collect();
    let has_stale_pose = frame.has_stale_pose;
    let mut message = FrameMessage {
        t: Some(frame.t_s),
        t_rest: frame.t_rest_ns,
        poses,
        stale,
        joints,
        has_stale_pose,
        ..FrameMessage::default()
    };
    let bytes = if 2 * missing.len() > values.len() {
        message.present = indices(false);
        let present = values.iter().filter(|value| !value.is_missing());
        present.flat_map(|value| value.to_bits().to_le_bytes()).collect()
    } else {
        message.missing = missing;
        if cfg!(target_endian = "little") {
            bytemuck::cast_slice(values).to_vec()
        } else {
            values.iter().flat_map(|value| value.to_bits().to_le_bytes()).collect()
        }
    };
    message.values = Some(bytes);
    to.clear();
    message.encode(to).expect("a vector has room");
}

/// The value with these bits; whatever is not a number but `MISSING` is faulty.
fn value_of(bits: [u8; 4]) -> RawValue {
    let single = f32::from_le_bytes(bits);
    if single.is_finite() { RawValue::new(single.into()) } else { RawValue::FAULTY }
}

impl FrameMessage {
    /// Reads it from `bytes`; `None` where they are not such a message, or have no time.
    pub(super) fn read(bytes: &[u8]) -> Option<Self> {
        Self::decode(bytes).ok().filter(|message| message.t.is_some_and(f64::is_finite))
    }

    /// Whether any of its values is stale.
    pub(super) fn has_stale(&self) -> bool {
        !self.stale.is_empty()
    }

    /// Puts it into `frame`, which has `width` values, with `stale` for those that are. `None` where it is not such a frame.
    pub(super) fn put_into(&self, frame: &mut Frame, width: usize, stale: RawValue) -> Option<()> {
        (frame.t_s, frame.t_rest_ns) = (self.t.unwrap_or_default(), self.t_rest);
        let (words, rest) = self.values.as_deref().unwrap_or_default().as_chunks::<4>();
        if !rest.is_empty() {
            return None;
        }
        frame.values.clear();
        if self.present.is_empty() && words.len() == width {
            frame.values.extend(words.iter().map(|&bits| value_of(bits)));
        } else if self.present.len() == words.len() {
            frame.values.resize(width, RawValue::MISSING);
            for (&index, &bits) in self.present.iter().zip(words) {
                *frame.values.get_mut(index as usize)? = value_of(bits);
            }
        } else {
            return None;
        }
        for (indices, value) in [(&self.missing, RawValue::MISSING), (&self.stale, stale)] {
            for &index in indices {
                *frame.values.get_mut(index as usize)? = value;
            }
        }
        frame.pose.clear();
        for LinkPose { link, pose } in &self.poses {
            let [x, y, z, qx, qy, qz, qw] = pose[..] else { return None };
            if !pose.iter().all(|number| number.is_finite()) {
                return None;
            }
            let pose = Pose { translation: DVec3::new(x, y, z), rotation: DQuat::from_xyzw(qx, qy, qz, qw) };
            frame.pose.push((link.clone(), pose));
        }
        frame.joints.clear();
        for JointPosition { joint, position } in &self.joints {
            if !position.is_finite() {
                return None;
            }
            frame.joints.push((joint.clone(), *position));
        }
        frame.has_stale_pose = self.has_stale_pose;
        Some(())
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::signal::FrameTime;

    fn value() -> impl Strategy<Value = RawValue> {
        prop_oneof![
            any::<f32>().prop_map(|value| RawValue::new(value.into())),
            Just(RawValue::MISSING),
            Just(RawValue::STALE),
            Just(RawValue::FAULTY),
            Just(RawValue::new(-0.0)),
            Just(RawValue::new(f64::from(f32::from_bits(1)))),
        ]
    }

    fn frame() -> impl Strategy<Value = Frame> {
        let sparse = prop::collection::vec(prop_oneof![9 => Just(RawValue::MISSING), 1 => value()], 0..300);
        let values = prop_oneof![prop::collection::vec(value(), 0..300), sparse];
        let pose = ("[a-z/é]{0,9}", prop::array::uniform7(-1e3..1e3_f64)).prop_map(|(link, [x, y, z, a, b, c, d])| {
            (link, Pose { translation: DVec3::new(x, y, z), rotation: DQuat::from_xyzw(a, b, c, d) })
        });
        let joints = prop::collection::vec(("[a-z]{0,9}", -9.0..9.0_f64), 0..3);
        let times = prop_oneof![
            (-1e12..1e12_f64).prop_map(FrameTime::from),
            (1_700_000_000_000_000_000..1_800_000_000_000_000_000_i64).prop_map(FrameTime::from_ns)
        ];
        (times, values, prop::collection::vec(pose, 0..3), joints, any::<bool>()).prop_map(
            |(time, values, pose, joints, has_stale_pose)| {
                let mut frame = Frame { values, pose, joints, has_stale_pose, ..Frame::default() };
                frame.set_time(time);
                frame
            },
        )
    }

    proptest! {
        #[test]
        fn a_frame_comes_back_bit_for_bit(frame in frame()) {
            let mut bytes = Vec::new();
            encode(&frame, &mut bytes);
            let mut back = Frame::default();
            let message = FrameMessage::read(&bytes).unwrap();
            prop_assert_eq!(message.put_into(&mut back, frame.values.len(), RawValue::STALE), Some(()));
            prop_assert_eq!(back.t_s.to_bits(), frame.t_s.to_bits());
            prop_assert_eq!(&back, &frame);
            // As numbers 0 and −0 are one; as bits they are not.
            let bits = |frame: &Frame| frame.values.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
            prop_assert_eq!(bits(&back), bits(&frame));
        }

        #[test]
        fn damage_gives_another_frame_or_none(frame in frame(), at in any::<prop::sample::Index>(), to in any::<u8>()) {
            let mut bytes = Vec::new();
            encode(&frame, &mut bytes);
            let at = at.index(bytes.len());
            bytes[at] = to;
            let mut back = Frame::default();
            let width = frame.values.len();
            if FrameMessage::read(&bytes).is_some_and(|it| it.put_into(&mut back, width, RawValue::STALE).is_some()) {
                prop_assert_eq!(back.values.len(), width);
                prop_assert!(back.t_s.is_finite());
            }
        }
    }

    #[test]
    fn a_frame_of_another_width_is_none() {
        let mut bytes = Vec::new();
        encode(&Frame { values: vec![RawValue::new(1.0); 3], ..Frame::default() }, &mut bytes);
        assert_eq!(FrameMessage::read(&bytes).unwrap().put_into(&mut Frame::default(), 4, RawValue::STALE), None);
    }

    #[test]
    fn what_is_stale_is_missing_for_whoever_does_not_heed_it() {
        let seen = Frame { values: vec![RawValue::new(1.0), RawValue::STALE, RawValue::MISSING], ..Frame::default() };
        let mut bytes = Vec::new();
        encode(&seen, &mut bytes);
        let message = FrameMessage::read(&bytes).unwrap();
        assert!(message.has_stale());
        let mut back = Frame::default();
        message.put_into(&mut back, 3, RawValue::MISSING).unwrap();
        assert_eq!(back.values, [RawValue::new(1.0), RawValue::MISSING, RawValue::MISSING]);
        encode(&back, &mut bytes);
        assert!(!FrameMessage::read(&bytes).unwrap().has_stale());
    }
}
