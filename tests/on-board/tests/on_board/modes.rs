//! The modes that yield: a weight that the limit, or the spring, does not carry all the way.

use bowden_link::message::{Goal, Mode, Reference};
use bowden_link::{Limit, State, ToBoard};
use bowden_on_board_tests::cost::Cost;
use bowden_on_board_tests::host::Host;
use bowden_on_board_tests::{Failure, Outcome};

use crate::{SINE, ready};

/// m g l of the bench \[Nm\].
const WEIGHT_NM: f64 = 2.5 * 9.81 * 0.03;

/// Instructions that these modes may take beyond position mode.
const MOST_MORE: f64 = 150.0;

fn hold(host: &mut Host, mode: Mode, angle_rad: f32) -> Outcome {
    host.order(&ToBoard::SetReference(Reference::Hold(angle_rad)))?;
    host.order(&ToBoard::Enter(Goal::Run(mode)))?;
    host.reach(State::Run, 0.1)?;
    host.run(2.5)
}

/// The board believes in a load of 0.5 kg, so it accepts 0.5 rad within 0.2 N·m; with the true 2.5 kg the joint stops where
/// m g l sin θ = 0.2 N·m, and goes on when the limit is raised.
#[test]
fn hybrid_mode_stops_at_its_limit_and_goes_on_when_it_is_raised() -> Outcome {
    let mut host = ready(401)?;
    host.set("load.mass", 0.5)?;
    host.set("limits.contact_torque", 0.2)?;
    hold(&mut host, Mode::Hybrid, 0.5)?;
    let stopped_rad = host.board.bench().theta_out_rad();
    let status = host.status()?;
    println!("{stopped_rad} rad, {status:?}");
    // 10 mN·m, as at rest on the bench without a board.
    let expected_rad = (0.2 / WEIGHT_NM).asin();
    assert!((stopped_rad - expected_rad).abs() < 0.01 / WEIGHT_NM, "{stopped_rad}, expected {expected_rad}");
    assert!(status.state == State::Run && status.limits.contains(Limit::OutputTorque), "{status:?}");
    host.set("limits.contact_torque", 0.5)?;
    host.run(1.5)?;
    let status = host.status()?;
    let arrived_rad = host.board.bench().theta_out_rad();
    // Two and a half counts of the joint's encoder.
    assert!((arrived_rad - 0.5).abs() < 2.5 * std::f64::consts::TAU / 4096.0, "{arrived_rad} rad");
    assert!(status.state == State::Run && !status.limits.contains(Limit::OutputTorque), "{status:?}");
    Ok(())
}

/// A spring of 2 N·m/rad and a weight that is not carried: k (0.3 - θ) = m g l sin θ at 0.2198 rad.
#[test]
fn impedance_mode_is_a_spring_about_its_reference() -> Outcome {
    let mut host = ready(402)?;
    host.set("impedance.gravity", 0.0)?;
    host.set("impedance.stiffness", 2.0)?;
    hold(&mut host, Mode::Impedance, 0.3)?;
    let angle_rad = host.board.bench().theta_out_rad();
    println!("{angle_rad} rad");
    let balance_nm = 2.0 * (0.3 - angle_rad) - WEIGHT_NM * angle_rad.sin();
    // 8 mN·m of friction that the loop has not overcome yet, and half a count, 0.8 mrad.
    assert!(balance_nm.abs() < 0.010, "{angle_rad} rad: {balance_nm} N·m");
    assert_eq!(host.status()?.state, State::Run);
    Ok(())
}

/// Instructions of a tick that follows a sine in this mode, mean.
fn tick_instructions(mode: Mode) -> Outcome<f64> {
    let mut host = ready(403)?;
    host.order(&ToBoard::SetReference(SINE))?;
    host.order(&ToBoard::Enter(Goal::Run(mode)))?;
    host.reach(State::Run, 0.1)?;
    host.run(1.0)?;
    host.board.measure_symbol("ADC1_2")?;
    host.board.take_measurements();
    host.run(0.5)?;
    let results = host.board.take_measurements();
    let found = results.iter().find(|result| result.function.contains("ADC1_2"));
    found.map(|result| Cost::from(result).typical_instructions).ok_or_else(|| Failure("no tick".to_owned()))
}

#[test]
fn the_modes_that_yield_cost_little() -> Outcome {
    let [position, hybrid, impedance] =
        [Mode::Position, Mode::Hybrid, Mode::Impedance].map(tick_instructions);
    let (position, hybrid, impedance) = (position?, hybrid?, impedance?);
    println!("{position:.0} in position mode, {hybrid:.0} hybrid, {impedance:.0} impedance");
    assert!(hybrid > position && hybrid < position + MOST_MORE, "{hybrid} after {position}");
    assert!(impedance < position + MOST_MORE, "{impedance} after {position}");
    Ok(())
}
