//! What has to hold in every tick, judged by what the host was told and by the joint itself.

use bowden_control::parameters::Parameters;
use bowden_control::tick::{Command, TickOutput};
use bowden_link::message::{Goal, Mode};
use bowden_link::{FaultRecord, State};

use super::Tally;
use crate::joint::Joint;

/// Steps of an angle in rad and of a torque in N·m.
const STEPS: f64 = 1_048_576.0;
const FULL_DUTY: f64 = 32_767.0;
/// Largest `bridge.duty_limit` that the firmware is compiled with.
const DUTY_CEILING: f64 = 0.98;

/// Current above its limit that is no fault of the board, A: at rest, a rad/s of speed more, and at most. The board limits the current by the
/// speed that its observer takes the motor to have, and a rad/s of error is 0.45 A here.
const CURRENT_SLACK: [f64; 3] = [0.3, 0.45, 1.0];

/// Time for which the current may be above a limit that was narrowed: twelve time constants of the winding.
const SETTLES_NS: u64 = 5_000_000;

/// Parameters by which the current cannot be judged once they are changed: with them the board knows another motor, or controls it so that its
/// speed is not what the board takes it for.
const MOTOR: [&str; 5] = ["motor.", "bridge.", "encoder.", "controller.", "correction."];

/// A command to the tick, as far as states are concerned.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Order {
    Enter(Goal),
    Reset,
    Other,
}

impl Order {
    pub fn of(command: &Command) -> Self {
        match command {
            Command::Enter(goal) => Self::Enter(*goal),
            Command::Reset => Self::Reset,
            _ => Self::Other,
        }
    }
}

/// Limits that act, SI units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    pub duty: f64,
    pub current_a: f64,
    pub angle_rad: [f64; 2],
    pub speed_rad_s: f64,
    pub torque_nm: f64,
    pub torque_rate_nm_s: f64,
    pub host_timeout_s: f64,
    pub bridge_direction: f64,
    /// Whether the current can be judged.
    pub knows_motor: bool,
}

/// Values of all parameters, by what the host was told.
pub struct Told(Vec<f32>);

impl Default for Told {
    fn default() -> Self {
        Self(defaults().collect())
    }
}

fn defaults() -> impl Iterator<Item = f32> {
    (0..Parameters::COUNT)
        .filter_map(|index| Parameters::specification(index).map(|specification| specification.default))
}

impl Told {
    pub fn write(&mut self, index: u16, value: f32) -> bool {
        self.0[usize::from(index)] = value;
        true
    }

    pub fn write_defaults(&mut self) -> bool {
        *self = Self::default();
        true
    }

    pub fn value(&self, index: u16) -> f32 {
        self.0[usize::from(index)]
    }

    fn named(&self, name: &str) -> f64 {
        self.value(Parameters::index_of(name).expect("a parameter of this name")).into()
    }

    pub fn allows_provocation(&self) -> bool {
        self.named("supervisor.allow_provoke") == 1.0
    }

    pub fn timeout_ns(&self) -> u64 {
        (self.named("supervisor.host_timeout") * 1e9) as u64
    }

    pub fn settings(&self) -> Settings {
        let unchanged = (0..Parameters::COUNT).zip(defaults()).all(|(index, default)| {
            let name = Parameters::specification(index).map_or("", |specification| specification.name);
            self.value(index) == default
                || name == "bridge.duty_limit"
                || !MOTOR.iter().any(|group| name.starts_with(group))
        });
        Settings {
            duty: self.named("bridge.duty_limit"),
            current_a: self.named("limits.current"),
            angle_rad: ["limits.angle_minimum", "limits.angle_maximum"].map(|name| self.named(name)),
            speed_rad_s: self.named("limits.speed"),
            torque_nm: self.named("limits.torque"),
            torque_rate_nm_s: self.named("limits.torque_rate"),
            host_timeout_s: self.named("supervisor.host_timeout"),
            bridge_direction: self.named("bridge.direction"),
            knows_motor: unchanged,
        }
    }
}

