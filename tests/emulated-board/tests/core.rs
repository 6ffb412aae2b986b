//! The core with small hand-assembled programs: exception frames, masks, costs, and what ends a run.

mod common;

use bowden_board::accesses::Accesses;
use bowden_board::{Board, BoardBuilder, BoardError, ResetCause, Torn};
use common::{CODE, STACK, elf};

fn words(board: &Board, address: u32, count: usize) -> Vec<u32> {
    let bytes = board.memory(address, 4 * count).expect("RAM");
    bytes.chunks_exact(4).map(|word| u32::from_le_bytes([word[0], word[1], word[2], word[3]])).collect()
}

fn board(code: &[u16], vectors: &[(usize, u32)], functions: &[(&str, u32, u32)]) -> Board {
    Board::builder(&elf(code, vectors, functions)).build().expect("a valid ELF")
}

/// Sets r0 to r3, r12 and s0, pends `PendSV`, stores what it finds behind it, calls SVC 7 and stores r0. The `PendSV`
/// handler copies LR, SP and 27 words of its frame to 0x20000200; the SVC handler sets the stacked r0 to 77.
const FRAME: &[u16] = &[
    0x4d13, // ldr r5, =0x20000100
    0x4e14, // ldr r6, =0xe000ed04
    0xf04f, 0x5780, // mov.w r7, #0x10000000
    0x2001, // movs r0, #1
    0x2102, // movs r1, #2
    0x2203, // movs r2, #3
    0x2304, // movs r3, #4
    0xf04f, 0x0c05, // mov.w r12, #5
    0xeeb7, 0x0a00, // vmov.f32 s0, #1.0
    0x6037, // str r7, [r6]
    0xe7ff, // b .+2
    0x6028, // 0x1c: str r0, [r5]
    0x6069, // str r1, [r5, #4]
    0xed85, 0x0a02, // vstr s0, [r5, #8]
    0xdf07, // svc #7
    0x60e8, // str r0, [r5, #12]
    0xe7fe, // b .
    0x466c, // 0x2a, PendSV: mov r4, sp
    0x480a, // ldr r0, =0x20000200
    0xf8c0, 0xe000, // str.w lr, [r0]
    0x6044, // str r4, [r0, #4]
    0x221b, // movs r2, #27
    0xf854, 0x1b04, // 0x36: ldr r1, [r4], #4
    0x6081, // str r1, [r0, #8]
    0x3004, // adds r0, #4
    0x3a01, // subs r2, #1
    0xd1f9, // bne 0x36
    0xeeb0, 0x0a00, // vmov.f32 s0, #2.0
    0x2163, // movs r1, #99
    0x4770, // bx lr
    0x204d, // 0x4a, SVC: movs r0, #77
    0x9000, // str r0, [sp]
    0x4770, // bx lr
    0x0100, 0x2000, // literals
    0xed04, 0xe000, //
    0x0200, 0x2000, //
];

/// ARMv7-M, exception entry with FP extension: 26 words, 8-byte aligned, `EXC_RETURN` bit 4 clear.
#[test]
fn an_exception_stacks_the_frame_of_the_manual_and_restores_it() {
    let mut board = board(FRAME, &[(14, 0x2a), (11, 0x4a)], &[]);
    board.run_for(1e-4).expect("runs");
    let seen = words(&board, 0x2000_0200, 2);
    assert_eq!(seen, [0xffff_ffe9, STACK - 0x68]);
    let frame = words(&board, 0x2000_0208, 26);
    assert_eq!(frame[..8], [1, 2, 3, 4, 5, 0xffff_ffff, CODE + 0x1c, 0x0100_0000]);
    assert_eq!(frame[8], 1.0_f32.to_bits(), "s0");
    // r0, r1 and s0 behind PendSV, r0 behind SVC.
    assert_eq!(words(&board, 0x2000_0100, 4), [1, 2, 1.0_f32.to_bits(), 77]);
    assert_eq!(board.counters().exceptions, 2);
    assert_eq!(board.firmware_use().stack_used_bytes, 0x68);
}

