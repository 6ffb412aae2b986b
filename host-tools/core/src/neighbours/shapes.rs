//! Mass and inertia of the solids that MuJoCo's `geom` may be, along their own axes.
//!
//! Source: the solids' volume integrals; a capsule is a cylinder with two half spheres.

use std::f64::consts::PI;

use nalgebra::{Matrix3, Point3, Vector3};

use super::body::Inertia;

/// A solid with its long axis along z.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Solid {
    Sphere { radius_m: f64 },
    Capsule { radius_m: f64, half_length_m: f64 },
    Cylinder { radius_m: f64, half_length_m: f64 },
    Ellipsoid { half_m: [f64; 3] },
    Box { half_m: [f64; 3] },
}

impl Solid {
    pub(super) fn volume_m3(self) -> f64 {
        let ball = |radius_m: f64| 4.0 / 3.0 * PI * radius_m.powi(3);
        match self {
            Self::Sphere { radius_m } => ball(radius_m),
            Self::Capsule { radius_m, half_length_m } => {
                ball(radius_m) + 2.0 * PI * radius_m.powi(2) * half_length_m
            }
            Self::Cylinder { radius_m, half_length_m } => 2.0 * PI * radius_m.powi(2) * half_length_m,
            Self::Ellipsoid { half_m: [a, b, c] } => 4.0 / 3.0 * PI * a * b * c,
            Self::Box { half_m: [a, b, c] } => 8.0 * a * b * c,
        }
    }

    /// The solid with this mass, its centre at the origin.
    pub(super) fn inertia(self, mass_kg: f64) -> Inertia {
        let m = mass_kg;
        let [x, y, z] = match self {
            Self::Sphere { radius_m } => [0.4 * m * radius_m.powi(2); 3],
            Self::Cylinder { radius_m: r, half_length_m: h } => cylinder(m, r, h),
            Self::Capsule { radius_m: r, half_length_m: h } => {
                let caps = m * (4.0 / 3.0 * PI * r.powi(3)) / self.volume_m3();
                let [across, _, along] = cylinder(m - caps, r, h);
                // A half sphere's centre is 3 r / 8 from its face.
                let of_caps = caps * (0.4 * r * r + h * h + 0.75 * h * r);
                [across + of_caps, across + of_caps, along + 0.4 * caps * r * r]
            }
            Self::Ellipsoid { half_m } => squares(half_m).map(|sum| m * sum / 5.0),
            Self::Box { half_m } => squares(half_m).map(|sum| m * sum / 3.0),
        };
        Inertia {
            mass_kg,
            centre_m: Point3::origin(),
            about_centre: Matrix3::from_diagonal(&Vector3::new(x, y, z)),
        }
    }
}

fn cylinder(m: f64, r: f64, half_length: f64) -> [f64; 3] {
    let across = m * (3.0 * r * r + 4.0 * half_length * half_length) / 12.0;
    [across, across, 0.5 * m * r * r]
}

fn squares([a, b, c]: [f64; 3]) -> [f64; 3] {
    [b * b + c * c, a * a + c * c, a * a + b * b]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sums over points spread through the solid, on a lattice of its bounding box.
    fn summed(solid: Solid, half: [f64; 3], holds: impl Fn([f64; 3]) -> bool) {
        const STEPS: i32 = 120;
        let (mut inside, mut moments) = (0.0, [0.0; 3]);
        let at = |step: i32, half: f64| half * (2.0 * (f64::from(step) + 0.5) / f64::from(STEPS) - 1.0);
        for i in 0..STEPS {
            for j in 0..STEPS {
                for k in 0..STEPS {
                    let p = [at(i, half[0]), at(j, half[1]), at(k, half[2])];
                    if holds(p) {
                        inside += 1.0;
                        for (sum, square) in moments.iter_mut().zip(squares(p)) {
                            *sum += square;
                        }
                    }
                }
            }
        }
        let cell: f64 = half.iter().map(|half| 2.0 * half / f64::from(STEPS)).product();
        assert!((solid.volume_m3() / (inside * cell) - 1.0).abs() < 5e-3, "{solid:?}");
        let inertia = solid.inertia(3.0).about_centre;
        for axis in 0..3 {
            let expected = 3.0 * moments[axis] / inside;
            assert!((inertia[(axis, axis)] / expected - 1.0).abs() < 5e-3, "{solid:?}, axis {axis}");
        }
    }

    #[test]
    fn solids_have_the_mass_and_inertia_of_their_points() {
        let norm = |p: [f64; 3]| (p[0] * p[0] + p[1] * p[1] + p[2] * p[2]).sqrt();
        summed(Solid::Sphere { radius_m: 0.3 }, [0.3; 3], |p| norm(p) < 0.3);
        summed(Solid::Box { half_m: [0.1, 0.2, 0.4] }, [0.1, 0.2, 0.4], |_| true);
        summed(Solid::Ellipsoid { half_m: [0.1, 0.2, 0.4] }, [0.1, 0.2, 0.4], |p| {
            norm([p[0] / 0.1, p[1] / 0.2, p[2] / 0.4]) < 1.0
        });
        summed(Solid::Cylinder { radius_m: 0.2, half_length_m: 0.5 }, [0.2, 0.2, 0.5], |p| {
            p[0].hypot(p[1]) < 0.2
        });
        summed(Solid::Capsule { radius_m: 0.2, half_length_m: 0.3 }, [0.2, 0.2, 0.5], |p| {
            norm([p[0], p[1], (p[2].abs() - 0.3).max(0.0)]) < 0.2
        });
    }
}
