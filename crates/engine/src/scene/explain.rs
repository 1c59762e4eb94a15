//! What a plan does and does not do, and why: what `EXPLAIN` is to a query.

use serde::{Serialize, Serializer};

use super::{Knobs, Plan, PlanField, outputs_of};
use crate::percept::{Component, Outputs, TouchOutputs};
use crate::signal::{Letter, Receptor};

/// A stage of a plan.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub struct PlannedStage {
    /// As in `crates/engine/src/stage`.
    #[serde(rename = "stage")]
    pub name: &'static str,
    /// Whether it runs.
    pub runs: bool,
    /// Why it runs, or does not.
    pub why: String,
    /// Whether it runs on the host whatever the backend is.
    #[serde(rename = "where", serialize_with = "host_or_backend")]
    pub on_host: bool,
    /// The outputs that it gives.
    #[serde(skip)]
    pub gives: Outputs,
    /// The letter that it makes, if that is not made of pressures.
    #[serde(skip)]
    pub letter: Option<Receptor>,
    /// How many of `each` it goes over in a frame; 0 where it does not run, and where only a frame tells.
    pub over: usize,
    /// What it goes over, one of them: `field`, of *calibrate* and *change* `value`, of *touches* and *fit* `taxel`, of the whole skin, and
    /// of *self_contacts* `touch`.
    pub each: &'static str,
    /// Memberships that it goes over, once or several times; 0 where it works on what others found.
    pub memberships: usize,
    /// Bytes that a frame brings to it.
    pub bytes_up: usize,
    /// Bytes that it adds to what comes back from a device.
    pub bytes_down: usize,
}

fn host_or_backend<S: Serializer>(on_host: &bool, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(if *on_host { "host" } else { "backend" })
}

/// The plan's JSON: what it computes, over how much, and why.
#[derive(Serialize)]
struct Summary<'a> {
    outputs: Vec<String>,
    letters: &'a [Letter],
    knobs: Knobs,
    taxels: usize,
    memberships: usize,
    bytes_up: usize,
    bytes_down: usize,
    fields: Vec<FieldSummary<'a>>,
    stages: Vec<PlannedStage>,
}

#[derive(Serialize)]
struct FieldSummary<'a> {
    field: &'a str,
    link: &'a str,
    letter: usize,
    members: usize,
    chart: bool,
}

impl<'a> FieldSummary<'a> {
    fn from_field(field: &'a PlanField) -> Self {
        let PlanField { name, link, letter, charted, .. } = field;
        Self { field: name, link, letter: *letter, members: field.taxels(), chart: *charted }
    }
}

impl Serialize for Plan {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let summary = Summary {
            outputs: self.outputs().names().collect(),
            letters: self.letters(),
            knobs: self.knobs(),
            taxels: self.channels(),
            memberships: self.memberships(),
            bytes_up: self.bytes_up(),
            bytes_down: self.bytes_down(),
            fields: self.fields.iter().map(FieldSummary::from_field).collect(),
            stages: self.explain(),
        };
        summary.serialize(serializer)
    }
}

/// The stages that run on the host, whatever the backend.
const ON_HOST: [&str; 11] = [
    "position",
    "world_motion",
    "touches",
    "self_contacts",
    "force",
    "filter",
    "sigma",
    "fit",
    "shear",
    "temperature",
    "proximity",
];

/// Of a stage its name, whether it runs, what it goes over and of how many memberships, and why it might not run.
type Row = (&'static str, bool, (usize, usize), &'static str);
/// Why a stage of pressures does not run.
const NO_PRESSURE: &str = "no field is read as pressures";

