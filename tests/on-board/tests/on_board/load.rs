//! Tick, memory and link at full load.

use bowden_board::Board;
use bowden_link::message::{Goal, Mode, Reference, Shape};
use bowden_link::{State, ToBoard};
use bowden_on_board_tests::Outcome;
use bowden_on_board_tests::host::Host;
use bowden_on_board_tests::image;
use bowden_on_board_tests::load::{DMA_ITEMS_IN_A_TICK, SHORTEST_PERIOD_CYCLES, under_load, worst_ticks};

use crate::ready;
use crate::stop::LIVELY;

/// Goals: beginning of the tick steady to 1.5 us; at most 3000 instructions in the longest tick; a fifth of the 17 000 cycles on
/// average and a quarter in the longest tick; compensator at most 400 instructions.
#[test]
fn the_tick_keeps_its_time_at_full_load() -> Outcome {
    let mut host = ready(1)?;
    let load = under_load(&mut host, 2.0)?;
    println!("{load:?}");
    // 1.5 us of 170 MHz.
    assert!(load.period.spread() <= 255, "{load:?}");
    assert!((load.period.mean() - 17_000.0).abs() < 1.0, "{load:?}");
    assert!(load.tick.worst_instructions <= 3000, "{load:?}");
    assert!(load.busy.mean() <= 3400.0 && load.busy.max <= 4250, "{load:?}");
    assert!(load.compensator.worst_instructions <= 400, "{load:?}");
    assert!(load.samples[0] >= 19_900 && load.samples[1] == 0, "{load:?}");
    assert!(load.requests >= 500, "{load:?}");
    let status = host.status()?;
    assert_eq!((status.state, status.lost, status.bad_frames), (State::Run, 0, 0));
    // What the firmware says of its own tick is what its marker shows, less entry and exit.
    let told = u64::from(status.longest_tick_cycles);
    assert!(told.abs_diff(host.ticks.longest) <= 100, "{status:?}, longest {}", host.ticks.longest);
    // A tick that takes a new configuration is longer, and short enough for 20 kHz.
    assert!(told <= 8500, "{status:?}");
    // Half of the stack is room for what the emulation does not see.
    assert!(2 * load.memory.stack_used_bytes <= load.memory.stack_bytes, "{load:?}");
    // The image leaves half of the flash, and all of the parameter store.
    assert!(load.memory.image.flash_bytes <= Board::flash_bytes() / 2, "{load:?}");
    Ok(())
}

/// The highest control rate: 8500 cycles a tick.
#[test]
fn the_joint_runs_at_twenty_kilohertz() -> Outcome {
    let mut host = ready(1)?;
    host.order(&ToBoard::Enter(Goal::Off))?;
    host.set("control.rate_divider", 1.0)?;
    host.make_ready()?;
    host.order(&ToBoard::Telemetry(true))?;
    host.follow(LIVELY)?;
    host.run(0.1)?;
    host.ticks.measure_anew();
    let (begun, received) = (host.ticks.begun, host.telemetry.received);
    host.run(1.0)?;
    let status = host.status()?;
    println!("{:?} {:?} {status:?}", host.ticks.period, host.ticks.busy);
    assert_eq!((status.state, status.period_ns), (State::Run, 50_000));
    assert!(host.ticks.begun - begun >= 20_000 && (host.ticks.period.mean() - 8500.0).abs() < 1.0);
    assert!(host.ticks.busy.max <= 4250, "half of the period: {:?}", host.ticks.busy);
    assert!(host.ticks.period.spread() <= 255, "{:?}", host.ticks.period);
    // Nothing is lost on the link, or it is counted.
    assert_eq!(host.telemetry.missing, u64::from(host.telemetry.lost));
    let arrived = host.telemetry.received - received;
    println!("{arrived} of {} samples", host.ticks.begun - begun);
    // Those of 10 ms at most are under way.
    assert!(arrived >= 19_800, "{arrived}, lost {:?}", host.telemetry.lost);
    Ok(())
}

/// The core fetches from the CCM SRAM without wait states (RM0440, 2.1): all that a tick runs lies there while the joint drives, in
/// every mode, with the telemetry that takes most, and with the copy of new parameters.
#[test]
fn the_tick_runs_from_the_ccm_sram() -> Outcome {
    for mode in [Mode::Position, Mode::Torque, Mode::Hybrid, Mode::Impedance] {
        let mut host = ready(1)?;
        host.order(&ToBoard::RawTelemetry)?;
        let amplitude = if mode == Mode::Torque { 0.05 } else { 0.3 };
        let sine = Reference::Generated { shape: Shape::Sine, amplitude, offset: 0.0, frequency_hz: 1.0 };
        host.order(&ToBoard::SetReference(sine))?;
        host.order(&ToBoard::Enter(Goal::Run(mode)))?;
        host.reach(State::Run, 0.1)?;
        host.board.measure_symbol("ADC1_2")?;
        host.board.take_measurements();
        host.run(0.2)?;
        host.order(&ToBoard::SetReference(Reference::Hold(0.0)))?;
        host.run(0.2)?;
        assert!(host.board.measurements()[0].calls > 4000);
        assert_eq!(host.board.fetched_from_flash(), [] as [&str; 0], "{mode:?}");
        host.set("controller.integral_time", 0.11)?;
        host.run(0.01)?;
        assert_eq!(host.board.fetched_from_flash(), [] as [&str; 0], "{mode:?}, new parameters");
        assert_eq!(host.status()?.state, State::Run);
    }
    Ok(())
}

/// Every access at its worst: waits of the flash, misses of its caches, DMA at each access of RAM, each instruction at the largest count
/// of the manual.
#[test]
fn the_upper_bound_of_the_worst_tick_is_within_the_period_of_twenty_kilohertz() -> Outcome {
    let board = Board::builder(&image::firmware()?).seed(1).count_accesses(DMA_ITEMS_IN_A_TICK).build()?;
    let mut host = Host::connect(board)?;
    host.make_ready()?;
    let [driving, other] = worst_ticks(&mut host)?;
    println!("{driving:?} {} {other:?} {}", driving.most_cycles(), other.most_cycles());
    // Nothing of a tick that drives comes from the flash, whose wait states the lower bound leaves out.
    assert_eq!((driving.fetched.as_slice(), driving.read.as_slice()), ([].as_slice(), [].as_slice()));
    for tick in [driving, other] {
        let most_cycles = tick.most_cycles();
        assert!(most_cycles <= SHORTEST_PERIOD_CYCLES, "{tick:?}: {most_cycles}");
        assert!(tick.dma_items <= DMA_ITEMS_IN_A_TICK, "{tick:?}");
        let lower = tick.handler.least_cycles;
        assert!(tick.handler.instructions < lower && lower < tick.handler.most_cycles, "{tick:?}");
    }
    Ok(())
}
