//! A pressure mat for a bed: 64 rows of 32 taxels, an inch apart; taxel id = 32 · row + column.
//!
//! The mat's frame: y up, origin in the middle of its underside. Row 0 is at the head, at −z; column 0 is at −x. Left
//! and right in the fields' names are those of somebody who looks down on the mat with the head end up.

use std::collections::BTreeMap;

use glam::DVec3;
use somatic::body::{FieldSpec, MemberSpec, Modality, Taxel};
use somatic::internal::body::{Glb, MeshData};

const ROWS: u32 = 64;
const COLUMNS: u32 = 32;
/// Distance between neighbours, m.
const PITCH: f64 = 0.0254;
const THICKNESS: f64 = 0.008;
/// From the outermost taxels' cells to the edge, m.
const BORDER: f64 = 0.02;
/// Radius of the outline's corners, m.
const CORNER: f64 = 0.03;
/// Radius of the rounded edges, m.
const EDGE: f64 = 0.003;

fn position(row: u32, column: u32) -> DVec3 {
    let from_middle = |index: u32, count: u32| PITCH * (f64::from(index) - (f64::from(count) - 1.0) / 2.0);
    DVec3::new(from_middle(column, COLUMNS), THICKNESS, from_middle(row, ROWS))
}

/// Rows, or columns, of taxels in one square of the faces' grids.
const TAXELS_A_SQUARE: u32 = 4;
/// Squares of a face's grid, along x and z.
const SQUARES: [u32; 2] = [COLUMNS / TAXELS_A_SQUARE, ROWS / TAXELS_A_SQUARE];

/// A point of the outline.
#[derive(Clone, Copy)]
struct OutlinePoint {
    /// The middle of its arc; beside a side, the point `CORNER` further in. x and z, m.
    centre: [f64; 2],
    outward: [f64; 2],
    /// The vertex of a face's grid, by column and row, that triangles join it with.
    inner: [u32; 2],
}

/// Where vertex `index` of a face's grid lies along x (0) or z (1), m. The grid covers the taxels' cells.
fn along(axis: usize, index: u32) -> f64 {
    PITCH * f64::from(TAXELS_A_SQUARE) * (f64::from(index) - f64::from(SQUARES[axis]) / 2.0)
}

/// A quarter of a circle: sine and cosine of angles from 0 to 90°.
fn quarter(steps: u32) -> impl DoubleEndedIterator<Item = (f64, f64)> {
    (0..=steps).map(move |k| {
        let angle = f64::from(k) / f64::from(steps) * std::f64::consts::FRAC_PI_2;
        (libm::sin(angle), libm::cos(angle))
    })
}

/// The outline, once around from +x over +z: rounded corners, and points beside the grid's lines along the sides.
fn outline() -> Vec<OutlinePoint> {
    let half = [PITCH * f64::from(COLUMNS) / 2.0 + BORDER, PITCH * f64::from(ROWS) / 2.0 + BORDER];
    let mut outline = Vec::new();
    for (corner, [x, z]) in [[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]].into_iter().enumerate() {
        let centre = [x * (half[0] - CORNER), z * (half[1] - CORNER)];
        let inner = [if x > 0.0 { SQUARES[0] } else { 0 }, if z > 0.0 { SQUARES[1] } else { 0 }];
        let mut arc: Vec<[f64; 2]> = quarter(6).map(|(sin, cos)| [x * cos, z * sin]).collect();
        // Each second arc runs the other way, so that the outline goes round once.
        if corner % 2 == 1 {
            arc.reverse();
        }
        outline.extend(arc.into_iter().map(|outward| OutlinePoint { centre, outward, inner }));
        // The side that follows, to the next corner: across the mat after the first and third corner, along it after the others.
        let axis = corner % 2;
        let mut lines: Vec<u32> = (1..SQUARES[axis]).collect();
        if corner < 2 {
            lines.reverse();
        }
        let mut outward = [0.0; 2];
        outward[1 - axis] = [z, x][axis];
        outline.extend(lines.into_iter().map(|line| {
            let (mut centre, mut inner) = (centre, inner);
            (centre[axis], inner[axis]) = (along(axis, line), line);
            OutlinePoint { centre, outward, inner }
        }));
    }
    outline
}

