//! Messages of every type, written here byte by byte.

use somatic_testing::{damage, numbers};

use super::super::super::messages::{
    Float32MultiArray, Header, JointState, Message as _, MultiArrayDimension, MultiArrayLayout, Time,
};
use super::*;
use crate::source::ArrayMap;

/// Bytes at multiples of their size, as CDR has them.
#[derive(Default)]
struct Bytes(Vec<u8>);

impl Bytes {
    fn put(mut self, bytes: &[u8]) -> Self {
        self.0.resize(self.0.len().next_multiple_of(bytes.len()), 0);
        self.0.extend_from_slice(bytes);
        self
    }

    fn text(self, text: &str) -> Self {
        let mut own = self.put(&(text.len() as u32 + 1).to_le_bytes());
        own.0.extend_from_slice(text.as_bytes());
        own.0.push(0);
        own
    }

    fn message(self) -> Vec<u8> {
        [&[0, 1, 0, 0][..], &self.0].concat()
    }
}

fn plan(map: &str, text: &str) -> crate::error::Result<Plan> {
    Plan::new(&ArrayMap::parse(map)?, "a/msg/B", text, true)
}

fn read(map: &str, text: &str, message: &[u8]) -> Walked<Taken> {
    let mut taken = Taken::default();
    plan(map, text).unwrap().read(message, &mut taken).map(|()| taken)
}

#[test]
fn every_type_of_number_is_read() {
    let text = "bool a\nuint8 b\nint8 c\nuint16 d\nint16 e\nuint32 f\nint32 g\nuint64 h\nint64 i\nfloat32 j\nfloat64 k\nbyte l\nchar m";
    let little = Bytes::default()
        .put(&[1])
        .put(&[200])
        .put(&(-2_i8).to_le_bytes())
        .put(&40_000_u16.to_le_bytes())
        .put(&(-3_i16).to_le_bytes())
        .put(&3_000_000_000_u32.to_le_bytes())
        .put(&(-4_i32).to_le_bytes())
        .put(&(1_u64 << 40).to_le_bytes())
        .put(&(-5_i64).to_le_bytes())
        .put(&0.5_f32.to_le_bytes())
        .put(&(-0.25_f64).to_le_bytes())
        .put(&[6])
        .put(&[7])
        .message();
    let right = [1.0, 200.0, -2.0, 40_000.0, -3.0, 3e9, -4.0, 2_f64.powi(40), -5.0, 0.5, -0.25, 6.0, 7.0];
    let map = "values = ['a', 'b', 'c', 'd', 'e', 'f', 'g', 'h', 'i', 'j', 'k', 'l', 'm']";
    assert_eq!(read(map, text, &little).unwrap().values.concat(), right);
    // The same in the other order of bytes.
    let big = [&[0, 0, 0, 0][..], &Bytes::default().put(&2_u16.to_be_bytes()).put(&1.5_f64.to_be_bytes()).0].concat();
    assert_eq!(read("values = ['a', 'b']", "uint16 a\nfloat64 b", &big).unwrap().values.concat(), [2.0, 1.5]);
}

#[test]
fn names_of_sensors_come_with_how_many_values_each_has() {
    let text = "Pad[] pads\n====\nMSG: a/Pad\nstring name\nfloat32[] values\n";
    let mut bytes = Bytes::default().put(&2_u32.to_le_bytes());
    for (name, count) in [("tip", 2_u32), ("palm", 3)] {
        bytes = bytes.text(name).put(&count.to_le_bytes());
        for value in 0..count {
            bytes = bytes.put(&(value as f32).to_le_bytes());
        }
    }
    let taken = read("values = 'pads[*].values'\nnames = 'pads[*].name'", text, &bytes.message()).unwrap();
    assert_eq!((taken.names, taken.counts), (vec!["tip".to_owned(), "palm".to_owned()], vec![2, 3]));
    assert_eq!(taken.values, [[0.0, 1.0, 0.0, 1.0, 2.0]]);
    // Names beside an array of values.
    let beside = "string[] name\nfloat64[] position";
    let bytes = Bytes::default().put(&2_u32.to_le_bytes()).text("a").text("b").put(&2_u32.to_le_bytes());
    let message = bytes.put(&0.5_f64.to_le_bytes()).put(&1.5_f64.to_le_bytes()).message();
    let taken = read("values = 'position'\nnames = 'name[*]'", beside, &message).unwrap();
    assert_eq!((taken.names.len(), taken.counts, taken.values.concat()), (2, vec![2], vec![0.5, 1.5]));
    for (map, text, says) in [
        ("values = 'pads[*].values'\nnames = 'pads[*].values'", text, "names: `pads[*].values` is a number, not text"),
        ("values = 'position'\nnames = 'name'", beside, "names: `name` is an array of texts; write name[*]"),
        ("values = 'position'\nnames = 'nam'", beside, "names: a/B has no `nam`; did you mean `name`?"),
    ] {
        let why = plan(map, text).err().unwrap().to_string();
        assert!(why.contains(says), "{map}: {why}");
    }
}

