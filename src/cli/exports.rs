//! Recordings that pressure systems export, as commands name them.

use std::path::PathBuf;

use clap::Args;
use somatic::Result;
use somatic::internal::scene_file::hertz;
use somatic::scene::file::SceneFile;
use somatic::source::{VendorFormat, VendorOptions};

use super::scene::{in_flags, one_of};

/// What a recording needs that its file does not have.
#[derive(Args, Clone, Debug, Default)]
pub(super) struct ExportFlags {
    /// Frames per second of a recording without times, such as 50Hz.
    ///
    /// A bare number is in Hz.
    #[arg(long, value_name = "RATE", value_parser = hertz)]
    pub(super) rate: Option<f64>,

    /// Read the file as the export of a pressure system [default: as its content says].
    ///
    /// One of xsensor, tekscan, emed, pliance, pedar, loadsol, footscan, stappone, or matrix for plain numbers.
    #[arg(long, value_name = "FORMAT", value_parser = one_of::<VendorFormat>(VendorFormat::WORDS))]
    pub(super) format: Option<VendorFormat>,

    /// Rows and columns of a frame of plain numbers, such as 31x11.
    #[arg(long, value_name = "ROWSxCOLUMNS")]
    pub(super) grid: Option<String>,

    /// Distance between rows and columns of plain numbers, such as 8.6mm, or 8.6mm,5mm for rows and columns.
    #[arg(long, value_name = "LENGTH")]
    pub(super) pitch: Option<String>,

    /// The unit of the values, if the file has none: kPa, mmHg, N/cm2, psi, N, and others.
    #[arg(long, value_name = "UNIT")]
    pub(super) unit: Option<String>,

    /// Where the sensors of pedar's insoles are: a CSV with the columns id, x, y and area.
    ///
    /// It is in metres and square metres. The exports of pedar do not have it.
    #[arg(long, value_name = "FILE.csv")]
    pub(super) layout: Option<PathBuf>,

    /// Which arrays of messages are sensors: a TOML file, or dex3, inspire, tactile-state or mujoco.
    ///
    /// For ROS 2 bags with messages of any type, NDJSON, and lines of JSON. dex3 and inspire are untested.
    #[arg(long, value_name = "FILE")]
    pub(super) map: Option<String>,
}

impl ExportFlags {
    /// What a scene would say of it.
    pub(super) fn keys(&self) -> SceneFile {
        let Self { rate, format, grid, pitch, unit, layout, map } = self.clone();
        let mut keys = SceneFile::default();
        (keys.rate_hz, keys.format, keys.grid, keys.pitch) = (rate, format, grid, pitch);
        (keys.unit, keys.layout, keys.map) = (unit, layout, map);
        keys
    }

    pub(super) fn options(&self) -> Result<VendorOptions> {
        self.keys().export_options().map_err(in_flags)
    }
}
