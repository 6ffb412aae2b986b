//! Advanced timer TIM1: centre-aligned and up counting, repetition, preload, break, complementary outputs, TRGO2
//! (RM0440, TIM1/TIM8/TIM20).
//!
//! Outputs are described by their mean over a period; dead time is kept and read back, its effect on the mean left
//! aside. Behind a break, and while a debugger freezes the timer, OSSI says whether the outputs are driven low or float; OSSR does
//! so for one output of a pair that is off (RM0440, TIM1, output control bits). The break filter delays either edge; LOCK is written
//! once and protects until the next reset. Not modelled: down counting, input capture, slave modes, DMA, dithering, BKIN2,
//! bidirectional break, input filters, compare flags and their interrupts. The interrupts are those of break and update.

use super::NEVER;
use crate::error::{Refusal, only};

const CHANNELS: usize = 6;
const UPDATE_DISABLE: u32 = 1 << 1;
const UPDATE_REQUEST_SOURCE: u32 = 1 << 2;
const AUTO_RELOAD_PRELOAD: u32 = 1 << 7;
const MAIN_OUTPUT_ENABLE: u32 = 1 << 15;
const OFF_STATE_RUN: u32 = 1 << 11;
const OFF_STATE_IDLE: u32 = 1 << 10;
const LOCK: u32 = 3 << 8;
/// Bits of BDTR that lock levels 1 and 2 protect (RM0440, `TIM1_BDTR`): DTG, BKE, BKP, AOE, BKF; OSSI and OSSR too.
const LOCKED_BDTR: [u32; 2] = [0x000f_70ff, 0x000f_7cff];
/// Cycles between two samples of the break filter and samples that it wants, by BKF (RM0440, `TIM1_BDTR`; CKD 0).
const BREAK_FILTER: [(u64, u64); 16] = [
    (0, 0),
    (1, 2),
    (1, 4),
    (1, 8),
    (2, 6),
    (2, 8),
    (4, 6),
    (4, 8),
    (8, 6),
    (8, 8),
    (16, 5),
    (16, 6),
    (16, 8),
    (32, 5),
    (32, 6),
    (32, 8),
];
const AUTOMATIC_OUTPUT_ENABLE: u32 = 1 << 14;
const BREAK_POLARITY_HIGH: u32 = 1 << 13;
const BREAK_ENABLE: u32 = 1 << 12;
const UPDATE_FLAG: u32 = 1;
const BREAK_FLAG: u32 = 1 << 7;
const SYSTEM_BREAK_FLAG: u32 = 1 << 13;

/// What the pair of outputs of one channel does to a half bridge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Leg {
    /// Both gates are driven low.
    Off,
    /// The timer drives neither gate: what they see is up to pull-downs.
    Floating,
    /// The high side is on for this fraction of the time, the low side for the rest.
    Switching(f64),
}

/// TIM1.
#[expect(clippy::struct_excessive_bools, reason = "independent levels and marks, no state machine")]
#[derive(Debug, Clone)]
pub(crate) struct AdvancedTimer {
    cr1: u32,
    cr2: u32,
    dier: u32,
    sr: u32,
    ccmr: [u32; 3],
    ccer: u32,
    prescaler: u32,
    prescaler_active: u32,
    reload: u32,
    reload_active: u32,
    repetition: u32,
    repetition_left: u32,
    compare: [u32; CHANNELS],
    compare_active: [u32; CHANNELS],
    bdtr: u32,
    af1: u32,
    /// BDTR was written: LOCK is what it is until the next reset.
    lock_is_set: bool,
    /// Level at the BKIN pin.
    break_pin: bool,
    /// A system break that lasts: the processor's supply.
    system_break: bool,
    /// Level behind the break filter: active.
    break_seen: bool,
    /// Cycle at which the filter passes the pin's level on, if that is another one.
    break_change: u64,
    /// Cycle at which a debugger froze the counter.
    frozen_since: Option<u64>,
    /// Cycle at which the present half period (up counting: period) began.
    half_start: u64,
    /// The present half counts down.
    down: bool,
    /// Count while the counter is stopped.
    stopped_count: u32,
    /// TRGO2 pulses since they were last taken.
    triggers: u32,
    /// Cycle of the last update event of the counter.
    last_update: u64,
}