impl Plan {
    /// All stages, in the order that they run in.
    #[must_use]
    pub fn explain(&self) -> Vec<PlannedStage> {
        let stages = self.stages();
        // The other letters have stages of their own.
        let all = |field: &PlanField| self.letters[field.letter].receptor.is_of_pressure();
        let charted = |field: &PlanField| field.charted && all(field);
        let counts = |which: &dyn Fn(&PlanField) -> bool| {
            let chosen = self.fields.iter().filter(|field| which(field));
            chosen.fold((0, 0), |(fields, memberships), field| (fields + 1, memberships + field.count))
        };
        let slots = (self.calibrated(), 0);
        let found = (counts(&all).0, 0);
        // What touches alone read of them is a part of touches.
        let is_letter = |receptor: Receptor| self.letters.iter().any(|letter| letter.receptor == receptor);
        let sensed = |receptor: Receptor| {
            let own = self.fields.iter().filter(|field| self.letters[field.letter].receptor == receptor);
            own.fold((0, 0), |(fields, members), field| (fields + 1, members + field.sensed.len()))
        };
        let found_charted = (counts(&charted).0, 0);
        let rows: [Row; _] = [
            ("calibrate", true, slots, ""),
            ("change", self.has_changes(), (self.slots() - slots.0, 0), "no letter is `change`"),
            ("contact", self.presses(), counts(&all), NO_PRESSURE),
            ("centroid", stages.centroid, counts(&all), ""),
            ("orientation", stages.orientation, counts(&charted), ""),
            ("principal_axis", stages.principal_axis, counts(&charted), ""),
            ("hysteresis", stages.hysteresis, found, "the calibration has no thresholds"),
            ("motion", stages.motion, found_charted, ""),
            ("position", stages.position, found, ""),
            ("world_motion", stages.world_motion, found, ""),
            ("touches", self.touched_from.is_some(), (self.channels(), 0), ""),
            ("self_contacts", stages.self_contacts, (0, 0), ""),
            ("force", stages.force, counts(&all), ""),
            ("filter", stages.filter, found_charted, ""),
            ("sigma", stages.sigma, found, ""),
            ("fit", self.fits(), (self.channels(), 0), ""),
            ("shear", is_letter(Receptor::Shear), sensed(Receptor::Shear), "no letter is `shear`"),
            (
                "temperature",
                is_letter(Receptor::Temperature),
                sensed(Receptor::Temperature),
                "no letter is `temperature`",
            ),
            ("proximity", is_letter(Receptor::Proximity), sensed(Receptor::Proximity), "no letter is `proximity`"),
        ];
        rows.into_iter().map(|row| self.planned(row)).collect()
    }

    fn planned(&self, (name, runs, (over, memberships), idle): Row) -> PlannedStage {
        let gives = match name {
            "self_contacts" => Outputs::SELF_CONTACTS,
            _ => Outputs::of_stage(name),
        };
        let mut asked: Vec<String> = (self.outputs() & gives).names().collect();
        if name == "fit" {
            let outputs = self.touch_outputs().unwrap_or(TouchOutputs::empty()) & TouchOutputs::FIT;
            asked.extend(outputs.names().map(|name| format!("touches.{name}")));
        }
        let why = match (runs, asked.is_empty(), idle.is_empty()) {
            (true, false, _) => format!("asked for: {}", asked.join(", ")),
            (true, true, _) => self.needed_by(name).to_owned(),
            (false, false, _) if !self.presses() => NO_PRESSURE.to_owned(),
            (false, _, false) => idle.to_owned(),
            (false, _, true) => "no output needs it".to_owned(),
        };
        PlannedStage {
            name,
            runs,
            on_host: ON_HOST.contains(&name),
            why,
            gives,
            letter: Receptor::OF_HOST.into_iter().find(|&letter| outputs_of(letter) == gives),
            over: if runs { over } else { 0 },
            each: match name {
                "calibrate" | "change" => "value",
                "touches" | "fit" => "taxel",
                "self_contacts" => "touch",
                _ => "field",
            },
            memberships: if runs { memberships } else { 0 },
            bytes_up: if name == "calibrate" { self.bytes_up() } else { 0 },
            bytes_down: self.bytes_from(name),
        }
    }

