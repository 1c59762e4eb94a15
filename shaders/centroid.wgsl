// centroid: the pressure-weighted mean place (src/stage/centroid.rs).

@group(0) @binding(0) var<uniform> batch: Batch;
@group(0) @binding(1) var<storage, read> fields: array<Field>;
@group(0) @binding(2) var<storage, read> members: array<Member>;
// The members' third coordinate, for fields without a chart.
@group(0) @binding(3) var<storage, read> depths: array<f32>;
@group(0) @binding(4) var<storage, read> pressures: array<f32>;
@group(0) @binding(5) var<storage, read> contacts: array<vec4<f32>>;
@group(0) @binding(6) var<storage, read_write> cells: array<u32>;
@group(0) @binding(7) var<storage, read_write> centroids: array<vec4<f32>>;
@group(0) @binding(8) var<storage, read> wide_fields: array<u32>;

fn add(so_far: vec3<f32>, m: u32, frame: u32, charted: bool) -> vec3<f32> {
    let member = members[m];
    let pull = member.weight * pressures[member.slot * batch.frames + frame];
    if charted {
        return so_far + pull * vec3<f32>(member.u, member.v, 0.0);
    }
    return so_far + pull * vec3<f32>(member.u, member.v, depths[m]);
}

fn join(a: vec3<f32>, b: vec3<f32>) -> vec3<f32> {
    return a + b;
}

fn finish(cell: u32, field: Field, sum: vec3<f32>) {
    if (cells[cell] & NO_CONTACT) != 0u {
        centroids[cell] = vec4<f32>();
        return;
    }
    centroids[cell] = vec4<f32>(sum / contacts[cell].x, 0.0);
    let present = select(POSITION, CENTROID | POSITION | NORMAL, field.charted != 0u);
    cells[cell] |= present << PRESENT;
}

// One invocation a field and frame.
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
    if field.count > WIDE {
        return;
    }
    var sum = vec3<f32>();
    for (var m = field.first; m < field.first + field.count; m++) {
        sum = add(sum, m, cell % batch.frames, field.charted != 0u);
    }
    finish(cell, field, sum);
}

var<workgroup> parts: array<vec3<f32>, GROUP>;

// One group a wide field and frame.
@compute @workgroup_size(GROUP)
fn wide(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    let number = group_number(group, groups);
    if number >= batch.frames * batch.wide {
        return;
    }
    let index = wide_fields[number / batch.frames];
    let cell = index * batch.frames + number % batch.frames;
    let field = fields[index];
    var sum = vec3<f32>();
    for (var m = field.first + local; m < field.first + field.count; m += GROUP) {
        sum = add(sum, m, cell % batch.frames, field.charted != 0u);
    }
    parts[local] = sum;
    for (var half = GROUP / 2u; half > 0u; half /= 2u) {
        workgroupBarrier();
        if local < half {
            parts[local] = join(parts[local], parts[local + half]);
        }
    }
    if local == 0u {
        finish(cell, field, parts[0]);
    }
}
