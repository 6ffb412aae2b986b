//! ADC1 and ADC2 with their common part: regular and injected sequences, single-ended (RM0440, ADC).
//!
//! A conversion takes the sampling time of its channel plus 12.5 clock cycles (12 bits; 2 less for each 2 bits less);
//! the input is held at the end of the sampling time. The delay from a trigger to the first sample (below 4 clock
//! cycles) is left out. Not modelled: differential inputs, offsets, oversampling, watchdogs, dual modes, the injected
//! queue, discontinuous mode, automatic injection, left alignment, external triggers of regular sequences.

use super::NEVER;
use crate::error::{Refusal, only};

/// JEXTSEL of `tim1_trgo2` for ADC1 and ADC2.
const TRIGGER_TIM1_TRGO2: u32 = 8;
/// Sampling times in half clock cycles, by SMP code.
const SAMPLING_HALF_CYCLES: [u64; 8] = [5, 13, 25, 49, 95, 185, 495, 1281];

const READY: u32 = 1;
const END_OF_SAMPLING: u32 = 1 << 1;
const END_OF_CONVERSION: u32 = 1 << 2;
const END_OF_SEQUENCE: u32 = 1 << 3;
const OVERRUN: u32 = 1 << 4;
const INJECTED_CONVERSION: u32 = 1 << 5;
const INJECTED_SEQUENCE: u32 = 1 << 6;

const ENABLED: u32 = 1;
const DISABLE: u32 = 1 << 1;
const START: u32 = 1 << 2;
const INJECTED_START: u32 = 1 << 3;
const STOP: u32 = 1 << 4;
const INJECTED_STOP: u32 = 1 << 5;
const REGULATOR: u32 = 1 << 28;
const DEEP_POWER_DOWN: u32 = 1 << 29;
const CALIBRATE: u32 = 1 << 31;

/// Clock and channel common to both.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Common {
    ccr: u32,
}

impl Common {
    /// State behind a reset.
    pub(crate) fn new() -> Self {
        Self { ccr: 0 }
    }

    /// Cycles of HCLK a clock cycle of the ADC; `None` while it has no clock.
    pub(crate) fn hclk_per_clock(self, hclk_hz: u64, asynchronous_hz: Option<u64>) -> Option<f64> {
        match self.ccr >> 16 & 3 {
            0 => {
                let divider = match self.ccr >> 18 & 0xf {
                    code @ 0..=1 => 1 << code,
                    code @ 2..=6 => 2 * code,
                    7 => 16,
                    code => 32 << (code.min(11) - 8),
                };
                asynchronous_hz.map(|hz| hclk_hz as f64 / (hz as f64 / f64::from(divider)))
            }
            mode => Some(f64::from(1_u32 << (mode - 1))),
        }
    }

    /// Value of the register at `offset` (0 is CSR).
    pub(crate) fn read(self, offset: u32, status: [u32; 2]) -> Result<u32, Refusal> {
        match offset {
            0x00 => Ok(status[0] & 0x7ff | (status[1] & 0x7ff) << 16),
            0x08 => Ok(self.ccr),
            _ => Err(Refusal::no_register(offset)),
        }
    }

    /// Writes the register at `offset`.
    pub(crate) fn write(&mut self, offset: u32, value: u32, any_enabled: bool) -> Result<(), Refusal> {
        if offset != 8 {
            return Err(Refusal::no_register(offset));
        }
        // VREFEN, VSENSESEL and VBATSEL besides the clock.
        only("CCR", value, 0x01ff_0000)?;
        if any_enabled && (value ^ self.ccr) & 0x003f_0000 != 0 {
            return Err(Refusal::because("CCR: CKMODE and PRESC must not change while an ADC is enabled"));
        }
        self.ccr = value;
        Ok(())
    }
}

/// Which sequence converts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Sequence {
    Regular,
    Injected,
}

