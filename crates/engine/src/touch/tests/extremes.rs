//! Cut recordings, extreme input, gaps, and shares.

use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;

use glam::{DAffine3, DVec3};

use super::common::{Random, between, bumps, everything, limb, step, touches};
use crate::percept::{TouchFlags, TouchFrame};
use crate::touch::layouts::{bent, grid_parts};
use crate::touch::{Input, Skin, SkinParts, Touches};

#[test]
fn a_recording_cut_anywhere_gives_the_same_bits() {
    let skin = Arc::new(Skin::from_parts(limb(30, 20, 0.006)));
    let mut random = Random(2);
    let frames: Vec<Vec<f64>> = (0..60)
        .map(|index| {
            let turn = 0.05 * f64::from(index);
            let centre = |turn: f64, y: f64| DVec3::new(0.0286 * turn.sin(), y, 0.0286 * turn.cos());
            let mut felt = bumps(&skin, &[(centre(turn, 0.05), 1.0), (centre(-turn, 0.06), 0.8)], 0.007);
            felt.iter_mut().for_each(|pressure| *pressure *= 1.0 + 0.05 * random.normal());
            felt
        })
        .collect();
    let run = |touches: &mut Touches, from: usize, to: usize| -> Vec<TouchFrame> {
        (from..to).map(|index| step(touches, 0.01 * index as f64, &frames[index])).collect()
    };
    let mut whole = Touches::new(skin.clone(), everything());
    let right = run(&mut whole, 0, frames.len());
    assert!(right.iter().any(|frame| !frame.released.is_empty()) && right.iter().any(|frame| frame.touches.len() == 2));
    for cut in [1, 7, 20, 33, 59] {
        let mut first = Touches::new(skin.clone(), everything());
        assert_eq!(run(&mut first, 0, cut), right[..cut]);
        let state = first.state();
        // Another one, that has been elsewhere.
        let mut second = Touches::new(skin.clone(), everything());
        run(&mut second, 10, 20);
        second.restore(&state);
        assert_eq!(run(&mut second, cut, frames.len()), right[cut..]);
        first.restore(&state);
        assert_eq!(run(&mut first, cut, frames.len()), right[cut..]);
    }
    assert_ne!(run(&mut Touches::new(skin, everything()), 7, 60), right[7..], "the control");
}

#[test]
fn extremes_give_finite_values_or_flags() {
    let sound = |frame: &TouchFrame| {
        frame.touches.iter().all(|touch| {
            let vectors = [Some(touch.position), Some(touch.centre), Some(touch.normal)];
            let more = [touch.principal_axis, touch.orientation, touch.velocity];
            let numbers = [Some(touch.total), touch.anisotropy, touch.force_newton, touch.principal_axis_rad];
            vectors.iter().chain(&more).flatten().all(|vector| vector.is_finite())
                && numbers.iter().flatten().all(|number| number.is_finite())
        })
    };
    let mut nothing = touches(SkinParts::default());
    assert_eq!(step(&mut nothing, 0.0, &[]), TouchFrame::default());
    assert_eq!(step(&mut nothing, 0.0, &[1.0]), TouchFrame::default());
    for (size_m, pitch_m, far_m) in [(5_u32, 0.01, 0.0), (5, 1e-5, 0.0), (5, 0.01, 1e4)] {
        let mut parts = bent(size_m, size_m, pitch_m, false, |x, y| (DVec3::new(x + far_m, y, far_m), DVec3::Z));
        parts.body_from_link = vec![DAffine3::from_translation(DVec3::new(far_m, 0.0, far_m))];
        let mut touches = touches(parts);
        let values = [
            0.0,
            -0.0,
            -1.0,
            f64::NAN,
            f64::INFINITY,
            f64::NEG_INFINITY,
            5e-324,
            2.0_f64.powi(-60),
            1.0,
            2.0_f64.powi(60),
        ];
        for (index, value) in values.into_iter().enumerate() {
            let frame = step(&mut touches, index as f64, &[value; 25]);
            let is_pressed = value > 1e-300 && value.is_finite();
            assert_eq!(frame.touches.len(), usize::from(is_pressed), "{value}");
            assert!(sound(&frame), "{value}: {frame:?}");
            for touch in &frame.touches {
                let middle = DVec3::new(2.0 * pitch_m, 2.0 * pitch_m, 0.0);
                let off_m = touch.position.distance(middle);
                assert!(off_m < 1e-6 * pitch_m + 1e-11, "{value}: {off_m}");
                assert!(touch.flags.contains(TouchFlags::ISOTROPIC), "{:?}", touch.flags);
                assert!(touch.principal_axis.is_none());
            }
        }
        // One, two, a row.
        let only =
            |nodes: &[usize]| -> Vec<f64> { (0..25).map(|node| f64::from(u8::from(nodes.contains(&node)))).collect() };
        let frame = step(&mut touches, 20.0, &only(&[12]));
        assert!(frame.touches[0].flags.contains(TouchFlags::ONE_TAXEL) && sound(&frame));
        let frame = step(&mut touches, 21.0, &only(&[12, 13]));
        assert!(between(frame.touches[0].principal_axis.unwrap(), DVec3::X) < 1e-6);
        assert!((frame.touches[0].anisotropy.unwrap() - 1.0).abs() < 1e-9);
        let frame = step(&mut touches, 22.0, &only(&[2, 7, 12, 17, 22]));
        let [touch] = &frame.touches[..] else { panic!() };
        assert!((touch.principal_axis_rad.unwrap() - FRAC_PI_2).abs() < 1e-6);
        // Two apart, and diagonal ones have no edge.
        assert_eq!(step(&mut touches, 23.0, &only(&[0, 6])).touches.len(), 2);
    }
    // Without cells.
    let mut parts = grid_parts(3, 3, 0.01);
    parts.taxels.iter_mut().for_each(|taxel| taxel.cell_m2 = 0.0);
    assert!(sound(&step(&mut touches(parts), 0.0, &[1.0; 9])));
    // All at one place.
    let mut parts = grid_parts(3, 3, 0.01);
    parts.taxels.iter_mut().for_each(|taxel| taxel.position = DVec3::ONE);
    parts.surface.clear();
    let frame = step(&mut touches(parts), 0.0, &[1.0; 9]);
    assert!(frame.touches[0].flags.contains(TouchFlags::COINCIDENT) && sound(&frame));
    assert!(frame.touches[0].position.distance(DVec3::ONE) < 1e-12);
}