/// As above from a stack pointer that is 4 off: the frame is aligned down and bit 9 of the stacked xPSR says so.
#[test]
fn a_frame_is_aligned_to_eight_bytes() {
    let mut image = elf(FRAME, &[(14, 0x2a), (11, 0x4a)], &[]);
    image[84..88].copy_from_slice(&(STACK - 4).to_le_bytes());
    let mut board = Board::builder(&image).build().expect("a valid ELF");
    board.run_for(1e-4).expect("runs");
    assert_eq!(words(&board, 0x2000_0204, 1), [STACK - 0x70]);
    assert_eq!(words(&board, 0x2000_0208, 8)[7], 0x0100_0200);
    assert_eq!(words(&board, 0x2000_010c, 1), [77]);
}

/// Interrupt 0 at priority 0 and interrupt 1 at priority 0x10 log 0x10 and 0x11, the thread 0xaa to 0xdd: all are
/// pended under BASEPRI 0x10, then BASEPRI is lifted; interrupt 0 is pended under PRIMASK, then that is lifted.
const MASKS: &[u16] = &[
    0xf04f, 0x25e0, // mov.w r5, #0xe000e000
    0x2010, // movs r0, #0x10
    0xf885, 0x0401, // strb.w r0, [r5, #0x401]
    0x2003, // movs r0, #3
    0xf8c5, 0x0100, // str.w r0, [r5, #0x100]
    0x4c13, // ldr r4, =0x20000100
    0x2010, // movs r0, #0x10
    0xf380, 0x8811, // msr basepri, r0
    0x2003, // movs r0, #3
    0xf8c5, 0x0200, // str.w r0, [r5, #0x200]
    0xe7ff, // b .+2
    0x21aa, // movs r1, #0xaa
    0xf804, 0x1b01, // strb r1, [r4], #1
    0x2000, // movs r0, #0
    0xf380, 0x8811, // msr basepri, r0
    0x21bb, // movs r1, #0xbb
    0xf804, 0x1b01, // strb r1, [r4], #1
    0xb672, // cpsid i
    0x2001, // movs r0, #1
    0xf8c5, 0x0200, // str.w r0, [r5, #0x200]
    0xe7ff, // b .+2
    0x21cc, // movs r1, #0xcc
    0xf804, 0x1b01, // strb r1, [r4], #1
    0xb662, // cpsie i
    0x21dd, // movs r1, #0xdd
    0xf804, 0x1b01, // strb r1, [r4], #1
    0xbf30, // wfi
    0xe7fe, // b .
    0x2110, // 0x4e, interrupt 0: movs r1, #0x10
    0xf804, 0x1b01, // strb r1, [r4], #1
    0x4770, // bx lr
    0x2111, // 0x56, interrupt 1: movs r1, #0x11
    0xf804, 0x1b01, // strb r1, [r4], #1
    0x4770, // bx lr
    0x0000, //
    0x0100, 0x2000, // literal
];

#[test]
fn basepri_lets_priority_zero_pass_and_primask_nothing() {
    let mut board = board(MASKS, &[(16, 0x4e), (17, 0x56)], &[]);
    board.run_for(1e-3).expect("runs");
    let log = board.memory(0x2000_0100, 7).expect("RAM");
    assert_eq!(log, [0x10, 0xaa, 0x11, 0xbb, 0xcc, 0x10, 0xdd]);
    // It sleeps in WFI for nearly all of 16000 cycles.
    let counters = board.counters();
    assert!(counters.idle_cycles > 15_500 && counters.idle_cycles < counters.cycles, "{counters:?}");
}

