//! Touches compared with their definition.

use std::collections::BTreeSet;
use std::f64::consts::TAU;
use std::sync::Arc;

use glam::{DAffine3, DVec3};

use super::common::{Random, between, bumps, everything, limb};
use crate::percept::{Touch, TouchFlags, TouchFrame};
use crate::touch::layouts::{bent, grid_parts, scattered};
use crate::touch::reference::{self, Reference, RightTouch};
use crate::touch::{Input, Options, Skin, SkinParts, Splits, Touches};

/// A frame that says nothing of nodes but their pressures, with gaps.
fn frame(t_s: f64, pressures: Vec<f64>, without_value: BTreeSet<u32>) -> reference::Frame {
    reference::Frame { t_s, restarts: false, pressures, without_value, unsure: BTreeSet::new() }
}

fn agrees(skin: &Skin, frame: &TouchFrame, found: &Touch, right: &RightTouch) -> Result<(), String> {
    let near = |what: &str, a: DVec3, b: DVec3, within: f64| {
        if a.distance(b) <= within { Ok(()) } else { Err(format!("{what} {a} {b}")) }
    };
    let same = |what: &str, a: f64, b: f64, within: f64| {
        if (a - b).abs() <= within { Ok(()) } else { Err(format!("{what} {a} {b}")) }
    };
    let nodes: BTreeSet<u32> = frame.taxels(found).iter().copied().collect();
    if nodes != right.nodes || found.id != right.id {
        return Err(format!("{} {nodes:?} {} {:?}", found.id, right.id, right.nodes));
    }
    let bound = &right.bound;
    same("total", found.total, right.total, bound.share * right.total)?;
    same("age", found.age_s, right.age_s, 1e-12)?;
    if right.link_in_doubt {
        return Ok(());
    }
    let way = skin.link_from_body(right.link);
    if found.link != right.link {
        return Err(format!("link {} {}", found.link, right.link));
    }
    let [a, b] = [found.force_newton, right.force_newton].map(|force| force.unwrap_or(-1.0));
    same("force", a, b, bound.share * b)?;
    near("centre", found.centre, way.transform_point3(right.centre), 1e-12)?;
    for share in frame.links(found) {
        let right = right.wrenches[&share.link];
        let wrench = share.wrench.ok_or("no wrench")?;
        near("force", wrench.force_newton, right.force_newton, bound.share * right.forces_newton)?;
        near("torque", wrench.torque_newton_m, right.torque_newton_m, bound.share * right.torques_newton_m)?;
    }
    // Without a surface it hangs on the base.
    let has_surface = skin.surface().has_surface(skin.cell_of(found.base));
    if has_surface || !right.base_in_doubt {
        near("position", found.position, way.transform_point3(right.position), bound.position_m)?;
    }
    let flags_in_doubt = [
        (bound.tie_in_doubt, TouchFlags::TIE | TouchFlags::COINCIDENT),
        (bound.isotropic_in_doubt, TouchFlags::ISOTROPIC),
    ];
    let in_doubt =
        flags_in_doubt.into_iter().filter(|(is_so, _)| *is_so).map(|(_, flags)| flags).collect::<TouchFlags>();
    if right.base_in_doubt {
        return Ok(());
    }
    let compared = TouchFlags::all() - in_doubt - TouchFlags::INCOMPLETE - TouchFlags::NO_UNIT;
    if (found.flags & compared) != (right.flags & compared) {
        return Err(format!("flags {:?} {:?}", found.flags, right.flags));
    }
    if let (Some(a), Some(b)) = (found.anisotropy, right.anisotropy) {
        same("anisotropy", a, b, bound.anisotropy)?;
        for k in 0..2 {
            let [a, b] = [found.spread_m, right.spread_m].map(|spread| spread.map_or(-1.0, |spread| spread[k]));
            same("spread", a, b, bound.spread_m[k])?;
        }
    }
    if let (Some(a), Some(b), Some(within)) = (found.principal_axis, right.axis, bound.axis_rad) {
        same("axis", between(a, way.transform_vector3(b)), 0.0, within + 1e-7)?;
    }
    if let (Some(a), Some(b), Some(within)) = (found.orientation, right.orientation, bound.orientation_rad) {
        same("orientation", between(a, way.transform_vector3(b)), 0.0, within + 1e-7)?;
    }
    if let (Some(a), Some(b)) = (found.velocity, right.velocity) {
        // Of two positions, a fifth of a second apart; how far the other one was off is not kept here.
        near(
            "velocity",
            a,
            way.transform_vector3(b),
            (bound.position_m + 1e-4 * f64::from(u8::from(bound.share > 1e-9))) * 20.0,
        )?;
    }
    Ok(())
}

