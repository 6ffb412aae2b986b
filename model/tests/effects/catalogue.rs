//! All effects: what they declare, that they vanish at their neutral strength, and that an inactive one is not there.

use std::collections::HashSet;
use std::sync::atomic::{AtomicUsize, Ordering};

use crate::joint::{IDLE, Run, joint};
use crate::motor::MOTOR;
use bowden_model::channel::Channel;
use bowden_model::drive::BridgeInput;
use bowden_model::effect::{
    ActiveEffect, Component, Descriptor, DrivePort, Effect, EffectState, JointPort, MAX_PARAMETERS,
    MotorPort, Scale, SensorPort, Target, TransmissionPort,
};
use bowden_model::effect_set::{EffectSet, FRESH_STATES, MAX_ACTIVE, TooManyEffects};
use bowden_model::effects::{CATALOGUE, find};
use bowden_model::plant::{InputBoundary, OutputBoundary, Plant, StepInput};

/// The fixed list of ids that a diagnosis may name, by component.
const CONTRACT: [(Component, &str); 4] = [
    (
        Component::Motor,
        "motor_coulomb_friction motor_viscous_friction motor_stribeck_friction gear_load_friction gear_backlash \
         motor_cogging drive_dead_zone winding_heating",
    ),
    (
        Component::Transmission,
        "distributed_friction sheath_viscous_friction sheath_stribeck_friction presliding_compliance \
         bending_friction asymmetric_friction friction_drift wrap_angle_varies_with_pose wrap_angle_disturbed \
         tendon_slack tendon_stiffening tendon_creep pretension_loss transmission_backlash",
    ),
    (
        Component::Joint,
        "joint_coulomb_friction joint_viscous_friction joint_backlash joint_spring end_stop_contact payload_change",
    ),
    (Component::Sensors, "encoder_eccentricity sensor_gain_error sensor_offset sensor_lag sensor_saturation"),
];

#[test]
fn catalogue_holds_the_ids_of_the_contract() {
    let wanted: HashSet<(Component, &str)> = CONTRACT
        .iter()
        .flat_map(|(component, ids)| ids.split_whitespace().map(move |id| (*component, id)))
        .collect();
    let ids: HashSet<&str> = CATALOGUE.iter().map(|effect| effect.descriptor().id).collect();
    assert_eq!(ids.len(), CATALOGUE.len(), "an id stands twice");
    let unasked: HashSet<(Component, &str)> = CATALOGUE
        .iter()
        .filter(|effect| !effect.on_request())
        .map(|effect| (effect.descriptor().component, effect.descriptor().id))
        .collect();
    assert_eq!(unasked, wanted);
    for effect in CATALOGUE {
        assert_eq!(find(effect.descriptor().id).unwrap().descriptor(), effect.descriptor());
    }
    assert!(find("no_such_effect").is_none());
}

/// Suffix that a parameter name must have for its unit; `None` where any name goes.
fn suffix(unit: &str) -> Option<&'static str> {
    Some(match unit {
        "N·m" => "_nm",
        "N·m/rad" => "_nm_per_rad",
        "N·m·s/rad" => "_nm_s_per_rad",
        "N·s/m" => "_n_s_per_m",
        "N/rad" => "_n_per_rad",
        "1/s" => "_per_s",
        "1/W" => "_per_w",
        "1/rad²" => "_per_rad2",
        "rad" => "_rad",
        "rad/s" => "_rad_s",
        "m" => "_m",
        "m/s" => "_m_s",
        "s" => "_s",
        "s/rad" => "_s_per_rad",
        "kg" => "_kg",
        "1" | "unit of the channel" => return None,
        other => panic!("no suffix is agreed for the unit {other}"),
    })
}

#[test]
fn descriptors_are_sane() {
    for effect in CATALOGUE {
        let descriptor = effect.descriptor();
        let id = descriptor.id;
        assert!(!descriptor.summary.is_empty() && !descriptor.summary.ends_with('.'), "{id}");
        assert!(descriptor.parameters.len() <= MAX_PARAMETERS, "{id}");
        let names: HashSet<_> = descriptor.parameters.iter().map(|spec| spec.name).collect();
        assert_eq!(names.len(), descriptor.parameters.len(), "{id}: a parameter stands twice");
        for (index, spec) in descriptor.parameters.iter().enumerate() {
            let name = spec.name;
            assert!(spec.lower < spec.upper, "{id}.{name}");
            assert!((spec.lower..=spec.upper).contains(&spec.default), "{id}.{name} {}", spec.default);
            assert!(spec.scale == Scale::Linear || spec.lower > 0.0, "{id}.{name}: ratio scale down to zero");
            assert!(!spec.meaning.is_empty(), "{id}.{name}");
            if let Some(suffix) = suffix(spec.unit) {
                assert!(name.ends_with(suffix), "{id}.{name} is in {}", spec.unit);
            }
            assert_eq!(descriptor.index_of(name), Some(index));
            assert_eq!(descriptor.defaults()[index], spec.default);
        }
        assert_eq!(descriptor.index_of("nonsense"), None);
        if let Some(neutral) = descriptor.neutral {
            let spec = descriptor.parameters[0];
            assert!((spec.lower..=spec.upper).contains(&neutral), "{id}: neutral {neutral}");
            assert_ne!(spec.default, neutral, "{id}: the default does nothing");
        }
        let is_sensor = descriptor.component == Component::Sensors;
        assert_eq!(is_sensor, !descriptor.channels.is_empty(), "{id}");
        let active = ActiveEffect::with_defaults(effect);
        assert_eq!(active.target == Target::None, !is_sensor, "{id}");
    }
}

