//! What the layer over the taxels makes of a contact: the table `[layer]`.

use serde::Deserialize;
use toml::Spanned;

use crate::error::Result;
use crate::keys::Text;

/// How a compliant layer passes a contact on to the taxels under it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LayerResponse {
    /// Standard deviation of the pressure below the layer under a point force, m.
    pub sigma_m: f64,
    /// Relative standard deviation of the taxels' gains, and of what the model of the layer is off by.
    pub gain_spread: f64,
}

impl LayerResponse {
    /// The assumed variation of gains, if none is given.
    pub const GAIN_SPREAD: f64 = 0.05;
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct LayerKeys {
    sigma_m: Spanned<f64>,
    gain_spread: Option<Spanned<f64>>,
}

impl LayerKeys {
    pub(super) fn read(&self, text: Text<'_>) -> Result<LayerResponse> {
        let wrong = |key: &str, value: &Spanned<f64>, must: &str| {
            Err(text.wrong(value.span(), format!("`{key}` is {}; it must be {must}", value.get_ref())))
        };
        let sigma_m = *self.sigma_m.get_ref();
        if !(sigma_m > 0.0 && sigma_m <= 1.0) {
            return wrong("sigma_m", &self.sigma_m, "over 0, and at most 1");
        }
        let gain_spread = match &self.gain_spread {
            Some(value) if !(0.0..=1.0).contains(value.get_ref()) => {
                return wrong("gain_spread", value, "between 0 and 1");
            }
            Some(value) => *value.get_ref(),
            None => LayerResponse::GAIN_SPREAD,
        };
        Ok(LayerResponse { sigma_m, gain_spread })
    }
}