/// A skin over several links and turned, of one of several kinds.
fn any_skin(random: &mut Random, kind: usize) -> SkinParts {
    let mut parts = match kind % 5 {
        0 => grid_parts(11, 9, 0.01),
        1 => limb(12, 9, 0.01),
        2 => scattered([0.1, 0.09], 0.01),
        3 => bent(12, 8, 0.008, false, |x, y| {
            let (a, b) = (x / 0.03, y / 0.03 - 1.0);
            let normal = DVec3::new(a.sin() * b.cos(), b.sin(), a.cos() * b.cos());
            (normal * 0.03, normal)
        }),
        _ => {
            let mut parts = scattered([0.1, 0.1], 0.009);
            parts.surface.clear();
            parts
        }
    };
    let way = DAffine3::from_axis_angle(DVec3::new(0.3, -0.8, 0.5).normalize(), TAU * random.next())
        * DAffine3::from_translation(DVec3::new(random.next(), random.next(), 3.0));
    for taxel in &mut parts.taxels {
        taxel.link = u32::from(taxel.position.x > 0.04) + u32::from(taxel.position.y > 0.05);
        taxel.position = way.transform_point3(taxel.position);
        taxel.normal = way.transform_vector3(taxel.normal);
        let tilt = DVec3::new(random.next(), random.next(), random.next()) - 0.5;
        taxel.mean_normal = (taxel.normal + tilt * 0.2).normalize();
        taxel.cell_m2 *= 0.5 + random.next();
        taxel.reading.weighs_by_cell = !kind.is_multiple_of(3);
        taxel.reading.sigma = 0.01;
    }
    parts.surface.iter_mut().for_each(|(_, corners)| *corners = corners.map(|corner| way.transform_point3(corner)));
    let tilted = DAffine3::from_axis_angle(DVec3::Y, 0.7) * DAffine3::from_translation(DVec3::X);
    parts.body_from_link = vec![way, tilted, DAffine3::IDENTITY];
    parts
}

#[test]
fn touches_are_those_of_the_definition() {
    let [compared, in_doubt, several, merged] = compare(0.0, 60);
    assert!(compared > 3000 && in_doubt < compared / 20, "{compared} {in_doubt}");
    assert!(several > 500 && merged > 20, "{several} {merged}");
}

#[test]
fn touches_of_pressures_that_are_off_are_within_their_bounds() {
    for share in [1e-7, 1e-4] {
        let [compared, in_doubt, ..] = compare(share, 30);
        assert!(compared > 500 && in_doubt < 4 * compared, "{share}: {compared} {in_doubt}");
    }
}

