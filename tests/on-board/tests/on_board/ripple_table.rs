//! The ripple table: sent, refused, stored whole or not at all, damage told, and what it takes off the error.

use std::f64::consts::{PI, TAU};

use bowden_board::{Board, ResetCause, Torn};
use bowden_control::correction::ripple_table::{RECORD, RippleTable};
use bowden_control::parameters::Parameters;
use bowden_link::message::{Goal, Mode, Refusal, TABLE_CHUNK, TABLE_POINTS, TableReport};
use bowden_link::{Fault, FromBoard, State, ToBoard};
use bowden_on_board_tests::host::Host;
use bowden_on_board_tests::load::under_load;
use bowden_on_board_tests::trial::{Trial, angle_error, error_of, sine};
use bowden_on_board_tests::{Outcome, fail, image};
use virtual_bench::MotorCogging;

use crate::{ready, switched_on};

/// A table of `torque_nm` over a period, full scale 0.5 N·m.
fn table(period_rad: f64, torque_nm: impl Fn(f64) -> f64) -> RippleTable {
    let points_raw: [i16; TABLE_POINTS] = std::array::from_fn(|node| {
        let angle_rad = period_rad * node as f64 / TABLE_POINTS as f64;
        (torque_nm(angle_rad) / 0.5 * 32_768.0).round() as i16
    });
    RippleTable::new(period_rad as f32, 0.5, &points_raw).expect("within range")
}

/// A table for each number, all of them different everywhere.
fn numbered(number: u16) -> RippleTable {
    let offset_nm = 0.01 * f64::from(number % 20);
    table(TAU, |angle_rad| 0.2 * (7.0 * angle_rad).sin() + offset_nm)
}

fn whole(table: &RippleTable) -> TableReport {
    TableReport::Whole(table.head())
}

#[test]
fn a_table_acts_only_whole_and_changes_with_the_bridge_off_only() -> Outcome {
    let mut host = switched_on(1)?;
    assert_eq!(host.table()?, TableReport::Absent);
    assert_eq!(host.ask(&ToBoard::ReadTablePoints(0))?, FromBoard::Refused(Refusal::NoSuchIndex));
    let (first, second) = (numbered(1), numbered(2));
    host.put_table(Some(&first))?;
    assert_eq!(host.table()?, whole(&first));
    // A part of another one: what acts stays, and is what is read.
    let part: heapless::Vec<i16, TABLE_CHUNK> =
        second.points_raw().iter().take(TABLE_CHUNK).copied().collect();
    host.order(&ToBoard::WriteTablePoints { first: 32, points_raw: part.clone() })?;
    for table in [&first, &second] {
        let answer = host.ask(&ToBoard::ActivateTable(table.head()))?;
        assert_eq!(answer, FromBoard::Refused(Refusal::TableDiffers));
    }
    let beyond = ToBoard::WriteTablePoints { first: TABLE_POINTS as u16 - 1, points_raw: part };
    assert_eq!(host.ask(&beyond)?, FromBoard::Refused(Refusal::NoSuchIndex));
    assert_eq!(host.table()?, whole(&first));
    let mut read = Vec::new();
    while read.len() < TABLE_POINTS {
        match host.ask(&ToBoard::ReadTablePoints(read.len() as u16))? {
            FromBoard::TablePoints(part) => read.extend_from_slice(&part),
            other => return fail(format!("{other:?} for points from {} on", read.len())),
        }
    }
    assert_eq!(read, first.points_raw());
    // While the joint moves, all of it is refused; the switch is not.
    host.make_ready()?;
    host.order(&ToBoard::Enter(Goal::Run(Mode::Position)))?;
    host.reach(State::Run, 0.1)?;
    for message in [
        ToBoard::WriteTablePoints { first: 0, points_raw: heapless::Vec::new() },
        ToBoard::ClearTable,
        ToBoard::StoreParameters,
    ] {
        let answer = host.ask(&message)?;
        let wrong_state = FromBoard::Refused(Refusal::WrongState(State::Run));
        assert!(answer == FromBoard::Refused(Refusal::Moving) || answer == wrong_state, "{answer:?}");
    }
    for on in [1.0, 0.0, 1.0] {
        host.set("correction.ripple_table.enable", on)?;
    }
    assert_eq!(host.status()?.state, State::Run);
    Ok(())
}

