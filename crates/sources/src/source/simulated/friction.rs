//! Friction: how an indenter that moves along the skin pulls on it.
//!
//! It holds the skin, and the layer gives way like a spring. While they stick, a motion δ of the indenter in the tangent plane
//! and a turn θ about the normal add k·δ to the pull Q and κ·θ to the torsion M. k = 4/3·E*·a and κ = 4/3·E*·a³ are those of a
//! rigid disc on rubber (after Mindlin, and Reissner and Sagoci, with ν = 1/2); E* is the layer's `stiffness_pa`, a the radius of
//! the even disc whose second moment is the pressure's under the layer: a² = 2⟨r²⟩.
//!
//! Coulomb: a force F holds (‖Q‖/μF)² + (M/μFρ)² ≤ 1 with ρ = 2a/3, an even disc's. Beyond that both shrink in proportion until
//! it holds, and the indenter slips. When the normal turns, Q turns with the tangent plane. Without a force nothing is held.
//!
//! What a taxel feels: with fᵢ its normal force and rᵢ its offset from the middle, fᵢ(Q/F + ω n × rᵢ), ω = M·(Σf/F)/Σfr². So of
//! both the share is felt that is felt of F. On a curved skin it turns with the taxel's normal.

use glam::{DQuat, DVec3};

/// What an indenter holds the skin with.
#[derive(Clone, Copy, Debug)]
pub(super) struct Grip {
    /// F, over 0.
    pub(super) force_newton: f64,
    /// a
    pub(super) radius_m: f64,
    /// E*
    pub(super) stiffness_pa: f64,
}

/// Where an indenter is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Stand {
    pub(super) position: DVec3,
    pub(super) normal: DVec3,
    /// How far it is turned about the normal, rad, counter-clockwise from outside.
    pub(super) turned: f64,
}

/// What an indenter does to the skin along it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Pull {
    /// N, in the tangent plane.
    pub(super) newton: DVec3,
    /// N m about the normal, counter-clockwise from outside.
    pub(super) torsion: f64,
    pub(super) slips: bool,
}

/// The friction of an indenter on the skin.
#[derive(Clone, Debug)]
pub(super) struct Friction {
    /// μ
    coefficient: f64,
    held: Option<(Stand, Pull)>,
}

/// 4/3.
const OF_A_DISC: f64 = 4.0 / 3.0;

impl Friction {
    /// With the coefficient μ.
    pub(super) fn new(coefficient: f64) -> Self {
        Self { coefficient, held: None }
    }

    /// μ
    pub(super) fn coefficient(&self) -> f64 {
        self.coefficient
    }

    /// Lets go of the skin.
    pub(super) fn release(&mut self) {
        self.held = None;
    }

    /// Moves on to `stand`; the first after a release is where it takes hold.
    pub(super) fn move_to(&mut self, stand: Stand, grip: &Grip) -> Pull {
        let (before, pull) = self.held.unwrap_or((stand, Pull::default()));
        let along = |vector: DVec3| vector - stand.normal * vector.dot(stand.normal);
        let a = grip.radius_m;
        let spring = OF_A_DISC * grip.stiffness_pa * a;
        let carried = along(pull.newton).normalize_or_zero() * pull.newton.length();
        let mut pull = Pull {
            newton: carried + spring * along(stand.position - before.position),
            torsion: pull.torsion + spring * a * a * (stand.turned - before.turned),
            slips: false,
        };
        let most = self.coefficient * grip.force_newton;
        let over = (pull.newton.length() / most).hypot(pull.torsion / (most * (2.0 / 3.0) * a));
        if over > 1.0 {
            pull = Pull { newton: pull.newton / over, torsion: pull.torsion / over, slips: true };
        }
        self.held = Some((stand, pull));
        pull
    }
}

/// A taxel with three axes under a touch.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pulled {
    /// Index among the pressed taxels.
    pub(super) taxel: usize,
    /// From the middle of the contact.
    pub(super) offset: DVec3,
    /// fᵢ
    pub(super) force_newton: f64,
}

