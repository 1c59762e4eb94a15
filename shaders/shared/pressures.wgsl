// What calibrate has written: pressures, and in their signs whether there is a status to look up.
@group(0) @binding(5) var<storage, read> pressures: array<vec4<u32>>;
@group(0) @binding(6) var<storage, read> statuses: array<u32>;

fn bits_at(here: u32) -> Words {
    return words_of(pressures[here]);
}

fn pressure_of(bits: Words) -> Numbers {
    return unmarked(bits);
}

// What several of them say together, as far as it tells whether there is any status.
const NOTHING_SAID = vec2<u32>();

fn hear(said: vec2<u32>, bits: Words) -> vec2<u32> {
    return vec2<u32>(said.x | or_of(bits), 0u);
}

fn is_said(said: vec2<u32>) -> bool {
    return said.x > NUMBER;
}

fn status_at(here: u32) -> u32 {
    if is_marked(bits_at(here)) {
        return statuses[here];
    }
    return 0u;
}
