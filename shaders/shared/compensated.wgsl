// Compensated sums (Sums in crates/engine/src/stage/mod.rs): Kahan's, which carries along what each addition has too much.

override COMPENSATED: bool = false;

// A sum, and what it has too much.
struct Kept {
    sum: Numbers,
    over: Numbers,
}

// `x`, about which a compiler knows nothing: (a + b) - a would be b to it, and nothing left to carry. No batch has 2^31
// frames.
fn opaque(x: Numbers) -> Numbers {
    return bitcast<Numbers>(bitcast<Words>(x) ^ Words(batch.frames >> 31u));
}

fn add_kept(sum: Numbers, over: Numbers, term: Numbers) -> Kept {
    let more = opaque(term - over);
    let next = opaque(sum + more);
    return Kept(next, opaque(next - sum) - more);
}

// What sums over a field have too much.
struct Over {
    total: Numbers,
    u: Numbers,
    v: Numbers,
    depth: Numbers,
}

fn nothing_over() -> Over {
    return Over(Numbers(), Numbers(), Numbers(), Numbers());
}

// A total and a place, and what they have too much.
struct Kepts {
    total: Numbers,
    place: Place,
    over: Over,
}

// Adds a member to `total` and `place` with care.
fn add_with_care(
    total: Numbers,
    place: Place,
    over: Over,
    m: u32,
    member: Member,
    pull: Numbers,
    charted: bool,
) -> Kepts {
    var kepts = Kepts(total, place, over);
    let sum = add_kept(total, over.total, pull);
    kepts.total = sum.sum;
    kepts.over.total = sum.over;
    if CENTRED {
        let u = add_kept(place.u, over.u, pull * member.u);
        let v = add_kept(place.v, over.v, pull * member.v);
        kepts.place.u = u.sum;
        kepts.place.v = v.sum;
        kepts.over.u = u.over;
        kepts.over.v = v.over;
        if DEPTH_AT != NOWHERE && !charted {
            let depth = add_kept(place.depth, over.depth, pull * depths[m]);
            kepts.place.depth = depth.sum;
            kepts.over.depth = depth.over;
        }
    }
    return kepts;
}

fn less(place: Place, over: Over) -> Place {
    return Place(place.u - over.u, place.v - over.v, place.depth - over.depth);
}

// Moments, and what they have too much.
struct KeptMoments {
    sums: Moments,
    over: Moments,
}

fn add_moments_with_care(so_far: Moments, over: Moments, member: Member, q: Numbers, place: Place) -> KeptMoments {
    let x = member.u - place.u;
    let y = member.v - place.v;
    let qx = q * x;
    let a = add_kept(so_far.a, over.a, qx * x);
    let b = add_kept(so_far.b, over.b, qx * y);
    let d = add_kept(so_far.d, over.d, (q * y) * y);
    return KeptMoments(Moments(a.sum, b.sum, d.sum), Moments(a.over, b.over, d.over));
}

fn less_moments(moments: Moments, over: Moments) -> Moments {
    return Moments(moments.a - over.a, moments.b - over.b, moments.d - over.d);
}
