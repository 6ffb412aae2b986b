//! `bowden doctor`: whether this machine and the board are ready for work, and what to do where they are not.

use std::fmt::Write;
use std::time::Duration;

use bowden_core::outcome::{Failure, Outcome};
use bowden_host_link::serial::{USB_PRODUCT, USB_VENDOR, udev_rule};
use bowden_host_link::{Client, ParameterSet, Unnoticed};
use serde::Serialize;

use super::port::timeout;
use super::{print, print_json};
use crate::machine::{Device, Machine, PROBE_VENDOR, at_least, version_of};

/// Compiler that the sources need.
const RUST_VERSION: &str = env!("CARGO_PKG_RUST_VERSION");

/// Arguments of `bowden doctor`.
#[derive(Clone, Debug, clap::Args)]
#[command(
    after_help = "Exit status 1 if something is wrong; what is missing and not needed for everything is a hint."
)]
pub struct DoctorArguments {
    /// Board to talk to as well: a serial port, `auto`, or `sim`
    #[arg(long, value_name = "PATH|auto|sim")]
    port: Option<String>,
    /// How long an answer of the board is waited for, s
    #[arg(long, value_name = "SECONDS", default_value = "1.5", value_parser = timeout)]
    timeout: Duration,
    /// Print JSON: one array, one object a check
    #[arg(long)]
    json: bool,
}

/// How a check ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
enum Grade {
    Ok,
    Hint,
    Wrong,
}

/// One thing that was looked at.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
struct Check {
    subject: &'static str,
    grade: Grade,
    found: String,
    /// What to do; empty if nothing.
    next: String,
}

impl Check {
    fn new(subject: &'static str, grade: Grade, found: impl Into<String>, next: impl Into<String>) -> Self {
        Self { subject, grade, found: found.into(), next: next.into() }
    }
}

impl DoctorArguments {
    /// Looks at everything and prints one line each.
    ///
    /// # Errors
    /// Exit status 1, if something is wrong.
    pub fn run(&self) -> Result<Outcome, Failure> {
        let machine = Machine::default();
        let mut checks = vec![
            Check::new(
                "bowden",
                Grade::Ok,
                concat!(env!("CARGO_PKG_VERSION"), ", commit ", env!("BOWDEN_REVISION")),
                "",
            ),
            compiler(version_of("rustc").as_deref()),
            probe(&machine.probes()),
            port(&machine.boards(USB_VENDOR, USB_PRODUCT)),
        ];
        if let Some(port) = &self.port {
            checks.extend(board(port, self.timeout));
        }
        if self.json {
            print_json(&checks)?;
        } else {
            print(&text(&checks))?;
        }
        let wrong: Vec<&str> =
            checks.iter().filter(|check| check.grade == Grade::Wrong).map(|check| check.subject).collect();
        match wrong.as_slice() {
            [] => Ok(Outcome::done()),
            wrong => {
                Err(Failure::failed(format!("wrong: {}; the lines above say what to do", wrong.join(", "))))
            }
        }
    }
}

fn text(checks: &[Check]) -> String {
    let mut text = String::new();
    for Check { subject, grade, found, next } in checks {
        let grade = match grade {
            Grade::Ok => "ok",
            Grade::Hint => "hint",
            Grade::Wrong => "WRONG",
        };
        let _ = writeln!(text, "{grade:5}  {subject}: {found}");
        if !next.is_empty() {
            let _ = writeln!(text, "       {next}");
        }
    }
    text
}

fn compiler(version: Option<&str>) -> Check {
    match version {
        Some(version) if at_least(version, RUST_VERSION) => {
            Check::new("compiler", Grade::Ok, format!("rustc {version}"), "")
        }
        Some(version) => Check::new(
            "compiler",
            Grade::Hint,
            format!("rustc {version}, the sources need {RUST_VERSION}"),
            "in the sources rustup takes the right one by itself; elsewhere: rustup update",
        ),
        None => Check::new(
            "compiler",
            Grade::Hint,
            "no rustc: the firmware cannot be built here",
            "install it from https://rustup.rs if you want to",
        ),
    }
}

