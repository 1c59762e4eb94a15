// Wide fields: each, and a quad of frames, by a whole group, whose invocations take every 64th member; or in parts, each by
// a whole group, so that each invocation has members. Then come first all parts' sums; from what these make of the field, all parts' lines; and
// one group a field puts those together. Besides being faster, it must be so: lavapipe ends any shader's loops after 65,535
// rounds in all, without a word.

// In place of fields.
@group(0) @binding(1) var<storage, read> parts: array<Part>;

// What one has found, as bits, as many words as the largest of the kinds that there are.
alias Bits = array<Words, 9>;

// Of each part, quad by quad, one of each kind.
@group(0) @binding(8) var<storage, read_write> by_parts: array<Bits>;
const TOUCHES = 0u;
const FARTHESTS = 1u;
const MOMENTS = 2u;
const KINDS = 3u;

fn of_part(number: u32, quad: u32, kind: u32) -> u32 {
    return (number * quads() + quad) * KINDS + kind;
}

// Of each invocation, of one kind after the other, as there is no room for all.
var<workgroup> by_invocations: array<Bits, GROUP>;
const_assert GROUP == 64u;

fn bits_of_touch(touch: Touch) -> Bits {
    return Bits(
        bitcast<Words>(touch.sums.total),
        bitcast<Words>(touch.sums.peak),
        bitcast<Words>(touch.sums.area),
        touch.sums.pressed,
        Words(touch.sums.status),
        Words(touch.sums.unusable),
        bitcast<Words>(touch.place.u),
        bitcast<Words>(touch.place.v),
        bitcast<Words>(touch.place.depth),
    );
}

fn touch_of_bits(bits: Bits) -> Touch {
    let sums = Sums(
        bitcast<Numbers>(bits[0]),
        bitcast<Numbers>(bits[1]),
        bitcast<Numbers>(bits[2]),
        bits[3],
        first_of(bits[4]),
        first_of(bits[5]),
    );
    let place = Place(bitcast<Numbers>(bits[6]), bitcast<Numbers>(bits[7]), bitcast<Numbers>(bits[8]));
    return Touch(sums, place);
}

fn bits_of_far(far: Farthest) -> Bits {
    return Bits(
        bitcast<Words>(far.r1),
        bitcast<Words>(far.r2),
        bitcast<Words>(far.r3),
        far.m1,
        far.m2,
        bitcast<Words>(far.e1u),
        bitcast<Words>(far.e1v),
        bitcast<Words>(far.e2u),
        bitcast<Words>(far.e2v),
    );
}

fn far_of_bits(bits: Bits) -> Farthest {
    return Farthest(
        bitcast<Numbers>(bits[0]),
        bitcast<Numbers>(bits[1]),
        bitcast<Numbers>(bits[2]),
        bits[3],
        bits[4],
        bitcast<Numbers>(bits[5]),
        bitcast<Numbers>(bits[6]),
        bitcast<Numbers>(bits[7]),
        bitcast<Numbers>(bits[8]),
    );
}

fn bits_of_moments(moments: Moments) -> Bits {
    var bits: Bits;
    bits[0] = bitcast<Words>(moments.a);
    bits[1] = bitcast<Words>(moments.b);
    bits[2] = bitcast<Words>(moments.d);
    return bits;
}

fn moments_of_bits(bits: Bits) -> Moments {
    return Moments(bitcast<Numbers>(bits[0]), bitcast<Numbers>(bits[1]), bitcast<Numbers>(bits[2]));
}

// As many as two of a kind know together.
fn joined(a: Bits, b: Bits, kind: u32) -> Bits {
    switch kind {
        case TOUCHES: {
            let left = touch_of_bits(a);
            let right = touch_of_bits(b);
            return bits_of_touch(Touch(join_sums(left.sums, right.sums), join_places(left.place, right.place)));
        }
        case FARTHESTS: {
            return bits_of_far(join_far(far_of_bits(a), far_of_bits(b)));
        }
        default: {
            return bits_of_moments(join_moments(moments_of_bits(a), moments_of_bits(b)));
        }
    }
}

// What one invocation of a group finds in its share of a field's members, or of a part's.
fn touch_of_members(members: Field, quad: u32, local: u32) -> Touch {
    let end = members.first + members.count;
    return touch_of(members.first + local, end, GROUP, at(0u, quad), is_charted(members));
}

fn lines_of_members(members: Field, quad: u32, local: u32, found: Found) -> Spread {
    let end = members.first + members.count;
    if is_charted(members) {
        return spread_of(members.first + local, end, GROUP, at(0u, quad), found);
    }
    return Spread(nobody_far(), no_moments());
}

// Joins what eight invocations have, `apart` of each other, in three levels; the first then has it.
fn join_eight(first: u32, apart: u32, kind: u32) {
    for (var step = 1u; step < 8u; step *= 2u) {
        for (var k = 0u; k < 8u; k += 2u * step) {
            let to = first + k * apart;
            by_invocations[to] = joined(by_invocations[to], by_invocations[to + step * apart], kind);
        }
    }
}

