// The scale that the stages which look for a line in a chart share.

// The power of two that brings a field's total into [1, 2), so that q lies in [0, 2) and its square cannot overflow.
fn scale_of(total: Numbers) -> Numbers {
    return bitcast<Numbers>(Words(254u << 23u) - (bitcast<Words>(total) & Words(0x7f800000u)));
}