impl AdvancedTimer {
    /// The timer behind a reset.
    pub(crate) fn new() -> Self {
        Self {
            cr1: 0,
            cr2: 0,
            dier: 0,
            sr: 0,
            ccmr: [0; 3],
            ccer: 0,
            prescaler: 0,
            prescaler_active: 0,
            reload: 0xffff,
            reload_active: 0xffff,
            repetition: 0,
            repetition_left: 0,
            compare: [0; CHANNELS],
            compare_active: [0; CHANNELS],
            bdtr: 0,
            af1: 1,
            lock_is_set: false,
            break_pin: true,
            system_break: false,
            break_seen: false,
            break_change: NEVER,
            frozen_since: None,
            half_start: 0,
            down: false,
            stopped_count: 0,
            triggers: 0,
            last_update: 0,
        }
    }

    /// Back to the reset state; the level at BKIN stays.
    pub(crate) fn reset(&mut self) {
        *self = Self {
            break_pin: self.break_pin,
            system_break: self.system_break,
            frozen_since: self.frozen_since,
            ..Self::new()
        };
    }

    fn runs(&self) -> bool {
        self.cr1 & 1 != 0
    }

    fn centre_aligned(&self) -> bool {
        self.cr1 >> 5 & 3 != 0
    }

    /// Counts of a half period (up counting: a period).
    fn half_counts(&self) -> u64 {
        u64::from(self.reload_active) + u64::from(!self.centre_aligned())
    }

    fn cycles_per_count(&self) -> u64 {
        u64::from(self.prescaler_active) + 1
    }

    fn half_cycles(&self) -> u64 {
        self.half_counts().max(1) * self.cycles_per_count()
    }

    /// Count and direction (true: down) at `now`.
    fn position(&self, now: u64) -> (u32, bool) {
        if !self.runs() {
            return (self.stopped_count, self.down);
        }
        let now = self.frozen_since.unwrap_or(now);
        let counts = now.saturating_sub(self.half_start) / self.cycles_per_count();
        let (halves, inside) = (counts / self.half_counts().max(1), counts % self.half_counts().max(1));
        let down = self.centre_aligned() && (self.down ^ (halves & 1 == 1));
        let count = if down { self.half_counts() - inside } else { inside };
        (count as u32, down)
    }

    /// Cycle of the next update event, [`NEVER`] while the counter stands.
    pub(crate) fn next_event(&self) -> u64 {
        if !self.runs() || self.reload_active == 0 || self.frozen_since.is_some() {
            return NEVER;
        }
        self.half_start + self.half_cycles() * (u64::from(self.repetition_left) + 1)
    }

    /// Brings the counter up to `now`, one update event after the other.
    pub(crate) fn advance(&mut self, now: u64) {
        while self.next_event() <= now {
            let halves = u64::from(self.repetition_left) + 1;
            self.half_start += self.half_cycles() * halves;
            self.down = self.centre_aligned() && (self.down ^ (halves & 1 == 1));
            self.last_update = self.half_start;
            self.update_event(true);
        }
    }

    /// Cycle of the last update event that the counter made.
    pub(crate) fn last_update(&self) -> u64 {
        self.last_update
    }

    fn update_event(&mut self, from_counter: bool) {
        if self.cr1 & UPDATE_DISABLE != 0 {
            self.repetition_left = self.repetition;
            return;
        }
        self.prescaler_active = self.prescaler;
        self.reload_active = self.reload;
        self.compare_active = self.compare;
        self.repetition_left = self.repetition;
        if from_counter || self.cr1 & UPDATE_REQUEST_SOURCE == 0 {
            self.sr |= UPDATE_FLAG;
        }
        if from_counter && self.bdtr & AUTOMATIC_OUTPUT_ENABLE != 0 && !self.break_input() {
            self.bdtr |= MAIN_OUTPUT_ENABLE;
        }
        if self.cr2 >> 20 & 0xf == 2 {
            self.triggers += 1;
        }
    }

