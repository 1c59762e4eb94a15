// centroid: the pressure-weighted mean place, one invocation a field and frame (src/stage/centroid.rs).

@group(0) @binding(0) var<uniform> batch: Batch;
@group(0) @binding(1) var<storage, read> fields: array<Field>;
@group(0) @binding(2) var<storage, read> members: array<Member>;
// The members' third coordinate, for fields without a chart.
@group(0) @binding(3) var<storage, read> depths: array<f32>;
@group(0) @binding(4) var<storage, read> pressures: array<f32>;
@group(0) @binding(5) var<storage, read> contacts: array<vec4<f32>>;
@group(0) @binding(6) var<storage, read_write> cells: array<u32>;
@group(0) @binding(7) var<storage, read_write> centroids: array<vec4<f32>>;

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
    if (cells[cell] & NO_CONTACT) != 0u {
        centroids[cell] = vec4<f32>();
        return;
    }
    var sum = vec2<f32>();
    var depth = 0.0;
    if field.charted != 0u {
        for (var m = field.first; m < field.first + field.count; m++) {
            let member = members[m];
            let pull = member.weight * pressures[member.slot * batch.frames + frame];
            sum += pull * vec2<f32>(member.u, member.v);
        }
    } else {
        for (var m = field.first; m < field.first + field.count; m++) {
            let member = members[m];
            let pull = member.weight * pressures[member.slot * batch.frames + frame];
            sum += pull * vec2<f32>(member.u, member.v);
            depth += pull * depths[m];
        }
    }
    let total = contacts[cell].x;
    centroids[cell] = vec4<f32>(sum / total, depth / total, 0.0);
    let present = select(POSITION, CENTROID | POSITION | NORMAL, field.charted != 0u);
    cells[cell] |= present << PRESENT;
}
