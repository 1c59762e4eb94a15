//! What limbs send: frames and their layout as little-endian packets, percepts as JSON. No I/O, no clock.
//!
//! The format of boards ([`crate::wire`]) holds 256 channels of 16 bits; limbs have any number of taxels, and raw values that
//! are single-precision numbers.

use serde::Deserialize;
use serde_json::value::RawValue as RawJson;

use crate::signal::RawValue;
use crate::wire::{Head, layout_hash};

/// The version of packets and of percepts' key `somatic_limb`.
const VERSION: u8 = 1;
/// Bytes of a packet's head: version, kind, boot, 0, sequence, time.
const HEAD_BYTES: usize = 12;
/// Bytes of a frame without its values: the head, and the layout's hash.
pub const FRAME_BYTES: usize = HEAD_BYTES + 4;

const FRAME: u8 = 1;
const LAYOUT: u8 = 2;
const END: u8 = 3;

/// A packet, taken apart.
#[derive(Debug, PartialEq)]
pub enum Packet<'a> {
    /// A value for each taxel of the layout with this hash; four bytes each.
    Frame {
        /// The hash.
        layout: u32,
        /// The values.
        values: &'a [u8],
    },
    /// The taxels' ids, four bytes each.
    Layout {
        /// The ids.
        taxels: Vec<u32>,
    },
    /// The limb has ended on purpose.
    End,
    /// A line of percepts.
    Percepts(Percepts<'a>),
}

/// Percepts of a frame, as a limb sends them.
#[derive(Debug, Deserialize)]
pub struct Percepts<'a> {
    somatic_limb: u32,
    boot: u8,
    sequence: u32,
    /// The limb's time, s.
    pub t: f64,
    /// The number of the frame.
    pub frame: u64,
    /// As in NDJSON, as are those that follow.
    #[serde(borrow)]
    pub fields: &'a RawJson,
    #[serde(borrow, default)]
    /// As there.
    pub touches: Option<&'a RawJson>,
    #[serde(borrow, default)]
    /// As there.
    pub released: Option<&'a RawJson>,
    #[serde(borrow, default)]
    /// As there.
    pub self_contacts: Option<&'a RawJson>,
}

impl PartialEq for Percepts<'_> {
    fn eq(&self, other: &Self) -> bool {
        let key = |of: &Self| (of.boot, of.sequence, of.t.to_bits(), of.frame);
        let json = |of: &Self| {
            let optional = [of.touches, of.released, of.self_contacts];
            (of.fields.get().to_owned(), optional.map(|json| json.map(|json| json.get().to_owned())))
        };
        key(self) == key(other) && json(self) == json(other)
    }
}

/// Microseconds of `t_s`, modulo 2³².
fn wrapped_us(t_s: f64) -> u32 {
    (t_s * 1e6).round() as i64 as u32
}

fn head(kind: u8, boot: u8, sequence: u32, time_us: u32, to: &mut Vec<u8>) {
    to.clear();
    to.extend_from_slice(&[VERSION, kind, boot, 0]);
    to.extend_from_slice(&sequence.to_le_bytes());
    to.extend_from_slice(&time_us.to_le_bytes());
}

/// Writes a frame at `t_s` (s) over `to`; `layout` is the hash of its taxels.
pub fn frame_packet(to: &mut Vec<u8>, boot: u8, sequence: u32, t_s: f64, layout: u32, values: &[RawValue]) {
    head(FRAME, boot, sequence, wrapped_us(t_s), to);
    to.extend_from_slice(&layout.to_le_bytes());
    // Bytes of the machine's own order are the packet's on all but a few.
    if cfg!(target_endian = "little") {
        to.extend_from_slice(bytemuck::cast_slice(values));
    } else {
        values.iter().for_each(|value| to.extend_from_slice(&value.to_bits().to_le_bytes()));
    }
}

/// Writes the layout of `frame`, a packet that comes next, and those after it over `to`.
pub fn layout_packet(to: &mut Vec<u8>, frame: &[u8], taxels: &[u32]) {
    to.clear();
    to.extend_from_slice(&frame[..HEAD_BYTES]);
    to[1] = LAYOUT;
    taxels.iter().for_each(|taxel| to.extend_from_slice(&taxel.to_le_bytes()));
}

/// What begins a line of percepts, in place of its `{`.
#[derive(Clone, Copy, Debug)]
pub struct PerceptHead {
    pub boot: u8,
    pub sequence: u32,
}

