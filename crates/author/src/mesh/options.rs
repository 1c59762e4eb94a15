//! How meshes of other formats are read.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use glam::{DAffine3, DQuat};

use super::ros_packages::PackageRoots;
use crate::body::Up;
use crate::error::{Result, failed};

/// The geometry of a URDF that taxels are put on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Geometry {
    /// What a person sees.
    #[default]
    Visual,
    /// What collisions are computed with: coarser, often of simple shapes.
    Collision,
    /// None: links alone, for taxels that the file has itself.
    None,
}

/// How a mesh of another format is read.
#[derive(Clone, Debug, Default)]
pub struct MeshOptions {
    /// The unit of its numbers, m; by default that of the file if it has one, else m.
    pub unit_m: Option<f64>,
    /// The axis that points up; by default z in a URDF or MJCF, else that of the file if it has one, else y.
    pub up: Option<Up>,
    /// Folders by name of a package, for `package://NAME/…` in a URDF.
    pub packages: BTreeMap<String, PathBuf>,
    /// The geometry of a URDF.
    pub geometry: Geometry,
    /// Where packages are looked for that `packages` has not.
    pub(super) package_roots: PackageRoots,
}

impl MeshOptions {
    /// Searches for packages that `packages` has not in the environment: below the folders of `ROS_PACKAGE_PATH`, and in
    /// `share` of those of `AMENT_PREFIX_PATH`.
    #[must_use]
    pub fn with_ros_packages(mut self) -> Self {
        self.package_roots = PackageRoots::of_environment();
        self
    }

    /// The axis that points up in a robot's file, and the message if it is not given.
    pub(super) fn robot_up(&self) -> (Up, Option<String>) {
        let assumed = || "the file's z counts as up, its x as forward, as in REP 103; if its y is up, give --up y";
        (self.up.unwrap_or(Up::Z), self.up.is_none().then(assumed).map(str::to_owned))
    }
}

/// Asks whether `what`, which has `size_m`, is in millimetres if it is over `most_m`.
pub(super) fn doubt(what: &str, size_m: f64, most_m: f64) -> Option<String> {
    (size_m > most_m).then(|| format!("{what} is {size_m:.0} m across: if its numbers are millimetres"))
}

pub(super) fn ending(path: &Path) -> String {
    path.extension().map(|ending| ending.to_string_lossy().to_ascii_lowercase()).unwrap_or_default()
}

/// `metres` as a length that a mesh's unit may have.
pub(super) fn check_unit(metres: f64) -> Result<f64> {
    if metres.is_finite() && metres > 0.0 { Ok(metres) } else { Err(failed!("a unit of {metres} m; give one over 0")) }
}

/// Turns what points up in a file of a single mesh to y, about x.
pub(super) fn y_up_from(up: Up) -> DAffine3 {
    match up {
        Up::Y => DAffine3::IDENTITY,
        Up::Z => DAffine3::from_quat(DQuat::from_rotation_x(-std::f64::consts::FRAC_PI_2)),
    }
}
