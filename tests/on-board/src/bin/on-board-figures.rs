//! Prints what the images cost and reach on the emulated board.

use std::process::ExitCode;
use std::time::Instant;

use bowden_board::Board;
use bowden_board::accesses::EXCEPTION;
use bowden_link::ToBoard;
use bowden_link::message::{Reference, Shape};
use bowden_on_board_tests::cost::{ControlAlone, Cost, SourceCosts};
use bowden_on_board_tests::course::{LoopError, follow_truth};
use bowden_on_board_tests::host::Host;
use bowden_on_board_tests::load::{
    DMA_ITEMS_IN_A_TICK, LoadedTick, SHORTEST_PERIOD_CYCLES, WorstTick, under_load, worst_ticks,
};
use bowden_on_board_tests::ticks::CYCLES_PER_US;
use bowden_on_board_tests::{Outcome, image};

/// Cycles of a control period at 10 kHz.
const PERIOD_CYCLES: f64 = 17_000.0;
/// Length of the loaded run \[s\].
const LOAD_S: f64 = 2.0;
/// Length of the sine that errors are taken of, and of the time before to settle \[s\].
const SINE_S: f64 = 10.0;
const SETTLE_S: f64 = 1.25;

fn main() -> ExitCode {
    match figures() {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            eprintln!("on-board-figures: {failure}");
            ExitCode::FAILURE
        }
    }
}

fn figures() -> Outcome {
    let (firmware, measure) = (image::firmware()?, image::measure()?);
    println!("Figures of the release images on the emulated STM32G474RE.");
    println!(
        "Instructions are exact. Cycles are a lower bound, without flash wait states and bus contention, where nothing else is said."
    );
    println!();
    print_costs(&ControlAlone::new(&measure)?.costs()?);

    let mut host = Host::connect(Board::builder(&firmware).build()?)?;
    host.make_ready()?;
    print_load(&under_load(&mut host, LOAD_S)?, &host);

    let mut host = Host::connect(Board::builder(&firmware).count_accesses(DMA_ITEMS_IN_A_TICK).build()?)?;
    host.make_ready()?;
    print_bounds(&worst_ticks(&mut host)?);

    println!("closed loop: true joint angle against its reference, sine of 0.5 rad at 0.2 Hz, {SINE_S} s");
    println!("{:<28}{:>12}{:>12}{:>26}", "lag angle", "RMS mrad", "largest", "emulation, of real time");
    for (source, name) in [(0.0, "off"), (1.0, "output torque"), (2.0, "both encoders")] {
        let (error, speed) = sine(&firmware, source)?;
        println!("{name:<28}{:>12.2}{:>12.2}{speed:>26.2}", 1e3 * error.rms_rad, 1e3 * error.largest_rad);
    }
    Ok(())
}

fn print_costs(all: &[SourceCosts]) {
    let row = |name: &str, cost: &Cost| {
        println!(
            "{name:<28}{:>10.0}{:>8}{:>12.0}{:>8}",
            cost.typical_instructions, cost.worst_instructions, cost.typical_cycles, cost.worst_cycles
        );
    };
    println!("{:<28}{:>18}{:>20}", "control code alone", "instructions", "cycles, at least");
    println!("{:<28}{:>10}{:>8}{:>12}{:>8}", "", "mean", "most", "mean", "most");
    for SourceCosts { source, fixed, float, tick } in all {
        row(&format!("compensator fixed, {source}"), fixed);
        row(&format!("compensator f32, {source}"), float);
        println!(
            "{:<28}{:>10.2}{:>8}{:>12.2}",
            "  fixed over f32",
            fixed.typical_instructions / float.typical_instructions,
            "",
            fixed.typical_cycles / float.typical_cycles
        );
        row(&format!("control tick, {source}"), tick);
    }
    println!();
}

