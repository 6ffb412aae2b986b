//! All friction in one contact (n = 1) against Eq. (15)-(24): what is exact, and by how much the rest is off.

#[path = "common/near.rs"]
mod near;

use bowden_model::friction_law::FrictionLaw;
use bowden_model::paper::displacement_transmission::{dead_zone_input_rad, lag_angle_rad};
use bowden_model::paper::torque_transmission::friction_torque_nm;
use bowden_model::paper::{Direction, LoopTorque, TendonPair};
use bowden_model::parameters::{PulleyParameters, SheathParameters, TendonParameters};
use bowden_model::sheath::End;
use bowden_model::transmission::{Transmission, TransmissionConfig};
use near::near;

const PULLEYS: PulleyParameters = PulleyParameters { input_radius_m: 0.012, output_radius_m: 0.02 };
const TENDON: TendonParameters =
    TendonParameters { length_m: 1.0, axial_stiffness_n: 72_900.0, pretension_n: 40.0 };
const SHEATH: SheathParameters =
    SheathParameters { wrap_angle_rad: std::f64::consts::PI, friction_coefficient: 0.12 };

/// Friction exponent a = μK of the sheath above.
const A: f64 = 0.12 * std::f64::consts::PI;

struct Bench {
    config: TransmissionConfig,
    state: Transmission,
    theta_in_rad: f64,
    theta_out_rad: f64,
}

impl Bench {
    fn new(friction: FrictionLaw, elements: usize) -> Self {
        let config = TransmissionConfig::new(PULLEYS, TENDON, Some(SHEATH), friction, elements).unwrap();
        let state = Transmission::at_rest(&config);
        Self { config, state, theta_in_rad: 0.0, theta_out_rad: 0.0 }
    }

    /// Turns the input in steps of at most 0.1 mrad; the joint follows so that it always carries `load_nm`.
    fn turn_to(&mut self, theta_in_rad: f64, load_nm: f64) {
        let travel = theta_in_rad - self.theta_in_rad;
        let steps = (travel.abs() / 1e-4).ceil().max(1.0);
        for _ in 0..steps as usize {
            self.state.turn_input(&self.config, travel / steps);
            let follow_rad = self.balance_rad(load_nm);
            self.state.turn_output(&self.config, follow_rad);
            self.theta_out_rad += follow_rad;
        }
        self.theta_in_rad = theta_in_rad;
    }

    /// Turn of the output pulley after which the cables carry `load_nm`, by bisection.
    fn balance_rad(&self, load_nm: f64) -> f64 {
        let torque_after_nm = |turn_rad: f64| {
            let mut tried = self.state;
            tried.turn_output(&self.config, turn_rad);
            tried.torque_out_nm(&self.config)
        };
        let (mut low, mut high) = (-1e-3, 1e-3);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            // The torque on the joint falls as it turns.
            if torque_after_nm(middle) > load_nm { low = middle } else { high = middle }
        }
        0.5 * (low + high)
    }

    fn lag_rad(&self) -> f64 {
        PULLEYS.input_radius_m / PULLEYS.output_radius_m * self.theta_in_rad - self.theta_out_rad
    }

    /// (r2/r1) `T_in` - `T_out`, N·m.
    fn torque_loss_nm(&self) -> f64 {
        PULLEYS.output_radius_m / PULLEYS.input_radius_m * self.state.torque_in_nm(&self.config)
            - self.state.torque_out_nm(&self.config)
    }
}

fn pair() -> TendonPair {
    TendonPair::uniform(&PULLEYS, &TENDON, &SHEATH).unwrap()
}

/// Corner points of the loop at three loads. Exact (1e-10): the difference of the torques has the form ± M of (15), (16),
/// the same at every load, and the step of the lag between + and - motion, which is the dead zone (23). Off by what one
/// place in the middle makes of the stretch lengths, psi = L (1 + Q)/2: M by tanh(a/2)/(a/2), and the elastic part of (18),
/// (19) by its inverse.
#[test]
fn lumped_corner_points() {
    let pair = pair();
    let off = (0.5 * A).tanh() / (0.5 * A);
    near("a/2 over tanh(a/2) at a = 0.377", off, 0.988_32, 5e-6);
    for load_nm in [-0.4, 0.0, 0.3] {
        let mut bench = Bench::new(FrictionLaw::Lumped, 16);
        for (direction, theta_in_rad) in
            [(Direction::Positive, 0.3), (Direction::Negative, -0.1), (Direction::Positive, 0.3)]
        {
            let name = format!("{direction:?} at {load_nm} N·m");
            bench.turn_to(theta_in_rad, load_nm);
            let friction_nm = off * friction_torque_nm(&pair);
            near(&name, bench.torque_loss_nm(), direction.sign() * friction_nm, 1e-10);
            let phi = lag_angle_rad(&pair, direction, LoopTorque::Output(load_nm));
            let friction_part = lag_angle_rad(&pair, direction, LoopTorque::Output(0.0));
            near(&name, bench.lag_rad(), friction_part + (phi - friction_part) / off, 1e-10);
        }
    }
}

