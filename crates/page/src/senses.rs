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
            is_sent: taxels.channels().iter().map(|channel| sent.contains(channel)).collect(),
            scales: SenseScales::new(SenseRanges::of_calibration(plan), recorded),
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

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::super::readings::{Health, Readings};
    use super::super::snapshot::Snapshot;
    use super::*;
    use crate::body::{FieldSpec, Glb, MemberSpec, Modality, Taxel};
    use crate::field::FieldSet;
    use crate::signal::{Calibration, Channel, RawValue};
    use somatic_engine::scene::Scene;

    /// Two taxels of each kind: 0 and 1 of three axes, 2 and 3 of temperature, 4 and 5 of proximity.
    fn body() -> Body {
        let mut glb = Glb::new();
        let link = glb.node("pad", None, DVec3::ZERO);
        let kinds = [Modality::Force3, Modality::Temperature, Modality::Proximity];
        let taxel = |id: u32| Taxel {
            id,
            link: 0,
            position_in_link: DVec3::X * 0.01 * f64::from(id),
            normal_in_link: DVec3::Y,
            area: 1e-5,
            modality: kinds[id as usize / 2],
            tangent_in_link: (id < 2).then_some(DVec3::Z),
        };
        glb.taxels("taxels", Some(link), &(0..6).map(taxel).collect::<Vec<_>>(), None);
        let members = (0..6).map(|id| (id, MemberSpec::default())).collect();
        glb.field(&FieldSpec { name: "pad".into(), parent: None, members, chart: None }, Some(link), DVec3::ZERO);
        Body::from_bytes("pad", &glb.to_bytes().unwrap()).unwrap()
    }

    #[test]
    fn taxels_that_read_something_else_have_their_values_states_and_scales() {
        let body = body();
        let ids: Vec<u32> = body.taxels.iter().map(|taxel| taxel.id).collect();
        let text = "[all]\nunit = \"N\"\n[proximity]\nunit = \"mm\"\nrange = 80\n";
        let calibration = Calibration::parse(text, &ids).unwrap();
        let plan = Plan::new(&body, &FieldSet::new(&body).unwrap(), &Scene::default(), &calibration).unwrap();
        let channels = Channel::all_of(&body);
        let senses = PageSenses::new(&body, &plan, &channels, SenseRanges::default()).unwrap();
        let welcome = senses.welcome(&senses.scales);
        assert_eq!(
            (&welcome["shear"], &welcome["temperature"], &welcome["proximity"]),
            (&json!([0, 1]), &json!([2, 3]), &json!([4, 5]))
        );
        assert_eq!(welcome["tangents"][0], json!([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]));
        assert_eq!(welcome["scales"]["proximity"]["most"], 0.08);
        assert_eq!(
            (welcome["scales"]["temperature"].clone(), plan.common_quantity()),
            (Value::Null, Some(crate::signal::Quantity::Newton))
        );

        let value_of: Vec<Option<usize>> = (0..plan.channels()).map(Some).collect();
        let mut snapshot = Snapshot::new(&plan);
        snapshot.raw = [2.0, 0.0].map(RawValue::new).to_vec();
        // Temperatures, distances in mm, then both tangential forces of each.
        let sensed = [Some(21.5), None, Some(30.0), Some(90.0), Some(0.5), Some(7.0), Some(-0.25), Some(7.0)];
        snapshot.sensed = sensed.map(|value| value.map_or(RawValue::MISSING, RawValue::new)).to_vec();
        let mut readings = Readings::new(plan.clone(), 6, &value_of, Some(&senses));
        assert_eq!(readings.read(&snapshot), 2.0, "the largest pressure is of no other kind");
        let health = [Health::Good, Health::Good, Health::Good, Health::Missing, Health::Good, Health::OutOfRange];
        assert_eq!(readings.health(), health.map(|health| health as u8));
        let values: Vec<Option<f32>> =
            readings.pressures().iter().map(|value| Some(*value).filter(|x| !x.is_nan())).collect();
        assert_eq!(values, [Some(2.0), Some(0.0), Some(21.5), None, Some(0.03), None]);
        // What is not pressed pulls nothing.
        assert_eq!(readings.shears(), [0.5, -0.25, 0.0, 0.0]);
        let ranges = readings.sense_ranges();
        assert_eq!((ranges.celsius, ranges.distance_m), (Some([21.5, 21.5]), Some([0.03, 0.03])));
        let [warm, far] = [2, 5].map(|taxel| readings.taxel(&snapshot, taxel));
        assert_eq!((warm.raw, warm.pressure, warm.health), (Some(21.5), Some(21.5), Health::Good));
        assert_eq!((far.raw, far.pressure, far.health), (Some(90.0), None, Health::OutOfRange));

        snapshot.sensed[0] = RawValue::new(22.0);
        readings.read(&snapshot);
        assert_eq!((readings.changes(), readings.pressures()[2]), (2, 22.0), "what is sensed alone is a change");
        // Without their channels they are not sent, and a plan of pressure alone has none of this.
        let unsent = PageSenses::new(&body, &plan, &ids[..2], SenseRanges::default()).unwrap();
        snapshot.sensed.fill(RawValue::MISSING);
        let mut readings = Readings::new(plan, 6, &value_of, Some(&unsent));
        readings.read(&snapshot);
        assert_eq!(readings.health()[2..], [Health::NotSent as u8; 4]);
        assert!(readings.shears().iter().all(|shear| shear.is_nan() || *shear == 0.0));
    }
}
