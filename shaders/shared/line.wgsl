// What the stages that look for a line in a chart share. They declare `cells`, `contacts` and `centroids`.

// The power of two that brings a field's total into [1, 2), so that q lies in [0, 2) and its square cannot overflow.
fn scale_of(total: f32) -> f32 {
    return bitcast<f32>((254u << 23u) - (bitcast<u32>(total) & 0x7f800000u));
}

struct Context {
    scale: f32,
    centroid: vec2<f32>,
}

fn context_of(cell: u32, field: Field) -> Context {
    return Context(scale_of(contacts[cell].x), centroids[cell].xy);
}

// Whether there is a line to look for; marks the cell where one pressed taxel is the reason that there is not.
fn is_pressed(cell: u32) -> bool {
    if (cells[cell] & (NO_CONTACT | NO_CHART)) != 0u {
        return false;
    }
    if bitcast<u32>(contacts[cell].w) == 1u {
        cells[cell] |= ONE_TAXEL;
        return false;
    }
    return true;
}