/// Without load both tendons turn together, and the joint starts after exactly the travel of (23), with one contact as
/// with 16: 13.3 · 0.986 mrad. Just before it has not moved at all with one contact.
#[test]
fn dead_zone_without_load_is_that_of_the_paper() {
    let pair = pair();
    let travel_rad =
        dead_zone_input_rad(&pair, Direction::Negative, LoopTorque::Output(0.0), LoopTorque::Output(0.0));
    for (friction, elements, tolerance) in
        [(FrictionLaw::Lumped, 1, 1e-12), (FrictionLaw::Distributed, 64, 3e-5)]
    {
        let mut bench = Bench::new(friction, elements);
        bench.turn_to(0.3, 0.0);
        let stood_rad = bench.theta_out_rad;
        bench.turn_to(0.3 + 0.999 * travel_rad, 0.0);
        near("before the end of the dead zone", bench.theta_out_rad, stood_rad, tolerance);
        bench.turn_to(0.3 + travel_rad - 0.01, 0.0);
        let moved_rad = PULLEYS.input_radius_m / PULLEYS.output_radius_m * -0.01;
        near("10 mrad further", bench.theta_out_rad, stood_rad + moved_rad, tolerance);
    }
}

/// At a standing output (17) is a hold of `T_out`. With one contact it is exact to the moment at which the slacker tendon
/// turns; 64 contacts move the output torque earlier, because the front arrives, and reach the same (15).
#[test]
fn output_torque_holds_until_the_first_tendon_turns() {
    let mut lumped = Bench::new(FrictionLaw::Lumped, 1);
    lumped.turn_to(0.3, 0.3);
    let held_nm = lumped.state.torque_out_nm(&lumped.config);
    // Turning from + to -: the contact of a tendon flips when its input tension has changed from F e^{±a} to F e^{∓a} at
    // standing output F; half the length is that spring. First the one with the lower output tension, cable b.
    let [_, f2, _, f4] = lumped.state.end_tensions_n(&lumped.config);
    let flip_rad = |output_n: f64| {
        output_n * 2.0 * A.sinh() * 0.5 * TENDON.length_m / TENDON.axial_stiffness_n / PULLEYS.input_radius_m
    };
    assert!(f4 < f2);
    lumped.state.turn_input(&lumped.config, -0.9999 * flip_rad(f4));
    near("held", lumped.state.torque_out_nm(&lumped.config), held_nm, 1e-12);
    lumped.state.turn_input(&lumped.config, -1e-3 * flip_rad(f4));
    assert!(lumped.state.torque_out_nm(&lumped.config) < held_nm - 1e-6);
    assert_eq!(lumped.state.tendon(0).front(End::Input), 0);
    assert_eq!(lumped.state.tendon(1).front(End::Input), 1);
    lumped.state.turn_input(&lumped.config, 0.9009 * flip_rad(f4) - flip_rad(f2));
    assert_eq!(lumped.state.tendon(0).front(End::Input), 1);
}

/// Eq. (15)-(20) with 64 contacts: loss and lag in full slip within (a/n)²/12 = 3e-6 of the closed form; the lag against
/// the friction part of it, since load and friction may cancel.
#[test]
fn distributed_full_slip_is_that_of_the_paper() {
    let pair = pair();
    for load_nm in [-0.4, 0.0, 0.3] {
        let mut bench = Bench::new(FrictionLaw::Distributed, 64);
        for (direction, theta_in_rad) in [(Direction::Positive, 0.3), (Direction::Negative, -0.1)] {
            let name = format!("{direction:?} at {load_nm} N·m");
            bench.turn_to(theta_in_rad, load_nm);
            let want_nm = direction.sign() * friction_torque_nm(&pair);
            near(&name, bench.torque_loss_nm() / want_nm, 1.0, 4e-6);
            let phi = lag_angle_rad(&pair, direction, LoopTorque::Output(load_nm));
            let friction_part = lag_angle_rad(&pair, direction, LoopTorque::Output(0.0));
            near(&name, (bench.lag_rad() - phi) / friction_part, 0.0, 1e-5);
        }
    }
}
