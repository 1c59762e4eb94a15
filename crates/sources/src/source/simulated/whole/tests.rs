//! Touches of planes, spheres and cylinders against their closed forms.

use std::f64::consts::PI;

use glam::{DAffine3, DVec3};

use super::super::contact;
use super::cells::Cells;
use super::chart::unrolled;
use super::footprint::Footprint;
use super::indenter::{Placed, Pose, Shape};
use super::layer::Layer;
use super::press::{Pressure, Skin};
use super::surface::WholeSurface;
use crate::body::{Body, Home, Link, Surface};

const LAYER: contact::Layer = contact::Layer { thickness_m: 7e-3, ..contact::Layer::NONE };
/// Pressure per depth, Pa/m.
const STIFFNESS: f64 = contact::Layer::STIFFNESS_PA / 7e-3;
const SIGMA: f64 = 7e-3 * contact::Layer::SPREAD;

/// A body with one link and a surface: `at` of a grid of (columns + 1) × (rows + 1) points, x across and y up seen from outside.
fn grid(columns: u32, rows: u32, at: impl Fn(f64, f64) -> DVec3) -> Body {
    let share = |step: u32, of: u32| f64::from(step) / f64::from(of);
    let nodes = (0..=rows).flat_map(|row| (0..=columns).map(move |column| (column, row)));
    let positions = nodes.map(|(column, row)| at(share(column, columns), share(row, rows))).collect();
    let wide = columns + 1;
    let cells = (0..rows).flat_map(|row| (0..columns).map(move |column| row * wide + column));
    let triangles = cells.flat_map(|a| [[a, a + 1, a + wide + 1], [a, a + wide + 1, a + wide]]).collect();
    let home = Home::Rigid { link: 0, link_from_mesh: DAffine3::IDENTITY };
    let link = Link {
        name: "limb".to_owned(),
        parent: None,
        body_from_link: DAffine3::IDENTITY,
        link_from_node: DAffine3::IDENTITY,
        joint: None,
        urdf_up: None,
    };
    Body {
        name: "made".to_owned(),
        links: vec![link],
        surfaces: vec![Surface { name: "limb".to_owned(), positions, triangles, home }],
        taxels: Vec::new(),
        fields: Vec::new(),
        findings: Vec::new(),
        edges: None,
        kept: Default::default(),
    }
}

/// 160 mm square, through the origin, facing +z.
pub(super) fn plane() -> Body {
    grid(32, 32, |x, y| DVec3::new(x - 0.5, y - 0.5, 0.0) * 0.16)
}

/// The part of a sphere within 60° of +z, about the origin.
fn sphere(radius_m: f64) -> Body {
    grid(90, 90, |x, y| DVec3::new(3.0 * x - 1.5, 3.0 * y - 1.5, 1.0).normalize() * radius_m)
}

/// A cylinder along y about the origin, 240 mm long, open along −z.
fn cylinder(radius_m: f64) -> Body {
    grid(240, 24, |x, y| {
        let turn = (2.0 * x - 1.0) * (PI - 0.02);
        DVec3::new(turn.sin() * radius_m, (y - 0.5) * 0.24, turn.cos() * radius_m)
    })
}

/// What `shape` at the top of `body` does, pressed along −z with `force_newton`, `along` its direction.
fn press(body: &Body, shape: Shape, along: DVec3, force_newton: f64) -> (WholeSurface, Pressure, Footprint) {
    let layer = Layer::new(&LAYER, 0.0);
    let (surface, cells) = (WholeSurface::new(body, layer.piece_m()), Cells::new(body, &[]));
    let spot = surface.nearest(DVec3::Z, DVec3::Z).unwrap();
    let placed = Placed::new(&surface, shape, Pose { spot, normal: DVec3::Z, along });
    let pressure = Skin { surface: &surface, cells: &cells, layer: &layer }.press(&placed, force_newton);
    let footprint = Footprint::new(&surface, &pressure.felt).unwrap();
    let felt: f64 = pressure.felt.iter().map(|felt| felt.force_newton).sum();
    assert!((felt / force_newton - 1.0).abs() < 1e-9, "{shape:?}: {felt} of {force_newton} N");
    (surface, pressure, footprint)
}

/// The mean of `of` over the pressure.
fn mean(pressure: &Pressure, of: impl Fn(DVec3) -> f64) -> f64 {
    let sum: f64 = pressure.felt.iter().map(|felt| of(felt.piece.middle) * felt.force_newton).sum();
    sum / pressure.felt.iter().map(|felt| felt.force_newton).sum::<f64>()
}

/// ∫ f from `from` to `to`, by the midpoint rule.
fn integral(from: f64, to: f64, f: impl Fn(f64) -> f64) -> f64 {
    let steps = 20_000;
    let step = (to - from) / f64::from(steps);
    (0..steps).map(|k| f(from + (f64::from(k) + 0.5) * step)).sum::<f64>() * step
}

