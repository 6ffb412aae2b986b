//! The release images on the emulated board.

mod boot;
mod boot_loader;
mod bridge;
mod calibrate;
mod campaign;
mod clock;
mod closed_loop;
mod conformance;
mod corrections;
mod coverage;
mod determinism;
mod directions;
mod endurance;
mod facts;
mod failures;
mod faults;
mod first_hour;
mod flash;
mod flash_over_usb;
#[path = "../../../../host-tools/tests/common/foxglove.rs"]
mod foxglove_client;
mod investigate;
mod load;
mod log;
mod modes;
mod monitor;
mod motor_lead;
mod moved_sheath;
mod parameters;
mod recover;
mod replay_control;
mod replug;
mod ripple_table;
mod run;
#[path = "../../../../host-tools/tests/common/screen.rs"]
#[expect(dead_code, reason = "another part of it is for the tests of the host tools")]
mod screen;
mod stop;
mod terminal;
mod torque_mode;
mod usb;

use bowden_board::Board;
use bowden_link::message::{Reference, Shape};
use bowden_on_board_tests::host::Host;
use bowden_on_board_tests::{Outcome, image};

/// A board with power just applied and a host that has greeted it.
fn switched_on(seed: u64) -> Outcome<Host> {
    Host::connect(Board::builder(&image::firmware()?).seed(seed).build()?)
}

/// The same, tested and ready.
fn ready(seed: u64) -> Outcome<Host> {
    let mut host = switched_on(seed)?;
    host.make_ready()?;
    Ok(host)
}

/// 0.5 rad at 0.2 Hz.
const SINE: Reference =
    Reference::Generated { shape: Shape::Sine, amplitude: 0.5, offset: 0.0, frequency_hz: 0.2 };
