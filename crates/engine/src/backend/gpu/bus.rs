//! GPUs that sit on the bus while no driver answers for them.

use std::path::Path;

use super::AdapterSummary;

use crate::limits::{self, MAX_SYSTEM_BYTES};

/// The GPUs on the PCI bus whose maker none of `answering` has: maker and place of each, and how to make it answer. Empty where
/// the system does not tell (it does on Linux).
#[must_use]
pub fn silent_gpus(answering: &[AdapterSummary]) -> Vec<(String, &'static str)> {
    on_bus(Path::new("/sys/bus/pci/devices"), answering)
}

fn on_bus(devices: &Path, answering: &[AdapterSummary]) -> Vec<(String, &'static str)> {
    let Ok(entries) = std::fs::read_dir(devices) else { return Vec::new() };
    let mut silent: Vec<(String, &str)> = entries
        .flatten()
        .filter_map(|entry| {
            let number = |file: &str| {
                let text = limits::read_to_string(entry.path().join(file), MAX_SYSTEM_BYTES).ok()?;
                u32::from_str_radix(text.trim().trim_start_matches("0x"), 16).ok()
            };
            // Class 03 is display controllers, with a screen or without.
            let vendor = (number("class")? >> 16 == 3).then(|| number("vendor"))??;
            if answering.iter().any(|adapter| adapter.vendor == vendor) {
                return None;
            }
            let (maker, remedy) = remedy(vendor)?;
            let place = entry.file_name();
            Some((format!("{maker} GPU at {}", place.to_string_lossy()), remedy))
        })
        .collect();
    silent.sort();
    silent
}

/// Who makes GPUs, and how theirs are made to answer. Others (a server's console, a virtual screen) compute nothing.
fn remedy(vendor: u32) -> Option<(&'static str, &'static str)> {
    const MESA: &str =
        "install Mesa's Vulkan drivers (mesa-vulkan-drivers), and see that you may open /dev/dri/renderD128";
    match vendor {
        0x10DE => Some((
            "NVIDIA",
            "install NVIDIA's driver with its Vulkan part; in a container, set NVIDIA_DRIVER_CAPABILITIES=all",
        )),
        0x1002 => Some(("AMD", MESA)),
        0x8086 => Some(("Intel", MESA)),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_gpus_without_a_driver_are_reported() {
        let bus = tempfile::tempdir().unwrap();
        for (place, class, vendor) in [
            ("0000:00:00.0", "0x060000\n", "0x8086\n"),
            ("0000:00:02.0", "0x030000\n", "0x8086\n"),
            ("0000:01:00.0", "0x030200\n", "0x10de\n"),
            ("0000:02:00.0", "0x030000\n", "0x1a03\n"),
            ("0000:03:00.0", "oops\n", "0x10de\n"),
        ] {
            let device = bus.path().join(place);
            std::fs::create_dir(&device).unwrap();
            std::fs::write(device.join("class"), class).unwrap();
            std::fs::write(device.join("vendor"), vendor).unwrap();
        }
        let intel = AdapterSummary {
            name: "UHD".into(),
            api: "Vulkan".into(),
            kind: "integrated GPU",
            driver: String::new(),
            vendor: 0x8086,
            unfit: None,
        };
        let silent = |answering: &[AdapterSummary]| {
            on_bus(bus.path(), answering).into_iter().map(|(gpu, _)| gpu).collect::<Vec<_>>()
        };
        assert_eq!(silent(&[]), ["Intel GPU at 0000:00:02.0", "NVIDIA GPU at 0000:01:00.0"]);
        assert_eq!(silent(&[intel]), ["NVIDIA GPU at 0000:01:00.0"]);
        assert!(on_bus(&bus.path().join("none"), &[]).is_empty());
    }
}