#[test]
fn arrays_within_messages_within_arrays_come_in_their_order() {
    let text = "string name\nPad[] pads\nint16[3] rest\nEmpty none\nuint8[<=4] few\n====\nMSG: a/Pad\nuint8 id\n\
                float32[2] pressure\nfloat64[] more\n====\nMSG: a/Empty\n";
    let mut bytes = Bytes::default().text("hand").put(&2_u32.to_le_bytes());
    for pad in 0..2_u8 {
        bytes = bytes.put(&[pad]).put(&f32::from(pad).to_le_bytes()).put(&10_f32.to_le_bytes());
        // A sequence of none has no room for its numbers.
        bytes = bytes.put(&u32::from(pad).to_le_bytes());
        if pad == 1 {
            bytes = bytes.put(&0.5_f64.to_le_bytes());
        }
    }
    for value in [-1_i16, 2, 3] {
        bytes = bytes.put(&value.to_le_bytes());
    }
    let message = bytes.put(&[0]).put(&1_u32.to_le_bytes()).put(&[9]).message();
    let values = |map: &str| read(map, text, &message).unwrap().values.concat();
    assert_eq!(values("values = 'pads[*].pressure'"), [0.0, 10.0, 1.0, 10.0]);
    assert_eq!(values("values = 'pads[*].pressure[0]'"), [0.0, 1.0]);
    assert_eq!(values("values = 'pads[1].pressure'"), [1.0, 10.0]);
    assert_eq!(values("values = ['few', 'rest[1:3]', 'pads[*].more']"), [9.0, 2.0, 3.0, 0.5]);
    assert_eq!(values("values = ['pads[0].id', 'pads[1].id']"), [0.0, 1.0]);
    let why = read("values = 'pads[4].id'", text, &message).unwrap_err();
    assert_eq!(why, Trouble::Wrong(failed!("`pads` has 2 items, and [4] is asked for")));
    let longer = [&message[..], &[0; 9]].concat();
    let why = read("values = 'few'", text, &longer).unwrap_err();
    assert!(matches!(why, Trouble::Wrong(e) if e.to_string().contains("9 bytes of it are left over")));
}