/// Restarts by power-on; the fault, the table and a parameter.
fn restart(host: &mut Host) -> Outcome<(Option<Fault>, TableReport, f32)> {
    host.reset(ResetCause::PowerOn)?;
    let fault = host.status()?.fault.map(|record| record.fault);
    Ok((fault, host.table()?, host.parameter("tendon.pretension")?.value))
}

#[test]
fn table_and_parameters_survive_each_other() -> Outcome {
    let mut host = switched_on(1)?;
    let (first, second) = (numbered(1), numbered(2));
    // On a board that has nothing stored, the parameters without a table, then both, then each alone.
    for (table, pretension_n) in
        [(None, 31.0), (Some(&first), 31.0), (Some(&first), 32.0), (Some(&second), 32.0), (None, 33.0)]
    {
        host.put_table(table)?;
        host.set("tendon.pretension", pretension_n)?;
        host.order(&ToBoard::StoreParameters)?;
        let report = table.map_or(TableReport::Absent, whole);
        assert_eq!(restart(&mut host)?, (None, report, pretension_n));
    }
    // What is not stored is gone; defaults do not touch the table.
    host.put_table(Some(&first))?;
    assert_eq!(restart(&mut host)?, (None, TableReport::Absent, 33.0));
    host.put_table(Some(&first))?;
    host.order(&ToBoard::DefaultParameters)?;
    assert_eq!(host.table()?, whole(&first));
    // An unchanged table costs no flash.
    host.order(&ToBoard::StoreParameters)?;
    let before = host.board.flash_operations();
    host.order(&ToBoard::StoreParameters)?;
    let of_parameters = host.board.flash_operations() - before;
    host.put_table(Some(&second))?;
    let before = host.board.flash_operations();
    host.order(&ToBoard::StoreParameters)?;
    let of_both = host.board.flash_operations() - before;
    println!("{of_parameters} operations for parameters, {of_both} with a new table");
    // 528 bytes by eight, and the head after them.
    assert!(of_both > of_parameters + 66, "{of_parameters}, {of_both}");
    Ok(())
}

/// Store of a table that is about to be made: flash before it, and the two tables.
struct Pending {
    flash: Vec<u8>,
    old: TableReport,
    new: RippleTable,
    operations: u64,
}

/// Stores of `rounds` tables one after the other, the parameters as they are.
fn stores(rounds: u16) -> Outcome<Vec<Pending>> {
    let mut host = switched_on(1)?;
    host.order(&ToBoard::StoreParameters)?;
    let mut all = Vec::new();
    for round in 0..rounds {
        let (flash, old) = (host.board.flash_image().to_vec(), host.table()?);
        let before = host.board.flash_operations();
        let new = numbered(round);
        host.put_table(Some(&new))?;
        host.order(&ToBoard::StoreParameters)?;
        all.push(Pending { flash, old, new, operations: host.board.flash_operations() - before });
    }
    Ok(all)
}

