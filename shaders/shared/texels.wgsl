// For drivers that run shaders on a processor: lavapipe loads from textures with a fifth of the instructions.

// Texels of a row: two to this power.
const ROW_LOG2 = 10u;

fn texel(here: u32) -> vec2<u32> {
    return vec2<u32>(here & ((1u << ROW_LOG2) - 1u), here >> ROW_LOG2);
}
