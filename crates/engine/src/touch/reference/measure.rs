//! The quantities of a touch as they are right.

use std::collections::{BTreeMap, BTreeSet};

use glam::{DMat3, DVec3};

use super::{Past, Region, RightTouch, RightWrench, Scene};
use crate::body::nearest_on_triangle;
use crate::percept::TouchFlags;
use crate::touch::bound;
use crate::touch::moments::symmetric_eigen;

impl Scene<'_> {
    pub(super) fn measure(&self, region: &Region) -> (RightTouch, Past) {
        let taxel = |node: u32| &self.skin.taxels()[node as usize];
        let nodes = || region.nodes.iter().copied();
        let total: f64 = nodes().map(|node| self.pressure(node)).sum();
        let pull = |node: u32| {
            self.pressure(node) * if taxel(node).reading.weighs_by_cell { taxel(node).cell_m2 } else { 1.0 }
        };
        let pulls: f64 = nodes().map(pull).sum();
        let mean: DVec3 = nodes().map(|node| taxel(node).position * (pull(node) / pulls)).sum();
        let centre = nodes().map(|node| taxel(node).position).sum::<DVec3>() / region.nodes.len() as f64;
        let mut by_link: BTreeMap<u32, f64> = BTreeMap::new();
        nodes().for_each(|node| *by_link.entry(taxel(node).link).or_default() += self.pressure(node));
        let most = by_link.values().copied().fold(0.0, f64::max);
        let link = by_link.iter().find(|(_, share)| **share == most).map_or(0, |(&link, _)| link);
        let link_in_doubt = by_link.iter().any(|(&other, &share)| other != link && self.are_near(share, most));
        let distance = |node: u32| taxel(node).position.distance(mean);
        let base = nodes().min_by(|&a, &b| distance(a).total_cmp(&distance(b)).then(a.cmp(&b)));
        let base = base.unwrap_or(region.peak);
        let places: Vec<(DVec3, f64)> = nodes().map(|node| (taxel(node).position, pull(node))).collect();
        let mean_m = bound::of_mean(&places, mean, self.within);
        let base_in_doubt = nodes().any(|node| node != base && distance(node) - distance(base) <= 2.0 * mean_m);
        let (position, position_m) = self.position(region, mean, base, mean_m);
        let mut wrenches: BTreeMap<u32, RightWrench> = BTreeMap::new();
        for node in nodes() {
            let taxel = taxel(node);
            let way = self.skin.link_from_body(taxel.link);
            let force = -way.transform_vector3(taxel.normal) * taxel.reading.newton_at_one * self.pressure(node);
            let wrench = wrenches.entry(taxel.link).or_default();
            let place = way.transform_point3(taxel.position);
            wrench.force_newton += force;
            wrench.torque_newton_m += place.cross(force);
            wrench.forces_newton += force.length();
            wrench.torques_newton_m += (place.length() + taxel.position.length()) * force.length();
        }
        let newtons: Vec<f64> = nodes().map(|node| taxel(node).reading.newton_at_one * self.pressure(node)).collect();
        let mut touch = RightTouch {
            id: 0,
            age_s: 0.0,
            link,
            nodes: region.nodes.clone(),
            total,
            force_newton: newtons.iter().all(|&newton| newton > 0.0).then(|| newtons.iter().sum()),
            position,
            centre,
            axis: None,
            anisotropy: None,
            spread_m: None,
            orientation: None,
            velocity: None,
            wrenches,
            flags: if by_link.len() > 1 { TouchFlags::SEVERAL_LINKS } else { TouchFlags::empty() },
            in_doubt: false,
            base_in_doubt,
            link_in_doubt,
            bound: bound::of_form(&places, mean, [0.0; 2], self.within),
        };
        self.shape(&mut touch, base, &pull, pulls);
        (touch.bound.mean_m, touch.bound.position_m) = (mean_m, position_m);
        let pressures = nodes().map(|node| (node, self.pressure(node))).collect();
        (touch, Past { began_s: self.frame.t_s, link, positions: Vec::new(), pressures })
    }

    /// The position for the weighted mean `mean`, which may be off by `mean_m`, and how far it may be off.
    fn position(&self, region: &Region, mean: DVec3, base: u32, mean_m: f64) -> (DVec3, f64) {
        let surface = self.skin.surface();
        let cells: BTreeSet<u32> = region.nodes.iter().map(|&node| self.skin.cell_of(node)).collect();
        let mut nearest: Vec<(DVec3, f64)> = Vec::new();
        for cell in cells.into_iter().filter(|&cell| surface.has_surface(cell)) {
            let origin = self.skin.taxels()[cell as usize].position;
            for corners in surface.triangles_about(cell) {
                let point = nearest_on_triangle(corners.map(|corner| corner + origin), mean);
                // A triangle that is a line in single precision has no nearest point; its neighbours have it.
                if point.is_finite() {
                    nearest.push((point, point.distance(mean)));
                }
            }
        }
        let Some(&(point, least_m)) = nearest.iter().min_by(|a, b| a.1.total_cmp(&b.1)) else {
            let base = &self.skin.taxels()[base as usize];
            let on_plane = mean - base.mean_normal * (mean - base.position).dot(base.mean_normal);
            return (on_plane, mean_m + 1e-12);
        };
        (point, bound::of_position(nearest.iter().copied(), point, least_m, mean_m))
    }

    fn shape(&self, touch: &mut RightTouch, base: u32, pull: &dyn Fn(u32) -> f64, pulls: f64) {
        let nodes: Vec<u32> = touch.nodes.iter().copied().collect();
        if nodes.len() == 1 {
            touch.flags |= TouchFlags::ONE_TAXEL;
            return;
        }
        let taxel = |node: u32| &self.skin.taxels()[node as usize];
        let n0 = taxel(base).mean_normal;
        let wrapped = nodes.iter().any(|&node| taxel(node).mean_normal.dot(n0) < -0.5);
        let place = |node: u32| if wrapped { taxel(node).position } else { self.place(base, node) };
        let mean: DVec3 = nodes.iter().map(|&node| place(node) * (pull(node) / pulls)).sum();
        let mut moments = DMat3::ZERO;
        for &node in &nodes {
            let x = place(node) - mean;
            moments += DMat3::from_cols(x * x.x, x * x.y, x * x.z) * (pull(node) / pulls);
        }
        let (values, vectors) = symmetric_eigen(moments);
        let [first, second] = [values[0].max(0.0), values[1].max(0.0)];
        let places: Vec<(DVec3, f64)> = nodes.iter().map(|&node| (place(node), pull(node))).collect();
        touch.bound = bound::of_form(&places, mean, [first, second], self.within);
        if wrapped {
            touch.flags |= TouchFlags::WRAPPED;
        }
        if first + second <= 1e-12 {
            touch.flags |= TouchFlags::COINCIDENT;
        } else {
            let anisotropy = (first - second) / (first + second);
            touch.anisotropy = Some(anisotropy);
            touch.spread_m = Some([first.sqrt(), second.sqrt()]);
            match anisotropy < 1e-3 {
                true => touch.flags |= TouchFlags::ISOTROPIC,
                false => touch.axis = Some(vectors[0].normalize()),
            }
        }
        if wrapped {
            return;
        }
        let point = |node: u32| (place(node) - mean) * (pull(node) / pulls);
        let mut far: Vec<(u32, DVec3)> = nodes.iter().map(|&node| (node, point(node))).collect();
        far.sort_by(|a, b| b.1.length().total_cmp(&a.1.length()).then(a.0.cmp(&b.0)));
        let r = |rank: usize| far.get(rank).map_or(f64::NEG_INFINITY, |(_, point)| point.length());
        let near = r(0) / 16_384.0;
        let line = far[0].1 - far[1].1;
        if line.length() <= near {
            touch.flags |= TouchFlags::COINCIDENT;
        } else {
            touch.orientation = Some(line.normalize());
            if r(1) - r(2) <= near {
                touch.flags |= TouchFlags::TIE;
            }
        }
    }
}