/// Makes the store behind power-on, the power cut at operation `nth`; whether the new table is there afterwards. It is the old
/// one or the new one, the parameters are there, and a table can be stored again (tried behind half of every eighth operation).
fn cut(host: &mut Host, pending: &Pending, first: bool, nth: u64, torn: Torn) -> Outcome<bool> {
    let place = format!("operation {nth}, {torn:?}");
    host.board.set_flash_image(&pending.flash)?;
    host.reset(ResetCause::PowerOn)?;
    host.put_table(Some(&pending.new))?;
    let boots = host.board.counters().boots;
    host.board.arm_power_cut_at_flash_operation(nth, torn);
    host.send(ToBoard::StoreParameters)?;
    host.await_reset(boots, 0.3)?;
    let fault = host.status()?.fault.map(|record| record.fault);
    let found = host.table()?;
    // Behind a cut of the very first store of a table there is something in the flash, but no table yet.
    let begun = first && found == TableReport::Unreadable && fault == Some(Fault::RippleTableCorrupt);
    if fault.is_some() && !begun {
        return fail(format!("{place}: {fault:?}"));
    }
    if !begun && found != pending.old && found != whole(&pending.new) {
        return fail(format!("{place}: neither the old table nor the new one: {found:?}"));
    }
    if torn == Torn::Half && nth.is_multiple_of(8) {
        let again = numbered(19);
        host.put_table(Some(&again))?;
        host.order(&ToBoard::StoreParameters)?;
        assert_eq!(restart(host)?, (None, whole(&again), 30.0), "{place}: stored again");
    }
    Ok(found == whole(&pending.new))
}

fn cuts(pending: &Pending, first: bool) -> Outcome {
    let mut host = switched_on(1)?;
    let mut new_tables = 0;
    for nth in 1..=pending.operations {
        new_tables += u64::from(cut(&mut host, pending, first, nth, Torn::Half)?);
    }
    println!("{} operations, new table behind {new_tables} cuts", pending.operations);
    // The parameters are written behind the table.
    assert!(new_tables >= 1 && new_tables < pending.operations);
    for nth in 0..8 {
        cut(&mut host, pending, first, pending.operations - 10 * nth, Torn::Before)?;
        cut(&mut host, pending, first, 1 + 5 * nth, Torn::After)?;
    }
    assert!(cut(&mut host, pending, first, pending.operations, Torn::After)?);
    Ok(())
}

#[test]
fn a_power_cut_at_any_operation_of_the_first_table_leaves_none_or_the_new_one() -> Outcome {
    cuts(&stores(1)?[0], true)
}

#[test]
fn a_power_cut_at_any_operation_of_a_table_store_that_erases_leaves_old_or_new() -> Outcome {
    // Two pages of 2 KiB hold three tables each.
    let all = stores(8)?;
    let pending = all.iter().skip(1).max_by_key(|pending| pending.operations).expect("eight stores");
    assert!(pending.operations > all[1].operations, "no store erases");
    cuts(pending, false)
}

/// Where `record` was written last in the flash.
fn place_of(flash: &[u8], record: &[u8]) -> Outcome<usize> {
    match flash.windows(record.len()).rposition(|window| window == record) {
        Some(place) => Ok(place),
        None => fail("the record is not in the flash"),
    }
}

