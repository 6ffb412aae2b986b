//! Motor, gear, drum, two tendons, output pulley and arm, advanced together with semi-implicit Euler.
//!
//! ```text
//! rotor --gear spring--> shaft (encoder) --hub--> drum ==tendon a, b== output pulley --hub--> arm (encoder)
//! ```
//! All rotations are counted at the input pulley (rotor angle over N). Velocities follow from forces at the old
//! positions, positions from the new velocities.

use crate::bristle::ShaftBristle;
use crate::config::BenchConfig;
use crate::effects::{ActiveEffects, AsymmetricFriction, TransmissionLaw};
use crate::hand::{self, Hands};
use crate::sheath;
use crate::tendon::{Contact, Material, Tendon};

/// Angle and speed of one rotating body.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Shaft {
    pub angle_rad: f64,
    pub omega_rad_per_s: f64,
}

impl Shaft {
    #[inline]
    fn advance(&mut self, torque_nm: f64, inertia_kg_m2: f64, dt: f64) {
        self.omega_rad_per_s += dt * torque_nm / inertia_kg_m2;
        self.angle_rad += dt * self.omega_rad_per_s;
    }
}

/// Torsion spring between two bodies, with play.
#[derive(Debug, Clone, Copy)]
#[expect(clippy::struct_field_names, reason = "the shared end of the names is the unit")]
struct Coupling {
    stiffness_nm_per_rad: f64,
    damping_nm_s_per_rad: f64,
    gap_rad: f64,
}

impl Coupling {
    /// A coupling whose lighter side, of `inertia_kg_m2`, is damped to a tenth of critical.
    fn new(stiffness_nm_per_rad: f64, inertia_kg_m2: f64, gap_rad: f64) -> Self {
        let damping_nm_s_per_rad = 0.2 * (stiffness_nm_per_rad * inertia_kg_m2).sqrt();
        Self { stiffness_nm_per_rad, damping_nm_s_per_rad, gap_rad: gap_rad.max(0.0) }
    }

    /// Torque from `drive` to `driven` \[Nm\]; a flank pushes and never pulls.
    #[inline]
    fn torque_nm(&self, drive: Shaft, driven: Shaft) -> f64 {
        let twist = drive.angle_rad - driven.angle_rad;
        let rate = drive.omega_rad_per_s - driven.omega_rad_per_s;
        if self.gap_rad == 0.0 {
            return self.stiffness_nm_per_rad * twist + self.damping_nm_s_per_rad * rate;
        }
        let depth = twist - twist.clamp(-0.5 * self.gap_rad, 0.5 * self.gap_rad);
        let torque = self.stiffness_nm_per_rad * depth + self.damping_nm_s_per_rad * rate;
        if depth > 0.0 {
            torque.max(0.0)
        } else if depth < 0.0 {
            torque.min(0.0)
        } else {
            0.0
        }
    }
}

/// State that only effects need.
#[derive(Debug, Clone, Default)]
struct EffectState {
    motor_coulomb: ShaftBristle,
    motor_stribeck: ShaftBristle,
    gear_load: ShaftBristle,
    gear_carried_nm: f64,
    joint_coulomb: ShaftBristle,
    winding_rise_k: f64,
    creep_strain: [f64; 2],
}

/// The bench in motion.
#[derive(Debug, Clone)]
pub(crate) struct Plant {
    config: BenchConfig,
    effects: ActiveEffects,
    state: EffectState,
    gear: Coupling,
    drum_hub: Coupling,
    arm_hub: Coupling,
    /// Cable a and cable b.
    tendons: [Tendon; 2],
    /// Normal force of the nodes without tension \[N\]; empty without that effect.
    preload_n: Vec<f64>,
    /// Bend angle under each mass of cable a and b, as far as no effect changes it \[rad\].
    nominal_bend_rad: [Vec<f64>; 2],
    /// Share of the wrap angle under each mass \[1\].
    bend_share: Vec<f64>,
    first_bend_share: Vec<f64>,
    last_bend_share: Vec<f64>,
    current_a: f64,
    rotor: Shaft,
    input: Shaft,
    drum: Shaft,
    output: Shaft,
    arm: Shaft,
    clock_s: f64,
    steps: u64,
    clock_start_s: f64,
    /// Pretension of cable a and b over that of the configuration \[1\]; 1 unless a live bench is tampered with.
    pretension_ratio: [f64; 2],
    /// Torque on the arm from outside, towards +θ \[Nm\].
    outer_nm: f64,
    hands: Hands,
}

