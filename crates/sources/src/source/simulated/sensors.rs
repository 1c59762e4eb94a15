//! Builds the sensors from the file's `[sensor]`.

use toml::Spanned;

use super::file::{CalibrationKeys, OutputName, SensorKeys, SensorName};
use super::noise;
use super::sensor::{Fault, FsrOutput, Kind, Sensor};
use crate::error::Result;
use crate::keys::Text;
use crate::signal::FsrCircuit;

/// No frame has this number, so that gains are independent of all noise.
const GAINS_FRAME: u64 = u64::MAX;

/// The sensors that `keys` describe, for the taxels `ids`, ascending; `calibration` is what their calibration says instead.
pub(super) fn sensors(
    text: Text<'_>,
    keys: &SensorKeys,
    calibration: &CalibrationKeys,
    seed: u64,
    ids: &[u32],
) -> Result<Sensor> {
    let kind = kind(text, keys)?;
    let noise_sigma = keys.noise_sigma.as_ref().map_or(Ok(0.0), |sigma| text.not_negative("noise_sigma", sigma))?;
    let drift_per_minute =
        keys.drift_per_minute.as_ref().map_or(Ok(0.0), |drift| text.finite("drift_per_minute", drift))?;
    let gain_spread = keys.gain_spread.as_ref().map_or(Ok(0.0), |spread| text.not_negative("gain_spread", spread))?;
    let gain = |&id: &u32| match gain_spread > 0.0 {
        true => libm::exp(gain_spread * noise::normal(keys.gain_seed, GAINS_FRAME, id)),
        false => 1.0,
    };
    let threshold_newton =
        keys.threshold_newton.as_ref().map_or(Ok(0.0), |force| text.not_negative("threshold_newton", force))?;
    let dead_band = calibration.dead_band.as_ref().map(|band| text.not_negative("dead_band", band)).transpose()?;
    let mut faults = vec![None; ids.len()];
    let mut broken = |taxel: &Spanned<i64>, fault: Fault| {
        let id = *taxel.get_ref();
        let index = u32::try_from(id).ok().and_then(|id| ids.binary_search(&id).ok());
        let Some(index) = index else {
            return Err(text.wrong(taxel.span(), format!("the body has no pressure taxel {id}")));
        };
        match faults[index].replace(fault) {
            Some(_) => Err(text.wrong(taxel.span(), format!("taxel {id} is broken twice; choose one way"))),
            None => Ok(()),
        }
    };
    for taxel in &keys.dead {
        broken(taxel, Fault::Dead)?;
    }
    for stuck in &keys.stuck {
        broken(&stuck.taxel, Fault::Stuck(text.finite("at", &stuck.at)?))?;
    }
    for noisy in &keys.noisy {
        broken(&noisy.taxel, Fault::Noisy(text.not_negative("sigma", &noisy.sigma)?))?;
    }
    let gains = ids.iter().map(gain).collect();
    Ok(Sensor { kind, seed, noise_sigma, drift_per_minute, gains, threshold_newton, dead_band, faults })
}

fn kind(text: Text<'_>, keys: &SensorKeys) -> Result<Kind> {
    let why = "for this kind of sensor";
    let name = keys.kind.as_ref().map(|kind| *kind.get_ref()).unwrap_or_default();
    if name != SensorName::Fsr {
        text.refuse("wiper", keys.wiper.as_ref(), why)?;
        text.refuse("output", keys.output.as_ref(), why)?;
        text.refuse("full_scale_newton", keys.full_scale_newton.as_ref(), why)?;
    }
    if name != SensorName::Linear {
        text.refuse("offset", keys.offset.as_ref(), why)?;
        text.refuse("gain", keys.gain.as_ref(), why)?;
        text.refuse("bits", keys.bits.as_ref(), why)?;
        text.refuse("invert", keys.invert.as_ref(), why)?;
    }
    Ok(match name {
        SensorName::Ideal => Kind::Ideal,
        SensorName::Fsr => {
            let wiper = text.int("wiper", keys.wiper.as_ref(), 0..256)?;
            let circuit = wiper.map_or_else(FsrCircuit::default, |wiper| FsrCircuit { wiper: wiper as u8 });
            let output = keys.output.as_ref().map_or(OutputName::Counts, |output| *output.get_ref());
            if output != OutputName::Linearised {
                text.refuse("full_scale_newton", keys.full_scale_newton.as_ref(), "unless `output` is linearised")?;
            }
            let output = match output {
                OutputName::Counts => FsrOutput::Counts,
                OutputName::Logarithmic => FsrOutput::Logarithmic,
                OutputName::Linearised => FsrOutput::Linearised {
                    full_scale_newton: keys
                        .full_scale_newton
                        .as_ref()
                        .map_or(Ok(FsrCircuit::SATURATION_NEWTON), |full| text.positive("full_scale_newton", full))?,
                },
            };
            Kind::Fsr { circuit, output }
        }
        SensorName::Linear => {
            let gain = keys.gain.as_ref().map_or(Ok(1.0), |gain| text.positive("gain", gain))?;
            let inverted = keys.invert.as_ref().is_some_and(|invert| *invert.get_ref());
            Kind::Linear {
                offset: keys.offset.as_ref().map_or(Ok(0.0), |offset| text.finite("offset", offset))?,
                gain: if inverted { -gain } else { gain },
                bits: text.int("bits", keys.bits.as_ref(), 1..25)?,
            }
        }
    })
}
