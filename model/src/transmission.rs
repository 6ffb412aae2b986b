//! Two tendons between two pulleys: the antagonistic pair.
//!
//! Elongation of cable a is `r1 θ_in - r2 θ_out`, of cable b its negative (Eq. (6)–(7)); torques are
//! `T_in = (F1 - F3) r1` and `T_out = (F2 - F4) r2` (Eq. (4)–(5)).

use crate::effect::Component;
use crate::effect::{SlipLaw, TendonPort, TransmissionPort};
use crate::effect_set::{EffectSet, EffectStates};
use crate::friction_law::FrictionLaw;
use crate::parameters::{PulleyParameters, SheathParameters, TendonParameters};
use crate::play::Play;
use crate::sheath::presliding::Pull;
use crate::sheath::{End, SheathError, SlipLimits, Tendon, TendonMesh};

/// Contacts of each tendon unless a rig says otherwise.
pub const DEFAULT_ELEMENTS: usize = 16;

/// Pull of cables a and b for a pulley that turns towards +θ, at the input end; negated at the output end.
const CABLE_SIGN: [f64; 2] = [1.0, -1.0];

/// Newton steps by which a pulley inside a play finds the place without torque, in one simulation step.
const PLAY_STEPS: usize = 4;

/// Internal friction of the ropes: the torque of a stretch rate, as a time τ. A cycle at the angular frequency ω loses 2π ω τ of
/// the elastic energy, 40 % at 20 Hz. A wire rope alone loses some 5 %, which would be 63 µs; the rest is taken for what rigid contacts
/// lose while they stick, which no other term has. Without it the arm would ring for seconds after each start. At steady
/// speed it does nothing.
const ROPE_LOSS_S: f64 = 5e-4;

/// Pulleys, tendons and sheaths: configuration only.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TransmissionConfig {
    pulleys: PulleyParameters,
    tendon: TendonParameters,
    sheath: SheathParameters,
    mesh: TendonMesh,
}

impl TransmissionConfig {
    /// A pair of equal tendons of constant curvature, with `elements` contacts each where friction is distributed.
    ///
    /// Without `sheath` the tendons run free. [`FrictionLaw::Lumped`] puts all friction on one contact in the middle.
    ///
    /// # Errors
    /// [`SheathError`] when the mesh cannot be made.
    pub fn new(
        pulleys: PulleyParameters,
        tendon: TendonParameters,
        sheath: Option<SheathParameters>,
        friction: FrictionLaw,
        elements: usize,
    ) -> Result<Self, SheathError> {
        let stiffness_n_per_m = tendon.axial_stiffness_n / tendon.length_m;
        let elements = match friction {
            FrictionLaw::Distributed => elements,
            FrictionLaw::Lumped => 1,
        };
        let mesh = TendonMesh::uniform(elements, stiffness_n_per_m)?;
        let sheath = sheath.unwrap_or(SheathParameters { wrap_angle_rad: 0.0, friction_coefficient: 0.0 });
        Ok(Self { pulleys, tendon, sheath, mesh })
    }

    /// The same pair with another mesh, for example of a sheath whose curvature varies along its length.
    #[must_use]
    pub fn with_mesh(mut self, mesh: TendonMesh) -> Self {
        self.mesh = mesh;
        self
    }

    /// The same pair in sheaths that are bent between these places alone, counted in their length from the input pulley. Friction on one
    /// contact in the middle stays there.
    ///
    /// # Errors
    /// [`SheathError`] when the places are not in order or not in `[0, 1]`.
    pub fn bent_between(self, places: [f64; 2]) -> Result<Self, SheathError> {
        let elements = self.mesh.elements();
        if places == [0.0, 1.0] || elements == 1 {
            return Ok(self);
        }
        let stiffness_n_per_m = 1.0 / self.mesh.total_compliance_m_per_n();
        Ok(self.with_mesh(TendonMesh::bent_between(elements, stiffness_n_per_m, places)?))
    }

    /// Mesh of both tendons.
    #[must_use]
    pub const fn mesh(&self) -> &TendonMesh {
        &self.mesh
    }

    /// Pulleys.
    #[must_use]
    pub const fn pulleys(&self) -> PulleyParameters {
        self.pulleys
    }

    /// Slope of the torque over a turn of one pulley while the contacts next to it stick, N·m/rad: the stiffest there is.
    #[must_use]
    pub fn sticking_stiffness_nm_per_rad(&self, end: End) -> f64 {
        let radius_m = match end {
            End::Input => self.pulleys.input_radius_m,
            End::Output => self.pulleys.output_radius_m,
        };
        // Half an element of each tendon.
        4.0 * self.mesh.elements() as f64 / self.mesh.total_compliance_m_per_n() * radius_m * radius_m
    }

