//! A bench joint for whole-plant tests.

use bowden_model::drive::BridgeInput;
use bowden_model::effect::ActiveEffect;
use bowden_model::effect_set::EffectSet;
use bowden_model::friction_law::FrictionLaw;
use bowden_model::load::GRAVITY_M_S2;
use bowden_model::parameters::{
    JointParameters, LoadParameters, PulleyParameters, SensorParameters, SheathParameters, TendonParameters,
};
use bowden_model::plant::{InputBoundary, OutputBoundary, Plant, PlantConfig, StepInput};
use bowden_model::transmission::Outside;

pub const RADIUS_M: f64 = 0.015;
pub const MASS_KG: f64 = 1.5;
pub const ARM_M: f64 = 0.03;
pub const PRETENSION_N: f64 = 60.0;
pub const STIFFNESS_N_PER_M: f64 = 72_900.0;
/// Weight's moment m g l, N·m.
pub const WEIGHT_NM: f64 = MASS_KG * GRAVITY_M_S2 * ARM_M;

/// Inertia of the arm, kg·m².
pub const INERTIA_KG_M2: f64 = MASS_KG * ARM_M * ARM_M;

/// The bench: K = π, with the given friction coefficient, and no motor.
pub fn joint(friction_coefficient: f64) -> JointParameters {
    JointParameters {
        motor: None,
        pulleys: Some(PulleyParameters { input_radius_m: RADIUS_M, output_radius_m: RADIUS_M }),
        tendon: Some(TendonParameters {
            length_m: 1.0,
            axial_stiffness_n: STIFFNESS_N_PER_M,
            pretension_n: PRETENSION_N,
        }),
        sheath: Some(SheathParameters { wrap_angle_rad: std::f64::consts::PI, friction_coefficient }),
        load: Some(LoadParameters {
            mass_kg: MASS_KG,
            arm_m: ARM_M,
            inertia_kg_m2: 0.0,
            viscous_nm_s_per_rad: 0.004,
        }),
        sensors: SensorParameters::default(),
        friction: FrictionLaw::Distributed,
    }
}

/// Nothing from outside.
pub const IDLE: StepInput = StepInput {
    bridge: BridgeInput { duty: 0.0, bus_v: 24.0, enabled: true },
    theta_in_rad: 0.0,
    theta_out_rad: 0.0,
    input_torque_nm: 0.0,
    loose_pulley: Outside::NOTHING,
    external_torque_nm: 0.0,
};

/// A plant with its configuration and step.
pub struct Run {
    pub config: PlantConfig,
    pub plant: Plant,
    pub dt_s: f64,
}

impl Run {
    /// At rest at zero angles, 16 contacts.
    pub fn new(
        parameters: JointParameters,
        effects: &[ActiveEffect],
        (input, output): (InputBoundary, OutputBoundary),
        dt_s: f64,
    ) -> Self {
        let effects = EffectSet::from_slice(effects).unwrap();
        let config = PlantConfig::new(parameters, 16, effects, input, output).unwrap();
        Self { plant: Plant::at_rest(&config, 0.0, 0.0), config, dt_s }
    }

    /// Steps until `t_s`; `input` sees the end of each step.
    pub fn until(&mut self, t_s: f64, mut input: impl FnMut(f64) -> StepInput) {
        let steps = ((t_s - self.plant.t_s()) / self.dt_s).round();
        for _ in 0..steps as usize {
            let now = input(self.plant.t_s() + self.dt_s);
            self.plant.step(&self.config, &now, self.dt_s);
        }
    }

    /// F1 to F4, N.
    pub fn tensions_n(&self) -> [f64; 4] {
        self.plant.end_tensions_n(&self.config)
    }
}
