//! The force and torque on each link, and of each touch, where they are known in newtons.

use std::collections::BTreeMap;

use glam::DVec3;

use super::places::{header, vector};
use super::readings::Readings;
use crate::body::Body;
use crate::percept;
use crate::robot::messages::{Wrench, WrenchStamped};
use crate::scene::Plan;
use crate::signal::{Quantity, Receptor};

/// Links that are named in a line; the others are counted.
const NAMED_LINKS: usize = 4;

/// The links whose wrench can be computed.
pub(super) struct LinkWrenches {
    links: Vec<LinkWrench>,
    /// By value of a frame, which of these links its taxel is of.
    link_of_value: Vec<Option<usize>>,
    /// Which of them lack values in this frame; memory.
    lacks: Vec<bool>,
    /// Why others have none, a line each.
    remarks: Vec<String>,
}

struct LinkWrench {
    name: String,
    taxels: Vec<WrenchTaxel>,
}

struct WrenchTaxel {
    /// Index of the body.
    taxel: usize,
    /// The force at P = 1, into the skin, N.
    force_at_one_in_link: DVec3,
    position_in_link: DVec3,
}

/// Why a link has no wrench.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Unknown {
    NoUnit,
    NoArea,
    NotRead,
    NotSent,
    NotSustained,
}

impl Unknown {
    fn words(self) -> &'static str {
        match self {
            Self::NoUnit => "P has no unit; give a calibration with `unit`",
            Self::NoArea => "P is a pressure, and taxels have no area",
            Self::NotRead => "the fields leave out some of its taxels; add touches to --outputs",
            Self::NotSent => "the source sends none of its taxels",
            Self::NotSustained => "the letters have no pressure; add letter sustained",
        }
    }
}

impl LinkWrenches {
    /// The wrenches of the links of `body`, whose frames hold values of the taxels `sent`.
    pub(super) fn new(body: &Body, plan: &Plan, sent: &[u32]) -> Self {
        let taxel_of = |id: &u32| body.taxels.binary_search_by_key(id, |taxel| taxel.id).ok();
        let sent: Vec<Option<usize>> = sent.iter().map(taxel_of).collect();
        let mut is_sent = vec![false; body.taxels.len()];
        sent.iter().flatten().for_each(|&taxel| is_sent[taxel] = true);
        let mut of_links = vec![Vec::new(); body.links.len()];
        for (index, taxel) in body.taxels.iter().enumerate().filter(|(_, taxel)| taxel.modality.is_pressed()) {
            of_links[taxel.link].push(index);
        }
        let (mut links, mut unknown) = (Vec::new(), BTreeMap::<Unknown, Vec<&str>>::new());
        let mut link_of_taxel = vec![None; body.taxels.len()];
        for (link, own) in body.links.iter().zip(&of_links).filter(|(_, own)| !own.is_empty()) {
            match wrench_taxels(body, plan, own, &is_sent) {
                Ok(taxels) => {
                    taxels.iter().for_each(|own| link_of_taxel[own.taxel] = Some(links.len()));
                    links.push(LinkWrench { name: link.name.clone(), taxels });
                }
                Err(why) => unknown.entry(why).or_default().push(&link.name),
            }
        }
        let link_of_value = sent.into_iter().map(|taxel| link_of_taxel[taxel?]).collect();
        let is_none_known = links.is_empty() && unknown.len() == 1;
        let remark = |(why, of): (Unknown, Vec<&str>)| {
            if is_none_known {
                return format!("no wrenches of links: {}", why.words());
            }
            let rest = of.len().saturating_sub(NAMED_LINKS);
            let more = if rest > 0 { format!(" and {rest} more") } else { String::new() };
            format!("no wrench of {}{more}: {}", of[..of.len() - rest].join(", "), why.words())
        };
        let (lacks, remarks) = (vec![false; links.len()], unknown.into_iter().map(remark).collect());
        Self { links, link_of_value, lacks, remarks }
    }

    /// The names of the links that have one.
    pub(super) fn names(&self) -> impl Iterator<Item = &str> {
        self.links.iter().map(|link| link.name.as_str())
    }

    /// Why others have none.
    pub(super) fn remarks(&self) -> &[String] {
        &self.remarks
    }

