//! Decompression of chunks.

use std::io::Read;

use crate::limits::MAX_CHUNK_BYTES;

/// Supported compressions.
pub(super) const KNOWN: [&str; 3] = ["", "lz4", "zstd"];

/// Decompresses `bytes` to `length` bytes; `None` if that fails.
pub(super) fn unpacked(compression: &str, bytes: &[u8], length: u64) -> Option<Vec<u8>> {
    let mut unpacked = Vec::new();
    let wanted = (length <= MAX_CHUNK_BYTES).then(|| length + 1)?;
    let read = match compression {
        "lz4" => lz4_flex::frame::FrameDecoder::new(bytes).take(wanted).read_to_end(&mut unpacked),
        "zstd" => ruzstd::decoding::StreamingDecoder::new(bytes).ok()?.take(wanted).read_to_end(&mut unpacked),
        _ => return None,
    };
    (read.is_ok() && unpacked.len() as u64 == length).then_some(unpacked)
}

/// Decompresses a message in zstd; `None` if that fails, or gives more than a chunk may have.
pub(super) fn unpacked_message(bytes: &[u8]) -> Option<Vec<u8>> {
    let mut unpacked = Vec::new();
    let decoder = ruzstd::decoding::StreamingDecoder::new(bytes).ok()?;
    decoder.take(MAX_CHUNK_BYTES + 1).read_to_end(&mut unpacked).ok()?;
    (unpacked.len() as u64 <= MAX_CHUNK_BYTES).then_some(unpacked)
}

#[cfg(test)]
mod tests {
    use std::io::Write as _;

    use super::*;

    #[test]
    fn what_was_compressed_comes_back_and_damage_does_not() {
        let bytes: Vec<u8> = (0..50_000_u32).flat_map(|i| (i / 7).to_le_bytes()).collect();
        let length = bytes.len() as u64;
        let mut lz4 = lz4_flex::frame::FrameEncoder::new(Vec::new());
        lz4.write_all(&bytes).unwrap();
        let level = ruzstd::encoding::CompressionLevel::Fastest;
        let packed = [("lz4", lz4.finish().unwrap()), ("zstd", ruzstd::encoding::compress_to_vec(&bytes[..], level))];
        for (compression, packed) in packed {
            assert!(packed.len() < bytes.len());
            assert!(unpacked(compression, &packed, length).as_ref() == Some(&bytes), "{compression}");
            assert_eq!(unpacked(compression, &packed, length - 1), None, "{compression}: longer than it says");
            assert_eq!(unpacked(compression, &packed, length + 1), None, "{compression}: shorter than it says");
            assert_eq!(unpacked(compression, &packed, u64::MAX), None, "{compression}: beyond all memory");
            assert_eq!(unpacked(compression, &packed[..packed.len() / 2], length), None, "{compression}: cut");
            let as_message = unpacked_message(&packed);
            assert!(as_message.as_ref() == (compression == "zstd").then_some(&bytes), "{compression}: as a message");
            assert_eq!(unpacked_message(&packed[..packed.len() / 2]), None, "{compression}: a message, cut");
            for at in (0..packed.len()).step_by(97) {
                // Another answer, which a checksum tells, or none: no panic.
                let mut damaged = packed.clone();
                damaged[at] ^= 0x55;
                let _ = unpacked(compression, &damaged, length);
            }
        }
    }
}
