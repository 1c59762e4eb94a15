// change: how fast pressures change, one invocation a taxel and quad of frames (crates/engine/src/stage/change.rs). It reads pressures
// that have been written, never computes them: a product fused into the difference would make changes where there are
// none.

@group(0) @binding(0) var<uniform> batch: Batch;
@group(0) @binding(1) var<storage, read> taxels: array<Taxel>;
@group(0) @binding(2) var<storage, read> steps: array<Step>;
// The frame before the batch's first, four times over.
@group(0) @binding(3) var<storage, read> pressures_before: array<vec4<u32>>;
@group(0) @binding(4) var<storage, read> statuses_before: array<u32>;
@group(0) @binding(5) var<storage, read_write> pressures: array<vec4<u32>>;
@group(0) @binding(6) var<storage, read_write> statuses: array<u32>;

// What is said of a quad whose pressures have these bits, and lie at `here`.
fn heard_at(bits: vec4<u32>, here: u32) -> u32 {
    if is_marked(bits) {
        return statuses[here];
    }
    return 0u;
}

@compute @workgroup_size(GROUP)
fn main(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    let change = invocation(group, groups, local);
    let quad = group.y;
    if change >= batch.changes {
        return;
    }
    let slot = batch.calibrated + change;
    let taxel = taxels[slot];
    let here = at(taxel.response, quad);
    let bits = pressures[here];
    let now = unmarked(bits);
    let heard = heard_at(bits, here);
    var bits_before = pressures_before[taxel.response];
    var heard_before = 0u;
    if quad > 0u {
        let there = at(taxel.response, quad - 1u);
        bits_before = pressures[there];
        heard_before = heard_at(bits_before, there) >> 24u;
    } else if is_marked(bits_before) {
        heard_before = statuses_before[taxel.response] >> 24u;
    }
    let first_before = unmarked(bits_before).w;
    let before = vec4<f32>(first_before, now.xyz);
    let known = unpacked(heard | (heard << 8u) | heard_before);
    var changes = vec4<f32>();
    var result = vec4<u32>();
    for (var i = 0u; i < 4u; i++) {
        let step = steps[min(quad * 4u + i, batch.frames - 1u)];
        var status = known[i];
        if step.flags != 0u {
            status = (unpacked(heard)[i] | (step.flags >> STATUS)) | UNUSABLE;
        }
        if (status & UNUSABLE) == 0u {
            let rate = abs(now[i] - before[i]) / step.dt_s;
            let size = bitcast<u32>(rate);
            if size > HUGE_BITS {
                status = (FAULTY_INPUT >> STATUS) | UNUSABLE;
            } else if size >= TINY_BITS && rate > taxel.dead_band {
                changes[i] = rate;
            }
        }
        result[i] = status;
    }
    pressures[at(slot, quad)] = marked(changes, result);
    if any(result != vec4<u32>()) {
        statuses[at(slot, quad)] = packed(result);
    }
}
