// How the stages from contact to axis go over the fields, all in one: each field and quad of frames by one invocation, or
// a wide field by a whole group. A member's pressures are read once for the sums and the centroid, and once more for what
// needs the centroid.

@group(0) @binding(0) var<uniform> batch: Batch;
@group(0) @binding(1) var<storage, read> fields: array<Field>;
// 2: the members.
// Their third coordinate, for fields without a chart.
@group(0) @binding(3) var<storage, read> depths: array<f32>;
@group(0) @binding(4) var<storage, read> taxels: array<Taxel>;
// 5, and 6 where there is one: what the taxels say.
// Column by column, each frame by frame, each field by field. The first column are the cells' statuses.
@group(0) @binding(7) var<storage, read_write> results: array<u32>;
@group(0) @binding(8) var<storage, read> wide_fields: array<u32>;

// Which column has what; what nobody wants is nowhere, and not computed.
const NOWHERE = 0xffffffffu;
override TOTAL_AT: u32 = NOWHERE;
override PEAK_AT: u32 = NOWHERE;
override ACTIVE_AT: u32 = NOWHERE;
override AREA_AT: u32 = NOWHERE;
// u; v is the next.
override CENTROID_AT: u32 = NOWHERE;
override DEPTH_AT: u32 = NOWHERE;
override ORIENTATION_AT: u32 = NOWHERE;
override AXIS_AT: u32 = NOWHERE;
override ANISOTROPY_AT: u32 = NOWHERE;
// Whether stages run: a later one may need what is not kept.
override CENTRED: bool = false;
override ORIENTED: bool = false;
override AXED: bool = false;
// Whether every member's weight is 1.
override UNWEIGHTED: bool = false;

fn pull_of(member: Member, pressure: Numbers) -> Numbers {
    if UNWEIGHTED {
        return pressure;
    }
    return member.weight * pressure;
}

fn store_numbers(column: u32, index: u32, quad: u32, values: Numbers) {
    store(column, index, quad, bitcast<Words>(values));
}

// Adds what the taxels have to say of a field's members `start`, `start + step` and so on.
fn add_statuses(so_far: Sums, start: u32, end: u32, step: u32, first: u32) -> Sums {
    var sums = so_far;
    sums.unusable = 0xffffffffu;
    for (var m = start; m < end; m += step) {
        let status = status_at(first + (member_at(m).slot << batch.lanes_log2));
        sums.status |= status;
        sums.unusable &= status;
    }
    return sums;
}

// What a field's later stages are told of its earlier ones.
struct Found {
    status: Words,
    total: Numbers,
    scale: Numbers,
    place: Place,
    // More than one taxel of a chart is pressed.
    lined: Truths,
}

fn found_of(field: Field, sums: Sums, place_sum: Place) -> Found {
    var found: Found;
    found.status = status_of(sums, field);
    found.total = sums.total;
    if CENTRED {
        let touched = sums.pressed > Words();
        found.place = mean_place(place_sum, sums.total, touched);
        found.status |= present_places(field, touched);
    }
    if ORIENTED || AXED {
        let charted = Truths(field.charted != 0u);
        found.scale = scale_of(sums.total);
        found.lined = (sums.pressed > Words(1u)) & charted;
        let alone = (sums.pressed == Words(1u)) & charted;
        found.status |= select(Words(), Words(ONE_TAXEL), alone);
    }
    return found;
}

fn store_sums(index: u32, quad: u32, sums: Sums, place: Place) {
    store_numbers(TOTAL_AT, index, quad, sums.total);
    store_numbers(PEAK_AT, index, quad, sums.peak);
    store_numbers(AREA_AT, index, quad, sums.area);
    store(ACTIVE_AT, index, quad, sums.pressed);
    if CENTROID_AT != NOWHERE {
        store_numbers(CENTROID_AT, index, quad, place.u);
        store_numbers(CENTROID_AT + 1u, index, quad, place.v);
    }
    store_numbers(DEPTH_AT, index, quad, place.depth);
}

