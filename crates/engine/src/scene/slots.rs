//! A plan's slots: the calibrated values of a frame. First every channel's pressure in each signal that a letter
//! needs, signal by signal; then every channel's change in each letter that is one.

use super::Plan;
use crate::error::Result;
use crate::signal::{Calibration, FsrSignal, Letter, Receptor, TaxelCalibration};
use crate::stage::layout;

impl Plan {
    /// The taxels of field `field` of the percepts, as indices into the body's.
    pub fn taxels_of(&self, field: usize) -> impl Iterator<Item = usize> + '_ {
        let (members, sensed) =
            self.fields.get(field).map_or((&[][..], &[][..]), |field| (self.members_of(field), &field.sensed[..]));
        let pressed = members.iter().map(|member| self.body_taxels[self.channel_of(member.slot as usize)]);
        pressed.chain(sensed.iter().map(|member| member.taxel))
    }

    /// Makes the taxels, slot by slot, and gives each
    /// letter's first slot.
    pub(super) fn lay_out_slots(&mut self, calibration: &Calibration) -> Result<Vec<u32>> {
        let mut signals: Vec<Option<FsrSignal>> = Vec::new();
        // Without a letter of pressures there are slots all the same, which nothing reads.
        let of_pressure = || self.letters.iter().filter(|letter| letter.receptor.is_of_pressure());
        let no_letter = Letter::default();
        let read: Vec<Letter> =
            of_pressure().chain(of_pressure().next().is_none().then_some(&no_letter)).copied().collect();
        for letter in &read {
            if !signals.contains(&letter.signal) {
                signals.push(letter.signal);
                for (channel, (of_taxel, &area)) in self.calibrations.iter().zip(&self.areas).enumerate() {
                    let onset = self.onset(channel);
                    let response = self.curves.response_of(calibration, of_taxel, letter.signal, onset)?;
                    self.taxels.push(taxel(of_taxel, area, response));
                }
            }
        }
        self.calibrated = self.taxels.len();
        let mut first_slots = Vec::with_capacity(self.letters.len());
        for letter in &self.letters {
            if !letter.receptor.is_of_pressure() {
                first_slots.push(0);
                continue;
            }
            let signal = signals.iter().position(|&signal| signal == letter.signal).unwrap_or_default();
            let pressures = signal * self.areas.len();
            if letter.receptor == Receptor::Sustained {
                first_slots.push(pressures as u32);
                continue;
            }
            first_slots.push(self.taxels.len() as u32);
            let dead_band = calibration.change.dead_band as f32;
            self.taxels.extend((pressures as u32..).zip(&self.areas).map(|(response, &area)| layout::Taxel {
                dead_band,
                p_max: f32::MAX,
                area: area as f32,
                response,
                ..layout::Taxel::default()
            }));
        }
        Ok(first_slots)
    }
}

fn taxel(calibration: &TaxelCalibration, area: f64, response: u32) -> layout::Taxel {
    layout::Taxel {
        baseline: calibration.baseline as f32,
        gain: calibration.gain as f32,
        dead_band: calibration.dead_band as f32,
        p_max: calibration.p_max as f32,
        raw_low: calibration.raw_range[0],
        raw_high: calibration.raw_range[1],
        area: area as f32,
        response,
    }
}