impl Plant {
    /// A bench at rest at theta = 0, at time `clock_start_s` of the effects' clock.
    pub(crate) fn new(config: &BenchConfig, effects: ActiveEffects, clock_start_s: f64) -> Self {
        let tendon = Tendon::new(config);
        let nominal_bend_rad = tendon.bend_rad.clone();
        let single = |bend| sheath::single_bend(config.nodes, bend);
        let first_bend_share = config.bends.first().map_or_else(Vec::new, single);
        let last_bend_share = config.bends.last().map_or_else(Vec::new, single);
        let preload_n = effects
            .bending_friction
            .as_ref()
            .map_or_else(Vec::new, |law| law.preload_n(&nominal_bend_rad, config.friction_coefficient));
        let elastic = config.pretension_n / config.axial_stiffness_n;
        let strain =
            effects.tendon_creep.as_ref().map_or(0.0, |law| law.strain_after(clock_start_s, elastic));
        let state = EffectState { creep_strain: [strain; 2], ..EffectState::default() };
        let gap = |gap: Option<f64>| gap.unwrap_or(0.0);
        let mut plant = Self {
            gear: Coupling::new(
                config.gear_stiffness_nm_per_rad,
                config.input_shaft_inertia_kg_m2,
                gap(effects.gear_backlash.as_ref().map(|e| e.gap_rad)),
            ),
            drum_hub: Coupling::new(
                config.hub_stiffness_nm_per_rad,
                config.input_shaft_inertia_kg_m2,
                gap(effects.transmission_backlash.as_ref().map(|e| e.gap_rad)),
            ),
            arm_hub: Coupling::new(
                config.hub_stiffness_nm_per_rad,
                config.output_pulley_inertia_kg_m2,
                gap(effects.joint_backlash.as_ref().map(|e| e.gap_rad)),
            ),
            config: config.clone(),
            effects,
            state,
            tendons: [tendon.clone(), tendon],
            preload_n,
            nominal_bend_rad: [nominal_bend_rad.clone(), nominal_bend_rad],
            bend_share: sheath::node_bends(config.nodes, &config.bends),
            first_bend_share,
            last_bend_share,
            current_a: 0.0,
            rotor: Shaft::default(),
            input: Shaft::default(),
            drum: Shaft::default(),
            output: Shaft::default(),
            arm: Shaft::default(),
            clock_s: clock_start_s,
            steps: 0,
            clock_start_s,
            pretension_ratio: [1.0; 2],
            outer_nm: 0.0,
            hands: Hands::default(),
        };
        plant.update_tensions();
        plant
    }

    /// Motor current \[A\].
    pub(crate) fn current_a(&self) -> f64 {
        self.current_a
    }

    /// Rotor, counted at the input pulley.
    pub(crate) fn rotor(&self) -> Shaft {
        self.rotor
    }

    /// Shaft with the input encoder.
    pub(crate) fn input(&self) -> Shaft {
        self.input
    }

    /// Arm, with the joint encoder.
    pub(crate) fn arm(&self) -> Shaft {
        self.arm
    }

    /// Tensions f1, f2, f3, f4 \[N\].
    pub(crate) fn tensions_n(&self) -> [f64; 4] {
        let [a, b] = &self.tendons;
        [a.input_n(), a.output_n(), b.input_n(), b.output_n()]
    }

    /// Sets the supply of the bridge \[V\].
    pub(crate) fn set_supply_v(&mut self, supply_v: f64) {
        self.config.supply_v = supply_v;
    }

    /// Sets the pretension of cable a and b over that of the configuration \[1\].
    pub(crate) fn set_pretension_ratio(&mut self, ratio: [f64; 2]) {
        self.pretension_ratio = ratio;
    }

    /// Sets the torque on the arm from outside, towards +θ \[Nm\].
    pub(crate) fn set_outer_torque_nm(&mut self, torque_nm: f64) {
        self.outer_nm = torque_nm;
    }

    /// What hands do.
    pub(crate) fn hands(&mut self) -> &mut Hands {
        &mut self.hands
    }

