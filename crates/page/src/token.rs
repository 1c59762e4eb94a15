//! Numbers that nobody can guess.

use std::fmt::Write as _;

use crate::error::{Error, Result};

/// 128 random bits in hexadecimal digits.
///
/// # Errors
/// The system gives no random numbers.
pub(super) fn random_hex() -> Result<String> {
    let mut bytes = [0; 16];
    getrandom::fill(&mut bytes).map_err(|e| Error::failed(format!("the system gives no random numbers: {e}")))?;
    Ok(bytes.iter().fold(String::with_capacity(32), |mut text, byte| {
        let _ = write!(text, "{byte:02x}");
        text
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_two_are_alike() {
        let [a, b] = [random_hex().unwrap(), random_hex().unwrap()];
        assert!(a.len() == 32 && a.bytes().all(|digit| digit.is_ascii_hexdigit()));
        assert_ne!(a, b);
    }
}
