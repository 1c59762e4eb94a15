//! Contacts fitted to touches of the whole body against the truth of simulated touches, and why some are absent.

use glam::DVec3;
use somatic::internal::touch;
use somatic::scene::{Knobs, OrientationBy, Scene};
use somatic::source::{SimulatedSource, Source, Truth};
use somatic::{
    BackendKind, Body, Calibration, ContactKind, Engine, Frame, Options, Outputs, Percept, RawValue, Touch, TouchFit,
    TouchFlags, TouchOutputs,
};

use crate::common::{Flat, backends};

/// A frame of a simulation: what a field says, the touch with most pressure, and the truth.
struct Pressed {
    percept: Percept,
    /// Where the field's centroid is on its link.
    centroid: DVec3,
    touch: Option<Touch>,
    truth: Truth,
}

impl Pressed {
    fn fit(&self) -> Option<TouchFit> {
        self.touch.as_ref()?.fit
    }

    fn flags(&self) -> TouchFlags {
        self.touch.as_ref().map_or(TouchFlags::empty(), |touch| touch.flags)
    }

    /// How far `place` is off across what is long and presses, m.
    fn across(&self, place: DVec3) -> Option<f64> {
        let across = self.truth.normal_in_link.cross(self.truth.direction_in_link?);
        Some((place - self.truth.position_in_link).dot(across))
    }
}

/// Runs the simulation in `text` with its own calibration, with `[layer]` as `assumed` says it, if it does, in all steps.
fn fitted(body: &Body, text: &str, field: &str, assumed: Option<&str>) -> Vec<Pressed> {
    fitted_by(OrientationBy::Fit, body, text, field, assumed)
}

/// The same in as many steps as `by` has.
fn fitted_by(by: OrientationBy, body: &Body, text: &str, field: &str, assumed: Option<&str>) -> Vec<Pressed> {
    fitted_under(by, body, text, field, |mut calibration| {
        if let Some(assumed) = assumed {
            calibration.truncate(calibration.find("\n[layer]").unwrap_or(calibration.len()));
            calibration += assumed;
        }
        calibration
    })
}

/// What is asked of touches.
fn asked() -> touch::Options {
    touch::Options { outputs: TouchOutputs::USUAL | TouchOutputs::FIT, ..touch::Options::default() }
}