    /// Takes the tendons off their pulleys, or fits them: all shafts then stand at angle zero, as on a bench that was just built.
    pub(crate) fn set_tendons_fitted(&mut self, fitted: bool) {
        if fitted {
            let tendon = Tendon::new(&self.config);
            for (place, bend_rad) in self.tendons.iter_mut().zip(&self.nominal_bend_rad) {
                *place = tendon.clone();
                place.bend_rad.clone_from(bend_rad);
            }
            (self.rotor, self.input, self.drum) = Default::default();
            (self.output, self.arm) = Default::default();
            self.current_a = 0.0;
        } else {
            for tendon in &mut self.tendons {
                tendon.tension_n.fill(0.0);
            }
        }
        self.hands = Hands { tendons_off: !fitted, ..Hands::default() };
    }

    /// Sets the wrap angle K of the sheaths of cable a and b \[rad\]; each bend keeps its share.
    pub(crate) fn set_wrap_angle_rad(&mut self, wrap_angle_rad: [f64; 2]) {
        for ((tendon, nominal), wrap) in
            self.tendons.iter_mut().zip(&mut self.nominal_bend_rad).zip(wrap_angle_rad)
        {
            for (bend, share) in nominal.iter_mut().zip(&self.bend_share) {
                *bend = share * wrap;
            }
            tendon.bend_rad.clone_from(nominal);
        }
    }

    /// One step under a constant duty.
    pub(crate) fn step(&mut self, duty: f64) {
        self.step_bridge(Some(duty));
    }

    /// One step with all switches of the bridge open.
    pub(crate) fn step_open(&mut self) {
        self.step_bridge(None);
    }

    fn step_bridge(&mut self, duty: Option<f64>) {
        let dt = self.config.step_s;
        if !self.hands.tendons_off {
            self.update_bends();
            self.update_tensions();
        }
        let [input_radius_m, output_radius_m] = self.radii_m();
        let input_nm = (self.tendons[0].input_n() - self.tendons[1].input_n()) * input_radius_m;
        let output_nm = (self.tendons[0].output_n() - self.tendons[1].output_n()) * output_radius_m;
        match duty {
            Some(duty) => self.advance_motor(duty, dt),
            None => self.advance_motor_open(dt),
        }
        let drum_nm = self.drum_hub.torque_nm(self.input, self.drum);
        let gear_nm = self.advance_rotor_and_shaft(drum_nm, dt);
        if let Some(law) = &self.effects.gear_load_friction {
            // Applied on the rotor after its step: the friction of a tooth reacts on the motor side.
            let state = &mut self.state;
            let friction = law.torque_nm(
                &mut state.gear_load,
                &mut state.gear_carried_nm,
                gear_nm,
                self.rotor.omega_rad_per_s,
                dt,
            );
            self.rotor.omega_rad_per_s -= dt * friction / self.rotor_inertia_kg_m2();
        }
        let arm_nm = self.arm_hub.torque_nm(self.output, self.arm);
        self.drum.advance(drum_nm - input_nm, self.config.input_drum_inertia_kg_m2, dt);
        self.output.advance(output_nm - arm_nm, self.config.output_pulley_inertia_kg_m2, dt);
        self.advance_arm(arm_nm, dt);
        if !self.hands.tendons_off {
            self.advance_tendons(dt);
        }
        self.steps += 1;
        self.clock_s = self.clock_start_s + self.steps as f64 * dt;
    }

    /// Radii of the pulleys where they stand.
    fn radii_m(&self) -> [f64; 2] {
        let law = self.effects.unlisted_transmission.as_ref();
        let ratio = |kind, shaft: Shaft| law.map_or(1.0, |law| law.radius_ratio(kind, shaft.angle_rad));
        [
            self.config.input_radius_m * ratio(TransmissionLaw::InputLobes, self.drum),
            self.config.output_radius_m * ratio(TransmissionLaw::OutputLobes, self.output),
        ]
    }

    fn rotor_inertia_kg_m2(&self) -> f64 {
        self.config.rotor_inertia_kg_m2 * self.config.gear_ratio * self.config.gear_ratio
    }

    fn torque_constant_at_pulley(&self) -> f64 {
        let swing = self.effects.torque_constant_swing.as_ref().map_or(1.0, |law| law.factor(self.clock_s));
        swing * self.config.torque_constant_nm_per_a * self.config.gear_ratio
    }

