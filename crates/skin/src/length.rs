//! Lengths as people write them: `8 mm`, `0.5mm`, `2cm`.

/// A number with a unit, or without.
#[derive(Clone, Copy)]
pub struct Length {
    pub number: f64,
    /// Metres to one of the unit.
    pub unit_m: Option<f64>,
}

/// Units of length, each with its metres.
const UNITS: [(&str, f64); 5] = [("um", 1e-6), ("µm", 1e-6), ("mm", 1e-3), ("cm", 1e-2), ("m", 1.0)];

impl Length {
    /// `None` where there is nothing.
    pub fn parse(text: &str) -> Result<Option<Self>, String> {
        if text.is_empty() {
            return Ok(None);
        }
        let found = UNITS.iter().find_map(|&(unit, metres)| Some((text.strip_suffix(unit)?, metres)));
        let (number, unit_m) = found.map_or((text, None), |(number, metres)| (number, Some(metres)));
        let number = number.trim_end().parse().map_err(|_| format!("`{text}` is not a length"))?;
        Ok(Some(Self { number, unit_m }))
    }
}

/// The metres to one of the unit called `name`.
pub fn unit(name: &str) -> Option<f64> {
    UNITS.iter().find(|(unit, _)| *unit == name).map(|(_, metres)| *metres)
}
