//! Faults of the core with small hand-assembled programs: who gets them, and what the handler finds.

mod common;

use bowden_board::{Board, BoardError};
use common::{CODE, STACK, STATIC_BYTES, elf, elf_beside};

/// Offset of [`HANDLER`] in a program.
const HANDLER_AT: u32 = 0x20;
/// Offset of a handler for which there is room behind.
const SECOND_AT: u32 = 0x48;

/// Stores the stacked program counter, LR, CFSR, HFSR, BFAR and IPSR at 0x20000200.
const HANDLER: &[u16] = &[
    0x4c07, // ldr r4, =0x20000200
    0x9806, // ldr r0, [sp, #24]
    0x6020, // str r0, [r4]
    0xf8c4, 0xe004, // str.w lr, [r4, #4]
    0x4d06, // ldr r5, =0xe000ed28
    0x6828, // ldr r0, [r5]
    0x60a0, // str r0, [r4, #8]
    0x6868, // ldr r0, [r5, #4]
    0x60e0, // str r0, [r4, #12]
    0x6928, // ldr r0, [r5, #16]
    0x6120, // str r0, [r4, #16]
    0xf3ef, 0x8005, // mrs r0, ipsr
    0x6160, // str r0, [r4, #20]
    0xe7fe, // b .
    0x0200, 0x2000, // literals
    0xed28, 0xe000, //
];

fn program(code: &[u16], second: &[u16]) -> Vec<u16> {
    let mut whole = code.to_vec();
    assert!(whole.len() <= 16);
    whole.resize(16, 0xbf00);
    whole.extend(HANDLER);
    assert_eq!(2 * whole.len(), SECOND_AT as usize);
    whole.extend(second);
    whole
}

/// What the handler in `vectors` stored when `code` ran with delivery on: PC, LR, CFSR, HFSR, BFAR, IPSR.
fn found(code: &[u16], second: &[u16], vectors: &[(usize, u32)]) -> Result<[u32; 6], BoardError> {
    found_beside(STATIC_BYTES, code, second, vectors)
}

/// The same with `static_bytes` below the stack.
fn found_beside(
    static_bytes: u32,
    code: &[u16],
    second: &[u16],
    vectors: &[(usize, u32)],
) -> Result<[u32; 6], BoardError> {
    let image = elf_beside(&program(code, second), vectors, &[], static_bytes);
    let mut board = Board::builder(&image).build().expect("a valid ELF");
    board.deliver_faults(true);
    board.run_for(1e-4)?;
    let bytes = board.memory(0x2000_0200, 24).expect("RAM");
    let mut words = bytes.as_chunks::<4>().0.iter().map(|word| u32::from_le_bytes(*word));
    Ok(std::array::from_fn(|_| words.next().expect("six words")))
}

const FORCED: u32 = 0x4000_0000;
const HARD_FAULT: &[(usize, u32)] = &[(3, HANDLER_AT)];

#[test]
fn a_fault_goes_to_hard_fault_with_the_address_of_its_instruction() {
    // CFSR and HFSR by the Armv7-M manual: UNDEFINSTR, PRECISERR with BFARVALID, INVSTATE; FORCED, DEBUGEVT.
    // Program, then program counter, CFSR, HFSR, BFAR.
    let cases: [(&str, &[u16], [u32; 4]); 6] = [
        // movs r0, #0; movs r1, #1; udf #0
        ("udf", &[0x2000, 0x2101, 0xde00], [CODE + 4, 0x0001_0000, FORCED, 0]),
        // movs r0, #0; udf.w #0
        ("udf.w", &[0x2000, 0xf7f0, 0xa000], [CODE + 2, 0x0001_0000, FORCED, 0]),
        // mov.w r5, #0x60000000; movs r0, #1; ldr r0, [r5]; adds r0, #1
        ("ldr", &[0xf04f, 0x45c0, 0x2001, 0x6828, 0x3001], [CODE + 6, 0x8200, FORCED, 0x6000_0000]),
        // mov.w r5, #0x60000000; movs r0, #1; strb r0, [r5, #1]; adds r0, #1
        ("strb", &[0xf04f, 0x45c0, 0x2001, 0x7068, 0x3001], [CODE + 6, 0x8200, FORCED, 0x6000_0001]),
        // mov.w r0, #0x08000000; adds r0, #0x80; bx r0
        ("bx", &[0xf04f, 0x6000, 0x3080, 0x4700], [0x0800_0080, 0x0002_0000, FORCED, 0]),
        // movs r0, #0; bkpt #0
        ("bkpt", &[0x2000, 0xbe00], [CODE + 2, 0, 0x8000_0000, 0]),
    ];
    for (name, code, [pc, cfsr, hfsr, bfar]) in cases {
        let seen = found(code, &[], HARD_FAULT).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert_eq!(seen, [pc, 0xffff_fff9, cfsr, hfsr, bfar, 3], "{name}: {seen:#010x?}");
    }
}

