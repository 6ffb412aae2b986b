//! A recording: named columns, one value a sample.

use std::io::{self, Write};

/// Columns of one run; all have the same length.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Recording {
    /// Time \[s\].
    pub t_s: Vec<f64>,
    /// Reference of the input pulley \[rad\].
    pub theta_ref_rad: Vec<f64>,
    /// Encoder of the input pulley \[rad\].
    pub theta_in_rad: Vec<f64>,
    /// Encoder of the joint \[rad\].
    pub theta_out_rad: Vec<f64>,
    /// Tension of cable a at the motor \[N\].
    pub f1_n: Vec<f64>,
    /// Tension of cable a at the joint \[N\].
    pub f2_n: Vec<f64>,
    /// Tension of cable b at the motor \[N\].
    pub f3_n: Vec<f64>,
    /// Tension of cable b at the joint \[N\].
    pub f4_n: Vec<f64>,
    /// PWM duty from this sample to the next, −1 to 1.
    pub duty: Vec<f64>,
    /// Supply voltage \[V\].
    pub bus_v: Vec<f64>,
    /// Motor current \[A\].
    pub i_motor_a: Vec<f64>,
}

impl Recording {
    /// An empty recording with room for `samples`.
    pub(crate) fn with_capacity(samples: usize) -> Self {
        let column = || Vec::with_capacity(samples);
        Self {
            t_s: column(),
            theta_ref_rad: column(),
            theta_in_rad: column(),
            theta_out_rad: column(),
            f1_n: column(),
            f2_n: column(),
            f3_n: column(),
            f4_n: column(),
            duty: column(),
            bus_v: column(),
            i_motor_a: column(),
        }
    }

    /// Number of samples.
    pub fn len(&self) -> usize {
        self.t_s.len()
    }

    /// Whether there is no sample.
    pub fn is_empty(&self) -> bool {
        self.t_s.is_empty()
    }

    /// Columns by name, in the order of the file.
    pub fn columns(&self) -> [(&'static str, &[f64]); 11] {
        [
            ("t_s", &self.t_s),
            ("theta_ref_rad", &self.theta_ref_rad),
            ("theta_in_rad", &self.theta_in_rad),
            ("theta_out_rad", &self.theta_out_rad),
            ("f1_n", &self.f1_n),
            ("f2_n", &self.f2_n),
            ("f3_n", &self.f3_n),
            ("f4_n", &self.f4_n),
            ("duty", &self.duty),
            ("bus_v", &self.bus_v),
            ("i_motor_a", &self.i_motor_a),
        ]
    }

    /// The column called `name`.
    pub fn column(&self, name: &str) -> Option<&[f64]> {
        self.columns().into_iter().find(|(known, _)| *known == name).map(|(_, values)| values)
    }

    /// Writes a header line and one line a sample, comma separated. A column without values is left out.
    ///
    /// # Errors
    /// Those of `out`.
    pub fn write_csv(&self, mut out: impl Write) -> io::Result<()> {
        let columns = self.columns();
        let kept: Vec<(&str, &[f64], usize)> = columns
            .into_iter()
            .filter(|(name, values)| *name == "t_s" || !values.is_empty())
            .map(|(name, values)| (name, values, decimals(name)))
            .collect();
        let names: Vec<&str> = kept.iter().map(|(name, ..)| *name).collect();
        writeln!(out, "{}", names.join(","))?;
        for row in 0..self.len() {
            for (place, (_, values, decimals)) in kept.iter().enumerate() {
                let comma = if place == 0 { "" } else { "," };
                write!(out, "{comma}{:.decimals$}", values[row])?;
            }
            writeln!(out)?;
        }
        out.flush()
    }
}

/// Decimals of a column in a file.
fn decimals(name: &str) -> usize {
    match name {
        "bus_v" => 2,
        _ if name.ends_with("_rad") || name == "t_s" => 6,
        _ => 4,
    }
}