fn probe(probes: &[Device]) -> Check {
    let Some(first) = probes.first() else {
        return Check::new(
            "probe",
            Grade::Hint,
            "no ST-LINK on USB: a board cannot be flashed over its probe",
            "connect the Nucleo board's USB socket CN1, which is its probe, or flash over the board's own USB lines: bowden flash ELF --dfu",
        );
    };
    match first.forbidden() {
        Some(file) => Check::new(
            "probe",
            Grade::Wrong,
            format!("{} {}: this user may not open {}", first.product, first.serial, file.display()),
            udev_rule("usb", PROBE_VENDOR, None),
        ),
        None => Check::new("probe", Grade::Ok, format!("{} {}", first.product, first.serial), ""),
    }
}

fn port(boards: &[Device]) -> Check {
    let Some(first) = boards.first() else {
        return Check::new(
            "port",
            Grade::Hint,
            format!("no driver board on USB ({USB_VENDOR:04x}:{USB_PRODUCT:04x})"),
            "connect the board's own USB lines, or work with --port sim",
        );
    };
    if let Some(file) = first.forbidden() {
        let found = format!("this user may not open {}", file.display());
        let rule = udev_rule("tty", USB_VENDOR, Some(USB_PRODUCT));
        return Check::new("port", Grade::Wrong, found, rule);
    }
    let names: Vec<String> =
        boards.iter().flat_map(|board| &board.files).map(|file| file.display().to_string()).collect();
    Check::new("port", Grade::Ok, format!("{}, serial number {}", names.join(", "), first.serial), "")
}

/// The board, and what its parameters keep it from noticing.
fn board(port: &str, timeout: Duration) -> Vec<Check> {
    let mut client = match bowden_host_link::connect(port, timeout) {
        Ok(client) => client,
        Err(error) => return vec![Check::new("board", Grade::Wrong, error.to_string(), "")],
    };
    let mut checks = vec![state(&mut client)];
    // A board that does not answer was named.
    if let Ok(parameters) = ParameterSet::read(&mut client)
        && let Some(Unnoticed { found, next }) = parameters.unnoticed()
    {
        checks.push(Check::new("parameters", Grade::Hint, found, next));
    }
    checks
}

fn state(client: &mut Client) -> Check {
    let status = client.status();
    let greeting = client.greeting();
    // An image that was built outside a repository names no revision.
    let image = format!("{} {}", greeting.firmware, greeting.revision);
    let found = format!("{}, firmware {}", greeting.board, image.trim_end());
    match status {
        Err(error) => Check::new("board", Grade::Wrong, format!("{found}: {error}"), ""),
        Ok(status) => match status.fault {
            Some(fault) => {
                Check::new("board", Grade::Wrong, format!("{found}: {fault}"), "see `bowden faults`")
            }
            None if greeting.firmware.as_str() != env!("CARGO_PKG_VERSION") => Check::new(
                "board",
                Grade::Hint,
                format!("{found}, this program {}: they speak the same protocol", env!("CARGO_PKG_VERSION")),
                "flash the firmware of this version to have what its change log says",
            ),
            None => Check::new("board", Grade::Ok, format!("{found}, state {}", status.state), ""),
        },
    }
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use super::*;

    fn device(file: &str) -> Device {
        Device { product: "board".into(), serial: "42".into(), files: vec![PathBuf::from(file)] }
    }

    #[test]
    fn a_port_that_may_not_be_opened_is_wrong_and_the_rule_is_offered() {
        let check = port(&[device("/no/such/port")]);
        assert_eq!(check.grade, Grade::Wrong);
        for part in [
            "SUBSYSTEM==\"tty\"",
            "ATTRS{idVendor}==\"1209\"",
            "ATTRS{idProduct}==\"b0d7\"",
            "rules.d/70-bowden.rules",
        ] {
            assert!(check.next.contains(part), "{part}: {}", check.next);
        }
        assert_eq!(port(&[device("/dev/null")]).grade, Grade::Ok);
        assert_eq!(port(&[]).grade, Grade::Hint);
        assert!(probe(&[device("/no/such/probe")]).next.contains("0483"));
    }

    #[test]
    fn a_compiler_that_is_too_old_or_missing_is_a_hint() {
        assert_eq!(compiler(Some(RUST_VERSION)).grade, Grade::Ok);
        assert_eq!(compiler(Some("1.70.0")).grade, Grade::Hint);
        assert_eq!(compiler(None).grade, Grade::Hint);
    }
}
