// motion: how the centroid moved since the frame before (crates/engine/src/stage/motion.rs).

@group(0) @binding(0) var<uniform> batch: Batch;
@group(0) @binding(1) var<storage, read> steps: array<Step>;
@group(0) @binding(2) var<storage, read> still: array<Still>;
// As shaders/shared/over_fields.wgsl has them.
@group(0) @binding(3) var<storage, read_write> results: array<u32>;
// Per field the centroid of the last batch's last frame as bits, how many taxels were pressed there, and 1 where that was
// in contact.
@group(0) @binding(4) var<storage, read_write> last: array<vec4<u32>>;

const NOWHERE = 0xffffffffu;
override ACTIVE_AT: u32 = 1u;
override CENTROID_AT: u32 = 2u;
// Flags below and quantities present above, for the host to add to the cell's: its neighbours read that meanwhile.
override MOTION_AT: u32 = 4u;
override DISPLACEMENT_AT: u32 = NOWHERE;
override DIRECTION_AT: u32 = NOWHERE;
override DISTANCE_AT: u32 = NOWHERE;
override RADIAL_DISTANCE_AT: u32 = NOWHERE;
override SPEED_AT: u32 = NOWHERE;
override RADIAL_SPEED_AT: u32 = NOWHERE;

fn at_column(column: u32, cell: u32) -> u32 {
    return column * batch.frames * batch.fields + cell;
}

// A cell's centroid as bits, how many taxels are pressed, and 1 where it is in contact.
fn touch_at(cell: u32) -> vec4<u32> {
    let u = results[at_column(CENTROID_AT, cell)];
    let v = results[at_column(CENTROID_AT + 1u, cell)];
    let pressed = results[at_column(ACTIVE_AT, cell)];
    return vec4<u32>(u, v, pressed, select(1u, 0u, (results[cell] & (NO_CONTACT | NO_CHART)) != 0u));
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
    var touch_before = last[field];
    if frame > 0u {
        touch_before = touch_at(cell - batch.fields);
    }
    let touched = touch_before.w == 1u;
    let step = steps[frame];
    if !touched || step.flags != 0u {
        motion.status = select(NO_PREVIOUS, step.flags, touched);
        return motion;
    }
    let touch = touch_at(cell);
    let now = bitcast<vec2<f32>>(touch.xy);
    let before = bitcast<vec2<f32>>(touch_before.xy);
    let moved = now - before;
    let distance = sqrt(moved.x * moved.x + moved.y * moved.y);
    let radial = sqrt(now.x * now.x + now.y * now.y) - sqrt(before.x * before.x + before.y * before.y);
    let rounding = still[field].rounding + still[field].per_taxel * f32(touch.z + touch_before.z);
    let is_still = distance <= max(rounding, still[field].least);
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
    last[field] = touch_at(cell);
}
