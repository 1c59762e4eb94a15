// fit: where the descents of contacts to touches end (src/stage/fit). The host makes the starts, and judges the ends
// in double precision.

// The structs of src/stage/layout.rs.
struct FitSensor {
    u: f32,
    v: f32,
    margin: f32,
    pressure: f32,
    variance: f32,
    // 1 if it is pressed, else 0.
    pressed: f32,
}

struct FitStart {
    along_u: f32,
    along_v: f32,
    // Logarithms of spreads.
    point_width: f32,
    line_width: f32,
    blob_width: f32,
    blob_length: f32,
    // The logarithm of half a segment's length.
    half_length: f32,
    gain_variance: f32,
    // Sensors; none of a touch that fills up a group.
    count: u32,
    steps: u32,
    // 1 where there are taxels enough for segments and blobs.
    is_long: u32,
}

struct FitShape {
    u: f32,
    v: f32,
    along_u: f32,
    along_v: f32,
    force: f32,
    width: f32,
    length: f32,
}

// A group's sensors lie row by row: the first of each of its touches, then the second of each, and so on.
@group(0) @binding(0) var<storage, read> sensors: array<FitSensor>;
@group(0) @binding(1) var<storage, read> starts: array<FitStart>;
// By group its first row.
@group(0) @binding(2) var<storage, read> rows: array<u32>;
// By touch that of each kind.
@group(0) @binding(3) var<storage, read_write> ends: array<FitShape>;

// Touches of a group.
const GROUP = 64u;

const POINT = 0u;
const LINE = 1u;
const SEGMENT = 2u;
const BLOB = 3u;
const KINDS = 4u;

// Its numbers come from src/stage/fit, and are put before this text (src/backend/gpu/shaders.rs). Only single precision has its own
// of these.
const LEAST_FORCE = 1e-30;

// e to the power of x, within ±87.
fn exponential(x: f32) -> f32 {
    let whole = round(x * LOG2_E);
    // ln 2 in two parts, of which the first times a whole number is exact.
    let rest = (x - whole * 0.693359375) + whole * 2.1219444e-4;
    var sum = 1.0 / 5040.0;
    sum = sum * rest + 1.0 / 720.0;
    sum = sum * rest + 1.0 / 120.0;
    sum = sum * rest + 1.0 / 24.0;
    sum = sum * rest + 1.0 / 6.0;
    sum = sum * rest + 0.5;
    sum = sum * rest + 1.0;
    sum = sum * rest + 1.0;
    return ldexp(sum, i32(whole));
}

// Φ and φ of z, by Hart's quotient of polynomials. Beyond 12 nothing is left.
fn normal(z: f32) -> vec2<f32> {
    let size = min(abs(z), 12.0);
    let density = exponential(-0.5 * size * size) * PER_SQRT_TAU;
    var above = ABOVE_0;
    above = above * size + ABOVE_1;
    above = above * size + ABOVE_2;
    above = above * size + ABOVE_3;
    above = above * size + ABOVE_4;
    above = above * size + ABOVE_5;
    above = above * size + ABOVE_6;
    var below = BELOW_0;
    below = below * size + BELOW_1;
    below = below * size + BELOW_2;
    below = below * size + BELOW_3;
    below = below * size + BELOW_4;
    below = below * size + BELOW_5;
    below = below * size + BELOW_6;
    below = below * size + BELOW_7;
    let tail = density * above / below * SQRT_TAU;
    return vec2<f32>(select(1.0 - tail, tail, z < 0.0), density);
}

// How much of a contact falls on a taxel along one direction, and how that changes with its place, with the logarithm of its spread, and
// with that of half its length.
struct Mass {
    value: f32,
    by_place: f32,
    by_spread: f32,
    by_half: f32,
}

// Both are seen from the side on which the taxel lies in the lower tail, where differences keep their digits.
fn mass_of_point(place: f32, margin: f32, spread: f32) -> Mass {
    let side = select(1.0, -1.0, place > 0.0);
    let far = (side * place + margin) / spread;
    let near = (side * place - margin) / spread;
    let at_far = normal(far);
    let at_near = normal(near);
    let by_place = side * (at_far.y - at_near.y) / spread;
    return Mass(at_far.x - at_near.x, by_place, near * at_near.y - far * at_far.y, 0.0);
}

// Φ, φ and Φ's integral.
fn integrated(z: f32) -> vec3<f32> {
    let at = normal(z);
    return vec3<f32>(at, z * at.x + at.y);
}

