//! Parameters: written, refused, stored, and stored whole or not at all when the power goes.

use bowden_board::{Board, ResetCause, Torn};
use bowden_control::parameters::Parameters;
use bowden_link::message::{Goal, Mode, Refusal};
use bowden_link::{Fault, FromBoard, State, ToBoard};
use bowden_on_board_tests::host::Host;
use bowden_on_board_tests::{Outcome, fail, image};

use crate::{ready, switched_on};

#[test]
fn the_board_tells_all_parameters_and_their_defaults() -> Outcome {
    let mut host = switched_on(1)?;
    let defaults: Vec<f32> =
        (0..Parameters::COUNT).map(|index| Parameters::default().get(index).expect("in range")).collect();
    assert_eq!(host.all_values()?, defaults);
    let pretension = host.parameter("tendon.pretension")?;
    assert_eq!((pretension.name.as_str(), pretension.unit.as_str()), ("tendon.pretension", "N"));
    assert_eq!((pretension.minimum, pretension.maximum, pretension.default), (0.1, 1000.0, 30.0));
    assert_eq!(
        host.ask(&ToBoard::ReadParameter(Parameters::COUNT))?,
        FromBoard::Refused(Refusal::NoSuchIndex)
    );
    Ok(())
}

#[test]
fn what_does_not_fit_is_refused_with_the_reason_and_changes_nothing() -> Outcome {
    let mut host = switched_on(1)?;
    let before = host.all_values()?;
    for (name, value, refusal) in [
        ("tendon.pretension", 2000.0, Refusal::OutOfRange { got: 2000.0, minimum: 0.1, maximum: 1000.0 }),
        // Above angle_maximum.
        ("limits.angle_minimum", 1.5, Refusal::Conflict(Host::index("limits.angle_maximum")?)),
    ] {
        assert_eq!(host.try_set(name, value)?, FromBoard::Refused(refusal), "{name}");
    }
    assert!(matches!(
        host.try_set("tendon.pretension", f32::NAN)?,
        FromBoard::Refused(Refusal::OutOfRange { .. })
    ));
    assert_eq!(host.all_values()?, before);
    Ok(())
}

#[test]
fn some_parameters_wait_for_the_bridge_to_be_off() -> Outcome {
    let mut host = ready(1)?;
    host.order(&ToBoard::Enter(Goal::Run(Mode::Position)))?;
    host.reach(State::Run, 0.1)?;
    assert_eq!(host.try_set("encoder.joint.zero", 1900.0)?, FromBoard::Refused(Refusal::Moving));
    assert_eq!(host.ask(&ToBoard::DefaultParameters)?, FromBoard::Refused(Refusal::Moving));
    assert_eq!(host.ask(&ToBoard::StoreParameters)?, FromBoard::Refused(Refusal::WrongState(State::Run)));
    // Others act at once.
    host.set("controller.bandwidth", 6.0)?;
    assert_eq!((host.parameter("controller.bandwidth")?.value, host.status()?.state), (6.0, State::Run));
    Ok(())
}

#[test]
fn the_control_rate_changes_without_a_reboot() -> Outcome {
    let mut host = switched_on(1)?;
    for (divider, period_us) in [(1.0, 50.0), (4.0, 200.0), (2.0, 100.0)] {
        host.set("control.rate_divider", divider)?;
        host.run(0.01)?;
        host.ticks.measure_anew();
        host.run(0.1)?;
        let measured_us = host.ticks.period.mean() / 170.0;
        assert!((measured_us - period_us).abs() < 0.01, "{measured_us} us, expected {period_us}");
        assert_eq!(f64::from(host.status()?.period_ns), 1e3 * period_us);
    }
    host.make_ready()
}

#[test]
fn stored_parameters_survive_reset_and_power_loss_and_the_rest_does_not() -> Outcome {
    let mut host = switched_on(1)?;
    host.set("tendon.pretension", 33.0)?;
    host.order(&ToBoard::StoreParameters)?;
    host.set("sheath.friction_coefficient", 0.2)?;
    for cause in [ResetCause::Pin, ResetCause::PowerOn] {
        host.reset(cause)?;
        assert_eq!(host.parameter("tendon.pretension")?.value, 33.0, "{cause:?}");
        assert_eq!(host.parameter("sheath.friction_coefficient")?.value, 0.12, "{cause:?}");
    }
    host.order(&ToBoard::DefaultParameters)?;
    assert_eq!(host.parameter("tendon.pretension")?.value, 30.0);
    host.order(&ToBoard::StoreParameters)?;
    host.reset(ResetCause::PowerOn)?;
    assert_eq!(host.parameter("tendon.pretension")?.value, 30.0);
    Ok(())
}

/// A store that is about to be made: flash before it, and the two sets.
struct Pending {
    flash: Vec<u8>,
    old: Vec<f32>,
    new: Vec<f32>,
    operations: u64,
}

/// Two parameters at either end of the record.
fn change(host: &mut Host, round: u16) -> Outcome {
    host.set("bridge.current_zero", 2000.0 + f32::from(round))?;
    host.set("supervisor.host_timeout", 1.0 + 0.25 * f32::from(round))
}