/// A conversion under way.
#[derive(Debug, Clone, Copy)]
struct Conversion {
    sequence: Sequence,
    rank: u32,
    /// Cycle at which the input is held.
    hold: u64,
    /// Cycle at which the result is there.
    end: u64,
    held: Option<u32>,
}

/// What the ADC wants from outside at an event.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Need {
    /// The code at this channel now; answer with [`Adc::hold`].
    Sample {
        /// Channel number.
        channel: u32,
    },
    /// Nothing.
    Nothing,
}

/// One ADC.
#[derive(Debug, Clone)]
pub(crate) struct Adc {
    isr: u32,
    ier: u32,
    cr: u32,
    cfgr: u32,
    smpr: [u32; 2],
    sqr: [u32; 4],
    jsqr: u32,
    thresholds: [u32; 3],
    calfact: u32,
    dr: u32,
    jdr: [u32; 4],
    calibrated: bool,
    running: Option<Conversion>,
    /// Regular rank to restart behind an injected sequence.
    suspended: Option<u32>,
    hclk_per_clock: f64,
    /// Conversions done.
    conversions: u64,
}

impl Adc {
    /// An ADC behind a reset.
    pub(crate) fn new() -> Self {
        Self {
            isr: 0,
            ier: 0,
            cr: DEEP_POWER_DOWN,
            cfgr: 1 << 31,
            smpr: [0; 2],
            sqr: [0; 4],
            jsqr: 0,
            thresholds: [0x0fff_0000, 0x00ff_0000, 0x00ff_0000],
            calfact: 0,
            dr: 0,
            jdr: [0; 4],
            calibrated: false,
            running: None,
            suspended: None,
            hclk_per_clock: 1.0,
            conversions: 0,
        }
    }

    /// Whether it is enabled.
    pub(crate) fn enabled(&self) -> bool {
        self.cr & ENABLED != 0
    }

    /// Status register, for the common CSR.
    pub(crate) fn status(&self) -> u32 {
        self.isr
    }

    /// Whether the interrupt line is high.
    pub(crate) fn line(&self) -> bool {
        self.isr & self.ier & 0x7ff != 0
    }

    /// Whether a DMA channel of its request may read the data register.
    pub(crate) fn request(&self) -> bool {
        self.cfgr & 1 != 0 && self.isr & END_OF_CONVERSION != 0
    }

    /// Cycle of the next hold or end of conversion.
    pub(crate) fn next_event(&self) -> u64 {
        self.running.map_or(NEVER, |now| if now.held.is_some() { now.end } else { now.hold })
    }

    fn result_bits(&self) -> u32 {
        12 - 2 * (self.cfgr >> 3 & 3)
    }

    fn channel(&self, sequence: Sequence, rank: u32) -> u32 {
        match sequence {
            Sequence::Injected => self.jsqr >> [9, 15, 21, 27][rank as usize & 3] & 0x1f,
            // Rank 1 stands behind the length in SQR1; five ranks a register follow.
            Sequence::Regular => self.sqr[(rank as usize + 1) / 5] >> (6 * ((rank + 1) % 5)) & 0x1f,
        }
    }

    fn begin(&mut self, sequence: Sequence, rank: u32, at: u64) {
        let channel = self.channel(sequence, rank) as usize;
        // Channels above 19 do not exist; the board refuses them when they are sampled.
        let code = self.smpr.get(channel / 10).map_or(0, |smpr| smpr >> (3 * (channel % 10)) & 7);
        let mut half_clocks = SAMPLING_HALF_CYCLES[code as usize];
        if code == 0 && self.smpr[0] >> 31 == 1 {
            half_clocks += 2; // SMPPLUS: 3.5 instead of 2.5
        }
        let conversion = 2 * u64::from(self.result_bits()) + 1;
        let cycles = |half: u64| (half as f64 / 2.0 * self.hclk_per_clock).ceil() as u64;
        let (hold, end) = (at + cycles(half_clocks), at + cycles(half_clocks + conversion));
        self.running = Some(Conversion { sequence, rank, hold, end, held: None });
    }

