//! Tensions, motor current and bus voltage: injected conversions, started by the PWM timer.
//!
//! ADC1 converts f1 to f4 and ADC2 current and bus voltage, both from the same event of TIM1. The ADC clock is
//! 170 / 4 = 42.5 MHz; a conversion takes 24.5 + 12.5 clocks, ADC1's four 3.5 us. ADC1 has the longer sequence, so its
//! end raises the interrupt of the control tick with everything converted.

use embassy_stm32::Peri;
use embassy_stm32::adc::{Adc, AdcChannel, AdcConfig, Exten, InjectedAdc, SampleTime};
use embassy_stm32::peripherals::{ADC1, ADC2, PA0, PA1, PC0, PC1, PC2, PC3};
use embassy_stm32::triggers::TIM1_TRGO2;

/// 0.58 us; the amplifiers' outputs have 1 kOhm and 10 nF close to the pin.
const SAMPLE: SampleTime = SampleTime::CYCLES24_5;

/// Codes of all channels at one event of the timer.
#[expect(clippy::struct_field_names, reason = "raw integers say so in their name")]
pub struct Codes {
    /// f1 to f4.
    pub tension_raw: [u16; 4],
    /// Motor current.
    pub current_raw: u16,
    /// Bus voltage.
    pub bus_raw: u16,
}

/// Both converters.
pub struct Analog {
    tensions: InjectedAdc<'static, ADC1, 4>,
    supply: InjectedAdc<'static, ADC2, 2>,
}

type TensionPins = (Peri<'static, PC0>, Peri<'static, PC1>, Peri<'static, PC2>, Peri<'static, PC3>);

impl Analog {
    /// Calibrates the converters and arms them; the first event of the timer starts the first conversion.
    pub fn new(
        adc1: Peri<'static, ADC1>,
        adc2: Peri<'static, ADC2>,
        tensions: TensionPins,
        supply: (Peri<'static, PA0>, Peri<'static, PA1>),
    ) -> Self {
        let (f1, f2, f3, f4) = tensions;
        let (current, bus) = supply;
        let supply = Adc::new(adc2, AdcConfig::default()).setup_injected_conversions(
            [(current.degrade_adc(), SAMPLE), (bus.degrade_adc(), SAMPLE)],
            TIM1_TRGO2,
            Exten::RISING_EDGE,
            false,
        );
        let tensions = Adc::new(adc1, AdcConfig::default()).setup_injected_conversions(
            [
                (f1.degrade_adc(), SAMPLE),
                (f2.degrade_adc(), SAMPLE),
                (f3.degrade_adc(), SAMPLE),
                (f4.degrade_adc(), SAMPLE),
            ],
            TIM1_TRGO2,
            Exten::RISING_EDGE,
            true,
        );
        Self { tensions, supply }
    }

    /// Codes of the sequence that just ended; acknowledges it.
    pub fn read(&mut self) -> Codes {
        embassy_stm32::pac::ADC1.isr().write(|isr| {
            isr.set_jeos(true);
            isr.set_jeoc(true);
        });
        let tension_raw = self.tensions.read_injected_samples();
        let [current_raw, bus_raw] = self.supply.read_injected_samples();
        Codes { tension_raw, current_raw, bus_raw }
    }

    /// Whether another sequence has ended since [`Self::read`]: the tick took longer than its period.
    #[expect(clippy::unused_self, reason = "asks the converter that this value owns")]
    pub fn next_is_ready(&self) -> bool {
        embassy_stm32::pac::ADC1.isr().read().jeos()
    }
}
