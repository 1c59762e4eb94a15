//! Skins for tests.

use glam::{DAffine3, DVec3};

use super::skin::{Reading, Skin, SkinParts, SkinTaxel};

/// A taxel at `position` with the `normal`.
pub(super) fn taxel(id: u32, position: DVec3, normal: DVec3, cell_m2: f64) -> SkinTaxel {
    let reading = Reading { newton_at_one: cell_m2, ..Reading::default() };
    SkinTaxel { id, link: 0, position, normal, mean_normal: normal, cell_m2, area_m2: cell_m2, reading }
}

/// A sheet of `columns` × `rows` taxels, `pitch_m` apart, in the plane z = 0, row by row along +x.
pub(super) fn grid(columns: u32, rows: u32, pitch_m: f64) -> Skin {
    Skin::from_parts(grid_parts(columns, rows, pitch_m))
}

/// The same with each place (x, y) at `at`, with its normal.
pub(super) fn grid_parts(columns: u32, rows: u32, pitch_m: f64) -> SkinParts {
    bent(columns, rows, pitch_m, false, |x, y| (DVec3::new(x, y, 0.0), DVec3::Z))
}

/// The same with each place (x, y) at `at`, with its normal; if it is `closed`, the last column is beside the first.
pub(super) fn bent(
    columns: u32,
    rows: u32,
    pitch_m: f64,
    closed: bool,
    at: impl Fn(f64, f64) -> (DVec3, DVec3),
) -> SkinParts {
    let place = |c: f64, r: f64| at(c * pitch_m, r * pitch_m);
    let node = |c: u32, r: u32| r * columns + c;
    let mut parts = SkinParts { body_from_link: vec![DAffine3::IDENTITY], ..SkinParts::default() };
    for (r, c) in (0..rows).flat_map(|r| (0..columns).map(move |c| (r, c))) {
        let (position, normal) = place(f64::from(c), f64::from(r));
        parts.taxels.push(taxel(node(c, r), position, normal, pitch_m * pitch_m));
        if c + 1 < columns || closed {
            parts.edges.push((node(c, r), node((c + 1) % columns, r)));
        }
        if r + 1 < rows {
            parts.edges.push((node(c, r), node(c, r + 1)));
        }
        // The cell in four by four squares.
        let corner = |i: u32, j: u32| {
            let off = |k: u32| f64::from(k) / 4.0 - 0.5;
            place(f64::from(c) + off(i), f64::from(r) + off(j)).0
        };
        for (i, j) in (0..4).flat_map(|i| (0..4).map(move |j| (i, j))) {
            let [a, b, d, e] = [corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)];
            parts.surface.extend([(node(c, r), [a, b, d]), (node(c, r), [a, d, e])]);
        }
    }
    parts
}

/// A sheet of about 1/`pitch_m`² taxels a square metre of `size_m`, scattered evenly but at no grid; neighbours are those within 1.6
/// pitches.
pub(super) fn scattered(size_m: [f64; 2], pitch_m: f64) -> SkinParts {
    let count = (size_m[0] * size_m[1] / (pitch_m * pitch_m)) as u32;
    let mut parts = SkinParts { body_from_link: vec![DAffine3::IDENTITY], ..SkinParts::default() };
    for id in 0..count {
        // Roberts's sequence.
        let [x, y] = [0.754_877_666_246_692_7, 0.569_840_290_998_053_3].map(|step| (step * f64::from(id + 1)).fract());
        let position = DVec3::new(x * size_m[0], y * size_m[1], 0.0);
        parts.taxels.push(taxel(id, position, DVec3::Z, pitch_m * pitch_m));
    }
    let near = |a: u32, b: u32| {
        let [p, q] = [a, b].map(|node| parts.taxels[node as usize].position);
        p.distance(q) < 1.6 * pitch_m
    };
    parts.edges = (0..count).flat_map(|a| (0..a).filter(move |&b| near(b, a)).map(move |b| (b, a))).collect();
    parts
}
