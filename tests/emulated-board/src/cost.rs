//! Lower and upper bound of the cycles of a basic block on a Cortex-M4F, waits for memories left aside.
//!
//! # Lower bound
//!
//! Counts per instruction are those of the Cortex-M4 technical reference manual (tables of processor and FPU
//! instruction timing), each taken at its smallest: pipeline refill P = 1, divisions 2, a load directly behind another
//! load or store 1, instructions inside an IT block 1 (they may be skipped). Flash wait states, bus contention, cache
//! misses and lazy FP stacking are not counted. Every instruction costs at least one cycle.
//!
//! # Upper bound
//!
//! The same tables, each at its largest: pipeline refill P = 3, divisions 12, no load pipelined behind another, instructions inside
//! an IT block at their full count. Added to them: a cycle for each load and store whose address the instruction before may have
//! computed (not behind another load or store, by the program counter, or by a stack pointer that was not touched), a cycle for each FP operation whose operand the instruction before may have computed, and a cycle for each 32-bit
//! instruction that straddles two words of a fetch. What memories add: [`crate::accesses`].

/// Cycles to refill the pipeline after a branch, at least and at most (Cortex-M4 TRM, 3.3.1: 1 to 3).
const REFILL: u32 = 1;
const MOST_REFILL: u32 = 3;
/// SDIV and UDIV, at least and at most (TRM, 3.3.1: 2 to 12).
const DIVISION: u32 = 2;
const MOST_DIVISION: u32 = 12;
/// MLA and MLS, at most (TRM, 3.3.1).
const MOST_MULTIPLY_ACCUMULATE: u32 = 2;
/// MSR, MRS, CPS and barriers, at most: a barrier refills the pipeline (TRM, 3.3.1: 1 + B, an ISB at least P). The stores that it
/// waits for are counted where they are made.
const MOST_SYSTEM: u32 = 1 + MOST_REFILL;
/// Stall of a load or store whose address the instruction before computed (Cortex-M3 TRM r2p0, 3.3.2; Cortex-M4 TRM, 3.3.2).
const ADDRESS_STALL: u32 = 1;
/// Stall of an FP operation that waits for the one before (Cortex-M4 TRM, 7.2.3).
const FP_STALL: u32 = 1;
/// VDIV.F32 and VSQRT.F32.
const FP_DIVISION: u32 = 14;
/// VMLA, VMLS, VFMA and their negated forms.
const FP_MULTIPLY_ADD: u32 = 3;

/// What an instruction does to the pipeline, as far as cycles go.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Class {
    /// A fixed number of cycles.
    Plain(u32),
    /// A single load: 2, or 1 behind another single transfer.
    Load,
    /// A single store with immediate offset: 1.
    Store,
    /// A single store with register offset: 2, or 1 behind another single transfer.
    StoreIndexed,
    /// A branch that is always taken, with the cycles beside the refill.
    Branch(u32),
    /// A branch that may fall through.
    ConditionalBranch,
    /// IT, covering this many instructions.
    IfThen(u32),
}

/// Length in bytes and class of the instruction with halfwords `first` and `second`.
pub(crate) fn classify(first: u16, second: u16) -> (u32, Class) {
    if first >> 11 >= 0b11101 { (4, classify_wide(first, second)) } else { (2, classify_narrow(first)) }
}

