@group(0) @binding(5) var<storage, read> raw: array<vec4<u32>>;

fn bits_at(here: u32) -> vec4<u32> {
    return raw[here];
}
