// Angles of lines, as crates/engine/src/stage/angle.rs has them; the built-in atan2 may be off by 4096 ulp.

const PI = 3.1415927f;
const HALF_PI = 1.5707964f;

// atan2(y, x) for y >= 0, in [0, pi].
fn atan2_upper(y: f32, x: f32) -> f32 {
    let wide = abs(x);
    let low = min(wide, y);
    let high = max(wide, y);
    var a = 0.0;
    if high > 0.0 {
        a = low / high;
    }
    let z = a * a;
    var q = -0.0017936205f;
    q = q * z + 0.010914601f;
    q = q * z - 0.031177837f;
    q = q * z + 0.057957586f;
    q = q * z - 0.084034505f;
    q = q * z + 0.10952186f;
    q = q * z - 0.14264242f;
    q = q * z + 0.19998549f;
    q = q * z - 0.333333f;
    let octant = a + (a * z) * q;
    let quadrant = select(octant, HALF_PI - octant, y > wide);
    return select(quadrant, PI - quadrant, x < 0.0);
}

// atan2(y, x) in (-pi, pi]; the largest single-precision number in there is a little under this pi.
fn full_angle(x: f32, y: f32) -> f32 {
    let size = min(atan2_upper(abs(y), x), 3.1415925f);
    return select(size, -size, y < 0.0);
}

// The angle of the line along (x, y), in [0, pi).
fn angle_of_line(x: f32, y: f32) -> f32 {
    let flip = y < 0.0 || (y == 0.0 && x < 0.0);
    let turned = atan2_upper(abs(y), select(x, -x, flip));
    // This pi lies above the real one.
    return select(turned, 0.0, turned >= PI);
}
