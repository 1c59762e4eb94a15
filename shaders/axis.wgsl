// axis: principal axis of the second moments (src/stage/axis.rs).

@group(0) @binding(0) var<uniform> batch: Batch;
@group(0) @binding(1) var<storage, read> fields: array<Field>;
@group(0) @binding(2) var<storage, read> members: array<Member>;
@group(0) @binding(3) var<storage, read> pressures: array<f32>;
@group(0) @binding(4) var<storage, read> contacts: array<vec4<f32>>;
@group(0) @binding(5) var<storage, read> centroids: array<vec4<f32>>;
@group(0) @binding(6) var<storage, read_write> cells: array<u32>;
// axis, anisotropy
@group(0) @binding(7) var<storage, read_write> axes: array<vec2<f32>>;
@group(0) @binding(8) var<storage, read> wide_fields: array<u32>;

const TOGETHER = 9.313225746154785e-10f;
const ISOTROPIC_UNDER = 1e-3f;

// a, b and d of the moments (a b; b d).
alias Part = vec3<f32>;

fn nothing() -> vec3<f32> {
    return vec3<f32>();
}

fn add(so_far: vec3<f32>, m: u32, frame: u32, context: Context) -> vec3<f32> {
    let member = members[m];
    let q = (member.weight * pressures[member.slot * batch.frames + frame]) * context.scale;
    let x = member.u - context.centroid.x;
    let y = member.v - context.centroid.y;
    let qx = q * x;
    return so_far + vec3<f32>(qx * x, qx * y, (q * y) * y);
}

fn join(a: vec3<f32>, b: vec3<f32>) -> vec3<f32> {
    return a + b;
}

fn finish(cell: u32, field: Field, moments: vec3<f32>) {
    axes[cell] = vec2<f32>();
    if !is_pressed(cell) {
        return;
    }
    let total = contacts[cell].x;
    let trace = moments.x + moments.z;
    if trace <= TOGETHER * (total * scale_of(total)) {
        cells[cell] |= COINCIDENT;
        return;
    }
    let x = moments.x - moments.z;
    let y = 2.0 * moments.y;
    let h = sqrt(x * x + y * y);
    let anisotropy = min(h / trace, 1.0);
    if anisotropy < ISOTROPIC_UNDER {
        axes[cell] = vec2<f32>(0.0, anisotropy);
        cells[cell] |= ISOTROPIC | (ANISOTROPY << PRESENT);
        return;
    }
    // Half the angle of (x, y), as a line's: of two equal forms the one that adds numbers of one sign.
    let axis = select(line_angle(y, h - x), line_angle(h + x, y), x >= 0.0);
    axes[cell] = vec2<f32>(axis, anisotropy);
    cells[cell] |= (AXIS | ANISOTROPY) << PRESENT;
}
