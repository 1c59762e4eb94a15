//! Paths to values within messages, such as `press_sensor_state[*].pressure`.

use std::fmt;
use std::str::FromStr;

use crate::error::{Error, Result, failed};

/// The most items that a range may name.
const MAX_ITEM: usize = 1 << 24;

/// A step into a message.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Step {
    /// A field by its name.
    Field(String),
    /// The items of an array from the first number to before the second one: `[2:5]`; `[2]` is one of them.
    Items(usize, usize),
    /// All items of an array, or of an object whose fields are called by whole numbers: `[*]`.
    All,
}

/// Where values are in a message: fields with `.` between them, `[*]` for all items of an array, `[3]` for one, `[2:5]` for some. `[*]` is
/// also for the fields of an object that are called by whole numbers, in the order of these.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ArrayPath(Vec<Step>);

impl ArrayPath {
    /// Its steps, from the message on.
    #[must_use]
    pub fn steps(&self) -> &[Step] {
        &self.0
    }

    /// The name of the last field.
    #[must_use]
    pub fn last_field(&self) -> &str {
        let fields =
            self.0.iter().rev().filter_map(|step| if let Step::Field(name) = step { Some(name) } else { None });
        fields.map(String::as_str).next().unwrap_or_default()
    }

    /// Whether `name`, such as `a.b[0].c[3]`, is a value at this path or within it.
    pub(in crate::source) fn leads_to(&self, name: &str) -> bool {
        self.place_of(name).is_some()
    }

    /// The numbers in `name` that `[*]` and ranges stand for, if it is a value at this path or within it: values are in their order.
    pub(in crate::source) fn place_of(&self, name: &str) -> Option<Vec<usize>> {
        let own: Self = name.parse().ok()?;
        let fits = |(wanted, step): (&Step, &Step)| match (wanted, step) {
            (Step::Field(wanted), Step::Field(name)) => (wanted == name).then_some(None),
            (Step::All, Step::Field(name)) => number_of(name).map(Some),
            (Step::All, Step::Items(at, _)) => Some(Some(*at)),
            (Step::Items(first, end), Step::Items(at, _)) => (*first..*end).contains(at).then_some(Some(*at)),
            _ => None,
        };
        let rest = own.0.get(self.0.len()..)?;
        let numbers: Vec<Option<usize>> = self.0.iter().zip(&own.0).map(fits).collect::<Option<_>>()?;
        rest.iter().all(|step| matches!(step, Step::Items(..))).then(|| numbers.into_iter().flatten().collect())
    }
}

/// The whole number that a field is called by, such as 2 of `2`.
pub(in crate::source) fn number_of(name: &str) -> Option<usize> {
    name.bytes().all(|byte| byte.is_ascii_digit()).then(|| name.parse().ok()).flatten()
}

/// The items that `text`, within brackets, names.
fn items(text: &str) -> Option<Step> {
    let number = |text: &str| text.trim().parse::<usize>().ok().filter(|number| *number < MAX_ITEM);
    match text.trim() {
        "*" | "" => Some(Step::All),
        text => match text.split_once(':') {
            Some((first, end)) => {
                let (first, end) = (number(first)?, number(end)?);
                (first < end).then_some(Step::Items(first, end))
            }
            None => number(text).map(|at| Step::Items(at, at + 1)),
        },
    }
}

impl FromStr for ArrayPath {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let bad = || {
            failed!(
                "`{text}` is not a path; write fields and items as a.b[*].c, [*] for all items, [0] or [2:5] for some"
            )
        };
        let mut steps = Vec::new();
        for part in text.trim().trim_start_matches("$.").split('.') {
            let (name, mut rest) = part.split_at(part.find('[').unwrap_or(part.len()));
            if name.trim().is_empty() && (rest.is_empty() || !steps.is_empty()) {
                return Err(bad());
            }
            if !name.trim().is_empty() {
                steps.push(Step::Field(name.trim().to_owned()));
            }
            while !rest.is_empty() {
                let (within, after) = rest.strip_prefix('[').and_then(|rest| rest.split_once(']')).ok_or_else(bad)?;
                steps.push(items(within).ok_or_else(bad)?);
                rest = after;
            }
        }
        Ok(Self(steps))
    }
}

impl fmt::Display for ArrayPath {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, step) in self.0.iter().enumerate() {
            match step {
                Step::Field(name) if index > 0 => write!(f, ".{name}")?,
                Step::Field(name) => f.write_str(name)?,
                Step::All => f.write_str("[*]")?,
                Step::Items(first, end) if first + 1 == *end => write!(f, "[{first}]")?,
                Step::Items(first, end) => write!(f, "[{first}:{end}]")?,
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_are_as_people_write_them() {
        for text in ["data", "a.b[*].c", "a[3].b[2:5]", "[*]", "rows[*][*]"] {
            assert_eq!(text.parse::<ArrayPath>().unwrap().to_string(), text);
        }
        assert_eq!("$.a.b[]".parse::<ArrayPath>().unwrap().to_string(), "a.b[*]");
        for wrong in ["", ".", "a..b", "a[", "a[x]", "a[5:2]", "a]b[", "a.", "a[-1]", "a[99999999999]"] {
            assert!(wrong.parse::<ArrayPath>().is_err(), "{wrong}");
        }
    }

    #[test]
    fn a_path_leads_to_the_values_within_it() {
        let path: ArrayPath = "pads[*].p".parse().unwrap();
        for name in ["pads[0].p[3]", "pads[7].p", "pads[0].p[1][2]"] {
            assert!(path.leads_to(name), "{name}");
        }
        for name in ["pads[0].q[3]", "pads[0]", "pads", "pads[0].p.x", "other[0].p"] {
            assert!(!path.leads_to(name), "{name}");
        }
        let some: ArrayPath = "a[1:3]".parse().unwrap();
        assert!(some.leads_to("a[2]") && !some.leads_to("a[3]") && !some.leads_to("a[0]"));
        let numbered: ArrayPath = "[*].force[*]".parse().unwrap();
        assert_eq!(numbered.place_of("12.force[3]"), Some(vec![12, 3]));
        assert!(["force[3]", "x.force[3]", "1x.force[3]", "12.count[3]"].iter().all(|name| !numbered.leads_to(name)));
    }
}