/// Calls `work` 50 times under a `SysTick` each 1000 cycles. `work`: 3 MOVS, 100 times ADDS, SUBS, BNE, then BX.
const COUNTED: &[u16] = &[
    0x4d0b, // ldr r5, =0xe000e010
    0xf240, 0x30e7, // movw r0, #999
    0x6068, // str r0, [r5, #4]
    0x2007, // movs r0, #7
    0x6028, // str r0, [r5]
    0x2600, // movs r6, #0
    0xf000, 0xf805, // 0x0e: bl 0x1c
    0x3601, // adds r6, #1
    0x2e32, // cmp r6, #50
    0xd1fa, // bne 0x0e
    0xbf30, // wfi
    0xe7fe, // b .
    0x2064, // 0x1c, work: movs r0, #100
    0x2100, // movs r1, #0
    0x2200, // movs r2, #0
    0x3103, // 0x22: adds r1, #3
    0x3801, // subs r0, #1
    0xd1fc, // bne 0x22
    0x4770, // bx lr
    0x3301, // 0x2a, SysTick: adds r3, #1
    0x4770, // bx lr
    0x0000, //
    0xe010, 0xe000, // literal
];

#[test]
fn a_halted_core_stands_while_time_goes_on() {
    let mut board = board(COUNTED, &[(15, 0x2a)], &[]);
    board.run_for(1e-3).expect("runs");
    let before = board.counters();
    board.halt_core(true);
    board.run_for(1e-3).expect("time passes");
    let halted = board.counters();
    assert_eq!((halted.instructions, halted.exceptions), (before.instructions, before.exceptions));
    assert_eq!(halted.idle_cycles - before.idle_cycles, halted.cycles - before.cycles);
    board.halt_core(false);
    board.run_for(1e-3).expect("runs");
    // One SysTick for all that passed meanwhile, and 15 or 16 of its own.
    assert!((16..=17).contains(&(board.counters().exceptions - before.exceptions)), "{:?}", board.counters());
}

#[test]
fn a_function_costs_the_same_whether_an_interrupt_preempts_it_or_not() {
    let mut board = board(COUNTED, &[(15, 0x2a)], &[("work", 0x1c, 14), ("tick", 0x2a, 4)]);
    board.measure_symbol("work").expect("in the symbol table");
    board.measure_symbol("tick").expect("in the symbol table");
    board.run_for(5e-3).expect("runs");
    let results = board.measurements();
    let work = results.iter().find(|result| result.function == "work").expect("called");
    // 3 + 300 + 1 instructions; 3 + 100·3 + 99 taken + 2 cycles.
    assert_eq!((work.calls, work.instructions.min, work.instructions.max), (50, 304, 304));
    assert_eq!((work.cycles.min, work.cycles.max), (404, 404));
    let tick = results.iter().find(|result| result.function == "tick").expect("called");
    // 80000 cycles have 79 ticks. ADDS 1, BX 2, return 10.
    assert_eq!((tick.calls, tick.instructions.max, tick.cycles.max), (79, 2, 13));
    assert!(matches!(board.measure_symbol("absent"), Err(BoardError::NoSymbol { .. })));
}

/// Puts two instructions into the CCM SRAM, then calls `work` once, which makes each kind of access and calls them.
const ACCESSES: &[u16] = &[
    0x4c0b, // ldr r4, =0x20000100
    0x4d0c, // ldr r5, =0x10000100
    0x4e0c, // ldr r6, =0x40021000
    0x4f0d, // ldr r7, =0xe000ed08
    0x480d, // ldr r0, =0x47703001, adds r0, #1 and bx lr
    0x6028, // str r0, [r5]
    0x1c68, // adds r0, r5, #1
    0x4681, // mov r9, r0
    0xf000, 0xf802, // bl 0x18
    0xe7fe, // b .
    0xbf00, // nop
    0xb500, // 0x18, work: push {lr}
    0x4809, // ldr r0, =0x47703001
    0x6821, // ldr r1, [r4]
    0x6060, // str r0, [r4, #4]
    0x682a, // ldr r2, [r5]
    0x6833, // ldr r3, [r6]
    0x683b, // ldr r3, [r7]
    0xf8d4, 0x1001, // ldr.w r1, [r4, #1]
    0x47c8, // blx r9
    0xbd00, // 0x2c: pop {pc}
    0xbf00, // nop
    0x0100, 0x2000, // literals
    0x0100, 0x1000, //
    0x1000, 0x4002, //
    0xed08, 0xe000, //
    0x3001, 0x4770, //
];