/// Writes the begin of a line of percepts over `to`; the line without its `{` is to follow.
pub fn percepts_begin(to: &mut Vec<u8>, head: PerceptHead) {
    to.clear();
    let PerceptHead { boot, sequence } = head;
    to.extend_from_slice(format!("{{\"somatic_limb\":{VERSION},\"boot\":{boot},\"sequence\":{sequence},").as_bytes());
}

/// Writes the end of a limb, which has sent the frames or percepts before `sequence`, over `to`.
pub fn end_packet(to: &mut Vec<u8>, boot: u8, sequence: u32, t_s: f64) {
    head(END, boot, sequence, wrapped_us(t_s), to);
}

/// The value that four bytes of a frame stand for. Any NaN but the two that say so is a faulty value.
pub fn raw_value(bytes: [u8; 4]) -> RawValue {
    let bits = u32::from_le_bytes(bytes);
    match bits {
        _ if bits == RawValue::MISSING.to_bits() => RawValue::MISSING,
        _ if bits == RawValue::STALE.to_bits() => RawValue::STALE,
        _ => RawValue::new(f32::from_bits(bits).into()),
    }
}

/// Takes a packet apart.
///
/// # Errors
/// Why it is none, in words.
pub fn open(bytes: &[u8]) -> Result<(Head, Packet<'_>), String> {
    let of_limb = |boot, sequence, time_us| Head { board: 0, boot, sequence, time_us };
    if bytes.first() == Some(&b'{') {
        let line: Percepts<'_> =
            serde_json::from_slice(bytes).map_err(|e| format!("it sends JSON that is not percepts: {e}"))?;
        if line.somatic_limb != u32::from(VERSION) {
            return Err(other_version(line.somatic_limb));
        }
        if !line.t.is_finite() {
            return Err("it sends percepts without a time".to_owned());
        }
        return Ok((of_limb(line.boot, line.sequence, wrapped_us(line.t)), Packet::Percepts(line)));
    }
    let Some((head, rest)) = bytes.split_first_chunk::<HEAD_BYTES>() else {
        return Err("it sends something else than frames of a limb".to_owned());
    };
    let [version, kind, boot, _, head @ ..] = *head;
    let word = |at: usize| u32::from_le_bytes([head[at], head[at + 1], head[at + 2], head[at + 3]]);
    if version != VERSION {
        return Err(other_version(version.into()));
    }
    let packet = match kind {
        FRAME => match rest.split_first_chunk::<4>() {
            Some((layout, values)) if values.len() % 4 == 0 => {
                Packet::Frame { layout: u32::from_le_bytes(*layout), values }
            }
            _ => return Err("it sends frames that are cut off".to_owned()),
        },
        LAYOUT if rest.len() % 4 == 0 => {
            let taxel = |bytes: &[u8]| u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]);
            Packet::Layout { taxels: rest.chunks_exact(4).map(taxel).collect() }
        }
        END => Packet::End,
        _ => return Err(format!("it sends packets of kind {kind}, which this program does not know")),
    };
    Ok((of_limb(boot, word(0), word(4)), packet))
}

fn other_version(version: u32) -> String {
    format!("it sends version {version} of the format of limbs; this program reads version {VERSION}")
}

