// The structs of crates/engine/src/stage/layout.rs, and the bits of crates/engine/src/percept.rs and crates/engine/src/stage/calibrate.rs.

struct Batch {
    frames: u32,
    channels: u32,
    calibrated: u32,
    changes: u32,
    fields: u32,
    // Quads of a block: two to this power, up to 16. Divisions are dear where vectors have none.
    lanes_log2: u32,
}

struct Taxel {
    baseline: f32,
    gain: f32,
    dead_band: f32,
    p_max: f32,
    raw_low: f32,
    raw_high: f32,
    area: f32,
    // STRAIGHT, MASKED, or FIRST_CURVE and up; of a change, the slot that changes.
    response: u32,
}

struct Curve {
    first: u32,
    count: u32,
}

struct Knot {
    raw: f32,
    p: f32,
    slope: f32,
}

// A field whose members lie in one table; a wide one's part is described alike.
struct Field {
    first: u32,
    count: u32,
    // CHARTED, AREA_KNOWN.
    known: u32,
    // Where its results go.
    index: u32,
}

// A part of a wide field.
struct Part {
    members: Field,
    // Its own number among all parts, that of its field's first, and how many that has.
    number: u32,
    first: u32,
    count: u32,
    // Members of its field before it.
    before: u32,
}

struct Member {
    slot: u32,
    weight: f32,
    u: f32,
    v: f32,
}

// The time since the frame before, and why it cannot be used (flags), or 0.
struct Step {
    dt_s: f32,
    flags: u32,
}

// Up to which distance a field's centroid counts as still, in its unit: at least so far, or what rounding of two frames'
// centroids may feign, which grows with each pressed taxel.
struct Still {
    least: f32,
    rounding: f32,
    per_taxel: f32,
}

const NO_CONTACT = 1u << 0u;
const ONE_TAXEL = 1u << 1u;
const TIE = 1u << 2u;
const COINCIDENT = 1u << 3u;
const ISOTROPIC = 1u << 4u;
const STILL = 1u << 5u;
const SATURATED = 1u << 6u;
const FAULTY_INPUT = 1u << 7u;
const OUT_OF_RANGE = 1u << 8u;
const INCOMPLETE = 1u << 9u;
const NO_CHART = 1u << 10u;
const NO_PREVIOUS = 1u << 11u;
const BAD_DT = 1u << 12u;
const FLAGS = 0x7fffu;

// A cell's status holds its flags below and, from this bit on, which outputs are present, whose bits are put before this
// file (TOTAL, PEAK and so on).
const PRESENT = 16u;

const CHARTED = 1u << 0u;
const AREA_KNOWN = 1u << 1u;

const STRAIGHT = 0u;
const MASKED = 1u;
const FIRST_CURVE = 2u;

// A taxel's status is a byte: from this bit on the flags that it can have, and above them UNUSABLE, which leaves it out of
// every sum.
const STATUS = 6u;
const UNUSABLE = 0x80u;

// Raw values as bits: one that is not there; what a sign leaves; the largest that is believed, and the smallest but for 0
// that is computed with.
const MISSING = 0xffffffffu;
const SIZE_BITS = 0x7fffffffu;
const HUGE_BITS = 0x5d800000u;
const TINY_BITS = 0x21800000u;

// Invocations of a group.
const GROUP = 64u;

// A dispatch counts groups along x, folded over z, as no side may be longer than 65,535; y counts blocks of frames where
// an invocation has but one.
fn group_number(group: vec3<u32>, groups: vec3<u32>) -> u32 {
    return group.z * groups.x + group.x;
}

fn invocation(group: vec3<u32>, groups: vec3<u32>, local: u32) -> u32 {
    return group_number(group, groups) * GROUP + local;
}

// Frames are taken four at a time, as a quad: a vector of their pressures, and one word of their statuses, the first in
// the lowest byte. On the device quads lie in blocks of `lanes`, in each block slot by slot: an invocation's neighbours
// read its neighbours, and what a group reads lies together. A quad that is not full repeats the last frame.
fn quads() -> u32 {
    return (batch.frames + 3u) / 4u;
}

fn lanes() -> u32 {
    return 1u << batch.lanes_log2;
}

fn at(slot: u32, quad: u32) -> u32 {
    let slots = batch.calibrated + batch.changes;
    return ((((quad >> batch.lanes_log2) * slots) + slot) << batch.lanes_log2) + (quad & (lanes() - 1u));
}
