//! How many frames a submission takes, and what is more than any takes.

use super::adapter::Device;
use super::columns::Columns;
use super::over_fields::{self, BY_PART};
use super::shares;
use crate::error::{Error, Result};
use crate::scene::Plan;
use crate::stage::layout;

/// Frames that fill all lanes of the shaders.
pub(super) const FRAMES_A_BLOCK: usize = 4 * layout::LANES as usize;
/// Bytes of raw values in a submission, about: enough for the device to be busy, little enough to stay in caches and to
/// have several on their way.
const ENOUGH: usize = 4 << 20;
/// Frames of a submission at most: dispatches count quads along one side, of 65,535 groups.
const MOST: usize = 1 << 17;

/// Frames that a submission takes for calls of `batch`.
pub(super) fn frames_per_submission(device: &Device, plan: &Plan, columns: &Columns, batch: usize) -> Result<usize> {
    let limits = device.device.limits();
    let limit = limits.max_storage_buffer_binding_size as usize;
    let tables = [
        plan.taxels.len() * size_of::<layout::Taxel>(),
        plan.fields.len() * size_of::<layout::Field>(),
        plan.curves.knots.len() * size_of::<layout::Knot>(),
    ];
    // A frame of every column, and a quad of every slot and of every part of a wide field.
    let (cells, quad) = (plan.fields.len() * 4 * columns.count(), plan.slots() * 16);
    let of_part = over_fields::of_part(device);
    let of_parts = plan.fields.iter().map(|field| shares::parts(field.count, of_part)).sum::<usize>() * BY_PART;
    if tables.into_iter().chain([cells, quad, of_parts]).any(|bytes| bytes > limit) {
        return Err(Error::failed(format!(
            "{} taxels in {} fields are more than a GPU binding holds ({limit} bytes); use the cpu backend",
            plan.channels(),
            plan.fields.len()
        )));
    }
    let in_blocks = |frames: usize| match frames {
        FRAMES_A_BLOCK.. => frames / FRAMES_A_BLOCK * FRAMES_A_BLOCK,
        // The largest power of two that is not more.
        _ => 1 << frames.max(1).ilog2(),
    };
    let enough = in_blocks(ENOUGH / (plan.channels() * 4)).clamp(FRAMES_A_BLOCK, MOST);
    let held = in_blocks(limit / quad.max(of_parts) * 4);
    // What comes back, in one buffer.
    let back = cells + if plan.stages().pressures { 2 * quad } else { 0 };
    let most = held.min(limit / cells).min(limits.max_buffer_size as usize / back).max(1);
    Ok(batch.clamp(1, enough.min(most)))
}
