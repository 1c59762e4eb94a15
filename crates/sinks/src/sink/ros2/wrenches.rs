//! The force and torque on each link, and of each touch, where they are known in newtons.

use std::collections::{BTreeMap, BTreeSet};

use glam::DVec3;

use super::places::{header, vector};
use super::readings::Readings;
use crate::body::{Body, Modality};
use crate::percept;
use crate::robot::messages::{Wrench, WrenchStamped};
use crate::scene::{Plan, SensedTaxels};
use crate::signal::{Axis, Channel, Quantity, Receptor};

/// Links that are named in a line; the others are counted.
const NAMED_LINKS: usize = 4;

/// The links whose wrench can be computed.
pub(super) struct LinkWrenches {
    links: Vec<LinkWrench>,
    /// By value of a frame, which of these links its taxel is of, if it is a normal value: tangential ones count only while it is pressed.
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
    /// The same of tangential forces, if it has three axes.
    pulls_at_one_in_link: Option<[DVec3; 2]>,
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
    NoPullsRead,
    NoPullsSent,
}

impl Unknown {
    fn words(self) -> &'static str {
        match self {
            Self::NoUnit => "P has no unit; give a calibration with `unit`",
            Self::NoArea => "P is a pressure, and taxels have no area",
            Self::NotRead => "the fields leave out some of its taxels; add touches to --outputs",
            Self::NotSent => "the source sends none of its taxels",
            Self::NotSustained => "the letters have no pressure; add letter sustained",
            Self::NoPullsRead => "tangential forces are not read; add touches to --outputs, or letter shear",
            Self::NoPullsSent => "the source sends no tangential forces of some taxels with three axes",
        }
    }
}

impl LinkWrenches {
    /// The wrenches of the links of `body`, whose frames hold values of the taxels `sent`.
    pub(super) fn new(body: &Body, plan: &Plan, sent: &[u32]) -> Self {
        let taxel_of = |id: &u32| {
            let channel = Channel(*id);
            let taxel = body.taxels.binary_search_by_key(&channel.taxel(), |taxel| taxel.id).ok()?;
            Some((taxel, channel.axis()))
        };
        let sent: Vec<Option<(usize, Axis)>> = sent.iter().map(taxel_of).collect();
        let all_sent: BTreeSet<(usize, Axis)> = sent.iter().flatten().copied().collect();
        let sensed = SensedTaxels::with_wrenches(plan, body);
        let is_read = |channel: Channel| sensed.channels().binary_search(&channel.0).is_ok();
        let mut of_links = vec![Vec::new(); body.links.len()];
        for (index, taxel) in body.taxels.iter().enumerate().filter(|(_, taxel)| taxel.modality.is_pressed()) {
            of_links[taxel.link].push(index);
        }
        let (mut links, mut unknown) = (Vec::new(), BTreeMap::<Unknown, Vec<&str>>::new());
        let mut link_of_taxel = vec![None; body.taxels.len()];
        for (link, own) in body.links.iter().zip(&of_links).filter(|(_, own)| !own.is_empty()) {
            match wrench_taxels((body, plan), own, &all_sent, is_read) {
                Ok(taxels) => {
                    taxels.iter().for_each(|own| link_of_taxel[own.taxel] = Some(links.len()));
                    links.push(LinkWrench { name: link.name.clone(), taxels });
                }
                Err(why) => unknown.entry(why).or_default().push(&link.name),
            }
        }
        let value = |sent: Option<(usize, Axis)>| {
            let (taxel, _) = sent.filter(|(_, axis)| *axis == Axis::Normal)?;
            link_of_taxel[taxel]
        };
        let link_of_value = sent.into_iter().map(value).collect();
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

    /// The wrench of each link, by its place among [`Self::names`]: Σ Aᵢ(−Pᵢnᵢ + sᵢ) over all of its taxels, whatever touches they are
    /// of, and the torque about the link's origin. A link has none in a frame that lacks the normal value of one of its taxels, or in
    /// which it is not known how a pressed one pulls: where a tangential value is missing, faulty or out of range. A part would pass
    /// for the whole. A normal value that came and was rejected adds nothing, as in all sums. Who reads the topic sees its messages pause:
    /// stamps tell how old the last one is.
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
        whole.filter_map(move |((index, link), _)| Some((index, link.message(time_ns, readings)?)))
    }
}