    /// Turns of the output pulley per turn of the input pulley.
    #[inline]
    pub(crate) fn pulley_ratio(&self) -> f64 {
        self.pulleys.input_radius_m / self.pulleys.output_radius_m
    }

    /// Torque on the joint from the internal friction of both ropes, N·m for each rad/s by which it lags the input.
    #[inline]
    pub(crate) fn rope_loss_nm_s_per_rad(&self) -> f64 {
        let radius_m = self.pulleys.output_radius_m;
        ROPE_LOSS_S * 2.0 * radius_m * radius_m / self.mesh.total_compliance_m_per_n()
    }

    fn nominal_tendon_port(&self) -> TendonPort {
        let slip =
            SlipLaw { friction_coefficient: self.sheath.friction_coefficient, friction_n_per_rad: 0.0 };
        TendonPort {
            wrap_angle_rad: self.sheath.wrap_angle_rad,
            speed_m_s: [0.0; 2],
            slip: [slip; 2],
            mean_tension_n: self.tendon.pretension_n,
            added_length_m: 0.0,
            unilateral: false,
            presliding_m: 0.0,
        }
    }
}

/// State of the pair.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Transmission {
    tendons: [Tendon; 2],
    limits: [[SlipLimits; 2]; 2],
    added_length_m: [f64; 2],
    unilateral: [bool; 2],
    presliding_m: [f64; 2],
    play_rad: f64,
    play: Play,
    /// Radii of both pulleys over those of round ones, where they stand.
    radius_ratio: [f64; 2],
    /// Turn of a round pulley that has wound as much more as each pulley that is not round, rad; `None` before the first step,
    /// which starts from tendons at the pretension whatever the angles.
    wound_excess_rad: Option<[f64; 2]>,
}

impl Transmission {
    /// Both tendons at the pretension, nothing slipping.
    #[must_use]
    pub fn at_rest(config: &TransmissionConfig) -> Self {
        let wrap_friction = config.sheath.friction_coefficient * config.sheath.wrap_angle_rad;
        let limits = SlipLimits::new(&config.mesh, wrap_friction, 0.0);
        Self {
            tendons: [Tendon::at_rest(&config.mesh, config.tendon.pretension_n); 2],
            limits: [[limits; 2]; 2],
            added_length_m: [0.0; 2],
            unilateral: [false; 2],
            presliding_m: [0.0; 2],
            play_rad: 0.0,
            play: Play::CENTRED,
            radius_ratio: [1.0; 2],
            wound_excess_rad: None,
        }
    }

    /// Cable a (0) or b (1).
    #[must_use]
    pub const fn tendon(&self, index: usize) -> &Tendon {
        &self.tendons[index]
    }

    /// F1 to F4, N.
    #[must_use]
    pub fn end_tensions_n(&self, config: &TransmissionConfig) -> [f64; 4] {
        let [a, b] = &self.tendons;
        [
            a.end_tension_n(&config.mesh, End::Input),
            a.end_tension_n(&config.mesh, End::Output),
            b.end_tension_n(&config.mesh, End::Input),
            b.end_tension_n(&config.mesh, End::Output),
        ]
    }

    /// Torque of the input pulley on the cables, `T_in = (F1 - F3) r1` (Eq. (4)), N·m.
    #[must_use]
    pub fn torque_in_nm(&self, config: &TransmissionConfig) -> f64 {
        let [f1, _, f3, _] = self.end_tensions_n(config);
        (f1 - f3) * self.radius_m(config, End::Input)
    }

    /// Torque of the cables on the output pulley, `T_out = (F2 - F4) r2` (Eq. (5)), N·m.
    #[must_use]
    pub fn torque_out_nm(&self, config: &TransmissionConfig) -> f64 {
        let [_, f2, _, f4] = self.end_tensions_n(config);
        (f2 - f4) * self.radius_m(config, End::Output)
    }

    /// Radius of a pulley where it stands, m.
    fn radius_m(&self, config: &TransmissionConfig, end: End) -> f64 {
        let round_m = match end {
            End::Input => config.pulleys.input_radius_m,
            End::Output => config.pulleys.output_radius_m,
        };
        round_m * self.radius_ratio[end as usize]
    }

    /// Slope of the torque over a turn of one pulley, N·m/rad, from the last move of that pulley.
    #[must_use]
    pub fn stiffness_nm_per_rad(&self, config: &TransmissionConfig, end: End) -> f64 {
        let radius_m = self.radius_m(config, end);
        let [a, b] = &self.tendons;
        (a.end_stiffness_n_per_m(end) + b.end_stiffness_n_per_m(end)) * radius_m * radius_m
    }

