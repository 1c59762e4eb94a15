//! That a link is the root of a URDF, and what points up there: kept in a body that was made from one.

use serde::Deserialize;
use serde_json::json;

use super::axes::Up;
use crate::error::{Error, Result, failed};

/// Version of the JSON that is written, and the latest that is read.
const VERSION: u32 = 1;

/// Key in the `extras` of the node of a URDF's root link, whose value is JSON as one string.
pub(super) const URDF_KEY: &str = "somatic_urdf";

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct UrdfJson {
    version: u32,
    up: String,
}

/// The JSON string that [`from_json`] reads back.
pub(super) fn to_json(up: Up) -> String {
    json!({"version": VERSION, "up": up.word()}).to_string()
}

/// The axis that points up in the URDF, from the JSON string `text`.
pub(super) fn from_json(text: &str) -> Result<Up> {
    let wrong = |why: &str| failed!("it does not say what points up in its URDF: {why}; repair or remove `{URDF_KEY}`");
    let UrdfJson { version, up } = serde_json::from_str(text).map_err(|e| wrong(&e.to_string()))?;
    if version > VERSION {
        return Err(failed!("`{URDF_KEY}` of version {version} is newer than this program; update it"));
    }
    up.parse().map_err(|e: Error| wrong(&e.to_string()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_points_up_survives_its_json() {
        for up in [Up::Y, Up::Z] {
            assert_eq!(from_json(&to_json(up)).unwrap(), up);
        }
        let why = |text: &str| from_json(text).unwrap_err().to_string();
        assert!(why(r#"{"version":2,"up":"z"}"#).contains("newer"));
        assert!(why(r#"{"version":1,"up":"x"}"#).contains("no axis that points up `x`"));
        assert!(why("z").contains("repair or remove `somatic_urdf`"));
    }
}
