//! What of a bench's motion reaches the training recording: channels that were not recorded, a slow rate, a dirty file.

use clap::ValueEnum;
use rand_distr::{Distribution, Uniform};
use rand_pcg::Pcg64;
use virtual_bench::Recording;

/// Samples of which one is kept in a slow recording: 100 Hz of 1 kHz.
const SLOW: usize = 10;

/// Samples of a dirty tension of which one is a spike, on average.
const SPIKE_IN: f64 = 500.0;

/// Largest spike, N, of either sign.
const SPIKE_N: f64 = 40.0;

/// Rows of a dirty file of which one is lost, on average.
const LOST_IN: f64 = 50.0;

/// Largest error of a dirty file's clock, as a part of a step.
const JITTER: f64 = 0.3;

/// Rows of a dirty file of which some begin a stretch in which the logger repeats its last row: one in so many.
const FROZEN_IN: usize = 8000;

/// Rows of such a stretch, at least and at most.
const FROZEN_ROWS: [f64; 2] = [50.0, 400.0];

/// What was recorded.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Recorded {
    /// Everything, at 1 kHz.
    Everything,
    /// Encoders and motor, but no tension.
    NoTensions,
    /// Tensions at the motor alone.
    MotorSide,
    /// Everything, at 100 Hz.
    Slow,
    /// Everything, with spikes in the tensions, stretches in which the logger stood still, lost rows and a clock that jitters.
    Dirty,
}

impl Recorded {
    /// Channels that the training recording lacks.
    #[must_use]
    pub const fn missing(self) -> &'static [&'static str] {
        match self {
            Self::NoTensions => &["f1_n", "f2_n", "f3_n", "f4_n"],
            Self::MotorSide => &["f2_n", "f4_n"],
            Self::Everything | Self::Slow | Self::Dirty => &[],
        }
    }

    /// The training recording, of everything that the bench shows at 1 kHz.
    #[must_use]
    pub fn of(self, mut all: Recording, seed: u64) -> Recording {
        match self {
            Self::Everything => {}
            Self::NoTensions | Self::MotorSide => {
                for (name, values) in columns_mut(&mut all) {
                    if self.missing().contains(&name) {
                        values.clear();
                    }
                }
            }
            Self::Slow => {
                for (_, values) in columns_mut(&mut all) {
                    *values = values.iter().copied().step_by(SLOW).collect();
                }
            }
            Self::Dirty => soil(&mut all, seed),
        }
        all
    }
}

fn soil(recording: &mut Recording, seed: u64) {
    let mut random = Pcg64::new(u128::from(seed), 0x0064_6972_7479);
    let unit = Uniform::new(0.0, 1.0).expect("an interval");
    let step_s = recording.t_s.get(1).copied().unwrap_or(0.0) - recording.t_s.first().copied().unwrap_or(0.0);
    for tension_n in [&mut recording.f1_n, &mut recording.f2_n, &mut recording.f3_n, &mut recording.f4_n] {
        for value_n in tension_n {
            if unit.sample(&mut random) * SPIKE_IN < 1.0 {
                *value_n += SPIKE_N * (2.0 * unit.sample(&mut random) - 1.0);
            }
        }
    }
    for _ in 0..recording.len() / FROZEN_IN {
        let [shortest, longest] = FROZEN_ROWS;
        let rows = (shortest + (longest - shortest) * unit.sample(&mut random)) as usize;
        let first = ((recording.len() - rows) as f64 * unit.sample(&mut random)) as usize;
        for (name, values) in columns_mut(recording) {
            if name != "t_s" {
                let last = values[first];
                values[first..first + rows].fill(last);
            }
        }
    }
    for t_s in &mut recording.t_s {
        *t_s += JITTER * step_s * (2.0 * unit.sample(&mut random) - 1.0);
    }
    let kept: Vec<bool> = recording.t_s.iter().map(|_| unit.sample(&mut random) * LOST_IN >= 1.0).collect();
    for (_, values) in columns_mut(recording) {
        let mut row = kept.iter();
        values.retain(|_| *row.next().unwrap_or(&true));
    }
}