/// A motor-driven run through both directions, with weight, friction and a push from outside.
fn lively_run(effects: &[ActiveEffect]) -> Run {
    let mut parameters = joint(0.12);
    parameters.motor = Some(MOTOR);
    let mut run = Run::new(parameters, effects, (InputBoundary::Motor, OutputBoundary::Arm), 5e-4);
    run.until(2.0, |t| StepInput {
        bridge: BridgeInput { duty: 0.2 * (6.0 * t).sin(), bus_v: 24.0, enabled: true },
        external_torque_nm: 0.1 * (17.0 * t).sin(),
        ..IDLE
    });
    run
}

fn observed(run: &Run) -> [f64; 10] {
    let plant = &run.plant;
    let [f1, f2, f3, f4] = run.tensions_n();
    [
        f1,
        f2,
        f3,
        f4,
        plant.theta_motor_rad(),
        plant.theta_in_rad(),
        plant.omega_in_rad_s(),
        plant.theta_out_rad(),
        plant.omega_out_rad_s(),
        plant.current_a(),
    ]
}

/// At its neutral strength an effect changes nothing, and the other parameters do not matter; at its default it changes
/// the run. 1e-9 of 60 N is what 4000 steps in another order of rounding may leave.
#[test]
fn neutral_strength_changes_nothing_and_the_default_does() {
    let plain = observed(&lively_run(&[]));
    for effect in CATALOGUE {
        let descriptor = effect.descriptor();
        let active = ActiveEffect::with_defaults(effect);
        let apart = |active: ActiveEffect| -> f64 {
            let run = observed(&lively_run(&[active]));
            run.iter().zip(&plain).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
        };
        if let (Some(neutral), false) = (descriptor.neutral, descriptor.component == Component::Sensors) {
            let off = active.with(descriptor.parameters[0].name, neutral);
            assert!(apart(off) <= 1e-9, "{}: {} at neutral", descriptor.id, apart(off));
        }
        // Effects that begin later than this run, beyond its range, or that the rig contains already.
        let idle = [
            "pretension_loss",
            "wrap_angle_disturbed",
            "payload_change",
            "distributed_friction",
            "tendon_slack",
        ];
        let sleeps = descriptor.component == Component::Sensors || idle.contains(&descriptor.id);
        let difference = apart(active);
        assert_eq!(difference > 1e-6, !sleeps, "{}: {difference} at default", descriptor.id);
    }
}

#[test]
fn neutral_sensors_show_the_truth() {
    for effect in CATALOGUE {
        let descriptor = effect.descriptor();
        if descriptor.component != Component::Sensors {
            continue;
        }
        let Some(neutral) = descriptor.neutral else { continue };
        let active = ActiveEffect::with_defaults(effect).with(descriptor.parameters[0].name, neutral);
        let set = EffectSet::from_slice(&[active]).unwrap();
        let channel = descriptor.channels[0];
        for value in [-3.0, 0.0, 0.7, 42.0] {
            let mut states = FRESH_STATES;
            let mut port = SensorPort { t_s: 1.0, dt_s: 0.01, value };
            set.measure(channel, &mut states, &mut port);
            assert_eq!(port.value, value, "{}", descriptor.id);
            set.correct(channel, &mut states, &mut port);
            assert_eq!(port.value, value, "{}", descriptor.id);
        }
    }
}

/// An effect that counts its calls by hook; every hook but those of its component must stay silent.
struct Spy {
    descriptor: &'static Descriptor,
    calls: [AtomicUsize; 5],
}

impl Effect for Spy {
    fn descriptor(&self) -> &'static Descriptor {
        self.descriptor
    }

    fn drive(&self, _p: &[f64; MAX_PARAMETERS], state: &mut EffectState, _port: &mut DrivePort) {
        self.count(0, state);
    }

    fn motor(&self, _p: &[f64; MAX_PARAMETERS], state: &mut EffectState, _port: &mut MotorPort) {
        self.count(1, state);
    }

    fn transmission(
        &self,
        _p: &[f64; MAX_PARAMETERS],
        state: &mut EffectState,
        _port: &mut TransmissionPort,
    ) {
        self.count(2, state);
    }

    fn joint(&self, _p: &[f64; MAX_PARAMETERS], state: &mut EffectState, _port: &mut JointPort) {
        self.count(3, state);
    }

    fn measure(&self, _p: &[f64; MAX_PARAMETERS], state: &mut EffectState, _port: &mut SensorPort) {
        self.count(4, state);
    }
}

