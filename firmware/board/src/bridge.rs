//! The motor bridge: TIM1 with two complementary pairs, break input, enable pin.
//!
//! Duty d from -1 to 1 gives leg A the duty (1 + d)/2 and leg B (1 - d)/2, so the motor sees d times the bus voltage.
//! The fault line of the bridge leads to the break input: hardware takes all four outputs low and keeps them there, with no clock
//! and no software needed, and only the next start puts them back. The same do a clock that fails, a core that locks up, a supply
//! that falls and flash or RAM that is damaged, and a debugger that holds the core.
//!
//! A gate driver such as the DRV8305 holds its line low for a fault and toggles it for a warning. Either stops the motor. Behind such a stop
//! the driver stays awake for a millisecond, and a line that rises by itself meanwhile was a warning, or a disturbance of the line.
//!
//! What decides over the outputs is locked until the next reset. The lock can be written with the first write to BDTR only, which
//! the HAL's driver makes, so the timer is set up here and the HAL does the pins.

use core::mem::forget;

use embassy_stm32::Peri;
use embassy_stm32::gpio::{Input, Level, Output, OutputType, Pull, Speed};
use embassy_stm32::pac;
use embassy_stm32::pac::gpio::vals::{Idr, Moder};
use embassy_stm32::pac::timer::vals::{Bkp, Cms, FilterValue, Lock, Mms2, Ocm, Ossi, Ossr};
use embassy_stm32::peripherals::{PA8, PA9, PB12, PB13, PB14, PC6, TIM1};
use embassy_stm32::rcc;
use embassy_stm32::timer::complementary_pwm::ComplementaryPwmPin;
use embassy_stm32::timer::simple_pwm::PwmPin;
use embassy_stm32::timer::{Ch1, Ch2};

use crate::clock::CYCLES_PER_US;

type High<C> = PwmPin<'static, TIM1, C>;
type Low<C> = ComplementaryPwmPin<'static, TIM1, C>;

/// Counts of half a PWM period: 170 MHz / 20 kHz / 2.
const RELOAD: u16 = 4_250;

/// Compare value of duty 0.
const HALF_PERIOD: i32 = RELOAD as i32 / 2;

/// Alternate function of PB12 that is `TIM1_BKIN` (DS12288, table 14).
const BREAK_FUNCTION: u8 = 6;

/// Dead time in steps of 5.9 ns: 353 ns, three times what the bridge in the parts list needs.
const DEAD_TIME: u8 = 60;

/// Eight samples of 170 MHz / 8: what switching couples into the fault line is shorter than these 0.38 us, and a short circuit
/// gets dangerous in microseconds.
const BREAK_FILTER: FilterValue = FilterValue::FDTS_DIV8_N8;

/// Level of the voltage detector: 2.9 V where 3.3 V should be (RM0440, `PWR_CR2`).
const SUPPLY_LEVEL: u8 = 6;

/// Time behind a stop in which the fault line is watched \[ms\]: far above the tens of microseconds for which a driver pulls it low to warn.
pub const LISTENED_MS: u32 = 1;

/// Core cycles a millisecond.
const CYCLES_A_MS: u32 = 1000 * CYCLES_PER_US;

/// The bridge, off after [`Self::new`].
pub struct Bridge {
    enable: Output<'static>,
    awake: bool,
    on: bool,
    /// Cycles for which the fault line has been watched behind a stop, while it is.
    listened: Option<u32>,
}

impl Bridge {
    /// Sets the timer up with `divider` PWM periods a control tick, outputs low, and locks it.
    pub fn new(
        _timer: Peri<'static, TIM1>,
        leg_a: (Peri<'static, PA8>, Peri<'static, PB13>),
        leg_b: (Peri<'static, PA9>, Peri<'static, PB14>),
        fault: Peri<'static, PB12>,
        enable: Peri<'static, PC6>,
        divider: u16,
    ) -> Self {
        let enable = Output::new(enable, Level::Low, Speed::Low);
        break_by_system();
        rcc::enable_and_reset::<TIM1>();
        let timer = pac::TIM1;
        // A debugger that holds the core stops the counter, and the outputs go low.
        pac::DBGMCU.apb2fzr().modify(|freeze| freeze.set_tim1(true));
        timer.cr1().write(|control| {
            control.set_cms(Cms::CENTER_ALIGNED3);
            control.set_arpe(true);
        });
        timer.cr2().write(|control| control.set_mms2(Mms2::UPDATE));
        timer.ccmr_output(0).write(|compare| {
            for channel in 0..2 {
                compare.set_ocm(channel, Ocm::PWM_MODE1);
                compare.set_ocpe(channel, true);
            }
        });
        timer.ccer().write(|outputs| {
            for channel in 0..2 {
                outputs.set_cce(channel, true);
                outputs.set_ccne(channel, true);
            }
        });
        connect_fault_line(fault);
        timer.bdtr().write(|protection| {
            protection.set_dtg(DEAD_TIME);
            protection.set_ossi(Ossi::IDLE_LEVEL);
            protection.set_ossr(Ossr::IDLE_LEVEL);
            protection.set_bke(0, true);
            protection.set_bkp(0, Bkp::ACTIVE_LOW);
            protection.set_bkf(0, BREAK_FILTER);
            protection.set_lock(Lock::LEVEL3);
        });
        // Kept as they are: the pins have no other use until reset.
        let kind = OutputType::PushPull;
        forget((High::<Ch1>::new(leg_a.0, kind), Low::<Ch1>::new(leg_a.1, kind)));
        forget((High::<Ch2>::new(leg_b.0, kind), Low::<Ch2>::new(leg_b.1, kind)));
        restart(divider);
        Self { enable, awake: false, on: false, listened: None }
    }

