//! Fitted contacts against the truth of simulated touches, and why some are absent.

use glam::DVec2;
use somatic::scene::{Knobs, OrientationBy, Scene};
use somatic::source::{SimulatedSource, Source};
use somatic::{BackendKind, Body, Calibration, ContactKind, Engine, Flags, Frame, Options, Outputs, Percept, RawValue};

use crate::common::{Flat, backends};

/// Frames of a simulation with their truth, and the fits of one field.
struct Fitted {
    percepts: Vec<Percept>,
    /// (u, v), angle and force.
    truths: Vec<(DVec2, Option<f64>, f64)>,
}

/// Runs the simulation in `text` with its own calibration, with `[layer]` as `assumed` says it, if it does, in all steps.
fn fitted(body: &Body, text: &str, field: &str, assumed: Option<&str>) -> Fitted {
    fitted_by(OrientationBy::Fit, body, text, field, assumed)
}

/// The same in as many steps as `by` has.
fn fitted_by(by: OrientationBy, body: &Body, text: &str, field: &str, assumed: Option<&str>) -> Fitted {
    fitted_under(by, body, text, field, |mut calibration| {
        if let Some(assumed) = assumed {
            calibration.truncate(calibration.find("\n[layer]").unwrap_or(calibration.len()));
            calibration += assumed;
        }
        calibration
    })
}

/// The same under what `edit` makes of the simulation's calibration.
fn fitted_under(by: OrientationBy, body: &Body, text: &str, field: &str, edit: impl Fn(String) -> String) -> Fitted {
    let mut source = SimulatedSource::on_body("simulation", text, body.clone()).unwrap();
    let calibration = edit(source.calibration());
    let ids: Vec<u32> = body.taxels.iter().map(|taxel| taxel.id).collect();
    let calibration = Calibration::parse(&calibration, &ids).unwrap();
    let scene = Scene::default().outputs(Outputs::all()).fields([field]).knobs(Knobs::default().orientation_by(by));
    let options = Options::default().scene(scene).calibration(calibration).backend(BackendKind::Cpu).batch(256);
    let mut engine = Engine::new(body, options).unwrap();
    engine.set_channels(source.taxels()).unwrap();
    let (mut frames, mut truths) = (Vec::new(), Vec::new());
    let mut frame = Frame::missing(0.0, source.taxels().len());
    while source.next_frame(&mut frame).unwrap() {
        let truth = &source.truth()[0];
        truths.push((DVec2::from_array(truth.uv.unwrap()), truth.angle, truth.force_newton));
        frames.push(frame.clone());
    }
    let percepts = engine.process(&frames).unwrap();
    Fitted { percepts: (0..frames.len()).map(|frame| percepts.get(frame, 0)).collect(), truths }
}

fn rms(errors: &[f64]) -> f64 {
    (errors.iter().map(|error| error * error).sum::<f64>() / errors.len() as f64).sqrt()
}

fn quantile(errors: &[f64], share: f64) -> f64 {
    let mut sorted = errors.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted[((errors.len() as f64 * share) as usize).min(errors.len() - 1)]
}

fn degrees_between(a: f64, b: f64) -> f64 {
    let apart = (a - b).rem_euclid(std::f64::consts::PI);
    apart.min(std::f64::consts::PI - apart).to_degrees()
}

fn hand() -> Body {
    Body::from_bytes("hand", somatic::bundled::HAND).unwrap()
}

/// A rod that turns through half a circle in steps of a degree, its force rising, its middle `off` beside that of the field.
fn turning_rod(off: f64, radius_m: f64, length_m: f64, layer: &str) -> String {
    let middle = |degrees: i32| {
        let (sin, cos) = f64::from(degrees).to_radians().sin_cos();
        format!("[{}, {}]", -off * sin, off * cos)
    };
    let middles: Vec<String> = (0..=180).map(middle).collect();
    let times: Vec<String> = (0..=180).map(|t: i32| t.to_string()).collect();
    format!(
        "rate_hz = 1\nduration_s = 180\nseed = {}\n[layer]\nthickness_m = 0.007\n{layer}[sensor]\nkind = \"fsr\"\nwiper = 38\n\
         noise_sigma = 1\n[[touch]]\non = \"hand/back\"\nindenter = \"rod\"\nradius_m = {radius_m}\nlength_m = {length_m}\n\
         angle_deg = [[0, 0], [180, 180]]\npath = [{}]\ntimes_s = [{}]\nforce_newton = [[0, {}], [180, {}]]\n",
        (1e6 * (off + 1.0)) as u64,
        middles.join(","),
        times.join(","),
        400.0 * length_m,
        800.0 * length_m
    )
}

