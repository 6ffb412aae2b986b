//! Motor current and bus voltage.

use bowden_link::Fault;

use crate::detection::Detection;
use crate::scale::{Code, Current, Debounce, Gain, Quantity, Sum, Voltage, Weight};
use crate::tension::code;
use crate::winding::{Winding, WindingConfig};

/// Channels and what is expected of them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SupplyConfig {
    /// Code of the current channel at 0 A.
    pub current_zero: Code,
    /// Current a code, negative where the bridge is connected the other way round.
    pub current_gain: Gain<Code, Current>,
    /// Voltage a code.
    pub bus_gain: Gain<Code, Voltage>,
    /// Low-pass of the bus voltage that the drive divides by.
    pub bus_filter: Weight<Voltage, Voltage>,
    /// Current that is a fault.
    pub over_current: Current,
    /// Ticks for which it has to be there, at least 1.
    pub over_current_ticks: u16,
    /// Least and largest bus voltage.
    pub bus_range: [Voltage; 2],
    /// Ticks for which it has to be wrong, at least 1.
    pub bus_ticks: u16,
    /// What the motor's winding bears.
    pub winding: WindingConfig,
}

/// State of the channels.
#[derive(Clone, Copy, Debug, Default)]
pub struct Supply {
    over_current: Debounce,
    under_voltage: Debounce,
    over_voltage: Debounce,
    bus: Option<Sum<Voltage>>,
    winding: Winding,
}

/// Current and voltage of a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SupplyReading {
    /// Motor current; positive drives towards +θ.
    pub current: Current,
    /// Bus voltage.
    pub bus: Voltage,
    /// Bus voltage behind its low-pass.
    pub bus_filtered: Voltage,
    /// The first fault.
    pub found: Option<Detection>,
}

impl Supply {
    /// Takes this tick's codes.
    pub fn observe(&mut self, config: &SupplyConfig, current_raw: u16, bus_raw: u16) -> SupplyReading {
        let current = config.current_gain.apply(code(current_raw).minus(config.current_zero));
        let bus = config.bus_gain.apply(code(bus_raw));
        let bus_filtered = self.bus.get_or_insert_with(|| Sum::at(bus)).approach(config.bus_filter, bus);
        let [low, high] = config.bus_range;
        let bearable = self.winding.warm(&config.winding, current);
        let fine = current.is_at_most(config.over_current) && bus.is_within(low, high) && bearable;
        let found = if fine {
            // Nearly always.
            (self.over_current, self.under_voltage, self.over_voltage) = Default::default();
            None
        } else {
            self.look(config, current, bus)
        };
        SupplyReading { current, bus, bus_filtered, found }
    }

    /// What is wrong, and for how long.
    #[cold]
    #[inline(never)]
    fn look(&mut self, config: &SupplyConfig, current: Current, bus: Voltage) -> Option<Detection> {
        let [low, high] = config.bus_range;
        let over_current =
            self.over_current.count(current.magnitude() > config.over_current, config.over_current_ticks);
        let under = self.under_voltage.count(bus < low, config.bus_ticks);
        let over = self.over_voltage.count(bus > high, config.bus_ticks);
        if over_current {
            Some(Detection::new(Fault::OverCurrent, 0, current.to_f32(), config.over_current.to_f32()))
        } else if under {
            Some(Detection::new(Fault::BusUnderVoltage, 0, bus.to_f32(), low.to_f32()))
        } else if over {
            Some(Detection::new(Fault::BusOverVoltage, 0, bus.to_f32(), high.to_f32()))
        } else {
            self.winding.too_hot(&config.winding)
        }
    }
}