/// Counts by hand. Code: 20 bytes at 0x218 in three lines of 8 bytes, a word in the CCM SRAM, two bytes at 0x22c in a line. The load of
/// a word at an odd address takes three accesses.
#[test]
fn accesses_are_those_of_a_program_counted_by_hand() {
    let image = elf(ACCESSES, &[], &[("work", 0x18, 22)]);
    let mut board = Board::builder(&image).count_accesses(u64::MAX).build().expect("a valid ELF");
    board.measure_symbol("work").expect("in the symbol table");
    board.run_for(1e-4).expect("runs");
    let result = &board.measurements()[0];
    let worst = result.worst.expect("accesses are counted");
    assert_eq!((result.calls, worst.instructions), (1, 12));
    // PUSH 2, LDR 2, six transfers behind a transfer, BLX 2; ADDS 1, BX 2; POP 3.
    assert_eq!(worst.least_cycles, 2 + 2 + 6 + 2 + 3 + 3);
    let accesses = Accesses {
        // PUSH 3, LDR 2 and 2, STR 1, LDR 3 times 2, LDR.W 2 across two words and in three parts, BLX 4; ADDS 1, BX 4; POP 6.
        core_cycles: 3 + 2 + 2 + 1 + 6 + (2 + 1 + 2) + 4 + 1 + 4 + 6,
        flash_blocks: 2,
        flash_lines: 3 + 1,
        ccm_words: 1,
        ram_words: 0,
        flash_reads: 1,
        ccm_accesses: 1,
        ram_accesses: 1 + 1 + 1 + 3 + 1,
        register_accesses: 1,
        core_register_accesses: 1,
        dma_items: 0,
    };
    assert_eq!(worst.accesses, accesses);
    assert_eq!(worst.most_cycles, 34 + 2 * 5 + 4 * 4 + 9 + 1 + 7 * 2 + 8 + 2);
    assert_eq!(accesses.most_cycles(3), worst.most_cycles - (7 - 3) * 2, "DMA makes three accesses");
    assert_eq!(board.read_from_flash(), ["no symbol (0x08000240), read by work"]);
    assert_eq!(board.fetched_from_flash().len(), 2);
}

/// Loads inside an IT block under a `SysTick` each 1000 cycles.
const CONDITIONAL: &[u16] = &[
    0x4d06, // ldr r5, =0xe000e010
    0xf240, 0x30e7, // movw r0, #999
    0x6068, // str r0, [r5, #4]
    0x2007, // movs r0, #7
    0x6028, // str r0, [r5]
    0x4c04, // ldr r4, =0x20000100
    0x4280, // 0x0e: cmp r0, r0
    0xbf08, // it eq
    0x6822, // ldreq r2, [r4]
    0xe7fb, // b 0x0e
    0x3301, // 0x16, SysTick: adds r3, #1
    0x4770, // bx lr
    0xbf00, // nop
    0xe010, 0xe000, // literals
    0x0100, 0x2000, //
];

