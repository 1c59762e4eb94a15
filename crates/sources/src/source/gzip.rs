//! Text that may be compressed with gzip, by its first bytes.

use std::fs::File;
use std::io::{self, BufRead as _, BufReader, Cursor, Read};
use std::path::Path;

use flate2::bufread::MultiGzDecoder;

use crate::limits::{MAX_UNPACKED_BYTES, size};

/// Text, and how many bytes it has, if that is known.
pub(super) type Text = (Box<dyn Read + Send>, Option<u64>);

/// The text of the file at `path`.
///
/// # Errors
/// It cannot be opened or read.
pub(super) fn open(path: &Path) -> io::Result<Text> {
    let file = File::open(path)?;
    let length = file.metadata().ok().filter(std::fs::Metadata::is_file).map(|about| about.len());
    let (text, is_packed) = unpacked(file, MAX_UNPACKED_BYTES)?;
    Ok((text, length.filter(|_| !is_packed)))
}

/// What `reader` gives, unpacked if that is gzip: at most `most` bytes of it then; and whether it was.
///
/// # Errors
/// It cannot be read.
pub(super) fn unpacked(reader: impl Read + Send + 'static, most: u64) -> io::Result<(Box<dyn Read + Send>, bool)> {
    let mut reader = BufReader::with_capacity(1 << 16, reader);
    let mut head = Vec::new();
    // A pipe may give one byte at first.
    if reader.fill_buf()?.len() == 1 {
        reader.by_ref().take(2).read_to_end(&mut head)?;
    }
    let first = if head.is_empty() { reader.buffer() } else { &head };
    let is_packed = first.starts_with(&[0x1F, 0x8B]);
    let whole = Cursor::new(head).chain(reader);
    if !is_packed {
        return Ok((Box::new(whole), false));
    }
    let inner = MultiGzDecoder::new(whole);
    Ok((Box::new(Unpacked { inner, left: most, most }), true))
}

/// What is unpacked, with an end.
struct Unpacked<R> {
    inner: R,
    left: u64,
    most: u64,
}

impl<R: Read> Read for Unpacked<R> {
    fn read(&mut self, to: &mut [u8]) -> io::Result<usize> {
        // One byte more than is allowed tells whether it goes on.
        let room = usize::try_from(self.left + 1).unwrap_or(usize::MAX).min(to.len());
        let count = self.inner.read(&mut to[..room]).map_err(|e| {
            let what = match e.kind() {
                io::ErrorKind::UnexpectedEof => "its gzip data ends too soon; copy the file again".to_owned(),
                io::ErrorKind::InvalidInput | io::ErrorKind::InvalidData => {
                    format!("its gzip data is damaged ({e}); copy the file again")
                }
                _ => return e,
            };
            io::Error::new(io::ErrorKind::InvalidData, what)
        })?;
        match self.left.checked_sub(count as u64) {
            Some(left) => self.left = left,
            None => {
                let what = format!("it unpacks to more than {}; unpack it with gunzip, and read that", size(self.most));
                return Err(io::Error::new(io::ErrorKind::FileTooLarge, what));
            }
        }
        Ok(count)
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write as _;

    use flate2::Compression;
    use flate2::write::GzEncoder;

    use super::*;
    use crate::signal::Frame;
    use crate::source::{CsvSource, JointStates, Source as _, VendorOptions, VendorSource};

    fn packed(text: &[u8]) -> Vec<u8> {
        let mut encoder = GzEncoder::new(Vec::new(), Compression::fast());
        encoder.write_all(text).unwrap();
        encoder.finish().unwrap()
    }

    fn read(bytes: Vec<u8>, most: u64) -> io::Result<Vec<u8>> {
        let mut all = Vec::new();
        unpacked(Cursor::new(bytes), most)?.0.read_to_end(&mut all).map(|_| all)
    }

    #[test]
    fn gzip_is_unpacked_and_other_text_stays() {
        let text = b"t,4\n0,1\n".as_slice();
        assert_eq!(read(text.to_vec(), 3).unwrap(), text);
        assert_eq!(read(packed(text), 8).unwrap(), text);
        // Two files after each other are one, as gzip has it.
        assert_eq!(read([packed(text), packed(text)].concat(), 16).unwrap(), [text, text].concat());
        // Also where the first byte comes alone.
        let (first, rest) = (Cursor::new(packed(text)[..1].to_vec()), Cursor::new(packed(text)[1..].to_vec()));
        let mut all = Vec::new();
        unpacked(first.chain(rest), 8).unwrap().0.read_to_end(&mut all).unwrap();
        assert_eq!(all, text);
        for short in [b"".as_slice(), b"t"] {
            assert_eq!(read(short.to_vec(), 1).unwrap(), short);
        }
    }

    #[test]
    fn what_unpacks_to_too_much_is_refused_and_damage_is_told() {
        let text = vec![b'\n'; 1 << 16];
        assert_eq!(read(packed(&text), 1 << 16).unwrap().len(), 1 << 16);
        let error = read(packed(&text), (1 << 16) - 1).unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::FileTooLarge);
        assert!(error.to_string().starts_with("it unpacks to more than 64.0 KiB; unpack it"), "{error}");
        let mut whole = packed(b"t,4\n0,1\n1,2\n");
        assert!(read(whole[..whole.len() - 9].to_vec(), 99).unwrap_err().to_string().contains("ends too soon"));
        let end = whole.len() - 6;
        whole[end] ^= 1;
        assert!(read(whole, 99).unwrap_err().to_string().contains("is damaged"));
    }

