//! Starts a browser.

use std::process::{Command, Stdio};

use somatic::internal::output::PrivateFile;
use somatic::{Error, Result};

/// What opens a file with the program that people have chosen for it.
const OPENER: &str = if cfg!(target_os = "macos") {
    "open"
} else if cfg!(windows) {
    "explorer"
} else {
    "xdg-open"
};

/// Opens `url` in a browser. Command lines are public, and the address holds a token: it is handed over in a file that only
/// its owner can read, which is to be kept while the browser may read it.
///
/// # Errors
/// There is no program that opens files.
pub(super) fn open(url: &str) -> Result<PrivateFile> {
    let page = format!(
        "<!doctype html><meta charset=utf-8><meta http-equiv=refresh content=\"0;url={url}\"><title>somatic</title>"
    );
    let file = PrivateFile::new(".html", page.as_bytes())?;
    let mut opener = Command::new(OPENER);
    opener.arg(file.path()).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    opener.spawn().map_err(|e| Error::failed(format!("cannot start a browser: {e}")).at(OPENER))?;
    Ok(file)
}