/// What was when the bridge went on, and the reference since then.
#[derive(Clone, Copy)]
struct Drive {
    mode: Mode,
    settings: Settings,
    /// Range of the reference: the limits, and where the joint stood.
    range: [f64; 2],
    reference_raw: i32,
    /// A sensor said something wrong since then.
    misled: bool,
}

/// Judge of all ticks.
pub struct Watch {
    pub told: Told,
    pub ticks: u32,
    pub heard_ns: u64,
    pub tally: Tally,
    in_force: Settings,
    /// When the current's limit was narrowed last.
    narrowed_ns: u64,
    drive: Option<Drive>,
    /// Mode that was ordered last.
    mode: Mode,
}

impl Default for Watch {
    fn default() -> Self {
        let told = Told::default();
        let tally = Tally { excess_a: f64::NEG_INFINITY, ..Tally::default() };
        let in_force = told.settings();
        Self {
            told,
            ticks: 0,
            heard_ns: 0,
            tally,
            in_force,
            narrowed_ns: 0,
            drive: None,
            mode: Mode::Position,
        }
    }
}

impl Watch {
    /// Limits that act in the tick.
    pub const fn in_force(&self) -> &Settings {
        &self.in_force
    }

    #[expect(clippy::too_many_arguments, reason = "everything that a tick is judged by")]
    pub fn tick(
        &mut self,
        taken: Option<(Order, Option<Settings>)>,
        before: (State, Option<FaultRecord>),
        after: (State, Option<FaultRecord>),
        output: &TickOutput,
        joint: &Joint,
        misled: bool,
        now_ns: u64,
        period_ns: u64,
    ) {
        self.ticks += 1;
        let order = taken.map(|(order, _)| order);
        if let Some((_, Some(settings))) = taken {
            if settings.current_a < self.in_force.current_a {
                self.narrowed_ns = now_ns;
            }
            self.in_force = settings;
        }
        if let Some(Order::Enter(Goal::Run(mode))) = order
            && before.0 == State::Ready
        {
            self.mode = mode;
        } else if order == Some(Order::Enter(Goal::Home)) {
            self.mode = Mode::Position;
        }
        states(order, before, after, output);
        self.duty(output);
        self.reference(before.0, after.0, output, joint, misled, period_ns);
        self.current(after.0, joint, now_ns);
        let silent_s = (now_ns - self.heard_ns) as f64 * 1e-9;
        // The service looks every 5 ms, counts whole milliseconds, and its order waits behind four others.
        let stopped_s = self.in_force.host_timeout_s.max(self.told.settings().host_timeout_s)
            + 0.006
            + 6e-9 * period_ns as f64;
        assert!(
            !after.0.drives() || silent_s <= stopped_s,
            "{} with a host silent for {silent_s} s",
            after.0
        );
        self.tally.driven += u32::from(output.bridge_on);
        self.tally.faults += u32::from(output.tripped.is_some());
        self.tally.farthest_rad = self.tally.farthest_rad.max(joint.theta_rad[1].abs());
    }

    fn duty(&mut self, output: &TickOutput) {
        let duty = f64::from(output.duty_raw).abs() / FULL_DUTY;
        assert!(
            duty <= DUTY_CEILING && duty <= self.in_force.duty + 1.0 / FULL_DUTY,
            "duty {duty}, set {}",
            self.in_force.duty
        );
        self.tally.at_duty_limit += u32::from(duty >= self.in_force.duty - 1.0 / FULL_DUTY);
    }

