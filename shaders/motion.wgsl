// motion: how the centroid moved since the frame before (src/stage/motion.rs).

@group(0) @binding(0) var<uniform> batch: Batch;
@group(0) @binding(1) var<storage, read> steps: array<Step>;
// Per field the distance within which its centroid counts as still.
@group(0) @binding(2) var<storage, read> still: array<f32>;
@group(0) @binding(3) var<storage, read> centroids: array<vec4<f32>>;
@group(0) @binding(4) var<storage, read> cells: array<u32>;
// Per field the centroid of the last batch's last frame, and 1 where that was in contact.
@group(0) @binding(5) var<storage, read_write> last: array<vec4<f32>>;
@group(0) @binding(6) var<storage, read_write> motions: array<Motion>;

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
    let field = cell / batch.frames;
    let frame = cell % batch.frames;
    motions[cell] = Motion();
    if (cells[cell] & (NO_CONTACT | NO_CHART)) != 0u {
        return;
    }
    var before = last[field].xy;
    var touched = last[field].w == 1.0;
    if frame > 0u {
        before = centroids[cell - 1u].xy;
        touched = (cells[cell - 1u] & NO_CONTACT) == 0u;
    }
    let step = steps[frame];
    if !touched || step.flags != 0u {
        motions[cell].status = select(NO_PREVIOUS, step.flags, touched);
        return;
    }
    let now = centroids[cell].xy;
    let moved = now - before;
    let distance = sqrt(moved.x * moved.x + moved.y * moved.y);
    let radial = sqrt(now.x * now.x + now.y * now.y) - sqrt(before.x * before.x + before.y * before.y);
    let is_still = distance <= still[field];
    var direction = 0.0;
    if !is_still {
        direction = full_angle(moved.x, moved.y);
    }
    let status = select(DIRECTION << PRESENT, STILL, is_still) | (DISPLACEMENT << PRESENT);
    motions[cell] = Motion(moved, direction, distance, radial, distance / step.dt_s, radial / step.dt_s, status);
}

// One invocation a field, after all frames: what the next batch starts from.
@compute @workgroup_size(GROUP)
fn keep(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    let field = invocation(group, groups, local);
    if field >= batch.fields {
        return;
    }
    let cell = (field + 1u) * batch.frames - 1u;
    let touched = (cells[cell] & (NO_CONTACT | NO_CHART)) == 0u;
    last[field] = vec4<f32>(centroids[cell].xy, 0.0, select(0.0, 1.0, touched));
}
