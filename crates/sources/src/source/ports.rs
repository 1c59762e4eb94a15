//! Lists this machine's serial ports without opening any: opening resets some boards.

use std::path::{Path, PathBuf};

use serialport::{SerialPortInfo, SerialPortType};

use crate::error::{Result, failed};
use crate::limits::{self, MAX_SYSTEM_BYTES};

/// A serial port, and whether it can be used.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct PortSummary {
    /// The name to open, such as `/dev/ttyUSB0`.
    pub name: String,
    /// Bus, maker, product and serial number as far as known.
    pub device: String,
    /// A path that does not depend on the order of plugging in, if the system has one.
    pub stable_path: Option<PathBuf>,
    /// Why it cannot be opened, and what to do.
    pub problem: Option<String>,
}

/// The serial ports that the system lists. Pseudo-terminals are not listed, but can be opened.
///
/// # Errors
/// The system cannot list them.
pub fn serial_ports() -> Result<Vec<PortSummary>> {
    let mut found =
        serialport::available_ports().map_err(|e| failed!("the system does not say which serial ports it has: {e}"))?;
    found.sort_by(|a, b| a.port_name.cmp(&b.port_name));
    let stable_path = links(Path::new("/dev/serial/by-id"));
    Ok(found.into_iter().map(|port| summary(port, &stable_path)).collect())
}

fn summary(port: SerialPortInfo, stable_path: &[(PathBuf, PathBuf)]) -> PortSummary {
    let path = Path::new(&port.port_name);
    PortSummary {
        device: device(&port.port_type),
        stable_path: stable_path.iter().find(|(_, target)| target == path).map(|(link, _)| link.clone()),
        problem: problem(path),
        name: port.port_name,
    }
}

fn device(kind: &SerialPortType) -> String {
    match kind {
        SerialPortType::UsbPort(usb) => {
            let mut words = vec!["USB".to_owned()];
            words.extend(usb.manufacturer.clone());
            words.extend(usb.product.clone());
            words.push(format!("{:04x}:{:04x}", usb.vid, usb.pid));
            words.extend(usb.serial_number.iter().map(|number| format!("no. {number}")));
            words.join(" ")
        }
        SerialPortType::PciPort => "built in".to_owned(),
        SerialPortType::BluetoothPort => "Bluetooth".to_owned(),
        SerialPortType::Unknown => "unknown".to_owned(),
    }
}

/// The symbolic links in `folder` with their targets.
fn links(folder: &Path) -> Vec<(PathBuf, PathBuf)> {
    let Ok(entries) = std::fs::read_dir(folder) else { return Vec::new() };
    let mut links: Vec<_> =
        entries.flatten().filter_map(|entry| Some((entry.path(), entry.path().canonicalize().ok()?))).collect();
    links.sort();
    links
}

/// Why `port`'s permissions do not allow reading and writing.
#[cfg(unix)]
fn problem(port: &Path) -> Option<String> {
    use rustix::fs::{Access, access};
    use rustix::io::Errno;
    use std::os::unix::fs::MetadataExt;

    match access(port, Access::READ_OK | Access::WRITE_OK) {
        Ok(()) => None,
        Err(Errno::ACCESS) => {
            let group = std::fs::metadata(port).ok().and_then(|of| group(&groups(), of.gid()));
            Some(match group {
                Some(group) if group != "root" => {
                    format!("no permission; `sudo usermod -aG {group} $USER`, then log in again")
                }
                _ => format!("no permission; `sudo chmod a+rw {}`, or a udev rule", port.display()),
            })
        }
        Err(e) => Some(e.to_string()),
    }
}

#[cfg(not(unix))]
fn problem(_: &Path) -> Option<String> {
    None
}

#[cfg(unix)]
fn groups() -> String {
    limits::read_to_string("/etc/group", MAX_SYSTEM_BYTES).unwrap_or_default()
}

/// The name of the group `gid` in `groups`, the text of /etc/group.
#[cfg(unix)]
fn group(groups: &str, gid: u32) -> Option<String> {
    groups.lines().find_map(|line| {
        let mut parts = line.split(':');
        let name = parts.next()?;
        (parts.nth(1)?.parse() == Ok(gid)).then(|| name.to_owned())
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use serialport::UsbPortInfo;

    #[test]
    fn a_usb_port_says_what_hangs_on_it() {
        let usb = UsbPortInfo {
            vid: 0x0403,
            pid: 0x6001,
            serial_number: Some("A50285BI".into()),
            manufacturer: Some("FTDI".into()),
            product: None,
        };
        assert_eq!(device(&SerialPortType::UsbPort(usb)), "USB FTDI 0403:6001 no. A50285BI");
    }

    #[cfg(unix)]
    #[test]
    fn a_port_is_known_by_its_steady_name_too() {
        let folder = tempfile::tempdir().unwrap();
        let port = folder.path().canonicalize().unwrap().join("ttyX0");
        std::fs::write(&port, "").unwrap();
        let by_id = folder.path().join("by-id");
        std::fs::create_dir(&by_id).unwrap();
        std::os::unix::fs::symlink(&port, by_id.join("usb-board")).unwrap();
        std::os::unix::fs::symlink("nowhere", by_id.join("gone")).unwrap();
        let info = SerialPortInfo { port_name: port.display().to_string(), port_type: SerialPortType::PciPort };
        let seen = summary(info, &links(&by_id));
        assert_eq!((seen.stable_path, seen.problem), (Some(by_id.join("usb-board")), None));
        assert!(problem(&by_id.join("gone")).is_some());
    }

    #[cfg(unix)]
    #[test]
    fn a_group_has_its_name() {
        let groups = "root:x:0:\ndialout:x:20:ann,bob\nbroken\nplugdev:x:46:\n";
        assert_eq!(group(groups, 20).as_deref(), Some("dialout"));
        assert_eq!(group(groups, 21), None);
    }
}
