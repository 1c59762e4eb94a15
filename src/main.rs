//! The command `somatic`: parse, call, exit code.

mod cli;
#[cfg(feature = "paper")]
mod experiments;

use std::process::ExitCode;

fn main() -> ExitCode {
    quieten_mesa();
    let arguments = match cli::arguments() {
        Ok(arguments) => arguments,
        Err(answer) => return cli::answer(&answer),
    };
    match cli::run(&arguments) {
        Ok(code) => ExitCode::from(code),
        Err(error) => {
            cli::say(&format!("{}: {error}", console::style("error").red().bold().for_stderr()));
            ExitCode::from(error.exit_code())
        }
    }
}

/// Mesa's Vulkan loader layer asks for a Wayland display and prints `error: XDG_RUNTIME_DIR is invalid` on every start
/// outside a login session (over ssh, in a container), though nothing is wrong.
fn quieten_mesa() {
    if cfg!(target_os = "linux") && std::env::var_os("XDG_RUNTIME_DIR").is_none() {
        // SAFETY: this is the first thing main does, and no other thread is there to read the environment meanwhile.
        #[expect(unsafe_code, reason = "there is no other way to tell a library in this process")]
        unsafe {
            std::env::set_var("XDG_RUNTIME_DIR", std::env::temp_dir());
        }
    }
}
