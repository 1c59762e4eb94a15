// contact: sums over a field (crates/engine/src/stage/contact.rs).

override TOTAL_AT: u32 = NOWHERE;
override PEAK_AT: u32 = NOWHERE;
override ACTIVE_AT: u32 = NOWHERE;
override AREA_AT: u32 = NOWHERE;

struct Sums {
    total: Numbers,
    peak: Numbers,
    area: Numbers,
    pressed: Words,
    // Four bytes each: of all statuses together, and UNUSABLE as long as every taxel is.
    status: u32,
    unusable: u32,
}

fn no_sums() -> Sums {
    return Sums(Numbers(), Numbers(), Numbers(), Words(), 0u, 0u);
}

fn add_sums(so_far: Sums, member: Member, pressure: Numbers, pull: Numbers) -> Sums {
    var sums = so_far;
    sums.total += pull;
    let pressed = pressure > Numbers();
    sums.pressed += select(Words(), Words(1u), pressed);
    if PEAK_AT != NOWHERE {
        sums.peak = max(sums.peak, pressure);
    }
    if AREA_AT != NOWHERE {
        sums.area += select(Numbers(), Numbers(taxels[member.slot].area), pressed);
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
fn status_of(sums: Sums, field: Field) -> Words {
    let flags = (unpacked(sums.status) & Words(UNUSABLE - 1u)) << Words(STATUS);
    let pressed = sums.pressed > Words();
    let usable = (unpacked(sums.unusable) & Words(UNUSABLE)) == Words();
    let present = TOTAL | PEAK | ACTIVE | select(0u, AREA, (field.known & AREA_KNOWN) != 0u);
    return flags
        | select(Words(NO_CONTACT), Words(), pressed)
        | Words(select(NO_CHART, 0u, is_charted(field)))
        | select(Words(), Words(present << PRESENT), usable);
}

fn store_contact(index: u32, quad: u32, sums: Sums) {
    store_numbers(TOTAL_AT, index, quad, sums.total);
    store_numbers(PEAK_AT, index, quad, sums.peak);
    store_numbers(AREA_AT, index, quad, sums.area);
    store(ACTIVE_AT, index, quad, sums.pressed);
}
