//! Names of sensors, each with its values.

use crate::error::{Result, failed};

/// `names`, each with how many values it has, where `counts` has those of each array.
///
/// # Errors
/// There is neither a name for each array nor one for each value.
pub fn named_sensors(names: Vec<String>, counts: &[usize]) -> Result<Vec<(String, usize)>> {
    let values: usize = counts.iter().sum();
    if names.len() == counts.len() {
        return Ok(names.into_iter().zip(counts.iter().copied()).collect());
    }
    if names.len() == values {
        return Ok(names.into_iter().map(|name| (name, 1)).collect());
    }
    let count = |count: usize, thing: &str| format!("{count} {thing}{}", if count == 1 { "" } else { "s" });
    Err(failed!(
        "names: it has {}, {} and {}; there should be one for each array, or for each value",
        count(names.len(), "name"),
        count(counts.len(), "array"),
        count(values, "value")
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_is_that_of_an_array_or_of_a_value() {
        let names = |all: &[&str]| all.iter().map(|&name| name.to_owned()).collect::<Vec<String>>();
        let own = |name: &str, count: usize| (name.to_owned(), count);
        assert_eq!(named_sensors(names(&["a", "b"]), &[2, 3]).unwrap(), [own("a", 2), own("b", 3)]);
        assert_eq!(named_sensors(names(&["a", "b"]), &[2]).unwrap(), [own("a", 1), own("b", 1)]);
        let why = named_sensors(names(&["a"]), &[2, 3]).unwrap_err().to_string();
        assert!(why.contains("it has 1 name, 2 arrays and 5 values"), "{why}");
    }
}