// Stores lines, and the cells' statuses.
fn finish_lines(index: u32, quad: u32, found: Found, far: Farthest, moments: Moments) {
    var status = found.status;
    if ORIENTED {
        let line = orientation_of(far, found.lined);
        status |= line.status;
        store_numbers(ORIENTATION_AT, index, quad, line.angle);
    }
    if AXED {
        let axis = axis_of(moments, found.total * found.scale, found.lined);
        status |= axis.status;
        store_numbers(AXIS_AT, index, quad, axis.angle);
        store_numbers(ANISOTROPY_AT, index, quad, axis.anisotropy);
    }
    store(0u, index, quad, status);
}

// What a first look at members gives.
struct Touch {
    sums: Sums,
    place: Place,
}

// Looks at every `step`th member from `begin` on; their frames begin at `first`.
fn touch_of(begin: u32, end: u32, step: u32, first: u32, charted: bool) -> Touch {
    var sums = no_sums();
    var place = no_place();
    var over = nothing_over();
    var said = NOTHING_SAID;
    for (var m = begin; m < end; m += step) {
        let member = member_at(m);
        let bits = bits_at(first + (member.slot << batch.lanes_log2));
        let pressure = pressure_of(bits);
        let pull = pull_of(member, pressure);
        said = hear(said, bits);
        if COMPENSATED {
            let kept = add_with_care(sums.total, place, over, m, member, pull, charted);
            sums = add_sums(sums, member, pressure, pull);
            sums.total = kept.total;
            place = kept.place;
            over = kept.over;
        } else {
            sums = add_sums(sums, member, pressure, pull);
            if CENTRED {
                place = add_place(place, m, member, pull, charted);
            }
        }
    }
    if COMPENSATED {
        sums.total -= over.total;
        place = less(place, over);
    }
    if is_said(said) {
        sums = add_statuses(sums, begin, end, step, first);
    }
    return Touch(sums, place);
}

// What a second look gives, from the place that the first has found.
struct Spread {
    far: Farthest,
    moments: Moments,
}

fn spread_of(begin: u32, end: u32, step: u32, first: u32, found: Found) -> Spread {
    var far = nobody_far();
    var moments = no_moments();
    var over = no_moments();
    if ORIENTED || AXED {
        for (var m = begin; m < end; m += step) {
            let member = member_at(m);
            let pressure = pressure_of(bits_at(first + (member.slot << batch.lanes_log2)));
            let q = pull_of(member, pressure) * found.scale;
            if ORIENTED {
                far = add_far(far, m, member, pressure, q, found.place);
            }
            if AXED {
                if COMPENSATED {
                    let kept = add_moments_with_care(moments, over, member, q, found.place);
                    moments = kept.sums;
                    over = kept.over;
                } else {
                    moments = add_moments(moments, member, q, found.place);
                }
            }
        }
    }
    if COMPENSATED {
        moments = less_moments(moments, over);
    }
    return Spread(far, moments);
}

@compute @workgroup_size(FIELDS_GROUP)
fn main(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    // A group takes a block's quads of as many fields as it has room for; groups side by side take other fields of the
    // same block, which so stays in the cache.
    let index = (group_number(group, groups) * FIELDS_GROUP + local) >> batch.lanes_log2;
    let quad = (group.y << batch.lanes_log2) + (local & (lanes() - 1u));
    if index >= batch.fields || quad >= quads() {
        return;
    }
    let field = fields[index];
    if field.count > WIDE {
        return;
    }
    let end = field.first + field.count;
    let first = at(0u, quad);
    let charted = field.charted != 0u;
    let touch = touch_of(field.first, end, 1u, first, charted);
    let found = found_of(field, touch.sums, touch.place);
    store_sums(index, quad, touch.sums, found.place);
    var spread = Spread(nobody_far(), no_moments());
    if charted {
        spread = spread_of(field.first, end, 1u, first, found);
    }
    finish_lines(index, quad, found, spread.far, spread.moments);
}

// What an invocation has found so far, as bits: of one kind after the other, as there is no room for all.
const WIDEST = 9u;
var<workgroup> parts: array<array<Words, WIDEST>, GROUP>;