#[test]
fn counting_of_accesses_changes_no_time() {
    let image = elf(CONDITIONAL, &[(15, 0x16)], &[]);
    let run = |builder: BoardBuilder| {
        let mut board = builder.build().expect("a valid ELF");
        board.run_for(1e-3).expect("runs");
        board.counters()
    };
    let plain = run(Board::builder(&image));
    assert_eq!(plain.exceptions, 15, "15920 cycles");
    assert_eq!(run(Board::builder(&image).count_accesses(u64::MAX)), plain);

    let image = elf(COUNTED, &[(15, 0x2a)], &[("work", 0x1c, 14)]);
    let run = |builder: BoardBuilder| {
        let mut board = builder.build().expect("a valid ELF");
        board.measure_symbol("work").expect("in the symbol table");
        board.run_for(5e-3).expect("runs");
        (board.counters(), board.trace_hash(), board.measurements())
    };
    let plain = run(Board::builder(&image));
    let counted = run(Board::builder(&image).count_accesses(u64::MAX));
    assert_eq!((plain.0, plain.1), (counted.0, counted.1));
    assert_eq!(plain.2[0].cycles, counted.2[0].cycles);
    assert_eq!(plain.2[0].worst, None);
    // 100 blocks of the loop and one before; SysTick is no part of it: 3 + 3·100 + 1 + 1 + 4 cycles and 3 for each branch taken;
    // 0x21c to 0x227 is two lines, 0x222 to 0x227 one, 0x228 one.
    let worst = counted.2[0].worst.expect("accesses are counted");
    assert_eq!(worst.accesses.core_cycles, 3 + 300 + 3 * 99 + 4);
    assert_eq!((worst.accesses.flash_blocks, worst.accesses.flash_lines), (1 + 99 + 1, 2 + 99 + 1));
}

fn error_of(code: &[u16]) -> String {
    let mut board = board(code, &[], &[("start", 0, 64)]);
    let error = board.run_for(1e-3).expect_err("must end");
    assert!(matches!(board.run_for(1e-3), Err(BoardError::Stopped(_))), "and stay ended");
    error.to_string()
}

#[test]
fn what_no_model_claims_ends_the_run_and_is_named() {
    // movs r0, #0; udf #0
    let text = error_of(&[0x2000, 0xde00]);
    assert!(text.contains("undefined instruction") && text.contains("(start)"), "{text}");
    // mov.w r5, #0x40000000; movs r0, #1; str r0, [r5]: TIM2 without clock.
    let text = error_of(&[0xf04f, 0x4580, 0x2001, 0x6028, 0xe7fe]);
    assert!(text.contains("TIM2") && text.contains("clock is off") && text.contains("0x40000000"), "{text}");
    // mov.w r5, #0x50000000 + 0x800 is not encodable at once: mov.w r5, #0x50000000; ldr.w r0, [r5, #0x800]: DAC1.
    let text = error_of(&[0xf04f, 0x45a0, 0xf8d5, 0x0800, 0xe7fe]);
    assert!(text.contains("0x50000800") && text.contains("no model claims"), "{text}");
    // mov.w r5, #0x60000000; ldr r0, [r5]: no memory.
    let text = error_of(&[0xf04f, 0x45c0, 0x6828, 0xe7fe]);
    assert!(text.contains("0x60000000"), "{text}");
    // mov.w r5, #0x08000000; str r0, [r5]: flash is no RAM.
    let text = error_of(&[0xf04f, 0x6500, 0x6028, 0xe7fe]);
    assert!(text.contains("0x08000000"), "{text}");
}

/// ldr r6, =0xe000ed04; mov.w r7, #0x10000000; sub.w sp, sp, #0xd00; str r7, [r6]; b .
#[test]
fn a_stack_that_reaches_static_data_ends_the_run() {
    let text = error_of(&[0x4e03, 0xf04f, 0x5780, 0xf5ad, 0x6d50, 0x6037, 0xe7fe, 0x0000, 0xed04, 0xe000]);
    assert!(text.contains("stack overflow") && text.contains("0x200002e0"), "{text}");
}

/// Counts a word in RAM up and requests a reset: mov.w r5, #0x20000000; ldr r0, [r5]; adds r0, #1; str r0, [r5];
/// ldr r1, =0xe000ed0c; ldr r2, =0x05fa0004; str r2, [r1]; b .
const RESETS: &[u16] = &[
    0xf04f, 0x5500, 0x6828, 0x3001, 0x6028, 0x4902, 0x4a02, 0x600a, 0xe7fe, 0x0000, 0xed0c, 0xe000, 0x0004,
    0x05fa,
];

