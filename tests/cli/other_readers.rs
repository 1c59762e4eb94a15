//! Meshes as another reader has them: every one of a collection of robots, corner by corner.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::atomic::{AtomicUsize, Ordering};

use serde_json::Value;
use somatic::author::mesh::{MeshOptions, open};
use somatic::internal::author::mesh::Up;

use crate::python::python_with;
use crate::{stderr, text_of};
use somatic_testing::skip;

/// The corners of the triangles of the mesh at `path` as doubles, in its own axes, m.
fn corners(path: &Path) -> Vec<u8> {
    let mut options = MeshOptions::default();
    options.up = Some(Up::Y);
    let (body, _) = open(path, &options).unwrap_or_else(|e| panic!("{e}")).read().unwrap();
    let numbers = body.triangles_at_rest().into_iter().flat_map(|(_, corners)| corners.map(|p| p.to_array()));
    numbers.flatten().flat_map(f64::to_le_bytes).collect()
}

#[test]
fn meshes_of_robots_are_those_that_trimesh_reads() {
    let python = match python_with("meshes", "import scipy, trimesh, collada") {
        Ok(python) => python,
        Err(why) => return skip("KINEMATICS", why),
    };
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/meshes/compare.py");
    let run = |arguments: &[&str]| {
        let output = Command::new(&python).arg(script).args(arguments).output().unwrap();
        assert!(output.status.success(), "{}", stderr(&output));
        String::from_utf8(output.stdout).unwrap()
    };
    let paths: Vec<PathBuf> = run(&["list"]).lines().map(PathBuf::from).collect();
    assert!(paths.len() > 700, "{}", paths.len());
    let folder = tempfile::tempdir().unwrap();
    let next = AtomicUsize::new(0);
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    std::thread::scope(|scope| {
        for _ in 0..threads {
            scope.spawn(|| {
                while let Some((index, path)) =
                    Some(next.fetch_add(1, Ordering::Relaxed)).and_then(|at| Some((at, paths.get(at)?)))
                {
                    std::fs::write(folder.path().join(index.to_string()), corners(path)).unwrap();
                }
            });
        }
    });
    let list = folder.path().join("list");
    let compare = |paths: &[PathBuf]| -> Value {
        let names: Vec<&str> = paths.iter().map(|path| text_of(path)).collect();
        std::fs::write(&list, names.join("\n")).unwrap();
        serde_json::from_str(&run(&["compare", text_of(&list), text_of(folder.path())])).unwrap()
    };
    let found = compare(&paths);
    eprintln!("{found:#}");
    assert_eq!(found["files"], paths.len());
    assert!(found["apart"].as_f64().unwrap() < 1e-6 && found["areas"].as_f64().unwrap() < 1e-4, "{found:#}");
    // A corner that is 2 µm off is seen.
    let first = folder.path().join("0");
    let mut bytes = std::fs::read(&first).unwrap();
    let moved = f64::from_le_bytes(bytes[..8].try_into().unwrap()) + 2e-6;
    bytes[..8].copy_from_slice(&moved.to_le_bytes());
    std::fs::write(&first, bytes).unwrap();
    assert!(compare(&paths[..1])["apart"].as_f64().unwrap() > 1e-6);
}
