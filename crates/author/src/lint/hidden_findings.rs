//! Findings about taxels that nothing can touch.

use std::collections::BTreeMap;

use super::drawn_poses::DrawnPoses;
use super::finding::{Finding, FindingKind, LinkShare};
use super::hidden::{Hidden, Reach, find};
use crate::body::{Body, listed};

/// Runs of ids of a link in a line.
const MAX_RUNS: usize = 6;

/// Findings on hidden taxels of `body`, in the poses of its joints if there are any. `progress` gets the share that is done.
pub(super) fn hidden(body: &Body, poses: Option<&DrawnPoses>, progress: &mut dyn FnMut(f64)) -> Vec<Finding> {
    let seen = find(body, poses, progress);
    let with_reach =
        |reach: Reach| seen.checked.iter().filter(|(_, own)| *own == reach).map(|(index, _)| *index).collect();
    let where_looked = match seen.other_poses {
        Some(poses) => format!(" at rest and in {poses} other poses"),
        None => String::new(),
    };
    let mut findings = Vec::new();
    let hidden: Vec<usize> = with_reach(Reach::Hidden);
    let what = format!("hidden, where nothing can touch them{where_looked}");
    findings.extend(finding(body, &seen, FindingKind::HiddenTaxel, &hidden, &what));
    let covered: Vec<usize> = with_reach(Reach::CoveredAtRest);
    let what = "covered at rest by another link, so that only another pose can uncover them";
    findings.extend(finding(body, &seen, FindingKind::CoveredAtRest, &covered, what));
    let what = "on faces that point into their own link";
    findings.extend(finding(body, &seen, FindingKind::InwardFaces, &seen.inward, what));
    findings.extend(runs_into(body, &seen));
    findings
}

/// `ids` as runs: `0–499, 1000`.
fn runs(ids: &[u32]) -> String {
    let mut runs: Vec<(u32, u32)> = Vec::new();
    for &id in ids {
        match runs.last_mut() {
            Some((_, last)) if *last + 1 == id => *last = id,
            _ => runs.push((id, id)),
        }
    }
    let run = |&(first, last): &(u32, u32)| if first == last { first.to_string() } else { format!("{first}–{last}") };
    let shown: Vec<String> = runs.iter().take(MAX_RUNS).map(run).collect();
    match runs.get(MAX_RUNS..) {
        Some(more) if !more.is_empty() => {
            let more: u64 = more.iter().map(|(first, last)| u64::from(last - first) + 1).sum();
            format!("{} and {more} more", shown.join(", "))
        }
        _ => shown.join(", "),
    }
}

/// The finding on the taxels with the indices `taxels`, if there are any.
fn finding(body: &Body, seen: &Hidden, kind: FindingKind, taxels: &[usize], what: &str) -> Option<Finding> {
    if taxels.is_empty() {
        return None;
    }
    let mut all: BTreeMap<usize, usize> = BTreeMap::new();
    seen.checked.iter().for_each(|(index, _)| *all.entry(body.taxels[*index].link).or_default() += 1);
    let mut by_link: BTreeMap<usize, Vec<u32>> = BTreeMap::new();
    taxels.iter().for_each(|&index| by_link.entry(body.taxels[index].link).or_default().push(body.taxels[index].id));
    let mut links: Vec<(usize, Vec<u32>)> = by_link.into_iter().collect();
    links.sort_by_key(|(link, ids)| (std::cmp::Reverse(ids.len()), *link));
    let name = |link: usize| body.links[link].name.as_str();
    let lines: Vec<String> = links
        .iter()
        .map(|(link, ids)| format!("{} of {} on `{}` ({})", ids.len(), all[link], name(*link), runs(ids)))
        .collect();
    let area = |indices: &mut dyn Iterator<Item = usize>| indices.map(|index| body.taxels[index].area).sum::<f64>();
    let whole = area(&mut seen.checked.iter().map(|(index, _)| *index));
    let share = match area(&mut taxels.iter().copied()) / whole {
        share if share.is_finite() => share,
        _ => taxels.len() as f64 / seen.checked.len() as f64,
    };
    let looked = match seen.checked.len() == body.taxels.len() {
        true => String::new(),
        false => format!(" that were looked at, of {}", body.taxels.len()),
    };
    let is = if taxels.len() == 1 { "is" } else { "are" };
    let what = format!(
        "{} of {} taxels{looked} {is} {what}: {}; {} % of the skin",
        taxels.len(),
        seen.checked.len(),
        listed(&lines),
        percent(share),
    );
    let share_of = |(link, ids): &(usize, Vec<u32>)| LinkShare {
        link: name(*link).to_owned(),
        taxels: ids.clone(),
        of: all[link],
    };
    let mut ids: Vec<u32> = taxels.iter().map(|&index| body.taxels[index].id).collect();
    ids.sort_unstable();
    let place = Some(format!("link `{}`", name(links[0].0)));
    let links = links.iter().map(share_of).collect();
    Some(Finding { worst: Some(share), place, links, ..Finding::of_taxels(kind, ids, what) })
}

fn percent(share: f64) -> String {
    let percent = 100.0 * share;
    if percent < 1.0 { format!("{percent:.1}") } else { format!("{percent:.0}") }
}

/// Links that are inside others at rest.
fn runs_into(body: &Body, seen: &Hidden) -> Option<Finding> {
    if seen.runs_into.is_empty() {
        return None;
    }
    let name = |link: usize| body.links[link].name.as_str();
    let pairs: Vec<String> = seen
        .runs_into
        .iter()
        .map(|runs| {
            let (link, into) = (name(runs.link), name(runs.into));
            format!("`{link}` into `{into}` ({} of its taxels inside)", runs.taxels.len())
        })
        .collect();
    let mut what = format!("at rest the body runs into itself: {}", listed(&pairs));
    if seen.other_poses.is_none() {
        what += ", so that whether taxels are hidden there is not sure";
    }
    let outside = |link: &crate::body::Link| {
        let joint = link.joint.as_ref().filter(|joint| joint.mimic.is_none())?;
        let [least, greatest] = joint.limits?;
        (least > 0.0 || greatest < 0.0).then(|| format!("`{}`", joint.name))
    };
    let outside: Vec<String> = body.links.iter().filter_map(outside).collect();
    if !outside.is_empty() {
        what += &format!("; position 0 is outside the limits of joint {}", listed(&outside));
    }
    let mut ids: Vec<u32> = seen.runs_into.iter().flat_map(|runs| runs.taxels.iter().copied()).collect();
    ids.sort_unstable();
    ids.dedup();
    let place = Some(format!("link `{}`", name(seen.runs_into[0].link)));
    Some(Finding { place, ..Finding::of_taxels(FindingKind::RestRunsIntoItself, ids, what) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ids_are_listed_as_runs() {
        assert_eq!(runs(&[1, 2, 3, 7, 9, 10]), "1–3, 7, 9–10");
        let odd: Vec<u32> = (0..20).map(|i| 2 * i).collect();
        assert_eq!(runs(&odd), "0, 2, 4, 6, 8, 10 and 14 more");
    }
}
