//! System control space of the Cortex-M4: NVIC, `SysTick`, system control block, DWT cycle counter, FPU control.
//!
//! Priorities have 4 bits and no subgroups (PRIGROUP 0). `MemManage` can be enabled and never happens.

use crate::error::{Refusal, only};

/// Exception number of the NMI.
pub(crate) const NMI: u16 = 2;
/// Its priority, which no mask keeps back.
pub(crate) const NMI_PRIORITY: i16 = -2;
/// Exception number of `HardFault`.
pub(crate) const HARD_FAULT: u16 = 3;
/// Exception number of `BusFault`.
pub(crate) const BUS_FAULT: u16 = 5;
/// Exception number of `UsageFault`.
pub(crate) const USAGE_FAULT: u16 = 6;
/// Exception number of SVC.
pub(crate) const SV_CALL: u16 = 11;
/// Exception number of `PendSV`.
pub(crate) const PEND_SV: u16 = 14;
/// Exception number of `SysTick`.
pub(crate) const SYS_TICK: u16 = 15;
/// Exception number of interrupt 0.
pub(crate) const FIRST_INTERRUPT: u16 = 16;
/// Interrupts of the STM32G474.
pub(crate) const INTERRUPTS: usize = 102;
/// Priority bits that exist.
const PRIORITY_MASK: u8 = 0xf0;
/// Priority below all others: thread mode.
pub(crate) const THREAD_PRIORITY: i16 = 256;

/// An exception that is active.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Active {
    /// Exception number.
    pub exception: u16,
    /// Its priority when it was taken; that of `HardFault` is -1.
    pub priority: i16,
}

/// Registers and pending state.
#[derive(Debug, Clone)]
pub(crate) struct Scs {
    enabled: u128,
    pending: u128,
    active: u128,
    priority: [u8; 112],
    system_priority: [u8; 16],
    system_pending: u16,
    /// Vector table offset.
    pub vector_table: u32,
    /// Active exceptions, the innermost last.
    pub stack: Vec<Active>,
    systick_control: u32,
    systick_reload: u32,
    systick_start: u64,
    cycle_count_origin: u64,
    dwt_control: u32,
    demcr: u32,
    cpacr: u32,
    scr: u32,
    ccr: u32,
    shcsr: u32,
    fpccr: u32,
    fpcar: u32,
    fpdscr: u32,
    /// CFSR.
    pub fault_status: u32,
    /// HFSR.
    pub hard_fault_status: u32,
    /// BFAR.
    pub bus_fault_address: u32,
    /// SYSRESETREQ was written.
    pub reset_requested: bool,
}

impl Scs {
    /// State behind a reset.
    pub(crate) fn new(vector_table: u32) -> Self {
        Self {
            enabled: 0,
            pending: 0,
            active: 0,
            priority: [0; 112],
            system_priority: [0; 16],
            system_pending: 0,
            vector_table,
            stack: Vec::new(),
            systick_control: 0,
            systick_reload: 0,
            systick_start: 0,
            cycle_count_origin: 0,
            dwt_control: 0x4000_0000,
            demcr: 0,
            cpacr: 0,
            scr: 0,
            ccr: 0x200,
            shcsr: 0,
            fpccr: 0xc000_0000,
            fpcar: 0,
            fpdscr: 0,
            fault_status: 0,
            hard_fault_status: 0,
            bus_fault_address: 0,
            reset_requested: false,
        }
    }

    /// Priority that code runs at, without PRIMASK and BASEPRI.
    pub(crate) fn running_priority(&self) -> i16 {
        self.stack.iter().map(|active| active.priority).min().unwrap_or(THREAD_PRIORITY)
    }

    /// Enabled, pending exception of the highest priority that may preempt what runs, masks left aside.
    ///
    /// Among equals the lowest exception number goes first.
    pub(crate) fn candidate(&self) -> Option<(u16, i16)> {
        if self.system_pending >> NMI & 1 == 1 && self.running_priority() > NMI_PRIORITY {
            return Some((NMI, NMI_PRIORITY));
        }
        let mut best: Option<(u16, i16)> = None;
        let mut consider = |exception: u16, priority: u8| {
            let priority = i16::from(priority);
            if best.is_none_or(|(_, highest)| priority < highest) {
                best = Some((exception, priority));
            }
        };
        for exception in [SV_CALL, PEND_SV, SYS_TICK] {
            if self.system_pending >> exception & 1 == 1 {
                consider(exception, self.system_priority[exception as usize]);
            }
        }
        let mut ready = self.pending & self.enabled;
        while ready != 0 {
            let interrupt = ready.trailing_zeros();
            ready &= ready - 1;
            consider(FIRST_INTERRUPT + interrupt as u16, self.priority[interrupt as usize]);
        }
        best.filter(|(_, priority)| *priority < self.running_priority())
    }

