//! What percepts are of: what an engine's batches, tables and sinks have in common.

use std::sync::Arc;

use somatic::internal::recording::CALIBRATION;
use somatic::internal::sink::{RecordPart, TableWish};
use somatic::percept::Unit;
use somatic::signal::Quantity;
use somatic::sink::{FieldNames, Session};
use somatic::{Body, Engine, Outputs, Plan, Precision};

/// The run that percepts are of.
pub(crate) struct Run {
    pub(crate) body: Arc<Body>,
    body_bytes: Arc<Vec<u8>>,
    pub(crate) plan: Plan,
    pub(crate) names: Vec<FieldNames>,
    pub(crate) labels: Vec<String>,
    /// By field, its letter.
    pub(crate) letters: Vec<String>,
    pub(crate) outputs: Outputs,
    pub(crate) precision: Precision,
    pub(crate) backend: [String; 3],
    scene: String,
    calibration: Option<String>,
    ids: Vec<u32>,
}

impl Run {
    /// What tables of its percepts have.
    pub(crate) fn tables(&self, wide: bool) -> TableWish {
        TableWish::new(self.outputs, self.plan.touch_outputs().is_some(), wide)
    }

    pub(crate) fn new(
        engine: &Engine,
        body: &Arc<Body>,
        body_bytes: &Arc<Vec<u8>>,
        scene: &str,
        calibration: Option<&str>,
    ) -> Self {
        let plan = engine.plan().clone();
        let chosen = engine.backend();
        let (fields, percepts) = (0..plan.fields().len(), engine.percepts());
        let labels = fields.clone().map(|field| plan.label(field)).collect();
        let letters = fields.map(|field| plan.letters()[percepts.letter(field)].receptor.to_string()).collect();
        Self {
            names: FieldNames::all_of(&plan),
            labels,
            letters,
            outputs: engine.percepts().outputs(),
            precision: engine.percepts().precision(),
            backend: [chosen.name.to_owned(), chosen.device, chosen.reason.to_owned()],
            ids: body.taxels.iter().map(|taxel| taxel.id).collect(),
            plan,
            body: Arc::clone(body),
            body_bytes: Arc::clone(body_bytes),
            scene: scene.to_owned(),
            calibration: calibration.map(str::to_owned),
        }
    }

    /// What pressures are measured in; empty where fields differ.
    pub(crate) fn unit(&self) -> &'static str {
        self.plan.common_quantity().map_or("", Quantity::symbol)
    }

    /// The symbol of `unit` as quantities of this run have it.
    pub(crate) fn symbol_of(&self, unit: Unit) -> String {
        let p = self.unit();
        match unit {
            Unit::P if !p.is_empty() => p.to_owned(),
            Unit::PMetre if !p.is_empty() => format!("{p} m"),
            unit => unit.symbol().to_owned(),
        }
    }

    /// What sinks and tables know of the run; `source` is the input's name for people.
    pub(crate) fn session<'a>(&'a self, source: &'a str, all_fields: bool, attached: bool) -> Session<'a> {
        let mut files = Vec::new();
        if attached {
            let text =
                |name: &str, text: &str| (name.to_owned(), "application/toml".to_owned(), text.as_bytes().to_vec());
            files.push((
                self.body.name.clone(),
                somatic::internal::recording::BODY.to_owned(),
                self.body_bytes.to_vec(),
            ));
            files.push(text("scene.toml", &self.scene));
            files.extend(self.calibration.as_deref().map(|calibration| text(CALIBRATION, calibration)));
        }
        Session {
            names: self.names.clone(),
            all_fields,
            outputs: self.outputs,
            is_double: self.precision == Precision::F64,
            p_unit: self.unit(),
            header: false,
            taxels: &self.ids,
            body: Some(&self.body),
            attached: files,
            parts: vec![RecordPart::Percepts],
            plan: Some(&self.plan),
            source,
            backend: [&self.backend[0], &self.backend[1], &self.backend[2]],
            wiring: None,
            ..Session::default()
        }
    }
}
