//! Touches simulated on a body, whose truth is known: what percepts are off by on a skin that nobody has measured.

use std::f64::consts::TAU;
use std::fmt::Write as _;

use glam::DVec2;

use super::TestFrames;
use crate::body::Body;
use crate::engine::Options;
use crate::error::{Error, Result};
use crate::field::FieldSet;
use crate::percept::Outputs;
use crate::random::Random;
use crate::scene::{Plan, PlanField, Scene};
use crate::signal::{Calibration, Frame, LayerResponse, Letter};
use crate::source::{SimulatedSource, Source as _};

/// σ of the layer that is assumed where no calibration knows it, m: that of 7 mm of silicone.
const SIGMA_M: f64 = 4.04e-3;
/// Steps of the simulated sensors' converter, and of them those that the hardest touch takes.
const STEPS: f64 = 1023.0;
const HARDEST: f64 = 900.0;
const SEED: u64 = 27;
/// Frames a second; every frame is a touch of its own.
const RATE_HZ: f64 = 100.0;
/// The middle of a touch lies between taxels that are no farther apart than this, in spacings of the field.
const NEAR: f64 = 1.6;

/// Touches simulated on a body.
#[derive(Clone, Debug)]
pub struct SimulatedTouches {
    /// Their frames, a touch in each, and their truth.
    pub frames: TestFrames,
    /// The calibration of the simulated sensors: it knows the noise, the layer unless the robot's own calibration does not, and not
    /// by how much gains differ.
    pub calibration: Calibration,
    /// What was simulated, for display.
    pub description: String,
}

/// An indenter: its keys in a simulation's file, the least and the largest force, N, and over how much of the skin, m, it presses
/// beside the layer's own blur.
struct Indenter {
    keys: &'static str,
    newtons: [f64; 2],
    length_m: f64,
    is_long: bool,
}

const INDENTERS: [Indenter; 5] = [
    Indenter { keys: "indenter = \"fingertip\"", newtons: [2.0, 8.0], length_m: 0.0, is_long: false },
    Indenter {
        keys: "indenter = \"rod\"\nradius_m = 0.0127\nlength_m = 0.05",
        newtons: [20.0, 40.0],
        length_m: 0.05,
        is_long: true,
    },
    Indenter { keys: "indenter = \"ball\"\nradius_m = 0.01", newtons: [2.0, 8.0], length_m: 0.0, is_long: false },
    Indenter { keys: "indenter = \"edge\"\nlength_m = 0.03", newtons: [8.0, 16.0], length_m: 0.03, is_long: true },
    Indenter { keys: "indenter = \"flat\"\nradius_m = 0.006", newtons: [4.0, 12.0], length_m: 0.0, is_long: false },
];

/// Kernels of the layers, with σ of a point force's pressure in thicknesses. Fits know the first.
const LAYERS: [(&str, f64); 4] = [
    ("gaussian", 0.577_350_269_189_625_8),
    ("boussinesq", 0.577_350_269_189_625_8),
    ("exponential", 0.577_350_269_189_625_8),
    ("bonded", 0.460_634_846_4),
];

impl SimulatedTouches {
    /// Up to `most` touches on the fields of `body` that `options` name and that have charts: fingertips, rods, balls, edges and
    /// stamps in turn, at random places between taxels. They press through each of four layers. Fits know the Gaussian one. The
    /// layer's σ and the spread of gains are those of the calibration where it has them.
    ///
    /// # Errors
    /// No field has a chart, no taxel an area, or the body no surface.
    pub fn on(body: &Body, options: &Options, most: usize) -> Result<Self> {
        let calibration = Calibration::identity(body.taxels.len());
        let mut scene = Scene::default().outputs(Outputs::CENTROID).letters(vec![Letter::default()]);
        scene.fields.clone_from(&options.scene.fields);
        let plan = Plan::new(body, &FieldSet::new(body)?, &scene, &calibration)?;
        let fields: Vec<&PlanField> =
            plan.fields.iter().filter(|field| field.chart.is_some() && field.count > 1).collect();
        if fields.is_empty() {
            return Err(Error::failed("no field with a chart could be touched").at(&body.name));
        }
        let known = options.calibration.as_ref().and_then(|calibration| calibration.layer);
        let LayerResponse { sigma_m, gain_spread } =
            known.unwrap_or(LayerResponse { sigma_m: SIGMA_M, gain_spread: LayerResponse::GAIN_SPREAD });
        let sensors = Sensors::new(body, options, sigma_m, gain_spread);
        let touches = touches(&fields, most.div_ceil(LAYERS.len()));
        let ids: Vec<u32> = body.taxels.iter().map(|taxel| taxel.id).collect();
        let mut frames = TestFrames { source: "touches simulated on it".to_owned(), ..TestFrames::default() };
        let mut calibration = None;
        for (kernel, spread) in LAYERS {
            let text = format!(
                "rate_hz = {RATE_HZ}\nduration_s = {}\nseed = {SEED}\n\n[layer]\nthickness_m = {}\nkernel = \"{kernel}\"\n\n{}\n\
                 {touches}",
                (most.div_ceil(LAYERS.len()) + 1) as f64 / RATE_HZ,
                sigma_m / spread,
                sensors.keys,
            );
            let mut source = SimulatedSource::on_body_where_possible("touches", &text, body.clone())?;
            frames.taxels = source.taxels().to_vec();
            let mut frame = Frame::missing(0.0, frames.taxels.len());
            let start_s = frames.frames.last().map_or(0.0, |last: &Frame| last.t_s + 1.0 / RATE_HZ);
            while source.next_frame(&mut frame)? {
                let mut frame = frame.clone();
                frame.t_s += start_s;
                frames.frames.push(frame);
                frames.truth.push(source.truth().to_vec());
            }
            if kernel == LAYERS[0].0 {
                calibration = Some(Calibration::parse(&source.calibration(), &ids)?);
            }
        }
        let count = frames.truth.iter().filter(|truth| !truth.is_empty()).count();
        if count == 0 {
            return Err(Error::failed("no touch could be simulated: its fields lie off its surface").at(&body.name));
        }
        let from = if known.is_some() { "the calibration's" } else { "assumed" };
        let description = format!(
            "{count} touches simulated on it by fingertips, balls, stamps, rods and edges, through four layers of which fits \
             know one; layer σ {:.2} mm ({from}), gains ±{:.0} %, {}",
            sigma_m * 1e3,
            gain_spread * 100.0,
            sensors.description
        );
        let mut calibration: Calibration = calibration.unwrap_or_default();
        if options.calibration.is_some() && known.is_none() {
            // Percepts are not better here than they could be with the robot's own.
            calibration.layer = None;
        }
        Ok(Self { frames, calibration, description })
    }
}

