// What the stages from contact to principal_axis have in common, as they go over members together: a member's pressures are read
// once for the sums and the centroid, and once more for what needs the centroid.

@group(0) @binding(0) var<uniform> batch: Batch;
@group(0) @binding(1) var<storage, read> fields: array<Field>;
// 2: the members.
// Their third coordinate, for fields without a chart.
@group(0) @binding(3) var<storage, read> depths: array<f32>;
@group(0) @binding(4) var<storage, read> taxels: array<Taxel>;
// 5, and 6 where there is one: what the taxels say.
// Column by column, each frame by frame, each field by field. The first column are the cells' statuses.
@group(0) @binding(7) var<storage, read_write> results: array<u32>;

// A column that nobody wants is nowhere, and not computed. Each stage's file has those of its outputs.
const NOWHERE = 0xffffffffu;
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

fn is_charted(field: Field) -> bool {
    return (field.known & CHARTED) != 0u;
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
        let charted = Truths(is_charted(field));
        found.scale = scale_of(sums.total);
        found.lined = (sums.pressed > Words(1u)) & charted;
        let alone = (sums.pressed == Words(1u)) & charted;
        found.status |= select(Words(), Words(ONE_TAXEL), alone);
    }
    return found;
}

fn store_sums(index: u32, quad: u32, sums: Sums, place: Place) {
    store_contact(index, quad, sums);
    store_centroid(index, quad, place);
}

// Stores lines, and the cells' statuses.
fn finish_lines(index: u32, quad: u32, found: Found, far: Farthest, moments: Moments) {
    var status = found.status;
    if ORIENTED {
        let line = orientation_of(far, found.lined);
        status |= line.status;
        store_orientation(index, quad, line);
    }
    if AXED {
        let axis = axis_of(moments, found.total * found.scale, found.lined);
        status |= axis.status;
        store_axis(index, quad, axis);
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
