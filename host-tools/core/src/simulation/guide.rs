//! The torque that keeps a simulated motor at its recorded angle.
//!
//! With tendons it is a spring, in proportion to theirs: friction and the tendons themselves damp what it would make swing. A joint without
//! tendons is held by a spring with a lead, as by a proportional-derivative controller with a bounded gain at high frequencies,
//!
//! ```text
//! T = -k (e + a (e - y)),   h dy/dt = e - y,   k = J w²,   a h w = 2
//! ```
//!
//! of the angle's error `e`: critically damped at the frequency `w` with the inertia `J` that the rig states. The recorded speed does not enter:
//! what an encoder leaves open of it would be more torque than friction is.

use std::f64::consts::TAU;

use crate::joint_model::JointModel;

/// Stiffness of the guide in the first pass over that of both tendons at the input pulley, `2 EA/L r1²`: so stiff that the
/// angle follows.
const STIFF_GUIDE: f64 = 4.5;

/// The same in the second pass.
const SOFT_GUIDE: f64 = 1.5;

/// The same on a pulley inside a play of the gear: that of the tendons or less, so that tensions there are those of a pulley that nothing
/// turns.
const PLAY_GUIDE: f64 = 0.6;

/// Frequency at which a joint without tendons is held, Hz: so low that the guide takes away little but the drift. What the recorded torque
/// contains that never reached the joint biases a fit the more the firmer it is held, and a joint that hardly is drifts like a free one.
const HELD_HZ: f64 = 0.7;

/// Gain of the lead.
pub(super) const LEAD: f64 = 8.0;

/// Half width of the zero-phase filter of the guiding torque, s.
pub(super) const FILTER_S: f64 = 0.03;

/// Part of the angle's standard deviation within which the guide does not pull.
pub(super) const DEAD_BAND: f64 = 0.3;

/// What holds the simulated angle to the recorded one.
#[derive(Clone, Copy)]
pub(super) struct Guide<'a> {
    pub stiffness_nm_per_rad: f64,
    /// Time constant of the lead, s; `None` for a spring alone.
    pub lead_s: Option<f64>,
    /// Torque at each sample that needs no angle to be left for it; none where it is empty.
    pub ahead_nm: &'a [f64],
    /// What these torques are divided by where they act, see [`Hold::shown`].
    pub shown: f64,
}

impl Guide<'_> {
    /// Holds nothing.
    pub const NONE: Self = Self { stiffness_nm_per_rad: 0.0, lead_s: None, ahead_nm: &[], shown: 1.0 };
}

/// How firmly the joint is held, by the model that an input was prepared for: a fit moves the model, and the guide stays the same.
#[derive(Clone, Copy, Debug)]
pub(super) struct Hold {
    /// Stiffness in the first and in the second pass, N·m/rad; a joint without tendons has one pass.
    passes_nm_per_rad: [f64; 2],
    lead_s: Option<f64>,
    /// Stiffness on a pulley inside a play of the gear, N·m/rad.
    pub loose_nm_per_rad: f64,
    /// Inertia of a joint without tendons, kg·m².
    direct_kg_m2: Option<f64>,
    /// Torque at the input pulley for a current, N·m/A, of a joint with tendons whose tensions no recording holds.
    motor_nm_per_a: Option<f64>,
}

/// Torque at the input pulley for a current, N·m/A.
fn pulley_nm_per_a(model: &JointModel) -> Option<f64> {
    model
        .parameters
        .motor
        .map(|motor| motor.torque_constant_nm_per_a * motor.gear_ratio)
        .filter(|nm_per_a| *nm_per_a > 0.0)
}

impl Hold {
    /// Of `model`.
    pub fn of(model: &JointModel) -> Self {
        let parameters = &model.parameters;
        if let Some((tendon, pulleys)) = parameters.tendon.zip(parameters.pulleys) {
            // `2 EA/L r1²`.
            let cables_nm_per_rad = 2.0 * tendon.axial_stiffness_n / tendon.length_m
                * pulleys.input_radius_m
                * pulleys.input_radius_m;
            return Self {
                passes_nm_per_rad: [STIFF_GUIDE * cables_nm_per_rad, SOFT_GUIDE * cables_nm_per_rad],
                lead_s: None,
                loose_nm_per_rad: PLAY_GUIDE * cables_nm_per_rad,
                direct_kg_m2: None,
                motor_nm_per_a: pulley_nm_per_a(model).filter(|_| model.tensions_unseen()),
            };
        }
        let inertia_kg_m2 = model.direct_inertia_kg_m2();
        let held_rad_s = TAU * HELD_HZ;
        Self {
            passes_nm_per_rad: [inertia_kg_m2 * held_rad_s * held_rad_s; 2],
            lead_s: Some(2.0 / (LEAD * held_rad_s)),
            loose_nm_per_rad: 0.0,
            direct_kg_m2: Some(inertia_kg_m2).filter(|inertia_kg_m2| *inertia_kg_m2 > 0.0),
            motor_nm_per_a: None,
        }
    }