/// The taxels `own` of a link as parts of its wrench, without those that are masked, or that are not among those `sent`. `is_read`
/// says of a tangential channel whether the plan reads it.
fn wrench_taxels(
    (body, plan): (&Body, &Plan),
    own: &[usize],
    sent: &BTreeSet<(usize, Axis)>,
    is_read: impl Fn(Channel) -> bool,
) -> Result<Vec<WrenchTaxel>, Unknown> {
    if !plan.letters().iter().any(|letter| letter.receptor == Receptor::Sustained) {
        return Err(Unknown::NotSustained);
    }
    let mut taxels = Vec::new();
    for &index in own {
        let channel = plan.body_taxels.binary_search(&index).map_err(|_| Unknown::NotRead)?;
        let calibration = &plan.calibrations[channel];
        if calibration.mask || !sent.contains(&(index, Axis::Normal)) {
            continue;
        }
        let taxel = &body.taxels[index];
        let newton_at_one = plan.newtons_per_p(channel).ok_or(match calibration.quantity {
            Quantity::Count => Unknown::NoUnit,
            Quantity::Pascal | Quantity::Newton => Unknown::NoArea,
        })?;
        let has_pulls = taxel.modality == Modality::Force3;
        let pulls = || [Axis::U, Axis::V].into_iter();
        if has_pulls && !pulls().all(|axis| is_read(Channel::of_taxel(taxel.id, axis))) {
            return Err(Unknown::NoPullsRead);
        }
        if has_pulls && !pulls().all(|axis| sent.contains(&(index, axis))) {
            return Err(Unknown::NoPullsSent);
        }
        let tangents = || taxel.tangents_in_link().map(|tangent| tangent * newton_at_one);
        taxels.push(WrenchTaxel {
            taxel: index,
            force_at_one_in_link: -taxel.normal_in_link * newton_at_one,
            pulls_at_one_in_link: has_pulls.then(tangents),
            position_in_link: taxel.position_in_link,
        });
    }
    if taxels.is_empty() { Err(Unknown::NotSent) } else { Ok(taxels) }
}

