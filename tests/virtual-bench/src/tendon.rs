//! One tendon in its sheath: point masses, springs between them, bristle contact on each mass.
//!
//! Displacement `u` is positive towards the joint end. Element e joins mass e−1 and mass e (the ends are pulleys):
//! `T_e = F0 + k·(u_{e+1} − u_e) + c·(v_{e+1} − v_e)`, `k = EA/h`, `c = beta·k`. Mass i feels
//! `m·a = T_{i+1} − T_i − F_i` with the bristle force on the normal force `N_i = |T_i + T_{i+1}|/2 · dphi_i`.
//! Nothing here knows the capstan equation. It emerges: in full slip the mean tension gives a ratio per node of
//! `(1 + x/2)/(1 − x/2)`, `x = mu·dphi`, that is `e^x·(1 + x³/12)`; for ten nodes at mu·K = 0.38 the product is
//! within 1e-3 of `e^{mu·K}`.

use crate::bristle;
use crate::config::BenchConfig;
use crate::effects::{
    KinkSpot, SheathStribeckFriction, SheathViscousFriction, TendonSlack, TendonStiffening,
};
use crate::sheath;

/// What the sheath does to a tendon in this step, beyond its geometry.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Contact<'a> {
    /// Coulomb friction coefficient of this sheath now \[1\].
    pub friction_coefficient: f64,
    /// Stiffness sigma0 over normal force \[1/m\].
    pub bristle_stiffness_per_m: f64,
    pub stribeck: Option<&'a SheathStribeckFriction>,
    pub viscous: Option<&'a SheathViscousFriction>,
    /// Normal force a node has without tension \[N\]; empty if none.
    pub preload_n: &'a [f64],
    pub spot: Option<&'a KinkSpot>,
}

/// How the tendon itself differs from linear springs in this step.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Material<'a> {
    /// Tension of the unstretched state now \[N\].
    pub pretension_n: f64,
    /// Creep elongation of one element \[m\].
    pub creep_m: f64,
    pub stiffening: Option<&'a TendonStiffening>,
    pub slack: Option<&'a TendonSlack>,
}

/// A tendon's mesh and state.
#[derive(Debug, Clone)]
pub(crate) struct Tendon {
    /// Displacements \[m\]: input end, masses, output end.
    pub u_m: Vec<f64>,
    /// Velocities \[m/s\] in the same order.
    pub v_m_per_s: Vec<f64>,
    /// Element tensions \[N\]; the first is at the motor, the last at the joint.
    pub tension_n: Vec<f64>,
    /// Bend angle under each mass \[rad\].
    pub bend_rad: Vec<f64>,
    bristle_m: Vec<f64>,
    element_n_per_m: f64,
    element_ns_per_m: f64,
    mass_kg: f64,
    bristle_damping_s_per_m: f64,
    contact_viscosity_s_per_m: f64,
    element_m: f64,
}

impl Tendon {
    /// A tendon at rest under its pretension.
    pub(crate) fn new(config: &BenchConfig) -> Self {
        let nodes = config.nodes;
        let element_m = config.element_m();
        let element_n_per_m = config.axial_stiffness_n / element_m;
        let bend_rad = sheath::node_bends(nodes, &config.bends)
            .iter()
            .map(|share| share * config.wrap_angle_rad)
            .collect();
        Self {
            u_m: vec![0.0; nodes + 2],
            v_m_per_s: vec![0.0; nodes + 2],
            tension_n: vec![config.pretension_n; nodes + 1],
            bend_rad,
            bristle_m: vec![0.0; nodes],
            element_n_per_m,
            element_ns_per_m: config.tendon_damping_s * element_n_per_m,
            mass_kg: config.tendon_mass_kg_per_m * element_m,
            bristle_damping_s_per_m: config.bristle_damping_s_per_m,
            contact_viscosity_s_per_m: config.contact_viscosity_s_per_m,
            element_m,
        }
    }

    /// Tension at the motor end \[N\].
    pub(crate) fn input_n(&self) -> f64 {
        self.tension_n[0]
    }

    /// Tension at the joint end \[N\].
    pub(crate) fn output_n(&self) -> f64 {
        self.tension_n[self.tension_n.len() - 1]
    }

    /// Length of one element \[m\].
    pub(crate) fn element_m(&self) -> f64 {
        self.element_m
    }

