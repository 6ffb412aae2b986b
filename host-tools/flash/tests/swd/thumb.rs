//! Instructions (Arm DDI 0403, A7): those that algorithms for this flash are made of.

use super::chip::{Chip, PC};

const SP: usize = 13;
const LR: usize = 14;
const NEGATIVE: u32 = 1 << 31;
const ZERO: u32 = 1 << 30;
const CARRY: u32 = 1 << 29;
const OVERFLOW: u32 = 1 << 28;
const FLAGS: usize = 16;

impl Chip {
    /// Carries out an instruction; false at a breakpoint, where it stays.
    pub(super) fn step(&mut self) -> bool {
        let at = self.registers[PC];
        let first = self.fetch(at);
        // Wide ones begin with 0b11101, 0b11110 or 0b11111.
        if first >> 11 >= 0x1d {
            let second = self.fetch(at + 2);
            self.registers[PC] = at + 4;
            self.wide(at, u32::from(first), u32::from(second));
        } else {
            if first >> 8 == 0xbe {
                return false;
            }
            self.registers[PC] = at + 2;
            self.narrow(at, u32::from(first));
        }
        true
    }

    fn fetch(&mut self, at: u32) -> u16 {
        (self.load(at & !3) >> (8 * (at & 2))) as u16
    }

    fn load(&mut self, at: u32) -> u32 {
        self.read(at).unwrap_or_else(|_| panic!("the core reads {at:#x}"))
    }

    fn store(&mut self, at: u32, value: u32) {
        assert!(self.write(at, 4, value).is_ok(), "the core writes {at:#x}");
    }

    fn set_flags(&mut self, value: u32, carry: Option<bool>, overflow: Option<bool>) {
        let flags = &mut self.registers[FLAGS];
        *flags = *flags & !(NEGATIVE | ZERO) | value & NEGATIVE | if value == 0 { ZERO } else { 0 };
        for (bit, state) in [(CARRY, carry), (OVERFLOW, overflow)] {
            if let Some(state) = state {
                *flags = *flags & !bit | if state { bit } else { 0 };
            }
        }
    }

    fn add(&mut self, a: u32, b: u32, carry: bool) -> u32 {
        let wide = u64::from(a) + u64::from(b) + u64::from(carry);
        let value = wide as u32;
        self.set_flags(value, Some(wide >> 32 != 0), Some((a ^ value) & (b ^ value) & NEGATIVE != 0));
        value
    }

    fn condition(&self, code: u32) -> bool {
        let set = |bit: u32| self.registers[FLAGS] & bit != 0;
        let result = match code >> 1 {
            0 => set(ZERO),
            1 => set(CARRY),
            2 => set(NEGATIVE),
            3 => set(OVERFLOW),
            4 => set(CARRY) && !set(ZERO),
            5 => set(NEGATIVE) == set(OVERFLOW),
            _ => !set(ZERO) && set(NEGATIVE) == set(OVERFLOW),
        };
        result != (code & 1 != 0)
    }

    fn branch(&mut self, target: u32) {
        assert_eq!(target & 1, 1, "branch to an instruction set that is not there: {target:#x}");
        self.registers[PC] = target & !1;
    }

    /// Value of a register as an operand.
    fn operand(&self, register: usize, at: u32) -> u32 {
        if register == PC { at + 4 } else { self.registers[register] }
    }

    fn narrow(&mut self, at: u32, op: u32) {
        let field = |shift: u32, bits: u32| (op >> shift & ((1 << bits) - 1)) as usize;
        let (d, n, immediate8) = (field(0, 3), field(3, 3), op & 0xff);
        match op >> 11 {
            // Shifts by an immediate: left, right, right with the sign.
            kind @ 0..3 => {
                let (value, by) = (self.registers[n], field(6, 5) as u32);
                let shifted = match kind {
                    0 => value << by,
                    1 => value.checked_shr(if by == 0 { 32 } else { by }).unwrap_or(0),
                    _ => (value.cast_signed() >> if by == 0 { 31 } else { by }).cast_unsigned(),
                };
                self.registers[d] = shifted;
                self.set_flags(shifted, None, None);
            }
            3 => {
                let second = if field(10, 1) == 0 { self.registers[field(6, 3)] } else { field(6, 3) as u32 };
                let first = self.registers[n];
                self.registers[d] = if field(9, 1) == 0 {
                    self.add(first, second, false)
                } else {
                    self.add(first, !second, true)
                };
            }
            4 => {
                self.registers[field(8, 3)] = immediate8;
                self.set_flags(immediate8, None, None);
            }
            5 => {
                self.add(self.registers[field(8, 3)], !immediate8, true);
            }
            6 => self.registers[field(8, 3)] = self.add(self.registers[field(8, 3)], immediate8, false),
            7 => self.registers[field(8, 3)] = self.add(self.registers[field(8, 3)], !immediate8, true),
            8 if field(10, 1) == 0 => self.data_processing(field(6, 4), d, n),
            8 => {
                let (d, m) = (d | field(7, 1) << 3, field(3, 4));
                match field(8, 2) {
                    0 => self.registers[d] = self.operand(d, at).wrapping_add(self.operand(m, at)),
                    1 => {
                        self.add(self.operand(d, at), !self.operand(m, at), true);
                    }
                    2 => self.registers[d] = self.operand(m, at),
                    _ => {
                        let target = self.operand(m, at);
                        if field(7, 1) == 1 {
                            self.registers[LR] = (at + 2) | 1;
                        }
                        self.branch(target);
                    }
                }
            }
            9 => self.registers[field(8, 3)] = self.load(((at + 4) & !3) + 4 * immediate8),
            12 => self.store(self.registers[n] + 4 * field(6, 5) as u32, self.registers[d]),
            13 => self.registers[d] = self.load(self.registers[n] + 4 * field(6, 5) as u32),
            17 => {
                let from = self.registers[n] + 2 * field(6, 5) as u32;
                self.registers[d] = self.load(from & !3) >> (8 * (from & 2)) & 0xffff;
            }
            22 | 23 if op & 0xf600 == 0xb400 => self.stack(op),
            23 if op == 0xbf00 => {}
            26 | 27 if op >> 8 & 0xf < 14 => {
                if self.condition(op >> 8 & 0xf) {
                    self.registers[PC] =
                        (at + 4).wrapping_add_signed(2 * i32::from((immediate8 as u8).cast_signed()));
                }
            }
            28 => {
                let offset = (op << 21).cast_signed() >> 20;
                self.registers[PC] = (at + 4).wrapping_add_signed(offset);
            }
            _ => panic!("instruction {op:#06x} at {at:#x}"),
        }
    }