#[test]
fn a_software_reset_keeps_ram_and_a_power_cut_does_not() {
    let mut board = board(RESETS, &[], &[]);
    let before = words(&board, 0x2000_0000, 1)[0];
    board.run_for(1e-4).expect("runs");
    let counters = board.counters();
    let counted = words(&board, 0x2000_0000, 1)[0].wrapping_sub(before);
    // The last boot may have ended before its store.
    assert!(
        counters.boots > 10 && counters.boots.abs_diff(u64::from(counted)) <= 1,
        "{counters:?}, {counted}"
    );
    board.power_cycle().expect("restarts");
    assert_eq!(words(&board, 0x2000_0000, 1)[0], before);
    board.reset(ResetCause::Pin).expect("restarts");
    assert_eq!(board.counters().boots, counters.boots + 2);
}

/// Shifts `RCC_CSR` into a list of three words at 0x20000100, clears its flags, and starts the watchdog with 32 periods of
/// 4/32 kHz: 4 ms.
const WATCHED: &[u16] = &[
    0x4d0b, // ldr r5, =0x40021094
    0x6828, // ldr r0, [r5]
    0xf44f, 0x0100, // mov.w r1, #0x800000
    0x6029, // str r1, [r5]
    0x4c0a, // ldr r4, =0x20000100
    0x6861, // ldr r1, [r4, #4]
    0x60a1, // str r1, [r4, #8]
    0x6821, // ldr r1, [r4]
    0x6061, // str r1, [r4, #4]
    0x6020, // str r0, [r4]
    0x4d08, // ldr r5, =0x40003000
    0xf245, 0x5055, // movw r0, #0x5555
    0x6028, // str r0, [r5]
    0x2100, // movs r1, #0
    0x6069, // str r1, [r5, #4]
    0x211f, // movs r1, #31
    0x60a9, // str r1, [r5, #8]
    0xf64c, 0x40cc, // movw r0, #0xcccc
    0x6028, // str r0, [r5]
    0xe7fe, // b .
    0x0000, 0x1094, 0x4002, 0x0100, 0x2000, 0x3000, 0x4000, // literals
];

#[test]
fn the_watchdog_resets_and_says_so() {
    let mut board = board(WATCHED, &[], &[]);
    board.run_for(3.9e-3).expect("runs");
    assert_eq!(board.counters().boots, 1);
    board.run_for(0.2e-3).expect("runs");
    assert_eq!(board.counters().boots, 2);
    board.reset(ResetCause::Software).expect("restarts");
    board.run_for(1e-3).expect("runs");
    // Newest first: SFTRST and PINRST, IWDGRST and PINRST, BORRST and PINRST.
    assert_eq!(words(&board, 0x2000_0100, 3), [0x1400_0000, 0x2400_0000, 0x0c00_0000]);
}

/// Programs the double words 0 to 7 at 0x0807e000 with their number in both words, if the first is erased.
const PROGRAMS: &[u16] = &[
    0x4c0a, // ldr r4, =0x0807e000
    0x6820, // ldr r0, [r4]
    0x3001, // adds r0, #1
    0xd110, // bne 0x2a
    0x4d09, // ldr r5, =0x40022000
    0x480a, // ldr r0, =0x45670123
    0x60a8, // str r0, [r5, #8]
    0x480a, // ldr r0, =0xcdef89ab
    0x60a8, // str r0, [r5, #8]
    0x2001, // movs r0, #1
    0x6168, // str r0, [r5, #0x14]
    0x2600, // movs r6, #0
    0x6026, // 0x18: str r6, [r4]
    0x6066, // str r6, [r4, #4]
    0x3408, // adds r4, #8
    0x3601, // adds r6, #1
    0x6928, // 0x20: ldr r0, [r5, #0x10]
    0x03c0, // lsls r0, r0, #15
    0xd4fc, // bmi 0x20
    0x2e08, // cmp r6, #8
    0xd1f6, // bne 0x18
    0xe7fe, // 0x2a: b .
    0xe000, 0x0807, 0x2000, 0x4002, 0x0123, 0x4567, 0x89ab, 0xcdef, // literals
];

