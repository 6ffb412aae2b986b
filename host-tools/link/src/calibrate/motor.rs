//! Direction of the motor and resistance of its winding, at low torque, each run after the board's own checks.
//!
//! The joint is asked for half and the whole of a quarter of `limits.torque`, in both directions, with `limits.current` lowered as far as
//! the board says that this torque can be reached. `R = dV/di` between the two levels of a direction, with `V = duty·bus − k_t N omega`: the dead time of
//! the bridge and the zero of the current cancel. Friction of the sheaths decides how much current a torque takes, so either level may have
//! more of it. A joint that turns the wrong way is stopped after 0.9°; then `bridge.direction` is changed and the first run repeated.
//!
//! | measured | possible | from |
//! |---|---|---|
//! | bus voltage | `supervisor.bus_minimum` to `bus_maximum` | the supply of the bridge is on |
//! | turn of the input pulley | towards the torque, in one of both directions | else cables or encoders contradict the motor |
//! | turn of the joint | up to 0.6 rad | low torque on a loaded joint |
//! | difference of the currents | ten times their noise, with the sign of the duty | a motor that is connected |
//! | R of both directions | within 20 % of each other | a contact that is loose |
//! | R | within a factor of 2 of `motor.resistance`, or the person confirms it | the data sheet |

use std::ops::ControlFlow;

use bowden_control::parameters::Reach;
use bowden_link::message::{Mode, Reference};

use super::Trouble;
use super::bench::{Bench, short};
use super::dialog::{done, yes};
use super::sheet::{Motor, Sheet};
use crate::conversion::Conversion;
use crate::course::Course;
use crate::session::RunEnd;

/// Share of `limits.torque` that is asked for.
const TORQUE_SHARE: f64 = 0.25;

/// Share of what the joint can do that is not exceeded.
const REACH_SHARE: f64 = 0.9;

/// Steps in which `limits.current` is lowered.
const CURRENT_STEPS: u8 = 20;

/// Least value of `limits.current`, A.
const LEAST_CURRENT_A: f32 = 0.05;

/// When the joint has come to rest, and when a run ends, s.
const SETTLED_S: f64 = 0.7;
const END_S: f64 = 1.1;

/// Turn of the input pulley that shows that the motor turns it, rad: 30 counts.
const TURN_RAD: f64 = 0.046;

/// Turn the wrong way at which a run ends, rad: 10 counts, before a tendon is slack.
const WRONG_RAD: f64 = 0.0153;

/// Turn of the joint that is not exceeded, rad.
const FARTHEST_RAD: f64 = 0.6;

/// Current over its noise in the mean of a run, and R of one direction over the other.
const SIGMAS: f64 = 10.0;
const APART: f64 = 0.2;

/// What a run at one torque showed.
#[derive(Clone, Copy, Debug, Default)]
struct Held {
    /// Turn of the input pulley when it ended, rad.
    turned_rad: f64,
    /// Mean voltage at the winding without back-emf, V.
    winding_v: f64,
    /// Mean current, A.
    current_a: f64,
    /// Standard error of it, A.
    unsure_a: f64,
}

