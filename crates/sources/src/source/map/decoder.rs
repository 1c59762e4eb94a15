//! Numbers in text and in bytes: hexadecimal digits, and integers and floats as bytes.

use std::str::FromStr;

use crate::error::{Error, Result, failed};

/// How numbers are written in a text, or lie in bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Decoder {
    /// `hex8`, `hex12`, `hex16`, `hex24` and `hex32`: so many hexadecimal digits a number.
    Hex(usize),
    /// Such as `i16le` or `f32be`: the bytes of a number; in text two hexadecimal digits a byte.
    Bytes {
        /// What the bytes are.
        number: Number,
        /// How many there are.
        size: usize,
        /// Whether the highest byte comes first.
        is_big: bool,
    },
}

/// What the bytes of a number are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Number {
    /// An integer from 0.
    Unsigned,
    /// An integer in two's complement.
    Signed,
    /// A float of IEEE 754.
    Float,
}

impl FromStr for Decoder {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let bad = || {
            failed!(
                "`{text}` is not a decoder; write hex8, hex12, hex16, hex24 or hex32 for digits, or u8, i16le, u16be, f32le and \
                 others for bytes"
            )
        };
        if let Some(bits) = text.strip_prefix("hex") {
            return match bits {
                "8" | "12" | "16" | "24" | "32" => Ok(Self::Hex(bits.parse::<usize>().map_err(|_| bad())? / 4)),
                _ => Err(bad()),
            };
        }
        let number = match text.chars().next() {
            Some('u') => Number::Unsigned,
            Some('i') => Number::Signed,
            Some('f') => Number::Float,
            _ => return Err(bad()),
        };
        let (bits, is_big) = match (text[1..].strip_suffix("le"), text[1..].strip_suffix("be")) {
            (Some(bits), _) => (bits, false),
            (_, Some(bits)) => (bits, true),
            // A single byte has no order.
            _ if &text[1..] == "8" => ("8", false),
            _ => return Err(bad()),
        };
        let size = match (number, bits) {
            (_, "32") => 4,
            (_, "64") => 8,
            (Number::Unsigned | Number::Signed, "8") => 1,
            (Number::Unsigned | Number::Signed, "16") => 2,
            (Number::Unsigned | Number::Signed, "24") => 3,
            _ => return Err(bad()),
        };
        Ok(Self::Bytes { number, size, is_big })
    }
}

impl Decoder {
    /// Calls `each` with every number in `text`.
    ///
    /// # Errors
    /// It has other signs than hexadecimal digits and separators, or half a number at its end.
    pub fn text(self, text: &str, each: impl FnMut(f64)) -> Result<()> {
        let digits = text.trim().trim_start_matches("0x").bytes();
        let is_between = |byte: &u8| byte.is_ascii_whitespace() || matches!(byte, b',' | b';' | b':');
        let digits: Vec<u8> = digits.filter(|byte| !is_between(byte)).collect();
        let value = |digit: u8| char::from(digit).to_digit(16);
        let Some(digits) = digits.iter().map(|&digit| value(digit)).collect::<Option<Vec<u32>>>() else {
            let first: String = text.chars().take(20).collect();
            return Err(failed!("`{first}` is not hexadecimal digits; decoder is for those"));
        };
        match self {
            Self::Hex(count) => {
                if digits.len() % count != 0 {
                    return Err(failed!("a text of {} hexadecimal digits is not a multiple of {count}", digits.len()));
                }
                let number = |digits: &[u32]| digits.iter().fold(0_u64, |all, &digit| all << 4 | u64::from(digit));
                digits.chunks_exact(count).map(number).map(|number| number as f64).for_each(each);
                Ok(())
            }
            Self::Bytes { .. } => {
                if digits.len() % 2 != 0 {
                    return Err(failed!("a text of {} hexadecimal digits is half a byte too long", digits.len()));
                }
                let bytes: Vec<u8> = digits.chunks_exact(2).map(|pair| (pair[0] << 4 | pair[1]) as u8).collect();
                self.bytes(&bytes, each)
            }
        }
    }

    /// Calls `each` with every number in `bytes`; digits are their text.
    ///
    /// # Errors
    /// There is half a number at their end; digits are none.
    pub fn bytes(self, bytes: &[u8], mut each: impl FnMut(f64)) -> Result<()> {
        let Self::Bytes { number, size, is_big } = self else {
            let text =
                std::str::from_utf8(bytes).map_err(|_| Error::failed("its bytes are not text; decoder says digits"))?;
            return self.text(text.trim_end_matches('\0'), each);
        };
        if !bytes.len().is_multiple_of(size) {
            return Err(failed!("{} bytes are not a multiple of {size}; decoder says numbers of {size}", bytes.len()));
        }
        for own in bytes.chunks_exact(size) {
            let place = |index: usize| if is_big { size - 1 - index } else { index };
            let bits =
                own.iter().enumerate().fold(0_u64, |all, (index, &byte)| all | u64::from(byte) << (8 * place(index)));
            let unused = 64 - 8 * size as u32;
            each(match number {
                Number::Unsigned => bits as f64,
                Number::Signed => ((bits << unused) as i64 >> unused) as f64,
                Number::Float if size == 4 => f64::from(f32::from_bits(bits as u32)),
                Number::Float => f64::from_bits(bits),
            });
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn text(decoder: &str, text: &str) -> Result<Vec<f64>> {
        let mut all = Vec::new();
        decoder.parse::<Decoder>()?.text(text, |number| all.push(number)).map(|()| all)
    }

    #[test]
    fn numbers_come_out_of_digits_and_bytes() {
        assert_eq!(text("hex12", "0ff 800,FFF").unwrap(), [255.0, 2048.0, 4095.0]);
        assert_eq!(text("hex16", "01020304").unwrap(), [258.0, 772.0]);
        assert_eq!(text("hex8", "0x0aff").unwrap(), [10.0, 255.0]);
        assert_eq!(text("i16le", "0100 ffff").unwrap(), [1.0, -1.0]);
        assert_eq!(text("u16be", "0100ffff").unwrap(), [256.0, 65535.0]);
        assert_eq!(text("i24be", "ffffff000001").unwrap(), [-1.0, 1.0]);
        assert_eq!(text("f32le", "0000803f").unwrap(), [1.0]);
        let mut all = Vec::new();
        "f64be".parse::<Decoder>().unwrap().bytes(&2.5_f64.to_be_bytes(), |number| all.push(number)).unwrap();
        "u64le".parse::<Decoder>().unwrap().bytes(&7_u64.to_le_bytes(), |number| all.push(number)).unwrap();
        "i64le".parse::<Decoder>().unwrap().bytes(&(-7_i64).to_le_bytes(), |number| all.push(number)).unwrap();
        "hex16".parse::<Decoder>().unwrap().bytes(b"00ff", |number| all.push(number)).unwrap();
        assert_eq!(all, [2.5, 7.0, -7.0, 255.0]);
    }

    #[test]
    fn halves_of_numbers_and_unknown_names_are_refused_in_a_line() {
        for (decoder, digits) in [("hex16", "012"), ("i16le", "010"), ("i16le", "010203"), ("hex8", "hello")] {
            let why = text(decoder, digits).unwrap_err().to_string();
            assert_eq!(why.lines().count(), 1, "{why}");
        }
        for wrong in ["", "hex", "hex7", "i16", "f16le", "x8", "u", "i12le", "8"] {
            assert!(text(wrong, "00").unwrap_err().to_string().contains("is not a decoder"), "{wrong}");
        }
    }
}
