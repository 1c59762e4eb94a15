//! Files that are known and not read: what to do with them.

use std::path::Path;

/// By ending what it is and what to do.
const REFUSED: [(&str, &str); 6] = [
    ("xls", "it is a workbook of a spreadsheet; save it as CSV, or name it csv:FILE if it is text"),
    ("xlsx", "it is a workbook of a spreadsheet; save it as CSV"),
    ("fsx", "it is a movie in Tekscan's own format; save it as ASCII (.asf) in Tekscan's program, and read that"),
    (
        "parquet",
        "a table in Parquet is read as a part of a LeRobot dataset; name its folder, lerobot:DIR, or save it as CSV",
    ),
    ("h5", HDF5),
    ("hdf5", HDF5),
];

const HDF5: &str = "HDF5 is read in Python: somatic_touch.read(FILE, dataset=NAME)";

/// Endings of files that are not read as `.gz`.
const BINARY: [&str; 3] = ["mcap", "db3", "bag"];

/// What to do with the file `text`, if it is known that it is not read.
pub(super) fn what_to_do(text: &str) -> Option<String> {
    let path = Path::new(text);
    let is = |path: &Path, wanted: &str| path.extension().is_some_and(|own| own.eq_ignore_ascii_case(wanted));
    if is(path, "gz") && BINARY.iter().any(|ending| is(&path.with_extension(""), ending)) {
        return Some(format!("only text is read from .gz; unpack it first: gunzip -k {text}"));
    }
    let (ending, what) = REFUSED.iter().find(|(ending, _)| is(path, ending))?;
    let is_absent = *ending == "parquet" && cfg!(not(feature = "parquet"));
    Some(if is_absent { format!("{what}; {NO_PARQUET}") } else { (*what).to_owned() })
}

/// What a build without Parquet has to say.
pub(super) const NO_PARQUET: &str = "this build reads no Parquet: cargo install --path . --features parquet, or use somatic_touch.lerobot.read in Python";

#[cfg(test)]
mod tests {
    use crate::source::SourceSpec;

    fn why(text: &str) -> String {
        let error = text.parse::<SourceSpec>().unwrap_err();
        assert!(error.is_usage(), "{error}");
        error.to_string()
    }

    #[test]
    fn a_known_file_that_is_not_read_says_what_to_do() {
        for (text, wanted) in [
            ("a.xls", "source `a.xls`: it is a workbook of a spreadsheet; save it as CSV, or"),
            ("a.XLSX", "save it as CSV"),
            ("walk.fsx", "save it as ASCII (.asf) in Tekscan's program"),
            ("a.h5", "somatic_touch.read(FILE, dataset=NAME)"),
            ("a.hdf5", "somatic_touch.read(FILE, dataset=NAME)"),
            ("a.parquet", "name its folder, lerobot:DIR, or save it as CSV"),
            ("a.mcap.gz", "unpack it first: gunzip -k a.mcap.gz"),
            ("b/a.db3.GZ", "unpack it first"),
        ] {
            assert!(why(text).contains(wanted), "{}", why(text));
        }
        assert_eq!(why("a.parquet").contains("--features parquet"), cfg!(not(feature = "parquet")));
    }

    #[test]
    fn what_is_written_is_not_packed() {
        let error = SourceSpec::one_of("out.csv.gz", &["csv", "mcap"]).unwrap_err();
        assert!(error.to_string().ends_with("this should be csv:FILE or mcap:FILE"), "{error}");
    }

    #[test]
    fn text_in_gz_and_old_bags_are_left_to_their_readers() {
        for text in ["a.csv.gz", "a.asf.GZ", "a.txt.gz", "a.bag", "csv:a.xls", "mcap:a.mcap.gz"] {
            assert!(text.parse::<SourceSpec>().is_ok(), "{text}");
        }
    }
}