fn rods(length_m: f64, layer: &str, assumed: Option<&str>) -> Vec<[f64; 4]> {
    rods_by(OrientationBy::Fit, length_m, layer, assumed)
}

/// Per rod that was fitted with an angle: the errors of the axis and of the fit, degrees, and of both across it, mm.
fn rods_by(by: OrientationBy, length_m: f64, layer: &str, assumed: Option<&str>) -> Vec<[f64; 4]> {
    let body = hand();
    let mut errors = Vec::new();
    for (off, radius_m) in [(-0.005, 0.0127), (-0.002, 0.008), (0.0, 0.0127), (0.003, 0.018), (0.006, 0.01)] {
        let Fitted { percepts, truths } =
            fitted_by(by, &body, &turning_rod(off, radius_m, length_m, layer), "hand/back", assumed);
        for (percept, (middle, angle, _)) in percepts.iter().zip(truths) {
            let (Some(axis), Some(angle)) = (percept.principal_axis, angle) else { continue };
            let (Some(fit), Some(place)) = (percept.fit_angle, percept.fit_place) else { continue };
            let across = |place: [f64; 2]| (DVec2::from_array(place) - middle).perp_dot(DVec2::from_angle(angle)) * 1e3;
            let centroid = percept.centroid.unwrap();
            let turned = [degrees_between(axis, angle), degrees_between(fit, angle)];
            errors.push([turned[0], turned[1], across(centroid), across(place)]);
        }
    }
    errors
}

fn column(errors: &[[f64; 4]], column: usize) -> Vec<f64> {
    errors.iter().map(|errors| errors[column].abs()).collect()
}

#[test]
fn a_rods_angle_is_ten_times_as_true_as_its_axis() {
    let errors = rods(0.05, "", None);
    let [axis, fit, centroid, place] = [0, 1, 2, 3].map(|of| column(&errors, of));
    let told = format!(
        "{} rods: axis {:.2}°, fit {:.2}° (median {:.2}, p95 {:.2}); across {:.3} mm, fit {:.3} mm",
        errors.len(),
        rms(&axis),
        rms(&fit),
        quantile(&fit, 0.5),
        quantile(&fit, 0.95),
        rms(&centroid),
        rms(&place)
    );
    println!("{told}");
    assert!(errors.len() > 750, "{told}");
    assert!(rms(&axis) > 3.5 && rms(&fit) < 0.45 && rms(&fit) < 0.1 * rms(&axis), "{told}");
    assert!(quantile(&fit, 0.5) <= 0.4 && quantile(&fit, 0.95) <= 2.0, "{told}");
    assert!(rms(&place) <= 0.2 && rms(&place) < 0.4 * rms(&centroid), "{told}");
    // Negative control: under another layer the same readings have another answer, which is not as true.
    let wrong = rods(0.05, "", Some("\n[layer]\nsigma_m = 0.008\n"));
    assert!(wrong.is_empty() || rms(&column(&wrong, 1)) > 2.0 * rms(&fit), "{}", rms(&column(&wrong, 1)));
}

/// What the fit does not know: the layer's own kernel, and the indenter's own profile.
const OTHER: &str = "kernel = \"boussinesq\"\ncontact = \"hertz\"\n";