    /// `L di/dt = V − R i − kt N omega`.
    fn advance_motor(&mut self, duty: f64, dt: f64) {
        let duty = self.effects.drive_dead_zone.as_ref().map_or(duty, |law| law.effective_duty(duty));
        let mut resistance = self.config.resistance_ohm;
        if let Some(law) = &self.effects.winding_heating {
            let cold_loss_w = self.current_a * self.current_a * resistance;
            resistance *= law.resistance_factor(&mut self.state.winding_rise_k, cold_loss_w, dt);
        }
        let back_emf = self.torque_constant_at_pulley() * self.rotor.omega_rad_per_s;
        let voltage = duty * self.config.supply_v - resistance * self.current_a - back_emf;
        self.current_a += dt / self.config.inductance_h * voltage;
    }

    /// Bridge open: the current flows on through the diodes, against the supply, and stops at zero.
    ///
    /// The back-emf of this motor stays below the supply, so no diode conducts again.
    fn advance_motor_open(&mut self, dt: f64) {
        if self.current_a == 0.0 {
            return;
        }
        let back_emf = self.torque_constant_at_pulley() * self.rotor.omega_rad_per_s;
        let sign = self.current_a.signum();
        let voltage = -sign * self.config.supply_v - self.config.resistance_ohm * self.current_a - back_emf;
        let next = self.current_a + dt / self.config.inductance_h * voltage;
        self.current_a = if next * sign > 0.0 { next } else { 0.0 };
    }

    /// Rotor and input shaft; returns the torque that the gear carries.
    fn advance_rotor_and_shaft(&mut self, drum_nm: f64, dt: f64) -> f64 {
        let gear_nm = self.gear.torque_nm(self.rotor, self.input);
        let mut rotor_nm = self.torque_constant_at_pulley() * self.current_a - gear_nm;
        if let Some(law) = &self.effects.motor_coulomb_friction {
            rotor_nm -= law.torque_nm(&mut self.state.motor_coulomb, self.rotor.omega_rad_per_s, dt);
        }
        if let Some(law) = &self.effects.motor_stribeck_friction {
            rotor_nm -= law.torque_nm(&mut self.state.motor_stribeck, self.rotor.omega_rad_per_s, dt);
        }
        if let Some(law) = &self.effects.motor_cogging {
            rotor_nm += law.torque_nm(self.rotor.angle_rad);
        }
        if let Some(law) = &self.effects.unlisted_motor {
            rotor_nm += law.torque_nm(self.rotor.angle_rad, self.rotor.omega_rad_per_s, self.clock_s);
        }
        let extra =
            self.effects.motor_viscous_friction.as_ref().map_or(0.0, |law| law.coefficient_nm_s_per_rad);
        let viscous_nm = (self.config.motor_viscous_nm_s_per_rad + extra) * self.input.omega_rad_per_s;
        let inertia = self.rotor_inertia_kg_m2();
        self.rotor.advance(rotor_nm, inertia, dt);
        let hand_nm = hand::torque_nm(self.hands.input_rad, self.input);
        self.input.advance(
            gear_nm - drum_nm - viscous_nm + hand_nm,
            self.config.input_shaft_inertia_kg_m2,
            dt,
        );
        gear_nm
    }

    fn advance_arm(&mut self, hub_nm: f64, dt: f64) {
        let effects = &self.effects;
        let arm = self.arm;
        let extra_kg = effects.payload_change.as_ref().map_or(0.0, |law| law.extra_kg(self.clock_s));
        let lever_m = self.config.arm_m;
        let inertia = self.config.arm_inertia_kg_m2() + extra_kg * lever_m * lever_m;
        let weight_n = (self.config.mass_kg + extra_kg) * self.config.gravity_m_per_s2;
        let extra_viscous =
            effects.joint_viscous_friction.as_ref().map_or(0.0, |law| law.coefficient_nm_s_per_rad);
        let viscous = self.config.joint_viscous_nm_s_per_rad + extra_viscous;
        let mut torque = hub_nm - weight_n * lever_m * arm.angle_rad.sin() - viscous * arm.omega_rad_per_s;
        torque += self.outer_nm;
        torque += hand::torque_nm(self.hands.arm_rad, arm);
        if let Some(law) = &effects.joint_coulomb_friction {
            torque -= law.torque_nm(&mut self.state.joint_coulomb, arm.omega_rad_per_s, dt);
        }
        if let Some(law) = &effects.joint_spring {
            torque += law.torque_nm(arm.angle_rad);
        }
        if let Some(law) = &effects.end_stop_contact {
            torque += law.torque_nm(arm.angle_rad, arm.omega_rad_per_s);
        }
        if let Some(law) = &effects.joint_magnetic_detent {
            torque += law.torque_nm(arm.angle_rad);
        }
        if let Some(law) = &effects.joint_torque_ripple {
            torque += law.torque_nm(arm.angle_rad);
        }
        if let Some(law) = &effects.unlisted_joint {
            torque += law.torque_nm(arm.angle_rad, arm.omega_rad_per_s, self.clock_s);
        }
        self.arm.advance(torque, inertia, dt);
    }

