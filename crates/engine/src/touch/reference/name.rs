//! The identities of a frame's touches as they are right.

use std::collections::{BTreeMap, BTreeSet};

use super::{Reference, Region, Scene};

/// What became of a region.
#[derive(Clone, Copy, Debug)]
pub(super) struct Became {
    pub(super) region: usize,
    pub(super) continues: Option<u64>,
    pub(super) merged: bool,
    pub(super) parted: bool,
    pub(super) in_doubt: bool,
}

impl Reference {
    pub(super) fn name(&mut self, scene: &Scene<'_>, regions: &[Region]) -> BTreeMap<u64, Became> {
        let total = |region: usize| regions[region].nodes.iter().map(|&node| scene.pressure(node)).sum::<f64>();
        let options = scene.options;
        // (shared pressure, identity before, region)
        let mut claims: Vec<(f64, u64, usize)> = Vec::new();
        for (&id, past) in &self.touches {
            for (index, region) in regions.iter().enumerate() {
                let both = past.pressures.iter().filter(|(node, _)| region.nodes.contains(node));
                let shared: f64 = both.map(|(&node, &pressure)| pressure.min(scene.pressure(node))).sum();
                if shared > 0.0 && total(index) > options.on.min(options.off) {
                    claims.push((shared, id, index));
                }
            }
        }
        claims.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)).then(a.2.cmp(&b.2)));
        let rivals = |region: usize, ids: &BTreeSet<u64>| {
            let concerns = |claim: &&(f64, u64, usize)| claim.2 == region || ids.contains(&claim.1);
            let near: Vec<f64> = claims.iter().filter(concerns).map(|claim| claim.0).collect();
            near.windows(2).any(|pair| scene.are_near(pair[0], pair[1]))
        };
        let mut became: BTreeMap<usize, Became> = BTreeMap::new();
        let mut went: BTreeMap<u64, usize> = BTreeMap::new();
        let mut id_of: BTreeMap<usize, u64> = BTreeMap::new();
        for &(_, id, region) in &claims {
            if !went.contains_key(&id) && !became.contains_key(&region) {
                went.insert(id, region);
                id_of.insert(region, id);
                became.insert(
                    region,
                    Became { region, continues: Some(id), merged: false, parted: false, in_doubt: false },
                );
            }
        }
        for &id in self.touches.keys() {
            if went.contains_key(&id) {
                continue;
            }
            if let Some(&(_, _, region)) = claims.iter().find(|claim| claim.1 == id) {
                went.insert(id, region);
                let Some(into) = became.get_mut(&region) else { continue };
                into.merged = true;
                if id < id_of[&region] {
                    into.continues = Some(id);
                    id_of.insert(region, id);
                }
            }
        }
        for region in 0..regions.len() {
            if !became.contains_key(&region) && total(region) > options.on {
                self.ids_given += 1;
                id_of.insert(region, self.ids_given);
                for &(_, id, _) in claims.iter().filter(|claim| claim.2 == region) {
                    if let Some(whole) = went.get(&id).and_then(|whole| became.get_mut(whole)) {
                        whole.parted = true;
                    }
                }
                became
                    .insert(region, Became { region, continues: None, merged: false, parted: false, in_doubt: false });
            }
        }
        for (&region, became) in &mut became {
            let ids: BTreeSet<u64> = claims.iter().filter(|claim| claim.2 == region).map(|claim| claim.1).collect();
            let is_near = |threshold: f64| threshold > 0.0 && scene.are_near(total(region), threshold);
            became.in_doubt = rivals(region, &ids) || is_near(options.on) || is_near(options.off);
        }
        became.into_iter().map(|(region, became)| (id_of[&region], became)).collect()
    }
}
