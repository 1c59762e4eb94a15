//! Notes about charts, one line for all fields with the same problem.

use crate::field::NoChart;

/// A chart with more distortion is split, if requested, or reported.
pub(super) const POOR_DISTORTION: f64 = 0.25;

/// The same where no ways over the surface lead to all taxels. On the edges of a robot's boxes and on shells that do not meet charts have
/// about so much; split at less, a fifth of the taxels would be alone.
pub(super) const SPLIT_DISTORTION: f64 = 0.5;

const SPLIT: &str = "to split a field, write `wrap = \"split\"` or smaller `patches` in a recipe's [[fields]]";

const SMALLER: &str = "smaller `patches`, or `wrap = \"split\"`, in a recipe's [[fields]] make it less";

/// Fields that a note names.
const MAX_LISTED: usize = 6;

#[derive(Default)]
pub(super) struct ChartNotes {
    /// Fields that were split, into how many parts and why.
    pub(super) split: Vec<(String, usize, String)>,
    /// Fields without a chart, why, and whether others are below them.
    pub(super) bare: Vec<(String, NoChart, bool)>,
    pub(super) poor: Vec<(String, f64)>,
    /// Parts without a chart that are not split further.
    pub(super) few: Vec<String>,
}

impl ChartNotes {
    pub(super) fn lines(&self) -> Vec<String> {
        let mut lines = Vec::new();
        if !self.split.is_empty() {
            let why = reason(self.split.iter().map(|(name, _, why)| (name, why.clone())));
            let names = fields(self.split.iter().map(|(name, ..)| name));
            let parts: usize = self.split.iter().map(|(_, parts, _)| parts).sum();
            lines.push(format!("{names} split into {parts} parts: {why}"));
        }
        if !self.few.is_empty() {
            let names = fields(self.few.iter());
            lines.push(format!("{names} without a chart, so without orientation: too few taxels to split"));
        }
        let mut rest: Vec<&(String, NoChart, bool)> = self.bare.iter().collect();
        while let Some(&(_, why, is_parent)) = rest.first() {
            let kind = (Kind::from_reason(why), *is_parent);
            let (alike, others) = rest.into_iter().partition(|one| (Kind::from_reason(&one.1), one.2) == kind);
            let alike: Vec<&(String, NoChart, bool)> = alike;
            rest = others;
            let advice = match kind {
                (Kind::Links, _) => "; for a field on each link, write `each = \"link\"` in a recipe's [[fields]]",
                (Kind::Surface, _) => "",
                (_, true) => "; use the fields below it",
                _ => &format!("; {SPLIT}"),
            };
            let names = fields(alike.iter().map(|(name, ..)| name));
            let why = reason(alike.iter().map(|(name, why, _)| (name, plain(why))));
            lines.push(format!("{names} without a chart, so without orientation: {why}{advice}"));
        }
        if let Some((worst, most)) = self.poor.iter().max_by(|a, b| a.1.total_cmp(&b.1)) {
            let names = fields(self.poor.iter().map(|(name, _)| name));
            let most = most * 100.0;
            lines.push(format!(
                "{names} with a distorted chart, distances up to {most:.0} % off in `{worst}`; {SMALLER}"
            ));
        }
        lines
    }
}

/// The names of fields in a note.
fn fields<'a>(names: impl Iterator<Item = &'a String>) -> String {
    let names: Vec<String> = names.map(|name| format!("`{name}`")).collect();
    match &names[..] {
        [name] => format!("field {name}:"),
        names => match names.split_at_checked(MAX_LISTED) {
            Some((first, rest)) if !rest.is_empty() => {
                format!("fields {} and {} more:", first.join(", "), rest.len())
            }
            _ => format!("fields {}:", names.join(", ")),
        },
    }
}

/// Why fields are as they are: the reason of all, else of the first as an example.
fn reason<'a>(fields: impl Iterator<Item = (&'a String, String)>) -> String {
    let mut fields = fields.peekable();
    let Some((name, first)) = fields.next() else { return String::new() };
    if fields.all(|(_, why)| why == first) { first } else { format!("for example in `{name}` {first}") }
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
    fn from_reason(why: &NoChart) -> Self {
        match why {
            NoChart::SeveralLinks(_) => Self::Links,
            NoChart::NoSurface => Self::Surface,
            NoChart::Wraps(_)
            | NoChart::Turns(_)
            | NoChart::CutLocus { .. }
            | NoChart::Torn(..)
            | NoChart::Bent(..) => Self::Wraps,
            _ => Self::Other,
        }
    }
}

/// The note of `count` fields whose surface was too fine to measure all ways on it.
pub(super) fn bounded(count: usize) -> String {
    format!(
        "{} no geodesic chart, as the surface is too fine, or its triangles too thin, to measure all ways on it; simplify the mesh, or \
         for a robot try --geometry collision",
        if count == 1 { "1 field has".to_owned() } else { format!("{count} fields have") }
    )
}

/// `why` without its own advice.
pub(super) fn plain(why: &NoChart) -> String {
    why.to_string().trim_end_matches("; split it").to_owned()
}

/// The advice for a refused field; `parts` is the number of parts of a split that works, if any up to `most` does.
pub(super) fn advice(why: &NoChart, parts: Option<usize>, is_parent: bool, most: usize) -> String {
    match (why, parts) {
        (NoChart::SeveralLinks(_), _) => "; for a field on each link, write `each = \"link\"`".into(),
        (_, Some(parts)) => format!("; to split it into {parts} parts that have one, write `wrap = \"split\"`"),
        _ if is_parent => "; request charts of the fields below it".into(),
        (NoChart::NoSurface, _) => String::new(),
        _ => format!("; no {most} parts or fewer have one: choose fewer taxels"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_on_charts_says_what_to_write() {
        let around = NoChart::CutLocus { taxel: 12, distance_m: 0.035 };
        let other = NoChart::CutLocus { taxel: 20, distance_m: 0.05 };
        let bare = [("limb", around.clone(), false), ("arm", other, false), ("all", NoChart::SeveralLinks(3), true)];
        let bare = bare.map(|(name, why, is_parent)| (name.to_owned(), why, is_parent)).to_vec();
        let few = vec!["leg/front_1".to_owned()];
        let poor = vec![("palm".to_owned(), 0.3), ("back".to_owned(), 0.4)];
        let split = [("leg", 2, "it wraps"), ("foot", 3, "it is bent")];
        let split = split.map(|(name, parts, why)| (name.to_owned(), parts, why.to_owned())).to_vec();
        let alike = ChartNotes { split: vec![split[0].clone(); 2], ..ChartNotes::default() };
        assert_eq!(alike.lines(), ["fields `leg`, `leg`: split into 4 parts: it wraps"]);
        assert_eq!(
            ChartNotes { split, bare, poor, few }.lines(),
            [
                "fields `leg`, `foot`: split into 5 parts: for example in `leg` it wraps",
                "field `leg/front_1`: without a chart, so without orientation: too few taxels to split",
                "fields `limb`, `arm`: without a chart, so without orientation: for example in `limb` it goes all the way around: \
                 two paths of 35.0 mm lead to taxel 12; to split a field, write `wrap = \"split\"` or smaller `patches` in a recipe's [[fields]]",
                "field `all`: without a chart, so without orientation: its taxels sit on 3 links that move against each \
                 other; for a field on each link, write `each = \"link\"` in a recipe's [[fields]]",
                "fields `palm`, `back`: with a distorted chart, distances up to 40 % off in `back`; smaller \
                 `patches`, or `wrap = \"split\"`, in a recipe's [[fields]] make it less",
            ]
        );
    }
}