    /// Number of TRGO2 pulses since the last call.
    pub(crate) fn take_triggers(&mut self) -> u32 {
        std::mem::take(&mut self.triggers)
    }

    /// A debugger holds the core with `DBG_TIM1_STOP` set, or lets it go on.
    pub(crate) fn freeze(&mut self, frozen: bool, now: u64) {
        match (self.frozen_since, frozen) {
            (None, true) => self.frozen_since = Some(now),
            (Some(since), false) => {
                self.half_start += now - since;
                self.frozen_since = None;
            }
            _ => {}
        }
    }

    /// Whether the pin in front of the break filter is active.
    fn break_wanted(&self) -> bool {
        let pin = if self.af1 >> 9 & 1 == 1 { !self.break_pin } else { self.break_pin };
        self.af1 & 1 != 0 && pin == (self.bdtr & BREAK_POLARITY_HIGH != 0)
    }

    /// Whether the break function sees an active input.
    fn break_input(&self) -> bool {
        self.bdtr & BREAK_ENABLE != 0 && self.break_seen
    }

    /// Follows the pin through the break filter.
    fn follow_break(&mut self, now: u64) {
        let (between, samples) = BREAK_FILTER[(self.bdtr >> 16 & 0xf) as usize];
        if self.break_wanted() == self.break_seen {
            self.break_change = NEVER;
        } else if samples == 0 {
            self.break_seen = !self.break_seen;
            self.break_change = NEVER;
        } else if self.break_change == NEVER {
            self.break_change = now + between * samples;
        }
        self.apply_break();
    }

    /// Cycle at which the break filter passes another level on.
    pub(crate) fn break_event(&self) -> u64 {
        self.break_change
    }

    /// The filter passes the pin's level on.
    pub(crate) fn pass_break(&mut self) {
        self.break_change = NEVER;
        self.break_seen = self.break_wanted();
        self.apply_break();
    }

    fn apply_break(&mut self) {
        if self.break_input() {
            self.bdtr &= !MAIN_OUTPUT_ENABLE;
            self.sr |= BREAK_FLAG;
        }
        if self.system_break {
            self.system_break();
        }
    }

    /// A system break begins that lasts until it is taken back, or is taken back.
    pub(crate) fn set_system_break(&mut self, active: bool) {
        self.system_break = active;
        self.apply_break();
    }

    /// A system break: failure of the clock, lockup and their like (RM0440, TIM1 break function).
    pub(crate) fn system_break(&mut self) {
        if self.bdtr & BREAK_ENABLE != 0 {
            self.bdtr &= !MAIN_OUTPUT_ENABLE;
            self.sr |= SYSTEM_BREAK_FLAG;
        }
    }

    /// Level at the BKIN pin changed.
    pub(crate) fn set_break_pin(&mut self, level: bool, now: u64) {
        self.break_pin = level;
        self.follow_break(now);
    }

    /// Whether the line of break (`TIM1_BRK_TIM15`) is high.
    pub(crate) fn break_line(&self) -> bool {
        self.sr & (BREAK_FLAG | SYSTEM_BREAK_FLAG) != 0 && self.dier & BREAK_FLAG != 0
    }

    /// Whether the line of update (`TIM1_UP_TIM16`) is high.
    pub(crate) fn update_line(&self) -> bool {
        self.sr & self.dier & UPDATE_FLAG != 0
    }

    /// Whether the main output enable is set and no debugger has frozen the timer, which acts like a cleared one.
    pub(crate) fn main_output(&self) -> bool {
        self.bdtr & MAIN_OUTPUT_ENABLE != 0 && self.frozen_since.is_none()
    }

    /// Compare registers as the firmware wrote them.
    pub(crate) fn compare(&self) -> [u32; CHANNELS] {
        self.compare
    }

