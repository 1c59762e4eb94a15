// Where every taxel's pressure is its raw value, fields read those as they came: four frames of a taxel side by side. What
// shaders/calibrate.wgsl does with them is done on the way, with the same results.
@group(0) @binding(5) var<storage, read> raw: array<vec4<u32>>;

fn bits_at(here: u32) -> vec4<u32> {
    return raw[here];
}

// What is tiny, infinite, no number, missing, or negative presses nothing.
fn pressure_of(bits: vec4<u32>) -> vec4<f32> {
    let fine = bits - vec4<u32>(TINY_BITS) <= vec4<u32>(HUGE_BITS - TINY_BITS);
    return bitcast<vec4<f32>>(select(vec4<u32>(), bits, fine));
}

// Marked where there is a status: beyond what can be computed with, and not 0.
fn said_by(bits: vec4<u32>) -> vec4<u32> {
    let size = bits & vec4<u32>(SIZE_BITS);
    let beyond = size - vec4<u32>(TINY_BITS) > vec4<u32>(HUGE_BITS - TINY_BITS);
    return select(vec4<u32>(), vec4<u32>(SAID), beyond & (size != vec4<u32>()));
}

fn status_at(here: u32) -> u32 {
    let bits = raw[here];
    let size = bits & vec4<u32>(SIZE_BITS);
    var status = select(vec4<u32>(), vec4<u32>(FAULTY_INPUT >> STATUS), said_by(bits) != vec4<u32>());
    status |= select(vec4<u32>(), vec4<u32>(UNUSABLE), size > vec4<u32>(HUGE_BITS));
    let missing = bits == vec4<u32>(MISSING);
    return packed(select(status, vec4<u32>((INCOMPLETE >> STATUS) | UNUSABLE), missing));
}