/// Where the increasing `f` is `wanted`, from 0 to `most`.
fn solve(wanted: f64, most: f64, f: impl Fn(f64) -> f64) -> f64 {
    let (mut low, mut high) = (0.0, most);
    for _ in 0..60 {
        let middle = (low + high) / 2.0;
        if f(middle) < wanted { low = middle } else { high = middle }
    }
    (low + high) / 2.0
}

#[test]
fn a_ball_on_a_plane_displaces_its_cap() {
    let radius_m = 0.01;
    for force in [0.05, 1.0, 8.0] {
        let (_, pressure, footprint) = press(&plane(), Shape::Ball { radius_m }, DVec3::X, force);
        let cap = |d: f64| PI * d * d * (3.0 * radius_m - d) / 3.0;
        let depth = solve(force / STIFFNESS, radius_m, cap);
        assert!((pressure.depth_m / depth - 1.0).abs() < 2e-3, "{force} N: {:e} {depth:e}", pressure.depth_m);
        assert!(footprint.spot.position.length() < 1e-5 && footprint.principal_axis.is_none(), "{force} N");
        // The cap's own variance each way, and the layer's.
        let edge = (2.0 * radius_m * depth - depth * depth).sqrt();
        let height = |r: f64| (radius_m * radius_m - r * r).sqrt() - (radius_m - depth);
        let own = PI * integral(0.0, edge, |r| r.powi(3) * height(r)) / cap(depth);
        for axis in [DVec3::X, DVec3::Y] {
            let variance = mean(&pressure, |p| p.dot(axis).powi(2));
            assert!((variance / (own + SIGMA * SIGMA) - 1.0).abs() < 5e-3, "{force} N: {variance:e} {own:e}");
        }
    }
}

#[test]
fn a_rod_on_a_plane_displaces_its_segment_along_its_direction() {
    let (radius_m, length_m, force) = (0.0127, 0.05, 20.0);
    let along = DVec3::new(0.8, 0.6, 0.0);
    let (_, pressure, footprint) = press(&plane(), Shape::Rod { radius_m, length_m }, along, force);
    let segment = |d: f64| {
        let h = radius_m - d;
        radius_m * radius_m * (h / radius_m).acos() - h * (2.0 * radius_m * d - d * d).sqrt()
    };
    let depth = solve(force / STIFFNESS / length_m, radius_m, segment);
    assert!((pressure.depth_m / depth - 1.0).abs() < 5e-3, "{:e} {depth:e}", pressure.depth_m);
    let variance = mean(&pressure, |p| p.dot(along).powi(2));
    assert!((variance / (length_m * length_m / 12.0 + SIGMA * SIGMA) - 1.0).abs() < 0.01, "{variance:e}");
    let axis = footprint.principal_axis.unwrap();
    assert!(axis.cross(along).length() < 0.1_f64.to_radians() && footprint.spot.position.length() < 5e-5, "{axis}");
}

#[test]
fn an_ellipsoid_on_a_plane_displaces_the_cap_of_a_stretched_ball() {
    let (radii_m, force) = ([0.03, 0.01, 0.015], 6.0);
    let (_, pressure, footprint) = press(&plane(), Shape::Ellipsoid { radii_m }, DVec3::Y, force);
    let [a, b, c] = radii_m;
    let cap = |d: f64| PI * a * b / (c * c) * d * d * (3.0 * c - d) / 3.0;
    let depth = solve(force / STIFFNESS, c, cap);
    assert!((pressure.depth_m / depth - 1.0).abs() < 2e-3, "{:e} {depth:e}", pressure.depth_m);
    assert!(footprint.principal_axis.unwrap().cross(DVec3::Y).length() < 0.2_f64.to_radians());
}

#[test]
fn a_strap_on_a_plane_bulges_over_its_length() {
    let (width_m, length_m, force) = (0.02, 0.08, 10.0);
    let (_, pressure, _) = press(&plane(), Shape::Strap { width_m, length_m }, DVec3::X, force);
    // A parabola across, and half a paraboloid at each end.
    let volume = 2.0 / 3.0 * width_m * length_m + PI * (width_m / 2.0).powi(2) / 2.0;
    let depth = force / STIFFNESS / volume;
    assert!((pressure.depth_m / depth - 1.0).abs() < 5e-3, "{:e} {depth:e}", pressure.depth_m);
}

