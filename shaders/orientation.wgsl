// orientation: the line through the two farthest points (src/stage/orientation.rs).

@group(0) @binding(0) var<uniform> batch: Batch;
@group(0) @binding(1) var<storage, read> fields: array<Field>;
@group(0) @binding(2) var<storage, read> members: array<Member>;
@group(0) @binding(3) var<storage, read> pressures: array<f32>;
@group(0) @binding(4) var<storage, read> contacts: array<vec4<f32>>;
@group(0) @binding(5) var<storage, read> centroids: array<vec4<f32>>;
@group(0) @binding(6) var<storage, read_write> cells: array<u32>;
@group(0) @binding(7) var<storage, read_write> orientations: array<f32>;
@group(0) @binding(8) var<storage, read> wide_fields: array<u32>;

const NEAR = 6.103515625e-5f;
const NOBODY = 0xffffffffu;

// The three largest squared distances, and the points and members of the two largest. Of equals the lower member is the
// larger.
struct Farthest {
    r1: f32,
    r2: f32,
    r3: f32,
    m1: u32,
    m2: u32,
    e1: vec2<f32>,
    e2: vec2<f32>,
}

alias Part = Farthest;

fn nothing() -> Farthest {
    return Farthest(-1.0, -1.0, -1.0, NOBODY, NOBODY, vec2<f32>(), vec2<f32>());
}

fn put(so_far: Farthest, r: f32, m: u32, e: vec2<f32>) -> Farthest {
    var far = so_far;
    if r > far.r1 || (r == far.r1 && m < far.m1) {
        far.r3 = far.r2;
        far.r2 = far.r1;
        far.m2 = far.m1;
        far.e2 = far.e1;
        far.r1 = r;
        far.m1 = m;
        far.e1 = e;
    } else if r > far.r2 || (r == far.r2 && m < far.m2) {
        far.r3 = far.r2;
        far.r2 = r;
        far.m2 = m;
        far.e2 = e;
    } else {
        far.r3 = max(far.r3, r);
    }
    return far;
}

fn add(so_far: Farthest, m: u32, frame: u32, context: Context) -> Farthest {
    let member = members[m];
    let pressure = pressures[member.slot * batch.frames + frame];
    if pressure <= 0.0 {
        return so_far;
    }
    let q = (member.weight * pressure) * context.scale;
    let e = (vec2<f32>(member.u, member.v) - context.centroid) * q;
    return put(so_far, e.x * e.x + e.y * e.y, m, e);
}

fn join(a: Farthest, b: Farthest) -> Farthest {
    var far = put(put(a, b.r1, b.m1, b.e1), b.r2, b.m2, b.e2);
    far.r3 = max(far.r3, b.r3);
    return far;
}

fn finish(cell: u32, field: Field, far: Farthest) {
    orientations[cell] = 0.0;
    if !is_pressed(cell) {
        return;
    }
    let along = far.e1 - far.e2;
    let near = NEAR * sqrt(far.r1);
    if sqrt(along.x * along.x + along.y * along.y) <= near {
        cells[cell] |= COINCIDENT;
        return;
    }
    let tie = far.r3 >= 0.0 && sqrt(far.r2) - sqrt(max(far.r3, 0.0)) <= near;
    orientations[cell] = line_angle(along.x, along.y);
    cells[cell] |= select(0u, TIE, tie) | (ORIENTATION << PRESENT);
}
