// centroid: the pressure-weighted mean place (crates/engine/src/stage/centroid.rs).

// u; v is the next.
override CENTROID_AT: u32 = NOWHERE;
override DEPTH_AT: u32 = NOWHERE;

// Sums of wPx, then the means.
struct Place {
    u: Numbers,
    v: Numbers,
    depth: Numbers,
}

fn no_place() -> Place {
    return Place(Numbers(), Numbers(), Numbers());
}

fn add_place(so_far: Place, m: u32, member: Member, pull: Numbers, charted: bool) -> Place {
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

fn mean_place(sum: Place, total: Numbers, touched: Truths) -> Place {
    let nowhere = Numbers();
    return Place(
        select(nowhere, sum.u / total, touched),
        select(nowhere, sum.v / total, touched),
        select(nowhere, sum.depth / total, touched),
    );
}

// What is present where a field is touched.
fn present_places(field: Field, touched: Truths) -> Words {
    let present = select(POSITION, CENTROID | POSITION | NORMAL, is_charted(field)) << PRESENT;
    return select(Words(), Words(present), touched);
}

fn store_centroid(index: u32, quad: u32, place: Place) {
    if CENTROID_AT != NOWHERE {
        store_numbers(CENTROID_AT, index, quad, place.u);
        store_numbers(CENTROID_AT + 1u, index, quad, place.v);
    }
    store_numbers(DEPTH_AT, index, quad, place.depth);
}
