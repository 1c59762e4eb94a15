// contact: sums over a field (src/stage/contact.rs).

struct Sums {
    total: vec4<f32>,
    peak: vec4<f32>,
    area: vec4<f32>,
    pressed: vec4<u32>,
    // Four bytes each: of all statuses together, and UNUSABLE as long as every taxel is.
    status: u32,
    unusable: u32,
}

fn no_sums() -> Sums {
    return Sums(vec4<f32>(), vec4<f32>(), vec4<f32>(), vec4<u32>(), 0u, 0u);
}

fn add_sums(so_far: Sums, member: Member, pressure: vec4<f32>, pull: vec4<f32>) -> Sums {
    var sums = so_far;
    sums.total += pull;
    let pressed = pressure > vec4<f32>();
    sums.pressed += select(vec4<u32>(), vec4<u32>(1u), pressed);
    if PEAK_AT != NOWHERE {
        sums.peak = max(sums.peak, pressure);
    }
    if AREA_AT != NOWHERE {
        sums.area += select(vec4<f32>(), vec4<f32>(taxels[member.slot].area), pressed);
    }
    return sums;
}

fn join_sums(a: Sums, b: Sums) -> Sums {
    return Sums(
        a.total + b.total,
        max(a.peak, b.peak),
        a.area + b.area,
        a.pressed + b.pressed,
        a.status | b.status,
        a.unusable & b.unusable,
    );
}

// Flags and quantities present of four cells.
fn status_of(sums: Sums, field: Field) -> vec4<u32> {
    let flags = (unpacked(sums.status) & vec4<u32>(UNUSABLE - 1u)) << vec4<u32>(STATUS);
    let pressed = sums.pressed > vec4<u32>();
    let usable = (unpacked(sums.unusable) & vec4<u32>(UNUSABLE)) == vec4<u32>();
    let present = TOTAL | PEAK | ACTIVE | select(0u, AREA, field.area_known != 0u);
    return flags
        | select(vec4<u32>(NO_CONTACT), vec4<u32>(), pressed)
        | vec4<u32>(select(NO_CHART, 0u, field.charted != 0u))
        | select(vec4<u32>(), vec4<u32>(present << PRESENT), usable);
}