    /// Moves the two ends: displacement \[m\] and velocity \[m/s\] at the drum and at the output pulley.
    pub(crate) fn set_ends(&mut self, input: (f64, f64), output: (f64, f64)) {
        let last = self.u_m.len() - 1;
        self.u_m[0] = input.0;
        self.v_m_per_s[0] = input.1;
        self.u_m[last] = output.0;
        self.v_m_per_s[last] = output.1;
    }

    /// Tensions of all elements for the present positions.
    pub(crate) fn update_tensions(&mut self, material: &Material) {
        let (k, c) = (self.element_n_per_m, self.element_ns_per_m);
        let rest = material.pretension_n - k * material.creep_m;
        let ends = self.u_m.windows(2).zip(self.v_m_per_s.windows(2));
        for (tension, (u, v)) in self.tension_n.iter_mut().zip(ends) {
            *tension = rest + k * (u[1] - u[0]) + c * (v[1] - v[0]);
        }
        if let Some(stiffening) = material.stiffening {
            for (tension, u) in self.tension_n.iter_mut().zip(self.u_m.windows(2)) {
                *tension += stiffening.extra_n(k, u[1] - u[0] - material.creep_m);
            }
        }
        if let Some(slack) = material.slack {
            for tension in &mut self.tension_n {
                *tension = slack.tension_n(*tension);
            }
        }
    }

    /// Moves the masses by one step under the present tensions.
    pub(crate) fn advance(&mut self, contact: &Contact, dt: f64) {
        let plain = contact.stribeck.is_none()
            && contact.viscous.is_none()
            && contact.spot.is_none()
            && contact.preload_n.is_empty();
        if plain {
            self.advance_masses::<false>(contact, dt);
        } else {
            self.advance_masses::<true>(contact, dt);
        }
    }

    /// `EFFECTS` compiles the same loop with and without the look at each node's effects.
    fn advance_masses<const EFFECTS: bool>(&mut self, contact: &Contact, dt: f64) {
        let sigma0 = contact.bristle_stiffness_per_m;
        let sigma1_over_dt = self.bristle_damping_s_per_m / dt;
        let sigma2 = self.contact_viscosity_s_per_m;
        let dt_over_mass = dt / self.mass_kg;
        let nodes = self.bend_rad.len();
        let tension = &self.tension_n[..=nodes];
        let u = &mut self.u_m[1..=nodes];
        let v = &mut self.v_m_per_s[1..=nodes];
        let z = &mut self.bristle_m[..nodes];
        for i in 0..nodes {
            let velocity = v[i];
            let mut normal = 0.5 * (tension[i] + tension[i + 1]).abs() * self.bend_rad[i];
            let mut level = contact.friction_coefficient;
            let mut viscous = 0.0;
            if EFFECTS {
                if let Some(preload) = contact.preload_n.get(i) {
                    normal += preload;
                }
                if let Some(spot) = contact.spot {
                    normal += spot.normal_n(i, nodes, u[i]);
                }
                if let Some(stribeck) = contact.stribeck {
                    level *= stribeck.factor(velocity);
                }
                if let Some(law) = contact.viscous {
                    viscous = law.force_n(velocity) / nodes as f64;
                }
            }
            let next = bristle::advance(z[i], velocity, sigma0, level, dt);
            let force =
                normal * (sigma0 * next + sigma1_over_dt * (next - z[i]) + sigma2 * velocity) + viscous;
            z[i] = next;
            v[i] = velocity + dt_over_mass * (tension[i + 1] - tension[i] - force);
            u[i] += dt * v[i];
        }
    }

    /// Kinetic, elastic and bristle energy \[J\], for linear elements.
    #[cfg(test)]
    pub(crate) fn energy_j(&self, material: &Material, contact: &Contact) -> f64 {
        let nodes = self.bend_rad.len();
        let kinetic: f64 = self.v_m_per_s[1..=nodes].iter().map(|v| 0.5 * self.mass_kg * v * v).sum();
        let elastic: f64 = self
            .u_m
            .windows(2)
            .map(|u| {
                let e = u[1] - u[0];
                (material.pretension_n + 0.5 * self.element_n_per_m * e) * e
            })
            .sum();
        let bristles: f64 = (0..nodes)
            .map(|i| {
                let normal = 0.5 * (self.tension_n[i] + self.tension_n[i + 1]).abs() * self.bend_rad[i];
                0.5 * normal * contact.bristle_stiffness_per_m * self.bristle_m[i].powi(2)
            })
            .sum();
        kinetic + elastic + bristles
    }
}

#[cfg(test)]
#[path = "tendon_tests.rs"]
mod tests;
