//! Torque ripple of any shape, by a table: the motor makes `s p(θ)`, N·m at the input pulley, which is taken off the torque
//! that is asked of it.
//!
//! θ is the observed angle of the input pulley, `p` a straight line between 256 points over one period, `s` the full scale.
//! While `correction.ripple_table.enable` is 1 and there is a table, it stands in the place of the harmonics of
//! [`super::cogging`].
//!
//! # Error
//! Against straight lines between the exact points, at most `0.75 s 2⁻¹⁵` and a step of the torque: half a bit of a point, a
//! quarter of a bit for the 15 bits of the place in a segment at a slope of `s/4` a segment; and the slope times `8e-7 |θ|`
//! for the phase, as of [`super::shape::Harmonic`].
//!
//! # Record
//! The stored form, little-endian: version (`u16`, 1), number of points (`u16`), period (`f32`, rad), full scale (`f32`, N·m),
//! points (`i16` each), CRC-32 of all before.

use bowden_link::frame::checksum;
use bowden_link::message::{Refusal, TABLE_POINTS, TableHead};

use super::shape::Harmonic;
use crate::scale::{Angle, Quantity, Share, Torque};

/// Version of the record.
const VERSION: u16 = 1;

/// Bytes ahead of the points: version, number, period, full scale.
const HEADER: usize = 12;

/// Bytes of a record.
pub const RECORD: usize = HEADER + 2 * TABLE_POINTS + 4;

/// Shortest and longest period, rad: 2992 and a tenth of a period a turn.
pub const PERIOD_RAD: [f32; 2] = [0.0021, 63.0];

/// Least and most torque of the full scale, N·m.
pub const FULL_SCALE_NM: [f32; 2] = [0.001, 20.0];

/// Bits of a phase below those that name the segment.
const SEGMENT_BITS: u32 = 32 - TABLE_POINTS.trailing_zeros();

/// Bits that say where in its segment an angle is. With 16 a difference of points would not fit.
const WITHIN_BITS: u32 = 15;

/// A table of the motor's ripple.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RippleTable {
    period_rad: f32,
    full_scale_nm: f32,
    phase: Harmonic,
    full_scale: Torque,
    points_raw: [i16; TABLE_POINTS],
}

impl RippleTable {
    /// The table with this period and full scale; the points are in `full_scale_nm/32768`, point `k` at `k/256` of the period.
    ///
    /// # Errors
    /// [`Refusal::OutOfRange`] for a period outside [`PERIOD_RAD`] or a full scale outside [`FULL_SCALE_NM`].
    pub fn new(
        period_rad: f32,
        full_scale_nm: f32,
        points_raw: &[i16; TABLE_POINTS],
    ) -> Result<Self, Refusal> {
        let within = |got: f32, [minimum, maximum]: [f32; 2]| {
            if got >= minimum && got <= maximum {
                Ok(())
            } else {
                Err(Refusal::OutOfRange { got, minimum, maximum })
            }
        };
        within(period_rad, PERIOD_RAD)?;
        within(full_scale_nm, FULL_SCALE_NM)?;
        Ok(Self {
            period_rad,
            full_scale_nm,
            phase: Harmonic::new(core::f32::consts::TAU / period_rad, 0.0),
            full_scale: Torque::from_f32(full_scale_nm),
            points_raw: *points_raw,
        })
    }

    /// Torque that the motor makes at an angle, N·m at the input pulley.
    #[must_use]
    #[inline]
    pub fn torque(&self, angle: Angle) -> Torque {
        const WITHIN_MASK: u32 = (1 << WITHIN_BITS) - 1;
        let phase = self.phase.phase_at(angle.to_bits());
        let segment = (phase >> SEGMENT_BITS) as usize;
        let within = ((phase >> (SEGMENT_BITS - WITHIN_BITS)) & WITHIN_MASK).cast_signed();
        let point = |n: usize| i32::from(self.points_raw[n % TABLE_POINTS]);
        let (start, end) = (point(segment), point(segment + 1));
        // Points are in 2⁻¹⁵: with 15 bits of the place, a share. 65535 · 32767 is less than 2³¹.
        Share::from_bits((start << WITHIN_BITS) + (end - start) * within).of(self.full_scale)
    }

    /// Period, full scale and checksum.
    #[must_use]
    pub fn head(&self) -> TableHead {
        let record = self.to_record();
        let crc = checksum(&record[..RECORD - 4]);
        TableHead { period_rad: self.period_rad, full_scale_nm: self.full_scale_nm, crc }
    }

