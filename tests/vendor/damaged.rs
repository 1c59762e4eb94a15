//! Files that are cut short, changed in the middle, or mislabelled: one line with the place, and what was read is kept.

use somatic::source::{VendorFormat, VendorOptions};

use crate::make::{self, Dialect, PLAIN};
use crate::{Read, read_bytes};

const KPA: Dialect = Dialect { unit: "kPa", ..PLAIN };

/// A sound recording of three frames in each format, and a word of a row in the middle of its second frame.
fn sound() -> Vec<(VendorFormat, String)> {
    vec![
        (VendorFormat::Xsensor, make::xsensor(&KPA, &["a-LF", "a-RF"], [4, 3], &[1, 2, 3])),
        (VendorFormat::Tekscan, make::tekscan(&KPA, [6, 10], &[1, 2, 3])),
        (VendorFormat::Emed, make::emed(&KPA, [5, 4], &[1, 2, 3], 1.0)),
        (VendorFormat::Pedar, make::novel(&KPA, &[5, 5], None, &[1, 2, 3])),
        (VendorFormat::Pliance, make::novel(&KPA, &[12], Some(4), &[1, 2, 3])),
        (VendorFormat::Loadsol, make::loadsol(&["A12-L", "A12-R"], &[1, 2, 3])),
        (VendorFormat::Footscan, make::footscan(&["Right"], [4, 3], &[1, 2, 3])),
        (VendorFormat::Stappone, make::stappone(&[1, 2], &[1, 2, 3])),
        (VendorFormat::Matrix, "1,2\n3,4\n\n5,6\n7,8\n\n9,10\n11,12\n".to_owned()),
    ]
}

fn options(format: VendorFormat) -> VendorOptions {
    match format {
        VendorFormat::Matrix => VendorOptions { grid: Some([2, 2]), rate_hz: Some(1.0), ..VendorOptions::default() },
        _ => VendorOptions::default(),
    }
}

fn try_read(format: VendorFormat, bytes: &[u8]) -> Result<Read, String> {
    read_bytes("file.dat", bytes, &options(format)).map_err(|e| {
        let line = e.to_string();
        assert!(line.contains("file.dat: ") && !line.contains('\n') && line.len() < 600, "{line}");
        line
    })
}

#[test]
fn what_is_sound_has_no_losses() {
    for (format, text) in sound() {
        let all = try_read(format, text.as_bytes()).unwrap();
        assert_eq!((all.format, all.frames.len(), &all.losses[..]), (format, 3, &[][..]));
    }
}

#[test]
fn what_is_cut_short_keeps_what_was_read() {
    for (format, text) in sound() {
        let whole = try_read(format, text.as_bytes()).unwrap();
        let (mut kept, mut cut_within) = ([0; 4], 0);
        for length in 0..text.len() {
            if !text.is_char_boundary(length) {
                continue;
            }
            match try_read(format, &text.as_bytes()[..length]) {
                Ok(part) => {
                    kept[part.frames.len()] += 1;
                    cut_within += usize::from(!part.losses.is_empty());
                    assert!(part.losses.len() <= 1 && part.losses.iter().all(|loss| loss.contains(": line ")));
                    // The last number may be cut, where nothing says that it goes on.
                    let certain = part.frames.len().saturating_sub(1);
                    assert_eq!(part.frames[..certain], whole.frames[..certain], "{format} at {length}");
                }
                // Places are at the end, so that without them it is of another kind; the others need their first frame.
                Err(_) => kept[0] += 1,
            }
        }
        assert!(kept.iter().all(|count| *count > 0) && cut_within > 5, "{format}: {kept:?}, {cut_within}");
    }
}

#[test]
fn a_wrong_row_in_the_middle_is_an_error_with_its_line() {
    for (format, text) in sound() {
        let lines: Vec<&str> = text.lines().collect();
        // A row of the second frame: of those that are rows of numbers, one a bit before the middle.
        let is_row = |line: &str| {
            let numbers = line.split([',', '\t', ' ']).filter(|word| word.parse::<f64>().is_ok()).count();
            numbers >= 2
                && !line.starts_with("Frame")
                && !line.contains('[')
                && !line.contains(':')
                && !line.contains("Force")
        };
        let rows: Vec<usize> = (0..lines.len()).filter(|&line| is_row(lines[line])).collect();
        let at = match format {
            VendorFormat::Pedar | VendorFormat::Pliance | VendorFormat::Loadsol | VendorFormat::Stappone => rows[1],
            _ => rows[rows.len() / 2],
        };
        let with = |row: String| {
            let mut lines: Vec<String> = lines.iter().map(|line| (*line).to_owned()).collect();
            lines[at] = row;
            lines.join("\n") + "\n"
        };
        let row = lines[at];
        let separator = if row.contains(',') {
            ","
        } else if row.contains('\t') {
            "\t"
        } else {
            " "
        };
        // Not the first word, which may say what kind of line it is.
        let word = row.split(separator).filter(|word| word.parse::<f64>().is_ok()).nth(1).unwrap();
        let position = row.match_indices(word).map(|(at, _)| at).find(|at| *at > 1).unwrap();
        let changed = format!("{}x?{}", &row[..position], &row[position + word.len()..]);
        let shorter = match format {
            // What follows the sensors is not read.
            VendorFormat::Loadsol => row.split('\t').take(9).collect::<Vec<_>>().join("\t"),
            _ => row.trim_end_matches(',').rsplit_once(separator).unwrap().0.to_owned(),
        };
        for (what, row) in [("another word", changed), ("a cell less", shorter)] {
            let error = try_read(format, with(row.clone()).as_bytes()).expect_err(&format!("{format}, {what}: {row}"));
            assert!(error.contains(&format!("line {}: ", at + 1)), "{format}, {what}: {error}");
        }
        // A row that is not there at all.
        let is_of_one_line =
            [VendorFormat::Pedar, VendorFormat::Pliance, VendorFormat::Loadsol, VendorFormat::Stappone];
        if !is_of_one_line.contains(&format) {
            let mut fewer = lines.clone();
            fewer.remove(at);
            let error = try_read(format, (fewer.join("\n") + "\n").as_bytes()).expect_err(&format!("{format}"));
            assert!(error.contains("line "), "{error}");
        }
    }
}