    /// Lets the effects set friction, stretch and play for the next moves.
    pub(crate) fn apply_effects(
        &mut self,
        config: &TransmissionConfig,
        effects: &EffectSet,
        states: &mut EffectStates,
        motion: PulleyMotion,
    ) {
        let is_first_step = self.wound_excess_rad.is_none();
        if !effects.touches(Component::Transmission) || (!effects.transmission_varies() && !is_first_step) {
            return;
        }
        let mut port = TransmissionPort {
            t_s: motion.t_s,
            dt_s: motion.dt_s,
            theta_in_rad: motion.theta_in_rad,
            theta_out_rad: motion.theta_out_rad,
            torque_in_nm: self.torque_in_nm(config),
            stiffness_n_per_m: 1.0 / config.mesh.total_compliance_m_per_n(),
            pretension_n: config.tendon.pretension_n,
            tendons: [config.nominal_tendon_port(); 2],
            play_rad: 0.0,
            radius_excess: [0.0; 2],
            wound_excess_rad: [0.0; 2],
        };
        for (index, (tendon, sign)) in port.tendons.iter_mut().zip(CABLE_SIGN).enumerate() {
            tendon.speed_m_s = [
                sign * motion.omega_in_rad_s * config.pulleys.input_radius_m,
                sign * motion.omega_out_rad_s * config.pulleys.output_radius_m,
            ];
            let state = &self.tendons[index];
            tendon.mean_tension_n = 0.5
                * (state.end_tension_n(&config.mesh, End::Input)
                    + state.end_tension_n(&config.mesh, End::Output));
        }
        effects.transmission(states, &mut port);
        let friction = port.tendons.each_ref().map(|tendon| {
            let wrap_angle_rad = tendon.wrap_angle_rad.max(0.0);
            tendon.slip.map(|law| {
                [law.friction_coefficient, law.friction_n_per_rad]
                    .map(|value| value.max(0.0) * wrap_angle_rad)
            })
        });
        let [[a_in, a_out], [b_in, b_out]] = &mut self.limits;
        a_in.set(&config.mesh, friction[0][0]);
        a_out.set_beside(&config.mesh, friction[0][1], a_in);
        b_in.set_beside(&config.mesh, friction[1][0], a_in);
        b_out.set_beside(&config.mesh, friction[1][1], a_out);
        for (index, tendon) in port.tendons.iter().enumerate() {
            let longer_m = tendon.added_length_m - self.added_length_m[index];
            if longer_m != 0.0 {
                self.tendons[index].add_length(&config.mesh, longer_m);
                self.added_length_m[index] = tendon.added_length_m;
            }
            self.unilateral[index] = tendon.unilateral;
            self.presliding_m[index] = tendon.presliding_m;
        }
        self.play_rad = port.play_rad;
        self.follow_radii(config, &port);
    }

    /// Takes the radii of pulleys that are not round where they stand now.
    ///
    /// During a turn the radius at its start counts. What that leaves out is made up for here, so that a pulley which comes
    /// back to an angle has wound what it had there before, however long the steps.
    fn follow_radii(&mut self, config: &TransmissionConfig, port: &TransmissionPort) {
        let wound_rad = self.wound_excess_rad.unwrap_or(port.wound_excess_rad);
        for (index, end) in [End::Input, End::Output].into_iter().enumerate() {
            let missing_rad = port.wound_excess_rad[index] - wound_rad[index];
            if missing_rad != 0.0 {
                self.radius_ratio[index] = 1.0;
                self.turn(config, end, missing_rad);
            }
            self.radius_ratio[index] = 1.0 + port.radius_excess[index];
        }
        self.wound_excess_rad = Some(port.wound_excess_rad);
    }

    /// Turns the input pulley by `delta_rad`. Inside a play the tendons on it wait for [`Self::close_play`].
    pub fn turn_input(&mut self, config: &TransmissionConfig, delta_rad: f64) {
        let turn_rad = self.play.turn(delta_rad, self.play_rad);
        self.turn(config, End::Input, turn_rad);
    }

    /// Lets the tendons move inside a play of the input pulley, once both pulleys have turned.
    #[inline]
    pub(crate) fn close_play(&mut self, config: &TransmissionConfig) {
        self.play = self.relax_play(config, End::Input, Outside::NOTHING, self.play, self.play_rad);
    }

    /// Whether the tendons are inside a play of the input pulley, where neither drives the other.
    #[inline]
    pub(crate) fn inside_play(&self) -> bool {
        self.play.is_open(self.play_rad)
    }