    /// A rising edge of TIM1's TRGO2 at `now`.
    pub(crate) fn trigger(&mut self, now: u64) {
        let armed = self.cr & INJECTED_START != 0 && self.jsqr >> 7 & 1 == 1;
        let busy = self.running.is_some_and(|running| running.sequence == Sequence::Injected);
        if armed && !busy && self.jsqr >> 2 & 0x1f == TRIGGER_TIM1_TRGO2 {
            self.begin_injected(now);
        }
    }

    fn begin_injected(&mut self, now: u64) {
        if let Some(Conversion { sequence: Sequence::Regular, rank, .. }) = self.running {
            self.suspended = Some(rank);
        }
        self.begin(Sequence::Injected, 0, now);
    }

    /// What is due at `now`.
    pub(crate) fn advance(&mut self, now: u64) -> Need {
        let Some(running) = self.running else { return Need::Nothing };
        match running.held {
            None if running.hold <= now => {
                Need::Sample { channel: self.channel(running.sequence, running.rank) }
            }
            Some(code) if running.end <= now => {
                self.finish(running, code);
                Need::Nothing
            }
            _ => Need::Nothing,
        }
    }

    /// Holds `code` (12 bits) as the input of the conversion under way.
    pub(crate) fn hold(&mut self, code: u32) {
        if let Some(running) = &mut self.running {
            running.held = Some(code);
            self.isr |= END_OF_SAMPLING;
        }
    }

    fn finish(&mut self, done: Conversion, code: u32) {
        self.running = None;
        self.conversions += 1;
        let code = code >> (12 - self.result_bits());
        match done.sequence {
            Sequence::Injected => {
                self.jdr[done.rank as usize & 3] = code;
                self.isr |= INJECTED_CONVERSION;
                if done.rank < self.jsqr & 3 {
                    self.begin(Sequence::Injected, done.rank + 1, done.end);
                    return;
                }
                self.isr |= INJECTED_SEQUENCE;
                if self.jsqr >> 7 & 3 == 0 {
                    self.cr &= !INJECTED_START;
                }
                if let Some(rank) = self.suspended.take() {
                    self.begin(Sequence::Regular, rank, done.end);
                }
            }
            Sequence::Regular => {
                if self.isr & END_OF_CONVERSION != 0 {
                    self.isr |= OVERRUN;
                    if self.cfgr >> 12 & 1 == 1 {
                        self.dr = code;
                    }
                } else {
                    self.dr = code;
                }
                self.isr |= END_OF_CONVERSION;
                if done.rank < self.sqr[0] & 0xf {
                    self.begin(Sequence::Regular, done.rank + 1, done.end);
                    return;
                }
                self.isr |= END_OF_SEQUENCE;
                if self.cfgr >> 13 & 1 == 1 {
                    self.begin(Sequence::Regular, 0, done.end);
                } else {
                    self.cr &= !START;
                }
            }
        }
    }

    /// Value of the register at `offset`.
    pub(crate) fn read(&mut self, offset: u32) -> Result<u32, Refusal> {
        Ok(match offset {
            0x00 => self.isr,
            0x04 => self.ier,
            0x08 => self.cr,
            0x0c => self.cfgr,
            0x10 | 0x60..=0x6c | 0xa0 | 0xa4 | 0xb0 | 0xc0 => 0,
            0x14 | 0x18 => self.smpr[(offset as usize - 0x14) / 4],
            0x20..=0x28 => self.thresholds[(offset as usize - 0x20) / 4],
            0x30..=0x3c => self.sqr[(offset as usize - 0x30) / 4],
            0x40 => {
                self.isr &= !END_OF_CONVERSION;
                self.dr
            }
            0x4c => self.jsqr,
            0x80..=0x8c => self.jdr[(offset as usize - 0x80) / 4],
            0xb4 => self.calfact,
            _ => return Err(Refusal::no_register(offset)),
        })
    }