#[test]
fn a_power_cut_at_the_third_write_leaves_two_and_the_board_boots_again() {
    let erased = 0xffff_ffff;
    for (torn, expected) in [(Torn::Before, erased), (Torn::After, 2)] {
        let mut board = board(PROGRAMS, &[], &[]);
        board.arm_power_cut_at_flash_operation(3, torn);
        board.run_for(2e-3).expect("runs");
        assert_eq!(words(&board, 0x0807_e000, 6), [0, 0, 1, 1, expected, expected]);
        assert_eq!((board.counters().boots, board.flash_operations()), (2, 3));
        // The content moves to another board, which finds the first double word and does nothing.
        let image = board.flash_image().to_vec();
        let other = elf(PROGRAMS, &[], &[]);
        let mut other = Board::builder(&other).flash_image(&image).build().expect("a valid ELF");
        other.run_for(2e-3).expect("runs");
        assert_eq!((other.flash_operations(), other.flash_image()), (0, image.as_slice()));
    }
    // Eight double words take 8 times 81.69 us.
    let mut board = board(PROGRAMS, &[], &[]);
    board.run_for(0.6e-3).expect("runs");
    assert_eq!(board.flash_operations(), 8);
    assert_eq!(words(&board, 0x0807_e038, 2), [erased, erased], "the last one is under way");
    board.run_for(0.1e-3).expect("runs");
    assert_eq!(words(&board, 0x0807_e038, 2), [7, 7]);
}

#[test]
fn equal_runs_have_equal_traces() {
    // RCC_AHB2ENR for port C (0x4002104c), mode of PC8 output, then toggle BSRR for ever:
    // ldr r0, =0x4002104c; movs r1, #4; str r1, [r0]; ldr r0, =0x48000800; mvn r1, #0x20000; str r1, [r0];
    // mov.w r1, #0x100; 0x12: str r1, [r0, #0x18]; str r1, [r0, #0x28]; b 0x12
    let code = [
        0x4805, 0x2104, 0x6001, 0x4805, 0xf46f, 0x3100, 0x6001, 0xf44f, 0x7180, 0x6181, 0x6281, 0xe7fc,
        0x104c, 0x4002, 0x0800, 0x4800,
    ];
    let run = |seconds: f64| {
        let mut board = board(&code, &[], &[]);
        board.run_for(seconds).expect("runs");
        (board.trace_hash(), board.counters(), board.edges(bowden_board::TICK_MARKER).len())
    };
    let first = run(1e-3);
    assert_eq!(first, run(1e-3));
    assert_ne!(first.0, run(1.01e-3).0);
    // STR 1, STR 1, B 2: 4 cycles of 15.92 MHz for two edges.
    assert!((7940..=7960).contains(&first.2), "{} edges in 15920 cycles", first.2);
}

#[test]
fn an_image_that_cannot_run_is_refused() {
    let refuse = |bytes: &[u8]| Board::builder(bytes).build().map(|_| ()).expect_err("no image").to_string();
    assert!(refuse(b"no ELF").starts_with("cannot use the image"));
    let mut wrong = elf(&[0xe7fe], &[], &[]);
    wrong[18] = 0x3e;
    assert!(refuse(&wrong).contains("expected Arm") || refuse(&wrong).contains("image"));
    let mut even = elf(&[0xe7fe], &[], &[]);
    even[84 + 4] &= 0xfe;
    assert!(refuse(&even).contains("reset vector"), "{}", refuse(&even));
    let mut stack = elf(&[0xe7fe], &[], &[]);
    stack[84..88].copy_from_slice(&0x1000_u32.to_le_bytes());
    assert!(refuse(&stack).contains("stack pointer"), "{}", refuse(&stack));
}

