//! Names of limbs on the network.

use crate::error::{Error, Result};

/// `key` as a key of Zenoh's for one limb: words between slashes, without wildcards.
///
/// # Errors
/// It is none.
pub fn checked_key(key: &str) -> Result<String> {
    if key.split('/').any(str::is_empty) {
        return Err(Error::usage(format!(
            "`{key}` is not a key; write words between single slashes, such as robot/left_arm"
        )));
    }
    if let Some(sign) = key.chars().find(|sign| "*$?#".contains(*sign)) {
        return Err(Error::usage(format!("`{key}` has a `{sign}`; name one limb, and give --source once for each")));
    }
    Ok(key.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_key_names_one_limb() {
        assert_eq!(checked_key("robot/left_arm").unwrap(), "robot/left_arm");
        for bad in ["", "/arm", "arm/", "a//b", "robot/*", "robot/**", "a?b", "a#b", "$*"] {
            assert!(checked_key(bad).unwrap_err().is_usage(), "{bad}");
        }
    }
}
