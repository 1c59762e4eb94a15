//! Touches whose right answer is known.

use std::f64::consts::{FRAC_PI_2, TAU};

use glam::DVec3;

use super::common::{Random, between, bumps, limb, step, touches};
use crate::percept::{TouchFlags, TouchFrame};
use crate::touch::layouts::{grid_parts, scattered};
use crate::touch::{Input, Touches};

#[test]
fn on_a_plane_a_touch_is_where_it_is_pressed_and_as_wide() {
    let mut touches = touches(grid_parts(40, 40, 0.005));
    let (centre, along) = (DVec3::new(0.0983, 0.1021, 0.0), DVec3::new(0.6, 0.8, 0.0));
    let across = DVec3::Z.cross(along);
    let pressures: Vec<f64> = touches
        .skin()
        .taxels()
        .iter()
        .map(|taxel| {
            let r = taxel.position - centre;
            (-0.5 * ((r.dot(along) / 0.016).powi(2) + (r.dot(across) / 0.008).powi(2))).exp()
        })
        .collect();
    let frame = step(&mut touches, 0.0, &pressures);
    let [touch] = &frame.touches[..] else { panic!("{:?}", frame.touches) };
    assert!(touch.position.distance(centre) < 1e-5, "{}", touch.position);
    assert!(touch.normal.distance(DVec3::Z) < 1e-12);
    assert!(between(touch.principal_axis.unwrap(), along) < 1e-3);
    assert!((touch.principal_axis_rad.unwrap() - 0.8_f64.atan2(0.6)).abs() < 1e-3);
    assert!(between(touch.orientation.unwrap(), along) < 0.15);
    let [wide, narrow] = touch.spread_m.unwrap();
    assert!((wide - 0.016).abs() < 1e-4 && (narrow - 0.008).abs() < 1e-4, "{wide} {narrow}");
    assert!((touch.anisotropy.unwrap() - 0.6).abs() < 0.01);
    assert_eq!((touch.id, touch.link, touch.flags, touch.age_s), (1, 0, TouchFlags::YOUNG, 0.0));
    // ∫ of the bump is its force, as a taxel's P counts for its cell.
    let force = TAU * 0.016 * 0.008;
    assert!((touch.force_newton.unwrap() / force - 1.0).abs() < 1e-3);
    let wrench = frame.links(touch)[0].wrench.unwrap();
    assert!(wrench.force_newton.distance(DVec3::Z * -touch.force_newton.unwrap()) < 1e-12);
    assert!(wrench.torque_newton_m.distance(centre.cross(wrench.force_newton)) < 1e-8);
    assert_eq!(frame.taxels(touch).len(), touch.active as usize);
}

#[test]
fn on_limbs_and_balls_a_rod_has_its_direction_and_length() {
    let mut touches = touches(limb(60, 40, 0.004));
    let radius_m = 60.0 * 0.004 / TAU;
    // A line of pressure on a helix: straight when the limb is unrolled.
    for slope in [0.0_f64, 0.4, 1.2, FRAC_PI_2] {
        let (sin, cos) = slope.sin_cos();
        let pressures: Vec<f64> = touches
            .skin()
            .taxels()
            .iter()
            .map(|taxel| {
                let turn = taxel.position.x.atan2(taxel.position.z);
                let r = DVec3::new(radius_m * turn, taxel.position.y - 0.078, 0.0);
                let (along, across) = (r.x * cos + r.y * sin, r.y * cos - r.x * sin);
                let felt = (-0.5 * ((along / 0.018).powi(2) + (across / 0.006).powi(2))).exp();
                if felt > 0.02 { felt } else { 0.0 }
            })
            .collect();
        let frame = step(&mut touches, 0.0, &pressures);
        let [touch] = &frame.touches[..] else { panic!("{}", frame.touches.len()) };
        assert!(!touch.flags.contains(TouchFlags::WRAPPED));
        assert!(touch.position.distance(DVec3::new(0.0, 0.078, radius_m)) < 2e-4, "{}", touch.position);
        let right = DVec3::new(cos, sin, 0.0);
        assert!(between(touch.principal_axis.unwrap(), right) < 0.02, "{slope}");
        assert!((touch.spread_m.unwrap()[0] / 0.0172 - 1.0).abs() < 0.05, "{:?}", touch.spread_m);
    }
}

#[test]
fn a_strap_around_a_limb_is_one_touch_that_is_wrapped() {
    let mut touches = touches(limb(40, 30, 0.005));
    for (half_turn, wrapped) in [(0.9, false), (1.8, false), (2.3, true), (3.2, true)] {
        let pressed = |p: DVec3| p.x.atan2(p.z).abs() < half_turn && (p.y - 0.075).abs() < 0.011;
        let pressures: Vec<f64> =
            touches.skin().taxels().iter().map(|taxel| f64::from(u8::from(pressed(taxel.position)))).collect();
        let frame = step(&mut touches, 0.0, &pressures);
        let [touch] = &frame.touches[..] else { panic!("{half_turn}: {}", frame.touches.len()) };
        assert_eq!(touch.flags.contains(TouchFlags::WRAPPED), wrapped, "{half_turn}");
        assert_eq!(touch.principal_axis_rad.is_none(), wrapped);
        assert_eq!(touch.orientation.is_none(), wrapped);
        assert!(touch.position.is_finite() && (touch.normal.length() - 1.0).abs() < 1e-12);
        if half_turn < 1.0 || half_turn < 2.0 && wrapped {
            assert!(between(touch.principal_axis.unwrap(), DVec3::X) < 0.02);
        }
    }
}

