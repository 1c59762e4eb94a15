//! Protocol Buffers' wire format, as much of it as messages here need: numbers, bytes and messages within messages.

/// Adds fields to a message.
pub(super) struct Writer<'a>(pub(super) &'a mut Vec<u8>);

const VARINT: u32 = 0;
const FIXED64: u32 = 1;
const BYTES: u32 = 2;
const FIXED32: u32 = 5;

impl Writer<'_> {
    fn varint(&mut self, mut value: u64) {
        while value >= 0x80 {
            self.0.push(value as u8 | 0x80);
            value >>= 7;
        }
        self.0.push(value as u8);
    }

    fn tag(&mut self, field: u32, kind: u32) {
        self.varint(u64::from(field << 3 | kind));
    }

    pub(super) fn number(&mut self, field: u32, value: u64) {
        self.tag(field, VARINT);
        self.varint(value);
    }

    pub(super) fn double(&mut self, field: u32, value: f64) {
        self.tag(field, FIXED64);
        self.0.extend_from_slice(&value.to_le_bytes());
    }

    pub(super) fn fixed32(&mut self, field: u32, value: u32) {
        self.tag(field, FIXED32);
        self.0.extend_from_slice(&value.to_le_bytes());
    }

    pub(super) fn bytes(&mut self, field: u32, bytes: &[u8]) {
        self.tag(field, BYTES);
        self.varint(bytes.len() as u64);
        self.0.extend_from_slice(bytes);
    }

    pub(super) fn text(&mut self, field: u32, text: &str) {
        self.bytes(field, text.as_bytes());
    }

    /// The message that `fill` makes.
    pub(super) fn message(&mut self, field: u32, fill: impl FnOnce(&mut Writer<'_>)) {
        let mut inner = Vec::new();
        fill(&mut Writer(&mut inner));
        self.bytes(field, &inner);
    }

    /// Whole numbers, packed.
    pub(super) fn numbers(&mut self, field: u32, numbers: impl Iterator<Item = u32>) {
        self.message(field, |inner| numbers.for_each(|number| inner.varint(number.into())));
    }

    /// Seconds and nanoseconds, as `google.protobuf.Timestamp` and `.Duration` have them.
    pub(super) fn time(&mut self, field: u32, nanoseconds: u64) {
        self.message(field, |time| {
            time.number(1, nanoseconds / 1_000_000_000);
            time.number(2, nanoseconds % 1_000_000_000);
        });
    }
}

/// What a field holds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Value<'a> {
    Number(u64),
    Fixed64(u64),
    Bytes(&'a [u8]),
    Fixed32(u32),
}

impl<'a> Value<'a> {
    pub(super) fn double(self) -> Option<f64> {
        if let Self::Fixed64(bits) = self { Some(f64::from_bits(bits)) } else { None }
    }

    pub(super) fn bytes(self) -> Option<&'a [u8]> {
        if let Self::Bytes(bytes) = self { Some(bytes) } else { None }
    }
}

/// The fields of a message, one by one; `None` in place of one that is no field.
pub(super) struct Fields<'a>(pub(super) &'a [u8]);

/// Takes a number off the front of `from`.
pub(super) fn take_varint(from: &mut &[u8]) -> Option<u64> {
    let mut value = 0;
    for index in 0..10 {
        let (&byte, rest) = from.split_first()?;
        *from = rest;
        value |= u64::from(byte & 0x7F) << (7 * index);
        if byte < 0x80 {
            return Some(value);
        }
    }
    None
}

fn take<'a>(from: &mut &'a [u8], count: u64) -> Option<&'a [u8]> {
    let (taken, rest) = from.split_at_checked(usize::try_from(count).ok()?)?;
    *from = rest;
    Some(taken)
}

impl<'a> Fields<'a> {
    fn field(&mut self) -> Option<(u32, Value<'a>)> {
        let tag = take_varint(&mut self.0)?;
        let value = match (tag & 7) as u32 {
            VARINT => Value::Number(take_varint(&mut self.0)?),
            FIXED64 => Value::Fixed64(u64::from_le_bytes(take(&mut self.0, 8)?.try_into().ok()?)),
            BYTES => {
                let count = take_varint(&mut self.0)?;
                Value::Bytes(take(&mut self.0, count)?)
            }
            FIXED32 => Value::Fixed32(u32::from_le_bytes(take(&mut self.0, 4)?.try_into().ok()?)),
            _ => return None,
        };
        Some((u32::try_from(tag >> 3).ok()?, value))
    }
}

impl<'a> Iterator for Fields<'a> {
    type Item = Option<(u32, Value<'a>)>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.0.is_empty() {
            return None;
        }
        let field = self.field();
        if field.is_none() {
            self.0 = &[];
        }
        Some(field)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_come_back() {
        let mut bytes = Vec::new();
        let mut writer = Writer(&mut bytes);
        writer.number(1, 300);
        writer.double(2, -0.1);
        writer.text(3, "é");
        writer.fixed32(20, 7);
        // 300 is the format's own example.
        assert_eq!(bytes[..3], [0x08, 0xAC, 0x02]);
        let fields: Option<Vec<_>> = Fields(&bytes).collect();
        assert_eq!(
            fields.unwrap(),
            [
                (1, Value::Number(300)),
                (2, Value::Fixed64((-0.1_f64).to_bits())),
                (3, Value::Bytes("é".as_bytes())),
                (20, Value::Fixed32(7)),
            ]
        );
    }

    #[test]
    fn what_is_cut_short_is_no_field() {
        let mut bytes = Vec::new();
        Writer(&mut bytes).text(1, "abc");
        for end in 1..bytes.len() {
            assert_eq!(Fields(&bytes[..end]).collect::<Vec<_>>(), [None], "{end}");
        }
        assert_eq!(Fields(&[0x0F]).next(), Some(None), "a kind that there is not");
        assert_eq!(take_varint(&mut &[0xFF; 11][..]), None);
    }
}
