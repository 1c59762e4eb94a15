// For drivers that run shaders on a processor: lavapipe loads from textures with a fifth of the instructions.
@group(0) @binding(5) var raw: texture_storage_2d<rgba32uint, read>;

// Texels of a row: two to this power.
const ROW_LOG2 = 10u;

fn bits_at(here: u32) -> vec4<u32> {
    return textureLoad(raw, vec2<u32>(here & ((1u << ROW_LOG2) - 1u), here >> ROW_LOG2));
}