#[test]
fn a_ball_on_a_sphere_presses_less_where_that_curves_away() {
    let (sphere_m, radius_m, force) = (0.04, 0.015, 6.0);
    let (_, pressure, footprint) = press(&sphere(sphere_m), Shape::Ball { radius_m }, DVec3::X, force);
    // How deep the ball, whose middle is `middle` over the sphere's, is along the radius at `turn` from the pole.
    let under = |turn: f64, depth: f64| {
        let middle = sphere_m + radius_m - depth;
        let across = radius_m * radius_m - (middle * turn.sin()).powi(2);
        if across <= 0.0 { 0.0 } else { (sphere_m - middle * turn.cos() + across.sqrt()).max(0.0) }
    };
    let ring = |turn: f64| 2.0 * PI * sphere_m * sphere_m * turn.sin();
    let volume = |depth: f64| integral(0.0, 1.0, |turn| ring(turn) * under(turn, depth));
    let depth = solve(force / STIFFNESS, radius_m, volume);
    assert!((pressure.depth_m / depth - 1.0).abs() < 5e-3, "{:e} {depth:e}", pressure.depth_m);
    // A plane's is another.
    let on_plane = solve(force / STIFFNESS, radius_m, |d| PI * d * d * (3.0 * radius_m - d) / 3.0);
    assert!(depth / on_plane > 1.1);
    // The mean of each force's spread lies below it by a share that is the same everywhere.
    let kernel = |turn: f64| (-0.5 * (sphere_m * turn / SIGMA).powi(2)).exp() * turn.sin();
    let shrinks = integral(0.0, 1.0, |turn| kernel(turn) * turn.cos()) / integral(0.0, 1.0, kernel);
    let own = integral(0.0, 1.0, |turn| ring(turn) * under(turn, depth) * turn.cos()) / volume(depth);
    let height = mean(&pressure, |p| p.z);
    assert!((height - sphere_m * own * shrinks).abs() < 2e-5, "{height} {}", sphere_m * own * shrinks);
    assert!(footprint.spot.position.distance(DVec3::Z * sphere_m) < 5e-5);
}

#[test]
fn a_rod_across_a_cylinder_presses_as_far_as_it_reaches() {
    let (cylinder_m, radius_m, length_m, force) = (0.04, 0.01, 0.06, 10.0);
    let (_, pressure, footprint) = press(&cylinder(cylinder_m), Shape::Rod { radius_m, length_m }, DVec3::X, force);
    // The rod lies along x at z = cylinder + radius − depth; a point at `turn` has its normal in x and z.
    let under = |turn: f64, y: f64, depth: f64| {
        let bottom = cylinder_m + radius_m - depth - (radius_m * radius_m - y * y).max(0.0).sqrt();
        let (x, z) = (cylinder_m * turn.sin(), cylinder_m * turn.cos());
        if z <= bottom || y.abs() >= radius_m || x.abs() > length_m / 2.0 { 0.0 } else { (z - bottom) / turn.cos() }
    };
    let steps = 400;
    let volume = |depth: f64| {
        let most = (2.0 * depth / cylinder_m).sqrt() * 1.5;
        let (dt, dy) = (most / f64::from(steps), radius_m / f64::from(steps));
        let at = |k: i32, d: f64| (f64::from(k) + 0.5) * d;
        let sum: f64 = (0..steps)
            .flat_map(|i| (0..steps).map(move |j| (i, j)))
            .map(|(i, j)| under(at(i, dt), at(j, dy), depth))
            .sum();
        4.0 * sum * dt * dy * cylinder_m
    };
    let depth = solve(force / STIFFNESS, radius_m / 2.0, volume);
    assert!((pressure.depth_m / depth - 1.0).abs() < 1e-2, "{:e} {depth:e}", pressure.depth_m);
    // Its footprint is wider along the cylinder than the rod is.
    assert!(footprint.spot.position.distance(DVec3::Z * cylinder_m) < 5e-5);
    assert!(pressure.felt.iter().all(|felt| felt.piece.middle.is_finite()));
}