/// The same under what `edit` makes of the simulation's calibration.
fn fitted_under(
    by: OrientationBy,
    body: &Body,
    text: &str,
    field: &str,
    edit: impl Fn(String) -> String,
) -> Vec<Pressed> {
    let mut source = SimulatedSource::on_body("simulation", text, body.clone()).unwrap();
    let calibration = edit(source.calibration());
    let ids: Vec<u32> = body.taxels.iter().map(|taxel| taxel.id).collect();
    let calibration = Calibration::parse(&calibration, &ids).unwrap();
    let outputs = Outputs::TOTAL | Outputs::PRINCIPAL_AXIS | Outputs::CENTROID | Outputs::POSITION;
    let knobs = Knobs::default().orientation_by(by);
    let scene = Scene::default().outputs(outputs).touches(asked()).fields([field]).knobs(knobs);
    let options = Options::default().scene(scene).calibration(calibration).backend(BackendKind::Cpu).batch(256);
    let mut engine = Engine::new(body, options).unwrap();
    engine.set_channels(source.taxels()).unwrap();
    let (mut frames, mut truths) = (Vec::new(), Vec::new());
    let mut frame = Frame::missing(0.0, source.taxels().len());
    while source.next_frame(&mut frame).unwrap() {
        truths.push(source.truth()[0].clone());
        frames.push(frame.clone());
    }
    let percepts = engine.process(&frames).unwrap();
    let pressed = |(frame, truth): (usize, Truth)| {
        let percept = percepts.get(frame, 0);
        let touches = percepts.touches(frame).unwrap().touches.iter();
        let touch = touches.max_by(|a, b| a.total.total_cmp(&b.total)).cloned();
        let centroid = percept.position.map_or(DVec3::NAN, DVec3::from_array);
        Pressed { percept, centroid, touch, truth }
    };
    truths.into_iter().enumerate().map(pressed).collect()
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
        let text = turning_rod(off, radius_m, length_m, layer);
        for pressed in fitted_by(by, &body, &text, "hand/back", assumed) {
            let (Some(axis), Some(angle)) = (pressed.percept.principal_axis, pressed.truth.angle) else { continue };
            let Some((fit, direction)) = pressed.fit().and_then(|fit| Some((fit, fit.direction?))) else { continue };
            let across = |place: DVec3| 1e3 * pressed.across(place).unwrap();
            let right = pressed.truth.direction_in_link.unwrap();
            let turned = direction.cross(right).length().atan2(direction.dot(right).abs()).to_degrees();
            errors.push([degrees_between(axis, angle), turned, across(pressed.centroid), across(fit.place)]);
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
    let summary = format!(
        "{} rods: axis {:.2}°, fit {:.2}° (median {:.2}, p95 {:.2}); across {:.3} mm, fit {:.3} mm",
        errors.len(),
        rms(&axis),
        rms(&fit),
        quantile(&fit, 0.5),
        quantile(&fit, 0.95),
        rms(&centroid),
        rms(&place)
    );
    println!("{summary}");
    assert!(errors.len() > 750, "{summary}");
    assert!(rms(&axis) > 3.5 && rms(&fit) < 0.45 && rms(&fit) < 0.1 * rms(&axis), "{summary}");
    assert!(quantile(&fit, 0.5) <= 0.4 && quantile(&fit, 0.95) <= 2.0, "{summary}");
    assert!(rms(&place) <= 0.2 && rms(&place) < 0.4 * rms(&centroid), "{summary}");
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
    let summary =
        format!("{} rods: axis {axis:.2}°, fit {fit:.2}°; across {centroid:.3} mm, fit {place:.3} mm", errors.len());
    println!("{summary}");
    assert!(errors.len() > 750 && fit <= 1.4 && fit < 0.4 * axis && place < 0.8 * centroid, "{summary}");
}

#[test]
fn a_rod_that_ends_on_the_field_is_in_doubt_or_fitted_no_worse_than_by_its_axis() {
    // By whether there is a doubt: the errors of the fit and of the axis.
    let mut errors = [const { [Vec::new(), Vec::new()] }; 2];
    for (off, radius_m) in [(-0.005, 0.0127), (0.0, 0.0127), (0.006, 0.01)] {
        for pressed in fitted(&hand(), &turning_rod(off, radius_m, 0.03, ""), "hand/back", None) {
            let (Some(axis), Some(angle)) = (pressed.percept.principal_axis, pressed.truth.angle) else { continue };
            let Some(direction) = pressed.fit().and_then(|fit| fit.direction) else { continue };
            let right = pressed.truth.direction_in_link.unwrap();
            let turned = direction.cross(right).length().atan2(direction.dot(right).abs()).to_degrees();
            let [fits, axes] = &mut errors[usize::from(pressed.flags().contains(TouchFlags::POOR_FIT))];
            fits.push(turned);
            axes.push(degrees_between(axis, angle));
        }
    }
    let summary = errors
        .each_ref()
        .map(|[fits, axes]| format!("{} with axis {:.2}°, fit {:.2}°", fits.len(), rms(axes), rms(fits)));
    println!("rods of 30 mm: {}; with a doubt {}", summary[0], summary[1]);
    // Nine sensors say little of an end between them: most of those that are taken for lines are doubted.
    let [[fits, axes], doubted] = &errors;
    assert!(fits.len() > 100 && doubted[0].len() > fits.len() && rms(fits) < 1.1 * rms(axes), "{summary:?}");
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
            for pressed in fitted_by(by, &grid(pitch, 6), &text, "grid", None) {
                // With few taxels the spread is a guess.
                let is_told = !pressed.flags().contains(TouchFlags::FEW_TAXELS);
                let Some(fit) = pressed.fit().filter(|_| is_told) else { continue };
                let off = fit.place - pressed.truth.position_in_link;
                points.places.push(off.length() * 1e3);
                points.centroids.push(pressed.centroid.distance(pressed.truth.position_in_link) * 1e3);
                points.forces.extend(fit.force.map(|force| force / pressed.truth.force_newton - 1.0));
                // The touch's u and v are the link's x and −z.
                let [su, sv] = fit.sigma.unwrap().place;
                points.sigmas.extend([off.x / su, -off.z / sv]);
            }
        }
        points
    }

    /// The mean error of the force, and how it spreads about that.
    fn force(&self) -> [f64; 2] {
        let mean = self.forces.iter().sum::<f64>() / self.forces.len() as f64;
        [mean, rms(&self.forces.iter().map(|force| force - mean).collect::<Vec<_>>())]
    }

    fn summary(&self, pitch: f64, sigma_m: f64) -> String {
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
        let summary = points.summary(pitch, sigma_m);
        println!("{summary}");
        assert!(points.places.len() > 150 && rms(&points.places) <= 0.65 * rms(&points.centroids), "{summary}");
        let [mean, spread] = points.force();
        assert!(mean.abs() < 0.02 && spread < 0.04, "{summary}");
        // With gains that are exact, errors are no larger than what gains of ± 5 % would make of them.
        assert!(rms(&points.sigmas) < 1.1, "{summary}");
    }
}