    /// The wrench of each link, by its place among [`Self::names`]: −Σ PᵢAᵢnᵢ over all of its taxels, whatever touches they are of, and
    /// the torque about the link's origin. A link with a missing value has none: a part would pass for the whole. A value
    /// that came and was rejected adds nothing, as in all sums.
    pub(super) fn messages(
        &mut self,
        time_ns: u64,
        readings: &Readings,
        missing: &[usize],
    ) -> impl Iterator<Item = (usize, WrenchStamped)> {
        let Self { links, link_of_value, lacks, .. } = self;
        lacks.fill(false);
        missing.iter().filter_map(|&value| *link_of_value.get(value)?).for_each(|link| lacks[link] = true);
        let whole = links.iter().enumerate().zip(lacks).filter(|(_, lacks)| !**lacks);
        whole.map(move |((index, link), _)| (index, link.message(time_ns, readings)))
    }
}

/// The taxels `own` of a link as parts of its wrench, without those that are masked, or that no frame has.
fn wrench_taxels(body: &Body, plan: &Plan, own: &[usize], is_sent: &[bool]) -> Result<Vec<WrenchTaxel>, Unknown> {
    if plan.letters().first().is_none_or(|letter| letter.receptor != Receptor::Sustained) {
        return Err(Unknown::NotSustained);
    }
    let mut taxels = Vec::new();
    for &index in own {
        let channel = plan.body_taxels.binary_search(&index).map_err(|_| Unknown::NotRead)?;
        let calibration = &plan.calibrations[channel];
        if calibration.mask || !is_sent[index] {
            continue;
        }
        let taxel = &body.taxels[index];
        let newton_at_one = match calibration.quantity {
            Quantity::Count => return Err(Unknown::NoUnit),
            Quantity::Pascal if taxel.area > 0.0 => taxel.area,
            Quantity::Pascal => return Err(Unknown::NoArea),
            Quantity::Newton => 1.0,
        };
        taxels.push(WrenchTaxel {
            taxel: index,
            force_at_one_in_link: -taxel.normal_in_link * newton_at_one,
            position_in_link: taxel.position_in_link,
        });
    }
    if taxels.is_empty() { Err(Unknown::NotSent) } else { Ok(taxels) }
}

impl LinkWrench {
    fn message(&self, time_ns: u64, readings: &Readings) -> WrenchStamped {
        let (mut force, mut torque) = (DVec3::ZERO, DVec3::ZERO);
        for WrenchTaxel { taxel, force_at_one_in_link, position_in_link } in &self.taxels {
            let Some(pressure) = readings.pressure(*taxel).filter(|&pressure| pressure > 0.0) else { continue };
            let own = force_at_one_in_link * pressure;
            force += own;
            torque += position_in_link.cross(own);
        }
        let wrench = Wrench { force: vector(force), torque: vector(torque) };
        WrenchStamped { header: header(time_ns, &self.name), wrench }
    }
}