fn classify_narrow(op: u16) -> Class {
    /// Mask, value, class; the first match counts.
    const TABLE: &[(u16, u16, Class)] = &[
        (0xff00, 0x4700, Class::Branch(1)),         // BX, BLX
        (0xff87, 0x4487, Class::Branch(1)),         // ADD PC
        (0xff87, 0x4687, Class::Branch(1)),         // MOV PC
        (0xf800, 0x4800, Class::Load),              // LDR literal
        (0xfe00, 0x5000, Class::StoreIndexed),      // STR register
        (0xfe00, 0x5200, Class::StoreIndexed),      // STRH register
        (0xfe00, 0x5400, Class::StoreIndexed),      // STRB register
        (0xf000, 0x5000, Class::Load),              // other register offsets
        (0xf800, 0x6000, Class::Store),             // STR
        (0xf800, 0x6800, Class::Load),              // LDR
        (0xf800, 0x7000, Class::Store),             // STRB
        (0xf800, 0x7800, Class::Load),              // LDRB
        (0xf800, 0x8000, Class::Store),             // STRH
        (0xf800, 0x8800, Class::Load),              // LDRH
        (0xf800, 0x9000, Class::Store),             // STR SP
        (0xf800, 0x9800, Class::Load),              // LDR SP
        (0xf500, 0xb100, Class::ConditionalBranch), // CBZ, CBNZ
        (0xff00, 0xdf00, Class::Branch(1)),         // SVC
        (0xff00, 0xde00, Class::Plain(1)),          // UDF
        (0xf000, 0xd000, Class::ConditionalBranch), // B<cond>
        (0xf800, 0xe000, Class::Branch(1)),         // B
    ];
    let registers = u32::from(op & 0xff).count_ones();
    match op {
        _ if op & 0xfe00 == 0xb400 => Class::Plain(1 + u32::from(op & 0x1ff).count_ones()), // PUSH
        _ if op & 0xff00 == 0xbc00 => Class::Plain(1 + registers),                          // POP
        _ if op & 0xff00 == 0xbd00 => Class::Branch(2 + registers),                         // POP with PC
        _ if op & 0xf000 == 0xc000 => Class::Plain(1 + registers),                          // STM, LDM
        _ if op & 0xff00 == 0xbf00 && op & 0x000f != 0 => Class::IfThen(4 - (op & 0xf).trailing_zeros()),
        _ => TABLE
            .iter()
            .find(|(mask, value, _)| op & mask == *value)
            .map_or(Class::Plain(1), |(_, _, class)| *class),
    }
}

fn classify_wide(first: u16, second: u16) -> Class {
    if first & 0xec00 == 0xec00 && second & 0x0e00 == 0x0a00 {
        return classify_fp(first, second);
    }
    let count = u32::from(second).count_ones();
    match first {
        _ if first & 0xfe50 == 0xe810 && second & 0x8000 != 0 => Class::Branch(1 + count), // LDM with PC
        _ if first & 0xfe40 == 0xe800 => Class::Plain(1 + count),                          // LDM, STM
        _ if first & 0xfff0 == 0xe8d0 && second & 0xffe0 == 0xf000 => Class::Branch(2),    // TBB, TBH
        _ if first & 0xffe0 == 0xe840 || first & 0xffe0 == 0xe8c0 => Class::Plain(2),      // exclusives
        _ if first & 0xfe40 == 0xe840 => Class::Plain(3),                                  // LDRD, STRD
        _ if first & 0xf800 == 0xf000 && second & 0x8000 != 0 => match second & 0xd000 {
            0x8000 if first >> 6 & 0xf < 14 => Class::ConditionalBranch,
            0x8000 => Class::Plain(1), // MSR, MRS, hints, barriers
            _ => Class::Branch(1),     // B.W, BL
        },
        _ if first & 0xff10 == 0xf800 && first & 0x80 == 0 && second & 0x0fc0 == 0 => Class::StoreIndexed,
        _ if first & 0xff10 == 0xf800 => Class::Store,
        _ if first & 0xff7f == 0xf85f && second >> 12 == 15 => Class::Branch(2), // LDR PC, literal
        _ if first & 0xff70 == 0xf850 && second >> 12 == 15 => Class::Branch(2), // LDR PC
        _ if first & 0xfe10 == 0xf810 && second >> 12 == 15 => Class::Plain(1),  // PLD, PLI
        _ if first & 0xfe10 == 0xf810 => Class::Load,
        _ if first & 0xffd0 == 0xfb90 && second & 0xf0 == 0xf0 => Class::Plain(DIVISION),
        _ => Class::Plain(1),
    }
}