fn mass_of_line(place: f32, margin: f32, half: f32, spread: f32) -> Mass {
    let side = select(1.0, -1.0, place > 0.0);
    let lower = side * place;
    let a = integrated((lower + half + margin) / spread);
    let b = integrated((lower + half - margin) / spread);
    let c = integrated((lower - half + margin) / spread);
    let d = integrated((lower - half - margin) / spread);
    let share = 0.5 / half;
    let ends = (a - b) - (c - d);
    let value = share * spread * ends.z;
    return Mass(value, side * share * ends.x, share * spread * ends.y, 0.5 * ((a.x - b.x) + (c.x - d.x)) - value);
}

// A shape with its logarithms taken back.
struct Contact {
    force: f32,
    width: f32,
    length: f32,
}

fn contact_of(shape: FitShape) -> Contact {
    return Contact(exponential(shape.force), exponential(shape.width), exponential(shape.length));
}

// What a taxel feels, and how that changes with across, along and turn, and with force, width and length: 0 for what the kind does not
// have.
struct Felt {
    value: f32,
    by_pose: vec3<f32>,
    by_size: vec3<f32>,
}

fn felt(kind: u32, shape: FitShape, contact: Contact, sensor: FitSensor) -> Felt {
    let beside = vec2<f32>(sensor.u - shape.u, sensor.v - shape.v);
    let x = beside.y * shape.along_u - beside.x * shape.along_v;
    let y = beside.x * shape.along_u + beside.y * shape.along_v;
    let across = mass_of_point(x, sensor.margin, contact.width);
    // Of a line the same wherever along it.
    var along = Mass(2.0 * sensor.margin, 0.0, 0.0, 0.0);
    var by_length = 0.0;
    if kind == SEGMENT {
        along = mass_of_line(y, sensor.margin, contact.length, contact.width);
        by_length = along.by_half;
    } else if kind != LINE {
        along = mass_of_point(y, sensor.margin, select(contact.width, contact.length, kind == BLOB));
    }
    if kind == BLOB {
        by_length = along.by_spread;
        along.by_spread = 0.0;
    }
    let value = contact.force * across.value * along.value;
    let by_x = contact.force * across.by_place * along.value;
    let by_y = contact.force * across.value * along.by_place;
    let by_turn = select(by_y * x - by_x * y, 0.0, kind == POINT);
    let by_width = contact.force * (across.by_spread * along.value + across.value * along.by_spread);
    return Felt(value, vec3<f32>(-by_x, -by_y, by_turn), vec3<f32>(value, by_width, contact.force * across.value * by_length));
}

// Where a touch's sensors lie.
struct Touch {
    first: u32,
    count: u32,
    gain_variance: f32,
}

fn sensor_of(touch: Touch, index: u32) -> FitSensor {
    return sensors[touch.first + index * GROUP];
}

// χ² and the prior, with A = JᵀJ in blocks, and g = Jᵀr.
struct Objective {
    cost: f32,
    pose: mat3x3<f32>,
    // Column by column: each of pose with all of size.
    both: mat3x3<f32>,
    size: mat3x3<f32>,
    g_pose: vec3<f32>,
    g_size: vec3<f32>,
}

fn objective(kind: u32, touch: Touch, shape: FitShape) -> Objective {
    let contact = contact_of(shape);
    var sum: Objective;
    for (var index = 0u; index < touch.count; index += 1u) {
        let sensor = sensor_of(touch, index);
        let felt = felt(kind, shape, contact, sensor);
        let off = felt.value - sensor.pressure;
        // One that is not pressed says only that it feels no more than its threshold.
        let counts = select(0.0, 1.0, sensor.pressed > 0.0 || off > 0.0);
        let per = 1.0 / sqrt(sensor.variance + touch.gain_variance * felt.value * felt.value);
        let r = counts * off * per;
        let slope = counts * per * (1.0 - r * touch.gain_variance * felt.value * per);
        let pose = felt.by_pose * slope;
        let size = felt.by_size * slope;
        sum.cost += r * r;
        sum.pose += mat3x3<f32>(pose * pose.x, pose * pose.y, pose * pose.z);
        sum.both += mat3x3<f32>(size * pose.x, size * pose.y, size * pose.z);
        sum.size += mat3x3<f32>(size * size.x, size * size.y, size * size.z);
        sum.g_pose += pose * r;
        sum.g_size += size * r;
    }
    let r = (shape.width - LN_USUAL_WIDTH) * PER_WIDTH_VARIES;
    sum.cost += r * r;
    sum.g_size.y += r * PER_WIDTH_VARIES;
    sum.size[1].y += PER_WIDTH_VARIES * PER_WIDTH_VARIES;
    return sum;
}

