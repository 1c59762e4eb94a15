//! The force and torque on each leaf field, where they are known in newtons.

use glam::DVec3;

use super::places::{header, vector};
use super::readings::Readings;
use crate::body::Body;
use crate::robot::messages::{Wrench, WrenchStamped};
use crate::scene::Plan;
use crate::signal::{Quantity, Receptor};

/// A field whose wrench can be told.
pub(super) struct WrenchField {
    pub(super) name: String,
    link: String,
    taxels: Vec<WrenchTaxel>,
}

struct WrenchTaxel {
    /// Index of the body.
    taxel: usize,
    /// The force at P = 1, into the skin, N.
    force_at_one_in_link: DVec3,
    position_in_link: DVec3,
}

/// The fields of `plan` that have a wrench: leaves, as nested ones would count twice, of sustained pressure in Pa with
/// known areas or of forces in N, whose taxels all sit on one link.
pub(super) fn wrench_fields(body: &Body, plan: &Plan) -> Vec<WrenchField> {
    let mut found = Vec::new();
    for field in plan.fields.iter() {
        let is_sustained = plan.letters()[field.letter].receptor == Receptor::Sustained;
        let is_known = match field.quantity {
            Quantity::Pascal => field.area_known,
            Quantity::Newton => true,
            Quantity::Count => false,
        };
        if field.divided || !is_sustained || !is_known {
            continue;
        }
        let taxels: Vec<_> = plan
            .members_of(field)
            .iter()
            .map(|member| plan.body_taxels[plan.channel_of(member.slot as usize)])
            .collect();
        let mut links: Vec<usize> = taxels.iter().map(|&taxel| body.taxels[taxel].link).collect();
        links.dedup();
        let [link] = links[..] else { continue };
        let area_m2 = |area: f64| if field.quantity == Quantity::Pascal { area } else { 1.0 };
        let of_taxel = |&index: &usize| {
            let taxel = &body.taxels[index];
            WrenchTaxel {
                taxel: index,
                force_at_one_in_link: -taxel.normal_in_link * area_m2(taxel.area),
                position_in_link: taxel.position_in_link,
            }
        };
        found.push(WrenchField {
            name: field.name.clone(),
            link: body.links[link].name.clone(),
            taxels: taxels.iter().map(of_taxel).collect(),
        });
    }
    found
}

impl WrenchField {
    /// −Σ PᵢAᵢnᵢ and its torque about the link's origin, `None` where a taxel has no reading.
    pub(super) fn message(&self, time_ns: u64, readings: &Readings) -> Option<WrenchStamped> {
        let (mut force, mut torque) = (DVec3::ZERO, DVec3::ZERO);
        for WrenchTaxel { taxel, force_at_one_in_link, position_in_link } in &self.taxels {
            let own = force_at_one_in_link * readings.of(*taxel)?;
            force += own;
            torque += position_in_link.cross(own);
        }
        let wrench = Wrench { force: vector(force), torque: vector(torque) };
        Some(WrenchStamped { header: header(time_ns, &self.link), wrench })
    }
}