fn classify_fp(first: u16, second: u16) -> Class {
    let double = second & 0x100 != 0;
    if first & 0xffe0 == 0xec40 {
        return Class::Plain(2); // VMOV of two core registers
    }
    if first & 0xff20 == 0xed00 {
        return if double { Class::Plain(3) } else { Class::Plain(2) }; // VLDR, VSTR
    }
    if first & 0xfe00 == 0xec00 {
        return Class::Plain(1 + u32::from(second & 0xff)); // VLDM, VSTM, VPUSH, VPOP
    }
    if second & 0x10 != 0 {
        return Class::Plain(1); // VMOV, VMRS, VMSR
    }
    match first >> 4 & 0xb {
        0x0 | 0x1 | 0x9 | 0xa => Class::Plain(FP_MULTIPLY_ADD),
        0x8 => Class::Plain(FP_DIVISION),
        0xb if first & 0xf == 1 && second & 0xc0 == 0xc0 => Class::Plain(FP_DIVISION), // VSQRT
        _ => Class::Plain(1),
    }
}

/// What the instruction before may have done to an address.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Before {
    /// Computed any register.
    Anything,
    /// Computed a register other than the stack pointer.
    NotStackPointer,
    /// Loaded or stored without writing its address back: no data processing.
    Transfer,
}

impl Before {
    /// What the instruction with halfwords `first` and `second` does to the next one's address.
    fn of(class: Class, first: u16, second: u16) -> Self {
        let wide = first >> 11 >= 0b11101;
        let writes_back = wide && first & 0x0080 == 0 && second & 0x0900 == 0x0900;
        match class {
            Class::Load | Class::Store | Class::StoreIndexed if !writes_back => Self::Transfer,
            // Only ADD and SUB of the stack pointer, and those of high registers, reach it.
            Class::Plain(1) if !wide && first >> 8 != 0xb0 && first >> 10 != 0b01_0001 => {
                Self::NotStackPointer
            }
            _ => Self::Anything,
        }
    }

    /// Largest stall of a load or store with halfword `first` behind it.
    fn stall(self, first: u16) -> u32 {
        let wide = first >> 11 >= 0b11101;
        let literal = !wide && first >> 11 == 0b01001;
        let by_stack_pointer = if wide { first & 0xf == 13 } else { first >> 12 == 0b1001 };
        match self {
            Self::Transfer => 0,
            Self::NotStackPointer if by_stack_pointer => 0,
            _ if literal => 0,
            _ => ADDRESS_STALL,
        }
    }
}

/// Largest cycles of the instruction with halfwords `first` and `second`, a branch that may fall through as if it did.
fn most_cycles(class: Class, first: u16, second: u16, before: Before) -> u32 {
    let wide = first >> 11 >= 0b11101;
    let stall = before.stall(first);
    match class {
        Class::Load | Class::StoreIndexed => 2 + stall,
        Class::Store => 1 + stall,
        // Those of more than a cycle load the program counter.
        Class::Branch(1) => 1 + MOST_REFILL,
        Class::Branch(cycles) => cycles + stall + MOST_REFILL,
        Class::ConditionalBranch | Class::IfThen(_) => 1,
        // PUSH, POP, LDM, STM
        Class::Plain(cycles) if !wide && cycles > 1 => cycles + stall,
        Class::Plain(_) if !wide && first & 0xffe8 == 0xb660 => MOST_SYSTEM, // CPS
        Class::Plain(cycles) if !wide => cycles,
        // LDM, STM, LDRD, STRD, exclusives, VLDR, VSTR, VLDM, VSTM
        Class::Plain(cycles) if first & 0xfe00 == 0xe800 || first & 0xee00 == 0xec00 => cycles + stall,
        Class::Plain(cycles) if first & 0xef00 == 0xee00 => cycles + FP_STALL,
        Class::Plain(DIVISION) => MOST_DIVISION,
        Class::Plain(_) if first & 0xf800 == 0xf000 && second & 0x8000 != 0 => MOST_SYSTEM,
        Class::Plain(_) if first & 0xfff0 == 0xfb00 && second & 0xf000 != 0xf000 => MOST_MULTIPLY_ACCUMULATE,
        Class::Plain(cycles) => cycles,
    }
}

