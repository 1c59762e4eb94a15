//! Common Data Representation, as ROS 2 has messages in bags and on the wire: little-endian, numbers at multiples of their
//! size from the header's end.

use std::borrow::Cow;

/// Plain CDR, little-endian, no options.
const HEADER: [u8; 4] = [0, 1, 0, 0];

/// Writes values one after the other.
#[derive(Clone, Debug)]
pub struct CdrWriter(Vec<u8>);

impl CdrWriter {
    pub(super) fn new() -> Self {
        Self(HEADER.to_vec())
    }

    pub(super) fn into_bytes(self) -> Vec<u8> {
        self.0
    }

    fn put<const SIZE: usize>(&mut self, bytes: [u8; SIZE]) {
        let length = self.0.len() - HEADER.len();
        let padding = length.next_multiple_of(SIZE) - length;
        self.0.extend_from_slice(&[0; SIZE][..padding]);
        self.0.extend_from_slice(&bytes);
    }

    /// A length: of a string with its end, or of a sequence.
    fn length(&mut self, length: usize) {
        self.put(u32::try_from(length).expect("a message has less than 4 GiB").to_le_bytes());
    }
}

/// Reads values one after the other.
#[derive(Clone, Debug)]
pub struct CdrReader<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> CdrReader<'a> {
    /// `None` where `bytes` do not begin with the header of plain little-endian CDR.
    pub(in crate::robot) fn new(bytes: &'a [u8]) -> Option<Self> {
        let (header, bytes) = bytes.split_at_checked(HEADER.len())?;
        // The last two bytes are options, which writers may use for padding at the end.
        (header[..2] == HEADER[..2]).then_some(Self { bytes, at: 0 })
    }

    fn take(&mut self, count: usize) -> Option<&'a [u8]> {
        let taken = self.bytes.get(self.at..self.at.checked_add(count)?)?;
        self.at += count;
        Some(taken)
    }

    fn get<const SIZE: usize>(&mut self) -> Option<[u8; SIZE]> {
        self.at = self.at.next_multiple_of(SIZE);
        self.take(SIZE)?.try_into().ok()
    }

    fn length(&mut self) -> Option<usize> {
        self.get().map(|bytes| u32::from_le_bytes(bytes) as usize)
    }
}

/// A type that messages are made of.
pub trait Cdr: Sized {
    /// What message definitions call it, such as `float64` or `geometry_msgs/Point`.
    const NAME: &'static str;

    /// Writes it.
    fn write(&self, to: &mut CdrWriter);

