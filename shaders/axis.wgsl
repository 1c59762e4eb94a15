// axis: principal axis of the second moments, one invocation a field and frame (src/stage/axis.rs).

@group(0) @binding(0) var<uniform> batch: Batch;
@group(0) @binding(1) var<storage, read> fields: array<Field>;
@group(0) @binding(2) var<storage, read> members: array<Member>;
@group(0) @binding(3) var<storage, read> pressures: array<f32>;
@group(0) @binding(4) var<storage, read> contacts: array<vec4<f32>>;
@group(0) @binding(5) var<storage, read> centroids: array<vec4<f32>>;
@group(0) @binding(6) var<storage, read_write> cells: array<u32>;
// axis, anisotropy
@group(0) @binding(7) var<storage, read_write> axes: array<vec2<f32>>;

const TOGETHER = 9.313225746154785e-10f;
const ISOTROPIC_UNDER = 1e-3f;

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
    axes[cell] = vec2<f32>();
    if (cells[cell] & (NO_CONTACT | NO_CHART)) != 0u {
        return;
    }
    if bitcast<u32>(contacts[cell].w) == 1u {
        cells[cell] |= ONE_TAXEL;
        return;
    }
    let total = contacts[cell].x;
    // Scaled by a power of two so that q lies in [0, 2) and its moments cannot overflow.
    let scale = bitcast<f32>((254u << 23u) - (bitcast<u32>(total) & 0x7f800000u));
    let centroid = centroids[cell].xy;
    var a = 0.0;
    var b = 0.0;
    var d = 0.0;
    for (var m = field.first; m < field.first + field.count; m++) {
        let member = members[m];
        let q = (member.weight * pressures[member.slot * batch.frames + frame]) * scale;
        let x = member.u - centroid.x;
        let y = member.v - centroid.y;
        let qx = q * x;
        a += qx * x;
        b += qx * y;
        d += (q * y) * y;
    }
    let trace = a + d;
    if trace <= TOGETHER * (total * scale) {
        cells[cell] |= COINCIDENT;
        return;
    }
    let x = a - d;
    let y = 2.0 * b;
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