    fn data_processing(&mut self, kind: usize, d: usize, m: usize) {
        let (a, b) = (self.registers[d], self.registers[m]);
        let value = match kind {
            0 | 8 => a & b,
            1 => a ^ b,
            12 => a | b,
            14 => a & !b,
            15 => !b,
            10 => {
                self.add(a, !b, true);
                return;
            }
            _ => panic!("data processing {kind}"),
        };
        self.set_flags(value, None, None);
        if kind != 8 {
            self.registers[d] = value;
        }
    }

    /// PUSH and POP.
    fn stack(&mut self, op: u32) {
        let pop = op & 1 << 11 != 0;
        let last = if pop { PC } else { LR };
        let list = (0..8).filter(|bit| op & 1 << bit != 0).chain((op & 1 << 8 != 0).then_some(last));
        let list: Vec<usize> = list.collect();
        let bytes = 4 * list.len() as u32;
        let from = if pop { self.registers[SP] } else { self.registers[SP] - bytes };
        self.registers[SP] = if pop { from + bytes } else { from };
        for (place, register) in (from..).step_by(4).zip(list) {
            match (pop, register) {
                (false, _) => self.store(place, self.registers[register]),
                (true, PC) => {
                    let target = self.load(place);
                    self.branch(target);
                }
                (true, _) => self.registers[register] = self.load(place),
            }
        }
    }

    fn wide(&mut self, at: u32, first: u32, second: u32) {
        let (n, d) = ((first & 0xf) as usize, (second >> 8 & 0xf) as usize);
        let immediate12 = (first >> 10 & 1) << 11 | (second >> 12 & 7) << 8 | second & 0xff;
        match (first, second) {
            // Barriers.
            (0xf3bf, _) if second & 0xff00 == 0x8f00 => {}
            // BL
            _ if first >> 11 == 0x1e && second & 0xd000 == 0xd000 => {
                let sign = first >> 10 & 1;
                let bit = |at: u32| (second >> at & 1 ^ sign) ^ 1;
                let offset = sign << 24
                    | bit(13) << 23
                    | bit(11) << 22
                    | (first & 0x3ff) << 12
                    | (second & 0x7ff) << 1;
                self.registers[LR] = (at + 4) | 1;
                self.registers[PC] = (at + 4).wrapping_add_signed((offset << 7).cast_signed() >> 7);
            }
            // MOVW
            _ if first & 0xfbf0 == 0xf240 && second & 0x8000 == 0 => {
                self.registers[d] = (first & 0xf) << 12 | immediate12;
            }
            // UBFX
            _ if first & 0xfff0 == 0xf3c0 => {
                let low = (second >> 12 & 7) << 2 | second >> 6 & 3;
                let mask = (2_u64 << (second & 0x1f)) as u32;
                self.registers[d] = self.registers[n] >> low & mask.wrapping_sub(1);
            }
            _ if first & 0xfa00 == 0xf000 && second & 0x8000 == 0 => {
                self.with_operand(first, n, d, expanded(immediate12));
            }
            // A register shifted left by an immediate.
            _ if first & 0xfe00 == 0xea00 && second & 0x30 == 0 => {
                let by = (second >> 12 & 7) << 2 | second >> 6 & 3;
                self.with_operand(first, n, d, self.registers[(second & 0xf) as usize] << by);
            }
            _ => panic!("instruction {first:#06x} {second:#06x} at {at:#x}"),
        }
    }

    fn with_operand(&mut self, first: u32, n: usize, d: usize, operand: u32) {
        let (kind, flags) = (first >> 5 & 0xf, first >> 4 & 1 == 1);
        let a = if n == PC { 0 } else { self.registers[n] };
        let value = match (kind, flags) {
            (0, false) => a & operand,
            (1, false) => a & !operand,
            (2, false) => a | operand,
            (4, false) => a ^ operand,
            (8, false) => a.wrapping_add(operand),
            (13, false) => a.wrapping_sub(operand),
            // CMP
            (13, true) if d == PC => {
                self.add(a, !operand, true);
                return;
            }
            _ => panic!("wide data processing {kind}, {flags}"),
        };
        self.registers[d] = value;
    }
}

/// An immediate of twelve bits (`ThumbExpandImm`).
fn expanded(immediate: u32) -> u32 {
    let byte = immediate & 0xff;
    match immediate >> 8 {
        0 => byte,
        1 => byte << 16 | byte,
        2 => byte << 24 | byte << 8,
        3 => byte << 24 | byte << 16 | byte << 8 | byte,
        _ => (immediate & 0x7f | 0x80).rotate_right(immediate >> 7),
    }
}
