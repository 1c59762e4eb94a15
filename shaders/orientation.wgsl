// orientation: the line through the two farthest points (crates/engine/src/stage/orientation.rs).

override ORIENTATION_AT: u32 = NOWHERE;

const NEAR = 6.103515625e-5f;
const NOBODY = 0xffffffffu;

// The three largest squared distances, and the points and members of the two largest. Of equals the lower member is the
// larger.
struct Farthest {
    r1: Numbers,
    r2: Numbers,
    r3: Numbers,
    m1: Words,
    m2: Words,
    e1u: Numbers,
    e1v: Numbers,
    e2u: Numbers,
    e2v: Numbers,
}

fn nobody_far() -> Farthest {
    let nothing = Numbers(-1.0);
    let nobody = Words(NOBODY);
    return Farthest(nothing, nothing, nothing, nobody, nobody, Numbers(), Numbers(), Numbers(), Numbers());
}

// Takes in a point that is the farthest where `first`, and else the second farthest where `second`.
fn put(
    so_far: Farthest,
    r: Numbers,
    m: Words,
    u: Numbers,
    v: Numbers,
    first: Truths,
    second: Truths,
) -> Farthest {
    var far = so_far;
    far.r3 = select(max(far.r3, r), far.r2, first | second);
    far.r2 = select(select(far.r2, r, second), far.r1, first);
    far.m2 = select(select(far.m2, m, second), far.m1, first);
    far.e2u = select(select(far.e2u, u, second), far.e1u, first);
    far.e2v = select(select(far.e2v, v, second), far.e1v, first);
    far.r1 = select(far.r1, r, first);
    far.m1 = select(far.m1, m, first);
    far.e1u = select(far.e1u, u, first);
    far.e1v = select(far.e1v, v, first);
    return far;
}

// Members come in rising order: of equals the one that is there is the lower.
fn add_far(so_far: Farthest, m: u32, member: Member, pressure: Numbers, q: Numbers, place: Place) -> Farthest {
    let u = (member.u - place.u) * q;
    let v = (member.v - place.v) * q;
    let r = select(Numbers(-1.0), u * u + v * v, pressure > Numbers());
    return put(so_far, r, Words(m), u, v, r > so_far.r1, r > so_far.r2);
}

fn put_any(far: Farthest, r: Numbers, m: Words, u: Numbers, v: Numbers) -> Farthest {
    let first = (r > far.r1) | ((r == far.r1) & (m < far.m1));
    let second = (r > far.r2) | ((r == far.r2) & (m < far.m2));
    return put(far, r, m, u, v, first, second);
}

fn join_far(a: Farthest, b: Farthest) -> Farthest {
    var far = put_any(put_any(a, b.r1, b.m1, b.e1u, b.e1v), b.r2, b.m2, b.e2u, b.e2v);
    far.r3 = max(far.r3, b.r3);
    return far;
}

struct Line {
    angle: Numbers,
    status: Words,
}

// `lined` is where more than one taxel of a chart is pressed.
fn orientation_of(far: Farthest, lined: Truths) -> Line {
    let along_u = far.e1u - far.e2u;
    let along_v = far.e1v - far.e2v;
    let near = NEAR * sqrt(far.r1);
    let together = sqrt(along_u * along_u + along_v * along_v) <= near;
    let tie = (far.r3 >= Numbers()) & (sqrt(far.r2) - sqrt(max(far.r3, Numbers())) <= near);
    let status = select(Words(), Words(TIE), tie) | Words(ORIENTATION << PRESENT);
    let angle = select(line_angle(along_u, along_v), Numbers(), together | !lined);
    return Line(angle, select(Words(), select(status, Words(COINCIDENT), together), lined));
}

fn store_orientation(index: u32, quad: u32, line: Line) {
    store_numbers(ORIENTATION_AT, index, quad, line.angle);
}
