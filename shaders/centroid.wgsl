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

// Σ wPx.
alias Part = vec3<f32>;

// Whether the field has a chart.
alias Context = bool;

fn context_of(cell: u32, field: Field) -> Context {
    return field.charted != 0u;
}

fn nothing() -> vec3<f32> {
    return vec3<f32>();
}

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
