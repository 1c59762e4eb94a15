@group(0) @binding(2) var members: texture_storage_2d<rgba32uint, read>;

fn member_at(m: u32) -> Member {
    let words = textureLoad(members, texel(m));
    return Member(words.x, bitcast<f32>(words.y), bitcast<f32>(words.z), bitcast<f32>(words.w));
}
