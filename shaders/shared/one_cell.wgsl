// The same for a single frame's cell.

// More than elsewhere: what a group costs by itself is a part of a live call.
const FIELDS_GROUP = 128u;

fn store(column: u32, index: u32, quad: u32, value: Words) {
    if column != NOWHERE {
        results[column * batch.fields + index] = value;
    }
}

fn line_angle(x: Numbers, y: Numbers) -> Numbers {
    return angle_of_line(x, y);
}
