//! What must hold for any skin and any touch, found out by random ones that shrink to the smallest that does not.

use glam::DVec3;
use proptest::prelude::*;
use somatic::body::{ChartKind, ChartSpec, FieldSpec, MemberSpec, Modality, Taxel};
use somatic::internal::body::Glb;
use somatic::{
    BackendKind, Body, Calibration, Engine, Flags, Frame, Letter, Options, Percept, Percepts, Receptor, Scene,
};

use crate::common::{backends, engine, frame};

/// A taxel's place, weight and pressure.
type Touch = ([f64; 2], f64, f64);

fn touch() -> impl Strategy<Value = Touch> {
    // A third of the taxels idle; the others over all that a sensor gives, and a little beyond.
    let pressure = prop_oneof![3 => Just(0.0), 5 => 1.0..1023.0, 1 => (-59.0..59.0).prop_map(f64::exp2)];
    let weight = prop_oneof![4 => Just(1.0), 1 => 0.01..100.0];
    ([-0.1..0.1, -0.1..0.1], weight, pressure)
}

fn touches(most: usize) -> impl Strategy<Value = Vec<Touch>> {
    prop::collection::vec(touch(), 1..most)
}

/// A flat body whose points stand in the file in the order `order` gives, with one field a chart.
fn body(touches: &[Touch], order: &[usize], charts: &[ChartSpec]) -> Body {
    let mut glb = Glb::new();
    let link = glb.node("skin", None, DVec3::ZERO);
    let taxels: Vec<Taxel> = order
        .iter()
        .map(|&id| Taxel {
            id: id as u32,
            link: 0,
            position_in_link: DVec3::new(touches[id].0[0], 0.0, -touches[id].0[1]),
            normal_in_link: DVec3::Y,
            area: 1e-4,
            modality: Modality::Pressure,
            tangent_in_link: None,
        })
        .collect();
    glb.taxels("taxels", Some(link), &taxels, None);
    for (index, chart) in charts.iter().enumerate() {
        let weight = |id: usize| MemberSpec { weight: touches[id].1, uv: None };
        let members = (0..touches.len()).map(|id| (id as u32, weight(id))).collect();
        let spec = FieldSpec { name: format!("field_{index}"), members, chart: Some(*chart), parent: None };
        glb.field(&spec, Some(link), DVec3::ZERO);
    }
    Body::from_bytes("random", &glb.to_bytes().unwrap()).unwrap()
}

/// A chart with its origin at (u, v) of the skin, turned by `angle`.
fn chart([u, v]: [f64; 2], angle: f64) -> ChartSpec {
    ChartSpec {
        kind: ChartKind::Plane,
        origin_in_anchor: Some([u, 0.0, -v]),
        u_in_anchor: Some([angle.cos(), 0.0, -angle.sin()]),
    }
}

fn values(touches: &[Touch]) -> Vec<f64> {
    touches.iter().map(|&(_, _, pressure)| pressure).collect()
}

fn run(body: &Body, kind: BackendKind, values: &[f64]) -> Percepts {
    engine(body, kind).process(&[frame(0.0, values)]).unwrap().clone()
}

fn between_lines(a: f64, b: f64) -> f64 {
    let d = (a - b).rem_euclid(std::f64::consts::PI);
    d.min(std::f64::consts::PI - d)
}

