//! Cells and edges of taxels against Voronoi cells that Python computes in another way.

use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;

use crate::python::python_with;
use crate::{done, stderr, text_of};
use somatic_testing::skip;

/// Taxels per body; `SOMATIC_VORONOI` sets another number.
const TAXELS: usize = 250;

/// An edge of the fine mesh is at most the spacing of taxels over this.
const FINE: &str = "4";

/// The maximum difference of a cell's area, and the minimum share of equal edges.
const WITHIN: f64 = 0.03;
const EQUAL: f64 = 0.95;

/// Bodies and their listings, made as needed.
struct Oracle {
    python: PathBuf,
    folder: tempfile::TempDir,
    taxels: String,
}

impl Oracle {
    /// `None` without Python, which is said.
    fn new() -> Option<Self> {
        let python = match python_with("voronoi", "import numpy, pygeodesic.geodesic, scipy") {
            Ok(python) => python,
            Err(why) => {
                skip("KINEMATICS", why);
                return None;
            }
        };
        let taxels = std::env::var("SOMATIC_VORONOI").unwrap_or_else(|_| TAXELS.to_string());
        Some(Self { python, folder: tempfile::tempdir().unwrap(), taxels })
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn run(&self, arguments: &[&str]) -> String {
        let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/voronoi/compare.py");
        let output = Command::new(&self.python).arg(script).args(arguments).output().unwrap();
        assert!(output.status.success(), "{arguments:?}: {}", stderr(&output));
        String::from_utf8(output.stdout).unwrap()
    }

    /// `mesh` with taxels, and its listing.
    fn author(&self, name: &str, mesh: &str, flags: &[&str]) -> (PathBuf, PathBuf) {
        let (body, listed) = (self.path(&format!("{name}.glb")), self.path(&format!("{name}.json")));
        done(&[&["author", mesh, "--taxels", &self.taxels, "--seed", "1", "-o", text_of(&body)], flags].concat());
        std::fs::write(&listed, done(&["inspect", text_of(&body), "--json"])).unwrap();
        (body, listed)
    }

    fn figures(name: &str, text: &str) -> Value {
        eprintln!("{name}: {text}");
        serde_json::from_str(text).unwrap()
    }

    /// Compares `mesh` with cells on a fine mesh.
    fn compare(&self, name: &str, mesh: &str, flags: &[&str]) -> Value {
        let (body, listed) = self.author(name, mesh, flags);
        let found = Self::figures(name, &self.run(&["body", text_of(&body), text_of(&listed), FINE]));
        assert!(number(&found, "off_surface_m") < 1e-5, "{name}: {found}");
        // Else the mesh is too coarse to judge.
        assert!(number(&found, "unclear") < 1e-3, "{name}: {found}");
        found
    }
}

fn number(found: &Value, key: &str) -> f64 {
    found[key].as_f64().unwrap_or_else(|| panic!("{key}: {found}"))
}

fn assert_near(name: &str, found: &Value) {
    assert!(number(found, "areas_worst") < WITHIN, "{name}: {found}");
    assert!(number(found, "edges_equal") >= EQUAL, "{name}: {found}");
}

#[test]
fn cells_and_edges_on_planes_spheres_and_cylinders_are_exact() {
    let Some(oracle) = Oracle::new() else { return };
    for shape in ["plane", "sphere", "cylinder"] {
        let mesh = oracle.path(&format!("{shape}.obj"));
        oracle.run(&["make", shape, text_of(&mesh)]);
        let (_, listed) = oracle.author(shape, text_of(&mesh), &[]);
        let found = Oracle::figures(shape, &oracle.run(&["shape", shape, text_of(&listed)]));
        assert_near(shape, &found);
        assert_eq!(found["without"], 0, "{shape}: {found}");
    }
}

#[test]
#[ignore = "the fine meshes take minutes"]
fn cells_and_edges_of_bodies_are_those_of_another_voronoi() {
    let Some(oracle) = Oracle::new() else { return };
    for name in ["humanoid", "hand"] {
        let found = oracle.compare(name, name, &[]);
        assert_near(name, &found);
        assert_eq!(found["without"], 0, "{name}: {found}");
        assert!((5.0..=6.5).contains(&number(&found, "degree_open")), "{name}: {found}");
    }
    let root = std::env::var_os("SOMATIC_DATA").map_or_else(|| PathBuf::from("../shared/data"), PathBuf::from);
    let mesh = root.join("meshes/blender_io/02_suzanne/02_suzanne.gltf");
    if mesh.exists() {
        assert_near("suzanne", &oracle.compare("suzanne", text_of(&mesh), &[]));
    } else {
        skip("DATA", format!("{} is not there; set SOMATIC_DATA to the folder that has it", mesh.display()));
    }
}

/// Robots have many shells; on some of these a fine mesh takes minutes.
#[test]
#[ignore = "takes minutes"]
fn cells_and_edges_of_robots_are_those_of_another_voronoi() {
    let Some(oracle) = Oracle::new() else { return };
    let robots = match python_with("presses", "import numpy, scipy") {
        Ok(robots) => robots,
        Err(why) => return skip("KINEMATICS", why),
    };
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/presses/compare.py");
    for name in ["panda", "go2"] {
        let output = Command::new(&robots).args([text_of(&script), "where", name]).output().unwrap();
        assert!(output.status.success(), "{}", stderr(&output));
        let place = String::from_utf8(output.stdout).unwrap();
        let (urdf, packages) = place.trim().split_once('\n').unwrap();
        let found = oracle.compare(name, urdf, &["--package", &format!("example-robot-data={packages}")]);
        assert!(number(&found, "edges_equal") >= EQUAL, "{name}: {found}");
        let taxels = number(&found, "taxels");
        assert!(
            number(&found, "without") <= 0.025 * taxels && number(&found, "few") <= 0.07 * taxels,
            "{name}: {found}"
        );
    }
}