/// The touches' part of a simulation's file.
fn touches(fields: &[&PlanField], count: usize) -> String {
    let mut random = Random::new(SEED);
    let mut text = String::new();
    for touch in 0..count {
        let field = fields[touch % fields.len()];
        let indenter = &INDENTERS[(touch + touch / fields.len()) % INDENTERS.len()];
        let place = place(field, &mut random);
        let [least, most] = indenter.newtons;
        let newtons = least + (most - least) * random.unit();
        let angle = 180.0 * random.unit();
        // JSON's strings are TOML's, too.
        let (name, t_s) = (serde_json::Value::from(field.name.as_str()), (touch + 1) as f64 / RATE_HZ);
        let (from_s, to_s) = (t_s - 0.25 / RATE_HZ, t_s + 0.25 / RATE_HZ);
        let _ = writeln!(text, "[[touch]]\non = {name}\n{}\npath = [[{}, {}]]", indenter.keys, place.x, place.y);
        if indenter.is_long {
            let _ = writeln!(text, "angle_deg = {angle}");
        }
        let _ = writeln!(text, "force_newton = [[{from_s}, {newtons}], [{to_s}, {newtons}]]");
    }
    text
}

/// A place between taxels of `field`, (u, v), m.
fn place(field: &PlanField, random: &mut Random) -> DVec2 {
    let mut any = |count: usize| ((random.unit() * count as f64) as usize).min(count - 1);
    let at = |member: usize| field.places[member].truncate();
    let first = at(any(field.count));
    let near: Vec<DVec2> =
        (0..field.count).map(at).filter(|other| other.distance(first) <= NEAR * field.spacing).collect();
    let (second, third) = (near[any(near.len())], near[any(near.len())]);
    // Evenly spread over the triangle of the three.
    let (a, b) = (random.unit().sqrt(), random.unit());
    (first * (1.0 - a) + second * (a * (1.0 - b)) + third * (a * b)) * f64::from(field.unit_m)
}

/// The simulated sensors.
struct Sensors {
    keys: String,
    description: String,
}

impl Sensors {
    /// Linear ones of ten bits, with the noise that the calibration knows as a share of their range, or one step.
    fn new(body: &Body, options: &Options, sigma_m: f64, gain_spread: f64) -> Self {
        let areas = || body.taxels.iter().map(|taxel| taxel.area);
        let has_areas = areas().all(|area| area > 0.0);
        // A square as wide as the layer blurs, for taxels of unknown size.
        let area_m2 = if has_areas { areas().fold(0.0, f64::max) } else { sigma_m * sigma_m };
        // The share of a Gaussian on the taxel in its middle, or of a blurred line, at most all of it.
        let hardest = |indenter: &Indenter| {
            let share = if indenter.is_long {
                area_m2 / (indenter.length_m.max(sigma_m) * TAU.sqrt() * sigma_m)
            } else {
                area_m2 / (TAU * sigma_m * sigma_m)
            };
            indenter.newtons[1] * share.min(1.0)
        };
        let full_newton = INDENTERS.iter().map(hardest).fold(0.0, f64::max);
        let noise = relative_noise(options).map(|share| (share * STEPS).clamp(0.05, 0.05 * STEPS));
        let noise_sigma = noise.unwrap_or(1.0);
        let mut keys = format!(
            "[sensor]\nkind = \"linear\"\nbits = 10\ngain = {}\nnoise_sigma = {noise_sigma}\ngain_spread = {gain_spread}\ngain_seed = {SEED}\n",
            HARDEST / full_newton
        );
        if !has_areas {
            let _ = writeln!(keys, "area_m2 = {area_m2}");
        }
        let from = if noise.is_some() { "the calibration's" } else { "assumed" };
        Self { keys, description: format!("noise {:.1} ‰ of the range ({from})", 1e3 * noise_sigma / STEPS) }
    }
}

