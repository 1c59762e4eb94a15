//! Every struct that crosses to the GPU. A test holds each to what naga makes of its WGSL twin.

use bytemuck::{Pod, Zeroable};

/// The bit of a cell's status from which on it says which outputs are present.
#[cfg_attr(not(feature = "gpu"), expect(dead_code, reason = "for shaders alone"))]
pub(crate) const PRESENT: u32 = 16;

/// A field of more members than this, or each of its parts, is taken by a whole group of the GPU's invocations. lavapipe ends
/// an invocation's loops after 65,535 rounds in all; a field that is not wide makes three rounds a member at most.
pub(crate) const WIDE: usize = 4096;

/// Memberships that a uniform binding holds, as `shaders/shared/few_members.wgsl` says: 64 KiB, which every device can bind.
#[cfg(feature = "gpu")]
pub(crate) const FEW: usize = 4096;

/// A field of as many members or more has sixteen of them abreast on the CPU: fewer do as well one after the other, with
/// sixteen frames or fields abreast.
pub(crate) const MANY: usize = 128;

#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Batch {
    /// Frames in this batch.
    pub(crate) frames: u32,
    /// Raw values in a frame.
    pub(crate) channels: u32,
    /// Slots that are calibrated from raw values, a whole number of times the channels.
    pub(crate) calibrated: u32,
    /// Slots after those, which are changes.
    pub(crate) changes: u32,
    pub(crate) fields: u32,
    /// Quads of a block, how many of a field a group of invocations takes: two to this power.
    pub(crate) lanes_log2: u32,
}

/// Quads of a block at most: enough to fill lines and a GPU's vectors, few enough for a block of a whole robot's taxels to
/// stay in a core's cache.
#[cfg(feature = "gpu")]
pub(crate) const LANES: u32 = 16;

/// Quads of a block, for a batch of `frames` frames: [`LANES`], or so few as there are.
#[cfg(feature = "gpu")]
pub(crate) fn lanes(frames: usize) -> u32 {
    (frames.div_ceil(4).max(1)).next_power_of_two().min(LANES as usize) as u32
}

/// Quads of a batch of `frames` frames with those that fill up its last block.
#[cfg(feature = "gpu")]
pub(crate) fn padded_quads(frames: usize) -> usize {
    frames.div_ceil(4).max(1).next_multiple_of(lanes(frames) as usize)
}

/// Raw values that a frame of `channels` takes, filled up to whole vectors.
#[cfg(feature = "gpu")]
pub(crate) fn padded_channels(channels: usize) -> usize {
    channels.next_multiple_of(4)
}

/// A taxel as a letter reads it: its calibration, or what holds for its changes.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Taxel {
    pub(crate) baseline: f32,
    pub(crate) gain: f32,
    pub(crate) dead_band: f32,
    pub(crate) p_max: f32,
    pub(crate) raw_low: f32,
    pub(crate) raw_high: f32,
    /// m².
    pub(crate) area: f32,
    /// [`STRAIGHT`], [`MASKED`], or [`FIRST_CURVE`] and up: which of the curves. Of a change: the slot that changes.
    pub(crate) response: u32,
}

impl Taxel {
    /// Whether its pressure is its raw value, with nothing to check but that it is a number.
    pub(crate) fn raw_is_pressure(&self) -> bool {
        let Self { baseline, gain, dead_band, p_max, raw_low, raw_high, area: _, response } = *self;
        let unlimited = p_max >= f32::MAX && raw_low <= f32::MIN && raw_high >= f32::MAX;
        response == STRAIGHT && baseline == 0.0 && gain == 1.0 && dead_band == 0.0 && unlimited
    }
}

/// P = gain · (raw − baseline).
pub(crate) const STRAIGHT: u32 = 0;
/// Never believed.
pub(crate) const MASKED: u32 = 1;
/// The first curve; gain and sign are in the table.
pub(crate) const FIRST_CURVE: u32 = 2;

/// Where a curve's knots stand.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Curve {
    pub(crate) first: u32,
    /// Number of knots, at least two.
    pub(crate) count: u32,
}

/// A knot of a curve.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Knot {
    /// raw − baseline, rising from knot to knot.
    pub(crate) raw: f32,
    pub(crate) p: f32,
    /// To the next knot; 0 at the last.
    pub(crate) slope: f32,
}

/// The time since the frame before.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Step {
    pub(crate) dt_s: f32,
    /// Why it cannot be used, as [`crate::percept::Flags`], or 0.
    pub(crate) flags: u32,
}

/// Up to which distance a field's centroid counts as still, in the field's unit; see [`crate::stage::motion`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Still {
    /// At least that far: 10⁻⁶ of the field's radius.
    pub(crate) least: f32,
    /// What rounding may feign of two centroids, beside `per_taxel`.
    pub(crate) rounding: f32,
    /// What each taxel that is pressed in either frame adds to that.
    pub(crate) per_taxel: f32,
}

/// Where a field's members stand, and what it can answer. A part of a wide field is described alike.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Field {
    /// Its first member in the table that has them.
    pub(crate) first: u32,
    /// Number of members.
    pub(crate) count: u32,
    /// [`CHARTED`], [`AREA_KNOWN`].
    pub(crate) known: u32,
    /// Which of the plan's fields it is.
    pub(crate) index: u32,
}

/// It has a chart.
#[cfg(feature = "gpu")]
pub(crate) const CHARTED: u32 = 1 << 0;
/// Every member's area is known.
#[cfg(feature = "gpu")]
pub(crate) const AREA_KNOWN: u32 = 1 << 1;

/// A part of a wide field.
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(crate) struct Part {
    pub(crate) members: Field,
    /// Among all parts.
    pub(crate) number: u32,
    /// The number of its field's first part.
    pub(crate) first: u32,
    /// How many parts its field has.
    pub(crate) count: u32,
    /// Members of its field before it.
    pub(crate) before: u32,
}

/// A taxel's part in a field.
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
#[repr(C)]
pub struct Member {
    /// Which taxel, and letter, of the frame.
    pub slot: u32,
    pub(crate) weight: f32,
    /// Place in the field's unit; the third coordinate stands apart, as only fields without a chart need it.
    pub(crate) u: f32,
    pub(crate) v: f32,
}
