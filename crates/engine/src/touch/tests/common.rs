//! What tests of touches share.

use std::f64::consts::TAU;
use std::sync::Arc;

use glam::DVec3;

use crate::percept::{TouchFrame, TouchOutputs};
use crate::touch::layouts::bent;
use crate::touch::{Input, Options, Skin, SkinParts, Touches};

/// Numbers in [0, 1), the same every time.
pub(super) struct Random(pub(super) u64);

impl Random {
    pub(super) fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    pub(super) fn below(&mut self, count: usize) -> usize {
        (self.next() * count as f64) as usize
    }

    pub(super) fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.next()).sum::<f64>() - 6.0
    }
}

/// A limb along +y: `columns` taxels around it.
pub(super) fn limb(columns: u32, rows: u32, pitch_m: f64) -> SkinParts {
    let radius_m = f64::from(columns) * pitch_m / TAU;
    bent(columns, rows, pitch_m, true, |x, y| {
        let (sin, cos) = (x / radius_m).sin_cos();
        (DVec3::new(radius_m * sin, y, radius_m * cos), DVec3::new(sin, 0.0, cos))
    })
}

pub(super) fn touches(parts: SkinParts) -> Touches {
    Touches::new(Arc::new(Skin::from_parts(parts)), everything())
}

/// The pressure of bumps at `centres` with this spread on each taxel.
pub(super) fn bumps(skin: &Skin, centres: &[(DVec3, f64)], spread_m: f64) -> Vec<f64> {
    let bump = |position: DVec3, &(centre, height): &(DVec3, f64)| {
        height * (-0.5 * position.distance_squared(centre) / (spread_m * spread_m)).exp()
    };
    let pressure = |position: DVec3| centres.iter().map(|centre| bump(position, centre)).sum::<f64>();
    // What is little is not felt.
    let felt = |pressure: f64| if pressure < 0.02 { 0.0 } else { pressure };
    skin.taxels().iter().map(|taxel| felt(pressure(taxel.position))).collect()
}

pub(super) fn step(touches: &mut Touches, t_s: f64, pressures: &[f64]) -> TouchFrame {
    let mut frame = TouchFrame::default();
    touches.step(Input::new(t_s, pressures), &mut frame);
    frame
}

/// How far two vectors of lines are apart, rad.
pub(super) fn between(a: DVec3, b: DVec3) -> f64 {
    a.cross(b).length().atan2(a.dot(b).abs())
}

/// Options that ask for all quantities.
pub(super) fn everything() -> Options {
    Options { outputs: TouchOutputs::all(), ..Options::default() }
}