    /// Pends the interrupts whose `lines` are high and that do not run; true if any is new.
    pub(crate) fn raise(&mut self, lines: u128) -> bool {
        let new = lines & !self.active & !self.pending;
        self.pending |= new;
        new & self.enabled != 0
    }

    /// Pends the NMI unless it runs; true if that is new.
    pub(crate) fn raise_nmi(&mut self) -> bool {
        let new =
            self.system_pending >> NMI & 1 == 0 && !self.stack.iter().any(|active| active.exception == NMI);
        if new {
            self.system_pending |= 1 << NMI;
        }
        new
    }

    /// Priority of the handler that SHCSR enables for the fault `exception`.
    pub(crate) fn fault_handler(&self, exception: u16) -> Option<i16> {
        let enabled = self.shcsr >> (12 + exception) & 1 == 1;
        enabled.then(|| i16::from(self.system_priority[exception as usize]))
    }

    /// Pends a system exception.
    pub(crate) fn pend_system(&mut self, exception: u16) {
        self.system_pending |= 1 << exception;
    }

    /// Marks `exception` as taken.
    pub(crate) fn enter(&mut self, exception: u16, priority: i16) {
        if exception >= FIRST_INTERRUPT {
            let bit = 1_u128 << (exception - FIRST_INTERRUPT);
            self.pending &= !bit;
            self.active |= bit;
        } else {
            self.system_pending &= !(1 << exception);
        }
        self.stack.push(Active { exception, priority });
    }

    /// Marks the innermost exception as done.
    pub(crate) fn leave(&mut self) -> Option<Active> {
        let done = self.stack.pop()?;
        if done.exception >= FIRST_INTERRUPT {
            self.active &= !(1_u128 << (done.exception - FIRST_INTERRUPT));
        }
        Some(done)
    }

    /// Cycle at which `SysTick` next reaches zero; `u64::MAX` if it is off.
    pub(crate) fn next_event(&self) -> u64 {
        if self.systick_control & 1 == 0 || self.systick_reload == 0 {
            return u64::MAX;
        }
        self.systick_start + u64::from(self.systick_reload) + 1
    }

    /// Brings `SysTick` up to `now`; true if it pended its exception.
    pub(crate) fn advance(&mut self, now: u64) -> bool {
        if now < self.next_event() {
            return false;
        }
        let period = u64::from(self.systick_reload) + 1;
        self.systick_start += (now - self.systick_start) / period * period;
        self.systick_control |= 1 << 16;
        if self.systick_control & 2 != 0 {
            self.system_pending |= 1 << SYS_TICK;
            return true;
        }
        false
    }

    fn cycle_counter_runs(&self) -> bool {
        self.demcr & 1 << 24 != 0 && self.dwt_control & 1 != 0
    }

    /// Value of the register at `offset` from 0xE0000000.
    pub(crate) fn read(&mut self, offset: u32, now: u64) -> Result<u32, Refusal> {
        let bank = (offset >> 2 & 3) * 32;
        Ok(match offset {
            0x1000 => self.dwt_control,
            0x1004 if self.cycle_counter_runs() => now.wrapping_sub(self.cycle_count_origin) as u32,
            0x1004 => self.cycle_count_origin as u32,
            0xe004 => 3,
            0xe010 => {
                let value = self.systick_control;
                self.systick_control &= !(1 << 16);
                value
            }
            0xe014 => self.systick_reload,
            0xe018 if self.systick_control & 1 == 0 => 0,
            0xe018 => {
                let period = u64::from(self.systick_reload) + 1;
                (period - 1 - (now - self.systick_start) % period) as u32
            }
            0xe01c => 0,
            0xe100..=0xe10c | 0xe180..=0xe18c => (self.enabled >> bank) as u32,
            0xe200..=0xe20c | 0xe280..=0xe28c => (self.pending >> bank) as u32,
            0xe300..=0xe30c => (self.active >> bank) as u32,
            0xe400..=0xe46c => {
                let at = (offset - 0xe400) as usize;
                u32::from_le_bytes(std::array::from_fn(|k| self.priority[at + k]))
            }
            0xed00 => 0x410f_c241,
            0xed04 => self.icsr(),
            0xed08 => self.vector_table,
            0xed0c => 0xfa05_0000,
            0xed10 => self.scr,
            0xed14 => self.ccr,
            0xed18..=0xed20 => {
                let at = (offset - 0xed18 + 4) as usize;
                u32::from_le_bytes(std::array::from_fn(|k| self.system_priority[at + k]))
            }
            0xed24 => self.shcsr,
            0xed28 => self.fault_status,
            0xed2c => self.hard_fault_status,
            0xed38 => self.bus_fault_address,
            // No memory protection, no debugger.
            0xed30 | 0xed34 | 0xedf0 => 0,
            0xed88 => self.cpacr,
            0xedfc => self.demcr,
            0xef34 => self.fpccr,
            0xef38 => self.fpcar,
            0xef3c => self.fpdscr,
            0xef40 => 0x1011_0021,
            0xef44 => 0x1100_0011,
            0xef48 => 0,
            _ => return Err(Refusal::no_register(offset)),
        })
    }

