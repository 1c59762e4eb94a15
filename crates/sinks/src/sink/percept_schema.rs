//! The JSON schema of a frame's line of percepts, for recordings: it has every key that a line may have, by the tables of columns.

use serde_json::{Map, Value, json};

use crate::percept::{COLUMNS, TOUCH_COLUMNS, Unit};

/// The schema.
pub(super) fn text() -> String {
    let schema = json!({
        "title": "somatic.Percepts",
        "description": "The percepts of a frame, a line of NDJSON. What is not defined is left out, and flags say why.",
        "type": "object",
        "required": ["t", "frame", "fields"],
        "properties": {
            "t": described("number", "The frame's time, s."),
            "frame": described("integer", "The frame's number."),
            "touches": list_of(&touch()),
            "released": {
                "type": "array", "items": {"type": "integer"}, "description": "The ids of touches that ended with the frame.",
            },
            "fields": list_of(&field()),
            "self_contacts": list_of(&self_contact()),
        },
    });
    schema.to_string()
}

fn described(kind: &str, what: &str) -> Value {
    json!({"type": kind, "description": what})
}

fn list_of(item: &Value) -> Value {
    json!({"type": "array", "items": item})
}

fn words() -> Value {
    list_of(&json!({"type": "string"}))
}

fn object<'n>(properties: impl IntoIterator<Item = (&'n str, Value)>) -> Value {
    let properties: Map<String, Value> = properties.into_iter().map(|(name, of)| (name.to_owned(), of)).collect();
    json!({"type": "object", "properties": properties})
}

/// Numbers by names that are the body's, or by ids of touches.
fn numbers_by_name(what: &str) -> Value {
    json!({"type": "object", "additionalProperties": {"type": "number"}, "description": what})
}

/// A quantity of `components` numbers.
fn quantity(unit: Unit, is_count: bool, components: usize, help: &str) -> Value {
    let kind = match unit {
        Unit::Kind => "string",
        _ if is_count => "integer",
        _ => "number",
    };
    match components {
        1 => described(kind, help),
        count => json!({
            "type": "array", "items": {"type": kind}, "minItems": count, "maxItems": count, "description": help,
        }),
    }
}

fn touch() -> Value {
    let of_wrench = |what: &str| quantity(Unit::Newton, false, 3, what);
    let wrench = json!({
        "type": "object",
        "additionalProperties": {"type": "object", "properties": {
            "force": of_wrench("Force on the link in its frame, N."),
            "torque": of_wrench("Torque about the link's origin in its frame, N m."),
        }},
        "description": "What the touch presses on each link that it lies on.",
    });
    let head = [
        ("id", described("integer", "Lasts from onset to release, and is never used again.")),
        ("age", described("number", "Time since its onset, s.")),
        ("link", described("string", "The link with most of its total.")),
        ("in", described("string", "The frame of its places and directions: the link, or the world.")),
    ];
    let columns = TOUCH_COLUMNS
        .iter()
        .map(|column| (column.name, quantity(column.unit, column.is_whole(), column.components, column.help)));
    let tail = [
        ("links", numbers_by_name("The links that it lies on, with their shares of its total.")),
        ("fields", numbers_by_name("The fields that hold parts of it, with their shares of its total.")),
        ("taxels", list_of(&described("integer", "The id of a taxel."))),
        ("wrench", wrench),
        ("flags", words()),
    ];
    object(head.into_iter().chain(columns).chain(tail))
}

fn field() -> Value {
    let head = [
        ("field", described("string", "Its name.")),
        ("link", described("string", "The frame of its place and normal: its anchor, or the world.")),
        ("letter", described("string", "Its letter, where there are several.")),
        ("signal", described("string", "Its signal, where there are several.")),
        (
            "contact",
            described(
                "boolean",
                "Whether it is touched; of letter proximity whether something is in range, of temperature whether there is a reading.",
            ),
        ),
    ];
    let columns = COLUMNS.iter().map(|column| {
        let is_count = column.is_whole();
        (column.name, quantity(column.unit, is_count, column.components, column.help))
    });
    let tail = [
        (
            "touches",
            numbers_by_name("By the id of each touch that it holds a part of, its share of the touch's total."),
        ),
        ("flags", words()),
    ];
    object(head.into_iter().chain(columns).chain(tail))
}

