//! Where the tables of touches and self-contacts are beside that of percepts.

use std::path::{Path, PathBuf};

/// `percepts.csv` has its `touches` in `percepts.touches.csv`.
pub(in crate::sink) fn path_beside(path: &Path, what: &str) -> PathBuf {
    let mut name = path.file_stem().unwrap_or_default().to_owned();
    name.push(".");
    name.push(what);
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
            assert_eq!(path_beside(Path::new(path), "touches"), Path::new(wanted));
        }
    }
}
