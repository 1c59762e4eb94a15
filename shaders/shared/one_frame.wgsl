// What an invocation takes at once where there is never more than one frame: that. Compilers drop much of what nobody
// reads, but not what goes round a loop.

alias Numbers = f32;
alias Words = u32;
alias Truths = bool;

// Of a quad's words the one that is taken.
fn words_of(quad: vec4<u32>) -> Words {
    return quad.x;
}

fn first_of(word: Words) -> u32 {
    return word;
}

fn or_of(word: Words) -> u32 {
    return word;
}

fn max_of(word: Words) -> u32 {
    return word;
}

fn min_of(word: Words) -> u32 {
    return word;
}

// A status as the first of four in a word.
fn packed(status: Words) -> u32 {
    return status;
}

fn unpacked(statuses: u32) -> Words {
    return statuses & 0xffu;
}
