//! A frame as a message, `somatic.Frame`: its values as single-precision numbers, what is missing listed beside them.
//!
//! Where most values are missing, as in what boards deliver live, those that came are listed instead. Of what is missing,
//! what is stale is listed once more.

use glam::{DQuat, DVec3};

use super::proto::{Fields, Value, Writer, take_varint};
use crate::signal::{Frame, Pose, RawValue};

// The fields' numbers, as in the schema.
pub(super) const T: u32 = 1;
pub(super) const VALUES: u32 = 2;
pub(super) const MISSING: u32 = 3;
pub(super) const PRESENT: u32 = 4;
pub(super) const POSES: u32 = 5;
pub(super) const STALE: u32 = 6;
pub(super) const LINK: u32 = 1;
pub(super) const POSE: u32 = 2;

/// Puts `frame` into `to`, in place of what it holds.
pub(super) fn encode(frame: &Frame, to: &mut Vec<u8>) {
    to.clear();
    let mut writer = Writer(to);
    writer.double(T, frame.t_s);
    let missing = frame.values.iter().filter(|value| value.is_missing()).count();
    let indices = |wanted: bool| {
        (0_u32..).zip(&frame.values).filter(move |(_, value)| value.is_missing() == wanted).map(|(index, _)| index)
    };
    if 2 * missing <= frame.values.len() {
        // Bits are kept in memory as they are on paper, except on a machine that counts bytes from the other end.
        if cfg!(target_endian = "little") {
            writer.bytes(VALUES, bytemuck::cast_slice(&frame.values));
        } else {
            let bytes: Vec<u8> = frame.values.iter().flat_map(|value| value.to_bits().to_le_bytes()).collect();
            writer.bytes(VALUES, &bytes);
        }
        if missing > 0 {
            writer.numbers(MISSING, indices(true));
        }
    } else {
        let there = frame.values.iter().filter(|value| !value.is_missing());
        let bytes: Vec<u8> = there.flat_map(|value| value.to_bits().to_le_bytes()).collect();
        writer.bytes(VALUES, &bytes);
        writer.numbers(PRESENT, indices(false));
    }
    if frame.values.contains(&RawValue::STALE) {
        let stale = (0_u32..).zip(&frame.values).filter(|(_, value)| **value == RawValue::STALE);
        writer.numbers(STALE, stale.map(|(index, _)| index));
    }
    for (link, pose) in &frame.pose {
        writer.message(POSES, |writer| {
            writer.text(LINK, link);
            let Pose { translation: p, rotation: q } = pose;
            let numbers = [p.x, p.y, p.z, q.x, q.y, q.z, q.w];
            writer.bytes(POSE, &numbers.map(f64::to_le_bytes).concat());
        });
    }
}

/// The value with these bits; whatever is no number but `MISSING` is faulty.
fn value_of(bits: [u8; 4]) -> RawValue {
    let single = f32::from_le_bytes(bits);
    if single.is_finite() { RawValue::new(single.into()) } else { RawValue::FAULTY }
}

/// Reads the message in `bytes` into `frame`, which has `width` values, with `stale` for those that are. `None` where it is
/// no such frame.
pub(super) fn decode(bytes: &[u8], width: usize, stale: RawValue, frame: &mut Frame) -> Option<()> {
    frame.pose.clear();
    let mut t_s = None;
    let (mut values, mut missing, mut present, mut stale_ones) = (&[][..], &[][..], None, &[][..]);
    for field in Fields(bytes) {
        match field? {
            (T, value) => t_s = Some(value.double()?),
            (VALUES, Value::Bytes(bytes)) => values = bytes,
            (MISSING, Value::Bytes(bytes)) => missing = bytes,
            (PRESENT, Value::Bytes(bytes)) => present = Some(bytes),
            (STALE, Value::Bytes(bytes)) => stale_ones = bytes,
            (POSES, Value::Bytes(bytes)) => frame.pose.push(pose(bytes)?),
            // Of a later version: what it adds takes nothing away.
            _ => {}
        }
    }
    frame.t_s = t_s.filter(|t_s| t_s.is_finite())?;
    let (words, rest) = values.as_chunks::<4>();
    if !rest.is_empty() {
        return None;
    }
    frame.values.clear();
    match present {
        None if words.len() == width => frame.values.extend(words.iter().map(|&bits| value_of(bits))),
        None => return None,
        Some(mut indices) => {
            frame.values.resize(width, RawValue::MISSING);
            for &bits in words {
                *frame.values.get_mut(usize::try_from(take_varint(&mut indices)?).ok()?)? = value_of(bits);
            }
        }
    }
    while !missing.is_empty() {
        *frame.values.get_mut(usize::try_from(take_varint(&mut missing)?).ok()?)? = RawValue::MISSING;
    }
    while !stale_ones.is_empty() {
        *frame.values.get_mut(usize::try_from(take_varint(&mut stale_ones)?).ok()?)? = stale;
    }
    Some(())
}