/// Cost of a basic block.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct BlockCost {
    /// Instructions.
    pub instructions: u32,
    /// Cycles if its last branch, when conditional, is not taken.
    pub cycles: u32,
    /// Upper bound of them.
    pub most_cycles: u32,
    /// Whether it ends in a conditional branch, which costs [`TAKEN`] and at most [`MOST_TAKEN`] more when taken.
    pub conditional: bool,
}

/// Extra cycles of a conditional branch that is taken.
pub(crate) const TAKEN: u32 = REFILL;
/// Upper bound of them.
pub(crate) const MOST_TAKEN: u32 = MOST_REFILL;

/// Cost of the straight-line `code` at `address`.
pub(crate) fn block_cost(address: u32, code: &[u8]) -> BlockCost {
    let half = |at: usize| code.get(at..at + 2).map_or(0, |b| u16::from_le_bytes([b[0], b[1]]));
    let mut cost = BlockCost::default();
    let (mut at, mut in_it, mut behind_transfer, mut before) = (0, 0_u32, false, Before::Anything);
    while at < code.len() {
        let (first, second) = (half(at), half(at + 2));
        let (length, class) = classify(first, second);
        let straddles = length == 4 && !(address as usize + at).is_multiple_of(4);
        at += length as usize;
        let single = matches!(class, Class::Load | Class::StoreIndexed | Class::Store);
        let cycles = match class {
            _ if in_it > 0 => 1,
            Class::Plain(cycles) => cycles,
            Class::Load | Class::StoreIndexed => 2 - u32::from(behind_transfer),
            Class::Store | Class::ConditionalBranch | Class::IfThen(_) => 1,
            Class::Branch(cycles) => cycles + REFILL,
        };
        // A branch inside an IT block is conditional too.
        let may_branch = in_it > 0 && matches!(class, Class::Branch(_));
        cost.conditional = class == Class::ConditionalBranch || may_branch;
        cost.most_cycles += most_cycles(class, first, second, before) + u32::from(straddles)
            - if may_branch { MOST_TAKEN } else { 0 };
        before = Before::of(class, first, second);
        in_it = if let Class::IfThen(covered) = class { covered } else { in_it.saturating_sub(1) };
        behind_transfer = single;
        cost.instructions += 1;
        cost.cycles += cycles;
    }
    debug_assert_eq!(at, code.len(), "a block ends with an instruction: {code:02x?}");
    cost
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cost(halfwords: &[u16]) -> (u32, u32, bool) {
        let code: Vec<u8> = halfwords.iter().flat_map(|half| half.to_le_bytes()).collect();
        let BlockCost { instructions, cycles, conditional, .. } = block_cost(0x1000_0000, &code);
        (instructions, cycles, conditional)
    }

    /// Upper bound of the block at `address`.
    fn most(address: u32, halfwords: &[u16]) -> u32 {
        let code: Vec<u8> = halfwords.iter().flat_map(|half| half.to_le_bytes()).collect();
        block_cost(address, &code).most_cycles
    }

    /// Each instruction at its largest count of the Cortex-M4 manual, with its stalls, added by hand.
    #[test]
    fn upper_bounds_are_the_largest_counts_of_the_manual() {
        let at = 0x1000_0000;
        assert_eq!(most(at, &[0x1840]), 1, "ADDS");
        assert_eq!(most(at, &[0x6808, 0x6849]), 5, "LDR, LDR: 2 + address, 2");
        assert_eq!(most(at, &[0x6808, 0x1840, 0x6849]), 7, "LDR, ADDS, LDR: 2 + address, 1, 2 + address");
        assert_eq!(most(at, &[0x1840, 0x9801]), 3, "ADDS, LDR by SP: 1, 2");
        assert_eq!(most(at, &[0xb081, 0x9801]), 4, "SUB SP, LDR by SP: 1, 2 + address");
        assert_eq!(most(at, &[0x4485, 0x9801]), 4, "ADD SP, r0, LDR by SP: 1, 2 + address");
        assert_eq!(most(at, &[0x1840, 0x4801]), 3, "ADDS, LDR literal: 1, 2");
        assert_eq!(
            most(at, &[0xf850, 0x1b04, 0x6802]),
            6,
            "LDR post-indexed, LDR by the same: 2 + address each"
        );
        assert_eq!(most(at, &[0x6008]), 2, "STR immediate: 1 + address");
        assert_eq!(most(at, &[0x5088]), 3, "STR register: 2 + address");
        assert_eq!(most(at, &[0xb5f0]), 7, "PUSH {{r4-r7, lr}}: 1 + 5 + address");
        assert_eq!(most(at, &[0xbdf0]), 10, "POP {{r4-r7, pc}}: 1 + 5 + address + 3");
        assert_eq!(most(at, &[0xe92d, 0x4ff0]), 11, "PUSH.W {{r4-r11, lr}}: 1 + 9 + address");
        assert_eq!(most(at + 2, &[0xe92d, 0x4ff0]), 12, "the same across two words");
        assert_eq!(most(at, &[0x1840, 0xe92d, 0x4ff0]), 12, "ADDS, the same by a stack pointer not touched");
        assert_eq!(most(at, &[0xe9d0, 0x1200]), 4, "LDRD: 1 + 2 + address");
        assert_eq!(most(at, &[0xd0fe]), 1, "BEQ that falls through");
        assert_eq!(most(at, &[0xe7fe]), 4, "B: 1 + 3");
        assert_eq!(most(at, &[0xf000, 0xf800]), 4, "BL: 1 + 3");
        assert_eq!(most(at, &[0xe8df, 0xf000]), 6, "TBB: 2 + address + 3");
        assert_eq!(most(at, &[0xfb90, 0xf0f1]), 12, "SDIV");
        assert_eq!(most(at, &[0xfbb0, 0xf0f1]), 12, "UDIV");
        assert_eq!(most(at, &[0xfb00, 0x3001]), 2, "MLA");
        assert_eq!(most(at, &[0xfb00, 0xf001]), 1, "MUL");
        assert_eq!(most(at, &[0xfb80, 0x0102]), 1, "SMULL");
        assert_eq!(most(at, &[0xf3bf, 0x8f6f]), 4, "ISB: 1 + 3");
        assert_eq!(most(at, &[0xb672]), 4, "CPSID");
        assert_eq!(most(at, &[0xee30, 0x0a20]), 2, "VADD.F32: 1 + stall");
        assert_eq!(most(at, &[0xee80, 0x0a20]), 15, "VDIV.F32: 14 + stall");
        assert_eq!(most(at, &[0xed90, 0x0a00]), 3, "VLDR.32: 2 + address");
        // ITE EQ; LDREQ; LDRNE; LDR: 1, 2 + address, 2, 2.
        assert_eq!(most(at, &[0xbf0c, 0x6808, 0x6808, 0x6808]), 8);
        // IT EQ; BXEQ LR, the refill being that of a branch that is taken.
        assert_eq!(most(at, &[0xbf08, 0x4770]) + MOST_TAKEN, 1 + 1 + 3);
    }

    /// Encodings from the ARMv7-M architecture manual, cycles from the Cortex-M4 manual, added by hand.
    #[test]
    fn listed_sequences_cost_what_the_manual_says() {
        assert_eq!(cost(&[0x1840]), (1, 1, false), "ADDS");
        assert_eq!(cost(&[0x6808, 0x6849]), (2, 3, false), "LDR, LDR: 2 + 1");
        assert_eq!(cost(&[0x6808, 0x1840, 0x6849]), (3, 5, false), "LDR, ADDS, LDR: 2 + 1 + 2");
        assert_eq!(cost(&[0x6008]), (1, 1, false), "STR immediate");
        assert_eq!(cost(&[0x5088]), (1, 2, false), "STR register");
        assert_eq!(cost(&[0xb5f0]), (1, 6, false), "PUSH {{r4-r7, lr}}: 1 + 5");
        assert_eq!(cost(&[0xbdf0]), (1, 7, false), "POP {{r4-r7, pc}}: 1 + 5 + 1");
        assert_eq!(cost(&[0xe92d, 0x4ff0]), (1, 10, false), "PUSH.W {{r4-r11, lr}}: 1 + 9");
        assert_eq!(cost(&[0xe8bd, 0x8ff0]), (1, 11, false), "POP.W {{r4-r11, pc}}: 1 + 9 + 1");
        assert_eq!(cost(&[0xd0fe]), (1, 1, true), "BEQ");
        assert_eq!(cost(&[0xb108]), (1, 1, true), "CBZ");
        assert_eq!(cost(&[0xe7fe]), (1, 2, false), "B");
        assert_eq!(cost(&[0xf000, 0xf800]), (1, 2, false), "BL");
        assert_eq!(cost(&[0x4770]), (1, 2, false), "BX LR");
        assert_eq!(cost(&[0xf43f, 0xaffe]), (1, 1, true), "BEQ.W");
        assert_eq!(cost(&[0xe8df, 0xf000]), (1, 3, false), "TBB: 2 + P");
        assert_eq!(cost(&[0xfb90, 0xf0f1]), (1, 2, false), "SDIV at least 2");
        assert_eq!(cost(&[0xfbb0, 0xf0f1]), (1, 2, false), "UDIV at least 2");
        assert_eq!(cost(&[0xfb80, 0x0102]), (1, 1, false), "SMULL");
        assert_eq!(cost(&[0xfb00, 0xf001]), (1, 1, false), "MUL");
        assert_eq!(cost(&[0xe9d0, 0x1200]), (1, 3, false), "LDRD: 1 + 2");
        assert_eq!(cost(&[0xe850, 0x1f00]), (1, 2, false), "LDREX");
        assert_eq!(cost(&[0xf8d0, 0x1004, 0xf8d0, 0x2008]), (2, 3, false), "LDR.W, LDR.W");
        assert_eq!(cost(&[0xf840, 0x1002]), (1, 2, false), "STR.W register");
        assert_eq!(cost(&[0xf840, 0x1b04]), (1, 1, false), "STR.W post-indexed");
    }

    #[test]
    fn floating_point_costs_what_the_manual_says() {
        assert_eq!(cost(&[0xee30, 0x0a20]), (1, 1, false), "VADD.F32");
        assert_eq!(cost(&[0xee20, 0x0a20]), (1, 1, false), "VMUL.F32");
        assert_eq!(cost(&[0xee00, 0x0a20]), (1, 3, false), "VMLA.F32");
        assert_eq!(cost(&[0xeea0, 0x0a20]), (1, 3, false), "VFMA.F32");
        assert_eq!(cost(&[0xee80, 0x0a20]), (1, 14, false), "VDIV.F32");
        assert_eq!(cost(&[0xeeb1, 0x0ac0]), (1, 14, false), "VSQRT.F32");
        assert_eq!(cost(&[0xeef1, 0x0ae0]), (1, 14, false), "VSQRT.F32 to an odd register");
        assert_eq!(cost(&[0xeeb0, 0x0ac0]), (1, 1, false), "VABS.F32");
        assert_eq!(cost(&[0xed90, 0x0a00]), (1, 2, false), "VLDR.32");
        assert_eq!(cost(&[0xed90, 0x0b00]), (1, 3, false), "VLDR.64");
        assert_eq!(cost(&[0xed2d, 0x8b10]), (1, 17, false), "VPUSH of 8 doubles: 1 + 16");
        assert_eq!(cost(&[0xeef1, 0xfa10]), (1, 1, false), "VMRS");
    }

    #[test]
    fn instructions_under_it_cost_one_and_a_branch_there_is_conditional() {
        // ITE EQ; LDREQ; LDRNE; LDR: 1 + 1 + 1, then the last stands behind a transfer: 1.
        assert_eq!(cost(&[0xbf0c, 0x6808, 0x6808, 0x6808]), (4, 4, false));
        // IT EQ; BXEQ LR.
        assert_eq!(cost(&[0xbf08, 0x4770]), (2, 2, true));
    }
}