#[test]
fn a_rods_angle_is_truer_than_its_axis_under_a_layer_that_the_fit_does_not_know() {
    let errors = rods(0.05, OTHER, None);
    let [axis, fit, centroid, place] = [0, 1, 2, 3].map(|of| rms(&column(&errors, of)));
    let told =
        format!("{} rods: axis {axis:.2}°, fit {fit:.2}°; across {centroid:.3} mm, fit {place:.3} mm", errors.len());
    println!("{told}");
    assert!(errors.len() > 750 && fit <= 1.4 && fit < 0.4 * axis && place < 0.8 * centroid, "{told}");
}

#[test]
fn a_rod_that_ends_on_the_field_is_not_taken_for_a_line() {
    let errors = rods(0.03, "", None);
    let (axis, fit) = (rms(&column(&errors, 0)), rms(&column(&errors, 1)));
    println!("{} rods of 30 mm: axis {axis:.2}°, fit {fit:.2}°", errors.len());
    // Nine sensors cannot tell most of them; those that they can are told no worse.
    assert!(errors.len() > 50 && errors.len() < 450 && fit < axis, "{} {fit} {axis}", errors.len());
}

/// A square grid of sensors without gaps, `half` of them to either side of the middle.
fn grid(pitch: f64, half: i32) -> Body {
    let places: Vec<[f64; 2]> = (-half..=half)
        .flat_map(|i| (-half..=half).map(move |j| [f64::from(i) * pitch, f64::from(j) * pitch]))
        .collect();
    let mut body = Flat::new(&places).field("grid", None, 0..places.len() as u32).surface(0.5).body();
    body.taxels.iter_mut().for_each(|taxel| taxel.area = pitch * pitch);
    body
}

/// A ball or fingertip pressed at a hundred places within a cell or two of `at`, with 2 to 8 N.
fn presses(sigma_m: f64, at: [f64; 2], indenter: &str, layer: &str) -> String {
    let mut seed = 5_u32;
    let mut random = || {
        seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(seed >> 8) / f64::from(1 << 24)
    };
    let (mut path, mut times, mut forces) = (String::new(), String::new(), String::new());
    for t in 0..100 {
        let [u, v] = [at[0] + 0.01 * (random() - 0.5), at[1] + 0.01 * (random() - 0.5)];
        path += &format!("[{u}, {v}],");
        times += &format!("{t},");
        forces += &format!("[{t}, {}],", 2.0 + 6.0 * random());
    }
    format!(
        "rate_hz = 1\nduration_s = 100\n[layer]\nthickness_m = {}\n{layer}[sensor]\nkind = \"ideal\"\n\
         noise_sigma = 0.01\n[[touch]]\non = \"grid\"\n{indenter}\npath = [{path}]\ntimes_s = [{times}]\n\
         force_newton = [{forces}]\n",
        sigma_m * 3.0_f64.sqrt()
    )
}

const INDENTERS: [&str; 2] = ["indenter = \"ball\"\nradius_m = 0.0127", "indenter = \"fingertip\""];

/// Points on a grid: errors of centroid and fit, mm, of the force, and of the place in its own sigmas.
#[derive(Default)]
struct Points {
    centroids: Vec<f64>,
    places: Vec<f64>,
    forces: Vec<f64>,
    sigmas: Vec<f64>,
}

impl Points {
    fn on(pitch: f64, sigma_m: f64, layer: &str) -> Self {
        Self::by(OrientationBy::Fit, pitch, sigma_m, layer)
    }

    fn by(by: OrientationBy, pitch: f64, sigma_m: f64, layer: &str) -> Self {
        let mut points = Self::default();
        for indenter in INDENTERS {
            let text = presses(sigma_m, [0.0; 2], indenter, layer);
            let Fitted { percepts, truths } = fitted_by(by, &grid(pitch, 6), &text, "grid", None);
            for (percept, (place, _, force)) in percepts.iter().zip(truths) {
                let Some(fit) = percept.fit_place else { continue };
                let off = DVec2::from_array(fit) - place;
                points.places.push(off.length() * 1e3);
                points.centroids.push(DVec2::from_array(percept.centroid.unwrap()).distance(place) * 1e3);
                points.forces.extend(percept.fit_force.map(|fit| fit / force - 1.0));
                let [su, sv] = percept.fit_place_sigma.unwrap();
                points.sigmas.extend([off.x / su, off.y / sv]);
            }
        }
        points
    }

