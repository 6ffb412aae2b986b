//! Heat of the motor's winding, from its current alone.
//!
//! A body that is heated by `R i²` and cools with one time constant `τ` reaches the temperature that it may have when the
//! continuous current `I` flows for ever. The share `h` of that rise follows
//!
//! ```text
//! τ dh/dt = (i / I)² - h,    too hot when h > 1: after τ ln(i² / (i² - I²)) of a current i > I from cold
//! ```
//!
//! A current of more than 11 times `I` counts as that. A switched-on board takes the winding for cold. Source: first-order thermal model (I²t), as in IEC 60034-1 for duty
//! types; both numbers are in a motor's data sheet.

use bowden_link::Fault;

use crate::detection::Detection;
use crate::scale::{Current, Gain, Quantity, Ratio, Sum, Weight};

/// What the winding bears.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WindingConfig {
    /// Current that it bears for ever.
    pub continuous: Current,
    /// A current in units of that one, `1 / I`.
    pub of_continuous: Gain<Current, Ratio>,
    /// Low-pass with the time constant of the winding.
    pub warming: Weight<Ratio, Ratio>,
}

/// How warm it is.
#[derive(Clone, Copy, Debug, Default)]
pub struct Winding {
    heat: Sum<Ratio>,
}

impl Winding {
    /// Takes this tick's current; whether it is no hotter than it may be.
    #[inline]
    pub fn warm(&mut self, config: &WindingConfig, current: Current) -> bool {
        let share = config.of_continuous.apply(current);
        self.heat.approach(config.warming, share.times(share)) <= Ratio::ONE
    }

    /// The fault of a winding that is too hot: the steady current that would heat it as far, A, to first order in what `h` is beyond 1,
    /// which is little because the fault stops the motor.
    #[must_use]
    pub fn too_hot(&self, config: &WindingConfig) -> Option<Detection> {
        let (heat, continuous_a) = (self.heat.value().to_f32(), config.continuous.to_f32());
        let steady_a = continuous_a * 0.5 * (1.0 + heat);
        (heat > 1.0).then(|| Detection::new(Fault::WindingHot, 0, steady_a, continuous_a))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD_S: f32 = 1e-4;

    fn config(continuous_a: f32, time_s: f32) -> WindingConfig {
        WindingConfig {
            continuous: Current::from_f32(continuous_a),
            of_continuous: Gain::new(1.0 / continuous_a).unwrap(),
            warming: Weight::low_pass(time_s, PERIOD_S),
        }
    }

    /// Time until `current_a` has heated a cold winding too far, s.
    fn lasts_s(config: &WindingConfig, current_a: f32, limit_s: f32) -> Option<f32> {
        let mut winding = Winding::default();
        let ticks = (limit_s / PERIOD_S) as u32;
        let current = Current::from_f32(current_a);
        (1..=ticks).find(|_| !winding.warm(config, current)).map(|tick| tick as f32 * PERIOD_S)
    }

    /// By the closed form, to a hundredth: slow windings, either sign, up to nine times what is borne.
    #[test]
    fn a_current_lasts_as_long_as_the_formula_says() {
        for (continuous_a, time_s, current_a) in
            [(4.0_f32, 30.0_f32, 8.0_f32), (4.0, 30.0, -5.0), (1.5, 2.0, 13.0), (2.0, 600.0, 13.0)]
        {
            let (square, bearable) = (current_a * current_a, continuous_a * continuous_a);
            let expected_s = time_s * (square / (square - bearable)).ln();
            let got_s = lasts_s(&config(continuous_a, time_s), current_a, 2.0 * expected_s).unwrap();
            assert!(
                (got_s / expected_s - 1.0).abs() < 0.01 || (got_s - expected_s).abs() < 2.0 * PERIOD_S,
                "{current_a} A: {got_s} s for {expected_s} s"
            );
        }
    }

    #[test]
    fn what_it_bears_lasts_for_ever_and_it_cools_without_current() {
        let config = config(4.0, 0.5);
        assert_eq!(lasts_s(&config, 3.99, 10.0), None);
        let mut winding = Winding::default();
        while winding.warm(&config, Current::from_f32(12.0)) {}
        let fault = winding.too_hot(&config).unwrap();
        assert!((fault.got - 4.0).abs() < 0.01 && fault.limit == 4.0, "{fault:?}");
        // From 1 to 1/2 in τ ln 2.
        for _ in 0..3466 {
            winding.warm(&config, Current::ZERO);
        }
        assert_eq!(winding.too_hot(&config), None);
        assert!((winding.heat.value().to_f32() - 0.5).abs() < 0.002, "{:?}", winding.heat.value());
    }
}