/// Adds what `pulled` feel of `pull` about `normal` to `felt`, by pressed taxel along its two tangents; `axes` has by taxel its
/// normal and these tangents.
pub(super) fn spread(
    pull: &Pull,
    normal: DVec3,
    force_newton: f64,
    pulled: &[Pulled],
    axes: impl Fn(usize) -> (DVec3, [DVec3; 2]),
    felt: &mut [[f64; 2]],
) {
    let offset = |taxel: &Pulled| taxel.offset - normal * taxel.offset.dot(normal);
    let sum: f64 = pulled.iter().map(|taxel| taxel.force_newton).sum();
    let second: f64 = pulled.iter().map(|taxel| taxel.force_newton * offset(taxel).length_squared()).sum();
    let turn = if second > 0.0 { pull.torsion * (sum / force_newton) / second } else { 0.0 };
    for taxel in pulled {
        let along = taxel.force_newton * (pull.newton / force_newton + turn * normal.cross(offset(taxel)));
        let (own_normal, tangents) = axes(taxel.taxel);
        let along = DQuat::from_rotation_arc(normal, own_normal) * along;
        for (felt, tangent) in felt[taxel.taxel].iter_mut().zip(tangents) {
            *felt += along.dot(tangent);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GRIP: Grip = Grip { force_newton: 4.0, radius_m: 0.008, stiffness_pa: 400e3 };

    fn at(x: f64, turned: f64) -> Stand {
        Stand { position: DVec3::new(x, 0.0, 0.0), normal: DVec3::Z, turned }
    }

    #[test]
    fn it_sticks_as_a_spring_and_slips_at_coulombs_limit() {
        let mut friction = Friction::new(0.6);
        let spring = 4.0 / 3.0 * 400e3 * 0.008;
        assert_eq!(friction.move_to(at(0.0, 0.0), &GRIP), Pull::default());
        let stuck = friction.move_to(at(1e-4, 0.0), &GRIP);
        assert!((stuck.newton.x - spring * 1e-4).abs() < 1e-12 && !stuck.slips);
        let slips = friction.move_to(at(1e-2, 0.0), &GRIP);
        assert!((slips.newton.x - 2.4).abs() < 1e-12 && slips.slips && slips.torsion == 0.0);
        // Back: it sticks again, and then slips the other way.
        let back = friction.move_to(at(1e-2 - 1e-4, 0.0), &GRIP);
        assert!((back.newton.x - (2.4 - spring * 1e-4)).abs() < 1e-12 && !back.slips);
        assert!((friction.move_to(at(0.0, 0.0), &GRIP).newton.x + 2.4).abs() < 1e-12);
        // What presses less holds less.
        let less = friction.move_to(at(0.0, 0.0), &Grip { force_newton: 2.0, ..GRIP });
        assert!((less.newton.x + 1.2).abs() < 1e-12 && less.slips);
        friction.release();
        assert_eq!(friction.move_to(at(1.0, 0.0), &GRIP), Pull::default());
    }

    #[test]
    fn a_turn_twists_by_its_sense_and_shares_the_limit_with_a_pull() {
        let most = 2.4 * 2.0 / 3.0 * 0.008;
        for sense in [1.0, -1.0] {
            let mut friction = Friction::new(0.6);
            friction.move_to(at(0.0, 0.0), &GRIP);
            let twisted = friction.move_to(at(0.0, sense * 0.01), &GRIP).torsion;
            assert!((twisted - sense * 4.0 / 3.0 * 400e3 * 0.008_f64.powi(3) * 0.01).abs() < 1e-12);
            assert!((friction.move_to(at(0.0, sense), &GRIP).torsion - sense * most).abs() < 1e-12);
            let both = friction.move_to(at(0.01, sense), &GRIP);
            let of_limit = (both.newton.length() / 2.4).hypot(both.torsion / most);
            assert!((of_limit - 1.0).abs() < 1e-12 && both.newton.x > 2.0, "{both:?}");
        }
    }

    #[test]
    fn a_pull_turns_with_the_tangent_plane() {
        let mut friction = Friction::new(0.6);
        friction.move_to(at(0.0, 0.0), &GRIP);
        let before = friction.move_to(at(1e-4, 0.0), &GRIP).newton;
        let tilted = Stand { normal: DVec3::new(0.6, 0.0, 0.8), ..at(1e-4, 0.0) };
        let after = friction.move_to(tilted, &GRIP).newton;
        assert!((after.length() - before.length()).abs() < 1e-12 && after.dot(tilted.normal).abs() < 1e-12);
    }

    #[test]
    fn taxels_feel_what_the_indenter_does_as_far_as_they_feel_its_force() {
        let pull = Pull { newton: DVec3::new(0.5, -1.0, 0.0), torsion: 0.01, slips: false };
        let places = [(-1.0, 0.0), (2.0, 0.5), (-1.0, -0.5), (0.0, 0.7)];
        let forces = [1.0, 0.5, 0.9, 0.6];
        let middle = DVec3::new(0.013, -0.002, 0.0);
        let pulled: Vec<Pulled> = places
            .iter()
            .zip(forces)
            .enumerate()
            .map(|(taxel, (&(x, y), force_newton))| Pulled {
                taxel,
                offset: 0.005 * DVec3::new(x, y, 0.1) - middle,
                force_newton,
            })
            .collect();
        let mut felt = [[0.0; 2]; 4];
        // They feel 3 of 4 N.
        let tangents = [DVec3::Y, DVec3::NEG_X];
        spread(&pull, DVec3::Z, 4.0, &pulled, |_| (DVec3::Z, tangents), &mut felt);
        let [mut sum, mut torsion, mut first] = [DVec3::ZERO, DVec3::ZERO, DVec3::ZERO];
        for (taxel, [t, v]) in pulled.iter().zip(felt) {
            let force = t * tangents[0] + v * tangents[1];
            sum += force;
            torsion += taxel.offset.cross(force);
            first += taxel.force_newton * taxel.offset;
        }
        // A twist about a middle that is not that of the forces pulls as well.
        let second: f64 = pulled.iter().map(|p| p.force_newton * p.offset.truncate().length_squared()).sum();
        let turn = 0.75 * pull.torsion / second;
        let right = 0.75 * pull.newton + turn * DVec3::Z.cross(DVec3::new(first.x, first.y, 0.0));
        assert!((sum - right).length() < 1e-12, "{sum} {right}");
        let of_pull = first.truncate().perp_dot(pull.newton.truncate() / 4.0);
        assert!((torsion.z - 0.75 * pull.torsion - of_pull).abs() < 1e-12, "{torsion}");
    }
}