impl Spy {
    const fn new(descriptor: &'static Descriptor) -> Self {
        Self { descriptor, calls: [const { AtomicUsize::new(0) }; 5] }
    }

    /// The state is this effect's own, zero at first: it holds the number of calls so far.
    fn count(&self, hook: usize, state: &mut EffectState) {
        let before: usize = self.calls.iter().map(|calls| calls.load(Ordering::Relaxed)).sum();
        assert_eq!(state[0], before as f64, "{}: somebody else's state", self.descriptor.id);
        state[0] += 1.0;
        self.calls[hook].fetch_add(1, Ordering::Relaxed);
    }
}

const fn described(id: &'static str, component: Component) -> Descriptor {
    Descriptor { id, component, summary: "counts calls", parameters: &[], neutral: None, channels: &[] }
}

static ON_MOTOR: Descriptor = described("on_motor", Component::Motor);
static ON_TRANSMISSION: Descriptor = described("on_transmission", Component::Transmission);
static ON_JOINT: Descriptor = described("on_joint", Component::Joint);
static ON_SENSORS: Descriptor = described("on_sensors", Component::Sensors);
static SPIES: [Spy; 4] =
    [Spy::new(&ON_MOTOR), Spy::new(&ON_TRANSMISSION), Spy::new(&ON_JOINT), Spy::new(&ON_SENSORS)];

/// Each component's hooks run once a step with their own state, no other hook does, and hooks that change nothing leave
/// the run bit for bit as it is without any effect.
#[test]
fn only_the_hooks_of_active_effects_run() {
    let active: Vec<ActiveEffect> = SPIES.iter().map(|spy| ActiveEffect::with_defaults(spy)).collect();
    let watched = observed(&lively_run(&active));
    let calls = |index: usize| SPIES[index].calls.each_ref().map(|calls| calls.load(Ordering::Relaxed));
    assert_eq!(calls(0), [4000, 4000, 0, 0, 0]);
    assert_eq!(calls(1), [0, 0, 4000, 0, 0]);
    assert_eq!(calls(2), [0, 0, 0, 4000, 0]);
    assert_eq!(calls(3), [0; 5]);
    assert_eq!(watched, observed(&lively_run(&[])));
}

/// An effect on the transmission that does nothing, and does not say so.
struct Idle;

static IDLE_ONE: Descriptor = described("idle", Component::Transmission);

impl Effect for Idle {
    fn descriptor(&self) -> &'static Descriptor {
        &IDLE_ONE
    }
}

/// What calls itself constant is asked once a run; beside an effect that does not, it is asked at every step, and the run is bit for bit the same.
#[test]
fn constant_effects_say_the_same_at_every_step() {
    let constant: Vec<_> = CATALOGUE.into_iter().filter(|effect| effect.is_constant()).collect();
    assert_eq!(constant.len(), 6);
    for effect in constant {
        let mut active = ActiveEffect::with_defaults(effect);
        for (value, spec) in active.parameters.iter_mut().zip(effect.descriptor().parameters) {
            if *value == 0.0 {
                *value = 0.1 * spec.upper;
            }
        }
        let asked_once = observed(&lively_run(&[active]));
        let always_asked = observed(&lively_run(&[active, ActiveEffect::with_defaults(&Idle)]));
        assert_eq!(asked_once, always_asked, "{}", effect.descriptor().id);
    }
}

#[test]
fn a_full_set_refuses_one_more() {
    let effect = ActiveEffect::with_defaults(find("joint_spring").unwrap());
    let mut set = EffectSet::from_slice(&[effect; MAX_ACTIVE]).unwrap();
    assert_eq!(set.push(effect), Err(TooManyEffects));
    assert_eq!(set.iter().count(), MAX_ACTIVE);
}

/// Channels of one target, and effects of one kind on two sensors that keep apart.
#[test]
fn sensors_are_distorted_by_their_own_effects_only() {
    let offset = ActiveEffect::with_defaults(find("sensor_offset").unwrap());
    let on_f2 = ActiveEffect { target: Target::One(Channel::F2), ..offset };
    let on_all = ActiveEffect { target: Target::Tensions, ..offset }.with("offset", 0.25);
    let set = EffectSet::from_slice(&[on_f2, on_all]).unwrap();
    for channel in Channel::ALL {
        let mut port = SensorPort { t_s: 0.0, dt_s: 0.0, value: 10.0 };
        set.measure(channel, &mut FRESH_STATES.clone(), &mut port);
        let want = match channel {
            Channel::F2 => 11.25,
            Channel::F1 | Channel::F3 | Channel::F4 => 10.25,
            _ => 10.0,
        };
        assert_eq!(port.value, want, "{}", channel.role());
    }
    let mut run = lively_run(&[on_f2]);
    run.plant = Plant::at_rest(&run.config, 0.0, 0.0);
    assert_eq!(run.tensions_n(), [60.0; 4]);
}
