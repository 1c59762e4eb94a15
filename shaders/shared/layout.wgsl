// The structs of src/stage/layout.rs, and the bits of src/percept.rs and src/stage/calibrate.rs.

struct Batch {
    frames: u32,
    channels: u32,
    calibrated: u32,
    changes: u32,
    fields: u32,
    wide: u32,
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

struct Field {
    first: u32,
    count: u32,
    charted: u32,
    area_known: u32,
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

struct Motion {
    displacement: vec2<f32>,
    direction: f32,
    distance: f32,
    radial_distance: f32,
    speed: f32,
    radial_speed: f32,
    // Flags below and quantities present above, for the host to add to the cell's: its neighbours read that meanwhile.
    status: u32,
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

// A cell's status holds its flags below and, from this bit on, which quantities are present.
const PRESENT = 16u;
const TOTAL = 1u << 0u;
const PEAK = 1u << 1u;
const ACTIVE = 1u << 2u;
const AREA = 1u << 3u;
const CENTROID = 1u << 4u;
const POSITION = 1u << 5u;
const NORMAL = 1u << 6u;
const ORIENTATION = 1u << 7u;
const AXIS = 1u << 8u;
const ANISOTROPY = 1u << 9u;
const DISPLACEMENT = 1u << 10u;
const DIRECTION = 1u << 11u;

const STRAIGHT = 0u;
const MASKED = 1u;
const FIRST_CURVE = 2u;

// Bit of a taxel's status that leaves it out of every sum.
const UNUSABLE = 1u << 31u;

// Invocations of a group.
const GROUP = 64u;

// A field of more members than this is taken by a whole group, each invocation a part of it. Besides being faster, it
// must be so: lavapipe ends any shader's loops after 65,535 rounds in all, without a word.
const WIDE = 4096u;

// A dispatch is folded into rows, as one row may not be longer than 65,535 groups.
fn group_number(group: vec3<u32>, groups: vec3<u32>) -> u32 {
    return group.y * groups.x + group.x;
}

fn invocation(group: vec3<u32>, groups: vec3<u32>, local: u32) -> u32 {
    return group_number(group, groups) * GROUP + local;
}