/// Noise as a share of the sensors' range, by the median taxel, where the calibration knows both.
fn relative_noise(options: &Options) -> Option<f64> {
    let calibration = options.calibration.as_ref()?;
    let known = calibration.taxels.iter().filter(|taxel| taxel.p_max < f64::from(f32::MAX));
    let mut shares: Vec<f64> = known.filter_map(|taxel| Some(taxel.noise? * taxel.gain.abs() / taxel.p_max)).collect();
    shares.sort_by(f64::total_cmp);
    shares.get(shares.len() / 2).copied().filter(|share| share.is_finite() && *share > 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bundled;

    fn hand() -> Body {
        Body::from_bytes("hand", bundled::HAND).unwrap()
    }

    #[test]
    fn every_field_with_a_chart_is_touched_by_everything_between_its_taxels() {
        let body = hand();
        let touches = SimulatedTouches::on(&body, &Options::default(), 400).unwrap();
        let truths = || touches.frames.truth.iter().flatten();
        let fields = FieldSet::new(&body).unwrap();
        for field in fields.fields.iter().filter(|field| field.chart.is_ok()) {
            let of_field = || truths().filter(|truth| truth.field.as_ref() == Some(&field.name));
            let long = of_field().filter(|truth| truth.angle.is_some()).count();
            assert!(long > 3 && of_field().count() - long > 3, "{}: {long} of {}", field.name, of_field().count());
            let far = |truth: &crate::source::Truth| {
                let uv = DVec2::from_array(truth.uv.unwrap());
                let to = |member: &crate::field::Member| member.place.truncate().distance(uv);
                field.members.iter().map(to).fold(f64::INFINITY, f64::min)
            };
            // The bundled hand's taxels are 8 to 17 mm apart.
            assert!(of_field().all(|truth| far(truth) < 0.012), "{}", field.name);
        }
        // A touch a frame, and one at rest at the beginning of each half.
        assert!(touches.frames.truth.iter().all(|truth| truth.len() <= 1));
        assert!(touches.frames.truth[0].is_empty() && truths().count() > 380);
        assert!(touches.frames.frames.windows(2).all(|pair| pair[0].t_s < pair[1].t_s));
    }

    #[test]
    fn touches_are_under_the_layer_that_the_calibration_knows() {
        let body = hand();
        let layer = Some(LayerResponse { sigma_m: 2e-3, gain_spread: 0.02 });
        let ids: Vec<u32> = body.taxels.iter().map(|taxel| taxel.id).collect();
        let noisy = Calibration::parse("[all]\nnoise = 5\np_max = 500\n", &ids).unwrap();
        let on = |calibration: Option<Calibration>| {
            SimulatedTouches::on(&body, &Options::default().calibration(calibration), 100).unwrap()
        };
        let assumed = on(None);
        assert!(
            assumed.description.contains("layer σ 4.04 mm (assumed), gains ±5 %, noise 1.0 ‰ of the range (assumed)")
        );
        assert_eq!(assumed.calibration.layer.unwrap().gain_spread, LayerResponse::GAIN_SPREAD);
        // Without a layer in the calibration fits are no better here than they would be on the robot: absent.
        assert_eq!(on(Some(noisy.clone())).calibration.layer, None);
        let known = on(Some(Calibration { layer, ..noisy }));
        assert!(known.description.contains("layer σ 2.00 mm (the calibration's), gains ±2 %, noise 10.0 ‰"));
        let sigma_m = known.calibration.layer.unwrap().sigma_m;
        assert!((sigma_m - 2e-3).abs() < 1e-12, "{sigma_m}");
        // The same touches whenever they are asked for.
        let values = |touches: &SimulatedTouches| format!("{:?}", touches.frames.frames);
        assert_eq!(values(&on(None)), values(&assumed));
        assert_ne!(values(&known), values(&assumed));
    }

    #[test]
    fn fields_without_charts_cannot_be_touched() {
        // All of the hand lies on several links.
        let options = Options::default().scene(Scene::default().fields(vec!["hand".to_owned()]));
        let why =
            SimulatedTouches::on(&hand(), &options, 10).map(|touches| touches.description).unwrap_err().to_string();
        assert!(why.contains("no field with a chart could be touched"), "{why}");
    }
}
