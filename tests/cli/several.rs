//! Several recordings as one table: rows of each are those that it has on its own, and nothing goes on from one to the next.

use std::path::{Path, PathBuf};

use super::{done, fails, file, files_in, text_of};

const INSOLES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/exports/insoles.csv");
const OUTPUTS: &str = "total,centroid,displacement,filtered_speed,touches";

/// Two recordings in a folder, whose touches go on from the first one's end to the second one's beginning.
fn two() -> (tempfile::TempDir, [PathBuf; 2]) {
    let text = include_str!("../../bodies/touch.csv");
    let (head, rows) = text.split_once('\n').unwrap();
    let rows: Vec<&str> = rows.lines().collect();
    let folder = tempfile::tempdir().unwrap();
    let paths = ["first.csv", "second, again.csv"].map(|name| folder.path().join(name));
    for (path, rows) in paths.iter().zip([&rows[..60], &rows[60..]]) {
        std::fs::write(path, format!("{head}\n{}\n", rows.join("\n"))).unwrap();
    }
    (folder, paths)
}

/// A table: its titles, and its rows.
fn table(path: &Path) -> (Vec<String>, Vec<Vec<String>>) {
    let mut reader = csv::Reader::from_path(path).unwrap();
    let titles = reader.headers().unwrap().iter().map(str::to_owned).collect();
    (titles, reader.records().map(|row| row.unwrap().iter().map(str::to_owned).collect()).collect())
}

/// Runs `sources` into `name`, with more flags.
fn run(folder: &Path, sources: &[&Path], name: &str, more: &[&str]) {
    let sink = format!("csv:{}", text_of(&folder.join(name)));
    let sources: Vec<&str> = sources.iter().flat_map(|source| ["--source", text_of(source)]).collect();
    let asked = ["run", "--quiet", "--backend", "cpu", "--outputs", OUTPUTS, "--sink", &sink];
    done(&[&asked[..], &sources, more].concat());
}

#[test]
fn a_table_of_several_recordings_has_the_rows_of_each() {
    let (folder, paths) = two();
    let at = |name: &str| folder.path().join(name);
    for more in [&[][..], &["--all-fields"], &["--wide"], &["--batch", "7"]] {
        let both: Vec<&Path> = paths.iter().map(PathBuf::as_path).collect();
        run(folder.path(), &both, "both.csv", &[more, &["--force"]].concat());
        for beside in ["", ".touches"] {
            let (titles, rows) = table(&at(&format!("both{beside}.csv")));
            assert_eq!(titles[..3], ["recording", "t [s]", "frame"]);
            let mut rest = rows.as_slice();
            for path in &paths {
                run(folder.path(), &[path.as_path()], "one.csv", &[more, &["--force"]].concat());
                let (own_titles, own) = table(&at(&format!("one{beside}.csv")));
                assert_eq!(own_titles, titles[1..]);
                assert!(own.len() > 20 && own[0][1].parse::<u64>().unwrap() < 30, "{beside} {more:?}");
                let (here, after) = rest.split_at(own.len());
                for (row, own) in here.iter().zip(&own) {
                    assert_eq!((row[0].as_str(), &row[1..]), (text_of(path), &own[..]), "{beside} {more:?}");
                }
                rest = after;
            }
            assert!(rest.is_empty(), "{beside} {more:?}");
        }
    }
    // The touch at the cut is one in the uncut recording, and begins anew here.
    let (titles, rows) = table(&at("both.touches.csv"));
    let age = titles.iter().position(|title| title == "age [s]").unwrap();
    let second: Vec<&Vec<String>> = rows.iter().filter(|row| row[0] == text_of(&paths[1])).collect();
    assert_eq!((second[0][2].as_str(), second[0][age].as_str()), ("0", "0.0"), "{:?}", second[0]);
}

