// A body's surface and its taxels, seen from one side: parallel projection, light that goes with the eye.
// Colours are linear. The structs stand in crates/engine/src/backend/gpu/raster.rs.

struct View {
    clip_from_world: mat4x4<f32>,
    // Unit vectors of the eye, in the world: to its right, up, and towards it.
    right: vec4<f32>,
    up: vec4<f32>,
    towards: vec4<f32>,
}

@group(0) @binding(0) var<uniform> view: View;

struct Shaded {
    @builtin(position) position: vec4<f32>,
    @location(0) normal: vec3<f32>,
    @location(1) colour: vec3<f32>,
    // How much of its colour depends on the light.
    @location(2) @interpolate(flat) shaded: f32,
}

@vertex
fn surface(@location(0) position: vec3<f32>, @location(1) normal: vec3<f32>) -> Shaded {
    return Shaded(view.clip_from_world * vec4(position, 1.0), normal, vec3(0.60, 0.585, 0.56), 1.0);
}

// How much light a surface of this normal gives back: from over the left shoulder, some from the right, and a little
// from everywhere, more from above.
fn light(normal: vec3<f32>) -> f32 {
    let seen = vec3(dot(normal, view.right.xyz), dot(normal, view.up.xyz), dot(normal, view.towards.xyz));
    let over_shoulder = max(dot(seen, normalize(vec3(-0.45, 0.6, 0.8))), 0.0);
    let from_right = max(dot(seen, normalize(vec3(0.8, 0.1, 0.35))), 0.0);
    return 0.20 + 0.06 * seen.y + 0.72 * over_shoulder + 0.14 * from_right;
}

@fragment
fn surface_colour(shaded: Shaded, @builtin(front_facing) outside: bool) -> @location(0) vec4<f32> {
    let normal = normalize(shaded.normal);
    // The inside of an open mesh is darker, and lit as what is seen of it.
    if dot(normal, view.towards.xyz) < 0.0 && !outside {
        return vec4(0.45 * shaded.colour * light(-normal), 1.0);
    }
    return vec4(shaded.colour * light(normal), 1.0);
}

// A piece of a disc, as a fan of triangles of 3 vertices each: corner 0 of each is the middle.
override TRIANGLES: u32 = 16u;

@vertex
fn slice(
    @builtin(vertex_index) vertex: u32,
    // Middle and radius; normal and how far it is lifted towards the eye, in radii; colour; start and sweep, rad.
    @location(0) middle: vec4<f32>,
    @location(1) normal: vec4<f32>,
    @location(2) colour: vec4<f32>,
    @location(3) span: vec4<f32>,
) -> Shaded {
    let n = normal.xyz;
    // Any two directions across the normal, without a jump where it can be seen (Duff and others, 2017).
    let side = select(-1.0, 1.0, n.z >= 0.0);
    let a = -1.0 / (side + n.z);
    let b = n.x * n.y * a;
    let u = vec3(1.0 + side * n.x * n.x * a, side * b, -side * n.x);
    let v = vec3(b, side + n.y * n.y * a, -n.y);
    let corner = vertex % 3u;
    let step = f32(vertex / 3u + max(corner, 1u) - 1u) / f32(TRIANGLES);
    let angle = span.x + span.y * step;
    let out = select(middle.w, 0.0, corner == 0u);
    var at = middle.xyz + out * (cos(angle) * u + sin(angle) * v);
    at += normal.w * middle.w * view.towards.xyz;
    var position = view.clip_from_world * vec4(at, 1.0);
    // One that looks away is on the other side, even where nothing hides it.
    if dot(n, view.towards.xyz) < 0.02 {
        position = vec4(2.0, 2.0, 2.0, 1.0);
    }
    return Shaded(position, n, colour.rgb, colour.a);
}

@fragment
fn slice_colour(shaded: Shaded) -> @location(0) vec4<f32> {
    // Light enough that a colour stays what the legend says.
    let shade = 0.45 * shaded.shaded;
    return vec4(shaded.colour * (1.0 - shade + shade * light(normalize(shaded.normal))), 1.0);
}