pub(super) fn run(bench: &mut Bench, sheet: &mut Sheet, at: &str) -> Result<(), Trouble> {
    bench.set(&sheet.parameters())?;
    bench.tendons(true)?;
    let control = bench.session.parameters().control();
    let reach_nm = f64::from(Reach::of(&control, Mode::Torque).torque);
    let torque_nm = (TORQUE_SHARE * bench.value("limits.torque")?).min(REACH_SHARE * reach_nm);
    let text = format!(
        "Switch the supply of the bridge on. The joint will turn by some degrees under {} N·m, to both sides: keep clear.",
        short(torque_nm)
    );
    done(bench.dialog, &text)?;
    let look = bench.look()?;
    let bus_v = look.bus.mean() * bench.value("bridge.bus_gain")?;
    let (least_v, most_v) = (bench.value("supervisor.bus_minimum")?, bench.value("supervisor.bus_maximum")?);
    if !(least_v..=most_v).contains(&bus_v) {
        return Err(Trouble::Refused(format!(
            "bus voltage {} V, expected {least_v} to {most_v} V; switch the supply of the bridge on",
            short(bus_v)
        )));
    }
    let names = ["limits.current", "bridge.direction"];
    let before =
        names.map(|name| bench.session.parameters().find(name).map(|found| (found.index, found.value)));
    let [current, direction] = before;
    let before = [current?, direction?];
    let measured = measure(bench, torque_nm, before);
    let restored = bench.session.replace_parameters(&before);
    let (direction, [positive_ohm, negative_ohm]) = measured?;
    restored?;
    let resistance_ohm = 0.5 * (positive_ohm + negative_ohm);
    let apart_ohm = (positive_ohm - negative_ohm).abs();
    if apart_ohm > APART * resistance_ohm || resistance_ohm <= 0.0 {
        return Err(Trouble::Refused(format!(
            "R is {} ohm one way and {} ohm the other, expected both within 20 %; look for a loose contact at the motor",
            short(positive_ohm),
            short(negative_ohm)
        )));
    }
    let believed_ohm = bench.value("motor.resistance")?;
    bench.dialog.show(&format!(
        "  direction {direction:+}, R {} ohm, spread {}\n",
        short(resistance_ohm),
        short(apart_ohm / 2.0)
    ))?;
    if !(0.5..=2.0).contains(&(resistance_ohm / believed_ohm)) {
        let question = format!(
            "R is {} ohm with its leads, motor.resistance {believed_ohm} ohm: is that the motor?",
            short(resistance_ohm)
        );
        if !yes(bench.dialog, &question)? {
            return Err(Trouble::Refused(format!(
                "R of {} ohm; check motor and leads",
                short(resistance_ohm)
            )));
        }
    }
    sheet.motor = Some(Motor {
        at: at.to_owned(),
        torque_nm: short(torque_nm),
        direction,
        resistance_ohm: short(resistance_ohm),
        spread_ohm: short(apart_ohm / 2.0),
    });
    Ok(())
}

/// `bridge.direction` and R of both directions, Ω, with parameters of the board that are put back by the caller.
fn measure(bench: &mut Bench, torque_nm: f64, before: [(u16, f32); 2]) -> Result<(i8, [f64; 2]), Trouble> {
    let [(current, current_a), (direction, told)] = before;
    let control = bench.session.parameters().control();
    let reaches = |limit_a: f32| {
        let mut lowered = control.clone();
        lowered.limits.current = limit_a;
        f64::from(Reach::of(&lowered, Mode::Torque).torque) >= torque_nm
    };
    let steps = (1..CURRENT_STEPS).map(|step| current_a * f32::from(step) / f32::from(CURRENT_STEPS));
    let limit_a = steps
        .filter(|limit_a| *limit_a >= LEAST_CURRENT_A)
        .find(|limit_a| reaches(*limit_a))
        .unwrap_or(current_a);
    bench.session.replace_parameters(&[(current, limit_a)])?;
    let mut sign = told;
    let mut first = hold(bench, torque_nm, true)?;
    if first.turned_rad < -WRONG_RAD {
        bench.dialog.show("  the joint turned the wrong way: the motor is reversed\n")?;
        sign = -told;
        bench.session.replace_parameters(&[(direction, sign)])?;
        first = hold(bench, torque_nm, true)?;
        if first.turned_rad < -WRONG_RAD {
            return Err(Trouble::Refused(
                "the joint turns the wrong way with either direction of the motor; check cables a and b, and the encoders".to_owned(),
            ));
        }
    }
    if first.turned_rad < TURN_RAD {
        return Err(Trouble::Refused(format!(
            "the input pulley turned by {} rad, expected {TURN_RAD} rad at least; check motor leads and gear",
            short(first.turned_rad)
        )));
    }
    if first.winding_v * first.current_a <= 0.0 {
        return Err(Trouble::Refused(format!(
            "{} A at {} V of the winding: exchange the inputs of the shunt amplifier",
            short(first.current_a),
            short(first.winding_v)
        )));
    }
    let half = hold(bench, 0.5 * torque_nm, false)?;
    let back = hold(bench, -torque_nm, false)?;
    let half_back = hold(bench, -0.5 * torque_nm, false)?;
    Ok((if sign < 0.0 { -1 } else { 1 }, [slope_ohm(first, half)?, slope_ohm(back, half_back)?]))
}