fn put_sums(local: u32, sums: Sums, place: Place) {
    parts[local][0] = bitcast<Words>(sums.total);
    parts[local][1] = bitcast<Words>(sums.peak);
    parts[local][2] = bitcast<Words>(sums.area);
    parts[local][3] = sums.pressed;
    parts[local][4] = Words(sums.status);
    parts[local][5] = bitcast<Words>(place.u);
    parts[local][6] = bitcast<Words>(place.v);
    parts[local][7] = bitcast<Words>(place.depth);
    parts[local][8] = Words(sums.unusable);
}

fn number_at(local: u32, part: u32) -> Numbers {
    return bitcast<Numbers>(parts[local][part]);
}

fn sums_at(local: u32) -> Sums {
    return Sums(
        number_at(local, 0u),
        number_at(local, 1u),
        number_at(local, 2u),
        parts[local][3],
        first_of(parts[local][4]),
        first_of(parts[local][8]),
    );
}

fn place_at(local: u32) -> Place {
    return Place(number_at(local, 5u), number_at(local, 6u), number_at(local, 7u));
}

fn put_far(local: u32, far: Farthest) {
    parts[local][0] = bitcast<Words>(far.r1);
    parts[local][1] = bitcast<Words>(far.r2);
    parts[local][2] = bitcast<Words>(far.r3);
    parts[local][3] = far.m1;
    parts[local][4] = far.m2;
    parts[local][5] = bitcast<Words>(far.e1u);
    parts[local][6] = bitcast<Words>(far.e1v);
    parts[local][7] = bitcast<Words>(far.e2u);
    parts[local][8] = bitcast<Words>(far.e2v);
}

fn far_at(local: u32) -> Farthest {
    return Farthest(
        number_at(local, 0u),
        number_at(local, 1u),
        number_at(local, 2u),
        parts[local][3],
        parts[local][4],
        number_at(local, 5u),
        number_at(local, 6u),
        number_at(local, 7u),
        number_at(local, 8u),
    );
}

fn put_moments(local: u32, moments: Moments) {
    parts[local][0] = bitcast<Words>(moments.a);
    parts[local][1] = bitcast<Words>(moments.b);
    parts[local][2] = bitcast<Words>(moments.d);
}

fn moments_at(local: u32) -> Moments {
    return Moments(number_at(local, 0u), number_at(local, 1u), number_at(local, 2u));
}

@compute @workgroup_size(GROUP)
fn wide(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    let number = group_number(group, groups);
    if number >= batch.wide {
        return;
    }
    let index = wide_fields[number];
    let quad = group.y;
    let field = fields[index];
    let end = field.first + field.count;
    let first = at(0u, quad);
    let charted = field.charted != 0u;
    let touch = touch_of(field.first + local, end, GROUP, first, charted);
    put_sums(local, touch.sums, touch.place);
    for (var half = GROUP / 2u; half > 0u; half /= 2u) {
        workgroupBarrier();
        if local < half {
            let joined = join_places(place_at(local), place_at(local + half));
            put_sums(local, join_sums(sums_at(local), sums_at(local + half)), joined);
        }
    }
    workgroupBarrier();
    // Every invocation goes on with what all have found.
    let sums = sums_at(0u);
    let found = found_of(field, sums, place_at(0u));
    if local == 0u {
        store_sums(index, quad, sums, found.place);
    }
    let spread = spread_of(field.first + local, end, GROUP, first, found);
    var far = spread.far;
    var moments = spread.moments;
    if ORIENTED {
        workgroupBarrier();
        put_far(local, far);
        for (var half = GROUP / 2u; half > 0u; half /= 2u) {
            workgroupBarrier();
            if local < half {
                put_far(local, join_far(far_at(local), far_at(local + half)));
            }
        }
        far = far_at(0u);
    }
    if AXED {
        workgroupBarrier();
        put_moments(local, moments);
        for (var half = GROUP / 2u; half > 0u; half /= 2u) {
            workgroupBarrier();
            if local < half {
                put_moments(local, join_moments(moments_at(local), moments_at(local + half)));
            }
        }
        moments = moments_at(0u);
    }
    if local == 0u {
        finish_lines(index, quad, found, far, moments);
    }
}
