//! Where the table of touches is beside that of percepts.

use std::path::{Path, PathBuf};

/// `percepts.csv` has its touches in `percepts.touches.csv`.
pub(in crate::sink) fn touches_path(path: &Path) -> PathBuf {
    let mut name = path.file_stem().unwrap_or_default().to_owned();
    name.push(".touches");
    if let Some(ending) = path.extension() {
        name.push(".");
        name.push(ending);
    }
    path.with_file_name(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn touches_are_beside_the_percepts() {
        for (path, wanted) in
            [("a/b.csv", "a/b.touches.csv"), ("b", "b.touches"), ("x.y.parquet", "x.y.touches.parquet")]
        {
            assert_eq!(touches_path(Path::new(path)), Path::new(wanted));
        }
    }
}
