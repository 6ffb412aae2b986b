//! Arguments that limit an investigation.

use bowden_host_link::investigate::limits::{DEFAULT_TIME_S, Wishes};

/// Limits that the user sets; where there is none, the board's count.
#[derive(Clone, Copy, Debug, PartialEq, clap::Args)]
pub struct LimitArguments {
    /// Largest angle of the joint, rad [default: 0.6 of what the board allows]
    #[arg(long, value_name = "RAD", value_parser = positive)]
    angle: Option<f64>,
    /// Largest torque at the joint that a reference may ask for, N·m [default: what the board allows]
    #[arg(long, value_name = "NM", value_parser = positive)]
    torque: Option<f64>,
    /// Largest speed of the joint that a reference may ask for, rad/s [default: 0.5 of what the board allows]
    #[arg(long, value_name = "RAD/S", value_parser = positive)]
    speed: Option<f64>,
    /// Longest time that the joint is driven along references, all runs together, s; the runs are shortened to it
    #[arg(long, value_name = "S", default_value_t = DEFAULT_TIME_S, value_parser = positive)]
    time: f64,
}

impl From<LimitArguments> for Wishes {
    fn from(arguments: LimitArguments) -> Self {
        let LimitArguments { angle, torque, speed, time } = arguments;
        Self { angle, torque, speed, time }
    }
}

fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value > 0.0 && value <= 1e6 => Ok(value),
        _ => Err("expected a number above 0".to_owned()),
    }
}
