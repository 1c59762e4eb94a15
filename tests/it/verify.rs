//! The comparison with the reference: what it counts, and that it goes on after what is too close to call.

use somatic::source::{CsvSource, Source};
use somatic::{
    Agreement, BackendKind, Body, Calibration, Engine, Frame, Options, Outputs, Percepts, Scene, TouchOutputs,
};

use crate::common::{Flat, backends, data, frame};

/// Ten taxels in a row, a centimetre apart, in a field with a chart.
fn row() -> Body {
    let uv: Vec<[f64; 2]> = (0..10).map(|i| [0.01 * f64::from(i) - 0.045, 0.0]).collect();
    Flat::new(&uv).field("row", None, 0..10).surface(0.1).body()
}

fn engine(body: &Body, backend: BackendKind, calibration: &str, outputs: Outputs) -> Engine {
    let ids: Vec<u32> = body.taxels.iter().map(|taxel| taxel.id).collect();
    let calibration = Some(Calibration::parse(calibration, &ids).unwrap());
    let scene = Scene::default().outputs(outputs);
    Engine::new(body, Options::default().backend(backend).scene(scene).calibration(calibration).batch(64)).unwrap()
}

/// Backends that are compared with the reference.
fn others() -> impl Iterator<Item = BackendKind> {
    backends().into_iter().filter(|&backend| backend != BackendKind::Reference)
}

/// How `frames` compare, all at once and one by one, which is the same.
fn compared(body: &Body, backend: BackendKind, calibration: &str, outputs: Outputs, frames: &[Frame]) -> Agreement {
    let cut_by = |cut: usize| {
        let mut engine = engine(body, backend, calibration, outputs);
        let mut plain = self::engine(body, backend, calibration, outputs);
        let mut sum = Agreement::default();
        for part in frames.chunks(cut) {
            let (percepts, agreement) = engine.process_and_compare(part).unwrap();
            check_sums(percepts, &agreement);
            sum.merge(agreement);
            // A comparison changes no bit of what it compares.
            assert_eq!(percepts, plain.process(part).unwrap(), "{backend:?}");
        }
        sum
    };
    let whole = cut_by(frames.len());
    let one_by_one = cut_by(1);
    assert_eq!(whole, one_by_one, "{backend:?}");
    whole
}

/// Every value that a backend has is counted; the reference may have some more.
fn check_sums(percepts: &Percepts, agreement: &Agreement) {
    let count = |name: &str| agreement.quantities.get(name).map_or(0, somatic::Comparison::values);
    let all = || (0..percepts.frames()).flat_map(|frame| percepts.frame(frame));
    let present = [
        ("total", all().filter(|p| p.total.is_some()).count()),
        ("active", all().filter(|p| p.active.is_some()).count()),
        ("centroid", all().filter(|p| p.centroid.is_some()).count()),
        ("position", all().filter(|p| p.position.is_some()).count()),
        ("orientation", all().filter(|p| p.orientation.is_some()).count()),
        ("speed", all().filter(|p| p.speed.is_some()).count()),
        ("filtered_direction", all().filter(|p| p.filtered_direction.is_some()).count()),
    ];
    for (name, present) in present {
        assert!(count(name) >= present as u64, "{name}: {} of {present} values", count(name));
    }
    let fields = percepts.fields();
    let cells = (percepts.frames() * fields) as u64;
    assert_eq!([agreement.percepts, count("flags"), count("contact")], [cells; 3]);
    for (name, of) in &agreement.quantities {
        assert!(of.agreeing <= of.compared && (agreement.failed > 0 || of.agreeing == of.compared), "{name}: {of:?}");
    }
}

#[test]
fn constants_that_single_precision_has_not_are_no_disagreement() {
    // A tenth of 10 is 1, on the dead band; the other frames are clear of it.
    let frames = [frame(0.0, &[10.0; 10]), frame(0.1, &[11.0; 10]), frame(0.2, &[13.0; 10]), frame(0.3, &[9.0; 10])];
    let calibration = "[all]\ngain = 0.1\ndead_band = 1\n";
    for backend in others() {
        let agreement = compared(&row(), backend, calibration, Outputs::all(), &frames);
        assert!(agreement.holds(), "{backend:?}: {agreement}");
        let of = |name: &str| (agreement.quantities[name].compared, agreement.quantities[name].too_close);
        assert_eq!([of("total"), of("active"), of("flags"), of("contact")], [(3, 1); 4], "{agreement}");
        // Of the frames in contact, and of the one that may have been.
        assert_eq!(of("centroid").0, 2, "{agreement}");
    }
    let mut right = engine(&row(), BackendKind::Reference, calibration, Outputs::USUAL_AND_MOTION);
    let percepts = right.process(&frames).unwrap();
    let total = |frame| percepts.get(frame, 0).total.unwrap();
    assert_eq!((percepts.get(0, 0).contact, total(0)), (false, 0.0));
    assert!((total(1) - 11.0).abs() < 1e-12 && (total(2) - 13.0).abs() < 1e-12, "as the calibration is written");
}

