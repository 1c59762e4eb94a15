// contact: sums over a field (src/stage/contact.rs).

@group(0) @binding(0) var<uniform> batch: Batch;
@group(0) @binding(1) var<storage, read> taxels: array<Taxel>;
@group(0) @binding(2) var<storage, read> fields: array<Field>;
@group(0) @binding(3) var<storage, read> members: array<Member>;
@group(0) @binding(4) var<storage, read> pressures: array<f32>;
@group(0) @binding(5) var<storage, read> statuses: array<u32>;
@group(0) @binding(6) var<storage, read_write> cells: array<u32>;
// total, peak, area, and the bits of the number of pressed taxels
@group(0) @binding(7) var<storage, read_write> contacts: array<vec4<f32>>;
@group(0) @binding(8) var<storage, read> wide_fields: array<u32>;

struct Sums {
    total: f32,
    peak: f32,
    area: f32,
    pressed: u32,
    flags: u32,
    // UNUSABLE as long as every taxel is.
    unusable: u32,
}

alias Part = Sums;

// Nothing is needed beside the members.
alias Context = bool;

fn context_of(cell: u32, field: Field) -> Context {
    return true;
}

fn nothing() -> Sums {
    return Sums(0.0, 0.0, 0.0, 0u, 0u, UNUSABLE);
}

fn add(so_far: Sums, m: u32, frame: u32, context: Context) -> Sums {
    var sums = so_far;
    let member = members[m];
    let at = member.slot * batch.frames + frame;
    let pressure = pressures[at];
    let status = statuses[at];
    sums.flags |= status;
    sums.unusable &= status;
    sums.total += member.weight * pressure;
    sums.peak = max(sums.peak, pressure);
    if pressure > 0.0 {
        sums.pressed += 1u;
        sums.area += taxels[member.slot].area;
    }
    return sums;
}

fn join(a: Sums, b: Sums) -> Sums {
    return Sums(
        a.total + b.total,
        max(a.peak, b.peak),
        a.area + b.area,
        a.pressed + b.pressed,
        a.flags | b.flags,
        a.unusable & b.unusable,
    );
}

fn finish(cell: u32, field: Field, sums: Sums) {
    var flags = sums.flags & FLAGS;
    flags |= select(NO_CONTACT, 0u, sums.pressed > 0u);
    flags |= select(NO_CHART, 0u, field.charted != 0u);
    var present = 0u;
    if (sums.unusable & UNUSABLE) == 0u {
        present = TOTAL | PEAK | ACTIVE | select(0u, AREA, field.area_known != 0u);
    }
    cells[cell] = flags | (present << PRESENT);
    contacts[cell] = vec4<f32>(sums.total, sums.peak, sums.area, bitcast<f32>(sums.pressed));
}