    /// The times and values of all frames.
    fn frames(source: &mut dyn crate::source::Source) -> Vec<Frame> {
        let (mut frame, mut all) = (Frame::missing(0.0, source.taxels().len()), Vec::new());
        while source.next_frame(&mut frame).unwrap() {
            all.push(frame.clone());
        }
        all
    }

    #[test]
    fn every_reader_of_text_takes_it() {
        let folder = tempfile::tempdir().unwrap();
        let write = |name: &str, text: &str| {
            let (plain, gz) = (folder.path().join(name), folder.path().join(format!("{name}.gz")));
            std::fs::write(&plain, text).unwrap();
            std::fs::write(&gz, packed(text.as_bytes())).unwrap();
            [plain, gz]
        };
        let [plain, gz] = write("a.csv", "t,4,7\n0,1,2\n0.5,3,nan\n");
        let mut source = CsvSource::open(&gz, None).unwrap();
        let read = frames(&mut source);
        assert_eq!(read.len(), 2);
        assert_eq!(read, frames(&mut CsvSource::open(plain, None).unwrap()));
        assert_eq!(source.progress(), None);
        let options = VendorOptions { grid: Some([1, 3]), rate_hz: Some(10.0), ..VendorOptions::default() };
        let [plain, gz] = write("b.txt", "1,2,3\n4,5,6\n");
        let read = frames(&mut VendorSource::open(&gz, &options).unwrap());
        assert_eq!(read.len(), 2);
        assert_eq!(read, frames(&mut VendorSource::open(plain, &options).unwrap()));
        for text in
            ["t,wrist\n0,1\n1,2\n", "\n\n\n{\"t\":0,\"joints\":{\"wrist\":1}}\n{\"t\":1,\"joints\":{\"wrist\":2}}\n"]
        {
            let [plain, gz] = write("c.csv", text);
            let (plain, packed) = (JointStates::open(plain).unwrap(), JointStates::open(gz).unwrap());
            assert_eq!(packed.span_s(), Some([0.0, 1.0]));
            assert_eq!(packed.span_s(), plain.span_s());
        }
    }

    #[test]
    fn a_damaged_file_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.csv.gz");
        let whole = packed(b"t,4\n0,1\n");
        std::fs::write(&path, &whole[..whole.len() - 4]).unwrap();
        let mut source = CsvSource::open(&path, None).unwrap();
        let mut frame = Frame::missing(0.0, 1);
        let error = loop {
            match source.next_frame(&mut frame) {
                Ok(true) => {}
                Ok(false) => panic!("nothing is said of its end"),
                Err(e) => break e.to_string(),
            }
        };
        assert!(error.ends_with("a.csv.gz: its gzip data ends too soon; copy the file again"), "{error}");
    }
}
