//! Where the packages of ROS are: what `package://NAME/…` in a URDF means.

use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};

use crate::error::{Error, Result, failed};

/// How deep below a folder of `ROS_PACKAGE_PATH` packages are looked for.
const MAX_DEPTH: usize = 4;
/// How many folders are looked into.
const MAX_FOLDERS: usize = 10_000;

/// Folders that have packages.
#[derive(Clone, Debug, Default)]
pub(super) struct PackageRoots {
    /// That are a package, or have some below.
    ros: Vec<PathBuf>,
    /// That have packages by name.
    shares: Vec<PathBuf>,
}

impl PackageRoots {
    /// Of the environment: what is below the folders of `ROS_PACKAGE_PATH`, and in `share` of those of `AMENT_PREFIX_PATH`.
    pub(super) fn of_environment() -> Self {
        let variable = |name: &str| std::env::var_os(name).unwrap_or_default();
        Self::of_paths(&variable("ROS_PACKAGE_PATH"), &variable("AMENT_PREFIX_PATH"))
    }

    fn of_paths(ros: &OsStr, ament: &OsStr) -> Self {
        let named = |paths: &OsStr| -> Vec<PathBuf> {
            std::env::split_paths(paths).filter(|path| !path.as_os_str().is_empty()).collect()
        };
        Self { ros: named(ros), shares: named(ament).into_iter().map(|prefix| prefix.join("share")).collect() }
    }
}

/// The file that `package://` with `rest` after it means.
pub(super) fn resolve(rest: &str, packages: &BTreeMap<String, PathBuf>, roots: &PackageRoots) -> Result<PathBuf> {
    // Tools of ROS read three slashes as two.
    let rest = rest.trim_start_matches('/');
    let (package, within) = rest.split_once('/').unwrap_or((rest, ""));
    if matches!(package, "" | "." | "..") {
        return Err(failed!("`package://{rest}` names no package; write package://NAME/…"));
    }
    let share = || roots.shares.iter().map(|share| share.join(package)).find(|folder| folder.is_dir());
    let found = packages.get(package).cloned().or_else(|| roots.ros.iter().find_map(|root| below(root, package)));
    let folder = found.or_else(share).ok_or_else(|| {
        let searched = match roots.ros.is_empty() && roots.shares.is_empty() {
            true => "",
            false => ", and ROS_PACKAGE_PATH and AMENT_PREFIX_PATH do not have it",
        };
        Error::failed(format!(
            "`package://{rest}` is in the package `{package}`{searched}; say where that is: --package {package}=FOLDER"
        ))
    })?;
    let path = folder.join(within);
    if packages.contains_key(package)
        && !path.exists()
        && let Some(right) = folder.ancestors().skip(1).take(MAX_DEPTH).find(|above| above.join(within).is_file())
    {
        return Err(failed!(
            "{}: no such file; did you mean --package {package}={}?",
            path.display(),
            if right.as_os_str().is_empty() { ".".into() } else { right.display().to_string() }
        ));
    }
    Ok(path)
}

/// The package called `name` at `root` or below it. What is below a package belongs to it.
fn below(root: &Path, name: &str) -> Option<PathBuf> {
    let mut folders = vec![root.to_owned()];
    let mut count = 0;
    for _ in 0..=MAX_DEPTH {
        if let Some(found) =
            folders.iter().find(|folder| folder.file_name() == Some(OsStr::new(name)) && folder.is_dir())
        {
            return Some(found.clone());
        }
        let mut next = Vec::new();
        for folder in folders.iter().filter(|folder| !is_package(folder)) {
            count += 1;
            if count > MAX_FOLDERS {
                return None;
            }
            let inner = std::fs::read_dir(folder).into_iter().flatten().flatten();
            next.extend(
                inner.filter(|entry| entry.file_type().is_ok_and(|kind| !kind.is_file())).map(|entry| entry.path()),
            );
        }
        // The order in which a folder lists its entries is not the same everywhere.
        next.sort();
        folders = next;
    }
    None
}

fn is_package(folder: &Path) -> bool {
    ["package.xml", "manifest.xml"].iter().any(|name| folder.join(name).is_file())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn packages_are_found_by_option_then_below_paths_then_in_shares() {
        let place = tempfile::tempdir().unwrap();
        let make = |name: &str| {
            let folder = place.path().join(name);
            std::fs::create_dir_all(&folder).unwrap();
            std::fs::write(folder.join("package.xml"), "<package/>").unwrap();
            folder
        };
        let (deep, inside) = (make("src/robots/arm"), make("src/robots/arm/hand"));
        let (shared, second) = (make("opt/share/hand"), make("opt/share/arm"));
        let paths = |names: &[&str]| std::env::join_paths(names.iter().map(|name| place.path().join(name))).unwrap();
        let found = |rest: &str, ros: &[&str], ament: &[&str], given: &[(&str, &str)]| {
            let roots = PackageRoots::of_paths(&paths(ros), &paths(ament));
            let given = given.iter().map(|&(name, folder)| (name.to_owned(), PathBuf::from(folder))).collect();
            resolve(rest, &given, &roots).map_err(|e| e.to_string())
        };
        let mesh = |folder: &Path| Ok(folder.join("a/b.stl"));
        assert_eq!(found("arm/a/b.stl", &["none", "src"], &["opt"], &[]), mesh(&deep));
        assert_eq!(found("/arm/a/b.stl", &["src/robots/arm"], &[], &[]), mesh(&deep));
        assert_eq!(found("arm/a/b.stl", &["src"], &["opt"], &[("arm", "/own")]), mesh(Path::new("/own")));
        std::fs::create_dir_all(deep.join("a/a")).unwrap();
        std::fs::write(deep.join("a/c.stl"), "").unwrap();
        let inner = deep.join("a");
        let why = found("arm/a/c.stl", &[], &[], &[("arm", inner.to_str().unwrap())]).unwrap_err();
        let right = format!("a/a/c.stl: no such file; did you mean --package arm={}?", deep.display());
        assert!(why.ends_with(&right), "{why}");
        assert_eq!(found("arm/a/b.stl", &[], &["opt"], &[]), mesh(&second));
        // A folder in a package is none, but one that is named is looked for by its name.
        assert_eq!(found("hand/a/b.stl", &["src"], &["opt"], &[]), mesh(&shared));
        assert_eq!(found("hand/a/b.stl", &["src/robots/arm/hand"], &["opt"], &[]), mesh(&inside));
        let why = found("leg/a", &["src"], &["opt"], &[]).unwrap_err();
        assert!(why.contains("do not have it") && why.contains("--package leg=FOLDER"), "{why}");
        let why = found("leg/a", &[], &[], &[]).unwrap_err();
        assert!(why.contains("`leg`; say where"), "{why}");
        assert!(found("//", &[], &[], &[]).unwrap_err().contains("names no package"));
    }
}