/// What a touch presses on the link called `link`.
pub(super) fn of_touch(time_ns: u64, link: &str, wrench: &percept::Wrench) -> WrenchStamped {
    let wrench = Wrench { force: vector(wrench.force_newton), torque: vector(wrench.torque_newton_m) };
    WrenchStamped { header: header(time_ns, link), wrench }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{BackendKind, Calibration, Engine, Options, RawValue, Scene, bundled, touch};

    fn hand() -> (Body, Vec<u32>) {
        let body = Body::from_bytes("hand", bundled::HAND).unwrap();
        let ids = body.taxels.iter().map(|taxel| taxel.id).collect();
        (body, ids)
    }

    fn engine(body: &Body, ids: &[u32], calibration: &str, scene: Scene) -> Engine {
        let calibration = Calibration::parse(calibration, ids).unwrap();
        let options = Options::default().scene(scene).calibration(calibration).backend(BackendKind::Reference);
        Engine::new(body, options).unwrap()
    }

    fn with_touches() -> Scene {
        Scene::default().touches(touch::Options::default())
    }

    /// The wrenches by link, of a frame of all taxels.
    fn wrenches_by_link(
        wrenches: &mut LinkWrenches,
        body: &Body,
        engine: &Engine,
        frame: &crate::Frame,
    ) -> BTreeMap<String, Wrench> {
        let mut pressures = Vec::new();
        engine.pressures(frame, &mut pressures);
        let mut readings = Readings::new(body);
        readings.read(&pressures, &[]);
        let missing: Vec<usize> = (0..frame.values.len()).filter(|&index| frame.values[index].is_missing()).collect();
        let messages = wrenches.messages(0, &readings, &missing);
        messages.map(|(_, message)| (message.header.frame_id, message.wrench)).collect()
    }

    #[test]
    fn the_wrench_of_a_link_is_what_the_engine_says_presses_on_it() {
        let (body, ids) = hand();
        let mut engine = engine(&body, &ids, "[all]\ngain = 100\nunit = \"Pa\"\n", with_touches());
        let mut wrenches = LinkWrenches::new(&body, engine.plan(), &ids);
        assert!(wrenches.remarks().is_empty(), "{:?}", wrenches.remarks());
        let mut frame = engine.frame(0.0);
        for (index, value) in frame.values.iter_mut().enumerate() {
            *value = RawValue::new(if index % 3 == 0 { 0.0 } else { (index * 7 % 11) as f64 });
        }
        engine.process_one(&frame).unwrap();
        let mut presses = Vec::new();
        engine.presses_on_links(&mut presses);
        let found = wrenches_by_link(&mut wrenches, &body, &engine, &frame);
        let mut compared = 0;
        for press in &presses {
            let wrench = press.wrench.unwrap();
            let own = &found[&body.links[press.link as usize].name];
            let (force, torque) = (wrench.force_newton, wrench.torque_newton_m);
            assert!(
                DVec3::new(own.force.x, own.force.y, own.force.z).distance(force) < 1e-12 * force.length().max(1.0)
            );
            assert!(DVec3::new(own.torque.x, own.torque.y, own.torque.z).distance(torque) < 1e-12);
            compared += 1;
        }
        assert!(compared >= 2 && compared <= found.len(), "{presses:?}");
        // What is not pressed has a wrench, too: nothing.
        frame.values.fill(RawValue::new(0.0));
        let at_rest = wrenches_by_link(&mut wrenches, &body, &engine, &frame);
        assert!(at_rest.len() == found.len() && at_rest.values().all(|wrench| *wrench == Wrench::default()));
    }

    #[test]
    fn a_link_with_a_missing_value_has_none_and_a_masked_taxel_is_left_out() {
        let (body, ids) = hand();
        let masked = format!("[all]\nunit = \"N\"\n[taxel.{}]\nmask = true\n", ids[0]);
        let engine = engine(&body, &ids, &masked, with_touches());
        let mut wrenches = LinkWrenches::new(&body, engine.plan(), &ids);
        let mut frame = engine.frame(0.0);
        frame.values.fill(RawValue::new(1.0));
        let all = wrenches_by_link(&mut wrenches, &body, &engine, &frame);
        let own = &body.links[body.taxels[0].link].name;
        frame.values[0] = RawValue::MISSING;
        assert_eq!(wrenches_by_link(&mut wrenches, &body, &engine, &frame), all, "it is masked anyway");
        let beside = (1..ids.len()).find(|&index| body.taxels[index].link == body.taxels[0].link).unwrap();
        // What came and is not a number adds nothing; what did not come is not known.
        frame.values[beside] = RawValue::FAULTY;
        let faulty = wrenches_by_link(&mut wrenches, &body, &engine, &frame);
        assert!(faulty.len() == all.len() && faulty[own] != all[own]);
        for absent in [RawValue::MISSING, RawValue::STALE] {
            frame.values[beside] = absent;
            let found = wrenches_by_link(&mut wrenches, &body, &engine, &frame);
            assert!(found.len() + 1 == all.len() && !found.contains_key(own), "{absent:?}");
        }
    }

    #[test]
    fn why_a_link_has_none_is_reported() {
        let (mut body, ids) = hand();
        let remarks = |body: &Body, calibration: &str, scene: Scene, sent: &[u32]| {
            LinkWrenches::new(body, engine(body, &ids, calibration, scene).plan(), sent).remarks().join("\n")
        };
        assert!(remarks(&body, "", with_touches(), &ids).contains("P has no unit"));
        let newtons = "[all]\nunit = \"N\"\n";
        let none = remarks(&body, newtons, with_touches(), &[]);
        assert!(none.contains("the source sends none of its taxels"), "{none}");
        let fields = Scene::default().fields(["hand/midhand/thumb"]).touches(None);
        assert!(remarks(&body, newtons, fields, &ids).contains("leave out some of its taxels; add touches"));
        body.taxels.iter_mut().for_each(|taxel| taxel.area = 0.0);
        assert!(remarks(&body, "[all]\nunit = \"Pa\"\n", with_touches(), &ids).contains("taxels have no area"));
        assert_eq!(remarks(&body, newtons, with_touches(), &ids), "");
    }
}
