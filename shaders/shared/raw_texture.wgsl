@group(0) @binding(5) var raw: Texels;

fn bits_at(here: u32) -> Words {
    return words_of(textureLoad(raw, texel(here)));
}
