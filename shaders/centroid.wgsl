// centroid: the pressure-weighted mean place (src/stage/centroid.rs).

// Sums of wPx, then the means.
struct Place {
    u: vec4<f32>,
    v: vec4<f32>,
    depth: vec4<f32>,
}

fn no_place() -> Place {
    return Place(vec4<f32>(), vec4<f32>(), vec4<f32>());
}

fn add_place(so_far: Place, m: u32, member: Member, pull: vec4<f32>, charted: bool) -> Place {
    var place = so_far;
    place.u += pull * member.u;
    place.v += pull * member.v;
    // The third coordinate is for fields without a chart.
    if DEPTH_AT != NOWHERE && !charted {
        place.depth += pull * depths[m];
    }
    return place;
}

fn join_places(a: Place, b: Place) -> Place {
    return Place(a.u + b.u, a.v + b.v, a.depth + b.depth);
}

fn mean_place(sum: Place, total: vec4<f32>, touched: vec4<bool>) -> Place {
    let nowhere = vec4<f32>();
    return Place(
        select(nowhere, sum.u / total, touched),
        select(nowhere, sum.v / total, touched),
        select(nowhere, sum.depth / total, touched),
    );
}

// What is present where a field is touched.
fn present_places(field: Field, touched: vec4<bool>) -> vec4<u32> {
    let present = select(POSITION, CENTROID | POSITION | NORMAL, field.charted != 0u) << PRESENT;
    return select(vec4<u32>(), vec4<u32>(present), touched);
}
