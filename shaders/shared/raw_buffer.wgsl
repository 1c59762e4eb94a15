@group(0) @binding(5) var<storage, read> raw: array<Words>;

fn bits_at(here: u32) -> Words {
    return raw[here];
}
