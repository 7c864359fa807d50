//! Help in two sizes: `-h` fits a screen of 80 × 24, `--help` has everything.

use std::fmt::Write as _;

use clap::{Arg, Command, CommandFactory};

use super::args::Arguments;

/// The commands that most users need, which come first.
const FIRST: [&str; 6] = ["verify", "compare", "judge", "solve", "new", "mesh"];

/// The options that `-h` shows of commands that have many; of the others it shows all but [`COMMON`].
const SHORT: [(&str, &[&str]); 8] = [
    (
        "verify",
        &[
            "engines", "methods", "n", "diagnose", "record", "run", "install", "json", "report",
        ],
    ),
    (
        "compare",
        &[
            "rtol", "atol", "field", "only", "map", "out", "junit", "json", "report",
        ],
    ),
    (
        "judge",
        &["scene", "method", "field", "mesh", "n", "json", "report"],
    ),
    (
        "solve",
        &[
            "engine", "method", "n", "accuracy", "certify", "linear", "out", "json", "report",
        ],
    ),
    (
        "study",
        &[
            "engines", "methods", "finest", "budget", "resume", "json", "report",
        ],
    ),
    (
        "stress",
        &["engines", "methods", "families", "junit", "json", "report"],
    ),
    (
        "mesh convert",
        &["format", "encoding", "lossy", "json", "report"],
    ),
    ("mesh make", &["n", "format", "json", "report"]),
];

/// Options that most commands have, which `-h` leaves to `--help`.
const COMMON: [&str; 9] = [
    "quiet",
    "badge",
    "allow_outside",
    "ranks",
    "launcher",
    "keep",
    "tolerance",
    "max_iterations",
    "msh_version",
];

/// The most letters of a line about a command or an option in `-h`.
const LINE: usize = 48;

/// Environment variables, at the end of the long help.
const ENVIRONMENT: &str = "\
Environment:
  FACEOFF_LOG            Log messages on standard error: info or debug
  FACEOFF_PYTHON         The Python that has dolfinx, or another code of a form
  FACEOFF_MESHIO_PYTHON  The Python that has meshio
  FACEOFF_SANDBOX        `require`: every command runs other codes as with --sandbox
  NO_COLOR               No colours on a terminal";

/// The command line as completions and manual pages have it.
pub(super) fn plain() -> Command {
    Arguments::command().after_long_help(ENVIRONMENT)
}

/// The command line, whose help has the first commands first; `is_short` where the help is to fit a screen.
pub(super) fn command(is_short: bool) -> Command {
    let known = Arguments::command();
    let (mut first, mut more) = (String::new(), String::from("More:\n"));
    let shown = known.get_subcommands().filter(|c| !c.is_hide_set());
    let mut shown: Vec<(&str, String)> = shown
        .map(|c| (c.get_name(), c.get_about().map(ToString::to_string)))
        .map(|(name, about)| (name, about.unwrap_or_default()))
        .collect();
    shown.sort_by_key(|(name, _)| FIRST.iter().position(|f| f == name).unwrap_or(FIRST.len()));
    for (name, about) in &shown {
        let to = if FIRST.contains(name) {
            &mut first
        } else {
            &mut more
        };
        let _ = writeln!(to, "  {name:<11}  {about}");
    }
    let names: Vec<&str> = shown
        .iter()
        .skip(FIRST.len())
        .map(|(name, _)| *name)
        .collect();
    let template = format!(
        "{{about-with-newline}}\n{{usage-heading}} {{usage}}\n\nCommands:\n{first}\n{{all-args}}{{after-help}}"
    );
    // The template lists the commands.
    let all = Arguments::command()
        .help_template(template)
        .override_usage("faceoff [OPTIONS] <COMMAND>")
        .after_help(format!("More (see --help): {}", names.join(", ")))
        .after_long_help(format!("{more}\n{ENVIRONMENT}"))
        .mut_subcommands(|c| c.hide(true));
    if !is_short {
        return all;
    }
    all.mut_subcommands(|c| shortened(c, ""))
        .mut_args(|argument| match argument.is_global_set() {
            true => argument.hide(true),
            false => argument,
        })
}

/// A command, and those below it, with the options of [`SHORT`] in `-h`.
fn shortened(command: Command, above: &str) -> Command {
    let name = format!("{above}{}", command.get_name());
    let short = SHORT.iter().find(|(of, _)| *of == name);
    let command = command.mut_args(|argument| {
        let id = argument.get_id().as_str();
        let is_shown = short.map_or(!COMMON.contains(&id), |(_, shown)| shown.contains(&id));
        match argument.is_positional() || is_shown {
            true => brief(argument),
            false => argument.hide(true),
        }
    });
    let all = format!("All options: faceoff {name} --help");
    let above = format!("{name} ");
    command
        .after_help(all)
        .mut_subcommands(|c| shortened(c, &above))
}

/// `-h` has the first clause of what an option does.
fn brief(argument: Arg) -> Arg {
    let Some(full) = argument.get_help().map(ToString::to_string) else {
        return argument;
    };
    let ends = [": ", "; ", ", as in", " [default", " (", ", instead"].map(|end| full.find(end));
    let end = ends.into_iter().flatten().filter(|end| *end > 0).min();
    let mut short = full[..end.unwrap_or(full.len())].to_owned();
    if short.chars().count() > LINE {
        let cut: String = short.chars().take(LINE - 1).collect();
        short = format!(
            "{} …",
            cut.rsplit_once(' ').map_or(&*cut, |(start, _)| start)
        );
    }
    argument.help(short)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The help of each command as `-h` prints it where a terminal has 80 columns.
    fn screens(command: &mut Command, name: &str, found: &mut Vec<(String, usize)>) {
        let lines = command.render_help().to_string().lines().count();
        found.push((name.to_owned(), lines));
        let below: Vec<String> = command
            .get_subcommands()
            .map(|c| c.get_name().to_owned())
            .collect();
        for below in below {
            let name = format!("{name} {below}");
            screens(command.find_subcommand_mut(&below).unwrap(), &name, found);
        }
    }

    #[test]
    fn short_help_fits_a_screen() {
        let mut command = command(true).term_width(80);
        command.build();
        let mut found = Vec::new();
        screens(&mut command, "faceoff", &mut found);
        found.retain(|(name, lines)| *lines > 24 && !name.contains(" help"));
        assert!(found.is_empty(), "{found:?}");
    }

    #[test]
    fn every_option_of_the_short_help_is_one() {
        let full = Arguments::command();
        for (name, shown) in SHORT {
            let mut command = &full;
            for part in name.split(' ') {
                command = command.find_subcommand(part).expect(name);
            }
            for option in shown {
                let is_one = command.get_arguments().any(|a| a.get_id() == option);
                assert!(is_one, "{name} --{option}");
            }
        }
    }
}
