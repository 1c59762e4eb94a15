// motion: how the centroid moved since the frame before (src/stage/motion.rs).

@group(0) @binding(0) var<uniform> batch: Batch;
@group(0) @binding(1) var<storage, read> steps: array<Step>;
// Per field the distance within which its centroid counts as still.
@group(0) @binding(2) var<storage, read> still: array<f32>;
// As shaders/shared/over_fields.wgsl has them.
@group(0) @binding(3) var<storage, read_write> results: array<u32>;
// Per field the centroid of the last batch's last frame, and 1 where that was in contact.
@group(0) @binding(4) var<storage, read_write> last: array<vec4<f32>>;

const NOWHERE = 0xffffffffu;
override CENTROID_AT: u32 = 1u;
// Flags below and quantities present above, for the host to add to the cell's: its neighbours read that meanwhile.
override MOTION_AT: u32 = 3u;
override DISPLACEMENT_AT: u32 = NOWHERE;
override DIRECTION_AT: u32 = NOWHERE;
override DISTANCE_AT: u32 = NOWHERE;
override RADIAL_DISTANCE_AT: u32 = NOWHERE;
override SPEED_AT: u32 = NOWHERE;
override RADIAL_SPEED_AT: u32 = NOWHERE;

fn at_column(column: u32, cell: u32) -> u32 {
    return column * batch.frames * batch.fields + cell;
}

fn centroid(cell: u32) -> vec2<f32> {
    let u = results[at_column(CENTROID_AT, cell)];
    let v = results[at_column(CENTROID_AT + 1u, cell)];
    return vec2<f32>(bitcast<f32>(u), bitcast<f32>(v));
}

fn store(column: u32, cell: u32, value: f32) {
    if column != NOWHERE {
        results[at_column(column, cell)] = bitcast<u32>(value);
    }
}

struct Motion {
    displacement: vec2<f32>,
    direction: f32,
    distance: f32,
    radial_distance: f32,
    speed: f32,
    radial_speed: f32,
    status: u32,
}

fn motion_of(field: u32, frame: u32, cell: u32) -> Motion {
    var motion: Motion;
    if (results[cell] & (NO_CONTACT | NO_CHART)) != 0u {
        return motion;
    }
    var before = last[field].xy;
    var touched = last[field].w == 1.0;
    if frame > 0u {
        before = centroid(cell - batch.fields);
        touched = (results[cell - batch.fields] & NO_CONTACT) == 0u;
    }
    let step = steps[frame];
    if !touched || step.flags != 0u {
        motion.status = select(NO_PREVIOUS, step.flags, touched);
        return motion;
    }
    let now = centroid(cell);
    let moved = now - before;
    let distance = sqrt(moved.x * moved.x + moved.y * moved.y);
    let radial = sqrt(now.x * now.x + now.y * now.y) - sqrt(before.x * before.x + before.y * before.y);
    let is_still = distance <= still[field];
    var direction = 0.0;
    if !is_still {
        direction = full_angle(moved.x, moved.y);
    }
    let status = select(DIRECTION << PRESENT, STILL, is_still) | (DISPLACEMENT << PRESENT);
    return Motion(moved, direction, distance, radial, distance / step.dt_s, radial / step.dt_s, status);
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
    let motion = motion_of(cell % batch.fields, cell / batch.fields, cell);
    results[at_column(MOTION_AT, cell)] = motion.status;
    if DISPLACEMENT_AT != NOWHERE {
        store(DISPLACEMENT_AT, cell, motion.displacement.x);
        store(DISPLACEMENT_AT + 1u, cell, motion.displacement.y);
    }
    store(DIRECTION_AT, cell, motion.direction);
    store(DISTANCE_AT, cell, motion.distance);
    store(RADIAL_DISTANCE_AT, cell, motion.radial_distance);
    store(SPEED_AT, cell, motion.speed);
    store(RADIAL_SPEED_AT, cell, motion.radial_speed);
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
    let cell = (batch.frames - 1u) * batch.fields + field;
    let touched = (results[cell] & (NO_CONTACT | NO_CHART)) == 0u;
    last[field] = vec4<f32>(centroid(cell), 0.0, select(0.0, 1.0, touched));
}
