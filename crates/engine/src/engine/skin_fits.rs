//! What presses, fitted to touches of the whole body: [`crate::stage::fit`] in the chart of each touch.
//!
//! It starts from the raw values, in double precision on the CPU, whatever the backend; which taxels are one touch is the backend's to
//! say. All touches of a call are fitted together; then each is followed, frame after frame, for the velocity of its fit.

use std::collections::BTreeMap;

use glam::{DAffine3, DVec2, DVec3};

use crate::backend::RawBatch;
use crate::backend::cpu::fit::fit_each;
use crate::percept::{ContactKind, Percepts, TouchFit, TouchFlags, TouchFrame};
use crate::scene::{Around, Plan, REACH};
use crate::signal::{LayerResponse, RawValue};
use crate::stage::fit::{self, Fit, Layer, Pull, Taxel};
use crate::touch::{Skin, Trail, Unrolled};

/// Where the fits of touches were on the body at rest, by the touches' identities: what the velocities of the next fits depend on.
pub(super) type FitTrails = BTreeMap<u64, Trail>;

/// Touches of a call that wait to be fitted.
#[derive(Debug)]
pub(super) struct SkinFits {
    layer: Option<LayerResponse>,
    steps: usize,
    /// The time over which the velocity of a fit is measured, s; `None` where it is not asked for.
    velocity_over_s: Option<f64>,
    waiting: Vec<Waiting>,
    /// What became of touches in the call, in the order of its frames.
    events: Vec<Event>,
    trails: FitTrails,
    /// Memory: the taxels of a touch and those beside them.
    near: Vec<u32>,
}

#[derive(Debug)]
struct Waiting {
    /// The frame and the touch, as percepts count them.
    at: (usize, usize),
    unrolled: Unrolled,
    touch: fit::Touch,
    /// Takes the body at rest to where places are given: the link's frame, or the world.
    from_body: DAffine3,
}

/// What became of a touch in a frame.
#[derive(Clone, Copy, Debug)]
enum Event {
    /// It was there.
    Seen { t_s: f64, id: u64, begins_anew: bool, waiting: Option<usize> },
    /// It has ended.
    Ended { id: u64 },
}

/// A frame whose touches are taken.
#[derive(Clone, Copy)]
pub(super) struct Moment<'a> {
    /// Its place in the call's raw values.
    pub(super) offset: usize,
    pub(super) t_s: f64,
    /// Where links are in the world, if the frame says so.
    pub(super) poses: &'a [Option<DAffine3>],
}

impl SkinFits {
    pub(super) fn new(layer: Option<LayerResponse>, steps: usize, velocity_over_s: Option<f64>) -> Self {
        Self {
            layer,
            steps,
            velocity_over_s,
            waiting: Vec::new(),
            events: Vec::new(),
            trails: FitTrails::new(),
            near: Vec::new(),
        }
    }

    pub(super) fn state(&self) -> FitTrails {
        self.trails.clone()
    }

    pub(super) fn restore(&mut self, trails: &FitTrails) {
        self.trails.clone_from(trails);
    }

    /// Takes the touches of a frame of `raw`, which are `found`.
    pub(super) fn take(
        &mut self,
        (plan, skin): (&Plan, &Skin),
        raw: &RawBatch<'_>,
        moment: Moment<'_>,
        found: &mut TouchFrame,
    ) {
        let before = self.waiting.len();
        self.wait((plan, skin), raw, moment, found);
        if self.velocity_over_s.is_none() {
            return;
        }
        self.events.extend(found.released.iter().map(|&id| Event::Ended { id }));
        let mut waiting = (before..).zip(&self.waiting[before..]).peekable();
        for (index, touch) in found.touches.iter().enumerate() {
            let own = waiting.next_if(|(_, waiting)| waiting.at.1 == index).map(|(at, _)| at);
            let (id, begins_anew) = (touch.id, touch.begins_anew);
            self.events.push(Event::Seen { t_s: moment.t_s, id, begins_anew, waiting: own });
        }
    }

    /// Makes those of the touches `found` wait that can be fitted.
    fn wait(
        &mut self,
        (plan, skin): (&Plan, &Skin),
        raw: &RawBatch<'_>,
        Moment { offset, poses, .. }: Moment<'_>,
        found: &mut TouchFrame,
    ) {
        for index in 0..found.touches.len() {
            found.touches[index].place = Some(found.touches[index].position);
            let touch = &found.touches[index];
            if touch.flags.contains(TouchFlags::WRAPPED) {
                continue;
            }
            self.near.clear();
            for &node in found.taxels(touch) {
                self.near.push(node);
                self.near.extend_from_slice(skin.beside(node));
            }
            self.near.sort_unstable();
            self.near.dedup();
            let unrolled = skin.unrolled(touch.base, touch.link, self.near.iter().copied());
            let value = |node: u32| raw.rows.value(offset, node as usize);
            match self.fittable((plan, skin), &unrolled, found.taxels(touch), value) {
                Ok(ready) => self.waiting.push(Waiting {
                    at: (raw.first + offset, index),
                    unrolled,
                    touch: ready,
                    from_body: {
                        let world_from_link = poses.get(touch.link as usize).copied().flatten();
                        world_from_link.unwrap_or(DAffine3::IDENTITY) * skin.link_from_body(touch.link)
                    },
                }),
                Err(why) => found.touches[index].flags |= why,
            }
        }
    }