    /// Bend angles of this step, where an effect changes them.
    fn update_bends(&mut self) {
        let pose = &self.effects.wrap_angle_varies_with_pose;
        let disturbed = &self.effects.wrap_angle_disturbed;
        if pose.is_none() && disturbed.is_none() {
            return;
        }
        let last_rad = pose.as_ref().map_or(0.0, |law| law.change_rad(self.arm.angle_rad));
        let first_rad = disturbed.as_ref().map_or(0.0, |law| law.change_rad(self.clock_s));
        for (tendon, nominal) in self.tendons.iter_mut().zip(&self.nominal_bend_rad) {
            let shares = self.first_bend_share.iter().zip(&self.last_bend_share);
            for ((bend, nominal), (first, last)) in tendon.bend_rad.iter_mut().zip(nominal).zip(shares) {
                *bend = (nominal + first_rad * first + last_rad * last).max(0.0);
            }
        }
    }

    fn update_tensions(&mut self) {
        let loss = self.effects.pretension_loss.as_ref().map_or(1.0, |law| law.factor(self.clock_s));
        for (index, tendon) in self.tendons.iter_mut().enumerate() {
            let sign = if index == 0 { -1.0 } else { 1.0 };
            let law = self.effects.unlisted_transmission.as_ref();
            let end = |kind, shaft: Shaft, radius_m: f64| {
                let plain = (shaft.angle_rad, shaft.omega_rad_per_s);
                let (angle, omega) = law.map_or(plain, |law| law.wound(kind, plain.0, plain.1));
                (sign * radius_m * angle, sign * radius_m * omega)
            };
            tendon.set_ends(
                end(TransmissionLaw::InputLobes, self.drum, self.config.input_radius_m),
                end(TransmissionLaw::OutputLobes, self.output, self.config.output_radius_m),
            );
            let material = Material {
                pretension_n: self.pretension_ratio[index] * (loss * self.config.pretension_n),
                creep_m: self.state.creep_strain[index] * tendon.element_m(),
                stiffening: self.effects.tendon_stiffening.as_ref(),
                slack: self.effects.tendon_slack.as_ref(),
            };
            tendon.update_tensions(&material);
        }
    }

    fn advance_tendons(&mut self, dt: f64) {
        let effects = &self.effects;
        let drift = effects.friction_drift.as_ref().map_or(1.0, |law| law.factor(self.clock_s));
        let sides = effects.asymmetric_friction.as_ref().map_or([1.0; 2], AsymmetricFriction::factors);
        let soft = effects.presliding_compliance.as_ref().map_or(1.0, |law| law.stiffness_ratio);
        for (index, tendon) in self.tendons.iter_mut().enumerate() {
            let tension_ratio = 0.5 * (tendon.input_n() + tendon.output_n()) / self.config.pretension_n;
            let varied = effects
                .unlisted_transmission
                .as_ref()
                .map_or(1.0, |law| law.friction_factor(self.input.angle_rad, tension_ratio, self.clock_s));
            let contact = Contact {
                friction_coefficient: self.config.friction_coefficient * drift * sides[index] * varied,
                bristle_stiffness_per_m: self.config.bristle_stiffness_per_m * soft,
                stribeck: effects.sheath_stribeck_friction.as_ref(),
                viscous: effects.sheath_viscous_friction.as_ref(),
                preload_n: &self.preload_n,
                spot: if index == 0 { effects.sheath_kink_spot.as_ref() } else { None },
            };
            if let Some(law) = &effects.tendon_creep {
                let mean_n = 0.5 * (tendon.input_n() + tendon.output_n());
                let strain = &mut self.state.creep_strain[index];
                *strain = law.advance(*strain, mean_n / self.config.axial_stiffness_n, dt);
            }
            tendon.advance(&contact, dt);
        }
    }
}

#[cfg(test)]
#[path = "plant_tests.rs"]
mod tests;
