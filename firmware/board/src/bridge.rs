//! The motor bridge: TIM1 with two complementary pairs, break input, enable pin.
//!
//! Duty d from -1 to 1 gives leg A the duty (1 + d)/2 and leg B (1 - d)/2, so the motor sees d times the bus voltage.
//! The fault line of the bridge leads to the break input: hardware takes all four outputs low, with no clock and no
//! software needed, and only the next start puts them back.

use embassy_stm32::Peri;
use embassy_stm32::gpio::{Input, Level, Output, OutputType, Pull, Speed};
use embassy_stm32::pac;
use embassy_stm32::pac::gpio::vals::Moder;
use embassy_stm32::peripherals::{PA8, PA9, PB12, PB13, PB14, PC6, TIM1};
use embassy_stm32::time::khz;
use embassy_stm32::timer::Channel;
use embassy_stm32::timer::complementary_pwm::{ComplementaryPwm, ComplementaryPwmPin, Mms2};
use embassy_stm32::timer::low_level::BreakInputPolarity;
use embassy_stm32::timer::low_level::CountingMode;
use embassy_stm32::timer::simple_pwm::PwmPin;

/// PWM periods a second, Hz.
pub const PWM_KHZ: u32 = 20;

/// Counts of half a PWM period: 170 MHz / 20 kHz / 2. The HAL would take one less.
const RELOAD: u16 = 4_250;

/// Compare value of duty 0.
const HALF_PERIOD: i32 = RELOAD as i32 / 2;

/// Alternate function of PB12 that is `TIM1_BKIN` (DS12288, table 14).
const BREAK_FUNCTION: u8 = 6;

/// Dead time in steps of 5.9 ns: 353 ns, three times what the bridge in the parts list needs.
const DEAD_TIME: u16 = 60;

/// The bridge, off after [`Self::new`].
pub struct Bridge {
    pwm: ComplementaryPwm<'static, TIM1>,
    enable: Output<'static>,
    on: bool,
}

impl Bridge {
    /// Sets the timer up with `divider` PWM periods a control tick, outputs off.
    pub fn new(
        timer: Peri<'static, TIM1>,
        leg_a: (Peri<'static, PA8>, Peri<'static, PB13>),
        leg_b: (Peri<'static, PA9>, Peri<'static, PB14>),
        fault: Peri<'static, PB12>,
        enable: Peri<'static, PC6>,
        divider: u16,
    ) -> Self {
        let enable = Output::new(enable, Level::Low, Speed::Low);
        let push_pull = OutputType::PushPull;
        let mut pwm = ComplementaryPwm::new(
            timer,
            Some(PwmPin::new(leg_a.0, push_pull)),
            Some(ComplementaryPwmPin::new(leg_a.1, push_pull)),
            Some(PwmPin::new(leg_b.0, push_pull)),
            Some(ComplementaryPwmPin::new(leg_b.1, push_pull)),
            None,
            None,
            None,
            None,
            khz(PWM_KHZ),
            CountingMode::CenterAlignedBothInterrupts,
        );
        pwm.set_master_output_enable(false);
        pwm.set_automatic_output_enable(false);
        pwm.set_dead_time(DEAD_TIME);
        connect_fault_line(fault);
        pwm.set_break_polarity(BreakInputPolarity::ACTIVE_LOW);
        pwm.set_break_input_pin_enable(true);
        pwm.set_break_enable(true);
        pwm.enable(Channel::Ch1);
        pwm.enable(Channel::Ch2);
        pwm.set_mms2(Mms2::UPDATE);
        restart(divider);
        Self { pwm, enable, on: false }
    }

    /// Whether the bridge reports a fault, or has since it was switched on.
    #[expect(clippy::unused_self, reason = "asks the timer that this value owns")]
    pub fn fault(&self) -> bool {
        let status = pac::TIM1.sr().read();
        status.bif(0) || status.sbif()
    }

    /// Duty of the coming PWM period and on or off; off acts at once.
    pub fn set(&mut self, duty_raw: i16, on: bool) {
        let offset = (HALF_PERIOD * i32::from(duty_raw)) >> 15;
        self.pwm.set_duty(Channel::Ch1, (HALF_PERIOD + offset) as u32);
        self.pwm.set_duty(Channel::Ch2, (HALF_PERIOD - offset) as u32);
        if !on {
            // While the fault line is low the flag comes back at once.
            pac::TIM1.sr().modify(|status| {
                status.set_bif(0, false);
                status.set_sbif(false);
            });
        }
        if on != self.on {
            self.on = on;
            self.pwm.set_master_output_enable(on);
            self.enable.set_level(on.into());
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
    core::mem::forget(Input::new(fault, Pull::Up));
    pac::GPIOB.afr(1).modify(|functions| functions.set_afr(12 - 8, BREAK_FUNCTION));
    pac::GPIOB.moder().modify(|modes| modes.set_moder(12, Moder::ALTERNATE));
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

/// Outputs off, from any context, with nothing but two writes.
pub fn off() {
    pac::TIM1.bdtr().modify(|break_register| break_register.set_moe(false));
    pac::GPIOC.bsrr().write(|pins| pins.set_br(6, true));
}