/// Stores of `rounds` changed sets one after the other.
fn stores(rounds: u16) -> Outcome<Vec<Pending>> {
    let mut host = switched_on(1)?;
    let mut all = Vec::new();
    for round in 0..rounds {
        let (flash, before) = (host.board.flash_image().to_vec(), host.board.flash_operations());
        let old = if round == 0 { host.all_values()? } else { Vec::new() };
        let old = all.last().map_or(old, |last: &Pending| last.new.clone());
        change(&mut host, round)?;
        host.order(&ToBoard::StoreParameters)?;
        let operations = host.board.flash_operations() - before;
        all.push(Pending { flash, old, new: host.all_values()?, operations });
    }
    Ok(all)
}

/// Makes the store of `round` behind power-on, the power cut at operation `nth`; what the board has afterwards is the old
/// set or the new one, and it can store again (tried behind half an operation).
fn cut(host: &mut Host, pending: &Pending, round: u16, nth: u64, torn: Torn) -> Outcome<bool> {
    let place = format!("store {round}, operation {nth}, {torn:?}");
    host.board.set_flash_image(&pending.flash)?;
    host.reset(ResetCause::PowerOn)?;
    change(host, round)?;
    let boots = host.board.counters().boots;
    host.board.arm_power_cut_at_flash_operation(nth, torn);
    host.send(ToBoard::StoreParameters)?;
    host.await_reset(boots, 0.3)?;
    let fault = host.status()?.fault.map(|record| record.fault);
    let found = host.all_values()?;
    // Behind a cut of the very first store there is something in the flash, but no set yet.
    let begun = round == 0 && found == pending.old && fault == Some(Fault::ParameterStoreCorrupt);
    if fault.is_some() && !begun {
        return fail(format!("{place}: {fault:?}"));
    }
    if found != pending.old && found != pending.new {
        return fail(format!("{place}: neither the old set nor the new one"));
    }
    if torn == Torn::Half {
        change(host, round + 1)?;
        host.order(&ToBoard::StoreParameters)?;
        host.reset(ResetCause::PowerOn)?;
        let again = host.parameter("bridge.current_zero")?.value;
        assert_eq!(again, 2001.0 + f32::from(round), "{place}: stored again");
    }
    Ok(found == pending.new)
}

/// All cuts of the store of `round`; the last ones find the new set.
fn cuts(pending: &Pending, round: u16) -> Outcome {
    let mut host = switched_on(1)?;
    let mut new_sets = 0;
    for nth in 1..=pending.operations {
        // What is cut behind an operation is what is cut before the next one.
        for torn in [Torn::Before, Torn::Half] {
            new_sets += u64::from(cut(&mut host, pending, round, nth, torn)?);
        }
    }
    println!(
        "store {round}: {} operations, new set behind {new_sets} cuts ahead of their end",
        pending.operations
    );
    assert!(new_sets < 2 * pending.operations);
    // Cut behind the last operation, the new set is there.
    assert!(cut(&mut host, pending, round, pending.operations, Torn::After)?);
    Ok(())
}

#[test]
fn a_power_cut_at_any_operation_of_the_first_store_leaves_old_or_new() -> Outcome {
    cuts(&stores(1)?[0], 0)
}

#[test]
fn a_power_cut_at_any_operation_of_a_store_that_erases_leaves_old_or_new() -> Outcome {
    // Four pages of 2 KiB hold five sets each: the store that opens the fourth page erases the first.
    let all = stores(24)?;
    let (round, pending) =
        all.iter().enumerate().max_by_key(|(_, pending)| pending.operations).expect("24 stores");
    assert!(pending.operations > all[1].operations, "no store erases");
    cuts(pending, round as u16)
}

/// Breaks the content of the store.
type Spoil = fn(&mut [u8]);

#[test]
fn a_broken_store_is_told_and_defaults_are_used() -> Outcome {
    let elf = image::firmware()?;
    let good = stores(1)?;
    let stored = {
        let mut host = Host::connect(Board::builder(&elf).flash_image(&good[0].flash).build()?)?;
        change(&mut host, 3)?;
        host.order(&ToBoard::StoreParameters)?;
        host.board.flash_image().to_vec()
    };
    let store_at = stored.len() - 4 * 2048;
    let broken: [(&str, Spoil); 3] = [
        ("zeros", |store| store.fill(0)),
        ("noise", |store| {
            let mut x = 0x1234_5678_u32;
            for byte in store {
                x = x.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                *byte = (x >> 24) as u8;
            }
        }),
        // Bits of the values that were programmed last fell to zero.
        ("fallen bits", |store| {
            let last = store.iter().take(2048).rposition(|byte| *byte != 0xff).expect("a record");
            for byte in &mut store[last - 40..last - 8] {
                *byte &= 0x5a;
            }
        }),
    ];
    for (name, spoil) in broken {
        let mut flash = stored.clone();
        spoil(&mut flash[store_at..]);
        let mut host = Host::connect(Board::builder(&elf).flash_image(&flash).build()?)?;
        let status = host.status()?;
        let fault = status.fault.map(|record| record.fault);
        assert_eq!(fault, Some(Fault::ParameterStoreCorrupt), "{name}: {status:?}");
        assert_eq!((status.state, host.board.pwm().duty), (State::Fault, None), "{name}");
        assert_eq!(host.all_values()?, good[0].old, "{name}: defaults");
        // Storing again mends it.
        host.set("tendon.pretension", 31.0)?;
        host.order(&ToBoard::StoreParameters)?;
        host.reset(ResetCause::PowerOn)?;
        assert_eq!(
            (host.status()?.fault, host.parameter("tendon.pretension")?.value),
            (None, 31.0),
            "{name}"
        );
    }
    Ok(())
}