/// Copies `movs r0, #42; bx lr` to the CCM SRAM, calls it, and stores r0.
const FROM_CCM: &[u16] = &[
    0xf04f, 0x5480, // mov.w r4, #0x10000000
    0x4d03, // ldr r5, =0x4770202a
    0x6025, // str r5, [r4]
    0x3401, // adds r4, #1
    0x47a0, // blx r4
    0x4e02, // ldr r6, =0x20000100
    0x6030, // str r0, [r6]
    0xe7fe, // b .
    0xbf00, // nop
    0x202a, 0x4770, // literals
    0x0100, 0x2000, //
];

/// RM0440, memory organization: 32 KiB at 0x1000 0000, where code runs. An image that does not use them behind SRAM2 finds them there only.
#[test]
fn code_runs_from_the_ccm_sram() {
    let mut board = board(FROM_CCM, &[], &[("main", 0, 20)]);
    board.run_for(1e-4).expect("it runs");
    assert_eq!(words(&board, 0x2000_0100, 1), [42]);
    assert!(board.memory(0x1000_7ffc, 4).is_some() && board.memory(0x1000_8000, 4).is_none());
    assert!(board.memory(0x2001_7ffc, 4).is_some() && board.memory(0x2001_8000, 4).is_none());
}

/// Writes `movs r0, #42; bx lr` to 0x20000200 twice, calls it, puts 43 in place of 42, calls it, and puts 42 back; stores each result.
const REPLACED: &[u16] = &[
    0x4c08, // ldr r4, =0x20000200
    0x4d09, // ldr r5, =0x4770202a
    0x4e09, // ldr r6, =0x20000100
    0x4f0a, // ldr r7, =0x4770202b
    0x6025, // str r5, [r4]
    0x6025, // str r5, [r4]
    0x4623, // mov r3, r4
    0x3301, // adds r3, #1
    0x4798, // blx r3
    0x6030, // str r0, [r6]
    0x6027, // str r7, [r4]
    0x4798, // blx r3
    0x6070, // str r0, [r6, #4]
    0x6025, // str r5, [r4]
    0x4798, // blx r3
    0x60b0, // str r0, [r6, #8]
    0xe7fe, // b .
    0xbf00, // nop
    0x0200, 0x2000, // literals
    0x202a, 0x4770, //
    0x0100, 0x2000, //
    0x202b, 0x4770, //
];

#[test]
fn code_in_ram_that_is_replaced_after_it_ran_is_the_new_code() {
    let mut board = board(REPLACED, &[], &[("main", 0, 36)]);
    board.run_for(1e-4).expect("it runs");
    assert_eq!(words(&board, 0x2000_0100, 3), [42, 43, 42]);
}

/// The first store to a page of RAM, inside an IT block; behind a branch, `movs` sets the flags that the next branch needs.
const STORE_IN_IT_BLOCK: &[u16] = &[
    0x4a06, // ldr r2, =0x20002000
    0x4e07, // ldr r6, =0x20000100
    0x2000, // movs r0, #0
    0x2800, // cmp r0, #0
    0xbf08, // it eq
    0x6010, // streq r0, [r2]
    0xe000, // b .+4
    0xbf00, // nop
    0x2001, // movs r0, #1
    0xd100, // bne .+4
    0xe7fe, // b .
    0x6030, // str r0, [r6]
    0xe7fe, // b .
    0xbf00, // nop
    0x2000, 0x2000, // literals
    0x0100, 0x2000, //
];

/// Inside an IT block the same `movs` would leave the flags alone.
#[test]
fn an_it_block_ends_behind_its_instructions() {
    let mut board = board(STORE_IN_IT_BLOCK, &[], &[("main", 0, 28)]);
    board.run_for(1e-4).expect("it runs");
    assert_eq!(words(&board, 0x2000_0100, 1), [1]);
}