    /// Why a stage runs that gives nothing that is asked for.
    fn needed_by(&self, stage: &str) -> &'static str {
        match stage {
            "calibrate" => "raw values become pressures",
            "change" => "a letter is `change`",
            "contact" => "says which fields are touched",
            "hysteresis" => "the calibration has thresholds",
            "centroid" | "position" => "later stages need it",
            "touches" => "of the whole body",
            "shear" => "of touches, and in wrenches",
            _ => "others need it",
        }
    }

    /// Bytes of raw values that a frame brings to the backend: those of the taxels that are read, and no others.
    #[must_use]
    pub fn bytes_up(&self) -> usize {
        self.channels() * size_of::<f32>()
    }

    /// Bytes of results that a frame brings back from a device: a status, and the numbers of the outputs, a field.
    #[must_use]
    pub fn bytes_down(&self) -> usize {
        let numbers = numbers().filter(|(_, wanted_for)| self.read_back().intersects(*wanted_for)).count();
        self.fields_read_back() * (1 + numbers) * size_of::<f32>() + self.kept_pressures() * size_of::<f32>()
    }

    /// How many fields have results that come back; none where the host makes all of them.
    fn fields_read_back(&self) -> usize {
        if self.presses() { self.fields.len() } else { 0 }
    }

    /// What of [`Plan::bytes_down`] is there for the sake of `stage`.
    fn bytes_from(&self, stage: &str) -> usize {
        let own = numbers().filter(|(by, wanted_for)| *by == stage && self.read_back().intersects(*wanted_for));
        let numbers = own.count();
        let status = usize::from(stage == "contact");
        let keeps = if self.touched_from.is_some() { "touches" } else { "force" };
        let kept = if stage == keeps { self.kept_pressures() } else { 0 };
        (self.fields_read_back() * (status + numbers) + kept) * size_of::<f32>()
    }
}

