//! Percepts of a limb with ids of touches that say which limb they are of: each limb counts its own.

use std::fmt;

use serde::Deserialize;
use serde::de::{Deserializer, MapAccess, Visitor};
use serde_json::value::RawValue as RawJson;

use super::packet::Percepts;

/// The keys of `percepts` behind their time, and the end of the line: ids of touches and of self-contacts become `"KEY/17"`, with the
/// `key` of the limb; all else stays as it is, byte for byte.
///
/// # Errors
/// They are not what NDJSON has, in words.
pub(crate) fn qualified(key: &str, percepts: &Percepts<'_>) -> Result<String, String> {
    let mut to = format!(",\"frame\":{}", percepts.frame);
    let written = Qualifier { key, to: &mut to }.keys(percepts);
    written.map_err(|e| format!("it sends JSON that is not percepts: {e}"))?;
    to.push('}');
    Ok(to)
}

struct Qualifier<'a> {
    key: &'a str,
    to: &'a mut String,
}

impl Qualifier<'_> {
    fn keys(&mut self, percepts: &Percepts<'_>) -> serde_json::Result<()> {
        if let Some(touches) = percepts.touches {
            self.to.push_str(",\"touches\":");
            self.objects(touches)?;
        }
        if let Some(released) = percepts.released {
            self.to.push_str(",\"released\":");
            self.ids(released)?;
        }
        self.to.push_str(",\"fields\":");
        self.objects(percepts.fields)?;
        if let Some(self_contacts) = percepts.self_contacts {
            self.to.push_str(",\"self_contacts\":");
            self.objects(self_contacts)?;
        }
        Ok(())
    }

    /// A list of touches, fields or self-contacts.
    fn objects(&mut self, list: &RawJson) -> serde_json::Result<()> {
        let objects: Vec<Pairs<'_>> = serde_json::from_str(list.get())?;
        self.to.push('[');
        for (index, Pairs(pairs)) in objects.into_iter().enumerate() {
            self.between(index);
            self.to.push('{');
            for (index, (name, value)) in pairs.into_iter().enumerate() {
                self.between(index);
                self.text(&name);
                self.to.push(':');
                match name.as_str() {
                    "id" => self.id(value.get()),
                    "touches" => self.touches(value)?,
                    _ => self.to.push_str(value.get()),
                }
            }
            self.to.push('}');
        }
        self.to.push(']');
        Ok(())
    }

    /// The touches of a field, with its shares, or those of the sides of a self-contact.
    fn touches(&mut self, touches: &RawJson) -> serde_json::Result<()> {
        if !touches.get().starts_with('{') {
            return self.ids(touches);
        }
        let Pairs(shares) = serde_json::from_str(touches.get())?;
        self.to.push('{');
        for (index, (id, share)) in shares.into_iter().enumerate() {
            self.between(index);
            self.id(&id);
            self.to.push(':');
            self.to.push_str(share.get());
        }
        self.to.push('}');
        Ok(())
    }

    fn ids(&mut self, list: &RawJson) -> serde_json::Result<()> {
        let ids: Vec<u64> = serde_json::from_str(list.get())?;
        self.to.push('[');
        for (index, id) in ids.into_iter().enumerate() {
            self.between(index);
            self.id(&id.to_string());
        }
        self.to.push(']');
        Ok(())
    }

    fn id(&mut self, id: &str) {
        self.text(&format!("{}/{id}", self.key));
    }

    fn text(&mut self, text: &str) {
        self.to.push_str(&serde_json::Value::from(text).to_string());
    }

    fn between(&mut self, index: usize) {
        if index > 0 {
            self.to.push(',');
        }
    }
}

/// An object of JSON: its keys in their order, with their values as they are written.
struct Pairs<'a>(Vec<(String, &'a RawJson)>);

impl<'de> Deserialize<'de> for Pairs<'de> {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        struct OfObject;

        impl<'de> Visitor<'de> for OfObject {
            type Value = Pairs<'de>;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("an object")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Pairs<'de>, A::Error> {
                let mut pairs = Vec::new();
                while let Some(pair) = map.next_entry()? {
                    pairs.push(pair);
                }
                Ok(Pairs(pairs))
            }
        }

        from.deserialize_map(OfObject)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::limb::{Packet, PerceptHead, open, percepts_begin};

    fn qualified_line(key: &str, line: &str) -> Result<String, String> {
        let mut bytes = Vec::new();
        percepts_begin(&mut bytes, PerceptHead { boot: 1, sequence: 0 });
        bytes.extend_from_slice(line.as_bytes());
        let Packet::Percepts(percepts) = open(&bytes)?.1 else { panic!("{line}") };
        qualified(key, &percepts)
    }

    #[test]
    fn ids_get_the_limb_and_all_else_stays_byte_for_byte() {
        let line = r#""t":1.5,"frame":7,"touches":[{"id":3,"age":0.1,"link":"middle","total":1e-7,"links":{"middle":1.0},"flags":["young"]},{"id":4}],"released":[1,2],"fields":[{"field":"a \"b\"","total":100000000000000.0,"touches":{"3":0.25,"4":1.0},"flags":[]},{"field":"c","touches":{}}],"self_contacts":[{"id":0,"fields":["a","c"],"touches":[3,4],"position":[0.10,1,2]}]}"#;
        let wanted = r#","frame":7,"touches":[{"id":"robot/left/3","age":0.1,"link":"middle","total":1e-7,"links":{"middle":1.0},"flags":["young"]},{"id":"robot/left/4"}],"released":["robot/left/1","robot/left/2"],"fields":[{"field":"a \"b\"","total":100000000000000.0,"touches":{"robot/left/3":0.25,"robot/left/4":1.0},"flags":[]},{"field":"c","touches":{}}],"self_contacts":[{"id":"robot/left/0","fields":["a","c"],"touches":["robot/left/3","robot/left/4"],"position":[0.10,1,2]}]}"#;
        assert_eq!(qualified_line("robot/left", line).unwrap(), wanted);
        // A limb without touches has none here.
        let line = r#""t":1.5,"frame":7,"fields":[{"field":"a","contact":false}]}"#;
        assert_eq!(qualified_line("left", line).unwrap(), r#","frame":7,"fields":[{"field":"a","contact":false}]}"#);
        // Names of limbs are text as any other.
        let line = r#""t":1.5,"frame":7,"touches":[{"id":3}],"fields":[]}"#;
        assert_eq!(qualified_line("a\"b", line).unwrap(), r#","frame":7,"touches":[{"id":"a\"b/3"}],"fields":[]}"#);
    }

    #[test]
    fn two_limbs_ids_differ() {
        let line = r#""t":0,"frame":0,"touches":[{"id":17}],"released":[16],"fields":[]}"#;
        let [left, right] = ["left", "right"].map(|key| qualified_line(key, line).unwrap());
        assert!(left.contains(r#""id":"left/17""#) && left.contains(r#"["left/16"]"#) && right.contains("right/17"));
    }

    #[test]
    fn what_is_not_ndjson_is_reported() {
        for line in [
            r#""t":0,"frame":0,"touches":3,"fields":[]}"#,
            r#""t":0,"frame":0,"touches":[3],"fields":[]}"#,
            r#""t":0,"frame":0,"released":["a"],"fields":[]}"#,
            r#""t":0,"frame":0,"fields":[{"field":"a","touches":"b"}]}"#,
        ] {
            let why = qualified_line("left", line).unwrap_err();
            assert!(why.starts_with("it sends JSON that is not percepts: ") && !why.contains('\n'), "{why}");
        }
    }
}
