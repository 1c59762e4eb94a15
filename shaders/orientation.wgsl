// orientation: the line through the two farthest points, one invocation a field and frame (src/stage/orientation.rs).

@group(0) @binding(0) var<uniform> batch: Batch;
@group(0) @binding(1) var<storage, read> fields: array<Field>;
@group(0) @binding(2) var<storage, read> members: array<Member>;
@group(0) @binding(3) var<storage, read> pressures: array<f32>;
@group(0) @binding(4) var<storage, read> contacts: array<vec4<f32>>;
@group(0) @binding(5) var<storage, read> centroids: array<vec4<f32>>;
@group(0) @binding(6) var<storage, read_write> cells: array<u32>;
@group(0) @binding(7) var<storage, read_write> orientations: array<f32>;

const NEAR = 6.103515625e-5f;

@compute @workgroup_size(GROUP)
fn main(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    let cell = invocation(group, groups, local);
    if cell >= batch.frames * batch.fields {
        return;
    }
    let field = fields[cell / batch.frames];
    let frame = cell % batch.frames;
    orientations[cell] = 0.0;
    if (cells[cell] & (NO_CONTACT | NO_CHART)) != 0u {
        return;
    }
    let pressed = bitcast<u32>(contacts[cell].w);
    if pressed == 1u {
        cells[cell] |= ONE_TAXEL;
        return;
    }
    // Scaled by a power of two so that q lies in [0, 2) and its square cannot overflow.
    let scale = bitcast<f32>((254u << 23u) - (bitcast<u32>(contacts[cell].x) & 0x7f800000u));
    let centroid = centroids[cell].xy;
    // The three largest squared distances, and the points of the two largest. Strictly larger, so that the lower id stays.
    var r1 = -1.0;
    var r2 = -1.0;
    var r3 = -1.0;
    var e1 = vec2<f32>();
    var e2 = vec2<f32>();
    for (var m = field.first; m < field.first + field.count; m++) {
        let member = members[m];
        let pressure = pressures[member.slot * batch.frames + frame];
        let q = (member.weight * pressure) * scale;
        let e = (vec2<f32>(member.u, member.v) - centroid) * q;
        let r = select(-1.0, e.x * e.x + e.y * e.y, pressure > 0.0);
        if r > r1 {
            r3 = r2;
            r2 = r1;
            e2 = e1;
            r1 = r;
            e1 = e;
        } else if r > r2 {
            r3 = r2;
            r2 = r;
            e2 = e;
        } else if r > r3 {
            r3 = r;
        }
    }
    let along = e1 - e2;
    let near = NEAR * sqrt(r1);
    if sqrt(along.x * along.x + along.y * along.y) <= near {
        cells[cell] |= COINCIDENT;
        return;
    }
    let tie = pressed > 2u && sqrt(r2) - sqrt(max(r3, 0.0)) <= near;
    orientations[cell] = line_angle(along.x, along.y);
    cells[cell] |= select(0u, TIE, tie) | (ORIENTATION << PRESENT);
}