#[test]
fn gaps_are_bridged_and_flagged() {
    let mut touches = touches(grid_parts(9, 1, 0.01));
    let pressures = [0.0, 1.0, 2.0, 0.0, 2.0, 0.5, 0.0, 0.0, 1.0];
    let mut frame = TouchFrame::default();
    let run = |touches: &mut Touches, gaps: &[u32], notes: &[(u32, TouchFlags)], frame: &mut TouchFrame| {
        touches.step(Input { without_value: gaps, notes, ..Input::new(0.0, &pressures[..]) }, frame);
        frame.touches.iter().map(|touch| (touch.active, touch.flags - TouchFlags::YOUNG)).collect::<Vec<_>>()
    };
    let flags = TouchFlags::empty();
    let one = |flags: TouchFlags| (1, flags | TouchFlags::ONE_TAXEL);
    assert_eq!(run(&mut touches, &[], &[], &mut frame), [(2, flags), (2, flags), one(flags)]);
    // The gap is a bridge: one touch now, of what was two.
    let bridged = run(&mut touches, &[3], &[], &mut frame);
    assert_eq!(bridged, [(4, TouchFlags::INCOMPLETE | TouchFlags::MERGED), one(flags)]);
    let noted = [(3, TouchFlags::FAULTY_INPUT), (8, TouchFlags::SATURATED)];
    let noted = run(&mut touches, &[3], &noted, &mut frame);
    assert_eq!(noted[0].1, TouchFlags::FAULTY_INPUT);
    assert_eq!(noted[1], one(TouchFlags::SATURATED));
    // Nothing of that is left.
    assert_eq!(run(&mut touches, &[], &[], &mut frame)[1], one(flags));
}

#[test]
fn shares_of_fields_and_links_add_up() {
    let mut parts = grid_parts(6, 1, 0.01);
    parts.taxels[3..].iter_mut().for_each(|taxel| taxel.link = 1);
    parts.body_from_link = vec![DAffine3::IDENTITY, DAffine3::from_translation(DVec3::X * 0.03)];
    let mut skin = Skin::from_parts(parts);
    skin.set_fields(&[vec![0, 1, 2, 3, 4, 5], vec![], vec![4, 2], vec![5, 77]]);
    let mut touches = Touches::new(Arc::new(skin), everything());
    let frame = step(&mut touches, 0.0, &[0.0, 1.0, 2.0, 2.0, 3.0, 0.0]);
    let [touch] = &frame.touches[..] else { panic!() };
    assert_eq!((touch.link, touch.total), (1, 8.0));
    assert!(touch.flags.contains(TouchFlags::SEVERAL_LINKS));
    let fields: Vec<(u32, f64)> = frame.fields(touch).iter().map(|share| (share.field, share.total)).collect();
    assert_eq!(fields, [(0, 8.0), (2, 5.0)]);
    let links: Vec<(u32, f64)> = frame.links(touch).iter().map(|share| (share.link, share.total)).collect();
    assert_eq!(links, [(0, 3.0), (1, 5.0)]);
    // (1·1 + 2·2 + 2·3 + 3·4) / 8 pitches, in the second link.
    assert!(touch.position.distance(DVec3::X * (0.01 * 23.0 / 8.0 - 0.03)) < 1e-8);
    // All that is pressed on a link, with what is not part of the touch.
    let frame = step(&mut touches, 0.1, &[1.0, 0.0, 2.0, 2.0, 3.0, 0.0]);
    assert_eq!(frame.touches.len(), 2);
    let mut on_links = Vec::new();
    touches.on_links(&mut on_links);
    assert_eq!(on_links.iter().map(|share| (share.link, share.total)).collect::<Vec<_>>(), [(0, 3.0), (1, 5.0)]);
    let wrench = on_links[1].wrench.unwrap();
    assert!(wrench.force_newton.distance(DVec3::Z * -5e-4) < 1e-12);
    // Two newtons at the second link's origin, three a pitch away along +x: T = x × F.
    assert!(wrench.torque_newton_m.distance(DVec3::Y * (0.01 * 3e-4)) < 1e-12, "{}", wrench.torque_newton_m);
}