/// The numbers of a field's percept that come back from a device: each with its stage, and the outputs that need it.
fn numbers() -> impl Iterator<Item = (&'static str, Outputs)> {
    let of_parts = Component::ALL.iter().map(|part| match part {
        Component::CentroidU | Component::CentroidV => ("centroid", part.wanted_for() | Outputs::FILTERED),
        Component::CentroidDepth => ("position", part.wanted_for()),
        _ => (part.column().map_or("", |column| column.stage), part.wanted_for()),
    });
    // Motion says which of its outputs are present; the filter counts pressed taxels.
    of_parts.chain([("contact", Outputs::ACTIVE | Outputs::FILTERED), ("motion", Outputs::MOTION)])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::Body;
    use crate::bundled;
    use crate::field::FieldSet;
    use crate::scene::Scene;
    use crate::signal::Calibration;
    use crate::touch;

    fn plan(outputs: Outputs, fields: &[&str]) -> Plan {
        let body = Body::from_bytes("humanoid.glb", bundled::HUMANOID).unwrap();
        let scene =
            Scene { outputs, fields: fields.iter().map(|glob| (*glob).to_owned()).collect(), ..Scene::default() };
        let calibration = Calibration::identity(body.taxels.len());
        Plan::new(&body, &FieldSet::new(&body).unwrap(), &scene, &calibration).unwrap()
    }

    fn running(plan: &Plan) -> Vec<&'static str> {
        plan.explain().into_iter().filter(|stage| stage.runs).map(|stage| stage.name).collect()
    }

    #[test]
    fn a_plan_is_json() {
        let plan = serde_json::to_value(plan(Outputs::TOTAL, &["torso"])).unwrap();
        assert_eq!((&plan["outputs"][0], &plan["letters"][0]["letter"]), (&"total".into(), &"sustained".into()));
        assert_eq!((&plan["knobs"]["charts"], &plan["fields"][0]["field"]), (&"as-authored".into(), &"torso".into()));
        let contact = plan["stages"].as_array().unwrap().iter().find(|stage| stage["stage"] == "contact").unwrap();
        assert_eq!((&contact["runs"], &contact["where"]), (&true.into(), &"backend".into()));
        assert_eq!((&contact["over"], &contact["each"]), (&1.into(), &"field".into()));
    }

    #[test]
    fn only_stages_that_an_output_needs_run() {
        assert_eq!(running(&plan(Outputs::TOTAL, &[])), ["calibrate", "contact"]);
        assert_eq!(running(&plan(Outputs::CENTROID, &[])), ["calibrate", "contact", "centroid"]);
        assert_eq!(running(&plan(Outputs::SPEED, &[])), ["calibrate", "contact", "centroid", "motion"]);
        let self_contacts = ["calibrate", "contact", "touches", "self_contacts"];
        assert_eq!(running(&plan(Outputs::SELF_CONTACTS, &[])), self_contacts);
        let explained = plan(Outputs::ORIENTATION, &[]).explain();
        let why = |name: &str| explained.iter().find(|stage| stage.name == name).unwrap().why.clone();
        assert_eq!(why("orientation"), "asked for: orientation");
        assert_eq!(why("centroid"), "later stages need it");
        assert_eq!(why("principal_axis"), "no output needs it");
        assert_eq!(why("change"), "no letter is `change`");
    }

    #[test]
    fn stages_over_the_whole_skin_count_its_taxels() {
        let body = Body::from_bytes("sensing-hand", bundled::SENSING_HAND).unwrap();
        let touches = touch::Options { outputs: TouchOutputs::USUAL | TouchOutputs::FIT, ..touch::Options::default() };
        let scene = Scene::default().touches(touches).outputs(Outputs::USUAL | Outputs::SELF_CONTACTS);
        let calibration = Calibration::identity(body.taxels.len());
        let plan = Plan::new(&body, &FieldSet::new(&body).unwrap(), &scene, &calibration).unwrap();
        let pressed = body.taxels.iter().filter(|taxel| taxel.modality.is_pressed()).count();
        assert!(pressed > 0 && pressed < body.taxels.len());
        let explained = plan.explain();
        let over = |name: &str| {
            let stage = explained.iter().find(|stage| stage.name == name).unwrap();
            assert!(stage.runs, "{name}");
            (stage.over, stage.each)
        };
        assert_eq!(
            [over("touches"), over("fit"), over("self_contacts")],
            [(pressed, "taxel"), (pressed, "taxel"), (0, "touch")]
        );
        assert_eq!(over("calibrate").1, "value");
        let warm = plan.fields.iter().filter(|field| plan.letters()[field.letter].receptor == Receptor::Temperature);
        assert_eq!(over("temperature"), (warm.count(), "field"));
    }

    #[test]
    fn one_region_moves_only_its_own_bytes() {
        let whole = plan(Outputs::CENTROID, &[]);
        let part = whole.fields.iter().find(|field| field.name.contains('/') && field.count < 40).unwrap();
        let (name, count) = (part.name.clone(), part.count);
        let one = plan(Outputs::CENTROID, &[&name]);
        assert_eq!((one.bytes_up(), one.bytes_down()), (count * 4, 3 * 4));
        assert_eq!(whole.bytes_down(), whole.fields.len() * 3 * 4);
        let contact = &one.explain()[2];
        assert_eq!((contact.name, contact.over, contact.memberships), ("contact", 1, count));
    }

    #[test]
    fn what_stages_move_adds_up_to_what_a_frame_moves() {
        for outputs in [Outputs::TOTAL, Outputs::POSITION, Outputs::SPEED, Outputs::SELF_CONTACTS, Outputs::all()] {
            let plan = plan(outputs, &[]);
            let stages = plan.explain();
            let sum = |bytes: fn(&PlannedStage) -> usize| stages.iter().map(bytes).sum::<usize>();
            assert_eq!(
                [sum(|stage| stage.bytes_up), sum(|stage| stage.bytes_down)],
                [plan.bytes_up(), plan.bytes_down()],
                "{outputs:?}"
            );
            assert!(stages.iter().all(|stage| stage.runs || stage.bytes_up + stage.bytes_down == 0), "{outputs:?}");
        }
    }
}
