// What an invocation takes at once: four frames, a quad. The stages say Numbers, Words and Truths where they mean one for
// each of those, and are compiled with one_frame.wgsl, too.

alias Numbers = vec4<f32>;
alias Words = vec4<u32>;
alias Truths = vec4<bool>;

// Of a quad's words those that are taken.
fn words_of(quad: vec4<u32>) -> Words {
    return quad;
}

fn first_of(words: Words) -> u32 {
    return words.x;
}

fn or_of(words: Words) -> u32 {
    return (words.x | words.y) | (words.z | words.w);
}

fn max_of(words: Words) -> u32 {
    return max(max(words.x, words.y), max(words.z, words.w));
}

fn min_of(words: Words) -> u32 {
    return min(min(words.x, words.y), min(words.z, words.w));
}

// Four statuses in one word.
fn packed(statuses: Words) -> u32 {
    return statuses.x | (statuses.y << 8u) | (statuses.z << 16u) | (statuses.w << 24u);
}

fn unpacked(statuses: u32) -> Words {
    return (Words(statuses) >> Words(0u, 8u, 16u, 24u)) & Words(0xffu);
}