// −(A + damping · diag A)⁻¹ g, by Cholesky's factor.
fn step_of(now: Objective, damping: f32) -> array<f32, 6> {
    var l: array<array<f32, 6>, 6>;
    var x: array<f32, 6>;
    for (var i = 0u; i < 3u; i += 1u) {
        for (var j = 0u; j < 3u; j += 1u) {
            l[i][j] = now.pose[j][i];
            l[i + 3u][j] = now.both[j][i];
            l[i + 3u][j + 3u] = now.size[j][i];
        }
        x[i] = -now.g_pose[i];
        x[i + 3u] = -now.g_size[i];
    }
    for (var i = 0u; i < 6u; i += 1u) {
        for (var j = 0u; j < i; j += 1u) {
            var rest = l[i][j];
            for (var k = 0u; k < j; k += 1u) {
                rest -= l[i][k] * l[j][k];
            }
            l[i][j] = rest * l[j][j];
            x[i] -= l[i][j] * x[j];
        }
        var rest = l[i][i] * (damping + 1.0);
        for (var k = 0u; k < i; k += 1u) {
            rest -= l[i][k] * l[i][k];
        }
        l[i][i] = 1.0 / sqrt(max(rest, LEAST));
        x[i] *= l[i][i];
    }
    for (var back = 0u; back < 6u; back += 1u) {
        let i = 5u - back;
        for (var k = i + 1u; k < 6u; k += 1u) {
            x[i] -= l[k][i] * x[k];
        }
        x[i] *= l[i][i];
    }
    return x;
}

fn moved(shape: FitShape, step: array<f32, 6>) -> FitShape {
    var steps = step;
    for (var k = 0u; k < 6u; k += 1u) {
        steps[k] = clamp(steps[k], -LONGEST, LONGEST);
    }
    let along = vec2<f32>(shape.along_u, shape.along_v);
    let across = vec2<f32>(-along.y, along.x);
    let place = vec2<f32>(shape.u, shape.v) + across * steps[0] + along * steps[1];
    let turned = normalize(along + across * steps[2]);
    let width = clamp(shape.width + steps[4], -WIDEST, WIDEST);
    let length = clamp(shape.length + steps[5], -WIDEST, WIDEST);
    return FitShape(place.x, place.y, turned.x, turned.y, shape.force + steps[3], width, length);
}

fn descend(kind: u32, touch: Touch, start: FitShape, steps: u32) -> FitShape {
    var shape = start;
    var now = objective(kind, touch, shape);
    var damping = DAMPING;
    for (var step = 0u; step < steps; step += 1u) {
        let tried = moved(shape, step_of(now, damping));
        let then = objective(kind, touch, tried);
        if then.cost < now.cost {
            shape = tried;
            now = then;
            damping /= DAMPING_CHANGES;
        } else {
            damping *= DAMPING_CHANGES;
        }
    }
    return shape;
}

// A shape of a force of 1, with the force that explains the pressed sensors best.
fn with_force(kind: u32, touch: Touch, along: vec2<f32>, width: f32, length: f32) -> FitShape {
    var shape = FitShape(0.0, 0.0, along.x, along.y, 0.0, width, length);
    let contact = contact_of(shape);
    var both = 0.0;
    var own = LEAST_FORCE;
    for (var index = 0u; index < touch.count; index += 1u) {
        let sensor = sensor_of(touch, index);
        if sensor.pressed > 0.0 {
            let value = felt(kind, shape, contact, sensor).value;
            both += value * sensor.pressure;
            own += value * value;
        }
    }
    shape.force = log(max(both / own, LEAST_FORCE));
    return shape;
}

// One invocation a touch, in each of three rows of groups: points; lines and the segments that start from them; blobs.
@compute @workgroup_size(GROUP)
fn main(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let number = group.x * GROUP + local;
    let start = starts[number];
    let touch = Touch(rows[group.x] * GROUP + local, start.count, start.gain_variance);
    let axis = vec2<f32>(start.along_u, start.along_v);
    let end = number * KINDS;
    if start.count == 0u {
        return;
    }
    if group.y == 0u {
        let point = with_force(POINT, touch, vec2<f32>(1.0, 0.0), start.point_width, 0.0);
        ends[end + POINT] = descend(POINT, touch, point, start.steps);
    } else if group.y == 1u {
        var line = with_force(LINE, touch, axis, start.line_width, 0.0);
        line = descend(LINE, touch, line, start.steps);
        ends[end + LINE] = line;
        if start.is_long == 1u {
            // As much force as the line has on the segment's length.
            line.force += start.half_length + LN_2;
            line.length = start.half_length;
            ends[end + SEGMENT] = descend(SEGMENT, touch, line, start.steps);
        }
    } else if start.is_long == 1u {
        let blob = with_force(BLOB, touch, axis, start.blob_width, start.blob_length);
        ends[end + BLOB] = descend(BLOB, touch, blob, start.steps);
    }
}
