//! A bill as text and as JSON.

use comfy_table::ColumnConstraint;
use serde_json::{Value, json};
use somatic::Agreement;
use somatic::internal::tradeoff::Words;

use super::bill::{Bill, Stage};
use crate::cli::table::{plain, shown};
use crate::cli::words::{count, one_line, title};

impl Bill {
    pub(super) fn text(&self) -> String {
        let mut text = format!("{}\n", title(&self.body));
        let mut line = |what: &str, value: String| text += &format!("  {what:<12}{}\n", one_line(&value));
        let [named, of_named] = self.named_fields;
        let each = match self.letters {
            0 | 1 => String::new(),
            letters => format!(
                ", {} of {letters} letters: one for each that its taxels have",
                count(self.fields[0] as u64, "percept")
            ),
        };
        line("fields", format!("{named} of {of_named}{each}"));
        line("taxels", format!("{} of {} are read", self.taxels[0], self.taxels[1]));
        line("memberships", self.memberships_in_words());
        let moved = format!("{} B up, {} B down", self.bytes[0], self.bytes[1]);
        line("a frame", format!("{moved}, {:.2} µs {}", self.measured.whole_us, self.measured.on));
        #[cfg(feature = "zenoh")]
        self.network.iter().for_each(|network| line("network", network.words()));
        let (name, what, why) = &self.backend;
        line("backend", format!("{name} ({what}): {why}; {} a call", count(self.batch as u64, "frame")));
        let Words { arithmetic, charts, orientation_by, coverage, cadence, .. } = self.knobs.words();
        line("options", [arithmetic, charts, orientation_by, coverage, cadence].join(", "));
        if let Some(kept) = &self.kept {
            line("measured", kept.clone());
        }
        self.kept_charts.iter().for_each(|kept| line("kept chart", kept.clone()));
        if let Some(agreement) = &self.measured.agreement {
            line("accuracy", accuracy(agreement));
        }
        text + "\n" + &self.table()
    }

    /// The memberships of pressures, which are also fields' in shear, and of what the host makes of other values.
    fn memberships_in_words(&self) -> String {
        let of_others: usize = self
            .stages
            .iter()
            .filter(|stage| stage.planned.letter.is_some())
            .map(|stage| stage.planned.memberships)
            .sum();
        match [self.memberships, of_others] {
            [pressures, 0] => pressures.to_string(),
            [0, others] => others.to_string(),
            [pressures, others] => format!("{pressures} of pressures, {others} of other letters"),
        }
    }

    fn table(&self) -> String {
        let headings = ["stage", "over", "memberships", "bytes", "measured µs", "where", "why"];
        let mut table = plain(headings, 1..5);
        table.set_constraints((0..6).map(|_| ColumnConstraint::ContentWidth));
        for Stage { planned: stage, measured_us } in &self.stages {
            let number = |count: usize| if count == 0 { String::new() } else { count.to_string() };
            let place = if stage.on_host { "host" } else { &self.backend.0 };
            let over = match stage.each {
                // Only a frame tells how many.
                "touch" => "touches".to_owned(),
                each => count(stage.over as u64, each),
            };
            table.add_row([
                stage.name.to_owned(),
                if stage.runs { over } else { "–".to_owned() },
                number(stage.memberships),
                match [stage.bytes_up, stage.bytes_down] {
                    [0, 0] => String::new(),
                    [0, down] => format!("{down} down"),
                    [up, _] => format!("{up} up"),
                },
                measured_us.map_or(String::new(), |us| format!("{us:.3}")),
                if stage.runs { place.to_owned() } else { String::new() },
                stage.why.clone(),
            ]);
        }
        shown(&table)
    }

    pub(super) fn json(&self) -> Value {
        let (name, what, why) = &self.backend;
        let stage = |Stage { planned, measured_us }: &Stage| {
            let mut row = json!(planned);
            row["us"] = json!(measured_us.map(rounded));
            row
        };
        let mut knobs = json!(self.knobs.knobs);
        knobs["arithmetic"] = self.knobs.words().arithmetic.into();
        let mut bill = json!({
            "body": self.body,
            "fields": self.fields[0],
            "of_fields": self.fields[1],
            "taxels": self.taxels[0],
            "of_taxels": self.taxels[1],
            "memberships": self.memberships,
            "bytes_up": self.bytes[0],
            "bytes_down": self.bytes[1],
            "backend": name,
            "adapter": what,
            "why": why,
            "knobs": knobs,
            "kept_charts": self.kept_charts,
            "measured": self.kept,
            "batch": self.batch,
            "us": rounded(self.measured.whole_us),
            "stages": self.stages.iter().map(stage).collect::<Vec<_>>(),
        });
        #[cfg(feature = "zenoh")]
        if let Some(network) = &self.network {
            bill["network"] = network.json();
        }
        if let Some(agreement) = &self.measured.agreement {
            // What is counted or chosen has no error to speak of.
            let measured = agreement
                .quantities
                .iter()
                .filter(|(name, _)| !["flags", "contact", "active"].contains(&name.as_str()));
            let errors = measured.map(|(name, of)| (name.clone(), of.worst_error.into()));
            bill["worst_errors"] = Value::Object(errors.collect());
            let left_out = agreement.quantities.iter().filter(|(_, of)| of.too_close > 0);
            bill["left_out"] = left_out.map(|(name, of)| (name.clone(), of.too_close)).collect();
            bill["agrees"] = agreement.holds().into();
        }
        bill
    }
}

fn rounded(us: f64) -> f64 {
    (us * 1e3).round() / 1e3
}

/// What single precision costs, in the units that people think in.
fn accuracy(agreement: &Agreement) -> String {
    let mut words = Vec::new();
    for name in ["centroid", "orientation", "principal_axis", "direction"] {
        let Some(of) = agreement.quantities.get(name).filter(|of| of.compared + of.too_close > 0) else { continue };
        let within = match name {
            _ if of.compared == 0 => String::new(),
            "centroid" => format!(" within {:.1e} mm", of.worst_error * 1e3),
            _ => format!(" within {:.1e}°", of.worst_error.to_degrees()),
        };
        // There both answers are right.
        let left_out = match (of.too_close, name) {
            (0, _) => String::new(),
            (ties, "orientation") => format!(" ({} left out)", count(ties, "tie")),
            (undecided, _) => format!(" ({undecided} left out, too close to call)"),
        };
        words.push(format!("{name}{within}{left_out}"));
    }
    let verdict =
        if agreement.holds() { "as the reference, to rounding" } else { "NOT as the reference; run --verify" };
    if words.is_empty() { verdict.to_owned() } else { format!("{verdict}: {}", words.join(", ")) }
}