    /// The mean error of the force, and how it spreads about that.
    fn force(&self) -> [f64; 2] {
        let mean = self.forces.iter().sum::<f64>() / self.forces.len() as f64;
        [mean, rms(&self.forces.iter().map(|force| force - mean).collect::<Vec<_>>())]
    }

    fn told(&self, pitch: f64, sigma_m: f64) -> String {
        let [mean, spread] = self.force().map(|part| part * 100.0);
        format!(
            "pitch {:.1} mm, σ {:.1} mm: {} fits; centroid {:.3} mm, fit {:.3} mm; force {mean:+.1} ± {spread:.1} %; {:.2} of σ",
            pitch * 1e3,
            sigma_m * 1e3,
            self.places.len(),
            rms(&self.centroids),
            rms(&self.places),
            rms(&self.sigmas)
        )
    }
}

const GRIDS: [(f64, f64); 4] = [(5e-3, 1.7e-3), (5e-3, 2.3e-3), (6.7e-3, 1.7e-3), (6.7e-3, 2.3e-3)];

#[test]
fn a_points_place_is_truer_than_the_centroid_and_its_force_is_whole() {
    for (pitch, sigma_m) in GRIDS {
        let points = Points::on(pitch, sigma_m, "");
        let told = points.told(pitch, sigma_m);
        println!("{told}");
        assert!(points.places.len() > 150 && rms(&points.places) <= 0.65 * rms(&points.centroids), "{told}");
        let [mean, spread] = points.force();
        assert!(mean.abs() < 0.02 && spread < 0.04, "{told}");
        // With gains that are exact, errors are no larger than what gains of ± 5 % would make of them.
        assert!(rms(&points.sigmas) < 1.1, "{told}");
    }
}

#[test]
fn a_point_is_truer_than_the_centroid_under_a_layer_that_the_fit_does_not_know() {
    for (pitch, sigma_m) in GRIDS {
        let points = Points::on(pitch, sigma_m, OTHER);
        let told = points.told(pitch, sigma_m);
        println!("other model: {told}");
        assert!(points.places.len() > 120 && rms(&points.places) <= 0.9 * rms(&points.centroids), "{told}");
        assert!(points.force()[1] < 0.06, "{told}");
    }
}

#[test]
fn more_steps_are_truer() {
    let steps = [OrientationBy::FitInOne, OrientationBy::FitInTwo, OrientationBy::Fit];
    let of_rods = steps.map(|by| rods_by(by, 0.05, "", None));
    let turned = of_rods.each_ref().map(|errors| rms(&column(errors, 1)));
    let axis = rms(&column(&of_rods[2], 0));
    println!("rods: axis {axis:.2}°; one step {:.2}°, two {:.2}°, all {:.2}°", turned[0], turned[1], turned[2]);
    // Each by a fifth and more.
    assert!(
        [axis, turned[0], turned[1], turned[2]].windows(2).all(|pair| pair[1] < 0.8 * pair[0]),
        "{axis} {turned:?}"
    );
    let points = steps.map(|by| Points::by(by, 5e-3, 2.3e-3, ""));
    let off = points.each_ref().map(|points| rms(&points.places));
    let centroid = rms(&points[2].centroids);
    println!(
        "points: centroid {centroid:.3} mm; one step {:.3} mm, two {:.3} mm, all {:.3} mm",
        off[0], off[1], off[2]
    );
    // After one there is little to gain.
    assert!(off[0] < 0.6 * centroid && off[1] < 1.02 * off[0] && off[2] < 1.02 * off[1], "{centroid} {off:?}");
}

