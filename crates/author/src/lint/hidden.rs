//! Taxels that nothing can touch.
//!
//! A ray starts 0.1 mm outside each taxel in each of 256 directions. With the poses of joints, a taxel is hidden if none
//! escapes at rest nor in any other pose. Without them, none escapes at rest, and the taxel's own link alone blocks all; or it is
//! inside the body, by the mean over the rays of ways out less ways in; or its shell is closed off as a whole. Else another pose
//! might uncover it. No mesh needs to be closed for this.

use std::collections::BTreeMap;

use glam::DVec3;

use super::drawn_poses::DrawnPoses;
use super::posed_surface::{BodyPoint, DIRECTIONS, PosedSurface, directions};
use super::shells::ShellsOfLinks;
use super::taxels_at_rest::taxels_at_rest;
use crate::body::Body;
use crate::parallel;

/// Taxels that are looked at; of more, as many evenly spread ones.
const MAX_CHECKED: usize = 10_000;

/// A start is inside a surface if the mean over the rays of ways out less ways in is over this.
const INSIDE: f64 = 0.5;

/// One direction in this many is tried for whether a taxel is inside another link.
const COARSE: usize = 8;

/// Taxels that a thread takes at a time, and how often it does between two reports of progress.
const PER_TASK: usize = 16;
const TASKS_PER_THREAD: usize = 4;

/// Links run into each other at rest if this share of one's taxels is inside the other, and at least this number.
const RUNS_INTO_SHARE: f64 = 0.05;
const RUNS_INTO_TAXELS: usize = 3;

/// Whether anything can touch a taxel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Reach {
    Open,
    /// Nothing at rest; another pose might uncover it.
    CoveredAtRest,
    Hidden,
}

/// What the rays show of a taxel.
struct Seen {
    reach: Reach,
    /// Whether its face points into its own link.
    is_inward: bool,
    /// Links that it is inside at rest, and not in some other pose.
    inside: Vec<usize>,
}

/// A link with taxels inside another at rest.
#[derive(Debug, PartialEq)]
pub(super) struct RunsInto {
    pub(super) link: usize,
    pub(super) into: usize,
    /// By id, ascending.
    pub(super) taxels: Vec<u32>,
}

/// What the rays show.
#[derive(Default)]
pub(super) struct Hidden {
    /// Indices of the taxels that were looked at, and whether they can be touched.
    pub(super) checked: Vec<(usize, Reach)>,
    /// Indices of taxels on faces that point into their own link.
    pub(super) inward: Vec<usize>,
    pub(super) runs_into: Vec<RunsInto>,
    /// How many poses beside rest.
    pub(super) other_poses: Option<usize>,
}

/// Looks for the taxels of `body` that nothing can touch, in the poses of its joints if there are any. `progress` gets the share
/// that is done.
pub(super) fn find(body: &Body, poses: Option<&DrawnPoses>, progress: &mut dyn FnMut(f64)) -> Hidden {
    let rest;
    let drawn = match poses {
        Some(poses) => poses,
        None => {
            rest = DrawnPoses::at_rest(body);
            &rest
        }
    };
    let surface = PosedSurface::new(body, drawn);
    if surface.is_empty() || body.taxels.is_empty() {
        return Hidden::default();
    }
    let count = body.taxels.len().min(MAX_CHECKED);
    let checked: Vec<usize> = (0..count).map(|index| index * body.taxels.len() / count).collect();
    let points = taxels_at_rest(body);
    let search = Search { body, surface: &surface, directions: directions(), has_joints: poses.is_some() };
    let mut seen: Vec<Option<Seen>> = (0..count).map(|_| None).collect();
    let at_once = PER_TASK * TASKS_PER_THREAD * parallel::threads();
    for (index, (seen, taxels)) in seen.chunks_mut(at_once).zip(checked.chunks(at_once)).enumerate() {
        progress((index * at_once) as f64 / count as f64);
        let tasks = seen.chunks_mut(PER_TASK).zip(taxels.chunks(PER_TASK));
        parallel::for_each(parallel::threads(), tasks, |(seen, taxels): (&mut [Option<Seen>], &[usize])| {
            for (seen, &taxel) in seen.iter_mut().zip(taxels) {
                *seen = Some(search.look(&points[taxel]));
            }
        });
    }
    let mut hidden = Hidden { other_poses: poses.map(|_| surface.poses() - 1), ..Hidden::default() };
    let mut shells = ShellsOfLinks::new(body);
    let mut inside: BTreeMap<(usize, usize), Vec<u32>> = BTreeMap::new();
    for (index, seen) in checked.into_iter().zip(seen) {
        let Some(mut seen) = seen else { continue };
        let taxel = &body.taxels[index];
        if seen.reach == Reach::CoveredAtRest
            && !shells.for_link(taxel.link).is_open_at(points[index].position, &surface, &search.directions)
        {
            seen.reach = Reach::Hidden;
        }
        hidden.checked.push((index, seen.reach));
        if seen.is_inward {
            hidden.inward.push(index);
        }
        for into in seen.inside {
            inside.entry((taxel.link, into)).or_default().push(taxel.id);
        }
    }
    let of_link = |link: usize| hidden.checked.iter().filter(|(index, _)| body.taxels[*index].link == link).count();
    for ((link, into), taxels) in inside {
        if taxels.len() >= RUNS_INTO_TAXELS && taxels.len() as f64 >= RUNS_INTO_SHARE * of_link(link) as f64 {
            hidden.runs_into.push(RunsInto { link, into, taxels });
        }
    }
    hidden
}

