//! Recordings that pressure systems export, as commands name them.

use std::path::PathBuf;

use clap::Args;
use somatic::Result;
use somatic::scene::file::SceneFile;
use somatic::source::{VendorFormat, VendorOptions};

use super::scene::{in_flags, one_of};

/// What is said of a recording beside what its file says.
#[derive(Args, Clone, Debug, Default)]
pub(super) struct ExportFlags {
    /// Frames per second of a recording that has no times, in Hz.
    #[arg(long, value_name = "HZ")]
    pub(super) rate: Option<f64>,

    /// Read the file as a pressure system's export: xsensor, tekscan, emed, pliance, pedar, or matrix for plain numbers
    /// [default: as its content says].
    #[arg(long, value_name = "FORMAT", value_parser = one_of::<VendorFormat>(VendorFormat::WORDS))]
    pub(super) format: Option<VendorFormat>,

    /// Rows and columns of a frame of plain numbers, such as 31x11.
    #[arg(long, value_name = "ROWSxCOLUMNS")]
    pub(super) grid: Option<String>,

    /// From one row and column of them to the next, such as 8.6mm, or 8.6mm,5mm for rows and columns.
    #[arg(long, value_name = "LENGTH")]
    pub(super) pitch: Option<String>,

    /// The unit of the values where the file does not say it: kPa, mmHg, N/cm2, psi, N, and others.
    #[arg(long, value_name = "UNIT")]
    pub(super) unit: Option<String>,

    /// Where the sensors of pedar's insoles are, which its files do not say: a CSV with the columns id, x, y and area, in
    /// metres and square metres.
    #[arg(long, value_name = "FILE.csv")]
    pub(super) layout: Option<PathBuf>,
}

impl ExportFlags {
    /// What a scene would say of it.
    pub(super) fn keys(&self) -> SceneFile {
        let Self { rate, format, grid, pitch, unit, layout } = self.clone();
        let mut keys = SceneFile::default();
        (keys.rate_hz, keys.format, keys.grid, keys.pitch) = (rate, format, grid, pitch);
        (keys.unit, keys.layout) = (unit, layout);
        keys
    }

    pub(super) fn options(&self) -> Result<VendorOptions> {
        self.keys().export_options().map_err(in_flags)
    }
}
