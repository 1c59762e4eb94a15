// calibrate: raw values to pressures, one invocation four taxels and a few quads of frames (crates/engine/src/stage/calibrate.rs).

@group(0) @binding(0) var<uniform> batch: Batch;
@group(0) @binding(1) var<storage, read> taxels: array<Taxel>;
// As recordings have it: a frame's values side by side, filled up to whole vectors. Neighbouring invocations read
// neighbouring vectors.
@group(0) @binding(2) var<storage, read> raw: array<vec4<u32>>;
// As the fields read it: a taxel's frames side by side.
@group(0) @binding(3) var<storage, read_write> pressures: array<vec4<u32>>;
@group(0) @binding(4) var<storage, read_write> statuses: array<u32>;
@group(0) @binding(5) var<storage, read> curves: array<Curve>;
@group(0) @binding(6) var<storage, read> knots: array<Knot>;

// Quads that an invocation takes, where a block has as many: what it writes is a whole cache line then.
const TURNS = 4u;

// Slots that a channel is calibrated in: one for each signal.
override SIGNALS: u32 = 1u;
// Whether every taxel's pressure is its raw value, with nothing to check but that it is a number.
override PLAIN: bool = false;

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

fn readings(bits: vec4<u32>, taxel: Taxel) -> Readings {
    let size = bits & vec4<u32>(SIZE_BITS);
    let tiny = is_tiny(size);
    let missing = bits == vec4<u32>(MISSING);
    // Infinity and NaN have larger bits than any number.
    var faulty = size > vec4<u32>(HUGE_BITS);
    if !PLAIN {
        faulty |= vec4<bool>(taxel.response == MASKED);
    }
    let value = bitcast<vec4<f32>>(select(bits, vec4<u32>(), tiny | faulty | missing));
    var above = value;
    var status = when(tiny, FAULTY_INPUT >> STATUS);
    if !PLAIN {
        above -= vec4<f32>(taxel.baseline);
        // The range is asked of the value as it came; where it came too small to compute with, its sign decides at 0.
        let low = (value < vec4<f32>(taxel.raw_low)) | (tiny & (bits != size) & vec4<bool>(taxel.raw_low == 0.0));
        let high = (value > vec4<f32>(taxel.raw_high)) | (tiny & (bits == size) & vec4<bool>(taxel.raw_high == 0.0));
        status |= when(low | high, OUT_OF_RANGE >> STATUS);
    }
    status = select(status, vec4<u32>((FAULTY_INPUT >> STATUS) | UNUSABLE), faulty);
    status = select(status, vec4<u32>((INCOMPLETE >> STATUS) | UNUSABLE), missing);
    return Readings(above, status);
}

fn straight(taxel: Taxel, above: vec4<f32>) -> vec4<f32> {
    if PLAIN {
        return above;
    }
    return above * taxel.gain;
}

// Writes the pressures `p` that a taxel's response makes of `seen`.
fn write(slot: u32, quad: u32, taxel: Taxel, seen: Readings, p: vec4<f32>) {
    var pressed = p > vec4<f32>();
    var status = seen.status;
    if !PLAIN {
        let size = bitcast<vec4<u32>>(p) & vec4<u32>(SIZE_BITS);
        let tiny = is_tiny(size);
        let usable = (seen.status & vec4<u32>(UNUSABLE)) == vec4<u32>();
        let faulty = size > vec4<u32>(HUGE_BITS);
        pressed = usable & !faulty & !tiny & (p > vec4<f32>(taxel.dead_band));
        status |= when(tiny & usable, FAULTY_INPUT >> STATUS);
        status |= when(pressed & (p > vec4<f32>(taxel.p_max)), SATURATED >> STATUS);
        status = select(status, vec4<u32>((FAULTY_INPUT >> STATUS) | UNUSABLE), faulty & usable);
    }
    let here = at(slot, quad);
    pressures[here] = marked(select(vec4<f32>(), p, pressed), status);
    if any(status != vec4<u32>()) {
        statuses[here] = packed(status);
    }
}

