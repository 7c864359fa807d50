//! Text for people on standard output and standard error.
//!
//! A reader may close the pipe before everything is written, as with `| head`. The rest is dropped: the verdict is the
//! exit code.

use std::fmt::Arguments;
use std::io::{self, ErrorKind, IsTerminal, Write};
use std::sync::Mutex;

use faceoff_judge::Verdict;
use faceoff_mesh::error::{Error, Result};

/// Why output was lost, other than by a closed pipe: a full disk.
static LOST: Mutex<Option<io::Error>> = Mutex::new(None);

/// A line on standard output.
macro_rules! tell {
    ($($words:tt)*) => { $crate::report::console::output(format_args!("{}\n", format_args!($($words)*))) };
}

/// A line on standard error.
macro_rules! note {
    ($($words:tt)*) => { $crate::report::console::aside(format_args!($($words)*)) };
}

pub(crate) use {note, tell};

/// Does it change the direction of reading, or end a line, without being visible? Then people read something other than the text.
pub fn misleads(c: char) -> bool {
    matches!(
        c,
        '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}'
    )
}

/// Neutralises a text that quotes untrusted input: no character that a terminal obeys or that changes the direction of
/// reading, and no line that a CI server takes for a command.
pub fn plain(text: &str) -> String {
    let shown = |c: char| match c {
        '\n' => c,
        '\t' => ' ',
        _ if misleads(c) || c.is_control() => '\u{fffd}',
        _ => c,
    };
    let text: String = text.chars().map(shown).collect();
    let lines = text.split('\n').map(|line| {
        let is_command = line.trim_start().starts_with("::") || line.contains("##[");
        if is_command {
            format!("\u{fffd}{}", line.replace("##[", "#\u{fffd}["))
        } else {
            line.to_owned()
        }
    });
    lines.collect::<Vec<_>>().join("\n")
}

/// Text on standard output.
pub fn output(text: Arguments) {
    write(&plain(&text.to_string()));
}

/// The answer, if there is one, as the last line; on a terminal in the colour of its verdict.
pub(super) fn answer(text: &str, verdict: Option<Verdict>) {
    let text = plain(text);
    if text.is_empty() {
        return;
    }
    let colour = verdict
        .filter(|_| has_colours(&io::stdout()))
        .map(|verdict| match verdict {
            Verdict::Agree | Verdict::Conditioned => "32",
            Verdict::Several | Verdict::Disagree => "31",
            Verdict::Undetermined => "33",
        });
    match colour {
        Some(colour) => write(&format!("\u{1b}[1;{colour}m{text}\u{1b}[0m\n")),
        None => write(&format!("{text}\n")),
    }
}

/// Is this a terminal whose user has not disabled colours (<https://no-color.org>)?
pub fn has_colours(stream: &impl IsTerminal) -> bool {
    let is_set = |name: &str| std::env::var_os(name).is_some_and(|value| !value.is_empty());
    let is_dumb = std::env::var_os("TERM").is_none_or(|term| term == "dumb");
    stream.is_terminal() && !is_set("NO_COLOR") && !is_dumb
}

/// Text by this program on standard output, unchanged.
pub fn write(text: &str) {
    let mut out = io::stdout().lock();
    if let Err(e) = out.write_all(text.as_bytes()).and_then(|()| out.flush())
        && e.kind() != ErrorKind::BrokenPipe
        && let Ok(mut lost) = LOST.lock()
    {
        *lost = Some(e);
    }
}

/// A line on standard error.
pub fn aside(text: Arguments) {
    // If standard error is closed, nobody reads it.
    let _ = writeln!(io::stderr(), "{}", plain(&text.to_string()));
}

/// Was all output written, or not wanted?
///
/// # Errors
/// Output that was lost.
pub fn check() -> Result<()> {
    let lost = LOST.lock().ok().and_then(|mut lost| lost.take());
    lost.map_or(Ok(()), |source| {
        Err(Error::Io {
            path: "standard output".into(),
            action: "write",
            source,
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_stranger_wrote_is_no_command() {
        for (text, shown) in [
            ("a name\nand β\n", "a name\nand β\n"),
            (
                "x\n::error file=a.rs::forged",
                "x\n\u{fffd}::error file=a.rs::forged",
            ),
            ("  ::stop-commands::t", "\u{fffd}  ::stop-commands::t"),
            ("x ##[error]forged", "\u{fffd}x #\u{fffd}[error]forged"),
            (
                "\u{1b}[2J\r\u{9b}31m\u{202e}",
                "\u{fffd}[2J\u{fffd}\u{fffd}31m\u{fffd}",
            ),
        ] {
            assert_eq!(plain(text), shown);
        }
    }
}
