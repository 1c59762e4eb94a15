// principal_axis: the axis of the second moments (crates/engine/src/stage/principal_axis.rs).

override PRINCIPAL_AXIS_AT: u32 = NOWHERE;
override ANISOTROPY_AT: u32 = NOWHERE;

const TOGETHER = 9.313225746154785e-10f;
const ISOTROPIC_UNDER = 1e-3f;

// The moments (a b; b d).
struct Moments {
    a: Numbers,
    b: Numbers,
    d: Numbers,
}

fn no_moments() -> Moments {
    return Moments(Numbers(), Numbers(), Numbers());
}

fn add_moments(so_far: Moments, member: Member, q: Numbers, place: Place) -> Moments {
    let x = member.u - place.u;
    let y = member.v - place.v;
    let qx = q * x;
    return Moments(so_far.a + qx * x, so_far.b + qx * y, so_far.d + (q * y) * y);
}

fn join_moments(a: Moments, b: Moments) -> Moments {
    return Moments(a.a + b.a, a.b + b.b, a.d + b.d);
}

struct Axis {
    angle: Numbers,
    anisotropy: Numbers,
    status: Words,
}

// `scaled` is the total as the moments' weights are scaled; `lined`, where more than one taxel of a chart is pressed.
fn axis_of(moments: Moments, scaled: Numbers, lined: Truths) -> Axis {
    let trace = moments.a + moments.d;
    let together = trace <= TOGETHER * scaled;
    let x = moments.a - moments.d;
    let y = 2.0 * moments.b;
    let h = sqrt(x * x + y * y);
    let anisotropy = min(h / trace, Numbers(1.0));
    let isotropic = anisotropy < Numbers(ISOTROPIC_UNDER);
    // Half the angle of (x, y), as a line's: of two equal forms the one that adds numbers of one sign.
    let broad = x >= Numbers();
    let angle = line_angle(select(y, h + x, broad), select(h - x, y, broad));
    let some = Words(ISOTROPIC | (ANISOTROPY << PRESENT));
    let status = select(Words((PRINCIPAL_AXIS | ANISOTROPY) << PRESENT), some, isotropic);
    let nothing = Numbers();
    return Axis(
        select(angle, nothing, isotropic | together | !lined),
        select(anisotropy, nothing, together | !lined),
        select(Words(), select(status, Words(COINCIDENT), together), lined),
    );
}

fn store_axis(index: u32, quad: u32, axis: Axis) {
    store_numbers(PRINCIPAL_AXIS_AT, index, quad, axis.angle);
    store_numbers(ANISOTROPY_AT, index, quad, axis.anisotropy);
}
