//! A command line that cannot be understood, told in one line.

use std::ffi::OsString;

use clap::Command;
use clap::error::{ContextKind, ContextValue, ErrorKind};

/// What is wrong with `arguments`, where an option belongs that stands in the wrong place, and whose help tells more.
pub fn line(error: &clap::Error, program: &Command, arguments: &[OsString]) -> String {
    let text = error.render().to_string();
    let parts: Vec<&str> = text
        .lines()
        .map(str::trim)
        .take_while(|line| !line.starts_with("Usage:") && !line.starts_with("For more information"))
        .filter(|line| !line.is_empty())
        .collect();
    let what = parts.join(" ").replace(" tip: ", "; ");
    let what = what.strip_prefix("error: ").unwrap_or(&what);
    let named = named(program, arguments);
    let place =
        place(error, &named).map_or_else(String::new, |before| format!("; it belongs before `{before}`"));
    let names: Vec<&str> = named.iter().map(|command| command.get_name()).collect();
    format!("{what}{place}; see `{} --help`", names.join(" "))
}

/// The program and the commands that are named, each one of the command before it.
fn named<'c>(program: &'c Command, arguments: &[OsString]) -> Vec<&'c Command> {
    let mut named = vec![program];
    for argument in arguments.iter().skip(1) {
        named.extend(named[named.len() - 1].find_subcommand(argument));
    }
    named
}

/// The command before which an option belongs that the last one does not know: it is one of a command above it.
fn place<'c>(error: &clap::Error, named: &[&'c Command]) -> Option<&'c str> {
    let (ErrorKind::UnknownArgument, Some(ContextValue::String(option))) =
        (error.kind(), error.get(ContextKind::InvalidArg))
    else {
        return None;
    };
    let option = option.strip_prefix("--")?;
    let has = |command: &Command| command.get_arguments().any(|argument| argument.get_long() == Some(option));
    named.windows(2).find(|pair| has(pair[0])).map(|pair| pair[1].get_name())
}