    /// The points in `full_scale_nm/32768`.
    #[must_use]
    pub const fn points_raw(&self) -> &[i16; TABLE_POINTS] {
        &self.points_raw
    }

    /// The stored form.
    #[must_use]
    pub fn to_record(&self) -> [u8; RECORD] {
        let mut record = [0; RECORD];
        record[0..2].copy_from_slice(&VERSION.to_le_bytes());
        record[2..4].copy_from_slice(&(TABLE_POINTS as u16).to_le_bytes());
        record[4..8].copy_from_slice(&self.period_rad.to_le_bytes());
        record[8..HEADER].copy_from_slice(&self.full_scale_nm.to_le_bytes());
        let places = record[HEADER..].as_chunks_mut::<2>().0;
        for (place, point) in places.iter_mut().zip(&self.points_raw) {
            *place = point.to_le_bytes();
        }
        let crc = checksum(&record[..RECORD - 4]);
        record[RECORD - 4..].copy_from_slice(&crc.to_le_bytes());
        record
    }

    /// The table of a record; `None` for another version or length, a wrong checksum, or values out of range.
    #[must_use]
    pub fn from_record(record: &[u8]) -> Option<Self> {
        let record: &[u8; RECORD] = record.try_into().ok()?;
        let (body, crc) = record.split_last_chunk::<4>()?;
        let half = |at: usize| u16::from_le_bytes([record[at], record[at + 1]]);
        let word = |at: usize| [record[at], record[at + 1], record[at + 2], record[at + 3]];
        if checksum(body) != u32::from_le_bytes(*crc)
            || half(0) != VERSION
            || usize::from(half(2)) != TABLE_POINTS
        {
            return None;
        }
        let points_raw = core::array::from_fn(|n| half(HEADER + 2 * n).cast_signed());
        Self::new(f32::from_le_bytes(word(4)), f32::from_le_bytes(word(8)), &points_raw).ok()
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use core::f64::consts::TAU;

    use super::*;

    fn angle_rad(angle: Angle) -> f64 {
        f64::from(angle.to_bits()) / f64::from(1 << 20)
    }

    fn torque_nm(table: &RippleTable, angle: Angle) -> f64 {
        f64::from(table.torque(angle).to_bits()) / f64::from(1 << 20)
    }

    /// Points that go up and down by any step.
    fn rough() -> [i16; TABLE_POINTS] {
        let mut x = 1_u32;
        core::array::from_fn(|_| {
            x = x.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            ((x >> 16) as u16).cast_signed()
        })
    }

    /// Straight lines between the points, in f64.
    fn reference_nm(points_raw: &[i16], period_rad: f64, full_scale_nm: f64, angle_rad: f64) -> f64 {
        let place = (angle_rad / period_rad).rem_euclid(1.0) * points_raw.len() as f64;
        let segment = place as usize % points_raw.len();
        let (start, end) = (points_raw[segment], points_raw[(segment + 1) % points_raw.len()]);
        let (start, end) = (f64::from(start), f64::from(end));
        full_scale_nm / 32_768.0 * (start + (end - start) * (place - place.floor()))
    }

    #[test]
    fn torque_by_hand() {
        // Period 2.56 rad, full scale 0.32768 N·m: a point a 10 mrad, in 10 µN·m.
        let mut points_raw = [0; TABLE_POINTS];
        (points_raw[0], points_raw[1], points_raw[2], points_raw[255]) = (1000, 3000, -32_768, 5000);
        let table = RippleTable::new(2.56, 0.327_68, &points_raw).unwrap();
        for (angle, expected) in [
            (0.0, 0.010),
            (0.005, 0.020),
            (0.010, 0.030),
            (0.0125, -0.059_42),
            (0.020, -0.327_68),
            (0.030, 0.0),
            (1.280, 0.0),
            (-0.010, 0.050),
            (-0.004, 0.026),
            // Ten periods on and back.
            (25.605, 0.020),
            (-25.604, 0.026),
        ] {
            let got = torque_nm(&table, Angle::from_f32(angle));
            // 36 N·m/rad at the steepest, the angle in 2⁻²⁰ rad and with 8e-7 of itself in the phase.
            let allowed = 2e-6 + 36.0 * (1e-6 + 8e-7 * f64::from(angle).abs());
            assert!((got - expected).abs() < allowed, "{angle}: {got}, expected {expected}");
        }
    }

    #[test]
    fn it_is_straight_lines_to_within_a_bit_over_many_turns() {
        // A point a bit either way of an i16, so steps of up to 2 full scales a segment; the worst slope bounds what the
        // place in a segment, 2⁻¹⁵ of it, and the phase, 8e-7 rad a radian, leave.
        let points_raw = rough();
        for (period_rad, full_scale_nm) in [(TAU, 0.2_f64), (0.448_8, 5.0), (0.0021, 0.01), (63.0, 20.0)] {
            let table = RippleTable::new(period_rad as f32, full_scale_nm as f32, &points_raw).unwrap();
            let (period_rad, full_scale_nm) = (f64::from(period_rad as f32), f64::from(full_scale_nm as f32));
            let steepest = points_raw
                .iter()
                .zip(points_raw.iter().cycle().skip(1))
                .map(|(one, other)| (f64::from(*one) - f64::from(*other)).abs() / 32_768.0)
                .fold(0.0, f64::max);
            let (mut worst, mut worst_share) = (0.0_f64, 0.0_f64);
            for step in -20_000..20_000 {
                let angle = Angle::from_bits(step * 1031);
                let rad = angle_rad(angle);
                let expected = reference_nm(&points_raw, period_rad, full_scale_nm, rad);
                let off = (torque_nm(&table, angle) - expected).abs();
                // The rate of the phase is a whole number of 2⁻²² turns a radian, one of TAU/period to f32's precision.
                let turns = rad.abs() * (0.5 / f64::from(1 << 22) + 1.2e-7 / period_rad);
                let segments = 1.0 / 32_768.0 + 256.0 * turns;
                let allowed = full_scale_nm * steepest * segments + 1e-6 + full_scale_nm * 1e-9;
                worst = worst.max(off);
                worst_share = worst_share.max(off / allowed);
                assert!(off <= allowed, "{period_rad} {rad}: {off} of {allowed}");
            }
            std::println!("period {period_rad}: {worst:.2e} N·m, {worst_share:.2} of the bound");
            // The bound is not slack: it is the rounding of place and torque that is measured.
            assert!(worst_share > 0.2, "{worst_share}");
        }
    }

    #[test]
    fn the_ends_of_a_period_meet() {
        let table = RippleTable::new(1.0, 1.0, &rough()).unwrap();
        // A step of the angle is 2⁻²⁰ of the period: no two neighbours differ by more than the steepest line allows.
        for around in [0, 1 << 20, -(1 << 20), 40 << 20] {
            for step in -300..300 {
                let at = |bits: i32| f64::from(table.torque(Angle::from_bits(bits)).to_bits());
                let rise = (at(around + step + 1) - at(around + step)).abs();
                // 2 N·m within 2¹² steps of the angle are 512 steps of the torque, and two roundings.
                assert!(rise <= 512.0 + 130.0, "{around} {step}: {rise}");
            }
        }
        // The largest angles do not panic.
        for angle in [Angle::MAX, Angle::from_bits(i32::MIN)] {
            assert!(table.torque(angle).magnitude() <= Torque::from_f32(1.0));
        }
    }

    #[test]
    fn a_record_comes_back_and_every_changed_bit_is_noticed() {
        let table = RippleTable::new(0.4488, 0.25, &rough()).unwrap();
        let record = table.to_record();
        assert_eq!(RippleTable::from_record(&record), Some(table));
        assert_eq!(record[..4], [1, 0, 0, 1]);
        assert_eq!(table.head().crc.to_le_bytes(), record[RECORD - 4..]);
        for place in 0..RECORD {
            for bit in 0..8 {
                let mut wrong = record;
                wrong[place] ^= 1 << bit;
                assert_eq!(RippleTable::from_record(&wrong), None, "byte {place} bit {bit}");
            }
        }
        assert_eq!(RippleTable::from_record(&record[..RECORD - 1]), None);
        // Another version with a checksum of its own.
        let mut other = record;
        other[0] = 2;
        let crc = checksum(&other[..RECORD - 4]);
        other[RECORD - 4..].copy_from_slice(&crc.to_le_bytes());
        assert_eq!(RippleTable::from_record(&other), None);
    }

    #[test]
    fn periods_and_scales_beyond_fixed_point_are_refused() {
        let points_raw = [0; TABLE_POINTS];
        for (period_rad, full_scale_nm) in [
            (0.002, 1.0),
            (64.0, 1.0),
            (f32::NAN, 1.0),
            (1.0, 0.0),
            (1.0, -1.0),
            (1.0, 21.0),
            (1.0, f32::NAN),
        ] {
            let refused = RippleTable::new(period_rad, full_scale_nm, &points_raw);
            assert!(matches!(refused, Err(Refusal::OutOfRange { .. })), "{period_rad} {full_scale_nm}");
        }
    }
}
