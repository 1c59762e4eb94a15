//! Decodes binary messages by the tables of the protocol, apart from what encodes them.

use serde_json::{Value, json};

use super::super::scene::PageScene;

/// What a viewer is told first of `scene`.
pub(super) fn welcome(scene: &PageScene) -> String {
    scene.welcome("00ff", scene.scale, scene.senses.as_ref().map(|senses| &senses.scales))
}

/// Reads what a page reads, by the protocol's tables.
struct Reader<'a>(&'a [u8], usize);

impl Reader<'_> {
    fn bytes<const N: usize>(&mut self) -> [u8; N] {
        let bytes = self.0[self.1..self.1 + N].try_into().unwrap();
        self.1 += N;
        bytes
    }

    fn u32(&mut self) -> u32 {
        u32::from_le_bytes(self.bytes())
    }

    fn f32(&mut self) -> Value {
        let number = f32::from_le_bytes(self.bytes());
        if number.is_nan() { Value::Null } else { f64::from(number).into() }
    }

    fn f64(&mut self) -> f64 {
        f64::from_le_bytes(self.bytes())
    }

    fn u32s(&mut self, count: u32) -> Vec<u32> {
        (0..count).map(|_| self.u32()).collect()
    }

    fn f32s(&mut self, count: u32) -> Vec<Value> {
        (0..count).map(|_| self.f32()).collect()
    }

    fn pad(&mut self) {
        while !self.1.is_multiple_of(8) {
            assert_eq!(self.bytes::<1>(), [0]);
        }
    }

    fn ends(self) {
        assert_eq!(self.1, self.0.len());
    }
}

pub(super) fn decode_mesh(bytes: &[u8]) -> Value {
    let mut from = Reader(bytes, 0);
    assert_eq!(from.bytes(), [1, 5, 0, 0]);
    let [v, t, n, l] = [0; 4].map(|_| from.u32());
    let mesh = json!({
        "position": from.f32s(3 * v), "normal": from.f32s(3 * v), "link": from.u32s(v), "corners": from.u32s(3 * t),
        "taxelId": from.u32s(n), "taxelLink": from.u32s(n), "taxelPosition": from.f32s(3 * n),
        "taxelNormal": from.f32s(3 * n), "taxelRadius": from.f32s(n), "taxelArea": from.f32s(n),
        "restPose": from.f32s(7 * l),
    });
    from.ends();
    mesh
}

