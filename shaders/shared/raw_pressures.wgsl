// Where every taxel's pressure is its raw value, fields read those as they came, a taxel's frames side by side. What
// shaders/calibrate.wgsl does with them is done on the way, with the same results.

@group(0) @binding(5) var<storage, read> raw: array<Words>;

fn bits_at(here: u32) -> Words {
    return raw[here];
}

// What is tiny, infinite, no number, missing, or negative presses nothing.
fn pressure_of(bits: Words) -> Numbers {
    let fine = bits - Words(TINY_BITS) <= Words(HUGE_BITS - TINY_BITS);
    return bitcast<Numbers>(select(Words(), bits, fine));
}

// The largest of several, and one less than the smallest but for 0: there is a status where they are too large or too
// small to compute with.
const NOTHING_SAID = vec2<u32>(0u, 0xffffffffu);

fn hear(said: vec2<u32>, bits: Words) -> vec2<u32> {
    let size = bits & Words(SIZE_BITS);
    let less = size - Words(1u);
    return vec2<u32>(max(said.x, max_of(size)), min(said.y, min_of(less)));
}

fn is_said(said: vec2<u32>) -> bool {
    return said.x > HUGE_BITS || said.y < TINY_BITS - 1u;
}

fn status_at(here: u32) -> u32 {
    let bits = bits_at(here);
    let size = bits & Words(SIZE_BITS);
    let huge = size > Words(HUGE_BITS);
    let tiny = (size < Words(TINY_BITS)) & (size != Words());
    var status = select(Words(), Words(FAULTY_INPUT >> STATUS), huge | tiny);
    status |= select(Words(), Words(UNUSABLE), huge);
    let missing = bits == Words(MISSING);
    return packed(select(status, Words((INCOMPLETE >> STATUS) | UNUSABLE), missing));
}