#[test]
fn a_contact_under_pressures_in_pascal_has_its_force_in_newtons() {
    let (pitch, text) = (5e-3, presses(1.7e-3, [0.0; 2], INDENTERS[0], ""));
    let with = |unit: &str| {
        let edit = |calibration: String| {
            assert!(calibration.contains("unit = \"N\"\n"), "{calibration}");
            calibration.replacen("unit = \"N\"", &format!("unit = \"{unit}\""), 1)
        };
        fitted_under(OrientationBy::Fit, &grid(pitch, 6), &text, "grid", edit).percepts
    };
    let mut compared = 0;
    for (newton, pascal) in with("N").iter().zip(&with("Pa")) {
        let (Some(force), Some(less)) = (newton.fit_force, pascal.fit_force) else { continue };
        let ([u, v], [s, t]) = (newton.fit_place.unwrap(), pascal.fit_place.unwrap());
        assert!((less / (force * pitch * pitch) - 1.0).abs() < 1e-6 && f64::hypot(u - s, v - t) < 1e-9, "{newton:?}");
        compared += 1;
    }
    assert!(compared > 50, "{compared}");
}

#[test]
fn a_soft_onset_takes_nothing_off_a_contact() {
    let text = turning_rod(0.0, 0.0127, 0.05, "") + "[calibration]\ndead_band = 0.4\n";
    let with = |onset: &str| {
        let edit = |calibration: String| calibration.replacen("[all]\n", &format!("[all]\nonset = \"{onset}\"\n"), 1);
        fitted_under(OrientationBy::Fit, &hand(), &text, "hand/back", edit).percepts
    };
    let (mut compared, mut less) = (0, 0);
    for (hard, soft) in with("hard").iter().zip(&with("soft")) {
        less += u32::from(soft.total < hard.total);
        let (Some(a), Some(b)) = (hard.fit_angle, soft.fit_angle) else { continue };
        let ([u, v], [s, t]) = (hard.fit_place.unwrap(), soft.fit_place.unwrap());
        assert!(degrees_between(a, b) < 1e-3 && f64::hypot(u - s, v - t) < 1e-7, "{a} and {b}, {u} {v} and {s} {t}");
        compared += 1;
    }
    // The totals are less by what was taken off.
    assert!(compared > 100 && less > 100, "{compared}, {less}");
}

#[test]
fn what_cannot_be_told_is_absent_with_its_reason() {
    let reasons = |percepts: &[Percept], flag: Flags| percepts.iter().filter(|p| p.flags.contains(flag)).count();
    let body = grid(5e-3, 6);
    let flags_of = |body: &Body, text: &str, assumed: Option<&str>| fitted(body, text, "grid", assumed).percepts;
    let middle = presses(2e-3, [0.0; 2], INDENTERS[1], "");

    let without = flags_of(&body, &middle, Some(""));
    assert_eq!(reasons(&without, Flags::NO_LAYER), 100);
    assert!(without.iter().all(|percept| percept.fit_kind.is_none() && percept.fit_place.is_none()));

    // Four sensors or fewer have less to say than a point has parameters.
    let few = flags_of(&grid(20e-3, 3), &middle, None);
    assert!(reasons(&few, Flags::FEW_TAXELS) > 90, "{}", reasons(&few, Flags::FEW_TAXELS));
    assert!(few.iter().all(|percept| !percept.flags.contains(Flags::FEW_TAXELS) || percept.fit_place.is_none()));

    // Most of a press 8 mm beyond the edge falls on no sensor.
    let beyond = flags_of(&body, &presses(4e-3, [0.0, 0.039], INDENTERS[1], ""), None);
    let (off, few) = (reasons(&beyond, Flags::OFF_FIELD), reasons(&beyond, Flags::FEW_TAXELS));
    println!(
        "beyond the edge: {off} off_field, {few} few_taxels, {} poor_fit, {} told",
        reasons(&beyond, Flags::POOR_FIT),
        beyond.iter().filter(|p| p.fit_place.is_some()).count()
    );

    // Nothing presses like a chequerboard.
    let ids: Vec<u32> = body.taxels.iter().map(|taxel| taxel.id).collect();
    let calibration = Calibration::parse("[all]\nnoise = 1\ndead_band = 5\n[layer]\nsigma_m = 0.002\n", &ids).unwrap();
    let options = Options::default().calibration(calibration).scene(Scene::default().outputs(Outputs::FIT));
    let mut engine = Engine::new(&body, options).unwrap();
    let mut frame = engine.frame(0.0);
    for (index, value) in frame.values.iter_mut().enumerate() {
        *value = RawValue::new(if index % 2 == 0 { 500.0 } else { 20.0 });
    }
    let percept = engine.process_one(&frame).unwrap().get(0, 0);
    assert!(percept.flags.contains(Flags::POOR_FIT) && percept.fit_kind.is_none(), "{percept:?}");
    // Negative control: the middle has none of these.
    let all = flags_of(&body, &middle, None);
    let none = Flags::NO_LAYER | Flags::FEW_TAXELS | Flags::OFF_FIELD | Flags::POOR_FIT | Flags::CURVED;
    let told = all.iter().filter(|percept| !percept.flags.intersects(none)).count();
    assert!(told > 95 && all.iter().filter(|p| p.fit_kind == Some(ContactKind::Point)).count() > 90, "{told}");
}

