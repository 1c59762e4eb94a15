//! How limbs on other computers are named. `limbs_network` has them on a network.

use super::fails;

#[cfg(not(feature = "zenoh"))]
#[test]
fn a_build_without_it_says_how_to_get_it() {
    somatic_testing::skip("ZENOH", "built without the feature `zenoh`: cargo test --features zenoh --test cli limbs");
    for arguments in [["--sink", "zenoh:robot/arm"], ["--sink", "zenoh-percepts:arm"], ["--source", "zenoh:robot/arm"]]
    {
        assert!(fails(1, &[&["run"], &arguments[..]].concat()).contains("--features zenoh"));
    }
}

#[test]
fn a_key_names_one_limb() {
    assert!(fails(2, &["run", "--source", "zenoh:robot/*"]).contains("name one limb"));
    assert!(fails(2, &["run", "--sink", "zenoh:/arm"]).contains("single slashes"));
    assert!(fails(2, &["run", "--source", "zenoh:a", "--source", "csv:b.csv"]).contains("only limbs"));
    assert!(fails(2, &["run", "--zenoh-config", "a.json5"]).contains("is for limbs"));
}