impl LinkWrench {
    /// `None` if it is not known how a pressed taxel with three axes pulls.
    fn message(&self, time_ns: u64, readings: &Readings) -> Option<WrenchStamped> {
        let (mut force, mut torque) = (DVec3::ZERO, DVec3::ZERO);
        for taxel in &self.taxels {
            let Some(pressure) = readings.pressure(taxel.taxel).filter(|&pressure| pressure > 0.0) else { continue };
            let mut own = taxel.force_at_one_in_link * pressure;
            if let Some(tangents) = taxel.pulls_at_one_in_link {
                let [su, sv] = readings.pull(taxel.taxel)?;
                own += su * tangents[0] + sv * tangents[1];
            }
            force += own;
            torque += taxel.position_in_link.cross(own);
        }
        let wrench = Wrench { force: vector(force), torque: vector(torque) };
        Some(WrenchStamped { header: header(time_ns, &self.name), wrench })
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
    use crate::signal::Letter;
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
        let mut sensed = Vec::new();
        engine.sensed_alone(frame, &SensedTaxels::with_wrenches(engine.plan(), body), &mut sensed);
        readings.read(&pressures, &sensed);
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

    /// Beyond the range of tangential values.
    const BEYOND: f64 = 1000.0;

    /// A hand with taxels of three axes, pressed and pulled: an engine and its frame.
    fn pulled_hand(body: &Body, ids: &[u32], scene: Scene) -> (Engine, crate::Frame) {
        let calibration = "[all]\ngain = 0.01\nunit = \"N\"\n[shear]\ngain = 0.02\nraw_range = [-99, 999]\n";
        let engine = engine(body, ids, calibration, scene);
        let mut frame = engine.frame(0.0);
        for (index, value) in frame.values.iter_mut().enumerate() {
            *value = RawValue::new((index * 7 % 11) as f64);
        }
        (engine, frame)
    }

    #[test]
    fn tangential_forces_of_taxels_with_three_axes_are_in_it() {
        let body = Body::from_bytes("sensing-hand", bundled::body("sensing-hand").unwrap()).unwrap();
        let ids: Vec<u32> = body.taxels.iter().map(|taxel| taxel.id).collect();
        let sent = Channel::all_of(&body);
        let (mut engine, mut frame) = pulled_hand(&body, &ids, with_touches());
        let mut wrenches = LinkWrenches::new(&body, engine.plan(), &sent);
        assert!(wrenches.remarks().is_empty(), "{:?}", wrenches.remarks());
        let mut by_engine = |frame: &crate::Frame| {
            engine.process_one(frame).unwrap();
            let (mut presses, name) = (Vec::new(), |link: u32| body.links[link as usize].name.clone());
            engine.presses_on_links(&mut presses);
            let known = presses.iter().filter_map(|press| Some((name(press.link), press.wrench?)));
            (known.collect::<BTreeMap<_, _>>(), wrenches_by_link(&mut wrenches, &body, &engine, frame))
        };
        let three = |index: &usize| body.taxels[*index].modality == Modality::Force3 && !(index * 7).is_multiple_of(11);
        let taxel = (0..ids.len()).find(three).unwrap();
        let (id, link) = (ids[taxel], &body.links[body.taxels[taxel].link].name);
        let of_three = body.taxels.iter().filter(|taxel| taxel.modality == Modality::Force3);
        let of_fingers = of_three.filter(|taxel| Some(taxel.link) != body.link_index("hand"));
        let links: BTreeSet<&str> = of_fingers.clone().map(|taxel| body.links[taxel.link].name.as_str()).collect();
        let (right, found) = by_engine(&frame);
        let mut without = frame.clone();
        for taxel in of_fingers {
            for axis in [Axis::U, Axis::V] {
                without.values[sent.binary_search(&Channel::of_taxel(taxel.id, axis).0).unwrap()] = RawValue::new(0.0);
            }
        }
        let (_, untouched) = by_engine(&without);
        assert!(links.len() >= 2);
        for (name, wrench) in &right {
            let own = &found[name];
            let [force, torque] = [&own.force, &own.torque].map(|own| DVec3::new(own.x, own.y, own.z));
            assert!(force.distance(wrench.force_newton) < 1e-12 && torque.distance(wrench.torque_newton_m) < 1e-12);
            // Without what pulls fingers, only the palm's link has the same.
            assert_eq!(*own != untouched[name], links.contains(name.as_str()), "{name}");
        }
        let at = sent.binary_search(&Channel::of_taxel(id, Axis::U).0).unwrap();
        frame.values[at] = RawValue::MISSING;
        let (right, missing) = by_engine(&frame);
        assert!(!right.contains_key(link) && !missing.contains_key(link) && missing.len() + 1 == found.len());
        frame.values[taxel] = RawValue::new(0.0);
        let (right, unpressed) = by_engine(&frame);
        assert!(right.contains_key(link) && unpressed.contains_key(link), "what nothing presses pulls nowhere");
        // Nor is it known what is rejected: a part would pass for the whole.
        frame.values[taxel] = RawValue::new((taxel * 7 % 11) as f64);
        for rejected in [RawValue::FAULTY, RawValue::new(BEYOND)] {
            frame.values[at] = rejected;
            let (right, unknown) = by_engine(&frame);
            assert!(!right.contains_key(link) && !unknown.contains_key(link), "{rejected:?}");
            assert!(unknown.len() + 1 == found.len(), "the other links have theirs");
        }
    }

    #[test]
    fn pressures_are_known_in_whatever_order_the_letters_are() {
        let body = Body::from_bytes("sensing-hand", bundled::body("sensing-hand").unwrap()).unwrap();
        let ids: Vec<u32> = body.taxels.iter().map(|taxel| taxel.id).collect();
        let found = |letters: &[Receptor]| {
            let scene = Scene::default().letters(Letter::all_of(letters, &[])).touches(None);
            let (engine, frame) = pulled_hand(&body, &ids, scene);
            let mut wrenches = LinkWrenches::new(&body, engine.plan(), &Channel::all_of(&body));
            let by_link = wrenches_by_link(&mut wrenches, &body, &engine, &frame);
            (by_link, wrenches.remarks().join("\n"))
        };
        let (usual, remarks) = found(&[Receptor::Sustained, Receptor::Shear]);
        assert!(usual.len() > 1 && remarks.is_empty(), "{remarks}");
        assert_eq!(found(&[Receptor::Shear, Receptor::Sustained]), (usual.clone(), remarks.clone()));
        assert_eq!(found(&[Receptor::Change, Receptor::Shear, Receptor::Sustained]), (usual, remarks));
        let (none, why) = found(&[Receptor::Shear, Receptor::Change]);
        assert!(none.is_empty() && why.contains("add letter sustained"), "{why}");
    }

    #[test]
    fn why_tangential_forces_are_not_known_is_reported() {
        let body = Body::from_bytes("sensing-hand", bundled::body("sensing-hand").unwrap()).unwrap();
        let ids: Vec<u32> = body.taxels.iter().map(|taxel| taxel.id).collect();
        let remarks = |scene: Scene, sent: &[u32]| {
            let (engine, _) = pulled_hand(&body, &ids, scene);
            LinkWrenches::new(&body, engine.plan(), sent).remarks().join("\n")
        };
        let sent = remarks(with_touches(), &ids);
        assert!(sent.contains("the source sends no tangential forces of some taxels with three axes"), "{sent}");
        let read = Scene::default().outputs(percept::Outputs::TOTAL).touches(None);
        assert!(remarks(read, &Channel::all_of(&body)).contains("add touches to --outputs, or letter shear"));
    }
}