#[test]
fn nothing_masks_hard_fault() {
    // cpsid i; movs r0, #0x10; msr basepri, r0; udf #0
    let seen = found(&[0xb672, 0x2010, 0xf380, 0x8811, 0xde00], &[], HARD_FAULT).expect("runs");
    assert_eq!((seen[0], seen[5]), (CODE + 8, 3));
}

#[test]
fn an_enabled_handler_of_its_own_gets_the_fault_unless_it_is_masked() {
    let vectors = &[(3, SECOND_AT), (6, HANDLER_AT)];
    // ldr r5, =0xe000ed24; mov.w r0, #0x40000; str r0, [r5]; udf #0
    let mut enable = vec![0x4d03, 0xf44f, 0x2080, 0x6028, 0xde00, 0xe7fe, 0x0000, 0x0000, 0xed24, 0xe000];
    let seen = found(&enable, &[0xe7fe], vectors).expect("runs");
    assert_eq!(seen, [CODE + 8, 0xffff_fff9, 0x0001_0000, 0, 0, 6], "{seen:#010x?}");
    // The same with cpsid i in place of the padding: it escalates.
    enable.splice(4..6, [0xb672, 0xde00]);
    let seen = found(&enable, &[0xe7fe], &[(3, HANDLER_AT), (6, SECOND_AT)]).expect("runs");
    assert_eq!(seen, [CODE + 10, 0xffff_fff9, 0x0001_0000, FORCED, 0, 3], "{seen:#010x?}");
}

#[test]
fn a_handler_that_skips_the_instruction_lets_the_code_go_on() {
    // 0x48: ldr r1, [sp, #24]; adds r1, #2; str r1, [sp, #24]; bx lr
    let second = [0x9906, 0x3102, 0x9106, 0x4770];
    // mov.w r4, #0x20000000; movs r0, #7; udf #0; strh.w r0, [r4, #0x200]; b .
    let code = [0xf04f, 0x5400, 0x2007, 0xde00, 0xf8a4, 0x0200, 0xe7fe];
    let seen = found(&code, &second, &[(3, SECOND_AT)]).expect("runs");
    assert_eq!(seen[0] & 0xffff, 7);
}

#[test]
fn a_fault_inside_hard_fault_is_a_lockup_and_ends_the_run() {
    // movs r0, #0; udf #0; the handler: mov.w r5, #0x60000000; ldr r0, [r5]
    let error = found(&[0x2000, 0xde00], &[0xf04f, 0x45c0, 0x6828], &[(3, SECOND_AT)]);
    let text = error.expect_err("locks up").to_string();
    assert!(text.contains("lockup") && text.contains("0x60000000"), "{text}");
}

/// mov.w r4, #0x20000000; adds r4, #16; mov sp, r4
const SMALL_STACK: [u16; 4] = [0xf04f, 0x5400, 0x3410, 0x46a5];