    /// Writes the register at `offset`; `hclk_per_clock` is `None` while the ADC has no clock.
    pub(crate) fn write(
        &mut self,
        offset: u32,
        value: u32,
        now: u64,
        hclk_per_clock: Option<f64>,
    ) -> Result<(), Refusal> {
        let converting = self.cr & (START | INJECTED_START) != 0;
        match offset {
            0x00 => self.isr &= !value,
            0x04 => {
                only("IER", value, 0x7f)?;
                self.ier = value;
            }
            0x08 => self.write_control(value, now, hclk_per_clock)?,
            0x0c => {
                // DMAEN, DMACFG, RES, OVRMOD, CONT, JQDIS.
                only("CFGR", value, 0x8000_301b)?;
                if value >> 31 == 0 {
                    return Err(Refusal::because("CFGR: the injected queue (JQDIS 0) is not modelled"));
                }
                if converting && (value ^ self.cfgr) & !3 != 0 {
                    return Err(Refusal::because("CFGR must not be written while a conversion is started"));
                }
                self.cfgr = value;
            }
            0x10 => only("CFGR2", value, 0)?,
            0x14 | 0x18 if converting => {
                return Err(Refusal::because("SMPR must not be written while a conversion is started"));
            }
            0x14 | 0x18 => self.smpr[(offset as usize - 0x14) / 4] = value,
            0x20..=0x28 => self.thresholds[(offset as usize - 0x20) / 4] = value,
            0x30..=0x3c if self.cr & START != 0 => {
                return Err(Refusal::because("SQR must not be written while ADSTART is set"));
            }
            0x30..=0x3c => self.sqr[(offset as usize - 0x30) / 4] = value,
            0x4c => {
                if self.cr & INJECTED_START != 0 {
                    return Err(Refusal::because("JSQR must not be written while JADSTART is set (JQDIS 1)"));
                }
                if value >> 7 & 3 != 0 && (value >> 7 & 3 != 1 || value >> 2 & 0x1f != TRIGGER_TIM1_TRGO2) {
                    return Err(Refusal::because(
                        "JSQR: of the triggers only rising edges of tim1_trgo2 (JEXTSEL 8, JEXTEN 1) are modelled",
                    ));
                }
                self.jsqr = value;
            }
            0x60..=0x6c => only("OFR", value, 0)?,
            0xa0 | 0xa4 => only("AWDCR", value, 0)?,
            0xb0 => only("DIFSEL", value, 0)?,
            0xb4 => self.calfact = value,
            0xc0 => only("GCOMP", value, 0)?,
            _ => return Err(Refusal::no_register(offset)),
        }
        Ok(())
    }

