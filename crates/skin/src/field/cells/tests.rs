use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3};

use super::*;
use crate::body::SurfaceIndex;

/// Points of [0, 1)² that lie irregularly, but not at random (Roberts's sequence).
fn scattered(count: u32) -> impl Iterator<Item = DVec2> {
    (1..=count).map(|i| DVec2::new(0.754_877_666_246_692_7, 0.569_840_290_998_053_3) * f64::from(i)).map(DVec2::fract)
}

/// A sheet of `columns` × `rows` squares over [0, 1]² with diagonals that alternate, each corner where `shape` takes it.
fn sheet(columns: u32, rows: u32, shape: impl Fn(DVec2) -> DVec3) -> Topology {
    let at = |c: u32, r: u32| shape(DVec2::new(f64::from(c) / f64::from(columns), f64::from(r) / f64::from(rows)));
    let positions: Vec<DVec3> =
        (0..=rows).flat_map(|r| (0..=columns).map(move |c| (c, r))).map(|(c, r)| at(c, r)).collect();
    let vertex = |c: u32, r: u32| r * (columns + 1) + c;
    let squares = (0..rows).flat_map(|r| (0..columns).map(move |c| (c, r)));
    let triangles: Vec<[u32; 3]> = squares
        .flat_map(|(c, r)| {
            let [a, b, d, e] = [vertex(c, r), vertex(c + 1, r), vertex(c + 1, r + 1), vertex(c, r + 1)];
            if (c + r) % 2 == 0 { [[a, b, d], [a, d, e]] } else { [[a, b, e], [b, d, e]] }
        })
        .collect();
    Topology::new(&positions, &triangles)
}