#[test]
fn a_damaged_table_is_told_and_the_motor_stays_off() -> Outcome {
    let elf = image::firmware()?;
    let (older, newer) = (numbered(1), numbered(2));
    let mut host = switched_on(1)?;
    host.set("tendon.pretension", 31.0)?;
    for table in [&older, &newer] {
        host.put_table(Some(table))?;
        host.order(&ToBoard::StoreParameters)?;
    }
    let good = host.board.flash_image().to_vec();
    let at = place_of(&good, &newer.to_record())?;
    // A bit that falls to zero in version, period, a point, the checksum; and pages of noise.
    let mut spoiled = Vec::new();
    for byte in [0, 6, 100, RECORD - 1] {
        let mut flash = good.clone();
        let bit = flash[at + byte] & flash[at + byte].wrapping_neg();
        flash[at + byte] &= !bit;
        assert_ne!(flash, good, "byte {byte} has no bit to fall");
        spoiled.push((format!("byte {byte}"), flash));
    }
    let mut noise = good.clone();
    let pages = noise.len() - 6 * 2048..noise.len() - 4 * 2048;
    for (n, byte) in noise[pages].iter_mut().enumerate() {
        *byte = (n as u32).wrapping_mul(2_654_435_761).to_be_bytes()[0];
    }
    spoiled.push(("noise".to_owned(), noise));
    for (name, flash) in &spoiled {
        for replaced in [Some(&older), None] {
            let mut host = Host::connect(Board::builder(&elf).flash_image(flash).build()?)?;
            let status = host.status()?;
            let fault = status.fault.map(|record| record.fault);
            assert_eq!(fault, Some(Fault::RippleTableCorrupt), "{name}: {status:?}");
            assert_eq!((status.state, host.board.pwm().duty), (State::Fault, None), "{name}");
            assert_eq!(host.table()?, TableReport::Unreadable, "{name}");
            assert_eq!(host.parameter("tendon.pretension")?.value, 31.0, "{name}: parameters are kept");
            // It cannot be forgotten, and stays in the flash.
            let clear = ToBoard::Enter(Goal::ClearFault);
            assert_eq!(host.ask(&clear)?, FromBoard::Refused(Refusal::TableUnreadable), "{name}");
            host.order(&ToBoard::StoreParameters)?;
            let told = (Some(Fault::RippleTableCorrupt), TableReport::Unreadable, 31.0);
            assert_eq!(restart(&mut host)?, told, "{name}");
            // Another one, or none, mends it.
            host.put_table(replaced)?;
            host.order(&clear)?;
            host.reach(State::Off, 0.1)?;
            host.order(&ToBoard::StoreParameters)?;
            let report = replaced.map_or(TableReport::Absent, whole);
            assert_eq!(restart(&mut host)?, (None, report, 31.0), "{name}");
            host.make_ready()?;
        }
    }
    Ok(())
}

/// Goals as without a table, which takes the place of the harmonics.
#[test]
fn the_tick_keeps_its_time_at_full_load_with_a_table() -> Outcome {
    let mut host = ready(1)?;
    host.put_table(Some(&numbered(0)))?;
    host.set("correction.ripple_table.enable", 1.0)?;
    let load = under_load(&mut host, 2.0)?;
    println!("{:?} {:?}", load.tick, load.busy);
    assert!(load.tick.worst_instructions <= 3000, "{load:?}");
    assert!(load.busy.mean() <= 3400.0 && load.busy.max <= 4250, "{load:?}");
    assert!(2 * load.memory.stack_used_bytes <= load.memory.stack_bytes, "{load:?}");
    Ok(())
}

/// Three harmonics, of which the parameters carry two.
const COGGING: MotorCogging = MotorCogging {
    amplitude_nm: 0.2,
    cycles_per_turn: 14.0,
    phase_rad: 1.0,
    second_harmonic: 0.5,
    third_harmonic: 0.6,
};

/// Amplitude of the reference \[rad\] and its frequency \[Hz\].
const AMPLITUDE_RAD: f64 = 0.3;
const FREQUENCY_HZ: f64 = 0.5;
/// Its largest speed \[rad/s\].
const PEAK_RAD_PER_S: f64 = AMPLITUDE_RAD * TAU * FREQUENCY_HZ;

/// Angle by which a torque of 1 N·m at the frequency `w` moves the rotor \[rad\].
///
/// The position loop of the input pulley, by hand: `J θ'' = -J (k_p θ + k_d θ' + k_i ∫θ) + τ`, `k_p = ω²`, `k_d = 2 ζ ω`,
/// `k_i = ω²/T_i`, so `1/(J |(k_p - w²) + j (k_d w - k_i/w)|)`.
fn compliance_rad_per_nm(w: f64) -> f64 {
    let parameters = Parameters::default();
    let inertia = f64::from(parameters.motor.rotor_inertia) * f64::from(parameters.motor.gear_ratio).powi(2);
    let omega = TAU * f64::from(parameters.controller.bandwidth);
    let damping = 2.0 * f64::from(parameters.controller.damping) * omega;
    let integral = omega * omega / f64::from(parameters.controller.integral_time);
    let (real, imaginary) = (omega * omega - w * w, damping * w - integral / w);
    1.0 / (inertia * real.hypot(imaginary))
}

