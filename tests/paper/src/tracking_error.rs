//! How far the joint is from what is asked of it, over a run.

use crate::error::ExperimentError;

/// Torque and angle at one moment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrackingSample {
    /// Torque that the desired motion needs \[Nm\].
    pub torque_desired_nm: f64,
    /// True output torque \[Nm\].
    pub torque_nm: f64,
    /// Desired angle of the joint \[rad\].
    pub angle_desired_rad: f64,
    /// True angle of the joint \[rad\].
    pub angle_rad: f64,
}

/// Errors over a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrackingErrors {
    /// `mean |T_d - T_out|` over `mean |T_d|` \[%\]: the average torque tracking error of section 5.2.
    pub torque_percent: f64,
    /// Root mean square of `theta_d - theta_out` \[rad\].
    pub angle_rms_rad: f64,
    /// Largest `|theta_d - theta_out|` \[rad\].
    pub angle_largest_rad: f64,
}

/// Sums over the samples of a run.
#[derive(Debug, Clone, Copy, Default)]
pub struct ErrorSums {
    samples: u64,
    torque_error_nm: f64,
    torque_nm: f64,
    squares_rad2: f64,
    largest_rad: f64,
}

impl ErrorSums {
    /// Adds a sample; all count alike.
    pub fn add(&mut self, sample: &TrackingSample) {
        let angle_rad = sample.angle_desired_rad - sample.angle_rad;
        self.samples += 1;
        self.torque_error_nm += (sample.torque_desired_nm - sample.torque_nm).abs();
        self.torque_nm += sample.torque_desired_nm.abs();
        self.squares_rad2 += angle_rad * angle_rad;
        self.largest_rad = self.largest_rad.max(angle_rad.abs());
    }

    /// Errors of the samples so far.
    ///
    /// # Errors
    /// [`ExperimentError::Evaluation`] if no torque was asked for.
    pub fn errors(&self) -> Result<TrackingErrors, ExperimentError> {
        if self.torque_nm == 0.0 {
            return Err(ExperimentError::Evaluation("the desired torque is 0 throughout: no relative error"));
        }
        Ok(TrackingErrors {
            torque_percent: 100.0 * self.torque_error_nm / self.torque_nm,
            angle_rms_rad: (self.squares_rad2 / self.samples as f64).sqrt(),
            angle_largest_rad: self.largest_rad,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_by_hand() {
        let mut sums = ErrorSums::default();
        assert!(sums.errors().is_err(), "nothing yet");
        for (torque_desired_nm, torque_nm, angle_desired_rad, angle_rad) in
            [(0.2, 0.1, 0.3, 0.3), (-0.4, -0.5, 0.3, 0.0), (0.4, 0.4, -0.1, 0.3)]
        {
            sums.add(&TrackingSample { torque_desired_nm, torque_nm, angle_desired_rad, angle_rad });
        }
        // (0.1 + 0.1 + 0)/(0.2 + 0.4 + 0.4) = 20 %; sqrt((0 + 0.09 + 0.16)/3) = 0.28868; 0.4.
        let errors = sums.errors().expect("torques asked for");
        assert!((errors.torque_percent - 20.0).abs() < 1e-9, "{errors:?}");
        assert!((errors.angle_rms_rad - 0.288_675).abs() < 1e-6, "{errors:?}");
        assert!((errors.angle_largest_rad - 0.4).abs() < 1e-12, "{errors:?}");
    }
}