    /// Reads it; `None` where the bytes are not such a value.
    fn read(from: &mut CdrReader<'_>) -> Option<Self>;

    /// Writes all of `items`, without their number.
    fn write_all(items: &[Self], to: &mut CdrWriter) {
        items.iter().for_each(|item| item.write(to));
    }

    /// What definitions call a field of this type.
    fn field_type() -> String {
        Self::NAME.to_owned()
    }

    /// Adds the definitions of the messages that it is made of, and its own, to `to`, unless they are there.
    fn define(_to: &mut Vec<(&'static str, String)>) {}
}

macro_rules! numbers {
    ($($type:ty = $name:literal),*) => {
        $(impl Cdr for $type {
            const NAME: &'static str = $name;

            fn write(&self, to: &mut CdrWriter) {
                to.put(self.to_le_bytes());
            }

            fn read(from: &mut CdrReader<'_>) -> Option<Self> {
                from.get().map(Self::from_le_bytes)
            }
        })*
    };
}

numbers! {i32 = "int32", u32 = "uint32", f32 = "float32", f64 = "float64"}

impl Cdr for u8 {
    const NAME: &'static str = "uint8";

    fn write(&self, to: &mut CdrWriter) {
        to.0.push(*self);
    }

    fn read(from: &mut CdrReader<'_>) -> Option<Self> {
        from.take(1).map(|byte| byte[0])
    }

    fn write_all(items: &[Self], to: &mut CdrWriter) {
        to.0.extend_from_slice(items);
    }
}

/// `byte`, which is not a number to ROS.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "ros2", derive(serde::Deserialize))]
pub struct Byte(pub u8);

impl Cdr for Byte {
    const NAME: &'static str = "byte";

    fn write(&self, to: &mut CdrWriter) {
        self.0.write(to);
    }

    fn read(from: &mut CdrReader<'_>) -> Option<Self> {
        u8::read(from).map(Self)
    }
}

impl Cdr for bool {
    const NAME: &'static str = "bool";

    fn write(&self, to: &mut CdrWriter) {
        u8::from(*self).write(to);
    }

    fn read(from: &mut CdrReader<'_>) -> Option<Self> {
        match u8::read(from)? {
            0 => Some(false),
            1 => Some(true),
            _ => None,
        }
    }
}

impl Cdr for String {
    const NAME: &'static str = "string";

    /// A zero ends a string: one within it would cut it short, and is left out.
    fn write(&self, to: &mut CdrWriter) {
        let text = if self.contains('\0') { Cow::Owned(self.replace('\0', "")) } else { Cow::Borrowed(self.as_str()) };
        to.length(text.len() + 1);
        to.0.extend_from_slice(text.as_bytes());
        to.0.push(0);
    }

    fn read(from: &mut CdrReader<'_>) -> Option<Self> {
        let length = from.length()?;
        let (end, text) = from.take(length)?.split_last()?;
        let text = std::str::from_utf8(text).ok()?;
        (*end == 0).then(|| text.to_owned())
    }
}

impl<T: Cdr> Cdr for Vec<T> {
    const NAME: &'static str = T::NAME;

    fn write(&self, to: &mut CdrWriter) {
        to.length(self.len());
        T::write_all(self, to);
    }

    fn read(from: &mut CdrReader<'_>) -> Option<Self> {
        let length = from.length()?;
        // Each item has at least a byte, so that a length that is wrong does not fill the memory.
        if length > from.bytes.len() - from.at {
            return None;
        }
        (0..length).map(|_| T::read(from)).collect()
    }

    fn field_type() -> String {
        format!("{}[]", T::field_type())
    }

    fn define(to: &mut Vec<(&'static str, String)>) {
        T::define(to);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bytes(write: impl FnOnce(&mut CdrWriter)) -> Vec<u8> {
        let mut writer = CdrWriter::new();
        write(&mut writer);
        writer.into_bytes().split_off(HEADER.len())
    }

    #[test]
    fn numbers_are_at_multiples_of_their_size_from_the_end_of_the_header() {
        let written = bytes(|to| {
            1_u8.write(to);
            2.0_f64.write(to);
            true.write(to);
            3_u32.write(to);
        });
        assert_eq!(
            written,
            [&[1, 0, 0, 0, 0, 0, 0, 0][..], &2.0_f64.to_le_bytes(), &[1, 0, 0, 0, 3, 0, 0, 0]].concat()
        );
    }

    #[test]
    fn strings_have_their_end_and_what_follows_is_aligned() {
        for text in ["", "a", "ab", "abc", "abcd", "touché"] {
            let written = bytes(|to| {
                text.to_owned().write(to);
                7_u32.write(to);
            });
            let length = text.len() + 1;
            assert_eq!(written.len(), 4 + length.next_multiple_of(4) + 4, "{text}");
            assert_eq!(written[..4], (length as u32).to_le_bytes());
            let mut reader = CdrReader { bytes: &written, at: 0 };
            assert_eq!((String::read(&mut reader), u32::read(&mut reader)), (Some(text.to_owned()), Some(7)));
        }
        assert_eq!(bytes(|to| "a\0b".to_owned().write(to)), [3, 0, 0, 0, b'a', b'b', 0]);
    }

    #[test]
    fn what_is_cut_short_or_too_long_is_nothing() {
        let written = bytes(|to| vec![1.0_f64, 2.0].write(to));
        for cut in 0..written.len() {
            assert_eq!(Vec::<f64>::read(&mut CdrReader { bytes: &written[..cut], at: 0 }), None, "{cut}");
        }
        let endless = u32::MAX.to_le_bytes();
        assert_eq!(Vec::<f64>::read(&mut CdrReader { bytes: &endless, at: 0 }), None);
        assert_eq!(String::read(&mut CdrReader { bytes: &endless, at: 0 }), None);
        assert_eq!(String::read(&mut CdrReader { bytes: &[0; 4], at: 0 }), None);
        assert!(CdrReader::new(&[0, 0, 0, 0]).is_none() && CdrReader::new(&[0, 1]).is_none());
    }
}