    fn icsr(&self) -> u32 {
        let running = self.stack.last().map_or(0, |active| u32::from(active.exception));
        let interrupts = self.pending & self.enabled;
        let vect_pending = self.candidate().map_or(0, |(exception, _)| u32::from(exception));
        running
            | u32::from(self.stack.len() <= 1) << 11
            | vect_pending << 12
            | u32::from(interrupts != 0) << 22
            | u32::from(self.system_pending >> SYS_TICK & 1) << 26
            | u32::from(self.system_pending >> PEND_SV & 1) << 28
            | u32::from(self.system_pending >> NMI & 1) << 31
    }

    /// Writes `size` bytes of `value` to the register at `offset` from 0xE0000000.
    pub(crate) fn write(&mut self, offset: u32, size: usize, value: u32, now: u64) -> Result<(), Refusal> {
        let byte_register = matches!(offset, 0xe400..=0xe46f | 0xed18..=0xed23);
        if size != 4 && !byte_register {
            return Err(Refusal::because(format!("a write of {size} bytes, the register takes words")));
        }
        let banked = u128::from(value) << ((offset >> 2 & 3) * 32);
        match offset {
            0x1000 => {
                only("DWT_CTRL", value, 0x4000_0001)?;
                let ran = self.cycle_counter_runs();
                self.dwt_control = value | 0x4000_0000;
                self.switch_cycle_counter(ran, now);
            }
            0x1004 if self.cycle_counter_runs() => {
                self.cycle_count_origin = now.wrapping_sub(u64::from(value));
            }
            0x1004 => self.cycle_count_origin = u64::from(value),
            0x1fb0 => {}
            0xe010 => {
                only("SYST_CSR", value, 0x0001_0007)?;
                if value & 4 == 0 && value & 1 != 0 {
                    return Err(Refusal::because("SysTick from HCLK/8 (CLKSOURCE 0) is not modelled"));
                }
                if value & 1 != 0 && self.systick_control & 1 == 0 {
                    self.systick_start = now;
                }
                self.systick_control = value & 7;
            }
            0xe014 => self.systick_reload = value & 0x00ff_ffff,
            0xe018 => {
                self.systick_start = now;
                self.systick_control &= !(1 << 16);
            }
            0xe100..=0xe10c => self.enabled |= banked,
            0xe180..=0xe18c => self.enabled &= !banked,
            0xe200..=0xe20c => self.pending |= banked,
            0xe280..=0xe28c => self.pending &= !banked,
            0xe400..=0xe46f => {
                for k in 0..size {
                    let slot = self.priority.get_mut((offset - 0xe400) as usize + k);
                    *slot.ok_or_else(|| Refusal::no_register(offset))? =
                        (value >> (8 * k)) as u8 & PRIORITY_MASK;
                }
            }
            0xed04 => {
                only("ICSR", value, 0x1e00_0000)?;
                for (exception, set, clear) in [(PEND_SV, 28, 27), (SYS_TICK, 26, 25)] {
                    if value >> set & 1 == 1 {
                        self.system_pending |= 1 << exception;
                    }
                    if value >> clear & 1 == 1 {
                        self.system_pending &= !(1 << exception);
                    }
                }
            }
            0xed08 => self.vector_table = value,
            0xed0c => {
                if value >> 16 != 0x05fa {
                    return Err(Refusal::because("AIRCR needs the key 0x05fa in its upper half"));
                }
                only("AIRCR", value & 0xffff, 0x4)?;
                self.reset_requested |= value & 4 != 0;
            }
            0xed10 => {
                only("SCR", value, 0)?;
                self.scr = value;
            }
            0xed14 => {
                only("CCR", value, 0x200)?;
                self.ccr = value;
            }
            0xed18..=0xed23 => {
                for k in 0..size {
                    let slot = self.system_priority.get_mut((offset - 0xed18 + 4) as usize + k);
                    *slot.ok_or_else(|| Refusal::no_register(offset))? =
                        (value >> (8 * k)) as u8 & PRIORITY_MASK;
                }
            }
            0xed24 => {
                only("SHCSR", value, 0x0007_0000)?;
                self.shcsr = value;
            }
            0xed28 => self.fault_status &= !value,
            0xed2c => self.hard_fault_status &= !value,
            0xed30 => {}
            0xed88 => {
                only("CPACR", value, 0x00f0_0000)?;
                self.cpacr = value;
            }
            0xedfc => {
                only("DEMCR", value, 1 << 24)?;
                let ran = self.cycle_counter_runs();
                self.demcr = value;
                self.switch_cycle_counter(ran, now);
            }
            0xef00 => {
                if value as usize >= INTERRUPTS {
                    return Err(Refusal::because(format!("interrupt {value} does not exist")));
                }
                self.pending |= 1_u128 << value;
            }
            0xef34 => {
                if value >> 30 != 3 {
                    return Err(Refusal::because("FPCCR without ASPEN and LSPEN is not modelled"));
                }
                self.fpccr = value;
            }
            0xef38 => self.fpcar = value,
            0xef3c => self.fpdscr = value,
            _ => return Err(Refusal::no_register(offset)),
        }
        Ok(())
    }