    fn reference(
        &mut self,
        before: State,
        after: State,
        output: &TickOutput,
        joint: &Joint,
        misled: bool,
        period_ns: u64,
    ) {
        if !after.drives() {
            self.drive = None;
            return;
        }
        let raw = output.sample.reference_raw;
        let settings = self.in_force;
        if before != after || self.drive.is_none() {
            let torque = after == State::Run && self.mode.follows_torque();
            let limits = if torque { [-settings.torque_nm, settings.torque_nm] } else { settings.angle_rad };
            let limits =
                if after == State::Homing { [limits[0].min(0.0), limits[1].max(0.0)] } else { limits };
            let here = f64::from(raw) / STEPS;
            // A reference begins where the joint is.
            let off_rad = (here - joint.theta_rad[1]).abs();
            assert!(
                torque || misled || !settings.knows_motor || off_rad < 0.03,
                "the reference begins {off_rad} rad off"
            );
            let range = [limits[0].min(here), limits[1].max(here)];
            self.drive = Some(Drive { mode: self.mode, settings, range, reference_raw: raw, misled });
            return;
        }
        let Some(drive) = &mut self.drive else { return };
        drive.misled |= misled;
        let rate = if drive.mode.follows_torque() {
            drive.settings.torque_rate_nm_s
        } else {
            drive.settings.speed_rad_s
        };
        let change = f64::from(raw) - f64::from(drive.reference_raw);
        let most = rate * period_ns as f64 * 1e-9 * STEPS + 2.0;
        assert!(
            change.abs() <= most,
            "the reference moves by {change} of 2^-20 in a tick, allowed {most}, {:?}",
            drive.mode
        );
        let value = f64::from(raw) / STEPS;
        let [low, high] = drive.range;
        assert!(
            value >= low - 1e-3 && value <= high + 1e-3,
            "reference {value} outside {low} to {high}, {:?}",
            drive.mode
        );
        drive.reference_raw = raw;
    }

    fn current(&mut self, state: State, joint: &Joint, now_ns: u64) {
        let Some(drive) = self.drive.filter(|drive| state.drives() && !drive.misled) else { return };
        if !(drive.settings.knows_motor && self.in_force.knows_motor) {
            return;
        }
        if now_ns - self.narrowed_ns < SETTLES_NS {
            return;
        }
        let limit_a = self.in_force.current_a;
        let excess_a = joint.current_a.abs() - limit_a;
        let [at_rest_a, a_per_rad_s, at_most_a] = CURRENT_SLACK;
        let slack_a = (at_rest_a + a_per_rad_s * joint.omega_rad_s[0].abs()).min(at_most_a);
        self.tally.excess_a = self.tally.excess_a.max(excess_a);
        assert!(excess_a <= slack_a, "{} A, set {limit_a} A", joint.current_a);
    }
}

/// The diagram of the supervisor, the bridge, and a fault that stays.
fn states(
    order: Option<Order>,
    before: (State, Option<FaultRecord>),
    after: (State, Option<FaultRecord>),
    output: &TickOutput,
) {
    use State::{Fault, Homing, Off, PretensionCheck, Ready, Run, SelfTest};
    let enter = |goal: fn(Goal) -> bool| matches!(order, Some(Order::Enter(ordered)) if goal(ordered));
    let allowed = match (before.0, after.0) {
        (from, to) if from == to => true,
        (_, Fault) => output.tripped.is_some(),
        (Fault, Off) => enter(|goal| goal == Goal::ClearFault),
        (Fault, _) => false,
        (_, Off) => enter(|goal| goal == Goal::Off),
        (Off | Ready, SelfTest) => enter(|goal| goal == Goal::Ready),
        (SelfTest, PretensionCheck) | (PretensionCheck | Homing, Ready) => true,
        (Ready, Homing) => enter(|goal| goal == Goal::Home),
        (Ready, Run) => enter(|goal| matches!(goal, Goal::Run(_))),
        _ => false,
    };
    assert!(allowed, "{} to {} by {order:?}", before.0, after.0);
    let drives = matches!(after.0, Homing | Run);
    assert_eq!(output.bridge_on, drives, "bridge in {}", after.0);
    assert!(drives || output.duty_raw == 0, "duty {} in {}", output.duty_raw, after.0);
    assert_eq!(output.sample.duty_raw, output.duty_raw);
    assert_eq!(after.1.is_some(), after.0 == Fault, "{} with {:?}", after.0, after.1);
    if let (Some(old), Some(new)) = (before.1, after.1) {
        let bits = |record: FaultRecord| {
            (record.fault, record.channel, record.tick, record.got.to_bits(), record.limit.to_bits())
        };
        assert_eq!(bits(old), bits(new), "a fault became another one");
    }
    // A latched fault is cleared by an order, and is not found again in the tick of the order as the old one.
    if before.1.is_some() && after.1.is_none() {
        assert!(enter(|goal| goal == Goal::ClearFault), "a fault was forgotten by {order:?}");
    }
}