#[test]
fn fits_have_the_same_bits_in_double_precision_and_however_a_recording_is_cut() {
    let body = hand();
    let text = turning_rod(0.002, 0.0127, 0.05, "");
    let mut source = SimulatedSource::on_body("simulation", &text, body.clone()).unwrap();
    let ids: Vec<u32> = body.taxels.iter().map(|taxel| taxel.id).collect();
    let calibration = Calibration::parse(&source.calibration(), &ids).unwrap();
    let mut frames = Vec::new();
    let mut frame = Frame::missing(0.0, source.taxels().len());
    while source.next_frame(&mut frame).unwrap() {
        frames.push(frame.clone());
    }
    let run = |backend: BackendKind, cut: usize| -> Vec<Percept> {
        let scene = Scene::default().outputs(Outputs::FIT).fields(["hand/back"]);
        let options = Options::default().scene(scene).calibration(calibration.clone()).backend(backend).batch(64);
        let mut engine = Engine::new(&body, options).unwrap();
        engine.set_channels(source.taxels()).unwrap();
        let mut told = Vec::new();
        for frames in frames.chunks(cut) {
            let percepts = engine.process(frames).unwrap();
            told.extend((0..frames.len()).map(|frame| percepts.get(frame, 0)));
        }
        told
    };
    // All digits that tell numbers apart.
    let shown = |percepts: &[Percept]| percepts.iter().map(|percept| format!("{percept:?}")).collect::<Vec<String>>();
    let right = run(BackendKind::Reference, frames.len());
    assert!(right.iter().filter(|percept| percept.fit_angle.is_some()).count() > 150, "{:?}", right[10]);
    for backend in backends() {
        // Descents on the device are in single precision.
        let whole = if backend == BackendKind::Gpu { run(backend, frames.len()) } else { right.clone() };
        for cut in [1, 7, 64, 180] {
            assert!(shown(&run(backend, cut)) == shown(&whole), "{backend:?}, {cut} at a time");
        }
        // At rest a place is within a tenth of its sigma of where all descents go, on either; here they are a thousandth apart.
        let (mut apart, mut compared): (f64, usize) = (0.0, 0);
        for (percept, right) in whole.iter().zip(&right) {
            assert_eq!((percept.fit_kind, percept.flags), (right.fit_kind, right.flags), "{backend:?}");
            let (Some(place), Some([u, v])) = (percept.fit_place, right.fit_place) else { continue };
            let [su, sv] = right.fit_place_sigma.unwrap();
            apart = apart.max((place[0] - u).abs() / su).max((place[1] - v).abs() / sv);
            let (angle, sigma) = (percept.fit_angle.unwrap(), right.fit_angle_sigma.unwrap());
            apart = apart.max(degrees_between(angle, right.fit_angle.unwrap()).to_radians() / sigma);
            compared += 1;
        }
        println!("{backend:?}: {compared} fits, at most {apart:e} σ apart");
        assert!(compared > 150 && apart < 0.2, "{backend:?}: {apart} σ");
        assert_eq!(apart > 0.0, backend == BackendKind::Gpu, "the device has digits of its own: {apart:e}");
    }
}
