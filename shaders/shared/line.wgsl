// Angles of lines for four at a time, and the scale that the stages which look for a line in a chart share.

// The power of two that brings a field's total into [1, 2), so that q lies in [0, 2) and its square cannot overflow.
fn scale_of(total: vec4<f32>) -> vec4<f32> {
    return bitcast<vec4<f32>>(vec4<u32>(254u << 23u) - (bitcast<vec4<u32>>(total) & vec4<u32>(0x7f800000u)));
}

fn line_angle(x: vec4<f32>, y: vec4<f32>) -> vec4<f32> {
    return vec4<f32>(
        angle_of_line(x.x, y.x),
        angle_of_line(x.y, y.y),
        angle_of_line(x.z, y.z),
        angle_of_line(x.w, y.w),
    );
}
