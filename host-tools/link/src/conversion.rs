//! From raw samples of the board to rows of a recording.

use std::f64::consts::TAU;

use bowden_core::recording::{Cell, RowColumn};
use bowden_link::Sample;
use bowden_link::message::Mode;
use bowden_model::channel::Channel;

use super::course::TORQUE_REFERENCE;
use super::error::LinkError;
use super::parameters::ParameterSet;

/// Counts a turn of both encoder parts, as [`Sample::encoder_count_raw`] has them.
const COUNTS_PER_TURN: f64 = 4096.0;

/// Angles and torques of a sample, steps a rad or N·m.
const STEPS: f64 = (1_u32 << 20) as f64;

/// Duty 1.
const FULL_DUTY: f64 = 32_767.0;

/// Cells are rounded to this, far below every sensor's step: shorter files.
const ROUNDING: f64 = 1e9;

/// SI values from raw ones, by the board's parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Conversion {
    encoder: [Encoder; 2],
    tension: [Linear; 4],
    current: Linear,
    bus: Linear,
    bridge_direction: f64,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Encoder {
    direction: f64,
    zero: f64,
}

/// `(code - zero) · gain`.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Linear {
    zero: f64,
    gain: f64,
}

impl Linear {
    fn apply(self, code: u16) -> f64 {
        (f64::from(code) - self.zero) * self.gain
    }
}

impl Conversion {
    /// Takes what it needs of the board's parameters.
    ///
    /// # Errors
    /// [`LinkError::NoParameter`]
    pub fn new(parameters: &ParameterSet) -> Result<Self, LinkError> {
        let encoder = |name: &str| {
            Ok::<_, LinkError>(Encoder {
                direction: parameters.value(&format!("encoder.{name}.direction"))?,
                zero: parameters.value(&format!("encoder.{name}.zero"))?,
            })
        };
        let tension = |name: &str| {
            Ok::<_, LinkError>(Linear {
                zero: parameters.value(&format!("tension.{name}.zero"))?,
                gain: parameters.value(&format!("tension.{name}.gain"))?,
            })
        };
        Ok(Self {
            encoder: [encoder("input")?, encoder("joint")?],
            tension: [tension("f1")?, tension("f2")?, tension("f3")?, tension("f4")?],
            current: Linear {
                zero: parameters.value("bridge.current_zero")?,
                gain: parameters.value("bridge.current_gain")?,
            },
            bus: Linear { zero: 0.0, gain: parameters.value("bridge.bus_gain")? },
            bridge_direction: parameters.value("bridge.direction")?,
        })
    }

    /// Angles of input pulley and joint, rad.
    pub fn angles_rad(&self, sample: &Sample) -> [f64; 2] {
        [0, 1].map(|encoder| self.angle_rad(encoder, sample.encoder_count_raw[encoder]))
    }

    /// Tensions f1 to f4, N.
    pub fn tensions_n(&self, sample: &Sample) -> [f64; 4] {
        [0, 1, 2, 3].map(|channel| self.tension[channel].apply(sample.tension_raw[channel]))
    }

    /// Angle of an encoder, rad.
    fn angle_rad(&self, encoder: usize, count: i32) -> f64 {
        let Encoder { direction, zero } = self.encoder[encoder];
        direction * (f64::from(count) - zero) * TAU / COUNTS_PER_TURN
    }

    /// Duty, 1 at most; positive drives towards +θ.
    pub fn duty(&self, sample: &Sample) -> f64 {
        self.bridge_direction * (f64::from(sample.duty_raw) / FULL_DUTY)
    }

    /// Current of the motor, A; positive drives towards +θ.
    pub fn current_a(&self, sample: &Sample) -> f64 {
        self.bridge_direction * self.current.apply(sample.current_raw)
    }

    /// Reference, rad or, in torque mode, N·m.
    pub fn reference(sample: &Sample) -> f64 {
        f64::from(sample.reference_raw) / STEPS
    }

    /// Voltage of the bus, V.
    pub fn bus_v(&self, sample: &Sample) -> f64 {
        self.bus.apply(sample.bus_raw)
    }

    /// Cells of a sample, one for every column of [`columns`].
    pub fn cells(&self, sample: &Sample, mode: Option<Mode>) -> impl Iterator<Item = Cell<'static>> {
        let number = |value: f64| Cell::Number((value * ROUNDING).round() / ROUNDING);
        let whole = |value: i64| Cell::Integer(value);
        let reference = mode.map(|_| number(Self::reference(sample)));
        let [f1, f2, f3, f4] = sample.tension_raw;
        let tension = |channel: usize, code| number(self.tension[channel].apply(code));
        let cells = [
            number(self.angle_rad(0, sample.encoder_count_raw[0])),
            number(self.angle_rad(1, sample.encoder_count_raw[1])),
            tension(0, f1),
            tension(1, f2),
            tension(2, f3),
            tension(3, f4),
            number(self.duty(sample)),
            number(self.bus_v(sample)),
            number(self.current_a(sample)),
            Cell::Integer(i64::from(sample.state.drives())),
            number(f64::from(sample.command_raw) / STEPS),
            whole(sample.encoder_count_raw[0].into()),
            whole(sample.encoder_count_raw[1].into()),
            whole(f1.into()),
            whole(f2.into()),
            whole(f3.into()),
            whole(f4.into()),
            whole(sample.current_raw.into()),
            whole(sample.bus_raw.into()),
            whole(sample.duty_raw.into()),
            whole(sample.reference_raw.into()),
            whole(sample.command_raw.into()),
            whole(sample.state as i64),
            whole(sample.limits.0.into()),
        ];
        reference.into_iter().chain(cells)
    }
}

/// Name of a mode, as arguments and files have it.
pub const fn mode_name(mode: Mode) -> &'static str {
    match mode {
        Mode::Position => "position",
        Mode::Torque => "torque",
        Mode::Hybrid => "hybrid",
        Mode::Impedance => "impedance",
    }
}

/// Columns of a recording of the board: roles, then the raw values that they came from.
///
/// `state` and `limits` are the numbers of [`bowden_link::State`] and [`bowden_link::Limits`]. Without a mode the meaning
/// of the reference is not known, and only its raw value is there.
pub fn columns(mode: Option<Mode>) -> Vec<RowColumn> {
    let reference = mode.map(|mode| match mode {
        Mode::Position | Mode::Hybrid | Mode::Impedance => RowColumn::Known(Channel::ThetaRef),
        Mode::Torque => RowColumn::described(TORQUE_REFERENCE, "N m"),
    });
    let roles = [
        Channel::ThetaIn,
        Channel::ThetaOut,
        Channel::F1,
        Channel::F2,
        Channel::F3,
        Channel::F4,
        Channel::Duty,
        Channel::BusVoltage,
        Channel::MotorCurrent,
        Channel::DriveEnable,
    ];
    let others = [
        ("theta_command_rad", "rad"),
        ("encoder_in_count_raw", "count"),
        ("encoder_out_count_raw", "count"),
        ("f1_raw", "code"),
        ("f2_raw", "code"),
        ("f3_raw", "code"),
        ("f4_raw", "code"),
        ("current_raw", "code"),
        ("bus_raw", "code"),
        ("duty_raw", "1/32767"),
        ("reference_raw", "2^-20 rad or N m"),
        ("command_raw", "2^-20 rad"),
        ("state", "number of the state"),
        ("limits", "set of bits"),
    ];
    let others = others.into_iter().map(|(name, unit)| RowColumn::described(name, unit));
    reference.into_iter().chain(roles.into_iter().map(RowColumn::Known)).chain(others).collect()
}
