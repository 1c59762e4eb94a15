//! Damaged files are read as they were, or the damage is reported: no frame is lost or changed silently.

use somatic_testing::{damage, numbers};
use std::io::{Seek as _, Write as _};
use std::path::Path;

use super::super::bag_survey::BagSurvey;
use super::super::reader::Reader;
use super::super::recorder::Recorder;
use super::super::records::HEAD;
use super::super::survey::Survey;
use super::super::{BODY, CALIBRATION, PERCEPTS};
use crate::error::Result;
use crate::output::OutputPath;
use crate::signal::{Frame, RawValue};

/// All that a recording gives.
#[derive(Clone, Debug, Default, PartialEq)]
struct Content {
    taxels: Vec<u32>,
    frames: Vec<Frame>,
    percepts: Vec<Vec<u8>>,
    files: Vec<Option<Vec<u8>>>,
}

/// Reads the recording at `path`, with its notices.
fn read(path: &Path) -> Result<(Content, Vec<String>)> {
    let mut reader = Reader::open(path)?;
    let mut content = Content { taxels: reader.taxels().to_vec(), ..Content::default() };
    let mut frame = Frame::default();
    for wanted in [BODY, CALIBRATION] {
        let found = reader.find_attached(|file| file.media_type == wanted || file.name == wanted)?;
        content.files.push(found.map(|(_, bytes)| bytes));
    }
    while reader.next_frame(&mut frame)? {
        content.frames.push(frame.clone());
    }
    let mut losses = reader.losses();
    let mut reader = Reader::open(path)?;
    let mut line = Vec::new();
    while reader.next_percepts(&mut line)? {
        content.percepts.push(line.clone());
    }
    losses.extend(reader.losses());
    // The survey counts what was read.
    let mut reader = Reader::open(path)?;
    let survey = Survey::read(&mut reader, |_| {})?;
    assert_eq!(survey.rhythm.frames, content.frames.len() as u64);
    assert_eq!(reader.losses().is_empty(), losses.is_empty(), "{losses:?}, {:?}", reader.losses());
    Ok((content, losses))
}

/// Reads `bytes` as a recording and as a bag, in every way: an answer or an error in a line, and no panic. For harnesses.
pub(crate) fn read_bytes(file: &mut std::fs::File, path: &Path, bytes: &[u8]) {
    put(file, bytes);
    let one_line = |line: &str| assert!(line.lines().count() == 1, "{line}");
    match read(path) {
        Ok((_, losses)) => losses.iter().for_each(|loss| one_line(loss)),
        Err(e) => one_line(&e.to_string()),
    }
    match BagSurvey::read(path, |_| {}) {
        Ok(survey) => survey.losses.iter().for_each(|loss| one_line(loss)),
        Err(e) => one_line(&e.to_string()),
    }
}

fn put(file: &mut std::fs::File, bytes: &[u8]) {
    file.rewind().unwrap();
    file.set_len(0).unwrap();
    file.write_all(bytes).unwrap();
}

/// A recording in four chunks, and what is in it.
fn small() -> (Vec<u8>, Content) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    let taxels = vec![3, 4, 7];
    let mut recorder = Recorder::create(OutputPath::new(&path, false, &[]).unwrap(), &taxels).unwrap();
    let files = [(&b"a body"[..], "hand", BODY), (b"[all]\ngain = 2\n", CALIBRATION, "application/toml")];
    for (bytes, name, kind) in files {
        recorder.attach(name, kind, bytes).unwrap();
    }
    let mut content =
        Content { taxels, files: files.iter().map(|file| Some(file.0.to_vec())).collect(), ..Content::default() };
    for index in 0..12 {
        let values = vec![RawValue::new(f64::from(index)), RawValue::MISSING, RawValue::new(0.5)];
        let frame = Frame { t_s: f64::from(index) * 0.25, values, ..Frame::default() };
        recorder.frame(&frame).unwrap();
        let line = format!("{{\"t\":{}}}", frame.t_s);
        recorder.write(PERCEPTS, frame.t_s, line.as_bytes()).unwrap();
        content.percepts.push(line.into_bytes());
        content.frames.push(frame);
        if index % 3 == 2 {
            recorder.end_chunk();
        }
    }
    recorder.finish().unwrap();
    (std::fs::read(&path).unwrap(), content)
}

/// Where the records of a whole file are.
fn records(bytes: &[u8]) -> Vec<(u8, std::ops::Range<usize>)> {
    let mut found = Vec::new();
    let mut at = 8;
    while at < bytes.len() - 8 {
        let length = u64::from_le_bytes(bytes[at + 1..at + 9].try_into().unwrap()) as usize;
        found.push((bytes[at], at..at + HEAD as usize + length));
        at += HEAD as usize + length;
    }
    found
}