/// The time of the frame in `bytes`.
pub(super) fn time_of(bytes: &[u8]) -> Option<f64> {
    Fields(bytes).flatten().find(|(field, _)| *field == T)?.1.double().filter(|t_s| t_s.is_finite())
}

/// Whether the frame in `bytes` has values that are stale.
pub(super) fn has_stale(bytes: &[u8]) -> bool {
    Fields(bytes).flatten().any(|(field, _)| field == STALE)
}

/// Whether the frame in `bytes` poses links.
pub(super) fn is_posed(bytes: &[u8]) -> bool {
    Fields(bytes).flatten().any(|(field, _)| field == POSES)
}

fn pose(bytes: &[u8]) -> Option<(String, Pose)> {
    let (mut link, mut numbers) = (None, None);
    for field in Fields(bytes) {
        match field? {
            (LINK, value) => link = Some(std::str::from_utf8(value.bytes()?).ok()?),
            (POSE, value) => numbers = Some(value.bytes()?),
            _ => {}
        }
    }
    let mut of = [0.0; 7];
    let (words, rest) = numbers?.as_chunks::<8>();
    if words.len() != of.len() || !rest.is_empty() {
        return None;
    }
    for (number, &bits) in of.iter_mut().zip(words) {
        *number = f64::from_le_bytes(bits);
    }
    let [x, y, z, qx, qy, qz, qw] = of;
    let finite = of.iter().all(|number| number.is_finite());
    let pose = Pose { translation: DVec3::new(x, y, z), rotation: DQuat::from_xyzw(qx, qy, qz, qw) };
    finite.then(|| (link.unwrap_or_default().to_owned(), pose))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

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
        (-1e12..1e12_f64, values, prop::collection::vec(pose, 0..3)).prop_map(|(t_s, values, pose)| Frame {
            t_s,
            values,
            pose,
        })
    }

    proptest! {
        #[test]
        fn a_frame_comes_back_bit_for_bit(frame in frame()) {
            let mut bytes = Vec::new();
            encode(&frame, &mut bytes);
            let mut back = Frame::default();
            prop_assert_eq!(decode(&bytes, frame.values.len(), RawValue::STALE, &mut back), Some(()));
            prop_assert_eq!(back.t_s.to_bits(), frame.t_s.to_bits());
            prop_assert_eq!(time_of(&bytes), Some(frame.t_s));
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
            if decode(&bytes, frame.values.len(), RawValue::STALE, &mut back).is_some() {
                prop_assert_eq!(back.values.len(), frame.values.len());
                prop_assert!(back.t_s.is_finite());
            }
        }
    }

    #[test]
    fn a_frame_of_another_width_is_none() {
        let mut bytes = Vec::new();
        encode(&Frame { values: vec![RawValue::new(1.0); 3], ..Frame::default() }, &mut bytes);
        assert_eq!(decode(&bytes, 4, RawValue::STALE, &mut Frame::default()), None);
    }

    #[test]
    fn what_is_stale_is_missing_for_whoever_does_not_heed_it() {
        let seen = Frame { values: vec![RawValue::new(1.0), RawValue::STALE, RawValue::MISSING], ..Frame::default() };
        let mut bytes = Vec::new();
        encode(&seen, &mut bytes);
        assert!(has_stale(&bytes));
        let mut back = Frame::default();
        decode(&bytes, 3, RawValue::MISSING, &mut back).unwrap();
        assert_eq!(back.values, [RawValue::new(1.0), RawValue::MISSING, RawValue::MISSING]);
        encode(&back, &mut bytes);
        assert!(!has_stale(&bytes));
    }
}
