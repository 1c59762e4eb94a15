//! How far sensors go while they are pressed.

use super::at_rest::middle;

/// The values of a sensor that is being pressed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pressed {
    last: [f32; 2],
    pub(super) seen: usize,
    pub(super) low: f32,
    pub(super) high: f32,
}

impl Default for Pressed {
    fn default() -> Self {
        Self { last: [0.0; 2], seen: 0, low: f32::INFINITY, high: f32::NEG_INFINITY }
    }
}

impl Pressed {
    pub(super) fn see(&mut self, value: f32) {
        if self.seen >= 2 {
            let middle = middle(self.last[0], self.last[1], value);
            (self.low, self.high) = (self.low.min(middle), self.high.max(middle));
        }
        self.last = [self.last[1], value];
        self.seen += 1;
    }

    /// Whether it is nearer to `baseline` than to the end of its way of `travel` when the pressing ends.
    pub(super) fn came_back(&self, baseline: f64, travel: f64) -> bool {
        (f64::from(self.last[1]) - baseline).abs() < travel / 2.0
    }
}

/// How far a sensor went down and up from its baseline.
pub(super) fn travels(rest: &Option<(f64, f64)>, pressed: &Pressed) -> [f64; 2] {
    match rest {
        Some((baseline, _)) if pressed.seen > 2 => {
            [(baseline - f64::from(pressed.low)).max(0.0), (f64::from(pressed.high) - baseline).max(0.0)]
        }
        _ => [0.0; 2],
    }
}