/// Reads damaged files, and compares what is read with what was written.
struct Harm {
    whole: Vec<u8>,
    content: Content,
    file: tempfile::NamedTempFile,
    /// How many were the same, without a word or with one; gave less; gave nothing.
    same: usize,
    mended: usize,
    less: usize,
    refused: usize,
}

impl Harm {
    fn new() -> Self {
        let (whole, content) = small();
        let file = tempfile::NamedTempFile::new().unwrap();
        Self { whole, content, file, same: 0, mended: 0, less: 0, refused: 0 }
    }

    /// `what` was done to `bytes`. Gives the number of frames that were read, and the notices.
    fn check(&mut self, what: &str, bytes: &[u8]) -> (usize, Vec<String>) {
        put(self.file.as_file_mut(), bytes);
        let (found, losses) = match read(self.file.path()) {
            Ok(read) => read,
            Err(e) => {
                assert_eq!(e.to_string().lines().count(), 1, "{what}: {e}");
                self.refused += 1;
                return (0, vec![e.to_string()]);
            }
        };
        let is_same = found == self.content;
        assert!(is_same || !losses.is_empty(), "{what}: {} frames, and not a word", found.frames.len());
        assert_eq!(found.taxels, self.content.taxels, "{what}");
        // What is cut off before the first frame may lack a file, too.
        assert!(found.frames.is_empty() || found.files == self.content.files, "{what}: {:?}", found.files);
        let mut all = self.content.frames.iter();
        // Bytes that were put in may be a chunk that was there.
        let is_twice = losses.iter().any(|loss| loss.contains("put into it"));
        let is_part = found.frames.iter().all(|frame| all.any(|known| known == frame));
        assert!(is_part || is_twice, "{what}: other frames");
        match (is_same, losses.is_empty()) {
            (true, true) => self.same += 1,
            (true, false) => self.mended += 1,
            (false, _) => self.less += 1,
        }
        (found.frames.len(), losses)
    }
}

#[test]
fn a_flipped_bit_is_repaired_or_reported() {
    let mut harm = Harm::new();
    let whole = harm.whole.clone();
    assert_eq!(harm.check("nothing", &whole), (12, Vec::new()));
    // One of each byte; all of them take minutes.
    let all = std::env::var("SOMATIC_ALL_BITS").is_ok_and(|all| all == "1");
    for at in 0..whole.len() {
        for bit in (0..8).filter(|bit| all || *bit == (at * 5 + at / 8) % 8) {
            let mut bytes = whole.clone();
            bytes[at] ^= 1 << bit;
            harm.check(&format!("bit {bit} of byte {at}"), &bytes);
        }
    }
    let Harm { same, mended, less, refused, .. } = harm;
    // Only the magic and what the summary does not repeat cost everything.
    assert!(
        refused < whole.len() && same + mended > less,
        "{same} same, {mended} mended, {less} less, {refused} refused"
    );
}

#[test]
fn the_kind_of_a_chunk_that_is_damaged_costs_no_frame() {
    let mut harm = Harm::new();
    let whole = harm.whole.clone();
    for (_, place) in records(&whole).into_iter().filter(|(kind, _)| *kind == 0x06) {
        for at in [0, 1, 8] {
            let mut bytes = whole.clone();
            bytes[place.start + at] ^= 0x80;
            let (frames, losses) = harm.check("head of a chunk", &bytes);
            assert_eq!(frames, 12);
            assert!(losses[0].contains("9 bytes not read, 12 frames are intact; none of its 12 frames is missing"));
        }
    }
}

#[test]
fn what_is_cut_out_or_put_in_is_reported_with_how_much() {
    let mut harm = Harm::new();
    let whole = harm.whole.clone();
    let all = records(&whole);
    let data_end = all.iter().position(|(kind, _)| *kind == 0x0F).unwrap();
    for (index, (kind, place)) in all.iter().enumerate() {
        let without = [&whole[..place.start], &whole[place.end..]].concat();
        let (frames, losses) = harm.check(&format!("record {index} of kind {kind} cut out"), &without);
        if *kind == 0x06 {
            assert_eq!(frames, 9, "{losses:?}");
            let reported = losses.join("\n");
            assert!(reported.contains(&format!("{} bytes were cut out of it", place.len())), "{reported}");
            assert!(reported.contains("1 of the 4 chunks that its summary lists are not there"), "{reported}");
            assert!(reported.contains("3 of its 12 frames are missing"), "{reported}");
        }
        let twice = [&whole[..place.end], &whole[place.start..]].concat();
        harm.check(&format!("record {index} of kind {kind} there twice"), &twice);
        if index < data_end {
            // An end in the middle.
            for end in [0x0F, 0x02] {
                let end = all.iter().find(|(kind, _)| *kind == end).unwrap().1.clone();
                let bytes = [&whole[..place.end], &whole[end], &whole[place.end..]].concat();
                harm.check(&format!("an end after record {index}"), &bytes);
            }
        }
    }
    for at in (8..whole.len()).step_by(7) {
        for count in [1, 7, 100] {
            let end = (at + count).min(whole.len());
            harm.check(&format!("{count} bytes cut out at {at}"), &[&whole[..at], &whole[end..]].concat());
            harm.check(&format!("{count} bytes put in at {at}"), &[&whole[..end], &whole[at..]].concat());
        }
        let (frames, losses) = harm.check(&format!("cut off at {at}"), &whole[..at]);
        assert!(!losses.is_empty(), "cut off at {at}: {frames} frames");
    }
    assert!(harm.less > 100 && harm.mended > 50, "{} {}", harm.less, harm.mended);
}