#[test]
fn a_point_is_truer_than_the_centroid_under_a_layer_that_the_fit_does_not_know() {
    for (pitch, sigma_m) in GRIDS {
        let points = Points::on(pitch, sigma_m, OTHER);
        let summary = points.summary(pitch, sigma_m);
        println!("other model: {summary}");
        assert!(points.places.len() > 120 && rms(&points.places) <= 0.9 * rms(&points.centroids), "{summary}");
        assert!(points.force()[1] < 0.06, "{summary}");
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
        fitted_under(OrientationBy::Fit, &grid(pitch, 6), &text, "grid", edit)
    };
    let mut compared = 0;
    for (newton, pascal) in with("N").iter().zip(&with("Pa")) {
        let Some((newton, pascal)) = newton.fit().zip(pascal.fit()) else { continue };
        let Some((force, less)) = newton.force.zip(pascal.force) else { continue };
        let apart = newton.place.distance(pascal.place);
        assert!((less / (force * pitch * pitch) - 1.0).abs() < 1e-6 && apart < 1e-9, "{newton:?} {pascal:?}");
        compared += 1;
    }
    assert!(compared > 50, "{compared}");
}

#[test]
fn a_soft_onset_takes_nothing_off_a_contact() {
    let text = turning_rod(0.0, 0.0127, 0.05, "") + "[calibration]\ndead_band = 0.4\n";
    let with = |onset: &str| {
        let edit = |calibration: String| calibration.replacen("[all]\n", &format!("[all]\nonset = \"{onset}\"\n"), 1);
        fitted_under(OrientationBy::Fit, &hand(), &text, "hand/back", edit)
    };
    let (mut compared, mut less) = (0, 0);
    for (hard, soft) in with("hard").iter().zip(&with("soft")) {
        less += u32::from(soft.percept.total < hard.percept.total);
        let Some((hard, soft)) = hard.fit().zip(soft.fit()) else { continue };
        let Some((a, b)) = hard.direction.zip(soft.direction) else { continue };
        assert!(a.cross(b).length() < 2e-5 && hard.place.distance(soft.place) < 1e-7, "{hard:?} and {soft:?}");
        compared += 1;
    }
    // The totals are less by what was taken off.
    assert!(compared > 100 && less > 100, "{compared}, {less}");
}