fn print_load(load: &LoadedTick, host: &Host) {
    let us = |cycles: f64| cycles / CYCLES_PER_US;
    let line = |name: &str, value: String, goal: &str| println!("{name:<40}{value:>26}   {goal}");
    println!(
        "firmware at full load: every tick's telemetry, streamed reference, requests without a pause, log"
    );
    let tick = &load.tick;
    let typical = format!("{:.0}, {} most", tick.typical_instructions, tick.worst_instructions);
    line("tick, instructions", typical, "goal 3000");
    let compensator = &load.compensator;
    let typical = format!("{:.0}, {} most", compensator.typical_instructions, compensator.worst_instructions);
    line("compensator, instructions", typical, "goal 400");
    let share = 100.0 * tick.worst_cycles as f64 / PERIOD_CYCLES;
    line("tick, cycles at least", format!("{} most, {share:.1} %", tick.worst_cycles), "goal 20 % of 17000");
    let longest = host.ticks.longest;
    let share = 100.0 * longest as f64 / PERIOD_CYCLES;
    line("longest tick, new configuration", format!("{longest} cycles, {share:.1} %"), "");
    let spread_us = us(load.period.spread() as f64);
    line("tick jitter, from peak to peak", format!("{spread_us:.2} us"), "goal 1.5 us");
    line("core idle, at most", format!("{:.0} %", 100.0 * load.idle), "");
    let [received, missing] = load.samples;
    line("samples received, missing", format!("{received}, {missing}"), "goal none missing");
    line("requests answered a second", format!("{:.0}", load.requests as f64 / LOAD_S), "");
    let memory = &load.memory;
    let stack = format!("{} of {}", memory.stack_used_bytes, memory.stack_bytes);
    line("deepest stack, bytes", stack, "");
    line("flash, bytes", format!("{} of {}", memory.image.flash_bytes, Board::flash_bytes()), "");
    line("static RAM, bytes", memory.image.ram_bytes.to_string(), "");
    println!();
}

/// Both bounds of the worst ticks at 20 kHz, what the upper one is made of, and what the ticks take from the flash.
fn print_bounds([driving, other]: &[WorstTick; 2]) {
    let row = |name: &str, value: &dyn Fn(&WorstTick) -> String| {
        println!("{name:<40}{:>16}{:>16}", value(driving), value(other));
    };
    let count = |name: &str, value: &dyn Fn(&WorstTick) -> u64| row(name, &|tick| value(tick).to_string());
    println!(
        "worst tick at 20 kHz, {SHORTEST_PERIOD_CYCLES} cycles: every mode, full load; every access at its worst"
    );
    println!("{:<40}{:>16}{:>16}", "", "while driving", "any other");
    count("instructions", &|tick| tick.handler.instructions);
    count("cycles, at least", &|tick| tick.handler.least_cycles);
    count("cycles, at most", &WorstTick::most_cycles);
    row("  of the period", &|tick| {
        format!("{:.0} %", 100.0 * tick.most_cycles() as f64 / SHORTEST_PERIOD_CYCLES as f64)
    });
    count("  instructions by themselves", &|tick| tick.handler.accesses.core_cycles);
    count("  waits for memories and buses", &|tick| tick.handler.accesses.wait_cycles(DMA_ITEMS_IN_A_TICK));
    row("  entry and return", &|_| EXCEPTION.to_string());
    count("words of code from the CCM SRAM", &|tick| tick.handler.accesses.ccm_words);
    count("lines of code from the flash", &|tick| tick.handler.accesses.flash_lines);
    count("words of data from the flash", &|tick| tick.handler.accesses.flash_reads);
    count("accesses of SRAM1 and SRAM2", &|tick| tick.handler.accesses.ram_accesses);
    count("accesses of registers", &|tick| tick.handler.accesses.register_accesses);
    for (kind, tick) in [("while driving", driving), ("any other", other)] {
        for (what, list) in [("code", &tick.fetched), ("data", &tick.read)] {
            // The address stands behind the name.
            let mut names: Vec<&str> = list.iter().filter_map(|entry| entry.split(" (0x").next()).collect();
            names.dedup();
            let names = if names.is_empty() { "none".to_owned() } else { names.join(", ") };
            println!("from the flash, {what}, {kind}: {names}");
        }
    }
    println!();
}

/// Error over the sine, and board time over wall time.
fn sine(firmware: &[u8], source: f32) -> Outcome<(LoopError, f64)> {
    let mut host = Host::connect(Board::builder(firmware).build()?)?;
    host.make_ready()?;
    host.set("compensator.source", source)?;
    host.home()?;
    host.order(&ToBoard::Telemetry(true))?;
    host.follow(Reference::Generated { shape: Shape::Sine, amplitude: 0.5, offset: 0.0, frequency_hz: 0.2 })?;
    host.run(SETTLE_S)?;
    host.telemetry.take();
    let (wall, start_s) = (Instant::now(), host.board.time_s());
    let error = follow_truth(&mut host, SINE_S)?;
    Ok((error, (host.board.time_s() - start_s) / wall.elapsed().as_secs_f64()))
}
