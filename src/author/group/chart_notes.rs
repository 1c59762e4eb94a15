//! Notes about charts, one line for all fields with the same problem.

use crate::field::NoChart;

/// A chart with more distortion is split, if requested, or reported.
pub(super) const POOR_DISTORTION: f64 = 0.25;

/// Problems with charts.
#[derive(Default)]
pub(super) struct ChartNotes {
    /// Fields that were split, into how many parts and why.
    pub(super) split: Vec<(String, usize, String)>,
    /// Fields without a chart, why, and whether others are below them.
    pub(super) bare: Vec<(String, NoChart, bool)>,
    /// Fields with distorted charts, and their distortion.
    pub(super) poor: Vec<(String, f64)>,
}

impl ChartNotes {
    pub(super) fn lines(&self) -> Vec<String> {
        let mut lines = self.of_split();
        lines.extend(self.of_bare());
        lines.extend(self.of_poor());
        lines
    }

    fn of_split(&self) -> Vec<String> {
        match &self.split[..] {
            [] => Vec::new(),
            [(name, parts, why)] => vec![format!("field `{name}` is split into {parts} parts: {why}")],
            [(first, _, why), ..] => {
                let each: Vec<String> =
                    self.split.iter().map(|(name, parts, _)| format!("`{name}` into {parts}")).collect();
                vec![format!("{} fields are split into parts: {}; `{first}`, as {why}", each.len(), each.join(", "))]
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
                (Kind::Links, _) => "; for a field on each link, write `each = \"link\"` in a recipe's [[fields]]",
                (Kind::Surface, _) => "",
                (_, true) => "; use the fields below it",
                _ => "; to split it, write `wrap = \"split\"` or `patches` in a recipe's [[fields]]",
            };
            let why = plain(why);
            if alike.len() == 1 {
                return Some(format!("field `{name}` has no chart, thus no orientation: {why}{advice}"));
            }
            let names: Vec<&str> = alike.iter().map(|one| &one.0[..]).collect();
            let names = names.join("`, `");
            Some(match of.0 {
                Kind::Wraps => {
                    let (count, advice) = (alike.len(), advice.replace(" it", " them"));
                    format!("{count} fields wrap around and have no chart, thus no orientation{advice}: `{names}`")
                }
                _ => format!("{} fields have no chart: `{names}`; `{name}`, as {why}{advice}", alike.len()),
            })
        };
        kinds.iter().filter_map(line).collect()
    }

    fn of_poor(&self) -> Option<String> {
        let worst = self.poor.iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
        let off = |share: f64| format!("{:.0} %", share * 100.0);
        let advice = "; for better ones write `wrap = \"split\"` or smaller `patches` in a recipe's [[fields]]";
        Some(match &self.poor[..] {
            [(name, most)] => format!("distances in the chart of field `{name}` are up to {} off{advice}", off(*most)),
            poor => {
                let names: Vec<&str> = poor.iter().map(|(name, _)| &name[..]).collect();
                let (count, worst) = (poor.len(), format!("{} in `{}`", off(worst.1), worst.0));
                let names = names.join("`, `");
                format!(
                    "distances in {count} charts are over {} off, up to {worst}{advice}: `{names}`",
                    off(POOR_DISTORTION)
                )
            }
        })
    }
}

/// Reasons that are reported together.
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

/// The advice for a refused field; `parts` is the number of parts of a split that works, if any up to `most` does.
pub(super) fn advice(why: &NoChart, parts: Option<usize>, is_parent: bool, most: usize) -> String {
    match (why, parts) {
        (NoChart::SeveralLinks(_), _) => "; for a field on each link, write `each = \"link\"`".into(),
        (_, Some(parts)) => format!("; to split it into {parts} parts that have one, write `wrap = \"split\"`"),
        _ if is_parent => "; ask for charts of the fields below it".into(),
        (NoChart::NoSurface, _) => String::new(),
        _ => format!("; no {most} parts or fewer have one: choose fewer taxels"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(bare: &[(&str, NoChart, bool)], poor: &[(&str, f64)]) -> Vec<String> {
        let bare = bare.iter().map(|(name, why, is_parent)| ((*name).to_owned(), why.clone(), *is_parent)).collect();
        let poor = poor.iter().map(|(name, off)| ((*name).to_owned(), *off)).collect();
        ChartNotes { split: Vec::new(), bare, poor }.lines()
    }

    #[test]
    fn a_line_on_charts_says_what_to_write() {
        let around = NoChart::CutLocus { taxel: 12, distance_m: 0.035, apart_rad: 2.9 };
        assert_eq!(
            lines(&[("limb", around.clone(), false)], &[]),
            [
                "field `limb` has no chart, thus no orientation: it goes all the way around a limb or a knob: two paths lead to \
              taxel 12, 35.0 mm away, one on each side; to split it, write `wrap = \"split\"` or `patches` in a recipe's \
              [[fields]]"
            ]
        );
        assert_eq!(
            lines(&[("arm", around, false), ("leg", NoChart::Wraps(2.0), false)], &[]),
            [
                "2 fields wrap around and have no chart, thus no orientation; to split them, write `wrap = \"split\"` or \
              `patches` in a recipe's [[fields]]: `arm`, `leg`"
            ]
        );
        assert_eq!(
            lines(&[("all", NoChart::SeveralLinks(3), true)], &[("palm", 0.3)]),
            [
                "field `all` has no chart, thus no orientation: its taxels sit on 3 links that move against each other; for \
                 a field on each link, write `each = \"link\"` in a recipe's [[fields]]",
                "distances in the chart of field `palm` are up to 30 % off; for better ones write `wrap = \"split\"` or \
                 smaller `patches` in a recipe's [[fields]]",
            ]
        );
        assert_eq!(
            lines(&[], &[("palm", 0.3), ("back", 0.4)]),
            [
                "distances in 2 charts are over 25 % off, up to 40 % in `back`; for better ones write `wrap = \"split\"` or \
              smaller `patches` in a recipe's [[fields]]: `palm`, `back`"
            ]
        );
    }
}