/// Whether the choice of the two farthest points is clear, and the answer so far from degenerate that f64 keeps it.
fn is_clear(p: &Percept) -> bool {
    !p.flags.intersects(Flags::TIE | Flags::COINCIDENT) && p.anisotropy.is_some_and(|a| a > 1e-2)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn every_backend_keeps_its_bounds(touches in touches(60), origin in [-0.1..0.1, -0.1..0.1], angle in 0.0..3.1) {
        let order: Vec<usize> = (0..touches.len()).collect();
        let body = body(&touches, &order, &[chart([0.0; 2], 0.0), chart(origin, angle)]);
        for kind in backends() {
            let mut engine = engine(&body, kind);
            let (_, agreement) = engine.process_and_compare(&[frame(0.0, &values(&touches))]).unwrap();
            prop_assert!(agreement.holds(), "{kind:?}: {agreement}");
        }
    }

    #[test]
    fn every_backend_hears_changes_within_its_bounds_however_they_are_cut(
        touches in touches(40),
        // Per frame: what each taxel's pressure is multiplied by, taken in turn, and the time since the frame before.
        frames in prop::collection::vec(
            (prop::collection::vec(prop_oneof![2 => Just(1.0), 1 => Just(0.0), 1 => 0.9..1.1], 1..5),
             prop_oneof![4 => Just(0.02), 1 => 1e-4..5.0, 1 => Just(0.0)]),
            1..8,
        ),
        gain in prop_oneof![Just(1.0), 0.001..1e3],
        keys in prop_oneof![Just(""), Just("[change]\ndead_band = 50\non = 300\noff = 120\n")],
    ) {
        let order: Vec<usize> = (0..touches.len()).collect();
        let body = body(&touches, &order, &[chart([0.0; 2], 0.0)]);
        let ids: Vec<u32> = (0..touches.len() as u32).collect();
        let calibration = Calibration::parse(&format!("{keys}[all]\ngain = {gain}\n"), &ids).unwrap();
        let (mut t_s, pressures) = (0.0, values(&touches));
        let frames: Vec<Frame> = frames.iter().map(|(factors, dt_s)| {
            t_s += dt_s;
            let values: Vec<f64> = pressures.iter().zip(factors.iter().cycle()).map(|(p, f)| p * f).collect();
            frame(t_s, &values)
        }).collect();
        for kind in backends() {
            let run = |cut: usize| {
                let scene = Scene::default().letters(Letter::all_of(&[Receptor::Change, Receptor::Sustained], &[])).outputs(somatic::Outputs::all());
                let calibration = Some(calibration.clone());
                let mut engine =
                    Engine::new(&body, Options::default().scene(scene).calibration(calibration).backend(kind).batch(64)).unwrap();
                let mut seen: Vec<Percept> = Vec::new();
                for part in frames.chunks(cut) {
                    let (percepts, agreement) = engine.process_and_compare(part).unwrap();
                    prop_assert!(agreement.holds(), "{kind:?}: {agreement}");
                    seen.extend((0..part.len()).flat_map(|frame| percepts.frame(frame)));
                }
                Ok(seen)
            };
            let whole = run(frames.len())?;
            for cut in [1, 3] {
                prop_assert_eq!(&run(cut)?, &whole, "{:?} cut by {}", kind, cut);
            }
            // To itself a recording that stands still is no change.
            for pair in frames.windows(2).zip(whole.chunks(2).skip(1)).filter(|(pair, _)| pair[0].values == pair[1].values) {
                prop_assert!(!pair.1[0].contact, "{:?}", pair.1[0]);
            }
        }
    }

    #[test]
    fn the_order_of_points_in_the_file_changes_nothing(
        (touches, order) in touches(40).prop_flat_map(|t| {
            let order: Vec<usize> = (0..t.len()).collect();
            (Just(t), Just(order).prop_shuffle())
        })
    ) {
        let straight: Vec<usize> = (0..touches.len()).collect();
        let chart = chart([0.0; 2], 0.0);
        for kind in [BackendKind::Reference, BackendKind::Cpu] {
            let one = run(&body(&touches, &straight, &[chart]), kind, &values(&touches));
            let other = run(&body(&touches, &order, &[chart]), kind, &values(&touches));
            prop_assert_eq!(one, other);
        }
    }

    #[test]
    fn moving_and_turning_the_chart_moves_and_turns_the_answer(
        touches in touches(40), origin in [-0.1..0.1, -0.1..0.1], angle in -3.0..3.0
    ) {
        // Within what a sensor gives: a value 2⁵⁰ times the others leaves f64 no digits for them.
        let tame = |&(uv, weight, pressure): &Touch| (uv, f64::clamp(weight, 0.1, 10.0), if pressure < 1.0 { 0.0 } else { f64::min(pressure, 1023.0) });
        let touches: Vec<Touch> = touches.iter().map(tame).collect();
        let order: Vec<usize> = (0..touches.len()).collect();
        let body = body(&touches, &order, &[chart([0.0; 2], 0.0), chart(origin, angle)]);
        // The other backends are held to this one on charts like these above.
        let percepts = run(&body, BackendKind::Reference, &values(&touches));
        let (plain, turned) = (percepts.get(0, 0), percepts.get(0, 1));
        prop_assert_eq!((plain.total, plain.active, plain.contact), (turned.total, turned.active, turned.contact));
        if let (Some([u, v]), Some(got)) = (plain.centroid, turned.centroid) {
            let (du, dv) = (u - origin[0], v - origin[1]);
            let right = [du * angle.cos() + dv * angle.sin(), dv * angle.cos() - du * angle.sin()];
            prop_assert!((got[0] - right[0]).abs() < 1e-14 && (got[1] - right[1]).abs() < 1e-14, "{got:?} {right:?}");
        }
        if is_clear(&plain) && is_clear(&turned) {
            for (a, b) in [(plain.orientation, turned.orientation), (plain.principal_axis, turned.principal_axis)] {
                prop_assert!(between_lines(a.unwrap() - angle, b.unwrap()) < 1e-8, "{a:?} {b:?} {angle}");
            }
            prop_assert!((plain.anisotropy.unwrap() - turned.anisotropy.unwrap()).abs() < 1e-9);
        }
        // Where it is on the body is nobody's coordinates' business.
        if let (Some(a), Some(b)) = (plain.position, turned.position) {
            prop_assert!(DVec3::from_array(a).distance(DVec3::from_array(b)) < 1e-12);
        }
    }

    #[test]
    fn scaling_pressure_changes_the_total_alone(touches in touches(40), exponent in -8..8, factor in 0.5..2.0) {
        let order: Vec<usize> = (0..touches.len()).collect();
        // Far from where values become nothing or unbelievable.
        let values: Vec<f64> = values(&touches).iter().map(|v| v.clamp(0.0, 2000.0)).map(|v| if v < 1e-6 { 0.0 } else { v }).collect();
        let body = body(&touches, &order, &[chart([0.0; 2], 0.0)]);
        let power = 2.0_f64.powi(exponent);
        let by = |factor: f64| values.iter().map(|v| v * factor).collect::<Vec<f64>>();
        // A raw value is single precision: only what that holds can be scaled without loss.
        let exact: Vec<f64> = values.iter().map(|&v| f64::from(v as f32)).collect();
        for kind in [BackendKind::Reference, BackendKind::Cpu] {
            let plain = run(&body, kind, &values).get(0, 0);
            let scaled = run(&body, kind, &by(power)).get(0, 0);
            let times = |x: Option<f64>| x.map(|x| x * power);
            let mut expected = plain;
            (expected.total, expected.peak) = (times(plain.total), times(plain.peak));
            prop_assert_eq!(scaled, expected);
        }
        let plain = run(&body, BackendKind::Reference, &exact).get(0, 0);
        let rounded = run(&body, BackendKind::Reference, &by(factor)).get(0, 0);
        if let (Some(a), Some(b)) = (plain.centroid, rounded.centroid) {
            // Each scaled value is rounded to single precision: a relative 2⁻²⁴ of coordinates up to 0.1 m, twice.
            prop_assert!((a[0] - b[0]).abs() < 2.5e-8 && (a[1] - b[1]).abs() < 2.5e-8, "{a:?} {b:?}");
        }
    }
}
