// What differs between a quad's cells: each is stored where its frame is, and has an angle of its own.

// Invocations of a group that takes fields.
const FIELDS_GROUP = GROUP;

fn store(column: u32, index: u32, quad: u32, values: Words) {
    if column == NOWHERE {
        return;
    }
    let frame = quad * 4u;
    let cell = (column * batch.frames + frame) * batch.fields + index;
    results[cell] = values.x;
    if frame + 1u < batch.frames {
        results[cell + batch.fields] = values.y;
    }
    if frame + 2u < batch.frames {
        results[cell + 2u * batch.fields] = values.z;
    }
    if frame + 3u < batch.frames {
        results[cell + 3u * batch.fields] = values.w;
    }
}

fn line_angle(x: Numbers, y: Numbers) -> Numbers {
    return Numbers(
        angle_of_line(x.x, y.x),
        angle_of_line(x.y, y.y),
        angle_of_line(x.z, y.z),
        angle_of_line(x.w, y.w),
    );
}
