//! Standard output, standard error and exit codes.

use std::borrow::Cow;
use std::io::{self, Write as _};
use std::process::ExitCode;
use std::sync::atomic::Ordering;

use somatic::internal::output::refuse_standard_output;
use somatic::internal::plain;
use somatic::output::OutputPaths;
use somatic::{Error, Result};

/// Exit code: everything was done.
pub(super) const DONE: u8 = 0;
/// Exit code: what was asked for does not hold.
pub(super) const FAILED: u8 = 1;
/// Exit code: done, but some input was never processed.
pub(super) const LOST: u8 = 3;

/// Prints `line` on standard error. A closed standard error is not a reason to stop.
pub(crate) fn say(line: &str) {
    let line = if console::colors_enabled_stderr() { plain::coloured_line(line) } else { plain::line(line) };
    let _ = writeln!(io::stderr(), "somatic: {line}");
}

/// As [`say`], for several lines.
pub(super) fn say_lines(text: &str) {
    plain::announce(&format!("somatic: {text}\n"));
}

/// Prints what the arguments are answered with, help or what is wrong with them, and gives the exit code.
pub(crate) fn answer(answer: &clap::Error) -> ExitCode {
    let (text, code) = (answer.render(), answer.exit_code());
    // What was wrong may be the name of a file, with line ends too.
    let arguments = std::env::args_os().map(|argument| argument.to_string_lossy().into_owned());
    let with_value = |argument: String| {
        let value = argument.split_once('=').map(|(_, value)| value.to_owned());
        std::iter::once(argument).chain(value)
    };
    let arguments: Vec<String> = arguments.flat_map(with_value).collect();
    let shown = |coloured: bool| {
        // Without its colours a part of an argument would be gone too.
        let text = arguments.iter().fold(text.ansi().to_string(), |text, argument| match plain::line(argument) {
            Cow::Owned(escaped) => text.replace(argument.as_str(), &escaped),
            Cow::Borrowed(_) => text,
        });
        if coloured { text } else { plain::without_colours(&text) }
    };
    let _ = if answer.use_stderr() {
        let text = shown(console::colors_enabled_stderr());
        let text = if console::colors_enabled_stderr() { plain::coloured_lines(&text) } else { plain::lines(&text) };
        io::stderr().write_all(text.as_bytes())
    } else {
        print(&shown(console::colors_enabled())).map_err(io::Error::other)
    };
    u8::try_from(code).map_or(ExitCode::FAILURE, ExitCode::from)
}

/// `line` for a terminal, with this command's colours if it has any.
pub(super) fn for_terminal(line: &str, on_stderr: bool) -> Cow<'_, str> {
    let coloured = if on_stderr { console::colors_enabled_stderr() } else { console::colors_enabled() };
    if coloured { plain::coloured_line(line) } else { plain::line(line) }
}

/// Says what of the input was never processed, and gives the exit code.
pub(super) fn tell_losses(losses: &[String]) -> u8 {
    losses.iter().for_each(|loss| say(&format!("never processed: {loss}")));
    if losses.is_empty() { DONE } else { LOST }
}

/// Refuses what goes to standard output if that was closed when the process started.
pub(super) fn refuse_closed_output() {
    if closed::OUTPUT.load(Ordering::Relaxed) {
        refuse_standard_output();
    }
}

/// Checks that there is a standard input.
pub(super) fn check_input() -> Result<()> {
    if closed::INPUT.load(Ordering::Relaxed) {
        return Err(Error::failed("it is closed; lead frames into it, or name a file").at("standard input"));
    }
    Ok(())
}

/// Whether standard streams were closed when the process started. What runs before `main` looks, as the runtime puts `/dev/null`
/// in the place of a stream that is closed: what is printed would be lost, and nobody would know.
mod closed {
    use std::sync::atomic::AtomicBool;

    pub(super) static INPUT: AtomicBool = AtomicBool::new(false);
    pub(super) static OUTPUT: AtomicBool = AtomicBool::new(false);

    #[cfg(any(target_os = "linux", target_os = "macos"))]
    mod look {
        #![expect(unsafe_code, reason = "nothing of the standard library is early enough")]

        use std::sync::atomic::Ordering;

        #[used]
        #[cfg_attr(target_os = "linux", unsafe(link_section = ".init_array"))]
        #[cfg_attr(target_os = "macos", unsafe(link_section = "__DATA,__mod_init_func"))]
        static LOOK: extern "C" fn() = look;

        extern "C" fn look() {
            for (number, is_closed) in [(0, &super::INPUT), (1, &super::OUTPUT)] {
                // SAFETY: it asks for the flags of a file that need not be there.
                is_closed.store(unsafe { libc::fcntl(number, libc::F_GETFD) } == -1, Ordering::Relaxed);
            }
        }
    }
}

/// Writes `text` to standard output. A reader that has gone is a normal end.
pub(super) fn print(text: &str) -> Result<()> {
    OutputPaths::default().add_standard_output()?;
    let text = if console::colors_enabled() { plain::coloured_lines(text) } else { plain::lines(text) };
    let mut stdout = io::stdout().lock();
    match stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush()) {
        Err(e) if e.kind() != io::ErrorKind::BrokenPipe => {
            Err(Error::failed(format!("cannot write: {e}")).at("standard output"))
        }
        _ => Ok(()),
    }
}
