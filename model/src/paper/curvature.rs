//! Full curvature of a sheath: Eq. (1).
//!
//! Friction needs the angle through which the tendon is bent, whatever the side or plane of the bend: two opposite
//! quarter turns count as pi, not 0. All functions therefore integrate the magnitude of the curvature.

use super::error::{PaperError, finite, positive, within};

/// Largest number of intervals a profile may be cut into.
pub const INTERVALS_MAX: usize = 1_000_000;

/// Wrap angle of a sheath with known mean curvature: `K = |kappa| L`, rad (text under Eq. (1)).
///
/// `mean_curvature_per_m`: mean of |kappa|, 1/m; `length_m` > 0, m. Result ≥ 0.
///
/// # Errors
/// [`PaperError::OutOfRange`] if a number is not finite or the length not positive.
pub fn wrap_angle_of_mean_curvature_rad(mean_curvature_per_m: f64, length_m: f64) -> Result<f64, PaperError> {
    let curvature = finite("mean_curvature_per_m", mean_curvature_per_m)?;
    Ok(curvature.abs() * positive("length_m", length_m)?)
}

/// Wrap angle of a sheath whose curvature is a function of the position: `K = ∫ |kappa(s)| ds`, rad, Eq. (1).
///
/// `curvature_per_m(s)`: curvature, 1/m, for `s` in `0..=length_m` from the input end; `intervals` 1 to
/// [`INTERVALS_MAX`]. Simpson's rule, exact for |kappa| cubic within an interval, error of fourth order in the interval
/// for smooth profiles (test: below 1e-9 relative at 200 intervals for a half sine). At a jump of the curvature the
/// error is up to jump times interval: put the interval limits on the jumps, or use [`wrap_angle_of_samples_rad`].
///
/// # Errors
/// [`PaperError::OutOfRange`] if the length is not positive, the interval count out of range, or a curvature not finite.
pub fn wrap_angle_of_profile_rad<P: Fn(f64) -> f64>(
    length_m: f64,
    intervals: usize,
    curvature_per_m: P,
) -> Result<f64, PaperError> {
    let pieces = ProfilePieces::new(length_m, intervals, &curvature_per_m)?;
    let mut wrap_rad = 0.0;
    for index in 0..pieces.intervals {
        wrap_rad += pieces.piece(index)?.wrap_rad();
    }
    Ok(wrap_rad)
}

/// Wrap angle of a sheath whose curvature is sampled: `K = ∫ |kappa(s)| ds`, rad, Eq. (1).
///
/// `position_m`: strictly increasing positions, m; `curvature_per_m`: curvature at each, 1/m. |kappa| is taken as
/// linear between samples (trapezoid rule, exact for that reading). A piecewise constant profile is given by two
/// closely spaced samples at each jump.
///
/// # Errors
/// [`PaperError::SampleCount`], [`PaperError::NotIncreasing`], or [`PaperError::OutOfRange`] for a curvature that is
/// not finite.
pub fn wrap_angle_of_samples_rad(position_m: &[f64], curvature_per_m: &[f64]) -> Result<f64, PaperError> {
    let samples = SampledPieces::new(position_m, curvature_per_m)?;
    let mut wrap_rad = 0.0;
    for index in 0..samples.len() {
        wrap_rad += samples.piece(index)?.wrap_rad();
    }
    Ok(wrap_rad)
}

/// One interval of a profile: |kappa| as the parabola through its ends and its middle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Piece {
    pub width_m: f64,
    /// |kappa| at the start, the middle and the end.
    pub curvature_per_m: [f64; 3],
}

impl Piece {
    /// Wrap angle of the whole interval.
    pub fn wrap_rad(&self) -> f64 {
        let [start, middle, end] = self.curvature_per_m;
        self.width_m / 6.0 * (start + 4.0 * middle + end)
    }

    /// Wrap angle from the start of the interval to its middle.
    pub fn wrap_to_middle_rad(&self) -> f64 {
        let [start, middle, end] = self.curvature_per_m;
        self.width_m / 24.0 * (5.0 * start + 8.0 * middle - end)
    }
}

/// A profile that can be walked interval by interval from the input end.
pub(crate) trait Pieces {
    fn len(&self) -> usize;
    fn length_m(&self) -> f64;
    fn piece(&self, index: usize) -> Result<Piece, PaperError>;
}

/// A closure cut into equal intervals.
pub(crate) struct ProfilePieces<'a, P> {
    length_m: f64,
    intervals: usize,
    curvature_per_m: &'a P,
}

impl<'a, P: Fn(f64) -> f64> ProfilePieces<'a, P> {
    pub fn new(length_m: f64, intervals: usize, curvature_per_m: &'a P) -> Result<Self, PaperError> {
        positive("length_m", length_m)?;
        within("intervals", intervals as f64, 1.0, INTERVALS_MAX as f64, "1 to 1000000")?;
        Ok(Self { length_m, intervals, curvature_per_m })
    }

    fn magnitude_per_m(&self, position_m: f64) -> Result<f64, PaperError> {
        let curvature = (self.curvature_per_m)(position_m);
        finite("curvature_per_m", curvature).map(f64::abs)
    }
}

impl<P: Fn(f64) -> f64> Pieces for ProfilePieces<'_, P> {
    fn len(&self) -> usize {
        self.intervals
    }

    fn length_m(&self) -> f64 {
        self.length_m
    }

    fn piece(&self, index: usize) -> Result<Piece, PaperError> {
        let width_m = self.length_m / self.intervals as f64;
        let start_m = width_m * index as f64;
        Ok(Piece {
            width_m,
            curvature_per_m: [
                self.magnitude_per_m(start_m)?,
                self.magnitude_per_m(start_m + 0.5 * width_m)?,
                self.magnitude_per_m((start_m + width_m).min(self.length_m))?,
            ],
        })
    }
}

/// Samples, |kappa| linear between them.
pub(crate) struct SampledPieces<'a> {
    position_m: &'a [f64],
    curvature_per_m: &'a [f64],
}

impl<'a> SampledPieces<'a> {
    pub fn new(position_m: &'a [f64], curvature_per_m: &'a [f64]) -> Result<Self, PaperError> {
        if position_m.len() < 2 || position_m.len() != curvature_per_m.len() {
            return Err(PaperError::SampleCount {
                positions: position_m.len(),
                curvatures: curvature_per_m.len(),
            });
        }
        finite("position_m", position_m[0])?;
        for (index, pair) in position_m.windows(2).enumerate() {
            if !pair[1].is_finite() || pair[1] <= pair[0] {
                return Err(PaperError::NotIncreasing {
                    index: index + 1,
                    previous_m: pair[0],
                    got_m: pair[1],
                });
            }
        }
        Ok(Self { position_m, curvature_per_m })
    }
}

impl Pieces for SampledPieces<'_> {
    fn len(&self) -> usize {
        self.position_m.len() - 1
    }

    fn length_m(&self) -> f64 {
        self.position_m[self.position_m.len() - 1] - self.position_m[0]
    }

    fn piece(&self, index: usize) -> Result<Piece, PaperError> {
        let start_per_m = finite("curvature_per_m", self.curvature_per_m[index])?.abs();
        let end_per_m = finite("curvature_per_m", self.curvature_per_m[index + 1])?.abs();
        Ok(Piece {
            width_m: self.position_m[index + 1] - self.position_m[index],
            curvature_per_m: [start_per_m, 0.5 * (start_per_m + end_per_m), end_per_m],
        })
    }
}
