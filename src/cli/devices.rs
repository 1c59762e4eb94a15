//! `somatic devices`: the GPUs and serial ports, and what is missing.

use std::thread::available_parallelism;

use clap::Args;
use serde_json::{Value, json};
use somatic::error::Result;
use somatic::source::{PortSummary, serial_ports};

use super::stdio::{DONE, print};
use super::table::{plain, shown};
use super::words::{bullet, count};

const EXAMPLES: &str = "\
Examples:
  somatic devices
  somatic devices --json | jq -r '.ports[] | select(.trouble == null) | .name'

Ports are looked at and not opened. Pseudo-terminals are not listed; a source can name them all
the same.";

/// List GPUs and serial ports, and what each can do.
#[derive(Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct Arguments {
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

pub(super) fn devices(arguments: &Arguments) -> Result<u8> {
    let found = Devices { cpu: somatic::internal::backend::processor(), gpus: gpus(), ports: serial_ports()? };
    print(&if arguments.json { format!("{:#}\n", found.json()) } else { found.text() })?;
    Ok(DONE)
}

/// What this machine has.
struct Devices {
    cpu: String,
    gpus: Gpus,
    ports: Vec<PortSummary>,
}

/// GPUs, and what is missing.
#[derive(Default)]
struct Gpus {
    /// Name, kind, API and driver of each, and why it cannot be used.
    adapters: Vec<([String; 4], Option<String>)>,
    /// What is missing, with the remedy.
    missing: Vec<String>,
}

#[cfg(feature = "gpu")]
fn gpus() -> Gpus {
    use somatic::internal::backend::gpu::adapters;
    use somatic::internal::backend::gpu::silent_gpus;

    let adapters = adapters();
    let mut missing: Vec<String> = silent_gpus(&adapters)
        .into_iter()
        .map(|(gpu, remedy)| format!("no driver answers for the {gpu}: {remedy}"))
        .collect();
    if adapters.is_empty() && missing.is_empty() {
        missing.push(
            "no GPU driver answers; backend gpu needs one (on Debian, mesa-vulkan-drivers runs its shaders on the CPU)"
                .to_owned(),
        );
    }
    let adapters = adapters.into_iter().map(|gpu| ([gpu.name, gpu.kind.to_owned(), gpu.api, gpu.driver], gpu.unfit));
    Gpus { adapters: adapters.collect(), missing }
}

#[cfg(not(feature = "gpu"))]
fn gpus() -> Gpus {
    Gpus { missing: vec!["this build has no GPU backend; build with feature gpu".to_owned()], ..Gpus::default() }
}

impl Devices {
    fn text(&self) -> String {
        let cores = available_parallelism().map_or(1, usize::from);
        let mut text = format!("cpu     {}, {}\n\n", self.cpu, count(cores as u64, "core"));
        if !self.gpus.adapters.is_empty() {
            let mut table = plain(["gpu", "kind", "through", "driver", "backend gpu"], []);
            for ([name, kind, api, driver], unfit) in &self.gpus.adapters {
                let serves = unfit.as_ref().map_or_else(|| "runs".to_owned(), |why| format!("does not run: {why}"));
                table.add_row([name, kind, api, driver, &serves]);
            }
            text += &shown(&table);
        }
        for line in &self.gpus.missing {
            text += &format!("{}\n", bullet(line));
        }
        text += "\n";
        if self.ports.is_empty() {
            text +=
                &format!("{}\n", bullet("no serial port; plug a board in, or make a virtual one with `somatic board`"));
            return text;
        }
        let mut table = plain(["port", "what", "can be opened", "steady name"], []);
        for port in &self.ports {
            let stable_path = port.stable_path.as_ref().map(|path| path.display().to_string()).unwrap_or_default();
            table.add_row([&port.name, &port.device, port.problem.as_deref().unwrap_or("yes"), &stable_path]);
        }
        text + &shown(&table)
    }

    fn json(&self) -> Value {
        let gpus = self.gpus.adapters.iter().map(|([name, kind, api, driver], unfit)| {
            json!({"name": name, "kind": kind, "api": api, "driver": driver, "unfit": unfit})
        });
        let ports = self.ports.iter().map(
            |port| json!({"name": port.name, "what": port.device, "steady": port.stable_path, "trouble": port.problem}),
        );
        json!({
            "cpu": self.cpu,
            "gpus": gpus.collect::<Vec<_>>(),
            "missing": self.gpus.missing,
            "ports": ports.collect::<Vec<_>>(),
        })
    }
}