/// The hash of a layout, as boards have it.
pub fn hash(taxels: &[u32]) -> u32 {
    layout_hash(taxels.iter().map(|taxel| Some(*taxel)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn packets_come_back_as_they_went() {
        let values = [RawValue::new(0.1), RawValue::MISSING, RawValue::STALE, RawValue::FAULTY, RawValue::new(1e-40)];
        let mut bytes = Vec::new();
        frame_packet(&mut bytes, 9, 70_000, -0.25, 0xABCD, &values);
        assert_eq!(bytes.len(), FRAME_BYTES + 4 * values.len());
        let (head, packet) = open(&bytes).unwrap();
        let time_us = (-250_000_i32) as u32;
        assert_eq!(head, Head { board: 0, boot: 9, sequence: 70_000, time_us });
        let Packet::Frame { layout: 0xABCD, values: got } = packet else { panic!("{packet:?}") };
        let got: Vec<RawValue> = got.chunks_exact(4).map(|four| raw_value(four.try_into().unwrap())).collect();
        assert_eq!(got, values);
        let mut layout = Vec::new();
        layout_packet(&mut layout, &bytes, &[4, 70_000]);
        assert_eq!(open(&layout).unwrap(), (head, Packet::Layout { taxels: vec![4, 70_000] }));
        end_packet(&mut bytes, 9, 12, 1.0);
        assert_eq!(open(&bytes).unwrap(), (Head { board: 0, boot: 9, sequence: 12, time_us: 1_000_000 }, Packet::End));
        percepts_begin(&mut bytes, PerceptHead { boot: 2, sequence: 8 });
        bytes.extend_from_slice(br#""t":0.5,"frame":6,"fields":[{"field":"a"}]}"#);
        let (head, packet) = open(&bytes).unwrap();
        assert_eq!(head, Head { board: 0, boot: 2, sequence: 8, time_us: 500_000 });
        let Packet::Percepts(line) = packet else { panic!() };
        assert_eq!((line.frame, line.fields.get()), (6, r#"[{"field":"a"}]"#));
        assert!(line.touches.is_none() && line.released.is_none() && line.self_contacts.is_none());
        percepts_begin(&mut bytes, PerceptHead { boot: 2, sequence: 9 });
        bytes.extend_from_slice(
            br#""t":0.5,"frame":7,"touches":[{"id":3}],"released":[2],"fields":[],"self_contacts":[]}"#,
        );
        let Packet::Percepts(line) = open(&bytes).unwrap().1 else { panic!() };
        let json = [line.touches, line.released, line.self_contacts].map(|json| json.map(RawJson::get));
        assert_eq!(json, [Some(r#"[{"id":3}]"#), Some("[2]"), Some("[]")]);
    }

    #[test]
    fn a_packet_is_as_the_page_has_it() {
        let mut bytes = Vec::new();
        frame_packet(&mut bytes, 7, 2, 0.02, hash(&[4]), &[RawValue::new(1.5)]);
        assert_eq!(bytes, [1, 1, 7, 0, 2, 0, 0, 0, 0x20, 0x4E, 0, 0, 0x4B, 0x48, 0x26, 0xAE, 0, 0, 0xC0, 0x3F]);
    }

    #[test]
    fn what_is_not_a_packet_is_reported() {
        let mut frame = Vec::new();
        frame_packet(&mut frame, 0, 0, 0.0, 1, &[RawValue::new(1.0)]);
        for cut in 0..frame.len() {
            let opened = open(&frame[..cut]);
            assert_eq!(opened.is_ok(), cut == FRAME_BYTES, "{cut}");
        }
        for (at, byte, why) in [(0, 2, "version 2"), (1, 9, "kind 9")] {
            let mut other = frame.clone();
            other[at] = byte;
            assert!(open(&other).unwrap_err().contains(why));
        }
        for line in [r#"{"t":1}"#, "{", r#"{"somatic_limb":2,"boot":1,"sequence":1,"t":0,"frame":0,"fields":[]}"#] {
            assert!(open(line.as_bytes()).is_err(), "{line}");
        }
        assert_eq!(raw_value(f32::NAN.to_bits().to_le_bytes()), RawValue::FAULTY);
        assert_eq!(raw_value(0xFFFF_FFFD_u32.to_le_bytes()), RawValue::FAULTY);
    }

    #[test]
    fn whatever_comes_is_a_packet_or_a_reason() {
        let (mut frame, mut layout, mut end) = (Vec::new(), Vec::new(), Vec::new());
        frame_packet(&mut frame, 9, 70_000, -0.25, 0xABCD, &[RawValue::new(0.1), RawValue::MISSING]);
        layout_packet(&mut layout, &frame, &[4, 70_000]);
        end_packet(&mut end, 9, 12, 1.0);
        let line = br#"{"somatic_limb":1,"boot":2,"sequence":8,"t":0.5,"frame":6,"fields":[{"field":"a"}]}"#.to_vec();
        let mut state = 1_u64;
        let mut next = |below: usize| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) as usize % below.max(1)
        };
        let (mut taken, mut refused) = (0, 0);
        for case in 0..40_000 {
            let mut bytes = [&frame, &layout, &end, &line][case % 4].clone();
            for _ in 0..=next(3) {
                let at = next(bytes.len());
                match next(5) {
                    0 => bytes[at] ^= 1 << next(8),
                    1 => bytes[at] = next(256) as u8,
                    2 => bytes.truncate(at + 1),
                    3 => bytes.extend_from_within(at..),
                    _ => drop(bytes.drain(at..bytes.len().min(at + 1 + next(8)))),
                }
                bytes.push(next(256) as u8);
            }
            match open(&bytes) {
                Ok((_, Packet::Frame { values, .. })) => {
                    for four in values.chunks_exact(4) {
                        let _ = raw_value([four[0], four[1], four[2], four[3]]);
                    }
                    taken += 1;
                }
                Ok(_) => taken += 1,
                Err(why) => {
                    assert!(why.len() > 10 && !why.contains('\n'), "{why}");
                    refused += 1;
                }
            }
        }
        assert!(taken > 1000 && refused > 1000, "{taken}, {refused}");
    }
}