fn self_contact() -> Value {
    let pair = |kind: &str, what: &str| json!({"type": "array", "items": {"type": kind}, "minItems": 2, "maxItems": 2, "description": what});
    let properties = [
        ("id", described("integer", "Lasts as long as the two sides touch each other.")),
        ("letter", described("string", "The letter of both sides, where there are several.")),
        ("signal", described("string", "The signal of both sides, where there are several.")),
        ("fields", pair("string", "The field of each side.")),
        ("links", pair("string", "The link of each side.")),
        ("touches", pair("integer", "The id of the touch of each side.")),
        ("totals", pair("number", "ΣP of each side.")),
        ("position", quantity(Unit::Metre, false, 3, "Half-way between the two places, m.")),
        ("distance", described("number", "Between the two places, m.")),
        ("angle", described("number", "Between the normals, rad.")),
    ];
    object(properties)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::percept::TouchOutputs;
    use crate::sink::line::LineWriter;
    use crate::sink::{FieldNames, SkinNames};
    use crate::{Body, Calibration, Engine, Options, RawValue, Scene, bundled, touch};

    /// What `value` has that `schema` does not say; places in it are keys behind dots.
    fn unsaid(schema: &Value, value: &Value, at: &str, found: &mut Vec<String>) {
        let is_of_kind = match schema["type"].as_str().unwrap_or("none") {
            "integer" => value.is_u64(),
            "number" => value.is_number(),
            "string" => value.is_string(),
            "boolean" => value.is_boolean(),
            "array" => value.is_array(),
            "object" => value.is_object(),
            other => panic!("{at}: {other}"),
        };
        if !is_of_kind {
            found.push(format!("{at}: {value} is not of type {}", schema["type"]));
        }
        let is_of_length = |of: &Value, count: usize| of.as_u64().is_none_or(|wanted| wanted == count as u64);
        for item in value.as_array().into_iter().flatten() {
            unsaid(&schema["items"], item, at, found);
        }
        if value.as_array().is_some_and(|items| !is_of_length(&schema["minItems"], items.len())) {
            found.push(format!("{at}: {value} has another length"));
        }
        for (key, own) in value.as_object().into_iter().flatten() {
            let said = schema["properties"].get(key).or_else(|| schema.get("additionalProperties"));
            match said {
                Some(said) => unsaid(said, own, &format!("{at}.{key}"), found),
                None => found.push(format!("{at}.{key}")),
            }
        }
    }

    #[test]
    fn the_schema_says_every_key_of_a_line() {
        let body = Body::from_bytes("hand", bundled::HAND).unwrap();
        let ids: Vec<u32> = body.taxels.iter().map(|taxel| taxel.id).collect();
        let all = touch::Options { outputs: TouchOutputs::all(), ..touch::Options::default() };
        let calibration = "[all]\ngain = 100\nunit = \"Pa\"\nnoise = 1\n[layer]\nsigma_m = 0.004\n";
        let calibration = Calibration::parse(calibration, &ids).unwrap();
        let options = Options::default().scene(Scene::default().touches(all)).calibration(calibration);
        let mut engine = Engine::new(&body, options).unwrap();
        let skin = SkinNames::for_plan(&body, engine.plan());
        let lines = LineWriter::new(&FieldNames::all_of(engine.plan()), true).with_skin(skin.as_ref());
        let schema: Value = serde_json::from_str(&text()).unwrap();
        let mut found = Vec::new();
        let mut keys = std::collections::BTreeSet::new();
        let mut frame = engine.frame(0.0);
        for number in 0..40 {
            frame.t_s = f64::from(number) * 0.02;
            for (index, value) in frame.values.iter_mut().enumerate() {
                let away = (index as f64 - 12.0 - 0.05 * f64::from(number)) / 3.0;
                *value = RawValue::new(if number < 39 { (200.0 * (-0.5 * away * away).exp()).floor() } else { 0.0 });
            }
            engine.process_one(&frame).unwrap();
            let mut line = Vec::new();
            lines.write(engine.percepts(), 0, &mut line);
            let line: Value = serde_json::from_slice(&line).unwrap();
            unsaid(&schema, &line, "", &mut found);
            keys.extend(
                line["touches"].as_array().unwrap().iter().flat_map(|touch| touch.as_object().unwrap().keys().cloned()),
            );
            keys.extend(line["released"].as_array().unwrap().iter().map(|_| "released".to_owned()));
        }
        assert_eq!(found, Vec::<String>::new());
        for key in
            ["force", "position", "principal_axis", "velocity", "links", "fields", "taxels", "wrench", "released"]
        {
            assert!(keys.contains(key), "{key}: {keys:?}");
        }
        // It would see a key that is not there, and a number that is a word.
        let odd =
            json!({"t": "now", "frame": 0, "fields": [{"field": "a", "colour": 1}], "touches": [{"position": [1, 2]}]});
        unsaid(&schema, &odd, "", &mut found);
        assert_eq!(found.len(), 3, "{found:?}");
    }
}