#[test]
fn recordings_with_bodies_of_their_own_are_one_table_where_these_are_alike() {
    let folder = tempfile::tempdir().unwrap();
    let again = folder.path().join("again.csv");
    std::fs::copy(INSOLES, &again).unwrap();
    let sink = format!("csv:{}", text_of(&folder.path().join("steps.csv")));
    let asked = ["run", "--quiet", "--backend", "cpu", "--outputs", "force,touches", "--sink", &sink];
    done(&[&asked[..], &["--source", INSOLES, "--source", text_of(&again)]].concat());
    let (titles, rows) = table(&folder.path().join("steps.csv"));
    let force = titles.iter().position(|title| title == "force [N]").unwrap();
    let of = |name: &str| -> Vec<&String> { rows.iter().filter(|row| row[0] == name).map(|row| &row[force]).collect() };
    assert!(of(INSOLES).len() > 40);
    assert_eq!(of(INSOLES), of(text_of(&again)));

    let mat = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/exports/mat.asf");
    let why = fails(1, &[&asked[..], &["--force", "--source", INSOLES, "--source", mat]].concat());
    assert!(
        why.contains("mat.asf: its sensors or their fields are not those of") && why.contains("give one `body`"),
        "{why}"
    );
    // The same sensors in another unit.
    let body = folder.path().join("body.glb");
    let counts = folder.path().join("counts.csv");
    done(&["convert", INSOLES, "-o", text_of(&body)]);
    done(&["convert", INSOLES, text_of(&counts)]);
    let named = ["--force", "--body", text_of(&body), "--source", INSOLES, "--source", text_of(&counts)];
    let why = fails(1, &[&asked[..], &named].concat());
    assert!(why.contains("counts.csv: P is a count here and Pa in"), "{why}");
    assert_eq!(table(&folder.path().join("steps.csv")).1, rows, "what was there stays until all is done");
}

#[test]
fn what_several_recordings_cannot_do_is_refused_before_anything_is_read() {
    let (folder, [first, second]) = two();
    let [first, second] = [text_of(&first), text_of(&second)];
    let both = ["run", "--source", first, "--source", second];
    let refused = |code: i32, more: &[&str]| fails(code, &[&both[..], more].concat());
    assert!(refused(2, &[]).contains("several recordings go into a table; add --sink csv:FILE"));
    let sink = format!("ndjson:{}", text_of(&folder.path().join("a.ndjson")));
    assert!(refused(2, &["--sink", &sink]).contains("go into tables, which say of which one a row is, and not into"));
    let table = format!("csv:{}", text_of(&folder.path().join("a.csv")));
    let with = |more: &[&str]| -> String { refused(2, &[&["--sink", table.as_str()][..], more].concat()) };
    assert!(with(&["--loop=2"]).contains("--loop is for one recording"));
    assert!(with(&["--joint-states", "a.csv"]).contains("--joint-states is for one recording"));
    assert!(with(&["--source", first]).contains("is there twice"));
    assert!(with(&["--source", "-"]).contains("only recordings are read together"));
    let missing = refused(1, &["--sink", &table, "--source", "no-such.csv"]);
    assert!(missing.contains("no-such.csv"), "{missing}");
    // An output is none of the recordings.
    let over = refused(2, &["--force", "--sink", &format!("csv:{second}")]);
    assert!(over.contains("second, again.csv"), "{over}");
    // Elsewhere one is run.
    let plan = fails(2, &["plan", "--source", first, "--source", second]);
    assert!(plan.contains("by `somatic run` alone"), "{plan}");
    assert_eq!(files_in(folder.path()), ["first.csv", "second, again.csv"]);
    // A table that one of them cannot complete is not there.
    let (_other, broken) = file("broken.csv", "t,0,1\n0,1,2\n0.1,x,2\n0.2,1,2\n");
    let why = fails(1, &["run", "--sink", &table, "--source", first, "--source", text_of(&broken)]);
    assert!(why.contains("broken.csv: line 3") && files_in(folder.path()).len() == 2, "{why}");
    let kept = [&both[..], &["--sink", &table, "--source", text_of(&broken), "--skip-bad", "--quiet"]].concat();
    assert!(fails(3, &kept).contains("broken.csv"));
    assert_eq!(files_in(folder.path()).len(), 4);
}

#[test]
fn columns_are_described_with_the_recording() {
    let (_folder, [first, second]) = two();
    let both = ["run", "--describe", "--source", text_of(&first), "--source", text_of(&second)];
    let text = done(&both);
    assert_eq!(text.matches("The recording that the frame is of.").count(), 2, "{text}");
    assert!(!done(&both[..4]).contains("recording"));
    assert!(done(&[&both[..], &["--sink", "csv:-", "--wide"]].concat()).contains("recording, t and frame"));
}