#[test]
fn after_a_contact_too_close_to_call_all_is_compared_again() {
    // 0.1 + 0.2 is on the threshold of 0.3 at which contact begins; after that the sum stays in the band between the two,
    // where contact is what it was.
    let press = |t_s: f64, a: f64, b: f64| frame(t_s, &[a, b, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    let mut frames = vec![press(0.0, 0.1, 0.2)];
    frames.extend((1..20).map(|i| press(0.1 * f64::from(i), 0.11 + 0.001 * f64::from(i), 0.1)));
    for backend in others() {
        let agreement = compared(&row(), backend, "[contact]\non = 0.3\noff = 0.1\n", Outputs::all(), &frames);
        assert!(agreement.holds(), "{backend:?}: {agreement}");
        let contact = agreement.quantities["contact"];
        assert_eq!((contact.compared, contact.too_close), (19, 1), "{agreement}");
        for (name, of) in &agreement.quantities {
            assert!(of.too_close <= 1 && of.not_compared == 0, "{name}: {agreement}");
        }
    }
}

#[test]
fn motion_after_a_centroid_too_close_to_call_is_compared_where_percepts_tell_the_centroid() {
    // The sixth taxel is on its dead band in the first frame, so that nobody knows where the centroid was.
    let press = |t_s: f64, a: f64, b: f64, c: f64| frame(t_s, &[a, b, 0.0, 0.0, 0.0, c, 0.0, 0.0, 0.0, 0.0]);
    let mut frames = vec![press(0.0, 50.0, 70.0, 10.0)];
    frames.extend((1..20).map(|i| press(0.1 * f64::from(i), 50.0 + f64::from(i), 70.0, 0.0)));
    for backend in others() {
        for (outputs, compared, not_compared) in [(Outputs::all(), 19, 0), (Outputs::SPEED, 18, 1)] {
            let agreement = self::compared(&row(), backend, "[all]\ngain = 0.1\ndead_band = 1\n", outputs, &frames);
            assert!(agreement.holds(), "{backend:?}: {agreement}");
            let speed = agreement.quantities["speed"];
            assert_eq!(
                (speed.compared, speed.too_close, speed.not_compared),
                (compared, 0, not_compared),
                "{agreement}"
            );
        }
    }
}

/// All frames of a recording, and the ids they are for.
fn read(path: &std::path::Path) -> (Vec<u32>, Vec<Frame>) {
    let mut source = CsvSource::open(path, None).unwrap();
    let (ids, mut frames) = (source.taxels().to_vec(), Vec::new());
    let mut frame = Frame::missing(0.0, ids.len());
    while source.next_frame(&mut frame).unwrap() {
        frames.push(frame.clone());
    }
    (ids, frames)
}

#[test]
fn on_the_mat_a_tenth_as_gain_disagrees_nowhere() {
    let Some(folder) = data("recordings/mat") else { return };
    let body = Body::from_bytes("mat", somatic::bundled::MAT).unwrap();
    for backend in others() {
        let mut sum = Agreement::default();
        for posture in 1..=6 {
            let (ids, frames) = read(&folder.join(format!("posture_{posture}.csv")));
            let mut engine = engine(&body, backend, "[all]\ngain = 0.1\ndead_band = 1\n", Outputs::all());
            engine.set_channels(&ids).unwrap();
            let (percepts, agreement) = engine.process_and_compare(&frames).unwrap();
            check_sums(percepts, &agreement);
            sum.merge(agreement);
        }
        println!("{backend:?} {sum}");
        assert!(sum.holds(), "{backend:?}: {sum}");
        // The recordings are whole numbers, many of them 10: a field that holds one cannot be called.
        let (whole, total) = (sum.whole(), sum.quantities["total"]);
        assert!(whole.too_close > 0 && whole.not_compared == 0, "{sum}");
        assert!(total.compared > total.values() / 2 && total.too_close > 0, "{sum}");
    }
}

#[test]
fn touches_are_held_to_their_definition_and_a_comparison_changes_none() {
    let body = Body::from_bytes("humanoid", somatic::bundled::HUMANOID).unwrap();
    let wanted = TouchOutputs::USUAL | TouchOutputs::ORIENTATION | TouchOutputs::WRENCH;
    let options = || somatic::touch::Options { outputs: wanted, ..Default::default() };
    let scene = || Scene::default().touches(options()).outputs(Outputs::TOTAL);
    for backend in others() {
        let make = || {
            let ids: Vec<u32> = body.taxels.iter().map(|taxel| taxel.id).collect();
            let calibration =
                Some(Calibration::parse("[all]\ngain = 0.37\ndead_band = 3\nunit = \"kPa\"\n", &ids).unwrap());
            let options = Options::default().backend(backend).scene(scene()).calibration(calibration).batch(64);
            Engine::new(&body, options).unwrap()
        };
        let (mut engine, mut plain) = (make(), make());
        // Blobs that move over the skin, merge and part, and noise that makes single taxels come and go.
        let frame = |index: usize| {
            let mut frame = engine.frame(0.02 * index as f64);
            for (place, value) in frame.values.iter_mut().enumerate() {
                let wave = (place as f64 * 0.03 + index as f64 * 0.11).sin().max(0.0).powi(4);
                let noise = f64::from((place * 7919 + index * 104_729) as u32 % 100) * 0.01;
                *value = somatic::RawValue::new(400.0 * wave + 10.5 * noise);
            }
            frame
        };
        let frames: Vec<Frame> = (0..24).map(frame).collect();
        let mut sum = Agreement::default();
        for part in frames.chunks(5) {
            let (percepts, agreement) = engine.process_and_compare(part).unwrap();
            assert_eq!(percepts, plain.process(part).unwrap(), "{backend:?}");
            sum.merge(agreement);
        }
        println!("{backend:?} {sum}");
        assert!(sum.holds(), "{backend:?}: {sum}");
        let of = |name: &str| sum.quantities[name];
        assert_eq!(of("touches").values(), sum.touches, "every touch is counted once: {sum}");
        assert!(of("touches").compared > 500 && of("touches.position").compared > 500, "{sum}");
        assert!(of("touches.velocity").compared > 20 && of("touches.principal_axis").compared > 100, "{sum}");
        assert!(of("touches.orientation").compared > 100 && of("touches.wrench").compared > 500, "{sum}");
        assert!(of("touches.position").worst_error > 0.0, "single precision is seen: {sum}");
    }
}