    /// The taxels `near` a touch that has the nodes `own` as fits take them, of those whose values can be used.
    fn fittable(
        &self,
        (plan, skin): (&Plan, &Skin),
        near: &Unrolled,
        own: &[u32],
        value: impl Fn(u32) -> RawValue,
    ) -> Result<fit::Touch, TouchFlags> {
        let LayerResponse { sigma_m, gain_spread } = self.layer.ok_or(TouchFlags::NO_LAYER)?;
        let Around { felt, longest_way_m } = plan.felt_around(skin, near, value);
        let of_touch = |(node, taxel): (u32, Taxel)| {
            if own.binary_search(&node).is_ok() { taxel } else { Taxel { pull: Pull::default(), ..taxel } }
        };
        let taxels: Vec<Taxel> = felt.into_iter().map(of_touch).collect();
        if taxels.iter().any(|taxel| taxel.area_m2 <= 0.0) {
            return Err(TouchFlags::NO_LAYER);
        }
        if !taxels.iter().any(|taxel| taxel.pressure > 0.0) {
            return Err(TouchFlags::FEW_TAXELS);
        }
        let reach_m = REACH * longest_way_m;
        Ok(fit::Touch::new(&taxels, &Layer { sigma_m, gain_spread, reach_m, steps: self.steps }))
    }

    /// Fits all that wait, and puts what comes of them into `percepts`.
    pub(super) fn finish(&mut self, skin: &Skin, percepts: &mut Percepts) {
        let touches: Vec<&fit::Touch> = self.waiting.iter().map(|waiting| &waiting.touch).collect();
        let fitted = fit_each(&touches, fit::Touch::conclude);
        let mut spots = Vec::with_capacity(fitted.len());
        for (waiting, (fit, flags)) in self.waiting.iter().zip(fitted) {
            let on_skin = fit.map(|fit| waiting.on_skin(skin, &fit));
            let place = fit.and_then(|fit| fit.blended);
            spots.push(on_skin.map(|(_, spot)| spot));
            let Some(touch) = percepts.touch_mut(waiting.at) else { continue };
            touch.flags |= flags;
            touch.fit = on_skin.map(|(fit, _)| fit);
            if let Some(place) = place {
                touch.place = Some(waiting.place_on_skin(skin, place.place));
                touch.place_sigma_m = place.sigma;
            }
        }
        if let Some(over_s) = self.velocity_over_s {
            self.follow(&spots, over_s, percepts);
        }
        self.waiting.clear();
        self.events.clear();
    }

    /// Follows the fits of the call, which are at `spots`, and puts their velocities over `over_s` into `percepts`. A touch that goes
    /// without a fit for longer than that is followed anew.
    fn follow(&mut self, spots: &[Option<Spot>], over_s: f64, percepts: &mut Percepts) {
        for event in &self.events {
            let (t_s, id, begins_anew, waiting) = match *event {
                Event::Seen { t_s, id, begins_anew, waiting } => (t_s, id, begins_anew, waiting),
                Event::Ended { id } => {
                    self.trails.remove(&id);
                    continue;
                }
            };
            let trail = self.trails.entry(id).or_default();
            if begins_anew {
                trail.clear();
            }
            let fitted = waiting.and_then(|at| Some((&self.waiting[at], spots[at]?)));
            let Some((waiting, spot)) = fitted else {
                if trail.is_broken(t_s, over_s) {
                    trail.clear();
                }
                continue;
            };
            let velocity = trail.follow(t_s, spot.place, over_s);
            let Some(touch) = percepts.touch_mut(waiting.at) else { continue };
            if velocity.is_none() && !touch.flags.contains(TouchFlags::YOUNG) {
                touch.flags |= TouchFlags::YOUNG_FIT;
            }
            if let Some(fit) = &mut touch.fit {
                fit.velocity = velocity.map(|velocity| {
                    // Along a line nothing can be felt.
                    let along = spot.line.map_or(DVec3::ZERO, |line| line * velocity.dot(line));
                    waiting.from_body.transform_vector3(velocity - along)
                });
            }
        }
    }
}

/// Where a fit is on the body at rest.
#[derive(Clone, Copy, Debug)]
struct Spot {
    place: DVec3,
    /// The direction of a line.
    line: Option<DVec3>,
}

impl Waiting {
    /// Where `place_m` of the touch's chart is.
    fn place_on_skin(&self, skin: &Skin, place_m: [f64; 2]) -> DVec3 {
        let (place, _) = self.unrolled.on_skin(skin, DVec2::from_array(place_m), None);
        self.from_body.transform_point3(place)
    }

    fn on_skin(&self, skin: &Skin, fit: &Fit) -> (TouchFit, Spot) {
        let (place, direction) = self.unrolled.on_skin(skin, DVec2::from_array(fit.place), fit.angle);
        let given = TouchFit {
            kind: fit.kind,
            place: self.from_body.transform_point3(place),
            force: fit.force,
            direction: direction.map(|direction| self.from_body.transform_vector3(direction)),
            angle_rad: fit.angle,
            width_m: fit.width,
            length_m: fit.length,
            velocity: None,
            sigma: fit.sigma,
        };
        (given, Spot { place, line: direction.filter(|_| fit.kind == ContactKind::Line) })
    }
}