/// A slab: the same outline at several heights, drawn in where the edges are rounded, closed by a grid at each end. Its squares
/// keep triangles short: geodesic distances from a taxel cross few of them.
fn slab() -> MeshData {
    // From the underside outward, up, and in again: (inset, height, how far the normal looks out, and up).
    let mut rings: Vec<(f64, f64, f64, f64)> =
        quarter(4).map(|(sin, cos)| (EDGE * (1.0 - sin), EDGE * (1.0 - cos), sin, -cos)).collect();
    rings.extend(quarter(4).map(|(sin, cos)| (EDGE * (1.0 - cos), THICKNESS - EDGE * (1.0 - sin), cos, sin)));
    let outline = outline();
    let mut mesh = MeshData::default();
    let mut vertex = |position: DVec3, normal: DVec3| {
        mesh.positions.push(position.as_vec3().to_array());
        mesh.normals.push(normal.as_vec3().to_array());
        mesh.positions.len() as u32 - 1
    };
    let [underside, topside] = [(0.0, DVec3::NEG_Y), (THICKNESS, DVec3::Y)].map(|(height, normal)| {
        let first = vertex(DVec3::new(along(0, 0), height, along(1, 0)), normal);
        for place in 1..(SQUARES[0] + 1) * (SQUARES[1] + 1) {
            let [column, row] = [place % (SQUARES[0] + 1), place / (SQUARES[0] + 1)];
            vertex(DVec3::new(along(0, column), height, along(1, row)), normal);
        }
        first
    });
    let mut loops: Vec<Vec<u32>> = Vec::new();
    for (inset, height, out, up) in rings {
        let radius = CORNER - inset;
        let corners = outline.iter().map(|OutlinePoint { centre, outward, .. }| {
            let place = DVec3::new(centre[0] + outward[0] * radius, height, centre[1] + outward[1] * radius);
            vertex(place, DVec3::new(outward[0] * out, up, outward[1] * out))
        });
        loops.push(corners.collect());
    }
    let after = |k: usize| (k + 1) % outline.len();
    for pair in loops.windows(2) {
        for k in 0..outline.len() {
            let [a, b, c, d] = [pair[0][k], pair[0][after(k)], pair[1][k], pair[1][after(k)]];
            mesh.triangles.extend([[a, c, b], [b, c, d]]);
        }
    }
    for (first, ring, is_top) in [(underside, &loops[0], false), (topside, &loops[loops.len() - 1], true)] {
        let at = |[column, row]: [u32; 2]| first + row * (SQUARES[0] + 1) + column;
        let mut add = |[a, b, c]: [u32; 3]| mesh.triangles.push(if is_top { [a, c, b] } else { [a, b, c] });
        for k in 0..outline.len() {
            let [inner, next] = [outline[k].inner, outline[after(k)].inner].map(at);
            add([inner, ring[k], ring[after(k)]]);
            if inner != next {
                add([inner, ring[after(k)], next]);
            }
        }
        for row in 0..SQUARES[1] {
            for column in 0..SQUARES[0] {
                let [near, right] = [at([column, row]), at([column + 1, row])];
                let [up, far] = [at([column, row + 1]), at([column + 1, row + 1])];
                add([near, right, far]);
                add([near, far, up]);
            }
        }
    }
    mesh
}

/// A field of the taxels in `rows` × `columns`, at their middle.
fn add_field(
    glb: &mut Glb,
    mat: usize,
    name: &str,
    parent: &str,
    rows: std::ops::Range<u32>,
    columns: std::ops::Range<u32>,
) {
    let middle = (position(rows.start, columns.start) + position(rows.end - 1, columns.end - 1)) / 2.0;
    let ids = rows.flat_map(|row| columns.clone().map(move |column| COLUMNS * row + column));
    let field = FieldSpec {
        name: name.to_owned(),
        parent: Some(parent.to_owned()),
        members: ids.map(|id| (id, MemberSpec::default())).collect(),
        chart: None,
    };
    glb.field(&field, Some(mat), middle);
}

/// Makes the mat.
pub(crate) fn make() -> Glb {
    let mut glb = Glb::new();
    glb.describe(&BTreeMap::from([
        ("title", "A pressure mat of 64 rows and 32 columns"),
        ("taxel_id", "32 * row + column; row 0 at the head"),
    ]));
    let fabric = glb.material("fabric", [0.25, 0.32, 0.42], 0.9);
    let mat = glb.node("mat", None, DVec3::ZERO);
    glb.mesh(mat, "mat", &slab(), Some(fabric), None);
    let taxels: Vec<Taxel> = (0..ROWS * COLUMNS)
        .map(|id| Taxel {
            id,
            link: 0,
            position_in_link: position(id / COLUMNS, id % COLUMNS),
            normal_in_link: DVec3::Y,
            area: PITCH * PITCH,
            modality: Modality::Pressure,
            tangent_in_link: None,
        })
        .collect();
    glb.taxels("mat taxels", Some(mat), &taxels, None);

    let whole = FieldSpec { name: "mat".to_owned(), ..FieldSpec::default() };
    glb.field(&whole, Some(mat), DVec3::Y * THICKNESS);
    for band in 0..7 {
        add_field(&mut glb, mat, &format!("mat/band_{}", band + 1), "mat", 8 * band..8 * band + 16, 0..COLUMNS);
    }
    // Quadrants reach four taxels into each other; the patches under each tile the quarter that is its own.
    for (half, rows) in [("head", 0..36), ("foot", 28..64)] {
        for (side, columns) in [("left", 0..18), ("right", 14..32)] {
            add_field(&mut glb, mat, &format!("mat/quadrant_{half}_{side}"), "mat", rows.clone(), columns);
        }
    }
    for row in 0..16 {
        for column in 0..8 {
            let half = if row < 8 { "head" } else { "foot" };
            let side = if column < 4 { "left" } else { "right" };
            let name = format!("mat/patch_r{row:02}_c{column:02}");
            let parent = format!("mat/quadrant_{half}_{side}");
            add_field(&mut glb, mat, &name, &parent, 4 * row..4 * row + 4, 4 * column..4 * column + 4);
        }
    }
    glb
}