    /// Keeps the count when the counter starts or stops.
    fn switch_cycle_counter(&mut self, ran: bool, now: u64) {
        match (ran, self.cycle_counter_runs()) {
            (false, true) => self.cycle_count_origin = now.wrapping_sub(self.cycle_count_origin),
            (true, false) => {
                self.cycle_count_origin = u64::from(now.wrapping_sub(self.cycle_count_origin) as u32);
            }
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn with_priorities(list: &[(u32, u32)]) -> Scs {
        let mut scs = Scs::new(0x0800_0000);
        for (interrupt, priority) in list {
            let register = 0xe400 + interrupt;
            scs.write(register, 1, *priority, 0).expect("priority register");
            scs.write(0xe100 + 4 * (interrupt / 32), 4, 1 << (interrupt % 32), 0).expect("enable register");
        }
        scs
    }

    #[test]
    fn the_lowest_number_wins_among_equals_and_a_lower_value_above_all() {
        let mut scs = with_priorities(&[(20, 0x30), (50, 0x30), (18, 0x00)]);
        scs.raise(1 << 20 | 1 << 50);
        assert_eq!(scs.candidate(), Some((36, 0x30)));
        scs.raise(1 << 18);
        assert_eq!(scs.candidate(), Some((34, 0x00)));
    }

    #[test]
    fn an_equal_priority_does_not_preempt_and_a_line_that_stays_high_pends_again() {
        let mut scs = with_priorities(&[(20, 0x30), (50, 0x30)]);
        scs.raise(1 << 20);
        scs.enter(36, 0x30);
        scs.raise(1 << 20 | 1 << 50);
        assert_eq!(scs.candidate(), None);
        scs.leave();
        assert_eq!(scs.candidate(), Some((66, 0x30)));
        scs.raise(1 << 20);
        assert_eq!(scs.candidate(), Some((36, 0x30)));
    }

    #[test]
    fn priorities_have_four_bits() {
        let mut scs = with_priorities(&[(7, 0x5f)]);
        assert_eq!(scs.read(0xe404, 0), Ok(0x5000_0000));
    }

    #[test]
    fn the_cycle_counter_needs_trcena_and_its_enable() {
        let mut scs = Scs::new(0);
        assert_eq!(scs.read(0x1004, 500), Ok(0));
        scs.write(0xedfc, 4, 1 << 24, 500).expect("DEMCR");
        scs.write(0x1004, 4, 7, 500).expect("CYCCNT");
        scs.write(0x1000, 4, 0x4000_0001, 600).expect("DWT_CTRL");
        assert_eq!(scs.read(0x1004, 1000), Ok(407));
        scs.write(0x1000, 4, 0x4000_0000, 1000).expect("DWT_CTRL");
        assert_eq!(scs.read(0x1004, 9000), Ok(407));
    }

    #[test]
    fn systick_counts_reload_plus_one() {
        let mut scs = Scs::new(0);
        scs.write(0xe014, 4, 99, 0).expect("SYST_RVR");
        scs.write(0xe010, 4, 7, 1000).expect("SYST_CSR");
        assert_eq!(scs.next_event(), 1100);
        assert!(!scs.advance(1099));
        assert!(scs.advance(1100));
        assert_eq!(scs.candidate(), Some((15, 0)));
        assert_eq!(scs.read(0xe018, 1110), Ok(89));
    }

    #[test]
    fn unmodelled_registers_and_bits_are_refused() {
        let mut scs = Scs::new(0);
        assert!(scs.read(0xed90, 0).is_err(), "no MPU");
        assert!(scs.write(0xed10, 4, 4, 0).is_err(), "SLEEPDEEP");
        assert!(scs.write(0xed0c, 4, 4, 0).is_err(), "AIRCR without key");
        assert!(scs.write(0xe100, 1, 1, 0).is_err(), "NVIC_ISER by bytes");
        scs.write(0xed0c, 4, 0x05fa_0004, 0).expect("SYSRESETREQ");
        assert!(scs.reset_requested);
    }
}