fn columns_mut(recording: &mut Recording) -> [(&'static str, &mut Vec<f64>); 11] {
    [
        ("t_s", &mut recording.t_s),
        ("theta_ref_rad", &mut recording.theta_ref_rad),
        ("theta_in_rad", &mut recording.theta_in_rad),
        ("theta_out_rad", &mut recording.theta_out_rad),
        ("f1_n", &mut recording.f1_n),
        ("f2_n", &mut recording.f2_n),
        ("f3_n", &mut recording.f3_n),
        ("f4_n", &mut recording.f4_n),
        ("duty", &mut recording.duty),
        ("bus_v", &mut recording.bus_v),
        ("i_motor_a", &mut recording.i_motor_a),
    ]
}

#[cfg(test)]
mod tests {
    use virtual_bench::{Case, MotionKind};

    use super::*;

    fn second() -> Recording {
        Case::new("bench", Vec::new(), 3, 0.0).train(MotionKind::Lab, 1.0).unwrap()
    }

    #[test]
    fn what_is_not_recorded_is_not_in_the_file() {
        let header = |recorded: Recorded| {
            let mut text = Vec::new();
            recorded.of(second(), 1).write_csv(&mut text).unwrap();
            String::from_utf8(text).unwrap().lines().next().unwrap().to_owned()
        };
        let all = "t_s,theta_ref_rad,theta_in_rad,theta_out_rad,f1_n,f2_n,f3_n,f4_n,duty,bus_v,i_motor_a";
        assert_eq!(header(Recorded::Everything), all);
        assert_eq!(header(Recorded::NoTensions), all.replace("f1_n,f2_n,f3_n,f4_n,", ""));
        assert_eq!(header(Recorded::MotorSide), all.replace("f2_n,", "").replace("f4_n,", ""));
    }

    #[test]
    fn a_slow_recording_has_every_tenth_sample() {
        let (all, slow) = (second(), Recorded::Slow.of(second(), 1));
        assert_eq!(slow.len(), all.len().div_ceil(10));
        assert_eq!((slow.t_s[7], slow.f3_n[7]), (all.t_s[70], all.f3_n[70]));
    }

    /// Of a thousand rows some twenty are lost, two in a thousand values are off, and time still goes on.
    #[test]
    fn a_dirty_file_has_spikes_gaps_and_a_clock_that_jitters() {
        let (all, dirty) = (second(), Recorded::Dirty.of(second(), 5));
        let lost = all.len() - dirty.len();
        assert!((8..40).contains(&lost), "{lost} rows");
        assert!(dirty.t_s.windows(2).all(|pair| pair[1] > pair[0]));
        assert!(all.t_s.iter().zip(&dirty.t_s).any(|(a, b)| a != b));
        let spikes = dirty.f1_n.iter().zip(&dirty.t_s).filter(|(f1_n, t_s)| {
            let sample = ((**t_s - all.t_s[0]) * 1e3).round() as usize;
            (**f1_n - all.f1_n[sample.min(all.len() - 1)]).abs() > 2.0
        });
        assert!((1..8).contains(&spikes.count()));
        assert_eq!(dirty, Recorded::Dirty.of(second(), 5));
    }

    /// Sixteen seconds: the logger stands still twice, for 50 to 400 rows, of which some are lost.
    #[test]
    fn the_logger_of_a_dirty_file_stands_still() {
        let all = Case::new("bench", Vec::new(), 3, 0.0).train(MotionKind::Lab, 16.0).unwrap();
        let dirty = Recorded::Dirty.of(all, 5);
        let stands = |row: usize| {
            [&dirty.f1_n, &dirty.f3_n, &dirty.i_motor_a].iter().all(|values| values[row] == values[row - 1])
        };
        let still = (1..dirty.len()).filter(|row| stands(*row)).count();
        assert!((90..800).contains(&still), "{still} rows");
    }
}
