//! Rigid bodies: mass, centre and inertia, added up.

use nalgebra::{Isometry3, Matrix3, Point3, Vector3};

/// A rigid body, or several that move as one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Inertia {
    pub(super) mass_kg: f64,
    pub(super) centre_m: Point3<f64>,
    /// About the centre, along the axes of the frame, kg·m².
    pub(super) about_centre: Matrix3<f64>,
}

impl Inertia {
    pub(super) fn none() -> Self {
        Self { mass_kg: 0.0, centre_m: Point3::origin(), about_centre: Matrix3::zeros() }
    }

    /// The same body in the frame in which its own frame stands at `pose`.
    pub(super) fn at(&self, pose: &Isometry3<f64>) -> Self {
        let turn = pose.rotation.to_rotation_matrix();
        let turn = turn.matrix();
        Self {
            mass_kg: self.mass_kg,
            centre_m: pose * self.centre_m,
            about_centre: turn * self.about_centre * turn.transpose(),
        }
    }

    /// Both as one.
    pub(super) fn with(&self, other: &Self) -> Self {
        let mass_kg = self.mass_kg + other.mass_kg;
        if mass_kg <= 0.0 {
            return *self;
        }
        let weighted = self.mass_kg * self.centre_m.coords + other.mass_kg * other.centre_m.coords;
        let centre_m = Point3::from(weighted / mass_kg);
        let about = self.about_point(centre_m) + other.about_point(centre_m);
        Self { mass_kg, centre_m, about_centre: about }
    }

    /// Inertia about another point, along the same axes.
    fn about_point(&self, point: Point3<f64>) -> Matrix3<f64> {
        let arm: Vector3<f64> = self.centre_m - point;
        let steiner = Matrix3::identity() * arm.norm_squared() - arm * arm.transpose();
        self.about_centre + self.mass_kg * steiner
    }

    /// Moment of inertia about a line, kg·m².
    pub(super) fn about_line(&self, point: Point3<f64>, along: Vector3<f64>) -> f64 {
        (along.transpose() * self.about_point(point) * along)[0]
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Translation3, UnitQuaternion};

    use super::*;

    /// Two halves of a rod, turned and moved, are the rod: m L²/12 about its middle, m L²/3 about its end.
    #[test]
    fn two_halves_of_a_rod_are_the_rod() {
        let (m, l) = (2.0, 0.6);
        let half = Inertia {
            mass_kg: m / 2.0,
            centre_m: Point3::new(0.0, 0.0, l / 4.0),
            about_centre: Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, 0.0))
                * (m / 2.0 * (l / 2.0_f64).powi(2) / 12.0),
        };
        let along_x = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), std::f64::consts::FRAC_PI_2);
        let near = half.at(&Isometry3::from_parts(Translation3::identity(), along_x));
        let far = half.at(&Isometry3::from_parts(Translation3::new(l / 2.0, 0.0, 0.0), along_x));
        let rod = near.with(&far);
        assert!((rod.centre_m - Point3::new(l / 2.0, 0.0, 0.0)).norm() < 1e-12);
        for (point, expected) in [(rod.centre_m, m * l * l / 12.0), (Point3::origin(), m * l * l / 3.0)] {
            assert!((rod.about_line(point, Vector3::y()) - expected).abs() < 1e-12);
            assert!(rod.about_line(point, Vector3::x()).abs() < 1e-12);
        }
    }
}