#[test]
fn what_is_unknown_is_absent_with_its_reason() {
    let reasons = |all: &[Pressed], flag: TouchFlags| all.iter().filter(|one| one.flags().contains(flag)).count();
    let body = grid(5e-3, 6);
    let pressed = |body: &Body, text: &str, assumed: Option<&str>| fitted(body, text, "grid", assumed);
    let middle = presses(2e-3, [0.0; 2], INDENTERS[1], "");

    let without = pressed(&body, &middle, Some(""));
    assert_eq!(reasons(&without, TouchFlags::NO_LAYER), 100);
    assert!(without.iter().all(|one| one.fit().is_none()));

    // One or two sensors cannot tell a point; three or four can, as far as its spread is the prior's.
    let few = pressed(&grid(20e-3, 3), &middle, None);
    assert!(reasons(&few, TouchFlags::FEW_TAXELS) > 90, "{}", reasons(&few, TouchFlags::FEW_TAXELS));
    let taxels = |one: &Pressed| one.touch.as_ref().map_or(0, |touch| touch.active);
    assert!(few.iter().all(|one| taxels(one) > 2 || one.fit().is_none()));
    let some = pressed(&grid(10e-3, 4), &presses(1.5e-3, [0.0; 2], INDENTERS[1], ""), None);
    let with_few = some.iter().filter(|one| one.flags().contains(TouchFlags::FEW_TAXELS) && one.fit().is_some());
    let with_few: Vec<&Pressed> = with_few.collect();
    let is_point = |one: &&Pressed| one.fit().is_some_and(|fit| fit.kind == ContactKind::Point);
    assert!(
        with_few.len() > 10 && with_few.iter().all(|one| is_point(one) && (3..5).contains(&taxels(one))),
        "{}",
        with_few.len()
    );

    // Most of a press 8 mm beyond the edge falls on no sensor.
    let beyond = pressed(&body, &presses(4e-3, [0.0, 0.039], INDENTERS[1], ""), None);
    let [off, few, poor] =
        [TouchFlags::OFF_SKIN, TouchFlags::FEW_TAXELS, TouchFlags::POOR_FIT].map(|flag| reasons(&beyond, flag));
    let is_told = |one: &&Pressed| one.fit().is_some() && !one.flags().contains(TouchFlags::FEW_TAXELS);
    let given = beyond.iter().filter(is_told).count();
    println!("beyond the edge: {off} off_skin, {few} few_taxels, {poor} poor_fit, {given} given");
    assert!(off > 20 && given == 0, "{off} {given}");

    // Nothing presses like a chequerboard, if it is one touch.
    let ids: Vec<u32> = body.taxels.iter().map(|taxel| taxel.id).collect();
    let calibration = Calibration::parse("[all]\nnoise = 1\ndead_band = 5\n[layer]\nsigma_m = 0.002\n", &ids).unwrap();
    let one_touch = touch::Splits { candidate: 0.0, split: 0.0, join: 0.0 };
    let scene = Scene::default().touches(touch::Options { splits: one_touch, ..asked() });
    let mut engine = Engine::new(&body, Options::default().calibration(calibration).scene(scene)).unwrap();
    let mut frame = engine.frame(0.0);
    for (index, value) in frame.values.iter_mut().enumerate() {
        *value = RawValue::new(if index % 2 == 0 { 500.0 } else { 20.0 });
    }
    let percepts = engine.process_one(&frame).unwrap();
    let [touch] = &percepts.touches(0).unwrap().touches[..] else { panic!("one touch") };
    assert!(touch.flags.contains(TouchFlags::POOR_FIT), "{touch:?}");
    // Negative control: the middle has none of these.
    let all = pressed(&body, &middle, None);
    let none = TouchFlags::NO_LAYER | TouchFlags::FEW_TAXELS | TouchFlags::OFF_SKIN | TouchFlags::POOR_FIT;
    let without_doubt = all.iter().filter(|one| !one.flags().intersects(none)).count();
    let points = all.iter().filter(|one| one.fit().is_some_and(|fit| fit.kind == ContactKind::Point)).count();
    assert!(without_doubt > 95 && points > 90, "{without_doubt} {points}");
}

#[test]
fn neighbours_that_are_turned_away_say_nothing() {
    // Around the edge of the hand's back there are sensors that feel nothing of a rod that lies on it and goes on beyond them.
    let text = "rate_hz = 90\nduration_s = 2\nseed = 5\n[layer]\nthickness_m = 0.007\n[sensor]\nkind = \"fsr\"\nwiper = 38\n\
                noise_sigma = 1\n[[touch]]\non = \"hand/back\"\nindenter = \"rod\"\nradius_m = 0.0127\nlength_m = 0.06\n\
                angle_deg = [[0, 0], [2, 180]]\npath = [[0.0005, 0.002]]\nforce_newton = [[0, 25], [2, 40]]\n";
    let pressed = fitted(&hand(), text, "hand/back", None);
    let poor = pressed.iter().filter(|one| one.flags().contains(TouchFlags::POOR_FIT)).count();
    let given = pressed.iter().filter(|one| one.fit().is_some()).count();
    println!("{given} fits and {poor} poor fits of {}", pressed.len());
    // A doubt stands beside an answer.
    assert!(given > 170 && poor < 30, "{given} {poor}");
}

#[test]
fn fits_have_the_same_bits_on_every_backend_and_however_a_recording_is_cut() {
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
    let run = |backend: BackendKind, cut: usize| -> Vec<Vec<Option<TouchFit>>> {
        let scene = Scene::default().outputs(Outputs::TOTAL).touches(asked()).fields(["hand/back"]);
        let options = Options::default().scene(scene).calibration(calibration.clone()).backend(backend).batch(64);
        let mut engine = Engine::new(&body, options).unwrap();
        engine.set_channels(source.taxels()).unwrap();
        let mut fits = Vec::new();
        for frames in frames.chunks(cut) {
            let percepts = engine.process(frames).unwrap();
            let of = |frame| percepts.touches(frame).unwrap().touches.iter().map(|touch| touch.fit).collect();
            fits.extend((0..frames.len()).map(of));
        }
        fits
    };
    let right = run(BackendKind::Reference, frames.len());
    let directions = right.iter().flatten().filter(|fit| fit.is_some_and(|fit| fit.direction.is_some())).count();
    assert!(directions > 150, "{directions}");
    for backend in backends() {
        for cut in [1, 7, 64, 180] {
            assert!(run(backend, cut) == right, "{backend:?}, {cut} at a time");
        }
    }
}