// What all 64 invocations of a group have found together; each is told. By eights, as lavapipe computes for all invocations
// what only some need, and changes between them at each barrier: halving has six.
fn of_group(local: u32, own: Bits, kind: u32) -> Bits {
    by_invocations[local] = own;
    workgroupBarrier();
    if local < 8u {
        join_eight(8u * local, 1u, kind);
    }
    workgroupBarrier();
    if local == 0u {
        join_eight(0u, 8u, kind);
    }
    workgroupBarrier();
    let all = by_invocations[0];
    // The next kind takes the same room.
    workgroupBarrier();
    return all;
}

@compute @workgroup_size(GROUP)
fn whole(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    let row = group_number(group, groups);
    if row >= arrayLength(&fields) {
        return;
    }
    let field = fields[row];
    let quad = group.y;
    let own = touch_of_members(field, quad, local);
    let touch = touch_of_bits(of_group(local, bits_of_touch(own), TOUCHES));
    let found = found_of(field, touch.sums, touch.place);
    var spread = lines_of_members(field, quad, local, found);
    if ORIENTED {
        spread.far = far_of_bits(of_group(local, bits_of_far(spread.far), FARTHESTS));
    }
    if AXED {
        spread.moments = moments_of_bits(of_group(local, bits_of_moments(spread.moments), MOMENTS));
    }
    if local == 0u {
        store_sums(field.index, quad, touch.sums, found.place);
        finish_lines(field.index, quad, found, spread.far, spread.moments);
    }
}

// What all parts of `part`'s field have found together; `nothing` is what a part without members would have.
fn of_all_parts(part: Part, quad: u32, local: u32, nothing: Bits, kind: u32) -> Bits {
    var some = nothing;
    for (var p = part.first + local; p < part.first + part.count; p += GROUP) {
        some = joined(some, by_parts[of_part(p, quad, kind)], kind);
    }
    return of_group(local, some, kind);
}

fn touch_of_all_parts(part: Part, quad: u32, local: u32) -> Touch {
    var nothing = Touch(no_sums(), no_place());
    nothing.sums.unusable = 0xffffffffu;
    return touch_of_bits(of_all_parts(part, quad, local, bits_of_touch(nothing), TOUCHES));
}

@compute @workgroup_size(GROUP)
fn sums(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    let row = group_number(group, groups);
    if row >= arrayLength(&parts) {
        return;
    }
    let part = parts[row];
    let quad = group.y;
    let own = touch_of_members(part.members, quad, local);
    let all = of_group(local, bits_of_touch(own), TOUCHES);
    if local == 0u {
        by_parts[of_part(part.number, quad, TOUCHES)] = all;
    }
}

// `m` counted among all members of a field, wherever the tables lie that they are in.
fn in_field(part: Part, m: Words) -> Words {
    return select(m - Words(part.members.first) + Words(part.before), m, m == Words(NOBODY));
}

@compute @workgroup_size(GROUP)
fn lines(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    let row = group_number(group, groups);
    if row >= arrayLength(&parts) {
        return;
    }
    let part = parts[row];
    let quad = group.y;
    let touch = touch_of_all_parts(part, quad, local);
    let found = found_of(part.members, touch.sums, touch.place);
    var spread = lines_of_members(part.members, quad, local, found);
    if ORIENTED {
        spread.far.m1 = in_field(part, spread.far.m1);
        spread.far.m2 = in_field(part, spread.far.m2);
        let all = of_group(local, bits_of_far(spread.far), FARTHESTS);
        if local == 0u {
            by_parts[of_part(part.number, quad, FARTHESTS)] = all;
        }
    }
    if AXED {
        let all = of_group(local, bits_of_moments(spread.moments), MOMENTS);
        if local == 0u {
            by_parts[of_part(part.number, quad, MOMENTS)] = all;
        }
    }
}

// `parts` are each wide field's first.
@compute @workgroup_size(GROUP)
fn ends(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    let row = group_number(group, groups);
    if row >= arrayLength(&parts) {
        return;
    }
    let part = parts[row];
    let quad = group.y;
    let touch = touch_of_all_parts(part, quad, local);
    let found = found_of(part.members, touch.sums, touch.place);
    var far = nobody_far();
    var moments = no_moments();
    if ORIENTED {
        far = far_of_bits(of_all_parts(part, quad, local, bits_of_far(far), FARTHESTS));
    }
    if AXED {
        moments = moments_of_bits(of_all_parts(part, quad, local, bits_of_moments(moments), MOMENTS));
    }
    if local == 0u {
        store_sums(part.members.index, quad, touch.sums, found.place);
        finish_lines(part.members.index, quad, found, far, moments);
    }
}
