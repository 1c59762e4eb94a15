//! Letters: what of a kind of taxel is felt, such as the pressure itself or its change; pressures in one of the paper's two signals.

use std::fmt;
use std::str::FromStr;

use serde::Serialize;

use super::FsrSignal;
use crate::body::Modality;
use crate::error::{Error, Result, nearest};

/// What of its taxels a letter is made of. Each is for the taxels of one kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Receptor {
    /// P itself, like slowly adapting Merkel discs.
    #[default]
    Sustained,
    /// |P(t) − P(t − Δt)| / Δt, P per second, like rapidly adapting Meissner corpuscles. Both pressures use the present
    /// calibration.
    Change,
    /// The tangential forces of taxels with three axes.
    Shear,
    /// Temperatures.
    Temperature,
    /// Distances of what comes near.
    Proximity,
}

impl Receptor {
    /// The receptors' names, as the command line and NDJSON spell them.
    pub const NAMES: [(&'static str, Self); 5] = [
        ("sustained", Self::Sustained),
        ("change", Self::Change),
        ("shear", Self::Shear),
        ("temperature", Self::Temperature),
        ("proximity", Self::Proximity),
    ];

    /// Those that the host makes: the ones that are not of pressure.
    pub const OF_HOST: [Self; 3] = [Self::Shear, Self::Temperature, Self::Proximity];

    /// Whether it is made of pressures, which backends compute; the others are the host's, in double precision on every backend.
    #[must_use]
    pub fn is_of_pressure(self) -> bool {
        matches!(self, Self::Sustained | Self::Change)
    }

    /// Whether it is made of taxels of this kind.
    #[must_use]
    pub fn reads(self, modality: Modality) -> bool {
        match self {
            Self::Sustained | Self::Change => modality.is_pressed(),
            Self::Shear => modality == Modality::Force3,
            Self::Temperature => modality == Modality::Temperature,
            Self::Proximity => modality == Modality::Proximity,
        }
    }
}

impl fmt::Display for Receptor {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.serialize(f)
    }
}

impl FromStr for Receptor {
    type Err = Error;

    fn from_str(name: &str) -> Result<Self> {
        let found = Self::NAMES.into_iter().find(|(known, _)| *known == name);
        found.map(|(_, receptor)| receptor).ok_or_else(|| {
            let hint = match nearest(name, Self::NAMES.map(|(known, _)| known)) {
                Some(near) => format!("did you mean `{near}`?"),
                None => format!("there are {}", Self::NAMES.map(|(known, _)| known).join(", ")),
            };
            Error::usage(format!("there is no letter `{name}`; {hint}"))
        })
    }
}

/// A letter: every field is computed once for each letter of a scene.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Letter {
    /// The quantity.
    #[serde(rename = "letter")]
    pub receptor: Receptor,
    /// The signal of sensors in the paper's circuit; by default that of the calibration.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub signal: Option<FsrSignal>,
}

impl Letter {
    /// Every receptor with every signal, receptor by receptor; with the calibration's own signal where `signals` is empty. What is not
    /// made of pressures has no signal.
    #[must_use]
    pub fn all_of(receptors: &[Receptor], signals: &[FsrSignal]) -> Vec<Self> {
        let signals: Vec<Option<FsrSignal>> =
            if signals.is_empty() { vec![None] } else { signals.iter().copied().map(Some).collect() };
        let with = |&receptor: &Receptor| {
            let own = if receptor.is_of_pressure() { &signals[..] } else { &[None] };
            own.iter().map(move |&signal| Self { receptor, signal })
        };
        receptors.iter().flat_map(with).collect()
    }

    /// Checks that each letter is there once.
    #[doc(hidden)]
    pub fn check(letters: &[Self]) -> Result<()> {
        match letters.iter().enumerate().find(|(index, letter)| letters[..*index].contains(letter)) {
            Some((_, twice)) => {
                let signal = twice.signal.map_or(String::new(), |signal| format!(" of signal `{signal}`"));
                Err(Error::usage(format!("letter `{}`{signal} is asked for twice; once is enough", twice.receptor)))
            }
            None => Ok(()),
        }
    }

    /// Its label among a run's letters: the receptor unless all are sustained, the signal if there are several.
    #[must_use]
    pub fn mark(self, among: &[Self]) -> Mark {
        let sustained = among.iter().all(|letter| letter.receptor == Receptor::Sustained);
        let alike = among.iter().all(|letter| letter.signal == self.signal);
        Mark { receptor: (!sustained).then_some(self.receptor), signal: self.signal.filter(|_| !alike) }
    }
}

/// The label of a letter among those of a run; empty for the default.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Mark {
    /// Its receptor.
    pub receptor: Option<Receptor>,
    /// Its signal.
    pub signal: Option<FsrSignal>,
}

impl fmt::Display for Mark {
    /// For people, after a field's name: ` · change · raw`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(receptor) = self.receptor {
            write!(f, " · {receptor}")?;
        }
        if let Some(signal) = self.signal {
            write!(f, " · {signal}")?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_letter_says_of_itself_what_is_not_usual() {
        let marks = |letters: &[Letter]| -> Vec<String> {
            letters.iter().map(|letter| letter.mark(letters).to_string()).collect()
        };
        let both = [Receptor::Sustained, Receptor::Change];
        assert_eq!(marks(&[Letter::default()]), [""]);
        assert_eq!(marks(&Letter::all_of(&[Receptor::Change], &[])), [" · change"]);
        assert_eq!(marks(&Letter::all_of(&both, &[])), [" · sustained", " · change"]);
        assert_eq!(marks(&Letter::all_of(&both[..1], &[FsrSignal::Raw])), [""]);
        assert_eq!(marks(&Letter::all_of(&both[..1], &[FsrSignal::Raw, FsrSignal::Linear])), [" · raw", " · linear"]);
        let all = marks(&Letter::all_of(&both, &[FsrSignal::Raw, FsrSignal::Linear]));
        assert_eq!(all[1..3], [" · sustained · linear", " · change · raw"]);
    }

    #[test]
    fn a_receptor_is_read_by_its_name() {
        for (name, receptor) in Receptor::NAMES {
            assert_eq!((name.parse::<Receptor>().unwrap(), receptor.to_string().as_str()), (receptor, name));
        }
        let why = |name: &str| name.parse::<Receptor>().unwrap_err().to_string();
        assert!(why("chnage").ends_with("did you mean `change`?"), "{}", why("chnage"));
        assert!(why("pain").contains("there are sustained, change, shear"), "{}", why("pain"));
    }
}
