// What calibrate has written: pressures, and in their signs whether there is a status to look up.
@group(0) @binding(5) var<storage, read> pressures: array<vec4<u32>>;
@group(0) @binding(6) var<storage, read> statuses: array<u32>;

fn bits_at(here: u32) -> vec4<u32> {
    return pressures[here];
}

fn pressure_of(bits: vec4<u32>) -> vec4<f32> {
    return unmarked(bits);
}

// Marked where there is a status.
fn said_by(bits: vec4<u32>) -> vec4<u32> {
    return bits;
}

fn status_at(here: u32) -> u32 {
    if is_marked(pressures[here]) {
        return statuses[here];
    }
    return 0u;
}
