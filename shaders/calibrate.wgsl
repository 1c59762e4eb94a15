// calibrate: raw values to pressures, one invocation a taxel and frame (src/stage/calibrate.rs).

@group(0) @binding(0) var<uniform> batch: Batch;
@group(0) @binding(1) var<storage, read> taxels: array<Taxel>;
// As recordings have it: a frame's values side by side.
@group(0) @binding(2) var<storage, read> raw: array<u32>;
// As the fields read it: a taxel's frames side by side.
@group(0) @binding(3) var<storage, read_write> pressures: array<f32>;
@group(0) @binding(4) var<storage, read_write> statuses: array<u32>;
@group(0) @binding(5) var<storage, read> curves: array<Curve>;
@group(0) @binding(6) var<storage, read> knots: array<Knot>;

const MISSING = 0xffffffffu;
const SIZE_BITS = 0x7fffffffu;
const HUGE_BITS = 0x5d800000u;
const TINY_BITS = 0x21800000u;

fn is_tiny(size: u32) -> bool {
    return size != 0u && size < TINY_BITS;
}

fn on_curve(curve: Curve, x: f32) -> f32 {
    let first = knots[curve.first];
    let last = knots[curve.first + curve.count - 1u];
    if x <= first.raw {
        return first.p;
    }
    if x >= last.raw {
        return last.p;
    }
    // The knot below x is `low` or one of the `count - 1` after it.
    var low = curve.first;
    var count = curve.count - 1u;
    while count > 1u {
        let half = count / 2u;
        let above = knots[low + half].raw <= x;
        low = select(low, low + half, above);
        count = select(half, count - half, above);
    }
    let before = knots[low];
    let after = knots[low + 1u];
    let p = before.p + (x - before.raw) * before.slope;
    return clamp(p, min(before.p, after.p), max(before.p, after.p));
}

// A raw value before its taxel's response.
struct Reading {
    // raw - baseline.
    above: f32,
    // What is known of it so far; UNUSABLE where there is nothing to respond to.
    status: u32,
}

fn reading(index: u32, taxel: Taxel) -> Reading {
    let slot = index / batch.frames;
    let frame = index % batch.frames;
    let bits = raw[frame * batch.channels + slot % batch.channels];
    let size = bits & SIZE_BITS;
    if bits == MISSING {
        return Reading(0.0, INCOMPLETE | UNUSABLE);
    }
    if size > HUGE_BITS || taxel.response == MASKED {
        // Infinity and NaN have larger bits than any number.
        return Reading(0.0, FAULTY_INPUT | UNUSABLE);
    }
    let value = bitcast<f32>(select(bits, 0u, is_tiny(size)));
    // The range is asked of the value as it came; where it came too small to compute with, its sign decides at 0.
    let low = value < taxel.raw_low || (is_tiny(size) && taxel.raw_low == 0.0 && bits != size);
    let high = value > taxel.raw_high || (is_tiny(size) && taxel.raw_high == 0.0 && bits == size);
    let status = select(0u, OUT_OF_RANGE, low || high) | select(0u, FAULTY_INPUT, is_tiny(size));
    return Reading(value - taxel.baseline, status);
}

// Writes the pressure `p` that a taxel's response makes of `seen`.
fn write(index: u32, taxel: Taxel, seen: Reading, p: f32) {
    var pressure = 0.0;
    var status = seen.status;
    if (status & UNUSABLE) == 0u {
        let size = bitcast<u32>(p) & SIZE_BITS;
        if size > HUGE_BITS {
            status = FAULTY_INPUT | UNUSABLE;
        } else {
            status |= select(0u, FAULTY_INPUT, is_tiny(size));
            if !is_tiny(size) && p > taxel.dead_band {
                pressure = p;
                status |= select(0u, SATURATED, p > taxel.p_max);
            }
        }
    }
    pressures[index] = pressure;
    statuses[index] = status;
}

// Where no taxel has a curve.
@compute @workgroup_size(GROUP)
fn main(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    let index = invocation(group, groups, local);
    if index >= batch.frames * batch.calibrated {
        return;
    }
    let taxel = taxels[index / batch.frames];
    let seen = reading(index, taxel);
    write(index, taxel, seen, seen.above * taxel.gain);
}

// Where some have.
@compute @workgroup_size(GROUP)
fn curved(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    let index = invocation(group, groups, local);
    if index >= batch.frames * batch.calibrated {
        return;
    }
    let taxel = taxels[index / batch.frames];
    let seen = reading(index, taxel);
    if taxel.response >= FIRST_CURVE {
        write(index, taxel, seen, on_curve(curves[taxel.response - FIRST_CURVE], seen.above));
    } else {
        write(index, taxel, seen, seen.above * taxel.gain);
    }
}
