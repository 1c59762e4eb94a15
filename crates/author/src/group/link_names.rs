//! What fields of links are called: as the links, without the prefixes of the tools that made them.

use std::collections::BTreeMap;

use crate::body::Body;

/// The prefix of Mixamo's skeletons; some exporters leave out its colon.
const MIXAMO: &str = "mixamorig";

/// Per link of `body` the name of its field.
pub(super) fn link_names(body: &Body) -> Vec<String> {
    shortened(&body.links.iter().map(|link| link.name.as_str()).collect::<Vec<_>>())
}

/// `names` without prefixes; those that would be the same without stay as they are.
fn shortened(names: &[&str]) -> Vec<String> {
    let mut uses: BTreeMap<&str, usize> = BTreeMap::new();
    names.iter().for_each(|name| *uses.entry(without_prefix(name)).or_insert(0) += 1);
    let shown = |&name: &&str| {
        let short = without_prefix(name);
        let shown = if uses[short] == 1 { short } else { name };
        // A slash would add a level.
        shown.replace('/', "_")
    };
    names.iter().map(shown).collect()
}

/// `name` without its namespace, such as `mixamorig:`.
fn without_prefix(name: &str) -> &str {
    let bare = name.rsplit(':').next().unwrap_or(name);
    let own = bare.strip_prefix(MIXAMO).map(|rest| rest.trim_start_matches(|c: char| c.is_ascii_digit() || c == '_'));
    let own = own.unwrap_or(bare);
    if own.trim().is_empty() { name } else { own }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prefixes_go_where_names_stay_apart() {
        let names = ["mixamorig:LeftArm", "mixamorig1:Hips", "mixamorigHead", "mixamorig_Neck", "torso", "a/b", "rig:"];
        assert_eq!(shortened(&names), ["LeftArm", "Hips", "Head", "Neck", "torso", "a_b", "rig:"]);
        assert_eq!(shortened(&["one:hand", "two:hand", "one:arm"]), ["one:hand", "two:hand", "arm"]);
        assert_eq!(shortened(&["mixamorig"]), ["mixamorig"]);
    }
}