pub(super) fn decode_frame(bytes: &[u8], scene: &PageScene) -> Value {
    let mut from = Reader(bytes, 0);
    let [kind, version, sections, zero] = from.bytes();
    assert_eq!((kind, version, zero), (2, 5, 0));
    let mut frame = json!({"seq": from.u32()});
    frame["frame"] = u64::from_le_bytes(from.bytes()).into();
    frame["t"] = from.f64().into();
    frame["skipped"] = from.u32().into();
    frame["p50"] = from.f32();
    frame["p99"] = from.f32();
    let [fields, touches, samples, newest, answers] = [0; 5].map(|_| from.u32());
    frame["newestEvent"] = newest.into();
    frame["engineMicroseconds"] = from.f32();
    assert_eq!(from.u32(), 0);
    let columns = u64::from_le_bytes(from.bytes());
    for part in ["pressure", "health", "shear", "pose", "percepts", "touches", "selfContacts", "samples"] {
        frame[part] = Value::Null;
    }
    let taxels = scene.counts.taxels as u32;
    if sections & 1 != 0 {
        frame["pressure"] = from.f32s(taxels).into();
        frame["health"] = (0..taxels).map(|_| from.bytes::<1>()[0]).collect::<Vec<_>>().into();
        from.pad();
    }
    if sections & 64 != 0 {
        let pulled = scene.senses.iter().flat_map(|senses| senses.taxels.all());
        let pulled = pulled.filter(|&(_, receptor, _)| receptor == crate::signal::Receptor::Shear).count();
        frame["shear"] = from.f32s(2 * pulled as u32).into();
    }
    if sections & 2 != 0 {
        frame["pose"] = from.f32s(7 * scene.poses.seven().len() as u32).into();
        from.pad();
    }
    if sections & 4 != 0 {
        let mut percepts = json!({"field": from.u32s(fields), "flags": from.u32s(fields), "present": from.u32s(2 * fields), "columns": {}});
        for (index, column) in scene.counts.columns.iter().enumerate().filter(|(index, _)| columns >> index & 1 != 0) {
            percepts["columns"][index.to_string()] = from.f32s(fields * column.components as u32).into();
        }
        from.pad();
        frame["percepts"] = percepts;
    }
    if sections & 8 != 0 {
        frame["touches"] = (0..touches).map(|_| touch(&mut from)).collect::<Vec<_>>().into();
        from.pad();
    }
    if sections & 32 != 0 {
        let number = from.u32();
        let mut contact = |_| {
            let identity = from.u32();
            let sides: Vec<Value> =
                (0..2).map(|_| json!({"link": from.u32(), "touch": from.u32(), "total": from.f32()})).collect();
            json!({"identity": identity, "sides": sides, "position": from.f32s(3), "distance": from.f32(), "angle": from.f32()})
        };
        let known = number != u32::MAX;
        let self_contacts: Vec<Value> = (0..if known { number } else { 0 }).map(&mut contact).collect();
        frame["selfContacts"] = json!({"known": known, "list": self_contacts});
        from.pad();
    }
    if sections & 16 != 0 {
        let t: Vec<f64> = (0..samples).map(|_| from.f64()).collect();
        let series = (bytes.len() - from.1) as u32 / (4 * samples);
        let values: Vec<Vec<Value>> = (0..series).map(|_| from.f32s(samples)).collect();
        frame["samples"] = json!({"answers": answers, "t": t, "values": values});
        from.pad();
    }
    from.ends();
    frame
}

fn touch(from: &mut Reader<'_>) -> Value {
    let [id, link, frame, flags, active, taxels, links, fields, points] = [0; 9].map(|_| from.u32());
    let mut touch = json!({"id": id, "link": link, "frame": frame, "flags": flags, "active": active});
    for name in ["age", "total", "force", "peak", "anisotropy"] {
        touch[name] = from.f32();
    }
    for (name, count) in
        [("position", 3), ("normal", 3), ("axis", 3), ("spread", 2), ("velocity", 3), ("place", 3), ("placeSigma", 2)]
    {
        touch[name] = from.f32s(count).into();
    }
    touch["taxels"] = from.u32s(taxels).into();
    for (name, count) in [("links", links), ("fields", fields)] {
        touch[name] = (0..count).map(|_| json!({"index": from.u32(), "share": from.f32()})).collect();
    }
    let point = |_| json!({"ago": from.f32(), "frame": from.u32(), "position": from.f32s(3)});
    touch["trail"] = (0..points).map(point).collect();
    touch
}

pub(super) fn decode_peaks(bytes: &[u8], taxels: u32) -> Value {
    let mut from = Reader(bytes, 0);
    assert_eq!(from.bytes(), [4, 5, 0, 0]);
    let (id, begin, end) = (from.u32(), from.f64(), from.f64());
    let peaks = from.f32s(taxels);
    from.ends();
    json!({"id": id, "from": begin, "to": end, "peaks": peaks})
}

pub(super) fn decode_history(bytes: &[u8]) -> Value {
    let mut from = Reader(bytes, 0);
    assert_eq!(from.bytes(), [3, 5, 0, 0]);
    let [id, bins, series] = [0; 3].map(|_| from.u32());
    let (begin, end) = (from.f64(), from.f64());
    let ends: Vec<[Vec<Value>; 2]> = (0..series).map(|_| [from.f32s(bins), from.f32s(bins)]).collect();
    from.ends();
    json!({"id": id, "bins": bins, "from": begin, "to": end,
           "least": ends.iter().map(|ends| &ends[0]).collect::<Vec<_>>(),
           "most": ends.iter().map(|ends| &ends[1]).collect::<Vec<_>>()})
}