struct Search<'a> {
    body: &'a Body,
    surface: &'a PosedSurface<'a>,
    directions: Vec<DVec3>,
    has_joints: bool,
}

impl Search<'_> {
    fn look(&self, taxel: &BodyPoint) -> Seen {
        let open = Seen { reach: Reach::Open, is_inward: false, inside: Vec::new() };
        let mut last = (0..self.surface.parts()).find(|&part| self.surface.is_of(part, taxel.link)).unwrap_or(0);
        if self.escapes(0, taxel, &mut last) {
            return open;
        }
        let (start, _) = self.start(0, taxel);
        let own: Vec<usize> = (0..self.surface.parts()).filter(|&part| self.surface.is_of(part, taxel.link)).collect();
        let is_inward = self.winding(0, &own, start, 1) < -INSIDE;
        let reach = match self.has_joints {
            true if (1..self.surface.poses()).any(|pose| self.escapes(pose, taxel, &mut last)) => Reach::Open,
            true => Reach::Hidden,
            false if self.is_hidden_at_rest(start, &own) => Reach::Hidden,
            false => Reach::CoveredAtRest,
        };
        Seen { reach, is_inward, inside: self.inside(taxel, start) }
    }

    /// Where rays start from `taxel`, and its normal, in the body.
    fn start(&self, pose: usize, taxel: &BodyPoint) -> (DVec3, DVec3) {
        self.surface.start(pose, self.body, taxel)
    }

    /// Whether any ray escapes; those along the normal first, as they mostly do.
    fn escapes(&self, pose: usize, taxel: &BodyPoint, last: &mut usize) -> bool {
        let (start, normal) = self.start(pose, taxel);
        let mut tried = [false; DIRECTIONS];
        for least in [0.8, 0.3, 0.0, -1.1] {
            for (direction, tried) in self.directions.iter().zip(&mut tried) {
                if *tried || direction.dot(normal) < least {
                    continue;
                }
                *tried = true;
                if self.surface.escapes(pose, start, *direction, last) {
                    return true;
                }
            }
        }
        false
    }

    fn is_hidden_at_rest(&self, start: DVec3, own: &[usize]) -> bool {
        let own_blocks = |&direction: &DVec3| own.iter().any(|&part| self.surface.is_hit(0, part, start, direction));
        if self.directions.iter().all(own_blocks) {
            return true;
        }
        let all: Vec<usize> = (0..self.surface.parts()).collect();
        self.winding(0, &all, start, 1) > INSIDE
    }

    /// The mean over every `step`th ray of ways out of `parts` less ways in: how often these wind around `start`.
    fn winding(&self, pose: usize, parts: &[usize], start: DVec3, step: usize) -> f64 {
        let crossings = |&direction: &DVec3| {
            parts.iter().map(|&part| self.surface.crossings(pose, part, start, direction)).sum::<i64>()
        };
        let rays = self.directions.iter().step_by(step);
        rays.clone().map(crossings).sum::<i64>() as f64 / rays.len() as f64
    }

    /// The links, neither the taxel's nor next to it, that the start is inside at rest and, with joints, outside in a pose.
    fn inside(&self, taxel: &BodyPoint, start: DVec3) -> Vec<usize> {
        let is_inside = |pose: usize, part: usize| {
            let start = if pose == 0 { start } else { self.start(pose, taxel).0 };
            self.winding(pose, &[part], start, COARSE) > INSIDE
        };
        let mut links = Vec::new();
        for part in 0..self.surface.parts() {
            let Some(link) = self.surface.rigid_link(part) else { continue };
            if self.is_next_to(link, taxel.link) || !is_inside(0, part) {
                continue;
            }
            if !self.has_joints || (1..self.surface.poses()).any(|pose| !is_inside(pose, part)) {
                links.push(link);
            }
        }
        links
    }

    /// Whether one of these links is above the other, with no other surface's link between them, or they are the same link.
    fn is_next_to(&self, one: usize, other: usize) -> bool {
        let above = |link: usize| {
            let ancestors = std::iter::successors(self.body.links[link].parent, |&up| self.body.links[up].parent);
            ancestors.into_iter().find(|&up| (0..self.surface.parts()).any(|part| self.surface.is_of(part, up)))
        };
        one == other || above(one) == Some(other) || above(other) == Some(one)
    }
}