#[test]
fn layouts_stamps_and_decoders_are_followed() {
    let dim = |label: &str, size, stride| MultiArrayDimension { label: label.to_owned(), size, stride };
    let layout = MultiArrayLayout { dim: vec![dim("rows", 2, 1), dim("columns", 3, 2)], data_offset: 1 };
    let array = Float32MultiArray { layout, data: vec![9.0, 1.0, 4.0, 2.0, 5.0, 3.0, 6.0] };
    for path in ["data", "data[*]"] {
        let map = ArrayMap::parse(&format!("values = '{path}'")).unwrap();
        let plan = Plan::new(&map, Float32MultiArray::TYPE, &Float32MultiArray::definition(), true).unwrap();
        let mut taken = Taken::default();
        plan.read(&array.to_cdr(), &mut taken).unwrap();
        assert_eq!(taken.values.concat(), [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
        assert_eq!((taken.lies, taken.time), (Some(Lies::ByColumns), None));
    }
    let state = JointState {
        header: Header { stamp: Time { sec: 3, nanosec: 7 }, frame_id: "f".to_owned() },
        name: vec!["a".to_owned(), "b".to_owned()],
        position: vec![0.5, 1.5],
        ..JointState::default()
    };
    let map = ArrayMap::parse("values = 'position'").unwrap();
    let plan = Plan::new(&map, JointState::TYPE, &JointState::definition(), true).unwrap();
    let mut taken = Taken::default();
    plan.read(&state.to_cdr(), &mut taken).unwrap();
    assert_eq!((taken.values.concat(), taken.time), (vec![0.5, 1.5], Some(Stamp::Ns(3_000_000_007))));
    let digits = Bytes::default().text("00ff0100").message();
    let values = read("values = 'a'\ndecoder = 'hex16'", "string a", &digits).unwrap().values;
    assert_eq!(values.concat(), [255.0, 256.0]);
    let bytes = Bytes::default().put(&4_u32.to_le_bytes()).put(&[255, 255, 1, 0]).message();
    let values = read("values = 'a'\ndecoder = 'i16le'", "uint8[] a", &bytes).unwrap().values;
    assert_eq!(values.concat(), [-1.0, 1.0]);
}

#[test]
fn a_path_that_is_wrong_names_the_nearest_field_in_a_line() {
    let text = "Pad[] pads\nstring word\nfloat32[4] few\nPad one\n====\nMSG: a/Pad\nfloat32[2] pressure\n";
    for (map, says) in [
        ("values = 'pad[*].pressure'", "a/B has no `pad`; did you mean `pads`?"),
        ("values = 'pads[*].presure'", "a/Pad has no `presure`; did you mean `pressure`?"),
        ("values = 'pads.pressure'", "`pads` is an array of messages; write pads[*].pressure"),
        ("values = 'pads'", "`pads` is an array of messages; go on with pads[*].NAME"),
        ("values = 'one'", "`one` is a message; go on with one.NAME"),
        ("values = 'one[*]'", "`one` is a message, not an array"),
        ("values = 'few.x'", "`few` is a number and has no `x`"),
        ("values = 'few[4]'", "`few` has 4 items, and [4] is asked for"),
        ("values = 'word'", "`word` is text; say how"),
        ("values = 'few'\ndecoder = 'hex16'", "`few` is numbers; decoder is for text"),
        ("values = ['few', 'few']", "`few` is named twice"),
        ("values = ['few[0]', 'few[*]']", "items of `few` are named twice"),
        ("values = 'few'\ntime = 'word'", "time: `word` is not a time"),
        ("values = 'few'\ntime = 'stamp'", "time: a/B has no `stamp`"),
    ] {
        let why = plan(map, text).err().unwrap().to_string();
        assert!(why.contains(says) && why.lines().count() == 1, "{map}: {why}");
    }
}

#[test]
fn damaged_messages_are_damaged_or_others_but_never_a_panic() {
    let text =
        "string name\nPad[] pads\nB[] more\n====\nMSG: a/Pad\nfloat32[] pressure\nstd_msgs/Int16MultiArray array\n";
    let map = "values = ['pads[*].pressure', 'pads[*].array']";
    let whole = Bytes::default()
        .text("hand")
        .put(&1_u32.to_le_bytes())
        .put(&1_u32.to_le_bytes())
        .put(&0.5_f32.to_le_bytes())
        .put(&0_u32.to_le_bytes())
        .put(&0_u32.to_le_bytes())
        .put(&2_u32.to_le_bytes())
        .put(&7_i16.to_le_bytes())
        .put(&8_i16.to_le_bytes())
        .put(&0_u32.to_le_bytes())
        .message();
    assert_eq!(read(map, text, &whole).unwrap().values.concat(), [0.5, 7.0, 8.0]);
    for cut in 0..whole.len() {
        assert!(read(map, text, &whole[..cut]).is_err(), "{cut}");
    }
    let mut chance = numbers(3);
    for _ in 0..20_000 {
        let mut bytes = whole.clone();
        damage(&mut bytes, &mut chance);
        let _ = read(map, text, &bytes);
    }
    // A message that lies within itself has no end.
    let endless = read("values = 'x'", "B b\nfloat32 x", &whole).unwrap_err();
    assert_eq!(endless, Trouble::Damaged);
}
