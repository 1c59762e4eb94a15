//! The serial ports of this machine, without opening any: on some boards that would pull the reset line.

use std::path::{Path, PathBuf};

use serialport::{SerialPortInfo, SerialPortType};

use crate::error::{Error, Result};

/// A serial port, and whether it can be used.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct PortSummary {
    /// What to open, such as `/dev/ttyUSB0`.
    pub name: String,
    /// How it is connected: bus, maker, product and serial number as far as they are known.
    pub what: String,
    /// A name that stays the same whichever port is plugged in first, where the system gives one.
    pub steady: Option<PathBuf>,
    /// Why it cannot be used now, and what to do about that.
    pub trouble: Option<String>,
}

/// The serial ports that the system names. Pseudo-terminals are not among them; they open like all others.
///
/// # Errors
/// The system does not say.
pub fn serial_ports() -> Result<Vec<PortSummary>> {
    let mut found = serialport::available_ports()
        .map_err(|e| Error::failed(format!("the system does not say which serial ports it has: {e}")))?;
    found.sort_by(|a, b| a.port_name.cmp(&b.port_name));
    let steady = links(Path::new("/dev/serial/by-id"));
    Ok(found.into_iter().map(|port| summary(port, &steady)).collect())
}

fn summary(port: SerialPortInfo, steady: &[(PathBuf, PathBuf)]) -> PortSummary {
    let path = Path::new(&port.port_name);
    PortSummary {
        what: what(&port.port_type),
        steady: steady.iter().find(|(_, target)| target == path).map(|(link, _)| link.clone()),
        trouble: trouble(path),
        name: port.port_name,
    }
}

fn what(kind: &SerialPortType) -> String {
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

/// The symbolic links in `folder`, with what they lead to.
fn links(folder: &Path) -> Vec<(PathBuf, PathBuf)> {
    let Ok(entries) = std::fs::read_dir(folder) else { return Vec::new() };
    let mut links: Vec<_> =
        entries.flatten().filter_map(|entry| Some((entry.path(), entry.path().canonicalize().ok()?))).collect();
    links.sort();
    links
}

/// Why `port` cannot be opened for reading and writing, as far as its permissions say.
#[cfg(unix)]
fn trouble(port: &Path) -> Option<String> {
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
fn trouble(_: &Path) -> Option<String> {
    None
}

#[cfg(unix)]
fn groups() -> String {
    std::fs::read_to_string("/etc/group").unwrap_or_default()
}

/// What `groups`, a file like /etc/group, calls the group `gid`.
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
        assert_eq!(what(&SerialPortType::UsbPort(usb)), "USB FTDI 0403:6001 no. A50285BI");
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
        assert_eq!((seen.steady, seen.trouble), (Some(by_id.join("usb-board")), None));
        assert!(trouble(&by_id.join("gone")).is_some());
    }

    #[cfg(unix)]
    #[test]
    fn a_group_has_its_name() {
        let groups = "root:x:0:\ndialout:x:20:ann,bob\nbroken\nplugdev:x:46:\n";
        assert_eq!(group(groups, 20).as_deref(), Some("dialout"));
        assert_eq!(group(groups, 21), None);
    }
}
