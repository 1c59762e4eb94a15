//! Options of a recording, besides what its file says.

use std::path::PathBuf;

use super::super::map::ArrayMap;
use super::super::sizes;
use super::super::text::TextOptions;
use super::format::VendorFormat;
use crate::error::{Error, Result};
use crate::signal::UnitOfP;

/// Options of a recording, besides what its file says.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct VendorOptions {
    /// Its format, if its content is not to tell.
    pub format: Option<VendorFormat>,
    /// Frames per second, where the file has no times.
    pub rate_hz: Option<f64>,
    /// Rows and columns of plain matrices.
    pub grid: Option<[u32; 2]>,
    /// From one row to the next and from one column to the next, m.
    pub pitch_m: Option<[f64; 2]>,
    /// The unit of the values, where the file does not say it.
    pub unit: Option<UnitOfP>,
    /// A table of the sensors' places, for pedar: `id,x,y`, with `area` and `link` (`left`, `right`) where they are known.
    pub layout: Option<PathBuf>,
    /// Whether lines, rows and messages of files that are wrong are skipped and counted.
    pub skip_bad: bool,
    /// How lines of text are written, where that is not to be found out.
    pub text: TextOptions,
    /// Which arrays of messages are sensors, where messages hold them.
    pub map: Option<ArrayMap>,
}

impl VendorOptions {
    /// Rows and columns as people write them: `31x11`.
    ///
    /// # Errors
    /// A usage error.
    pub fn grid_of(text: &str) -> Result<[u32; 2]> {
        sizes::grid_of(text)
            .ok_or_else(|| Error::usage(format!("--grid {text} is not rows and columns; write them as 31x11")))
    }

    /// The pitch of rows and columns as people write it: `8.6mm`, or `8.6mm,5mm`.
    ///
    /// # Errors
    /// A usage error.
    pub fn pitch_of(text: &str) -> Result<[f64; 2]> {
        sizes::pitch_of(text).ok_or_else(|| {
            Error::usage(format!("--pitch {text} is not a length; write it with its unit, as 8.6mm or 8.6mm,5mm"))
        })
    }

    /// Refuses what is only for exports; of lines of text what these do not have either.
    pub(in crate::source) fn check_unused(&self, is_text: bool) -> Result<()> {
        let given = [
            ("--format", self.format.is_some()),
            ("--grid", self.grid.is_some() && !is_text),
            ("--pitch", self.pitch_m.is_some() && !is_text),
            ("--unit", self.unit.is_some()),
            ("--layout", self.layout.is_some()),
        ];
        match given.into_iter().find(|(_, given)| *given) {
            Some((flag, _)) => {
                Err(Error::usage(format!("{flag} is for recordings that pressure systems export; leave it out here")))
            }
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn grids_and_pitches_are_as_people_write_them() {
        assert_eq!(VendorOptions::grid_of("31x11").unwrap(), [31, 11]);
        assert_eq!(VendorOptions::grid_of("31 × 11").unwrap(), [31, 11]);
        assert_eq!(VendorOptions::pitch_of("8.6mm").unwrap(), [0.0086, 0.0086]);
        assert_eq!(VendorOptions::pitch_of("1 cm, 5mm").unwrap(), [0.01, 0.005]);
        for wrong in ["31", "31x", "0x3", "axb", "1x2x3"] {
            assert!(VendorOptions::grid_of(wrong).unwrap_err().is_usage(), "{wrong}");
        }
        for wrong in ["", "8.6", "-1mm", "0mm", "1mm,2mm,3mm", "mm"] {
            assert!(VendorOptions::pitch_of(wrong).unwrap_err().is_usage(), "{wrong}");
        }
    }
}