/// `dV/di` between two runs, Ω.
fn slope_ohm(one: Held, other: Held) -> Result<f64, Trouble> {
    let difference_a = one.current_a - other.current_a;
    let expected_a = SIGMAS * one.unsure_a.hypot(other.unsure_a);
    if difference_a.abs() < expected_a {
        return Err(Trouble::Refused(format!(
            "current changed by {} A between half and whole torque, expected {} A at least; check the shunt amplifier and the leads",
            short(difference_a),
            short(expected_a)
        )));
    }
    Ok((one.winding_v - other.winding_v) / difference_a)
}

/// Holds a torque until the joint has come to rest, or turns too far, or the wrong way where it `begins` at rest without torque.
fn hold(bench: &mut Bench, torque_nm: f64, begins: bool) -> Result<Held, Trouble> {
    let stop = bench.stop;
    let conversion = Conversion::new(bench.session.parameters())?;
    let emf_v_s = bench.value("motor.torque_constant")? * bench.value("motor.gear_ratio")?;
    if let Err(error) = bench.session.ready(stop) {
        return Err(bench.board_refuses(error));
    }
    let course = Course::OnBoard(Reference::Hold(torque_nm as f32));
    let mut begun = None;
    let mut turned_rad = [0.0; 2];
    let mut settled: Option<(f64, f64)> = None;
    let mut last = (0.0, 0.0);
    let mut sums = [0.0; 3];
    let mut count = 0.0_f64;
    let end = bench.session.run(Mode::Torque, &course, stop, &mut |tick| {
        let time_s = tick.tick as f64 * f64::from(tick.period_ns) * 1e-9;
        let angles_rad = conversion.angles_rad(&tick.sample);
        let (begun_s, at_rad) = *begun.get_or_insert((time_s, angles_rad));
        let passed_s = time_s - begun_s;
        turned_rad = [0, 1].map(|index: usize| angles_rad[index] - at_rad[index]);
        let wrong_way = begins && turned_rad[0] * torque_nm.signum() < -WRONG_RAD;
        if wrong_way || turned_rad[1].abs() > FARTHEST_RAD || passed_s >= END_S {
            return ControlFlow::Break(());
        }
        if passed_s >= SETTLED_S && tick.sample.state.drives() {
            settled.get_or_insert((time_s, angles_rad[0]));
            last = (time_s, angles_rad[0]);
            let current_a = conversion.current_a(&tick.sample);
            sums[0] += conversion.duty(&tick.sample) * conversion.bus_v(&tick.sample);
            sums[1] += current_a;
            sums[2] += current_a * current_a;
            count += 1.0;
        }
        ControlFlow::Continue(())
    })?;
    let turned_rad = [turned_rad[0] * torque_nm.signum(), turned_rad[1]];
    let wrong_way = begins && turned_rad[0] < -WRONG_RAD;
    match end {
        RunEnd::Complete => {}
        RunEnd::Interrupted => return Err(Trouble::Stopped),
        RunEnd::Fault(fault) => {
            let refused = bench.board_refuses(crate::LinkError::Fault(fault));
            if !(wrong_way && matches!(refused, Trouble::Refused(_))) {
                return Err(refused);
            }
        }
        RunEnd::Left(state) => {
            return Err(Trouble::Refused(format!(
                "the board went to state {state} under {} N·m",
                short(torque_nm)
            )));
        }
    }
    if turned_rad[1].abs() > FARTHEST_RAD && !wrong_way {
        return Err(Trouble::Refused(format!(
            "the joint turned by {} rad under {} N·m, expected {FARTHEST_RAD} rad at most; hang its weight on it, or lower limits.torque",
            short(turned_rad[1]),
            short(torque_nm)
        )));
    }
    let count = count.max(1.0);
    let [voltage_v, current_a, square] = sums.map(|sum| sum / count);
    let speed_rad_s =
        settled.map_or(0.0, |(time_s, angle_rad)| (last.1 - angle_rad) / (last.0 - time_s).max(1e-3));
    Ok(Held {
        turned_rad: turned_rad[0],
        winding_v: voltage_v - emf_v_s * speed_rad_s,
        current_a,
        unsure_a: ((square - current_a * current_a).max(0.0) / count).sqrt(),
    })
}
