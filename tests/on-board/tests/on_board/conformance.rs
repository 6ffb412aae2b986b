//! The emulated Cortex-M4F computes what this machine computes, bit for bit, and within its budget.

use bowden_control::conformance::{compensator_digest, correction_digest, ripple_table_digest, run};
use bowden_on_board_tests::cost::ControlAlone;
use bowden_on_board_tests::{Outcome, image};

#[test]
fn the_core_computes_what_this_machine_computes() -> Outcome {
    let found = ControlAlone::new(&image::measure()?)?.digests()?;
    assert!(found.inputs >= 1_000_000 && found.ticks >= 50_000, "{found:?}");
    assert_eq!(found.compensator, compensator_digest(found.seed, found.inputs), "{found:?}");
    assert_eq!(found.outcome, run(found.seed, found.ticks));
    let ticks = found.corrected_ticks;
    assert!(ticks >= 20_000, "{found:?}");
    assert_eq!(
        found.corrected,
        [correction_digest(found.seed, ticks), ripple_table_digest(found.seed, ticks)],
        "{found:?}"
    );
    // All seven states were among them.
    assert_eq!(found.outcome.states, 0x7f);
    Ok(())
}

/// 400 instructions for the compensator, 3000 for the tick; 17 000 cycles at 10 kHz, of which a fifth is 3400.
#[test]
fn compensator_and_tick_keep_their_budget() -> Outcome {
    for costs in ControlAlone::new(&image::measure()?)?.costs()? {
        println!("{costs:?}");
        assert!(costs.fixed.worst_instructions <= 400, "{costs:?}");
        assert!(costs.tick.worst_instructions <= 3000 && costs.tick.worst_cycles <= 3400, "{costs:?}");
        // A cycle an instruction is the least.
        assert!(costs.float.typical_cycles >= costs.float.typical_instructions, "{costs:?}");
    }
    Ok(())
}
