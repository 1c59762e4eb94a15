use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3};

use super::{LogMap, SurfacePlace};
use crate::body::Topology;

/// A sheet of `columns` × `rows` squares over [0, 1]², two triangles each with diagonals that alternate, bent by `shape`.
fn sheet(columns: u32, rows: u32, shape: impl Fn(DVec2) -> DVec3) -> Topology {
    let at = |c: u32, r: u32| shape(DVec2::new(f64::from(c) / f64::from(columns), f64::from(r) / f64::from(rows)));
    let positions: Vec<DVec3> =
        (0..=rows).flat_map(|r| (0..=columns).map(move |c| (c, r))).map(|(c, r)| at(c, r)).collect();
    let vertex = |c: u32, r: u32| r * (columns + 1) + c;
    let triangles: Vec<[u32; 3]> = (0..rows)
        .flat_map(|r| (0..columns).map(move |c| (c, r)))
        .flat_map(|(c, r)| {
            let [a, b, d, e] = [vertex(c, r), vertex(c + 1, r), vertex(c + 1, r + 1), vertex(c, r + 1)];
            if (c + r) % 2 == 0 { [[a, b, d], [a, d, e]] } else { [[a, b, e], [b, d, e]] }
        })
        .collect();
    Topology::new(&positions, &triangles)
}

