//! Files that people write: rigs with laws, studies, plans, parameters, ripple tables.

use std::f64::consts::TAU;
use std::path::Path;
use std::sync::OnceLock;
use std::time::Duration;

use bowden_core::outcome::Failure;
use bowden_core::rig::{Rig, RigDocument};
use bowden_core::study::LoadedStudy;
use bowden_host_link::bench_run::plan_file::Plan;
use bowden_host_link::client::Client;
use bowden_host_link::parameters::ParameterSet;
use bowden_host_link::ripple_table::{Sampled, to_csv};
use bowden_host_link::sim::SimTransport;

use crate::files::{file, folder};
use crate::judge;

/// A recording that studies name.
const RECORDING: &str = "t_s,theta_in_rad,theta_out_rad\n0,0,0\n0.001,0.01,0\n0.002,0.02,0.01\n";

const BENCH: &str = include_str!("../../../host-tools/core/tests/rigs/bench.toml");
const SERVO: &str = include_str!("../../../host-tools/studies/xl330-pendulum/xl330.toml");
const TOOL: &str = include_str!("../../../host-tools/studies/davinci-cable-tool/left.toml");
const DAMPER: &str = include_str!("../../../host-tools/studies/band-friction-damper/damper.toml");

/// Everything that a rig file may have behind its sections.
const EXTRAS: &str = r#"
[replay]
inputs = ["duty", "bus_v"]
outputs = ["theta_in_rad", "theta_out_rad", "f1_n"]

[recording.columns]
t_s = { column = "ms", scale = 0.001, offset = 0.0 }
theta_out_rad = { column = "elbow", scale = 1.0, offset = 0.12 }

[[effect]]
id = "joint_backlash"
gap_rad = 0.01

[[law]]
component = "joint"
port = "joint_friction_nm"
variables = ["omega_out_rad_s"]
formula = "amplitude_nm * abs(omega_out_rad_s)^exponent"
coefficients = { amplitude_nm = 0.083, exponent = 2.05 }
"#;

const POINTS: &str = r#"
[[law]]
name = "drag"
component = "joint"
port = "joint_friction_nm"
variables = ["omega_out_rad_s"]
units = { omega_out_rad_s = "rad/s", joint_friction_nm = "N·m" }
points = [[-1, 0.5], [0, 0.0], [1, 0.5]]
"#;

/// Runs a reader of text on any bytes; those that are no text are cut where they cease to be.
fn text(bytes: &[u8]) -> &str {
    match std::str::from_utf8(bytes) {
        Ok(text) => text,
        Err(error) => std::str::from_utf8(&bytes[..error.valid_up_to()]).unwrap_or_default(),
    }
}

fn checked<T>(read: Result<T, Failure>, source: &str) -> Option<T> {
    read.inspect_err(|failure| judge::one_line(failure, source)).ok()
}

/// A rig that is read is read again from what its document writes, as the same.
pub fn rig(bytes: &[u8]) {
    judge::bounded(bytes, || {
        let path = file("rig.toml", bytes);
        checked(Rig::load(&path), "rig.toml");
        let text = text(bytes);
        let Some(rig) = checked(Rig::parse(text, "rig.toml"), "rig.toml") else {
            checked(RigDocument::parse(text, "rig.toml").and_then(|document| document.rig()), "rig.toml");
            return;
        };
        let document = checked(RigDocument::parse(text, "rig.toml"), "rig.toml");
        let mut document = document.expect("what is a rig is a document");
        assert_eq!(
            format!("{:?}", document.rig().expect("an unchanged document is its rig")),
            format!("{rig:?}")
        );
        for active in &rig.effects {
            checked(document.add_effect(active), "rig.toml");
        }
        checked(document.rig(), "rig.toml").expect("a rig with its own effects is a rig");
        document.clear_effects();
        checked(document.rig(), "rig.toml").expect("a rig without effects is a rig");
    });
}

/// Rigs of every kind of section.
pub fn rigs() -> Vec<Vec<u8>> {
    let whole = [&[BENCH, EXTRAS][..], &[BENCH, POINTS], &[SERVO], &[TOOL], &[DAMPER]];
    whole.map(|parts| parts.concat().into_bytes()).into()
}

/// A study beside its rig and recordings.
pub fn study(bytes: &[u8]) {
    if !folder().join("bench.toml").exists() {
        file("bench.toml", BENCH.as_bytes());
        for name in ["a.csv", "b.csv"] {
            file(name, RECORDING.as_bytes());
        }
    }
    let path = file("study.toml", bytes);
    judge::bounded(bytes, || {
        // A recording may be named as it should not be, so the message may be about any of the files.
        if let Err(failure) = LoadedStudy::load(&path) {
            judge::one_line(&failure, &folder().display().to_string());
        }
    });
}