    /// Guide of the first pass of `model` with tendons.
    pub fn first_pass(&self, model: &JointModel) -> Guide<'static> {
        self.guide(self.passes_nm_per_rad[0], &[], self.shown(model))
    }

    /// Guide of the second pass of `model` with tendons, beside a torque that is applied ahead.
    pub fn second_pass<'a>(&self, model: &JointModel, ahead_nm: &'a [f64]) -> Guide<'a> {
        self.guide(self.passes_nm_per_rad[1], ahead_nm, self.shown(model))
    }

    /// Guide of the only pass of `model` without tendons.
    pub fn only_pass(&self, model: &JointModel) -> Guide<'static> {
        self.guide(self.passes_nm_per_rad[1], &[], self.shown(model))
    }

    /// What the torques of the guide are divided by where they act on `model`.
    ///
    /// Where neither a torque nor a tension is recorded a motor half as strong, with half of all inertia, stiffness and friction, moves alike and
    /// is guided by half the torque, and so is one whose friction takes half of its torque. Without tendons what is compared is therefore
    /// an acceleration, with them a current, stated as the torque that it takes with the inertia or the motor of the model that the input was
    /// prepared for. A torque would be made small by a light joint or a weak motor.
    fn shown(&self, model: &JointModel) -> f64 {
        let [before, now] = match (self.direct_kg_m2, self.motor_nm_per_a) {
            (Some(kg_m2), _) => [Some(kg_m2), Some(model.direct_inertia_kg_m2()).filter(|now| *now > 0.0)],
            (None, before) => [before, pulley_nm_per_a(model)],
        };
        before.zip(now).map_or(1.0, |(before, now)| before / now)
    }

    fn guide<'a>(&self, stiffness_nm_per_rad: f64, ahead_nm: &'a [f64], shown: f64) -> Guide<'a> {
        Guide { stiffness_nm_per_rad, lead_s: self.lead_s, ahead_nm, shown }
    }

    /// Torque, N·m, with which the spring answers an angle of `rad`.
    pub fn answer_nm(&self, rad: f64) -> f64 {
        self.passes_nm_per_rad[1] * rad
    }
}

#[cfg(test)]
mod tests {
    use bowden_model::channel::Channel;
    use bowden_model::effect::ActiveEffect;
    use bowden_model::effects::find;

    use crate::joint_model::{Drive, JointModel};
    use crate::simulation::{ReplayInput, replay};
    use crate::test_bench;

    fn rms(values: &[f64]) -> f64 {
        (values.iter().map(|value| value * value).sum::<f64>() / values.len() as f64).sqrt()
    }

    fn friction(torque_nm: f64) -> ActiveEffect {
        ActiveEffect::with_defaults(find("joint_coulomb_friction").unwrap()).with("torque_nm", torque_nm)
    }

    /// The duty is 0.47 N·m, root mean square. A joint that moves as its model does is guided by less than a hundredth of that. One with dry
    /// friction of 0.1 N·m that the model lacks is guided by it, against the motion.
    #[test]
    fn a_joint_without_tendons_is_guided_by_what_its_model_lacks() {
        let guided = |effects: &[ActiveEffect]| {
            let recording = test_bench::turned(6000, effects);
            let model =
                JointModel::from_rig(&test_bench::direct_rig(), &recording).unwrap().guided(&recording);
            assert_eq!(model.drive().unwrap(), Drive::GuidedMotor);
            let input = ReplayInput::new(&model, &recording).unwrap();
            (replay(&model, &input).unwrap(), input.motion().unwrap().clone())
        };
        let (right, _) = guided(&[]);
        assert!(rms(&right.guide_nm) < 0.0047, "{}", rms(&right.guide_nm));
        let (lacking, motion) = guided(&[friction(0.1)]);
        let turning = lacking.guide_nm.iter().zip(&motion.omega_rad_s).filter(|(_, omega)| omega.abs() > 0.5);
        let against: Vec<f64> = turning.map(|(nm, omega)| -nm * omega.signum()).collect();
        let mean_nm = against.iter().sum::<f64>() / against.len() as f64;
        assert!((mean_nm / 0.1 - 1.0).abs() < 0.2, "{mean_nm} N·m over {} samples", against.len());
    }

    /// Of a motor half as strong with half of all inertia, weight and drag the duty and the angle are the same, and so is what is shown of the
    /// guide.
    #[test]
    fn without_tendons_the_guide_is_told_in_proportion_to_the_inertia() {
        let recording = test_bench::turned(4000, &[friction(0.1)]);
        let strong = JointModel::from_rig(&test_bench::direct_rig(), &recording).unwrap().guided(&recording);
        let mut weak = strong.clone();
        for name in [
            "motor.torque_constant_nm_per_a",
            "motor.rotor_inertia_kg_m2",
            "load.mass_kg",
            "load.inertia_kg_m2",
            "load.viscous_nm_s_per_rad",
        ] {
            let parameter = crate::rig::RigParameter::parse(name).unwrap();
            weak.set_value(&parameter, 0.5 * strong.value(&parameter).unwrap());
        }
        // One input for both, as in a fit.
        let input = ReplayInput::new(&strong, &recording).unwrap();
        let [strong, weak] = [strong, weak].map(|model| replay(&model, &input).unwrap());
        let apart = |a: &[f64], b: &[f64]| rms(&a.iter().zip(b).map(|(a, b)| a - b).collect::<Vec<f64>>());
        assert!(rms(&strong.guide_nm) > 0.05);
        assert!(apart(&strong.guide_nm, &weak.guide_nm) < 0.01 * rms(&strong.guide_nm));
        let [a, b] = [&strong, &weak].map(|of| of.channel(Channel::ThetaOut).unwrap());
        assert!(apart(a, b) < 0.01 * rms(a));
    }
}
