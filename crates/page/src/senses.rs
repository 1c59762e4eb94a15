//! What a page is told of taxels that read other things than pressure.

use serde_json::{Value, json};

use super::sense_scale::SenseScales;
use crate::body::Body;
use crate::colours::{distance_colours, temperature_colours};
use crate::signal::Receptor;
use somatic_engine::scene::{Plan, SenseRanges, SensedTaxels};

/// Such taxels of a scene, and their scales.
#[derive(Clone, Debug)]
pub(super) struct PageSenses {
    pub(super) taxels: SensedTaxels,
    /// By their channels, whether frames have their values.
    pub(super) is_sent: Vec<bool>,
    pub(super) scales: SenseScales,
    /// In `welcome`.
    json: Value,
}

impl PageSenses {
    /// Those of `body` under `plan`, if there are any; frames have the channels `sent`, and a recording's readings are
    /// `recorded`.
    pub(super) fn new(body: &Body, plan: &Plan, sent: &[u32], recorded: SenseRanges) -> Option<Self> {
        let taxels = SensedTaxels::new(plan, body);
        taxels.all().next()?;
        let of_letter = |wanted: Receptor| {
            let own = taxels.all().filter(|&(_, receptor, _)| receptor == wanted);
            own.map(|(taxel, ..)| taxel).collect::<Vec<usize>>()
        };
        let mut sent = sent.to_vec();
        sent.sort_unstable();
        let pulled = of_letter(Receptor::Shear);
        let tangents = pulled.iter().map(|&taxel| body.taxels[taxel].tangents_in_link().map(|axis| axis.to_array()));
        let json = json!({
            "shear": pulled,
            "tangents": tangents.collect::<Vec<_>>(),
            "temperature": of_letter(Receptor::Temperature),
            "proximity": of_letter(Receptor::Proximity),
            "temperature_colours": temperature_colours().to_vec(),
            "distance_colours": distance_colours().to_vec(),
        });
        Some(Self {
            is_sent: taxels.channels().iter().map(|channel| sent.binary_search(channel).is_ok()).collect(),
            scales: SenseScales::new(SenseRanges::of_calibration(plan, &taxels), recorded),
            taxels,
            json,
        })
    }

    /// It in `welcome`.
    pub(super) fn welcome(&self, scales: &SenseScales) -> Value {
        let mut json = self.json.clone();
        json["scales"] = scales.json();
        json
    }
}

/// What messages call what a letter reads.
pub(super) fn sense_word(receptor: Receptor) -> &'static str {
    match receptor {
        Receptor::Sustained | Receptor::Change => "pressure",
        Receptor::Shear => "shear",
        Receptor::Temperature => "temperature",
        Receptor::Proximity => "proximity",
    }
}