/// A unit sphere of 8·4ⁿ triangles.
fn sphere(cuts: u32) -> Topology {
    let octants = (0..8_u32).map(|octant| {
        let sign = |axis: u32| if octant & (1 << axis) == 0 { 1.0 } else { -1.0 };
        let [x, y, z] = [DVec3::X * sign(0), DVec3::Y * sign(1), DVec3::Z * sign(2)];
        if sign(0) * sign(1) * sign(2) > 0.0 { [x, y, z] } else { [x, z, y] }
    });
    let mut soup: Vec<[DVec3; 3]> = octants.collect();
    for _ in 0..cuts {
        soup = soup
            .into_iter()
            .flat_map(|[a, b, c]| {
                let [ab, bc, ca] = [(a + b).normalize(), (b + c).normalize(), (c + a).normalize()];
                [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
            })
            .collect();
    }
    let positions: Vec<DVec3> = soup.concat();
    let triangles: Vec<[u32; 3]> = (0..soup.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    Topology::new(&positions, &triangles)
}

/// Places all over the surface, three a triangle.
fn places(topology: &Topology) -> impl Iterator<Item = SurfacePlace> {
    (0..topology.triangles.len() as u32).flat_map(|triangle| {
        [[0.6, 0.3, 0.1], [0.1, 0.6, 0.3], [1.0 / 3.0; 3]].map(|barycentric| SurfacePlace { triangle, barycentric })
    })
}

fn find(topology: &Topology, p: DVec3) -> SurfacePlace {
    (0..topology.triangles.len() as u32)
        .map(|t| SurfacePlace::in_triangle(topology, t, p))
        .min_by(|a, b| a.position(topology).distance(p).total_cmp(&b.position(topology).distance(p)))
        .unwrap()
}

/// The largest distance between the (u, v) that come out and those that `right` gives for a place, over where the
/// geodesic is no longer than `up_to`.
fn worst(
    topology: &Topology,
    start: DVec3,
    u: DVec3,
    up_to: f64,
    right: impl Fn(DVec3, &SurfacePlace) -> DVec2,
) -> f64 {
    let map = LogMap::new(topology, find(topology, start), u, up_to).unwrap();
    let mut worst: f64 = 0.0;
    let mut compared = 0;
    for place in places(topology) {
        let right = right(place.position(topology), &place);
        if right.length() <= 0.98 * up_to {
            worst = worst.max(map.reach(&place).unwrap().uv.distance(right));
            compared += 1;
        }
    }
    assert!(compared > 100, "{compared} places");
    worst
}

#[test]
fn on_a_plane_coordinates_are_the_planes_own() {
    let topology = sheet(17, 13, |p| DVec3::new(p.x, p.y, 0.0));
    for start in [DVec3::new(0.43, 0.61, 0.0), DVec3::new(6.0 / 17.0, 5.0 / 13.0, 0.0), DVec3::ZERO] {
        let off = worst(&topology, start, DVec3::X, 2.0, |p, _| (p - start).truncate());
        // Rounding of unfolding through some forty triangles.
        assert!(off < 1e-13, "{start}: {off}");
        let turned = worst(&topology, start, DVec3::Y, 2.0, |p, _| DVec2::new(p.y - start.y, start.x - p.x));
        assert!(turned < 1e-13, "{start}: {turned}");
    }
}

/// A sheet folded along straight lines unrolls exactly: rolled up as a polygon, it is still the sheet.
#[test]
fn a_rolled_sheet_unrolls_to_rounding() {
    let (columns, rows) = (24, 16);
    let roll = |p: DVec2| {
        // The corners of a polygon around 170° of a cylinder; lengths along it are counted below.
        let angle = (p.x * f64::from(columns)).round() / f64::from(columns) * 170.0_f64.to_radians();
        DVec3::new(angle.sin(), p.y, angle.cos())
    };
    let topology = sheet(columns, rows, roll);
    let side = 2.0 * (85.0_f64.to_radians() / f64::from(columns)).sin();
    // The unrolled sheet has the same triangles.
    let flat = sheet(columns, rows, |p| DVec3::new(p.x * f64::from(columns) * side, p.y, 0.0));
    let start = 401;
    let place = SurfacePlace { triangle: start, barycentric: [0.5, 0.2, 0.3] };
    let origin = place.position(&flat).truncate();
    let map = LogMap::new(&topology, place, DVec3::Y, 9.0).unwrap();
    for place in places(&topology) {
        let offset = place.position(&flat).truncate() - origin;
        let reached = map.reach(&place).unwrap();
        // +u is along the axis, so that +v, to the left of it seen from outside, is against the roll.
        let right = DVec2::new(offset.y, -offset.x);
        assert!(reached.uv.distance(right) < 1e-13, "{} {right}", reached.uv);
        assert!(reached.rival.is_none_or(|rival| rival.distance_m > reached.distance_m));
    }
}

#[test]
fn a_cone_unrolls_to_rounding() {
    // Half the cone's opening is 30°: unrolled, a full turn is half of one.
    let (columns, rows) = (30_u32, 12_u32);
    let step = TAU / f64::from(columns);
    let topology = sheet(columns, rows, |p| {
        let (angle, slant) = ((p.x * f64::from(columns)).round() * step, 0.3 + p.y);
        DVec3::new(0.5 * slant * angle.cos(), 0.75_f64.sqrt() * slant, 0.5 * slant * angle.sin())
    });
    // Sides of a polygon take the angle of their chord.
    let unrolled_step = 2.0 * (0.5 * (step / 2.0).sin()).asin();
    let start = find(&topology, DVec3::new(-0.4, 0.75_f64.sqrt() * 0.8, 0.01));
    let unroll = |place: &SurfacePlace| {
        let triangle = topology.triangles[place.triangle as usize];
        let column = triangle
            .map(|v| topology.positions[v as usize])
            .map(|p| (p.z.atan2(p.x) / step).rem_euclid(f64::from(columns)));
        let turn = |c: f64, by: f64| if by - c > 15.0 { c + 30.0 } else { c };
        let last = column.iter().copied().fold(0.0, f64::max);
        let corner = |k: usize| {
            let slant = topology.positions[triangle[k] as usize].y / 0.75_f64.sqrt();
            DVec2::from_angle(turn(column[k], last) * unrolled_step) * slant
        };
        let [a, b, c] = [0, 1, 2].map(corner);
        a * place.barycentric[0] + b * place.barycentric[1] + c * place.barycentric[2]
    };
    let (map, origin) = (LogMap::new(&topology, start, DVec3::Y, 9.0).unwrap(), unroll(&start));
    let mut compared = 0;
    for place in places(&topology) {
        let at = unroll(&place);
        // Ways that pass the hole at the top, or the seam, are not straight in this picture.
        let straight = (origin.perp_dot(at) / origin.distance(at)).abs() > 0.31 || (at - origin).dot(origin) > 0.0;
        if straight && (at.to_angle() - origin.to_angle()).abs() < 0.35 * PI {
            let reached = map.reach(&place).unwrap();
            assert!((reached.distance_m - origin.distance(at)).abs() < 1e-13);
            compared += 1;
        }
    }
    assert!(compared > 500, "{compared}");
}

#[test]
fn on_a_sphere_lengths_are_those_of_great_circles() {
    let topology = sphere(6);
    assert_eq!((topology.triangles.len(), topology.parts()), (32_768, 1));
    let pole = topology.positions[0];
    let vertex = |v: usize| SurfacePlace {
        triangle: v as u32 / 3,
        barycentric: [0, 1, 2].map(|k| f64::from(u8::from(k == v % 3))),
    };
    let place = vertex(0);
    let map = LogMap::new(&topology, place, DVec3::X, 1.05).unwrap();
    let [_, u, v, normal] = map.frame();
    assert!(normal.distance(pole) < 1e-3);
    let (mut radial, mut round, mut count): (f64, f64, usize) = (0.0, 0.0, 0);
    for corner in 0..3 * topology.triangles.len() {
        let place = vertex(corner);
        let p = place.position(&topology);
        let right = p.dot(pole).acos();
        if right > 1e-6 && right <= 1.0 {
            let reached = map.reach(&place).unwrap();
            radial = radial.max((reached.distance_m / right - 1.0).abs());
            let angle = p.dot(v).atan2(p.dot(u));
            let off = (reached.uv.to_angle() - angle).rem_euclid(TAU);
            round = round.max(off.min(TAU - off));
            count += 1;
        }
    }
    assert!(count > 2000);
    // Chords are shorter than arcs by the square of their angle over 24; the mesh's edges are 0.04 long at most.
    assert!(radial < 3e-4, "{radial}");
    assert!(round < 0.02, "{round}");
}

#[test]
fn a_way_bends_around_a_slit_by_as_much_as_it_must() {
    // A sheet of 20 × 20 squares without those of column 10, but for the topmost four.
    let whole = sheet(20, 20, |p| DVec3::new(p.x, p.y, 0.0));
    let cut: Vec<[u32; 3]> = whole
        .triangles
        .iter()
        .copied()
        .filter(|t| {
            let middle = t.map(|v| whole.positions[v as usize]).into_iter().sum::<DVec3>() / 3.0;
            !((0.5..0.55).contains(&middle.x) && middle.y < 0.8)
        })
        .collect();
    let topology = Topology::new(&whole.positions, &cut);
    let at = |x: f64, y: f64| find(&topology, DVec3::new(x, y, 0.0));
    let map = LogMap::new(&topology, at(0.23, 0.31), DVec3::X, 3.0).unwrap();
    let start = DVec2::new(0.23, 0.31);
    let (first, second) = (DVec2::new(0.5, 0.8), DVec2::new(0.55, 0.8));
    for (x, y) in [(0.83, 0.21), (0.61, 0.44), (0.97, 0.03)] {
        let reached = map.reach(&at(x, y)).unwrap();
        let to = DVec2::new(x, y);
        let right = start.distance(first) + first.distance(second) + second.distance(to);
        assert!((reached.distance_m - right).abs() < 1e-12, "{} {right}", reached.distance_m);
        assert!((reached.uv.to_angle() - (first - start).to_angle()).abs() < 1e-12);
        let bends = [(first - start).angle_to(second - first), (second - first).angle_to(to - second)];
        let sharpest = bends.into_iter().map(f64::abs).fold(0.0, f64::max);
        assert!((reached.bend_rad - sharpest).abs() < 1e-9, "{} {sharpest}", reached.bend_rad);
    }
    // What the slit does not hide is straight ahead.
    let reached = map.reach(&at(0.6, 0.99)).unwrap();
    assert_eq!(reached.bend_rad, 0.0);
    assert!((reached.uv - (DVec2::new(0.6, 0.99) - start)).length() < 1e-12);
}

#[test]
fn around_a_tube_two_ways_are_reported() {
    let topology = sheet(24, 12, |p| {
        let (sin, cos) = (p.x * TAU).sin_cos();
        DVec3::new(sin, 3.0 * p.y, cos)
    });
    let map = LogMap::new(&topology, find(&topology, DVec3::new(0.0, 1.4, 1.0)), DVec3::X, 4.0).unwrap();
    // A little off the line opposite, the way round the other side is a little longer.
    let back = map.reach(&find(&topology, DVec3::new(-0.02, 1.4, -0.98))).unwrap();
    let rival = back.rival.unwrap();
    assert!(rival.distance_m > back.distance_m && rival.distance_m < back.distance_m + 0.1);
    assert!((rival.apart_rad - PI).abs() < 0.05, "{}", rival.apart_rad);
    // All round, the two are as long as the polygon.
    let round = 24.0 * 2.0 * (TAU / 48.0).sin();
    assert!((rival.distance_m + back.distance_m - round).abs() < 0.02);
    assert_eq!(map.reach(&find(&topology, DVec3::new(0.7, 1.4, 0.7))).unwrap().rival, None);
}

#[test]
fn what_is_out_of_reach_is_distinguished() {
    let topology = sheet(10, 10, |p| DVec3::new(p.x, p.y, 0.0));
    let at = |x: f64, y: f64| find(&topology, DVec3::new(x, y, 0.0));
    let map = LogMap::new(&topology, at(0.05, 0.05), DVec3::X, 0.2).unwrap();
    assert!(map.reach(&at(0.95, 0.95)).is_none());
    assert!(map.reach(&at(0.1, 0.1)).is_some());
    let nowhere = SurfacePlace { triangle: 900, barycentric: [1.0, 0.0, 0.0] };
    assert!(LogMap::new(&topology, nowhere, DVec3::X, 1.0).is_err());
}

#[test]
fn a_map_stops_when_its_windows_are_used_up_and_counts_them() {
    let topology = sphere(4);
    let place = find(&topology, DVec3::new(0.6, 0.0, 0.8));
    let whole = LogMap::new(&topology, place, DVec3::X, 1.0).unwrap();
    let (mut few, mut many) = (100, 1_000_000);
    assert!(LogMap::with_windows(&topology, place, DVec3::X, 1.0, &mut few).is_err());
    assert_eq!(few, 0);
    let bounded = LogMap::with_windows(&topology, place, DVec3::X, 1.0, &mut many).unwrap();
    // Besides its windows, preparing the map takes some.
    assert!(many < 1_000_000 - whole.windows() && many > 1_000_000 - 2 * whole.windows(), "{many}");
    for place in places(&topology) {
        assert_eq!(bounded.reach(&place), whole.reach(&place));
    }
}

#[test]
fn a_vertex_that_two_parts_share_leads_to_no_way_between_them() {
    // Two triangles that meet in the origin alone.
    let positions = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (-1.0, 0.0), (-1.0, -1.0)];
    let positions = positions.map(|(x, y)| DVec3::new(x, y, 0.0));
    let topology = Topology::new(&positions, &[[0, 1, 2], [0, 3, 4]]);
    assert_eq!(topology.parts(), 2);
    let place = |triangle| SurfacePlace { triangle, barycentric: [0.2, 0.4, 0.4] };
    for (from, to) in [(0, 1), (1, 0)] {
        let map = LogMap::new(&topology, place(from), DVec3::X, 9.0).unwrap();
        assert!(map.reach(&place(from)).is_some() && map.reach(&place(to)).is_none());
    }
}
