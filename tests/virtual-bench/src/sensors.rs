//! What the sensors make of the state: effects, noise, range, quantisation; once a sample.

use std::collections::VecDeque;
use std::f64::consts::TAU;

use crate::config::BenchConfig;
use crate::draw::Draw;
use crate::effects::{ActiveEffects, Channel};

/// One sample of all channels, in the order of [`Channel`].
pub(crate) type Sample = [f64; Channel::COUNT];

/// Longer dead times are cut to this \[s\].
const LONGEST_DEAD_TIME_S: f64 = 10.0;

/// Dead time and low-pass of the channel that lags.
#[derive(Debug, Clone)]
struct Lag {
    channel: usize,
    waiting: VecDeque<f64>,
    keep: f64,
    filtered: Option<f64>,
}

/// Sensors of one run.
#[derive(Debug, Clone)]
pub(crate) struct Sensors {
    effects: ActiveEffects,
    lag: Option<Lag>,
    noise: Draw,
    period_s: f64,
    samples: u64,
    rad_per_count: f64,
    newton_per_lsb: f64,
    full_scale_n: f64,
    amp_per_lsb: f64,
    tension_noise_n: f64,
    current_noise_a: f64,
}

impl Sensors {
    /// Sensors that have been on for `clock_start_s` \[s\].
    pub(crate) fn new(config: &BenchConfig, effects: ActiveEffects, clock_start_s: f64, seed: u64) -> Self {
        let period_s = 1.0 / config.sample_rate_hz;
        let lag = effects.sensor_lag.as_ref().map(|law| Lag {
            channel: law.channel as usize,
            waiting: VecDeque::from(vec![
                f64::NAN;
                (law.dead_time_s.min(LONGEST_DEAD_TIME_S) / period_s).round()
                    as usize
            ]),
            keep: if law.filter_s > 0.0 { (-period_s / law.filter_s).exp() } else { 0.0 },
            filtered: None,
        });
        Self {
            effects,
            lag,
            noise: Draw::new(seed, "sensor noise"),
            period_s,
            samples: (clock_start_s / period_s).round() as u64,
            rad_per_count: TAU / f64::from(1_u32 << config.encoder_bits),
            newton_per_lsb: config.tension_full_scale_n / f64::from(1_u32 << config.adc_bits),
            full_scale_n: config.tension_full_scale_n,
            amp_per_lsb: config.current_lsb_a,
            tension_noise_n: config.tension_noise_n,
            current_noise_a: config.current_noise_a,
        }
    }

    /// Readings for true values `truth`. The noise drawn does not depend on the effects.
    pub(crate) fn read(&mut self, truth: &Sample) -> Sample {
        let mut sample = *truth;
        if let Some(law) = &self.effects.encoder_eccentricity {
            let value = &mut sample[law.channel as usize];
            if matches!(law.channel, Channel::ThetaIn | Channel::ThetaOut) {
                *value = law.reading_rad(*value);
            }
        }
        if let Some(lag) = &mut self.lag {
            let value = &mut sample[lag.channel];
            lag.waiting.push_back(*value);
            // At the start the line holds nothing yet: the first value is taken as the past.
            let late = lag
                .waiting
                .pop_front()
                .filter(|late| !late.is_nan())
                .unwrap_or(lag.filtered.unwrap_or(*value));
            let filtered = lag.filtered.map_or(late, |old| late + lag.keep * (old - late));
            lag.filtered = Some(filtered);
            *value = filtered;
        }
        if let Some(law) = &self.effects.sensor_saturation {
            let value = &mut sample[law.channel as usize];
            *value = law.reading_n(*value);
        }
        if let Some(law) = &self.effects.sensor_gain_error {
            sample[law.channel as usize] *= 1.0 + law.error;
        }
        if let Some(law) = &self.effects.sensor_offset {
            sample[law.channel as usize] += law.offset;
        }
        if let Some(law) = &self.effects.sensor_hum {
            sample[law.channel as usize] += law.pick_up_n(self.samples as f64 * self.period_s);
        }
        if let Some(law) = &self.effects.unlisted_sensor {
            let value = &mut sample[law.channel as usize];
            *value += law.error(*value, self.samples as f64 * self.period_s);
        }
        self.samples += 1;
        for channel in [Channel::ThetaIn, Channel::ThetaOut] {
            let value = &mut sample[channel as usize];
            *value = (*value / self.rad_per_count).round() * self.rad_per_count;
        }
        for channel in Channel::TENSIONS {
            let value = &mut sample[channel as usize];
            let noisy = *value + self.tension_noise_n * self.noise.normal();
            let top_n = self.full_scale_n - self.newton_per_lsb;
            *value = ((noisy / self.newton_per_lsb).round() * self.newton_per_lsb).clamp(0.0, top_n);
        }
        let current = &mut sample[Channel::Current as usize];
        let noisy = *current + self.current_noise_a * self.noise.normal();
        *current = (noisy / self.amp_per_lsb).round() * self.amp_per_lsb;
        sample
    }
}
