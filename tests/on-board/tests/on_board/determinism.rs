//! Same image, same seed, same calls: same trace.

use bowden_board::Board;
use bowden_link::ToBoard;
use bowden_on_board_tests::host::Host;
use bowden_on_board_tests::{Outcome, image};

use crate::stop::LIVELY;

/// Hash over times and values of what the board did in a second of closed loop with telemetry.
fn trace(seed: u64) -> Outcome<(u64, u64)> {
    let mut host = Host::connect(Board::builder(&image::firmware()?).seed(seed).build()?)?;
    host.make_ready()?;
    host.order(&ToBoard::Telemetry(true))?;
    host.follow(LIVELY)?;
    host.run(1.0)?;
    Ok((host.board.trace_hash(), host.board.counters().instructions))
}

#[test]
fn equal_seeds_give_equal_traces_and_other_seeds_others() -> Outcome {
    let first = trace(7)?;
    assert_eq!(first, trace(7)?);
    assert_ne!(first.0, trace(8)?.0);
    Ok(())
}