#[test]
fn without_a_summary_damage_is_reported_too() {
    let mut harm = Harm::new();
    let whole = harm.whole.clone();
    let summary = records(&whole).iter().find(|(kind, _)| *kind == 0x0F).unwrap().1.end;
    // A footer that knows of no summary.
    let bare = [&whole[..summary], &[0x02], &20_u64.to_le_bytes(), &[0; 20], &whole[..8]].concat();
    assert_eq!(harm.check("no summary", &bare), (12, Vec::new()));
    for at in 8..summary {
        let bit = (at * 5 + at / 8) % 8;
        let mut bytes = bare.clone();
        bytes[at] ^= 1 << bit;
        harm.check(&format!("bit {bit} of byte {at} without a summary"), &bytes);
    }
    assert!(harm.less > 100);
}

#[test]
fn many_damaged_entries_of_an_index_take_as_long_as_the_file_is() {
    // Each entry is of a chunk that goes to the end of the file, and is damaged.
    let mut bytes = b"\x89MCAP0\r\n".to_vec();
    let count = 20_000_u64;
    let data_end = 8 + count * 49;
    for index in 0..count {
        let length = data_end - (8 + index * 49) - 9;
        bytes.push(0x06);
        bytes.extend(length.to_le_bytes());
        bytes.extend([0; 16]);
        bytes.extend((length - 40).to_le_bytes());
        bytes.extend([1; 4]);
        bytes.extend([0; 4]);
        bytes.extend((length - 40).to_le_bytes());
    }
    for index in 0..count {
        let at = 8 + index * 49;
        let entry =
            [&[0; 16][..], &at.to_le_bytes(), &(data_end - at).to_le_bytes(), &[0; 12], &[0; 4], &[0; 16]].concat();
        bytes.push(0x08);
        bytes.extend((entry.len() as u64).to_le_bytes());
        bytes.extend(entry);
    }
    bytes.extend([&[0x02][..], &20_u64.to_le_bytes(), &data_end.to_le_bytes(), &[0; 12], b"\x89MCAP0\r\n"].concat());
    let mut file = tempfile::NamedTempFile::new().unwrap();
    put(file.as_file_mut(), &bytes);
    let start = std::time::Instant::now();
    let survey = BagSurvey::read(file.path(), |_| {}).unwrap();
    assert!(start.elapsed().as_secs() < 5, "{:?}", start.elapsed());
    assert!(survey.losses.iter().any(|loss| loss.contains("damaged in")), "{:?}", survey.losses);
}

/// Reads damaged recordings and bags for `seconds`, or `rounds` times; for harnesses.
pub(crate) fn fuzz(seed: u64, rounds: u64, seconds: u64) {
    let mut harm = Harm::new();
    let start = std::time::Instant::now();
    let mut chance = numbers(seed);
    for round in 0..rounds {
        if start.elapsed().as_secs() >= seconds {
            break;
        }
        let mut bytes = harm.whole.clone();
        damage(&mut bytes, &mut chance);
        let began = std::time::Instant::now();
        harm.check(&format!("round {round} of seed {seed}"), &bytes);
        let path = harm.file.path().to_owned();
        read_bytes(harm.file.as_file_mut(), &path, &bytes);
        assert!(began.elapsed().as_secs() < 5, "round {round} of seed {seed} took {:?}", began.elapsed());
    }
    let Harm { same, mended, less, refused, .. } = harm;
    eprintln!("{same} same, {mended} mended, {less} less, {refused} refused");
}

#[test]
fn any_damage_is_reported() {
    fuzz(1, 600, 60);
}

/// `SOMATIC_FUZZ_SECONDS=300 cargo test -p somatic-recording --lib harm -- --ignored` (all bits: `SOMATIC_ALL_BITS=1`)
#[test]
#[ignore = "runs for SOMATIC_FUZZ_SECONDS"]
fn any_damage_is_reported_for_as_long_as_one_likes() {
    let seconds = std::env::var("SOMATIC_FUZZ_SECONDS").ok().and_then(|s| s.parse().ok()).unwrap_or(60);
    fuzz(std::process::id().into(), u64::MAX, seconds);
}
