//! Flash with damaged words, and flash that is set up another way.

use bowden_board::{Board, Injection};
use bowden_link::message::{Boot, Goal, Refusal};
use bowden_link::{Fault, FromBoard, State, ToBoard};
use bowden_on_board_tests::host::Host;
use bowden_on_board_tests::{Outcome, image};

use crate::stop::moving;
use crate::switched_on;

/// First byte of the parameter store in the flash image of the board.
const STORE_AT: usize = 0x2000;

/// A board whose flash holds a stored set, with `pretension` in it, and that content.
fn stored(pretension: f32) -> Outcome<Vec<u8>> {
    let mut host = switched_on(1)?;
    host.set("tendon.pretension", 28.0)?;
    host.order(&ToBoard::StoreParameters)?;
    host.set("tendon.pretension", pretension)?;
    host.order(&ToBoard::StoreParameters)?;
    Ok(host.board.flash_image().to_vec())
}

/// A word that a power cut tore is met at every start, before the port is there: no reset, but the set before, this one, or
/// the defaults and a named fault.
#[test]
fn a_torn_word_anywhere_in_the_store_leaves_a_board_that_starts() -> Outcome {
    let elf = image::firmware()?;
    let content = stored(33.0)?;
    let used = content[STORE_AT..].iter().rposition(|byte| *byte != 0xff).expect("two sets") / 8 + 2;
    let mut sets = [0; 3];
    // Ends of the page, headers and a sample of the values.
    for word in (0..used).filter(|word| *word < 4 || word % 9 == 0 || used - *word < 6) {
        let mut board = Board::builder(&elf).flash_image(&content).build()?;
        board.tear_flash_word(STORE_AT + 8 * word);
        let mut host = Host::connect(board)?;
        let fault = host.status()?.fault.map(|record| record.fault);
        let found = host.parameter("tendon.pretension")?.value;
        let set = match (found, fault) {
            (33.0, None) => 0,
            (28.0, None) => 1,
            (30.0, Some(Fault::ParameterStoreCorrupt)) => 2,
            other => panic!("word {word}: {other:?}"),
        };
        sets[set] += 1;
        assert_eq!(host.board.counters().boots, 1, "word {word}");
        // It can store again, which is there behind the next start.
        host.set("tendon.pretension", 31.0)?;
        host.order(&ToBoard::StoreParameters)?;
        host.reset(bowden_board::ResetCause::PowerOn)?;
        assert_eq!(host.parameter("tendon.pretension")?.value, 31.0, "word {word}");
        assert_eq!(host.status()?.fault, None, "word {word}");
    }
    println!("{sets:?} starts with the last set, the one before, the defaults");
    assert!(sets[0] > 0 && sets[1] > 0, "{sets:?}");
    Ok(())
}

#[test]
fn damaged_code_opens_the_bridge_and_is_a_named_fault() -> Outcome {
    let mut host = moving()?;
    host.board.inject(Injection::FlashDamage);
    assert_eq!(host.board.pwm().duty, None, "hardware opens the bridge");
    assert_eq!(host.await_reset(1, 0.3)?.boot, Boot::Software);
    let status = host.status()?;
    let fault = status.fault.map(|record| record.fault);
    assert_eq!((status.state, fault), (State::Fault, Some(Fault::FlashDamaged)));
    let text = host.panic_text()?;
    assert_eq!(text, "bank 1, 0x12340");
    Ok(())
}

/// Before memory is set up, before the bridge's timer has its clock, and behind. Until the start has read what began it, the reset behind the
/// damage cannot be told from the power-on before it; from then on the board says why.
#[test]
fn damaged_code_during_the_start_starts_anew_with_the_motor_off() -> Outcome {
    let elf = image::firmware()?;
    for (after_s, told) in [(0.1e-3, false), (1e-3, false), (4e-3, false), (8e-3, false), (20e-3, true)] {
        let mut board = Board::builder(&elf).build()?;
        board.run_for(after_s)?;
        board.inject(Injection::FlashDamage);
        let mut host = Host::connect(board)?;
        let status = host.status()?;
        let fault = status.fault.map(|record| record.fault);
        assert_eq!((host.board.counters().boots, host.board.pwm().duty), (2, None), "{after_s} s");
        assert!(fault == Some(Fault::FlashDamaged) || !told && fault.is_none(), "{after_s} s: {status:?}");
    }
    Ok(())
}

#[test]
fn a_flash_of_one_bank_is_told_and_nothing_is_stored() -> Outcome {
    let board = Board::builder(&image::firmware()?).option_bytes(false, 0).build()?;
    let mut host = Host::connect(board)?;
    assert_eq!(host.greet()?.chip.flash_banks, 1);
    let record = host.await_fault(0.01)?;
    assert_eq!((record.fault, record.got, record.limit), (Fault::FlashBanks, 1.0, 2.0), "{record}");
    assert_eq!(host.ask(&ToBoard::StoreParameters)?, FromBoard::Refused(Refusal::Storage));
    assert_eq!(host.board.flash_operations(), 0);
    // The joint itself does not need the stores.
    host.order(&ToBoard::Enter(Goal::ClearFault))?;
    host.reach(State::Off, 0.01)?;
    host.make_ready()
}
