//! What the monitor shows of a sample.

use bowden_host_link::conversion::Conversion;
use bowden_host_link::{LinkError, ParameterSet};
use bowden_link::Sample;
use bowden_link::message::Mode;

/// A signal with a history.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(usize)]
pub enum Signal {
    /// Reference of the joint's angle, rad; no number in torque mode.
    ThetaRef,
    /// Angle of the input pulley, rad.
    ThetaIn,
    /// Angle of the joint, rad.
    ThetaOut,
    /// Tension of cable a at the input end, N.
    F1,
    /// Tension of cable a at the output end, N.
    F2,
    /// Tension of cable b at the input end, N.
    F3,
    /// Tension of cable b at the output end, N.
    F4,
    /// Reference of the output torque, N·m; a number in torque mode only.
    TorqueRef,
    /// (F1 - F3) r1, N·m.
    TorqueIn,
    /// (F2 - F4) r2, N·m.
    TorqueOut,
    /// Reference minus what the joint does, rad or, in torque mode, N·m.
    Error,
    /// Duty of the bridge.
    Duty,
    /// Current of the motor, A.
    Current,
    /// Voltage of the bus, V.
    Bus,
}

/// Number of signals.
pub const SIGNALS: usize = Signal::Bus as usize + 1;

/// One value a signal.
pub type Reading = [f32; SIGNALS];

/// Makes readings of samples.
#[derive(Clone, Copy, Debug)]
pub struct Meter {
    conversion: Conversion,
    radius_in_m: f64,
    radius_out_m: f64,
    follows_torque: bool,
}

impl Meter {
    /// Takes what it needs of the board's parameters.
    ///
    /// # Errors
    /// [`LinkError::NoParameter`]
    pub fn new(parameters: &ParameterSet, mode: Mode) -> Result<Self, LinkError> {
        Ok(Self {
            conversion: Conversion::new(parameters)?,
            radius_in_m: parameters.value("pulley.input_radius")?,
            radius_out_m: parameters.value("pulley.output_radius")?,
            follows_torque: mode.follows_torque(),
        })
    }

    /// Unit of reference and error.
    pub fn unit(&self) -> &'static str {
        if self.follows_torque { "N·m" } else { "rad" }
    }

    /// Values of all signals.
    pub fn read(&self, sample: &Sample) -> Reading {
        let [theta_in_rad, theta_out_rad] = self.conversion.angles_rad(sample);
        let [f1, f2, f3, f4] = self.conversion.tensions_n(sample);
        let torque_out_nm = (f2 - f4) * self.radius_out_m;
        let reference = Conversion::reference(sample);
        let (theta_ref_rad, torque_ref_nm, error) = if self.follows_torque {
            (f64::NAN, reference, reference - torque_out_nm)
        } else {
            (reference, f64::NAN, reference - theta_out_rad)
        };
        let mut reading = [0.0; SIGNALS];
        for (signal, value) in [
            (Signal::ThetaRef, theta_ref_rad),
            (Signal::ThetaIn, theta_in_rad),
            (Signal::ThetaOut, theta_out_rad),
            (Signal::F1, f1),
            (Signal::F2, f2),
            (Signal::F3, f3),
            (Signal::F4, f4),
            (Signal::TorqueRef, torque_ref_nm),
            (Signal::TorqueIn, (f1 - f3) * self.radius_in_m),
            (Signal::TorqueOut, torque_out_nm),
            (Signal::Error, error),
            (Signal::Duty, self.conversion.duty(sample)),
            (Signal::Current, self.conversion.current_a(sample)),
            (Signal::Bus, self.conversion.bus_v(sample)),
        ] {
            reading[signal as usize] = value as f32;
        }
        reading
    }
}
