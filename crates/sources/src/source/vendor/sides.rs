//! The names of panels that are of one side of the body.

/// The names of panels: the side of the body where a sensor's name says it, as `…-LF …`, else numbers.
pub(super) fn sides(sensors: &[&str]) -> Vec<String> {
    let side = |name: &&str| {
        let mut parts = name.split(|c: char| !c.is_ascii_alphabetic()).map(str::to_ascii_uppercase);
        parts.find_map(|part| match part.as_str() {
            "LF" | "LEFT" | "L" => Some("left"),
            "RF" | "RIGHT" | "R" => Some("right"),
            _ => None,
        })
    };
    let found: Option<Vec<&str>> = sensors.iter().map(side).collect();
    let is_clear = |names: &Vec<&str>| names.len() == 1 || (names.len() == 2 && names[0] != names[1]);
    match found.filter(is_clear) {
        Some(names) => names.into_iter().map(str::to_owned).collect(),
        None if sensors.len() == 1 => vec!["sensor".to_owned()],
        None => (1..=sensors.len()).map(|number| format!("sensor_{number}")).collect(),
    }
}
