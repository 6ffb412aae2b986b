//! A hypothesis as an effect: what it adds at its port.

use bowden_model::effect::{
    Descriptor, Effect, EffectState, JointPort, MAX_PARAMETERS, MotorPort, SensorPort, TransmissionPort,
};
use bowden_model::law::Variable;

use super::{Hypothesis, Source};

impl Hypothesis {
    fn value(&self, coefficients: &[f64; MAX_PARAMETERS], point: [f64; 2]) -> f64 {
        match &self.source {
            Source::Points(table) => table.at(point),
            Source::Function(asked) if asked.axes.get().is_none() => {
                asked.watch(point);
                0.0
            }
            Source::Function(_) => self.table(coefficients).map_or(0.0, |table| table.at(point)),
        }
    }

    fn point(&self, of: impl Fn(Variable) -> f64) -> [f64; 2] {
        [of(self.variables[0]), self.variables.get(1).map_or(0.0, |variable| of(*variable))]
    }
}

impl Effect for Hypothesis {
    fn descriptor(&self) -> &'static Descriptor {
        self.descriptor
    }

    fn on_request(&self) -> bool {
        true
    }

    /// The user asked for it, whatever its size.
    fn is_hardly_there(&self, _parameters: &[f64; MAX_PARAMETERS], _usual: f64) -> bool {
        false
    }

    fn motor(&self, p: &[f64; MAX_PARAMETERS], _state: &mut EffectState, port: &mut MotorPort) {
        let y = self.value(p, self.point(|variable| variable.at_motor(port)));
        self.port.add_at_motor(y, port);
    }

    fn transmission(&self, p: &[f64; MAX_PARAMETERS], _state: &mut EffectState, port: &mut TransmissionPort) {
        self.port.add_at_tendons(port, |port, tendon| {
            self.value(p, self.point(|variable| variable.at_tendon(port, tendon)))
        });
    }

    fn joint(&self, p: &[f64; MAX_PARAMETERS], _state: &mut EffectState, port: &mut JointPort) {
        let y = self.value(p, self.point(|variable| variable.at_joint(port)));
        self.port.add_at_joint(y, port);
    }

    fn measure(&self, p: &[f64; MAX_PARAMETERS], _state: &mut EffectState, port: &mut SensorPort) {
        port.value += self.value(p, self.point(|variable| variable.at_sensor(port)));
    }
}