    /// Whether the bridge reports a fault, or has since it was switched on.
    #[expect(clippy::unused_self, reason = "asks the timer that this value owns")]
    pub fn fault(&self) -> bool {
        let status = pac::TIM1.sr().read();
        status.bif(0) || status.sbif()
    }

    /// Whether that was the processor's supply; to be asked only if there was a [`Self::fault`].
    pub fn supply_is_low() -> bool {
        pac::PWR.sr2().read().pvdo()
    }

    /// Watches the fault line, with the gate driver awake, behind a stop that it caused.
    pub const fn listen(&mut self) {
        self.listened = Some(0);
    }

    /// To be asked in each tick: time since the stop \[ms\], once, if the gate driver has let go of its fault line meanwhile.
    pub fn let_go_ms(&mut self) -> Option<f32> {
        let listened = self.listened? + self.period_cycles();
        let is_high = pac::GPIOB.idr().read().idr(12) == Idr::HIGH;
        self.listened = if is_high || listened >= LISTENED_MS * CYCLES_A_MS { None } else { Some(listened) };
        is_high.then(|| listened as f32 * (1.0 / CYCLES_A_MS as f32))
    }

    /// Duty of the coming PWM period, gate driver awake or not, and bridge on or off; off acts at once.
    pub fn set(&mut self, duty_raw: i16, awake: bool, on: bool) {
        let offset = (HALF_PERIOD * i32::from(duty_raw)) >> 15;
        pac::TIM1.ccr(0).write(|compare| compare.set_ccr((HALF_PERIOD + offset) as u16));
        pac::TIM1.ccr(1).write(|compare| compare.set_ccr((HALF_PERIOD - offset) as u16));
        if !on {
            // While the fault line is low the flag comes back at once.
            pac::TIM1.sr().modify(|status| {
                status.set_bif(0, false);
                status.set_sbif(false);
            });
        }
        if on != self.on {
            self.on = on;
            pac::TIM1.bdtr().modify(|protection| protection.set_moe(on));
        }
        if awake != self.awake && self.listened.is_none() {
            self.awake = awake;
            self.enable.set_level(awake.into());
        }
    }

    /// Core cycles between two control ticks.
    #[expect(clippy::unused_self, reason = "asks the timer that this value owns")]
    pub fn period_cycles(&self) -> u32 {
        (u32::from(pac::TIM1.rcr().read().rep()) + 1) * u32::from(RELOAD)
    }
}

/// Pulled up, active low, led to `TIM1_BKIN`; the HAL has no way to keep a break input and five more pins.
fn connect_fault_line(fault: Peri<'static, PB12>) {
    // Configures the pull-up and is kept as it is: the pin has no other use until reset.
    forget(Input::new(fault, Pull::Up));
    pac::GPIOB.afr(1).modify(|functions| functions.set_afr(12 - 8, BREAK_FUNCTION));
    pac::GPIOB.moder().modify(|modes| modes.set_moder(12, Moder::ALTERNATE));
}

/// What the processor itself finds breaks too: lockup, PVD, parity of the RAM, two wrong bits of the flash (RM0440, `SYSCFG_CFGR2`).
fn break_by_system() {
    pac::PWR.cr2().write(|detector| {
        detector.set_pls(SUPPLY_LEVEL);
        detector.set_pvde(true);
    });
    pac::SYSCFG.cfgr2().modify(|breaks| {
        breaks.set_cll(true);
        breaks.set_spl(true);
        breaks.set_pvdl(true);
        breaks.set_eccl(true);
    });
}

/// Sets period and repetition while the counter stands, so that every update falls on the middle of the low phase
/// (RM0440, 29.3.7: an odd repetition count takes its phase from how the counter was started).
fn restart(divider: u16) {
    let timer = pac::TIM1;
    timer.cr1().modify(|control| control.set_cen(false));
    timer.arr().write(|reload| reload.set_arr(RELOAD));
    set_rate_divider(divider);
    timer.egr().write(|event| event.set_ug(true));
    timer.cr1().modify(|control| control.set_cen(true));
}

/// PWM periods a control tick, from the next one on. One period has two half periods, and a count of n skips n of them.
pub fn set_rate_divider(divider: u16) {
    pac::TIM1.rcr().write(|counter| counter.set_rep(2 * divider.max(1) - 1));
}

/// Outputs off, from any context, with nothing but two writes. Before timer and port have their clocks nothing of the bridge is on, and
/// their registers must not be touched (RM0440, RCC, peripheral clock gating).
pub fn off() {
    if pac::RCC.apb2enr().read().tim1en() {
        pac::TIM1.bdtr().modify(|break_register| break_register.set_moe(false));
    }
    if pac::RCC.ahb2enr().read().gpiocen() {
        pac::GPIOC.bsrr().write(|pins| pins.set_br(6, true));
    }
}