// Four taxels side by side.
struct Taxels {
    vector: u32,
    slot: u32,
    count: u32,
    x: Taxel,
    y: Taxel,
    z: Taxel,
    w: Taxel,
}

fn vectors() -> u32 {
    return (batch.channels + 3u) / 4u;
}

fn taxels_of(index: u32) -> Taxels {
    var four: Taxels;
    four.vector = index;
    four.slot = index * 4u;
    if SIGNALS > 1u {
        let signal = index / vectors();
        four.vector = index - signal * vectors();
        four.slot = signal * batch.channels + four.vector * 4u;
    }
    four.count = min(4u, batch.channels - four.vector * 4u);
    if !PLAIN {
        let last = four.slot + four.count - 1u;
        four.x = taxels[four.slot];
        four.y = taxels[min(four.slot + 1u, last)];
        four.z = taxels[min(four.slot + 2u, last)];
        four.w = taxels[last];
    }
    return four;
}

// Their raw values in the four frames of a quad.
fn values_of(four: Taxels, quad: u32) -> array<vec4<u32>, 4> {
    let frames = min(vec4<u32>(quad * 4u) + vec4<u32>(0u, 1u, 2u, 3u), vec4<u32>(batch.frames - 1u));
    let places = frames * vectors() + four.vector;
    let a = raw[places.x];
    let b = raw[places.y];
    let c = raw[places.z];
    let d = raw[places.w];
    return array<vec4<u32>, 4>(
        vec4<u32>(a.x, b.x, c.x, d.x),
        vec4<u32>(a.y, b.y, c.y, d.y),
        vec4<u32>(a.z, b.z, c.z, d.z),
        vec4<u32>(a.w, b.w, c.w, d.w),
    );
}

fn write_straight(slot: u32, quad: u32, taxel: Taxel, bits: vec4<u32>) {
    let seen = readings(bits, taxel);
    write(slot, quad, taxel, seen, straight(taxel, seen.above));
}

// Where no taxel has a curve.
@compute @workgroup_size(GROUP)
fn main(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    let index = invocation(group, groups, local);
    if index >= vectors() * SIGNALS {
        return;
    }
    let four = taxels_of(index);
    let turns = min(TURNS, lanes());
    let first = group.y * turns;
    for (var quad = first; quad < first + turns; quad++) {
        let values = values_of(four, quad);
        write_straight(four.slot, quad, four.x, values[0]);
        if four.count > 1u {
            write_straight(four.slot + 1u, quad, four.y, values[1]);
        }
        if four.count > 2u {
            write_straight(four.slot + 2u, quad, four.z, values[2]);
        }
        if four.count > 3u {
            write_straight(four.slot + 3u, quad, four.w, values[3]);
        }
    }
}

fn write_curved(slot: u32, quad: u32, taxel: Taxel, bits: vec4<u32>) {
    let seen = readings(bits, taxel);
    if taxel.response >= FIRST_CURVE {
        let curve = curves[taxel.response - FIRST_CURVE];
        var p = vec4<f32>();
        for (var i = 0u; i < 4u; i++) {
            p[i] = on_curve(curve, seen.above[i]);
        }
        write(slot, quad, taxel, seen, p);
    } else {
        write(slot, quad, taxel, seen, straight(taxel, seen.above));
    }
}

// Where some have.
@compute @workgroup_size(GROUP)
fn curved(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    let index = invocation(group, groups, local);
    if index >= vectors() * SIGNALS {
        return;
    }
    let four = taxels_of(index);
    let turns = min(TURNS, lanes());
    let first = group.y * turns;
    for (var quad = first; quad < first + turns; quad++) {
        let values = values_of(four, quad);
        write_curved(four.slot, quad, four.x, values[0]);
        if four.count > 1u {
            write_curved(four.slot + 1u, quad, four.y, values[1]);
        }
        if four.count > 2u {
            write_curved(four.slot + 2u, quad, four.z, values[2]);
        }
        if four.count > 3u {
            write_curved(four.slot + 3u, quad, four.w, values[3]);
        }
    }
}