    /// Compare values in use since the last update event.
    pub(crate) fn compare_active(&self) -> [u32; CHANNELS] {
        self.compare_active
    }

    /// Auto-reload value in use.
    pub(crate) fn reload_active(&self) -> u32 {
        self.reload_active
    }

    /// Dead time generator setting, DTG.
    pub(crate) fn dead_time_raw(&self) -> u8 {
        self.bdtr as u8
    }

    /// Fraction of a period for which `OCxREF` is high.
    fn reference_high(&self, channel: usize) -> f64 {
        let mode = self.ccmr[channel / 2] >> (8 * (channel % 2) + 4);
        let mode = mode & 7 | self.ccmr[channel / 2] >> (8 * (channel % 2) + 13) & 8;
        let whole = f64::from(self.reload_active) + if self.centre_aligned() { 0.0 } else { 1.0 };
        let compare = self.compare_active[channel];
        let below = if !self.runs() {
            // A counter that stands leaves the comparison as it is.
            f64::from(u8::from(self.stopped_count < compare))
        } else if whole > 0.0 {
            (f64::from(compare) / whole).min(1.0)
        } else {
            0.0
        };
        match mode {
            6 => below,
            7 => 1.0 - below,
            5 => 1.0,
            _ => 0.0,
        }
    }

    /// What outputs `channel` and its complement (0 to 2) do.
    pub(crate) fn leg(&self, channel: usize) -> Leg {
        let bits = self.ccer >> (4 * channel);
        let (high, low) = (bits & 1 != 0, bits & 4 != 0);
        if !self.main_output() {
            let driven = self.bdtr & OFF_STATE_IDLE != 0 && high && low;
            return if driven { Leg::Off } else { Leg::Floating };
        }
        if !(high && low) {
            let driven = self.bdtr & OFF_STATE_RUN != 0 && (high || low);
            return if driven { Leg::Off } else { Leg::Floating };
        }
        let reference = self.reference_high(channel);
        Leg::Switching(if bits & 2 != 0 { 1.0 - reference } else { reference })
    }

    /// Value of the register at `offset`.
    pub(crate) fn read(&mut self, offset: u32, now: u64) -> Result<u32, Refusal> {
        let (count, down) = self.position(now);
        Ok(match offset {
            0x00 => self.cr1 | u32::from(down) << 4,
            0x04 => self.cr2,
            0x08 | 0x14 => 0,
            0x0c => self.dier,
            0x10 => self.sr,
            0x18 | 0x1c => self.ccmr[(offset as usize - 0x18) / 4],
            0x20 => self.ccer,
            0x24 => count,
            0x28 => self.prescaler,
            0x2c => self.reload,
            0x30 => self.repetition,
            0x34..=0x40 => self.compare[(offset as usize - 0x34) / 4],
            0x44 => self.bdtr,
            0x48 | 0x4c => self.compare[(offset as usize - 0x48) / 4 + 4],
            0x50 => self.ccmr[2],
            0x54 | 0x58 | 0x5c => 0,
            0x60 => self.af1,
            0x64 => 1,
            _ => return Err(Refusal::no_register(offset)),
        })
    }

    fn set_compare(&mut self, channel: usize, value: u32) {
        self.compare[channel] = value & 0xffff;
        let preload = self.ccmr[channel / 2] >> (8 * (channel % 2) + 3) & 1 == 1;
        if !preload {
            self.compare_active[channel] = self.compare[channel];
        }
    }

    fn write_cr1(&mut self, value: u32, now: u64) -> Result<(), Refusal> {
        only("CR1", value & !0x300, 0xf7)?;
        if self.runs() && (value ^ self.cr1) & 0x60 != 0 {
            return Err(Refusal::because("CMS must not change while the counter runs"));
        }
        if value & 0x10 != 0 && value & 0x60 == 0 {
            return Err(Refusal::because("down counting is not modelled"));
        }
        if value & 8 != 0 {
            return Err(Refusal::because("one-pulse mode is not modelled"));
        }
        let (count, down) = self.position(now);
        let ran = self.runs();
        self.cr1 = value & !0x10;
        if ran && !self.runs() {
            self.stopped_count = count;
            self.down = down;
        } else if !ran && self.runs() {
            let count = u64::from(count);
            let done = if self.down { self.half_counts().saturating_sub(count) } else { count };
            self.half_start = now.saturating_sub(done * self.cycles_per_count());
        }
        Ok(())
    }

