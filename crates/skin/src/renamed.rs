//! Old names: an error about an old name gives the new one. `CHANGELOG.md` has the same table.

/// Old names and what they are now, flags without their `--`; `*` is the rest of a name. What one name stood for may be called by
/// several now: which of them is meant follows from what is known where it is given.
const RENAMED: [(&str, &str); 25] = [
    // Outputs, ways to an orientation, tables.
    ("axis", "principal_axis"),
    ("axis_sigma", "principal_axis_sigma"),
    ("contacts", "self_contacts"),
    ("footprint", "fit"),
    ("footprint-*", "fit-*"),
    ("footprint_*", "fit_*"),
    // What presses, of touches in place of fields.
    ("fit_*", "touches.fit_*"),
    ("fit_angle", "touches.fit_direction"),
    ("fit_displacement", "touches.fit_velocity"),
    ("fit_speed", "touches.fit_velocity"),
    ("fit_place_sigma", "touches.fit_sigmas"),
    ("fit_force_sigma", "touches.fit_sigmas"),
    ("fit_angle_sigma", "touches.fit_sigmas"),
    ("fit_width_sigma", "touches.fit_sigmas"),
    ("fit_length_sigma", "touches.fit_sigmas"),
    // Keys of scenes.
    ("force", "overwrite"),
    ("in", "relative_to"),
    ("speed", "playback_speed"),
    // Keys of calibrations, simulations and wirings.
    ("skin", "layer"),
    ("tap", "wiper"),
    ("taps", "wipers"),
    ("upkeep", "drift"),
    // Flags that are called otherwise than keys.
    ("in", "relative-to"),
    ("skin", "gains-from"),
    // A whole group of outputs.
    ("footprint", "touches.fit_*"),
];

/// What `old` is called now, if it was renamed, once or twice, and its new name is one of `known`, or stands for several of them.
#[must_use]
pub fn new_name<'k>(old: &str, known: impl IntoIterator<Item = &'k str>) -> Option<String> {
    let known: Vec<&str> = known.into_iter().collect();
    let is_known = |new: &String| match new.strip_suffix('*') {
        Some(group) => known.iter().any(|name| name.starts_with(group)),
        None => known.contains(&new.as_str()),
    };
    let once: Vec<String> = names_after(old).collect();
    let twice = once.iter().flat_map(|name| names_after(name));
    once.iter().cloned().chain(twice).find(is_known)
}

/// What `new` was called before, if that was otherwise: to read what was written then.
#[must_use]
pub fn old_name(new: &str) -> Option<String> {
    RENAMED.iter().find_map(|(was, now)| put(new, now, was))
}

/// What `old` may have been called next.
fn names_after(old: &str) -> impl Iterator<Item = String> {
    RENAMED.iter().filter_map(move |(was, now)| put(old, was, now))
}

/// `name` with `to` in the place of `from`, if it is called so.
fn put(name: &str, from: &str, to: &str) -> Option<String> {
    match (from.strip_suffix('*'), to.strip_suffix('*')) {
        (Some(from), Some(to)) => name.strip_prefix(from).map(|rest| format!("{to}{rest}")),
        _ => (name == from).then(|| to.to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_old_name_is_what_is_known_where_it_is_given() {
        let is = |old: &str, known: &[&'static str], new: Option<&str>| {
            assert_eq!(new_name(old, known.iter().copied()).as_deref(), new, "{old} among {known:?}");
        };
        is("skin", &["body", "layer"], Some("layer"));
        is("skin", &["body", "gains-from"], Some("gains-from"));
        // Not all that was called so is called otherwise.
        is("skin", &["body", "taxels"], None);
        is("footprint", &["fit-1", "fit"], Some("fit"));
        is("footprint", &["total", "touches.fit_place"], Some("touches.fit_*"));
        is("footprint_angle", &["total", "fit_angle"], Some("fit_angle"));
        is("footprint_*", &["total", "fit_angle"], Some("fit_*"));
        is("footprint_age", &["total", "fit_angle"], None);
        // What was renamed twice.
        let of_touches = ["total", "touches.fit_place", "touches.fit_direction", "touches.fit_sigmas"];
        is("fit_place", &of_touches, Some("touches.fit_place"));
        is("fit_angle", &of_touches, Some("touches.fit_direction"));
        is("fit_angle_sigma", &of_touches, Some("touches.fit_sigmas"));
        is("fit_*", &of_touches, Some("touches.fit_*"));
        is("footprint_place", &of_touches, Some("touches.fit_place"));
        is("footprint_angle", &of_touches, Some("touches.fit_direction"));
        is("footprint_*", &of_touches, Some("touches.fit_*"));
        is("fit_age", &of_touches, None);
        is("total", &["total"], None);
        assert_eq!((old_name("fit_angle").as_deref(), old_name("total")), (Some("footprint_angle"), None));
        assert_eq!(old_name("principal_axis").as_deref(), Some("axis"));
    }

    #[test]
    fn the_changelog_has_the_same_table() {
        let text = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../../CHANGELOG.md")).unwrap();
        let has = |cell: &str, name: &str| ["", "--"].iter().any(|dashes| cell.contains(&format!("`{dashes}{name}`")));
        for (was, now) in RENAMED {
            let is_row = |line: &str| matches!(line.split('|').collect::<Vec<_>>()[..], [_, old, new, ..] if has(old, was) && has(new, now));
            assert!(text.lines().any(is_row), "{was} → {now}");
        }
    }
}
