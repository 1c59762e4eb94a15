//! Writes NumPy's array files, version 1.0 of the format.

use std::io::{BufWriter, Write as _};

use somatic::error::{Error, Result};
use somatic::output::OutputPath;

/// A number that an array can hold, little-endian.
pub(super) trait Number: Copy {
    /// Its dtype as NumPy writes it.
    const DTYPE: &'static str;
    type Bytes: AsRef<[u8]>;
    fn bytes(self) -> Self::Bytes;
}

macro_rules! numbers {
    ($($number:ty: $dtype:literal),*) => {$(
        impl Number for $number {
            const DTYPE: &'static str = $dtype;
            type Bytes = [u8; size_of::<$number>()];
            fn bytes(self) -> Self::Bytes {
                self.to_le_bytes()
            }
        }
    )*};
}
numbers!(u32: "<u4", u64: "<u8", f32: "<f4", f64: "<f8");

/// Writes `numbers`, the product of `shape`, last index fastest, as an array to `output`, atomically.
pub(super) fn write<N: Number>(output: OutputPath, shape: &[usize], numbers: impl Iterator<Item = N>) -> Result<()> {
    let path = output.name().to_owned();
    let failed = |e: &std::io::Error| Error::io(&path, e);
    let mut file = BufWriter::with_capacity(1 << 16, output.begin()?);
    file.write_all(&header(N::DTYPE, shape)).map_err(|e| failed(&e))?;
    let mut count = 0;
    for number in numbers {
        file.write_all(number.bytes().as_ref()).map_err(|e| failed(&e))?;
        count += 1;
    }
    debug_assert_eq!(count, shape.iter().product::<usize>(), "{}", path.display());
    file.into_inner().map_err(|e| failed(e.error()))?.finish()
}

/// Magic, version, and a Python dictionary padded so that the numbers begin at a multiple of 64 bytes.
fn header(dtype: &str, shape: &[usize]) -> Vec<u8> {
    let shape: String = shape.iter().map(|length| format!("{length},")).collect();
    let dictionary = format!("{{'descr': '{dtype}', 'fortran_order': False, 'shape': ({shape}), }}");
    let used = 10 + dictionary.len() + 1;
    let length = used.next_multiple_of(64) - 10;
    let mut header = b"\x93NUMPY\x01\x00".to_vec();
    header.extend((length as u16).to_le_bytes());
    header.extend(dictionary.as_bytes());
    header.resize(10 + length - 1, b' ');
    header.push(b'\n');
    header
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_array_is_laid_out_as_the_format_says() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.npy");
        let to = || OutputPath::new(&path, true, &[]).unwrap();
        write(to(), &[2, 3], [1_u32, 2, 3, 4, 5, 0x0102_0304].into_iter()).unwrap();
        let bytes = std::fs::read(&path).unwrap();
        let length = usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
        assert_eq!((&bytes[..8], (10 + length) % 64), (&b"\x93NUMPY\x01\x00"[..], 0));
        let dictionary = std::str::from_utf8(&bytes[10..10 + length]).unwrap();
        assert_eq!(dictionary.trim_end(), "{'descr': '<u4', 'fortran_order': False, 'shape': (2,3,), }");
        assert!(dictionary.ends_with('\n'));
        assert_eq!(bytes.len(), 10 + length + 24);
        assert_eq!(bytes[bytes.len() - 4..], [4, 3, 2, 1]);
        write(to(), &[1], [0.5_f32].into_iter()).unwrap();
        assert!(
            std::fs::read(&path).unwrap().windows(5).any(|w| w == b"(1,),"),
            "a shape of one number keeps its comma"
        );
    }
}