#[test]
fn a_strap_around_a_cylinder_is_where_it_would_be_unrolled() {
    let (cylinder_m, width_m, length_m, force) = (0.04, 0.02, 0.07, 10.0);
    for degrees in [0.0_f64, 35.0, 90.0] {
        let turn = degrees.to_radians();
        let along = DVec3::X * turn.cos() + DVec3::Y * turn.sin();
        let (surface, pressure, footprint) =
            press(&cylinder(cylinder_m), Shape::Strap { width_m, length_m }, along, force);
        let volume = 2.0 / 3.0 * width_m * length_m + PI * (width_m / 2.0).powi(2) / 2.0;
        let depth = force / STIFFNESS / volume;
        assert!((pressure.depth_m / depth - 1.0).abs() < 1e-2, "{degrees}°: {:e} {depth:e}", pressure.depth_m);
        // Unrolled, the variance along it is that of a band with round ends and the layer's.
        let (half, round) = (length_m / 2.0, width_m / 2.0);
        let across = |u: f64| {
            let beyond = (u.abs() - half).max(0.0);
            let edge = (round * round - beyond * beyond).max(0.0).sqrt();
            2.0 * edge - 2.0 * (beyond * beyond * edge + edge.powi(3) / 3.0) / (round * round)
        };
        let reach = half + round;
        let own = integral(-reach, reach, |u| u * u * across(u)) / integral(-reach, reach, across);
        let top = DVec3::Z * cylinder_m;
        let sum: f64 = pressure
            .felt
            .iter()
            .map(|felt| {
                let normal = surface.facet(felt.facet).normal;
                unrolled(felt.piece.middle - top, DVec3::Z, normal).dot(along).powi(2) * felt.force_newton
            })
            .sum();
        let variance = sum / force;
        assert!((variance / (own + SIGMA * SIGMA) - 1.0).abs() < 0.02, "{degrees}°: {variance:e} {own:e}");
        let axis = footprint.principal_axis.unwrap();
        assert!(axis.cross(along).length() < 0.3_f64.to_radians(), "{degrees}°: {axis} {along}");
        assert!(footprint.spot.position.distance(top) < 1e-4, "{degrees}°: {}", footprint.spot.position);
    }
}

#[test]
fn boussinesqs_kernel_conserves_the_force_too() {
    let layer = Layer::new(
        &contact::Layer {
            kernel: super::super::layer::Kernel::Radial(super::super::radial::Radial::Boussinesq),
            ..LAYER
        },
        0.0,
    );
    let body = plane();
    let (surface, cells) = (WholeSurface::new(&body, layer.piece_m()), Cells::new(&body, &[]));
    let spot = surface.nearest(DVec3::ZERO, DVec3::Z).unwrap();
    let placed =
        Placed::new(&surface, Shape::Ball { radius_m: 0.002 }, Pose { spot, normal: DVec3::Z, along: DVec3::X });
    let pressure = Skin { surface: &surface, cells: &cells, layer: &layer }.press(&placed, 0.05);
    // Within r of a point lies 1 − z³/(r² + z²)^(3/2).
    let (z, r) = (7e-3_f64, 9e-3);
    let within = |p: DVec3| f64::from(p.length() < r);
    let share = 1.0 - z.powi(3) / (r * r + z * z).powf(1.5);
    assert!((mean(&pressure, within) / share - 1.0).abs() < 0.02, "{} {share}", mean(&pressure, within));
}

#[test]
fn covered_surface_bears_nothing_and_links_keep_their_pressure() {
    // A second plane 2 mm under the first one.
    let mut body = plane();
    let mut under = body.surfaces[0].clone();
    under.positions.iter_mut().for_each(|p| p.z -= 2e-3);
    body.surfaces.push(under);
    let (surface, pressure, _) = press(&body, Shape::Ball { radius_m: 0.01 }, DVec3::X, 30.0);
    assert!(pressure.depth_m > 3e-3, "{}", pressure.depth_m);
    assert!(pressure.felt.iter().all(|felt| surface.facet(felt.facet).mesh == 0));
    // Two links beside each other: what presses one is not felt on the other.
    let mut body = plane();
    let mut beside = body.surfaces[0].clone();
    beside.positions.iter_mut().for_each(|p| p.x += 0.16);
    beside.home = Home::Rigid { link: 1, link_from_mesh: DAffine3::IDENTITY };
    let other = Link { name: "other".to_owned(), ..body.links[0].clone() };
    body.links.push(other);
    body.surfaces.push(beside);
    let (layer, at) = (Layer::new(&LAYER, 0.0), DVec3::new(0.076, 0.0, 0.0));
    let (surface, cells) = (WholeSurface::new(&body, layer.piece_m()), Cells::new(&body, &[]));
    let press = |x: f64| {
        let spot = surface.nearest(at + DVec3::X * x, DVec3::Z).unwrap();
        let pose = Pose { spot, normal: DVec3::Z, along: DVec3::X };
        let placed = Placed::new(&surface, Shape::Ball { radius_m: 0.005 }, pose);
        let pressure = Skin { surface: &surface, cells: &cells, layer: &layer }.press(&placed, 0.2);
        let on = |link: usize| {
            let felt = pressure.felt.iter().filter(|felt| surface.facet(felt.facet).link == link);
            felt.map(|felt| felt.force_newton).sum::<f64>()
        };
        (on(0), on(1))
    };
    // The ball presses 1.4 mm around it: here one link alone, there both.
    let (one, none) = press(0.0);
    assert!((one - 0.2).abs() < 1e-9 && none == 0.0, "{one} {none}");
    let (left, right) = press(0.004);
    assert!((left + right - 0.2).abs() < 1e-9 && (left - right).abs() < 0.01, "{left} {right}");
}