#[test]
fn what_is_none_of_them_is_refused() {
    for (bytes, words) in [
        (&b""[..], "the file is empty"),
        (b"t,4,7\n0,1,2\n", "--format"),
        (b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR", "--format"),
        (b"FRAME,1\nSENSELS\n", "no sensor"),
        (b"DATA_TYPE MOVIE\nROWS 0\nCOLS 3\nASCII_DATA @@\nFrame 1,0\nB,B,B\n", "`ROWS` is `0`"),
        (b"DATA_TYPE MOVIE\nROWS 4000000000\nCOLS 4000000000\nASCII_DATA @@\nFrame 1,0\nB,B,B\n", "not a sensor"),
        (b"FRAME,1\nTime,1:2:3\nSENSOR,a\nRows,4000000000\nColumns,4000000000\nSENSELS\n1,2\n", "not a sensor"),
    ] {
        let error = read_bytes("file.dat", bytes, &VendorOptions::default()).expect_err(words).to_string();
        assert!(error.contains(words) && !error.contains('\n'), "{error}");
    }
    // One for the other.
    for (format, text) in sound() {
        for other in [VendorFormat::Xsensor, VendorFormat::Tekscan, VendorFormat::Emed, VendorFormat::Pedar] {
            let novel = [VendorFormat::Pedar, VendorFormat::Pliance];
            if other == format || novel.contains(&other) && novel.contains(&format) || format == VendorFormat::Matrix {
                continue;
            }
            let options = VendorOptions { format: Some(other), ..VendorOptions::default() };
            assert!(read_bytes("file.dat", text.as_bytes(), &options).is_err(), "{format} as {other}");
        }
    }
}

/// Numbers that look like chance.
struct Random(u64);

impl Random {
    fn below(&mut self, below: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as usize % below.max(1)
    }
}

/// Changes bytes, words and lines of sound files: each is read or refused in a line, and nothing panics or fills the memory.
///
/// `SOMATIC_MUTATIONS` files of each format, by default three hundred.
#[test]
fn a_changed_file_does_no_harm() {
    let count: usize = std::env::var("SOMATIC_MUTATIONS").ok().and_then(|word| word.parse().ok()).unwrap_or(300);
    let words = [
        "",
        "0",
        "-1",
        "1e308",
        "-1e-320",
        "nan",
        "inf",
        "4294967296",
        "18446744073709551616",
        "B",
        "@@",
        "Force",
        "Frame 7",
        "SENSOR",
        "SENSELS",
        "FRAME",
        "Rows",
        "Pict-No.: 2",
        "time[",
        "sensor",
        "x[0]",
        "\u{C}",
        "ü",
        "\0",
        "1,5",
        "\"",
        ";",
    ];
    let mut random = Random(0x2545_F491_4F6C_DD1D);
    for (format, text) in sound() {
        let (mut read, mut refused) = (0, 0);
        for _ in 0..count {
            let mut bytes = text.clone().into_bytes();
            for _ in 0..1 + random.below(3) {
                let at = random.below(bytes.len());
                match random.below(6) {
                    0 => bytes[at] = random.below(256) as u8,
                    1 => drop(bytes.drain(at..(at + random.below(40)).min(bytes.len()))),
                    2 => drop(bytes.splice(at..at, words[random.below(words.len())].bytes())),
                    3 => {
                        // A word for another.
                        let end =
                            bytes[at..].iter().position(|b| b",\t \n".contains(b)).map_or(bytes.len(), |end| at + end);
                        drop(bytes.splice(at..end, words[random.below(words.len())].bytes()));
                    }
                    4 => {
                        // A line twice, somewhere else.
                        let begin = bytes[..at].iter().rposition(|b| *b == b'\n').map_or(0, |begin| begin + 1);
                        let end = bytes[at..].iter().position(|b| *b == b'\n').map_or(bytes.len(), |end| at + end + 1);
                        let line = bytes[begin..end].to_vec();
                        let to = random.below(bytes.len());
                        let to = bytes[..to].iter().rposition(|b| *b == b'\n').map_or(0, |to| to + 1);
                        drop(bytes.splice(to..to, line));
                    }
                    _ => bytes.truncate(at.max(1)),
                }
                if bytes.is_empty() {
                    bytes.push(b'\n');
                }
            }
            match try_read(format, &bytes) {
                Ok(all) => {
                    read += 1;
                    assert!(all.frames.iter().all(|(t_s, values)| t_s.is_finite() && values.len() == all.ids.len()));
                    assert!(all.ids.is_sorted_by(|a, b| a < b));
                    let cells = all.layout.panels.iter().flat_map(|panel| &panel.cells);
                    assert!(
                        cells
                            .clone()
                            .all(|cell| cell.area_m2.is_finite() && cell.centre_m.iter().all(|x| x.is_finite()))
                    );
                }
                Err(_) => refused += 1,
            }
        }
        assert!(read > count / 20 && refused > count / 20, "{format}: {read} read, {refused} refused");
    }
}
