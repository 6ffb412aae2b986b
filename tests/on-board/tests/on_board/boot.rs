//! From power-on to the greeting.

use bowden_board::{Level, ResetCause};
use bowden_link::message::Boot;
use bowden_link::{PROTOCOL_VERSION, SCHEMA, State};
use bowden_on_board_tests::Outcome;

use crate::switched_on;

#[test]
fn the_port_is_the_boards_and_the_greeting_fits() -> Outcome {
    let mut host = switched_on(1)?;
    // Ten times faster than any user notices.
    assert!(host.board.time_s() < 0.1, "port and greeting after {} s", host.board.time_s());
    let identity = host.board.usb_identity();
    assert_eq!((identity.vendor_id, identity.product_id), (0x1209, 0xb0d7));
    assert!(!identity.manufacturer.is_empty() && !identity.product.is_empty() && !identity.serial.is_empty());
    let greeting = host.greet()?;
    assert_eq!((greeting.protocol_version, greeting.schema), (PROTOCOL_VERSION, SCHEMA));
    assert_eq!(greeting.boot, Boot::Power);
    assert_eq!(greeting.firmware.as_str(), env!("CARGO_PKG_VERSION"));
    assert_eq!(greeting.parameters, bowden_control::parameters::Parameters::COUNT);
    let status = host.status()?;
    assert_eq!((status.state, status.fault), (State::Off, None));
    assert_eq!(status.period_ns, 100_000);
    // The bridge stays open.
    assert_eq!(host.board.pwm().duty, None);
    // The tick began with its first sample: the marker and the firmware count alike, but for those since the answer.
    assert!(host.ticks.begun.abs_diff(host.status()?.tick) <= 20, "{} ticks, {status:?}", host.ticks.begun);
    Ok(())
}

#[test]
fn the_log_is_read_and_says_what_started_the_board() -> Outcome {
    let mut host = switched_on(1)?;
    host.run(1.2)?;
    for line in host.log() {
        println!("{line}");
    }
    let first = host.log().first().expect("a line");
    assert!(first.level == Level::Info && first.text.contains("boot by Power"), "{first}");
    // State, longest tick and losses once a second.
    let regular = host.log().iter().find(|line| line.text.contains("lost 0")).expect("a regular line");
    assert!((0.9..1.2).contains(&regular.at_s), "{regular}");
    // Not more than a line each 50 ms in the mean.
    assert!(host.log().len() < 24, "{} lines in 1.2 s", host.log().len());
    Ok(())
}

#[test]
fn the_greeting_tells_the_cause_of_a_reset() -> Outcome {
    let mut host = switched_on(1)?;
    assert_eq!(host.reset(ResetCause::Pin)?.boot, Boot::Pin);
    assert_eq!(host.reset(ResetCause::PowerOn)?.boot, Boot::Power);
    assert_eq!(host.status()?.state, State::Off);
    Ok(())
}