#[test]
fn two_fingers_are_two_and_a_rod_is_one() {
    let mut random = Random(5);
    let (mut right_two, mut right_one, cases) = (0, 0, 60);
    for case in 0..cases {
        let parts = if case % 2 == 0 { grid_parts(24, 24, 0.005) } else { scattered([0.12, 0.12], 0.005) };
        let mut touches = touches(parts);
        let turn = TAU * random.next();
        let along = DVec3::new(turn.cos(), turn.sin(), 0.0);
        let middle = DVec3::new(0.058, 0.058, 0.0);
        let gains: Vec<f64> = (0..touches.skin().nodes()).map(|_| (0.1 * random.normal()).exp()).collect();
        let mut felt = |centres: &[(DVec3, f64)]| -> usize {
            let mut pressures = bumps(touches.skin(), centres, 0.005);
            let highest = pressures.iter().copied().fold(0.0, f64::max);
            for (pressure, gain) in pressures.iter_mut().zip(&gains) {
                *pressure =
                    if *pressure > 0.0 { (*pressure * gain + 0.01 * highest * random.normal()).max(0.0) } else { 0.0 };
            }
            let mut frame = TouchFrame::default();
            let input = Input { restarts: true, ..Input::new(0.0, &pressures[..]) };
            touches.step(input, &mut frame);
            // A corner that noise cut off is none of a finger.
            frame.touches.iter().filter(|touch| touch.peak > 0.2 * highest).count()
        };
        let two = [(middle - along * 0.0095, 1.0), (middle + along * 0.0095, 0.8)];
        right_two += usize::from(felt(&two) == 2);
        let rod: Vec<(DVec3, f64)> = (-6..=6).map(|k| (middle + along * (0.003 * f64::from(k)), 0.4)).collect();
        right_one += usize::from(felt(&rod) == 1);
    }
    assert!(right_two * 100 >= 90 * cases && right_one * 100 >= 95 * cases, "{right_two} {right_one} of {cases}");
}

#[test]
fn fingers_that_meet_are_distinguished_longer_than_they_would_be_found() {
    // Towards each other and apart again: joined at a smaller distance than parted, once each.
    let mut touches = touches(grid_parts(30, 9, 0.005));
    let at = |apart_m: f64| [-0.5, 0.5].map(|side| (DVec3::new(0.072 + side * apart_m, 0.02, 0.0), 1.0));
    let mut seen: Vec<(f64, Vec<u64>)> = Vec::new();
    let distances = (0..200).map(|k| 0.03 - 1.5e-4 * f64::from(k)).chain((0..200).map(|k| 1.5e-4 * f64::from(k)));
    for (index, apart_m) in distances.enumerate() {
        let pressures = bumps(touches.skin(), &at(apart_m), 0.005);
        let frame = step(&mut touches, 0.01 * index as f64, &pressures);
        let ids: Vec<u64> = frame.touches.iter().map(|touch| touch.id).collect();
        if frame.touches.iter().any(|touch| touch.flags.contains(TouchFlags::MERGED)) {
            assert_eq!((ids.len(), &frame.released[..]), (1, &[2][..]));
        }
        if seen.last().is_none_or(|(_, last)| *last != ids) {
            seen.push((apart_m, ids));
        }
    }
    let ids: Vec<&[u64]> = seen.iter().map(|(_, ids)| &ids[..]).collect();
    assert_eq!(ids, [&[1, 2][..], &[1], &[1, 3]], "{seen:?}");
    assert!(seen[1].0 < seen[2].0, "{seen:?}");
}

#[test]
fn velocity_is_that_of_the_skin_and_begins_anew_when_touches_meet() {
    let mut touches = touches(limb(60, 60, 0.004));
    let radius_m = 60.0 * 0.004 / TAU;
    let mut last = None;
    for frame_index in 0..60 {
        let t_s = 0.01 * f64::from(frame_index);
        let turn = 0.5 * t_s / radius_m * 0.1;
        let centre = DVec3::new(radius_m * turn.sin(), 0.06 + 0.08 * t_s, radius_m * turn.cos());
        let pressures = bumps(touches.skin(), &[(centre, 1.0)], 0.006);
        let frame = step(&mut touches, t_s, &pressures);
        let [touch] = &frame.touches[..] else { panic!() };
        assert_eq!(touch.velocity.is_none(), t_s < 0.2 - 1e-9, "{t_s}");
        assert_eq!(touch.flags.contains(TouchFlags::YOUNG), t_s < 0.2 - 1e-9);
        assert!((touch.age_s - t_s).abs() < 1e-12 && touch.id == 1);
        last = touch.velocity;
    }
    let velocity = last.unwrap();
    assert!((velocity.length() / 0.08_f64.hypot(0.05) - 1.0).abs() < 0.05, "{velocity}");
    // Another finger beside it, then between them.
    let pressures = |touches: &Touches, more: f64| {
        let centres = [(DVec3::new(0.0, 0.11, radius_m), 1.0), (DVec3::new(0.0, 0.11 + more, radius_m), 1.0)];
        bumps(touches.skin(), &centres, 0.006)
    };
    let apart = pressures(&touches, 0.04);
    step(&mut touches, 0.6, &apart);
    let near = pressures(&touches, 0.0);
    let frame = step(&mut touches, 0.61, &near);
    assert_eq!(frame.released.len(), 1);
    assert!(frame.touches[0].velocity.is_none() || !frame.touches[0].flags.contains(TouchFlags::MERGED));
}
