use std::fs;
use std::path::{Path, PathBuf};

use super::*;
use crate::error::{ErrorKind, Result};

/// A folder with a file `in.csv` that holds `mine`.
fn with_input() -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let input = folder.path().join("in.csv");
    fs::write(&input, "mine").unwrap();
    (folder, input)
}

fn names_in(folder: &Path) -> Vec<String> {
    let mut names: Vec<_> =
        fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

fn refused(made: Result<OutputPath>) -> String {
    let why = made.unwrap_err();
    assert!(why.is_usage(), "{why}");
    why.to_string()
}

#[test]
fn an_input_is_not_an_output_however_it_is_spelt() {
    let (folder, input) = with_input();
    let at = |name: &str| folder.path().join(name);
    fs::create_dir(at("inner")).unwrap();
    fs::hard_link(&input, at("hard.csv")).unwrap();
    let mut spellings = vec![input.clone(), at("./in.csv"), at("inner/../in.csv"), at("hard.csv")];
    #[cfg(unix)]
    {
        use std::os::unix::fs::symlink;
        symlink("in.csv", at("soft.csv")).unwrap();
        symlink(at("soft.csv"), at("softer.csv")).unwrap();
        symlink(folder.path(), at("inner/linked")).unwrap();
        spellings.extend([at("soft.csv"), at("softer.csv"), at("inner/linked/in.csv")]);
    }
    for spelling in &spellings {
        for force in [false, true] {
            let why = refused(OutputPath::new(spelling, force, &[&input]));
            let both = [spelling, &input].map(|path| path.display().to_string());
            assert!(both.iter().all(|path| why.contains(path)), "{why}");
            let why = refused(OutputPath::new(&input, force, &[Path::new("no/such.csv"), spelling]));
            assert!(both.iter().all(|path| why.contains(path)), "{why}");
        }
    }
    assert!(OutputPath::new(at("other.csv"), false, &[&input]).is_ok());
    assert!(!at("other.csv").exists(), "nothing is made by asking");
}

#[test]
fn two_outputs_are_two_files_even_before_they_are_there() {
    let (folder, input) = with_input();
    let at = |name: &str| folder.path().join(name);
    fs::create_dir(at("inner")).unwrap();
    let mut pairs = vec![(at("out"), at("out")), (at("out"), at("inner/../out"))];
    #[cfg(unix)]
    {
        use std::os::unix::fs::symlink;
        symlink(folder.path(), at("linked")).unwrap();
        symlink("inner/new", at("to_new")).unwrap();
        pairs.extend([(at("out"), at("linked/out")), (at("to_new"), at("linked/inner/new"))]);
    }
    for (first, second) in &pairs {
        let mut outputs = OutputPaths::new(true, [&input]);
        outputs.add(first).unwrap();
        let why = refused(outputs.add(second));
        assert!(why.contains(&first.display().to_string()) && why.contains(&second.display().to_string()), "{why}");
        assert!(outputs.add(at("inner/out")).is_ok());
    }
    let mut outputs = OutputPaths::new(true, [at("none")]);
    outputs.add(&input).unwrap();
    fs::hard_link(&input, at("hard.csv")).unwrap();
    refused(outputs.add(at("hard.csv")));
}

#[test]
fn a_file_that_is_there_goes_only_by_force_and_only_for_a_whole_one() {
    let (folder, file) = with_input();
    let why = OutputPath::new(&file, false, &[]).unwrap_err();
    assert!(!why.is_usage() && why.to_string().contains("--force"), "{why}");
    let force = || OutputPath::new(&file, true, &[]).unwrap();
    drop(force());
    drop(force().begin().unwrap());
    assert_eq!(fs::read_to_string(&file).unwrap(), "mine", "not finished, not replaced");
    force().write(b"new").unwrap();
    assert_eq!(fs::read_to_string(&file).unwrap(), "new");
    assert_eq!(names_in(folder.path()), ["in.csv"]);

    // What came up in the meantime is kept as well.
    let late = folder.path().join("late");
    let mut parts =
        [late.clone(), late.clone()].map(|path| OutputPath::new(path, false, &[]).unwrap().begin().unwrap());
    std::io::Write::write_all(&mut parts[1], b"second").unwrap();
    let [first, second] = parts;
    first.finish().unwrap();
    assert!(second.finish().unwrap_err().to_string().contains("--force"));
    assert_eq!(fs::read_to_string(&late).unwrap(), "");
    assert_eq!(names_in(folder.path()), ["in.csv", "late"]);
}

#[test]
fn a_part_takes_nobodys_name() {
    let (folder, _) = with_input();
    let other = folder.path().join("out.part");
    fs::write(&other, "mine too").unwrap();
    OutputPath::new(folder.path().join("out"), false, &[]).unwrap().write(b"x").unwrap();
    assert_eq!(fs::read_to_string(&other).unwrap(), "mine too");
    assert_eq!(names_in(folder.path()), ["in.csv", "out", "out.part"]);
}

#[test]
fn what_cannot_be_written_is_reported_before() {
    let (folder, file) = with_input();
    assert_eq!(OutputPath::new(folder.path().join("no/such"), false, &[]).unwrap_err().kind(), ErrorKind::NotFound);
    for is_folder in [folder.path().to_owned(), folder.path().join("new/"), folder.path().join(".."), "".into()] {
        let why = OutputPath::new(is_folder, true, &[]).unwrap_err().to_string();
        assert!(why.contains("this is a folder"), "{why}");
    }
    let why = OutputPaths::new(true, [""; 0]).add_folder(&file, ["a"]).unwrap_err().to_string();
    assert!(why.contains("name a folder"), "{why}");
    assert!(OutputPath::edit(folder.path()).is_err() && OutputPath::edit(folder.path().join("none")).is_err());
}

#[test]
fn a_folder_is_made_for_the_files_that_were_asked_for() {
    let (folder, _) = with_input();
    let destination = folder.path().join("deep/out");
    let write = |force: bool| {
        let mut files = OutputPaths::new(force, [""; 0]).add_folder(&destination, ["a", "b"])?;
        files.make()?;
        files.take("b").write(b"x")
    };
    write(false).unwrap();
    assert_eq!(names_in(&destination), ["b"]);
    assert!(write(false).unwrap_err().to_string().contains("b: it exists"));
    write(true).unwrap();
}

#[test]
fn both_files_or_neither() {
    let (folder, _) = with_input();
    let begun = |name: &str| OutputPath::new(folder.path().join(name), false, &[]).unwrap().begin().unwrap();
    let (first, second) = (begun("first"), begun("second"));
    fs::write(folder.path().join("second"), "mine").unwrap();
    assert!(first.finish_with(vec![second]).is_err());
    assert_eq!(names_in(folder.path()), ["in.csv", "second"]);
    begun("third").finish_with(vec![begun("fourth")]).unwrap();
    assert_eq!(names_in(folder.path()), ["fourth", "in.csv", "second", "third"]);
}

#[cfg(unix)]
mod unix {
    use std::os::unix::fs::{PermissionsExt as _, symlink};

    use super::*;

    #[test]
    fn devices_pipes_and_links_stay_what_they_are() {
        let (folder, file) = with_input();
        let mut outputs = OutputPaths::new(false, [Path::new("/dev/null")]);
        for _ in 0..2 {
            outputs.add("/dev/null").unwrap().write(b"x").unwrap();
        }
        assert!(!fs::metadata("/dev/null").unwrap().is_file());
        let link = folder.path().join("link");
        symlink("in.csv", &link).unwrap();
        OutputPath::new(&link, true, &[]).unwrap().write(b"new").unwrap();
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(fs::read_to_string(&file).unwrap(), "new");
        // A link to nothing yet: the file is made where it leads.
        let early = folder.path().join("early");
        symlink("later", &early).unwrap();
        OutputPath::new(&early, false, &[]).unwrap().write(b"made").unwrap();
        assert!(fs::symlink_metadata(&early).unwrap().is_symlink());
        assert_eq!(fs::read_to_string(folder.path().join("later")).unwrap(), "made");
        symlink("round", folder.path().join("round")).unwrap();
        assert!(OutputPath::new(folder.path().join("round"), true, &[]).is_err());
    }

    #[test]
    fn what_is_written_is_as_public_as_any_file_or_as_the_one_before() {
        let (folder, plain) = with_input();
        let ours = folder.path().join("ours");
        OutputPath::new(&ours, false, &[]).unwrap().write(b"x").unwrap();
        let mode = |path| fs::metadata(path).unwrap().permissions().mode();
        assert_eq!(mode(&ours), mode(&plain));
        fs::set_permissions(&ours, fs::Permissions::from_mode(0o640)).unwrap();
        OutputPath::edit(&ours).unwrap().write(b"y").unwrap();
        assert_eq!(mode(&ours) & 0o777, 0o640);
    }

    #[test]
    fn a_link_takes_the_place_of_a_link_and_of_nothing_else() {
        let (folder, input) = with_input();
        let at = |name: &str| folder.path().join(name);
        let mut outputs = OutputPaths::new(true, [&input]);
        symlink("/dev/null", at("stale")).unwrap();
        fs::write(at("stale.new"), "mine").unwrap();
        let link = outputs.add_link(at("stale")).unwrap();
        link.lead_to(Path::new("/dev/zero")).unwrap();
        link.lead_to(Path::new("/dev/full")).unwrap();
        assert_eq!(fs::read_link(at("stale")).unwrap(), Path::new("/dev/full"));
        assert_eq!(fs::read_to_string(at("stale.new")).unwrap(), "mine");
        link.remove();
        assert!(!at("stale").exists());
        symlink("in.csv", at("to_input")).unwrap();
        for path in [&input, &at("to_input")] {
            assert!(outputs.add_link(path).unwrap_err().is_usage());
        }
        symlink("stale.new", at("to_file")).unwrap();
        for path in ["stale.new", "to_file"] {
            assert!(outputs.add_link(at(path)).unwrap_err().to_string().contains("give --link another"));
        }
    }
}
