// What calibrate has written: pressures, and in their signs whether there is a status to look up.
@group(0) @binding(5) var<storage, read> pressures: array<vec4<u32>>;
@group(0) @binding(6) var<storage, read> statuses: array<u32>;

fn bits_at(here: u32) -> vec4<u32> {
    return pressures[here];
}

fn pressure_of(bits: vec4<u32>) -> vec4<f32> {
    return unmarked(bits);
}

// What several of them say together, as far as it tells whether there is any status.
const NOTHING_SAID = vec2<u32>();

fn hear(said: vec2<u32>, bits: vec4<u32>) -> vec2<u32> {
    return vec2<u32>(said.x | (bits.x | bits.y) | (bits.z | bits.w), 0u);
}

fn is_said(said: vec2<u32>) -> bool {
    return said.x > NUMBER;
}

fn status_at(here: u32) -> u32 {
    if is_marked(pressures[here]) {
        return statuses[here];
    }
    return 0u;
}