/// Root of the mean square of the angle by which a ripple `A sin(n θ)` moves the rotor, on the sine: at the frequency
/// `n |θ'|` \[rad\].
fn ripple_rms_rad(amplitude_nm: f64, periods: f64) -> f64 {
    let squares = (0..1000).map(|step| {
        let phase = PI * (f64::from(step) + 0.5) / 1000.0;
        let w = periods * PEAK_RAD_PER_S * phase.sin();
        (amplitude_nm * compliance_rad_per_nm(w)).powi(2) / 2.0
    });
    (squares.sum::<f64>() / 1000.0).sqrt()
}

#[test]
fn a_table_takes_off_the_ripple_that_two_harmonics_leave() -> Outcome {
    let elf = image::firmware()?;
    let law = COGGING;
    let (first_nm, n) = (law.amplitude_nm, law.cycles_per_turn);
    let mut trial =
        Trial::new(Mode::Position, sine(AMPLITUDE_RAD as f32, FREQUENCY_HZ as f32), 1.0 / FREQUENCY_HZ);
    trial.settle_s = 0.6;
    let without = error_of(&trial.on_image(&elf)?, angle_error).rms;

    trial.effects = vec![law.clone().into()];
    let cogging = &mut trial.parameters.correction.cogging;
    (cogging.enable, cogging.amplitude_1, cogging.periods_1) = (1.0, first_nm as f32, n as f32);
    cogging.phase_1 = law.phase_rad as f32;
    (cogging.amplitude_2, cogging.periods_2) = ((law.second_harmonic * first_nm) as f32, 2.0 * n as f32);
    cogging.phase_2 = 2.0 * law.phase_rad as f32;
    let harmonics = error_of(&trial.on_image(&elf)?, angle_error).rms;

    let ripple = table(TAU / n, |angle_rad| {
        let x = n * angle_rad + law.phase_rad;
        first_nm * (x.sin() + law.second_harmonic * (2.0 * x).sin() + law.third_harmonic * (3.0 * x).sin())
    });
    let mut host = trial.prepared(&elf)?;
    host.put_table(Some(&ripple))?;
    host.set("correction.ripple_table.enable", 1.0)?;
    let with_table = error_of(&trial.follow(&mut host)?, angle_error).rms;
    // Switched off while the joint moves, the harmonics act again.
    host.set("correction.ripple_table.enable", 0.0)?;
    host.run(0.5)?;
    assert_eq!(host.status()?.state, State::Run);

    let left = ripple_rms_rad(law.third_harmonic * first_nm, 3.0 * n);
    println!(
        "without cogging {:.3} mrad, two harmonics {:.3}, table {:.3}; the third harmonic by derivation {:.3}",
        1e3 * without,
        1e3 * harmonics,
        1e3 * with_table,
        1e3 * left
    );
    // The third harmonic adds to the error without cogging in the square; the observer's lag is in neither.
    let expected = without.hypot(left);
    assert!(harmonics > 0.8 * expected && harmonics < 1.25 * expected, "{harmonics}, expected {expected}");
    // With the table, what half a count of the encoder and the current's rise, L/R = 0.4 ms at the largest speed, leave of the
    // steepest slope, 0.2·14 (1 + 2·0.5 + 3·0.6) N·m/rad: 12 mN·m, at whatever frequency it moves the rotor most.
    let slope_nm_per_rad = first_nm * n * (1.0 + 2.0 * law.second_harmonic + 3.0 * law.third_harmonic);
    let late_nm = slope_nm_per_rad * (TAU / 8192.0 + 0.4e-3 * PEAK_RAD_PER_S);
    let most = (1..200).map(|w| compliance_rad_per_nm(f64::from(w))).fold(0.0, f64::max);
    let allowed = without.hypot(late_nm * most);
    println!("allowed with the table {:.3} mrad", 1e3 * allowed);
    assert!(with_table < allowed && allowed < 0.4 * harmonics, "{with_table}, allowed {allowed}");
    Ok(())
}
