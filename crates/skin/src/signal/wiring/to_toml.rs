//! Writes a wiring as a TOML file.

use std::fmt::Write as _;

use super::{Axis, Channel, WiredBoard, Wiring};

impl Wiring {
    /// The file's text, TOML.
    #[must_use]
    pub fn to_toml(&self) -> String {
        let boards: Vec<String> = self.boards.iter().map(WiredBoard::to_toml).collect();
        boards.join("\n")
    }
}

impl WiredBoard {
    fn to_toml(&self) -> String {
        let mut text = format!("[[board]]\nid = {}\n", self.id);
        let mut key = |name: &str, value: Option<String>| {
            if let Some(value) = value {
                let _ = writeln!(text, "{name} = {value}");
            }
        };
        key("bits", self.bits.map(|bits| bits.to_string()));
        // A TOML string, as JSON writes it.
        key("port", self.port.as_ref().map(|port| serde_json::Value::from(port.as_str()).to_string()));
        key("baud", self.baud.map(|baud| baud.to_string()));
        key("channels", Some(self.taxels.len().to_string()));
        text += "taxels = [\n";
        let has_wiper = |channel: usize| self.wipers.get(channel).copied().flatten().is_some();
        let wired: Vec<usize> = (0..self.taxels.len()).filter(|&channel| self.taxels[channel].is_some()).collect();
        for run in wired.chunk_by(|&a, &b| a + 1 == b && has_wiper(a) == has_wiper(b)) {
            text += &self.run(run[0], run[run.len() - 1] + 1);
        }
        text + "]\n"
    }

    /// The channels from `from` to before `end`. They all have taxels.
    fn run(&self, from: usize, end: usize) -> String {
        let ids: Vec<u32> = self.taxels[from..end].iter().flatten().copied().collect();
        let ascends = ids.windows(2).all(|pair| pair[0].checked_add(1) == Some(pair[1]));
        let name = |&id: &u32| match Channel(id).axis() {
            Axis::Normal => id.to_string(),
            _ => format!("\"{}\"", Channel(id)),
        };
        let names: Vec<String> = ids.iter().map(name).collect();
        let is_run = ascends && names.iter().all(|name| !name.starts_with('"'));
        let what = match is_run {
            true => format!("first = {}, count = {}", ids[0], ids.len()),
            false => format!("ids = [{}]", names.join(", ")),
        };
        let wipers: Vec<u8> = (from..end).filter_map(|channel| self.wipers.get(channel).copied().flatten()).collect();
        let wipers = if wipers.is_empty() { String::new() } else { format!(", wipers = {wipers:?}") };
        format!("  {{ channel = {from}, {what}{wipers} }},\n")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read_as_it_was() {
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/wirings");
        let [hand, boards] =
            ["hand", "hand-boards"].map(|name| std::fs::read_to_string(format!("{folder}/{name}.toml")).unwrap());
        let more = "[[board]]\nid = 9\nbits = 12\nport = \"/dev/\\\"a\"\nbaud = 1000\ntaxels = [\n\
                    { channel = 3, ids = [7, 3], wipers = [0, 255] }, { channel = 5, first = 11 }]\n";
        for text in [&hand[..], &boards, more] {
            let wiring = Wiring::from_text(text).unwrap();
            let wipers = wiring.with_wipers(|board, channel| channel.is_multiple_of(3).then_some(board as u8));
            for wiring in [wiring, wipers] {
                let written = wiring.to_toml();
                assert_eq!(Wiring::from_text(&written).unwrap(), wiring, "{written}");
            }
        }
        let read = Wiring::from_text(more).unwrap();
        assert_eq!(read.boards()[0].wipers, [None, None, None, Some(0), Some(255), None]);
        assert_eq!(read.with_wipers(|_, _| Some(8)).boards()[0].wipers[..4], [None, None, None, Some(8)]);
    }
}