/// A sphere of radius 1 with 8·4ⁿ triangles.
pub(super) fn sphere(cuts: u32) -> Topology {
    let mut soup: Vec<[DVec3; 3]> = (0..8_u32)
        .map(|octant| {
            let sign = |axis: u32| if octant >> axis & 1 == 0 { 1.0 } else { -1.0 };
            let [x, y, z] = [DVec3::X * sign(0), DVec3::Y * sign(1), DVec3::Z * sign(2)];
            if sign(0) * sign(1) * sign(2) > 0.0 { [x, y, z] } else { [x, z, y] }
        })
        .collect();
    for _ in 0..cuts {
        let cut = |[a, b, c]: [DVec3; 3]| {
            let [ab, bc, ca] = [(a + b).normalize(), (b + c).normalize(), (c + a).normalize()];
            [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
        };
        soup = soup.into_iter().flat_map(cut).collect();
    }
    let triangles: Vec<[u32; 3]> = (0..soup.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    Topology::new(&soup.concat(), &triangles)
}

pub(super) fn places(topology: &Topology, points: &[DVec3]) -> Vec<SurfacePlace> {
    let index = SurfaceIndex::of_triangles((0..topology.triangles.len() as u32).map(|t| topology.corners(t)));
    let place = |&p: &DVec3| {
        let hit = index.nearest(p).unwrap();
        SurfacePlace::in_triangle(topology, hit.triangle as u32, hit.position)
    };
    points.iter().map(place).collect()
}

/// Per point the area that a raster counts, of `fine`² cells a triangle, by `distance`; and the pairs of points that share a
/// border between neighbouring cells of it.
fn counted(topology: &Topology, points: usize, fine: u32, distance: impl Fn(DVec3, usize) -> f64) -> Vec<f64> {
    let mut areas = vec![0.0; points];
    for triangle in 0..topology.triangles.len() as u32 {
        let [a, b, c] = topology.corners(triangle);
        let each = area_vector([a, b, c]).length() / 2.0 / f64::from(fine * fine);
        for row in 0..fine {
            for column in 0..2 * (fine - row) - 1 {
                // The middles of the small triangles, upright and upside down.
                let shift = if column % 2 == 0 { 1.0 / 3.0 } else { 2.0 / 3.0 };
                let u = (f64::from(column / 2) + shift) / f64::from(fine);
                let v = (f64::from(row) + shift) / f64::from(fine);
                let p = a + (b - a) * u + (c - a) * v;
                let nearest = (0..points).min_by(|&i, &j| distance(p, i).total_cmp(&distance(p, j)));
                areas[nearest.unwrap()] += each;
            }
        }
    }
    areas
}

/// Asserts that each of `areas` is `wanted` within the share `within` of their mean, and both sums the same.
fn assert_near(areas: &[f64], wanted: &[f64], within: f64) {
    let mean = wanted.iter().sum::<f64>() / wanted.len() as f64;
    assert!((areas.iter().sum::<f64>() / wanted.len() as f64 / mean - 1.0).abs() < 1e-9);
    for (index, (area, wanted)) in areas.iter().zip(wanted).enumerate() {
        assert!((area - wanted).abs() < within * mean, "{index}: {area} instead of {wanted}, of {mean} in the mean");
    }
}

#[test]
fn on_a_plane_cells_are_those_of_the_plane_on_any_mesh() {
    let points: Vec<DVec3> = scattered(60).map(|p| p.extend(0.0)).collect();
    let exact = counted(&sheet(1, 1, |p| p.extend(0.0)), points.len(), 160, |p, i| p.distance_squared(points[i]));
    let mut all = Vec::new();
    for (columns, rows) in [(1, 1), (7, 5), (60, 2), (40, 40)] {
        let topology = sheet(columns, rows, |p| DVec2::new(p.x * p.x, p.y).extend(0.0));
        let cells = Cells::new(&topology, &places(&topology, &points));
        // The raster's own error: some of its 800 squares a cell are half on the other side of a border.
        assert_near(&cells.areas, &exact, 0.025);
        assert!(cells.pieces.is_empty());
        all.push(cells);
    }
    for other in &all[1..] {
        for (area, wanted) in other.areas.iter().zip(&all[0].areas) {
            assert!((area - wanted).abs() < 1e-5 * wanted, "{area} and {wanted}");
        }
        let long = |cells: &Cells| -> Vec<(u32, u32)> {
            cells.borders.iter().filter(|(_, border)| border.length_m > 1e-4).map(|(&pair, _)| pair).collect()
        };
        assert_eq!(long(other), long(&all[0]));
    }
    // A border that the straight line between its points crosses is crossed by the shortest path.
    let straight = |&(i, j): &(u32, u32)| points[i as usize].distance(points[j as usize]);
    let borders = all[3].borders.iter().filter(|(_, border)| border.length_m > 1e-4);
    let ratios: Vec<f64> = borders.map(|(pair, border)| border.path_m / straight(pair)).collect();
    assert!(ratios.iter().all(|&ratio| ratio > 1.0 - 1e-5), "{ratios:?}");
    let exact = ratios.iter().filter(|&&ratio| ratio < 1.0 + 1e-5).count();
    assert!(exact * 10 > ratios.len() * 8, "{exact} of {}", ratios.len());
}

#[test]
fn on_a_sphere_and_a_cylinder_cells_are_measured_along_the_surface() {
    let topology = sphere(4);
    let points: Vec<DVec3> = scattered(50)
        .map(|p| {
            let (z, turn) = (2.0 * p.y - 1.0, TAU * p.x);
            DVec3::new(turn.cos() * (1.0 - z * z).sqrt(), turn.sin() * (1.0 - z * z).sqrt(), z)
        })
        .collect();
    let exact = counted(&topology, points.len(), 6, |p, i| -p.dot(points[i]));
    assert_near(&Cells::new(&topology, &places(&topology, &points)).areas, &exact, 0.015);

    // A cylinder of 48 sides, each flat: what is unrolled is exact.
    let (sides, height) = (48_u32, 3.0);
    let width = 2.0 * (PI / f64::from(sides)).sin();
    let round = width * f64::from(sides);
    let on = |p: DVec2| {
        let (side, along) = ((p.x * f64::from(sides)).floor(), (p.x * f64::from(sides)).fract());
        let corner = |side: f64| DVec2::from_angle(TAU * side / f64::from(sides));
        corner(side).lerp(corner(side + 1.0), along).extend(p.y * height)
    };
    let topology = sheet(sides, 20, on);
    assert_eq!(topology.flaws.boundary_edges, 2 * sides as usize);
    let flat: Vec<DVec2> = scattered(80).collect();
    let points: Vec<DVec3> = flat.iter().map(|&p| on(p)).collect();
    let unrolled = sheet(1, 1, |p| DVec3::new(p.x * round, p.y * height, 0.0));
    let exact = counted(&unrolled, points.len(), 160, |p, i| {
        let across = (p.x - flat[i].x * round).abs();
        across.min(round - across).powi(2) + (p.y - flat[i].y * height).powi(2)
    });
    let cells = Cells::new(&topology, &places(&topology, &points));
    assert_near(&cells.areas, &exact, 0.025);
    // The chord through the cylinder is not a way.
    let thin = sheet(sides, 4, |p| on(p) * DVec3::new(0.02, 0.02, 1.0));
    let ends = places(&thin, &[DVec3::new(0.02, 0.0, 1.5), DVec3::new(-0.02, 0.0, 1.5)]);
    let cells = Cells::new(&thin, &ends);
    let border = cells.borders[&(0, 1)];
    assert!((border.path_m / (round / 2.0 * 0.02) - 1.0).abs() < 1e-6, "{border:?}");
    assert!((border.length_m / (2.0 * height) - 1.0).abs() < 1e-6, "{border:?}");
}

#[test]
fn a_grid_has_square_cells_and_no_borders_across_corners() {
    // Points on the mesh's own corners, in the middles of its edges and of its triangles.
    for shift in [0.0, 0.05, 0.0333, 0.02] {
        let topology = sheet(10, 10, |p| p.extend(0.0));
        let points: Vec<DVec3> = (0..64_u32)
            .map(|i| DVec3::new(f64::from(i % 8) * 0.1 + 0.1 + shift, f64::from(i / 8) * 0.1 + 0.1, 0.0))
            .collect();
        let cells = Cells::new(&topology, &places(&topology, &points));
        let inner = (0..64).filter(|i| (1..7).contains(&(i % 8)) && (1..7).contains(&(i / 8)));
        inner.for_each(|i| assert!((cells.areas[i] - 0.01).abs() < 1e-6, "{shift}, {i}: {}", cells.areas[i]));
        let long = cells.borders.iter().filter(|(_, border)| border.length_m > 1e-4);
        let long: Vec<(u32, u32)> = long.map(|(&pair, _)| pair).collect();
        assert_eq!(long.len(), 2 * 7 * 8, "{shift}: {long:?}");
        assert!(long.iter().all(|(i, j)| j - i == 1 || j - i == 8));
    }
}

#[test]
fn points_at_one_place_share_its_cell_and_parts_without_points_are_left() {
    let mut one = sheet(4, 4, |p| p.extend(0.0));
    let other = sheet(3, 3, |p| p.extend(1e-3));
    let first = one.positions.len() as u32;
    one.positions.extend(&other.positions);
    one.triangles.extend(other.triangles.iter().map(|corners| corners.map(|v| v + first)));
    let (positions, triangles) = (one.positions, one.triangles);
    let point = |x: f64, y: f64| CellPoint { position: DVec3::new(x, y, 0.0), normal: DVec3::Z, triangle: 0 };
    let topology = Topology::new(&positions, &triangles);
    let on = |x, y| {
        let triangle = places(&topology, &[DVec3::new(x, y, 0.0)])[0].triangle;
        CellPoint { triangle: topology.given[triangle as usize] as usize, ..point(x, y) }
    };
    // Two of the three are at one place; the sheet behind has none, and is given to the nearest.
    let points = [on(0.25, 0.5), on(0.75, 0.5), on(0.75, 0.5)];
    let areas = Divided::with_areas(&positions, &triangles, &|_| 0, None, &points).0;
    assert!((areas.iter().sum::<f64>() - 2.0).abs() < 1e-9, "{areas:?}");
    assert!((areas[1] - 0.46).abs() < 0.05 && areas[1] == areas[2], "{areas:?}");
    // What is not skin has no area, and no border where cells meet on it.
    let is_skin = |triangle: usize| triangles[triangle].iter().any(|&v| positions[v as usize].x < 0.45);
    let (areas, divided) = Divided::with_areas(&positions, &triangles, &|_| 0, Some(&is_skin), &points);
    let skin = (0..triangles.len()).filter(|&triangle| is_skin(triangle));
    let skin = skin.map(|triangle| area_vector(triangles[triangle].map(|v| positions[v as usize])).length() / 2.0);
    assert!((areas.iter().sum::<f64>() - skin.sum::<f64>()).abs() < 1e-9, "{areas:?}");
    assert!(areas[0] > 0.4 && areas[1] < 0.3, "{areas:?}");
    assert!(divided.is_some());
    let cells = Cells::new(&topology, &places(&topology, &points.map(|p| p.position)));
    assert_eq!(cells.first, [0, 1, 1]);
    assert!((cells.areas[1] - 0.5).abs() < 1e-6 && (cells.areas[0] - 0.5).abs() < 1e-6, "{:?}", cells.areas);
    let left: f64 = cells.pieces.iter().map(|piece| piece.area).sum();
    assert!((left - 1.0).abs() < 1e-9, "{left}");
    assert_eq!(cells.borders.keys().copied().collect::<Vec<_>>(), [(0, 1)]);
}

#[test]
fn the_least_of_a_parabola() {
    let least = |f: fn(f64) -> f64| least_of_parabola([0.0, 0.5, 1.0].map(f));
    assert!((least(|t| (t - 0.3).powi(2) + 2.0) - 2.0).abs() < 1e-12);
    assert!((least(|t| 3.0 - t) - 2.0).abs() < 1e-12);
    assert!((least(|t| (t + 1.0).powi(2)) - 1.0).abs() < 1e-12);
    assert!((least(|t| 1.0 - t * t)).abs() < 1e-12);
}

#[test]
fn marching_over_fine_triangles_finds_the_cells_and_borders_of_exact_ways() {
    // A plane whose triangles are of all shapes, and a sphere: with many triangles for each point, and by windows.
    let scatter =
        |p: DVec2| DVec2::new(p.x + 0.004 * (37.0 * p.y).sin() * (1.0 - p.x) * p.x, p.y * p.y * (3.0 - 2.0 * p.y));
    let plane = sheet(110, 90, |p| scatter(p).extend(0.0));
    let flat: Vec<DVec3> = scattered(40).map(|p| p.extend(0.0)).collect();
    let round: Vec<DVec3> = scattered(40)
        .map(|p| {
            let (z, turn) = (2.0 * p.y - 1.0, TAU * p.x);
            DVec3::new(turn.cos() * (1.0 - z * z).sqrt(), turn.sin() * (1.0 - z * z).sqrt(), z)
        })
        .collect();
    for (topology, points) in [(plane, flat), (sphere(6), round)] {
        assert!(topology.triangles.len() > MARCHED_PER_POINT * points.len());
        let marched = Cells::new(&topology, &places(&topology, &points));
        let exact = Cells::in_windows(&topology, &places(&topology, &points));
        let total: f64 = exact.areas.iter().sum();
        assert!((marched.areas.iter().sum::<f64>() / total - 1.0).abs() < 1e-9 && marched.pieces.is_empty());
        let mut worst = 0.0_f64;
        for (area, wanted) in marched.areas.iter().zip(&exact.areas) {
            worst = worst.max((area / wanted - 1.0).abs());
        }
        assert!(worst < 0.02, "{worst}");
        let long = |cells: &Cells| -> Vec<(u32, u32)> {
            cells.borders.iter().filter(|(_, border)| border.length_m > 0.02).map(|(&pair, _)| pair).collect()
        };
        let mut compared = 0;
        for (one, other) in [(&marched, &exact), (&exact, &marched)] {
            for pair in long(one) {
                let [a, b] = [one, other].map(|cells| cells.borders[&pair]);
                assert!((a.path_m / b.path_m - 1.0).abs() < 0.04, "{pair:?} {a:?} {b:?}");
                compared += 1;
            }
        }
        assert!(compared > 150, "{compared}");
    }
}

#[test]
fn the_surface_in_triangles_is_that_of_the_cells() {
    // Triangles larger than cells, which are cut beforehand, and smaller ones.
    for columns in [2, 60] {
        let topology = sheet(columns, columns, |p| p.extend(0.1 * p.x * p.x));
        let places: Vec<SurfacePlace> = scattered(150)
            .map(|p| {
                let at = p.extend(0.1 * p.x * p.x);
                let triangles = 0..topology.triangles.len() as u32;
                let nearest = triangles.map(|t| SurfacePlace::in_triangle(&topology, t, at));
                let far = |place: &SurfacePlace| place.position(&topology).distance(at);
                nearest.min_by(|a, b| far(a).total_cmp(&far(b))).unwrap()
            })
            .collect();
        let cells = Cells::with_surface(&topology, &places);
        let mut areas = vec![0.0; places.len()];
        for &(point, corners) in &cells.surface {
            areas[point as usize] += area_vector(corners).length() / 2.0;
            let middle = corners.iter().sum::<DVec3>() / 3.0;
            let away = |place: &SurfacePlace| place.position(&topology).distance(middle);
            let least = places.iter().map(away).fold(f64::INFINITY, f64::min);
            assert!(away(&places[point as usize]) < least + 0.01, "nearly flat: along the surface as in space");
        }
        let differ = areas.iter().zip(&cells.areas).filter(|(a, b)| (*a - *b).abs() > 1e-9).count();
        assert_eq!(differ, 0);
        // Triangles inside one cell stay whole.
        let most = topology.triangles.len() + 12 * places.len() * (if columns == 2 { 12 } else { 4 });
        assert!(cells.surface.len() < most, "{} of {most}", cells.surface.len());
        assert!(Cells::new(&topology, &places).surface.is_empty());
    }
}

#[test]
fn bare_surface_around_a_skin_is_in_no_cell() {
    // Points on a tenth of a sheet, 0.02 apart, with coarse triangles and with fine ones, which are marched over.
    // Triangles that are reached in part are in a cell.
    for (columns, most) in [(2, 0.09), (150, 0.055)] {
        let topology = sheet(columns, columns, |p| p.extend(0.0));
        let at = |i: u32| DVec3::new(0.011 + 0.02 * f64::from(i % 5), 0.013 + 0.02 * f64::from(i / 5), 0.0);
        let points: Vec<DVec3> = (0..25).map(at).collect();
        let cells = Cells::with_surface(&topology, &places(&topology, &points));
        let far = |corners: &[DVec3; 3]| {
            let middle = corners.iter().sum::<DVec3>() / 3.0;
            points.iter().map(|point| point.distance(middle)).fold(f64::INFINITY, f64::min)
        };
        let farthest = cells.surface.iter().map(|(_, corners)| far(corners)).fold(0.0, f64::max);
        assert!(farthest < most, "{columns}: {farthest}");
        // One in the middle has all of its cell; the skin is a hundredth of the sheet.
        assert!((cells.areas[12] / 4e-4 - 1.0).abs() < 0.03, "{columns}: {}", cells.areas[12]);
        let all: f64 = cells.areas.iter().sum();
        assert!(all > 0.01 && all < 0.1, "{columns}: {all}");
        assert!((Cells::new(&topology, &places(&topology, &points)).areas.iter().sum::<f64>() - 1.0).abs() < 1e-6);
    }
}

#[test]
fn all_is_marched_over_where_windows_are_too_many() {
    let topology = sheet(40, 40, |p| p.extend(0.0));
    let at = |i: u32| DVec3::new(0.1 + 0.2 * f64::from(i % 5), 0.1 + 0.2 * f64::from(i / 5), 0.0);
    let points: Vec<DVec3> = (0..25).map(at).collect();
    for most_windows in [0, 100, usize::MAX] {
        let mut cells = Cells::empty((0..25).collect());
        let starts = places(&topology, &points).into_iter().enumerate().collect();
        cells.divide(&topology, (starts, f64::INFINITY), (|_| false, |_| true), most_windows, None);
        assert!((cells.areas.iter().sum::<f64>() - 1.0).abs() < 1e-9, "{most_windows}");
        assert_near(&cells.areas, &[0.04; 25], 0.02);
        // Across corners single ones may be of no length to speak of.
        let long = cells.borders.values().filter(|border| border.length_m > 0.1).count();
        assert_eq!(long, 40, "{most_windows}");
    }
}
