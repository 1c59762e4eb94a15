//! Meshes that MuJoCo makes itself, of those that are meant for tactile sensors.

use glam::DVec3;

use super::model::TouchGrid;
use crate::error::{Error, Result, failed};
use crate::limits::MAX_CELLS;
use crate::mesh::triangles::Triangles;

/// Most vertices along one side.
const MAX_SIDE: f64 = 4096.0;

/// The mesh called `kind` with these parameters.
pub(super) fn make(kind: &str, params: &[f64]) -> Result<Triangles> {
    let side = |x: f64| {
        let is_count = x.fract() == 0.0 && (2.0..=MAX_SIDE).contains(&x);
        if is_count { Ok(x as u32) } else { Err(failed!("`params` has {x} vertices; give 2 to {MAX_SIDE}")) }
    };
    let grid = |x: f64, y: f64, fov_deg, gamma| {
        Ok::<_, Error>(TouchGrid { size: [side(x)?, side(y)?], fov_deg, gamma, channels: 1 })
    };
    if let &[x, y, ..] = params
        && x * y > MAX_CELLS as f64
    {
        return Err(failed!("`params` has {x} × {y} vertices; give at most {MAX_CELLS}"));
    }
    match (kind, params) {
        ("plate", &[x, y]) => Ok(plate(side(x)?, side(y)?)),
        ("wedge", &[x, y, fov_x, fov_y, gamma]) => Ok(wedge(&grid(x, y, [fov_x, fov_y], gamma)?)),
        ("plate" | "wedge", _) => Err(failed!("`params` of a {kind} has {} numbers", params.len())),
        // Other kinds may be seen, but are not meant for skin.
        _ => Ok(Triangles::default()),
    }
}

/// A vertex in the middle of each cell of the side of a cube, two long, that looks along −z.
fn plate(columns: u32, rows: u32) -> Triangles {
    let along = |index: u32, count: u32| (2.0 * f64::from(index) + 1.0) / f64::from(count) - 1.0;
    sheet(columns, rows, |column, row| DVec3::new(along(column, columns), along(row, rows), -1.0))
}

/// A vertex in the middle of each bin of a touch grid, at a distance of one.
fn wedge(grid: &TouchGrid) -> Triangles {
    let [columns, rows] = grid.size;
    sheet(columns, rows, |column, row| {
        let [[a0, a1], [e0, e1]] = grid.bin(row * columns + column);
        TouchGrid::direction((a0 + a1) / 2.0, (e0 + e1) / 2.0)
    })
}

/// Columns of vertices one after the other, with triangles between them that look along −z.
fn sheet(columns: u32, rows: u32, at: impl Fn(u32, u32) -> DVec3) -> Triangles {
    let mut mesh = Triangles::default();
    for column in 0..columns {
        mesh.positions.extend((0..rows).map(|row| at(column, row)));
    }
    for column in 0..columns - 1 {
        for row in 0..rows - 1 {
            let corner = |column: u32, row: u32| column * rows + row;
            let [a, b] = [corner(column, row), corner(column + 1, row)];
            let [c, d] = [corner(column + 1, row + 1), corner(column, row + 1)];
            mesh.triangles.extend([[a, c, b], [a, d, c]]);
        }
    }
    mesh
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn meshes_are_those_of_mujoco() {
        let plate = make("plate", &[3.0, 4.0]).unwrap();
        assert_eq!((plate.positions.len(), plate.triangles.len()), (12, 12));
        assert!(plate.positions[1].distance(DVec3::new(-2.0 / 3.0, -0.25, -1.0)) < 1e-12);
        let [a, b, c] = plate.triangles[0].map(|v| plate.positions[v as usize]);
        assert!((b - a).cross(c - a).z < 0.0);
        // As MuJoCo 4.0 has them, at a scale of 0.3.
        for (gamma, index, place) in [
            (0.0, 0, [-0.13703, -0.12202, -0.23735]),
            (0.0, 9, [0.0, 0.12202, -0.27406]),
            (1.0, 1, [-0.11523, -0.00613, -0.27692]),
        ] {
            let wedge = make("wedge", &[3.0, 5.0, 45.0, 30.0, gamma]).unwrap();
            assert!((0.3 * wedge.positions[index]).distance(DVec3::from_array(place)) < 1e-5, "{gamma}, {index}");
        }
        assert!(make("plate", &[4000.0, 4000.0]).unwrap_err().to_string().contains("at most 1000000"));
        assert!(make("plate", &[3.0]).is_err() && make("plate", &[1.0, 3.0]).is_err());
        assert!(make("cone", &[3.0]).unwrap().positions.is_empty());
    }
}
