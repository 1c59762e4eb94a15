// Where every taxel's pressure is its raw value, fields read those as they came: four frames of a taxel side by side. What
// shaders/calibrate.wgsl does with them is done on the way, with the same results.

// What is tiny, infinite, no number, missing, or negative presses nothing.
fn pressure_of(bits: vec4<u32>) -> vec4<f32> {
    let fine = bits - vec4<u32>(TINY_BITS) <= vec4<u32>(HUGE_BITS - TINY_BITS);
    return bitcast<vec4<f32>>(select(vec4<u32>(), bits, fine));
}

// The largest of several, and one less than the smallest but for 0: there is a status where they are too large or too
// small to compute with.
const NOTHING_SAID = vec2<u32>(0u, 0xffffffffu);

fn hear(said: vec2<u32>, bits: vec4<u32>) -> vec2<u32> {
    let size = bits & vec4<u32>(SIZE_BITS);
    let less = size - vec4<u32>(1u);
    return vec2<u32>(
        max(said.x, max(max(size.x, size.y), max(size.z, size.w))),
        min(said.y, min(min(less.x, less.y), min(less.z, less.w))),
    );
}

fn is_said(said: vec2<u32>) -> bool {
    return said.x > HUGE_BITS || said.y < TINY_BITS - 1u;
}

fn status_at(here: u32) -> u32 {
    let bits = bits_at(here);
    let size = bits & vec4<u32>(SIZE_BITS);
    let huge = size > vec4<u32>(HUGE_BITS);
    let tiny = (size < vec4<u32>(TINY_BITS)) & (size != vec4<u32>());
    var status = select(vec4<u32>(), vec4<u32>(FAULTY_INPUT >> STATUS), huge | tiny);
    status |= select(vec4<u32>(), vec4<u32>(UNUSABLE), huge);
    let missing = bits == vec4<u32>(MISSING);
    return packed(select(status, vec4<u32>((INCOMPLETE >> STATUS) | UNUSABLE), missing));
}
