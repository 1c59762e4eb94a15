// hysteresis: when a field counts as touched, one invocation a field, through the batch's frames (crates/engine/src/stage/hysteresis.rs).

@group(0) @binding(0) var<uniform> batch: Batch;
@group(0) @binding(1) var<storage, read> thresholds: array<vec2<f32>>;
// As shaders/shared/over_fields.wgsl has them.
@group(0) @binding(2) var<storage, read_write> results: array<u32>;
// 1 where the frame before was in contact.
@group(0) @binding(3) var<storage, read_write> touched: array<u32>;

override TOTAL_AT: u32 = 1u;

// What a field says of its input, and of itself, whether it is touched or not. The last two are a
// change's here: motion comes later.
const KEPT = SATURATED | FAULTY_INPUT | OUT_OF_RANGE | INCOMPLETE | NO_CHART | NO_PREVIOUS | BAD_DT;
const SUMS = TOTAL | PEAK | ACTIVE | AREA;

@compute @workgroup_size(GROUP)
fn main(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    let field = invocation(group, groups, local);
    if field >= batch.fields {
        return;
    }
    let on = thresholds[field].x;
    let off = thresholds[field].y;
    let totals = TOTAL_AT * batch.frames * batch.fields;
    var before = touched[field] != 0u;
    for (var frame = 0u; frame < batch.frames; frame++) {
        let cell = frame * batch.fields + field;
        let total = bitcast<f32>(results[totals + cell]);
        before = total > on || (before && total > off);
        if !before {
            results[cell] = (results[cell] & (KEPT | (SUMS << PRESENT))) | NO_CONTACT;
        }
    }
    touched[field] = select(0u, 1u, before);
}