    fn write_control(&mut self, value: u32, now: u64, hclk_per_clock: Option<f64>) -> Result<(), Refusal> {
        only("CR", value, 0xf000_003f)?;
        // The flag ADRDY may have been cleared by software; the ADC stays ready.
        let ready = self.cr & ENABLED != 0;
        // Power first: these bits are plain.
        self.cr = self.cr & !0x7000_0000 | value & 0x7000_0000;
        let powered = self.cr & (REGULATOR | DEEP_POWER_DOWN) == REGULATOR;
        if value & CALIBRATE != 0 {
            if !powered || self.cr & ENABLED != 0 {
                return Err(Refusal::because("CR: ADCAL needs ADVREGEN set, DEEPPWD and ADEN clear"));
            }
            // Calibration is over at once.
            self.calibrated = true;
        }
        if value & DISABLE != 0 && self.cr & ENABLED != 0 {
            if self.cr & (START | INJECTED_START) != 0 {
                return Err(Refusal::because("CR: ADDIS while a conversion is started: stop it first"));
            }
            self.cr &= !ENABLED;
            self.isr &= !READY;
            return Ok(());
        }
        if value & ENABLED != 0 && self.cr & ENABLED == 0 {
            if !powered || !self.calibrated {
                return Err(Refusal::because(
                    "CR: ADEN before the regulator is on and the ADC is calibrated",
                ));
            }
            let Some(ratio) = hclk_per_clock else {
                return Err(Refusal::because("CR: ADEN without a clock: set CCIPR.ADC12SEL or CCR.CKMODE"));
            };
            self.hclk_per_clock = ratio;
            self.cr |= ENABLED;
            self.isr |= READY;
        }
        if value & STOP != 0 {
            self.cr &= !START;
            self.suspended = None;
            if self.running.is_some_and(|running| running.sequence == Sequence::Regular) {
                self.running = None;
            }
        }
        if value & INJECTED_STOP != 0 {
            self.cr &= !INJECTED_START;
            if self.running.is_some_and(|running| running.sequence == Sequence::Injected) {
                self.running = None;
                if let Some(rank) = self.suspended.take() {
                    self.begin(Sequence::Regular, rank, now);
                }
            }
        }
        let starting = value & (START | INJECTED_START) & !self.cr;
        let starting = if value & (STOP | INJECTED_STOP) != 0 { 0 } else { starting };
        if starting != 0 && !ready {
            return Err(Refusal::because("CR: a conversion started before the ADC is enabled"));
        }
        if starting & INJECTED_START != 0 {
            self.cr |= INJECTED_START;
            if self.jsqr >> 7 & 3 == 0 {
                self.begin_injected(now);
            }
        }
        if starting & START != 0 {
            self.cr |= START;
            if self.running.is_some() {
                self.suspended = Some(0);
            } else {
                self.begin(Sequence::Regular, 0, now);
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 170 MHz / 4 = 42.5 MHz: four cycles of HCLK a clock.
    const RATIO: Option<f64> = Some(4.0);

    fn enabled() -> Adc {
        let mut adc = Adc::new();
        adc.write(0x08, REGULATOR, 0, RATIO).expect("CR");
        adc.write(0x08, REGULATOR | CALIBRATE, 0, RATIO).expect("CR");
        adc.write(0x08, REGULATOR | ENABLED, 0, RATIO).expect("CR");
        adc
    }

    fn run(adc: &mut Adc, code: u32) -> Vec<(u64, u32)> {
        let mut holds = Vec::new();
        while adc.next_event() != NEVER {
            let now = adc.next_event();
            if let Need::Sample { channel } = adc.advance(now) {
                holds.push((now, channel));
                adc.hold(code + channel);
            }
        }
        holds
    }

    /// SMP code 2 (12.5 clocks) and 12.5 clocks to convert: 50 + 50 cycles of HCLK a rank.
    #[test]
    fn injected_ranks_follow_the_trigger_and_each_takes_25_clocks() {
        let mut adc = enabled();
        adc.write(0x14, 0o2222 << 18, 0, RATIO).expect("SMPR1");
        adc.write(0x4c, 3 | 8 << 2 | 1 << 7 | 6 << 9 | 7 << 15 | 8 << 21 | 9 << 27, 0, RATIO).expect("JSQR");
        adc.write(0x04, INJECTED_SEQUENCE, 0, RATIO).expect("IER");
        adc.trigger(500);
        assert_eq!(adc.next_event(), NEVER, "not started");
        adc.write(0x08, REGULATOR | ENABLED | INJECTED_START, 600, RATIO).expect("CR");
        assert_eq!(adc.next_event(), NEVER, "armed");
        adc.trigger(1000);
        adc.trigger(1001);
        let holds = run(&mut adc, 100);
        assert_eq!(holds, [(1050, 6), (1150, 7), (1250, 8), (1350, 9)]);
        assert_eq!(adc.read(0x8c), Ok(109));
        assert!(adc.line());
        assert!(adc.read(0x08).expect("CR") & INJECTED_START != 0, "armed for the next trigger");
        assert!(adc.write(0x4c, 0, 2000, RATIO).is_err(), "JSQR while armed");
    }

    /// SMP code 0: 2.5 + 12.5 = 15 clocks, 60 cycles; 247.5 + 12.5 = 260 clocks, 1040 cycles.
    #[test]
    fn a_regular_sequence_runs_once_and_reports_its_end() {
        let mut adc = enabled();
        adc.write(0x14, 6 << 6, 0, RATIO).expect("SMPR1 channel 2");
        adc.write(0x30, 1 | 1 << 6 | 2 << 12, 0, RATIO).expect("SQR1");
        adc.write(0x08, REGULATOR | ENABLED | START, 0, RATIO).expect("CR");
        assert_eq!(adc.next_event(), 10);
        assert!(matches!(adc.advance(10), Need::Sample { channel: 1 }));
        adc.hold(7);
        assert_eq!(adc.next_event(), 60);
        adc.advance(60);
        assert_eq!((adc.read(0x40), adc.next_event()), (Ok(7), 60 + 990));
        run(&mut adc, 0);
        assert_eq!(adc.read(0x00).map(|isr| isr & 0xc), Ok(0xc));
        assert_eq!(adc.read(0x08).map(|cr| cr & START), Ok(0));
    }

    #[test]
    fn an_injected_sequence_interrupts_a_regular_conversion_which_starts_again() {
        let mut adc = enabled();
        adc.write(0x30, 3 << 6, 0, RATIO).expect("SQR1");
        adc.write(0x4c, 1 << 7 | 8 << 2 | 5 << 9, 0, RATIO).expect("JSQR");
        adc.write(0x08, REGULATOR | ENABLED | START | INJECTED_START, 0, RATIO).expect("CR");
        adc.trigger(4);
        assert_eq!(run(&mut adc, 0), [(14, 5), (74, 3)]);
    }

    #[test]
    fn data_that_is_not_read_is_kept_and_overruns() {
        let mut adc = enabled();
        adc.write(0x30, 1 | 1 << 6 | 2 << 12, 0, RATIO).expect("SQR1");
        adc.write(0x08, REGULATOR | ENABLED | START, 0, RATIO).expect("CR");
        run(&mut adc, 40);
        assert_eq!(adc.read(0x00).map(|isr| isr & OVERRUN), Ok(OVERRUN));
        assert_eq!(adc.read(0x40), Ok(41));
    }

    #[test]
    fn the_order_of_the_manual_is_enforced() {
        let mut adc = Adc::new();
        assert!(adc.write(0x08, ENABLED, 0, RATIO).is_err(), "in deep power down");
        let mut adc = Adc::new();
        adc.write(0x08, REGULATOR, 0, RATIO).expect("CR");
        assert!(adc.write(0x08, REGULATOR | ENABLED, 0, RATIO).is_err(), "not calibrated");
        adc.write(0x08, REGULATOR | CALIBRATE, 0, RATIO).expect("CR");
        assert!(adc.write(0x08, REGULATOR | ENABLED, 0, None).is_err(), "no clock");
        assert!(adc.write(0x08, REGULATOR | START, 0, RATIO).is_err(), "not enabled");
        assert!(adc.write(0x4c, 1 << 7 | 3 << 2, 0, RATIO).is_err(), "another trigger");
        assert!(adc.write(0xb0, 2, 0, RATIO).is_err(), "differential");
    }

    /// PRESC 2 divides by 4, PRESC 6 by 12, PRESC 8 by 32 (RM0440, ADC common control register).
    #[test]
    fn the_prescaler_divides_the_kernel_clock() {
        let ratio = |presc: u32| Common { ccr: presc << 18 }.hclk_per_clock(170, Some(170));
        assert_eq!([ratio(0), ratio(1), ratio(2), ratio(6)], [Some(1.0), Some(2.0), Some(4.0), Some(12.0)]);
        assert_eq!([ratio(7), ratio(8), ratio(11)], [Some(16.0), Some(32.0), Some(256.0)]);
        assert_eq!(Common { ccr: 3 << 16 }.hclk_per_clock(170, None), Some(4.0));
    }
}
