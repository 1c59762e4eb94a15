//! What is told of charts: one line for all fields that a thing is true of, so that a body of many links stays readable.

use super::charts::POOR;
use crate::field::NoChart;

/// What there is to tell.
#[derive(Default)]
pub(super) struct Words {
    /// Fields that were split, into how many parts and why.
    pub(super) split: Vec<(String, usize, String)>,
    /// Fields without a chart, why, and whether others are below them.
    pub(super) bare: Vec<(String, NoChart, bool)>,
    /// Fields whose charts are far from true, and how far.
    pub(super) poor: Vec<(String, f64)>,
}

impl Words {
    pub(super) fn lines(&self) -> Vec<String> {
        let mut lines = self.of_split();
        lines.extend(self.of_bare());
        lines.extend(self.of_poor());
        lines
    }

    fn of_split(&self) -> Vec<String> {
        match &self.split[..] {
            [] => Vec::new(),
            [(name, parts, why)] => vec![format!("field `{name}` is split into {parts}: {why}")],
            [(first, _, why), ..] => {
                let each: Vec<String> =
                    self.split.iter().map(|(name, parts, _)| format!("`{name}` into {parts}")).collect();
                vec![format!("{} fields are split: {}; `{first}` because {why}", each.len(), each.join(", "))]
            }
        }
    }

    /// A line for each kind of reason.
    fn of_bare(&self) -> Vec<String> {
        let mut kinds = Vec::new();
        for (_, why, is_parent) in &self.bare {
            let kind = (Kind::of(why), *is_parent);
            if !kinds.contains(&kind) {
                kinds.push(kind);
            }
        }
        let line = |of: &(Kind, bool)| {
            let alike: Vec<_> = self.bare.iter().filter(|one| (Kind::of(&one.1), one.2) == *of).collect();
            let (name, why, _) = alike.first()?;
            let advice = match of {
                (Kind::Links, _) => "; one field for each of them (`each = \"link\"`) may have one",
                (Kind::Surface, _) => "",
                (_, true) => "; fields below it may have",
                _ => "; in a recipe's [[fields]], `patches` or `wrap = \"split\"` give some that have",
            };
            let why = plain(why);
            if alike.len() == 1 {
                return Some(format!("field `{name}` has no chart: {why}{advice}"));
            }
            let names: Vec<&str> = alike.iter().map(|one| &one.0[..]).collect();
            let names = names.join("`, `");
            Some(match of.0 {
                Kind::Wraps => {
                    format!("{} fields go around something and have no chart{advice}: `{names}`", alike.len())
                }
                _ => format!("{} fields have no chart: `{names}`; `{name}` because {why}{advice}", alike.len()),
            })
        };
        kinds.iter().filter_map(line).collect()
    }

    fn of_poor(&self) -> Option<String> {
        let worst = self.poor.iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
        let off = |share: f64| format!("{:.0} %", share * 100.0);
        let advice = "; `wrap = \"split\"` or smaller `patches` give truer ones";
        Some(match &self.poor[..] {
            [(name, most)] => format!("the chart of field `{name}` is up to {} off{advice}", off(*most)),
            poor => {
                let names: Vec<&str> = poor.iter().map(|(name, _)| &name[..]).collect();
                let worst = format!("that of `{}` up to {}", worst.0, off(worst.1));
                format!("{} charts are over {} off, {worst}{advice}: `{}`", poor.len(), off(POOR), names.join("`, `"))
            }
        })
    }
}

/// Reasons that are one to a person.
#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Links,
    Surface,
    Wraps,
    Other,
}

impl Kind {
    fn of(why: &NoChart) -> Self {
        match why {
            NoChart::SeveralLinks(_) => Self::Links,
            NoChart::NoSurface => Self::Surface,
            NoChart::Wraps(_) | NoChart::CutLocus { .. } | NoChart::Torn(..) | NoChart::Bent(..) => Self::Wraps,
            _ => Self::Other,
        }
    }
}

/// `why` without its own advice.
pub(super) fn plain(why: &NoChart) -> String {
    let why = why.to_string();
    why.strip_suffix("; split it").map(str::to_owned).unwrap_or(why)
}

/// What to do about a field that is refused; `parts` is how many would have what it asks for, if any up to `most` have.
pub(super) fn advice(why: &NoChart, parts: Option<usize>, is_parent: bool, most: usize) -> String {
    match (why, parts) {
        (NoChart::SeveralLinks(_), _) => "; one field for each of them (`each = \"link\"`) may have".into(),
        (_, Some(parts)) => format!("; {parts} parts would have (`wrap = \"split\"`)"),
        _ if is_parent => "; fields below it may have".into(),
        (NoChart::NoSurface, _) => String::new(),
        _ => format!("; no split into {most} or fewer has"),
    }
}