/// Studies of one bench and of two.
pub fn studies() -> Vec<Vec<u8>> {
    let one = "schema = \"bowden-study/1\"\nname = \"one\"\n[[bench]]\nname = \"a\"\nrig = \"bench.toml\"\n\
               [[recording]]\nfile = \"a.csv\"\nset = { \"load.mass_kg\" = 2.0 }\n[[recording]]\nfile = \"b.csv\"\nheldout = true\n";
    let two = "schema = \"bowden-study/1\"\n[[bench]]\nname = \"a\"\nrig = \"bench.toml\"\nown = [\"sheath.wrap_angle_rad\"]\n\
               [[bench]]\nname = \"b\"\nrig = \"bench.toml\"\n[[recording]]\nfile = \"a.csv\"\nbench = \"a\"\n\
               [[recording]]\nfile = \"b.csv\"\nbench = \"b\"\nset.load.mass_kg = 2.0\n";
    vec![one.into(), two.into()]
}

/// A plan.
pub fn plan(bytes: &[u8]) {
    judge::bounded(bytes, || {
        let text = text(bytes);
        if let Some(plan) = checked(Plan::parse(text, "plan.toml", Path::new("folder")), "plan.toml") {
            let parameters = bowden_control::parameters::Parameters::default();
            let reach =
                bowden_control::parameters::Reach::of(&parameters, bowden_link::message::Mode::Position);
            checked(plan.check_limits(&reach), "plan.toml");
            for step in &plan.steps {
                if let bowden_host_link::bench_run::plan_file::Step::Follow { motion, .. } = step
                    && let Err(reason) = motion.check(&parameters, &reach, &plan.limits)
                {
                    judge::is_one_line(&reason);
                }
            }
        }
    });
}

/// Plans of every kind of step.
pub fn plans() -> Vec<Vec<u8>> {
    let all = "schema = \"bowden-plan/1\"\nname = \"check\"\n[limits]\nangle_rad = 0.4\nspeed_rad_s = 2.0\ntorque_nm = 0.3\n\
               [[step]]\nkind = \"pretension_check\"\n[[step]]\nkind = \"home\"\n[[step]]\nkind = \"pause\"\nseconds = 0.5\n\
               [[step]]\nkind = \"follow\"\nreference = \"sine\"\namplitude = 0.2\nfrequency_hz = 1.0\nseconds = 0.3\nrepeat = 2\n\
               [[step]]\nkind = \"follow\"\nreference = \"hold\"\nmode = \"torque\"\noffset = 0.1\nseconds = 6\nevery = 5\n\
               [[step]]\nkind = \"excite\"\nrig = \"rig.toml\"\nseconds = 9\n";
    vec![all.into()]
}

/// The parameters of the simulated board.
fn board() -> &'static ParameterSet {
    static BOARD: OnceLock<ParameterSet> = OnceLock::new();
    BOARD.get_or_init(|| {
        let board = Box::new(SimTransport::new());
        let mut client =
            Client::connect(board, "sim", Duration::from_millis(1500)).expect("the simulated board greets");
        ParameterSet::read(&mut client).expect("the simulated board answers")
    })
}

/// A file of parameters: every value that is read is within its range.
pub fn parameters(bytes: &[u8]) {
    let board = board();
    judge::bounded(bytes, || {
        let text = text(bytes);
        for (index, value) in checked(board.parse(text, "board.toml"), "board.toml").unwrap_or_default() {
            let parameter = &board.all()[usize::from(index)];
            let range = parameter.minimum..=parameter.maximum;
            assert!(range.contains(&value), "{}: {value} is outside {range:?}", parameter.name);
        }
        let line = text.lines().next().unwrap_or_default();
        if let Err(failure) = board.assignment(line) {
            judge::one_line(&failure, "`");
        }
    });
}

/// The file that `bowden params` writes, and an assignment of its command line.
pub fn parameter_files() -> Vec<Vec<u8>> {
    vec![board().to_toml().into_bytes(), b"limits.current=2.5".to_vec()]
}

/// A ripple table: one that is read is written and read as the same.
pub fn ripple_table(bytes: &[u8]) {
    judge::bounded(bytes, || {
        let text = text(bytes);
        if let Some(sampled) = checked(Sampled::parse(text, "ripple.csv", TAU), "ripple.csv") {
            assert!(sampled.largest_error_nm.is_finite(), "error {} N·m", sampled.largest_error_nm);
            let period_rad = f64::from(sampled.table.head().period_rad);
            let again =
                checked(Sampled::parse(&to_csv(&sampled.table), "again.csv", period_rad), "again.csv");
            let again = again.expect("what is written can be read");
            assert_eq!(again.rows, bowden_link::message::TABLE_POINTS);
        }
    });
}

/// A sampled ripple over one turn.
pub fn ripple_tables() -> Vec<Vec<u8>> {
    let rows = (0..16).map(|row| {
        let angle_rad = TAU * f64::from(row) / 16.0;
        format!("{angle_rad},{}\n", 0.01 * (3.0 * angle_rad).sin())
    });
    let table: String = std::iter::once("angle_rad,torque_nm\n".to_owned()).chain(rows).collect();
    vec![table.into_bytes()]
}
