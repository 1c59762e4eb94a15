// change: how fast pressures change, one invocation a taxel and frame (src/stage/change.rs). It reads pressures that have
// been written, never computes them: a product fused into the difference would make changes where there are none.

@group(0) @binding(0) var<uniform> batch: Batch;
@group(0) @binding(1) var<storage, read> taxels: array<Taxel>;
@group(0) @binding(2) var<storage, read> steps: array<Step>;
// The frame before the batch's first.
@group(0) @binding(3) var<storage, read> pressures_before: array<f32>;
@group(0) @binding(4) var<storage, read> statuses_before: array<u32>;
@group(0) @binding(5) var<storage, read_write> pressures: array<f32>;
@group(0) @binding(6) var<storage, read_write> statuses: array<u32>;

const HUGE_BITS = 0x5d800000u;
const TINY_BITS = 0x21800000u;

@compute @workgroup_size(GROUP)
fn main(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    let number = invocation(group, groups, local);
    if number >= batch.frames * batch.changes {
        return;
    }
    let frame = number % batch.frames;
    let index = batch.calibrated * batch.frames + number;
    let taxel = taxels[index / batch.frames];
    let now = taxel.response * batch.frames + frame;
    let step = steps[frame];
    var status = statuses[now] | step.flags;
    pressures[index] = 0.0;
    if step.flags != 0u {
        statuses[index] = status | UNUSABLE;
        return;
    }
    var before = 0.0;
    if frame == 0u {
        before = pressures_before[taxel.response];
        status |= statuses_before[taxel.response];
    } else {
        before = pressures[now - 1u];
        status |= statuses[now - 1u];
    }
    if (status & UNUSABLE) == 0u {
        let change = abs(pressures[now] - before) / step.dt_s;
        let size = bitcast<u32>(change);
        if size > HUGE_BITS {
            status = FAULTY_INPUT | UNUSABLE;
        } else if size >= TINY_BITS && change > taxel.dead_band {
            pressures[index] = change;
        }
    }
    statuses[index] = status;
}
