//! A hinge that carries a body against gravity, as weight and arm: what `[load]` states.

use bowden_model::load::GRAVITY_M_S2;
use nalgebra::{Point3, Unit, Vector3};

use super::body::Inertia;

/// Distance of the centre of mass from the axis below which a body is balanced, m.
const BALANCED_M: f64 = 1e-6;

/// Weight at the end of an arm that has the body's gravity torque and inertia about the axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Pendulum {
    pub(super) mass_kg: f64,
    pub(super) arm_m: f64,
    /// Beyond `mass_kg · arm_m²`.
    pub(super) inertia_kg_m2: f64,
    /// Angle of the arm from hanging straight down where the joint stands at zero, about its axis; zero where gravity does not pull.
    pub(super) zero_rad: f64,
}

/// `body` on a hinge through `point` along `axis`; all three and `gravity_m_s2` in one frame.
pub(super) fn pendulum(
    body: &Inertia,
    point: Point3<f64>,
    axis: Unit<Vector3<f64>>,
    gravity_m_s2: Vector3<f64>,
) -> Pendulum {
    let across = |v: Vector3<f64>| v - axis.into_inner() * v.dot(&axis);
    let arm = across(body.centre_m - point);
    let pull = across(gravity_m_s2);
    let arm_m = arm.norm();
    let inertia_kg_m2 = body.about_line(point, axis.into_inner());
    // The model's gravity is the standard one.
    let mass_kg = if arm_m > BALANCED_M { body.mass_kg * pull.norm() / GRAVITY_M_S2 } else { 0.0 };
    let hangs = mass_kg > 0.0;
    let zero_rad = if hangs { axis.dot(&pull.cross(&arm)).atan2(pull.dot(&arm)) } else { 0.0 };
    Pendulum {
        mass_kg,
        arm_m: if hangs { arm_m } else { 0.0 },
        inertia_kg_m2: (inertia_kg_m2 - mass_kg * arm_m * arm_m).max(0.0),
        zero_rad,
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Matrix3;

    use super::*;

    const DOWN: Vector3<f64> = Vector3::new(0.0, 0.0, -GRAVITY_M_S2);

    fn ball(centre_m: Point3<f64>) -> Inertia {
        Inertia { mass_kg: 2.0, centre_m, about_centre: Matrix3::identity() * 0.01 }
    }

    #[test]
    fn a_ball_on_a_level_axis_is_its_weight_at_its_distance() {
        let axis = Vector3::y_axis();
        let hanging = pendulum(&ball(Point3::new(0.0, 7.0, -0.5)), Point3::origin(), axis, DOWN);
        assert!((hanging.mass_kg - 2.0).abs() < 1e-12 && (hanging.arm_m - 0.5).abs() < 1e-12, "{hanging:?}");
        assert!((hanging.inertia_kg_m2 - 0.01).abs() < 1e-12 && hanging.zero_rad.abs() < 1e-12);
        // About y, from -z to -x is a quarter turn forwards.
        let level = pendulum(&ball(Point3::new(-0.5, 0.0, 0.0)), Point3::origin(), axis, DOWN);
        assert!((level.zero_rad - std::f64::consts::FRAC_PI_2).abs() < 1e-12, "{level:?}");
    }

    #[test]
    fn about_an_upright_axis_nothing_hangs_and_all_is_inertia() {
        let upright = pendulum(&ball(Point3::new(0.3, 0.0, 0.0)), Point3::origin(), Vector3::z_axis(), DOWN);
        assert_eq!((upright.mass_kg, upright.arm_m, upright.zero_rad), (0.0, 0.0, 0.0));
        assert!((upright.inertia_kg_m2 - (0.01 + 2.0 * 0.09)).abs() < 1e-12);
    }

    /// An axis 60 degrees from level leaves half the pull: m g l cos 60.
    #[test]
    fn a_tilted_axis_takes_a_part_of_gravity() {
        let axis = Unit::new_normalize(Vector3::new(0.0, 0.5, 0.75_f64.sqrt()));
        let tilted = pendulum(&ball(Point3::new(0.3, 0.0, 0.0)), Point3::origin(), axis, DOWN);
        assert!((tilted.mass_kg - 1.0).abs() < 1e-12, "{tilted:?}");
        assert!((tilted.inertia_kg_m2 + tilted.mass_kg * 0.09 - 0.19).abs() < 1e-12);
    }
}
