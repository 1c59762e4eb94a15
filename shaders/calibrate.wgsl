// calibrate: raw values to pressures, one invocation a taxel and a few quads of frames (src/stage/calibrate.rs).

@group(0) @binding(0) var<uniform> batch: Batch;
@group(0) @binding(1) var<storage, read> taxels: array<Taxel>;
// As recordings have it: a frame's values side by side. Neighbouring invocations read neighbouring values.
@group(0) @binding(2) var<storage, read> raw: array<u32>;
// As the fields read it: a taxel's frames side by side.
@group(0) @binding(3) var<storage, read_write> pressures: array<vec4<f32>>;
@group(0) @binding(4) var<storage, read_write> statuses: array<u32>;
@group(0) @binding(5) var<storage, read> curves: array<Curve>;
@group(0) @binding(6) var<storage, read> knots: array<Knot>;

const MISSING = 0xffffffffu;
const SIZE_BITS = 0x7fffffffu;
const HUGE_BITS = 0x5d800000u;
const TINY_BITS = 0x21800000u;

// Quads that an invocation takes, where a block has as many: what it writes is a whole cache line then.
const TURNS = 4u;

// Slots that a channel is calibrated in: one for each signal.
override SIGNALS: u32 = 1u;

fn is_tiny(size: vec4<u32>) -> vec4<bool> {
    return (size != vec4<u32>()) & (size < vec4<u32>(TINY_BITS));
}

// `status` where `is`.
fn when(is: vec4<bool>, status: u32) -> vec4<u32> {
    return select(vec4<u32>(), vec4<u32>(status), is);
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

// A quad's raw values before their taxel's response.
struct Readings {
    // raw - baseline.
    above: vec4<f32>,
    // What is known of them so far; UNUSABLE where there is nothing to respond to.
    status: vec4<u32>,
}

fn channel_of(slot: u32) -> u32 {
    if SIGNALS == 1u {
        return slot;
    }
    return slot % batch.channels;
}

fn readings(channel: u32, quad: u32, taxel: Taxel) -> Readings {
    let frames = min(vec4<u32>(quad * 4u) + vec4<u32>(0u, 1u, 2u, 3u), vec4<u32>(batch.frames - 1u));
    let places = frames * batch.channels + channel;
    let bits = vec4<u32>(raw[places.x], raw[places.y], raw[places.z], raw[places.w]);
    let size = bits & vec4<u32>(SIZE_BITS);
    let tiny = is_tiny(size);
    let missing = bits == vec4<u32>(MISSING);
    // Infinity and NaN have larger bits than any number.
    let faulty = (size > vec4<u32>(HUGE_BITS)) | vec4<bool>(taxel.response == MASKED);
    let value = bitcast<vec4<f32>>(select(bits, vec4<u32>(), tiny | faulty | missing));
    // The range is asked of the value as it came; where it came too small to compute with, its sign decides at 0.
    let low = (value < vec4<f32>(taxel.raw_low)) | (tiny & (bits != size) & vec4<bool>(taxel.raw_low == 0.0));
    let high = (value > vec4<f32>(taxel.raw_high)) | (tiny & (bits == size) & vec4<bool>(taxel.raw_high == 0.0));
    var status = when(low | high, OUT_OF_RANGE >> STATUS) | when(tiny, FAULTY_INPUT >> STATUS);
    status = select(status, vec4<u32>((FAULTY_INPUT >> STATUS) | UNUSABLE), faulty);
    status = select(status, vec4<u32>((INCOMPLETE >> STATUS) | UNUSABLE), missing);
    return Readings(value - taxel.baseline, status);
}

// Writes the pressures `p` that a taxel's response makes of `seen`.
fn write(slot: u32, quad: u32, taxel: Taxel, seen: Readings, p: vec4<f32>) {
    let size = bitcast<vec4<u32>>(p) & vec4<u32>(SIZE_BITS);
    let tiny = is_tiny(size);
    let usable = (seen.status & vec4<u32>(UNUSABLE)) == vec4<u32>();
    let faulty = size > vec4<u32>(HUGE_BITS);
    let pressed = usable & !faulty & !tiny & (p > vec4<f32>(taxel.dead_band));
    var status = seen.status | when(tiny & usable, FAULTY_INPUT >> STATUS);
    status |= when(pressed & (p > vec4<f32>(taxel.p_max)), SATURATED >> STATUS);
    status = select(status, vec4<u32>((FAULTY_INPUT >> STATUS) | UNUSABLE), faulty & usable);
    pressures[at(slot, quad)] = select(vec4<f32>(), p, pressed);
    statuses[at(slot, quad)] = packed(status);
}

// Where no taxel has a curve.
@compute @workgroup_size(GROUP)
fn main(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    let slot = invocation(group, groups, local);
    if slot >= batch.calibrated {
        return;
    }
    let taxel = taxels[slot];
    let channel = channel_of(slot);
    let turns = min(TURNS, lanes());
    let first = group.y * turns;
    for (var quad = first; quad < first + turns; quad++) {
        let seen = readings(channel, quad, taxel);
        write(slot, quad, taxel, seen, seen.above * taxel.gain);
    }
}

// Where some have.
@compute @workgroup_size(GROUP)
fn curved(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    let slot = invocation(group, groups, local);
    if slot >= batch.calibrated {
        return;
    }
    let taxel = taxels[slot];
    let channel = channel_of(slot);
    let turns = min(TURNS, lanes());
    let first = group.y * turns;
    for (var quad = first; quad < first + turns; quad++) {
        let seen = readings(channel, quad, taxel);
        if taxel.response >= FIRST_CURVE {
            let curve = curves[taxel.response - FIRST_CURVE];
            var p = vec4<f32>();
            for (var i = 0u; i < 4u; i++) {
                p[i] = on_curve(curve, seen.above[i]);
            }
            write(slot, quad, taxel, seen, p);
        } else {
            write(slot, quad, taxel, seen, seen.above * taxel.gain);
        }
    }
}
