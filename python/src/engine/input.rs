//! What a call is given: values, and where links are.

use pyo3::exceptions::PyMemoryError;
use pyo3::prelude::*;
use somatic::signal::Pose;

use super::PyEngine;
use crate::arrays::poses;
use crate::frame_values::{Values, values};
use crate::kinematics::Positions;

/// Bytes of percepts from which on it is asked whether there is room for them.
const LARGE: usize = 1 << 28;

impl PyEngine {
    /// The values of `frames` frames, where Python has them if they can be read there.
    pub(super) fn held<'py>(
        &self,
        values: &Bound<'py, PyAny>,
        mask: Option<&Bound<'py, PyAny>>,
        frames: usize,
    ) -> PyResult<Values<'py>> {
        self::values(values, mask, Some(frames), &self.channels)
    }

    /// Where links are in `frames` frames: by their poses, and by the positions of joints.
    pub(super) fn placed(
        &self,
        frames: usize,
        pose: Option<&Bound<'_, PyAny>>,
        joints: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Vec<(String, Vec<Pose>)>> {
        let given = pose.map(|pose| poses(pose, frames)).transpose()?.unwrap_or_default();
        let Some(joints) = joints else { return Ok(given) };
        let body = &self.run.body;
        let (positions, _) = Positions::new(joints, body, Some(frames))?;
        let known = |(name, _): &&(String, Vec<Pose>)| body.link_index(name).is_none();
        // What the body does not have the engine refuses by name.
        let strange: Vec<_> = given.iter().filter(known).cloned().collect();
        let mut placed = positions.poses(body, frames, &given);
        positions.check(joints.py(), body, &placed)?;
        placed.extend(strange);
        Ok(placed)
    }

    /// Refuses a call whose percepts have no room, which would end the process.
    pub(super) fn check_room(&self, frames: usize) -> PyResult<()> {
        let numbers: usize = self.run.outputs.columns().map(|column| 8 * column.components).sum();
        let cells = frames.saturating_mul(self.run.names.len());
        let bytes = cells.saturating_mul(numbers + 16);
        let is_there =
            bytes < LARGE || (bytes < isize::MAX as usize && Vec::<u8>::new().try_reserve_exact(bytes).is_ok());
        if is_there {
            return Ok(());
        }
        let gibibytes = bytes as f64 / f64::from(1 << 30);
        let what = format!("the percepts of {frames} frames take {gibibytes:.0} GiB; process fewer frames a call");
        Err(PyMemoryError::new_err(what))
    }
}