/// Compares touches with their definition, where pressures are off by up to `share` of themselves: how many touches were compared,
/// how many frames were in doubt, in how many there were several, and how many touches merged.
fn compare(share: f64, cases: usize) -> [usize; 4] {
    let mut random = Random(11);
    let (mut compared, mut in_doubt, mut several, mut merged) = (0, 0, 0, 0);
    for case in 0..cases {
        let skin = Arc::new(Skin::from_parts(any_skin(&mut random, case)));
        let thresholds = if case % 4 == 0 { (0.5, 0.25) } else { (0.0, 0.0) };
        let options = Options { on: thresholds.0, off: thresholds.1, ..everything() };
        let mut touches = Touches::new(skin.clone(), options);
        let mut right = Reference::default();
        let anywhere = |random: &mut Random| skin.taxels()[random.below(skin.nodes())].position;
        let mut fingers: Vec<(DVec3, f64)> = (0..4).map(|_| (anywhere(&mut random), 1.0)).collect();
        let gains: Vec<f64> = (0..skin.nodes()).map(|_| (0.15 * random.normal()).exp()).collect();
        let mut gaps = BTreeSet::new();
        for index in 0..40 {
            for (centre, height) in &mut fingers {
                if random.next() < 0.03 {
                    *centre = anywhere(&mut random);
                }
                *centre += DVec3::new(random.normal(), random.normal(), random.normal()) * 0.001;
                *height = (*height + 0.2 * random.normal()).clamp(0.0, 2.0);
            }
            if random.next() < 0.2 {
                gaps = (0..random.below(12)).map(|_| random.below(skin.nodes()) as u32).collect();
            }
            // Whole parts, so that there are ties and that sums are exact.
            let parts = if case % 2 == 0 { 16.0 } else { 256.0 };
            let felt = bumps(&skin, &fingers, 0.012);
            let noisy = |(pressure, gain): (&f64, &f64)| {
                if share > 0.0 { pressure * gain } else { (pressure * gain * parts).round() / parts }
            };
            let pressures: Vec<f64> = felt.iter().zip(&gains).map(noisy).collect();
            let off: Vec<f64> =
                pressures.iter().map(|pressure| pressure * (1.0 + share * (2.0 * random.next() - 1.0))).collect();
            let t_s = 0.02 * f64::from(index);
            let mut given = frame(t_s, pressures, gaps.clone());
            given.restarts = random.next() < 0.01;
            let without: Vec<u32> = gaps.iter().copied().collect();
            let input = Input { without_value: &without, restarts: given.restarts, ..Input::new(t_s, &off[..]) };
            let mut found = TouchFrame::default();
            touches.step(input, &mut found);
            let (all, released) = right.step(&skin, &options, &given, share);
            if all.iter().any(|touch| touch.in_doubt) {
                in_doubt += 1;
                touches = Touches::new(skin.clone(), options);
                right = Reference::default();
                continue;
            }
            let nodes: Vec<_> = found.touches.iter().map(|touch| (touch.id, found.taxels(touch))).collect();
            let right_nodes: Vec<_> = all.iter().map(|touch| (touch.id, &touch.nodes)).collect();
            assert_eq!(nodes.len(), right_nodes.len(), "case {case}, frame {index}: {nodes:?} {right_nodes:?}");
            assert_eq!(found.released, released, "case {case}, frame {index}");
            for (touch, right) in found.touches.iter().zip(&all) {
                if let Err(why) = agrees(&skin, &found, touch, right) {
                    panic!("case {case}, frame {index}: {why}");
                }
                compared += 1;
                merged += usize::from(touch.flags.contains(TouchFlags::MERGED));
            }
            several += usize::from(all.len() > 1);
        }
    }
    [compared, in_doubt, several, merged]
}

#[test]
fn a_definition_that_is_off_is_found_out() {
    // The control: another threshold, another weight and another limit are seen.
    let skin = Arc::new(Skin::from_parts(grid_parts(20, 9, 0.005)));
    let two = [-0.5, 0.5].map(|side| (DVec3::new(0.05 + side * 0.02, 0.02, 0.0), 1.0 + 0.3 * side));
    let pressures = bumps(&skin, &two, 0.005);
    let mut found = TouchFrame::default();
    Touches::new(skin.clone(), everything()).step(Input::new(0.0, &pressures[..]), &mut found);
    let given = frame(0.0, pressures, BTreeSet::new());
    let all = |options: &Options| Reference::default().step(&skin, options, &given, 0.0).0;
    let right = all(&everything());
    assert_eq!(right.len(), found.touches.len());
    let mut other = everything();
    other.splits.split = 0.2;
    assert_ne!(all(&other).len(), right.len());
    other.splits = Splits { candidate: 0.1, ..Default::default() };
    assert_ne!(all(&other).len(), right.len());
    let mut parts = grid_parts(20, 9, 0.005);
    parts.taxels.iter_mut().for_each(|taxel| taxel.cell_m2 *= 1.0 + 0.01 * taxel.position.x);
    let (other, _) = Reference::default().step(&Skin::from_parts(parts), &everything(), &given, 0.0);
    assert!(other.iter().zip(&found.touches).any(|(right, touch)| agrees(&skin, &found, touch, right).is_err()));
}
