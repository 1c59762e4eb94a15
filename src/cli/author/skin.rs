//! Skins that come with their places: the iCub's position files, tactile sensors in a URDF or an MJCF, tables.

use std::path::PathBuf;

use clap::Args;
use somatic::author::mesh::{author_mjcf_skin, author_urdf_skin};
use somatic::author::{Authored, author_csv_skin, author_icub};
use somatic::{Error, Result};

use super::convert::MeshArguments;

const HEADING: &str = "Skins of others, which have their places";

#[derive(Args)]
pub(super) struct SkinArguments {
    /// The iCub's position files, one for each part, as a body without a mesh.
    ///
    /// Each part is a link.
    #[arg(long, value_name = "FILE", num_args = 1.., help_heading = HEADING,
        conflicts_with_all = ["recipe", "taxels", "spacing", "region", "seed", "unit", "even", "hidden", "clear", "mirror", "grid", "urdf_skin", "mjcf_skin", "csv_skin"])]
    icub: Vec<PathBuf>,

    /// A robot whose .urdf has its skin, as <sensor> with <tactile>, in an <array> or as <taxel>s.
    ///
    /// With --geometry none, only the taxels are read.
    #[arg(long, value_name = "FILE.urdf", help_heading = HEADING,
        conflicts_with_all = ["recipe", "taxels", "spacing", "region", "seed", "unit", "even", "hidden", "clear", "mirror", "grid", "mjcf_skin", "csv_skin"])]
    urdf_skin: Option<PathBuf>,

    /// A robot for MuJoCo whose .xml has its skin, as <tactile> sensors on meshes and as touch_grid sensors.
    #[arg(long, value_name = "FILE.xml", help_heading = HEADING,
        conflicts_with_all = ["recipe", "taxels", "spacing", "region", "seed", "unit", "even", "hidden", "clear", "mirror", "grid", "csv_skin"])]
    mjcf_skin: Option<PathBuf>,

    /// A table of taxels, as `somatic convert SKIN.glb -o FILE.csv` writes it, as a body without a mesh.
    #[arg(long, value_name = "FILE.csv", help_heading = HEADING,
        conflicts_with_all = ["recipe", "taxels", "spacing", "region", "seed", "unit", "even", "hidden", "clear", "mirror", "grid"])]
    csv_skin: Option<PathBuf>,
}

impl SkinArguments {
    pub(super) fn is_asked(&self) -> bool {
        !self.icub.is_empty() || self.urdf_skin.is_some() || self.mjcf_skin.is_some() || self.csv_skin.is_some()
    }

    /// The files that are read; `mesh` says how a URDF is.
    pub(super) fn files(&self, mesh: &MeshArguments) -> Result<Vec<PathBuf>> {
        let mut files = self.icub.clone();
        files.extend(self.csv_skin.clone());
        files.extend(self.mjcf_skin.clone());
        if let Some(path) = &self.urdf_skin {
            files.extend(somatic::internal::author::mesh::files(path, &mesh.options(None)?));
        }
        Ok(files)
    }

    pub(super) fn author(&self, mesh: &MeshArguments) -> Result<Authored> {
        match (&self.urdf_skin, &self.mjcf_skin, &self.csv_skin) {
            (Some(path), ..) => author_urdf_skin(path, &mesh.options(None)?),
            (_, Some(path), _) => author_mjcf_skin(path, &mesh.options(None)?),
            (_, _, Some(path)) => author_csv_skin(path),
            _ if self.icub.is_empty() => Err(Error::usage("give a skin")),
            _ => author_icub(&self.icub),
        }
    }
}