/// Takes the stack from 0x20001000 on and stores the stack pointer that it found, LR, CFSR, HFSR and BFAR at 0x20000200.
const HANDLER_WITHOUT_STACK: &[u16] = &[
    0xf3ef, 0x8008, // mrs r0, msp
    0xf04f, 0x5400, // mov.w r4, #0x20000000
    0xf504, 0x5180, // add.w r1, r4, #0x1000
    0x468d, // mov sp, r1
    0xf8c4, 0x0200, // str.w r0, [r4, #0x200]
    0xf8c4, 0xe204, // str.w lr, [r4, #0x204]
    0xf04f, 0x25e0, // mov.w r5, #0xe000e000
    0xf8d5, 0x1d28, // ldr.w r1, [r5, #0xd28]
    0xf8c4, 0x1208, // str.w r1, [r4, #0x208]
    0xf8d5, 0x1d2c, // ldr.w r1, [r5, #0xd2c]
    0xf8c4, 0x120c, // str.w r1, [r4, #0x20c]
    0xf8d5, 0x1d38, // ldr.w r1, [r5, #0xd38]
    0xf8c4, 0x1210, // str.w r1, [r4, #0x210]
    0xe7fe, // b .
];

/// By the Armv7-M manual: the push that crosses the end of the memory is a precise bus fault, the frame of the `HardFault` that it leads
/// to finds no memory either (STKERR), and the handler runs with a stack pointer below the memory.
#[test]
fn a_push_below_the_memory_of_the_stack_goes_to_hard_fault_without_a_frame() {
    // push {r0-r7}; b .
    let code = [&SMALL_STACK[..], &[0xb4ff, 0xe7fe]].concat();
    let seen = found_beside(0, &code, HANDLER_WITHOUT_STACK, &[(3, SECOND_AT)]).expect("runs");
    assert_eq!(seen[..5], [0x1fff_fff0, 0xffff_fff9, 0x9200, FORCED, 0x1fff_fff0]);
}

/// A bus fault while the frame of another exception is stored leads to `HardFault` in its place.
#[test]
fn an_exception_that_finds_no_stack_is_a_hard_fault() {
    // svc 0; b .
    let code = [&SMALL_STACK[..], &[0xdf00, 0xe7fe]].concat();
    let seen =
        found_beside(0, &code, HANDLER_WITHOUT_STACK, &[(3, SECOND_AT), (11, HANDLER_AT)]).expect("runs");
    assert_eq!(seen[..4], [0x1fff_fff0, 0xffff_fff9, 0x1000, FORCED]);
}

#[test]
fn a_register_that_no_model_claims_ends_the_run_all_the_same() {
    // mov.w r5, #0x50000000; ldr.w r0, [r5, #0x800]: DAC1.
    let error = found(&[0xf04f, 0x45a0, 0xf8d5, 0x0800, 0xe7fe], &[], HARD_FAULT);
    assert!(matches!(error, Err(BoardError::Unmodelled { .. })), "{error:?}");
}

#[test]
fn without_delivery_a_fault_ends_the_run() {
    let image = elf(&program(&[0x2000, 0xde00], &[]), HARD_FAULT, &[]);
    let mut board = Board::builder(&image).build().expect("a valid ELF");
    let error = board.run_for(1e-4).expect_err("ends");
    assert!(matches!(error, BoardError::Fault { .. }), "{error}");
}

/// The handler runs in the time of its own instructions: those behind the faulting one are not counted.
#[test]
fn only_what_ran_is_counted() {
    // movs r0, #0; movs r1, #1; udf #0, then 10 more in the same block; the handler: b .
    let code = [0x2000, 0x2101, 0xde00, 0x2000, 0x2000, 0x2000, 0x2000, 0x2000, 0x2000, 0xe7fe];
    let image = elf(&program(&code, &[0xbf30, 0xe7fe]), &[(3, SECOND_AT)], &[]);
    let mut board = Board::builder(&image).build().expect("a valid ELF");
    board.deliver_faults(true);
    board.run_for(1e-4).expect("runs");
    let counters = board.counters();
    // Two MOVS and the WFI it sleeps in; the frame of 32 bytes.
    assert_eq!((counters.instructions, counters.exceptions), (3, 1), "{counters:?}");
    assert_eq!(board.firmware_use().stack_used_bytes, 0x20, "below {STACK:#x}");
}