    /// Lock level, 0 to 3.
    pub(crate) fn lock_level(&self) -> u32 {
        self.bdtr >> 8 & 3
    }

    fn write_bdtr(&mut self, value: u32, now: u64) -> Result<(), Refusal> {
        only("BDTR", value, 0x000f_ffff)?;
        let protected = match self.lock_level() {
            0 => 0,
            1 => LOCKED_BDTR[0],
            _ => LOCKED_BDTR[1],
        };
        // LOCK is frozen by the first write behind a reset, whatever it was.
        let locked = protected | if self.lock_is_set { LOCK } else { 0 };
        self.lock_is_set = true;
        self.bdtr = self.bdtr & locked | value & !locked;
        self.follow_break(now);
        Ok(())
    }

    /// Writes the register at `offset`.
    pub(crate) fn write(&mut self, offset: u32, value: u32, now: u64) -> Result<(), Refusal> {
        match offset {
            0x00 => self.write_cr1(value, now)?,
            0x04 => {
                // OIS bits are kept; the idle state of this board's bridge is off either way.
                only("CR2", value, 0x00f0_3f70)?;
                if value >> 20 & 0xf != 0 && value >> 20 & 0xf != 2 {
                    return Err(Refusal::because("CR2: of MMS2 only reset (0) and update (2) are modelled"));
                }
                if value & 0x3f00 != 0 && self.lock_level() == 0 {
                    return Err(Refusal::because("CR2: idle states (OIS) that switch a transistor on"));
                }
                if value >> 4 & 7 != 0 {
                    return Err(Refusal::because("CR2: TRGO (MMS) is not modelled"));
                }
                self.cr2 = value;
            }
            0x08 => only("SMCR", value, 0)?,
            0x0c => {
                only("DIER", value, 0x81)?;
                self.dier = value;
            }
            0x10 => {
                self.sr &= value;
                self.apply_break();
            }
            0x14 => {
                only("EGR", value, 0x81)?;
                if value & 1 != 0 {
                    self.stopped_count = 0;
                    self.down = false;
                    self.half_start = now;
                    self.update_event(false);
                    if self.cr2 >> 20 & 0xf == 0 {
                        self.triggers += 1;
                    }
                }
                if value & 0x80 != 0 {
                    self.bdtr &= !MAIN_OUTPUT_ENABLE;
                    self.sr |= BREAK_FLAG;
                }
            }
            0x18 | 0x1c | 0x50 => {
                if value & 0x0303 != 0 && offset != 0x50 {
                    return Err(Refusal::because("CCMR: input capture is not modelled"));
                }
                if value & 0x8484 != 0 {
                    return Err(Refusal::because("CCMR: fast and clear of a compare are not modelled"));
                }
                let register = if offset == 0x50 { 2 } else { (offset as usize - 0x18) / 4 };
                // Lock level 3 protects OCxM and OCxPE.
                let locked = if self.lock_level() == 3 { 0x0101_7878 } else { 0 };
                self.ccmr[register] = self.ccmr[register] & locked | value & !locked;
                for channel in [2 * register, 2 * register + 1] {
                    self.set_compare(channel, self.compare[channel]);
                }
            }
            0x20 => {
                only("CCER", value, 0x0033_ffff)?;
                // Lock level 2 protects the polarities.
                let locked = if self.lock_level() >= 2 { 0x0022_aaaa } else { 0 };
                self.ccer = self.ccer & locked | value & !locked;
            }
            0x24 if !self.runs() => self.stopped_count = value & 0xffff,
            0x24 => return Err(Refusal::because("CNT must not be written while the counter runs")),
            0x28 => self.prescaler = value & 0xffff,
            0x2c => {
                self.reload = value & 0xffff;
                if self.cr1 & AUTO_RELOAD_PRELOAD == 0 {
                    if self.runs() {
                        return Err(Refusal::because("ARR without preload while the counter runs: set ARPE"));
                    }
                    self.reload_active = self.reload;
                }
            }
            0x30 => self.repetition = value & 0xffff,
            0x34..=0x40 => self.set_compare((offset as usize - 0x34) / 4, value),
            0x44 => self.write_bdtr(value, now)?,
            0x48 | 0x4c => self.set_compare((offset as usize - 0x48) / 4 + 4, value & 0xffff),
            0x54 => only("DTR2", value, 0)?,
            0x58 => only("ECR", value, 0)?,
            0x5c => only("TISEL", value, 0)?,
            0x60 => {
                only("AF1", value, 0x201)?;
                if self.lock_level() == 0 {
                    self.af1 = value;
                }
                self.follow_break(now);
            }
            0x64 => only("AF2", value, 1)?,
            _ => return Err(Refusal::no_register(offset)),
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Centre-aligned, ARR 5, no prescaler: 0 1 2 3 4 | 5 4 3 2 1 | 0 1 ... (RM0440, centre-aligned mode).
    fn small(repetition: u32) -> AdvancedTimer {
        let mut timer = AdvancedTimer::new();
        timer.write(0x2c, 5, 0).expect("ARR");
        timer.write(0x30, repetition, 0).expect("RCR");
        timer.write(0x00, 0xa4, 0).expect("CR1 ARPE CMS URS");
        timer.write(0x14, 1, 0).expect("EGR UG");
        timer.write(0x00, 0xa5, 100).expect("CR1 CEN");
        timer
    }

    #[test]
    fn centre_aligned_counts_up_to_arr_less_one_then_from_arr_down_to_one() {
        let mut timer = small(0);
        let counts: Vec<u32> = (100..122).map(|now| timer.read(0x24, now).expect("CNT")).collect();
        assert_eq!(counts, [0, 1, 2, 3, 4, 5, 4, 3, 2, 1, 0, 1, 2, 3, 4, 5, 4, 3, 2, 1, 0, 1]);
        let down: Vec<u32> = (100..110).map(|now| timer.read(0x00, now).expect("CR1") >> 4 & 1).collect();
        assert_eq!(down, [0, 0, 0, 0, 0, 1, 1, 1, 1, 1]);
    }

    #[test]
    fn without_repetition_overflow_and_underflow_each_make_an_update() {
        let mut timer = small(0);
        assert_eq!(timer.next_event(), 105);
        timer.advance(105);
        assert_eq!(timer.next_event(), 110);
        timer.advance(129);
        assert_eq!(timer.next_event(), 130);
        assert_eq!(timer.read(0x24, 129), Ok(1));
    }

    /// RCR 3 loaded before the start: overflow, underflow, overflow count down, the underflow updates.
    #[test]
    fn repetition_three_updates_at_every_second_underflow() {
        let mut timer = small(3);
        assert_eq!(timer.take_triggers(), 1, "MMS2 0: UG itself is the trigger");
        timer.write(0x04, 0x0020_0000, 100).expect("CR2 MMS2 = update");
        assert_eq!(timer.next_event(), 120);
        timer.advance(119);
        assert_eq!((timer.sr & 1, timer.take_triggers()), (0, 0));
        timer.advance(120);
        assert_eq!((timer.sr & 1, timer.take_triggers()), (1, 1));
        assert_eq!(timer.next_event(), 140);
    }

    /// RCR written behind the start without UG: the repetition counter is still 0, so the first overflow updates.
    #[test]
    fn a_repetition_written_behind_the_start_updates_at_overflows() {
        let mut timer = small(0);
        timer.write(0x30, 3, 101).expect("RCR");
        timer.advance(105);
        assert_eq!(timer.next_event(), 125);
        timer.advance(125);
        assert_eq!(timer.read(0x00, 125).map(|cr1| cr1 >> 4 & 1), Ok(1), "at the top, counting down");
    }

    #[test]
    fn the_board_s_setting_updates_ten_thousand_times_a_second() {
        let mut timer = AdvancedTimer::new();
        timer.write(0x2c, 4250, 0).expect("ARR");
        timer.write(0x30, 3, 0).expect("RCR");
        timer.write(0x00, 0xa4, 0).expect("CR1");
        timer.write(0x14, 1, 0).expect("EGR");
        timer.write(0x00, 0xa5, 0).expect("CR1");
        assert_eq!(timer.next_event(), 17_000, "170 MHz / 10 kHz");
        timer.advance(170_000_000);
        assert_eq!(timer.next_event(), 170_017_000);
    }

    fn driving() -> AdvancedTimer {
        let mut timer = small(0);
        timer.write(0x18, 0x6868, 100).expect("CCMR1 PWM 1, preload");
        timer.write(0x20, 0x55, 100).expect("CCER");
        timer.write(0x34, 3, 100).expect("CCR1");
        timer.write(0x44, 0x9022, 100).expect("BDTR BKE MOE DTG");
        timer
    }

    #[test]
    fn compare_values_wait_for_the_update() {
        let mut timer = driving();
        assert_eq!(timer.leg(0), Leg::Switching(0.0));
        timer.advance(105);
        assert_eq!(timer.leg(0), Leg::Switching(0.6));
        timer.write(0x34, 9, 106).expect("CCR1");
        timer.advance(110);
        assert_eq!(timer.leg(0), Leg::Switching(1.0), "beyond ARR: always on");
    }

    #[test]
    fn a_stopped_counter_leaves_the_outputs_where_they_are() {
        let mut timer = driving();
        timer.advance(105);
        timer.write(0x00, 0xa4, 107).expect("CR1 CEN off at count 3, counting down");
        assert_eq!(timer.leg(0), Leg::Switching(0.0), "3 is not below 3");
        timer.write(0x24, 2, 108).expect("CNT");
        assert_eq!(timer.leg(0), Leg::Switching(1.0));
    }

    #[test]
    fn a_low_break_pin_switches_off_and_stays_off() {
        let mut timer = driving();
        timer.write(0x0c, 0x80, 100).expect("DIER BIE");
        timer.set_break_pin(false, 100);
        assert!(!timer.main_output() && timer.break_line());
        assert_eq!(timer.leg(0), Leg::Floating, "OSSI 0");
        timer.write(0x10, !0x80, 101).expect("SR");
        assert!(timer.break_line(), "the flag comes back while the pin is low");
        timer.write(0x44, 0x0000_9022, 102).expect("BDTR MOE");
        assert!(!timer.main_output());
        timer.set_break_pin(true, 102);
        assert!(!timer.main_output(), "no automatic re-enable");
        timer.write(0x10, !0x80, 103).expect("SR");
        timer.write(0x44, 0x0000_9022, 104).expect("BDTR MOE");
        assert!(timer.main_output() && !timer.break_line());
    }

    #[test]
    fn off_states_drive_the_gates_low() {
        let mut timer = driving();
        timer.write(0x44, 0x9c22, 100).expect("BDTR BKE MOE OSSI OSSR DTG");
        timer.set_break_pin(false, 101);
        assert_eq!(timer.leg(0), Leg::Off, "OSSI 1");
        timer.set_break_pin(true, 102);
        timer.write(0x10, !0x80, 103).expect("SR");
        timer.write(0x44, 0x9c22, 104).expect("BDTR MOE");
        timer.freeze(true, 105);
        assert_eq!((timer.leg(0), timer.next_event()), (Leg::Off, NEVER));
        let count = timer.read(0x24, 105);
        assert_eq!(timer.read(0x24, 1000), count);
        timer.freeze(false, 1005);
        assert_eq!((timer.read(0x24, 1005), timer.next_event()), (count, 1005));
        timer.write(0x20, 0x51, 1005).expect("CCER without CC1NE");
        assert_eq!(timer.leg(0), Leg::Off, "OSSR 1");
        timer.write(0x20, 0x50, 1005).expect("CCER without CC1E and CC1NE");
        assert_eq!(timer.leg(0), Leg::Floating);
    }

    #[test]
    fn a_system_break_that_lasts_brings_its_flag_back_and_keeps_the_output_off() {
        let mut timer = driving();
        timer.set_system_break(true);
        assert!(!timer.main_output());
        timer.write(0x10, 0, 101).expect("SR");
        timer.write(0x44, 0x0000_9022, 102).expect("BDTR MOE");
        assert!(timer.sr & SYSTEM_BREAK_FLAG != 0 && !timer.main_output());
        timer.set_system_break(false);
        timer.write(0x10, 0, 103).expect("SR");
        timer.write(0x44, 0x0000_9022, 104).expect("BDTR MOE");
        assert!(timer.sr & SYSTEM_BREAK_FLAG == 0 && timer.main_output());
    }

    #[test]
    fn the_break_filter_keeps_short_pulses_away() {
        let mut timer = driving();
        // BKF 9: 8 samples of CK_INT / 8.
        timer.write(0x44, 9 << 16 | 0x9022, 100).expect("BDTR");
        timer.set_break_pin(false, 1000);
        assert_eq!((timer.main_output(), timer.break_event()), (true, 1064));
        timer.set_break_pin(true, 1063);
        assert_eq!((timer.main_output(), timer.break_event()), (true, NEVER));
        timer.set_break_pin(false, 2000);
        timer.pass_break();
        assert!(!timer.main_output());
        timer.set_break_pin(true, 2100);
        timer.write(0x44, 9 << 16 | 0x9022, 2101).expect("BDTR MOE");
        assert!(!timer.main_output(), "the filter holds the level for 64 cycles");
        timer.pass_break();
        timer.write(0x44, 9 << 16 | 0x9022, 2164).expect("BDTR MOE");
        assert!(timer.main_output());
    }

    #[test]
    fn a_lock_protects_until_the_next_reset_and_is_written_once() {
        let mut timer = small(0);
        timer.write(0x18, 0x6868, 100).expect("CCMR1");
        timer.write(0x20, 0x55, 100).expect("CCER");
        timer.write(0x44, 9 << 16 | LOCK | 0x1c3c, 100).expect("BDTR level 3");
        timer.write(0x44, 0x8000, 100).expect("BDTR");
        assert_eq!(timer.read(0x44, 100), Ok(9 << 16 | LOCK | 0x9c3c), "MOE alone changed");
        timer.write(0x18, 0, 100).expect("CCMR1");
        timer.write(0x20, 0xff, 100).expect("CCER");
        assert_eq!((timer.read(0x18, 100), timer.read(0x20, 100)), (Ok(0x6868), Ok(0x55)));
        timer.reset();
        timer.write(0x44, 0x22, 100).expect("BDTR");
        timer.write(0x44, LOCK | 0x22, 100).expect("BDTR");
        assert_eq!(timer.read(0x44, 100), Ok(0x22), "the first write decided");
    }

    #[test]
    fn a_software_break_clears_the_output_enable() {
        let mut timer = driving();
        timer.write(0x14, 0x80, 101).expect("EGR BG");
        assert!(!timer.main_output());
        assert_eq!(timer.read(0x10, 101).map(|sr| sr & 0x80), Ok(0x80));
    }

    #[test]
    fn what_is_not_modelled_or_forbidden_is_refused() {
        let mut timer = small(0);
        assert!(timer.write(0x00, 0x85, 101).is_err(), "CMS while running");
        assert!(timer.write(0x0c, 2, 101).is_err(), "compare interrupt");
        assert!(timer.write(0x04, 0x0010_0000, 101).is_err(), "MMS2 enable");
        assert!(timer.write(0x18, 1, 101).is_err(), "input capture");
        assert!(timer.write(0x24, 0, 101).is_err(), "CNT while running");
        assert!(timer.write(0x3dc, 0, 101).is_err(), "DCR");
    }
}