    /// Lets a pulley without inertia move inside a play until the cables balance what acts from `outside`, or the play
    /// ends.
    ///
    /// Motor or input pulley lead the tendons ([`End::Input`]), the output pulley leads the arm ([`End::Output`]). Returns the play
    /// with its new lead, at once where there is none of `width_rad`. The first step assumes
    /// tendons that stick next to the pulley, the stiffest they can be; they get softer as they slip, so that each step
    /// falls short of the place and none swings across it, which would feed energy into the play. Both pulleys have turned before:
    /// after the turn of one alone the tendons would see the travel of a step, 1.6 mrad at 3 rad/s and 0.5 ms, as a lead.
    #[inline]
    pub(crate) fn relax_play(
        &mut self,
        config: &TransmissionConfig,
        end: End,
        outside: Outside,
        play: Play,
        width_rad: f64,
    ) -> Play {
        if play.is_there(width_rad) { self.relax(config, end, outside, play, width_rad) } else { play }
    }

    /// The same of a play that is there.
    fn relax(
        &mut self,
        config: &TransmissionConfig,
        end: End,
        outside: Outside,
        play: Play,
        width_rad: f64,
    ) -> Play {
        let half = 0.5 * width_rad;
        let mut lead_rad = play.lead_rad;
        let mut stiffness = config.sticking_stiffness_nm_per_rad(end);
        for _ in 0..PLAY_STEPS {
            // The input pulley turns back as the lead of the gear grows.
            let outside_nm = outside.torque_nm + outside.stiffness_nm_per_rad * (lead_rad - play.lead_rad);
            let torque_nm = match end {
                End::Input => self.torque_in_nm(config) - outside_nm,
                End::Output => self.torque_out_nm(config) - outside_nm,
            };
            let wanted =
                (lead_rad + torque_nm / (stiffness + outside.stiffness_nm_per_rad)).clamp(-half, half);
            let moved = wanted - lead_rad;
            if moved == 0.0 {
                break;
            }
            match end {
                End::Input => self.turn(config, End::Input, -moved),
                End::Output => self.turn(config, End::Output, moved),
            }
            lead_rad = wanted;
            stiffness = self.stiffness_nm_per_rad(config, end);
        }
        Play { lead_rad }
    }

    /// Turns the output pulley by `delta_rad`.
    pub fn turn_output(&mut self, config: &TransmissionConfig, delta_rad: f64) {
        self.turn(config, End::Output, delta_rad);
    }

    fn turn(&mut self, config: &TransmissionConfig, end: End, delta_rad: f64) {
        let wound_m = self.radius_m(config, end) * delta_rad;
        if let Some(wound_rad) = &mut self.wound_excess_rad {
            wound_rad[end as usize] += (self.radius_ratio[end as usize] - 1.0) * delta_rad;
        }
        let stretch_m = match end {
            End::Input => wound_m,
            End::Output => -wound_m,
        };
        let pulls = [0, 1].map(|index| Pull {
            limits: &self.limits[index][end as usize],
            stretch_m: CABLE_SIGN[index] * stretch_m,
            unilateral: self.unilateral[index],
            presliding_m: self.presliding_m[index],
        });
        if pulls.iter().all(|pull| pull.presliding_m > 0.0) {
            return Tendon::move_ends_presliding(&mut self.tendons, &config.mesh, end, pulls);
        }
        for (tendon, pull) in self.tendons.iter_mut().zip(pulls) {
            let Pull { limits, stretch_m, unilateral, presliding_m } = pull;
            if presliding_m > 0.0 {
                tendon.move_end_presliding(&config.mesh, limits, end, stretch_m, unilateral, presliding_m);
            } else {
                tendon.move_end(&config.mesh, limits, end, stretch_m, unilateral);
            }
        }
    }
}

/// A torque from outside on a pulley without inertia, which must be told together with how it follows the angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outside {
    /// Torque at the angle where the pulley is, N·m; positive turns it forward.
    pub torque_nm: f64,
    /// By how much it falls as the pulley turns forward, N·m/rad, at least 0.
    pub stiffness_nm_per_rad: f64,
}

impl Outside {
    /// Nothing acts.
    pub const NOTHING: Self = Self { torque_nm: 0.0, stiffness_nm_per_rad: 0.0 };
}

/// Angles and speeds of both pulleys at the start of a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PulleyMotion {
    pub t_s: f64,
    pub dt_s: f64,
    pub theta_in_rad: f64,
    pub omega_in_rad_s: f64,
    pub theta_out_rad: f64,
    pub omega_out_rad_s: f64,
}
